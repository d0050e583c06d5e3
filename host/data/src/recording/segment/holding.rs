//! Where the length is held.

use std::collections::VecDeque;

use super::scale::Scale;
use super::turning::Leg;
use crate::statistics::median;

/// A stretch of samples at held length, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// First sample at rest.
    pub start: usize,
    /// Last sample at rest.
    pub end: usize,
    /// The stroke it rests at, m.
    pub stroke: f64,
}

/// The holds of a smoothed stroke, in order.
///
/// A hold is a stretch that stays within the threshold for much longer than the motion around it takes for that distance,
/// and within which the stroke is flat and not the round top of a smooth turn.
pub(super) fn holds(time: &[f64], smooth: &[f64], scale: &Scale, legs: &[Leg]) -> Vec<Hold> {
    let n = smooth.len();
    if n == 0 {
        return Vec::new();
    }
    if legs.is_empty() {
        return vec![Hold { start: 0, end: n - 1, stroke: sampled_median(smooth) }];
    }
    let mut holds: Vec<Hold> = Vec::new();
    let speeds: Vec<f64> = legs.iter().map(|l| speed(time, smooth, l, scale.threshold)).collect();
    let (mut lows, mut highs) = (VecDeque::new(), VecDeque::new());
    let mut start = 0;
    let mut leg = 0;
    for end in 0..=n {
        // The window start..end is the longest one that ends here and stays within the threshold.
        let mut broken = end == n;
        if end < n {
            while lows.back().is_some_and(|i: &usize| smooth[*i] >= smooth[end]) {
                lows.pop_back();
            }
            while highs.back().is_some_and(|i: &usize| smooth[*i] <= smooth[end]) {
                highs.pop_back();
            }
            lows.push_back(end);
            highs.push_back(end);
            let spread = |l: &VecDeque<usize>, h: &VecDeque<usize>| match (l.front(), h.front()) {
                (Some(l), Some(h)) => smooth[*h] - smooth[*l],
                _ => 0.0,
            };
            broken = spread(&lows, &highs) > scale.threshold;
            if broken {
                let behind =
                    match longest(time, &mut holds, smooth, scale, legs, &speeds, &mut leg, start, end) {
                        Found::Hold => end,
                        // Testing this stretch again sample by sample would take quadratic time.
                        Found::Round => start + (end - start) / 4,
                        Found::Short => start + 1,
                    };
                while start < behind || spread(&lows, &highs) > scale.threshold {
                    start += 1;
                    while lows.front().is_some_and(|i| *i < start) {
                        lows.pop_front();
                    }
                    while highs.front().is_some_and(|i| *i < start) {
                        highs.pop_front();
                    }
                }
                continue;
            }
        }
        if broken {
            longest(time, &mut holds, smooth, scale, legs, &speeds, &mut leg, start, end);
        }
    }
    joined(holds, smooth, scale)
}

/// The mean speed of a leg while it moves: what it spends within the threshold of its ends may be rest.
fn speed(time: &[f64], smooth: &[f64], leg: &Leg, threshold: f64) -> f64 {
    let over = |distance: f64, duration: f64| distance / duration.max(f64::MIN_POSITIVE);
    let whole = over(leg.amplitude(), time[leg.end] - time[leg.start]);
    if leg.amplitude() < 4.0 * threshold {
        return whole;
    }
    let gone = |i: usize| (smooth[i] - leg.from) * leg.sign();
    let left = (leg.start..=leg.end).find(|i| gone(*i) > threshold);
    let near = (leg.start..=leg.end).rev().find(|i| gone(*i) < leg.amplitude() - threshold);
    match (left, near) {
        (Some(left), Some(near)) if near > left => over(gone(near) - gone(left), time[near] - time[left]),
        _ => whole,
    }
}

/// What a stretch turned out to be.
enum Found {
    Hold,
    /// Long enough, but a smooth turn.
    Round,
    Short,
}

