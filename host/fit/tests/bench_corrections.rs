//! Corrections of the bench: the catalogue's names, the same contract as the muscle's effects, and cases worked out by hand.

use model_core::effects::{Context, MEMORY};
use model_core::motion::{Motion, MotionSettings, MotionTracker};
use model_core::muscle::Muscle;
use model_core::table;
use model_core::units::{Length, Pressure};
use pam_fit::bench::{BenchName, Candidate, Span};

const BENCH: [&str; 14] = [
    "gauge-offset",
    "gauge-gain",
    "pressure-sensor-lag",
    "inertia",
    "gravity",
    "misalignment",
    "rig-compliance",
    "backlash",
    "force-offset",
    "force-drift",
    "force-gain",
    "cross-talk",
    "sensor-delay",
    "displacement-offset",
];

fn muscle() -> Muscle<f64> {
    Muscle::build(&table::example()).expect("a valid table")
}

/// Two loops at 400 kPa with a pause of half an hour between them, and a ramp of pressure at the end.
fn contexts() -> Vec<Context<f64>> {
    let muscle = muscle();
    let mut tracker = MotionTracker::new(MotionSettings::default());
    (0..2400_i32)
        .map(|i| {
            let phase = f64::from(i % 400) / 200.0;
            let stroke = if i < 2000 { 2e-3 * (1.0 - (phase - 1.0).abs()) } else { 0.0 };
            let pressure = 400e3 - 100.0 * f64::from((i - 2000).max(0));
            let dt = if i == 800 { 1800.0 } else { 0.05 };
            let mut motion = *tracker.step(dt, stroke, pressure);
            motion.temperature = 295.0 + 1e-3 * f64::from(i);
            muscle.context(&motion, Pressure::from_pascals(pressure))
        })
        .collect()
}

fn columns(name: &str, shape: &[f64], contexts: &[Context<f64>]) -> Vec<Vec<f64>> {
    Candidate::from_name(name).expect("in the catalogue").columns(contexts, shape, &mut [0.0; MEMORY])
}

#[test]
fn the_bench_s_part_of_the_catalogue_is_there_and_is_no_muscle_s() {
    for name in BENCH {
        assert!(Candidate::from_name(name).is_some_and(Candidate::is_bench), "{name}");
    }
    assert_eq!(BenchName::ALL.len(), BENCH.len());
    assert_eq!(Candidate::all().count(), 39);
    let mut names: Vec<&str> = Candidate::all().map(Candidate::name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), 39, "no name twice");
}

#[test]
fn every_trace_is_the_sum_of_its_columns_and_finite() {
    let contexts = contexts();
    let span = Span::of(&contexts).expect("readings");
    for candidate in Candidate::all() {
        for shape in candidate.grid(2, &span) {
            let columns = candidate.columns(&contexts, &shape, &mut [0.0; MEMORY]);
            let amplitudes: Vec<f64> = (0..columns.len()).map(|i| 0.5 + i as f64).collect();
            let parameters: Vec<f64> = amplitudes.iter().chain(&shape).copied().collect();
            let trace = candidate.trace(&contexts, &parameters, &mut [0.0; MEMORY]);
            let size = trace.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            for (row, force) in trace.iter().enumerate() {
                let sum: f64 = columns.iter().zip(&amplitudes).map(|(c, a)| a * c[row]).sum();
                assert!(force.is_finite(), "{} at row {row}", candidate.name());
                assert!(
                    (force - sum).abs() <= 1e-9 * size,
                    "{} at row {row}: {force} {sum}",
                    candidate.name()
                );
            }
        }
    }
}

