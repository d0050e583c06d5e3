//! `host stock`: a table for a muscle with few recordings, beside its kin.

use std::path::PathBuf;

use clap::Args;
use pam_data::date;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::{FolderLock, printed, to_standard_output};
use pam_data::recording::Reader;
use pam_fit::table_file::{self, FitQuality, TableFile};
use pam_fleet::fleet::Fleet;
use pam_fleet::partition::folder_name;
use pam_fleet::stock::{StockFit, stock_fit};

use super::recordings::Recordings;
use crate::console::Console;
use crate::documents::{fleet as document, text};

/// Arguments of `host stock`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host stock --muscle new.toml new.csv --kin results -o new.pam\n  \
    host stock --muscle new.toml new/*.csv --kin results --tag type=mini --json\n\n\
    results is the folder that `host batch` wrote for muscles of the same type. The table is that of a typical muscle, moved as far as the \
    recordings show. Its confidence bands contain the variation of the stock.")]
pub struct Arguments {
    /// The muscle's description.
    #[arg(long, value_name = "MUSCLE.toml")]
    muscle: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// The results of a batch with other muscles of this type.
    #[arg(long, value_name = "OUT")]
    kin: PathBuf,
    /// Take only muscles with this tag; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    tag: Vec<String>,
    /// Where to write the table.
    #[arg(short, long, value_name = "TABLE.pam")]
    output: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Reads, fits, writes.
    ///
    /// # Errors
    /// Files that cannot be read or written, a stock that is too small, recordings that cannot be fitted.
    pub fn run(self, console: &Console) -> Result<()> {
        to_standard_output(&[("--json", printed(self.json)), ("-o", self.output.as_deref())])?;
        let muscle = MuscleDescription::read(&self.muscle)?;
        let watched = if self.json { Console::silent() } else { console.clone() };
        let (campaign, hashes) = self.recordings.read_hashed(Reader::of(&muscle), &watched)?;
        let kin = self.kin(&muscle)?;
        let options = pam_fit::Options::default();
        let found = stock_fit(&campaign, &muscle, &kin, &options)?;
        if let Some(path) = &self.output {
            let about = table_file::About {
                muscle: muscle.name.clone(),
                date: date::now_utc(),
                tool: format!("host {}", env!("CARGO_PKG_VERSION")),
                sources: table_file::sources(&campaign, &self.recordings.files, hashes),
                fit: FitQuality { rms_newtons: found.rms, ..found.alone.summary.quality() },
                uncertainty: Some(found.uncertainty.clone()),
                ..table_file::About::default()
            };
            let _lock = FolderLock::of([Some(path.as_path())])?;
            TableFile { table: found.table.clone(), about }.write(path)?;
        }
        let document = to_document(&muscle, &found);
        if self.json {
            console.result(text(&document)?);
        } else {
            console.result(format!(
                "{}: {} rows beside {} kin, P0 {:.1} kPa, blocked force {:.1} N, rms {:.3} N ({:.3} N alone)\n\
                 valid from {:.0} to {:.0} kPa; confidence bands widened by {:.2}",
                muscle.name,
                document.samples,
                found.kin,
                document.deadband_kPa,
                document.blocked_force_N,
                found.rms,
                document.rms_alone_N,
                document.pressure_low_kPa,
                document.pressure_high_kPa,
                found.widened
            ));
        }
        Ok(())
    }

    /// The tables of the stock, without the muscle itself.
    fn kin(&self, muscle: &MuscleDescription) -> Result<Vec<TableFile>> {
        let wanted = self.tag.iter().map(|tag| {
            tag.split_once('=').ok_or_else(|| {
                Error::new(DataCode::CallInvalid, "a tag without `=`")
                    .value(tag)
                    .help("write --tag key=value, such as --tag type=mini")
            })
        });
        let wanted = wanted.collect::<Result<Vec<_>>>()?;
        let fleet = Fleet::read(&self.kin)?;
        let members = fleet.members.iter().filter(|m| {
            m.muscle != muscle.name
                && wanted.iter().all(|(k, v)| m.tags.get(*k).is_some_and(|there| there == v))
        });
        let files = members.map(|m| self.kin.join(folder_name(&m.muscle)).join("table.pam"));
        files.filter(|path| path.exists()).map(TableFile::read).collect()
    }
}

fn to_document<'a>(muscle: &'a MuscleDescription, found: &StockFit) -> document::Stock<'a> {
    let tested = &found.table.tested;
    document::Stock {
        schema: "pam-stock/1",
        muscle: &muscle.name,
        kin: found.kin,
        samples: found.alone.summary.samples,
        deadband_kPa: f64::from(found.table.deadband.pascals()) / 1e3,
        blocked_force_N: f64::from(found.table.blocked_force.newtons()),
        rms_N: found.rms,
        rms_alone_N: found.alone.summary.rms_N,
        bands_widened: found.widened,
        pressure_low_kPa: f64::from(tested.pressure_low.pascals()) / 1e3,
        pressure_high_kPa: f64::from(tested.pressure_high.pascals()) / 1e3,
    }
}
