//! Tables as a user gets them: the bench records the thesis's protocol, `host` reads the files and fits.

use std::sync::{Mutex, OnceLock, PoisonError};

use model_core::table::MuscleTable;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Reader;
use pam_fit::{Options, fit};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::MuscleSpec;
use virtual_bench::recording::Columns;

use crate::machine::Folder;

/// Pressures of the thesis's test for a muscle, Pa.
pub fn pressures(spec: &MuscleSpec) -> Vec<f64> {
    if spec.geometry.rest_length < 0.08 {
        virtual_bench::presets::miniature_pressures()
    } else {
        virtual_bench::presets::large_pressures()
    }
}

/// The table of a muscle, fitted to recordings of the thesis's protocol with instruments of their own seed. Fitted once a
/// process for each muscle.
///
/// # Panics
/// When a step of the way fails.
pub fn fitted(spec: &MuscleSpec) -> MuscleTable {
    static KNOWN: OnceLock<Mutex<Vec<(MuscleSpec, MuscleTable)>>> = OnceLock::new();
    let mut known = KNOWN.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, table)) = known.iter().find(|(muscle, _)| muscle == spec) {
        return table.clone();
    }
    let mut bench = Bench::new(&BenchSpec::laboratory(spec.clone(), 20_121));
    let protocol = campaigns::thesis(bench.muscle(), &pressures(spec));
    let recordings = bench.run(&protocol).expect("the bench records");
    let folder = Folder::new();
    let files: Vec<_> = recordings
        .iter()
        .enumerate()
        .map(|(n, recording)| {
            let path = folder.path().join(format!("{n:02}.csv"));
            std::fs::write(&path, recording.csv(Columns::default())).expect("a file");
            path
        })
        .collect();
    let muscle = MuscleDescription::parse(&spec.description()).expect("a description");
    let campaign = Reader::of(&muscle).campaign(&files).expect("recordings");
    let table = fit(&campaign, &muscle, &Options::default()).expect("a fit").table;
    known.push((spec.clone(), table.clone()));
    table
}
