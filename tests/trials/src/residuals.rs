//! Noise from real recordings: residuals of settled points about a smooth curve, resampled in blocks.
//!
//! The recordings are the settled points of two sets of isometric pressure staircases (half a second apart). In each run and
//! direction the force is fitted by a cubic in pressure; the residual is coloured, not normal, and not synthetic.

use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use std::path::Path;
use virtual_bench::rng::Rng;

/// Residual series of unit deviation.
#[derive(Debug, Clone, Default)]
pub struct Residuals {
    runs: Vec<Vec<f64>>,
}

/// Seconds between settled points.
const PITCH: f64 = 0.5;
/// Below this force a muscle may hang slack, N.
const TAUT: f64 = 20.0;

impl Residuals {
    /// Read what there is below a directory of real recordings; empty where nothing is.
    pub fn read(data: &Path) -> Self {
        let mut runs = Vec::new();
        for set in ["aarl-festo-10mm-2022", "aarl-festo-10mm-2021"] {
            let Ok(text) = std::fs::read_to_string(data.join(set).join("settled_points.csv")) else {
                continue;
            };
            runs.extend(of_table(&text));
        }
        Self { runs }
    }

    /// Whether there is nothing to resample.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// `n` values at `rate` (Hz): blocks of three to eight seconds from runs drawn at random, either sign, straight between points.
    pub fn series(&self, n: usize, rate: f64, r: &mut Rng) -> Vec<f64> {
        let needed = (n as f64 / rate / PITCH) as usize + 3;
        let mut points = Vec::with_capacity(needed + 16);
        while points.len() < needed && !self.runs.is_empty() {
            let run = &self.runs[r.index(self.runs.len())];
            let length = (6 + r.index(11)).min(run.len());
            let start = r.index(run.len() - length + 1);
            let sign = if r.chance(0.5) { 1.0 } else { -1.0 };
            points.extend(run[start..start + length].iter().map(|v| sign * v));
        }
        (0..n)
            .map(|i| {
                let at = i as f64 / rate / PITCH;
                let (k, part) = (at as usize, at.fract());
                match (points.get(k), points.get(k + 1)) {
                    (Some(a), Some(b)) => a + (b - a) * part,
                    _ => 0.0,
                }
            })
            .collect()
    }
}

fn of_table(text: &str) -> Vec<Vec<f64>> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let at = |name: &str| header.iter().position(|c| *c == name);
    let (Some(p), Some(f)) = (at("pressure_kPa"), at("force_N")) else { return Vec::new() };
    // Unmeasured quantities differ between runs.
    let keys: Vec<usize> = ["rest_length_mm", "mounted_length_mm", "contraction", "run", "direction"]
        .iter()
        .filter_map(|n| at(n))
        .collect();
    let mut runs: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells.get(i).and_then(|c| c.parse::<f64>().ok());
        if let (Some(p), Some(f)) = (number(p), number(f))
            && f > TAUT
        {
            let key: Vec<&str> = keys.iter().filter_map(|&k| cells.get(k).copied()).collect();
            runs.entry(key.join(",")).or_default().push((p / 500.0, f));
        }
    }
    runs.into_values().filter(|points| points.len() >= 10).filter_map(|points| left(&points)).collect()
}

/// What a cubic leaves of a run, to unit deviation; single points beyond six deviations are cut there.
fn left(points: &[(f64, f64)]) -> Option<Vec<f64>> {
    let a = DMatrix::from_fn(points.len(), 4, |i, j| points[i].0.powi(j as i32));
    let y = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
    let x = a.clone().svd(true, true).solve(&y, 1e-9).ok()?;
    let rest = y - a * x;
    let deviation = (rest.norm_squared() / points.len() as f64).sqrt();
    (deviation > 1e-6).then(|| rest.iter().map(|v| (v / deviation).clamp(-6.0, 6.0)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_leaves_its_noise_and_series_keep_its_size() {
        let mut text = String::from("rest_length_mm,run,direction,pressure_kPa,force_N\n");
        let mut r = Rng::new(4);
        for run in 0..6 {
            for i in 0..30 {
                let p = 100.0 + 18.0 * f64::from(i);
                text += &format!("100,{run},up,{p},{}\n", 50.0 + 0.4 * p + 0.3 * r.normal());
            }
        }
        let residuals = Residuals { runs: of_table(&text) };
        assert_eq!(residuals.runs.len(), 6);
        let s = residuals.series(20_000, 10.0, &mut r);
        let var = s.iter().map(|v| v * v).sum::<f64>() / s.len() as f64;
        // Straight lines between points take a third of the variance away.
        assert!((0.5..0.9).contains(&var), "{var}");
        assert!(Residuals::read(Path::new("/nowhere")).is_empty());
    }
}
