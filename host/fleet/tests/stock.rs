//! The fit beside a stock on muscles of the virtual bench: error on pressures that were not recorded, and calibrated bands.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_data::statistics::NORMAL_95;
use pam_fit::confidence_band::ConfidenceBand;
use pam_fit::predict::predict;
use pam_fit::table_file::{About, TableFile};
use pam_fit::{Options, fit};
use pam_fleet::stock::stock_fit;
use serde_json::json;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::presets;
use virtual_bench::rng::Rng;

/// A muscle of the stock: made like the miniature one, with the tolerances of a workshop.
fn specimen(seed: u64) -> MuscleSpec {
    let mut rng = Rng::new(seed);
    let mut spec = presets::miniature();
    // What a maker does not control: the wall, the gap between bladder and braid, the braid's friction.
    spec.geometry.wall *= 1.0 + 0.04 * rng.normal();
    let gap = spec.deadband.gap * (1.0 + 0.05 * rng.normal());
    spec.deadband.gap = gap;
    scale_friction(&mut spec, 1.0 + 0.08 * rng.normal());
    spec
}

fn scale_friction(spec: &mut MuscleSpec, factor: f64) {
    spec.friction.factor.iter_mut().for_each(|(_, k_f)| *k_f *= factor);
}

fn campaign(spec: &MuscleSpec, levels: &[f64], seed: u64) -> Campaign {
    let mut protocol = campaigns::thesis(&Muscle::new(spec.clone()), levels);
    protocol.sample_hz = 4.0;
    let files = Bench::new(&BenchSpec::laboratory(spec.clone(), seed)).run(&protocol).unwrap();
    let recordings = files.iter().map(|f| Recording {
        name: f.name.clone(),
        time: f.rows.iter().map(|r| r.time).collect(),
        pressure: f.rows.iter().map(|r| r.pressure).collect(),
        stroke: f.rows.iter().map(|r| r.stroke).collect(),
        force: Some(f.rows.iter().map(|r| r.force).collect()),
        ..Recording::default()
    });
    Campaign::new(recordings.collect())
}

/// All muscles have the same description: that of the drawing.
fn description() -> MuscleDescription {
    MuscleDescription::parse(&presets::miniature().description()).unwrap()
}

fn file(fitted: &pam_fit::Fit) -> TableFile {
    let about = About { uncertainty: Some(fitted.stored_uncertainty()), ..About::default() };
    TableFile { table: fitted.table.clone(), about }
}

#[test]
fn unseen_pressures_are_predicted_better_than_alone_and_the_bands_hold() {
    let all = presets::miniature_pressures();
    let options = Options::default();
    let muscle = description();
    let kin: Vec<TableFile> = (0..12)
        .map(|i| file(&fit(&campaign(&specimen(100 + i), &all, 1 + i), &muscle, &options).unwrap()))
        .collect();
    let (mut with_square, mut alone_square, mut inside, mut rows) = (0.0, 0.0, 0.0, 0.0);
    for (i, seen) in [[0, 1, 2], [1, 2, 3], [0, 1, 2], [2, 3, 4]].into_iter().enumerate() {
        let spec = specimen(200 + i as u64);
        let levels: Vec<f64> = seen.iter().map(|j| all[*j]).collect();
        let unseen: Vec<f64> = (0..all.len()).filter(|j| !seen.contains(j)).map(|j| all[j]).collect();
        let short = campaign(&spec, &levels, 50 + i as u64);
        let test = campaign(&spec, &unseen, 70 + i as u64);
        let stock = stock_fit(&short, &muscle, &kin, &options).unwrap();
        let rms = |t: &TableFile| predict(t, &test).unwrap().rms.unwrap();
        let about = About { uncertainty: Some(stock.uncertainty.clone()), ..About::default() };
        let with = TableFile { table: stock.table.clone(), about };
        let (a, b) = (rms(&with), rms(&file(&stock.alone)));
        let seen_kpa: Vec<f64> = levels.iter().map(|p| (p / 1e3).round()).collect();
        println!(
            "figures: {}",
            json!({"seen_kPa": seen_kpa, "with_N": a, "alone_N": b, "widened": stock.widened})
        );
        with_square += a * a;
        alone_square += b * b;
        let band = ConfidenceBand::of(&with).unwrap();
        let built = model_core::muscle::Muscle::<f64>::build(&with.table).unwrap();
        for r in &test.recordings {
            // The middle of each loop's branches: reversals are another matter.
            for k in 1..r.len() {
                let v = r.stroke[k] - r.stroke[k - 1];
                let step = r.stroke.iter().fold(0.0_f64, |m, s| m.max(*s)) / 40.0;
                let near_end = r.stroke[k] < 4.0 * step || r.stroke[k] > 36.0 * step;
                if near_end || v == 0.0 {
                    continue;
                }
                let p = model_core::units::Pressure::from_pascals(r.pressure[k]);
                let x = model_core::units::Length::from_metres(r.stroke[k]);
                let model = built.force(p, x, v.signum()).newtons();
                let half = NORMAL_95 * band.reading_std(r.pressure[k], r.stroke[k], v.signum());
                inside += f64::from(u8::from((r.force.as_ref().unwrap()[k] - model).abs() <= half));
                rows += 1.0;
            }
        }
    }
    let ratio = (with_square / alone_square).sqrt();
    println!("figures: {}", json!({"ratio": ratio, "inside_pct": 100.0 * inside / rows}));
    assert!(ratio < 0.5, "{ratio}");
    assert!(inside / rows > 0.88, "{}", inside / rows);
}
