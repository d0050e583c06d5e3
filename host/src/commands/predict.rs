//! `host predict`: a table's force on recordings.

use std::path::{Path, PathBuf};

use super::recordings::Recordings;
use crate::console::Console;
use crate::documents::{predict as document, text};
use clap::Args;
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::{to_standard_output, write_whole};
use pam_data::pluralise::pluralise;
use pam_data::recording::Reader;
use pam_fit::predict::{predict_with_bands, to_csv};
use pam_fit::table_file::TableFile;

/// Arguments of `host predict`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host predict --table mini.pam new.csv -o predicted.csv\n  \
    host predict --table mini.pam first.csv second.csv --json scores.json\n\n\
    The column force_model_band_N is the half-width of the 95 % confidence interval of the table's force (of its base model, \
    where it has effects). Single readings scatter more.\n\n\
    Several recordings are one history: effects with a memory continue from one to the next. The output is one table; with \
    several recordings its first column is `file`; a column of that name in them becomes `file_in_recording`. Columns of an \
    earlier prediction are replaced.")]
pub struct Arguments {
    /// The table.
    #[arg(long, value_name = "TABLE.pam")]
    table: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// Write the recordings with a column `force_model_N` added; `-` is standard output.
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Write the scores as JSON to a file; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Arguments {
    /// Reads, computes, writes.
    ///
    /// # Errors
    /// What is wrong with the input, or an output that cannot be written.
    pub fn run(self, console: &Console) -> Result<()> {
        to_standard_output(&[("-o", self.output.as_deref()), ("--json", self.json.as_deref())])?;
        if let Some(path) = &self.output
            && self.recordings.files.iter().any(|f| same_file(f, path))
        {
            return Err(Error::new(
                DataCode::CallInvalid,
                "the output would overwrite a recording that is read",
            )
            .file(path)
            .help("name another file behind -o"));
        }
        let table = TableFile::read(&self.table)?;
        let rest_length = f64::from(table.table.geometry.rest_length.metres());
        let mut reader = Reader::with_rest_length(rest_length);
        reader.muscle_name = Some(&table.about.muscle);
        // With JSON the caller is a program.
        let watched = if self.json.is_some() { Console::silent() } else { console.clone() };
        let campaign = self.recordings.read_watched(reader, &watched)?;
        for warning in &campaign.warnings {
            console.warning(warning);
        }
        let prediction = predict_with_bands(&table, &campaign).map_err(|e| e.file(&self.table))?;
        for warning in &prediction.warnings {
            console.warning(warning);
        }
        if let Some(path) = &self.output {
            let imported = self.recordings.import.is_some();
            let (csv, whole) = to_csv(&campaign, &prediction, imported);
            if !whole && !imported {
                console.warning(
                    "the output has the columns of time, pressure, displacement and force only: others are kept where all files are CSV files \
                     with the same header and decimal points",
                );
            }
            write_whole(path, &csv)?;
        }
        if let Some(path) = &self.json {
            let recordings: Vec<_> = campaign
                .recordings
                .iter()
                .zip(&prediction.recordings)
                .map(|(r, p)| document::Recording {
                    band_N: p.bands.as_ref().map(|b| b.mean),
                    file: r.name.clone(),
                    inside_pct: p.bands.as_ref().map(|b| b.inside.map(|share| 100.0 * share)),
                    rms_N: p.rms,
                    samples: r.len(),
                    scored: p.scored,
                })
                .collect();
            let document = document::Predict { recordings, rms_N: prediction.rms, schema: "pam-predict/1" };
            write_whole(path, (text(&document)? + "\n").as_bytes())?;
        }
        for (recording, p) in campaign.recordings.iter().zip(&prediction.recordings) {
            let unscored = if recording.force.is_some() { "not scored" } else { "no force column" };
            let rms = p.rms.map_or(unscored.to_owned(), |r| format!("rms {r:.3} N"));
            let band = p.bands.as_ref().map_or(String::new(), |bands| {
                let inside = bands.inside.filter(|_| p.rms.is_some()).map_or(String::new(), |share| {
                    format!(", {:.1} % of the readings inside their prediction interval", 100.0 * share)
                });
                format!(", model force ± {:.3} N (95 %){inside}", bands.mean)
            });
            let limit = match p.at_limit {
                0 => String::new(),
                n => format!("; not scored: {} at the end of the force sensor's range", pluralise(n, "row")),
            };
            console.note(format!(
                "{}: {}, {rms}{band}{limit}",
                recording.name,
                pluralise(recording.len(), "row")
            ));
        }
        if self.output.is_none() && self.json.is_none() {
            console.detail("nothing written: use -o or --json");
        }
        Ok(())
    }
}

/// Whether two paths lead to one file that is there.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
