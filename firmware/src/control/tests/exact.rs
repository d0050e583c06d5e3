//! Times to the tick, counts to the one, and what requests are refused.

use model_core::link::settings::FeedForward;
use model_core::table;

use super::*;
use crate::regulator::Air;

fn sent(set_point: SetPoint) -> SetPointOrder {
    SetPointOrder { set_point, session: OWNER }
}

fn ready(change: impl FnOnce(&mut Settings)) -> Bench {
    let mut bench = Bench::new(change);
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench
}

#[test]
fn a_mode_is_vent_until_it_is_started_and_again_when_it_is_stopped() {
    let mut bench = ready(|_| ());
    assert_eq!(bench.controller.mode(), Mode::Vent);
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
    assert_eq!(bench.controller.mode(), Mode::Pressure);
    assert_eq!(bench.controller.stop(), Ok(()));
    assert_eq!((bench.controller.state(), bench.controller.mode()), (State::Armed, Mode::Vent));
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
    assert_eq!(bench.controller.disarm(), Ok(()));
    assert_eq!((bench.controller.state(), bench.controller.mode()), (State::Disarmed, Mode::Vent));
}

#[test]
fn force_needs_a_table_unless_it_is_only_fed_back() {
    let mut fed_back = ready(|settings| settings.feed_forward = FeedForward::Off);
    assert_eq!(fed_back.controller.start(Mode::Force, OWNER), Ok(()));
    // No pressure is known for a force: nothing is commanded, and that is not a fault.
    assert_eq!(fed_back.controller.set_point(sent(SetPoint::Force(20.0))), Ok(()));
    fed_back.pass(50);
    assert_eq!((fed_back.controller.state(), fed_back.last.sides[0].pressure_pa), (State::Running, 0.0));
    for feed_forward in [FeedForward::Table, FeedForward::Gaylord] {
        let mut without = ready(|settings| settings.feed_forward = feed_forward);
        assert_eq!(without.controller.start(Mode::Force, OWNER), Err(Refusal::NoTable(Side::Agonist)));
        assert_eq!(without.latched(), Some(Fault::TableMissing));
    }
}

#[test]
fn a_table_is_used_until_it_is_forgotten() {
    let mut bench = Bench::new(|_| ());
    assert_eq!(bench.controller.use_table(Side::Agonist, &table::example()), Ok(()));
    assert!(
        bench.controller.model(Side::Agonist).is_some() && bench.controller.model(Side::Antagonist).is_none()
    );
    bench.controller.forget_table(Side::Agonist);
    assert!(bench.controller.model(Side::Agonist).is_none());
}

#[test]
fn a_silence_of_setpoints_is_noticed_in_the_tick_after_its_time() {
    let mut bench = Bench::running(|settings| settings.watch.silence_ticks = 1_200);
    assert_eq!(bench.controller.set_point(to_pressure(400e3)), Ok(()));
    bench.pass(1_200);
    assert_eq!(bench.latched(), None);
    bench.pass(1);
    assert_eq!(bench.latched(), Some(Fault::SetPointSilence));
}

#[test]
fn an_armed_device_disarms_in_the_tick_after_its_time() {
    let mut bench = ready(|settings| settings.watch.armed_silence_ticks = 1_000);
    bench.hears_host = false;
    bench.pass(1_000);
    assert_eq!(bench.controller.state(), State::Armed);
    bench.pass(1);
    assert_eq!(bench.controller.state(), State::Disarmed);
}

#[test]
fn a_vented_muscle_needs_no_keep_alive() {
    let mut vents = ready(|_| ());
    assert_eq!(vents.controller.start(Mode::Vent, OWNER), Ok(()));
    vents.hears_host = false;
    vents.pass(3_000);
    assert_eq!((vents.controller.state(), vents.latched()), (State::Running, None));
    let mut faulty = Bench::running(|_| ());
    faulty.pass_with(3, |now, _| now.force_n = -1e6);
    assert_eq!(faulty.latched(), Some(Fault::SensorRange));
    faulty.hears_host = false;
    faulty.pass(12_000);
    let counts = faulty.controller.faults().counts;
    for fault in [Fault::HostSilence, Fault::HoldEnded] {
        assert_eq!(counts[usize::from(fault.code())], 0, "{fault:?} where nothing is held");
    }
}

#[test]
fn a_muscle_without_readings_is_a_fault_while_it_is_used_and_an_unused_one_is_watched() {
    let mut bench = Bench::running(|_| ());
    let silent = |bench: &mut Bench, second: Option<Readings>| {
        let now = Readings { pressure_pa: bench.pressure_pa, stroke_m: 1e-3, force_n: 0.0 };
        let first = if second.is_some() { Some(now) } else { None };
        bench.last = bench
            .controller
            .step(&Inputs { sides: [first, second].map(|side| side.map(Into::into)), ..Inputs::default() });
    };
    silent(&mut bench, None);
    assert_eq!(bench.latched(), None);
    silent(&mut bench, None);
    assert_eq!(bench.latched(), Some(Fault::SensorsSilent));
    let mut bench = Bench::running(|_| ());
    for _ in 0..2 {
        silent(&mut bench, Some(Readings { pressure_pa: 900e3, ..Readings::default() }));
    }
    assert_eq!(bench.latched(), Some(Fault::OverPressure), "in the muscle that is not used");
    assert_eq!(bench.controller.faults().latched.map(|report| report.side), Some(Side::Antagonist));
}

