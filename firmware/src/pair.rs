//! Two muscles on one pulley: from an angle and a stiffness to two forces, and which stiffness is available.
//!
//! ```text
//! x₁ = x_rest + r θ,  x₂ = x_rest − r θ        strokes
//! F₁ = T + τ/2r,      F₂ = T − τ/2r            tension T that both share, torque τ
//! K  = r² Σ −∂F_i/∂x  at held pressures, without friction
//! ```
//! `K` is what the joint resists without a request, quicker than any loop: its air and its braid. It rises with the tension. Both muscles
//! must pull, since a slack one resists nothing, and neither may need more than its highest pressure: so at each angle `K` has
//! a least and a greatest value.

use model_core::link::messages::Refusal;
use model_core::link::settings::Joint;
use model_core::muscle::AtStroke;
use model_core::scalar::Scalar;
use model_core::single_precision;
use model_core::units::{Force, Length, Pressure};

use crate::modes::{Integral, Model};

/// Whether this image can move a joint: that of a board for one muscle carries nothing of it.
pub const SUPPORTED: bool = cfg!(any(test, feature = "joint"));

/// Step of pressure over which the stiffness is differentiated, and the most that a tick moves the tension by, Pa.
const PROBE_PA: f32 = 10e3;
const QUICKEST_PA: f32 = 1e3;
/// Share by which a stiffness may miss its range and still count as its end.
const EDGE: f32 = 2.0e-3;
/// Halvings in the search for the largest angle.
const HALVINGS: usize = 12;

/// One muscle of the joint in this tick.
#[derive(Clone, Copy, Debug)]
pub struct Arm<'a> {
    /// Its table, brought to this tick.
    pub model: &'a Model,
    /// Pressure that the last demand came to, Pa.
    pub pressure_pa: f32,
    /// The highest that may be commanded, Pa.
    pub high_pa: f32,
}

/// What the pair's loop keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairState {
    integral: Integral,
    tension_n: f32,
}

/// What the joint is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posed {
    /// Demanded angle, rad.
    pub angle_rad: f32,
    /// Demanded stiffness, N·m/rad.
    pub stiffness_nm_per_rad: f32,
    /// Measured angle, rad.
    pub measured_rad: f32,
    /// Its rate, rad/s.
    pub rate_rad_per_s: f32,
}

/// What the pair wants of its muscles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// Forces, N.
    pub forces_n: [f32; 2],
    /// Whether the stiffness is available beside the torque that the angle takes; the angle goes first.
    pub reached: bool,
}

