//! Friction of a muscle whose length was held throughout: it follows the pressure.
//!
//! After a reversal of the pressure the strands slip one after the other, so that friction turns over a wide range of changes. It
//! is described by sets of bristles that break one after the other (generalised Maxwell slip: F. Al-Bender, V. Lampaert, J. Swevers,
//! IEEE Transactions on Automatic Control 50 (2005) 1883-1887, doi 10.1109/TAC.2005.858676), each over its own change of pressure.
//! Their shares are linear, and are fitted with the force; so is how far they are bent when a recording begins. The change that static
//! friction carries before any strand slips is not linear, and is found by trial.

use rayon::prelude::*;

use super::{RestLaw, followed, slip_beyond_play, smoothed};
use crate::baselines::{self, Baseline, Kind};
use crate::criteria::rest_friction::{
    BEGINNING_LEFT, CARRIED_PRESSURES, FOLLOWING_PRESSURES, HELD_ROWS, PRESSURE_SMOOTHING, REST_LAW_LEAVES,
    TURNING_PRESSURES,
};
use crate::rows::{RestFriction, Rows};

/// Changes of pressure over which the parts of friction turn, and for each its share: of a set beside the first none is known where the
/// shares are still to be fitted.
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

/// Direction of friction at every row that turns over one change of the pressure. It begins at zero: nothing is known before the first row.
fn direction(rows: &Rows, slips: &[f64], over: f64) -> Vec<f64> {
    let mut direction = 0.0;
    let along = |(i, slipped): (usize, &f64)| {
        direction = followed(direction, *slipped, over);
        if rows.sign[i] == 0.0 { 0.0 } else { direction }
    };
    slips.iter().enumerate().map(along).collect()
}

/// How much is left at every row of the place that friction has at the beginning of its recording: what moved the muscle before is
/// unknown.
fn beginnings(rows: &Rows, slips: &[f64], sets: &Sets) -> (Vec<u32>, Vec<f64>) {
    let mut left = sets.shares.clone();
    let mut before = None;
    let along = |(recording, slipped): (&u32, &f64)| {
        if before != Some(*recording) {
            before = Some(*recording);
            left.clone_from(&sets.shares);
        } else {
            left.iter_mut().zip(&sets.over).for_each(|(z, over)| *z *= (-slipped.abs() / over).exp());
        }
        let kept: f64 = left.iter().sum();
        (if kept > BEGINNING_LEFT { recording + 1 } else { 0 }, kept)
    };
    rows.recording.iter().zip(slips).map(along).unzip()
}

/// The rows under a law: friction has the direction of the first set of bristles, and the shares of the others are free.
fn under(rows: &Rows, carries: f64, pressure: &[f64], sets: &Sets) -> Rows {
    let slips = slip_beyond_play(pressure, carries);
    let whole = direction(rows, &slips, sets.over[0]);
    let beyond = |over: &f64| {
        let part = direction(rows, &slips, *over);
        part.iter().zip(&whole).map(|(part, whole)| part - whole).collect()
    };
    let turning = sets.over[1..].iter().map(beyond).collect();
    let (rest, kept) = beginnings(rows, &slips, sets);
    let contexts = rows.contexts().iter().zip(&whole);
    let contexts =
        contexts.map(|(c, whole)| model_core::effects::Context { direction: *whole, ..*c }).collect();
    rows.with_contexts(contexts).with_rest_friction(RestFriction {
        turning,
        rest,
        kept,
        ..rows.at_rest().clone()
    })
}

/// The model fitted to some of the rows, and its mean square error on them, N².
fn fitted(rows: &Rows) -> (Baseline, f64) {
    let rows = rows.thinned(rows.len().div_ceil(HELD_ROWS).max(1));
    let fitted = baselines::fit(&rows, Kind::Stiff, &[]);
    let error = fitted.per_row(&rows);
    (fitted, error)
}

/// Finds how friction follows the pressure: the rows with its direction, and the law; none where friction turns at each reversal of the
/// pressure, or where the pressure never reverses.
pub(super) fn settle(rows: &Rows) -> (Rows, Option<RestLaw>) {
    let goes = |way: f64| (0..rows.len()).any(|i| rows.sign[i] == way && rows.root_weight()[i] > 0.0);
    if !(goes(1.0) && goes(-1.0)) {
        return (rows.clone(), None);
    }
    let pressures: Vec<Vec<f64>> = PRESSURE_SMOOTHING.iter().map(|h| smoothed(rows, *h)).collect();
    let best = |laws: Vec<(f64, f64, usize)>, sets: fn(f64) -> Sets| {
        let tried: Vec<f64> = laws
            .par_iter()
            .map(|(carries, over, smoothing)| {
                fitted(&under(rows, *carries, &pressures[*smoothing], &sets(*over))).1
            })
            .collect();
        laws.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let plays = (0..PRESSURE_SMOOTHING.len())
        .flat_map(|smoothing| CARRIED_PRESSURES.iter().map(move |h| (*h, TURNING_PRESSURES[0], smoothing)));
    let Some(((carries, _, smoothing), left)) = best(plays.collect(), Sets::with_others) else {
        return (rows.clone(), None);
    };
    if !(left < REST_LAW_LEAVES * fitted(rows).1) {
        return (rows.clone(), None);
    }
    // Effects see one direction: that of the set of bristles that comes closest alone.
    let alone = FOLLOWING_PRESSURES.iter().map(|over| (carries, *over, smoothing)).collect();
    let over = best(alone, Sets::one).map_or(TURNING_PRESSURES[0], |((_, over, _), _)| over);
    let under = |sets: &Sets| under(rows, carries, &pressures[smoothing], sets);
    let sets = Sets::with_others(over);
    let first = under(&sets);
    let sets = sets.with_shares(&fitted(&first).0);
    (under(&sets), Some(RestLaw::Follows { carries, over, smoothing }))
}
