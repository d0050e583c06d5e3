//! Friction at held length: it stays, fades, or follows the drift of the pressure.
//!
//! The model holds the sign of the last motion. On a real bench the air's ripple shakes the braid, so that friction ends near
//! the middle of the gap between the branches, and a regulator that drifts by a few kilopascals reverses it: static friction
//! carries small changes of pressure (a play of half-width `h`), what goes beyond lets the strands slip, and over a change `b`
//! the friction follows to the other branch. That is not missing physics of the model in motion; but left out, every effect that
//! acts at rest would be mistaken for it. The rows at rest decide which of the three it is, and how fast.

use rayon::prelude::*;

use super::baselines::{self, Baseline, Kind};
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::rest_friction::{
    CARRIED_PRESSURES, FEWEST_MOVING_ROWS, FOLLOWING_PRESSURES, HOLD_ROWS, MOST_RESTS, NEARBY_FACTORS,
    NO_LAW_RATIO, PRESSURE_SMOOTHING, REST_JUMP, REST_LAW_LEAVES, RESTING_AFTER, RESTING_ROWS,
    SETTLING_TIMES,
};
use super::remark;
use super::rows::{RestFriction, Rows};

mod held_length;
mod ramps;
mod steps;

pub(crate) use ramps::Turning;

/// The law of friction at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RestLaw {
    /// It fades: `s → s e^(−t/τ)`, `t` since the braid last moved, s.
    Fades(f64),
    /// It follows the pressure.
    Follows {
        /// Half-width of the play that static friction carries, Pa.
        carries: f64,
        /// Change beyond it over which friction comes to the other branch, Pa.
        over: f64,
        /// Which smoothing of the pressure.
        smoothing: usize,
    },
}

impl From<RestLaw> for remark::RestFriction {
    fn from(law: RestLaw) -> Self {
        match law {
            RestLaw::Fades(time) => Self::Fades(time),
            RestLaw::Follows { carries, over, .. } => Self::Follows { carries, over },
        }
    }
}

/// Rows of each stay at one length.
fn holds(rows: &Rows) -> Vec<(usize, usize)> {
    let n = rows.len();
    let held = |i: usize| rows.contexts()[i].speed == 0.0 && !rows.vented[i];
    let mut found = Vec::new();
    let mut from = 0;
    while from < n {
        let mut to = from + 1;
        while to < n && held(to) == held(from) && rows.recording[to] == rows.recording[from] {
            to += 1;
        }
        if held(from) && to - from > HOLD_ROWS {
            found.push((from, to));
        }
        from = to;
    }
    found
}

/// The pressure with its noise smoothed over `half` rows each way, within recordings.
fn smoothed(rows: &Rows, half: usize) -> Vec<f64> {
    let n = rows.len();
    (0..n)
        .map(|i| {
            let (a, b) = (i.saturating_sub(half), (i + half + 1).min(n));
            let same = (a..b).filter(|j| rows.recording[*j] == rows.recording[i]);
            let (sum, count) = same.fold((0.0, 0.0), |(s, c), j| (s + rows.contexts()[j].pressure, c + 1.0));
            sum / count
        })
        .collect()
}

/// How far every change of pressure goes beyond what static friction carries: what a play of half-width `carries` lets through.
/// The play has its memory: it follows the pressure through motion and over pauses too.
fn slip_beyond_play(pressure: &[f64], carries: f64) -> Vec<f64> {
    let mut carried = 0.0;
    let mut last = pressure.first().copied().unwrap_or(0.0);
    pressure
        .iter()
        .map(|p| {
            let reached: f64 = carried + p - last;
            last = *p;
            carried = reached.clamp(-carries, carries);
            reached - carried
        })
        .collect()
}

/// The friction's direction after the pressure has gone on by `slipped` (Pa) beyond what static friction carries: it follows over `over` (Pa).
pub(crate) fn followed(direction: f64, slipped: f64, over: f64) -> f64 {
    let way = if slipped > 0.0 { 1.0 } else { -1.0 };
    way + (direction - way) * (-slipped.abs() / over).exp()
}

/// The friction's direction in every hold under a law.
fn directions(rows: &Rows, holds: &[(usize, usize)], pressures: &[Vec<f64>], law: RestLaw) -> Vec<Vec<f64>> {
    match law {
        RestLaw::Fades(time) => holds
            .iter()
            .map(|(from, to)| {
                (*from..*to).map(|i| rows.sign[i] * (-rows.still[i].max(0.0) / time).exp()).collect()
            })
            .collect(),
        RestLaw::Follows { carries, over, smoothing } => {
            let slips = slip_beyond_play(&pressures[smoothing], carries);
            holds
                .iter()
                .map(|(from, to)| {
                    let mut z = rows.sign[*from];
                    slips[*from..*to]
                        .iter()
                        .map(|slipped| {
                            z = followed(z, *slipped, over);
                            z
                        })
                        .collect()
                })
                .collect()
        }
    }
}

