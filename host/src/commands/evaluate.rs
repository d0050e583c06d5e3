//! `host evaluate`: errors on held-out recordings.

use std::path::{Path, PathBuf};

mod json;
mod tables;

use self::json::to_document;
use self::tables::to_text;
use super::recordings::Recordings;
use super::reports::{self, Reports};
use crate::console::Console;
use crate::documents::{evaluate as document, text};
use clap::{Args, ValueEnum};
use pam_data::error::{Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::{to_standard_output, write_whole};
use pam_data::progress::Progress;
use pam_evaluate::cross_validation::{CrossValidation, Score, Split, cross_validate};
use pam_evaluate::length_transfer::{LengthTransfer, predict_unseen_length};
use pam_evaluate::published::Published;
use pam_evaluate::stock_transfer::{StockTransfer, predict_with_stock};
use pam_fit::Fit;
use pam_fit::Options;
use pam_fit::stock::FEWEST_MUSCLES;
use pam_fit::stock::Member;

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
    /// Keep the described dimensions and lengths, also where recordings at held lengths require others.
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
        let published = self.published.as_deref().map(Published::by_name).transpose()?;
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
        let mut failures: Vec<(String, Error)> = Vec::new();
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
                        if !failures.iter().any(|(_, f)| f.to_string() == e.to_string()) {
                            failures.push((muscle.name.clone(), e));
                        }
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
        // What ends the command is its error, and no warning beside that.
        let all = cases.iter().all(|c| c.runs.is_none() && c.contractions.is_none());
        let ends = if all && !failures.is_empty() { Some(failures.remove(0).1) } else { None };
        for (muscle, e) in &failures {
            console.warning(format!("{muscle}: {e}"));
        }
        if let Some(e) = ends {
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
        let text = to_text(&cases, &lengths, &stock, self.published.as_deref());
        // If the report goes to standard output, nothing else does.
        if self.reports.file() == Some(Path::new("-")) {
            console.note(text)
        } else {
            console.result(text)
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
