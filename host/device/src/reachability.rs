//! Why a setpoint could not be reached, and how long a run was outside the tested range of its table.

use model_core::inverse::Attainability;
use model_core::link::messages::{Side, State, Telemetry};
use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use model_core::units::{Force, Length, Pressure};
use serde::Serialize;

use super::setpoint_profile::{Quantity, SetpointProfile};
use super::{Client, tables};
use pam_data::error::Result;

/// A setpoint above a limit by less than this factor is at the limit: numbers that users write are rounded.
const ROUNDING: f32 = 1.001;
/// Halvings of an interval: a rest length divided by 2^20 is below a micrometre.
const BISECTIONS: usize = 20;

/// How long a run was beyond what its table can do, or was tested for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unreached {
    /// More force than the muscle pulls at that stroke and the highest pressure allowed.
    pub beyond_blocked_force_s: f64,
    /// Less force than it pulls there without pressure.
    pub below_deadband_s: f64,
    /// At a stroke where more pressure pulls no harder.
    pub not_rising_s: f64,
    /// Outside the tested range of the table.
    pub outside_tested_s: f64,
}

/// Samples of a run, classified by the table of the first muscle without friction and effects.
#[derive(Debug)]
pub struct Reachability {
    table: MuscleTable,
    muscle: Muscle<f32>,
    guess: Pressure<f32>,
    samples: u64,
    beyond_blocked_force: u64,
    below_deadband: u64,
    not_rising: u64,
    outside_tested: u64,
}

impl Reachability {
    /// For the table that a device has; none without one that this version can read.
    ///
    /// # Errors
    /// As [`tables::read`].
    pub fn of(client: &mut Client) -> Result<Option<Self>> {
        let image = tables::read(client, Side::Agonist)?;
        let table = image.and_then(|image| model_core::image::read(&image).ok());
        Ok(table.and_then(|table| {
            let muscle = Muscle::build(&table).ok()?;
            Some(Self {
                table,
                muscle,
                guess: Pressure::ZERO,
                samples: 0,
                beyond_blocked_force: 0,
                below_deadband: 0,
                not_rising: 0,
                outside_tested: 0,
            })
        }))
    }

    /// Why the muscle cannot follow a profile, before it moves; `None` where the whole profile is within its limits.
    #[must_use]
    pub fn beyond(&self, quantity: Quantity, profile: &SetpointProfile) -> Option<String> {
        let (lowest, highest) = profile.range()?;
        match quantity {
            Quantity::Pressure => self.pressure_beyond(lowest, highest),
            Quantity::Force => self.force_beyond(lowest, highest),
            Quantity::Stroke => self.stroke_beyond(lowest, highest),
            Quantity::Angle { .. } => None,
        }
    }

    fn pressure_beyond(&self, lowest: f32, highest: f32) -> Option<String> {
        let most = self.table.max_pressure;
        if highest > ROUNDING * most.pascals() {
            return Some(format!(
                "the setpoint reaches {:.0} kPa, and the highest pressure of the table is {:.0} kPa: the controller limits the setpoint to it",
                highest / 1e3,
                most.kilopascals()
            ));
        }
        (lowest < 0.0).then(|| {
            format!(
                "the setpoint falls to {:.0} kPa: a regulator cannot go below ambient pressure, 0 kPa",
                lowest / 1e3
            )
        })
    }

    /// Against the force at rest length and the highest pressure, friction included.
    fn force_beyond(&self, lowest: f32, highest: f32) -> Option<String> {
        let most = self.table.max_pressure;
        let friction = self.table.friction.iter().copied().fold(0.0, f32::max);
        let rest = self.muscle.at_stroke(Length::from_metres(0.0));
        let largest = self.muscle.parts(&rest, most).quasi() * (1.0 + friction);
        if highest > largest {
            return Some(format!(
                "the setpoint reaches {highest:.0} N, and the muscle pulls at most {largest:.0} N, at rest length and {:.0} kPa: the pressure \
                 would stay at its highest value",
                most.kilopascals()
            ));
        }
        (lowest < 0.0).then(|| format!("the setpoint falls to {lowest:.0} N: a muscle cannot push"))
    }

    /// Against the stroke at which the muscle pulls nothing at the highest pressure.
    fn stroke_beyond(&self, lowest: f32, highest: f32) -> Option<String> {
        let longest = self.free_stroke();
        if highest > ROUNDING * longest {
            return Some(format!(
                "the setpoint reaches {:.1} mm, and the muscle shortens by at most {:.1} mm, without load at {:.0} kPa: the pressure would \
                 stay at its highest value",
                highest * 1e3,
                longest * 1e3,
                self.table.max_pressure.kilopascals()
            ));
        }
        (lowest < 0.0).then(|| {
            format!(
                "the setpoint falls to {:.1} mm: the muscle is at rest length at 0 mm, and only a load can make it longer",
                lowest * 1e3
            )
        })
    }

