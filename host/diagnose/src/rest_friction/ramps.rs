//! Ramps of the pressure at held length: how far the pressure goes until friction has turned.
//!
//! After a reversal of the pressure the strands stretch before they slip, so that friction turns over a change of pressure that
//! depends on the muscle. Rows of a ramp are judged once friction has turned. The ramps themselves show when that is: both ways
//! of the pressure are compared with a friction that follows it as two sets of bristles do (Dahl's law, one set breaking later).

use rayon::prelude::*;

use super::{followed, slip_beyond_play};
use crate::baselines::Baseline;
use crate::criteria::rest_friction::{
    FOLLOWING_PRESSURES, LATER_SHARES, LATER_TIMES, NEARBY_FACTORS, RAMP_CARRIED, RAMP_LAW_LEAVES,
    RAMP_PRECISION, RAMP_ROWS, RAMP_TURNED,
};
use crate::rows::Rows;
use pam_fit::numerics::least_squares::least_squares;

/// How friction turns while the pressure ramps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turning {
    /// Change of pressure that static friction carries, half-width, Pa.
    carries: f64,
    /// Change over which the most of it turns, Pa.
    over: f64,
    /// Share that turns later.
    later: f64,
}

impl Turning {
    /// Change of the pressure, Pa, by which 63 % of a turn is done.
    pub(crate) fn most_done(self) -> f64 {
        let left = |p: f64| {
            (1.0 - self.later) * (-p / self.over).exp() + self.later * (-p / (self.over * LATER_TIMES)).exp()
        };
        // The rest falls to 1/e after the one change for the first set of bristles, and after the other for the second.
        let (mut low, mut high) = (self.over, self.over * LATER_TIMES);
        while high - low > RAMP_PRECISION * self.over {
            let middle = 0.5 * (low + high);
            if left(middle) > (-1.0_f64).exp() { low = middle } else { high = middle }
        }
        self.carries + high
    }

    /// Direction of friction along one hold that begins with a direction.
    fn directions(self, pressure: &[f64], begun: f64) -> Vec<f64> {
        let (mut soon, mut late) = (begun, begun);
        slip_beyond_play(pressure, self.carries)
            .into_iter()
            .map(|slipped| {
                soon = followed(soon, slipped, self.over);
                late = followed(late, slipped, self.over * LATER_TIMES);
                (1.0 - self.later) * soon + self.later * late
            })
            .collect()
    }
}

/// A hold on which the pressure ramps.
struct Ramps {
    from: usize,
    to: usize,
    /// Direction of friction at its beginning. Where the recording begins with the hold it is unknown; this is then the one that
    /// takes longest to turn.
    begun: f64,
    /// Rows at its beginning whose direction is unknown.
    unknown: usize,
    /// Rows that show the law: those at which the muscle pulls, counted from the first of the hold. Empty where the pressure ramps one way.
    telling: Vec<usize>,
}

/// The holds with ramps.
fn ramps(rows: &Rows, fitted: &Baseline) -> Vec<Ramps> {
    let held = |i: usize| rows.contexts()[i].speed == 0.0;
    let mut found = Vec::new();
    let mut from = 0;
    let indices: Vec<usize> = (0..rows.len()).collect();
    for stretch in indices.chunk_by(|a, b| held(*a) == held(*b) && rows.recording[*a] == rows.recording[*b]) {
        let to = from + stretch.len();
        let ramps = |way: f64| (from..to).any(|i| rows.on_ramp[i] && rows.sign[i] == way);
        if held(from) && (ramps(1.0) || ramps(-1.0)) {
            let pulls = |i: &usize| !rows.vented[*i] && fitted.quasi[*i] > 0.0 && rows.force[*i] > 0.0;
            let mut telling: Vec<usize> = (from..to).filter(pulls).map(|i| i - from).collect();
            // One way alone does not show a turn: the table's own error over the pressure looks like it.
            if !(ramps(1.0) && ramps(-1.0)) || telling.len() < RAMP_ROWS {
                telling.clear();
            }
            let (begun, unknown) = beginning(rows, from, to);
            found.push(Ramps { from, to, begun, unknown, telling });
        }
        from = to;
    }
    found
}

