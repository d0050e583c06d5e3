//! Ready-made protocols: the thesis's, and A, B, C, D of the catalogue of left-out physics.
//!
//! Speeds are scaled to the muscle, so that a loop at the slow speed takes about as long for a small muscle as for a large one:
//! the unit is the free stroke at the highest level in 27 s (1 mm/s for a 150 mm muscle).

use crate::muscle::Muscle;
use crate::protocol::{Place, Protocol, Step};
use crate::rng::Rng;

/// Six levels for a muscle, from where it begins to move well (an eighth of its free stroke at the highest level) to 90 % of
/// what it is rated for, Pa, in whole kPa.
pub fn levels(muscle: &Muscle) -> Vec<f64> {
    let top = 0.9 * muscle.spec().max_pressure;
    let deadband = muscle.truth(&[]).deadband_kpa * 1e3;
    let enough = 0.125 * muscle.free_stroke(top);
    let (mut low, mut high) = (deadband, top);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if muscle.free_stroke(middle) < enough { low = middle } else { high = middle }
    }
    let bottom = (top / 6.0).max(1.8 * deadband).max(high).min(0.7 * top);
    (0..6).map(|i| ((bottom + (top - bottom) * f64::from(i) / 5.0) * 1e-3).round() * 1e3).collect()
}

/// The slow speed of a muscle, mm/s.
pub fn slow(muscle: &Muscle, levels: &[f64]) -> f64 {
    let top = levels.iter().copied().fold(0.0, f64::max);
    (muscle.free_stroke(top) * 1e3 / 27.0).max(1e-3)
}

fn file(number: &mut u32, what: &str) -> Step {
    *number += 1;
    Step::File { name: format!("{number:02}_{what}") }
}

fn level_name(p: f64) -> String {
    format!("{:03.0}kPa", p * 1e-3)
}

fn set(p: f64, settle_s: f64) -> Step {
    Step::Pressure { to_kpa: p * 1e-3, rate_kpa_s: Some(50.0), settle_s }
}

fn go(part: f64, speed_mm_s: f64) -> Step {
    Step::Move { to: Place::free(part), speed_mm_s }
}

fn loops(count: u32, speed_mm_s: f64) -> Step {
    Step::Cycles { to: Place::free(1.0), speed_mm_s, count }
}

/// The thesis's test: per pressure three slow loops from blocked to free and back, one file each, at about 1,350 samples a
/// loop.
pub fn thesis(muscle: &Muscle, pressures: &[f64]) -> Protocol {
    let speed = slow(muscle, pressures);
    let mut step = Vec::new();
    let mut n = 0;
    for &p in pressures {
        step.extend([set(p, 3.0), file(&mut n, &level_name(p)), loops(3, speed), Step::EndFile]);
    }
    Protocol { name: "thesis".into(), sample_hz: 30.0, step }
}

/// Protocol A, classic: ascending levels, three triangular loops at the slow speed, 10 Hz.
pub fn classic(muscle: &Muscle, levels: &[f64]) -> Protocol {
    let speed = slow(muscle, levels);
    let mut step = Vec::new();
    let mut n = 0;
    for &p in levels {
        step.extend([set(p, 2.0), file(&mut n, &level_name(p)), loops(3, speed), Step::EndFile]);
    }
    Protocol { name: "A".into(), sample_hz: 10.0, step }
}

/// Levels in shuffled order, the one in the middle repeated at the end.
fn shuffled(levels: &[f64], seed: u64) -> Vec<f64> {
    let mut order = levels.to_vec();
    Rng::stream(seed, "order").shuffle(&mut order);
    order.extend(levels.get((levels.len().max(1) - 1) / 2));
    order
}

fn enriched_level(step: &mut Vec<Step>, v: f64) {
    step.extend([loops(1, v), loops(2, 4.0 * v), loops(3, 16.0 * v)]);
    // Two dwells at the same place, reached from either side.
    step.extend([go(0.5, 4.0 * v), Step::Hold { seconds: 60.0 }]);
    step.extend([go(0.9, 4.0 * v), go(0.5, 4.0 * v), Step::Hold { seconds: 60.0 }]);
    for part in [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0] {
        step.push(go(part, 4.0 * v));
    }
}

