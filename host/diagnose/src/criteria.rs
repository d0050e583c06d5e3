//! Every number that decides, on one page: symbol, unit, value, statistical meaning, source.
//!
//! One file per stage of the diagnosis. Guards against division by zero and steps of numerical derivatives are not criteria; they stand
//! where they are used.
//!
//! Some ideas meet here with several values, on purpose. First, inexactness:
//!
//! | criterion | inexactness of | as a share of |
//! | --- | --- | --- |
//! | `selection::SELECTION_FLOOR` | the base model, below which nothing is selected | blocked force |
//! | `judgement::LACK_OF_FIT` | the base model with everything it admits, for the verdict | blocked force |
//! | `candidates::LAW_ERROR` | a law in its sensitivities, as a penalty of its score | the law's own trace |
//! | `selection::COMPETITOR_FLOOR` | a law, when two are compared by what they leave | the excess error |
//! | `uncertainty::LAW_DEVIATION` | a law in its parameters, for their intervals | the parameter |
//!
//! Others:
//!
//! | idea | criteria and values | why they differ |
//! | --- | --- | --- |
//! | deviations at which outliers are clipped | `reference::LOSS_CLIP` 2, `LAG_SPREADS` 3, `CATALOGUE_CLIP` 4 | a slope loses little precision by Huber's 2; a variance is too small by what is clipped, so it is clipped further out, and furthest of many cells |
//! | highest correlation of neighbours | `reference::LAG_CORRELATION`, `table_health::HEALTH_CORRELATION` 0.99, `reference::CATALOGUE_CORRELATED` 0.97 | of series of hundreds, and of some ten states |
//! | probability of a name that is listed | `reference::CATALOGUE_COMPETITOR` 0.02, `reference::POSSIBLE` 0.05, `selection::CONFUSABLE` 0.1, `selection::REPORTED_COMPETITOR` 0.15 | forty effects share what four changes have; weights within one selection are no probabilities |
//! | prior probability of no change | `reference::PRIOR_NONE`, `timeline::COURSE_PRIOR_NONE` 0.8, `reference::STROKE_PRIOR_NONE` 0.5 | nothing of the spread between campaigns of strokes is learned, so the prior claims nothing |
//! | turn of a pressure or stroke, share of its range | `history::STAIRCASE_TURN` 0.04, `TURN` of the motion 0.05, `COMBINED_TURNED` 0.1, `rows::TURNED_BACK` 0.25 | above the ripple of a regulator, ringing valves, friction that turns slowly, and of the least motion instead of the range |
//! | where an actuator pulls, share of a largest value | `history::PULLS` 0.0125, `stock::ONSET` 0.02, `reference::COMBINED_PULLS` 0.05, `timeline::THRESHOLD_SHARE` 0.1 | a load cell's offset, its zero, a table's fitted range, and a crossing that must be sharp |
//! | half-width of an interval of 95 % | `uncertainty::SIZE_ERRORS`, `RANGE_ERRORS` 1.96 | each decides on its own; both are `pam_data::statistics::NORMAL_95` |
//!
//! `cargo run -p pam-diagnose --example criteria` prints the page, which is a page of the book (`docs/src/criteria.md`); a test of the
//! book compares them. The criteria of the motion stand with it, in `pam-data`.

pub use pam_data::criteria::{Criterion, Source, Stage};
use pam_data::recording::motion;

pub(crate) mod baseline;
pub(crate) mod candidates;
pub(crate) mod filtered_channels;
pub(crate) mod history;
pub(crate) mod judgement;
pub(crate) mod location;
pub(crate) mod noise;
pub(crate) mod planning;
pub(crate) mod reference;
pub(crate) mod rest_friction;
pub(crate) mod rows;
pub(crate) mod selection;
pub(crate) mod stock;
pub(crate) mod table_health;
pub(crate) mod timeline;
pub(crate) mod uncertainty;
pub(crate) mod valve_pulses;

/// Lack of fit of the base model with everything that it admits, share of the blocked force: for those who plan with it.
#[must_use]
pub fn lack_of_fit() -> f64 {
    judgement::LACK_OF_FIT
}

