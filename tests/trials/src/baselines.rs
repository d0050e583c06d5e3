//! Simpler ways to answer the same question, on the same recordings: a random choice, the largest gain in BIC, and sparse regression
//! as PySINDy does it (sequentially thresholded least squares, doi 10.1073/pnas.1517384113).
//!
//! Both regressions take the residual of a flexible base (polynomial and friction factor per file) and explain it with
//! columns that are the catalogue's compact equations at fixed shapes.

use crate::answer::recordings;
use crate::generate::TrialTruth;
use crate::ledger::name;
use crate::names::{SINGLES, class};
use nalgebra::{DMatrix, DVector};
use std::path::Path;
use virtual_bench::rng::Rng;

/// A name by chance, the same for each call.
pub fn random(truth: &TrialTruth) -> &'static str {
    let mut r = Rng::stream(truth.id as u64, "guess");
    SINGLES[r.index(SINGLES.len())].0
}

/// Whether a name is right.
pub fn is(truth: &TrialTruth, guess: &str) -> bool {
    truth.effects.iter().any(|e| e.name == guess)
}

/// Whether its class is.
pub fn is_class(truth: &TrialTruth, guess: &str) -> bool {
    truth.effects.iter().any(|e| class(&e.name) == class(guess))
}

/// The columns' names.
pub const LIBRARY: [&str; 15] = [
    "coulomb-friction",
    "pressure-friction",
    "viscous-damping",
    "stribeck-friction",
    "rate-power",
    "stress-relaxation",
    "log-creep",
    "cyclic-softening",
    "thermal-softening",
    "force-drift",
    "sensor-delay",
    "inertia",
    "mullins-softening",
    "presliding-hysteresis",
    "breakaway-friction",
];

struct Memory {
    travel: f64,
    way: f64,
    relaxed: f64,
    held: f64,
    largest: f64,
    turns: f64,
}

/// Residual and library, both with the base taken out, rows downsampled.
fn projected(set: &Path, truth: &TrialTruth) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let force = truth.blocked_force;
    let l0 = truth.bench.muscle.geometry.rest_length;
    let mut residual = Vec::new();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut m = Memory { travel: 0.0, way: 1.0, relaxed: 0.0, held: 0.0, largest: 0.0, turns: 0.0 };
    let mut last_u = 0.0;
    for path in recordings(&set.join("trials").join(name(truth.id))) {
        let text = std::fs::read_to_string(path).ok()?;
        let rows: Vec<[f64; 4]> = text
            .lines()
            .skip(1)
            .filter_map(|l| {
                let v: Vec<f64> = l.split(',').filter_map(|x| x.parse().ok()).collect();
                (v.len() >= 4).then(|| [v[0], v[1] * 1e3, v[2] * 1e-3, v[3]])
            })
            .collect();
        if rows.len() < 60 || rows.iter().all(|r| r[1] < 20e3) {
            continue;
        }
        let (mut base, mut library, mut y) = (Vec::new(), Vec::new(), Vec::new());
        let keep = (rows.len() / 500).max(1);
        for i in 2..rows.len() - 2 {
            let (a, b, r) = (rows[i - 2], rows[i + 2], rows[i]);
            let dt = (b[0] - a[0]).max(1e-6);
            let v = (b[2] - a[2]) / dt;
            let acceleration = (b[2] - 2.0 * r[2] + a[2]) / (0.25 * dt * dt);
            let moving = v.abs() > 1e-5 * l0;
            if moving && v.signum() != m.way {
                (m.way, m.travel) = (v.signum(), 0.0);
                m.turns += 0.5;
            }
            let step = rows[i][0] - rows[i - 1][0];
            m.travel += v.abs() * step;
            m.held = if moving { 0.0 } else { m.held + step };
            let u = r[2] / l0;
            m.relaxed = (m.relaxed + (u - last_u)) * (-step / 30.0).exp();
            last_u = u;
            let new = u > m.largest;
            m.largest = m.largest.max(u);
            if i % keep != 0 {
                continue;
            }
            let (s, f, p) = (m.way, r[3] / force, r[1] / 5e5);
            let slow = 0.02 * l0;
            base.extend([1.0, u, u * u, u.powi(3), u.powi(4), s * f]);
            library.extend([
                -s,
                -s * p,
                -v / l0,
                -s * (-v.abs() / slow).exp(),
                -s * f * (v.abs() / l0).powf(0.3),
                m.relaxed,
                f * (1.0 + r[0] - rows[0][0]).ln(),
                f * (1.0 + m.turns).ln(),
                f * (1.0 - (-r[0] / 600.0).exp()),
                r[0] / 1000.0,
                (b[3] - a[3]) / dt / force,
                acceleration / l0,
                if new { u } else { 0.0 },
                s * f * (-m.travel / (0.01 * l0)).exp(),
                s * (-m.travel / (0.003 * l0)).exp(),
            ]);
            y.push(r[3]);
        }
        let n = y.len();
        if n < 20 {
            continue;
        }
        let base = DMatrix::from_row_slice(n, 6, &base);
        let q = base.qr().q();
        let out = |v: DVector<f64>| &v - &q * (q.transpose() * &v);
        residual.extend(out(DVector::from_vec(y)).iter().copied());
        let library = DMatrix::from_row_slice(n, LIBRARY.len(), &library);
        let all: Vec<DVector<f64>> = library.column_iter().map(|c| out(c.into_owned())).collect();
        for row in 0..n {
            columns.push(all.iter().map(|c| c[row]).collect());
        }
    }
    let flat: Vec<f64> = columns.concat();
    (!residual.is_empty())
        .then(|| (DVector::from_vec(residual), DMatrix::from_row_slice(columns.len(), LIBRARY.len(), &flat)))
}

/// The names of the largest ΔBIC and of the largest term of a sparse regression.
pub fn regress(set: &Path, truth: &TrialTruth) -> Option<(&'static str, &'static str)> {
    let (y, a) = projected(set, truth)?;
    let norms: Vec<f64> = a.column_iter().map(|c| c.norm()).collect();
    let gain = |i: usize| if norms[i] > 1e-9 { (a.column(i).dot(&y) / norms[i]).powi(2) } else { 0.0 };
    let best = (0..LIBRARY.len()).max_by(|&i, &j| gain(i).total_cmp(&gain(j)))?;
    let mut active: Vec<usize> = (0..LIBRARY.len()).filter(|&i| norms[i] > 1e-9).collect();
    let mut weights = vec![0.0; LIBRARY.len()];
    for _ in 0..10 {
        if active.is_empty() {
            break;
        }
        let mut scaled = DMatrix::zeros(y.len(), active.len());
        for (k, &i) in active.iter().enumerate() {
            scaled.set_column(k, &(a.column(i) / norms[i]));
        }
        let x = scaled.svd(true, true).solve(&y, 1e-9).ok()?;
        weights = vec![0.0; LIBRARY.len()];
        for (k, &i) in active.iter().enumerate() {
            weights[i] = x[k];
        }
        let threshold = 0.1 * y.norm();
        let kept: Vec<usize> = active.iter().copied().filter(|&i| weights[i].abs() > threshold).collect();
        if kept.len() == active.len() {
            break;
        }
        active = kept;
    }
    let sparse = active.iter().copied().max_by(|&i, &j| weights[i].abs().total_cmp(&weights[j].abs()));
    Some((LIBRARY[best], sparse.map_or("", |i| LIBRARY[i])))
}
