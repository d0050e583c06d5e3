//! The surface of force over pressure and stroke on which most recordings of a campaign agree, and the distance of a recording from it.

use super::mistake::{Mistake, mistakes};
use super::{InconsistentRecording, Sample};
use crate::recording::force_surface::{ForceSurface, TERMS};
use crate::statistics::{median, ranked};

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
/// They cover a pressure up to this factor beyond their own range.
const BEYOND: f64 = 1.6;
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
        let pulls = |r: &Row| r[2].abs() > PULLS * largest;
        let rows: Vec<Row> = samples.flat_map(|s| &s.rows).copied().filter(pulls).collect();
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
        };
        let mut kept = rows.clone();
        for _ in 0..ROUNDS {
            surface.surface = surface.fitted(&kept)?;
            let off = |r: &Row| (r[2] - surface.force(r[0], r[1])).abs();
            let mut sizes: Vec<f64> = rows.iter().map(off).collect();
            let far = FAR * median(&mut sizes);
            kept = rows.iter().copied().filter(|r| off(r) <= far).collect();
        }
        Some(surface)
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
        let within = pressure <= BEYOND * self.pressure.1 && pressure >= self.pressure.0 / BEYOND;
        within && (near(next) || next > 0 && near(next - 1))
    }

    /// Whether an inconsistent recording agrees once one mistake is corrected.
    pub(super) fn judge(&self, sample: &Sample) -> Option<Judged> {
        let as_read = self.residual(&sample.rows, None).filter(|off| *off >= FAR_OFF)?;
        let tried = mistakes(&sample.rows).filter_map(|m| Some((self.residual(&sample.rows, Some(&m))?, m)));
        let mut tried: Vec<(f64, Mistake)> = tried.collect();
        tried.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (left, mistake) = tried.first().copied()?;
        let next = tried.get(1).filter(|(next, _)| *next < AS_GOOD * left);
        (left <= AGREES && as_read >= BETTER * left).then(|| Judged {
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
            let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            high - low
        };
        let along = usize::from(range(1) > range(0));
        residuals.sort_unstable_by(|a, b| place(&a.0)[along].total_cmp(&place(&b.0)[along]));
        let each = residuals.len().div_ceil(SECTIONS).max(1);
        residuals.chunks(each).map(|s| (s.iter().map(|r| r.1).sum::<f64>() / s.len() as f64).abs()).collect()
    }

    /// The 80 % quantile of the mean residuals of a recording's sections, as a share of the usual largest force; a slack muscle has no
    /// force. With a mistake corrected `None` where the others do not cover most of the rows, or where the expected force hardly changes.
    pub(super) fn residual(&self, rows: &[Row], mistake: Option<&Mistake>) -> Option<f64> {
        let rows: Vec<Row> = rows.iter().map(|r| mistake.map_or(*r, |m| m.of_row(*r))).collect();
        let known = rows.iter().filter(|r| self.covers(r[0], r[1])).count();
        if mistake.is_some() && 4 * known < 3 * rows.len() {
            return None;
        }
        let quantile = |values: &mut Vec<f64>, fifths: usize| {
            let rank = values.len() * fifths / 5;
            ranked(values, rank) / self.largest
        };
        let four_fifths = |values: &mut Vec<f64>| quantile(values, 4);
        let fifth = |values: &mut Vec<f64>| quantile(values, 1);
        let mut made: Vec<f64> = rows.iter().map(|[p, x, _]| self.force(*p, *x).max(0.0)).collect();
        let signed = rows.iter().zip(&made).map(|(row, force)| (*row, row[2] - force)).collect();
        let mut sizes = self.section_means(signed);
        // A dead load cell agrees with any muscle without pressure, and one level agrees with many units: the force must change.
        let telling = mistake.is_none() || four_fifths(&mut made) - fifth(&mut made) >= CHANGES;
        telling.then(|| four_fifths(&mut sizes))
    }
}
