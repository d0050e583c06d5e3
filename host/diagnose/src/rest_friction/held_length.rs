//! Friction of a muscle whose length was held throughout: it follows the pressure.
//!
//! After a reversal of the pressure the strands slip one after the other, so that friction turns over a wide range of changes. It
//! is described by sets of bristles that break one after the other (generalised Maxwell slip: F. Al-Bender, V. Lampaert, J. Swevers,
//! IEEE Transactions on Automatic Control 50 (2005) 1883-1887, doi 10.1109/TAC.2005.858676), each over its own change of pressure.
//! Their shares, and how far they are bent when a recording begins, are linear and are fitted with the force. The change that static
//! friction carries before any strand slips is not linear, and is found by trial.

use rayon::prelude::*;

use super::{RestLaw, followed, slip_beyond_play, smoothed};
use crate::baselines::{self, Baseline, Kind};
use crate::criteria::rest_friction::{
    BEGINNING_LEFT, BEGINNING_UNKNOWN, CARRIED_PRESSURES, FOLLOWING_PRESSURES, HELD_ROWS, MOST_BEGINNINGS,
    PRESSURE_SMOOTHING, REST_LAW_LEAVES, TURNING_PRESSURES,
};
use crate::rows::Rows;
use model_core::effects::Context;

/// Changes of pressure over which the parts of friction turn, and the share of each. Before a fit all shares are the same.
struct Sets {
    over: Vec<f64>,
    shares: Vec<f64>,
}

impl Sets {
    /// One set alone.
    fn one(over: f64) -> Self {
        Self { over: vec![over], shares: vec![1.0] }
    }

    /// One set that the effects see and others beside it, all with the same share.
    fn with_others(over: f64) -> Self {
        let over: Vec<f64> = std::iter::once(over).chain(TURNING_PRESSURES).collect();
        Self { shares: vec![1.0 / over.len() as f64; over.len()], over }
    }

    /// With the shares of a fit; what the others do not have is the first one's.
    fn with_shares(self, fitted: &Baseline) -> Self {
        let mut shares: Vec<f64> =
            std::iter::once(1.0 - fitted.turning.iter().sum::<f64>()).chain(fitted.turning.clone()).collect();
        shares.iter_mut().for_each(|s| *s = s.max(0.0));
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|s| *s /= sum.max(f64::MIN_POSITIVE));
        Self { shares, ..self }
    }
}

/// How friction follows the pressure.
struct Law<'a> {
    /// Change of pressure that static friction carries, half-width, Pa.
    carries: f64,
    /// Pressure that is followed, Pa.
    pressure: &'a [f64],
    sets: Sets,
    /// Direction of friction at the beginning of each recording; empty while it is unknown.
    begun: Vec<f64>,
}

/// Whether a row is the first of its recording.
fn begins(rows: &Rows, i: usize) -> bool {
    i == 0 || rows.recording[i - 1] != rows.recording[i]
}

