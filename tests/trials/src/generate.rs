//! Making a trial: the campaign with its effects, its twin without, held-out recordings, and the sealed truth.

mod disturbance;
mod residual;
mod strength;

use crate::inject::Parameter;
use crate::residuals::Residuals;
use crate::spec::{Operator, Spec, Stratum};
use serde::{Deserialize, Serialize};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::checks::{self, Check};
use virtual_bench::muscle::Muscle;
use virtual_bench::protocol::{Place, Protocol, Step};
use virtual_bench::recording::Recording;
use virtual_bench::rng::Rng;

use self::disturbance::{disturb, downsample, mishandle, resample};
use self::residual::{Base, least_left, rms};
use self::strength::{Sized, sized};

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
        downsample(&mut files, spec.lost_rows, seed);
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
            downsample(files, spec.lost_rows, seed);
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
