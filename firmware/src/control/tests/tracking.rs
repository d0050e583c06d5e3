//! What the loops reach, on muscles whose force is that of a table without friction, behind regulators like the one in the settings.

use model_core::link::messages::{Reference, ReferenceOrder};
use model_core::link::settings::FeedForward;
use model_core::muscle::AtStroke;
use model_core::single_precision;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};

use super::*;
use crate::modes::Model;

/// A table whose muscle has no friction: its force depends on stroke and pressure alone.
pub(super) fn frictionless() -> MuscleTable {
    let mut table = table::example();
    table.friction.iter_mut().for_each(|friction| *friction = 0.0);
    table
}

/// Force of a muscle, N.
pub(super) fn force(model: &Model, stroke_m: f32, pressure_pa: f32) -> f32 {
    let mut held = AtStroke::NONE;
    single_precision::hold(&model.muscle, &mut held, Length::from_metres(stroke_m));
    single_precision::parts(&model.muscle, &held, Pressure::from_pascals(pressure_pa)).quasi().max(0.0)
}

/// What a muscle pulls on.
#[derive(Clone, Copy)]
enum Load {
    /// Nothing moves.
    Held(f32),
    /// A spring, N/m.
    Spring(f32),
}

/// One muscle, controlled by its table; what it really does may differ from that.
struct Rig {
    bench: Bench,
    muscle: Model,
    load: Load,
    /// Force of the muscle as a part of the table's.
    strength: f32,
    /// Time constant of the regulator, ticks.
    lag: f32,
    /// What the regulator adds to every command, Pa.
    drift_pa: f32,
    pressure_pa: f32,
    force_n: f32,
    stroke_m: f32,
}

impl Rig {
    fn new(change: impl FnOnce(&mut Settings)) -> Self {
        let mut bench = Bench::new(|settings| {
            // Judged here is what the loops reach, not what the watches make of it.
            settings.force.stuck_ticks = 0;
            settings.watch.follow_pa = 1e6;
            change(settings);
        });
        assert_eq!(bench.controller.use_table(Side::Agonist, &frictionless()), Ok(()));
        Self {
            bench,
            muscle: Model::build(&frictionless()).expect("a table"),
            load: Load::Held(1e-3),
            strength: 1.0,
            lag: 30.5,
            drift_pa: 0.0,
            pressure_pa: 0.0,
            force_n: 0.0,
            stroke_m: 1e-3,
        }
    }

    fn start(mut self, mode: Mode) -> Self {
        self.pass(10);
        assert_eq!(self.bench.controller.arm(OWNER), Ok(()));
        assert_eq!(self.bench.controller.start(mode, OWNER), Ok(()));
        self
    }

    fn set(&mut self, set_point: SetPoint) {
        assert_eq!(self.bench.controller.set_point(SetPointOrder { set_point, session: OWNER }), Ok(()));
    }

    fn sine(&mut self, mean: f32, amplitude: f32, frequency_hz: f32) {
        let reference = Reference::Sine { mean, amplitude, frequency_hz };
        assert_eq!(self.bench.controller.reference(ReferenceOrder { reference, session: OWNER }), Ok(()));
    }

    fn pulls(&self, stroke_m: f32) -> f32 {
        self.strength * force(&self.muscle, stroke_m, self.pressure_pa)
    }

    fn step(&mut self) {
        self.stroke_m = match self.load {
            Load::Held(stroke_m) => stroke_m,
            Load::Spring(stiffness) => {
                // The force falls as the muscle shortens.
                let (mut low, mut high) = (0.0, 5e-3);
                for _ in 0..24 {
                    let middle = 0.5 * (low + high);
                    if self.pulls(middle) > stiffness * middle { low = middle } else { high = middle }
                }
                0.5 * (low + high)
            }
        };
        self.force_n = self.pulls(self.stroke_m);
        let now = Readings { pressure_pa: self.pressure_pa, stroke_m: self.stroke_m, force_n: self.force_n };
        let outputs =
            self.bench.controller.step(&Inputs { sides: [Some(now.into()), None], ..Inputs::default() });
        assert_eq!(self.bench.controller.keep_alive(OWNER), Ok(()));
        let command = outputs.sides[0];
        let target = if command.vent { 0.0 } else { command.pressure_pa + self.drift_pa };
        self.pressure_pa += (target - self.pressure_pa) / self.lag;
        self.bench.last = outputs;
    }

