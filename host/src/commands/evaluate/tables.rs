//! The errors on held-out data as tables of text.

use pam_evaluate::cross_validation::{Score, Spot};
use pam_evaluate::length_transfer::LengthTransfer;
use pam_evaluate::stock_transfer::StockTransfer;
use pam_fit::recording_table;

use super::{Case, percent};

/// The whole answer.
pub(super) fn to_text(
    cases: &[Case],
    lengths: &[Option<LengthTransfer>],
    stock: &[StockTransfer],
    published: Option<&str>,
) -> String {
    let mut text = format!(
        "Errors on held-out data: mean |F − F_model| in N, and in percent of the largest measured force (F_max).\n\
         {:<22} {:>8} {:>8} {:>17} {:>17} {:>17} {:>17} {:>17}\n",
        "muscle",
        "F_max N",
        "F_B N",
        "held-out runs",
        "same, published",
        "between contr.",
        "at end contr.",
        "other lengths"
    );
    let cell = |s: Option<&Score>, blocked: f64| {
        s.map_or("–".to_owned(), |s| format!("{:.2} N  {:.2} %", s.mean(), percent(s, blocked).0))
    };
    let mut sums = [(0.0, 0.0); 5];
    for (case, length) in cases.iter().zip(lengths) {
        let Some(any) = case.runs.as_ref().or(case.contractions.as_ref()) else { continue };
        let (b, blocked) = (any.largest, any.blocked);
        let columns = [
            case.runs.as_ref().map(|h| h.table),
            any.published,
            case.contractions.as_ref().and_then(|h| h.between),
            case.contractions.as_ref().and_then(|h| h.ends),
            length.as_ref().map(|l| l.score),
        ];
        for (sum, c) in sums.iter_mut().zip(&columns) {
            if let Some(c) = c {
                *sum = (sum.0 + percent(c, b).0, sum.1 + 1.0);
            }
        }
        text += &format!(
            "{:<22} {b:8.1} {blocked:8.1} {:>17} {:>17} {:>17} {:>17} {:>17}\n",
            case.muscle.name,
            cell(columns[0].as_ref(), b),
            cell(columns[1].as_ref(), b),
            cell(columns[2].as_ref(), b),
            cell(columns[3].as_ref(), b),
            cell(columns[4].as_ref(), b)
        );
    }
    let means: Vec<String> =
        sums.iter().map(|(s, n)| if *n > 0.0 { format!("{:.2} %", s / n) } else { "–".into() }).collect();
    text += &format!(
        "{:<22} {:>8} {:>8} {:>17} {:>17} {:>17} {:>17} {:>17}\n",
        "mean", "", "", means[0], means[1], means[2], means[3], means[4]
    );
    if cases.iter().any(|case| case.contractions.is_some()) {
        text += "between contr.: each held contraction between others left out in turn; at end contr.: the smallest and the largest one, \
                 which is extrapolation\n";
    }
    if let Some(name) = published {
        text += &format!("published: {name}, on the rows of the first column\n");
    }
    text += "F_B: blocked force, friction-free at rest length and the highest tested pressure, by the fit to all rows\n";
    if lengths.iter().any(Option::is_some) {
        text += "unseen length: the mean of the other muscles' tables, with an end effect of\n";
        for (case, length) in cases.iter().zip(lengths) {
            if let Some(l) = length {
                text += &format!("  {:<22} {:5.1} mm by the others\n", case.muscle.name, l.end_effect * 1e3);
            }
        }
    }
    text += &stock_text(cases, stock);
    text += &where_it_is(cases, lengths);
    text
}

