//! The surface of force over pressure and stroke on which most recordings of a campaign agree, and the distance of a recording from it.

use super::mistake::{Mistake, mistakes};
use super::{InconsistentRecording, LEAST_ROWS, Sample};
use crate::recording::force_surface::{ForceSurface, TERMS};
use crate::statistics::{extremes, median, ranked};

/// A muscle counts as pulling above this share of the campaign's usual largest force.
const PULLS: f64 = 0.05;
/// A recording is inconsistent if a fifth of its sections have a mean residual above this share of that force…
pub(super) const FAR_OFF: f64 = 0.08;
/// …and this many times the residual with the mistake corrected.
const BETTER: f64 = 4.0;
/// Another mistake whose residual is below this multiple of the best one is reported as an alternative.
const AS_GOOD: f64 = 1.5;
/// Corrected, it agrees with the others within this share of that force: at the lowest and the highest pressure, the surface of the others
/// is an extrapolation.
const AGREES: f64 = 0.15;
/// The expected force changes by at least this share between the lowest and the highest fifth of its rows.
const CHANGES: f64 = 0.1;
/// The others cover a stroke if one of their rows is nearer than this share of their range.
const NEAR: f64 = 0.03;
/// They cover a pressure up to this factor beyond their own range…
const BEYOND: f64 = 1.6;
/// …and below it by this share of their range: by one of five even levels, over which force is linear in pressure.
const BELOW: f64 = 0.3;
/// The surface is trusted at a stroke where the recordings that it is fitted to are, in the median, nearer to it than this share of the
/// usual largest force: half of what makes another recording inconsistent. A steep beginning of the stroke is more than it follows.
const FOLLOWED: f64 = 0.5 * FAR_OFF;
/// Parts of the strokes' range in which that is tested.
const PARTS: usize = 33;
/// Sections of a recording over which residuals are averaged.
const SECTIONS: usize = 10;

/// A row: pressure in Pa, stroke in m, force in N.
pub(super) type Row = [f64; 3];

/// Ridge towards zero, per row, for what the rows do not determine.
const HELD: f64 = 1e-6;
/// Rounds that exclude rows whose residual exceeds [`FAR`] times the median.
const ROUNDS: usize = 4;
const FAR: f64 = 5.0;

/// Force over pressure and stroke in the recordings that agree.
pub(super) struct ConsensusSurface {
    surface: ForceSurface,
    /// Lowest and highest, Pa.
    pressure: (f64, f64),
    /// Lowest, and the range above it, m.
    stroke: (f64, f64),
    /// The recorded strokes, sorted, m.
    strokes: Vec<f64>,
    /// The usual largest force, N.
    largest: f64,
    /// Whether the surface follows the recordings in each part of the strokes' range.
    followed: Vec<bool>,
}

/// Residuals of the same rows of a recording, as shares of the usual largest force.
#[derive(Clone, Copy)]
struct Residuals {
    as_read: f64,
    corrected: f64,
}

/// A recording that agrees once a mistake is corrected.
pub(super) struct Judged {
    /// Its residual then, as a share of the usual largest force.
    pub(super) left: f64,
    /// What was found.
    pub(super) found: InconsistentRecording,
}

