//! Making a trial: the campaign with its effects, its twin without, held-out recordings, and the sealed truth.

use crate::inject::{Injection, Parameter, Scale};
use crate::residuals::Residuals;
use crate::spec::{Operator, Size, Spec, Stratum};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::checks::{self, Check};
use virtual_bench::friction::BraidFriction;
use virtual_bench::muscle::Muscle;
use virtual_bench::pneumatics::Pneumatics;
use virtual_bench::protocol::{Place, Protocol, Step};
use virtual_bench::recording::{Recording, Row};
use virtual_bench::rng::Rng;
use virtual_bench::sensors::Sensor;
use virtual_bench::tube::Geometry;

/// One injected effect, as it is in the sealed truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrueEffect {
    /// Name in the catalogue, or of a mechanism outside it.
    pub name: String,
    /// Peak (99.5 % quantile) of the raw effect over the campaign, percent of the blocked force at the highest level.
    pub amplitude_pct: f64,
    /// What of it is left, rms in N, after a flexible base (polynomial and friction free per level) is refitted.
    #[serde(rename = "left_flexible_N")]
    pub left_flexible: f64,
    /// The same after a stiff base (one polynomial for all levels).
    #[serde(rename = "left_stiff_N")]
    pub left_stiff: f64,
    /// Its parameters, where one number says it.
    pub parameters: Vec<Parameter>,
}

/// What is sealed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialTruth {
    /// Number in the set.
    pub id: usize,
    /// What the trial is for.
    pub stratum: Stratum,
    /// Protocol of the campaign.
    pub protocol: String,
    /// What is hidden.
    pub effects: Vec<TrueEffect>,
    /// For a decoy, what it looks like.
    pub looks_like: Option<String>,
    /// Standard deviation of the force's noise, N, and its correlation time, s.
    #[serde(rename = "noise_N")]
    pub noise: f64,
    /// Correlation time of the coloured part, s.
    pub noise_time_s: f64,
    /// Where the coloured part comes from: `synthetic`, or `real residuals`.
    #[serde(default)]
    pub noise_source: String,
    /// What the person at the bench did wrong.
    #[serde(default)]
    pub operator: Operator,
    /// Blocked force at the highest level, N.
    #[serde(rename = "blocked_force_N")]
    pub blocked_force: f64,
    /// The muscle and its bench in full.
    pub bench: BenchSpec,
    /// Salt, so that the hash cannot be found from a likely truth.
    pub salt: String,
}

/// A trial, made.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Muscle description as an engineer would measure it.
    pub description: String,
    /// The campaign.
    pub recordings: Vec<Recording>,
    /// Held-out recordings, sealed until the answers are frozen; they follow the campaign.
    pub held_out: Vec<Recording>,
    /// Campaign and held-out recordings of the twin muscle without the effect.
    pub twin: (Vec<Recording>, Vec<Recording>),
    /// Where what is hidden is, as a table.
    pub trace: String,
    /// Checks of the bench without its muscle, where the protocol has them.
    pub checks: Vec<Check>,
    /// The sealed truth.
    pub truth: TrialTruth,
}

/// The same protocol with every position in mm, taken from the muscle without effects: the crosshead's course must not
/// depend on what is hidden.
fn in_millimetres(mut protocol: Protocol, muscle: &Muscle) -> Protocol {
    let mut pressure = 0.0;
    for step in &mut protocol.step {
        match step {
            Step::Pressure { to_kpa, .. } => pressure = *to_kpa * 1e3,
            Step::Tare { .. } | Step::Rest { .. } => pressure = 0.0,
            Step::Move { to, .. } | Step::Cycles { to, .. } => {
                if let Some(part) = to.free.take() {
                    to.mm = Some(part * muscle.free_stroke(pressure) * 1e3);
                }
            }
            _ => {}
        }
    }
    protocol
}

/// Two levels that the campaign did not have, at another speed, after everything else.
fn held_out_protocol(levels: &[f64], speed: f64) -> Protocol {
    let between = |i: usize| 0.5 * (levels[i] + levels[i + 1]);
    let mut step = Vec::new();
    for (n, &p) in [between(3), between(1)].iter().enumerate() {
        let loops = |count, speed_mm_s| Step::Cycles { to: Place::free(1.0), speed_mm_s, count };
        step.push(Step::Pressure { to_kpa: p * 1e-3, rate_kpa_s: Some(50.0), settle_s: 2.0 });
        step.push(Step::File { name: format!("held_out_{}", n + 1) });
        step.extend([loops(1, speed), loops(2, 2.0 * speed), Step::EndFile]);
    }
    Protocol { name: "held-out".into(), sample_hz: 10.0, step }
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

/// A base to refit: its scales, and whether it is flexible.
#[derive(Debug, Clone, Copy)]
struct Base<'a> {
    stroke: f64,
    force: f64,
    geometry: Geometry,
    friction: &'a BraidFriction,
    flexible: bool,
    /// Whether friction follows what the base changes in the core force.
    rubs: bool,
}

