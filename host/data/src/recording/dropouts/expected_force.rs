//! The force expected at a pressure and stroke in a campaign, and whether a force continues while the pressure reading steps away.

use std::ops::Range;

use super::steps::Stretch;
use crate::recording::force_surface::{ForceSurface, TERMS};
use crate::recording::spikes::{spikes, without_spikes};
use crate::recording::{Campaign, Recording, white_noise};
use crate::statistics::{extremes, median, quantile};

/// Rows that the surface is fitted to.
const ROWS: usize = 20_000;
/// Rounds that exclude rows whose residual exceeds [`FAR`] times the median.
const ROUNDS: usize = 3;
const FAR: f64 = 5.0;
/// Ridge towards zero, per row, for what the campaign does not determine. With one tested pressure the force comes out proportional to
/// pressure, which is the smallest possible effect of pressure: deadband and elasticity reduce the force.
const HELD: [f64; TERMS] = [1e-6, 1e-5, 1e-5, 1e-5, 1e-3, 1e-5, 1e-5, 1e-5];
/// A muscle counts as pulling above this share of the range of forces.
const PULLS: f64 = 0.05;
/// The step must change the expected force by this share of the range of forces, and this many standard deviations of a reading.
const NOTICEABLE: (f64, f64) = (0.03, 25.0);
/// The force continues if it follows less than this share of the expected change.
const FOLLOWS: f64 = 0.15;
/// Before and after, the residual of the force stays below this share of the expected change: of two levels between which the reading
/// changes, the true one is the one that the force agrees with.
const SUPPORTED: f64 = 0.3;
/// How long after a stretch the force is checked for a late reaction: s, and rows at least.
const LATE: (f64, usize) = (0.3, 2);
/// A spike is at least this share of the usual range. Few spikes far away would bend the surface.
const SPIKE: f64 = 0.1;
/// This share of the rows lies above the usual range, and as much below.
const RARE: f64 = 0.01;
/// Rows on either side that determine the level.
const BESIDE: usize = 5;
/// A saturated force sensor repeats one value in at least this share of the rows.
const CLIPPED: f64 = 1.0 / 300.0;

/// Force over pressure and stroke, from the rows of a campaign away from pressure steps.
#[derive(Debug, Clone)]
pub(in crate::recording) struct ExpectedForce {
    surface: ForceSurface,
    pressure: f64,
    stroke: (f64, f64),
    /// The lowest force, and the range above it, N.
    floor: f64,
    span: f64,
    /// Where the force sensor saturates, N.
    ceiling: f64,
}

/// The range of a column without spikes and few readings far away, SI.
fn usual_span(campaign: &Campaign, of: fn(&Recording) -> &[f64], stride: usize) -> f64 {
    let mut some: Vec<f64> = campaign.recordings.iter().flat_map(|r| without_spikes(of(r), stride)).collect();
    if some.is_empty() { 0.0 } else { quantile(&mut some, 1.0 - RARE) - quantile(&mut some, RARE) }
}

impl ExpectedForce {
    /// `None` where too few rows pull, or the force hardly changes.
    pub(in crate::recording) fn of(campaign: &Campaign, masks: &[Vec<Range<usize>>]) -> Option<Self> {
        let total = campaign.samples();
        let stride = (total / ROWS).max(1);
        let mut rows: Vec<[f64; 3]> = Vec::with_capacity(total / stride + 1);
        let pressure_step = SPIKE * usual_span(campaign, |r| &r.pressure, stride);
        let stroke_step = SPIKE * usual_span(campaign, |r| &r.stroke, stride);
        let force_step = SPIKE * usual_span(campaign, |r| r.force.as_deref().unwrap_or(&[]), stride);
        for (r, mask) in campaign.recordings.iter().zip(masks) {
            let Some(force) = r.force.as_deref() else { continue };
            let away = [
                spikes(&r.pressure, pressure_step),
                spikes(&r.stroke, stroke_step),
                spikes(force, force_step),
            ];
            let mut next = mask.iter().peekable();
            let mut away = away.each_ref().map(|spikes| spikes.iter().peekable());
            for i in (0..r.len()).step_by(stride) {
                while next.next_if(|m| m.end <= i).is_some() {}
                let spiked = away.each_mut().map(|spikes| {
                    while spikes.next_if(|s| s.end <= i).is_some() {}
                    spikes.peek().is_some_and(|s| s.contains(&i))
                });
                if spiked == [false; 3] && next.peek().is_none_or(|m| i < m.start) {
                    rows.push([r.pressure[i], r.stroke[i], force[i]]);
                }
            }
        }
        let mut forces: Vec<f64> = rows.iter().map(|r| r[2]).collect();
        forces.sort_unstable_by(f64::total_cmp);
        let largest = forces.last().copied()?;
        let at = |share: f64| forces[(share * (forces.len() - 1) as f64) as usize];
        let (floor, top) = (at(0.002), at(0.998));
        // Where the force hardly changes, as on a dead weight, no row exceeds the lowest by a share of the largest.
        let span = (top - floor).max(top.abs());
        let at_largest = forces.iter().rev().take_while(|f| **f == largest).count();
        let clipped = at_largest >= 5 && at_largest as f64 >= CLIPPED * forces.len() as f64;
        rows.retain(|r| r[2] > floor + PULLS * span);
        if rows.len() < 5 * TERMS {
            return None;
        }
        let bounds = |k: usize| extremes(rows.iter().map(|r| r[k]));
        let ((lowest, highest), stroke) = (bounds(0), bounds(1));
        let mut expected = Self {
            surface: ForceSurface::default(),
            pressure: highest.abs().max(lowest.abs()).max(f64::MIN_POSITIVE),
            stroke: (stroke.0, (stroke.1 - stroke.0).max(1e-9)),
            floor,
            span,
            ceiling: if clipped { largest } else { f64::INFINITY },
        };
        expected.surface = expected.fitted(&rows)?;
        // A wrong unit from the first row on shows no step; it must not bend the surface.
        for _ in 0..ROUNDS {
            let off = |r: &[f64; 3]| (r[2] - expected.force(r[0], r[1])).abs();
            let mut sizes: Vec<f64> = rows.iter().map(off).collect();
            let far = FAR * median(&mut sizes);
            let near: Vec<[f64; 3]> = rows.iter().copied().filter(|r| off(r) <= far).collect();
            expected.surface = expected.fitted(&near)?;
        }
        Some(expected)
    }

