//! Modes that control the stroke, with a stroke sensor that is frozen, noisy at one place, or not there.

use model_core::link::messages::Field;
use model_core::link::settings::FeedForward;
use model_core::table;

use super::*;

/// Ticks of a muscle whose load cell reads a force and whose stroke sensor something; the highest command.
fn pass(
    controller: &mut Controller,
    pressure_pa: &mut f32,
    ticks: u32,
    read: impl Fn(u32, f32) -> (f32, f32),
) -> f32 {
    let mut most_pa = 0.0_f32;
    for tick in 0..ticks {
        let wiggle = (tick % 7) as f32 - 3.0;
        let (stroke_m, force_n) = read(tick, *pressure_pa);
        let now = Readings { pressure_pa: *pressure_pa + wiggle, stroke_m, force_n: force_n + 1e-3 * wiggle };
        let outputs = controller.step(&Inputs { sides: [Some(now.into()), None], ..Inputs::default() });
        assert_eq!(controller.keep_alive(OWNER), Ok(()));
        let command = outputs.sides[0];
        let target = if command.vent { 0.0 } else { command.pressure_pa };
        *pressure_pa += (target - *pressure_pa) / 31.0;
        most_pa = most_pa.max(*pressure_pa);
    }
    most_pa
}

fn in_stroke_mode(change: impl FnOnce(&mut Settings)) -> Controller {
    let mut settings = Settings::default();
    change(&mut settings);
    let mut controller = Controller::new(&settings);
    assert_eq!(controller.use_table(Side::Agonist, &table::example()), Ok(()));
    pass(&mut controller, &mut 0.0, 50, |_, _| (0.0, 0.0));
    assert_eq!(controller.arm(OWNER), Ok(()));
    controller
}

fn to_stroke(controller: &mut Controller, stroke_m: f32) {
    assert_eq!(controller.start(Mode::Stroke, OWNER), Ok(()));
    let order = SetPointOrder { set_point: SetPoint::Stroke(stroke_m), session: OWNER };
    assert_eq!(controller.set_point(order), Ok(()));
}

fn latched(controller: &Controller) -> Option<(Fault, Option<model_core::link::messages::Sensor>)> {
    controller.faults().latched.map(|report| (report.fault, report.sensor))
}

/// The rod of a slider has come off: the muscle contracts freely, and its stroke sensor reads what it did.
#[test]
fn a_frozen_stroke_sensor_vents_long_before_the_highest_pressure() {
    use model_core::link::messages::Sensor;
    let frozen = [0.0_f32, 15e-6];
    for noise_m in frozen {
        for (fitted, fault) in
            [(true, (Fault::SensorsDisagree, None)), (false, (Fault::SensorStuck, Some(Sensor::Stroke)))]
        {
            for demand_m in [1e-4, 2e-3] {
                let mut controller = in_stroke_mode(|s| s.force.fitted = fitted);
                to_stroke(&mut controller, demand_m);
                let read = |tick: u32, _: f32| (noise_m * (tick as f32 * 12.9898).sin(), 0.0);
                let most_pa = pass(&mut controller, &mut 0.0, 60_000, read);
                assert_eq!(latched(&controller), Some(fault), "to {demand_m} m, noise {noise_m} m");
                assert!(most_pa < 420e3, "{most_pa} Pa, to {demand_m} m, noise {noise_m} m");
            }
        }
    }
}

/// Something stops the muscle: with a load cell that is seen, and the mode continues.
#[test]
fn a_muscle_that_is_stopped_is_no_frozen_sensor_where_a_load_cell_shows_its_force() {
    let model = crate::modes::Model::build(&table::example()).expect("a table");
    let mut controller = in_stroke_mode(|_| ());
    to_stroke(&mut controller, 1e-3);
    let read = |_: u32, pressure_pa: f32| (0.0, tracking::force(&model, 0.0, pressure_pa));
    let most_pa = pass(&mut controller, &mut 0.0, 20_000, read);
    assert_eq!((controller.state(), latched(&controller)), (State::Running, None));
    assert!(most_pa > 500e3, "{most_pa}");
}

/// A weight that is held, without a load cell: the settings say how much.
#[test]
fn a_known_load_may_be_lifted_before_the_stroke_moves() {
    let load_n = 80.0;
    let mut controller = in_stroke_mode(|s| {
        s.force.fitted = false;
        s.stroke_loop.load_n = load_n;
    });
    to_stroke(&mut controller, 1e-4);
    // It rests on its support until the muscle carries it, and then has its place.
    let read = |_: u32, pressure_pa: f32| (if pressure_pa > 380e3 { 1e-4 } else { 0.0 }, 0.0);
    pass(&mut controller, &mut 0.0, 5_000, read);
    assert_eq!((controller.state(), latched(&controller)), (State::Running, None));
}

/// A setpoint is any number, and the stroke loop may take one infinity from another.
#[test]
fn a_demanded_force_that_is_no_number_vents_in_its_tick() {
    for feed_forward in [FeedForward::Table, FeedForward::Gaylord, FeedForward::Off] {
        let mut controller = in_stroke_mode(|s| {
            s.feed_forward = feed_forward;
            s.stroke_loop.load_stiffness_n_per_m = -1e9;
        });
        to_stroke(&mut controller, -1e36);
        let most_pa = pass(&mut controller, &mut 0.0, 1, |_, _| (0.0, 0.0));
        assert_eq!(latched(&controller), Some((Fault::NotANumber, None)), "{feed_forward:?}");
        assert_eq!(most_pa, 0.0, "nothing was commanded");
        assert!(controller.is_vented());
    }
}

/// Such a table is refused; here it comes into force all the same.
#[test]
fn a_table_whose_force_is_no_number_vents_in_the_tick_that_demands_one() {
    let mut controller = in_stroke_mode(|_| ());
    assert_eq!(controller.start(Mode::Force, OWNER), Ok(()));
    let model = controller.model_mut(Side::Agonist).expect("a table");
    // An effect that gives no number.
    let effect = model_core::effects::FittedEffect::new(
        model_core::effects::EffectName::CoulombFriction,
        &[f64::NAN, f64::NAN],
    );
    model.chain.resume(&[effect]);
    let order = SetPointOrder { set_point: SetPoint::Force(10.0), session: OWNER };
    assert_eq!(controller.set_point(order), Ok(()));
    let most_pa = pass(&mut controller, &mut 0.0, 1, |_, _| (1e-3, 0.0));
    assert_eq!(latched(&controller), Some((Fault::NotANumber, None)));
    assert_eq!(most_pa, 0.0, "nothing was commanded");
}

#[test]
fn no_mode_that_controls_the_stroke_starts_without_a_stroke_sensor() {
    let mut controller = in_stroke_mode(|s| s.stroke.fitted = false);
    assert_eq!(controller.use_table(Side::Antagonist, &table::example()), Ok(()));
    for mode in [Mode::Stroke, Mode::Pair] {
        assert_eq!(controller.start(mode, OWNER), Err(Refusal::Value(Field::SensorWatch)), "{mode:?}");
        assert_eq!(controller.state(), State::Armed);
    }
    assert_eq!(controller.start(Mode::Pressure, OWNER), Ok(()));
}
