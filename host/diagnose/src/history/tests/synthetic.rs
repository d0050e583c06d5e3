//! A muscle with and without memory.

use super::super::additional_effect::AdditionalEffect;
use super::super::answer::FindingKind;
use super::super::{History, found, history};
use crate::linear::Random;
use model_core::braid::Geometry;
use model_core::effects::EffectName;
use model_core::table;
use pam_data::recording::{Campaign, Clock, Recording};
use pam_fit::bench::Candidate;

/// What a synthetic campaign is made of.
#[derive(Clone, Copy)]
struct Truth {
    share: f64,
    balance: f64,
    /// White noise of settled points, N.
    noise: f64,
    /// Noise with a memory of 6 s, N.
    slow: f64,
    /// Offset of each run, kPa.
    offsets: f64,
    /// Mounting and run (from 0) from which the pressure's effect is shifted, and by how much, kPa.
    slip: Option<(usize, usize, f64)>,
    runs: usize,
    /// Friction of the base model, as a share of the force.
    factor: f64,
    /// Friction of constant size, N.
    strand: f64,
}

const NO_MEMORY: Truth = Truth {
    share: 0.0,
    balance: 110.0,
    noise: 0.3,
    slow: 0.0,
    offsets: 0.0,
    slip: None,
    runs: 5,
    factor: 0.0,
    strand: 0.0,
};
const MEMORY: Truth = Truth { share: 0.6, ..NO_MEMORY };

pub(super) const THRESHOLDS: [f64; 3] = [80.0, 220.0, 340.0];
pub(super) const PAUSE: f64 = 12.0;
pub(super) const TIMES: [f64; 5] = [1.0, 10.0, 100.0, 1e3, 1e4];

/// Pressure of a staircase, kPa: pulses every half second, filling to 27 s, emptying to 50 s.
fn pressure(time: f64) -> f64 {
    let pulse = (time / 0.5).floor() + 1.0;
    if time < 27.0 { 630.0 * (1.0 - (-pulse / 12.0).exp()) } else { 630.0 * (-(pulse - 54.0) / 10.0).exp() }
}

/// A pull that begins softly at a threshold, N.
pub(super) fn pull(pressure: f64, threshold: f64) -> f64 {
    let x = (pressure - threshold) / 25.0;
    0.75 * 25.0 * if x > 30.0 { x } else { x.exp().ln_1p() }
}

fn campaign(truth: Truth, seed: u64) -> Campaign {
    let mut random = Random(seed);
    let mut recordings = Vec::new();
    for (m, threshold) in THRESHOLDS.iter().enumerate() {
        let carried = threshold - truth.balance;
        let mut states = [0.0_f64; 5];
        for run in 0..truth.runs {
            let mut offset = truth.offsets * random.normal();
            if let Some((mounting, from, shift)) = truth.slip {
                offset += if mounting == m && run >= from { shift } else { 0.0 };
            }
            let mut slow = truth.slow * random.normal();
            let (mut time, mut pressures, mut forces) = (Vec::new(), Vec::new(), Vec::new());
            // Explicit steps of 10 ms, apart from the exact steps of the code under test.
            let step = 0.01;
            for k in 0..((50.0 + PAUSE) / step) as usize {
                let t = k as f64 * step;
                let p = if t < 50.0 { pressure(t) } else { 0.0 };
                let engaged = ((p - 60.0) / carried.abs().max(60.0)).clamp(0.0, 1.0);
                for (z, tau) in states.iter_mut().zip(TIMES) {
                    *z += step / tau * (carried * engaged - *z);
                }
                if t < 50.0 && k % 50 == 42 {
                    let mean = states.iter().sum::<f64>() / 5.0;
                    slow = slow * (-0.5_f64 / 6.0).exp()
                        + truth.slow * (1.0 - (-1.0_f64 / 6.0).exp()).sqrt() * random.normal();
                    let free = pull(p + truth.share * mean + offset, *threshold);
                    let along = if t < 27.0 { -1.0 } else { 1.0 };
                    let force = free
                        + along * (truth.factor * free + truth.strand.min(free))
                        + slow
                        + truth.noise * random.normal();
                    time.push(t);
                    pressures.push(1e3 * p);
                    forces.push(force);
                }
            }
            recordings.push(Recording {
                name: format!("mounting {m}, run {run}"),
                stroke: vec![4e-3 * m as f64; time.len()],
                time,
                pressure: pressures,
                force: Some(forces),
                ..Recording::default()
            });
        }
    }
    Campaign::new(recordings)
}

