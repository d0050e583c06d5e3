//! `host diagnose`: what the model leaves out of recordings, where, and how sure that is.

use std::path::PathBuf;

use clap::Args;
use model_core::braid::Geometry;
use model_core::units::{Angle, Length};

use super::reports::Reports;
use crate::console::Console;
use crate::diagnose::{self, Options, summary::summary};
use crate::error::Result;
use crate::muscle_description::MuscleDescription;
use crate::output::write_whole;
use crate::recording::{Import, Reader};
use crate::report::diagnose_page;

/// Arguments of `host diagnose`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host diagnose --muscle mini.toml loops/*.csv\n  \
    host diagnose --muscle mini.toml loops/*.csv --report answer.html")]
pub struct Arguments {
    /// The muscle's description.
    #[arg(long, value_name = "M.toml")]
    muscle: PathBuf,
    /// Recordings of one muscle, in chronological order.
    #[arg(required = true, value_name = "REC")]
    recordings: Vec<PathBuf>,
    /// How to read files that are not in the project's own form.
    #[arg(long, value_name = "I.toml")]
    import: Option<PathBuf>,
    /// Write the answer as JSON; `-` is standard output.
    #[arg(long, value_name = "F")]
    json: Option<PathBuf>,
    #[command(flatten)]
    reports: Reports,
}

impl Arguments {
    /// Does what was asked.
    ///
    /// # Errors
    /// Files that cannot be read or written, recordings without force.
    pub fn run(self, console: &Console) -> Result<()> {
        let muscle = MuscleDescription::read(&self.muscle)?;
        let import = self.import.as_ref().map(Import::read).transpose()?;
        let campaign = Reader::of(&muscle).import(import.as_ref()).campaign(&self.recordings)?;
        for warning in &campaign.warnings {
            console.warning(warning);
        }
        let geometry = Geometry {
            rest_length: Length::from_millimetres(muscle.rest_length_mm),
            braid_angle: Angle::from_degrees(muscle.braid_angle_deg),
            outer_diameter: Length::from_millimetres(muscle.bladder_outer_diameter_mm),
            wall: Length::from_millimetres(muscle.bladder_wall_mm),
            tip_correction: false,
        };
        let answer = diagnose::diagnose(&campaign, &geometry, &Options { muscle: muscle.name.clone() })?;
        if let Some(path) = &self.json {
            write_whole(path, (answer.to_json() + "\n").as_bytes())?;
        }
        self.reports.write(console, || diagnose_page::page(&answer, &geometry))?;
        if self.json.as_deref() != Some(std::path::Path::new("-")) {
            console.result(summary(&answer).trim_end());
        }
        Ok(())
    }
}
