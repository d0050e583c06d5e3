//! Checks of the bench: what dead weights, a rigid bar and a reference gauge show, and what a diagnosis makes of it.

use std::fmt::Write as _;
use std::path::PathBuf;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_diagnose::{Diagnosis, Options, diagnose};
use pam_fit::bench::BenchName;
use pam_fit::checks::Checks;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::checks::all;
use virtual_bench::muscle::Muscle;
use virtual_bench::{campaigns, presets};

use crate::bench_campaign;

fn bench() -> BenchSpec {
    BenchSpec::laboratory(presets::by_name("mini").expect("a preset"), 5)
}

/// The checks of a bench as files.
fn files(bench: &BenchSpec, folder: &tempfile::TempDir) -> Vec<PathBuf> {
    let written = all(bench, 120.0, 600e3, 0.0).into_iter().map(|check| {
        let path = folder.path().join(format!("{}.csv", check.name));
        std::fs::write(&path, check.csv).expect("room for a file");
        path
    });
    written.collect()
}

fn read(bench: &BenchSpec) -> Checks {
    let folder = tempfile::tempdir().expect("a folder");
    Checks::read(&files(bench, &folder)).expect("valid checks")
}

fn refused(text: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("check.csv");
    std::fs::write(&path, text).expect("room for a file");
    Checks::read(&[path]).expect_err("a bad check").to_string()
}

#[test]
fn every_fault_is_measured_within_its_interval_and_none_where_there_is_none() {
    let sound = read(&bench());
    assert_eq!(sound.measured().len(), 7);
    for m in sound.measured().iter().filter(|m| m.fault != BenchName::RigCompliance) {
        let size = match m.fault {
            BenchName::Backlash => m.parameters[1] / 1e-5,
            BenchName::DisplacementOffset => m.parameters[0] / 1e-5,
            BenchName::CrossTalk => m.parameters[0] / 1e-6,
            // Noise of 0.1 N.
            BenchName::Gravity => m.parameters[0] / 1e-2,
            _ => m.parameters[0] / 2e-3,
        };
        assert!(size.abs() < 1.0, "{}: {}", m.fault.info().name, m.text);
    }
    let mut faulty = bench();
    faulty.instruments.force.gain = 0.03;
    faulty.instruments.pressure.gain = -0.02;
    faulty.rig.stiffness = 3e5;
    faulty.rig.hose = 4e-6;
    faulty.rig.offset = 2e-4;
    faulty.rig.play = 1e-4;
    let checks = read(&faulty);
    for (fault, at, truth) in [
        (BenchName::ForceGain, 0, 0.03),
        (BenchName::CrossTalk, 0, 4e-6),
        (BenchName::GaugeGain, 0, 1.0 / 0.98 - 1.0),
        // The cell that reads the pull is itself three per cent off.
        (BenchName::RigCompliance, 0, 1.0 / 3e5 / 1.03),
        (BenchName::DisplacementOffset, 0, 2e-4),
        (BenchName::Backlash, 1, 1e-4),
    ] {
        let m = checks.measured().iter().find(|m| m.fault == fault).expect("measured");
        let std = m.deviations[at].expect("varied");
        let off = (m.parameters[at] - truth).abs();
        assert!(m.is_sure(), "{}", m.text);
        assert!(off < 3.0 * std + 0.01 * truth.abs(), "{}: {} for {truth}", m.text, m.parameters[at]);
        assert!(std < 0.1 * truth.abs(), "{}: {std} of {truth}", m.text);
    }
    // Alone: a weight in the load path loads the frame, and shows in what the rigid bar reads.
    let mut heavy = bench();
    heavy.rig.weight = 3.0;
    let checks = read(&heavy);
    let m = checks.measured().iter().find(|m| m.fault == BenchName::Gravity).expect("measured");
    assert!(m.is_sure() && (m.parameters[0] + 3.0 / 9.806_65).abs() < 1e-2, "{}", m.text);
}

#[test]
fn bad_checks_are_refused_with_the_place_and_what_to_do() {
    let rows = |row: &str| row.repeat(30);
    for (text, says) in [
        (format!("time_s,force_N\n{}", rows("0,1\n")), "no column of the reference"),
        ("time_s,force_N,reference_force_N\n0,1,1\n".to_owned(), "1 row;"),
        (
            format!("time_s,force_N,reference_force_N\n{}0,x,1\n", rows("0,1,1\n")),
            "line 32: `x` is not a number for `force_N`",
        ),
        (format!("time_s,force_N,reference_force_stone\n{}", rows("0,1,1\n")), "unknown unit of the column"),
        (format!("time_s,force_N,reference_force_N\n{}0,1\n", rows("0,1,1\n")), "line 32"),
        (format!("time_s,force_N,reference_force_N\n{}", rows("0,1,1\n")), "at least three different"),
        (format!("time_s,pressure_kPa,reference_force_N\n{}", rows("0,1,1\n")), "no column `force_`"),
        (format!("time_s,force_N,attached\n{}", rows("0,1,yes\n")), "line 2: `yes` is neither 1 nor 0"),
        (format!("time_s,force_N,attached\n{}", rows("0,1,1\n")), "do not separate the weight"),
    ] {
        let error = refused(&text);
        assert!(error.contains(says), "{error}");
    }
}

