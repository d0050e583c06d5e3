//! Staircases recorded row by row, with pulses that ring: friction that they turn, and readings that are late or wrong.

use super::super::answer::FindingKind;
use super::super::{Found, diagnose, found};
use super::synthetic::{PAUSE, THRESHOLDS, TIMES, geometry, pull};
use crate::linear::Random;
use crate::options::Options;
use model_core::effects::EffectName;
use pam_data::recording::{Campaign, Recording};
use pam_fit::bench::{BenchName, Candidate};

/// How the bench reads the muscle, and the muscle's friction.
#[derive(Clone, Copy, Default)]
struct Bench {
    /// Friction of constant size, N, that turns over a change of pressure of 10 kPa.
    friction: f64,
    /// The base model's friction as a share of the pull, which turns likewise.
    coefficient: f64,
    /// Time constant of a filter in the force channel, s.
    filter: f64,
    /// Time constant of the pressure sensor, s.
    lag: f64,
    /// Reading of the load cell without load, N.
    zero: f64,
    /// Its reading of the pressure, N/kPa.
    per_pressure: f64,
    /// How many times as softly as the other muscles it begins to pull, less one.
    softer: f64,
}

const RUNS: usize = 4;
/// Time between samples, s.
const STEP: f64 = 0.005;
const LENGTH: f64 = 40.0;

/// Pressure, kPa: a pulse every half second that rings and settles, filling to 21 s. No two pulses are the same.
fn pressure(time: f64, strengths: &[f64]) -> f64 {
    let pulse = (time / 0.5).floor();
    let strength = strengths[pulse as usize];
    let since = time - 0.5 * pulse;
    let (level, way) = if time < 21.0 {
        (630.0 * (1.0 - (-(pulse + 1.0) / 12.0).exp()), 1.0)
    } else {
        (630.0 * (-(pulse - 41.0) / 10.0).exp(), -1.0)
    };
    level
        + way
            * strength
            * (25.0 * (-since / 0.06).exp() * (125.0 * since).cos() + 8.0 * (-since / 0.25).exp())
}

/// One run of a mounting, whose memory it leaves in `states`.
fn run(
    bench: Bench,
    threshold: f64,
    states: &mut [f64; 5],
    random: &mut Random,
) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let carried = threshold - 110.0;
    let (mut times, mut pressures, mut forces) = (Vec::new(), Vec::new(), Vec::new());
    let strengths: Vec<f64> = (0..80).map(|_| (0.8 * random.normal()).exp()).collect();
    let mut last = pressure(0.0, &strengths);
    let (mut direction, mut filtered, mut read) = (1.0_f64, None, last);
    for k in 0..((LENGTH + PAUSE) / STEP) as usize {
        let t = k as f64 * STEP;
        let p = if t < LENGTH { pressure(t, &strengths) } else { 0.0 };
        let engaged = ((p - 60.0) / carried.abs().max(60.0)).clamp(0.0, 1.0);
        for (z, tau) in states.iter_mut().zip(TIMES) {
            *z += STEP / tau * (carried * engaged - *z);
        }
        let way = if p > last { 1.0 } else { -1.0 };
        direction = way + (direction - way) * (-(p - last).abs() / 10.0).exp();
        last = p;
        let moved = p + 0.6 * states.iter().sum::<f64>() / 5.0;
        let knee = 1.0 + bench.softer;
        let free = knee * pull(threshold + (moved - threshold) / knee, threshold);
        let friction = bench.friction.min(free) + bench.coefficient * free;
        let force = free - direction * friction + bench.zero + bench.per_pressure * p;
        let before = filtered.unwrap_or(force);
        let late: f64 = before + (force - before) * (1.0 - (-STEP / bench.filter.max(1e-6)).exp());
        filtered = Some(late);
        read += (p - read) * (1.0 - (-STEP / bench.lag.max(1e-6)).exp());
        if t < LENGTH && k % 5 == 0 {
            times.push(t);
            pressures.push(1e3 * read);
            forces.push(late + 0.3 * random.normal());
        }
    }
    (times, pressures, forces)
}

fn recorded(bench: Bench, seed: u64) -> Campaign {
    let mut random = Random(seed);
    let mut recordings = Vec::new();
    for (m, threshold) in THRESHOLDS.iter().enumerate() {
        let mut states = [0.0; 5];
        for k in 0..RUNS {
            let (time, pressure, force) = run(bench, *threshold, &mut states, &mut random);
            recordings.push(Recording {
                name: format!("mounting {m}, run {k}"),
                stroke: vec![4e-3 * m as f64; time.len()],
                time,
                pressure,
                force: Some(force),
                ..Recording::default()
            });
        }
    }
    Campaign::new(recordings)
}

