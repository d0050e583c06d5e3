//! The menu of steps: what can be done with the muscle, as plain data.

use pam_fit::checks;
use serde::{Deserialize, Serialize};

use crate::criteria::{
    FIRST_RAMP_SHARE, HANDLING_S, RAMP_SHARE, SLOW_RAMP_SHARE, SURVEY_HOLD, SURVEY_RAMP_SHARE,
};
use crate::places::Places;
use crate::step_profile::{Segment, StepProfile, VENT_S};

/// What a step does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum Step {
    /// Vented at rest length: the zeros of the instruments.
    Tare {
        /// How long, s.
        seconds: f64,
    },
    /// Pressure up and down at rest length: deadband, and blocked force.
    BlockedRamp,
    /// One stroke from blocked to free and back at every level, the highest first.
    Survey {
        /// Speed, in slow speeds.
        times: f64,
    },
    /// Strokes from blocked to free and back.
    Loops {
        /// Pressure, Pa.
        level: f64,
        /// Speed, in slow speeds.
        times: f64,
        /// How many.
        count: u32,
    },
    /// One slow stroke, two at four times its speed, three at sixteen times.
    Speeds {
        /// Pressure, Pa.
        level: f64,
    },
    /// Two holds at the same place, reached from either side.
    Dwells {
        /// Pressure, Pa.
        level: f64,
        /// How long each, s.
        seconds: f64,
    },
    /// Small strokes inside large ones.
    Nested {
        /// Pressure, Pa.
        level: f64,
        /// Speed, in slow speeds.
        times: f64,
    },
    /// Slow pressure ramps at a held length, down and up twice.
    Ramps {
        /// Stroke, share of the free stroke at the highest level.
        part: f64,
    },
    /// A pressure staircase up and down at a held length.
    Staircase {
        /// Stroke, share of the free stroke at the highest level.
        part: f64,
        /// How long each stair, s.
        seconds: f64,
    },
    /// Vented rest, then one slow stroke.
    Rest {
        /// How long, s.
        seconds: f64,
        /// Pressure of the stroke, Pa.
        level: f64,
    },
    /// A check of the bench without the muscle.
    Check {
        /// Which check it is.
        check: checks::Kind,
    },
}

/// How long a check takes, s: its recording, as the virtual bench makes it, and its handling.
pub(crate) const fn check_seconds(check: checks::Kind) -> f64 {
    let recording = match check {
        checks::Kind::DeadWeights => 84.0,
        checks::Kind::RigidBar => 120.0,
        checks::Kind::ReferenceGauge => 60.0,
        checks::Kind::Weighing => 48.0,
        checks::Kind::ClosedValve => 72.0,
    };
    recording + HANDLING_S
}

impl Step {
    /// A short name for files.
    #[must_use]
    pub fn name(&self) -> String {
        let kpa = |p: f64| format!("{:03.0}kPa", p * 1e-3);
        match *self {
            Self::Tare { .. } => "tare".into(),
            Self::BlockedRamp => "blocked_ramp".into(),
            Self::Survey { .. } => "survey".into(),
            Self::Loops { level, times, .. } if times > 1.0 => format!("fast_{}", kpa(level)),
            Self::Loops { level, .. } => format!("loops_{}", kpa(level)),
            Self::Speeds { level } => format!("speeds_{}", kpa(level)),
            Self::Dwells { level, .. } => format!("dwells_{}", kpa(level)),
            Self::Nested { level, .. } => format!("nested_{}", kpa(level)),
            Self::Ramps { part } => format!("ramps_{:02.0}percent", 100.0 * part),
            Self::Staircase { part, .. } => format!("staircase_{:02.0}percent", 100.0 * part),
            Self::Rest { level, .. } => format!("rested_{}", kpa(level)),
            Self::Check { check } => check.file_name().into(),
        }
    }