    fn pass(&mut self, ticks: u32) {
        (0..ticks).for_each(|_| self.step());
        assert_eq!(self.bench.latched(), None);
    }

    /// The largest difference between a measured value and the setpoint of its tick, after the wave has begun.
    fn miss(&mut self, measured: impl Fn(&Self) -> f32) -> f32 {
        self.pass(1_000);
        let mut most = 0.0_f32;
        for _ in 0..1_000 {
            self.pass(1);
            most = most.max((measured(self) - self.bench.controller.setpoint).abs());
        }
        most
    }

    fn trim_pa(&self) -> f32 {
        self.bench.controller.sides[0].trim_pa
    }
}

fn trimmed(settings: &mut Settings) {
    settings.force_loop.integral_pa_per_n_s = 2e4;
    settings.force_loop.trim_limit_pa = 100e3;
}

#[test]
fn the_table_alone_reaches_a_force() {
    // Without an observer of the pressure nothing else limits a command.
    let mut rig = Rig::new(|settings| settings.pressure.fitted = false).start(Mode::Force);
    for newtons in [40.0, 70.0, 25.0] {
        rig.set(SetPoint::Force(newtons));
        rig.pass(1_000);
        assert!((rig.force_n - newtons).abs() < 0.2, "{newtons}: {}", rig.force_n);
    }
    let saturated = rig.bench.controller.saturated_ticks();
    rig.pass(1_000);
    assert_eq!(rig.bench.controller.saturated_ticks(), saturated, "nothing limits a force that is there");
    rig.set(SetPoint::Force(500.0));
    rig.pass(1_000);
    assert_eq!(
        rig.bench.controller.saturated_ticks(),
        saturated + 1_000,
        "each tick of a force in saturation"
    );
}

#[test]
fn a_trim_on_the_load_cell_removes_what_the_table_misses() {
    for (feed_forward, strength) in [FeedForward::Table, FeedForward::Gaylord, FeedForward::Off]
        .into_iter()
        .flat_map(|f| [(f, 0.9), (f, 1.1)])
    {
        let mut rig = Rig::new(|settings| {
            trimmed(settings);
            settings.force_loop.trim_limit_pa = 500e3;
            settings.feed_forward = feed_forward;
        });
        rig.strength = strength;
        let mut rig = rig.start(Mode::Force);
        for newtons in [40.0, 60.0, 20.0] {
            rig.set(SetPoint::Force(newtons));
            rig.pass(4_000);
            assert!((rig.force_n - newtons).abs() < 0.3, "{feed_forward:?} {newtons}: {}", rig.force_n);
        }
    }
}

#[test]
fn a_trim_beside_the_table_does_not_answer_a_wave() {
    // The regulator is slower than the settings say, so that the force is late; the table is right all the same.
    let mut rig = Rig::new(trimmed);
    rig.lag = 100.0;
    let mut rig = rig.start(Mode::Force);
    rig.sine(50.0, 15.0, 2.0);
    // At the start the muscle is slack, of which its table knows nothing.
    rig.pass(2_500);
    let mut most = 0.0_f32;
    for _ in 0..1_000 {
        rig.pass(1);
        most = most.max(rig.trim_pa().abs());
    }
    assert!(most < 300.0, "{most} Pa of trim on a table without error");
}

