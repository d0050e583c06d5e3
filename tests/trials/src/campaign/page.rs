//! The results as a page of the book.

use super::{BENCH_S, BOUNDS, Method, SEED, Said, Trial};
use crate::rate::Rate;
use std::fmt::Write as _;

/// Beginning of the page.
const INTRODUCTION: &str = "# Trials of automatic campaigns\n\nThis command wrote this page; nothing on it is typed by hand:\n\n\
    ```text\ncargo run --release -p trials -- campaign -o DIR --page docs/src/proof-campaign.md\n```\n\n";

/// The section on the diagnosis.
const DIAGNOSIS: &str = "## Diagnosis\n\n\"Only the right name\": at least one effect is named, every name is without competitors, and every \
    name is a hidden effect; of two hidden effects one may be missing.\n\n";

/// The header of its table; the third column counts resolved campaigns.
const COLUMNS: &str = "| method | muscles | only the right name | class right | truth in the set, where a name is given | nothing named | false alarms |\n\
    | --- | --- | --- | --- | --- | --- | --- |\n";

/// The page; `drawn` is the number of muscles in the whole set.
pub fn page(all: &[Trial], drawn: usize) -> String {
    let mut m = format!(
        "{INTRODUCTION}The muscles of the virtual bench have one hidden effect, two, or none, of 1 to 6 % of the blocked force (seed {SEED}). \
         Each method has {:.0} minutes of bench time, and all recordings get the same diagnosis. The bounds and the seed were committed before \
         the first scored run. Rates have exact 95 % intervals. The set has {drawn} muscles, tested in its order; \"muscles\" counts \
         those that a method has had, with and without effects.\n\n{DIAGNOSIS}",
        BENCH_S / 60.0
    );
    let with: Vec<&Trial> = all.iter().filter(|t| !t.truth.is_empty()).collect();
    let without: Vec<&Trial> = all.iter().filter(|t| t.truth.is_empty()).collect();
    m += COLUMNS;
    // Writing to a string cannot fail.
    let _ =
        writeln!(m, "| bound | | {} | {} | {} | | {} |", BOUNDS[0].1, BOUNDS[1].1, BOUNDS[2].1, BOUNDS[3].1);
    for method in Method::ALL {
        let said = |trials: &[&Trial]| -> Vec<(Vec<String>, Said)> {
            let of =
                |t: &&Trial| Some((t.truth.clone(), t.said.iter().find(|s| s.method == method)?.clone()));
            trials.iter().filter_map(of).collect()
        };
        let (hidden, nulls) = (said(&with), said(&without));
        let named = hidden.iter().filter(|h| !h.1.sets.is_empty()).count();
        type Right<'a> = &'a dyn Fn(&(Vec<String>, Said)) -> bool;
        let rate = |right: Right<'_>, n: usize| Rate::new(hidden.iter().filter(|h| right(h)).count(), n);
        let _ = writeln!(
            m,
            "| {} | {} | {} | {} | {} | {} | {} |",
            method.description(),
            hidden.len() + nulls.len(),
            rate(&|h| h.1.resolved(&h.0), hidden.len()),
            rate(&|h| h.1.class_right(&h.0), hidden.len()),
            rate(&|h| h.1.holds_truth(&h.0), named),
            rate(&|h| h.1.sets.is_empty(), hidden.len()),
            Rate::new(nulls.iter().filter(|n| !n.1.sets.is_empty()).count(), nulls.len()),
        );
    }
    m += &times(all);
    m += &errors(&without);
    m += &missed(&with);
    m
}

