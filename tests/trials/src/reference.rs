//! `trials reference`: changes put into later runs of real recordings, untouched pairs, and a cylinder whose seal was swapped; each asked of
//! the diagnosis against a reference.

mod cylinder;
pub mod further;
mod injection;
mod leaks;
mod page;
mod pairs;
mod single_effects;
mod staircases;
mod tables;
mod time_course;
mod together;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use pam_data::recording::Campaign;
use pam_diagnose::reference::shapes::{Change, Class};
use pam_diagnose::reference::{Against, ChangeReport, Mounted, Options, Verdict, compare};
use rayon::prelude::*;
use serde::Serialize;

use injection::{EFFECTS, Slopes, inject};
use staircases::{Half, Muscle};

/// What is tried.
#[derive(Args)]
pub struct Reference {
    /// Directory that holds aarl-festo-10mm-2021, -2022 and tudelft-printed-cylinder; what is absent is left out, and the page says so.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// Where to.
    #[arg(short, long)]
    output: PathBuf,
    /// Write the tables as this page of the book, too.
    #[arg(long)]
    page: Option<PathBuf>,
    /// A stratified share: one split a muscle at 3 %, every seventh untouched pair, the cylinder's five configurations.
    #[arg(long)]
    short: bool,
    /// Also write the pairs at 3 % and the untouched ones as tables, DIR/pairs.jsonl, and as many simulated muscles for training,
    /// DIR/training.jsonl: for `reference_baselines.py`.
    #[arg(long, value_name = "MUSCLES")]
    pairs: Option<u64>,
    /// Only the trials against a table and the cylinder: their sections of the page are rewritten, the others stay.
    #[arg(long, requires = "page", conflicts_with_all = ["short", "pairs"])]
    sections: bool,
    /// Only the trials against a table, without a page.
    #[arg(long, conflicts_with = "page")]
    tables: bool,
}

/// Sizes put in, % of the largest force rms.
const SIZES: [f64; 4] = [1.0, 2.0, 3.0, 5.0];
/// Untouched pairs that the short version leaves out between two.
const SHORT_STEP: usize = 7;

/// One trial of a staircase.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    /// Muscle.
    pub muscle: String,
    /// Which half it belongs to.
    pub half: Half,
    /// First and last run before, last run after.
    pub runs: (usize, usize, usize),
    /// What was put in; absent for untouched pairs.
    pub effect: Option<&'static str>,
    /// % of the largest force rms.
    pub percent: f64,
    /// Its size, SI.
    pub size: f64,
    /// The answer.
    pub answer: Answer,
    /// What the simpler method names; empty where it was not asked.
    pub simple: String,
}

/// What is kept of an answer.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// The most probable cause.
    pub top: String,
    /// Its probability.
    pub probability: f64,
    /// Probability that nothing changed.
    pub none: f64,
    /// Causes that hold 95 %.
    pub set: Vec<String>,
    /// Names, with size and half the 95 % interval.
    pub named: Vec<(String, f64, f64)>,
    /// Share of the difference gone on recordings held out.
    pub held_out: f64,
    /// Verdict.
    pub verdict: Verdict,
    /// s.
    pub seconds: f64,
}

impl Answer {
    fn of(report: &ChangeReport, seconds: f64) -> Self {
        let size = |m: &pam_diagnose::reference::answer::Changed| {
            m.parameters.first().map_or((0.0, 0.0), |s| (s.value, (s.high - s.low) / 2.0))
        };
        let h = &report.held_out;
        Self {
            top: report.top().to_owned(),
            probability: report.probability(report.top()),
            none: report.probability("none"),
            set: report.set.clone(),
            named: report.missing.iter().map(|m| (m.effect.clone(), size(m).0, size(m).1)).collect(),
            held_out: 1.0 - (h.rms_after_N / h.rms_before_N.max(f64::MIN_POSITIVE)).powi(2),
            verdict: report.verdict,
            seconds,
        }
    }
}

