//! What is in the bench's recordings, as statements about a muscle on a test stand.

use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::physics::{Heat, Mullins, Relaxation, Viscous};
use virtual_bench::presets;
use virtual_bench::protocol::{Place, Protocol, Step};
use virtual_bench::recording::{Columns, Recording, Row};
use virtual_bench::sensors::Instruments;

fn ideal(muscle: MuscleSpec) -> BenchSpec {
    let mut b = BenchSpec::laboratory(muscle, 5);
    b.instruments = Instruments::ideal();
    (b.pneumatics.ripple, b.pneumatics.wander, b.pneumatics.deadband) = ((0.0, 1.0), (0.0, 1.0), 0.0);
    b
}

fn loops(pressure_kpa: f64, speed_mm_s: f64, count: u32) -> Protocol {
    let pressure = Step::Pressure { to_kpa: pressure_kpa, rate_kpa_s: Some(50.0), settle_s: 2.0 };
    let cycles = Step::Cycles { to: Place::free(0.95), speed_mm_s, count };
    Protocol {
        name: "loops".into(),
        sample_hz: 50.0,
        step: vec![pressure, Step::File { name: "l".into() }, cycles],
    }
}

fn run(bench: &BenchSpec, protocol: &Protocol) -> Vec<Row> {
    let files = Bench::new(bench).run(protocol).expect("a good protocol");
    files.into_iter().flat_map(|f| f.rows).collect()
}

/// Work taken in over the rows, J: positive when a closed loop loses energy.
fn loss(rows: &[Row]) -> f64 {
    rows.windows(2).map(|w| -0.5 * (w[0].force + w[1].force) * (w[1].stroke - w[0].stroke)).sum()
}

fn at(rows: &[Row], stroke: f64, shortening: bool) -> f64 {
    let crossing = rows.windows(2).find(|w| {
        let up = w[1].stroke > w[0].stroke;
        up == shortening
            && (w[0].stroke - stroke) * (w[1].stroke - stroke) <= 0.0
            && w[0].stroke != w[1].stroke
    });
    crossing.map_or(f64::NAN, |w| {
        let part = (stroke - w[0].stroke) / (w[1].stroke - w[0].stroke);
        w[0].force + part * (w[1].force - w[0].force)
    })
}

#[test]
fn a_loop_loses_energy_and_its_width_is_the_friction_factors() {
    let bench = ideal(presets::contractile());
    let rows = run(&bench, &loops(414.0, 2.0, 2));
    let second = &rows[rows.len() / 2..];
    assert!(loss(second) > 0.0, "{} J", loss(second));
    let (out, back) = (at(second, 0.015, true), at(second, 0.015, false));
    let factor = (back - out) / (back + out);
    assert!((factor - 0.10).abs() < 0.004, "{factor}");
}

#[test]
fn without_friction_or_memory_a_loop_gives_back_what_it_took() {
    let mut spec = presets::contractile();
    spec.friction.factor = vec![(0.0, 0.0), (1e6, 0.0)];
    let mut bench = ideal(spec);
    bench.pneumatics.line = 1e-5;
    let rows = run(&bench, &loops(414.0, 2.0, 1));
    let stroke = rows.iter().map(|r| r.stroke).fold(0.0, f64::max);
    let force = rows.iter().map(|r| r.force).fold(0.0, f64::max);
    assert!(loss(&rows).abs() < 2e-3 * force * stroke, "{} J of {} J", loss(&rows), force * stroke);
}

#[test]
fn drag_widens_the_loop_in_proportion_to_speed() {
    let width = |speed: f64| {
        let mut spec = presets::contractile();
        spec.friction.factor = vec![(0.0, 0.0), (1e6, 0.0)];
        spec.physics.viscous = Some(Viscous { drag: 2000.0, per_pressure: 0.0 });
        let mut bench = ideal(spec);
        bench.pneumatics.line = 1e-5;
        let rows = run(&bench, &loops(414.0, speed, 1));
        at(&rows, 0.015, false) - at(&rows, 0.015, true)
    };
    let (slow, fast) = (width(2.0), width(8.0));
    assert!((slow - 8.0).abs() < 0.5 && (fast - 32.0).abs() < 1.0, "{slow} {fast}");
}

#[test]
fn a_held_muscle_relaxes_and_a_rested_first_stroke_is_the_stiffest() {
    let mut spec = presets::contractile();
    spec.physics.relaxation = Some(Relaxation { strength: 0.05, fastest: 5.0, branches: 2, exponent: 0.3 });
    let mut protocol = loops(414.0, 4.0, 1);
    protocol
        .step
        .extend([Step::Move { to: Place::free(0.6), speed_mm_s: 10.0 }, Step::Hold { seconds: 60.0 }]);
    let rows = run(&ideal(spec), &protocol);
    let n = rows.len();
    // The elastic force works against the pull: as it relaxes the pull grows.
    assert!(rows[n - 1].force > rows[n - 2900].force + 1.0, "{} {}", rows[n - 1].force, rows[n - 2900].force);

    let mut spec = presets::contractile();
    spec.physics.mullins = Some(Mullins { loss: 0.3, width: 0.5, conditioned: 0.0 });
    let rows = run(&ideal(spec), &loops(414.0, 4.0, 3));
    let turn = |n: usize| &rows[rows.len() * n / 3..rows.len() * (n + 1) / 3];
    let pull = |n: usize| at(turn(n), 0.015, true);
    assert!(
        pull(1) > pull(0) + 1.0 && (pull(2) - pull(1)).abs() < 1.0,
        "{} {} {}",
        pull(0),
        pull(1),
        pull(2)
    );
}

