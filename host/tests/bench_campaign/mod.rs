//! Campaigns of the virtual bench as recordings, for tests of the fit.
#![allow(
    clippy::expect_used,
    dead_code,
    reason = "helpers of several tests: a failure here is a failure of the test"
)]

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};

/// The bench's muscle, as a user would describe it.
pub fn description(spec: &MuscleSpec) -> MuscleDescription {
    MuscleDescription::parse(&spec.description()).expect("the bench describes its muscles")
}

/// The thesis's test of a muscle as the bench wrote it: three slow loops at each pressure, one file a pressure.
pub fn files(
    spec: &MuscleSpec,
    levels: &[f64],
    seed: u64,
    hz: f64,
) -> Vec<virtual_bench::recording::Recording> {
    let muscle = Muscle::new(spec.clone());
    let mut protocol = campaigns::thesis(&muscle, levels);
    protocol.sample_hz = hz;
    Bench::new(&BenchSpec::laboratory(spec.clone(), seed)).run(&protocol).expect("a protocol")
}

/// The same, as a campaign.
pub fn thesis(spec: &MuscleSpec, levels: &[f64], seed: u64, hz: f64) -> Campaign {
    Campaign::new(recordings(&files(spec, levels, seed, hz)))
}

/// What the bench wrote, as the recordings that come of it.
pub fn recordings(files: &[virtual_bench::recording::Recording]) -> Vec<Recording> {
    let column = |f: &virtual_bench::recording::Recording, of: fn(&virtual_bench::recording::Row) -> f64| {
        f.rows.iter().map(of).collect::<Vec<f64>>()
    };
    files
        .iter()
        .map(|f| Recording {
            name: f.name.clone(),
            time: column(f, |r| r.time),
            pressure: column(f, |r| r.pressure),
            stroke: column(f, |r| r.stroke),
            force: Some(column(f, |r| r.force)),
            ..Recording::default()
        })
        .collect()
}