/// Takes the samples from `start` up to `end` as a hold if they are one.
#[allow(clippy::too_many_arguments)] // One step of `holds`, apart for being read.
fn longest(
    time: &[f64],
    holds: &mut Vec<Hold>,
    smooth: &[f64],
    scale: &Scale,
    legs: &[Leg],
    speeds: &[f64],
    leg: &mut usize,
    start: usize,
    end: usize,
) -> Found {
    if end < start + 6 {
        return Found::Short;
    }
    while legs[*leg].end < start && *leg + 1 < legs.len() {
        *leg += 1;
    }
    // The slower of the adjacent strokes determines how long the motion would take for this distance.
    let around = || legs[*leg..].iter().zip(&speeds[*leg..]).take_while(|(l, _)| l.start <= end).take(3);
    let slowest = around().map(|(_, speed)| *speed).fold(f64::INFINITY, f64::min);
    let shortest = around().map(|(l, _)| time[l.end] - time[l.start]).fold(f64::INFINITY, f64::min);
    let duration = time[end - 1] - time[start];
    let passing = scale.threshold / slowest;
    if !(duration > 4.0 * passing) {
        return Found::Short;
    }
    // The stretch includes what of the motion before and after stays within the threshold; that is no rest.
    let level = sampled_median(&smooth[start..end]);
    let tolerance = (3.0 * scale.smoothed_noise).max(0.1 * scale.threshold);
    let still = |i: &usize| (smooth[*i] - level).abs() <= tolerance;
    let (Some(first), Some(last)) = ((start..end).find(still), (start..end).rev().find(still)) else {
        return Found::Round;
    };
    let rested = time[last] - time[first];
    // What stays so much longer is at rest even if it creeps. About the turns of a sine both bounds are never passed at once:
    // with amplitude A, a share of 0.9 √(θ/A) of a leg is within the threshold θ, 1.8 √(A/θ) times what passing takes.
    let long = rested > 60.0 * passing && rested > 0.1 * shortest;
    if rested < 4.0 * passing || !long && !flat(&smooth[first..=last], scale) {
        return Found::Round;
    }
    // The middle of a smooth turn is flat too, but it is not left at the speed of the motion.
    let far = |i: &usize| (smooth[*i] - level).abs() > scale.threshold;
    let entered = (0..first).rev().find(far).map_or(0.0, |i| time[first] - time[i]);
    let left = (last + 1..smooth.len()).find(far).map_or(0.0, |i| time[i] - time[last]);
    if !long && entered.min(left) > 2.5 * passing && entered.min(left) > 0.3 * rested {
        return Found::Round;
    }
    holds.push(Hold { start: first, end: last, stroke: level });
    Found::Hold
}

/// Whether a stretch is flat: the parabola through it rises and bends by no more than noise does. A smooth turn that fills
/// the threshold bends by half of it, its flanks rise by as much.
fn flat(smooth: &[f64], scale: &Scale) -> bool {
    let cut = smooth.len() / 20;
    let inner = &smooth[cut..smooth.len() - cut];
    let n = inner.len() as f64;
    // Orthogonal polynomials on -1..1: their coefficients are slope and curvature.
    let place = |i: usize| 2.0 * i as f64 / (n - 1.0) - 1.0;
    let mean_square = (0..inner.len()).map(|i| place(i).powi(2)).sum::<f64>() / n;
    let (mut pp, mut px, mut qq, mut qx) = (0.0, 0.0, 0.0, 0.0);
    for (i, x) in inner.iter().enumerate() {
        let (p, x) = (place(i), x - inner[0]);
        let q = p * p - mean_square;
        pp += p * p;
        px += p * x;
        qq += q * q;
        qx += q * x;
    }
    let size = |square: f64, product: f64| if square > 0.0 { (product / square).abs() } else { 0.0 };
    // Rise and bend of mere noise have standard deviations of 1.7 and 3.4 of it, over the root of the independent samples. Five of
    // them hold all but one rest in a million; but half way to what a smooth turn shows, a turn is the likelier of the two.
    let independent = n * (scale.smoothed_noise / scale.noise.max(f64::MIN_POSITIVE)).powi(2).min(1.0);
    let most = |share: f64| {
        let noise = share * scale.smoothed_noise / independent.max(1.0).sqrt();
        (5.0 * noise).clamp(0.05 * scale.threshold, 0.25 * scale.threshold)
    };
    size(pp, px) <= most(1.7) && size(qq, qx) <= most(3.4)
}

/// Holds as long as they are, and joined where a wild sample has parted them: with its level known from many samples, a hold
/// goes on as far as noise about that level explains the samples.
fn joined(holds: Vec<Hold>, smooth: &[f64], scale: &Scale) -> Vec<Hold> {
    let tolerance = (3.0 * scale.smoothed_noise).max(0.1 * scale.threshold);
    let near = |level: f64, i: usize| (smooth[i] - level).abs() <= 0.6 * scale.threshold;
    let at_rest = |level: f64, i: usize| (smooth[i] - level).abs() <= tolerance;
    let mut joined: Vec<Hold> = Vec::with_capacity(holds.len());
    for mut hold in holds {
        let level = hold.stroke;
        if joined.last().is_some_and(|last| last.end >= hold.end) {
            continue;
        }
        let after = (hold.end + 1..smooth.len()).take_while(|i| near(level, *i));
        hold.end = after.filter(|i| at_rest(level, *i)).last().unwrap_or(hold.end);
        // A hold found earlier ends where this one begins; it is extended first, so it owns what lies between.
        let bound = joined.last().map_or(0, |last| last.end + 1);
        let before = (bound..hold.start).rev().take_while(|i| near(level, *i));
        hold.start = before.filter(|i| at_rest(level, *i)).last().unwrap_or(hold.start.max(bound));
        match joined.last_mut() {
            Some(last)
                if hold.start <= last.end + 2 && (last.stroke - level).abs() < 0.5 * scale.threshold =>
            {
                last.end = hold.end;
            }
            _ => joined.push(hold),
        }
    }
    joined
}

/// The median of a column, from at most 4096 samples spread evenly over it: they determine a level as well as millions.
pub(super) fn sampled_median(column: &[f64]) -> f64 {
    let mut some: Vec<f64> = column.iter().step_by(column.len() / 4096 + 1).copied().collect();
    median(&mut some)
}
