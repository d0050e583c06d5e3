//! Recordings that no one here made come in through the import descriptions of `examples`. Where the data are not present
//! (they are not part of the project) these tests say that they skipped.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::{Path, PathBuf};

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, Clock, Import, Reader};
use pam_diagnose::Options as Diagnosing;
use pam_diagnose::history::diagnose;
use pam_diagnose::remark::Remark;
use pam_evaluate::length_transfer::predict_unseen_length;
use pam_fit::points;
use pam_fit::pressures;
use pam_fit::{Options, fit};

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

fn read(folder: &str, file: &str, import: &str, muscle: &str) -> Option<Campaign> {
    let path = project().join("../shared/data").join(folder).join(file);
    if !path.exists() {
        eprintln!("skipped: {} is not here", path.display());
        return None;
    }
    let import = Import::read(project().join("examples/imports").join(import)).unwrap();
    let muscle = MuscleDescription::read(project().join("examples/muscles").join(muscle)).unwrap();
    Some(Reader::of(&muscle).import(Some(&import)).campaign([path]).unwrap())
}

#[test]
fn every_muscle_of_2022_has_its_settled_points() {
    let rest = [83, 132, 182, 233, 281, 382];
    let mut rows = 0;
    for mm in rest {
        let muscle = format!("festo10-2022-{mm}mm.toml");
        let Some(campaign) =
            read("aarl-festo-10mm-2022", "settled_points.csv", "festo-2022-settled.toml", &muscle)
        else {
            return;
        };
        assert_eq!(campaign.recordings.len(), 12, "four lengths of three runs");
        assert_eq!(campaign.clock, Clock::Separate);
        assert_eq!(campaign.warnings, Vec::<String>::new());
        assert!(campaign.recordings.iter().all(|r| r.held_stroke().is_some() && r.force.is_some()));
        let spread = pressures(&points(&Screened::of(&campaign), &Motion::of_campaign(&campaign)), 620e3);
        assert!(!spread.held, "{:?}", spread.levels);
        rows += campaign.samples();
    }
    assert_eq!(rows, 3925);
}

#[test]
fn every_muscle_of_2021_has_its_settled_points() {
    let mut rows = 0;
    for name in ["13cm", "23cm", "27cm", "29cm", "30cm"] {
        let muscle = format!("festo10-2021-{name}.toml");
        let Some(campaign) =
            read("aarl-festo-10mm-2021", "settled_points.csv", "festo-2021-settled.toml", &muscle)
        else {
            return;
        };
        assert!([30, 40].contains(&campaign.recordings.len()), "{}", campaign.recordings.len());
        rows += campaign.samples();
    }
    assert_eq!(rows, 18_027);
}

#[test]
fn the_pressure_alone_distinguishes_filling_from_emptying() {
    for mm in [83, 182, 382] {
        let muscle = format!("festo10-2022-{mm}mm.toml");
        let Some(campaign) =
            read("aarl-festo-10mm-2022", "settled_points.csv", "festo-2022-settled.toml", &muscle)
        else {
            return;
        };
        for mut recording in campaign.recordings {
            let commanded = recording.direction.take().unwrap();
            let found = Motion::of(&recording).direction;
            let wrong: Vec<usize> = (0..commanded.len()).filter(|i| commanded[*i] != found[*i]).collect();
            // The file contains the valve's command. At the top the command to empty comes up to one period before the pressure
            // falls, and it is the pressure that the muscle feels.
            let top = commanded.iter().position(|d| *d < 0).unwrap();
            assert!(
                wrong.iter().all(|i| *i == top || *i + 1 == top),
                "{}: {wrong:?}, top {top}",
                recording.name
            );
        }
    }
}

#[test]
fn staircases_come_in_with_the_list_of_their_runs() {
    let Some(a) = read(
        "aarl-festo-10mm-2022",
        "festo10_cut200mm.csv",
        "festo-2022-staircase.toml",
        "festo10-2022-182mm.toml",
    ) else {
        return;
    };
    assert_eq!((a.recordings.len(), a.samples()), (12, 36_000));
    let held: Vec<i64> =
        a.recordings.iter().map(|r| (r.held_stroke().unwrap() * 1e6).round() as i64).collect();
    assert_eq!(held, [0, 0, 0, 7500, 7500, 7500, 15_000, 15_000, 15_000, 22_500, 22_500, 22_500]);
    let Some(b) = read(
        "aarl-festo-10mm-2021",
        "festo10_rest281mm_29cm.csv",
        "festo-2021-staircase.toml",
        "festo10-2021-29cm.toml",
    ) else {
        return;
    };
    assert_eq!(b.recordings.len(), 40);
    assert!(b.recordings.iter().any(|r| (r.stroke[0] - 0.041).abs() < 1e-9));
}

