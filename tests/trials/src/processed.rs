//! Clean recordings that were processed after the measurement: filtered, thinned, rounded, or noisy. No processing is physics: every name is a
//! false alarm.

use crate::answer::Answer;
use crate::generate;
use crate::progress::Progress;
use crate::queue::in_order;
use crate::rate::Rate;
use crate::residuals::Residuals;
use crate::spec::{self, Operator, Spec};
use crate::tool;
use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;
use virtual_bench::recording::{Recording, Row};
use virtual_bench::rng::Rng;

/// How many muscles, and where the page goes.
#[derive(clap::Args)]
pub struct Processed {
    /// Clean muscles for each campaign; the recordings of each are processed once in every way.
    #[arg(long, default_value_t = 20)]
    n: u64,
    /// The seed of the first muscle.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Real recordings whose residuals half of the muscles get as noise, where they are.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// The tool.
    #[arg(long, default_value = "target/release/host")]
    host: PathBuf,
    /// Directory of the recordings and answers.
    #[arg(short, long)]
    output: PathBuf,
    /// Write the table as this page of the book.
    #[arg(long)]
    page: Option<PathBuf>,
}

/// The campaigns, and what they are on the page.
const CAMPAIGNS: [(&str, &str); 2] = [("A", "loops"), ("C", "loops, sines, steps, holds")];

/// Measured columns of a row.
const COLUMNS: [fn(&mut Row) -> &mut f64; 3] =
    [|row| &mut row.pressure, |row| &mut row.stroke, |row| &mut row.force];
const PRESSURE: usize = 0;
const STROKE: usize = 1;
const FORCE: usize = 2;

/// A way to process the recordings of a campaign. Spans are the ranges of pressure, stroke and force over the campaign.
struct Way {
    name: &'static str,
    apply: fn(&mut Vec<Row>, spans: [f64; 3], rng: &mut Rng),
}

const WAYS: [Way; 12] = [
    Way { name: "as recorded", apply: |_, _, _| () },
    Way {
        name: "moving mean of 0.5 s",
        apply: |rows, _, _| all_columns(rows, |t, x| moving_mean(t, x, 0.5)),
    },
    Way {
        name: "moving mean of 1.5 s",
        apply: |rows, _, _| all_columns(rows, |t, x| moving_mean(t, x, 1.5)),
    },
    Way {
        name: "first-order filter of 0.3 s",
        apply: |rows, _, _| all_columns(rows, |t, x| first_order(t, x, 0.3)),
    },
    Way {
        name: "second-order filter of 0.2 s",
        apply: |rows, _, _| all_columns(rows, |t, x| first_order(t, &first_order(t, x, 0.2), 0.2)),
    },
    Way { name: "every fourth row", apply: |rows, _, _| *rows = rows.iter().step_by(4).cloned().collect() },
    Way { name: "20 % of the rows missing", apply: |rows, _, rng| rows.retain(|_| !rng.chance(0.2)) },
    Way {
        name: "displacement in steps of 0.5 % of its range",
        apply: |rows, s, _| round(rows, STROKE, s[STROKE] / 200.0),
    },
    Way {
        name: "all columns in 1,000 steps",
        apply: |rows, s, _| (0..3).for_each(|k| round(rows, k, s[k] / 1000.0)),
    },
    Way {
        name: "noise of 0.3 % on the displacement",
        apply: |rows, s, rng| noise(rows, STROKE, 0.003 * s[STROKE], rng),
    },
    Way {
        name: "noise of 1 % on the pressure",
        apply: |rows, s, rng| noise(rows, PRESSURE, 0.01 * s[PRESSURE], rng),
    },
    Way { name: "noise of 1 % on the force", apply: |rows, s, rng| noise(rows, FORCE, 0.01 * s[FORCE], rng) },
];

fn all_columns(rows: &mut [Row], filter: impl Fn(&[f64], &[f64]) -> Vec<f64>) {
    let time: Vec<f64> = rows.iter().map(|r| r.time).collect();
    for column in COLUMNS {
        let values: Vec<f64> = rows.iter_mut().map(|r| *column(r)).collect();
        for (row, value) in rows.iter_mut().zip(filter(&time, &values)) {
            *column(row) = value;
        }
    }
}

/// The mean within half of a time, s, on either side.
fn moving_mean(time: &[f64], column: &[f64], over: f64) -> Vec<f64> {
    let mean = |t: &f64| {
        let from = time.partition_point(|u| *u < t - 0.5 * over);
        let to = time.partition_point(|u| *u <= t + 0.5 * over);
        column[from..to].iter().sum::<f64>() / (to - from) as f64
    };
    time.iter().map(mean).collect()
}

/// A first-order low-pass filter with a time constant, s.
fn first_order(time: &[f64], column: &[f64], constant: f64) -> Vec<f64> {
    let mut state = column.first().copied().unwrap_or(0.0);
    let steps = std::iter::once(0.0).chain(time.windows(2).map(|t| t[1] - t[0]));
    column
        .iter()
        .zip(steps)
        .map(|(value, dt)| {
            state += (1.0 - (-dt / constant).exp()) * (value - state);
            state
        })
        .collect()
}

fn round(rows: &mut [Row], column: usize, step: f64) {
    for row in rows {
        let value = COLUMNS[column](row);
        *value = (*value / step).round() * step;
    }
}

fn noise(rows: &mut [Row], column: usize, size: f64, rng: &mut Rng) {
    rows.iter_mut().for_each(|row| *COLUMNS[column](row) += size * rng.normal());
}

