//! Force against pressure at a few held lengths, as most laboratories record it, and tables that are useless for control.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use bench_campaign::{description, recordings};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Reader, Recording};
use pam_fit::table_file::{About, TableFile};
use pam_fit::{Options, fit};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::presets;

use crate::bench_campaign;

/// Pressure staircases at three held lengths; the stroke is the nominal one, as on a bench without a displacement sensor.
fn staircases(spec: &MuscleSpec, seed: u64) -> Campaign {
    let muscle = Muscle::new(spec.clone());
    let protocol = campaigns::staircase(&muscle, &campaigns::levels(&muscle));
    let files = Bench::new(&BenchSpec::laboratory(spec.clone(), seed)).run(&protocol).unwrap();
    let mut all = recordings(&files);
    for r in &mut all {
        let middle = r.stroke[r.len() / 2];
        r.stroke.fill(middle);
    }
    Campaign::new(all)
}

/// The bench's muscle with a braid angle that is wrong by a number of degrees.
fn described(spec: &MuscleSpec, degrees: f64) -> MuscleDescription {
    let mut muscle = description(spec);
    muscle.braid_angle_deg += degrees;
    muscle
}

#[test]
fn described_dimensions_stay_where_others_describe_the_force_no_better() {
    let spec = presets::contractile();
    let campaign = staircases(&spec, 1);
    let muscle = described(&spec, 1.0);
    let fitted = fit(&campaign, &muscle, &Options::default()).unwrap();
    let kept = fit(&campaign, &muscle, &Options { as_described: true, ..Options::default() }).unwrap();
    assert!(fitted.summary.adjusted.is_empty(), "{:?}", fitted.summary.adjusted);
    assert_eq!(fitted.summary.rms_N, kept.summary.rms_N);
    let text = fitted.summary.to_string() + &fitted.summary.warnings.join("\n");
    assert!(text.contains("held lengths (3 mountings)"), "{text}");
    for advice in ["longer stroke", "slow stroke"] {
        assert!(!text.contains(advice), "{advice:?} is not advice for held lengths: {text}");
    }
}

/// Negative friction or deadband says that the described dimensions are wrong, also where the misfit hardly changes.
#[test]
fn a_table_without_faults_is_taken_where_other_dimensions_give_one() {
    let spec = presets::contractile();
    let campaign = staircases(&spec, 1);
    for degrees in [-6.0, -4.5, -3.0, -1.5, 1.5, 3.0, 4.5, 6.0] {
        let muscle = described(&spec, degrees);
        let of = |options: Options| {
            fit(&campaign, &muscle, &options).map_or_else(|e| vec![e.to_string()], |f| f.summary.faults)
        };
        let open = of(Options { fit_geometry: true, fit_lengths: true, ..Options::default() });
        let taken = of(Options::default());
        assert!(taken.is_empty() || !open.is_empty(), "{degrees}°: {taken:?}");
    }
}

/// Fitted dimensions can make up for a factor of the force; then only the described ones show it.
#[test]
fn a_force_in_another_unit_is_reported_though_fitted_dimensions_describe_it() {
    let spec = presets::contractile();
    let warns = |per_newton: f64| {
        let mut recordings = staircases(&spec, 1).recordings;
        recordings.iter_mut().flat_map(|r| r.force.iter_mut().flatten()).for_each(|f| *f *= per_newton);
        let found = fit(&Campaign::new(recordings), &description(&spec), &Options::default()).unwrap();
        found.summary.warnings.iter().any(|w| w.contains("what the described braid makes"))
    };
    assert!(warns(1.0 / 9.806_65) && !warns(1.0));
}

#[test]
fn mountings_of_equal_length_are_separated_by_their_labels() {
    let spec = presets::contractile();
    let mut all = Vec::new();
    for label in ["first", "second"] {
        for (run, mut r) in staircases(&spec, 2).recordings.into_iter().enumerate() {
            r.labels = vec![("condition".into(), format!("{label}{run}")), ("run".into(), "1".into())];
            r.time.iter_mut().for_each(|t| *t += if label == "second" { 1e4 } else { 0.0 });
            all.push(r);
        }
    }
    let options = Options { fit_lengths: true, ..Options::default() };
    let fitted = fit(&Campaign::new(all), &description(&spec), &options).unwrap();
    assert_eq!(fitted.solution.problem.mountings.len(), 6);
    assert_eq!(fitted.summary.recordings.len(), 6);
    assert_eq!(fitted.summary.recordings[4].recording, "second1, run 1");
}

