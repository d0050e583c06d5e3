//! Changes put into rows by slopes that the recordings themselves give; no equation of the model.

use sha2::{Digest, Sha256};

use super::staircases::Run;

/// What is put in.
pub const EFFECTS: [&str; 12] = [
    "force-offset",
    "force-gain",
    "gauge-gain",
    "gauge-offset",
    "cross-talk",
    "displacement-offset",
    "coulomb-friction",
    "force-drift",
    "rig-compliance",
    "end-slip",
    "sensor-delay",
    "pressure-sensor-lag",
];
/// Those of them that grow, come in the middle, or shift a channel in time: the others are there from one reading to the next.
const OVER_TIME: [&str; 4] = ["force-drift", "end-slip", "sensor-delay", "pressure-sensor-lag"];
const NODES: usize = 65;
/// Pa: ends of the curves and width of their kernel.
const ENDS: (f64, f64) = (5e3, 645e3);
const WIDTH: f64 = 20e3;
/// s: longest lag put in.
const LONGEST: f64 = 2.0;

/// The effects that are there from one reading to the next.
pub fn immediate() -> impl Iterator<Item = &'static str> {
    EFFECTS.into_iter().filter(|effect| !OVER_TIME.contains(effect))
}

/// Mean curves of all runs of a muscle, for the slopes.
pub struct Slopes {
    by_pressure: Vec<Vec<f64>>,
    by_stroke: Vec<Vec<f64>>,
    largest: f64,
}

fn node(i: usize) -> f64 {
    ENDS.0 + (ENDS.1 - ENDS.0) * i as f64 / (NODES - 1) as f64
}

impl Slopes {
    /// Local lines by mounting, and a monotone piecewise cubic over the mountings.
    pub fn of(runs: &[Run]) -> Self {
        let mountings = runs.iter().map(|r| r.mounting).max().map_or(0, |m| m + 1);
        let mut strokes = vec![0.0; mountings];
        runs.iter().for_each(|r| strokes[r.mounting] = r.stroke);
        let curves: Vec<Vec<f64>> =
            (0..mountings).map(|m| curve(runs.iter().filter(|r| r.mounting == m))).collect();
        let step = node(1) - node(0);
        let gradient = |c: &Vec<f64>| {
            (0..NODES)
                .map(|i| {
                    let (a, b) = (i.saturating_sub(1), (i + 1).min(NODES - 1));
                    (c[b] - c[a]) / ((b - a) as f64 * step)
                })
                .collect()
        };
        let mut by_stroke = vec![vec![0.0; NODES]; mountings];
        for i in 0..NODES {
            let y: Vec<f64> = curves.iter().map(|c| c[i]).collect();
            for (m, s) in monotone(&strokes, &y).into_iter().enumerate() {
                by_stroke[m][i] = s;
            }
        }
        let largest = runs.iter().flat_map(|r| r.force.iter().copied()).fold(0.0, f64::max);
        Self { by_pressure: curves.iter().map(gradient).collect(), by_stroke, largest }
    }

    /// Largest force, N.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// N/Pa at a mounting and a pressure.
    pub fn by_pressure(&self, mounting: usize, pressure: f64) -> f64 {
        Self::at(&self.by_pressure[mounting], pressure)
    }

    fn at(table: &[f64], pressure: f64) -> f64 {
        let z = ((pressure - ENDS.0) / (ENDS.1 - ENDS.0) * (NODES - 1) as f64).clamp(0.0, (NODES - 1) as f64);
        let i = (z as usize).min(NODES - 2);
        let v = z - i as f64;
        table[i] * (1.0 - v) + table[i + 1] * v
    }
}

fn curve<'a>(runs: impl Iterator<Item = &'a Run> + Clone) -> Vec<f64> {
    (0..NODES)
        .map(|i| {
            let g = node(i);
            let mut s = [0.0; 5];
            for r in runs.clone() {
                for (p, f) in r.pressure.iter().zip(&r.force) {
                    let d = p - g;
                    let k = (-0.5 * (d / WIDTH).powi(2)).exp() + 1e-9;
                    for (to, v) in s.iter_mut().zip([k, k * d, k * d * d, k * f, k * d * f]) {
                        *to += v;
                    }
                }
            }
            (s[2] * s[3] - s[1] * s[4]) / (s[0] * s[2] - s[1] * s[1])
        })
        .collect()
}

