//! Whole recordings with another unit, sign or zero than the others of their campaign: bar under a heading in kPa, a load cell with
//! inverted sign, an absolute pressure sensor among gauge pressure sensors.
//!
//! A surface of force over pressure and stroke is fitted to the other recordings. A recording is inconsistent only where its residuals
//! are large as read, and small with one known mistake corrected. At least three recordings are needed to decide which one is wrong,
//! and the others must cover the strokes of this one.

use super::{Campaign, Recording};
use crate::statistics::ranked;

mod consensus_surface;
mod mistake;

use consensus_surface::{ConsensusSurface, FAR_OFF, Row};
use mistake::Mistake;

/// A recording that is inconsistent with the others, and its mistake.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct InconsistentRecording {
    /// Index of the recording in the campaign.
    pub(crate) recording: usize,
    /// The mistake whose correction makes it agree.
    pub(crate) mistake: Mistake,
    /// Another mistake that explains it about as well.
    pub(crate) or: Option<Mistake>,
}

impl InconsistentRecording {
    /// Description of the mistake and the remedy.
    #[must_use]
    pub(crate) fn describe(&self) -> String {
        let or = self.or.map_or(String::new(), |m| format!("; or {}", m.describe()));
        self.mistake.describe() + &or
    }
}

/// Sampled rows of a campaign, and of one recording at most.
const ROWS: usize = 6000;
const ROWS_OF_ONE: usize = 400;
/// Recordings with fewer rows are skipped.
const LEAST_ROWS: usize = 8;
/// With fewer recordings it cannot be decided which one is wrong.
const LEAST_RECORDINGS: usize = 3;
/// From this residual on, as a share of the usual largest force, the search without one recording starts: a wrong recording also bends
/// the surface that includes it.
const SEARCH_FROM: f64 = 0.02;
/// At most this many recordings are excluded until the others agree, each chosen among this many with the largest residuals.
const MOST_ODD: usize = 6;
const TRIED: usize = 24;

/// Sampled rows of a recording.
struct Sample {
    /// Index of the recording in the campaign.
    recording: usize,
    rows: Vec<Row>,
}

/// The recordings of a campaign that are inconsistent with the others, in order.
#[must_use]
pub(crate) fn inconsistent_recordings(campaign: &Campaign) -> Vec<InconsistentRecording> {
    let long_enough = |r: &Recording| r.force.is_some() && r.len() >= LEAST_ROWS;
    let count = campaign.recordings.iter().filter(|r| long_enough(r)).count();
    if count < LEAST_RECORDINGS {
        return Vec::new();
    }
    let each = (ROWS / count).clamp(LEAST_ROWS, ROWS_OF_ONE);
    let of = |(recording, r)| Sample { recording, rows: sampled(r, each) };
    let samples: Vec<Sample> =
        campaign.recordings.iter().enumerate().filter(|(_, r)| long_enough(r)).map(of).collect();
    let Some(largest) = usual_largest(&samples) else { return Vec::new() };
    let Some((others, odd)) = consensus(&samples, largest) else { return Vec::new() };
    let mut found = Vec::new();
    for i in odd {
        match others.judge(&samples[i]) {
            Some(judged) => found.push(judged.found),
            // Where recordings differ and no mistake explains one, the muscle or the bench changed: that may imitate a mistake.
            None if others.is_far_off(&samples[i]) => return Vec::new(),
            None => {}
        }
    }
    found
}

