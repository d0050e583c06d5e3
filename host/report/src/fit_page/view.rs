//! What the figures of a fit share: points with their residuals, and how tested pressures are called and coloured.

use model_core::units::{Length, Pressure};
use pam_data::statistics::extremes;

use super::super::{Colour, fixed, significant};
use pam_data::recording::Campaign;
use pam_data::statistics::NORMAL_95;
use pam_fit::Fit;
use pam_fit::Point;
use pam_fit::PointUse;
use pam_fit::confidence_band::ConfidenceBand;
use pam_fit::table_file::{About, TableFile};

/// A fit, ready to be drawn.
pub(super) struct View<'a> {
    pub fit: &'a Fit,
    pub campaign: &'a Campaign,
    /// Tested pressures, or middles of intervals, Pa.
    pub levels: &'a [f64],
    /// Rest length of the muscle, m.
    pub l0: f64,
    /// Strokes of the tested lengths, m, ascending, where every recording was held at one length; otherwise empty.
    pub lengths: Vec<f64>,
    /// `F − F_model` of every point by the table itself, N.
    pub residual: Vec<f64>,
    /// The points, their strokes with the correction of a fitted mounting: the table was fitted at these.
    points: Vec<Point>,
    muscle: Option<model_core::muscle::Muscle<f64>>,
    band: Option<ConfidenceBand>,
}

/// A curve with the edges of its interval.
pub(super) struct Banded {
    pub middle: Vec<f64>,
    pub low: Vec<f64>,
    pub high: Vec<f64>,
}

impl FromIterator<[f64; 3]> for Banded {
    fn from_iter<I: IntoIterator<Item = [f64; 3]>>(values: I) -> Self {
        let mut all = Self { middle: Vec::new(), low: Vec::new(), high: Vec::new() };
        for [middle, low, high] in values {
            all.middle.push(middle);
            all.low.push(low);
            all.high.push(high);
        }
        all
    }
}

impl<'a> View<'a> {
    /// The pressure of the blocked force that the fit states, Pa: the highest held level, or the highest reading of a continuous range.
    pub fn highest_pressure(&self) -> f64 {
        let problem = &self.fit.solution.problem;
        let level = self.levels.last().copied().filter(|_| problem.pressures.held);
        level.unwrap_or(problem.points.pressure.high)
    }

    pub fn new(fit: &'a Fit, campaign: &'a Campaign) -> Self {
        let muscle = model_core::muscle::Muscle::<f64>::build(&fit.table).ok();
        let l0 = fit.solution.problem.braid.rest_length();
        let levels = fit.solution.problem.pressures.levels.as_slice();
        let uncertainty = Some(fit.stored_uncertainty());
        let about = About { uncertainty, ..About::default() };
        let band = ConfidenceBand::of(&TableFile { table: fit.table.clone(), about });
        let problem = &fit.solution.problem;
        let corrected = |(p, shift): (&Point, &f64)| Point { stroke: p.stroke + shift, ..*p };
        let points: Vec<Point> = problem.points.list.iter().zip(&problem.shift).map(corrected).collect();
        let lengths = lengths(&points, l0, problem.points.stroke_noise);
        let mut view =
            Self { fit, campaign, levels, l0, lengths, residual: Vec::new(), points, muscle, band };
        view.residual = view
            .points()
            .iter()
            .map(|p| p.force - view.force(p.pressure, p.stroke, view.direction(p)))
            .collect();
        view
    }

    /// Whether every recording was held at one length: then force is drawn against pressure.
    pub fn held_length(&self) -> bool {
        !self.lengths.is_empty()
    }

