//! Recordings as runs: which mounting, which run of it, when, and what cannot be compared.

use super::answer::NotComparable;
use super::criteria::{INTERPOLATE_FROM, NEW_VISIT, PAUSE, SAME_STROKE};
use pam_data::error::Result;
use pam_data::recording::motion;
use pam_data::recording::{Campaign, Clock, Recording};
use pam_data::statistics::median;

/// Whether AFTER was remounted since BEFORE.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mounted {
    /// Found from files and clocks: one file, or one clock without a long pause, is one visit.
    #[default]
    Found,
    /// AFTER continues where BEFORE ended: nothing was taken off the bench.
    Same,
    /// Taken off and put on again.
    Anew,
}

/// One recording at a held length, SI.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub name: String,
    pub after: bool,
    /// Index of the mounting, by ascending stroke.
    pub mounting: usize,
    /// Number of the run within its mounting, counted from 0 at each visit.
    pub number: usize,
    /// Own stroke minus the mounting's, m.
    pub shift: f64,
    pub time: Vec<f64>,
    pub pressure: Vec<f64>,
    pub force: Vec<f64>,
    pub settled: Vec<bool>,
    pub direction: Vec<f64>,
    /// s since the mounting's first row.
    pub since_mounted: f64,
    /// s since AFTER began; zero for BEFORE.
    pub since_after: f64,
}

impl Run {
    pub fn duration(&self) -> f64 {
        self.time.last().zip(self.time.first()).map_or(0.0, |(l, f)| l - f)
    }
}

/// All runs, BEFORE first, each side in the order given.
#[derive(Debug, Clone, Default)]
pub(super) struct Runs {
    pub runs: Vec<Run>,
    /// Strokes of the mountings, m, ascending.
    pub strokes: Vec<f64>,
    /// Mountings that only AFTER has, between lengths of the reference: its force there is interpolated.
    pub interpolated: Vec<bool>,
    /// Whether the AFTER runs of a mounting were remounted.
    pub remounted: bool,
    /// Whether the runs are parts of recordings in which length and pressure move together.
    pub moving: bool,
    /// Duration of AFTER, s.
    pub duration: f64,
    pub not_comparable: Vec<NotComparable>,
}

/// The middle of a recording's strokes, m.
fn stroke(recording: &Recording) -> f64 {
    median(&mut recording.stroke.clone())
}

/// Strokes that are further apart than a mounting's tolerance.
pub(super) fn mountings(recordings: &[Recording]) -> Vec<f64> {
    let mut all: Vec<f64> = recordings.iter().map(stroke).collect();
    all.sort_by(f64::total_cmp);
    let mut groups: Vec<Vec<f64>> = Vec::new();
    for s in all {
        match groups.last_mut() {
            Some(group) if s - group[0] <= SAME_STROKE => group.push(s),
            _ => groups.push(vec![s]),
        }
    }
    groups.iter().map(|g| g.iter().sum::<f64>() / g.len() as f64).collect()
}

