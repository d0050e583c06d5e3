//! How long the solutions take that other programs are compared with: `cargo run --release -p pam-fit --example fit_speed POINTS.csv`.
//!
//! POINTS.csv has `pressure_Pa,stroke_m,force_N`, as tests/benchmarks/fit.py writes it: mid-lines of the thesis's miniature muscle.
//! Prints microseconds as JSON: `separate_us` for the very problem of the thesis (each pressure alone, `P0` given, errors
//! relative to the force), `joint_us` for all pressures together with `P0`; both from strokes to moduli. `separate` has the moduli
//! of every pressure in MPa, so that they can be compared.

use std::time::Instant;

use model_core::braid::miniature;
use pam_fit::Smoothing;
use pam_fit::moduli_at_one_pressure;
use pam_fit::{Design, Measured};
use serde_json::json;

/// `P0` of the benchmark's muscle, Pa.
const DEADBAND: f64 = 76.5e3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("name the file of points")?;
    let text = std::fs::read_to_string(path)?;
    let mut points = Vec::new();
    for line in text.lines().skip(1) {
        let cells = line.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        if let [pressure, stroke, force] = cells[..] {
            points.push(Measured { pressure, stroke, direction: 0.0, force });
        }
    }
    let braid = miniature().build()?;
    let weight = |p: &Measured| 1.0 / p.force.powi(2).max(1.0);
    let separate = || -> Vec<Vec<f64>> {
        let levels = points.chunk_by(|a, b| a.pressure == b.pressure);
        levels
            .map(|of| {
                let weights: Vec<f64> = of.iter().map(weight).collect();
                moduli_at_one_pressure(of, &weights, &braid, DEADBAND, 4)
            })
            .collect()
    };
    let joint = || {
        let design = Design::at_levels(&points, &braid, 4, false);
        let weights: Vec<f64> = points.iter().map(weight).collect();
        let mut parameters = design.start(50e3);
        let data = design.normal(&parameters, &weights);
        let penalty = design.penalty(&data, Smoothing::START.elastic, Smoothing::START.friction);
        design.solve(&mut parameters, &weights, &penalty, 10);
        let square: f64 = design.residuals(&parameters).iter().map(|r| r * r).sum();
        (parameters[0], (square / points.len() as f64).sqrt())
    };
    let moduli: Vec<Vec<f64>> = separate().iter().map(|e| e.iter().map(|e| e * 1e-6).collect()).collect();
    let (deadband, rms) = joint();
    let result = json!({
        "separate_us": best(separate),
        "joint_us": best(joint),
        "separate": moduli,
        "deadband_Pa": deadband,
        "rms_N": rms,
        "points": points.len(),
    });
    println!("{result}");
    Ok(())
}

/// Microseconds of the quickest of many calls: whatever else the machine does only adds.
fn best<T>(call: impl Fn() -> T) -> f64 {
    let each = (0..500).map(|_| {
        let start = Instant::now();
        std::hint::black_box(call());
        start.elapsed().as_secs_f64() * 1e6
    });
    each.fold(f64::INFINITY, f64::min)
}
