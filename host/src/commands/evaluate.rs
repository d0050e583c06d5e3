//! `host evaluate`: errors on held-out recordings.

use std::path::{Path, PathBuf};

use super::recordings::Recordings;
use super::reports::{self, Reports};
use crate::console::Console;
use crate::documents::{evaluate as document, text};
use clap::{Args, ValueEnum};
use pam_data::error::{Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::{json_of, to_standard_output, write_whole};
use pam_data::progress::Progress;
use pam_evaluate::cross_validation::{CrossValidation, Score, Split, Spot, cross_validate};
use pam_evaluate::length_transfer::{LengthTransfer, predict_unseen_length};
use pam_evaluate::published::Published;
use pam_evaluate::stock_transfer::{StockTransfer, predict_with_stock};
use pam_fit::Fit;
use pam_fit::stock::Member;
use pam_fit::stock::criteria::FEWEST_MUSCLES;
use pam_fit::{Options, recording_table};

use crate::progress::ProgressLine;
use pam_data::recording::{Campaign, Reader};
use pam_report::evaluate_page::{self, Evaluated};

/// Arguments of `host evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host evaluate --muscle mini.toml loops/*.csv --report evaluation.html\n  \
    host evaluate --muscle short.toml --muscle long.toml --import festo.toml \\\n      \
        --fit-geometry --fit-lengths --published bolen-10mm settled_points.csv\n\n\
    Each run (or contraction) is held out in turn, the rest is fitted, and the held-out part is scored. With several \
    muscles of one stock each is also predicted from the tables of the others, with a common end effect.")]
pub struct Arguments {
    /// A muscle's description; several, where the import description selects each muscle's rows.
    #[arg(long, required = true, value_name = "MUSCLE.toml")]
    muscle: Vec<PathBuf>,
    #[command(flatten)]
    recordings: Recordings,
    /// What is held out in turn.
    #[arg(long, value_enum, value_name = "WHAT", default_value_t = LeaveOut::Both)]
    leave_out: LeaveOut,
    /// Order M of the elastic polynomial.
    #[arg(long, default_value_t = 4, value_name = "M", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u8).range(1..=6))]
    order: u8,
    /// Fit effective dimensions too, within bounds.
    #[arg(long)]
    fit_geometry: bool,
    /// Correct the length of every mounting by up to 1 mm.
    #[arg(long)]
    fit_lengths: bool,
    /// Keep the described dimensions and lengths, also where recordings at held lengths ask for others.
    #[arg(long, conflicts_with_all = ["fit_geometry", "fit_lengths"])]
    as_described: bool,
    /// A published formula to compare with.
    #[arg(long, value_name = "NAME")]
    published: Option<String>,
    /// Write the errors as JSON to a file; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    reports: Reports,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LeaveOut {
    /// Every run.
    Runs,
    /// Every contraction.
    Contractions,
    /// Both, one after the other.
    Both,
}

struct Case {
    muscle: MuscleDescription,
    campaign: Campaign,
    runs: Option<CrossValidation>,
    contractions: Option<CrossValidation>,
}

impl Arguments {
    /// Reads, fits, scores.
    ///
    /// # Errors
    /// What is wrong with the input.
    pub fn run(self, console: &Console) -> Result<()> {
        to_standard_output(&[("--json", self.json.as_deref()), ("--report", self.reports.file())])?;
        let published = self.published.as_deref().map(Published::named).transpose()?;
        let options = Options {
            order: usize::from(self.order),
            fit_geometry: self.fit_geometry,
            fit_lengths: self.fit_lengths,
            as_described: self.as_described,
            ..Options::default()
        };
        let watched = if self.json.is_some() { Console::silent() } else { console.clone() };
        let splits = if self.leave_out == LeaveOut::Both { 2 } else { 1 };
        let progress = ProgressLine::new(&watched, "holding out");
        progress.total(splits * self.muscle.len() as u64);
        let mut cases = Vec::new();
        let mut hashes = Vec::new();
        let mut failure: Option<Error> = None;
        for path in &self.muscle {
            let muscle = MuscleDescription::read(path)?;
            let campaign;
            (campaign, hashes) = self.recordings.read_hashed(Reader::of(&muscle), console)?;
            let mut over = |split, wanted: bool| {
                let score = || cross_validate(&campaign, &muscle, &options, split, published.as_ref());
                // A split that cannot be fitted does not suppress the others.
                let scored = wanted.then(score)?;
                progress.step();
                match scored {
                    Ok(held) => Some(held),
                    Err(e) => {
                        let reported = failure.as_ref().is_some_and(|f| f.to_string() == e.to_string());
                        if !reported {
                            console.warning(format!("{}: {e}", muscle.name));
                        }
                        failure.get_or_insert(e);
                        None
                    }
                }
            };
            let runs = over(Split::Run, self.leave_out != LeaveOut::Contractions);
            let contractions = over(Split::Contraction, self.leave_out != LeaveOut::Runs);
            console.detail(format!("{} done", muscle.name));
            cases.push(Case { muscle, campaign, runs, contractions });
        }
        drop(progress);
        if cases.iter().all(|c| c.runs.is_none() && c.contractions.is_none())
            && let Some(e) = failure
        {
            return Err(e);
        }
        let lengths = (0..cases.len()).map(|i| by_others(&cases, i)).collect::<Result<Vec<_>>>()?;
        let stock = with_stock(&cases, console)?;
        self.write_report(console, &cases, (&lengths, &stock), hashes)?;
        if let Some(path) = &self.json {
            let muscles = cases
                .iter()
                .zip(&lengths)
                .enumerate()
                .map(|(i, (c, l))| to_document(c, l.as_ref(), stock.get(i)))
                .collect();
            let json = text(&document::Evaluate { schema: "pam-evaluate/1", muscles })?;
            write_whole(path, (json + "\n").as_bytes())?;
            if path.as_os_str() == "-" {
                return Ok(());
            }
        }
        let words = to_text(&cases, &lengths, &stock, self.published.as_deref());
        // If the report goes to standard output, nothing else does.
        if self.reports.file() == Some(Path::new("-")) {
            console.note(words)
        } else {
            console.result(words)
        }
        Ok(())
    }

    fn write_report(
        &self,
        console: &Console,
        cases: &[Case],
        (lengths, stock): (&[Option<LengthTransfer>], &[StockTransfer]),
        hashes: Vec<String>,
    ) -> Result<()> {
        let from = cases.iter().fold(reports::provenance(), |from, case| from.muscle(&case.muscle));
        let from = from.files(&self.recordings.files, &hashes);
        self.reports.write(console, &from, || {
            let found: Vec<Evaluated<'_>> = cases
                .iter()
                .zip(lengths)
                .enumerate()
                .map(|(i, (case, length))| Evaluated {
                    muscle: &case.muscle.name,
                    runs: case.runs.as_ref(),
                    contractions: case.contractions.as_ref(),
                    length: length.as_ref(),
                    stock: stock.get(i),
                })
                .collect();
            evaluate_page::page(&found, self.published.as_deref())
        })
    }
}

impl Case {
    /// The fit to all of it.
    fn whole(&self) -> Option<&Fit> {
        self.runs.as_ref().or(self.contractions.as_ref()).map(|h| &h.whole)
    }
}

/// The muscle predicted from the tables of all others.
fn by_others(cases: &[Case], index: usize) -> Result<Option<LengthTransfer>> {
    let Some(own) = cases[index].whole() else { return Ok(None) };
    let others: Vec<_> =
        cases.iter().enumerate().filter(|(i, _)| *i != index).filter_map(|(_, c)| c.whole()).collect();
    if others.is_empty() {
        return Ok(None);
    }
    let clip = own.solution.problem.clips.0.map(|c| c.force);
    predict_unseen_length(&others, &cases[index].campaign, &cases[index].muscle, clip).map(Some)
}

/// Every muscle, and every contraction, predicted with the stock; empty with too few muscles.
fn with_stock(cases: &[Case], console: &Console) -> Result<Vec<StockTransfer>> {
    if cases.len() < FEWEST_MUSCLES {
        return Ok(Vec::new());
    }
    let members: Vec<Member<'_>> =
        cases.iter().map(|c| Member { muscle: &c.muscle, campaign: &c.campaign }).collect();
    let clip = |c: &Case| pam_fit::clip(&c.campaign).0.map(|c| c.force);
    let clips: Vec<Option<f64>> = cases.iter().map(clip).collect();
    match predict_with_stock(&members, &clips) {
        Ok(all) => Ok(all),
        Err(e) => {
            console.warning(format!("the muscles as one stock: {e}"));
            Ok(Vec::new())
        }
    }
}

fn percent(score: &Score, blocked: f64) -> (f64, f64) {
    (100.0 * score.mean() / blocked, 100.0 * score.rms() / blocked)
}

fn to_text(
    cases: &[Case],
    lengths: &[Option<LengthTransfer>],
    stock: &[StockTransfer],
    published: Option<&str>,
) -> String {
    let mut text = format!(
        "Errors on held-out data: mean |F − F_model| in N, and in percent of the largest measured force (F_max).\n\
         {:<22} {:>8} {:>8} {:>17} {:>17} {:>17} {:>17}\n",
        "muscle", "F_max N", "F_B N", "held-out runs", "same, published", "held-out contr.", "other lengths"
    );
    let cell = |s: Option<&Score>, blocked: f64| {
        s.map_or("–".to_owned(), |s| format!("{:.2} N  {:.2} %", s.mean(), percent(s, blocked).0))
    };
    let mut sums = [(0.0, 0.0); 4];
    for (case, length) in cases.iter().zip(lengths) {
        let Some(any) = case.runs.as_ref().or(case.contractions.as_ref()) else { continue };
        let (b, blocked) = (any.largest, any.blocked);
        let columns = [
            case.runs.as_ref().map(|h| h.table),
            any.published,
            case.contractions.as_ref().map(|h| h.table),
            length.as_ref().map(|l| l.score),
        ];
        for (sum, c) in sums.iter_mut().zip(&columns) {
            if let Some(c) = c {
                *sum = (sum.0 + percent(c, b).0, sum.1 + 1.0);
            }
        }
        text += &format!(
            "{:<22} {b:8.1} {blocked:8.1} {:>17} {:>17} {:>17} {:>17}\n",
            case.muscle.name,
            cell(columns[0].as_ref(), b),
            cell(columns[1].as_ref(), b),
            cell(columns[2].as_ref(), b),
            cell(columns[3].as_ref(), b)
        );
    }
    let means: Vec<String> =
        sums.iter().map(|(s, n)| if *n > 0.0 { format!("{:.2} %", s / n) } else { "–".into() }).collect();
    text += &format!(
        "{:<22} {:>8} {:>8} {:>17} {:>17} {:>17} {:>17}\n",
        "mean", "", "", means[0], means[1], means[2], means[3]
    );
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

fn to_document(
    case: &Case,
    length: Option<&LengthTransfer>,
    stock: Option<&StockTransfer>,
) -> document::Muscle {
    let any = case.runs.as_ref().or(case.contractions.as_ref());
    let (blocked, largest) = any.map_or((f64::NAN, f64::NAN), |h| (h.blocked, h.largest));
    let score = |s: &Score| {
        let (mean_pct, rms_pct) = percent(s, largest);
        let (mean, rms) = (s.mean(), s.rms());
        document::Score { rows: s.rows, mean_N: mean, rms_N: rms, mean_pct, rms_pct, bias_N: s.bias() }
    };
    let spots = |spots: &[Spot]| -> Vec<document::Spot> {
        spots
            .iter()
            .map(|s| document::Spot {
                left_out: s.left_out.clone(),
                contraction: s.contraction as f64 * 1e-3,
                direction: s.direction,
                bias_N: s.score.bias(),
                rms_N: s.score.rms(),
                rows: s.score.rows,
            })
            .collect()
    };
    let held = |h: &Option<CrossValidation>| {
        h.as_ref().map(|h| document::HeldOut {
            table: score(&h.table),
            published: h.published.as_ref().map(score),
            r#where: spots(&h.spots),
            recordings: json_of(&h.recordings),
            adjusted: json_of(&h.whole.summary.adjusted),
        })
    };
    document::Muscle {
        muscle: case.muscle.name.clone(),
        blocked_force_N: blocked,
        largest_force_N: largest,
        unseen_runs: held(&case.runs),
        unseen_contractions: held(&case.contractions),
        unseen_length: length.map(|l| document::OtherLength {
            end_effect_mm: l.end_effect * 1e3,
            table: score(&l.score),
            r#where: spots(&l.spots),
        }),
        with_stock: stock.map(|s| document::WithStock {
            ends_mm: s.ends * 1e3,
            unseen_length: score(&s.length),
            length_expected_pct: 100.0 * s.length_expected / largest,
            length_where: spots(&s.length_spots),
            unseen_contractions: (s.contractions.rows > 0.0).then(|| score(&s.contractions)),
            contractions_expected_pct: 100.0 * s.contractions_expected / largest,
            contractions_where: spots(&s.contraction_spots),
        }),
    }
}