#[test]
fn a_muscle_that_is_not_in_the_file_is_reported() {
    let path = project().join("../shared/data/aarl-festo-10mm-2022/settled_points.csv");
    if !path.exists() {
        eprintln!("skipped: {} is not here", path.display());
        return;
    }
    let import = Import::read(project().join("examples/imports/festo-2022-settled.toml")).unwrap();
    let error = Reader::with_rest_length(0.1).import(Some(&import)).file(&path).unwrap_err();
    assert!(error.to_string().starts_with("no row passes the filters for a muscle of 100 mm"), "{error}");
    assert!(error.advice().unwrap().contains("83, 132, 182"), "{error:?}");
}

#[test]
fn the_thesis_raw_form_comes_in_with_its_units() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("03_345kPa.txt");
    let mut text =
        "Test\tmini\npressure\t50\nFile\t3\nTime\tDisplacement\tCommand\tLoad\nsec\tin\tin\tV\n".to_owned();
    for i in 0..100 {
        let stroke_mm = 3.0 * (1.0 - (f64::from(i - 50).abs() / 50.0));
        let force = 80.0 - 20.0 * stroke_mm;
        let crosshead = 1.25 - stroke_mm / 25.4;
        text += &format!(
            "{:.4}\t{crosshead:.6}\t0\t{:.8}\n",
            f64::from(i) / 30.0,
            force / (508.41 * 4.448_221_615_260_5)
        );
    }
    std::fs::write(&path, text).unwrap();
    let import = Import::read(project().join("examples/imports/thesis.toml")).unwrap();
    let campaign = Reader::new().import(Some(&import)).campaign([&path]).unwrap();
    let recording = &campaign.recordings[0];
    assert_eq!(recording.pressure[0], 345e3);
    let close = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() < tolerance, "{a} {b}");
    close(recording.stroke[50], 3.0e-3, 0.1e-3);
    close(recording.force.as_ref().unwrap()[0], 80.0, 1e-3);
    close(recording.force.as_ref().unwrap()[50], 20.0, 1e-3);
    close(recording.stroke[0], 0.0, 0.15e-3);
    assert_eq!(Motion::of(recording).reversals.len(), 2);
}

/// Effective dimensions are found, not stumbled upon: what two of three runs give hardly depends on which two.
#[test]
fn dimensions_from_two_of_three_runs_are_those_from_the_others() {
    let options = Options { fit_geometry: true, fit_lengths: true, ..Options::default() };
    for name in ["festo10-2022-83mm.toml", "festo10-2022-382mm.toml"] {
        let Some(campaign) =
            read("aarl-festo-10mm-2022", "settled_points.csv", "festo-2022-settled.toml", name)
        else {
            return;
        };
        let muscle = MuscleDescription::read(project().join("examples/muscles").join(name)).unwrap();
        let blocked: Vec<f64> = ["8", "9", "10"]
            .map(|run| {
                let kept =
                    campaign.recordings.iter().filter(|r| r.labels.iter().all(|(_, value)| value != run));
                let part = Campaign { recordings: kept.cloned().collect(), ..campaign.clone() };
                assert_eq!(part.recordings.len(), 8, "{name} without run {run}");
                fit(&part, &muscle, &options).unwrap().summary.blocked_force_N
            })
            .into();
        let (low, high) = blocked.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), b| (l.min(*b), h.max(*b)));
        println!("{name}: {blocked:.1?} N");
        assert!(high < 1.06 * low, "{name}: {blocked:?} N");
    }
}