impl Law<'_> {
    /// Direction of friction at every row that turns over one change of the pressure. Where the direction at the beginning of a recording
    /// is unknown it continues from the recording before.
    fn direction(&self, rows: &Rows, slips: &[f64], over: f64) -> Vec<f64> {
        let mut begun = self.begun.iter();
        let mut direction = 0.0;
        let along = |(i, slipped): (usize, &f64)| {
            direction = followed(direction, *slipped, over);
            if begins(rows, i) {
                direction = begun.next().copied().unwrap_or(direction);
            }
            direction
        };
        slips.iter().enumerate().map(along).collect()
    }

    /// How much is left at every row of the place that friction has at the beginning of its recording, and the recording's number until
    /// next to nothing is left.
    fn left_of_beginnings(&self, rows: &Rows, slips: &[f64]) -> (Vec<u32>, Vec<f64>) {
        let Sets { over, shares } = &self.sets;
        let mut left = shares.clone();
        let along = |(i, slipped): (usize, &f64)| {
            if begins(rows, i) {
                left.clone_from(shares);
            } else {
                left.iter_mut().zip(over).for_each(|(z, over)| *z *= (-slipped.abs() / over).exp());
            }
            let kept: f64 = left.iter().sum();
            (if kept > BEGINNING_LEFT { rows.recording[i] + 1 } else { 0 }, kept)
        };
        slips.iter().enumerate().map(along).unzip()
    }

    /// The rows under the law: friction has the direction of the first set of bristles, and the shares of the others are free. So is the
    /// place at the beginning of each recording while it is unknown.
    fn of(&self, rows: &Rows) -> Rows {
        let slips = slip_beyond_play(self.pressure, self.carries);
        let whole = self.direction(rows, &slips, self.sets.over[0]);
        let beyond = |over: &f64| {
            let part = self.direction(rows, &slips, *over);
            part.iter().zip(&whole).map(|(part, whole)| part - whole).collect()
        };
        let mut at_rest = rows.at_rest().clone();
        at_rest.turning = self.sets.over[1..].iter().map(beyond).collect();
        if self.begun.is_empty() {
            (at_rest.rest, at_rest.kept) = self.left_of_beginnings(rows, &slips);
        }
        let contexts = rows.contexts().iter().zip(&whole);
        let contexts = contexts.map(|(c, whole)| Context { direction: *whole, ..*c }).collect();
        rows.with_contexts(contexts).with_rest_friction(at_rest)
    }

    /// Rows at the beginnings of recordings that are not judged: the place from which friction turns is known from these rows alone. None
    /// where that would leave out too many.
    fn unknown(&self, rows: &Rows) -> Vec<bool> {
        let slips = slip_beyond_play(self.pressure, self.carries);
        let (_, left) = self.left_of_beginnings(rows, &slips);
        let judged = |i: &usize| rows.root_weight()[*i] > 0.0;
        let unknown: Vec<bool> = left.iter().map(|kept| *kept > BEGINNING_UNKNOWN).collect();
        let count = (0..rows.len()).filter(judged).filter(|i| unknown[*i]).count();
        let most = MOST_BEGINNINGS * (0..rows.len()).filter(judged).count() as f64;
        if count as f64 > most { vec![false; rows.len()] } else { unknown }
    }

    /// The law with the shares and the beginnings that a fit of its rows found.
    fn with_found(self, rows: &Rows, under: &Rows, fitted: &Baseline) -> Self {
        let first = |i: &usize| begins(rows, *i);
        let begun = (0..rows.len()).filter(first).zip(&fitted.places).map(|(i, place)| {
            let turned = under.at_rest().turning.iter().zip(&fitted.turning);
            let beyond: f64 = turned.map(|(part, share)| part[i] * share).sum();
            (under.contexts()[i].direction + beyond + place).clamp(-1.0, 1.0)
        });
        let begun = begun.collect();
        Self { begun, sets: self.sets.with_shares(fitted), ..self }
    }
}

/// Mean square error of the model on some of the rows, N².
fn error(rows: &Rows) -> f64 {
    let rows = rows.downsampled(rows.len().div_ceil(HELD_ROWS).max(1));
    baselines::fit(&rows, Kind::Stiff, &[]).per_row(&rows)
}

/// Finds how friction follows the pressure: the rows with its direction, and the law; none where friction turns at each reversal of the
/// pressure, or where the pressure never reverses.
pub(super) fn settle(rows: &Rows) -> (Rows, Option<RestLaw>) {
    let goes = |way: f64| (0..rows.len()).any(|i| rows.sign[i] == way && rows.root_weight()[i] > 0.0);
    if !(goes(1.0) && goes(-1.0)) {
        return (rows.clone(), None);
    }
    let pressures: Vec<Vec<f64>> = PRESSURE_SMOOTHING.iter().map(|h| smoothed(rows, *h)).collect();
    let law = |(carries, over, smoothing): (f64, f64, usize), sets: fn(f64) -> Sets| Law {
        carries,
        pressure: &pressures[smoothing],
        sets: sets(over),
        begun: Vec::new(),
    };
    let best = |tried: Vec<(f64, f64, usize)>, sets: fn(f64) -> Sets| {
        let errors: Vec<f64> = tried.par_iter().map(|t| error(&law(*t, sets).of(rows))).collect();
        tried.into_iter().zip(errors).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let plays = (0..PRESSURE_SMOOTHING.len())
        .flat_map(|smoothing| CARRIED_PRESSURES.iter().map(move |h| (*h, TURNING_PRESSURES[0], smoothing)));
    let Some(((carries, _, smoothing), left)) = best(plays.collect(), Sets::with_others) else {
        return (rows.clone(), None);
    };
    if !(left < REST_LAW_LEAVES * error(rows)) {
        return (rows.clone(), None);
    }
    // Effects see one direction: that of the set of bristles that comes closest alone.
    let alone = FOLLOWING_PRESSURES.iter().map(|over| (carries, *over, smoothing)).collect();
    let over = best(alone, Sets::one).map_or(TURNING_PRESSURES[0], |((_, over, _), _)| over);
    // How a beginning fades depends on the shares of the sets.
    let mut found = law((carries, over, smoothing), Sets::with_others);
    let first = baselines::fit(&found.of(rows), Kind::Stiff, &[]);
    found.sets = found.sets.with_shares(&first);
    let under = found.of(rows);
    let fitted = baselines::fit(&under, Kind::Stiff, &[]);
    let found = found.with_found(rows, &under, &fitted);
    let unknown = found.unknown(rows);
    (found.of(rows).without(|i| unknown[i]), Some(RestLaw::Follows { carries, over, smoothing }))
}