/// Residual of a row, N, where friction acts in a direction.
fn residual_at(rows: &Rows, fitted: &Baseline, i: usize, direction: f64) -> f64 {
    fitted.raw_residual[i] + fitted.quasi[i] * fitted.friction[i] * (direction - rows.contexts()[i].direction)
}

/// What a law leaves of the rows at rest: the friction is that of the moving rows, and the part of the force that stays the same
/// through a hold is not counted as an error of it.
fn energy_at_rest(rows: &Rows, fitted: &Baseline, holds: &[(usize, usize)], directions: &[Vec<f64>]) -> f64 {
    let mut sum = 0.0;
    for ((from, to), way) in holds.iter().zip(directions) {
        for i in *from..*to {
            let w = if rows.on_ramp[i] { 0.0 } else { rows.root_weight()[i] };
            sum += (w * residual_at(rows, fitted, i, way[i - from])).powi(2);
        }
    }
    sum
}

/// Finds over which change of the pressure friction turns on ramps at held length: the rows that can be judged, and the law. There is no
/// law if friction turns without delay, or if too few rows move to know the friction.
pub(crate) fn settle_ramps(rows: &Rows) -> (Rows, Option<Turning>) {
    if !rows.on_ramp.iter().any(|r| *r) {
        return (rows.clone(), None);
    }
    let moving = rows.without(|i| rows.contexts()[i].speed == 0.0);
    if moving.effective() < FEWEST_MOVING_ROWS {
        return (rows.clone(), None);
    }
    ramps::settle(rows, &baselines::fit(&moving, Kind::Flexible(TABLE_ORDER), &[]))
}

/// Finds the law of friction at rest: the rows with its directions, and the law; none where friction stays as the model holds it.
pub(crate) fn settle_rest_friction(rows: &Rows) -> (Rows, Option<RestLaw>) {
    if rows.isometric {
        return held_length::settle(rows);
    }
    let holds = holds(rows);
    let Some(moving) = moving(rows, &holds) else { return (rows.clone(), None) };
    // Friction and bladder as the moving rows have them.
    let fitted = baselines::fit(&moving, Kind::Flexible(TABLE_ORDER), &[]);
    let pressures: Vec<Vec<f64>> = PRESSURE_SMOOTHING.iter().map(|h| smoothed(rows, *h)).collect();
    let stays: Vec<Vec<f64>> =
        holds.iter().map(|(a, b)| rows.contexts()[*a..*b].iter().map(|c| c.direction).collect()).collect();
    let held = energy_at_rest(rows, &fitted, &holds, &stays);
    let Some((best, energy)) = best_law(rows, &fitted, &holds, &pressures) else {
        return (rows.clone(), None);
    };
    let law = (energy < REST_LAW_LEAVES * held).then_some(best);
    let chosen = law.map_or(stays, |law| directions(rows, &holds, &pressures, law));
    let doubted = match law {
        Some(law) => matches!(law, RestLaw::Follows { .. }),
        None => held > NO_LAW_RATIO * fitted.per_row(&moving) * weight_at(rows, &holds),
    };
    let steps = steps::of(rows, &fitted, &holds, &chosen);
    let rest = rests(rows, &holds, &chosen, &steps, doubted);
    (settled(rows, &holds, &chosen, law, rest), law)
}

/// The rows by which friction and bladder are known, where there are rests to look at and enough motion beside them.
fn moving(rows: &Rows, holds: &[(usize, usize)]) -> Option<Rows> {
    let counts = rows.still.iter().zip(rows.root_weight());
    let resting = counts.filter(|(s, w)| **s > RESTING_AFTER && **w > 0.0).count();
    if holds.is_empty() || resting * RESTING_ROWS < rows.effective() {
        return None;
    }
    let mut at_rest = vec![false; rows.len()];
    for (from, to) in holds {
        at_rest[*from..*to].fill(true);
    }
    let moving = rows.without(|i| at_rest[i]);
    (moving.effective() >= FEWEST_MOVING_ROWS).then_some(moving)
}

