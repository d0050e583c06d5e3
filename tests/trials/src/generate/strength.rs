//! How strong the effects of a trial have to be to have the size that it requires.

use crate::inject::{Injection, Parameter, Scale};
use crate::spec::{Size, Spec};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::Muscle;
use virtual_bench::pneumatics::Pneumatics;
use virtual_bench::protocol::Protocol;
use virtual_bench::recording::Row;
use virtual_bench::sensors::Sensor;
use virtual_bench::tube::Geometry;

use super::protocol_of;

/// What the search for the strength of the effects gives.
pub(super) struct Sized {
    pub scale: Scale,
    pub protocol: Protocol,
    pub levels: Vec<f64>,
    pub speed: f64,
    /// Rows of the silent bench without the effects; empty where there are none.
    pub without: Vec<Vec<Row>>,
    /// The bench with its effects.
    pub bench: BenchSpec,
    /// Peak of each effect as a part of the blocked force, what it adds to each row, and its parameters.
    pub effects: Vec<(f64, Vec<f64>, Vec<Parameter>)>,
}

/// Finds how strong the effects of a trial have to be.
pub(super) fn sized(spec: &Spec) -> Sized {
    let muscle = Muscle::new(spec.bench.muscle.clone());
    let levels = campaigns::levels(&muscle);
    let speed = campaigns::slow(&muscle, &levels);
    let protocol = protocol_of(spec, &muscle, &levels);
    let seconds = duration(&protocol, &spec.bench);
    let scale = Scale::new(&muscle, &levels, speed * 1e-3, seconds);
    let geometry = spec.bench.muscle.geometry;
    let quiet = silent(&spec.bench);
    let without = if spec.effects.is_empty() { Vec::new() } else { rows(&quiet, &protocol) };
    let size = |injection: &Injection, s: f64| {
        let mut b = quiet.clone();
        injection.apply(&mut b, &scale, s);
        let with = rows(&b, &protocol);
        let d = difference(&with, &without, &geometry);
        // What shows for a few samples at each reversal only is measured by them.
        let part = if injection.name == "inertia" { 0.9999 } else { 0.995 };
        (quantile(&d, part) / scale.force, d)
    };
    let mut bench = spec.bench.clone();
    let mut effects = Vec::new();
    for (injection, wanted) in &spec.effects {
        let mut s = match wanted {
            Size::Peak(_) => injection.strongest().min(1.0) * 0.5,
            Size::Strength(s) => *s,
        };
        let (mut is, mut d) = size(injection, s);
        // Most effects are straight in their strength; those that are not get there by secants in the logarithm.
        let mut power = 1.0;
        for _ in 0..9 {
            let Size::Peak(wanted) = wanted else { break };
            if is <= 0.0 || (is / wanted - 1.0).abs() < 0.1 {
                break;
            }
            let next =
                (s * (wanted / is).powf(1.0 / power).clamp(0.05, 20.0)).clamp(1e-3, injection.strongest());
            if (next / s - 1.0).abs() < 1e-3 {
                break;
            }
            let before = (s, is);
            (is, d) = size(injection, next);
            s = next;
            if is > 0.0 {
                power = ((is / before.1).ln() / (s / before.0).ln()).clamp(0.7, 4.0);
            }
        }
        let parameters = injection.apply(&mut bench, &scale, s);
        effects.push((is, d, parameters));
    }
    Sized { scale, protocol, levels, speed, without, bench, effects }
}

fn duration(protocol: &Protocol, bench: &BenchSpec) -> f64 {
    let mut quiet = bench.clone();
    quiet.muscle.physics = Default::default();
    let mut b = Bench::new(&quiet);
    // A protocol that was built for the muscle passes its own check.
    let _ = b.run(protocol);
    b.clock()
}

/// The bench with instruments and regulator that add nothing of their own, so that two runs differ by the effect alone.
fn silent(bench: &BenchSpec) -> BenchSpec {
    let mut b = bench.clone();
    let keep = |s: Sensor| Sensor { white: 0.0, coloured: (0.0, 1.0), outliers: (0.0, 0.0), stuck: 0.0, ..s };
    b.instruments.force = keep(b.instruments.force);
    b.instruments.pressure = keep(b.instruments.pressure);
    b.instruments.stroke = keep(b.instruments.stroke);
    b.pneumatics = Pneumatics { ripple: (0.0, 1.0), wander: (0.0, 1.0), deadband: 0.0, ..b.pneumatics };
    b
}

fn rows(bench: &BenchSpec, protocol: &Protocol) -> Vec<Vec<Row>> {
    let run = Bench::new(bench).run(protocol).unwrap_or_default();
    run.into_iter().map(|f| f.rows).collect()
}

/// What an effect does to the force at the same measured pressure and stroke, row by row.
fn difference(with: &[Vec<Row>], without: &[Vec<Row>], g: &Geometry) -> Vec<f64> {
    with.iter()
        .flatten()
        .zip(without.iter().flatten())
        .map(|(a, b)| {
            let area = g.pulling_area(g.rest_length - b.stroke);
            (a.force - b.force) - area * (a.pressure - b.pressure)
        })
        .collect()
}

fn quantile(values: &[f64], q: f64) -> f64 {
    let mut v: Vec<f64> = values.iter().map(|x| x.abs()).filter(|x| x.is_finite()).collect();
    v.sort_by(f64::total_cmp);
    v.get(((v.len() as f64 * q) as usize).min(v.len().saturating_sub(1))).copied().unwrap_or(0.0)
}
