//! Which points a fit may use, and why others are set aside: nothing is dropped without being counted and said.

use pam_data::recording::Campaign;

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
    /// The gauge alone fell out: the pressure of these rows is bridged.
    Dropout,
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
pub fn clip(campaign: &Campaign) -> (Option<Clip>, Option<Clip>) {
    let readings = || campaign.recordings.iter().filter_map(|r| r.force.as_deref()).flatten().copied();
    let count = |value: f64| readings().filter(|f| *f == value).count();
    let (low, high) =
        readings().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), f| (low.min(f), high.max(f)));
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
