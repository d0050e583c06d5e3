//! Writes `docs/figures/tracking.md` and its picture: how well force and stroke follow, for each muscle, load and law.

use std::fmt::Write;
use std::io;
use std::path::Path;

use emulator_tests::bandwidth::Bandwidth;
use emulator_tests::sweep::{COURSES, Course, LAWS, Law, Load, Still, Subject, in_qemu};
use model_core::link::messages::Mode;
use pam_report::{Axis, Colour, Figure, Panel};
use virtual_bench::presets;

const HEAD: &str = "| load | asked | table | table + trim | Gaylord | PI alone | regulator's limit | PI : table + trim |\n\
                    | --- | --- | --- | --- | --- | --- | --- | --- |\n";

/// What was queried, and the error of each law and the regulator's limit.
type Row = (Course, [f64; 5]);

fn rows(text: &mut String, subject: &Subject, mode: Mode, load: Load) -> Vec<Row> {
    let mut rows = Vec::new();
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
        rows.push((course, [table, trimmed, gaylord, feedback, limit]));
    }
    rows
}

/// The largest errors of the table and of table and trim where the regulator can follow, and how many times as large that of PI alone is at 1 Hz.
fn against_the_aim(rows: &[Row]) -> [f64; 4] {
    let can_follow = |course: Course| match course {
        Course::Steps => false,
        Course::Ramps => true,
        Course::Sine(hz) => hz <= 2.0,
    };
    let largest = |law: usize| {
        rows.iter()
            .filter(|(course, _)| can_follow(*course))
            .map(|(_, errors)| errors[law])
            .fold(0.0, f64::max)
    };
    let ratio = |law: usize| {
        let at = rows.iter().find(|(course, _)| *course == Course::Sine(1.0));
        at.map_or(f64::NAN, |(_, errors)| errors[3] / errors[law])
    };
    [largest(0), largest(1), ratio(0), ratio(1)]
}

