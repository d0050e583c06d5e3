//! The texts of the page.

/// Header of the tables of changes.
pub(super) const TABLE_HEADER: &str = "| | n | class right | exact | in the set | names in the set | size within 20 % | in the stated 95 % | missed (\"none\") | a name of a false class |\n\
                    | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";

/// Beginning of the page.
pub(super) const INTRODUCTION: &str = "# Trials of changes\n\n`host diagnose AFTER… --reference BEFORE…` is tested on real recordings: changes that were added to \
    them, pairs without a change, and a cylinder whose seal was replaced. Nothing on this page is typed by hand:\n\n\
    ```text\ncargo run --release -p trials -- reference -o DIR --page docs/src/proof-reference.md\n```\n\n";

/// The bounds as they were set.
pub(super) const BOUNDS: &str = "Bounds set in advance, at 3 %: class right in 85 %, exact in 75 %, truth in the set in 95 %, size within 20 % in 90 %; \
    unchanged pairs named in 2 % at most; pairs of seals: main class in 80 %, no rerun named; 60,000 rows in 5 s on two cores.\n\n";

/// The section on added changes.
pub(super) const INJECTED: &str = "## Changes added to later runs\n\nIn each muscle, the runs from some number on get one change, with a sign by hash; the \
    earlier runs are unchanged. All splits with at least two runs on each side (2021), and both splits of three runs (2022, one run on one \
    side). \"Class\", \"exact\": the most probable cause. Sizes: of those named exactly. Rates with exact 95 % intervals.\n";

/// The section on pairs without a change, and the header of its table.
pub(super) const UNCHANGED: &str = "## Unchanged pairs\n\nEvery contiguous window of runs, split once. Windows of one muscle share runs: errors are \
    clustered, so the intervals are too narrow. \"Change probable\": probability of no change below one half.\n\n\
    | | pairs | named | change probable |\n";

/// The section on a simpler method, and the header of its table.
pub(super) const COMPARISON: &str = "## Comparison with a simpler method\n\nThe simpler method names the one effect whose least squares lower the BIC most, \
    by more than ten. It uses differences of mean force by mounting, direction and bin of pressure, with cells taken as independent, and the \
    same slopes by which the changes were added. The last columns count pairs that only one of the methods gets right (McNemar's test).\n\n\
    | | n | class right, diagnosis | class right, largest ΔBIC | only the diagnosis | only ΔBIC |\n";

/// The section on a table as the only reference.
pub(super) const TABLES: &str = "## Earlier table as the only reference\n\nThe table is fitted to the first half of the runs (dimensions and mounted lengths, too) \
    and is the only reference of the later ones. The error of the table counts as part of the repeatability; its size is estimated from \
    the later runs. The later runs count as mounted again (± 1 mm), which hides offsets of the stroke, gains and compliance of that size. \
    The form of this error was chosen with both halves known, its constants on the development half: these windows are not an independent \
    test.\n\n";

/// The section on the cylinder, and the header of its table.
pub(super) const CYLINDER: &str = "## Cylinder with another seal\n\nOne rig, another seal or bore: another seal has other friction, the larger bore a larger gain. \
    Main class: gain where the bore differs, otherwise friction.\n\n| | pairs | |\n";

/// The last section.
pub(super) const UNTESTED: &str = "\n## Not tested\n\n\
    - Several campaigns in the reference of strokes. Two simultaneous changes and the time of a change have a [page of their \
    own](proof-reference-further.md).\n\
    - A leak of a muscle that its valve supplies is not identifiable from force over measured pressure; strokes of a described muscle name it \
    only within the class of gains. The leaks of this page were added to the recordings; no pair with a real one is known.\n\
    - These pairs were seen while changes within AFTER, pairs of changes, and lags beside other changes were developed: no figure here is of \
    new muscles.\n\
    - A change that begins within AFTER and shows in one of its recordings alone is not judged on a held-out one.\n\
    - Lengths between those of the reference are interpolated from three lengths on; tested on synthetic staircases only (`cargo test -p \
    pam-diagnose interpolated`).\n\
    - Length and pressure that move together, and a controller at work: tested on an emulated one only (`cargo test -p host --test change_watch`).\n\
    - Stroked muscles with a description: tested on [simulated pairs](proof-reference-bench.md), not on real ones.\n\
    - All staircases are of one laboratory and one type of muscle, and the constants of the repeatability come from six of the eleven. A second rig is \
    missing.\n\
    - Added drift and slip run through AFTER by run, then mounting. Lags of the 12 Hz recordings are added by the same interpolation that the analysis \
    assumes.\n\
    - Another mounting (± 1 mm) is modelled but not tested here; it hides stroke offsets and compliance of that size.\n\
    - The prior of the cylinder was changed once after a first look at these pairs (friction repeats to a share of friction): they are not an \
    independent test.\n\
    - Other methods were run on a share of these pairs: [table](proof-reference-others.md).\n";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_in_the_book_has_these_texts() {
        let texts =
            [INTRODUCTION, BOUNDS, INJECTED, UNCHANGED, COMPARISON, TABLES, TABLE_HEADER, CYLINDER, UNTESTED];
        crate::book::contains("proof-reference.md", &texts);
    }
}