/// Class of a name; names without a class are their own.
pub fn class(name: &str) -> Option<Class> {
    Change::from_name(name).map(Change::class)
}

/// What a job puts in.
struct Job<'a> {
    muscle: &'a Muscle,
    runs: (usize, usize, usize),
    put_in: Option<(&'static str, f64)>,
    number: usize,
}

/// Every contiguous window of runs, parted so that enough are left on either side.
fn untouched(muscles: &[Muscle], step: usize) -> Vec<Job<'_>> {
    let mut jobs = Vec::new();
    let mut number = 0;
    for muscle in muscles {
        let side = muscle.least_runs();
        for a in 1..=muscle.runs {
            for b in a + side - 1..muscle.runs {
                for c in b + side..=muscle.runs {
                    number += 1;
                    if number % step == 0 {
                        jobs.push(Job { muscle, runs: (a, b, c), put_in: None, number });
                    }
                }
            }
        }
    }
    jobs
}

fn injected(muscles: &[Muscle], short: bool) -> Vec<Job<'_>> {
    let mut jobs = Vec::new();
    for muscle in muscles {
        let side = muscle.least_runs();
        let splits: Vec<usize> = (side..=muscle.runs - side).collect();
        for (number, b) in splits.iter().enumerate() {
            if short && number != splits.len() / 2 {
                continue;
            }
            for percent in SIZES.into_iter().filter(|p| !short || *p == 3.0) {
                for effect in EFFECTS {
                    jobs.push(Job {
                        muscle,
                        runs: (1, *b, muscle.runs),
                        put_in: Some((effect, percent)),
                        number,
                    });
                }
            }
        }
    }
    jobs
}

/// The runs of both sides, and the size of the change.
fn sides(job: &Job<'_>, slopes: &Slopes) -> (Vec<staircases::Run>, Vec<staircases::Run>, f64) {
    let (a, b, c) = job.runs;
    let before = job.muscle.between(a, b);
    let mut after = job.muscle.between(b + 1, c);
    after.sort_by_key(|r| (r.run, r.mounting));
    let mut size = 0.0;
    if let Some((effect, percent)) = job.put_in {
        // A slip happens between a third and two thirds of AFTER, by the number of the trial.
        let moment = 0.35 + 0.3 * ((job.number * 37 % 10) as f64 / 10.0);
        (after, size) = inject(&after, effect, percent, slopes, &job.muscle.name, b, moment);
    }
    (before, after, size)
}

/// One pair as a table, with what the diagnosis named.
#[derive(Serialize)]
struct AnsweredPair {
    #[serde(flatten)]
    pair: pairs::Pair,
    /// The most probable cause.
    diagnosis: String,
    /// What the largest ΔBIC names.
    simple: String,
}