/// The surface on which most recordings agree, and those that do not, in order; `None` where all agree.
///
/// A recording in a wrong unit bends the common surface and can make another one look inconsistent. So the recording is excluded that
/// agrees with the others once a mistake is corrected, if all agree better then. Where there is none, it is the one without which the
/// others agree best. Then the next, until they agree.
fn consensus(samples: &[Sample], largest: f64) -> Option<(ConsensusSurface, Vec<usize>)> {
    let mut kept: Vec<usize> = (0..samples.len()).collect();
    let mut odd = Vec::new();
    let without = |kept: &[usize], i: Option<usize>| {
        let rest = kept.iter().copied().filter(|k| Some(*k) != i).map(|k| &samples[k]);
        ConsensusSurface::on(rest, largest)
    };
    let mut consensus = without(&kept, None)?;
    let error_of = |consensus: &ConsensusSurface, i: usize| consensus.residual(&samples[i].rows);
    let most = MOST_ODD.min((samples.len() - 1) / 2);
    while odd.len() < most {
        let far = if odd.is_empty() { SEARCH_FROM } else { FAR_OFF };
        if kept.iter().all(|i| error_of(&consensus, *i) < far) {
            break;
        }
        let mut tried: Vec<usize> = kept.clone();
        tried.sort_by(|a, b| error_of(&consensus, *b).total_cmp(&error_of(&consensus, *a)));
        tried.truncate(TRIED);
        let exclusion = |i: usize| {
            let rest = without(&kept, Some(i))?;
            let disagreement: f64 = kept.iter().filter(|k| **k != i).map(|k| error_of(&rest, *k)).sum();
            let corrected = rest.judge(&samples[i]).map(|judged| disagreement + judged.left);
            Some(Exclusion { recording: i, rest, disagreement, corrected })
        };
        let with_all: f64 = kept.iter().map(|i| error_of(&consensus, *i)).sum();
        let Some(best) =
            Exclusion::best(tried.into_iter().filter_map(exclusion).collect(), kept.len(), with_all)
        else {
            break;
        };
        kept.retain(|k| *k != best.recording);
        odd.push(best.recording);
        consensus = best.rest;
    }
    odd.sort_unstable();
    (!odd.is_empty()).then_some((consensus, odd))
}

/// What the other recordings are without one of them.
struct Exclusion {
    recording: usize,
    /// The surface of the others.
    rest: ConsensusSurface,
    /// Sum of the residuals of the others.
    disagreement: f64,
    /// The same with the residual of this one, corrected by one mistake; `None` where none explains it.
    corrected: Option<f64>,
}

impl Exclusion {
    /// The best one of `count` recordings, which together have this sum of residuals.
    fn best(mut all: Vec<Self>, count: usize, with_all: f64) -> Option<Self> {
        all.sort_by(|a, b| a.disagreement.total_cmp(&b.disagreement));
        // A mistake that leaves the others in disagreement explains nothing: another recording is wrong.
        let mean_disagreement = all.first()?.disagreement / (count - 1) as f64;
        let allowed = with_all.min(count as f64 * mean_disagreement);
        let explained = |e: &Self| e.corrected.filter(|sum| *sum < allowed);
        let best =
            (0..all.len()).filter_map(|i| Some((explained(&all[i])?, i))).min_by(|a, b| a.0.total_cmp(&b.0));
        Some(all.swap_remove(best.map_or(0, |(_, i)| i)))
    }
}

/// Rows of a recording, evenly spread.
fn sampled(r: &Recording, most: usize) -> Vec<Row> {
    let Some(force) = &r.force else { return Vec::new() };
    let stride = (r.len() / most).max(1);
    (0..r.len()).step_by(stride).map(|i| [r.pressure[i], r.stroke[i], force[i]]).collect()
}

/// The upper quartile of the recordings' largest absolute force (each its 98 % quantile), N. A campaign may contain as many recordings of
/// a vented muscle as of one that pulls.
fn usual_largest(samples: &[Sample]) -> Option<f64> {
    let top = |s: &Sample| {
        let mut forces: Vec<f64> = s.rows.iter().map(|r| r[2].abs()).collect();
        let rank = forces.len() - 1 - forces.len() / 50;
        ranked(&mut forces, rank)
    };
    let mut tops: Vec<f64> = samples.iter().map(top).collect();
    let rank = tops.len() * 3 / 4;
    let usual = ranked(&mut tops, rank);
    (usual > 0.0).then_some(usual)
}

#[cfg(test)]
mod tests;