    fn fitted(&self, rows: &[[f64; 3]]) -> Option<ForceSurface> {
        let scaled = rows.iter().map(|[p, x, f]| (self.scaled(*p, *x), *f));
        ForceSurface::fit(scaled, &HELD)
    }

    /// Pressure and stroke as shares of their ranges.
    fn scaled(&self, pressure: f64, stroke: f64) -> [f64; 2] {
        [pressure / self.pressure, (stroke - self.stroke.0) / self.stroke.1]
    }

    /// The force of the surface, N, at a pressure in Pa and a stroke in m.
    fn force(&self, pressure: f64, stroke: f64) -> f64 {
        self.surface.force(self.scaled(pressure, stroke))
    }

    /// The force expected in a row of a recording, N: not below the lowest that was read.
    pub(in crate::recording) fn at(&self, r: &Recording, row: usize) -> f64 {
        self.force(r.pressure[row], r.stroke[row]).max(self.floor)
    }

    /// What the expected force leaves of the force that was read in a row, N.
    pub(in crate::recording) fn residual(&self, r: &Recording, row: usize) -> f64 {
        r.force.as_ref().map_or(0.0, |f| f[row]) - self.at(r, row)
    }

    /// The lowest force of the campaign, N.
    pub(in crate::recording) fn floor(&self) -> f64 {
        self.floor
    }

    /// The least change of the expected force, N, that a recording's force would show.
    pub(super) fn noticeable(&self, force: &[f64]) -> f64 {
        (NOTICEABLE.0 * self.span).max(NOTICEABLE.1 * white_noise(force))
    }

    /// Whether the force continues through a stretch, and for a while after, as if its pressure steps had not happened. `least` is what
    /// [`Self::noticeable`] gives of the recording.
    pub(super) fn continues(&self, stretch: &Stretch, r: &Recording, force: &[f64], least: f64) -> bool {
        let Range { start, end } = stretch.rows;
        let bridge = stretch.bridged(&r.time, &r.pressure);
        let inside = if start > 0 { start } else { end - 1 };
        let step = (r.pressure[inside] - stretch.beside(&r.pressure)).abs();
        // What the surface leaves is the same before and after, up to friction that turns between.
        let left = |i: usize| force[i] - self.force(r.pressure[i], r.stroke[i]);
        let near = |a: usize, i: usize| (r.pressure[i] - r.pressure[a]).abs() <= 0.1 * step;
        let before = (0..start).rev().take(BESIDE).take_while(|i| near(start - 1, *i)).map(left);
        let after = (end..r.len()).take(BESIDE).take_while(|i| near(end, *i)).map(left);
        let (low, high) = match (mean(before), mean(after)) {
            (Some(before), Some(after)) => (before.min(after), before.max(after)),
            (Some(one), None) | (None, Some(one)) => (one, one),
            (None, None) => return false,
        };
        let mut made = 0.0;
        let undisturbed = |i: usize, pressure: f64, made: f64| {
            let base = self.force(pressure, r.stroke[i]);
            let off = (force[i] - base - high).max(base + low - force[i]).max(0.0);
            off <= FOLLOWS * made && force[i] < self.ceiling
        };
        for (i, pressure) in stretch.rows.clone().zip(bridge) {
            let base = self.force(pressure, r.stroke[i]) + 0.5 * (low + high);
            let pushed = self.force(r.pressure[i], r.stroke[i]) - self.force(pressure, r.stroke[i]);
            let change = r.pressure[i] - pressure;
            made = (base + pushed).max(self.floor) - base;
            if base < self.floor + PULLS * self.span
                || made * change <= 0.0
                || made.abs() < least
                || low.abs().max(high.abs()) > SUPPORTED * made.abs()
                || !undisturbed(i, pressure, made.abs())
            {
                return false;
            }
        }
        let late = |i: &usize| r.time[*i] - r.time[end] <= LATE.0 || *i < end + LATE.1;
        (end..r.len())
            .take_while(late)
            .take_while(|i| near(end, *i))
            .all(|i| undisturbed(i, r.pressure[i], made.abs()))
    }
}

/// `None` of nothing.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    (n > 0.0).then(|| sum / n)
}
