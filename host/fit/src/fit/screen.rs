//! Which points a fit may use, and why it excludes others. Every excluded point is counted and reported.

use pam_data::recording::Campaign;
use pam_data::statistics::extremes;

use super::points::Points;

/// Whether a point takes part in the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PointUse {
    /// It takes part.
    Fitted,
    /// Excluded: the direction of motion is unknown, and with it the sign of friction.
    UnknownDirection,
    /// Excluded: just after a reversal, where friction has not changed sign completely.
    NearReversal,
    /// Excluded: the muscle is slack; the force stays at zero where the model would push.
    Slack,
    /// Excluded: the rig pushes the muscle; the table describes its pull.
    Pushed,
    /// Excluded: the force reading is at the end of the sensor's range.
    Clipped,
    /// Excluded: the reading is far outside the scatter of the others.
    Outlier,
    /// Excluded: a sensor failed for these rows, or something other than the muscle holds a constant load.
    Dropout,
}

/// A force reading outside the scatter of the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// Index of the recording in the campaign.
    pub recording: u32,
    /// Index of the row in that recording.
    pub row: u32,
    /// Time, s.
    pub time: f64,
    /// The reading, N.
    pub force: f64,
    /// Its distance from what the other readings give, N.
    pub off: f64,
}

/// An end of the force sensor's range: many rows are at exactly the smallest, or the largest, value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clip {
    /// The reading at that end, N.
    pub force: f64,
    /// How many rows are at it.
    pub rows: usize,
}

/// The use of every point, and what was found on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Screen {
    /// The use of each point, in the order of the points.
    pub used: Vec<PointUse>,
    /// The distance from a reversal within which points are excluded, as a share of the ranges of stroke and pressure.
    pub reversal_zone: f64,
    /// Whether the recordings show the muscle slack.
    pub goes_slack: bool,
    /// Readings outside the scatter of the others.
    pub outliers: Vec<Outlier>,
    /// Points of a slack muscle that take part so that the model does not pull there; empty where there are none.
    pub held_down: Vec<bool>,
}

impl Screen {
    /// Excludes what can be judged without a model: sensor failures, ends of the sensor's range, unknown directions.
    pub(super) fn without_model(
        points: &Points,
        clips: (Option<Clip>, Option<Clip>),
        outliers: Vec<Outlier>,
    ) -> Self {
        let known: f64 = points.list.iter().filter(|p| p.direction != 0.0).map(|p| f64::from(p.rows)).sum();
        // Where the direction is rarely known there is no friction to find, and every point takes part.
        let drop_unknown = known > 0.5 * points.rows as f64;
        let tolerance = 1e-9 * points.force.span();
        let at = |clip: &Option<Clip>, value: f64| clip.is_some_and(|c| (value - c.force).abs() <= tolerance);
        let used = points.list.iter().map(|p| {
            if p.dropout {
                PointUse::Dropout
            } else if at(&clips.0, p.force_range.0) || at(&clips.1, p.force_range.1) {
                PointUse::Clipped
            } else if p.direction == 0.0 && drop_unknown {
                PointUse::UnknownDirection
            } else {
                PointUse::Fitted
            }
        });
        Self { used: used.collect(), reversal_zone: 0.05, goes_slack: false, outliers, held_down: Vec::new() }
    }

    /// The same with another use of the points.
    pub(super) fn with_use(&self, used: Vec<PointUse>) -> Self {
        Self { used, ..self.clone() }
    }
}

/// Finds the ends of the force sensor's range. A converter that clips repeats one exact value; the readings of a free sensor near its
/// smallest value scatter over several.
#[must_use]
pub fn clip(campaign: &Campaign) -> (Option<Clip>, Option<Clip>) {
    let readings = || campaign.recordings.iter().filter_map(|r| r.force.as_deref()).flatten().copied();
    let count = |value: f64| readings().filter(|f| *f == value).count();
    let (low, high) = extremes(readings());
    let ends = |value: f64, side: f64| {
        let rows = count(value);
        if rows < 30.max(campaign.samples() / 300) {
            return None;
        }
        // The next distinct reading: at a free end it is about as frequent as the last one.
        let next = readings()
            .filter(|f| side * (f - value) > 0.0)
            .fold(f64::INFINITY, |best, f| best.min(side * (f - value)));
        let neighbours = if next.is_finite() { count(value + side * next) } else { 0 };
        (rows > 3 * neighbours && high > low).then_some(Clip { force: value, rows })
    };
    (ends(low, 1.0), ends(high, -1.0))
}
