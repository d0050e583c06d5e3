//! The library's laws against the virtual bench's own: the bench has other equations (bristles, relays, network damage, path
//! of strain, Eyring's law, a thermal network, a line of air). Each effect of the library has to describe most of what its
//! namesake there leaves in the force once a base model has taken its part. Laws that only describe themselves would pass every
//! other test.

use std::collections::BTreeMap;

use model_core::effects::{Context, MEMORY};
use model_core::muscle::Muscle as Model;
use model_core::units::{Length, Pressure};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, Follower, Recording};
use pam_fit::bench::{Candidate, Span};
use pam_fit::{Options, fit};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::Muscle;
use virtual_bench::physics::{
    Activated, Ageing, Heat, Jam, Mullins, Relaxation, Relays, Seal, Set, Slip, Slow, StrandContact, Viscous,
    Wear,
};
use virtual_bench::pneumatics::Pneumatics;
use virtual_bench::presets;
use virtual_bench::protocol::{Protocol, Step};
use virtual_bench::sensors::Sensor;

use crate::bench_campaign;

/// What of an effect's trace, beyond the base model's reach, its namesake must at least explain.
const BOUNDS: [(&str, f64); 28] = [
    ("coulomb-friction", 0.98),
    ("seal-friction", 0.97),
    ("pressure-friction", 0.95),
    ("viscous-damping", 0.98),
    ("stribeck-friction", 0.85),
    ("rate-power", 0.88),
    ("breakaway-friction", 0.88),
    ("presliding-hysteresis", 0.88),
    ("minor-loop-memory", 0.80),
    ("stress-relaxation", 0.85),
    ("mullins-softening", 0.88),
    ("cyclic-softening", 0.90),
    ("thermal-softening", 0.90),
    ("permanent-set", 0.85),
    ("pressure-lag", 0.90),
    ("rig-compliance", 0.90),
    ("gauge-gain", 0.97),
    ("force-gain", 0.97),
    ("cross-talk", 0.97),
    ("sensor-delay", 0.95),
    ("log-creep", 0.85),
    // The bench's tapers use up fibre by their own steepness, which neither law of the tips knows.
    ("tip-effect", 0.75),
    ("braid-elasticity", 0.92),
    ("strand-jamming", 0.80),
    ("friction-asymmetry", 0.75),
    ("displacement-offset", 0.95),
    ("end-slip", 0.93),
    ("force-drift", 0.98),
];