#[test]
fn an_unknown_beginning_fades() {
    let contexts = contexts();
    for name in ["stress-relaxation", "log-creep", "force-drift"] {
        let candidate = Candidate::from_name(name).expect("in the catalogue");
        let shape = [30.0];
        let traces = candidate.fading_columns(&contexts, &shape);
        assert_eq!(traces.len(), candidate.info().fading.len());
        // The residual of an over-stress in the muscle is rubbed as all that it pulls.
        let rubbed = |row: usize| if candidate.is_bench() { 1.0 } else { contexts[row].rubbed(1.0) };
        for trace in traces {
            assert!(trace[0].abs() > 0.5, "{name} begins with {}", trace[0]);
            assert!((trace[799] / rubbed(799)).abs() < (trace[0] / rubbed(0)).abs(), "{name} fades");
        }
    }
    // A standard solid's: e^(−t/τ), also over the pause.
    let solid = Candidate::from_name("stress-relaxation").expect("in the catalogue");
    let trace = &solid.fading_columns(&contexts, &[30.0])[0];
    let kept = trace[700] / contexts[700].rubbed(1.0);
    assert!((kept - (-35.0_f64 / 30.0).exp()).abs() < 1e-3, "{kept}");
    assert!(trace[800].abs() < 1e-12);
}

#[test]
fn a_rig_that_gives_is_solved_to_first_order() {
    let muscle = muscle();
    let pressure = Pressure::from_kilopascals(400.0);
    let context = muscle.context(&Motion { stroke: 1e-3, ..Motion::default() }, pressure);
    let compliance = 2e-8;
    // F = F_model(x + F/K), solved.
    let mut force = context.quasi;
    for _ in 0..50 {
        force = muscle.force(pressure, Length::from_metres(1e-3 + compliance * force), 0.0).newtons();
    }
    let added = compliance * columns("rig-compliance", &[], &[context])[0][0];
    assert!(
        (context.quasi + added - force).abs() < 0.01 * added.abs(),
        "{added} for {}",
        force - context.quasi
    );
}

#[test]
fn shifted_readings_are_the_model_s_at_shifted_readings() {
    let muscle = muscle();
    let at = |stroke: f64, kilopascals: f64| {
        muscle.context(&Motion { stroke, ..Motion::default() }, Pressure::from_kilopascals(kilopascals))
    };
    let here = at(1e-3, 400.0);
    let moved = columns("displacement-offset", &[], &[here])[0][0] * 1e-6;
    let exact = at(1e-3 + 1e-6, 400.0).quasi - here.quasi;
    assert!((moved - exact).abs() < 1e-2 * exact.abs(), "{moved} {exact}");
    // A gauge that reads 1 % low: Gaylord's force of 4 kPa more.
    let gain = columns("gauge-gain", &[], &[here])[0][0] * 0.01;
    assert!((gain - 4e3 * here.area).abs() < 1e-9, "{gain}");
    let offset = columns("gauge-offset", &[], &[here])[0][0];
    assert_eq!(offset, here.area);
}

#[test]
fn a_loose_joint_holds_still_for_its_width_after_a_turn() {
    let muscle = muscle();
    let width = 0.1e-3;
    let strokes: Vec<f64> =
        (0..=100).map(|i| 1e-5 * f64::from(i)).chain((0..100).map(|i| 1e-5 * f64::from(99 - i))).collect();
    let contexts: Vec<Context<f64>> = strokes
        .iter()
        .map(|x| {
            muscle.context(&Motion { stroke: *x, ..Motion::default() }, Pressure::from_kilopascals(400.0))
        })
        .collect();
    let column = &columns("backlash", &[width], &contexts)[0];
    // Where the muscle is: the stroke that would make the model's first-order force.
    let place = |row: usize| strokes[row] + column[row] / contexts[row].stiffness;
    assert!((place(100) - (1e-3 - width / 2.0)).abs() < 1e-9);
    assert!((place(105) - place(100)).abs() < 1e-9, "still within the play");
    assert!((place(150) - (strokes[150] + width / 2.0)).abs() < 1e-9, "on the other flank");
}