fn campaign(bench: &BenchSpec) -> Campaign {
    let muscle = Muscle::new(bench.muscle.clone());
    let protocol = campaigns::classic(&muscle, &campaigns::levels(&muscle));
    let files = Bench::new(bench).run(&protocol).expect("a protocol for this muscle");
    Campaign::new(bench_campaign::recordings(&files))
}

fn diagnosed(bench: &BenchSpec, checks: Checks) -> Diagnosis {
    let description = MuscleDescription::parse(&bench.muscle.description()).expect("a description");
    let options = Options { muscle: "mini".into(), checks, ..Options::default() };
    diagnose(&campaign(bench), &description.geometry(), &options).expect("a diagnosis")
}

#[test]
fn an_error_that_a_check_measured_is_the_only_name() {
    let mut faulty = bench();
    faulty.instruments.force.gain = 0.04;
    let answer = diagnosed(&faulty, read(&faulty));
    let named: Vec<&str> = answer.missing.iter().map(|m| m.effect.as_str()).collect();
    assert_eq!(named, ["force-gain"]);
    let gain = &answer.missing[0];
    assert!(gain.checked && gain.correction && gain.confusable_with.is_empty());
    assert!((gain.parameters[0].value - 0.04).abs() < 2e-3, "{:?}", gain.why);
    // What the checks cleared is reported as clear, with a bound.
    let cleared = answer.considered.iter().find(|c| c.effect == "gauge-gain").expect("looked at");
    let why_not = pam_report::wording::why_not(cleared);
    assert!(why_not.contains("a reference gauge"), "{why_not}");
    assert!(cleared.hidden_up_to_N.is_some_and(|h| h < 0.01 * answer.blocked_force_N));
    // A bench that is sound leaves the muscle's diagnosis as it was.
    let sound = bench();
    assert!(diagnosed(&sound, read(&sound)).missing.is_empty());
}

/// Where the load cell is noisy the recordings do not show a play; the bar shows it.
#[test]
fn a_play_that_a_rigid_bar_shows_is_named_where_it_matters() {
    for (play, matters) in [(20e-6, true), (2e-6, false)] {
        let mut loose = bench();
        loose.rig.play = play;
        loose.instruments.force.coloured = (1.0, 5.0);
        let without = diagnosed(&loose, Checks::default());
        assert!(without.missing.is_empty(), "{play}: {:?}", without.missing);
        let folder = tempfile::tempdir().expect("a folder");
        let bar: Vec<PathBuf> =
            files(&loose, &folder).into_iter().filter(|f| f.ends_with("rigid_bar.csv")).collect();
        let answer = diagnosed(&loose, Checks::read(&bar).expect("a check"));
        let named: Vec<(&str, bool)> =
            answer.missing.iter().map(|m| (m.effect.as_str(), m.checked)).collect();
        assert_eq!(named, if matters { vec![("backlash", true)] } else { Vec::new() }, "{play}");
    }
}

#[test]
fn weighing_shows_whether_a_constant_force_is_a_weight_or_a_wrong_zero() {
    let size = 0.04 * 120.0;
    let (mut heavy, mut offset) = (bench(), bench());
    heavy.rig.weight = size;
    offset.instruments.force.offset = size;
    for (bench, name) in [(heavy, "gravity"), (offset, "force-offset")] {
        let folder = tempfile::tempdir().expect("a folder");
        let weighing: Vec<PathBuf> =
            files(&bench, &folder).into_iter().filter(|f| f.ends_with("weighing.csv")).collect();
        let muscle = Muscle::new(bench.muscle.clone());
        let levels = campaigns::levels(&muscle);
        // The vented readings before and after show the constant.
        let mut protocol = campaigns::classic(&muscle, &levels);
        let tare = campaigns::enriched(&muscle, &levels, 1).step[..3].to_vec();
        protocol.step.splice(0..0, tare);
        let recorded = Bench::new(&bench).run(&protocol).expect("a protocol for this muscle");
        let campaign = Campaign::new(bench_campaign::recordings(&recorded));
        let description = MuscleDescription::parse(&bench.muscle.description()).expect("a description");
        let diagnosed = |checks: Checks| {
            let options = Options { muscle: "mini".into(), checks, ..Options::default() };
            diagnose(&campaign, &description.geometry(), &options).expect("a diagnosis").missing
        };
        let before = diagnosed(Checks::default());
        let possible: Vec<&String> =
            before.iter().flat_map(|m| std::iter::once(&m.effect).chain(&m.confusable_with)).collect();
        assert!(possible.iter().any(|n| *n == "gravity") && possible.iter().any(|n| *n == "force-offset"));
        let after = diagnosed(Checks::read(&weighing).expect("a check"));
        let named: Vec<&str> = after.iter().map(|m| m.effect.as_str()).collect();
        assert_eq!(named, [name]);
        assert!(after[0].confusable_with.is_empty(), "{:?}", after[0].confusable_with);
    }
}