    /// The tested length nearest to a stroke.
    pub fn length_of(&self, stroke: f64) -> usize {
        let off = |i: &usize| (self.lengths[*i] - stroke).abs();
        (0..self.lengths.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// A tested length with its contraction.
    pub fn length_name(&self, length: usize) -> String {
        let Some(stroke) = self.lengths.get(length) else { return String::new() };
        format!("{} mm ({} %)", fixed(1e3 * (self.l0 - stroke), 1), fixed(self.contraction(*stroke), 1))
    }

    pub fn length_colour(&self, length: usize) -> Colour {
        Colour::ordered(length, self.lengths.len())
    }

    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Whether the lengths of the mountings were fitted, so that they differ from the recorded ones.
    pub fn fitted_lengths(&self) -> bool {
        !self.fit.solution.problem.mountings.is_empty()
    }

    fn direction(&self, p: &Point) -> f64 {
        if self.fit.solution.problem.design.friction { p.direction } else { 0.0 }
    }

    /// The table's force, N.
    pub fn force(&self, pressure: f64, stroke: f64, direction: f64) -> f64 {
        self.muscle.as_ref().map_or(f64::NAN, |m| {
            m.force(Pressure::from_pascals(pressure), Length::from_metres(stroke), direction).newtons()
        })
    }

    /// Slope of the friction-free force over contraction, N.
    pub fn slope(&self, pressure: f64, contraction: f64) -> f64 {
        let h = 1e-4;
        let at = |c: f64| self.force(pressure, c * self.l0, 0.0);
        (at(contraction + h) - at(contraction - h)) / (2.0 * h)
    }

    /// The tested pressure that a point belongs to.
    pub fn group(&self, i: usize) -> usize {
        let design = &self.fit.solution.problem.design;
        design.bins[design.rows[i].bin as usize].group as usize
    }

    pub fn fitted(&self, i: usize) -> bool {
        self.fit.solution.screen.used[i] == PointUse::Fitted
    }

    /// Contraction in percent.
    pub fn contraction(&self, stroke: f64) -> f64 {
        100.0 * stroke / self.l0
    }

    pub fn name(&self, group: usize) -> String {
        let Some(p) = self.levels.get(group) else { return String::new() };
        if self.fit.solution.problem.pressures.held {
            format!("{} kPa", fixed(p / 1e3, 0))
        } else {
            format!("about {} kPa", fixed(p / 1e3, 0))
        }
    }

    pub fn colour(&self, group: usize) -> Colour {
        Colour::ordered(group, self.levels.len())
    }

    /// At most `most` tested pressures, the lowest and the highest among them.
    pub fn some(&self, most: usize) -> Vec<usize> {
        let n = self.levels.len();
        if n <= most {
            return (0..n).collect();
        }
        let last = (most - 1).max(1);
        (0..most).map(|i| i * (n - 1) / last).collect()
    }

    /// Strokes over the range tested at one pressure, m.
    pub fn strokes(&self, group: usize, count: usize) -> Vec<f64> {
        let of =
            (0..self.points().len()).filter(|i| self.group(*i) == group).map(|i| self.points()[i].stroke);
        let (low, high) = extremes(of);
        if !(low < high) {
            return if low.is_finite() { vec![low] } else { Vec::new() };
        }
        (0..count).map(|i| low + (high - low) * i as f64 / (count - 1).max(1) as f64).collect()
    }

    /// The table's force with the edges of its 95 % interval along some strokes at one pressure, N.
    pub fn banded(&self, pressure: f64, strokes: &[f64], direction: f64) -> Banded {
        strokes.iter().map(|x| self.banded_at(pressure, *x, direction)).collect()
    }

    /// The same at one pressure and one stroke: force, lower and upper edge.
    pub fn banded_at(&self, pressure: f64, stroke: f64, direction: f64) -> [f64; 3] {
        let force = self.force(pressure, stroke, direction);
        let half = self.band.as_ref().map_or(f64::NAN, |b| NORMAL_95 * b.std(pressure, stroke, direction));
        [force, force - half, force + half]
    }

    /// Half the width of the 95 % interval of single readings, N.
    pub fn half_of_readings(&self, pressure: f64, stroke: f64, direction: f64) -> f64 {
        self.band.as_ref().map_or(f64::NAN, |b| NORMAL_95 * b.reading_std(pressure, stroke, direction))
    }

    /// Description of where the largest error is.
    pub fn worst_place(&self) -> String {
        let worst = self.fit.chunks.iter().max_by(|a, b| a.percent.abs().total_cmp(&b.percent.abs()));
        worst.map_or(String::new(), |c| {
            format!(
                "at {}, contraction {} %",
                self.name(c.group as usize),
                significant(100.0 * c.contraction, 2)
            )
        })
    }
}

/// A length counts as held within this share of the rest length, or within six deviations of the stroke's noise; lengths that differ by
/// less are one length.
const HELD: f64 = 0.003;

/// The mean stroke of each tested length; empty where a recording moved.
fn lengths(points: &[Point], l0: f64, noise: f64) -> Vec<f64> {
    let mut ranges: std::collections::BTreeMap<u32, (f64, f64, f64, f64)> = std::collections::BTreeMap::new();
    for p in points {
        let (low, high, sum, count) =
            ranges.entry(p.recording).or_insert((f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0));
        (*low, *high) = (low.min(p.stroke), high.max(p.stroke));
        (*sum, *count) = (*sum + p.stroke, *count + 1.0);
    }
    let tolerance = (HELD * l0).max(6.0 * noise);
    if ranges.is_empty() || !ranges.values().all(|(low, high, ..)| high - low <= tolerance) {
        return Vec::new();
    }
    let mut means: Vec<(f64, f64)> =
        ranges.values().map(|(_, _, sum, count)| (sum / count, *count)).collect();
    means.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut groups: Vec<(f64, f64, f64)> = Vec::new();
    for (mean, count) in means {
        match groups.last_mut() {
            Some((last, sum, n)) if mean - *last <= HELD * l0 => {
                (*last, *sum, *n) = (mean, *sum + mean * count, *n + count);
            }
            _ => groups.push((mean, mean * count, count)),
        }
    }
    groups.into_iter().map(|(_, sum, count)| sum / count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(recording: u32, stroke: f64) -> Point {
        Point {
            recording,
            first_row: 0,
            rows: 1,
            block: 0,
            direction: 1.0,
            time: 0.0,
            pressure: 2e5,
            stroke,
            force: 1.0,
            force_range: (1.0, 1.0),
            since_reversal: 1.0,
            dropout: false,
        }
    }

    #[test]
    fn recordings_at_held_length_are_grouped_by_length_and_a_moving_one_is_none() {
        let mut points =
            vec![point(0, 0.0), point(0, 1e-4), point(1, 0.02), point(2, 0.0201), point(3, 0.05)];
        let found = lengths(&points, 0.2, 0.0);
        assert_eq!(found.len(), 3);
        assert!((found[1] - 0.02005).abs() < 1e-9 && (found[2] - 0.05).abs() < 1e-9, "{found:?}");
        points.push(point(3, 0.06));
        assert!(lengths(&points, 0.2, 0.0).is_empty());
        assert!(lengths(&[], 0.2, 0.0).is_empty());
    }
}