/// Columns of the stiff base.
const STIFF: usize = 13;

impl Base<'_> {
    fn columns(&self) -> usize {
        if self.flexible { 6 } else { STIFF }
    }

    /// Columns at one row. The flexible base has its own set per file. The stiff one shares a larger set: whatever depends on
    /// the stroke alone could be the bladder's energy, so that is given every freedom, in stroke and in radius; then the
    /// deadband, and friction straight in the pressure.
    fn row(&self, r: &Row, way: f64) -> Vec<f64> {
        let (u, f) = (r.stroke / self.stroke, r.force / self.force);
        let g = &self.geometry;
        // What changes the core force changes the friction with it.
        let rubbed = if self.rubs { 1.0 - way * self.friction.factor(r.pressure) } else { 1.0 };
        let mut row =
            vec![rubbed, rubbed * u, rubbed * u * u, rubbed * u.powi(3), rubbed * u.powi(4), way * f];
        if !self.flexible {
            let q = g.braid_radius(g.rest_length - r.stroke) / g.radius - 1.0;
            row[0] *= g.pulling_area(g.rest_length - r.stroke) * 1e6;
            row.extend([u.powi(6), q, q * q, q.powi(3), q.powi(4)].map(|c| rubbed * c));
            row.extend([1, 2].map(|power| way * f * (r.pressure / 5e5).powi(power)));
        }
        row
    }
}

/// The residual of a difference after a base is refitted, row by row and file by file; vented files are left out of the
/// fit and have nothing left.
fn left(difference: &[f64], files: &[Vec<Row>], base: Base<'_>) -> Vec<Vec<f64>> {
    let (columns, flexible) = (base.columns(), base.flexible);
    let way = |file: &[Row], i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(file.len() - 1));
        (file[b].stroke - file[a].stroke).signum()
    };
    let mut normal = DMatrix::<f64>::zeros(columns, columns);
    let mut rhs = DVector::<f64>::zeros(columns);
    let mut at = 0;
    let mut starts = Vec::new();
    let mut solutions: Vec<Option<DVector<f64>>> = Vec::new();
    let solve = |a: &DMatrix<f64>, y: &DVector<f64>| a.clone().svd(true, true).solve(y, 1e-12).ok();
    for file in files {
        starts.push(at);
        if flexible {
            normal.fill(0.0);
            rhs.fill(0.0);
        }
        let pressed = file.iter().map(|r| r.pressure).fold(0.0, f64::max) > 20e3;
        if pressed {
            for i in (0..file.len()).step_by((file.len() / 600).max(1)) {
                let b = DVector::from_vec(base.row(&file[i], way(file, i)));
                normal += &b * b.transpose();
                rhs += b * difference[at + i];
            }
        }
        solutions.push(if flexible && pressed { solve(&normal, &rhs) } else { None });
        at += file.len();
    }
    let shared = if flexible { None } else { solve(&normal, &rhs) };
    files
        .iter()
        .zip(starts)
        .zip(&solutions)
        .map(|((file, at), own)| {
            let pressed = file.iter().map(|r| r.pressure).fold(0.0, f64::max) > 20e3;
            let Some(x) = own.as_ref().or(shared.as_ref()).filter(|_| pressed) else {
                return vec![0.0; file.len()];
            };
            (0..file.len())
                .map(|i| {
                    let b = DVector::from_vec(base.row(&file[i], way(file, i)));
                    difference[at + i] - b.dot(x)
                })
                .collect()
        })
        .collect()
}

/// The lesser residual, when friction follows the base's changes and when it does not: an effect that either
/// reading absorbs counts as absorbed.
fn least_left(difference: &[f64], files: &[Vec<Row>], base: Base<'_>) -> Vec<Vec<f64>> {
    let (a, b) = (left(difference, files, base), left(difference, files, Base { rubs: false, ..base }));
    if rms(&a) < rms(&b) { a } else { b }
}