#[test]
fn a_load_cell_that_is_not_fitted_trims_nothing() {
    let mut rig = Rig::new(|settings| {
        trimmed(settings);
        settings.force.fitted = false;
    });
    rig.strength = 0.5;
    let mut rig = rig.start(Mode::Force);
    rig.set(SetPoint::Force(40.0));
    rig.pass(1_000);
    assert_eq!(rig.trim_pa(), 0.0);
    assert!((rig.force_n - 20.0).abs() < 0.2);
}

#[test]
fn waves_are_followed_without_delay_in_pressure_force_and_stroke() {
    let pressure = |rig: &Rig| rig.pressure_pa;
    let mut rig = Rig::new(|_| ()).start(Mode::Pressure);
    rig.sine(300e3, 100e3, 2.0);
    let miss = rig.miss(pressure) / 100e3;
    assert!(miss < 0.02, "{miss} of the amplitude in pressure");
    let mut rig = Rig::new(|_| ()).start(Mode::Force);
    rig.sine(50.0, 15.0, 2.0);
    let miss = rig.miss(|rig| rig.force_n) / 15.0;
    assert!(miss < 0.03, "{miss} of the amplitude in force");
    // The braid alone: what its formula commands is reached without delay, whatever force that is.
    let mut rig = Rig::new(|settings| settings.feed_forward = FeedForward::Gaylord).start(Mode::Force);
    rig.sine(50.0, 15.0, 2.0);
    let area = rig.bench.controller.model(Side::Agonist).expect("a table").at_stroke().posture.area;
    let miss = rig.miss(|rig| rig.pressure_pa * area) / 15.0;
    assert!(miss < 0.02, "{miss} of the amplitude in force of the braid");
    let stiffness = 15e3;
    let mut rig = Rig::new(|settings| {
        settings.stroke_loop.load_stiffness_n_per_m = stiffness;
        settings.stroke_loop.proportional_n_per_m = 0.0;
        settings.stroke_loop.integral_n_per_m_s = 0.0;
        settings.stroke_loop.damping_n_s_per_m = 0.0;
    });
    rig.load = Load::Spring(stiffness);
    let mut rig = rig.start(Mode::Stroke);
    rig.sine(2e-3, 0.5e-3, 2.0);
    let miss = rig.miss(|rig| rig.stroke_m) / 0.5e-3;
    assert!(miss < 0.04, "{miss} of the amplitude in stroke");
}

#[test]
fn a_stroke_is_reached_against_a_spring() {
    let mut rig = Rig::new(|settings| settings.stroke_loop.integral_n_per_m_s = 60e3);
    rig.load = Load::Spring(15e3);
    let mut rig = rig.start(Mode::Stroke);
    for stroke_m in [2e-3, 1e-3, 3e-3] {
        rig.set(SetPoint::Stroke(stroke_m));
        rig.pass(4_000);
        assert!((rig.stroke_m - stroke_m).abs() < 2e-5, "{stroke_m}: {}", rig.stroke_m);
    }
}

#[test]
fn the_drift_of_a_regulator_is_removed_with_lead_and_left_without() {
    for (lead, left) in [(1.0, 0.0), (0.0, 5e3)] {
        let mut rig = Rig::new(|settings| settings.regulator.lead = lead);
        rig.drift_pa = 5e3;
        let mut rig = rig.start(Mode::Pressure);
        rig.set(SetPoint::Pressure(300e3));
        rig.pass(3_000);
        assert!((rig.pressure_pa - 300e3 - left).abs() < 50.0, "lead {lead}: {}", rig.pressure_pa);
        // Without lead a command is the setpoint.
        assert!(lead > 0.0 || rig.bench.last.sides[0].pressure_pa == 300e3);
    }
    // Without a sensor of pressure nothing is known of a drift.
    let mut rig = Rig::new(|settings| settings.pressure.fitted = false);
    rig.drift_pa = 5e3;
    let mut rig = rig.start(Mode::Pressure);
    rig.set(SetPoint::Pressure(300e3));
    rig.pass(3_000);
    assert!((rig.pressure_pa - 305e3).abs() < 50.0, "{}", rig.pressure_pa);
}