fn enriched_levels(order: &[f64], v: f64, tares: bool, n: &mut u32) -> Vec<Step> {
    let mut step = Vec::new();
    for &p in order {
        step.extend([set(p, 2.0), file(n, &level_name(p))]);
        enriched_level(&mut step, v);
        step.push(Step::EndFile);
        if tares {
            step.extend([file(n, "tare"), Step::Tare { seconds: 10.0 }, Step::EndFile]);
        }
    }
    step
}

fn ramps(n: &mut u32, top: f64, v: f64) -> Vec<Step> {
    let mut step = vec![set(top, 1.0), file(n, "ramps")];
    for part in [0.0, 0.3, 0.6] {
        step.push(set(top, 1.0));
        step.push(go(part, 4.0 * v));
        for to in [0.0, top, 0.0, top] {
            let rate = top * 1e-3 / 25.0;
            step.push(Step::Pressure { to_kpa: to * 1e-3, rate_kpa_s: Some(rate), settle_s: 2.0 });
        }
    }
    step.extend([go(0.0, 4.0 * v), Step::EndFile]);
    step
}

fn tare(n: &mut u32) -> Vec<Step> {
    vec![file(n, "tare"), Step::Tare { seconds: 10.0 }, Step::EndFile]
}

/// Protocol B, enriched: shuffled levels with one repeated, speeds 1/4/16, two 60 s dwells and nested minor loops per
/// level, isometric pressure ramps at three lengths, vented tares at both ends.
pub fn enriched(muscle: &Muscle, levels: &[f64], seed: u64) -> Protocol {
    let (v, mut n) = (slow(muscle, levels), 0);
    let top = levels.iter().copied().fold(0.0, f64::max);
    let mut step = tare(&mut n);
    step.extend(enriched_levels(&shuffled(levels, seed), v, false, &mut n));
    step.extend(ramps(&mut n, top, v));
    step.extend(tare(&mut n));
    Protocol { name: "B".into(), sample_hz: 10.0, step }
}

/// Protocol C: B with a tare after every level, half an hour of vented rest, and the first level once more. Its checks of the
/// bench are in [`crate::checks`].
pub(crate) fn complete(muscle: &Muscle, levels: &[f64], seed: u64) -> Protocol {
    let (v, mut n) = (slow(muscle, levels), 0);
    let top = levels.iter().copied().fold(0.0, f64::max);
    let order = shuffled(levels, seed);
    let mut step = tare(&mut n);
    step.extend(enriched_levels(&order, v, true, &mut n));
    step.extend(ramps(&mut n, top, v));
    step.push(Step::Rest { seconds: 1800.0 });
    step.extend(tare(&mut n));
    step.extend(enriched_levels(&order[..order.len().min(1)], v, true, &mut n));
    Protocol { name: "C".into(), sample_hz: 10.0, step }
}

/// Protocol D, the minimal upgrade of A: shuffled levels with one repeated, two loops and a pair of 30 s dwells each, speeds
/// 4 and 16 on two levels, one set of nested loops, tares at both ends.
pub fn upgraded(muscle: &Muscle, levels: &[f64], seed: u64) -> Protocol {
    let (v, mut n) = (slow(muscle, levels), 0);
    let order = shuffled(levels, seed);
    let mut step = tare(&mut n);
    for (i, &p) in order.iter().enumerate() {
        step.extend([set(p, 2.0), file(&mut n, &level_name(p)), loops(2, v)]);
        step.extend([go(0.5, v), Step::Hold { seconds: 30.0 }]);
        step.extend([go(0.9, 4.0 * v), go(0.5, v), Step::Hold { seconds: 30.0 }, go(0.0, 4.0 * v)]);
        if i == 1 || i == 4 {
            step.extend([loops(2, 4.0 * v), loops(3, 16.0 * v)]);
        }
        if i == 2 {
            for part in [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0] {
                step.push(go(part, 4.0 * v));
            }
        }
        step.push(Step::EndFile);
    }
    step.extend(tare(&mut n));
    Protocol { name: "D".into(), sample_hz: 10.0, step }
}