    /// As text.
    #[must_use]
    pub fn description(&self) -> String {
        let kpa = |p: f64| format!("{:.0} kPa", p * 1e-3);
        match *self {
            Self::Tare { seconds } => format!("vented at rest length for {seconds:.0} s"),
            Self::BlockedRamp => "a pressure ramp up and down at rest length".into(),
            Self::Survey { times } => {
                format!("a stroke at each pressure level, {times} × the slow speed")
            }
            Self::Loops { level, times, count } => {
                format!("{count} strokes at {}, {times} × the slow speed", kpa(level))
            }
            Self::Speeds { level } => format!("strokes at three speeds at {}", kpa(level)),
            Self::Dwells { level, seconds } => {
                format!(
                    "two holds of {seconds:.0} s at the same place, reached from either side, at {}",
                    kpa(level)
                )
            }
            Self::Nested { level, .. } => format!("small strokes inside large ones at {}", kpa(level)),
            Self::Ramps { part } => {
                format!("slow pressure ramps, the length held at {:.0} % of the free stroke", 100.0 * part)
            }
            Self::Staircase { part, .. } => {
                format!("a pressure staircase, the length held at {:.0} % of the free stroke", 100.0 * part)
            }
            Self::Rest { seconds, level } => {
                format!("a vented rest of {:.0} s, then a slow stroke at {}", seconds, kpa(level))
            }
            Self::Check { check } => match check {
                checks::Kind::DeadWeights => "a check of the load cell with dead weights".into(),
                checks::Kind::RigidBar => "a check of the frame with a rigid bar".into(),
                checks::Kind::ReferenceGauge => {
                    "a check of the pressure sensor with a reference gauge".into()
                }
                checks::Kind::Weighing => {
                    "a check of the load cell with and without muscle and fittings".into()
                }
                checks::Kind::ClosedValve => "a check of the muscle for a leak behind a closed valve".into(),
            },
        }
    }

    /// Its profile on a muscle; empty for a check, which has no muscle.
    #[must_use]
    pub fn profile(&self, places: &Places) -> StepProfile {
        let mut builder = Builder { places, profile: StepProfile::default(), level: 0.0 };
        match *self {
            Self::Tare { seconds } => {
                builder.profile.skip(Segment::Vented { seconds: VENT_S });
                builder.profile.record(Segment::Vented { seconds });
            }
            Self::BlockedRamp => builder.blocked_ramp(),
            Self::Survey { times } => {
                for level in places.levels().into_iter().rev() {
                    builder.set(level, SURVEY_RAMP_SHARE, SURVEY_HOLD);
                    builder.loops(times, 1);
                }
            }
            Self::Loops { level, times, count } => {
                builder.begin(level);
                builder.loops(times, count);
            }
            Self::Speeds { level } => {
                builder.begin(level);
                for (times, count) in [(1.0, 1), (4.0, 2), (16.0, 3)] {
                    builder.loops(times, count);
                }
            }
            Self::Dwells { level, seconds } => {
                builder.begin(level);
                builder.dwells(seconds);
            }
            Self::Nested { level, times } => {
                builder.begin(level);
                for part in [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0] {
                    builder.go(part, times);
                }
            }
            Self::Ramps { part } => builder.ramps(part),
            Self::Staircase { part, seconds } => builder.staircase(part, seconds),
            Self::Rest { seconds, level } => {
                builder.profile.skip(Segment::Vented { seconds });
                builder.begin(level);
                builder.loops(1.0, 1);
            }
            Self::Check { .. } => return StepProfile::default(),
        }
        builder.end();
        builder.profile
    }

    /// Whether the length is held shorter than the rest length.
    #[must_use]
    pub(crate) fn is_held_shortened(&self) -> bool {
        matches!(self, Self::Ramps { part } | Self::Staircase { part, .. } if *part > 0.0)
    }