fn times(all: &[Trial]) -> String {
    let chosen: Vec<&Said> =
        all.iter().filter_map(|t| t.said.iter().find(|s| s.method == Method::Chosen)).collect();
    let longest = chosen.iter().map(|s| s.choosing_s).fold(0.0, f64::max);
    let bench = chosen.iter().map(|s| s.bench_s / 60.0).sum::<f64>() / chosen.len().max(1) as f64;
    format!(
        "\nLongest choice of a step: {longest:.1} s (bound {}; campaigns shared the machine with other work). Bench time \
         of a campaign: {bench:.1} min on average.\n",
        BOUNDS[4].1
    )
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Table errors over bench time, and how much of the thesis's time the chosen steps need.
pub fn errors(nulls: &[&Trial]) -> String {
    let mut m = String::from(
        "\n## Table error on held-out pressures and strokes\n\nMuscles without hidden effects; rms against the bench's own friction-free \
         force between the levels, median over the muscles, percent of the blocked force. Bound: the error of the thesis's protocol in at \
         most a third of its time.\n\n| minutes | chosen steps | thesis's protocol | muscles |\n| --- | --- | --- | --- |\n",
    );
    for minutes in SHOWN {
        let of = |pick: fn(&super::table_error::After) -> Option<f64>| {
            median(
                nulls.iter().filter_map(|t| pick(t.errors.iter().find(|a| a.minutes == minutes)?)).collect(),
            )
        };
        let words = |v: Option<f64>| v.map_or("no table yet".to_owned(), |v| format!("{v:.2}"));
        let n = nulls.iter().filter(|t| !t.errors.is_empty()).count();
        let (chosen, thesis) = (of(|a| a.chosen), of(|a| a.thesis));
        let _ = writeln!(m, "| {minutes} | {} | {} | {n} |", words(chosen), words(thesis));
    }
    m += "\n| error of the table, at most | chosen steps, min | thesis's protocol, min | ratio, median over the muscles | muscles |\n\
          | --- | --- | --- | --- | --- |\n";
    for bound in ERRORS {
        let reached: Vec<(f64, f64)> = nulls
            .iter()
            .filter_map(|t| Some((minutes(t, bound, |a| a.chosen)?, minutes(t, bound, |a| a.thesis)?)))
            .collect();
        let of = |pick: fn(&(f64, f64)) -> f64| {
            median(reached.iter().map(pick).collect()).map_or("–".to_owned(), |v| format!("{v:.2}"))
        };
        let _ = writeln!(
            m,
            "| {bound} % | {} | {} | {} | {} of {} |",
            of(|r| r.0),
            of(|r| r.1),
            of(|r| r.0 / r.1),
            reached.len(),
            nulls.len()
        );
    }
    m
}

/// Bench times of the table, min.
const SHOWN: [f64; 9] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0];
/// Errors whose first time is compared, % of the blocked force.
const ERRORS: [f64; 4] = [1.0, 0.5, 0.2, 0.1];

/// The first time from which on the error stays below a bound, min.
fn minutes(trial: &Trial, bound: f64, of: fn(&super::table_error::After) -> Option<f64>) -> Option<f64> {
    let above = trial.errors.iter().rposition(|a| !of(a).is_some_and(|e| e <= bound));
    trial.errors.get(above.map_or(0, |i| i + 1)).map(|a| a.minutes)
}

/// Every muscle whose effect was not found as one right name.
fn missed(with: &[&Trial]) -> String {
    let mut m = String::from(
        "\n## What the chosen steps did not resolve\n\n| muscle | hidden | reported |\n| --- | --- | --- |\n",
    );
    for t in with {
        let Some(said) = t.said.iter().find(|s| s.method == Method::Chosen) else { continue };
        if !said.resolved(&t.truth) {
            let sets: Vec<String> = said.sets.iter().map(|s| s.join(" or ")).collect();
            let reported = if sets.is_empty() { "nothing".to_owned() } else { sets.join("; ") };
            let _ = writeln!(m, "| {} | {} | {reported} |", t.id, t.truth.join(", "));
        }
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_in_the_book_has_these_texts() {
        crate::book::contains("proof-campaign.md", &[INTRODUCTION, DIAGNOSIS]);
    }
}