impl ConsensusSurface {
    /// Fits the rows of some recordings that pull; `None` of too few.
    pub(super) fn on<'a>(samples: impl Iterator<Item = &'a Sample>, largest: f64) -> Option<Self> {
        let pulls = |r: &&Row| r[2].abs() > PULLS * largest;
        let recordings: Vec<Vec<Row>> =
            samples.map(|s| s.rows.iter().filter(pulls).copied().collect()).collect();
        let rows = recordings.concat();
        if rows.len() < 5 * TERMS {
            return None;
        }
        let bounds = |k: usize| {
            let mut all: Vec<f64> = rows.iter().map(|r| r[k]).collect();
            all.sort_unstable_by(f64::total_cmp);
            // A few extreme rows must not set the scale.
            (all[all.len() / 100], all[all.len() - 1 - all.len() / 100], all)
        };
        let ((low, high, _), (short, long, strokes)) = (bounds(0), bounds(1));
        if high <= 0.0 {
            return None;
        }
        let mut surface = Self {
            surface: ForceSurface::default(),
            pressure: (low, high),
            stroke: (short, (long - short).max(1e-9)),
            strokes,
            largest,
            followed: Vec::new(),
        };
        let mut kept = rows.clone();
        for _ in 0..ROUNDS {
            surface.surface = surface.fitted(&kept)?;
            let off = |r: &Row| (r[2] - surface.force(r[0], r[1])).abs();
            let mut sizes: Vec<f64> = rows.iter().map(off).collect();
            let far = FAR * median(&mut sizes);
            kept = rows.iter().copied().filter(|r| off(r) <= far).collect();
        }
        surface.followed = surface.follows(&recordings);
        Some(surface)
    }

    /// Which part of the strokes' range a stroke is in.
    fn part(&self, stroke: f64) -> usize {
        let at = self.scaled(0.0, stroke)[1];
        ((at * PARTS as f64) as usize).min(PARTS - 1)
    }

    /// Whether the surface follows the recordings in each part of the strokes' range. Both directions are in the mean of a recording, and
    /// friction cancels; the median over recordings is not moved by a single wrong one.
    fn follows(&self, recordings: &[Vec<Row>]) -> Vec<bool> {
        let mut means = vec![Vec::new(); PARTS];
        for rows in recordings {
            let mut sums = vec![(0.0, 0); PARTS];
            for [p, x, f] in rows {
                let (sum, count) = &mut sums[self.part(*x)];
                *sum += f - self.force(*p, *x);
                *count += 1;
            }
            for (means, (sum, count)) in means.iter_mut().zip(sums).filter(|(_, (_, count))| *count > 0) {
                means.push(sum / f64::from(count));
            }
        }
        let near = |means: &mut Vec<f64>| means.is_empty() || median(means).abs() <= FOLLOWED * self.largest;
        means.iter_mut().map(near).collect()
    }

    /// Whether the surface follows the others at a stroke, or nothing is known there.
    fn is_followed(&self, stroke: f64) -> bool {
        let known = ((stroke - self.stroke.0) / self.stroke.1 - 0.5).abs() <= 0.5 + NEAR;
        !known || self.followed[self.part(stroke)]
    }

    /// The rows of a recording but those at strokes where the surface does not follow the others.
    fn comparable(&self, rows: &[Row]) -> Vec<Row> {
        rows.iter().copied().filter(|r| self.is_followed(r[1])).collect()
    }

    fn fitted(&self, rows: &[Row]) -> Option<ForceSurface> {
        let scaled = rows.iter().map(|[p, x, f]| (self.scaled(*p, *x), *f));
        ForceSurface::fit(scaled, &[HELD; TERMS])
    }

    /// Pressure and stroke as shares of their ranges; a stroke outside its range counts as the nearer end of it.
    fn scaled(&self, pressure: f64, stroke: f64) -> [f64; 2] {
        [pressure / self.pressure.1, ((stroke - self.stroke.0) / self.stroke.1).clamp(0.0, 1.0)]
    }

    /// The force of the surface, N, at a pressure in Pa and a stroke in m.
    fn force(&self, pressure: f64, stroke: f64) -> f64 {
        self.surface.force(self.scaled(pressure, stroke))
    }

    /// Whether there are rows near this stroke and pressure.
    fn covers(&self, pressure: f64, stroke: f64) -> bool {
        let next = self.strokes.partition_point(|x| *x < stroke);
        let near = |i: usize| self.strokes.get(i).is_some_and(|x| (x - stroke).abs() <= NEAR * self.stroke.1);
        let (low, high) = self.pressure;
        let below = (low / BEYOND).min(low - BELOW * (high - low));
        let within = pressure <= BEYOND * high && pressure >= below;
        within && (near(next) || next > 0 && near(next - 1))
    }

    /// Whether an inconsistent recording agrees once one mistake is corrected.
    pub(super) fn judge(&self, sample: &Sample) -> Option<Judged> {
        if self.residual(&sample.rows) < FAR_OFF {
            return None;
        }
        let mut tried: Vec<(Residuals, Mistake)> = mistakes(&sample.rows)
            .filter_map(|m| Some((self.with_mistake_corrected(&sample.rows, m)?, m)))
            .collect();
        tried.sort_unstable_by(|a, b| a.0.corrected.total_cmp(&b.0.corrected));
        let (Residuals { as_read, corrected: left }, mistake) = tried.first().copied()?;
        let next = tried.get(1).filter(|(next, _)| next.corrected < AS_GOOD * left);
        (left <= AGREES && as_read >= FAR_OFF.max(BETTER * left)).then(|| Judged {
            left,
            found: InconsistentRecording { recording: sample.recording, mistake, or: next.map(|(_, m)| *m) },
        })
    }

    /// Sizes of the mean residuals of sections along pressure or stroke, whichever the recording covers more of, N: both directions of
    /// motion are in each, and friction cancels.
    fn section_means(&self, mut residuals: Vec<(Row, f64)>) -> Vec<f64> {
        let place = |row: &Row| self.scaled(row[0], row[1]);
        let range = |k: usize| {
            let ends = residuals.iter().map(|(row, _)| place(row)[k]);
            let (low, high) = extremes(ends);
            high - low
        };
        let along = usize::from(range(1) > range(0));
        residuals.sort_unstable_by(|a, b| place(&a.0)[along].total_cmp(&place(&b.0)[along]));
        let each = residuals.len().div_ceil(SECTIONS).max(1);
        residuals.chunks(each).map(|s| (s.iter().map(|r| r.1).sum::<f64>() / s.len() as f64).abs()).collect()
    }

    /// Whether a recording as read is inconsistent with the others, strokes left out at which the surface does not follow them.
    pub(super) fn is_far_off(&self, sample: &Sample) -> bool {
        let comparable = self.comparable(&sample.rows);
        comparable.len() >= LEAST_ROWS && self.residual(&comparable) >= FAR_OFF
    }

    /// The residuals of a recording where the others cover it with a mistake corrected: beyond their strokes and pressures, the surface says
    /// nothing. `None` where they do not cover most of it, or where the expected force hardly changes. A dead load cell agrees with any
    /// muscle without pressure, and one level agrees with many units.
    fn with_mistake_corrected(&self, rows: &[Row], mistake: Mistake) -> Option<Residuals> {
        let both = rows.iter().map(|r| (*r, mistake.of_row(*r)));
        let comparable: Vec<(Row, Row)> = both.filter(|(_, c)| self.is_followed(c[1])).collect();
        let covered = comparable.iter().copied().filter(|(_, c)| self.covers(c[0], c[1]));
        let (as_read, corrected): (Vec<Row>, Vec<Row>) = covered.unzip();
        if 4 * comparable.len() < 3 * rows.len()
            || corrected.is_empty()
            || 3 * corrected.len() < 2 * comparable.len()
        {
            return None;
        }
        let mut made: Vec<f64> = corrected.iter().map(|[p, x, _]| self.force(*p, *x).max(0.0)).collect();
        let changes = self.share(&mut made, 4) - self.share(&mut made, 1);
        (changes >= CHANGES)
            .then(|| Residuals { as_read: self.residual(&as_read), corrected: self.residual(&corrected) })
    }

    /// The 80 % quantile of the mean residuals of a recording's sections, as a share of the usual largest force; a slack muscle has no
    /// force.
    pub(super) fn residual(&self, rows: &[Row]) -> f64 {
        let signed = rows.iter().map(|row| (*row, row[2] - self.force(row[0], row[1]).max(0.0))).collect();
        self.share(&mut self.section_means(signed), 4)
    }

    /// A quantile in fifths, as a share of the usual largest force.
    fn share(&self, values: &mut [f64], fifths: usize) -> f64 {
        let rank = values.len() * fifths / 5;
        ranked(values, rank) / self.largest
    }
}