/// The direction of friction at the beginning of a hold, as far as the recording shows it, and for how many rows it is unknown.
fn beginning(rows: &Rows, from: usize, to: usize) -> (f64, usize) {
    if from > 0 && rows.recording[from - 1] == rows.recording[from] {
        return (rows.sign[from], 0);
    }
    let ramp = (from..to).find(|i| rows.on_ramp[*i]).unwrap_or(from);
    (-rows.sign[ramp], ramp - from)
}

/// What a law leaves of the ramps, N²: beside it the table's error at this length, a cubic of the pressure, and the direction at the
/// beginning of the hold are fitted.
fn energy(rows: &Rows, fitted: &Baseline, ramps: &[Ramps], law: Turning) -> f64 {
    let of = |ramp: &Ramps| {
        let pressure: Vec<f64> = rows.contexts()[ramp.from..ramp.to].iter().map(|c| c.pressure).collect();
        let (upright, bent) = (law.directions(&pressure, 0.0), law.directions(&pressure, 1.0));
        let top = pressure.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let row = |k: &usize| {
            let i = ramp.from + k;
            let (p, gap) = (pressure[*k] / top, fitted.quasi[i] * fitted.friction[i]);
            let without = fitted.raw_residual[i] - gap * rows.contexts()[i].direction;
            ([1.0, p, p * p, p * p * p, gap * upright[*k], gap * (bent[*k] - upright[*k])], without)
        };
        let all: Vec<([f64; 6], f64)> = ramp.telling.iter().map(row).collect();
        let found = least_squares(&all, 6);
        let left =
            |(c, target): &([f64; 6], f64)| target - c.iter().zip(&found).map(|(c, x)| c * x).sum::<f64>();
        all.iter().map(|r| left(r).powi(2)).sum::<f64>()
    };
    ramps.iter().map(of).sum()
}

/// The law of the least error, where the ramps show that friction turns over more than the pressure's noise.
fn law(rows: &Rows, fitted: &Baseline, ramps: &[Ramps]) -> Option<Turning> {
    let least = |laws: Vec<Turning>| {
        let tried: Vec<f64> = laws.par_iter().map(|l| energy(rows, fitted, ramps, *l)).collect();
        laws.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let at_once = Turning { carries: 0.0, over: FOLLOWING_PRESSURES[0], later: 0.0 };
    let as_judged = energy(rows, fitted, ramps, at_once);
    let mut grid = Vec::new();
    for over in FOLLOWING_PRESSURES {
        for carries in RAMP_CARRIED {
            grid.push(Turning { carries, over, ..at_once });
            grid.extend(LATER_SHARES.map(|later| Turning { carries, over, later }));
        }
    }
    let mut best = least(grid)?;
    for factors in NEARBY_FACTORS {
        let near = factors.iter().map(|f| Turning { over: best.0.over * f, ..best.0 }).collect();
        best = least(near).filter(|(_, e)| *e < best.1).unwrap_or(best);
    }
    (best.1 < RAMP_LAW_LEAVES * as_judged).then_some(best.0)
}

/// The rows without those of holds with ramps on which friction still turns, with the direction that it has on the others; and the
/// law, where the ramps show one.
pub(super) fn settle(rows: &Rows, fitted: &Baseline) -> (Rows, Option<Turning>) {
    let ramps = ramps(rows, fitted);
    let Some(law) = law(rows, fitted, &ramps) else { return (rows.clone(), None) };
    let mut turning = vec![false; rows.len()];
    let mut contexts = rows.contexts().to_vec();
    for ramp in &ramps {
        turning[ramp.from..ramp.from + ramp.unknown].fill(true);
        let pressure: Vec<f64> = contexts[ramp.from..ramp.to].iter().map(|c| c.pressure).collect();
        for (k, direction) in law.directions(&pressure, ramp.begun).into_iter().enumerate() {
            let i = ramp.from + k;
            turning[i] |= !rows.vented[i] && (rows.sign[i] - direction).abs() > RAMP_TURNED;
            if rows.on_ramp[i] {
                contexts[i].direction = direction;
            }
        }
    }
    (rows.with_contexts(contexts).without(|i| turning[i]), Some(law))
}