fn rms(rows: &[Vec<f64>]) -> f64 {
    let n: usize = rows.iter().filter(|f| f.iter().any(|v| *v != 0.0)).map(Vec::len).sum();
    (rows.iter().flatten().map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt()
}

/// Lose some rows: uneven sampling.
fn thin(files: &mut [Recording], part: f64, seed: u64) {
    if part <= 0.0 {
        return;
    }
    let mut r = Rng::stream(seed, "lost rows");
    for f in files {
        f.rows.retain(|_| !r.chance(part));
    }
}

/// Make every file as loud as it likes, up to `most` (N) of white noise.
fn disturb(files: &mut [Recording], most: f64, seed: u64) {
    if most <= 0.0 {
        return;
    }
    let mut r = Rng::stream(seed, "uneven noise");
    for f in files {
        let loud = most * r.unit();
        f.rows.iter_mut().for_each(|row| row.force += loud * r.normal());
    }
}

/// Put resampled real residuals of deviation `deviation` (N) on the force.
fn resample(files: &mut [Recording], residuals: &Residuals, deviation: f64, seed: u64) {
    let mut r = Rng::stream(seed, "real residuals");
    for f in files {
        let series = residuals.series(f.rows.len(), RATE, &mut r);
        f.rows.iter_mut().zip(series).for_each(|(row, v)| row.force += deviation * v);
    }
}

/// Samples per second of every protocol used here.
const RATE: f64 = 10.0;

/// What the person at the bench makes of the files.
fn mishandle(files: &mut Vec<Recording>, o: &Operator, blocked: f64, seed: u64) {
    let mut r = Rng::stream(seed, "operator");
    let tare = |f: &Recording| f.name.contains("tare");
    let lost = |r: &mut Rng, most: f64| if r.chance(0.34) { (r.range(0.0, most) * RATE) as usize } else { 0 };
    for f in files.iter_mut().filter(|f| !tare(f)) {
        let (first, last) = (lost(&mut r, o.late_s), lost(&mut r, o.early_s));
        if f.rows.len() > 2 * (first + last) {
            f.rows.drain(..first);
            f.rows.truncate(f.rows.len() - last);
        }
        let away = o.tared_drift * blocked * r.range(-1.0, 1.0) / f.rows.len().max(1) as f64;
        f.rows.iter_mut().enumerate().for_each(|(i, row)| row.force += away * i as f64);
    }
    let tares: Vec<usize> = (0..files.len()).filter(|&i| tare(&files[i])).collect();
    if o.forgot_tare && tares.len() > 1 {
        files.remove(tares[r.index(tares.len())]);
    }
    let long: Vec<usize> = (0..files.len()).filter(|&i| files[i].rows.len() > 600).collect();
    if o.restarted && !long.is_empty() {
        let at = long[r.index(long.len())];
        let cut = (files[at].rows.len() as f64 * r.range(0.3, 0.7)) as usize;
        let mut rows = files[at].rows.split_off(cut);
        rows.drain(..40);
        let name = format!("{}_again", files[at].name);
        files.insert(at + 1, Recording { name, rows });
    }
    for row in files.iter_mut().flat_map(|f| &mut f.rows) {
        row.time *= 1.0 + o.clock_skew;
    }
}

/// The campaign of a trial, every position in mm.
fn protocol_of(spec: &Spec, muscle: &Muscle, levels: &[f64]) -> Protocol {
    let mut order = levels.to_vec();
    if let Some(i) = spec.operator.swapped
        && i + 1 < order.len()
    {
        order.swap(i, i + 1);
    }
    let protocol = campaigns::by_name(spec.protocol, muscle, &order, spec.seed)
        .unwrap_or_else(|| campaigns::classic(muscle, levels));
    in_millimetres(protocol, muscle)
}

/// What a further protocol records on the muscle of a trial, with its effects in `bench`, after the trial's campaign.
pub fn after(spec: &Spec, bench: &BenchSpec, residuals: &Residuals, next: &Protocol) -> Vec<Recording> {
    let muscle = Muscle::new(spec.bench.muscle.clone());
    let levels = campaigns::levels(&muscle);
    let real = spec.real_noise && !residuals.is_empty();
    let mut b = bench.clone();
    let coloured = b.instruments.force.coloured.0;
    if real {
        b.instruments.force.coloured.0 = 0.0;
    }
    let mut at = Bench::new(&b);
    // Both protocols were checked when they were made or read.
    let _ = at.run(&protocol_of(spec, &muscle, &levels));
    let mut files = at.run(next).unwrap_or_default();
    if real {
        resample(&mut files, residuals, coloured, spec.seed ^ 2);
    }
    files
}

/// What the search for the strength of the effects gives.
struct Sized {
    scale: Scale,
    protocol: Protocol,
    levels: Vec<f64>,
    speed: f64,
    /// Rows of the silent bench without the effects; empty where there are none.
    without: Vec<Vec<Row>>,
    /// The bench with its effects.
    bench: BenchSpec,
    /// Peak of each effect as a part of the blocked force, what it adds to each row, and its parameters.
    effects: Vec<(f64, Vec<f64>, Vec<Parameter>)>,
}

/// Finds how strong the effects of a trial have to be.
fn sized(spec: &Spec) -> Sized {
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

/// A pair of campaigns of one muscle, of which the later one has the effects of a trial.
pub struct Pair {
    /// Muscle description as an engineer would measure it.
    pub description: String,
    /// The campaign without effects, with noise and mistakes of its own.
    pub before: Vec<Recording>,
    /// The campaign with the effects.
    pub after: Vec<Recording>,
    /// Name and peak of each effect, percent of the blocked force.
    pub effects: Vec<(String, f64)>,
}

/// Makes the pair of a trial.
pub fn pair(spec: &Spec, residuals: &Residuals) -> Pair {
    let Sized { scale, protocol, bench, effects, .. } = sized(spec);
    let real = spec.real_noise && !residuals.is_empty();
    let campaign = |b: &BenchSpec, seed: u64| {
        let coloured = b.instruments.force.coloured.0;
        let mut b = BenchSpec { seed, ..b.clone() };
        if real {
            b.instruments.force.coloured.0 = 0.0;
        }
        let mut files = Bench::new(&b).run(&protocol).unwrap_or_default();
        if real {
            resample(&mut files, residuals, coloured, seed);
        }
        disturb(&mut files, spec.uneven_noise * b.instruments.force.white, seed);
        mishandle(&mut files, &spec.operator, scale.force, seed);
        thin(&mut files, spec.lost_rows, seed);
        files
    };
    // Another day: other noise, and other mistakes of the same operator.
    let other = Rng::stream(spec.seed, "before").bits();
    Pair {
        description: spec.bench.muscle.description(),
        before: campaign(&spec.bench, other),
        after: campaign(&bench, spec.seed),
        effects: spec.effects.iter().zip(&effects).map(|((i, _), e)| (i.name.into(), 100.0 * e.0)).collect(),
    }
}

/// Make one trial.
pub fn make(spec: &Spec, residuals: &Residuals) -> Trial {
    let muscle = Muscle::new(spec.bench.muscle.clone());
    let geometry = spec.bench.muscle.geometry;
    let Sized { scale, protocol, levels, speed, without, bench, effects: strengths } = sized(spec);
    let mut effects = Vec::new();
    let mut together: Vec<Vec<f64>> = without.iter().map(|f| vec![0.0; f.len()]).collect();
    for ((injection, _), (is, d, parameters)) in spec.effects.iter().zip(strengths) {
        let friction = &spec.bench.muscle.friction;
        let base =
            Base { stroke: scale.stroke, force: scale.force, geometry, friction, flexible: true, rubs: true };
        let rest = least_left(&d, &without, base);
        for (sum, one) in together.iter_mut().flatten().zip(rest.iter().flatten()) {
            *sum += one;
        }
        effects.push(TrueEffect {
            name: injection.name.into(),
            amplitude_pct: 100.0 * is,
            left_flexible: rms(&rest),
            left_stiff: rms(&least_left(&d, &without, Base { flexible: false, ..base })),
            parameters,
        });
    }
    let after = in_millimetres(held_out_protocol(&levels, speed), &muscle);
    let real = spec.real_noise && !residuals.is_empty();
    let campaign = |b: &BenchSpec| {
        let coloured = b.instruments.force.coloured.0;
        let mut b = b.clone();
        if real {
            b.instruments.force.coloured.0 = 0.0;
        }
        let mut at = Bench::new(&b);
        let mut first = at.run(&protocol).unwrap_or_default();
        let clock = at.clock();
        let mut second = at.run(&after).unwrap_or_default();
        for (files, seed) in [(&mut first, spec.seed), (&mut second, spec.seed ^ 1)] {
            if real {
                resample(files, residuals, coloured, seed);
            }
            disturb(files, spec.uneven_noise * b.instruments.force.white, seed);
            mishandle(files, &spec.operator, scale.force, seed);
            thin(files, spec.lost_rows, seed);
        }
        let checked = spec.protocol == "C";
        let checks = if checked { checks::all(&b, scale.force, scale.pressure, clock) } else { Vec::new() };
        (first, second, checks)
    };
    let (recordings, held_out, checks) = campaign(&bench);
    let twin = if spec.effects.is_empty() {
        (Vec::new(), Vec::new())
    } else {
        let (first, second, _) = campaign(&spec.bench);
        (first, second)
    };
    let force = bench.instruments.force;
    let mut salt = Rng::stream(spec.seed, "salt");
    let truth = TrialTruth {
        id: spec.id,
        stratum: spec.stratum,
        protocol: spec.protocol.into(),
        effects,
        looks_like: spec.looks_like.map(Into::into),
        noise: force.white.hypot(force.coloured.0),
        noise_time_s: force.coloured.1,
        noise_source: if real { "real residuals" } else { "synthetic" }.into(),
        operator: spec.operator,
        blocked_force: scale.force,
        bench,
        salt: format!("{:016x}{:016x}", salt.bits(), salt.bits()),
    };
    let trace = crate::locate::trace(&without, &together, geometry.rest_length);
    Trial { description: spec.bench.muscle.description(), recordings, held_out, twin, trace, checks, truth }
}