fn panel(name: &str, rows: &[Row]) -> Panel {
    let sines: Vec<(f32, [f64; 5])> = rows
        .iter()
        .filter_map(|(course, errors)| match course {
            Course::Sine(hz) => Some((*hz, *errors)),
            Course::Steps | Course::Ramps => None,
        })
        .collect();
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
         fitted by `host` to recordings of the bench, whose physics are others than the model's. Lag, line and rate of the regulator are \
         those that `host device identify` finds in steps of the same bench; all laws get them. The trim and PI alone have the same \
         phase margin, 60°, at the stroke of the case: PI with its zero on the regulator's lag, so that line and tick are left to it; the \
         trim with lag and line inverted, so that smoothing and tick are left. Waves are the device's own, which it knows ahead. The \
         limit is what ripple, wander and fastest change of the regulator leave to a controller that begins when it is asked.\n\n\
         ![Errors over frequency](tracking.svg)\n",
    );
    let mut panels = Vec::new();
    let mut aims = String::new();
    let subjects = [presets::miniature(), presets::contractile(), presets::push()].map(Subject::of);
    for subject in &subjects {
        let _ = write!(text, "\n## {}: force\n\n{HEAD}", subject.spec.name);
        for load in [Load::AtStroke, Load::Moved, Load::Spring] {
            let rows = rows(&mut text, subject, Mode::Force, load);
            let [table, trimmed, times, times_trimmed] = against_the_aim(&rows);
            let _ = writeln!(
                aims,
                "| {} | {} | {table:.2} | {trimmed:.2} | {times:.1} | {times_trimmed:.1} |",
                subject.spec.name,
                load.name()
            );
            if load == Load::Moved {
                panels.push(panel(&format!("{}, moved at 0.3 Hz", subject.spec.name), &rows));
            }
        }
        let _ = write!(text, "\n## {}: stroke\n\n{HEAD}", subject.spec.name);
        rows(&mut text, subject, Mode::Stroke, Load::Spring);
    }
    let _ = write!(
        text,
        "\n## Against the aim\n\nForce, under 1 % where the regulator can follow: the largest of ramps and sines up to 2 Hz. Five times better \
         than PI alone at 1 Hz.\n\n\
         | muscle | load | table: largest error, % | table + trim, % | PI : table at 1 Hz | PI : table + trim |\n\
         | --- | --- | --- | --- | --- | --- |\n{aims}"
    );
    text.push_str(
        "\n## A force that stays the same\n\nFive seconds from 1.5 s after a step on. Swing is what of the error goes to and fro about its \
         own mean; the command's change from tick to tick is rms. With nothing but sensor noise in it, that change is what the lead makes of the noise.\n\n\
         | muscle | load | table: error, % | swing, % | change, kPa | table + trim: error, % | swing, % | change, kPa |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for subject in &subjects {
        for load in [Load::AtStroke, Load::Moved, Load::Spring] {
            let [table, trimmed] = [Law::Table, Law::Trimmed].map(|law| {
                let Still { error, swing, jump } = subject.still(load, law);
                format!("{error:.2} | {swing:.2} | {:.1}", 1e-3 * jump)
            });
            let _ = writeln!(text, "| {} | {} | {table} | {trimmed} |", subject.spec.name, load.name());
        }
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
    text.push_str(
        "\n## The regulator as it was identified\n\n| muscle | lag, ms | line at rest length, ms | rate, MPa/s | PI's crossover, rad/s |\n\
         | --- | --- | --- | --- | --- |\n",
    );
    for subject in &subjects {
        let found = &subject.regulator;
        let _ = writeln!(
            text,
            "| {} | {:.1} | {:.1} | {:.2} | {:.0} |",
            subject.spec.name,
            found.lag_s * 1e3,
            found.line_s * 1e3,
            found.rate_pa_per_s * 1e-6,
            subject.crossover(Load::Moved)
        );
    }
    text.push_str(
        "\n## Set-points of a host\n\nForce, moved, sine of 1 Hz, sent tick by tick: the device does not know what comes.\n\n\
         | muscle | table | table + trim | PI alone | PI : table + trim |\n| --- | --- | --- | --- | --- |\n",
    );
    for subject in &subjects {
        let [table, trimmed, feedback] = [Law::Table, Law::Trimmed, Law::Feedback]
            .map(|law| subject.streamed_error(Load::Moved, 1.0, law));
        let ratio = feedback / trimmed;
        let _ = writeln!(
            text,
            "| {} | {table:.2} | {trimmed:.2} | {feedback:.2} | {ratio:.1} |",
            subject.spec.name
        );
    }
    text.push_str(
        "\n## Bandwidth\n\nForce at held length, a sine of 2 % of blocked force about 40 %: the frequency at which the true force's \
         amplitude is 1/√2 of what is asked for, and the largest amplitude below it as a part of that. Sent tick by tick by a host. So small a wave is \
         mostly friction; what of it comes through enlarged is friction's compensation, which goes over with the measured pressure and \
         is late near the end of the band.\n\n\
         | muscle | table, Hz | largest | table + trim, Hz | largest | PI alone, Hz | largest |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for subject in &subjects {
        let _ = write!(text, "| {} |", subject.spec.name);
        for law in [Law::Table, Law::Trimmed, Law::Feedback] {
            let Bandwidth { hz, peak } = subject.bandwidth(law);
            let _ = write!(text, " {hz:.0} | {peak:.2} |");
        }
        text.push('\n');
    }
    let mut emulated = String::new();
    for subject in &subjects {
        for (mode, load) in [(Mode::Force, Load::Moved), (Mode::Stroke, Load::Spring)] {
            for course in [Course::Steps, Course::Ramps, Course::Sine(1.0)] {
                let here = subject.error(mode, load, course, Law::Trimmed);
                let Ok(there) = in_qemu(subject, mode, load, course, Law::Trimmed) else { continue };
                let what = if mode == Mode::Stroke { "stroke" } else { "force" };
                let _ = writeln!(
                    emulated,
                    "| {} | {what} | {} | {} | {here:.2} | {there:.2} |",
                    subject.spec.name,
                    load.name(),
                    course.name()
                );
            }
        }
    }
    if !emulated.is_empty() {
        text.push_str(
            "\n## The same through the image in QEMU and the link\n\nTable and trim, over half as many periods, judged by the device's own \
             sensors with their noise.\n\n| muscle | what | load | asked | here | in QEMU |\n| --- | --- | --- | --- | --- | --- |\n",
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