#[test]
fn nothing_winds_up_while_a_limit_holds_the_command() {
    let gaylord = |settings: &mut Settings| {
        trimmed(settings);
        settings.force_loop.trim_limit_pa = 500e3;
        settings.feed_forward = FeedForward::Gaylord;
    };
    // Saturated above, with a force that stays too small.
    let mut high = Rig::new(gaylord);
    high.strength = 0.9;
    let mut high = high.start(Mode::Force);
    high.set(SetPoint::Force(60.0));
    high.pass(4_000);
    let before = high.trim_pa();
    high.set(SetPoint::Force(200.0));
    high.pass(2_000);
    // One tick passes before a limit is known.
    assert!((high.trim_pa() - before).abs() < 4e3, "{before} to {}", high.trim_pa());
    // Saturated below, with a trim that adds pressure.
    let mut low = Rig::new(gaylord);
    low.strength = 0.8;
    let mut low = low.start(Mode::Force);
    low.set(SetPoint::Force(30.0));
    low.pass(4_000);
    let before = low.trim_pa();
    assert!((5e3..250e3).contains(&before), "{before}");
    low.set(SetPoint::Force(-50.0));
    low.pass(2_000);
    assert!((low.trim_pa() - before).abs() < 2e3, "{before} to {}", low.trim_pa());
    // Falling at the slew limit, with a force that is still too large.
    let mut falling = Rig::new(|settings| {
        gaylord(settings);
        settings.limits.slew_pa_per_s = 30e3;
    });
    falling.strength = 0.9;
    let mut falling = falling.start(Mode::Force);
    falling.set(SetPoint::Force(60.0));
    falling.pass(20_000);
    assert!((falling.force_n - 60.0).abs() < 0.5, "{}", falling.force_n);
    let before = falling.trim_pa();
    falling.set(SetPoint::Force(30.0));
    falling.pass(500);
    assert!(falling.force_n > 35.0, "it still falls");
    assert!((falling.trim_pa() - before).abs() < 2e3, "{before} to {}", falling.trim_pa());
}

/// A muscle that its load holds shorter than it would be: without pressure it is slack.
#[test]
fn a_start_of_force_mode_does_not_pressurise_a_slack_muscle() {
    for goes_slack in [true, false] {
        for stroke_m in [0.0, 1e-3, 2e-3, 3e-3] {
            let mut rig = Rig::new(|_| ());
            let table = MuscleTable { goes_slack, ..frictionless() };
            assert_eq!(rig.bench.controller.use_table(Side::Agonist, &table), Ok(()));
            rig.load = Load::Held(stroke_m);
            let mut rig = rig.start(Mode::Force);
            rig.pass(500);
            assert!(rig.pressure_pa < 1e3, "{} Pa at {stroke_m} m", rig.pressure_pa);
            // What is ordered is done: no force is the pressure at which the muscle begins to pull.
            rig.set(SetPoint::Force(0.0));
            rig.pass(500);
            assert!(rig.pressure_pa > 70e3 && rig.force_n < 1.0, "{} Pa at {stroke_m} m", rig.pressure_pa);
        }
    }
}

#[test]
fn a_start_of_force_mode_keeps_the_force_of_a_muscle_that_pulls() {
    let mut rig = Rig::new(|_| ()).start(Mode::Pressure);
    rig.set(SetPoint::Pressure(300e3));
    rig.pass(500);
    let force_n = rig.force_n;
    let mut rig = rig;
    assert_eq!(rig.bench.controller.start(Mode::Force, OWNER), Ok(()));
    rig.load = Load::Held(0.5e-3);
    rig.pass(500);
    assert!(force_n > 20.0 && (rig.force_n - force_n).abs() < 0.5, "{force_n} N, then {} N", rig.force_n);
}
