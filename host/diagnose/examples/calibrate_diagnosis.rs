//! Learns from answered trials with known truths how often a name was right at each model weight.
//!
//! ```text
//! cargo run --release -p pam-diagnose --example calibrate_diagnosis -- SET…
//! ```
//! Each `SET` is a directory as `trials generate` and `trials answer` make it (`answers/ID.json`, `sealed/ID/truth.json`); use development
//! or opened sets only. Fits `p = w^B q`, `logit q = A + C logit(explained)`, by penalised maximum likelihood and prints the constants of
//! `host/diagnose/src/criteria/uncertainty.rs`, with log score and calibration error found by leaving out every fifth trial in turn.

use std::path::Path;
use std::process::ExitCode;

use serde_json::Value;

/// One name that was given.
struct Name {
    trial: usize,
    /// Model weight among its competitors.
    weight: f64,
    /// Logarithm of the odds of the share explained.
    explained: f64,
    right: bool,
}

/// As in `calibration.rs`.
fn within(x: f64) -> f64 {
    x.clamp(0.01, 0.99)
}

fn logit(x: f64) -> f64 {
    (within(x) / (1.0 - within(x))).ln()
}

fn read(path: &Path) -> Option<Value> {
    serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
}

/// The names of all trials of a set.
fn names(set: &Path, first_trial: usize) -> Vec<Name> {
    let mut found = Vec::new();
    let mut answers: Vec<_> = std::fs::read_dir(set.join("answers"))
        .map(|d| {
            d.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "json")).collect()
        })
        .unwrap_or_default();
    answers.sort();
    for (trial, path) in answers.iter().enumerate() {
        let Some(id) = path.file_stem() else { continue };
        let truth = read(&set.join("sealed").join(id).join("truth.json"));
        let (Some(answer), Some(truth)) = (read(path), truth) else { continue };
        let hidden: Vec<&str> =
            truth["effects"].as_array().into_iter().flatten().filter_map(|e| e["name"].as_str()).collect();
        let explained = 1.0 - answer["unexplained"]["share"].as_f64().unwrap_or(1.0);
        for m in answer["missing"].as_array().into_iter().flatten() {
            let (Some(effect), Some(model_weight)) = (m["effect"].as_str(), m["model_weight"].as_f64())
            else {
                continue;
            };
            found.push(Name {
                trial: first_trial + trial,
                weight: within(model_weight),
                explained: logit(explained),
                right: hidden.contains(&effect),
            });
        }
    }
    found
}

/// Probability that the truth is among the competitors, and of this name.
fn probabilities([a, b, c]: &[f64; 3], n: &Name) -> (f64, f64) {
    let among = 1.0 / (1.0 + (-(a + c * n.explained)).exp());
    (among, (n.weight.powf(*b) * among).clamp(1e-4, 1.0 - 1e-4))
}

/// Penalised maximum likelihood by gradient steps; towards the uncalibrated model weight.
fn fit(names: &[&Name]) -> [f64; 3] {
    let prior = [2.0, 1.0, 0.0];
    let mut c = prior;
    let rate = 2.0 / (names.len() as f64 * 12.0 + 2.0);
    for _ in 0..50_000 {
        let mut slope = [0.0; 3];
        for n in names {
            let (among, p) = probabilities(&c, n);
            // Of the log-likelihood against ln p.
            let along = if n.right { 1.0 } else { -p / (1.0 - p) };
            for (s, x) in slope.iter_mut().zip([1.0 - among, n.weight.ln(), (1.0 - among) * n.explained]) {
                *s += along * x;
            }
        }
        for k in 0..3 {
            c[k] += rate * (slope[k] - 2.0 * (c[k] - prior[k]));
        }
    }
    c
}

/// Mean log score and expected calibration error in ten bins.
fn quality(said: &[(f64, bool)]) -> (f64, f64) {
    let mut bins = [[0.0; 2]; 10];
    let mut log = 0.0;
    for (p, right) in said {
        let b = &mut bins[((p * 10.0) as usize).min(9)];
        b[0] += p;
        b[1] += f64::from(u8::from(*right));
        log -= if *right { p.ln() } else { (1.0 - p).ln() };
    }
    let n = said.len().max(1) as f64;
    (log / n, bins.iter().map(|b| (b[0] - b[1]).abs()).sum::<f64>() / n)
}

fn main() -> ExitCode {
    let mut all = Vec::new();
    for set in std::env::args().skip(1) {
        all.extend(names(Path::new(&set), all.len() * 1000));
    }
    if all.len() < 20 {
        eprintln!(
            "calibrate_diagnosis: {} names are too few; give the directories of answered sets",
            all.len()
        );
        return ExitCode::FAILURE;
    }
    let every: Vec<&Name> = all.iter().collect();
    let c = fit(&every);
    let left_out: Vec<(f64, bool)> = (0..5)
        .flat_map(|k| {
            let others: Vec<&Name> = all.iter().filter(|n| n.trial % 5 != k).collect();
            let c = fit(&others);
            all.iter()
                .filter(move |n| n.trial % 5 == k)
                .map(move |n| (probabilities(&c, n).1, n.right))
                .collect::<Vec<_>>()
        })
        .collect();
    let plain: Vec<(f64, bool)> = all.iter().map(|n| (n.weight, n.right)).collect();
    let (log, error) = quality(&left_out);
    let (log_plain, error_plain) = quality(&plain);
    println!("{} names, {} of them right", all.len(), all.iter().filter(|n| n.right).count());
    println!("uncalibrated model weight: log score {log_plain:.3}, calibration error {error_plain:.3}");
    println!("calibrated, on trials left out: log score {log:.3}, calibration error {error:.3}");
    println!("const CALIBRATION: [f64; 3] = [{:.2}, {:.2}, {:.2}];", c[0], c[1], c[2]);
    ExitCode::SUCCESS
}
