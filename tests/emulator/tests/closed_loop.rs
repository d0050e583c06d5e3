//! The control step on the plant, as physical statements, without the emulator.

use emulator_tests::closed_loop::{self, Loop, Tick, rms};
use emulator_tests::fitting;
use model_core::link::messages::{Mode, Reference, SetPoint};
use model_core::link::settings::{FeedForward, Settings};
use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use model_core::units::{Length, Pressure};
use virtual_bench::bench::BenchSpec;
use virtual_bench::muscle::MuscleSpec;
use virtual_bench::plant::Motion;
use virtual_bench::presets;

/// A muscle moved at 0.3 Hz over the first third of its free contraction, at a force of 40 % ± 15 % of blocked.
struct Task {
    spec: MuscleSpec,
    table: MuscleTable,
    motion: Motion,
    /// What a user would have set: the regulator as it was identified.
    base: Settings,
}

impl Task {
    fn of(spec: MuscleSpec) -> Self {
        let table = fitting::fitted(&spec);
        let rest_mm = f64::from(table.geometry.rest_length.si()) * 1e3;
        let reach = f64::from(table.tested.contraction_high);
        let motion = Motion::Sine {
            mean_mm: 0.22 * reach * rest_mm,
            amplitude_mm: 0.12 * reach * rest_mm,
            frequency_hz: 0.3,
        };
        let bench = BenchSpec::laboratory(spec.clone(), 12);
        let base =
            closed_loop::identified(&bench, &table, 0.1 * reach * rest_mm).settings(Settings::default());
        Self { spec, table, motion, base }
    }

    fn blocked(&self) -> f64 {
        f64::from(self.table.blocked_force.newtons())
    }

    /// Free stroke at the highest pressure tested, m.
    fn free_stroke(&self) -> f64 {
        f64::from(self.table.tested.contraction_high) * f64::from(self.table.geometry.rest_length.si())
    }

    /// Stroke about which the muscle is moved, m.
    fn middle(&self) -> f64 {
        0.22 * self.free_stroke()
    }

    fn slope(&self) -> f32 {
        let muscle = Muscle::<f32>::build(&self.table).expect("valid");
        muscle.braid().posture(Length::from_metres(self.middle() as f32)).area
    }

    fn settings(&self, mut settings: Settings) -> Settings {
        settings.limits.force_n = 2.0 * self.table.blocked_force.newtons();
        settings
    }

    /// Rms error in % of blocked force for a sine of a frequency.
    fn sine(&self, settings: Settings, frequency_hz: f32) -> f64 {
        let bench = BenchSpec::laboratory(self.spec.clone(), 11);
        let mut control =
            Loop::start(&bench, &self.motion, &self.table, self.settings(settings), Mode::Force);
        let blocked = self.table.blocked_force.newtons();
        control.wave(Reference::Sine { mean: 0.4 * blocked, amplitude: 0.15 * blocked, frequency_hz });
        control.run(700);
        100.0 * rms(&control.run(4000), |tick| tick.force) / self.blocked()
    }
}