/// The whole page, stage by stage in the order in which they decide.
pub const PAGE: [Stage; 18] = [
    motion::CRITERIA,
    valve_pulses::STAGE,
    rows::STAGE,
    baseline::STAGE,
    filtered_channels::STAGE,
    rest_friction::STAGE,
    noise::STAGE,
    candidates::STAGE,
    selection::STAGE,
    uncertainty::STAGE,
    judgement::STAGE,
    location::STAGE,
    planning::STAGE,
    history::STAGE,
    reference::STAGE,
    timeline::STAGE,
    stock::STAGE,
    table_health::STAGE,
];

/// The page as Markdown tables.
#[must_use]
pub fn markdown() -> String {
    pam_data::criteria::markdown(&PAGE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_criterion_has_a_unique_name_and_a_meaning() {
        let mut names: Vec<&str> = PAGE.iter().flat_map(|s| s.criteria).map(|c| c.name).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all, "a name scales one criterion");
        for c in PAGE.iter().flat_map(|s| s.criteria) {
            assert!(c.meaning.len() > 20 && !c.symbol.is_empty() && !c.unit.is_empty(), "{}", c.name);
        }
        assert_eq!(markdown().lines().filter(|l| l.starts_with("| `")).count(), all);
    }

    #[test]
    fn symbols_are_unique_in_a_stage_and_no_names() {
        for stage in PAGE {
            let mut symbols: Vec<&str> = stage.criteria.iter().map(|c| c.symbol).collect();
            symbols.sort_unstable();
            let twice: Vec<_> = symbols.windows(2).filter(|w| w[0] == w[1]).collect();
            assert!(twice.is_empty(), "{}: {twice:?}", stage.title);
            let named = stage.criteria.iter().find(|c| c.symbol == c.name.to_lowercase());
            assert!(named.is_none(), "{named:?}");
        }
    }

    /// Both decide by an interval of 95 %.
    #[cfg(not(pam_study))]
    #[test]
    fn intervals_have_one_width() {
        for errors in [uncertainty::SIZE_ERRORS, uncertainty::RANGE_ERRORS] {
            assert_eq!(errors, pam_data::statistics::NORMAL_95);
        }
    }

    /// Every source file of the crate outside this page and tests, without its tests.
    fn production() -> Vec<(String, String)> {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut folders = vec![root.clone()];
        let mut files = Vec::new();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
                let path = entry.path();
                if path.is_dir() && !path.ends_with("criteria") && !path.ends_with("tests") {
                    folders.push(path);
                } else if path.extension().is_some_and(|e| e == "rs")
                    && !path.ends_with("criteria.rs")
                    && !path.ends_with("tests.rs")
                {
                    let text = std::fs::read_to_string(&path).expect("a source file");
                    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("").to_owned();
                    let name = path.strip_prefix(&root).expect("below the root").display().to_string();
                    files.push((name, text));
                }
            }
        }
        assert!(files.len() > 100, "{}", files.len());
        files
    }

    /// A number that decides belongs on the page: no other file of the crate declares one, outside tests.
    #[test]
    fn no_other_file_declares_a_criterion() {
        let declares = |line: &&str| {
            let line = line.trim_start().trim_start_matches("pub(crate) ").trim_start_matches("pub(super) ");
            line.starts_with("const ")
                && [": f64 =", ": usize =", ": u32 =", ": [f64;"].iter().any(|t| line.contains(t))
        };
        let stray: Vec<String> = production()
            .iter()
            .flat_map(|(name, text)| text.lines().filter(declares).map(move |l| format!("{name}: {l}")))
            .collect();
        assert_eq!(stray, [""; 0], "move these into criteria");
    }

    /// Literals that decide nothing: the file, or any file, the number, and why.
    const DECIDE_NOTHING: [(&str, f64, &str); 16] = [
        ("", 0.0, "a sign, or the end of a share"),
        ("", 1.0, "the end of a share, a count of one, a direction"),
        ("", 2.0, "two directions, a square, the fewest of anything that varies"),
        ("", 0.5, "the middle"),
        ("", 100.0, "percent"),
        ("", 1e3, "a unit"),
        ("", 1e-6, "guard against division by zero or a logarithm of it"),
        ("", 1e-9, "guard against division by zero"),
        ("", 1e-10, "guard against division by zero"),
        ("", 1e-12, "guard against division by zero"),
        ("", 1e-300, "guard against division by zero"),
        ("history/memory.rs", 1e-4, "below it a series replaces a difference that cancels"),
        ("history/shift_fit.rs", 1e-3, "guard against the logarithm of a pressure of zero"),
        ("next_experiment/menu.rs", 1e-3, "guard against a speed of zero"),
        ("protocol_simulation.rs", 1e-3, "guard against a rate of zero"),
        ("rows/sleeve.rs", 1e-3, "guard against a wall without extent"),
    ];

    /// Where float literals of a line of code begin and end.
    fn floats(code: &str) -> Vec<(usize, usize)> {
        let bytes = code.as_bytes();
        let digit = |i: usize| bytes.get(i).is_some_and(u8::is_ascii_digit);
        let mut found = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let inside = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || b"_.".contains(&bytes[at - 1]));
            if !digit(at) || inside {
                at += 1;
                continue;
            }
            let begin = at;
            let mut float = false;
            while digit(at) || bytes.get(at) == Some(&b'_') {
                at += 1;
            }
            if bytes.get(at) == Some(&b'.') && digit(at + 1) {
                float = true;
                at += 1;
                while digit(at) || bytes.get(at) == Some(&b'_') {
                    at += 1;
                }
            }
            if bytes.get(at) == Some(&b'e') && (digit(at + 1) || bytes.get(at + 1) == Some(&b'-')) {
                float = true;
                at += 2;
                while digit(at) {
                    at += 1;
                }
            }
            if float {
                found.push((begin, at));
            }
        }
        found
    }

    /// The float literals of a line of code that are compared with something or limit it.
    fn deciding(code: &str) -> Vec<f64> {
        let limits: Vec<(usize, usize)> = [".clamp(", ".max(", ".min("]
            .iter()
            .flat_map(|call| code.match_indices(call).map(|(at, call)| at + call.len()))
            .map(|begin| {
                let mut depth = 1;
                let end = code[begin..].find(|c| {
                    depth += i32::from(c == '(') - i32::from(c == ')');
                    depth == 0
                });
                (begin, end.map_or(code.len(), |e| begin + e))
            })
            .collect();
        let decides = |(begin, end): &(usize, usize)| {
            let before = code[..*begin].trim_end_matches('-').trim_end();
            let after = code[*end..].trim_start();
            let compared = [" <", " >", " <=", " >="].iter().any(|c| before.ends_with(c))
                || ["< ", "> ", "<= ", ">= "].iter().any(|c| after.starts_with(c));
            compared || limits.iter().any(|(from, to)| begin >= from && end <= to)
        };
        let value =
            |(begin, end): (usize, usize)| code[begin..end].replace('_', "").parse().unwrap_or(f64::NAN);
        floats(code).into_iter().filter(decides).map(value).collect()
    }

    #[test]
    fn literals_beside_comparisons_and_limits_are_found() {
        assert_eq!(deciding("if a.0.x > 0.3 * high && 1e-5 <= b {"), [0.3, 1e-5]);
        assert_eq!(deciding("(x.1 - 4.0).clamp(-1.1 * f(2.5), 1_0.5) * 7.0"), [1.1, 2.5, 10.5]);
        assert_eq!(deciding("(2..=10).map(|i| 0.25 * values[i].1.0).max(top)"), [0.0; 0]);
    }

    /// Nor does any other file decide by a bare number.
    #[test]
    fn no_other_file_decides_by_a_literal() {
        let allowed = |name: &str, value: f64| {
            DECIDE_NOTHING.iter().any(|(file, v, _)| *v == value && (file.is_empty() || *file == name))
        };
        let mut stray = Vec::new();
        for (name, text) in production() {
            for line in text.lines() {
                let code = line.split("//").next().unwrap_or("");
                if deciding(code).into_iter().any(|value| !allowed(&name, value)) {
                    stray.push(format!("{name}: {}", line.trim()));
                }
            }
        }
        assert_eq!(stray, [""; 0], "move these into criteria");
    }
}