#[test]
fn friction_that_the_pressure_reverses_at_held_length_reverses_behind_a_loose_joint_too() {
    let width = 0.2e-3;
    let muscle = muscle();
    let at = |stroke: f64, speed: f64, direction: f64, kpa: f64| {
        muscle.context(
            &Motion { stroke, speed, direction, ..Motion::default() },
            Pressure::from_kilopascals(kpa),
        )
    };
    // Shortened by a millimetre, held while the pressure falls and rises again, then lengthened by a little less than the play.
    let mut contexts: Vec<Context<f64>> =
        (0..=100).map(|i| at(1e-5 * f64::from(i), 1e-3, 1.0, 400.0)).collect();
    contexts
        .extend([(-1.0, 350.0), (-1.0, 300.0), (1.0, 350.0), (1.0, 400.0)].map(|(d, p)| at(1e-3, 0.0, d, p)));
    contexts.push(at(0.9e-3, -1e-3, -1.0, 400.0));
    let column = &columns("backlash", &[width, 0.05], &contexts)[0];
    let friction = |row: usize| {
        let c = &contexts[row];
        let place = if row <= 104 { -0.5 * width } else { 0.5 * width - 0.1e-3 };
        (column[row] - c.slope() * place) / (c.friction * c.quasi)
    };
    for row in 100..=104 {
        assert!(friction(row).abs() < 1e-9, "row {row}: held, friction is the model's: {}", friction(row));
    }
    assert!(
        (friction(105) + 2.0).abs() < 1e-9,
        "turned within the play it is still the old one: {}",
        friction(105)
    );
}

#[test]
fn a_filtered_cell_rounds_the_jump_at_a_turn() {
    let turned = |direction: f64, dt: f64| Context {
        direction,
        dt,
        quasi: 100.0,
        friction: 0.1,
        ..Context::default()
    };
    let contexts =
        [turned(1.0, 0.0), turned(1.0, 1.0), turned(-1.0, 1e-6), turned(-1.0, 0.02), turned(-1.0, 10.0)];
    let filtered = &columns("sensor-delay", &[0.02], &contexts)[1];
    // The force jumps from 90 to 110 N; the reading follows with 20 ms.
    for (row, expected) in [(1, 0.0), (2, -20.0), (3, -20.0 * (-1.0_f64).exp()), (4, 0.0)] {
        assert!((filtered[row] - expected).abs() < 0.01, "row {row}: {}", filtered[row]);
    }
}

#[test]
fn a_late_cell_reads_the_jump_at_a_turn_later() {
    // The force jumps from 90 to 110 N at t = 0.995 s; the reading is 0.2 s late.
    let contexts: Vec<_> = (0..200)
        .map(|i| Context {
            direction: if i < 100 { 1.0 } else { -1.0 },
            dt: if i == 0 { 0.0 } else { 0.01 },
            quasi: 100.0,
            friction: 0.1,
            ..Context::default()
        })
        .collect();
    let late = &columns("sensor-delay", &[0.2], &contexts)[2];
    for (row, added) in late.iter().enumerate() {
        let expected = if (100..120).contains(&row) { -20.0 } else { 0.0 };
        assert!((added - expected).abs() < 1e-9, "row {row}: {added} for {expected}");
    }
}

#[test]
fn plain_readings() {
    let context = Context {
        pressure: 2e5,
        acceleration: 2.0,
        stroke: 0.01,
        time: 100.0,
        quasi: 50.0,
        ..Context::default()
    };
    let one = |name: &str, shape: &[f64]| {
        columns(name, shape, &[context]).iter().map(|c| c[0]).collect::<Vec<f64>>()
    };
    assert_eq!(one("force-offset", &[]), [1.0]);
    assert_eq!(one("cross-talk", &[]), [2e5]);
    assert_eq!(one("inertia", &[]), [-2.0]);
    assert_eq!(one("force-gain", &[]), [50.0, 2500.0]);
    assert_eq!(one("gravity", &[]), [-9.80665, -0.0980665]);
    assert_eq!(one("force-drift", &[50.0])[0], 100.0);
}