#[test]
fn the_table_beats_the_ideal_braid_and_with_a_trim_pi_of_the_same_margin_by_far() {
    let mut failures = Vec::new();
    for spec in [presets::miniature(), presets::contractile(), presets::push()] {
        let name = spec.name.clone();
        let task = Task::of(spec);
        for hz in [0.5, 1.0] {
            let table = task.sine(closed_loop::forward(task.base, FeedForward::Table), hz);
            let gaylord = task.sine(closed_loop::forward(task.base, FeedForward::Gaylord), hz);
            let pi = task.sine(
                closed_loop::pi_alone(task.base, task.slope(), closed_loop::fill(&task.table, task.middle())),
                hz,
            );
            let trimmed = task.sine(closed_loop::trimmed(task.base, task.slope()), hz);
            eprintln!(
                "{name} at {hz} Hz: table {table:.2} %, with trim {trimmed:.2} %, Gaylord {gaylord:.2} %, PI {pi:.2} %"
            );
            // PI has the same phase margin, and does not know what comes. At the largest stroke and force the larger muscles need more
            // than the regulator's highest command for a moment, regardless of the law.
            if !(table < 1.0 && trimmed < 0.8 && pi > 2.5 * trimmed && gaylord > 10.0 * table) {
                failures.push((name.clone(), hz, table, trimmed, gaylord, pi));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

#[test]
fn a_trim_on_the_load_cell_takes_away_what_a_wrong_table_leaves() {
    let task = Task::of(presets::miniature());
    let mut softer = task.table.clone();
    for curve in &mut softer.elastic {
        for modulus in curve.iter_mut() {
            *modulus *= 0.8;
        }
    }
    let wrong = Task { table: softer, ..task };
    let alone = wrong.sine(closed_loop::forward(wrong.base, FeedForward::Table), 0.5);
    let with_trim = wrong.sine(closed_loop::trimmed(wrong.base, wrong.slope()), 0.5);
    eprintln!("bladder 20 % stiffer than its table: {alone:.2} % alone, {with_trim:.2} % with trim");
    assert!(with_trim < 0.2 * alone && with_trim < 0.6);
}

#[test]
fn stroke_is_reached_against_a_spring_without_a_lasting_error() {
    let task = Task::of(presets::miniature());
    let bench = BenchSpec::laboratory(task.spec.clone(), 5);
    let load = Motion::Load { mass: 0.5, spring: 10.0, preload: 5.0, damper: 0.05 };
    let mut control = Loop::start(&bench, &load, &task.table, Settings::default(), Mode::Stroke);
    for millimetres in [0.8_f32, 1.6, 0.4] {
        control.point(SetPoint::Stroke(millimetres * 1e-3));
        control.run(1500);
        let error = rms(&control.run(1000), |tick| tick.stroke);
        eprintln!("stroke of {millimetres} mm: rms error {:.3} mm", error * 1e3);
        // 3 % of the free stroke: friction lets the last tenths of a millimetre go in small slips.
        assert!(error < 0.1e-3, "{error}");
    }
}

/// Ticks until what is demanded is within a part of `scale` permanently.
fn settled(ticks: &[Tick], scale: f64, value: impl Fn(&Tick) -> f64) -> usize {
    ticks
        .iter()
        .rposition(|tick| (value(tick) - tick.setpoint).abs() > 0.03 * scale)
        .map_or(0, |last| last + 1)
}

#[test]
fn a_long_saturation_causes_no_integrator_windup() {
    let task = Task::of(presets::miniature());
    let bench = BenchSpec::laboratory(task.spec.clone(), 2);
    let blocked = task.blocked();
    let fill = closed_loop::fill(&task.table, task.middle());
    let laws = [
        ("table and trim", closed_loop::trimmed(task.base, task.slope()), 150),
        ("PI alone", closed_loop::pi_alone(task.base, task.slope(), fill), 320),
    ];
    let held = Motion::Held { stroke_mm: task.middle() * 1e3 };
    for (name, settings, most) in laws {
        let back = |asked_before: f64| {
            let mut control = Loop::start(&bench, &held, &task.table, task.settings(settings), Mode::Force);
            control.point(SetPoint::Force(asked_before as f32));
            control.run(3000);
            let limited = control.controller.saturated_ticks();
            control.point(SetPoint::Force(0.3 * blocked as f32));
            (settled(&control.run(2000), blocked, |tick| tick.force), limited)
        };
        // Twice what the muscle can do, for three seconds; and a little less than it can.
        let ((after_limit, limited), (after_reach, _)) = (back(2.0 * blocked), back(0.7 * blocked));
        eprintln!(
            "{name}: back in {after_limit} ticks from saturation, {after_reach} from within the limits"
        );
        assert!(limited > 2500, "{limited} ticks in saturation");
        // With an integrator that continued PI would need 346 and 439.
        assert!(after_limit < most && after_reach < 200, "{name}: {after_limit} and {after_reach} ticks");
    }
    let load = Motion::Load { mass: 0.5, spring: 10.0, preload: 5.0, damper: 0.05 };
    let back = |asked_before: f32| {
        let mut control = Loop::start(&bench, &load, &task.table, Settings::default(), Mode::Stroke);
        control.point(SetPoint::Stroke(asked_before));
        control.run(3000);
        control.point(SetPoint::Stroke(0.8e-3));
        settled(&control.run(4000), task.free_stroke(), |tick| tick.stroke)
    };
    let (after_limit, after_reach) = (back(20e-3), back(1.6e-3));
    eprintln!("stroke: back in {after_limit} ticks from the limit, {after_reach} from within reach");
    assert!(after_limit < after_reach + 300, "{after_limit} and {after_reach} ticks");
}

#[test]
fn a_minute_without_a_missed_tick_a_drift_or_a_leak() {
    let task = Task::of(presets::miniature());
    let bench = BenchSpec::laboratory(task.spec.clone(), 9);
    let settings = task.settings(closed_loop::forward(task.base, FeedForward::Table));
    let mut control = Loop::start(&bench, &task.motion, &task.table, settings, Mode::Force);
    let blocked = task.table.blocked_force.newtons();
    control.wave(Reference::Sine { mean: 0.4 * blocked, amplitude: 0.15 * blocked, frequency_hz: 0.5 });
    control.run(1000);
    let first: Vec<Tick> = control.run(10_000);
    // PAM_LONG=1 makes it a day.
    let ticks = if std::env::var_os("PAM_LONG").is_some() { 86_400_000 } else { 60_000 };
    for _ in 0..ticks / 10_000 {
        control.run(10_000);
    }
    let last = control.run(10_000);
    let (before, after) = (rms(&first, |tick| tick.force), rms(&last, |tick| tick.force));
    assert!((after - before).abs() < 0.25 * before, "{before} N at first, {after} N at last");
    assert_eq!(control.controller.overruns(), 0);
    let expected = 1 + 1000 + 10_000 + ticks / 10_000 * 10_000 + 10_000_u32;
    assert_eq!(control.controller.ticks(), u64::from(expected), "time is counted in ticks");
}

#[test]
fn the_highest_pressure_of_the_table_is_never_passed() {
    let task = Task::of(presets::miniature());
    let bench = BenchSpec::laboratory(task.spec.clone(), 2);
    let mut control = Loop::start(
        &bench,
        &Motion::Held { stroke_mm: 1.0 },
        &task.table,
        task.settings(Settings::default()),
        Mode::Force,
    );
    control.point(SetPoint::Force(1e5));
    let highest = control.run(2000).iter().map(|tick| tick.command).fold(0.0, f64::max);
    let limit = f64::from(task.table.max_pressure.pascals());
    assert!(highest <= limit + 1.0, "{highest}");
    assert!(control.controller.saturated_ticks() > 1000);
    let force = Muscle::<f64>::build(&task.table).expect("valid").force(
        Pressure::from_pascals(limit),
        Length::from_millimetres(1.0),
        0.0,
    );
    let settled = control.run(100).last().map_or(0.0, |tick| tick.force);
    assert!(settled < 1.15 * force.newtons(), "{settled} N");
}

#[test]
fn a_constant_setpoint_is_held_without_a_limit_cycle_with_and_without_a_moving_load() {
    use emulator_tests::sweep::{Law, Load, Subject};
    for spec in [presets::miniature(), presets::contractile(), presets::push()] {
        let subject = Subject::of(spec);
        for load in [Load::AtStroke, Load::Moved, Load::Spring] {
            let [table, trimmed] = [Law::Table, Law::Trimmed].map(|law| subject.still(load, law));
            eprintln!(
                "{} {load:?}: {table:.3?} with the table, {trimmed:.3?} with a trim",
                subject.spec.name
            );
            // Friction that does not turn with the load costs 3 to 5 %; with a trim a tenth of that is left.
            let error = if load == Load::Moved { 1.0 } else { 2.0 };
            assert!(table.error < error && trimmed.error < 0.7, "{load:?} {table:?} {trimmed:?}");
            if load != Load::Moved {
                // A mass on a spring whose friction is taken away follows the regulator's drift.
                assert!(table.swing < 0.45 && trimmed.swing < 0.1, "{load:?} {table:?} {trimmed:?}");
                // Three times what the lead makes of sensor noise: a compensation that chatters makes ten of it.
                assert!(table.jump < 4e3 && trimmed.jump < 4e3, "{load:?} {table:?} {trimmed:?}");
            }
        }
    }
}

/// The short form of `cargo run --release -p emulator-tests --bin tracking`, which writes the whole sweep.
#[test]
fn force_with_table_and_trim_follows_within_a_percent_and_a_stiffer_bladder_does_not_upset_it() {
    use emulator_tests::sweep::{Law, Load, Profile, Subject};
    let subject = Subject::of(presets::miniature());
    let cases = [
        (Load::AtStroke, Profile::Sine(1.0)),
        (Load::Moved, Profile::Ramps),
        (Load::Moved, Profile::Sine(1.0)),
        (Load::Spring, Profile::Ramps),
        (Load::Spring, Profile::Sine(0.5)),
    ];
    for (load, profile) in cases {
        let [table, trimmed, gaylord] = [Law::Table, Law::Trimmed, Law::Gaylord]
            .map(|law| subject.error(Mode::Force, load, profile, law));
        let limit = subject.limit(Mode::Force, load, profile);
        eprintln!(
            "{load:?} {profile:?}: table {table:.2}, trimmed {trimmed:.2}, Gaylord {gaylord:.2}, limit {limit:.2} %"
        );
        assert!(trimmed < 0.5 && trimmed > 0.5 * limit && gaylord > 10.0 * table, "{load:?} {profile:?}");
    }
    for factor in [0.8, 1.2] {
        let other = subject.misjudged(factor);
        let error = other.error(Mode::Force, Load::Moved, Profile::Sine(1.0), Law::Trimmed);
        assert!(error < 0.5, "{error} % with moduli by {factor}");
    }
}

/// The whole table is `cargo run --release -p emulator-tests --bin stability`.
#[test]
fn no_number_of_a_table_that_is_wrong_by_a_fifth_makes_the_loop_swing() {
    use emulator_tests::misjudged;
    use emulator_tests::sweep::{Law, Load, Profile, Subject};
    let subject = Subject::of(presets::miniature());
    let corners = misjudged::alone(&subject, 0.2).into_iter().chain(misjudged::worst(&subject, 0.2));
    for corner in corners {
        let other = corner.subject(&subject);
        let error = other.error(Mode::Force, Load::Moved, Profile::Sine(1.0), Law::Trimmed);
        let still = other.still(Load::AtStroke, Law::Trimmed);
        eprintln!("{}: {:.2}, {error:.2} %, {still:.3?}", corner.name(), corner.slope_error);
        // The small-gain theorem.
        assert!(corner.slope_error < 1.0, "{}: {}", corner.name(), corner.slope_error);
        assert!(error < 0.5, "{}: {error} %", corner.name());
        assert!(still.error < 0.7 && still.swing < 0.1 && still.jump < 4e3, "{}: {still:?}", corner.name());
    }
}