    /// The stroke at which the force vanishes at the highest pressure, m.
    fn free_stroke(&self) -> f32 {
        let pulls = |stroke: f32| {
            let held = self.muscle.at_stroke(Length::from_metres(stroke));
            self.muscle.parts(&held, self.table.max_pressure).quasi() > 0.0
        };
        let (mut pulling, mut slack) = (0.0, self.table.geometry.rest_length.metres());
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (pulling + slack);
            if pulls(middle) {
                pulling = middle;
            } else {
                slack = middle;
            }
        }
        pulling
    }

    /// Takes a sample of a run.
    pub fn add(&mut self, quantity: Quantity, sample: &Telemetry) {
        let Some(side) = sample.sides.first() else { return };
        if sample.state != State::Running || !side.stroke_m.is_finite() || !side.pressure_pa.is_finite() {
            return;
        }
        self.samples += 1;
        let tested = &self.table.tested;
        let contraction = side.stroke_m / self.table.geometry.rest_length.si();
        // Friction and a sensor's noise go a little beyond the ends.
        let slack = 0.02 * tested.contraction_high;
        let inside = side.pressure_pa <= 1.02 * tested.pressure_high.pascals()
            && (tested.contraction_low - slack..=tested.contraction_high + slack).contains(&contraction);
        self.outside_tested += u64::from(!inside);
        if quantity == Quantity::Force && sample.setpoint.is_finite() {
            let held = self.muscle.at_stroke(Length::from_metres(side.stroke_m));
            let force = Force::from_newtons(sample.setpoint);
            let found = self.muscle.pressure_for(force, &held, 0.0, self.guess, &self.muscle.search());
            self.guess = found.pressure;
            match found.attainability {
                Attainability::Attainable => {}
                Attainability::BeyondBlockedForce => self.beyond_blocked_force += 1,
                Attainability::BelowDeadband => self.below_deadband += 1,
                Attainability::NotRising | Attainability::NotANumber => self.not_rising += 1,
            }
        }
    }

    /// How long each lasted, for n samples in a second.
    #[must_use]
    pub fn times(&self, per_s: f64) -> Unreached {
        let seconds = |samples: u64| samples as f64 / per_s;
        Unreached {
            beyond_blocked_force_s: seconds(self.beyond_blocked_force),
            below_deadband_s: seconds(self.below_deadband),
            not_rising_s: seconds(self.not_rising),
            outside_tested_s: seconds(self.outside_tested),
        }
    }

    /// Why a force could not be reached: the reason that applied longest.
    #[must_use]
    pub fn why(&self) -> Option<&'static str> {
        let reasons = [
            (
                self.beyond_blocked_force,
                "more than the muscle can pull at that stroke and the highest pressure allowed",
            ),
            (self.below_deadband, "less than it pulls there without pressure"),
            (self.not_rising, "at a stroke where more pressure pulls no harder"),
        ];
        let (samples, reason) = reasons.into_iter().max_by_key(|reason| reason.0)?;
        (samples > 0).then_some(reason)
    }

    /// The warning for a run that spent more than a tenth of its time outside the tested range of the table.
    #[must_use]
    pub fn extrapolated(&self, per_s: f64) -> Option<String> {
        let tested = &self.table.tested;
        (self.outside_tested * 10 > self.samples).then(|| {
            format!(
                "for {:.2} of {:.2} s the muscle was outside the tested range of its table (up to {:.0} kPa, contraction {:.3} to {:.3}): \
                 the table is extrapolated there, and its error is not known",
                self.outside_tested as f64 / per_s,
                self.samples as f64 / per_s,
                tested.pressure_high.kilopascals(),
                tested.contraction_low,
                tested.contraction_high
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::messages::Reference;

    fn of_example() -> Reachability {
        let table = model_core::table::example();
        let muscle = Muscle::build(&table).expect("the example is valid");
        Reachability {
            table,
            muscle,
            guess: Pressure::ZERO,
            samples: 0,
            beyond_blocked_force: 0,
            below_deadband: 0,
            not_rising: 0,
            outside_tested: 0,
        }
    }

    #[test]
    fn unreachable_setpoints_are_found_before_the_muscle_moves() {
        let reachability = of_example();
        let constant = |value| SetpointProfile::Constant(value);
        let said = reachability.beyond(Quantity::Pressure, &constant(9000e3)).expect("beyond");
        assert!(said.contains("9000 kPa") && said.contains("600 kPa"), "{said}");
        let said = reachability.beyond(Quantity::Force, &constant(500.0)).expect("beyond");
        assert!(said.starts_with("the setpoint reaches 500 N, and the muscle pulls at most 1"), "{said}");
        let sine =
            SetpointProfile::Wave(Reference::Sine { mean: 100.0, amplitude: 150.0, frequency_hz: 1.0 });
        assert!(reachability.beyond(Quantity::Force, &sine).is_some());
        assert_eq!(reachability.beyond(Quantity::Force, &constant(100.0)), None);
        assert_eq!(reachability.beyond(Quantity::Pressure, &constant(600e3)), None);
        let said = reachability.beyond(Quantity::Pressure, &constant(-20e3)).expect("below");
        assert!(said.contains("-20 kPa"), "{said}");
        assert!(reachability.beyond(Quantity::Force, &constant(-1.0)).is_some());
    }

    #[test]
    fn a_stroke_longer_than_the_free_one_is_known_before_the_muscle_moves() {
        let reachability = of_example();
        let constant = |metres| SetpointProfile::Constant(metres);
        let free = reachability.free_stroke();
        let held = reachability.muscle.at_stroke(Length::from_metres(free));
        let force = reachability.muscle.parts(&held, reachability.table.max_pressure).quasi();
        assert!(force.abs() < 0.1, "{force} N at the free stroke {free} m");
        assert_eq!(reachability.beyond(Quantity::Stroke, &constant(0.9 * free)), None);
        let said = reachability.beyond(Quantity::Stroke, &constant(1.2 * free)).expect("beyond");
        assert!(said.contains("shortens by at most"), "{said}");
        let said = reachability.beyond(Quantity::Stroke, &constant(-0.005)).expect("longer");
        assert!(said.contains("-5.0 mm"), "{said}");
    }
}
