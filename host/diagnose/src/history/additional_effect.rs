//! Effects beside the memory that settled points show: dry friction, and readings that come late.
//!
//! Each is a shift of pressure per unit of its amplitude. Unseen runs decide: they must be predicted better than with the friction of the
//! base model, and the jackknife over runs must know the amplitude. Unit of all tests: run.

use model_core::effects::Parameter;
use pam_fit::bench::Candidate;
use pam_fit::numerics::jackknife;
use pam_fit::numerics::student::{chance_beyond, half_width_95};

use super::campaign::{Points, Run};
use super::criteria::{KEPT_ERRORS, MEMORY_KEPT_GAIN};
use super::held_table::predicts_better;
use super::law::{Law, Layer};
use super::run_offset;
use super::unseen::{self, Unseen};
use crate::criteria::candidates::AMPLITUDE_BEYOND;
use crate::paired::errors_below;

/// An effect of the catalogue as a shift of pressure.
pub(super) struct Column {
    pub effect: Candidate,
    /// Which of the effect's amplitudes.
    pub amplitude: usize,
    /// The value of its shape, SI, where it has one.
    pub shape: Option<f64>,
    /// kPa per unit of it, at every point.
    pub shift: Vec<f64>,
}

/// An effect that unseen runs need beside the memory.
#[derive(Clone, Debug)]
pub(super) struct AdditionalEffect {
    pub effect: Candidate,
    /// Which of its amplitudes.
    pub amplitude: usize,
    /// The value of its shape, SI, where it has one.
    pub shape: Option<f64>,
    /// The amplitude, SI, and its standard error (jackknife over runs).
    pub value: f64,
    pub error: f64,
    /// Largest force, N.
    pub peak: f64,
    /// Share of the squared error of supported points that it removes beside the memory.
    pub gain: f64,
    /// Errors of unseen runs with the base model's friction at most, and with the effect, rms, N.
    pub rms: (f64, f64),
    /// Probability of such an amplitude by chance among all that were tried.
    pub chance: f64,
    /// How many were tried.
    pub tried: usize,
    /// Other effects that predict the runs as well.
    pub confusable: Vec<Candidate>,
    /// Unseen runs with it and the memory, and with it alone.
    pub with_memory: Unseen,
    pub alone: Unseen,
}

/// A law with further columns, its unseen runs, and their squared errors by run.
pub(super) struct Tried {
    law: Law,
    unseen: Unseen,
    pub squares: Vec<f64>,
    pub rms: f64,
}

/// The law with slips and more columns fitted beside it.
pub(super) fn tried(layer: &Layer<'_>, start: &Law, steps: &[Vec<f64>], more: &[&Vec<f64>]) -> Tried {
    let mut columns = steps.to_vec();
    columns.extend(more.iter().map(|c| (*c).clone()));
    let mut room = start.clone();
    more.iter().for_each(|_| room.fit = run_offset::with_room(&room));
    let law = layer.fit(&vec![true; layer.points.len()], Some(start.choice), &columns, Some(&room));
    let unseen = unseen::with_memory(layer, &law, &columns, true);
    measured(layer.points, law, unseen)
}

pub(super) fn measured(points: &Points, law: Law, unseen: Unseen) -> Tried {
    let supported = points.supported();
    let square = |r: &Run| -> f64 {
        let own = (r.points.0..r.points.1).filter(|i| supported[*i]);
        own.map(|i| unseen.error(points, i).powi(2)).filter(|e| e.is_finite()).sum()
    };
    let squares = points.runs.iter().map(square).collect();
    let rms = unseen.sizes(points, |i| supported[i]).rms;
    Tried { law, unseen, squares, rms }
}

/// Whether one predicts no worse than another, by the 95 % interval over runs.
pub(super) fn no_worse(one: &[f64], other: &[f64]) -> bool {
    errors_below(other, one) <= half_width_95(one.len().saturating_sub(1))
}

impl Tried {
    pub(super) fn sum(&self) -> f64 {
        self.squares.iter().sum()
    }

    /// The coefficient of the last column, and its standard error.
    pub(super) fn amplitude(&self) -> (f64, f64) {
        let last = |l: &Law| l.fit.theta.last().copied().unwrap_or(0.0);
        (last(&self.law), jackknife::deviation(&self.unseen.folds.iter().map(last).collect::<Vec<_>>()))
    }
}