/// The reference's strokes and those of AFTER that lie between two of them, with a mark on the latter. From three lengths on the force
/// over the length has a curvature that is known, and its error can be judged by leaving lengths out.
fn with_interpolated(recorded: Vec<f64>, after: &[Recording]) -> (Vec<f64>, Vec<bool>) {
    let mut all: Vec<(f64, bool)> = recorded.iter().map(|s| (*s, false)).collect();
    if let ([first, .., last], true) = (recorded.as_slice(), recorded.len() >= INTERPOLATE_FROM) {
        let new = mountings(after).into_iter().filter(|s| nearest(&recorded, *s).is_none());
        all.extend(new.filter(|s| s > first && s < last).map(|s| (s, true)));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().unzip()
}

fn nearest(strokes: &[f64], stroke: f64) -> Option<usize> {
    let best = (0..strokes.len())
        .min_by(|a, b| (strokes[*a] - stroke).abs().total_cmp(&(strokes[*b] - stroke).abs()))?;
    ((strokes[best] - stroke).abs() <= SAME_STROKE * 1.000_001).then_some(best)
}

/// Whether AFTER is another visit to the bench than BEFORE.
pub(super) fn mounted_anew(before: &Campaign, after: &Campaign, said: Mounted) -> bool {
    match said {
        Mounted::Same => false,
        Mounted::Anew => true,
        Mounted::Found => {
            let one_file =
                after.recordings.iter().all(|a| before.recordings.iter().any(|b| a.source == b.source));
            let end = before
                .recordings
                .iter()
                .filter_map(|r| r.time.last())
                .fold(f64::NEG_INFINITY, |a, b| a.max(*b));
            let begin =
                after.recordings.iter().filter_map(|r| r.time.first()).fold(f64::INFINITY, |a, b| a.min(*b));
            // A clock that shows less than before, or about zero, was restarted and does not show it.
            let one_clock = before.clock == Clock::Shared && begin > end && begin - end < NEW_VISIT;
            !(one_file || one_clock)
        }
    }
}

impl Runs {
    /// Runs of AFTER against the mountings of BEFORE.
    ///
    /// # Errors
    /// A recording without force.
    pub fn of(before: &Campaign, after: &Campaign, said: Mounted) -> Result<Self> {
        let (strokes, interpolated) = with_interpolated(mountings(&before.recordings), &after.recordings);
        let remounted = mounted_anew(before, after, said);
        let mut all = Self { strokes, interpolated, remounted, ..Self::default() };
        all.add(before, false)?;
        all.add(after, true)?;
        all.count();
        Ok(all)
    }

    /// Runs of AFTER alone, for a reference that is a table.
    ///
    /// # Errors
    /// A recording without force.
    pub fn alone(after: &Campaign, said: Mounted) -> Result<Self> {
        // A table was made at some other time: without a word AFTER counts as remounted.
        let remounted = said != Mounted::Same;
        let mut all = Self { strokes: mountings(&after.recordings), remounted, ..Self::default() };
        all.add(after, true)?;
        all.count();
        Ok(all)
    }

    fn add(&mut self, campaign: &Campaign, after: bool) -> Result<()> {
        for recording in &campaign.recordings {
            let own = stroke(recording);
            let force = recording.require_force()?.to_vec();
            let Some(mounting) = nearest(&self.strokes, own) else {
                self.not_comparable
                    .push(NotComparable::Stroke { recording: recording.name.clone(), stroke: own });
                continue;
            };
            let settled = motion::settled(&recording.time, &recording.pressure);
            let direction = motion::settled_way(&recording.pressure, &settled);
            self.runs.push(Run {
                name: recording.name.clone(),
                after,
                mounting,
                number: 0,
                shift: own - self.strokes[mounting],
                time: recording.time.clone(),
                pressure: recording.pressure.clone(),
                force,
                settled,
                direction,
                since_mounted: 0.0,
                since_after: 0.0,
            });
        }
        Ok(())
    }

    /// Numbers the runs of each mounting and starts their clocks.
    fn count(&mut self) {
        let mut clocks = vec![(0, 0.0); self.strokes.len()];
        let (mut side, mut elapsed) = (false, 0.0);
        for run in &mut self.runs {
            if run.after && !side {
                side = true;
                if self.remounted {
                    clocks.fill((0, 0.0));
                }
            }
            let duration = run.duration();
            let (number, clock) = &mut clocks[run.mounting];
            (run.number, run.since_mounted) = (*number, *clock);
            (*number, *clock) = (*number + 1, *clock + duration + PAUSE);
            if run.after {
                run.since_after = elapsed;
                elapsed += duration;
            }
        }
        self.duration = elapsed;
    }

    /// Whether the reference has no recording at this mounting's length.
    pub fn is_interpolated(&self, mounting: usize) -> bool {
        self.interpolated.get(mounting).copied().unwrap_or(false)
    }

    /// Runs of one side.
    pub fn side(&self, after: bool) -> impl Iterator<Item = &Run> {
        self.runs.iter().filter(move |r| r.after == after)
    }
}
