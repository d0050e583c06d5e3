//! What changed between strokes of a cylinder whose seal was swapped: recordings of which the truth is known.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::path::PathBuf;

use pam_data::recording::{Campaign, Reader};
use pam_diagnose::reference::shapes::Class;
use pam_diagnose::reference::{Against, ChangeReport, Options, Verdict, compare};

fn campaign(configuration: &str) -> Campaign {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/tudelft-printed-cylinder");
    Reader::new()
        .campaign([1, 3, 5, 7].map(|bar| folder.join(format!("{configuration}_{bar}bar.csv"))))
        .unwrap()
}

fn ask(before: &str, after: &str) -> ChangeReport {
    compare(&campaign(after), Against::Recordings(&campaign(before)), &Options::default()).unwrap()
}

#[test]
fn another_seal_and_a_larger_bore_are_friction_and_gain() {
    let report = ask("pk", "x-ring257");
    let mut classes: Vec<Class> = report.missing.iter().map(|m| m.class).collect();
    classes.sort();
    assert_eq!(classes, [Class::Gain, Class::Friction], "{:?}", report.probabilities);
    let gain = report.missing.iter().find(|m| m.class == Class::Gain).unwrap();
    // (25.7 / 25.0)² is 5.7 % more area.
    assert!((0.03..0.08).contains(&gain.parameters[0].value), "{gain:?}");
    let friction = report.missing.iter().find(|m| m.class == Class::Friction).unwrap();
    assert!(friction.parameters[0].value > 0.0, "the X-ring rubs more: {friction:?}");
    assert!(report.held_out.rms_after_N < report.held_out.rms_before_N);
}

#[test]
fn a_rerun_is_not_named() {
    let report = ask("rerun_2_o-ring257", "rerun_3_o-ring257");
    assert_eq!(report.verdict, Verdict::Consistent, "{:?}", report.probabilities);
    assert!(report.missing.is_empty());
}

#[test]
fn the_other_way_round_the_gain_is_lost_again() {
    let report = ask("x-ring257", "pk");
    let gain = report.missing.iter().find(|m| m.class == Class::Gain).unwrap();
    assert!((-0.08..-0.03).contains(&gain.parameters[0].value), "{gain:?}");
}

#[test]
fn a_residual_above_the_spread_of_reruns_is_reported() {
    let before = campaign("rerun_2_o-ring257");
    let mut after = campaign("rerun_3_o-ring257");
    // A load cell that yields softly at its end is not a change of the list; gain and friction take most of it, but not all.
    for recording in &mut after.recordings {
        let end = 290.0;
        recording.force.iter_mut().flatten().for_each(|f| *f = end * (*f / end).tanh());
    }
    let report = compare(&after, Against::Recordings(&before), &Options::default()).unwrap();
    assert!(!report.missing.is_empty() && report.held_out.share_where_shown > 0.5, "{:?}", report.held_out);
    assert!(report.held_out.rms_after_N > 2.0 * report.noise_N);
    assert_eq!(report.verdict, Verdict::PartlyExplained);
}
