//! Writes `docs/src/closed-loop.md`: what a diagnosis is worth to the controller.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use emulator_tests::diagnosed::{self, Case};

fn row(case: &Case, out: &mut String) -> bool {
    let tables = diagnosed::tables(case);
    let without = diagnosed::table_without(case);
    let Ok(with) = diagnosed::in_emulator(&case.spec, case, &[&tables.plain, &tables.diagnosed]) else {
        return false;
    };
    let Ok(floor) = diagnosed::in_emulator(&case.plain, case, &[&without]) else { return false };
    let named: Vec<String> = tables.named.iter().map(|n| format!("{} ({:.2})", n.0, n.1)).collect();
    // A string takes what is written to it.
    let _ = writeln!(
        out,
        "| {}: {} | {} | {} | {:.3} → {:.3} | {:.2} | {:.2} | {:.2} |",
        case.effect,
        case.words,
        case.plain.name,
        if named.is_empty() { "nothing".into() } else { named.join(", ") },
        tables.rms.0,
        tables.rms.1,
        with[0],
        with[1],
        floor[0]
    );
    true
}

fn main() -> io::Result<()> {
    let mut out = String::from(
        "# What a diagnosis is worth to the controller\n\n\
         Written by `cargo run --release -p emulator-tests --bin diagnosed`; nothing here is typed by hand.\n\n\
         In each row a muscle of the virtual bench conceals an effect. It is recorded by protocol D, fitted plainly and diagnosed \
         (`host diagnose -o`). The controller's image in QEMU then follows a force, a sine of 0.5 Hz and two steps, by feed-forward \
         alone while the bench moves the muscle; what grows during a rest is tried on one force, while the bench rests a second and \
         a half and moves by two hundredths of the free stroke within a second, eight times to and fro: with the plain table, with the diagnosed one, and, for what can be had at best, \
         on the same muscle without the effect with a plain table of its own. Force errors are root mean square by the load \
         cell, in % of blocked force.\n\n\
         | concealed | muscle | named (probability) | error on the recordings, plain → diagnosed, N | control, plain table, % | control, \
         diagnosed table, % | control without the effect, % |\n| --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for case in diagnosed::cases() {
        if !row(&case, &mut out) {
            return Ok(());
        }
    }
    print!("{out}");
    std::fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/closed-loop.md"), out)
}