    /// Bench time that it takes, s.
    #[must_use]
    pub fn seconds(&self, places: &Places) -> f64 {
        match self {
            Self::Check { check } => check_seconds(*check),
            _ => {
                let moves = if places.by_hand { f64::from(self.positions()) * HANDLING_S } else { 0.0 };
                self.profile(places).seconds() + moves
            }
        }
    }

    /// Strokes that the operator would have to set.
    fn positions(&self) -> u32 {
        if self.is_held_shortened() { 2 } else { 0 }
    }
}

struct Builder<'a> {
    places: &'a Places,
    profile: StepProfile,
    level: f64,
}

impl Builder<'_> {
    fn begin(&mut self, level: f64) {
        self.set(level, RAMP_SHARE, 2.0);
    }

    /// Goes to a level at a rate, share of the highest level per second, and waits there, s.
    fn set(&mut self, level: f64, rate: f64, seconds: f64) {
        self.level = level;
        self.profile.skip(Segment::Ramp { to: level, rate: rate * self.places.top });
        self.profile.skip(Segment::Hold { seconds });
    }

    fn end(&mut self) {
        self.profile.skip(Segment::Vented { seconds: VENT_S });
    }

    fn speed(&self, times: f64) -> f64 {
        (times * self.places.slow_speed()).min(self.places.speed_max)
    }

    fn travel(&mut self, to: f64, times: f64) {
        // An operator sets the stroke of a vented muscle: no force shows where it becomes free.
        let ends_by_force = to > 0.0 && !self.places.by_hand;
        let until_force = ends_by_force.then_some(self.places.free_force());
        self.profile.record(Segment::Travel { to, speed: self.speed(times), until_force });
    }

    fn go(&mut self, part: f64, times: f64) {
        self.travel(part * self.places.free_stroke(self.level), times);
    }

    fn loops(&mut self, times: f64, count: u32) {
        for _ in 0..count {
            self.go(1.0, times);
            self.go(0.0, times);
        }
    }

    fn dwells(&mut self, seconds: f64) {
        self.go(0.5, 4.0);
        self.profile.record(Segment::Hold { seconds });
        self.go(0.9, 4.0);
        self.go(0.5, 4.0);
        self.profile.record(Segment::Hold { seconds });
        self.go(0.0, 4.0);
    }

    fn blocked_ramp(&mut self) {
        let top = self.places.top;
        let rate = FIRST_RAMP_SHARE * top;
        self.profile.record(Segment::Ramp { to: top, rate });
        self.profile.record(Segment::Hold { seconds: 2.0 });
        self.profile.record(Segment::Ramp { to: 0.0, rate });
        self.profile.record(Segment::Hold { seconds: 2.0 });
    }

    fn ramps(&mut self, part: f64) {
        let top = self.places.top;
        self.begin(top);
        let stroke = part * self.places.free_stroke(top);
        let low = self.places.pressure_that_reaches(1.05 * stroke);
        self.travel(stroke, 4.0);
        for to in [low, top, low, top] {
            self.profile.record(Segment::Ramp { to, rate: SLOW_RAMP_SHARE * top });
            self.profile.record(Segment::Hold { seconds: 2.0 });
        }
        self.travel(0.0, 4.0);
    }

    fn staircase(&mut self, part: f64, seconds: f64) {
        let top = self.places.top;
        self.begin(top);
        let stroke = part * self.places.free_stroke(top);
        let low = self.places.pressure_that_reaches(1.05 * stroke);
        if stroke > 0.0 {
            self.travel(stroke, 4.0);
        }
        let stairs = 8;
        let at = |i: i32| low + (top - low) * f64::from(i) / f64::from(stairs);
        let down_and_up = (0..stairs).rev().chain(1..=stairs);
        for to in down_and_up.map(at) {
            self.profile.record(Segment::Ramp { to, rate: RAMP_SHARE * top });
            self.profile.record(Segment::Hold { seconds });
        }
        if stroke > 0.0 {
            self.travel(0.0, 4.0);
        }
    }
}
