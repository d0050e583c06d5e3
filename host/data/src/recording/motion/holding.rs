//! Where the length is held.

use std::collections::VecDeque;

use super::criteria::{
    CREEP_SPEED, DWELL_RATIO, FLAT_NOISE, FLAT_SHARE, HOLD_DRIFT, HOLD_EDGE_SHARE, HOLD_EDGE_TIME, HOLD_JOIN,
    HOLD_REACH, HOLD_SAMPLES, HOLD_TIME, LEVEL_SAMPLES, LONG_HOLD_SHARE, LONG_HOLD_TIME, PACE_PARTS,
    PACE_SAMPLES, SMALL_STROKE,
};
use super::legs::Leg;
use super::scale::Scale;
use crate::statistics::{median, range};

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
/// A hold stays within the threshold for much longer than the motion around it takes for that distance. Within a hold the stroke is flat;
/// the round top of a smooth reversal is not a hold.
pub(super) fn holds(time: &[f64], smooth: &[f64], scale: &Scale, legs: &[Leg]) -> Vec<Hold> {
    let n = smooth.len();
    if n == 0 {
        return Vec::new();
    }
    if is_held(smooth, scale) {
        return vec![Hold { start: 0, end: n - 1, stroke: sampled_median(smooth) }];
    }
    let strokes = without_creep(time, smooth, scale, legs);
    let search = Search { time, smooth, scale, strokes: &strokes };
    joined(search.stretches(), smooth, scale)
}

/// Whether the length never moves: a frame yields by some thresholds at most.
pub(super) fn is_held(smooth: &[f64], scale: &Scale) -> bool {
    range(smooth) <= HOLD_DRIFT * scale.threshold
}

/// A leg with its speed, m/s.
struct Stroke {
    leg: Leg,
    speed: f64,
}

/// The legs without the creep of a held length, where the frame yields to the force. Creep is small and far slower than the leg in the
/// middle by travel.
fn without_creep(time: &[f64], smooth: &[f64], scale: &Scale, legs: &[Leg]) -> Vec<Stroke> {
    let with_speed = |leg: &Leg| Stroke { leg: *leg, speed: speed(time, smooth, leg, scale.threshold) };
    let strokes: Vec<Stroke> = legs.iter().map(with_speed).collect();
    let mut order: Vec<&Stroke> = strokes.iter().collect();
    order.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    let half = 0.5 * strokes.iter().map(|s| s.leg.amplitude()).sum::<f64>();
    let mut travelled = 0.0;
    let middle = order.iter().find(|s| {
        travelled += s.leg.amplitude();
        travelled >= half
    });
    let slowest = CREEP_SPEED * middle.map_or(0.0, |s| s.speed);
    let small = HOLD_DRIFT * scale.threshold;
    strokes.into_iter().filter(|s| s.leg.amplitude() > small || s.speed >= slowest).collect()
}

/// The search for holds in a recording.
struct Search<'a> {
    time: &'a [f64],
    smooth: &'a [f64],
    scale: &'a Scale,
    strokes: &'a [Stroke],
}