fn diagnosed(bench: Bench, seed: u64) -> Found {
    found(&recorded(bench, seed), &geometry()).expect("a campaign of staircases")
}

fn named(bench: Bench, seed: u64) -> Option<Candidate> {
    diagnosed(bench, seed).needed.map(|n| n.effect)
}

#[test]
fn nothing_is_named_beside_a_memory_alone() {
    for seed in 0..3 {
        let found = diagnosed(Bench::default(), 500 + seed);
        assert!(found.answer.named, "seed {seed}: {:?}", found.answer.why_not);
        assert!(found.needed.is_none(), "seed {seed}: {:?}", found.needed);
        assert!(!found.slack_reading.as_ref().expect("slack mountings").found, "seed {seed}");
    }
}

#[test]
fn the_friction_of_the_base_model_does_not_hide_a_memory() {
    for (coefficient, seed) in [(0.0, 501), (0.04, 502), (0.08, 503)] {
        let found = diagnosed(Bench { coefficient, ..Bench::default() }, seed);
        assert!(found.answer.named, "{coefficient}: {:?}", found.answer.why_not);
        assert!(found.needed.is_none(), "{coefficient}: {:?}", found.needed);
        let fitted = found.answer.friction.unwrap_or(0.0);
        assert!((fitted - coefficient).abs() < 0.25 * coefficient + 1e-3, "{coefficient}: {fitted}");
        let share = found.answer.law.relaxed_share.value;
        assert!((share / 0.6 - 1.0).abs() < 0.2, "{coefficient}: {share}");
    }
}

#[test]
fn friction_that_the_ring_of_pulses_turns_is_named_beside_the_memory() {
    let found = diagnosed(Bench { friction: 12.0, ..Bench::default() }, 510);
    assert!(found.answer.named, "{:?}", found.answer.why_not);
    let needed = found.needed.expect("an effect");
    assert_eq!(needed.effect, Candidate::Muscle(EffectName::CoulombFriction), "{needed:?}");
    assert!((needed.value / 12.0 - 1.0).abs() < 0.3, "{needed:?}");
}

#[test]
fn readings_that_come_late_are_named() {
    let late = named(Bench { filter: 0.25, ..Bench::default() }, 520);
    assert_eq!(late, Some(Candidate::Bench(BenchName::SensorDelay)));
    let late = named(Bench { lag: 0.1, ..Bench::default() }, 530);
    assert_eq!(late, Some(Candidate::Bench(BenchName::PressureSensorLag)));
}

#[test]
fn a_slack_muscle_shows_what_the_load_cell_reads() {
    for (bench, effect, amplitude) in [
        (Bench { zero: 9.0, ..Bench::default() }, BenchName::ForceOffset, 9.0),
        (Bench { zero: -9.0, ..Bench::default() }, BenchName::ForceOffset, -9.0),
        (Bench { per_pressure: 0.03, ..Bench::default() }, BenchName::CrossTalk, 3e-5),
    ] {
        let found = diagnosed(bench, 540);
        let reading = found.slack_reading.expect("slack mountings");
        assert!(reading.found && reading.effect == effect, "{reading:?}");
        assert!((reading.amplitude / amplitude - 1.0).abs() < 0.25, "{reading:?}, {amplitude} is true");
        let finding = found.answer.of(FindingKind::SlackReading).next().expect("a finding");
        assert_eq!(finding.cause, Some(Candidate::Bench(effect)));
    }
}

#[test]
fn a_pull_that_begins_softly_is_no_reading_of_a_slack_muscle() {
    for softer in [1.5, 2.0, 3.0, 4.0] {
        let found = diagnosed(Bench { softer, ..Bench::default() }, 550);
        let reading = found.slack_reading;
        assert!(reading.as_ref().is_none_or(|r| !r.found), "{softer}: {reading:?}");
    }
}

#[test]
fn effects_that_a_slack_muscle_excludes_cannot_be_hidden() {
    let diagnosed = |bench| {
        diagnose(&recorded(bench, 560), &geometry(), &Options::default()).expect("a diagnosis of staircases")
    };
    let effects = [(BenchName::ForceOffset, 0.06), (BenchName::Gravity, 0.06), (BenchName::CrossTalk, 0.15)];
    let clean = diagnosed(Bench::default());
    for (effect, share) in effects {
        let considered =
            clean.considered.iter().find(|c| c.effect == effect.info().name).expect("considered");
        let hidden = considered.hidden_up_to_N.expect("a limit");
        assert!(hidden < share * clean.blocked_force_N, "{considered:?}");
    }
    let off = diagnosed(Bench { zero: 9.0, ..Bench::default() });
    let name = effects[0].0.info().name;
    assert!(off.missing.iter().any(|m| m.effect == name), "{:?}", off.missing);
    assert!(off.considered.iter().all(|c| c.effect != name), "{:?}", off.considered);
}