/// Puts the bench's version of an effect on it, at about one per cent of the blocked force.
fn inject(
    name: &str,
    bench: &mut BenchSpec,
    force: f64,
    stroke: f64,
    pressure: f64,
    speed: f64,
    stretch: f64,
) {
    let physics = &mut bench.muscle.physics;
    match name {
        "coulomb-friction" => {
            physics.seal = Some(Seal {
                dry: 0.01 * force,
                per_pressure: 0.0,
                travel: 2e-4 * stroke,
                slow: 0.0,
                slow_speed: 0.0,
            });
        }
        "seal-friction" => {
            physics.seal = Some(Seal {
                dry: 0.005 * force,
                per_pressure: 0.01 * force / pressure,
                travel: 5e-4 * stroke,
                slow: 0.3,
                slow_speed: 2.0 * speed,
            });
        }
        "pressure-friction" => physics.strands = Some(StrandContact { area: 0.01 * force / pressure }),
        "viscous-damping" => {
            physics.viscous = Some(Viscous { drag: 0.005 * force / speed, per_pressure: 0.0 })
        }
        "stribeck-friction" => physics.slow = Some(Slow { strength: 0.15, speed: 2.0 * speed }),
        "rate-power" => physics.activated = Some(Activated { strength: 0.2, speed: 0.1 * speed }),
        "breakaway-friction" => {
            physics.ageing = Some(Ageing { strength: 0.06, time: 1.0, travel: 0.01 * stroke });
        }
        "presliding-hysteresis" => {
            bench.muscle.friction.bristles =
                [(0.4, 0.4), (0.35, 1.0), (0.25, 2.2)].map(|(share, d)| (share, 0.03 * d * stroke)).to_vec();
        }
        "minor-loop-memory" => {
            physics.relays = Some(Relays { area: 0.03 * force / pressure, span: 1.1 * stroke, widest: 0.4 });
        }
        "stress-relaxation" => {
            physics.relaxation =
                Some(Relaxation { strength: 0.05, fastest: 8.0, branches: 2, exponent: 0.3 });
        }
        "mullins-softening" => {
            physics.mullins = Some(Mullins { loss: 0.15, width: 0.6, conditioned: 0.05 * stretch });
        }
        "cyclic-softening" => physics.wear = Some(Wear { loss: 0.08, path: 12.0 * stretch }),
        "thermal-softening" => {
            let power = 0.1 * force * speed;
            let cooling = power / 8.0;
            physics.heat = Some(Heat {
                capacity: 500.0 * cooling,
                to_fittings: 2.0 * cooling,
                fittings: 500.0 * cooling,
                to_room: 2.0 * cooling,
                stiffness: 0.0034,
                friction: -0.004,
                hysteresis: 0.05,
            });
        }
        "permanent-set" => physics.set = Some(Set { travel: 0.015 * stroke, force, time: 80.0 }),
        "pressure-lag" => {
            bench.pneumatics.sensor_at_regulator = true;
            bench.pneumatics.line = 0.06;
        }
        "rig-compliance" => bench.rig.stiffness = force / (0.01 * stroke),
        "gauge-gain" => bench.instruments.pressure.gain = 0.01,
        "force-gain" => bench.instruments.force.gain = 0.012,
        "cross-talk" => bench.rig.hose = 0.01 * force / pressure,
        "sensor-delay" => (bench.instruments.force.delay, bench.instruments.force.lag) = (0.05, 0.02),
        "log-creep" => {
            physics.creep = Some(Relaxation { strength: 0.004, fastest: 0.5, branches: 9, exponent: 0.0 });
        }
        "tip-effect" => bench.muscle.shape.ends = 0.4,
        "braid-elasticity" => bench.muscle.shape.fibre_stiffness = Some(400.0 * force),
        "strand-jamming" => {
            physics.jam = Some(Jam { force: 0.004 * force, stroke: 0.85 * stroke, width: 0.07 * stroke });
        }
        "friction-asymmetry" => bench.muscle.friction.asymmetry = 0.1,
        "displacement-offset" => bench.rig.offset = 0.006 * stroke,
        "end-slip" => physics.slip = Some(Slip { time: 200.0, travel: 0.015 * stroke }),
        "force-drift" => bench.rig.warm_up = (0.01 * force, 600.0),
        other => panic!("nothing is known of {other}"),
    }
}

/// Instruments and regulator that add nothing of their own: two runs then differ by the effect alone.
fn silent(bench: &BenchSpec) -> BenchSpec {
    let mut b = bench.clone();
    let quiet = |s: Sensor| Sensor { white: 0.0, coloured: (0.0, 1.0), outliers: (0.0, 0.0), ..s };
    b.instruments.force = quiet(b.instruments.force);
    b.instruments.pressure = quiet(b.instruments.pressure);
    b.instruments.stroke = quiet(b.instruments.stroke);
    b.pneumatics = Pneumatics { ripple: (0.0, 1.0), wander: (0.0, 1.0), deadband: 0.0, ..b.pneumatics };
    b
}

fn run(bench: &BenchSpec, protocol: &Protocol) -> Vec<Recording> {
    let files = Bench::new(bench).run(protocol).expect("a protocol for this muscle");
    bench_campaign::recordings(&files)
}

fn force(recording: &Recording) -> &[f64] {
    recording.force.as_deref().expect("a force")
}

