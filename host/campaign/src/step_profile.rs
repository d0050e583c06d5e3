//! The setpoint profile of a step: pressure and stroke over time, in SI units.

/// One stretch of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Segment {
    /// The free end moves at constant speed.
    Travel {
        /// To this stroke, m.
        to: f64,
        /// Speed, m/s.
        speed: f64,
        /// Where the force has fallen to this value (N) before, the motion ends there; for motions that shorten.
        until_force: Option<f64>,
    },
    /// The commanded pressure changes at constant rate.
    Ramp {
        /// To this pressure, Pa.
        to: f64,
        /// Rate, Pa/s.
        rate: f64,
    },
    /// Nothing changes.
    Hold {
        /// How long, s.
        seconds: f64,
    },
    /// Vented at rest length.
    Vented {
        /// How long, s.
        seconds: f64,
    },
}

/// The segments of a step, and which of them are recorded. It begins and ends vented at rest length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepProfile {
    /// Segments, and whether each is recorded.
    pub segments: Vec<(Segment, bool)>,
}

/// Time in which a muscle vents, s.
pub(crate) const VENT_S: f64 = 2.0;

impl StepProfile {
    /// Adds a segment that is recorded.
    pub fn record(&mut self, segment: Segment) {
        self.segments.push((segment, true));
    }

    /// Adds one that is not.
    pub fn skip(&mut self, segment: Segment) {
        self.segments.push((segment, false));
    }

    /// How long it takes, s, where no motion ends early.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        let (mut pressure, mut stroke, mut total) = (0.0_f64, 0.0_f64, 0.0);
        for (segment, _) in &self.segments {
            total += duration(segment, pressure, stroke);
            match *segment {
                Segment::Travel { to, .. } => stroke = to,
                Segment::Ramp { to, .. } => pressure = to,
                Segment::Hold { .. } => {}
                Segment::Vented { .. } => (pressure, stroke) = (0.0, 0.0),
            }
        }
        total
    }

    /// Time, pressure and stroke at a sampling rate, as they are if the muscle follows, for what is recorded.
    #[must_use]
    pub fn samples(&self, begin: f64, hz: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let (mut time, mut pressure, mut stroke) = (Vec::new(), Vec::new(), Vec::new());
        let (mut now, mut p, mut x) = (begin, 0.0_f64, 0.0_f64);
        for (segment, recorded) in &self.segments {
            let seconds = duration(segment, p, x);
            let (to_p, to_x) = match *segment {
                Segment::Travel { to, .. } => (p, to),
                Segment::Ramp { to, .. } => (to, x),
                Segment::Hold { .. } => (p, x),
                Segment::Vented { .. } => (0.0, 0.0),
            };
            if let (Segment::Vented { .. }, true) = (segment, recorded) {
                (p, x) = (0.0, 0.0);
            }
            let count = (seconds * hz).round() as usize;
            for i in 1..=count {
                if *recorded {
                    let part = i as f64 / count as f64;
                    time.push(now + i as f64 / hz);
                    pressure.push(p + (to_p - p) * part);
                    stroke.push(x + (to_x - x) * part);
                }
            }
            now += count as f64 / hz;
            (p, x) = (to_p, to_x);
        }
        (time, pressure, stroke)
    }
}

/// How long a segment takes from a pressure (Pa) and a stroke (m), s.
#[must_use]
pub(crate) fn duration(segment: &Segment, pressure: f64, stroke: f64) -> f64 {
    match *segment {
        Segment::Travel { to, speed, .. } => (to - stroke).abs() / speed.max(1e-9),
        Segment::Ramp { to, rate } => (to - pressure).abs() / rate.max(1e-9),
        Segment::Hold { seconds } | Segment::Vented { seconds } => seconds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_takes_as_long_as_its_segments_and_records_what_it_should() {
        let mut profile = StepProfile::default();
        profile.skip(Segment::Ramp { to: 2e5, rate: 1e5 });
        profile.record(Segment::Travel { to: 2e-3, speed: 1e-3, until_force: None });
        profile.record(Segment::Travel { to: 0.0, speed: 1e-3, until_force: None });
        profile.skip(Segment::Vented { seconds: VENT_S });
        assert!((profile.seconds() - 8.0).abs() < 1e-9);
        let (time, pressure, stroke) = profile.samples(100.0, 10.0);
        assert_eq!((time.len(), pressure[0], stroke[19]), (40, 2e5, 2e-3));
        assert!((time[0] - 102.1).abs() < 1e-9);
    }
}