/// The law that leaves least of the rows at rest, and what it leaves: the best of a grid, varied twice.
fn best_law(
    rows: &Rows,
    fitted: &Baseline,
    holds: &[(usize, usize)],
    pressures: &[Vec<f64>],
) -> Option<(RestLaw, f64)> {
    let best_of = |laws: Vec<RestLaw>| {
        let tried: Vec<f64> = laws
            .par_iter()
            .map(|l| energy_at_rest(rows, fitted, holds, &directions(rows, holds, pressures, *l)))
            .collect();
        laws.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let follows = |smoothing: usize| {
        CARRIED_PRESSURES.iter().flat_map(move |h| {
            FOLLOWING_PRESSURES.iter().map(move |b| RestLaw::Follows { carries: *h, over: *b, smoothing })
        })
    };
    let fades = SETTLING_TIMES.iter().map(|t| RestLaw::Fades(*t));
    let mut best = best_of(fades.chain((0..PRESSURE_SMOOTHING.len()).flat_map(follows)).collect())?;
    for factors in NEARBY_FACTORS {
        best = best_of(nearby(best.0, &factors)).filter(|(_, e)| *e < best.1).unwrap_or(best);
    }
    Some(best)
}

/// A law with its numbers varied by factors.
fn nearby(law: RestLaw, factors: &[f64]) -> Vec<RestLaw> {
    match law {
        RestLaw::Fades(time) => factors.iter().map(|f| RestLaw::Fades(time * f)).collect(),
        RestLaw::Follows { carries, over, smoothing } => factors
            .iter()
            .chain(&[1.0])
            .flat_map(|f| {
                factors.iter().chain(&[1.0]).map(move |g| RestLaw::Follows {
                    carries: carries * f,
                    over: over * g,
                    smoothing,
                })
            })
            .collect(),
    }
}

/// The rows with the directions of a law, and with what is fitted beside it.
fn settled(
    rows: &Rows,
    holds: &[(usize, usize)],
    directions: &[Vec<f64>],
    law: Option<RestLaw>,
    rest: Vec<u32>,
) -> Rows {
    let n = rows.len();
    let mut found = RestFriction { rest, kept: vec![1.0; n], ..RestFriction::as_modelled(n) };
    let Some(law) = law else { return rows.with_rest_friction(found) };
    let mut contexts = rows.contexts().to_vec();
    for ((from, to), way) in holds.iter().zip(directions) {
        for i in (*from..*to).filter(|i| !rows.on_ramp[*i]) {
            found.unsettled[i] = contexts[i].direction - way[i - from];
            contexts[i].direction = way[i - from];
            if let RestLaw::Fades(time) = law
                && rows.still[i] > 0.0
            {
                // How a settling departs from an exponential is fitted beside it.
                found.settling[i] = (-3.0 * rows.still[i] / time).exp() - (-rows.still[i] / time).exp();
            }
        }
    }
    rows.with_contexts(contexts).with_rest_friction(found)
}

/// The weight of the rows at rest.
fn weight_at(rows: &Rows, holds: &[(usize, usize)]) -> f64 {
    let resting = holds.iter().flat_map(|(from, to)| *from..*to).filter(|i| !rows.on_ramp[*i]);
    resting.map(|i| rows.root_weight()[i].powi(2)).sum()
}

/// Numbers of the stretches over which friction rests at an unknown place. Static friction slips in steps too small and too quick for the
/// pressure's samples: between the steps that a law predicts or the force shows, the place of rest is fitted. Without doubt about the law it is
/// fitted only after such a step. A force that steps more often is periodic, which is not a slip of friction.
fn rests(
    rows: &Rows,
    holds: &[(usize, usize)],
    directions: &[Vec<f64>],
    steps: &[Vec<bool>],
    doubted: bool,
) -> Vec<u32> {
    let most = MOST_RESTS + holds.len();
    let stepped = steps.iter().flatten().filter(|step| **step).count();
    let lets_go = stepped + if doubted { holds.len() } else { 0 } <= most;
    let mut jump = REST_JUMP;
    let mut numbers = vec![0; rows.len()];
    // A direction lies within ±1: no change of it is a jump at last.
    loop {
        let mut number = 0;
        for (((from, to), way), steps) in holds.iter().zip(directions).zip(steps) {
            let mut known = !doubted;
            number += u32::from(doubted);
            let mut since = way[0];
            for i in *from..*to {
                if (doubted && (way[i - from] - since).abs() > jump) || (lets_go && steps[i - from]) {
                    since = way[i - from];
                    number += 1;
                    known = false;
                }
                numbers[i] = if known || rows.on_ramp[i] { 0 } else { number };
            }
        }
        if number as usize <= most {
            return numbers;
        }
        jump *= 2.0;
    }
}