impl Search<'_> {
    /// Stretches at held length, in order; a wild sample or a creep parts them.
    fn stretches(&self) -> Vec<Hold> {
        let (smooth, n) = (self.smooth, self.smooth.len());
        let mut holds: Vec<Hold> = Vec::new();
        let mut window = Window::default();
        let mut stroke = 0;
        for end in 0..n {
            // The window is the longest one that ends here and stays within the threshold.
            window.push(end, smooth[end]);
            if window.spread() <= self.scale.threshold {
                continue;
            }
            let (start, found) = (window.start, self.hold(&mut stroke, window.start, end));
            let behind = match found {
                Found::Hold(hold) => {
                    holds.push(hold);
                    end
                }
                // Testing this stretch again sample by sample would take quadratic time.
                Found::Round => start + (end - start) / 4,
                Found::Short => start + 1,
            };
            while window.start < behind || window.spread() > self.scale.threshold {
                window.shift();
            }
        }
        if let Found::Hold(hold) = self.hold(&mut stroke, window.start, n) {
            holds.push(hold);
        }
        holds
    }

    /// Whether the samples from `start` up to `end` are a hold. `stroke` is the first stroke that may lie beside it.
    fn hold(&self, stroke: &mut usize, start: usize, end: usize) -> Found {
        let Self { time, smooth, scale, strokes } = self;
        if end < start + HOLD_SAMPLES || strokes.is_empty() {
            return Found::Short;
        }
        while strokes[*stroke].leg.end < start && *stroke + 1 < strokes.len() {
            *stroke += 1;
        }
        // The slower of the adjacent strokes determines how long the motion would take for this distance; the next one where creep
        // alone lies beside.
        let beside = |(k, s): &(usize, &Stroke)| *k == 0 || s.leg.start <= end;
        let around = || strokes[*stroke..].iter().enumerate().take_while(beside).map(|(_, s)| s).take(3);
        let slowest = around().map(|s| s.speed).fold(f64::INFINITY, f64::min);
        let shortest = around().map(|s| time[s.leg.end] - time[s.leg.start]).fold(f64::INFINITY, f64::min);
        let passing = scale.threshold / slowest;
        let within = time[end - 1] - time[start];
        if !(within > HOLD_TIME * passing) {
            return Found::Short;
        }
        let level = sampled_median(&smooth[start..end]);
        if within > LONG_HOLD_TIME * passing && within > LONG_HOLD_SHARE * shortest {
            // What stays so much longer is at rest even if it creeps: its edges have levels of their own.
            let third = (end - start) / 3;
            let edges =
                [sampled_median(&smooth[start..start + third]), sampled_median(&smooth[end - third..end])];
            let tolerance = scale.rest_tolerance() + 0.5 * (edges[1] - edges[0]).abs();
            let still = |i: &usize, level: f64| (smooth[*i] - level).abs() <= tolerance;
            let first = (start..end).find(|i| still(i, edges[0]));
            let last = (start..end).rev().find(|i| still(i, edges[1]));
            if let (Some(first), Some(last)) = (first, last)
                && first < last
            {
                return Found::Hold(Hold { start: first, end: last, stroke: level });
            }
        }
        // The stretch includes what of the motion before and after stays within the threshold; that is not a rest.
        let tolerance = scale.rest_tolerance();
        let still = |i: &usize| (smooth[*i] - level).abs() <= tolerance;
        let (Some(first), Some(last)) = ((start..end).find(still), (start..end).rev().find(still)) else {
            return Found::Round;
        };
        let rested = time[last] - time[first];
        if rested < HOLD_TIME * passing || !flat(&smooth[first..=last], scale) {
            return Found::Round;
        }
        // The middle of a smooth turn is flat too, but it is not left at the speed of the motion.
        let far = |i: &usize| (smooth[*i] - level).abs() > scale.threshold;
        let entered = (0..first).rev().find(far).map_or(0.0, |i| time[first] - time[i]);
        let left = (last + 1..smooth.len()).find(far).map_or(0.0, |i| time[i] - time[last]);
        if entered.min(left) > HOLD_EDGE_TIME * passing && entered.min(left) > HOLD_EDGE_SHARE * rested {
            return Found::Round;
        }
        Found::Hold(Hold { start: first, end: last, stroke: level })
    }
}