impl PairState {
    /// Restarts, at the force that both muscles have at their pressures: below zero where they are slack.
    pub fn begin(&mut self, arms: [Arm<'_>; 2]) {
        let quasi = arms.map(|arm| {
            single_precision::parts(
                &arm.model.muscle,
                arm.model.at_stroke(),
                Pressure::from_pascals(arm.pressure_pa),
            )
            .quasi()
        });
        *self = Self { integral: Integral::default(), tension_n: quasi[0].min(quasi[1]) };
    }

    /// Demanded forces of both muscles.
    ///
    /// One Newton step a tick moves the tension to where the stiffness is the demanded one. The torque is `K (θ* − θ)`, by which
    /// pressures stay what they are when the joint is pushed, and the angle's loop for the rest.
    pub fn forces(&mut self, joint: &Joint, posed: &Posed, arms: [Arm<'_>; 2], saturation: f32) -> Pull {
        let r = joint.radius_m;
        let (mut stiffness, mut gain, mut quickest) = (0.0, 0.0, f32::MAX);
        let most_n = arms.map(|arm| {
            let Model { muscle, .. } = arm.model;
            let held = arm.model.at_stroke();
            let resists = |pascals: f32| {
                -single_precision::stroke_slope(muscle, held, Pressure::from_pascals(pascals)) * r * r
            };
            let (here, there) = (resists(arm.pressure_pa), resists(arm.pressure_pa + PROBE_PA));
            let rise =
                single_precision::parts(muscle, held, Pressure::from_pascals(arm.pressure_pa)).pressure_slope;
            stiffness += here;
            gain += (there - here) / (PROBE_PA * rise);
            quickest = (QUICKEST_PA * rise).min(quickest);
            single_precision::parts(muscle, held, Pressure::from_pascals(arm.high_pa))
                .force(arm.model.direction())
        });
        let error = posed.angle_rad - posed.measured_rad;
        self.integral.step(joint.integral_nm_per_rad_s * error, joint.torque_limit_nm, saturation);
        let torque = ((stiffness + joint.proportional_nm_per_rad) * error + self.integral.value()
            - joint.damping_nm_s_per_rad * posed.rate_rad_per_s)
            .within(-joint.torque_limit_nm, joint.torque_limit_nm);
        let share = torque / (2.0 * r);
        let wanted = if gain > 0.0 {
            self.tension_n + (posed.stiffness_nm_per_rad - stiffness) / gain
        } else {
            self.tension_n
        };
        let low = taut(arms) + share.abs();
        let high = (most_n[0] - share).min(most_n[1] + share);
        let within = wanted.min(high).max(low);
        if quickest > 0.0 && quickest.is_finite() {
            self.tension_n += (within - self.tension_n).within(-quickest, quickest);
        }
        let missed = (within - wanted).abs() * gain > EDGE * posed.stiffness_nm_per_rad;
        Pull { forces_n: [self.tension_n + share, self.tension_n - share], reached: !missed }
    }
}

/// The least tension at which both muscles surely pull, N.
fn taut(arms: [Arm<'_>; 2]) -> f32 {
    arms[0].model.taut_n().max(arms[1].model.taut_n())
}

/// What depends on a muscle's length alone, where the pulley has turned by `arc_m` of its circumference.
fn held_at(joint: &Joint, arm: Arm<'_>, arc_m: f32) -> AtStroke<f32> {
    let mut held = AtStroke::NONE;
    single_precision::hold(&arm.model.muscle, &mut held, Length::from_metres(joint.rest_stroke_m + arc_m));
    held
}

/// The least and the greatest tension at an angle, N, if both muscles can pull there.
fn tensions(joint: &Joint, arms: [Arm<'_>; 2], angle_rad: f32) -> Option<(f32, f32)> {
    let most = |arm: Arm<'_>, arc_m: f32| {
        let held = held_at(joint, arm, arc_m);
        single_precision::parts(&arm.model.muscle, &held, Pressure::from_pascals(arm.high_pa)).quasi()
    };
    let arc_m = joint.radius_m * angle_rad;
    let (low, high) = (taut(arms), most(arms[0], arc_m).min(most(arms[1], -arc_m)));
    (high > low).then_some((low, high))
}

/// The stiffness at a tension and an angle, N·m/rad.
fn stiffness_at(joint: &Joint, arms: [Arm<'_>; 2], angle_rad: f32, tension_n: f32) -> f32 {
    let arc_m = joint.radius_m * angle_rad;
    let resists = |arm: Arm<'_>, arc_m: f32| {
        let (muscle, held) = (&arm.model.muscle, held_at(joint, arm, arc_m));
        let guess = Pressure::from_pascals(0.5 * arm.high_pa);
        let force = Force::from_newtons(tension_n);
        let found = single_precision::pressure_for(muscle, &held, 0.0, force, guess, &muscle.search());
        -single_precision::stroke_slope(muscle, &held, found.pressure)
    };
    joint.radius_m * joint.radius_m * (resists(arms[0], arc_m) + resists(arms[1], -arc_m))
}

/// Whether an angle and a stiffness are available without a load on the joint.
///
/// # Errors
/// [`Refusal::Angle`] or [`Refusal::Stiffness`] with what can.
pub fn check(
    joint: &Joint,
    arms: [Arm<'_>; 2],
    angle_rad: f32,
    stiffness_nm_per_rad: f32,
) -> Result<(), Refusal> {
    let Some((low, high)) = tensions(joint, arms, angle_rad) else {
        let most = |sign: f32| {
            let (mut good, mut bad) = (0.0, sign * angle_rad.abs());
            for _ in 0..HALVINGS {
                let middle = 0.5 * (good + bad);
                if tensions(joint, arms, middle).is_some() { good = middle } else { bad = middle }
            }
            good
        };
        return Err(Refusal::Angle { low_rad: most(-1.0), high_rad: most(1.0) });
    };
    let ends = [low, high].map(|tension| stiffness_at(joint, arms, angle_rad, tension));
    let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    if stiffness_nm_per_rad >= least * (1.0 - EDGE) && stiffness_nm_per_rad <= most * (1.0 + EDGE) {
        Ok(())
    } else {
        Err(Refusal::Stiffness { low_nm_per_rad: least, high_nm_per_rad: most })
    }
}
