//! The memory of a muscle over a campaign of isometric staircases, found before any static model is fitted.
//!
//! Visits of different runs to the same pressure, length and direction differ by history alone, so a free static curve for each mounting is all
//! that is needed beside it.
//!
//! | file | what |
//! | --- | --- |
//! | `campaign` | mountings, runs and their clock |
//! | `base_friction` | the friction of the base model, taken out first |
//! | `staircase` | pulses, settled points, direction |
//! | `memory` | the relaxing states, stepped exactly |
//! | `spline`, `shift_fit` | free curves on a shifted pressure |
//! | `law` | threshold of each mounting, relaxed share, stress-free pressure, unrecorded times |
//! | `table_fit` | the memory as an effect of a table |
//! | [`table_unseen`] | each run predicted from the others by tables |
//! | `unseen` | each run predicted from the others; jackknife over runs |
//! | `run_offset` | slips and bad runs |
//! | `additional_effect` | which effect unseen runs need beside the memory |
//! | `friction` | dry friction beside the memory, and in place of its fast part |
//! | `sensor_dynamics` | lag, delay, and filter of a sensor |
//! | `hysteresis` | the gap between filling and emptying, and its cause |
//! | `findings` | documented contrasts with intervals over runs or mountings |
//! | `slack_reading` | what the load cell reads of a slack muscle |
//! | `first_runs` | the search on the other runs, where the first of each mounting alone differs without a memory |
//! | `places` | where the static error is concentrated: run within mounting, time since mounting, mounting |
//! | `judge` | rules of the verdict |
//! | [`answer`] | the findings as values and JSON |
//! | `memory_removal`, `entries` | the history beside what the static search says, and its entries in the answer |
//! | [`crate::criteria`] | every constant |

pub mod answer;

mod additional_effect;
mod base_friction;
mod campaign;
mod entries;
mod findings;
mod first_runs;
mod friction;
mod held_table;
mod hysteresis;
mod judge;
mod law;
mod memory;
mod memory_removal;
mod places;
mod run_offset;
mod sensor_dynamics;
mod shift_fit;
mod slack_reading;
mod spline;
mod staircase;
pub(crate) mod table_fit;
pub mod table_unseen;
#[cfg(test)]
mod tests;
mod unseen;

pub use answer::History;
pub use entries::is_from_history;
pub(crate) use first_runs::without_first_runs;
pub use memory_removal::diagnose;
pub(crate) use memory_removal::reliable_recordings;

use model_core::braid::Geometry;
use pam_data::recording::Campaign;

use self::additional_effect::{AdditionalEffect, Column};
use self::campaign::Points;
use self::criteria::{LEAST_POINTS, MEMORY_SINGLE_TIMES, TIMES};
use self::findings::Visits;
use self::first_runs::FirstRuns;
use self::friction::Instead;
use self::law::{Law, Layer};
use self::run_offset::Event;
use self::slack_reading::SlackReading;
use self::unseen::Unseen;
use super::verdict::Region;
pub(crate) use crate::criteria::history as criteria;

/// A history with what its use needs beside the answer.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub answer: History,
    /// Where the static error of held-out runs is concentrated.
    pub regions: Vec<Region>,
    /// First runs that differ from those that follow, where no memory is named.
    first_runs: Option<FirstRuns>,
    /// By recording: times, s, and shifts of pressure, Pa.
    pub shifts: Vec<(Vec<f64>, Vec<f64>)>,
    /// The largest force that the memory makes, N.
    pub peak: f64,
    /// The effect that unseen runs need beside the memory.
    needed: Option<AdditionalEffect>,
    /// What the load cell reads of a slack muscle.
    slack_reading: Option<SlackReading>,
}

/// All fits of a campaign.
struct Fits<'a> {
    layer: Layer<'a>,
    /// The law alone, and its unseen runs.
    law: Law,
    memory: Unseen,
    /// A curve for each mounting and direction; a curve for each mounting.
    by_direction: Unseen,
    plain: Unseen,
    /// Offsets of runs, kPa.
    offsets: Vec<f64>,
    events: Vec<Event>,
    /// The law beside slips, and its unseen runs; absent without a slip.
    with_slips: Option<(Law, Unseen)>,
    /// Unseen errors with the slips alone.
    slips_alone: Option<Unseen>,
    needed: Option<AdditionalEffect>,
    instead: Instead,
    slack_reading: Option<SlackReading>,
    /// Unseen error of the best law with one time constant over that of the spectrum, rms.
    single: f64,
}

impl Fits<'_> {
    /// The law that is reported: beside slips where there are any.
    fn best(&self) -> (&Law, &Unseen) {
        self.with_slips.as_ref().map_or((&self.law, &self.memory), |(l, u)| (l, u))
    }
}

/// The history of a campaign; `None` where it is none of isometric staircases with repeated runs.
#[must_use]
pub fn history(campaign: &Campaign, geometry: &Geometry) -> Option<History> {
    found(campaign, geometry).map(|f| f.answer)
}

