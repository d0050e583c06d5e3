//! Writes `docs/figures/stability.md`: force control by tables whose numbers are wrong by a fifth.

use std::fmt::Write;
use std::io;
use std::path::Path;

use emulator_tests::misjudged::{self, Corner};
use emulator_tests::sweep::{Law, Load, Profile, Still, Subject};
use model_core::link::messages::Mode;
use virtual_bench::presets;

/// Part by which numbers are wrong.
const OFF: f32 = 0.2;

fn row(text: &mut String, subject: &Subject, corner: &Corner) {
    let other = corner.subject(subject);
    let errors = [Load::Moved, Load::Spring]
        .map(|load| other.error(Mode::Force, load, Profile::Sine(1.0), Law::Trimmed))
        .map(|error| format!("{error:.2}"));
    let Still { error, swing, jump } = other.still(Load::AtStroke, Law::Trimmed);
    let _ = writeln!(
        text,
        "| {} | {} | {:.2} | {} | {error:.2} | {swing:.2} | {:.1} |",
        subject.spec.name,
        corner.name(),
        corner.slope_error,
        errors.join(" | "),
        1e-3 * jump
    );
}

fn main() -> io::Result<()> {
    let mut text = String::from(
        "# Stability with a wrong table\n\nWritten by `cargo run -p emulator-tests --bin stability`. Force control with table and \
         trim. Each curve and number of the fitted table is multiplied by a factor, one after another. The last two rows of each muscle \
         are corners, where all of them are wrong: the one whose slope ∂F/∂P is furthest from that of the muscle, and its opposite. Errors of a sine of \
         1 Hz and of a force that is held, rms in % of blocked force; swing and change of the command as in \
         [tracking.md](tracking.md).\n\nThe slope error is the largest |g* − g|/g, with the slope g of the table and g* of the muscle. It is taken between 30 and 100 % of the highest pressure and up to 34 % \
         of the free stroke. The gain of the trim's loop is \
         K_i (g + (g* − g) H)/s, where H is the response of the pressure to its demand. By the small-gain theorem, the loop is stable for \
         every H with a magnitude of at most 1 if the slope error is below 1. The lead of the regulator's command can raise the magnitude of H \
         somewhat above 1; the largest that was measured is in the section on bandwidth of [tracking.md](tracking.md).\n\n\
         | muscle | table | slope error | moved, % | mass and spring, % | held, % | swing, % | change, kPa |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for spec in [presets::miniature(), presets::contractile(), presets::push()] {
        let subject = Subject::of(spec);
        for corner in misjudged::alone(&subject, OFF).into_iter().chain(misjudged::worst(&subject, OFF)) {
            row(&mut text, &subject, &corner);
        }
    }
    print!("{text}");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/figures");
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("stability.md"), text)
}