/// Recordings as one file, one after another.
fn one_file(path: &Path, recordings: &[Recording]) {
    let mut text = String::from("time_s,pressure_kPa,displacement_mm,force_N\n");
    let mut start = 0.0;
    for r in recordings {
        for (i, t) in r.time.iter().enumerate() {
            let (p, x, f) = (r.pressure[i] / 1e3, r.stroke[i] * 1e3, r.require_force().unwrap()[i]);
            writeln!(text, "{:.6},{p},{x},{f}", start + t - r.time[0]).unwrap();
        }
        start += r.duration() + 0.01;
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn one_file_of_several_lengths_gives_the_table_of_separate_files() {
    let spec = presets::contractile();
    let campaign = staircases(&spec, 1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("staircases.csv");
    // The first length again at the end.
    let mut visits = campaign.recordings.clone();
    visits.push(visits[0].clone());
    one_file(&path, &visits);
    let read = Reader::new().campaign(&[path]).unwrap();
    let titles: Vec<String> = read.recordings.iter().map(Recording::title).collect();
    assert_eq!(titles.len(), 4, "{titles:?}");
    assert!(titles[0].ends_with(" mm, run 1") && titles[3].ends_with(" mm, run 2"), "{titles:?}");
    let muscle = description(&spec);
    let [one, separate] =
        [read, Campaign::new(visits)].map(|c| fit(&c, &muscle, &Options::default()).unwrap());
    let of = |f: &pam_fit::Fit| (f.summary.deadband_kPa, f.summary.rms_N);
    let ((p, rms), (separate_p, separate_rms)) = (of(&one), of(&separate));
    assert!((p - separate_p).abs() < 0.01, "{p} and {separate_p} kPa");
    assert!((rms / separate_rms - 1.0).abs() < 0.01, "{rms} and {separate_rms} N");
}

/// A sensor of the stroke with 20 µm of noise: the lengths are held nevertheless, and the one at rest length is no further length.
#[test]
fn noise_of_the_stroke_sensor_hides_no_held_length() {
    let spec = presets::contractile();
    let mut campaign = staircases(&spec, 1);
    let rest = campaign.recordings[0].stroke[0];
    let mut noisy = campaign.clone();
    let mut row = 0.0_f64;
    for (clean, r) in campaign.recordings.iter_mut().zip(&mut noisy.recordings) {
        clean.stroke.iter_mut().for_each(|x| *x -= rest);
        for (x, clean) in r.stroke.iter_mut().zip(&clean.stroke) {
            row += 1.0;
            // The sum of three uniform numbers is nearly normal.
            let uniform = |k: f64| (43_758.5 * (12.9898 * row + k).sin()).rem_euclid(1.0) - 0.5;
            *x = clean + 40e-6 * (uniform(0.0) + uniform(1.0) + uniform(2.0));
        }
    }
    let muscle = description(&spec);
    let [clean, noisy] = [campaign, noisy].map(|c| fit(&c, &muscle, &Options::default()).unwrap());
    assert_eq!(noisy.solution.problem.points.held_lengths().len(), 3);
    let rank = |f: &pam_fit::Fit| f.solution.problem.design.orthonormal.rank;
    assert_eq!(rank(&noisy), rank(&clean));
    let (p, clean_p) = (noisy.summary.deadband_kPa, clean.summary.deadband_kPa);
    assert!((p - clean_p).abs() < 3.0, "P0 {p} kPa, without noise {clean_p} kPa");
}

/// Runs that repeat are condensed while dimensions are searched for.
#[test]
fn dimensions_from_runs_that_repeat_are_those_of_one_run() {
    let spec = presets::contractile();
    let campaign = staircases(&spec, 1);
    let options = Options { fit_geometry: true, fit_lengths: true, ..Options::default() };
    let [once, often] = [1, 12].map(|times| {
        let mut all = Vec::new();
        for run in 0..times {
            for mut r in campaign.recordings.clone() {
                r.labels = vec![("run".into(), run.to_string())];
                r.time.iter_mut().for_each(|t| *t += 1e3 * f64::from(run));
                all.push(r);
            }
        }
        fit(&Campaign::new(all), &described(&spec, 2.0), &options).unwrap()
    });
    assert!(!once.summary.adjusted.is_empty());
    for (a, b) in once.summary.adjusted.iter().zip(&often.summary.adjusted) {
        let (few, many) = (a.value, b.value);
        // The search ends where a step gains less than a ten-thousandth.
        assert!((few - many).abs() < 0.01 * few.abs() + 0.02, "{}: {few} once, {many} often", a.name);
    }
}

#[test]
fn the_report_draws_the_fitted_lengths() {
    let spec = presets::contractile();
    let mut campaign = staircases(&spec, 3);
    // The tape measure is off by 0.8 mm at one length.
    campaign.recordings[1].stroke.iter_mut().for_each(|x| *x += 0.8e-3);
    let options = Options { fit_lengths: true, ..Options::default() };
    let fitted = fit(&campaign, &description(&spec), &options).unwrap();
    let page = pam_report::fit_page::page(&fitted, &campaign, &options);
    let figure = |id: &str| page.figures().find(|f| f.id == id).unwrap();
    assert!(figure("load-lines").reading.contains("fitted ones"));
    for layer in &figure("errors").panels[0].layers {
        if let pam_report::Mark::Series { x, .. } = &layer.mark {
            assert!(x.windows(2).all(|w| w[0] < w[1]), "one error for each pressure: {x:?}");
        }
    }
    let pam_report::Mark::Series { y: residuals, .. } = &figure("residuals").panels[0].layers[0].mark else {
        panic!("each point is drawn");
    };
    let rms = (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt();
    assert!(
        residuals.len() > 20 && rms < 2.0 * fitted.summary.rms_N,
        "{rms} N drawn, {} N fitted",
        fitted.summary.rms_N
    );
}

fn host(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr) + String::from_utf8_lossy(&output.stdout);
    (output.status.code().unwrap(), said.into_owned())
}

#[test]
fn a_useless_table_is_refused_by_check() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = TableFile { table: model_core::table::example(), about: About::default() };
    file.write(folder.path().join("good.pam")).unwrap();
    assert_eq!(host(folder.path(), &["table", "check", "good.pam"]).0, 0);
    file.table.friction.iter_mut().for_each(|k| *k = -0.2);
    file.write(folder.path().join("bad.pam")).unwrap();
    let (status, said) = host(folder.path(), &["table", "check", "bad.pam"]);
    assert_eq!(status, 1, "{said}");
    assert!(said.contains("not usable") && said.contains("negative friction"), "{said}");
    let (status, said) = host(folder.path(), &["table", "check", "--json", "bad.pam"]);
    assert_eq!(status, 1);
    assert!(said.contains("\"valid\": false"), "{said}");
}

#[test]
fn a_useless_table_is_written_on_request_only() {
    let folder = tempfile::tempdir().unwrap();
    let spec = presets::miniature();
    let muscle = Muscle::new(spec.clone());
    let mut protocol = campaigns::thesis(&muscle, &[207e3, 345e3, 483e3]);
    protocol.sample_hz = 8.0;
    let files = Bench::new(&BenchSpec::laboratory(spec.clone(), 3)).run(&protocol).unwrap();
    std::fs::write(folder.path().join("m.toml"), spec.description()).unwrap();
    let mut names = Vec::new();
    for r in recordings(&files) {
        // A pressure sensor whose zero is 150 kPa too low: the muscle seems to pull below ambient pressure.
        let mut text = "time_s,pressure_kPa,displacement_mm,force_N\n".to_owned();
        for i in 0..r.len() {
            let force = r.force.as_ref().unwrap()[i];
            text += &format!("{},{},{},{force}\n", r.time[i], r.pressure[i] / 1e3 - 150.0, r.stroke[i] * 1e3);
        }
        let name = format!("{}.csv", r.name);
        std::fs::write(folder.path().join(&name), text).unwrap();
        names.push(name);
    }
    let call = |more: &[&'static str]| {
        let mut arguments = vec!["fit", "--muscle", "m.toml", "-o", "t.pam"];
        arguments.extend(names.iter().map(String::as_str));
        arguments.extend(more);
        host(folder.path(), &arguments)
    };
    let (status, said) = call(&[]);
    assert_eq!(status, 1, "{said}");
    assert!(said.contains("fit::implausible") && said.contains("P0 is -"), "{said}");
    assert!(!folder.path().join("t.pam").exists());
    assert_eq!(call(&["--force"]).0, 0);
    assert_eq!(host(folder.path(), &["table", "check", "t.pam"]).0, 1);
}

/// A file of three runs: `--where` picks by list and by exclusion, `compare` picks one each, `-` is standard input.
#[test]
fn runs_of_one_file_are_picked_by_list_exclusion_and_side() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "run,t_s,pressure_kPa,stroke_mm,force_N\n".to_owned();
    for run in 1..=3 {
        for i in 0..40 {
            text += &format!("{run},{},300,{},{}\n", f64::from(i) * 0.1, f64::from(i) * 0.05, 40 - i + run);
        }
    }
    std::fs::write(folder.path().join("all.csv"), &text).unwrap();
    std::fs::write(folder.path().join("i.toml"), "split_by = [\"run\"]\n").unwrap();
    let compare = |more: &[&'static str]| {
        let mut arguments = vec!["compare", "--import", "i.toml", "all.csv", "all.csv"];
        arguments.extend(more);
        host(folder.path(), &arguments)
    };
    let (status, said) = compare(&[]);
    assert_eq!(status, 2, "{said}");
    assert!(said.contains("3 recordings: run 1; run 2; run 3") && said.contains("--where-a run=1"), "{said}");
    let (status, said) = compare(&["--where-a", "run=1", "--where-b", "run!=1,2"]);
    assert_eq!(status, 0, "{said}");
    assert!(said.contains("2.0"), "runs 1 and 3 differ by 2 N: {said}");
}
