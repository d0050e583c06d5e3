//! The controller's own step on a joint of two muscles, without a link and as fast as this machine goes.

use firmware::board::{Inputs, Outputs, Readings};
use firmware::control::Controller;
use model_core::link::messages::{Mode, Refusal, Session, SetPoint, SetPointOrder, Side, State};
use model_core::link::settings::Settings;
use model_core::table::MuscleTable;

use virtual_bench::bench::BenchSpec;
use virtual_bench::muscle::MuscleSpec;

use crate::joint::Joint;

/// Radius of the elbow's pulley, m.
pub const RADIUS: f64 = 0.05;
/// Stroke of both its muscles at angle zero, m.
const REST: f64 = 0.012;

/// Two large muscles on a pulley with a forearm.
pub fn elbow(muscle: &MuscleSpec) -> Joint {
    let bench = BenchSpec::laboratory(muscle.clone(), 5);
    Joint::new(&bench, RADIUS, REST).moving(0.05, 1.0)
}

/// Its settings: an integral slow beside its least stiffness, and no proportional part, so that it stays as soft as was queried.
pub fn adjust(settings: &mut Settings) {
    let joint = &mut settings.joint;
    joint.radius_m = RADIUS as f32;
    joint.rest_stroke_m = REST as f32;
    joint.proportional_nm_per_rad = 0.0;
    joint.integral_nm_per_rad_s = 300.0;
    joint.damping_nm_s_per_rad = 0.5;
    joint.torque_limit_nm = 100.0;
    // As `host device identify` finds the bench's regulator.
    settings.regulator.line_s = 0.004;
    settings.limits.force_n = 5e3;
    settings.force.high = 1e4;
    settings.force.jump = 3e3;
}

/// A controller on a joint.
pub struct PairLoop {
    /// The controller.
    pub controller: Controller,
    /// The joint.
    pub joint: Joint,
    outputs: Outputs,
}

/// What was true in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Angle, rad.
    pub angle: f64,
    /// Stiffness at the pressures in the muscles, N·m/rad.
    pub stiffness: f64,
    /// Those pressures, Pa.
    pub pressures: [f64; 2],
}

impl PairLoop {
    /// Running in pair mode with a table for both muscles.
    ///
    /// # Panics
    /// When the controller refuses.
    pub fn start(joint: Joint, table: &MuscleTable, mut settings: Settings) -> Self {
        // No link, and therefore no host to receive from.
        settings.watch.autonomous = true;
        let mut controller = Controller::new(&settings);
        for side in Side::ALL {
            controller.use_table(side, table).expect("a valid table");
        }
        let mut this = Self { controller, joint, outputs: Outputs::VENT };
        this.tick();
        this.controller.arm(Session::default()).expect("it arms");
        this.controller.start(Mode::Pair, Session::default()).expect("it starts");
        this
    }

    /// Requests an angle (rad) and a stiffness (N·m/rad).
    ///
    /// # Errors
    /// As [`Controller::set_point`].
    pub fn ask(&mut self, angle_rad: f32, stiffness_nm_per_rad: f32) -> Result<(), Refusal> {
        let set_point = SetPoint::Pair { angle_rad, stiffness_nm_per_rad };
        self.controller.set_point(SetPointOrder { set_point, session: Session::default() })
    }

    /// One millisecond.
    pub fn tick(&mut self) {
        for (at, side) in self.outputs.sides.into_iter().enumerate() {
            self.joint.step(at, if side.vent { 0.0 } else { f64::from(side.pressure_pa) });
        }
        let sides = [0, 1].map(|side| {
            let answer = self.joint.answer(side);
            Some(
                Readings { pressure_pa: answer.pressure, stroke_m: answer.stroke, force_n: answer.force }
                    .into(),
            )
        });
        self.outputs = self.controller.step(&Inputs { sides, ..Inputs::default() });
    }

    /// Continues for some ticks and returns the mean of the true values in the last `judged` of them.
    ///
    /// # Panics
    /// When a fault stops the controller.
    pub fn run(&mut self, ticks: u32, judged: u32) -> Pose {
        let mut sums = [0.0; 3];
        for tick in 0..ticks {
            self.tick();
            let latched = self.controller.faults().latched;
            assert!(self.controller.state() == State::Running, "stopped by {latched:?}");
            if tick + judged >= ticks {
                let pressures = self.joint.pressures();
                for (sum, value) in sums.iter_mut().zip([self.joint.angle(), pressures[0], pressures[1]]) {
                    *sum += value / f64::from(judged);
                }
            }
        }
        let [angle, first, second] = sums;
        let pressures = [first, second];
        Pose { angle, stiffness: self.joint.stiffness_at(pressures, angle), pressures }
    }
}
