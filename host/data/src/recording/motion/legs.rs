//! Reversals: where a column turns back by more than a threshold, and exactly where it did so.

use super::criteria::{LINE_REACH, LINE_STROKE_SHARE, ONSET_CLEAR, SHARP_RATIO, SHARP_SAMPLES, SHARP_STEP};

/// A stretch between two reversals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Leg {
    /// Sample of the extremum it starts from.
    pub start: usize,
    /// Sample of the extremum it ends at.
    pub end: usize,
    pub from: f64,
    pub to: f64,
}

impl Leg {
    pub(super) fn amplitude(&self) -> f64 {
        (self.to - self.from).abs()
    }

    pub(super) fn sign(&self) -> f64 {
        (self.to - self.from).signum()
    }
}

/// The legs of a column, alternating in sign, each larger than `threshold`. Empty when the column never moves that far.
pub(super) fn legs(column: &[f64], threshold: f64) -> Vec<Leg> {
    let mut legs = Vec::new();
    let Some(first) = column.first() else { return legs };
    // Before the first motion both extremes are open.
    let (mut low, mut high) = ((0, *first), (0, *first));
    let mut way = 0.0;
    let mut start = (0, *first);
    let mut extreme = start;
    for (i, x) in column.iter().copied().enumerate() {
        if way == 0.0 {
            if x > high.1 {
                high = (i, x);
            }
            if x < low.1 {
                low = (i, x);
            }
            if x - low.1 > threshold {
                (way, start, extreme) = (1.0, low, (i, x));
            } else if high.1 - x > threshold {
                (way, start, extreme) = (-1.0, high, (i, x));
            }
        } else if (x - extreme.1) * way > 0.0 {
            extreme = (i, x);
        } else if (extreme.1 - x) * way > threshold {
            legs.push(Leg { start: start.0, end: extreme.0, from: start.1, to: extreme.1 });
            start = extreme;
            extreme = (i, x);
            way = -way;
        }
    }
    if way != 0.0 {
        legs.push(Leg { start: start.0, end: extreme.0, from: start.1, to: extreme.1 });
    }
    legs
}

/// A straight line x(t) = at + slope · (t − origin).
#[derive(Debug, Clone, Copy)]
struct Line {
    origin: f64,
    at: f64,
    slope: f64,
}

impl Line {
    /// Least squares through some samples; `None` when they do not define one.
    fn through(time: &[f64], column: &[f64], samples: impl Iterator<Item = usize> + Clone) -> Option<Self> {
        let n = samples.clone().count() as f64;
        if n < 2.0 {
            return None;
        }
        let origin = samples.clone().map(|i| time[i]).sum::<f64>() / n;
        let at = samples.clone().map(|i| column[i]).sum::<f64>() / n;
        let (mut tt, mut tx) = (0.0, 0.0);
        for i in samples {
            let t = time[i] - origin;
            tt += t * t;
            tx += t * (column[i] - at);
        }
        (tt > 0.0).then(|| Self { origin, at, slope: tx / tt })
    }

    fn value(&self, time: f64) -> f64 {
        self.at + self.slope * (time - self.origin)
    }

    fn reaches(&self, level: f64) -> Option<f64> {
        (self.slope != 0.0).then(|| self.origin + (level - self.at) / self.slope)
    }

    fn meets(&self, other: &Self) -> Option<f64> {
        let slope = self.slope - other.slope;
        (slope != 0.0).then(|| self.origin + (other.value(self.origin) - self.at) / slope)
    }
}

/// A column with its clock and its noise.
#[derive(Clone, Copy)]
pub(super) struct Track<'a> {
    pub time: &'a [f64],
    /// As recorded.
    pub raw: &'a [f64],
    /// Smoothed, for finding.
    pub smooth: &'a [f64],
    pub noise: f64,
    pub threshold: f64,
}

