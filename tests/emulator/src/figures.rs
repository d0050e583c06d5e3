//! Figures of the controller: instructions by the image that counts them, memory, precision.

use std::process::{Command, Stdio};

use firmware::reference::Generator;
use model_core::link::messages::Reference;
use model_core::muscle::Muscle;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};
use virtual_bench::presets;

use crate::fitting;
use crate::machine::{self, Skipped};

pub mod memory;

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
    let image = machine::instruction_counts_image()?;
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

/// How far the force in single precision is from that in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Precision {
    /// The muscle.
    pub name: String,
    /// Points compared: pressures up to the highest allowed, strokes a tenth beyond the tested, three directions.
    pub points: u32,
    /// The largest difference, % of blocked force.
    pub worst_percent: f64,
}

/// Compares over a grid.
///
/// # Panics
/// For a table that cannot be used.
pub fn precision(name: &str, table: &MuscleTable) -> Precision {
    let single = Muscle::<f32>::build(table).expect("a valid table");
    let double = Muscle::<f64>::build(table).expect("a valid table");
    let reach = 1.1 * table.tested.contraction_high * table.geometry.rest_length.metres();
    let blocked = f64::from(table.blocked_force.newtons()).abs();
    let (mut points, mut worst) = (0, 0.0_f64);
    for p in 0..=150 {
        let pressure = Pressure::from_pascals(table.max_pressure.pascals() * p as f32 / 150.0);
        for x in 0..=150 {
            let stroke = Length::from_metres(reach * x as f32 / 150.0);
            for s in [-1.0_f32, 0.0, 1.0] {
                let near = f64::from(single.force(pressure, stroke, s).newtons());
                let true_n = double.force(pressure.cast(), stroke.cast(), f64::from(s)).newtons();
                worst = worst.max((near - true_n).abs() / blocked * 100.0);
                points += 1;
            }
        }
    }
    Precision { name: name.to_owned(), points, worst_percent: worst }
}

/// The same for the bench's three muscles, by the tables fitted to them, and the example.
pub fn precisions() -> Vec<Precision> {
    let bench = [presets::miniature(), presets::contractile(), presets::push()];
    let mut all: Vec<Precision> =
        bench.iter().map(|spec| precision(&spec.name, &fitting::fitted(spec))).collect();
    all.push(precision("example", &table::example()));
    all
}

/// The largest error of the reference generator's sine (micromath's), as a part of its amplitude, over ten seconds at 1 kHz.
///
/// # Panics
/// When the generator refuses a sine.
pub fn reference_error() -> f64 {
    let mut generator = Generator::default();
    let hz = 3.77;
    let sine = Reference::Sine { mean: 0.0, amplitude: 1.0, frequency_hz: hz };
    generator.begin(sine).expect("a sine");
    let exact = |tick: u32| (std::f64::consts::TAU * f64::from(hz) * f64::from(tick) * 1e-3).sin();
    (0..10_000)
        .filter_map(|tick| Some((f64::from(generator.step_ahead(0)?.0) - exact(tick)).abs()))
        .fold(0.0, f64::max)
}

/// The instruction counts as a Markdown table.
pub fn markdown(figures: &[Figure]) -> String {
    let mut out = String::from(
        "# Figures of the controller\n\nWritten by `cargo run -p emulator-tests --bin figures`.\n\n## Instructions\n\nOn the \
         emulated Cortex-M4F (QEMU, `-icount shift=0`); table of six pressures and order 4. The inverse starts 5 kPa away. An \
         effect's figure is what it adds to a tick on top of the context, which all effects of a table share. `health-of-step` is the \
         part of the step that compares the load cell with the table: the difference from a step whose samples are not compared, in the \
         mean and in the worst tick, and the countdown to a sample.\n\n| what | mean | \
         worst | points |\n| --- | --- | --- | --- |\n",
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

/// Precision and the reference's error as Markdown.
pub fn precision_markdown(precisions: &[Precision], reference_error: f64) -> String {
    let mut out = String::from(
        "\n## Precision\n\nForce in single precision against double, from no pressure to the highest allowed, a tenth beyond the \
         tested stroke, every direction.\n\n| muscle | points | worst, % of blocked force |\n| --- | --- | --- |\n",
    );
    for one in precisions {
        out.push_str(&format!("| {} | {} | {:.5} |\n", one.name, one.points, one.worst_percent));
    }
    out.push_str(&format!(
        "\nSine of the reference generator (micromath): off by at most {:.3} % of its amplitude. The force path uses the hardware \
         square root and no other approximation.\n",
        100.0 * reference_error
    ));
    out
}