/// Lengths at which muscles are held, as parts of the free stroke.
const HELD: [f64; 3] = [0.0, 0.25, 0.5];

/// For each held length what is recorded there, in a file of its own. The highest pressure comes first.
fn held(
    name: &str,
    sample_hz: f64,
    muscle: &Muscle,
    levels: &[f64],
    parts: &[f64],
    there: impl Fn(f64) -> Vec<Step>,
) -> Protocol {
    let (v, mut n) = (slow(muscle, levels), 0);
    let top = levels.iter().copied().fold(0.0, f64::max);
    let mut step = Vec::new();
    for part in parts {
        step.extend([set(top, 1.0), go(*part, 4.0 * v)]);
        step.push(file(&mut n, &format!("held_{:02.0}percent", part * 100.0)));
        step.extend(there(top));
        step.push(Step::EndFile);
    }
    Protocol { name: name.into(), sample_hz, step }
}

/// Pressure staircases up and down at held lengths (parts of the free stroke), as in the recordings of commercial muscles.
fn staircases(name: &str, muscle: &Muscle, levels: &[f64], parts: &[f64]) -> Protocol {
    held(name, 20.0, muscle, levels, parts, |top| {
        let up: Vec<f64> = (0..=10).map(|i| top * f64::from(i) / 10.0).collect();
        let there_and_back = up.iter().chain(up.iter().rev().skip(1));
        there_and_back
            .map(|&p| Step::Pressure { to_kpa: p * 1e-3, rate_kpa_s: None, settle_s: 6.0 })
            .collect()
    })
}

/// Pressure staircases up and down at three held lengths.
pub fn staircase(muscle: &Muscle, levels: &[f64]) -> Protocol {
    staircases("staircase", muscle, levels, &HELD)
}

/// Pressure ramps at held lengths: at three rates over the whole range, then over parts of it, with a rest under pressure.
fn held_ramps(name: &str, muscle: &Muscle, levels: &[f64], parts: &[f64]) -> Protocol {
    held(name, 10.0, muscle, levels, parts, |top| {
        let to = |part: f64, seconds: f64, settle_s: f64| Step::Pressure {
            to_kpa: part * top * 1e-3,
            rate_kpa_s: Some(top * 1e-3 / seconds),
            settle_s,
        };
        let mut step = Vec::new();
        for seconds in [25.0, 25.0, 10.0, 60.0] {
            step.extend([to(0.0, seconds, 2.0), to(1.0, seconds, 2.0)]);
        }
        step.extend([0.3, 0.8, 0.5, 0.7].map(|part| to(part, 25.0, 2.0)));
        step.extend([to(0.0, 25.0, 2.0), to(0.6, 25.0, 40.0), to(1.0, 25.0, 2.0)]);
        step
    })
}

/// A protocol by name: `thesis`, `A`, `B`, `C`, `D`, `staircase`; at one held length `one-staircase` and `one-ramps`, at three `ramps`.
pub fn by_name(name: &str, muscle: &Muscle, levels: &[f64], seed: u64) -> Option<Protocol> {
    Some(match name {
        "thesis" => thesis(muscle, levels),
        "A" => classic(muscle, levels),
        "B" => enriched(muscle, levels, seed),
        "C" => complete(muscle, levels, seed),
        "D" => upgraded(muscle, levels, seed),
        "staircase" => staircase(muscle, levels),
        "one-staircase" => staircases(name, muscle, levels, &[0.0; 3]),
        "one-ramps" => held_ramps(name, muscle, levels, &HELD[..1]),
        "ramps" => held_ramps(name, muscle, levels, &HELD),
        _ => return None,
    })
}
