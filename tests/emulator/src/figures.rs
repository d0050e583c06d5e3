//! Figures of the emulated Cortex-M4F: instructions of each function, by the image that counts them.

use std::process::{Command, Stdio};

use crate::machine::{self, Skipped};

/// A line of the image's report.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What was counted.
    pub name: String,
    /// Mean of the sweep, instructions (bytes for `table-image`).
    pub mean: f64,
    /// The worst point.
    pub worst: f64,
    /// Points of the sweep.
    pub points: u32,
}

/// Runs the counting image.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When the image cannot be built, or does not come to its end.
pub fn count() -> Result<Vec<Figure>, Skipped> {
    let image = machine::figures_image()?;
    let output = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "null"])
        .args(["-semihosting-config", "enable=on,target=native", "-icount", "shift=0", "-kernel"])
        .arg(image)
        .stdin(Stdio::null())
        .output()
        .expect("QEMU starts");
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    let figures: Vec<Figure> = text
        .lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            let name = words.next()?.to_owned();
            let mut number = || words.next()?.parse::<f64>().ok();
            Some(Figure { name, mean: number()?, worst: number()?, points: number()? as u32 })
        })
        .collect();
    assert!(figures.last().is_some_and(|last| last.name == "end"), "the counting image says:\n{text}");
    Ok(figures.into_iter().filter(|figure| figure.name != "end").collect())
}

/// The figures as a Markdown table.
pub fn markdown(figures: &[Figure]) -> String {
    let mut out = String::from(
        "# Figures of the emulated Cortex-M4F\n\nWritten by `cargo run -p emulator-tests --bin figures`; instructions, QEMU \
         `-icount shift=0`, table of six pressures and order 4. An effect's figure is what it adds to a tick, the context that \
         every effect needs included.\n\n| what | mean | worst | points |\n| --- | --- | --- | --- |\n",
    );
    for figure in figures {
        let unit = if figure.name == "table-image" { " bytes" } else { "" };
        out.push_str(&format!(
            "| {} | {:.0}{unit} | {:.0}{unit} | {} |\n",
            figure.name, figure.mean, figure.worst, figure.points
        ));
    }
    out
}