fn best(of: &[Tried]) -> Option<usize> {
    (0..of.len()).min_by(|a, b| of[*a].sum().total_cmp(&of[*b].sum()))
}

/// The best of those whose amplitude is possible.
fn best_possible(of: &[Tried], columns: &[Column]) -> Option<usize> {
    let possible = |j: &usize| {
        let (value, column) = (of[*j].amplitude().0, &columns[*j]);
        // Settled points show a late force as a positive skew: no friction imitates it there.
        let parameter = column.effect.info().parameters.get(column.amplitude);
        let most = parameter.map_or(0.0, Parameter::largest);
        value > 0.0 && value <= AMPLITUDE_BEYOND * most
    };
    (0..of.len()).filter(possible).min_by(|a, b| of[*a].sum().total_cmp(&of[*b].sum()))
}

/// Other effects that predict the runs no worse than one of those tried.
fn as_good(all: &[Tried], columns: &[Column], as_this: usize) -> Vec<Candidate> {
    let as_good = |t: &Tried| no_worse(&t.squares, &all[as_this].squares) && t.amplitude().0 > 0.0;
    let tried = all.iter().zip(columns).filter(|(t, _)| as_good(t));
    let mut effects: Vec<Candidate> = tried.map(|(_, c)| c.effect).collect();
    effects.retain(|effect| *effect != columns[as_this].effect);
    effects.sort_unstable();
    effects.dedup();
    effects
}

/// The effect that predicts unseen runs best, where these need one in place of the base model's friction or beside it. `base` holds the
/// base model's friction, one column for each direction that friction may have.
pub(super) fn needed(
    layer: &Layer<'_>,
    (law, memory): (&Law, &Unseen),
    steps: &[Vec<f64>],
    base: &[Vec<f64>],
    columns: &[Column],
    areas: &[f64],
) -> Option<AdditionalEffect> {
    let points = layer.points;
    let mut without = vec![measured(points, law.clone(), memory.clone())];
    without.extend(base.iter().map(|column| tried(layer, law, steps, &[column])));
    let null = best(&without)?;
    let alone: Vec<Tried> = columns.iter().map(|c| tried(layer, law, steps, &[&c.shift])).collect();
    // The base model's friction stays only where it is needed, too.
    let beside = |c: &Column| null.checked_sub(1).map(|b| tried(layer, law, steps, &[&base[b], &c.shift]));
    let beside: Vec<Tried> = columns.iter().filter_map(beside).collect();
    let with = best_possible(&beside, columns)
        .zip(best_possible(&alone, columns))
        .filter(|(b, a)| predicts_better(&beside[*b].squares, &alone[*a].squares));
    let (all, at) = match with {
        Some((at, _)) => (&beside, at),
        None => (&alone, best_possible(&alone, columns)?),
    };
    let (found, column, without) = (&all[at], &columns[at], &without[null]);
    let (value, error) = found.amplitude();
    let gain = 1.0 - found.sum() / without.sum().max(f64::MIN_POSITIVE);
    let known = value > KEPT_ERRORS * error;
    if !(known && gain > MEMORY_KEPT_GAIN && !no_worse(&without.squares, &found.squares)) {
        return None;
    }
    let freedom = points.runs.len() as f64 - 1.0;
    let chance = 0.5 * chance_beyond(value / error.max(f64::MIN_POSITIVE), freedom);
    let friction = null.checked_sub(1).filter(|_| with.is_some()).map(|b| base[b].clone());
    let fitted: Vec<Vec<f64>> = steps.iter().cloned().chain(friction).chain([column.shift.clone()]).collect();
    let (alone, _) = unseen::shifted_curves(layer, &fitted, &found.law.fit.theta[1..]);
    let force = |i: usize| (column.shift[i] * areas[points.mounting[i]] * value).abs();
    Some(AdditionalEffect {
        effect: column.effect,
        amplitude: column.amplitude,
        shape: column.shape,
        value,
        error,
        peak: (0..points.len()).map(force).fold(0.0, f64::max),
        gain,
        rms: (without.rms, found.rms),
        chance: (chance * columns.len() as f64).min(1.0),
        tried: columns.len(),
        confusable: as_good(all, columns, at),
        with_memory: found.unseen.clone(),
        alone,
    })
}