/// Slopes of a monotone piecewise cubic; written apart from the one that is tried.
fn monotone(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    if n < 2 {
        return vec![0.0; n];
    }
    let d: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / (x[i + 1] - x[i])).collect();
    if n == 2 {
        return vec![d[0]; 2];
    }
    let h: Vec<f64> = (0..n - 1).map(|i| x[i + 1] - x[i]).collect();
    let edge = |h0: f64, h1: f64, d0: f64, d1: f64| {
        let s = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
        match () {
            () if s.signum() != d0.signum() => 0.0,
            () if d0.signum() != d1.signum() && s.abs() > 3.0 * d0.abs() => 3.0 * d0,
            () => s,
        }
    };
    let mut s = vec![edge(h[0], h[1], d[0], d[1])];
    for i in 1..n - 1 {
        let (w0, w1) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
        s.push(if d[i - 1] * d[i] > 0.0 { (w0 + w1) / (w0 / d[i - 1] + w1 / d[i]) } else { 0.0 });
    }
    s.push(edge(h[n - 2], h[n - 3], d[n - 2], d[n - 3]));
    s
}

/// Which way the pressure goes, for friction: reversals at a twentieth of the range.
pub fn ways(pressure: &[f64]) -> Vec<f64> {
    let top = pressure.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let bottom = pressure.iter().copied().fold(f64::INFINITY, f64::min);
    let limit = 0.05 * (top - bottom);
    let mut way = vec![1.0; pressure.len()];
    let (mut sign, mut start, mut high, mut low) = (1.0, 0, (0, f64::NEG_INFINITY), (0, f64::INFINITY));
    for (i, &p) in pressure.iter().enumerate() {
        if p >= high.1 {
            high = (i, p);
        }
        if p <= low.1 {
            low = (i, p);
        }
        let turned = if sign > 0.0 { high.1 - p > limit } else { p - low.1 > limit };
        if turned {
            let end = if sign > 0.0 { high.0 } else { low.0 };
            way[start..=end].fill(sign);
            (start, sign, high, low) = (end + 1, -sign, (i, p), (i, p));
        }
    }
    way[start..].fill(sign);
    way
}

/// Exact for piecewise linear input.
fn slowed(time: &[f64], values: &[f64], lag: f64) -> Vec<f64> {
    let mut out = vec![values[0]];
    for i in 1..values.len() {
        let h = time[i] - time[i - 1];
        let s = (values[i] - values[i - 1]) / h;
        let rest = out[i - 1] - (values[i - 1] - s * lag);
        out.push(values[i] - s * lag + rest * (-h / lag).exp());
    }
    out
}

fn interpolated(time: &[f64], values: &[f64], at: f64) -> f64 {
    let i = time.partition_point(|t| *t <= at);
    if i == 0 {
        return values[0];
    }
    if i == time.len() {
        return values[i - 1];
    }
    values[i - 1] + (values[i] - values[i - 1]) * (at - time[i - 1]) / (time[i] - time[i - 1])
}

/// What a change of size `a` adds to pressure and force of a run that begins at `start` of `total` seconds.
fn change(
    effect: &str,
    a: f64,
    run: &Run,
    slopes: &Slopes,
    (start, total, moment): (f64, f64, f64),
) -> (Vec<f64>, Vec<f64>) {
    let n = run.time.len();
    let by_stroke = |i: usize| Slopes::at(&slopes.by_stroke[run.mounting], run.pressure[i]);
    let clock = |i: usize| (start + run.time[i]) / total;
    let each = |of: &dyn Fn(usize) -> f64| (0..n).map(of).collect::<Vec<f64>>();
    let none = vec![0.0; n];
    match effect {
        "force-offset" => (none, vec![a; n]),
        "force-gain" => (none, each(&|i| a * run.force[i])),
        "gauge-gain" => (each(&|i| a * run.pressure[i]), none),
        "gauge-offset" => (vec![a; n], none),
        "cross-talk" => (none, each(&|i| a * run.pressure[i])),
        "displacement-offset" => (none, each(&|i| a * by_stroke(i))),
        "coulomb-friction" => {
            let ways = ways(&run.pressure);
            (none, each(&|i| -a * ways[i]))
        }
        "force-drift" => (none, each(&|i| a * clock(i))),
        "rig-compliance" => (none, each(&|i| a * run.force[i] * by_stroke(i))),
        "end-slip" => (none, each(&|i| if clock(i) > moment { a * by_stroke(i) } else { 0.0 })),
        "sensor-delay" => {
            (none, each(&|i| interpolated(&run.time, &run.force, run.time[i] - a) - run.force[i]))
        }
        _ => {
            let slow = slowed(&run.time, &run.pressure, a.max(1e-6));
            (each(&|i| slow[i] - run.pressure[i]), none)
        }
    }
}