/// The mean speed of a leg while it moves, m/s. What it spends within the threshold of its ends may be rest, and so may a part that
/// takes much longer than the others.
fn speed(time: &[f64], smooth: &[f64], leg: &Leg, threshold: f64) -> f64 {
    let over = |distance: f64, duration: f64| distance / duration.max(f64::MIN_POSITIVE);
    let whole = over(leg.amplitude(), time[leg.end] - time[leg.start]);
    if leg.amplitude() < SMALL_STROKE * threshold {
        return whole;
    }
    let gone = |i: usize| (smooth[i] - leg.from) * leg.sign();
    let left = (leg.start..=leg.end).find(|i| gone(*i) > threshold);
    let near = (leg.start..=leg.end).rev().find(|i| gone(*i) < leg.amplitude() - threshold);
    let (Some(left), Some(near)) = (left, near) else { return whole };
    if near <= left {
        return whole;
    }
    let (from, travelled) = (gone(left), gone(near) - gone(left));
    let parts = ((near - left) / PACE_SAMPLES).clamp(1, PACE_PARTS);
    let mut passed = vec![time[left]];
    for i in left..near {
        while passed.len() < parts && gone(i) - from >= travelled * passed.len() as f64 / parts as f64 {
            passed.push(time[i]);
        }
    }
    passed.push(time[near]);
    let taken: Vec<f64> = passed.windows(2).map(|w| w[1] - w[0]).collect();
    let usual = median(&mut taken.clone());
    let rests = |t: &f64| usual > 0.0 && *t > DWELL_RATIO * usual;
    over(travelled, taken.iter().map(|t| if rests(t) { usual } else { *t }).sum())
}

/// What a stretch turned out to be.
enum Found {
    Hold(Hold),
    /// Long enough, but a smooth turn.
    Round,
    Short,
}

/// A window over a column with its smallest and largest value.
#[derive(Default)]
struct Window {
    start: usize,
    /// Samples that may become the smallest, with their values, which rise.
    lows: VecDeque<(usize, f64)>,
    /// Samples that may become the largest, with their values, which fall.
    highs: VecDeque<(usize, f64)>,
}

impl Window {
    /// Takes one more sample in.
    fn push(&mut self, i: usize, value: f64) {
        while self.lows.back().is_some_and(|(_, low)| *low >= value) {
            self.lows.pop_back();
        }
        while self.highs.back().is_some_and(|(_, high)| *high <= value) {
            self.highs.pop_back();
        }
        self.lows.push_back((i, value));
        self.highs.push_back((i, value));
    }

    /// Leaves its first sample out.
    fn shift(&mut self) {
        self.start += 1;
        for list in [&mut self.lows, &mut self.highs] {
            while list.front().is_some_and(|(i, _)| *i < self.start) {
                list.pop_front();
            }
        }
    }

    /// Largest minus smallest value.
    fn spread(&self) -> f64 {
        match (self.lows.front(), self.highs.front()) {
            (Some((_, low)), Some((_, high))) => high - low,
            _ => 0.0,
        }
    }
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
        (FLAT_NOISE * noise).clamp(FLAT_SHARE.0 * scale.threshold, FLAT_SHARE.1 * scale.threshold)
    };
    size(pp, px) <= most(1.7) && size(qq, qx) <= most(3.4)
}

/// Holds as long as they are, and joined where a wild sample has parted them: with its level known from many samples, a hold
/// extends as far as noise about that level explains the samples.
fn joined(holds: Vec<Hold>, smooth: &[f64], scale: &Scale) -> Vec<Hold> {
    let tolerance = scale.rest_tolerance();
    let near = |level: f64, i: usize| (smooth[i] - level).abs() <= HOLD_REACH * scale.threshold;
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
            // Side by side: on one level, or creeping from one to the other.
            Some(last)
                if hold.start <= last.end + 2
                    && ((last.stroke - level).abs() < HOLD_JOIN * scale.threshold
                        || (smooth[last.end] - smooth[hold.start]).abs() < HOLD_JOIN * scale.threshold) =>
            {
                last.end = hold.end;
            }
            _ => joined.push(hold),
        }
    }
    joined
}

/// The median of a column, from samples spread evenly over it.
pub(super) fn sampled_median(column: &[f64]) -> f64 {
    let mut some: Vec<f64> = column.iter().step_by(column.len() / LEVEL_SAMPLES + 1).copied().collect();
    median(&mut some)
}
