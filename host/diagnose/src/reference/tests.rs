//! Known answers on synthetic staircases, which share no code with what is tested.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use super::answer::{NotComparable, Remark, Since};
use super::shapes::{Change, Owner};
use super::{Against, ChangeReport, Mounted, Options, Verdict, compare};
use crate::tests::added::AddedName;
use pam_data::recording::{Campaign, Recording};

/// Strokes of the mountings, m.
const STROKES: [f64; 5] = [0.0, 0.008, 0.018, 0.012, 0.024];

/// A force that is slack below a threshold which grows with the stroke, N.
fn force(pressure: f64, stroke: f64, direction: f64) -> f64 {
    let above = (pressure - 40e3 - 6e6 * stroke) / 30e3;
    let pull = 30e3 * (above.min(30.0).exp().ln_1p() + (above - 30.0).max(0.0));
    7.5e-4 * pull * (1.0 - 9.0 * stroke) - 3.0 * direction * pull / 600e3
}

/// A run of filling and emptying with creep, a little of its own, and noise.
fn run(mounting: usize, number: usize, change: &dyn Fn(f64, f64, f64, f64) -> (f64, f64)) -> Recording {
    let mut state = (17 + 31 * mounting + 101 * number) as u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let own = 0.4 * uniform();
    let x = STROKES[mounting];
    let mut r = Recording {
        name: format!("m{mounting} r{number}"),
        source: format!("r{number}.csv").into(),
        ..Recording::default()
    };
    let mut forces = Vec::new();
    for i in 0..600 {
        let t = 0.1 * f64::from(i);
        let (p, d) =
            if i < 300 { (8e3 + 2e3 * f64::from(i), 1.0) } else { (608e3 - 2e3 * f64::from(i - 300), -1.0) };
        let creep = 0.002 * (1.0 + t + 70.0 * number as f64).ln();
        let f = force(p, x, d) * (1.0 + creep) + own + 0.6 * uniform();
        let slope = (force(p, x + 1e-4, d) - force(p, x - 1e-4, d)) / 2e-4;
        let (dp, df) = change(p, f, d, slope);
        r.time.push(t);
        r.pressure.push(p + dp);
        r.stroke.push(x);
        forces.push(f + df);
    }
    r.force = Some(forces);
    r
}

fn untouched(_: f64, _: f64, _: f64, _: f64) -> (f64, f64) {
    (0.0, 0.0)
}

/// Runs from one number to another at the first mountings, in the order of their times.
fn campaign(
    mountings: usize,
    runs: std::ops::Range<usize>,
    change: &dyn Fn(f64, f64, f64, f64) -> (f64, f64),
) -> Campaign {
    Campaign::new(
        runs.flat_map(|n| (0..mountings).map(move |m| (m, n))).map(|(m, n)| run(m, n, change)).collect(),
    )
}

fn ask(change: &dyn Fn(f64, f64, f64, f64) -> (f64, f64), mounted: Mounted) -> ChangeReport {
    let before = campaign(3, 0..3, &untouched);
    let after = campaign(3, 3..6, change);
    compare(&after, Against::Recordings(&before), &Options { mounted, ..Options::default() }).unwrap()
}

fn size(report: &ChangeReport, name: &str) -> f64 {
    assert_eq!(
        report.missing.iter().map(|m| m.effect.as_str()).collect::<Vec<_>>(),
        [name],
        "{:?}",
        report.probabilities
    );
    report.missing[0].parameters[0].value
}

