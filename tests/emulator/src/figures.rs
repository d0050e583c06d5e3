//! Figures of the controller: instructions by the image that counts them, memory, precision.

use std::path::Path;
use std::process::{Command, Stdio};

use firmware::reference::Generator;
use model_core::effects::{EffectName, FittedEffect};
use model_core::link::endpoints::EvaluateTable;
use model_core::link::messages::{Evaluate, Mode, Point, Reference, Side};
use model_core::link::settings::FeedForward;
use model_core::muscle::Muscle;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::presets;

use crate::machine::{self, Folder, Machine, Options, Skipped};
use crate::tracking::{self, Stretch, Wanted};
use crate::{fitting, upload};

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

/// What a board's image takes of the chip, bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Size {
    /// The board.
    pub board: &'static str,
    /// Program and constants.
    pub flash: u32,
    /// Static memory, without the stack.
    pub ram: u32,
}

/// Builds the images of both boards and reads their sizes off what the build says.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When an image cannot be built.
pub fn sizes() -> Result<Vec<Size>, Skipped> {
    machine::image()?;
    let build = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/build");
    let size = |board| {
        let output = Command::new(&build).arg(board).output().expect("the build runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let after =
            |word: &str| -> Option<u32> { text.split_once(word)?.1.split_whitespace().next()?.parse().ok() };
        let (flash, ram) = after(": flash ").zip(after(" RAM ")).unwrap_or_else(|| {
            panic!("the build of {board} says {text} {}", String::from_utf8_lossy(&output.stderr))
        });
        Size { board, flash, ram }
    };
    Ok(vec![size("mps2-an386"), size("nucleo-f446re")])
}

/// End of the emulated board's memory, where the stack begins.
const STACK_TOP: u32 = 0x2040_0000;

/// The most of the stack that the image used, bytes: the emulator gives the program memory of zeros, and what is not zero below
/// the stack's beginning has been written. Before it is looked at, two tables with four effects each are uploaded and evaluated,
/// settings changed, a wave of force followed with trim and telemetry, and the table read back.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When the board does not do what it is asked.
pub fn stack() -> Result<u32, Skipped> {
    let folder = Folder::new();
    let bench = BenchSpec::laboratory(presets::miniature(), 7);
    let motion = Motion::Sine { mean_mm: 0.9, amplitude_mm: 0.6, frequency_hz: 0.3 };
    let station = PlantStation::new(bench, vec![motion], 1e-3);
    let options = Options { first: Some(Box::new(station)), debugged: true, ..Options::default() };
    let machine = Machine::start(folder.path(), options)?;
    let mut client = machine.client();
    let mut table = table::example();
    let names = [
        EffectName::LogCreep,
        EffectName::MinorLoopMemory,
        EffectName::PressureLag,
        EffectName::CyclicSoftening,
    ];
    for name in names {
        let small: Vec<f64> = name.info().parameters.iter().map(|p| p.low.max(0.0)).collect();
        table.effects.push(FittedEffect::new(name, &small)).expect("room for four");
    }
    for side in Side::ALL {
        upload(&mut client, side, &table);
        let points = (0..16).map(|n| Point { pressure_pa: 40e3 * n as f32, stroke_m: 1e-3 }).collect();
        client.call::<EvaluateTable>(&Evaluate { side, direction: 1, points }).expect("an evaluation");
    }
    tracking::set(&mut client, tracking::compare(FeedForward::Table, 0.0, 4e3));
    let sine = Reference::Sine { mean: 45.0, amplitude: 20.0, frequency_hz: 2.0 };
    let stretch = Stretch { wanted: Wanted::Wave(sine), ticks: 1000, unjudged: 0 };
    tracking::run(&mut client, Mode::Force, &[stretch]);
    host::device::tables::read(&mut client, Side::Agonist).expect("it reads");
    let mut debugger = machine.debugger();
    let (mut lowest, mut at) = (STACK_TOP, STACK_TOP);
    // Eight kibibytes of zeros in a row were never reached.
    while lowest - at < 8192 {
        at -= 4;
        if debugger.word(at) != 0 {
            lowest = at;
        }
    }
    Ok(STACK_TOP - lowest)
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
         effect's figure is what it adds to a tick on top of the context, which all effects of a table share.\n\n| what | mean | \
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

/// Sizes, stack, precision and the reference's error as Markdown.
pub fn more_markdown(sizes: &[Size], stack: u32, precisions: &[Precision], reference_error: f64) -> String {
    let kib = |bytes: u32| f64::from(bytes) / 1024.0;
    let mut out = String::from(
        "\n## Memory\n\nImages without logs.\n\n| board | flash, KiB | static RAM, KiB |\n| --- | --- | --- |\n",
    );
    for size in sizes {
        out.push_str(&format!("| {} | {:.1} | {:.1} |\n", size.board, kib(size.flash), kib(size.ram)));
    }
    out.push_str(&format!(
        "\nStack used on mps2-an386, interrupts included, after uploads of tables with four effects and a run of force control: \
         {stack} bytes.\n\n## Precision\n\nForce in single precision against double, from no pressure to the highest allowed, a \
         tenth beyond the tested stroke, every direction.\n\n| muscle | points | worst, % of blocked force |\n| --- | --- | --- |\n"
    ));
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