#[test]
fn friction_warms_the_bladder_and_rest_cools_it() {
    let mut spec = presets::contractile();
    spec.physics.heat = Some(Heat {
        capacity: 40.0,
        to_fittings: 0.3,
        fittings: 100.0,
        to_room: 0.3,
        stiffness: 0.003,
        friction: -0.01,
        hysteresis: 0.1,
    });
    let bench = ideal(spec);
    let mut b = Bench::new(&bench);
    let warm = b.run(&loops(414.0, 40.0, 60)).expect("runs");
    let end = warm[0].rows.last().map_or(0.0, |r| r.temperature);
    assert!(end > 23.0, "{end} °C");
    let mut rest = loops(414.0, 40.0, 1);
    rest.step.insert(0, Step::Rest { seconds: 3600.0 });
    let cool = b.run(&rest).expect("runs");
    assert!(cool[0].rows[0].temperature < 0.3 * (end - 22.0) + 22.0);
}

#[test]
fn emptying_a_held_muscle_leaves_more_force_than_filling() {
    let bench = ideal(presets::contractile());
    let to = |kpa: f64| Step::Pressure { to_kpa: kpa, rate_kpa_s: Some(20.0), settle_s: 1.0 };
    let protocol = Protocol { name: "ramp".into(), sample_hz: 20.0, step: vec![to(600.0), to(0.0)] };
    let rows = run(&bench, &protocol);
    let near = |p: f64, part: &[Row]| {
        part.iter()
            .min_by(|a, b| (a.pressure - p).abs().total_cmp(&(b.pressure - p).abs()))
            .map_or(0.0, |r| r.force)
    };
    let top = rows.iter().position(|r| r.pressure > 599e3).expect("reaches the top");
    let (fill, empty) = (near(300e3, &rows[..top]), near(300e3, &rows[top..]));
    assert!(empty > 1.1 * fill, "{empty} {fill}");
}

#[test]
fn a_vented_muscle_neither_pulls_nor_pushes() {
    let mut bench = Bench::new(&ideal(presets::miniature()));
    let protocol = Protocol { name: "t".into(), sample_hz: 10.0, step: vec![Step::Tare { seconds: 3.0 }] };
    let rows = bench.run(&protocol).expect("runs").remove(0).rows;
    assert!(rows.iter().all(|r| r.force.abs() < 0.05 && r.stroke == 0.0), "{:?}", rows.last());
}

#[test]
fn files_have_the_agreed_columns_and_the_thesiss_raw_form_agrees() {
    let spec = BenchSpec::laboratory(presets::miniature(), 3);
    let muscle = Muscle::new(spec.muscle.clone());
    let levels = presets::miniature_pressures();
    let files = Bench::new(&spec).run(&campaigns::thesis(&muscle, &levels)).expect("runs");
    assert_eq!(files.len(), 6);
    let rows: usize = files.iter().map(|f| f.rows.len()).sum();
    assert!((15_000..30_000).contains(&rows), "about the thesis's 24,229: {rows}");
    let csv = files[0].csv(Columns { cycle: true, ..Columns::default() });
    assert!(csv.starts_with("time_s,pressure_kPa,displacement_mm,force_N,cycle\n"), "{}", &csv[..60]);
    let raw = files[0].thesis("mini-1", levels[0], 1.5);
    let lines: Vec<&str> = raw.lines().collect();
    assert_eq!(lines.len(), 5 + files[0].rows.len());
    let cells: Vec<f64> = lines[700].split('\t').map(|c| c.parse().expect("a number")).collect();
    let row = files[0].rows[695];
    assert!(((1.5 - cells[1]) * 0.0254 - row.stroke).abs() < 1e-7);
    assert!((cells[3] * 508.41 * 4.448_221_6 - row.force).abs() < 1e-3);
}

#[test]
fn a_seed_gives_the_same_files_for_ever() {
    let make = |seed| {
        let spec = BenchSpec::laboratory(presets::random(seed), seed);
        let m = Muscle::new(spec.muscle.clone());
        let protocol = campaigns::classic(&m, &campaigns::levels(&m));
        let files: Vec<Recording> = Bench::new(&spec).run(&protocol).expect("runs");
        files.iter().map(|f| f.csv(Columns::default())).collect::<String>()
    };
    assert_eq!(make(11), make(11));
    assert_ne!(make(11), make(12));
}
