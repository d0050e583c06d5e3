//! How long the solutions take that other programs are compared with: `cargo run --release --example fit_speed POINTS.csv`.
//!
//! POINTS.csv has `pressure_Pa,stroke_m,force_N`, as tests/benchmarks/fit.py writes it. Prints microseconds as JSON.

use std::time::Instant;

use host::fit::basis::{Orthonormal, PressureBasis, columns};
use host::fit::joint::{Bin, Design, Row};
use host::fit::smoothing::Smoothing;
use model_core::braid::miniature;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("name the file of points")?;
    let text = std::fs::read_to_string(path)?;
    let mut points = Vec::new();
    for line in text.lines().skip(1) {
        let cells = line.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        if let [p, x, f] = cells[..] {
            points.push((p, x, f));
        }
    }
    let braid = miniature().build()?;
    let solve = || {
        let mut levels: Vec<f64> = points.iter().map(|p| p.0).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let basis = PressureBasis::new(&levels);
        let all: Vec<_> = points.iter().map(|p| columns(&braid, p.1)).collect();
        let orthonormal = Orthonormal::over(&all, 4);
        let bin = |p: f64| levels.iter().position(|l| *l == p).unwrap_or(0) as u32;
        let rows = points
            .iter()
            .zip(&all)
            .map(|((p, _, f), c)| Row {
                pressure: *p,
                area: c.area,
                elastic: orthonormal.apply(c),
                direction: 0.0,
                force: *f,
                bin: bin(*p),
            })
            .collect();
        let bins =
            levels.iter().enumerate().map(|(g, p)| Bin { phi: basis.at(*p), group: g as u32 }).collect();
        let design = Design {
            basis,
            orthonormal,
            rows,
            bins,
            groups: levels.len(),
            extra: Vec::new(),
            extras: 0,
            extra_prior: Vec::new(),
            friction: false,
            origin: 0.0,
            hold_deadband: 0.0,
            held: None,
            level: 0.0,
        };
        let weights: Vec<f64> = points.iter().map(|p| 1.0 / p.2.powi(2).max(1.0)).collect();
        let mut parameters = design.start(50e3);
        let data = design.normal(&parameters, &weights);
        let penalty = design.penalty(&data, Smoothing::START.elastic, Smoothing::START.friction);
        design.solve(&mut parameters, &weights, &penalty, 10);
        let rms =
            (design.residuals(&parameters).iter().map(|r| r * r).sum::<f64>() / points.len() as f64).sqrt();
        (parameters[0], rms)
    };
    let (deadband, rms) = solve();
    let repeats = 200;
    let start = Instant::now();
    for _ in 0..repeats {
        std::hint::black_box(solve());
    }
    let each = start.elapsed().as_secs_f64() / f64::from(repeats) * 1e6;
    println!(
        "{{\"joint_us\": {each:.1}, \"deadband_Pa\": {deadband:.1}, \"rms_N\": {rms:.5}, \"points\": {}}}",
        points.len()
    );
    Ok(())
}