pub(super) fn geometry() -> Geometry {
    table::example().geometry.cast()
}

fn diagnosed(campaign: &Campaign) -> History {
    history(campaign, &geometry()).expect("a campaign of staircases")
}

#[test]
fn share_and_stress_free_pressure_are_recovered() {
    let h = diagnosed(&campaign(MEMORY, 1));
    assert!(h.named, "{:?}", h.why_not);
    // The carried part counts from the threshold as it shows, which the memory itself has lowered: the product is what is determined.
    for (m, threshold) in h.mountings.iter().zip(THRESHOLDS).skip(1) {
        let (found, true_one) =
            (h.law.relaxed_share.value * m.carried_kPa, MEMORY.share * (threshold - MEMORY.balance));
        assert!((found / true_one - 1.0).abs() < 0.1, "{found} kPa, {true_one} kPa are true");
    }
    assert!((h.law.balance_pressure.value - MEMORY.balance).abs() < 15.0, "{:?}", h.law.balance_pressure);
    assert!(h.unseen.gain > 0.5 && h.law.one_time_constant_ratio > 1.1, "{:?}", h.law);
    assert!(
        h.of(FindingKind::FirstRunDeficit)
            .any(|f| f.found && f.cause == Some(Candidate::Muscle(EffectName::LogCreep)))
    );
    assert_eq!(h.of(FindingKind::Slip).chain(h.of(FindingKind::BadRun)).count(), 0);
}

#[test]
fn a_shuffled_order_of_runs_lowers_the_gain() {
    let ordered = campaign(MEMORY, 2);
    let mut shuffled = ordered.clone();
    for (m, first) in [0, MEMORY.runs, 2 * MEMORY.runs].into_iter().enumerate() {
        shuffled.recordings[first..first + MEMORY.runs].rotate_left(1 + m % 2);
    }
    let (a, b) =
        (diagnosed(&ordered).unseen.with_memory.rms_N, diagnosed(&shuffled).unseen.with_memory.rms_N);
    assert!(b > 1.3 * a, "{a} N in order, {b} N shuffled");
}

#[test]
fn campaigns_without_memory_are_not_named() {
    let slow = Truth { noise: 0.05, slow: 1.0, ..NO_MEMORY };
    let offsets = Truth { slow: 1.0, offsets: 1.0, ..NO_MEMORY };
    for seed in 0..6 {
        for (what, truth) in [("white noise", NO_MEMORY), ("slow noise", slow), ("offsets", offsets)] {
            let h = diagnosed(&campaign(truth, 100 + seed));
            assert!(!h.named && !h.why_not.is_empty(), "{what}, seed {seed}: {:?}", h.law.relaxed_share);
        }
    }
}

#[test]
fn dry_friction_alone_is_no_memory() {
    let mut c = campaign(NO_MEMORY, 3);
    for r in &mut c.recordings {
        if let Some(force) = &mut r.force {
            for (f, t) in force.iter_mut().zip(&r.time) {
                *f *= if *t < 27.0 { 0.95 } else { 1.05 };
            }
        }
    }
    let h = diagnosed(&c);
    assert!(!h.named, "{:?}", h.law.relaxed_share);
}

/// The friction that is named beside the memory.
fn friction(campaign: &Campaign) -> Option<AdditionalEffect> {
    found(campaign, &geometry()).expect("a campaign of staircases").needed
}

/// The same campaign by one clock, which gives the pauses.
fn clocked(truth: Truth, seed: u64) -> Campaign {
    let mut campaign = campaign(truth, seed);
    for (run, recording) in campaign.recordings.iter_mut().enumerate() {
        recording.time.iter_mut().for_each(|t| *t += (50.0 + PAUSE) * run as f64);
    }
    campaign.clock = Clock::Shared;
    campaign
}

