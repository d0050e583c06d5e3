//! Writes `docs/figures/tracking.md` and its picture: how well force and stroke follow, for each muscle, load and law.

use std::fmt::Write;
use std::io;
use std::path::Path;

use emulator_tests::sweep::{COURSES, Course, LAWS, Law, Load, Subject, in_qemu};
use host::report::{Axis, Colour, Figure, Panel};
use model_core::link::messages::Mode;
use virtual_bench::presets;

const HEAD: &str = "| load | asked | table | table + trim | Gaylord | PI alone | regulator's limit | PI : table + trim |\n\
                    | --- | --- | --- | --- | --- | --- | --- | --- |\n";

fn rows(text: &mut String, subject: &Subject, mode: Mode, load: Load) -> Vec<(f32, [f64; 5])> {
    let mut sines = Vec::new();
    for course in COURSES {
        let errors = LAWS.map(|law| subject.error(mode, load, course, law));
        let limit = subject.limit(mode, load, course);
        let [table, trimmed, gaylord, feedback] = errors;
        let _ = writeln!(
            text,
            "| {} | {} | {table:.2} | {trimmed:.2} | {gaylord:.2} | {feedback:.2} | {limit:.2} | {:.1} |",
            load.name(),
            course.name(),
            feedback / trimmed
        );
        if let Course::Sine(hz) = course {
            sines.push((hz, [table, trimmed, gaylord, feedback, limit]));
        }
    }
    sines
}

fn panel(name: &str, sines: &[(f32, [f64; 5])]) -> Panel {
    let names = ["fitted table", "table and trim", "ideal braid (Gaylord)", "PI alone", "regulator's limit"];
    let x: Vec<f64> = sines.iter().map(|(hz, _)| f64::from(*hz)).collect();
    let axes = (Axis::log("frequency", "Hz"), Axis::log("tracking error, rms", "% of blocked force"));
    names.iter().enumerate().fold(Panel::new(axes.0, axes.1).titled(name), |panel, (at, name)| {
        let y: Vec<f64> = sines.iter().map(|(_, errors)| errors[at]).collect();
        let colour = if at == 4 { Colour::Muted } else { Colour::Series(at) };
        panel.line(*name, colour, &x, &y)
    })
}

fn main() -> io::Result<()> {
    let mut text = String::from(
        "# How well force and stroke follow\n\nWritten by `cargo run --release -p emulator-tests --bin tracking`. True errors, rms, in % \
         of blocked force (force) or of free stroke (stroke), around 40 % of blocked force or 20 % of free stroke by 10 %; tables are \
         fitted by `host` to recordings of the bench, whose physics are others than the model's. The trim and PI alone have the same \
         phase margin, 60°. The limit is what dead time and fastest change of the regulator leave to a controller that knows \
         everything but the future.\n\n![Errors over frequency](tracking.svg)\n",
    );
    let mut panels = Vec::new();
    let subjects = [presets::miniature(), presets::contractile(), presets::push()].map(Subject::of);
    for subject in &subjects {
        let _ = write!(text, "\n## {}: force\n\n{HEAD}", subject.spec.name);
        for load in [Load::Held, Load::Moved, Load::Spring] {
            let sines = rows(&mut text, subject, Mode::Force, load);
            if load == Load::Moved {
                panels.push(panel(&format!("{}, moved at 0.3 Hz", subject.spec.name), &sines));
            }
        }
        let _ = write!(text, "\n## {}: stroke\n\n{HEAD}", subject.spec.name);
        rows(&mut text, subject, Mode::Stroke, Load::Spring);
    }
    text.push_str(
        "\n## A bladder that is not the table's\n\nForce, moved, sine of 1 Hz: the table's moduli by a factor.\n\n\
         | muscle | factor | table | table + trim |\n| --- | --- | --- | --- |\n",
    );
    for subject in &subjects {
        for factor in [0.8, 1.0, 1.2] {
            let other = subject.misjudged(factor);
            let [table, trimmed] = [Law::Table, Law::Trimmed]
                .map(|law| other.error(Mode::Force, Load::Moved, Course::Sine(1.0), law));
            let _ = writeln!(text, "| {} | {factor} | {table:.2} | {trimmed:.2} |", subject.spec.name);
        }
    }
    let mut emulated = String::new();
    for subject in &subjects {
        for law in LAWS {
            let here = subject.error(Mode::Force, Load::Moved, Course::Sine(1.0), law);
            let Ok(there) = in_qemu(subject, Load::Moved, Course::Sine(1.0), law) else { continue };
            let _ = writeln!(emulated, "| {} | {law:?} | {here:.2} | {there:.2} |", subject.spec.name);
        }
    }
    if !emulated.is_empty() {
        text.push_str(
            "\n## The same through the image in QEMU and the link\n\nForce, moved, sine of 1 Hz, judged by the load cell with its \
             noise.\n\n| muscle | law | here | in QEMU |\n| --- | --- | --- | --- |\n",
        );
        text.push_str(&emulated);
    }
    let figure = Figure::multiples(
        "tracking",
        "Tracking error of force over frequency",
        "Lower is better; nothing lies below the regulator's limit for long.",
        panels,
    )
    .shared(true, true);
    print!("{text}");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/figures");
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("tracking.svg"), figure.svg())?;
    std::fs::write(folder.join("tracking.md"), text)
}
