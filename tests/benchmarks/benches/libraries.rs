//! Times the libraries on campaigns of the virtual bench: `cargo bench -p benchmarks`.
//!
//! Comparisons with other programs, and their bounds, are in `tests/benchmarks/*.py`.

#![allow(clippy::unwrap_used, reason = "what fails here fails the benchmark")]

use std::hint::black_box;
use std::path::PathBuf;

use benchmarks::Recorded;
use divan::Bencher;
use divan::counter::ItemsCount;
use model_core::muscle::Muscle;
use model_core::table::example;
use model_core::units::{Length, Pressure};
use pam_data::recording::Reader;
use tempfile::TempDir;

/// Sampling rates, Hz: about 3,000 and 30,000 rows.
const RATES: [f64; 2] = [10.0, 100.0];

fn main() {
    divan::main();
}

fn recorded(sample_hz: f64) -> (TempDir, Recorded) {
    let folder = tempfile::tempdir().unwrap();
    let recorded = Recorded::new(sample_hz, folder.path()).unwrap();
    (folder, recorded)
}

#[divan::bench(args = RATES)]
fn read(bencher: Bencher, sample_hz: f64) {
    let (folder, recorded) = recorded(sample_hz);
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    bencher
        .counter(ItemsCount::new(recorded.campaign.samples()))
        .bench(|| Reader::new().campaign(black_box(&files)).unwrap());
}

#[divan::bench(args = RATES)]
fn fit(bencher: Bencher, sample_hz: f64) {
    let (_folder, recorded) = recorded(sample_hz);
    let options = pam_fit::Options::default();
    bencher
        .counter(ItemsCount::new(recorded.campaign.samples()))
        .bench(|| pam_fit::fit(black_box(&recorded.campaign), &recorded.muscle, &options).unwrap());
}

#[divan::bench(args = [RATES[0]], sample_count = 10)]
fn diagnose(bencher: Bencher, sample_hz: f64) {
    let (_folder, recorded) = recorded(sample_hz);
    let (geometry, options) = (recorded.muscle.geometry(), pam_diagnose::Options::default());
    bencher
        .counter(ItemsCount::new(recorded.campaign.samples()))
        .bench(|| pam_diagnose::diagnose(black_box(&recorded.campaign), &geometry, &options).unwrap());
}

#[divan::bench]
fn force(bencher: Bencher) {
    let muscle = Muscle::<f32>::build(&example()).unwrap();
    let (pressure, stroke) = (Pressure::from_pascals(400e3), Length::from_metres(1e-3));
    bencher.bench(|| muscle.force(black_box(pressure), black_box(stroke), 1.0));
}
