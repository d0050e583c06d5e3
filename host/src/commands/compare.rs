//! `host compare`: two recordings, in numbers and in a picture.

use std::path::PathBuf;

use clap::Args;

use crate::compare::compare;
use crate::console::Console;
use crate::error::{Code, Error, Result};
use crate::output::write_whole;
use crate::recording::{Reader, Recording};
use crate::report::{Axis, Colour, Figure, Page, Panel, Section};

/// Arguments of `host compare`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host compare before.csv after.csv\n  host compare a.csv b.csv --report difference.html --json"
)]
pub struct Arguments {
    /// The first recording.
    #[arg(value_name = "A.csv")]
    a: PathBuf,
    /// The second recording.
    #[arg(value_name = "B.csv")]
    b: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write a page with pictures.
    #[arg(long, value_name = "F.html")]
    report: Option<PathBuf>,
}

impl Arguments {
    /// Reads both, compares, writes.
    ///
    /// # Errors
    /// Files that cannot be read or written, recordings without a common stretch.
    pub fn run(self, console: &Console) -> Result<()> {
        let one = |path: &PathBuf| {
            let mut all = Reader::new().file(path)?;
            if all.len() == 1 {
                Ok(all.remove(0))
            } else {
                Err(Error::new(Code::RecordingTooShort, "the file holds more than one recording").file(path))
            }
        };
        let (a, b) = (one(&self.a)?, one(&self.b)?);
        let found = compare(&a, &b)?;
        if let Some(path) = &self.report {
            let mut page = Page::new("Two recordings", format!("{} and {}", a.name, b.name));
            let mut section = Section::new("Over time");
            for (id, title, unit, scale) in [
                ("force", "force F", "N", 1.0),
                ("pressure", "pressure P", "kPa", 1e-3),
                ("stroke", "contraction stroke", "mm", 1e3),
            ] {
                if let (Some((ta, ya)), Some((tb, yb))) = (column(&a, id, scale), column(&b, id, scale)) {
                    let panel = Panel::new(Axis::new("time after the start", "s"), Axis::new(title, unit))
                        .line(format!("A: {}", a.name), Colour::Series(0), &ta, &ya)
                        .line(format!("B: {}", b.name), Colour::Series(1), &tb, &yb);
                    section.figure(Figure::new(
                        id,
                        title,
                        "Where the curves part, the recordings differ.",
                        panel,
                    ));
                }
            }
            section.listing(found.to_text());
            page.push(section);
            write_whole(path, page.html().as_bytes())?;
        }
        console.result(if self.json { format!("{:#}", found.to_json()) } else { found.to_text() });
        Ok(())
    }
}

fn column(r: &Recording, id: &str, scale: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let values = match id {
        "force" => r.force.as_ref()?,
        "pressure" => &r.pressure,
        _ => &r.stroke,
    };
    let start = r.time.first()?;
    Some((r.time.iter().map(|t| t - start).collect(), values.iter().map(|v| v * scale).collect()))
}