#[test]
fn friction_beside_the_memory_is_named_with_its_size() {
    for seed in 0..3 {
        let needed = friction(&clocked(Truth { strand: 2.0, runs: 8, ..MEMORY }, 200 + seed));
        let needed = needed.unwrap_or_else(|| panic!("seed {seed}: not named"));
        assert_eq!(needed.effect, Candidate::Muscle(EffectName::CoulombFriction), "seed {seed}: {needed:?}");
        assert!((needed.value / 2.0 - 1.0).abs() < 0.4, "seed {seed}: {needed:?}");
    }
}

#[test]
fn no_friction_is_named_beyond_that_of_the_base_model() {
    let of_the_base = Truth { factor: 0.02, ..MEMORY };
    let slow = Truth { noise: 0.05, slow: 1.0, ..MEMORY };
    let offsets = Truth { slow: 1.0, offsets: 1.0, ..MEMORY };
    for seed in 0..5 {
        for (what, truth) in
            [("none", MEMORY), ("base", of_the_base), ("slow noise", slow), ("offsets", offsets)]
        {
            let needed = friction(&campaign(truth, 300 + seed));
            assert!(needed.is_none(), "{what}, seed {seed}: {needed:?}");
        }
    }
}

#[test]
fn the_gap_of_a_memory_is_not_put_down_to_friction() {
    for seed in 0..3 {
        let h = diagnosed(&campaign(MEMORY, 400 + seed));
        let gap = h.of(FindingKind::FillingEmptyingGap).next().expect("a gap");
        assert!(
            gap.found && gap.cause == Some(Candidate::Muscle(EffectName::LogCreep)),
            "seed {seed}: {gap:?}"
        );
        assert!(gap.alternatives.is_empty(), "seed {seed}: {gap:?}");
    }
}

#[test]
fn a_slip_is_found_at_its_run() {
    let h = diagnosed(&campaign(Truth { runs: 8, slip: Some((1, 4, 15.0)), ..MEMORY }, 4));
    let slips: Vec<_> = h.of(FindingKind::Slip).filter(|f| f.found).collect();
    assert_eq!(slips.len(), 1, "{:?}", h.findings);
    assert_eq!((slips[0].mounting, slips[0].run), (Some(2), Some(5)));
    assert!((slips[0].size.value - 15.0).abs() < 3.0, "{:?}", slips[0].size);
    assert!(h.unseen.with_slips.is_some_and(|e| e.rms_N < 0.9 * h.unseen.with_memory.rms_N));
}

#[test]
fn a_single_bad_run_is_named_and_a_clean_campaign_has_none() {
    let mut c = campaign(Truth { runs: 8, ..MEMORY }, 5);
    let bad = &mut c.recordings[8 + 5];
    if let Some(force) = &mut bad.force {
        for (f, p) in force.iter_mut().zip(&bad.pressure) {
            *f += pull(1e-3 * p + 20.0, THRESHOLDS[1]) - pull(1e-3 * p, THRESHOLDS[1]);
        }
    }
    let h = diagnosed(&c);
    let bad: Vec<_> = h.of(FindingKind::BadRun).map(|f| (f.mounting, f.run)).collect();
    assert_eq!(bad, [(Some(2), Some(6))], "{:?}", h.findings);
}

#[test]
fn loops_of_stroke_have_no_history() {
    let mut c = campaign(MEMORY, 6);
    for r in &mut c.recordings {
        r.stroke.iter_mut().enumerate().for_each(|(i, s)| *s += 1e-4 * i as f64);
    }
    assert!(history(&c, &geometry()).is_none());
}

#[test]
fn one_mounting_determines_a_share_but_no_stress_free_pressure() {
    let mut c = campaign(Truth { runs: 6, ..MEMORY }, 7);
    c.recordings.drain(..6);
    c.recordings.truncate(6);
    let h = diagnosed(&Campaign::new(c.recordings));
    assert!(!h.law.balance_identifiable && h.law.balance_pressure.low.is_none());
    assert_eq!(h.mountings.len(), 1);
}

#[test]
fn of_many_runs_groups_are_left_out_and_each_run_is_predicted() {
    let h = diagnosed(&campaign(Truth { runs: 20, ..MEMORY }, 8));
    assert_eq!(h.runs.len(), 60);
    assert_eq!(h.unseen.with_memory.points, h.points);
    assert!(h.named && h.unseen.gain > 0.5, "{:?}", h.unseen);
}