#[test]
fn the_test_of_the_valves_commands_its_pressure_and_gives_each_half_its_time() {
    let tested = |settings: &mut Settings| {
        settings.watch.valve_test_pa = 40e3;
        (settings.regulator.gain, settings.regulator.offset_pa) = (1.25, 4e3);
    };
    let mut empty = ready(tested);
    empty.pass_with(1, |now, _| now.pressure_pa = 0.0);
    assert_eq!(empty.last.sides[0].pressure_pa, 40e3 / 1.25 - 4e3);
    empty.pass_with(999, |now, _| now.pressure_pa = 0.0);
    assert_eq!(empty.latched(), None);
    empty.pass_with(1, |now, _| now.pressure_pa = 0.0);
    assert_eq!(empty.latched(), Some(Fault::ValveTest));

    let mut full = ready(tested);
    let held = |now: &mut Readings, _: &mut Inputs| now.pressure_pa = 21e3;
    while !full.is_vented() || full.tick < 12 {
        full.pass_with(1, held);
        assert!(full.tick < 1_100, "what is full is emptied");
    }
    full.pass_with(999, held);
    assert_eq!(full.latched(), None, "a thousand ticks to empty");
    full.pass_with(1, |now, _| now.pressure_pa = 21e3);
    assert_eq!(full.latched(), Some(Fault::ValveTest));
}

#[test]
fn a_reading_that_is_no_number_is_not_remembered() {
    let mut bench = Bench::new(|_| ());
    assert_eq!(bench.controller.use_table(Side::Agonist, &table::example()), Ok(()));
    bench.pass(5);
    for spoil in
        [|now: &mut Readings| now.stroke_m = f32::NAN, |now: &mut Readings| now.pressure_pa = f32::INFINITY]
    {
        bench.pass_with(1, |now, _| spoil(now));
        assert_eq!(bench.controller.sides[0].model_n, None);
        bench.pass(1);
        let side = &bench.controller.sides[0];
        assert!(side.model_n.is_some_and(f32::is_finite) && side.motion.motion().stroke.is_finite());
    }
}

#[test]
fn a_turn_counts_beyond_the_bands_of_the_settings() {
    // Shortening by 2 mm, then lengthening by half a millimetre; and the same with pressure at held length.
    let direction = |change: fn(&mut Settings), strokes: [f32; 2], pressures: [f32; 2]| {
        let mut settings = Settings::default();
        change(&mut settings);
        let mut controller = Controller::new(&settings);
        for tick in 0..400 {
            let at = |[first, second]: [f32; 2]| {
                let part = (tick % 200) as f32 / 200.0;
                if tick < 200 { first * part } else { first + (second - first) * part }
            };
            let now = Readings { stroke_m: at(strokes), pressure_pa: at(pressures), force_n: 0.0 };
            controller.step(&Inputs { sides: [Some(now.into()), None], ..Inputs::default() });
        }
        controller.sides[0].motion.motion().direction
    };
    let fine = |_: &mut Settings| ();
    let coarse = |settings: &mut Settings| (settings.motion_band_m, settings.pressure_band_pa) = (1e-3, 20e3);
    assert_eq!(direction(fine, [2e-3, 1.95e-3], [0.0; 2]), -1.0);
    assert_eq!(direction(coarse, [2e-3, 1.5e-3], [0.0; 2]), 1.0);
    assert_eq!(direction(fine, [0.0; 2], [100e3, 96e3]), -1.0);
    assert_eq!(direction(coarse, [0.0; 2], [100e3, 90e3]), 1.0);
}

#[test]
fn the_volume_of_a_muscle_with_a_table_grows_as_it_shortens() {
    let mut bench = Bench::new(|_| ());
    bench.pass(5);
    assert_eq!(bench.controller.sides[0].air(), Air::default());
    assert_eq!(bench.controller.use_table(Side::Agonist, &table::example()), Ok(()));
    let stroke = core::cell::Cell::new(0.0);
    for _ in 0..100 {
        bench.pass_with(1, |now, _| now.stroke_m = stroke.replace(stroke.get() + 2e-5));
    }
    let air = bench.controller.sides[0].air();
    assert!(air.fill > 1.02 && air.widening_per_s > 0.0, "{air:?}");
}

#[test]
fn a_command_above_what_the_hardware_allows_is_never_sent() {
    // Such settings are refused; here they come into force all the same.
    let mut bench = ready(|settings| {
        (settings.regulator.gain, settings.regulator.command_max_pa) = (0.5, 5e6);
        (settings.limits.pressure_pa, settings.pressure.high) = (1.9e6, 3e6);
    });
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
    assert_eq!(bench.controller.set_point(to_pressure(1.9e6)), Ok(()));
    let ceiling = bench.controller.hardware().command_ceiling_pa;
    for _ in 0..300 {
        bench.pass(1);
        assert!(bench.last.sides[0].pressure_pa <= ceiling, "{:?}", bench.last);
    }
    assert_eq!((bench.latched(), bench.is_vented()), (Some(Fault::NotANumber), true));
}