impl Track<'_> {
    /// How far readings stray from the level of a rest or a reversal.
    pub(super) fn tolerance(&self) -> f64 {
        (ONSET_CLEAR * self.noise).min(self.threshold / 2.0)
    }

    /// First sample of the leg that is farther than `distance` from where the leg starts.
    pub(super) fn leaves(&self, leg: &Leg, distance: f64) -> usize {
        let far = |i: &usize| (self.smooth[*i] - leg.from) * leg.sign() > distance;
        (leg.start..=leg.end).find(far).unwrap_or(leg.end)
    }

    /// Last sample of the leg that is farther than `distance` from where the leg ends.
    pub(super) fn nears(&self, leg: &Leg, distance: f64) -> usize {
        let far = |i: &usize| (leg.to - self.smooth[*i]) * leg.sign() > distance;
        (leg.start..=leg.end).rev().find(far).unwrap_or(leg.start)
    }

    /// The first sample that belongs to `after`, where `before` turns into `after` without a rest.
    ///
    /// Where single samples stand clear of the noise, the extremum's own sample is the only one in doubt: on a corner it lies
    /// on the line of one side, on a smooth reversal the slope across it decides. Where they do not, the lines of both sides,
    /// taken at equal distances from the reversal, meet there.
    pub(super) fn reversal(&self, before: &Leg, after: &Leg) -> usize {
        let k = after.start;
        let (first, last) = (before.start, after.end);
        let steps =
            |from: usize, to: usize| (self.smooth[to] - self.smooth[from]).abs() / (to - from).max(1) as f64;
        let left = self.nears(before, self.threshold);
        let right = self.leaves(after, self.threshold);
        let step = steps(left, k).min(steps(k, right));
        if step > SHARP_STEP * self.noise || right - left < SHARP_SAMPLES {
            return self.sharp_reversal(k, first, last, before.sign());
        }
        // Samples close to the extremum may belong to either side; far ones show little about it.
        let near = self.tolerance();
        let far = (LINE_REACH * self.threshold)
            .min(LINE_STROKE_SHARE * before.amplitude())
            .min(LINE_STROKE_SHARE * after.amplitude());
        let a = self.nears(before, far)..self.nears(before, near).max(first + 1);
        let b = self.leaves(after, near)..(self.leaves(after, far) + 1).min(last + 1);
        let lines = (Line::through(self.time, self.raw, a), Line::through(self.time, self.raw, b));
        let (Some(a), Some(b)) = lines else { return k + 1 };
        let Some(moment) = a.meets(&b) else { return k + 1 };
        let at = left + self.time[left..=right].partition_point(|t| *t <= moment);
        at.clamp(left + 1, right)
    }

    fn sharp_reversal(&self, k: usize, first: usize, last: usize, way: f64) -> usize {
        let x = self.raw;
        // The extremum of the recorded column may be beside that of the smoothed one.
        let around = k.saturating_sub(2).max(first)..=(k + 2).min(last);
        let k = around.max_by(|a, b| (x[*a] * way).total_cmp(&(x[*b] * way))).unwrap_or(k);
        if k == 0 || k + 1 >= x.len() {
            return k + 1;
        }
        if k >= first + 2 && k + 2 <= last {
            let a = Line::through(self.time, x, k - 2..k);
            let b = Line::through(self.time, x, k + 1..k + 3);
            if let (Some(a), Some(b)) = (a, b) {
                let (off_a, off_b) =
                    ((x[k] - a.value(self.time[k])).abs(), (x[k] - b.value(self.time[k])).abs());
                if off_a > SHARP_RATIO * off_b + ONSET_CLEAR * self.noise {
                    return k;
                }
                if off_b > SHARP_RATIO * off_a + ONSET_CLEAR * self.noise {
                    return k + 1;
                }
            }
        }
        if (x[k + 1] - x[k - 1]) * way > 0.0 { k + 1 } else { k }
    }

    /// The first sample of a leg that moves, after a rest that ends somewhere in `from..`. `level` is where it rested, and
    /// `tolerance` how far samples at rest stray from it.
    pub(super) fn departure(&self, leg: &Leg, from: usize, level: f64, tolerance: f64) -> usize {
        let way = leg.sign();
        let gone = |i: usize| (self.smooth[i] - level) * way;
        let far = (from..=leg.end).find(|i| gone(*i) > self.threshold).unwrap_or(leg.end);
        let at_rest = (from..far).rev().find(|i| gone(*i) <= tolerance);
        let first = at_rest.map_or(from, |i| i + 1);
        if far < first + 3 {
            return first;
        }
        // Slow against the noise: back along the line of motion to the level of rest.
        let line = Line::through(self.time, self.raw, first..far + 1);
        let moment = line.filter(|l| l.slope * way > 0.0).and_then(|l| l.reaches(level));
        match moment {
            Some(moment) => {
                let start = first.saturating_sub(far - first).max(from);
                (start + self.time[start..=first].partition_point(|t| *t <= moment)).min(first)
            }
            None => first,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legs_alternate_and_ignore_what_is_smaller() {
        let column = [0.0, 1.0, 0.8, 3.0, 2.9, 1.0, 1.2, -1.0, 5.0];
        let legs = legs(&column, 0.5);
        let ends: Vec<_> = legs.iter().map(|l| (l.start, l.end)).collect();
        assert_eq!(ends, [(0, 3), (3, 7), (7, 8)]);
        assert!(super::legs(&[1.0, 1.1, 0.9], 0.5).is_empty());
        assert!(super::legs(&[], 0.5).is_empty());
    }
}