/// What a change of unit size adds to the force of each row of each run, N, its pressure's share by the slope; lags of 0.1 s.
pub fn added(runs: &[Run], effect: &str, slopes: &Slopes, moment: f64) -> Vec<Vec<f64>> {
    let total: f64 = runs.iter().map(|r| r.time.last().copied().unwrap_or(0.0)).sum();
    let a = if matches!(effect, "sensor-delay" | "pressure-sensor-lag") { 0.1 } else { 1.0 };
    let mut elapsed = 0.0;
    let mut all = Vec::new();
    for run in runs {
        let (dp, df) = change(effect, a, run, slopes, (elapsed, total, moment));
        elapsed += run.time.last().copied().unwrap_or(0.0);
        let by_pressure = &slopes.by_pressure[run.mounting];
        let one = |i: usize| df[i] - dp[i] * Slopes::at(by_pressure, run.pressure[i]);
        all.push((0..run.time.len()).map(one).collect());
    }
    all
}

/// Puts a change into runs: its force is `percent` of the largest rms. Gives the runs and the size, SI.
pub fn inject(
    runs: &[Run],
    effect: &'static str,
    percent: f64,
    slopes: &Slopes,
    muscle: &str,
    split: usize,
    moment: f64,
) -> (Vec<Run>, f64) {
    let goal = percent / 100.0 * slopes.largest;
    let total: f64 = runs.iter().map(|r| r.time.last().copied().unwrap_or(0.0)).sum();
    let mut starts = Vec::new();
    let mut elapsed = 0.0;
    for r in runs {
        starts.push(elapsed);
        elapsed += r.time.last().copied().unwrap_or(0.0);
    }
    let of = |a: f64, k: usize| change(effect, a, &runs[k], slopes, (starts[k], total, moment));
    let rms = |a: f64| {
        let (mut square, mut count) = (0.0, 0.0);
        for (k, run) in runs.iter().enumerate() {
            let (dp, df) = of(a, k);
            for i in 0..run.time.len() {
                let e = df[i] - dp[i] * Slopes::at(&slopes.by_pressure[run.mounting], run.pressure[i]);
                square += e * e;
                count += 1.0;
            }
        }
        f64::sqrt(square / count)
    };
    let lag = matches!(effect, "sensor-delay" | "pressure-sensor-lag");
    let mut size = match effect {
        "force-offset" | "coulomb-friction" | "force-drift" => 1.0,
        "force-gain" | "gauge-gain" => 0.01,
        "gauge-offset" => 1e3,
        "cross-talk" => 1e-5,
        "rig-compliance" => 1e-6,
        "displacement-offset" | "end-slip" => 1e-4,
        _ => 0.02,
    };
    for _ in 0..if lag { 12 } else { 2 } {
        size *= (goal / rms(size)).powf(if lag { 1.2 } else { 1.0 });
        if lag {
            size = f64::min(size, LONGEST);
        }
    }
    let positive = lag || matches!(effect, "coulomb-friction" | "rig-compliance");
    let seed = Sha256::digest(format!("{muscle}|{split}|{effect}|{percent}"));
    if !positive && seed[0] & 1 == 1 {
        size = -size;
    }
    let changed = runs.iter().enumerate().map(|(k, run)| {
        let (dp, df) = of(size, k);
        let mut run = run.clone();
        run.pressure.iter_mut().zip(dp).for_each(|(p, d)| *p += d);
        run.force.iter_mut().zip(df).for_each(|(f, d)| *f += d);
        run
    });
    (changed.collect(), size)
}
