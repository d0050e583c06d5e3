//! Writes `docs/src/closed-loop.md`: the effect of a diagnosis on the errors of the controller.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

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
        case.description,
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

fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/closed-loop.md")
}

/// Beginning of the page, and the header of its table.
const INTRODUCTION: &str = "# Diagnosis in closed loop\n\n\
    Written by `cargo run --release -p emulator-tests --bin diagnosed`; nothing here is typed by hand.\n\n\
    In each row a muscle of the virtual bench has a concealed effect. It is recorded by protocol D, fitted without effects (plain \
    table) and diagnosed (`host diagnose -o`, diagnosed table). The controller's image in QEMU then follows a force by feed-forward \
    alone while the bench moves the muscle: a sine of 0.5 Hz and two steps. For an effect that grows during a rest, the force is \
    constant, and the bench makes eight small moves back and forth: a rest of 1.5 s, then two hundredths of the free stroke within a \
    second. Each muscle is controlled with the plain and with the diagnosed table. The last column is the best that can be reached: \
    the same muscle without the effect, with a plain table of its own. Force errors are root mean square by the load cell, in % of \
    blocked force.\n\n\
    | concealed | muscle | named (probability) | error on the recordings, plain → diagnosed, N | control, plain table, % | control, \
    diagnosed table, % | control without the effect, % |\n";

fn main() -> io::Result<()> {
    let mut out = format!("{INTRODUCTION}| --- | --- | --- | --- | --- | --- | --- |\n");
    for case in diagnosed::cases() {
        if !row(&case, &mut out) {
            return Ok(());
        }
    }
    print!("{out}");
    std::fs::write(page(), out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_in_the_book_has_this_introduction() {
        let written = std::fs::read_to_string(page()).expect("the page");
        assert!(written.starts_with(INTRODUCTION), "{INTRODUCTION}");
    }
}