fn write_pairs(
    what: &Reference,
    jobs: &[Job<'_>],
    trials: &[Trial],
    slopes: &BTreeMap<&str, Slopes>,
    muscles: u64,
) -> Result<(), Box<dyn Error>> {
    let mut text = String::new();
    let wanted = |j: &Job<'_>| j.put_in.is_none_or(|(_, percent)| percent == 3.0);
    for (job, trial) in jobs.iter().zip(trials).filter(|(j, _)| wanted(j)) {
        let own = &slopes[job.muscle.name.as_str()];
        let (before, after, _) = sides(job, own);
        let (effect, percent) = job.put_in.map_or((None, 0.0), |p| (Some(p.0), p.1));
        let about = (job.muscle.name.clone(), Some(job.muscle.half), effect, percent, job.runs);
        let pair = pairs::table((&before, &after), own, own.largest(), about);
        let line = AnsweredPair { pair, diagnosis: trial.answer.top.clone(), simple: trial.simple.clone() };
        text += &serde_json::to_string(&line)?;
        text.push('\n');
    }
    write(&what.output, "pairs.jsonl", &text)?;
    let mut text = String::new();
    for pair in pairs::of_the_bench(muscles) {
        text += &serde_json::to_string(&pair)?;
        text.push('\n');
    }
    write(&what.output, "training.jsonl", &text)
}

/// The comparison of two sides of an actuator that stayed on the bench.
fn compared(before: &[staircases::Run], after: &[staircases::Run]) -> Result<ChangeReport, String> {
    let campaign =
        |runs: &[staircases::Run]| Campaign::new(runs.iter().map(staircases::Run::recording).collect());
    let options = Options { mounted: Mounted::Same, ..Options::default() };
    compare(&campaign(after), Against::Recordings(&campaign(before)), &options).map_err(|e| e.to_string())
}

fn ask(job: &Job<'_>, slopes: &Slopes) -> Result<Trial, String> {
    let (before, after, size) = sides(job, slopes);
    let simple = single_effects::name(&before, &after, slopes);
    let start = Instant::now();
    let report = compared(&before, &after)
        .map_err(|e| format!("{} {:?} {:?}: {e}", job.muscle.name, job.runs, job.put_in))?;
    Ok(Trial {
        muscle: job.muscle.name.clone(),
        half: job.muscle.half,
        runs: job.runs,
        effect: job.put_in.map(|p| p.0),
        percent: job.put_in.map_or(0.0, |p| p.1),
        size,
        answer: Answer::of(&report, start.elapsed().as_secs_f64()),
        simple: simple.into(),
    })
}

/// Runs all trials and writes `reference.json`, `reference.md` and, on request, the page.
///
/// # Errors
/// Files that cannot be read or written, a trial without an answer.
pub fn run(what: &Reference) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    std::fs::create_dir_all(&what.output)?;
    let muscles = staircases::read(&what.data)?;
    let slopes: BTreeMap<&str, Slopes> =
        muscles.iter().map(|m| (m.name.as_str(), Slopes::of(&m.between(1, m.runs)))).collect();
    if what.tables {
        let trials = tables::run(&muscles, &slopes, what.short);
        write(&what.output, "tables.json", &serde_json::to_string_pretty(&trials)?)?;
        let text = page::tables(&trials);
        print!("{text}");
        return write(&what.output, "tables.md", &text);
    }
    if let Some(path) = what.page.as_ref().filter(|_| what.sections) {
        let trials = tables::run(&muscles, &slopes, false);
        let pairs = cylinder::run(&what.data, false)?;
        write(&what.output, "sections.json", &serde_json::to_string_pretty(&(&trials, &pairs))?)?;
        std::fs::write(path, page::replaced(&std::fs::read_to_string(path)?, &trials, &pairs))?;
        return Ok(());
    }
    let mut jobs = untouched(&muscles, if what.short { SHORT_STEP } else { 1 });
    jobs.extend(injected(&muscles, what.short));
    let trials: Vec<Trial> =
        jobs.par_iter().map(|j| ask(j, &slopes[j.muscle.name.as_str()])).collect::<Result<_, _>>()?;
    if let Some(muscles) = what.pairs {
        return write_pairs(what, &jobs, &trials, &slopes, muscles);
    }
    let against_tables = tables::run(&muscles, &slopes, what.short);
    let leaks = leaks::run(&muscles, &slopes, what.short)?;
    let cylinder = cylinder::run(&what.data, what.short)?;
    let speed = page::speed(&muscles)?;
    let sections = leaks::section(&leaks) + &page::tables(&against_tables);
    let text = page::page(&trials, &sections, &cylinder, speed, what.short);
    write(
        &what.output,
        "reference.json",
        &serde_json::to_string_pretty(&(&trials, &cylinder, &against_tables, &leaks))?,
    )?;
    write(&what.output, "reference.md", &text)?;
    if let Some(page) = &what.page {
        std::fs::write(page, &text)?;
    }
    println!(
        "{} trials, {} of leaks, {} against tables, and {} pairs of the cylinder in {:.0} s",
        trials.len(),
        leaks.len(),
        against_tables.len(),
        cylinder.len(),
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

fn write(directory: &Path, name: &str, text: &str) -> Result<(), Box<dyn Error>> {
    std::fs::write(directory.join(name), text)?;
    Ok(())
}