pub(super) fn found(campaign: &Campaign, geometry: &Geometry) -> Option<Found> {
    let rest_length = geometry.rest_length.metres();
    let read = campaign::points(campaign, rest_length)?;
    let first = fits(&read, geometry, true);
    let moved = base_friction::removed(&first, geometry);
    let friction = moved.as_ref().map(|(_, coefficient)| *coefficient);
    // No other effect was needed in its place; a slack muscle has no friction.
    let (points, fits) = match &moved {
        Some((points, _)) => {
            let slack_reading = first.slack_reading.clone();
            (points, Fits { slack_reading, ..fits(points, geometry, false) })
        }
        None => (&read, first),
    };
    let answer = History { friction, ..judge::answer(&read, &fits, campaign, rest_length) };
    let (law, _) = fits.best();
    let peak = (0..points.len())
        .map(|i| (law.columns[0][i] * law.fit.theta[0] * fits.layer.slope(law, i)).abs())
        .fold(0.0, f64::max);
    let shifts = points
        .runs
        .iter()
        .map(|run| {
            let own = run.points.0..run.points.1;
            let moved = |i: usize| -> f64 {
                law.columns.iter().zip(&law.fit.theta).map(|(q, t)| 1e3 * q[i] * t).sum()
            };
            (own.clone().map(|i| points.time[i] + run.zero).collect(), own.map(moved).collect())
        })
        .collect();
    let regions = places::regions(points, &fits.by_direction, &fits.layer.clocks[law.choice.pause].1.since);
    // A named memory explains what first runs differ by.
    let first_runs = if answer.named { None } else { FirstRuns::of(points, &Visits::new(points)) };
    Some(Found {
        answer,
        regions,
        first_runs,
        shifts,
        peak,
        needed: fits.needed.clone(),
        slack_reading: fits.slack_reading.clone(),
    })
}

/// What the load cell reads of a slack muscle, in any campaign at held lengths; `None` with fewer than two mountings that are slack at some
/// pressure.
fn slack_reading(campaign: &Campaign, geometry: &Geometry) -> Option<SlackReading> {
    let points = campaign::held_points(campaign, geometry.rest_length.metres())?;
    if (points.len() as f64) < LEAST_POINTS || points.largest_force() <= 0.0 {
        return None;
    }
    let first = slack_reading::of(&points, &law::thresholds(&points))?;
    // The pull seems to begin at another pressure where the zero is off.
    let freed =
        Points { force: points.force.iter().map(|f| f - first.zero_read()).collect(), ..points.clone() };
    slack_reading::of(&points, &law::thresholds(&freed))
}

/// All fits; those that find an effect beside the memory where one may be needed.
fn fits<'a>(points: &'a Points, geometry: &Geometry, may_need_effect: bool) -> Fits<'a> {
    let layer = Layer::new(points, &TIMES);
    let everything = vec![true; points.len()];
    let law = layer.fit(&everything, None, &[], None);
    let memory = unseen::with_memory(&layer, &law, &[], false);
    let offsets = run_offset::offsets(&layer, &law);
    let events = run_offset::events(&layer, &law, &offsets);
    let steps: Vec<Vec<f64>> = events
        .iter()
        .filter(|e| e.lasts && e.sure)
        .map(|e| run_offset::step_column(points, e.mounting, e.run))
        .collect();
    let with_slips = (!steps.is_empty()).then(|| {
        let mut start = law.clone();
        steps.iter().for_each(|_| start.fit = run_offset::with_room(&start));
        let law = layer.fit(&everything, None, &steps, Some(&start));
        let unseen = unseen::with_memory(&layer, &law, &steps, false);
        (law, unseen)
    });
    let slips_alone =
        (!steps.is_empty()).then(|| unseen::shifted_curves(&layer, &steps, &vec![0.0; steps.len()]).0);
    let (reported, seen) = with_slips.as_ref().map_or((&law, &memory), |(l, u)| (l, u));
    let areas = friction::areas(&layer, reported);
    let mut directions = friction::directions(&layer, &areas, geometry);
    let drive = directions.first();
    let instead = drive.map(|d| friction::instead(&layer, (reported, seen), &steps, d)).unwrap_or_default();
    let needed = if may_need_effect {
        let laws = directions.iter_mut().flat_map(|d| std::mem::take(&mut d.laws));
        let columns: Vec<Column> = laws.chain(sensor_dynamics::columns(points)).collect();
        let base: Vec<Vec<f64>> = directions.into_iter().map(|d| d.base).collect();
        additional_effect::needed(&layer, (reported, seen), &steps, &base, &columns, &areas)
    } else {
        None
    };
    let single = single_time(points, &law, &memory);
    Fits {
        by_direction: unseen::static_curves(points, true),
        plain: unseen::static_curves(points, false),
        slack_reading: slack_reading::of(points, &layer.thresholds),
        layer,
        law,
        memory,
        offsets,
        events,
        with_slips,
        slips_alone,
        needed,
        instead,
        single,
    }
}

/// See [`Fits::single`].
fn single_time(points: &Points, law: &Law, memory: &Unseen) -> f64 {
    let supported = points.supported();
    let counts = |i: usize| supported[i];
    let spectrum = memory.sizes(points, counts).rms;
    let best = MEMORY_SINGLE_TIMES
        .iter()
        .map(|time| {
            let layer = Layer::new(points, &[*time]);
            let one = layer.fit(&vec![true; points.len()], Some(law.choice), &[], None);
            unseen::with_memory(&layer, &one, &[], true).sizes(points, counts).rms
        })
        .fold(f64::INFINITY, f64::min);
    if spectrum > 0.0 && best.is_finite() { best / spectrum } else { 1.0 }
}
