//! A joint of two muscles on one pulley, without friction.

use model_core::link::messages::{Reference, ReferenceOrder};

use super::tracking::{force, frictionless};
use super::*;
use crate::modes::Model;
use crate::pair::PairState;

/// A joint that moves where it is in balance, or is held, or is moved.
struct Joint {
    bench: Bench,
    muscle: Model,
    pressures_pa: [f32; 2],
    /// Strokes of both muscles in each tick; none: where their forces are equal.
    moved: Option<fn(f32) -> [f32; 2]>,
    ticks: u32,
    angle_rad: f32,
}

/// Stroke of both muscles at angle zero, and radius of the pulley, m.
const REST: f32 = 2e-3;
const RADIUS: f32 = 0.02;

impl Joint {
    fn new(moved: Option<fn(f32) -> [f32; 2]>, change: impl FnOnce(&mut Settings)) -> Self {
        let bench = Bench::new(|settings| {
            (settings.joint.radius_m, settings.joint.rest_stroke_m) = (RADIUS, REST);
            settings.force.fitted = false;
            settings.watch.follow_pa = 1e6;
            change(settings);
        });
        let muscle = Model::build(&frictionless()).expect("a table");
        let mut joint = Self { bench, muscle, pressures_pa: [0.0; 2], moved, ticks: 0, angle_rad: 0.0 };
        for side in Side::ALL {
            assert_eq!(joint.bench.controller.use_table(side, &frictionless()), Ok(()));
        }
        joint.pass(10);
        assert_eq!(joint.bench.controller.arm(OWNER), Ok(()));
        joint
    }

    fn start(mut self) -> Self {
        assert_eq!(self.bench.controller.start(Mode::Pair, OWNER), Ok(()));
        self
    }

    fn set(&mut self, angle_rad: f32, stiffness_nm_per_rad: f32) -> Result<(), Refusal> {
        let set_point = SetPoint::Pair { angle_rad, stiffness_nm_per_rad };
        self.bench.controller.set_point(SetPointOrder { set_point, session: OWNER })
    }

    fn torque(&self, angle_rad: f32) -> f32 {
        let pulls = |at: usize, stroke_m| force(&self.muscle, stroke_m, self.pressures_pa[at]);
        pulls(0, REST + RADIUS * angle_rad) - pulls(1, REST - RADIUS * angle_rad)
    }

    fn step(&mut self, spoil: impl Fn(&mut [Readings; 2])) {
        self.ticks += 1;
        let strokes = match self.moved {
            Some(moved) => moved(self.ticks as f32 * 1e-3),
            None => {
                let (mut low, mut high) = (-0.1, 0.1);
                for _ in 0..24 {
                    let middle = 0.5 * (low + high);
                    if self.torque(middle) > 0.0 { low = middle } else { high = middle }
                }
                [REST + RADIUS * low, REST - RADIUS * low]
            }
        };
        self.angle_rad = (strokes[0] - strokes[1]) / (2.0 * RADIUS);
        let mut now = [0, 1].map(|at| Readings {
            pressure_pa: self.pressures_pa[at] + (self.ticks % 7) as f32,
            stroke_m: strokes[at],
            force_n: 0.0,
        });
        spoil(&mut now);
        let outputs = self
            .bench
            .controller
            .step(&Inputs { sides: now.map(|now| Some(now.into())), ..Inputs::default() });
        assert_eq!(self.bench.controller.keep_alive(OWNER), Ok(()));
        for (pressure_pa, command) in self.pressures_pa.iter_mut().zip(outputs.sides) {
            let target = if command.vent { 0.0 } else { command.pressure_pa };
            *pressure_pa += (target - *pressure_pa) / 30.5;
        }
        self.bench.last = outputs;
    }

    fn pass(&mut self, ticks: u32) {
        (0..ticks).for_each(|_| self.step(|_| ()));
        assert_eq!(self.bench.latched(), None);
    }

    fn forces_n(&self) -> [f32; 2] {
        [0, 1].map(|at| self.bench.controller.sides[at].force_demand_n)
    }

    /// The least and the greatest stiffness that the controller says it can have at an angle.
    fn stiffnesses(&mut self, angle_rad: f32) -> [f32; 2] {
        match self.set(angle_rad, 0.0) {
            Err(Refusal::Stiffness { low_nm_per_rad, high_nm_per_rad }) => [low_nm_per_rad, high_nm_per_rad],
            other => panic!("{other:?}"),
        }
    }

    fn middle(&mut self, angle_rad: f32) -> f32 {
        let [low, high] = self.stiffnesses(angle_rad);
        assert!(low > 0.0 && high > 1.2 * low, "{low} to {high}");
        0.5 * (low + high)
    }
}

#[test]
fn a_joint_reaches_its_angle() {
    let mut joint = Joint::new(None, |_| ()).start();
    let stiffness = joint.middle(0.0);
    for angle in [0.03, -0.03, 0.0] {
        assert_eq!(joint.set(angle, stiffness), Ok(()));
        joint.pass(3_000);
        assert!((joint.angle_rad - angle).abs() < 1e-3, "{angle}: {}", joint.angle_rad);
        let [first, second] = joint.forces_n();
        assert!(first > 1.0 && second > 1.0, "both pull: {first} and {second}");
    }
}

#[test]
fn a_joint_starts_where_it_is() {
    let mut joint = Joint::new(Some(|_| [REST + 1e-3, REST - 1e-3]), |_| ());
    joint.pressures_pa = [15e3; 2];
    joint.pass(1);
    let mut joint = joint.start();
    assert!((joint.bench.controller.setpoint - 0.05).abs() < 1e-6, "{}", joint.bench.controller.setpoint);
    let mut begun = PairState::default();
    begun.begin(joint.bench.controller.arms().expect("two tables"));
    assert_ne!(begun, PairState::default());
    assert_eq!(joint.bench.controller.pair, begun);
    joint.pass(1);
}

