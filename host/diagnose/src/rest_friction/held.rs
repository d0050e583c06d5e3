//! Friction of a muscle whose length was held throughout: it follows the pressure.
//!
//! After a reversal of the pressure the strands slip one after the other, so that friction turns over a wide range of changes. It
//! is described by sets of bristles that break one after the other (generalised Maxwell slip: F. Al-Bender, V. Lampaert, J. Swevers,
//! IEEE Transactions on Automatic Control 50 (2005) 1883-1887, doi 10.1109/TAC.2005.858676), each over its own change of pressure.
//! Their shares are linear, and are fitted with the force; the change that static friction carries before any strand slips is not, and
//! is found by trial.

use rayon::prelude::*;

use super::{RestLaw, followed, slip_beyond_play, smoothed};
use crate::baselines::{self, Kind};
use crate::criteria::rest_friction::{
    BEGINNING_LEFT, CARRIED_PRESSURES, FOLLOWING_PRESSURES, HELD_ROWS, PRESSURE_SMOOTHING, REST_LAW_LEAVES,
    TURNING_PRESSURES,
};
use crate::rows::{RestFriction, Rows};

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
/// unknown. All sets of bristles count the same.
fn beginnings(rows: &Rows, slips: &[f64]) -> (Vec<u32>, Vec<f64>) {
    let mut left = [1.0; TURNING_PRESSURES.len()];
    let mut before = None;
    let along = |(recording, slipped): (&u32, &f64)| {
        if before != Some(*recording) {
            (before, left) = (Some(*recording), [1.0; TURNING_PRESSURES.len()]);
        } else {
            left.iter_mut().zip(TURNING_PRESSURES).for_each(|(z, over)| *z *= (-slipped.abs() / over).exp());
        }
        let kept = left.iter().sum::<f64>() / left.len() as f64;
        (if kept > BEGINNING_LEFT { recording + 1 } else { 0 }, kept)
    };
    rows.recording.iter().zip(slips).map(along).unzip()
}

/// The rows under a law: friction has the direction of one set of bristles, and with `others` the shares of the other sets are free.
fn under(rows: &Rows, (carries, over, pressure): (f64, f64, &[f64]), others: bool) -> Rows {
    let slips = slip_beyond_play(pressure, carries);
    let whole = direction(rows, &slips, over);
    let beyond = |over: &f64| {
        let part = direction(rows, &slips, *over);
        part.iter().zip(&whole).map(|(part, whole)| part - whole).collect()
    };
    let turning = if others { TURNING_PRESSURES.iter().map(beyond).collect() } else { Vec::new() };
    let contexts = rows.contexts().iter().zip(&whole);
    let contexts =
        contexts.map(|(c, whole)| model_core::effects::Context { direction: *whole, ..*c }).collect();
    let (rest, kept) = beginnings(rows, &slips);
    rows.with_contexts(contexts).with_rest_friction(RestFriction {
        turning,
        rest,
        kept,
        ..rows.at_rest().clone()
    })
}

/// Mean square error of the model on some of the rows, N².
fn error(rows: &Rows) -> f64 {
    let rows = rows.thinned(rows.len().div_ceil(HELD_ROWS).max(1));
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
    let best = |laws: Vec<(f64, f64, usize)>, others: bool| {
        let tried: Vec<f64> = laws
            .par_iter()
            .map(|(carries, over, smoothing)| {
                error(&under(rows, (*carries, *over, &pressures[*smoothing]), others))
            })
            .collect();
        laws.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let plays = (0..PRESSURE_SMOOTHING.len())
        .flat_map(|smoothing| CARRIED_PRESSURES.iter().map(move |h| (*h, TURNING_PRESSURES[0], smoothing)));
    let Some(((carries, _, smoothing), left)) = best(plays.collect(), true) else {
        return (rows.clone(), None);
    };
    if !(left < REST_LAW_LEAVES * error(rows)) {
        return (rows.clone(), None);
    }
    // Effects see one direction: that of the set of bristles that comes closest alone.
    let alone = FOLLOWING_PRESSURES.iter().map(|over| (carries, *over, smoothing)).collect();
    let over = best(alone, false).map_or(TURNING_PRESSURES[0], |((_, over, _), _)| over);
    let law = RestLaw::Follows { carries, over, smoothing };
    (under(rows, (carries, over, &pressures[smoothing]), true), Some(law))
}
