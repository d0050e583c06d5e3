//! The report of a sealed set as a page of the book.

use crate::ledger;
use std::error::Error;
use std::path::Path;

/// What the trials are, how they were made, and what the figures mean.
const INTRODUCTION: &str = "# Sealed trials\n\n\
    A sealed trial tests the diagnosis on simulated recordings with hidden effects. The simulated muscles belong to a bench that shares no \
    equation with the model. Each muscle has one effect of the catalogue, several, none, or something that is not in the catalogue. \
    The truths are sealed by their hashes before the tool runs, and the answers are frozen by theirs before a seal is opened. The seed of \
    the final set comes from the operating system. In half of the trials the noise is resampled from residuals of real recordings, where \
    these are available.\n\n\
    Protocol A is the classic one: ascending levels, one slow speed. Protocol D is extended: shuffled levels, one of them twice, three \
    speeds, dwells, nested loops, tares. Protocol C is complete: more of each, tares between levels, half an hour of rest, checks of the \
    bench. `tests/trials/README.md` and `host/virtual-bench/src/campaigns.rs` describe them in full. These commands wrote this page; \
    nothing on it is typed by hand:\n\n\
    ```text\n\
    cargo run --release -p trials -- prove -o DIR\n\
    cargo run --release -p trials -- oracle DIR\n\
    cargo run --release -p trials -- again DIR\n\
    python3 tests/trials/baselines.py DIR --development DEV --training TRAINING\n\
    cargo run --release -p trials -- score DIR --page docs/src/proof.md\n\
    ```\n\n\
    The bounds were set before the seed was drawn; a missed bound is reported as missed. Rates have exact 95 % intervals. An effect counts \
    as visible if a base model with one bladder for all pressures leaves half a noise deviation of it; otherwise no name is the right \
    answer.\n\n\
    Held-out gain is (plain − diagnosed)/(plain − oracle), with rms errors on recordings at other pressures and speeds. The oracle is the \
    true structure refitted: the same tool is given the hidden effects (`host diagnose --with`) after the answers were frozen. The gain is \
    taken over visible effects of the muscle for which the oracle removes a tenth of the plain error or more. A stricter figure uses, \
    instead of the oracle, a plain table of the same muscle without the effect; this table is complete, and no refit can be better. The \
    oracle's own share of this stricter gain is given too.\n";

/// The same for a set without effects.
const WITHOUT_EFFECTS: &str = "# Sealed trials without effects\n\n\
    A diagnosis must name nothing where nothing is missing. These trials are made, sealed, answered and opened like the \
    [sealed trials](proof.md), but no muscle has an effect. In the nasty half the data are bad or the rubber is strongly curved. These \
    commands wrote this page; nothing on it is typed by hand:\n\n\
    ```text\n\
    cargo run --release -p trials -- prove --set nulls --n 300 -o DIR\n\
    cargo run --release -p trials -- score DIR --page docs/src/proof-nulls.md\n\
    ```\n\n\
    Rates have exact 95 % intervals: of 60 trials without a false alarm the true rate may still be 6 %, of 300 it is at most 1.2 %.\n";

/// Writes the page of a scored set.
pub fn write(set: &Path, page: &Path) -> Result<(), Box<dyn Error>> {
    let ledger = ledger::read_ledger(set)?;
    let report = std::fs::read_to_string(set.join("report.md"))?;
    let body = report.split_once('\n').map_or("", |(_, rest)| rest).replace("\n## ", "\n### ");
    let title = report.lines().next().unwrap_or("").trim_start_matches("# ");
    let introduction = if ledger.set == "nulls" { WITHOUT_EFFECTS } else { INTRODUCTION };
    let text = format!(
        "{introduction}\n\
         ## {title}\n\nSHA-256 of the seed: `{}`. The set's `ledger.json` contains the hashes of all truths and answers (SHA-256 of \
         that file: `{}`).\n{body}",
        ledger.seed_sha256,
        ledger::sha256(&std::fs::read(set.join("ledger.json"))?),
    );
    std::fs::write(page, text)?;
    println!("{}", page.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::book;

    #[test]
    fn the_pages_in_the_book_have_these_introductions() {
        book::contains("proof.md", &[INTRODUCTION]);
        book::contains("proof-nulls.md", &[WITHOUT_EFFECTS]);
    }
}
