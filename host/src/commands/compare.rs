//! `host compare`: two recordings, in numbers and in a picture.

use std::path::PathBuf;

use clap::Args;

use super::reports::Reports;
use crate::compare::{Comparison, compare};
use crate::console::Console;
use crate::error::{Code, Error, Result};
use crate::recording::{Reader, Recording};
use crate::report::{Axis, Colour, Figure, Page, Panel, Section, Tone};

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
    #[command(flatten)]
    reports: Reports,
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
                Err(Error::new(Code::RecordingTooShort, "the file holds more than one recording")
                    .file(path)
                    .help(
                        "an import description with a group splits it; compare files of one recording each",
                    ))
            }
        };
        let (a, b) = (one(&self.a)?, one(&self.b)?);
        let found = compare(&a, &b)?;
        self.reports.write(console, || page(&a, &b, &found))?;
        console.result(if self.json { format!("{:#}", found.to_json()) } else { found.to_text() });
        Ok(())
    }
}

/// The pictures: both over time, their difference, and both as loops.
fn page(a: &Recording, b: &Recording, found: &Comparison) -> Page {
    let mut page = Page::new("Two recordings", format!("{} and {}", a.name, b.name));
    for c in &found.columns {
        page.fact(format!("{} of B − A, rms", c.name), format!("{:.4}", c.rms), c.unit, Tone::Plain);
    }
    let names = [format!("A: {}", a.name), format!("B: {}", b.name)];
    let mut over_time = Section::new("Over time");
    over_time
        .text("Both are counted from their own start. B is read at A's times, joined by straight lines.");
    for (column, (title, scale)) in found.columns.iter().filter_map(|c| Some((c, titled(c.name)?))) {
        if let (Some((ta, ya)), Some((tb, yb))) =
            (series(a, column.name, scale), series(b, column.name, scale))
        {
            let both = Panel::new(Axis::new("time after the start", "s"), Axis::new(title, column.unit))
                .line(&names[0], Colour::Series(0), &ta, &ya)
                .line(&names[1], Colour::Series(1), &tb, &yb);
            let reading = "Where the curves part, the recordings differ.";
            over_time.figure(Figure::new(column.name, title, reading, both));
            let difference = Panel::new(
                Axis::new("time after the start", "s"),
                Axis::new("B − A", column.unit),
            )
            .line("B − A", Colour::Series(2), &found.time, &column.difference);
            let reading = format!(
                "The same, subtracted: the largest difference, {:.4} {}, is at {:.3} s.",
                column.largest, column.unit, column.largest_at
            );
            over_time.figure(Figure::new(
                format!("{}-difference", column.name),
                format!("{title}: difference"),
                reading,
                difference,
            ));
        }
    }
    over_time.listing(found.to_text());
    page.push(over_time);
    if let (Some(fa), Some(fb)) = (&a.force, &b.force) {
        let millimetres = |r: &Recording| r.stroke.iter().map(|x| x * 1e3).collect::<Vec<_>>();
        let loops = Panel::new(Axis::new("contraction stroke", "mm"), Axis::new("force F", "N"))
            .line(&names[0], Colour::Series(0), &millimetres(a), fa)
            .line(&names[1], Colour::Series(1), &millimetres(b), fb);
        let mut section = Section::new("Force against stroke");
        section.figure(Figure::new(
            "loops",
            "Force against stroke",
            "A loop's height is friction, its place is pressure and elasticity; a loop that moved as a whole had another \
             pressure or another zero.",
            loops,
        ));
        page.push(section);
    }
    page.origin("recording A", a.name.clone());
    page.origin("recording B", b.name.clone());
    page
}

fn titled(name: &str) -> Option<(&'static str, f64)> {
    match name {
        "force" => Some(("force F", 1.0)),
        "pressure" => Some(("pressure P", 1e-3)),
        "displacement" => Some(("contraction stroke", 1e3)),
        _ => None,
    }
}

fn series(r: &Recording, name: &str, scale: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let values = match name {
        "force" => r.force.as_ref()?,
        "pressure" => &r.pressure,
        _ => &r.stroke,
    };
    let start = r.time.first()?;
    Some((r.time.iter().map(|t| t - start).collect(), values.iter().map(|v| v * scale).collect()))
}