/// Recordings at held lengths whose description is inexact: without options, dimensions and lengths are fitted, and the table is usable.
#[test]
fn held_lengths_have_their_dimensions_fitted_without_an_option() {
    for name in ["festo10-2022-83mm.toml", "festo10-2022-182mm.toml"] {
        let Some(campaign) =
            read("aarl-festo-10mm-2022", "settled_points.csv", "festo-2022-settled.toml", name)
        else {
            return;
        };
        let muscle = MuscleDescription::read(project().join("examples/muscles").join(name)).unwrap();
        let fitted = fit(&campaign, &muscle, &Options::default()).unwrap();
        let kept = fit(&campaign, &muscle, &Options { as_described: true, ..Options::default() }).unwrap();
        assert!(!fitted.summary.adjusted.is_empty(), "{name}: {:?}", fitted.summary.warnings);
        assert!(
            fitted.summary.rms_N < 0.7 * kept.summary.rms_N,
            "{name}: {} {}",
            fitted.summary.rms_N,
            kept.summary.rms_N
        );
        assert_eq!(fitted.summary.faults, Vec::<String>::new(), "{name}");
    }
}

/// Muscles of one stock predict each other's lengths: percent of blocked force, mean over the muscles, with bounds on both sides.
#[test]
fn a_length_that_was_not_recorded_is_predicted_from_the_others() {
    let options = Options { fit_geometry: true, fit_lengths: true, ..Options::default() };
    for (year, muscles, bounds) in [
        ("2022", &["83mm", "132mm", "182mm", "233mm", "281mm", "382mm"][..], 3.0..3.5),
        ("2021", &["13cm", "23cm", "27cm", "29cm", "30cm"][..], 3.0..3.5),
    ] {
        let mut cases = Vec::new();
        for name in muscles {
            let description = format!("festo10-{year}-{name}.toml");
            let import = format!("festo-{year}-settled.toml");
            let folder = format!("aarl-festo-10mm-{year}");
            let Some(campaign) = read(&folder, "settled_points.csv", &import, &description) else { return };
            let path = project().join("examples/muscles").join(&description);
            let muscle = MuscleDescription::read(path).unwrap();
            let fitted = fit(&campaign, &muscle, &options).unwrap();
            cases.push((muscle, campaign, fitted));
        }
        let percent = |i: usize| {
            let (muscle, campaign, own) = &cases[i];
            let others: Vec<_> =
                cases.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, c)| &c.2).collect();
            let clip = own.solution.problem.clips.0.map(|c| c.force);
            let carried = predict_unseen_length(&others, campaign, muscle, clip).unwrap();
            println!("{}: end effect {:.1} mm by the others", muscle.name, carried.end_effect * 1e3);
            100.0 * carried.score.mean() / own.summary.blocked_force_N
        };
        let mean = (0..cases.len()).map(percent).sum::<f64>() / cases.len() as f64;
        println!("{year}: {mean:.2} %");
        assert!(bounds.contains(&mean), "{year}: {mean} %");
    }
}

/// A run whose force is in another unit, and spikes of the pressure, are not a reason to see no memory in the others, and none of these readings
/// is taken for an error.
#[test]
fn failing_sensors_leave_the_memory_of_the_other_readings() {
    let muscle = "festo10-2022-182mm.toml";
    let Some(campaign) =
        read("aarl-festo-10mm-2022", "festo10_cut200mm.csv", "festo-2022-staircase.toml", muscle)
    else {
        return;
    };
    let muscle = MuscleDescription::read(project().join("examples/muscles").join(muscle)).unwrap();
    let (mut pounds, mut spikes) = (campaign.clone(), campaign);
    if let Some(force) = &mut pounds.recordings[4].force {
        force.iter_mut().for_each(|f| *f /= 4.448_222);
    }
    for recording in &mut spikes.recordings {
        (50..recording.len()).step_by(311).for_each(|i| recording.pressure[i] += 2e6);
    }
    for (name, campaign) in [("pounds", pounds), ("spikes", spikes)] {
        let answer = diagnose(&campaign, &muscle.geometry(), &Diagnosing::default()).unwrap();
        assert_eq!(answer.missing[0].effect, "log-creep", "{name}: {:?}", answer.missing);
        assert!(answer.noise_N < 2.0, "{name}: {} N", answer.noise_N);
        assert!(
            answer.remarks.iter().any(|r| matches!(r, Remark::Screening(_))),
            "{name}: {:?}",
            answer.remarks
        );
        let blocked = fit(&campaign, &muscle, &Options::default()).unwrap().summary.blocked_force_N;
        assert!((380.0..440.0).contains(&blocked), "{name}: blocked force {blocked} N");
    }
}