/// A clean muscle in a campaign, processed in one way.
struct Case<'a> {
    campaign: usize,
    way: &'a Way,
    spec: Spec,
}

impl<'a> Case<'a> {
    fn new(campaign: usize, way: &'a Way, seed: u64) -> Option<Self> {
        let mut spec = spec::draw_of(seed, "processed", 1, &[Vec::new()]).pop()?;
        spec.protocol = CAMPAIGNS[campaign].0;
        spec.operator = Operator::default();
        Some(Self { campaign, way, spec })
    }

    /// Makes and processes the recordings, and has them diagnosed.
    fn ask(&self, what: &Processed, residuals: &Residuals) -> Result<Answer, String> {
        let folder =
            format!("{}_{}_{}", self.spec.protocol, self.way.name.replace([' ', '%'], "_"), self.spec.seed);
        let dir = what.output.join(folder);
        let mut trial = generate::make(&self.spec, residuals);
        self.process(&mut trial.recordings);
        tool::answer_to(&what.host, &dir, &trial)
    }

    fn process(&self, files: &mut [Recording]) {
        let spans = [PRESSURE, STROKE, FORCE].map(|k| {
            let all = files.iter_mut().flat_map(|f| f.rows.iter_mut()).map(|row| *COLUMNS[k](row));
            let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        });
        let mut rng = Rng::stream(self.spec.seed, self.way.name);
        files.iter_mut().for_each(|f| (self.way.apply)(&mut f.rows, spans, &mut rng));
    }
}

fn table(cases: &[Case<'_>], answers: &[Answer]) -> Result<String, std::fmt::Error> {
    let mut text =
        "| campaign | processing | named | unexplained | names |\n| --- | --- | --- | --- | --- |\n"
            .to_owned();
    let mut rows: BTreeMap<(usize, usize), Vec<&Answer>> = BTreeMap::new();
    for (case, answer) in cases.iter().zip(answers) {
        let way = WAYS.iter().position(|w| w.name == case.way.name).unwrap_or(0);
        rows.entry((case.campaign, way)).or_default().push(answer);
    }
    for ((campaign, way), answers) in rows {
        let named = answers.iter().filter(|a| !a.missing.is_empty()).count();
        let unexplained = answers.iter().filter(|a| a.verdict == "unexplained").count();
        let mut names: BTreeMap<&str, usize> = BTreeMap::new();
        for name in answers.iter().flat_map(|a| &a.missing) {
            *names.entry(name.effect.as_str()).or_default() += 1;
        }
        let names: Vec<String> = names.iter().map(|(name, n)| format!("{name} ({n})")).collect();
        let (n, how, way) = (answers.len(), CAMPAIGNS[campaign].1, WAYS[way].name);
        let (named, unexplained) = (Rate::new(named, n), Rate::new(unexplained, n));
        writeln!(text, "| {how} | {way} | {named} | {unexplained} | {} |", names.join(", "))?;
    }
    Ok(text)
}

/// Runs all cases, prints their table, and writes the page.
///
/// # Errors
/// Recordings or a page that cannot be written, or a tool that gives no answer.
pub fn run(what: &Processed) -> Result<(), Box<dyn Error>> {
    let residuals = Residuals::read(&what.data);
    let seeds = what.seed..what.seed + what.n;
    let of = |campaign| {
        seeds.clone().flat_map(move |seed| WAYS.iter().filter_map(move |w| Case::new(campaign, w, seed)))
    };
    let cases: Vec<Case<'_>> = (0..CAMPAIGNS.len()).flat_map(of).collect();
    let progress = Progress::new("diagnosed", cases.len());
    let answers = in_order(&cases, |case| {
        let answer = case.ask(what, &residuals);
        progress.one();
        answer
    })?;
    let table = table(&cases, &answers)?;
    println!("{table}");
    if let Some(page) = &what.page {
        std::fs::write(
            page,
            format!("{INTRODUCTION}This page: `--n {} --seed {}`.\n\n{table}", what.n, what.seed),
        )?;
    }
    Ok(())
}

/// Beginning of the page.
const INTRODUCTION: &str = "# Trials of processed recordings\n\nWritten by `cargo run --release -p trials -- processed -o DIR --page \
    docs/src/proof-processed.md`; nothing here is typed by hand. Recordings of clean muscles of the virtual bench, at 10 rows a second, \
    processed as loggers and users do. Nothing is left out of the model: every name is a false alarm. Filters, rounding and missing \
    rows apply to pressure, displacement and force together. Noise and steps are shares of a column's range. Rates have exact 95 % intervals \
    in brackets. For filtered recordings the answer has a remark with the time over which friction turns in them.\n\n";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_in_the_book_has_this_introduction() {
        crate::book::contains("proof-processed.md", &[INTRODUCTION]);
    }

    #[test]
    fn filters_keep_a_line_and_round_a_corner() {
        let time: Vec<f64> = (0..200).map(|i| 0.1 * f64::from(i)).collect();
        let corner: Vec<f64> = time.iter().map(|t| 10.0 - (t - 10.0).abs()).collect();
        let mean = moving_mean(&time, &corner, 1.0);
        assert!((mean[50] - corner[50]).abs() < 1e-9 && (mean[100] - 9.75).abs() < 0.05, "{}", mean[100]);
        let late = first_order(&time, &corner, 0.3);
        // The ramp is late by the time constant, less half of a row.
        assert!((corner[90] - late[90] - 0.25).abs() < 0.02, "{}", late[90]);
    }
}