#[test]
fn unreachable_angles_and_stiffnesses_are_refused() {
    let mut joint = Joint::new(None, |_| ()).start();
    let stiffness = joint.middle(0.0);
    let [low, high] = joint.stiffnesses(0.0);
    assert_eq!(joint.set(0.0, stiffness), Ok(()));
    for wrong in [0.9 * low, 1.1 * high] {
        assert!(matches!(joint.set(0.0, wrong), Err(Refusal::Stiffness { .. })), "{wrong}");
    }
    assert!(matches!(joint.set(1.0, stiffness), Err(Refusal::Angle { .. })));
    for (angle, wrong) in [(f32::NAN, stiffness), (0.0, f32::NAN), (0.0, -1.0)] {
        assert!(matches!(joint.set(angle, wrong), Err(Refusal::Value(_))), "{angle} {wrong}");
    }
    let mut wave = |amplitude| {
        let reference = Reference::Sine { mean: 0.0, amplitude, frequency_hz: 1.0 };
        joint.bench.controller.reference(ReferenceOrder { reference, session: OWNER })
    };
    assert!(matches!(wave(1.0), Err(Refusal::Angle { .. })));
    assert_eq!(wave(0.01), Ok(()));
}

#[test]
fn an_arm_goes_no_higher_than_its_regulator_reaches() {
    let high = |change: fn(&mut Settings)| {
        Joint::new(None, change).bench.controller.arms().expect("two tables").map(|arm| arm.high_pa)
    };
    assert_eq!(high(|_| ()), [600e3; 2], "the table's");
    assert_eq!(high(|settings| settings.limits.pressure_pa = 500e3), [500e3; 2]);
    let reached = high(|settings| {
        (settings.regulator.gain, settings.regulator.offset_pa) = (1.25, 10e3);
        settings.regulator.command_max_pa = 300e3;
    });
    assert_eq!(reached, [1.25 * 310e3; 2]);
}

/// Difference of the demanded forces, N, while the muscles move in 100 ms from rest at 20 mm/s, with a damping of the angle's loop.
fn moved(strokes: fn(f32) -> [f32; 2], damping: f32) -> f32 {
    let mut joint = Joint::new(Some(strokes), |settings| {
        settings.joint.damping_nm_s_per_rad = damping;
        (settings.joint.integral_nm_per_rad_s, settings.joint.proportional_nm_per_rad) = (0.0, 0.0);
    })
    .start();
    let stiffness = joint.middle(0.0);
    assert_eq!(joint.set(0.0, stiffness), Ok(()));
    joint.pass(1_085);
    let [first, second] = joint.forces_n();
    first - second
}

/// Distance at 20 mm/s, from the first second on.
fn ramp(time: f32) -> f32 {
    0.02 * (time - 1.0).max(0.0)
}

#[test]
fn a_turning_joint_is_damped_and_one_whose_muscles_move_together_is_not() {
    let together = moved(|time| [REST + ramp(time), REST + ramp(time)], 0.2);
    assert!(together.abs() < 0.05, "{together} N");
    let turning = |time: f32| [REST + ramp(time), REST - ramp(time)];
    let damped = moved(turning, 0.2) - moved(turning, 0.0);
    // τ = −d · 2 v / 2 r, and the difference of the forces is τ / r; the stiffness of the air, which depends on the pressures, adds some.
    let expected = -0.2 * (0.02 / RADIUS) / RADIUS;
    assert!((damped - expected).abs() < 0.2 * expected.abs(), "{damped} N, not {expected} N");
}

#[test]
fn a_joint_that_is_held_winds_nothing_up() {
    for sign in [-1.0, 1.0] {
        let mut joint = Joint::new(Some(|_| [REST; 2]), |_| ()).start();
        let stiffness = joint.middle(0.0);
        assert_eq!(joint.set(sign * 0.03, stiffness), Ok(()));
        joint.pass(3_000);
        let most = joint.forces_n().into_iter().fold(0.0, f32::max);
        // What a muscle of 136 N cannot give is not asked of it much longer.
        assert!(most < 300.0, "{most} N are demanded");
    }
}

#[test]
fn a_stiffness_that_the_torque_leaves_no_room_for_is_counted_as_saturated() {
    let mut joint = Joint::new(Some(|_| [REST; 2]), |settings| settings.joint.torque_limit_nm = 1.0).start();
    let [low, _] = joint.stiffnesses(0.02);
    assert_eq!(joint.set(0.02, low), Ok(()));
    joint.pass(2_000);
    let before = joint.bench.controller.saturated_ticks();
    joint.pass(100);
    assert_eq!(joint.bench.controller.saturated_ticks(), before + 200, "both muscles in each tick");
    let [first, second] = joint.forces_n();
    assert!(first < 100.0 && second > 1.0, "the forces can be reached: {first} and {second}");
}

#[test]
fn a_joint_asks_nothing_of_its_muscles_while_one_of_them_is_not_seen() {
    let mut joint = Joint::new(None, |_| ()).start();
    let stiffness = joint.middle(0.0);
    assert_eq!(joint.set(0.0, stiffness), Ok(()));
    joint.pass(1_000);
    assert!(joint.forces_n().into_iter().all(|force| force > 1.0));
    joint.step(|now| now[1].stroke_m = f32::NAN);
    assert_eq!(joint.forces_n(), [0.0; 2]);
    joint.step(|_| ());
    joint.step(|now| now[0].stroke_m = f32::NAN);
    assert_eq!(joint.forces_n(), [0.0; 2]);
}
