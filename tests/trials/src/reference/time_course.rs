//! Changes that begin within the later runs, suddenly or gradually: whether they are found, and how far the time that is found is off.

use pam_diagnose::reference::answer::{Moment, Since};
use rayon::prelude::*;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::injection::{Slopes, immediate, inject};
use super::staircases::{Muscle, Run};
use super::{class, compared};

/// % of the largest force rms, once the change is there in full.
pub const SIZES: [f64; 2] = [3.0, 5.0];

/// How a change continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeCourse {
    /// From the first run after on.
    Whole,
    /// Suddenly.
    Step,
    /// Growing to the end.
    Ramp,
}

/// One trial.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    /// Muscle.
    pub muscle: String,
    /// What was put in.
    pub effect: &'static str,
    /// %.
    pub percent: f64,
    /// How.
    #[serde(rename = "course")]
    pub time_course: TimeCourse,
    /// When, share of AFTER.
    pub start: f64,
    /// Class of the name right: a zero that grows is a drift, an offset of the stroke that comes is a slip.
    pub right: bool,
    /// Course of the name that is right.
    pub answer: &'static str,
    /// The moment found and its interval, share of AFTER.
    pub found: Option<[f64; 3]>,
    /// s of AFTER.
    pub duration: f64,
    /// Whether the recording named is the one in which the change began.
    pub recording: bool,
    /// Runs of AFTER, over all lengths.
    pub runs: usize,
}

fn blended(whole: &[Run], before: &[Run], factor: &dyn Fn(f64) -> f64) -> Vec<Run> {
    let total: f64 = before.iter().map(|r| r.time.last().copied().unwrap_or(0.0)).sum();
    let mut elapsed = 0.0;
    let mut all = Vec::new();
    for (changed, plain) in whole.iter().zip(before) {
        let mut run = plain.clone();
        for i in 0..run.time.len() {
            let f = factor((elapsed + run.time[i]) / total);
            run.pressure[i] += f * (changed.pressure[i] - plain.pressure[i]);
            run.force[i] += f * (changed.force[i] - plain.force[i]);
        }
        elapsed += plain.time.last().copied().unwrap_or(0.0);
        all.push(run);
    }
    all
}

/// Whether a name is right for what was put in.
fn right(effect: &str, time_course: TimeCourse, name: &str) -> bool {
    let slip = effect == "displacement-offset" && time_course != TimeCourse::Whole && name == "end-slip";
    slip || class(name) == class(effect)
}

fn ask(
    muscle: &Muscle,
    slopes: &Slopes,
    effect: &'static str,
    percent: f64,
    time_course: TimeCourse,
) -> Result<Trial, String> {
    let middle = (muscle.runs / 2).max(1);
    let before = muscle.between(1, middle);
    let mut plain = muscle.between(middle + 1, muscle.runs);
    plain.sort_by_key(|r| (r.run, r.mounting));
    let (whole, _) = inject(&plain, effect, percent, slopes, &muscle.name, middle, 0.5);
    // The moment is drawn by a hash, so that no constant can be fitted to it.
    let hash = Sha256::digest(format!("{}|{effect}|{percent}|{time_course:?}", muscle.name));
    let start = if time_course == TimeCourse::Whole { 0.0 } else { 0.25 + 0.5 * f64::from(hash[1]) / 255.0 };
    let factor = |clock: f64| match time_course {
        TimeCourse::Whole => 1.0,
        TimeCourse::Step => f64::from(u8::from(clock >= start)),
        TimeCourse::Ramp => ((clock - start) / (1.0 - start)).max(0.0),
    };
    let after = blended(&whole, &plain, &factor);
    let report = compared(&before, &after).map_err(|e| format!("{} {effect}: {e}", muscle.name))?;
    let duration: f64 = plain.iter().map(|r| r.time.last().copied().unwrap_or(0.0)).sum();
    let mut elapsed = 0.0;
    let mut began = String::new();
    for run in &plain {
        if elapsed <= start * duration {
            began = run.recording().name;
        }
        elapsed += run.time.last().copied().unwrap_or(0.0);
    }
    let named = report.missing.iter().find(|m| right(effect, time_course, &m.effect));
    let (answer, moment): (&str, Option<&Moment>) = match named.map(|m| &m.since) {
        None => ("no name", None),
        Some(Since::Beginning) => ("beginning", None),
        Some(Since::From(m)) => ("suddenly", Some(m)),
        Some(Since::Gradual(m)) => ("gradually", Some(m)),
        Some(Since::NotDetermined) => ("not determined", None),
    };
    Ok(Trial {
        muscle: muscle.name.clone(),
        effect,
        percent,
        time_course,
        start,
        right: named.is_some(),
        answer,
        found: moment.map(|m| [m.moment, m.low, m.high].map(|t| t / duration)),
        duration,
        recording: moment.is_some_and(|m| m.recording == began),
        runs: plain.len(),
    })
}

/// All trials.
///
/// # Errors
/// A trial without an answer.
pub fn run(muscles: &[(&Muscle, &Slopes)]) -> Result<Vec<Trial>, String> {
    let mut jobs = Vec::new();
    for (muscle, slopes) in muscles {
        for effect in immediate() {
            for percent in SIZES {
                for time_course in [TimeCourse::Whole, TimeCourse::Step, TimeCourse::Ramp] {
                    jobs.push((*muscle, *slopes, effect, percent, time_course));
                }
            }
        }
    }
    jobs.par_iter()
        .map(|(m, s, effect, percent, time_course)| ask(m, s, effect, *percent, *time_course))
        .collect()
}