/// Loops hardly distinguish a leak from a friction that differs between the directions, or from a gauge that reads too much.
#[test]
fn a_closed_valve_shows_whether_a_loss_of_pull_is_a_leak() {
    // The recordings do not show the smaller leak; the valve does.
    for leak in [0.05, 0.01, 0.0] {
        let mut bench = bench();
        bench.pneumatics.sensor_at_regulator = leak > 0.0;
        bench.pneumatics.leak = leak;
        let folder = tempfile::tempdir().expect("a folder");
        let closed: Vec<PathBuf> =
            files(&bench, &folder).into_iter().filter(|f| f.ends_with("closed_valve.csv")).collect();
        let checks = Checks::read(&closed).expect("a check");
        let answer = diagnosed(&bench, checks);
        let named: Vec<&str> = answer.missing.iter().map(|m| m.effect.as_str()).collect();
        if bench.pneumatics.leak > 0.0 {
            let found = answer.missing.iter().find(|m| m.effect == "leak").expect("a leak");
            assert!(found.confusable_with.is_empty(), "{:?}", found.confusable_with);
            assert!(leak < 0.05 || named == ["leak"], "{named:?}");
            assert_eq!(found.checked, leak < 0.05, "{:?}", found.why);
        } else {
            assert!(named.is_empty(), "{named:?}");
            let excluded = answer.considered.iter().find(|c| c.effect == "leak").expect("looked at");
            assert!(pam_report::wording::why_not(excluded).contains("closed valve"));
            assert!(excluded.hidden_up_to_N.is_some_and(|h| h < 0.0025 * answer.blocked_force_N));
        }
    }
}

/// Each stay is off by its own error, so that chance could still be the cause of what the check shows. It is not excluded for that.
#[test]
fn a_fault_that_a_check_shows_without_certainty_is_left_to_the_recordings() {
    let mut bench = bench();
    bench.rig.hose = 3e-5;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("dead_weights.csv");
    let mut text = String::from("time_s,force_N,reference_force_N,pressure_kPa\n");
    let errors = [1.6, -1.4, 0.3, -0.9, -1.7, 1.2, 0.8, -1.1];
    for (stay, error) in errors.into_iter().enumerate() {
        let (weight, pressure) = (40.0 * (stay / 2) as f64, 500.0 * (stay % 2) as f64);
        for row in 0..20 {
            let force = weight + bench.rig.hose * 1e3 * pressure + error;
            let _ = writeln!(text, "{},{force:.4},{weight},{pressure}", stay * 20 + row);
        }
    }
    std::fs::write(&path, text).expect("written");
    let checks = Checks::read(&[&path]).expect("a check");
    let thrust = checks.measured().iter().find(|m| m.fault == BenchName::CrossTalk).expect("a pressed line");
    assert!(thrust.is_likely() && !thrust.is_sure(), "{thrust:?}");
    let answer = diagnosed(&bench, checks);
    let named: Vec<&str> = answer.missing.iter().map(|m| m.effect.as_str()).collect();
    assert_eq!(named, ["cross-talk"]);
    assert!(answer.missing[0].confusable_with.is_empty(), "{:?}", answer.missing[0].confusable_with);
}

/// Each stay at a weight is off by its own error, as a cell that creeps is: the rows of a stay repeat it.
#[test]
fn few_stays_do_not_make_a_sound_load_cell_faulty() {
    let mut draw = StdRng::seed_from_u64(7);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("dead_weights.csv");
    let (mut sure, mut outside, checks) = (0, 0, 400);
    for _ in 0..checks {
        let mut text = String::from("time_s,force_N,reference_force_N\n");
        for (stay, weight) in [0.0, 50.0, 100.0, 150.0, 200.0, 100.0, 0.0].into_iter().enumerate() {
            // Irwin and Hall: the sum of twelve uniform numbers is nearly normal.
            let error: f64 = (0..12).map(|_| draw.random::<f64>() - 0.5).sum();
            for row in 0..5 {
                let _ = writeln!(text, "{},{},{weight}", stay * 5 + row, weight + error);
            }
        }
        std::fs::write(&path, text).expect("written");
        let measured = Checks::read(&[&path]).expect("a check");
        let gain = &measured.measured()[0];
        sure += usize::from(gain.is_sure());
        outside += usize::from(gain.parameters[0].abs() > gain.half_width(0));
    }
    // By the quantile of the normal distribution 3 of these 400 would be faulty.
    assert_eq!(sure, 0, "sound cells that count as faulty, of {checks}");
    assert!(outside <= checks / 10, "{outside} of {checks} intervals miss the truth");
}
