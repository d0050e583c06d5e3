//! Which points a fit may use, and why others are set aside: nothing is dropped without being counted and said.

use crate::recording::Campaign;

use super::points::{Points, median};

/// Whether a point takes part in the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// It does.
    Fitted,
    /// The direction of its motion is not known, so friction's sign is not either.
    UnknownDirection,
    /// Just after a turn: friction has not yet turned round.
    NearTurn,
    /// The muscle is slack: the force stays at zero while the model would push.
    Slack,
    /// The force sensor's reading stands at the end of its range.
    Clipped,
    /// A reading far beyond what the rest scatters.
    Outlier,
}

/// A reading that does not belong to the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// The recording, counted as in the campaign.
    pub recording: u32,
    /// Row in that recording, from 0.
    pub row: u32,
    /// s.
    pub time: f64,
    /// What was read, N.
    pub force: f64,
    /// How far it lies off, N.
    pub off: f64,
}

/// A force at which the sensor's readings end: many rows stand at exactly the smallest (or largest) value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clip {
    /// N.
    pub force: f64,
    /// Rows at it.
    pub rows: usize,
}

/// Looks for the end of the force sensor's range. A converter that clips repeats one exact value; readings of a free sensor
/// near its smallest value scatter over several.
#[must_use]
pub fn clip(campaign: &Campaign, points: &Points) -> (Option<Clip>, Option<Clip>) {
    let count = |value: f64| {
        campaign
            .recordings
            .iter()
            .filter_map(|r| r.force.as_deref())
            .flatten()
            .filter(|f| **f == value)
            .count()
    };
    let ends = |value: f64, side: f64| {
        let rows = count(value);
        if rows < 30.max(points.rows / 300) {
            return None;
        }
        // The next distinct reading: at a free end it is about as frequent as the last one.
        let next = campaign
            .recordings
            .iter()
            .filter_map(|r| r.force.as_deref())
            .flatten()
            .filter(|f| side * (**f - value) > 0.0)
            .fold(f64::INFINITY, |best, f| best.min(side * (f - value)));
        let neighbours = if next.is_finite() { count(value + side * next) } else { 0 };
        (rows > 3 * neighbours && points.force.span() > 0.0).then_some(Clip { force: value, rows })
    };
    (ends(points.force.low, 1.0), ends(points.force.high, -1.0))
}

/// Finds single rows that jump out of their piece and takes them out of its mean.
///
/// Only pieces whose own spread is far above that of the others are looked at row by row.
pub fn despike(campaign: &Campaign, points: &mut Points) -> Vec<Outlier> {
    let mut spreads: Vec<f64> =
        points.list.iter().filter(|p| p.rows >= 3).map(|p| p.force_range.1 - p.force_range.0).collect();
    let typical = median(&mut spreads).max(4.0 * points.row_noise);
    let mut found = Vec::new();
    if typical <= 0.0 {
        return found;
    }
    for p in points.list.iter_mut().filter(|p| p.rows >= 3) {
        if p.force_range.1 - p.force_range.0 < 6.0 * typical {
            continue;
        }
        let Some(force) = campaign.recordings.get(p.recording as usize).and_then(|r| r.force.as_ref()) else {
            continue;
        };
        let (first, last) = (p.first_row as usize, (p.first_row + p.rows) as usize);
        let Some(rows) = force.get(first..last) else { continue };
        let middle = median(&mut rows.to_vec());
        let stray: Vec<usize> =
            (0..rows.len()).filter(|i| (rows[*i] - middle).abs() > 4.0 * typical).collect();
        // Many strays are a real jump, not spikes.
        if stray.is_empty() || stray.len() * 5 > rows.len() {
            continue;
        }
        let kept = rows.iter().enumerate().filter(|(i, _)| !stray.contains(i)).map(|(_, f)| *f);
        p.force = kept.sum::<f64>() / (rows.len() - stray.len()) as f64;
        for i in stray {
            found.push(Outlier {
                recording: p.recording,
                row: (first + i) as u32,
                time: campaign.recordings[p.recording as usize].time[first + i],
                force: rows[i],
                off: rows[i] - middle,
            });
        }
    }
    found
}

/// How far from a turn friction is fully turned round, as a share of the ranges (see [`super::points::Point::since_turn`]).
///
/// `missing` gives, per point after a turn, its distance and the share of friction that its residual lacks
/// (`s r / (k_F q)`), with a weight. Right after a turn that share is near 2, far from it near 0. The zone ends where
/// the mean stays below a tenth.
#[must_use]
pub fn turn_zone(missing: impl IntoIterator<Item = (f64, f64, f64)>) -> f64 {
    const BIN: f64 = 0.0025;
    const BINS: usize = 100;
    const LEAST: f64 = 0.005;
    let mut sums = [(0.0, 0.0); BINS];
    let mut far = (0.0, 0.0);
    for (distance, share, weight) in missing {
        let bin = (distance / BIN) as usize;
        let to = if bin < BINS { &mut sums[bin] } else { &mut far };
        to.0 += weight * share;
        to.1 += weight;
    }
    let mean = |s: (f64, f64)| if s.1 > 0.0 { s.0 / s.1 } else { 0.0 };
    // Whatever misfit the model has everywhere is no sign of a turn.
    let base = mean(far);
    let last = (0..BINS).take_while(|i| {
        let here: Vec<f64> = sums[*i..(*i + 3).min(BINS)].iter().map(|s| mean(*s) - base).collect();
        here.iter().any(|v| *v > 0.1)
    });
    let bins = last.count();
    if bins == 0 { LEAST } else { (bins as f64 + 1.0) * BIN * 1.2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zone_ends_where_friction_has_turned() {
        let exponential = (0..4000).map(|i| {
            let d = f64::from(i) * 1e-4;
            (d, 2.0 * (-d / 0.01).exp() + 0.02 * (f64::from(i) * 2.1).sin(), 1.0)
        });
        // 2 e^(−d/0.01) falls below a tenth at 0.03.
        let zone = turn_zone(exponential);
        assert!((0.03..0.05).contains(&zone), "{zone}");
        assert!(turn_zone((0..100).map(|i| (f64::from(i) * 0.01, 0.0, 1.0))) < 0.01);
    }
}