/// The residuals at the contractions and in the recordings of each muscle, under a heading; empty where no muscle has any to list.
fn where_it_is(cases: &[Case], lengths: &[Option<LengthTransfer>]) -> String {
    let (mut text, mut legend) = (String::new(), "");
    for (case, length) in cases.iter().zip(lengths) {
        let mut listed = String::new();
        if let Some(held) = &case.runs {
            listed += &places("run", &held.spots);
        }
        if let Some(held) = &case.contractions {
            listed += &places("left out", &held.spots);
        }
        if let Some(length) = length {
            listed += &places("length of", &length.spots);
        }
        if !listed.is_empty() {
            legend = ", at contractions (filling or shortening / emptying or lengthening)";
        }
        if let Some(held) = &case.runs {
            let table = recording_table(&held.recordings);
            if !table.is_empty() {
                listed += &format!("held-out {table}\n");
            }
        }
        if !listed.is_empty() {
            text += &format!("{}\n{listed}", case.muscle.name);
        }
    }
    if text.is_empty() {
        return text;
    }
    format!("\nWhere the error is: mean of F − F_model, N{legend}\n{text}")
}

/// The errors with the stock, one line for each muscle. Behind each: the mean error that unknown lengths, zeros and scale alone would give.
fn stock_text(cases: &[Case], stock: &[StockTransfer]) -> String {
    if stock.is_empty() {
        return String::new();
    }
    let mut text = format!(
        "\nAll muscles fitted together, without what is predicted (expected: from unknown lengths, zeros and scale alone)\n\
         {:<22} {:>17} {:>9} {:>17} {:>9} {:>14}\n",
        "muscle", "held-out contr.", "expected", "other lengths", "expected", "ends by others"
    );
    let mut sums = [(0.0, 0.0); 4];
    for (case, of) in cases.iter().zip(stock) {
        let Some(any) = case.runs.as_ref().or(case.contractions.as_ref()) else { continue };
        let share = |newtons: f64| 100.0 * newtons / any.largest;
        let held = of.contractions.rows > 0.0;
        let numbers = [
            held.then(|| of.contractions.mean()),
            held.then_some(of.contractions_expected),
            Some(of.length.mean()),
            Some(of.length_expected),
        ];
        for (sum, n) in sums.iter_mut().zip(&numbers) {
            if let Some(n) = n {
                *sum = (sum.0 + share(*n), sum.1 + 1.0);
            }
        }
        let whole = |n: Option<f64>| n.map_or("–".to_owned(), |n| format!("{n:.2} N  {:.2} %", share(n)));
        let pct = |n: Option<f64>| n.map_or("–".to_owned(), |n| format!("{:.2} %", share(n)));
        text += &format!(
            "{:<22} {:>17} {:>9} {:>17} {:>9} {:>11.1} mm\n",
            case.muscle.name,
            whole(numbers[0]),
            pct(numbers[1]),
            whole(numbers[2]),
            pct(numbers[3]),
            of.ends * 1e3
        );
    }
    let means = sums.map(|(s, n)| if n > 0.0 { format!("{:.2} %", s / n) } else { "–".into() });
    text + &format!("{:<22} {:>17} {:>9} {:>17} {:>9}\n", "mean", means[0], means[1], means[2], means[3])
}

/// A line for everything that was left out: the mean error with its sign at each contraction.
fn places(what: &str, spots: &[Spot]) -> String {
    let sorted = |of: &dyn Fn(&Spot) -> String| {
        let mut names: Vec<String> = spots.iter().map(of).collect();
        names.sort_by(|a, b| (a.len(), a).cmp(&(b.len(), b)));
        names.dedup();
        names
    };
    let mut contractions: Vec<i64> = spots.iter().map(|s| s.contraction).collect();
    contractions.sort_unstable();
    contractions.dedup();
    // A moving muscle has no few contractions to list.
    if contractions.len() > 8 {
        return String::new();
    }
    let mut text = String::new();
    for left_out in sorted(&|s| s.left_out.clone()) {
        text += &format!("  {what} {left_out:>4}:");
        for c in &contractions {
            let at = |d: i8| {
                spots
                    .iter()
                    .find(|s| s.left_out == left_out && s.contraction == *c && s.direction == d)
                    .map(|s| format!("{:+.1}", s.score.bias()))
            };
            let or_none = |cell: Option<String>| cell.unwrap_or_else(|| "–".to_owned());
            if at(1).is_some() || at(-1).is_some() {
                text += &format!("  {:.3}: {:>6} / {:>6}", *c as f64 * 1e-3, or_none(at(1)), or_none(at(-1)));
            }
        }
        text += "\n";
    }
    text
}