#[test]
fn nothing_changed_is_an_answer_with_sizes_that_would_have_been_seen() {
    let report = ask(&untouched, Mounted::Same);
    assert_eq!(report.verdict, Verdict::Consistent, "{:?}", report.probabilities);
    assert!(report.missing.is_empty() && report.r#where.is_empty());
    let offset = report.considered.iter().find(|c| c.effect == "force-offset").unwrap();
    assert!(offset.detectable.is_some_and(|d| d > 0.5 && d < 12.0), "{offset:?}");
}

#[test]
fn changes_of_three_per_cent_are_named_with_their_size() {
    let offset = size(&ask(&|_, _, _, _| (0.0, 13.0), Mounted::Same), "force-offset");
    assert!((offset - 13.0).abs() < 2.0, "{offset}");
    let rubbing = size(&ask(&|_, _, d, _| (0.0, -11.0 * d), Mounted::Same), "coulomb-friction");
    assert!((rubbing - 11.0).abs() < 2.0, "{rubbing}");
    let gauge = size(&ask(&|_, _, _, _| (-22e3, 0.0), Mounted::Same), "gauge-offset");
    assert!((gauge + 22e3).abs() < 4e3, "{gauge}");
    let moved = size(&ask(&|_, _, _, s| (0.0, 2.5e-3 * s), Mounted::Same), "displacement-offset");
    assert!((moved - 2.5e-3).abs() < 0.6e-3, "{moved}");
}

#[test]
fn a_named_change_is_gone_on_recordings_held_out_and_its_interval_holds_it() {
    let report = ask(&|_, _, _, _| (0.0, 13.0), Mounted::Same);
    let h = &report.held_out;
    assert!(h.rms_after_N < 0.4 * h.rms_before_N, "{h:?}");
    let s = &report.missing[0].parameters[0];
    assert!(s.low < 13.0 && s.high > 13.0, "{s:?}");
}

#[test]
fn a_shift_of_the_clamp_is_not_a_change_where_the_actuator_was_remounted() {
    let anew = ask(&|_, _, _, s| (0.0, 0.7e-3 * s), Mounted::Anew);
    assert!(anew.missing.is_empty(), "{:?}", anew.probabilities);
    assert!(anew.reference.mounted_anew);
    // The answer explains a difference of this size, and names the option that makes a change of it.
    assert!(anew.misfit_rms_N > 2.0 * anew.noise_N, "{} {}", anew.misfit_rms_N, anew.noise_N);
    assert!(anew.remarks.contains(&Remark::WithinMounting), "{:?}", anew.remarks);
    assert!(!ask(&untouched, Mounted::Anew).remarks.contains(&Remark::WithinMounting));
}

#[test]
fn the_same_recordings_on_both_sides_and_other_units_are_refused() {
    let before = campaign(3, 0..3, &untouched);
    let error = compare(&before, Against::Recordings(&before), &Options::default()).unwrap_err();
    assert!(error.cause().contains("both sides"), "{error}");
    let pounds = campaign(3, 3..6, &|_, f, _, _| (0.0, f / 4.448_222 - f));
    let error = compare(&pounds, Against::Recordings(&before), &Options::default()).unwrap_err();
    assert!(error.cause().contains("lbf"), "{error}");
}

#[test]
fn other_lengths_are_reported_and_none_in_common_is_an_error_with_both_lists() {
    let before = campaign(2, 0..3, &untouched);
    let report =
        compare(&campaign(3, 3..6, &untouched), Against::Recordings(&before), &Options::default()).unwrap();
    assert!(
        report
            .reference
            .not_comparable
            .iter()
            .any(|n| matches!(n, NotComparable::Stroke { stroke, .. } if (stroke - 0.018).abs() < 1e-9)),
        "{:?}",
        report.reference.not_comparable
    );
    let elsewhere = Campaign::new((3..5).map(|n| run(2, n, &untouched)).collect());
    let error = compare(&elsewhere, Against::Recordings(&before), &Options::default()).unwrap_err();
    assert!(error.advice().is_some_and(|a| a.contains("0.0, 8.0") && a.contains("18.0")), "{error}");
}

#[test]
fn one_run_on_each_side_is_answered_with_a_note_and_finite_numbers() {
    let (before, after) = (campaign(1, 0..1, &untouched), campaign(1, 1..2, &untouched));
    let report = compare(&after, Against::Recordings(&before), &Options::default()).unwrap();
    assert!(report.missing.is_empty(), "{:?}", report.probabilities);
    assert!(report.remarks.contains(&Remark::NothingTwice), "{:?}", report.remarks);
    assert!(report.reference.not_comparable.contains(&NotComparable::OneLength));
    assert!(report.misfit_rms_N.is_finite() && report.reference.repeatability_N > 0.0);
}

#[test]
fn a_frozen_sensor_and_a_lost_force_are_errors() {
    let before = campaign(1, 0..2, &untouched);
    let mut dead = campaign(1, 2..4, &untouched);
    for r in &mut dead.recordings {
        r.force = Some(vec![5.0; r.time.len()]);
    }
    assert!(compare(&dead, Against::Recordings(&before), &Options::default()).is_err());
    dead.recordings.iter_mut().for_each(|r| r.force = None);
    assert!(compare(&dead, Against::Recordings(&before), &Options::default()).is_err());
}

/// AFTER at one length that the reference does not have, beside two that it has.
fn at_another_length(mounting: usize, change: &dyn Fn(f64, f64, f64, f64) -> (f64, f64)) -> ChangeReport {
    let before = campaign(3, 0..3, &untouched);
    let runs = (3..6).flat_map(|n| [0, 2, mounting].map(|m| (m, n)));
    let after = Campaign::new(runs.map(|(m, n)| run(m, n, change)).collect());
    let options = Options { mounted: Mounted::Same, ..Options::default() };
    compare(&after, Against::Recordings(&before), &options).unwrap()
}

#[test]
fn a_length_between_those_of_the_reference_is_interpolated_with_its_error() {
    let report = at_another_length(3, &untouched);
    assert!(report.missing.is_empty(), "{:?}", report.probabilities);
    let error = report.remarks.iter().find_map(|r| match r {
        Remark::Interpolated { stroke, error } if (stroke - 0.012).abs() < 1e-6 => Some(*error),
        _ => None,
    });
    assert!(error.is_some_and(|e| e > 0.0), "{error:?}");
    assert!(!report.reference.not_comparable.iter().any(|n| matches!(n, NotComparable::Stroke { .. })));
}

#[test]
fn a_length_beyond_those_of_the_reference_is_not_compared() {
    let report = at_another_length(4, &untouched);
    assert!(report.reference.not_comparable.iter().any(|n| matches!(n, NotComparable::Stroke { .. })));
    assert!(!report.remarks.iter().any(|r| matches!(r, Remark::Interpolated { .. })));
}

/// A zero of 13 N that `factor` gives its size over the time of AFTER, s.
fn zero_over_time(factor: impl Fn(f64) -> f64) -> ChangeReport {
    let before = campaign(3, 0..3, &untouched);
    let mut after = campaign(3, 3..6, &untouched);
    let mut begin = 0.0;
    for r in &mut after.recordings {
        let zeros = r.time.iter().map(|t| 13.0 * factor(begin + t)).collect::<Vec<f64>>();
        r.force.as_mut().unwrap().iter_mut().zip(zeros).for_each(|(f, z)| *f += z);
        begin += r.duration();
    }
    let options = Options { mounted: Mounted::Same, ..Options::default() };
    compare(&after, Against::Recordings(&before), &options).unwrap()
}

#[test]
fn a_zero_that_steps_within_a_recording_is_named_as_a_zero() {
    // Nine recordings of 60 s; the step is in the middle of the fifth. A step within the recordings is not compared with a drift.
    let report = zero_over_time(|t| f64::from(u8::from(t > 270.0)));
    let named = report.missing[0].effect.as_str();
    assert!(["force-offset", "force-drift"].contains(&named), "{:?}", report.probabilities);
}

#[test]
fn a_change_that_was_there_or_grew_is_no_step() {
    assert_eq!(zero_over_time(|_| 1.0).missing[0].since, Since::Beginning);
    let grown = zero_over_time(|t| ((t - 180.0) / 180.0).max(0.0));
    let Since::Gradual(from) = &grown.missing[0].since else { panic!("{:?}", grown.missing[0].since) };
    assert!(from.low < 180.0 && from.high > 180.0, "{from:?}");
}

/// A slip of the clamp that only the recordings `slipped` of AFTER have, counted from 0 in the order of their times.
fn slip(mountings: usize, slipped: &[usize]) -> ChangeReport {
    let before = campaign(mountings, 0..3, &untouched);
    let all = (3..6).flat_map(|n| (0..mountings).map(move |m| (m, n))).enumerate();
    let moved = |_: f64, _: f64, _: f64, slope: f64| (0.0, 4e-3 * slope);
    let one = |(k, (m, n)): (usize, (usize, usize))| {
        if slipped.contains(&k) { run(m, n, &moved) } else { run(m, n, &untouched) }
    };
    let after = Campaign::new(all.map(one).collect());
    let options = Options { mounted: Mounted::Same, ..Options::default() };
    compare(&after, Against::Recordings(&before), &options).unwrap()
}

#[test]
fn a_slip_is_not_judged_on_recordings_before_it() {
    // The last recording alone has it: there is none to hold out.
    let last = slip(2, &[5]);
    assert_eq!(last.missing.first().map(|m| m.effect.as_str()), Some("end-slip"), "{last:?}");
    // The last two have it, and each is judged by the other.
    let two = slip(3, &[7, 8]);
    assert_eq!(two.missing.first().map(|m| m.effect.as_str()), Some("end-slip"), "{:?}", two.probabilities);
    assert!(two.held_out.share_where_shown > 0.5, "{:?}", two.held_out);
}

#[test]
fn a_change_of_an_effect_of_one_file_and_one_line_is_compared_with_a_reference() {
    let before = campaign(3, 0..3, &untouched);
    let mut after = campaign(3, 3..6, &untouched);
    let (mut begin, duration) = (0.0, after.recordings.iter().map(Recording::duration).sum::<f64>());
    for r in &mut after.recordings {
        let times = r.time.clone();
        r.force
            .as_mut()
            .unwrap()
            .iter_mut()
            .zip(times)
            .for_each(|(f, t)| *f *= 1.0 - 0.08 * (begin + t) / duration);
        begin += r.duration();
    }
    let asked = |added: Vec<Change>| {
        let options = Options { mounted: Mounted::Same, added, ..Options::default() };
        compare(&after, Against::Recordings(&before), &options).unwrap()
    };
    let without = asked(Vec::new());
    assert_eq!(without.missing[0].effect, "force-gain", "{:?}", without.probabilities);
    let with = asked(vec![Change::Added(AddedName::GainFade)]);
    let gain = size(&with, "gain-fade");
    assert!((gain + 0.08).abs() < 0.02, "{gain}");
    assert!(matches!(with.missing[0].since, Since::Gradual(_)) && with.missing[0].owner == Owner::Sensor);
    // One that did not change is considered with the size that would have been seen.
    let options = Options {
        mounted: Mounted::Same,
        added: vec![Change::Added(AddedName::GainFade)],
        ..Options::default()
    };
    let same = compare(&campaign(3, 3..6, &untouched), Against::Recordings(&before), &options).unwrap();
    let considered = same.considered.iter().find(|c| c.effect == "gain-fade").unwrap();
    assert!(considered.detectable.is_some_and(|d| d < 0.1), "{considered:?}");
}
