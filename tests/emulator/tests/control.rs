//! The controller follows a force while the muscle moves: the real image, in lock-step with a plant of other physics.

use emulator_tests::machine::Folder;
use emulator_tests::tracking::{self, Stretch, Wanted};
use emulator_tests::{Machine, Options, Watched, fitting, upload};
use model_core::link::messages::{Mode, Reference, SetPoint, Side};
use model_core::link::settings::FeedForward;
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::presets;

/// The task of the comparison: the muscle is moved, the force swings at 0.5 Hz and steps.
fn task() -> [Stretch; 3] {
    let sine = Reference::Sine { mean: 45.0, amplitude: 20.0, frequency_hz: 0.5 };
    let point = |newtons| Wanted::Point(SetPoint::Force(newtons));
    [
        Stretch { wanted: Wanted::Wave(sine), ticks: 3000, unjudged: 300 },
        Stretch { wanted: point(60.0), ticks: 700, unjudged: 300 },
        Stretch { wanted: point(35.0), ticks: 700, unjudged: 300 },
    ]
}

fn moving() -> Watched<PlantStation> {
    let bench = BenchSpec::laboratory(presets::miniature(), 7);
    let motion = Motion::Sine { mean_mm: 0.9, amplitude_mm: 0.6, frequency_hz: 0.3 };
    Watched::new(PlantStation::new(bench, vec![motion], 1e-3))
}

#[test]
fn force_follows_its_wave_far_better_with_the_fitted_table_than_without() {
    let folder = Folder::new();
    let station = moving();
    let options = Options { first: Some(Box::new(station.clone())), ..Options::default() };
    let Ok(machine) = Machine::start(folder.path(), options) else { return };
    let table = fitting::fitted(&presets::miniature());
    let blocked = f64::from(table.blocked_force.newtons());
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &table);
    let mut figures = [0.0; 3];
    let ways =
        [(FeedForward::Table, 0.0, 0.0), (FeedForward::Gaylord, 0.0, 0.0), (FeedForward::Off, 0.0, 4e3)];
    for ((feed_forward, p, i), figure) in ways.into_iter().zip(&mut figures) {
        tracking::set(&mut client, tracking::compare(feed_forward, p, i));
        let samples = tracking::run(&mut client, Mode::Force, &task());
        *figure = 100.0 * tracking::rms(&samples, tracking::force) / blocked;
    }
    let [table, gaylord, none] = figures;
    eprintln!("rms error in % of blocked force: table {table:.2}, Gaylord {gaylord:.2}, none (PI) {none:.2}");
    assert!(table < 2.0, "{figures:?}");
    assert!(gaylord > 3.0 * table, "{figures:?}");
    assert!(none > 2.0 * table, "{figures:?}");
}