/// The crosshead's course in millimetres, so that it does not depend on what is on the bench.
fn in_millimetres(mut protocol: Protocol, muscle: &Muscle) -> Protocol {
    let mut pressure = 0.0;
    for step in &mut protocol.step {
        match step {
            Step::Pressure { to_kpa, .. } => pressure = *to_kpa * 1e3,
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

/// Takes `basis` out of a column; `None` where only rounding is left.
fn left(column: &[f64], basis: &[Vec<f64>]) -> Option<Vec<f64>> {
    let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let whole = size(column);
    let mut rest = column.to_vec();
    for _ in 0..2 {
        for unit in basis {
            let share: f64 = unit.iter().zip(&rest).map(|(u, r)| u * r).sum();
            rest.iter_mut().zip(unit).for_each(|(r, u)| *r -= share * u);
        }
    }
    (size(&rest) > 1e-6 * whole).then_some(rest)
}

fn extend(basis: &mut Vec<Vec<f64>>, column: &[f64]) {
    if let Some(rest) = left(column, basis) {
        let size = rest.iter().map(|x| x * x).sum::<f64>().sqrt();
        basis.push(rest.iter().map(|r| r / size).collect());
    }
}

#[test]
fn each_law_describes_the_bench_s_own_version_of_its_effect() {
    let spec = BenchSpec::laboratory(presets::by_name("mini").expect("a preset"), 1);
    let quiet = silent(&spec);
    let muscle = Muscle::new(spec.muscle.clone());
    let levels: Vec<f64> = campaigns::levels(&muscle).into_iter().step_by(2).collect();
    let protocol = in_millimetres(campaigns::upgraded(&muscle, &levels, 3), &muscle);
    let top = levels[levels.len() - 1];
    let (blocked, stroke) = (muscle.quasi_static(top, 0.0), muscle.free_stroke(top));
    let speed = campaigns::slow(&muscle, &levels) * 1e-3;
    let pressed = |r: &Recording| r.pressure.iter().all(|p| *p > 0.5 * levels[0]);

    let without = run(&quiet, &protocol);
    let pulling: Vec<Recording> = run(&spec, &protocol).into_iter().filter(|r| pressed(r)).collect();
    let description = MuscleDescription::parse(&spec.muscle.description()).expect("a description");
    let fit = fit(&Campaign::new(pulling), &description, &Options::default()).expect("a fit");
    let model = Model::<f64>::build(&fit.table).expect("a valid table");

    let mut short = BTreeMap::new();
    for (name, bound) in BOUNDS {
        let mut bench = quiet.clone();
        inject(name, &mut bench, blocked, stroke, top, speed, muscle.stretch(stroke));
        let campaign = Campaign::new(run(&bench, &protocol));
        let motions = Motion::of_campaign(&campaign);
        let mut follower = Follower::of(&campaign);
        let mut contexts: Vec<Context<f64>> = Vec::new();
        // The effect at the same measured pressure and stroke, at rows where the muscle pulls and does not just turn.
        let (mut rows, mut trace) = (Vec::new(), Vec::new());
        for (i, (recording, motion)) in campaign.recordings.iter().zip(&motions).enumerate() {
            let way = &motion.direction;
            let moments = follower.follow(recording, motion, campaign.pause_before(i));
            for (k, moment) in moments.iter().enumerate() {
                let context = model.context(moment, Pressure::from_pascals(recording.pressure[k]));
                let near = &way[k.saturating_sub(2)..(k + 3).min(way.len())];
                let pulls = force(recording)[k].min(force(&without[i])[k]) > 0.02 * blocked;
                if pulls && pressed(recording) && near.iter().all(|w| *w == way[k]) {
                    rows.push(contexts.len());
                    let gauge = recording.pressure[k] - without[i].pressure[k];
                    trace.push(force(recording)[k] - force(&without[i])[k] - context.area * gauge);
                }
                contexts.push(context);
            }
        }
        let pick =
            |of: &dyn Fn(&Context<f64>) -> f64| rows.iter().map(|r| of(&contexts[*r])).collect::<Vec<f64>>();
        let mut base: Vec<Vec<f64>> = Vec::new();
        extend(&mut base, &pick(&|c| c.area));
        for k in 0..5 {
            let elastic = |c: &Context<f64>| {
                model.braid().posture(Length::from_metres(c.stroke)).elastic_columns::<5>()[k]
            };
            extend(&mut base, &pick(&elastic));
        }
        extend(&mut base, &pick(&|c| c.direction * c.quasi));
        extend(&mut base, &pick(&|c| c.direction * c.quasi * c.pressure));

        let target = left(&trace, &base).expect("a trace beyond the base");
        let energy = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
        let candidate = Candidate::from_name(name).expect("in the catalogue");
        let span = Span::of(&contexts).expect("readings");
        let explained = candidate
            .grid(if candidate.shapes().len() > 1 { 6 } else { 40 }, &span)
            .iter()
            .map(|shape| {
                let mut own = base.clone();
                for column in candidate.columns(&contexts, shape, &mut [0.0; MEMORY]) {
                    extend(&mut own, &rows.iter().map(|r| column[*r]).collect::<Vec<f64>>());
                }
                1.0 - left(&target, &own[base.len()..]).map_or(0.0, |rest| energy(&rest)) / energy(&target)
            })
            .fold(f64::NEG_INFINITY, f64::max);
        println!("{name:24} {explained:.3}");
        if !(explained >= bound) {
            short.insert(name, explained);
        }
    }
    assert!(short.is_empty(), "too little explained: {short:?}");
}
