//! Recordings of a kind that a tidy campaign does not have: the fit gives the truth, or gives the reason why not.
//!
//! The truth is the thesis's own model (shared/model.md), written out here once more, so that only the recording is odd.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::f64::consts::PI;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Reader, Recording};
use pam_diagnose::diagnose;
use pam_fit::predict::{predict, to_csv};
use pam_fit::table_file::{About, TableFile};
use pam_fit::{Fit, Options, fit};

const REST: f64 = 39.16e-3;
const DEADBAND: f64 = 76.5e3;

fn description() -> MuscleDescription {
    let text = "name = \"mini\"\nkind = \"contractile\"\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
                bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n";
    toml::from_str(text).unwrap()
}

/// `k_F`, linear in pressure as the thesis found it.
fn friction(pressure: f64) -> f64 {
    0.14 - 0.093 * (pressure - 207e3) / 345e3
}

/// F of a pressure (Pa), a stroke (m) and a direction, N.
fn force(pressure: f64, stroke: f64, direction: f64) -> f64 {
    let (angle, diameter, wall) = (77.4_f64.to_radians(), 3e-3, 0.5e-3);
    let fibre = REST / angle.sin();
    let turns = fibre * angle.cos() / (PI * diameter);
    let volume = PI / 4.0 * REST * (diameter * diameter - (diameter - 2.0 * wall) * (diameter - 2.0 * wall));
    let length = REST - stroke;
    let radius = (fibre * fibre - length * length).sqrt() / (2.0 * PI * turns);
    let thickness = radius - (radius * radius - volume / (PI * length)).sqrt();
    let (radial, axial) = (radius / (diameter / 2.0) - 1.0, length / REST - 1.0);
    let about = (pressure - 380e3) / 172e3;
    let moduli = [
        2e6 * (1.0 + 0.2 * about),
        -3e6 * (1.0 + 0.3 * about),
        4e6 * (1.0 + 0.3 * about),
        -1.5e6 * (1.0 + 0.3 * about),
    ];
    let gaylord =
        (pressure - DEADBAND) * (3.0 * length * length - fibre * fibre) / (4.0 * PI * turns * turns);
    let elastic: f64 = (1..)
        .zip(moduli)
        .map(|(k, e)| {
            let hoop = thickness * length * length * radial.powi(k) / (2.0 * PI * turns * turns * radius);
            e * (volume / length * axial.powi(k) - hoop)
        })
        .sum();
    (gaylord + elastic) * (1.0 - friction(pressure) * direction)
}

/// Normal numbers of unit variance, correlated from one to the next by `memory`.
struct Noise {
    state: u64,
    memory: f64,
    last: f64,
}

impl Noise {
    fn new(seed: u64, memory: f64) -> Self {
        Self { state: seed, memory, last: 0.0 }
    }

    fn uniform(&mut self) -> f64 {
        self.state =
            self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        // Box and Muller: the tails of a sum of uniform numbers would be too short for a test of outliers.
        let normal = (-2.0 * self.uniform().ln()).sqrt() * (2.0 * PI * self.uniform()).cos();
        self.last = self.memory * self.last + (1.0 - self.memory * self.memory).sqrt() * normal;
        self.last
    }
}

/// Three strokes back and forth at a pressure, which ripples by `ripple` Pa. `turned` is how many rows before each reversal at rest
/// length friction has turned already.
fn strokes(
    level: f64,
    rows: usize,
    rate: f64,
    ripple: f64,
    turned: usize,
    noise: (f64, &mut Noise),
) -> Recording {
    let mut white = Noise::new(level as u64, 0.0);
    let mut r =
        Recording { force: Some(Vec::new()), name: format!("{:.0}", level / 1e3), ..Recording::default() };
    let phase = |i: usize| (i as f64 / rows as f64 * 3.0).fract();
    for i in 0..rows {
        let time = i as f64 / rate;
        let pressure = level + ripple * (2.0 * PI * 0.7 * time).sin();
        let stroke = 2.5e-3 * (1.0 - (1.0 - 2.0 * phase(i)).abs());
        let ahead = phase((i + turned).min(rows - 1));
        let direction = if phase(i) < 0.5 || ahead < 0.5 { 1.0 } else { -1.0 };
        r.time.push(time);
        r.pressure.push(pressure + 300.0 * white.next());
        r.stroke.push(stroke + 1e-6 * white.next());
        r.force.as_mut().unwrap().push(force(pressure, stroke, direction) + noise.0 * noise.1.next());
    }
    r
}

const SIX: [f64; 6] = [207e3, 276e3, 345e3, 414e3, 483e3, 552e3];

/// `P0` (Pa) within `deadband`, `k_F` within 0.005, and the friction-free force within `share` of blocked force.
fn assert_truth(found: &Fit, deadband: f64, share: f64) {
    let p0 = found.summary.deadband_kPa * 1e3;
    assert!((p0 - DEADBAND).abs() < deadband, "P0 {p0} Pa; {:?}", found.summary.warnings);
    for p in &found.summary.pressures {
        let pressure = p.pressure_kPa * 1e3;
        assert!((p.k_F - friction(pressure)).abs() < 0.005, "k_F {} at {pressure} Pa", p.k_F);
        let blocked = force(pressure, 0.0, 0.0);
        let off = (p.blocked_force_N - blocked).abs() / blocked;
        assert!(off < share, "blocked force off by {off} at {pressure} Pa");
    }
}

/// A row or two at each reversal belong to the other branch: the stroke turned between two samples, or the instruments are not in step to
/// the sample. They lie off by twice friction where the load line is steepest, and must not move the table.
#[test]
fn rows_of_the_other_branch_at_a_turn_move_nothing() {
    let mut noise = Noise::new(1, 0.0);
    let files = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 2, (0.05, &mut noise)));
    let found = fit(&Campaign::new(files.to_vec()), &description(), &Options::default()).unwrap();
    // Their influence on P0 is a few hundred pascals, less than a thousandth of the blocked force.
    assert_truth(&found, 400.0, 0.003);
    // Those rows are in the mid-line that the model is judged against, two in some twenty of a chunk.
    assert!(found.summary.max_error_pct < 2.0, "{}", found.summary.max_error_pct);
    assert_eq!(found.summary.outliers.len(), 0, "{:?}", found.summary.outliers);
}

/// Normal noise has no outliers, however many rows there are and however long it remembers.
#[test]
fn correlated_noise_has_no_outliers() {
    for memory in [0.0, 0.9, 0.995] {
        let mut noise = Noise::new(2, memory);
        let files = SIX.map(|p| strokes(p, 100_000, 1000.0, 0.0, 0, (0.5, &mut noise)));
        let found = fit(&Campaign::new(files.to_vec()), &description(), &Options::default()).unwrap();
        assert_eq!(found.summary.outliers.len(), 0, "memory {memory}: {:?}", found.summary.outliers);
        assert_truth(&found, 500.0, 0.005);
    }
}

/// Two pressures whose step is small against the regulator's ripple are two pressures, not a range.
#[test]
fn two_close_pressures_are_two_levels() {
    let mut noise = Noise::new(3, 0.0);
    let files = [300e3, 360e3].map(|p| strokes(p, 6000, 100.0, 1500.0, 0, (0.05, &mut noise)));
    let found = fit(&Campaign::new(files.to_vec()), &description(), &Options::default()).unwrap();
    let levels: Vec<f64> = found.summary.pressures.iter().map(|p| p.pressure_kPa.round()).collect();
    assert_eq!(levels, [300.0, 360.0]);
    assert_truth(&found, 500.0, 0.005);
}

/// At one length `P0` and elasticity are confounded: the fit reports it.
#[test]
fn one_held_length_determines_no_deadband() {
    let (mut force_noise, mut white) = (Noise::new(4, 0.0), Noise::new(5, 0.0));
    let mut r = Recording { force: Some(Vec::new()), ..Recording::default() };
    for i in 0..3000 {
        let phase = (f64::from(i) / 1000.0).fract();
        let pressure = 150e3 + 400e3 * (1.0 - (1.0 - 2.0 * phase).abs());
        let direction = if phase < 0.5 { 1.0 } else { -1.0 };
        r.time.push(f64::from(i) / 100.0);
        r.pressure.push(pressure + 300.0 * white.next());
        r.stroke.push(0.02 * REST + 1e-6 * white.next());
        r.force.as_mut().unwrap().push(force(pressure, 0.02 * REST, direction) + 0.05 * force_noise.next());
    }
    let found = fit(&Campaign::new(vec![r]), &description(), &Options::default()).unwrap();
    assert!(found.summary.warnings.iter().any(|w| w.contains("one length")), "{:?}", found.summary.warnings);
}

/// A length that is read again in each run is one length: three mountings determine no more coefficients than three lengths do, and a length
/// between them is predicted.
#[test]
fn a_mounting_whose_length_is_read_again_in_each_run_is_one_length() {
    let (mut noise, mut gauge) = (Noise::new(7, 0.0), Noise::new(8, 0.0));
    let mut run = |stroke: f64| {
        let mut r = Recording { force: Some(Vec::new()), ..Recording::default() };
        for i in 0..1000 {
            let phase = f64::from(i) / 1000.0;
            let pressure = 100e3 + 450e3 * (1.0 - (1.0 - 2.0 * phase).abs());
            let direction = if phase < 0.5 { 1.0 } else { -1.0 };
            r.time.push(f64::from(i) / 20.0);
            r.pressure.push(pressure);
            r.force.as_mut().unwrap().push(force(pressure, stroke, direction) + 0.2 * noise.next());
        }
        r.stroke = vec![stroke + 1e-5 * gauge.next(); r.time.len()];
        r
    };
    let runs =
        [0.0, 0.05, 0.1].iter().flat_map(|share| (0..3).map(|_| run(share * REST)).collect::<Vec<_>>());
    let found = fit(&Campaign::new(runs.collect()), &description(), &Options::default()).unwrap();
    let (p, stroke) = (500e3, 0.075 * REST);
    let unseen = Recording {
        time: vec![0.0, 0.05],
        pressure: vec![p; 2],
        stroke: vec![stroke; 2],
        direction: Some(vec![1; 2]),
        ..Recording::default()
    };
    let file = found.table_file("test".into());
    let predicted = predict(&file, &Campaign::new(vec![unseen])).unwrap().recordings[0].force[0];
    let (truth, blocked) = (force(p, stroke, 1.0), force(p, 0.0, 1.0));
    assert!((predicted - truth).abs() < 0.03 * blocked, "{predicted} N, {truth} N, blocked {blocked} N");
}

/// Readings in another unit, and readings of a loose plug, change only their own rows: in the table, in what it predicts, and in
/// the answer of a diagnosis.
#[test]
fn a_gauge_that_falls_out_does_no_harm() {
    let mut noise = Noise::new(6, 0.0);
    let clean = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise)));
    let mut spoiled = clean.clone();
    spoiled[1].pressure[220..260].iter_mut().for_each(|p| *p /= 6.894_757);
    for start in [300, 306, 320] {
        spoiled[4].pressure[start..start + 3].fill(0.0);
    }
    let (clean, spoiled) = (Campaign::new(clean.to_vec()), Campaign::new(spoiled.to_vec()));
    let found = fit(&spoiled, &description(), &Options::default()).unwrap();
    assert_truth(&found, 400.0, 0.003);
    assert_eq!(found.summary.rows.dropouts, 49);
    assert_eq!(found.summary.pressures.len(), SIX.len(), "no level that was not recorded");
    let remark = |all: &[String]| all.iter().find(|w| w.contains("49 rows excluded")).cloned();
    let said = remark(&found.summary.warnings).unwrap();
    assert!(said.contains("276 rows 221 to 260 (2.20 to 2.59 s) from 27"), "{said}");
    assert!(said.contains("483 rows 301 to 303 (3.00 to 3.02 s) from 48"), "{said}");

    let file = TableFile { table: found.table, about: About::default() };
    let foretold = predict(&file, &spoiled).unwrap();
    let rms = predict(&file, &clean).unwrap().rms.unwrap();
    assert!((foretold.rms.unwrap() / rms - 1.0).abs() < 0.02, "{:?} N beside {rms} N", foretold.rms);
    assert_eq!(remark(&foretold.warnings).as_ref(), Some(&said));

    let answer =
        |campaign| diagnose(campaign, &description().geometry(), &pam_diagnose::Options::default()).unwrap();
    let (with, without) = (answer(&spoiled), answer(&clean));
    assert_eq!((with.verdict(), with.missing.len()), (without.verdict(), without.missing.len()));
    assert!((with.misfit_rms_N / without.misfit_rms_N - 1.0).abs() < 0.05, "{} N", with.misfit_rms_N);
    assert_eq!(remark(&words(&with)).as_ref(), Some(&said));
}

fn words(answer: &pam_diagnose::Diagnosis) -> Vec<String> {
    answer.remarks.iter().map(pam_report::wording::remark).collect()
}

/// A whole recording in psi under a heading in kPa: reported, left out, and the rest as good as ever, in the fit, in what a table predicts
/// and in a diagnosis.
#[test]
fn a_recording_in_another_unit_does_no_harm() {
    let mut noise = Noise::new(7, 0.0);
    let clean = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise)));
    let mut recordings = clean.clone();
    recordings[3].pressure.iter_mut().for_each(|p| *p /= 6.894_757);
    let (clean, campaign) = (Campaign::new(clean.to_vec()), Campaign::new(recordings.to_vec()));
    let found = fit(&campaign, &description(), &Options::default()).unwrap();
    assert_truth(&found, 300.0, 0.003);
    assert_eq!((found.summary.pressures.len(), found.summary.samples), (SIX.len() - 1, 15_000));
    let remark = |all: &[String]| all.iter().find(|w| w.contains("the ratio of psi to kPa")).cloned();
    let said = remark(&found.summary.warnings).unwrap();

    let file = TableFile { table: found.table, about: About::default() };
    let (foretold, rms) = (predict(&file, &campaign).unwrap(), predict(&file, &clean).unwrap().rms.unwrap());
    assert!(foretold.recordings[3].rms.is_none(), "not scored");
    assert!((foretold.rms.unwrap() / rms - 1.0).abs() < 0.1, "{:?} N beside {rms} N", foretold.rms);
    assert_eq!(remark(&foretold.warnings).as_ref(), Some(&said));

    let answer = diagnose(&campaign, &description().geometry(), &pam_diagnose::Options::default()).unwrap();
    assert_eq!((answer.missing.len(), remark(&words(&answer))), (0, Some(said)));
}

/// A campaign that is wrong throughout cannot stand apart from itself; its fit says what it looks like.
#[test]
fn absolute_pressure_and_a_force_of_the_other_sign_are_reported() {
    let is_reported = |spoil: &dyn Fn(&mut Recording), word: &str| {
        let mut noise = Noise::new(8, 0.0);
        let mut recordings = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise))).to_vec();
        recordings.iter_mut().for_each(spoil);
        let found = fit(&Campaign::new(recordings), &description(), &Options::default()).unwrap();
        found.summary.warnings.iter().any(|w| w.contains(word))
    };
    let absolute = "absolute pressure";
    assert!(is_reported(&|r| r.pressure.iter_mut().for_each(|p| *p += 101_325.0), absolute));
    assert!(!is_reported(&|_| (), absolute));
    let sign = "positive as the muscle pulls";
    assert!(is_reported(&|r| r.force.iter_mut().flatten().for_each(|f| *f = -*f), sign));
    assert!(!is_reported(&|_| (), sign));
}

/// Where no table comes out, the error says by how much force and pressure disagree with the braid.
#[test]
fn a_campaign_in_another_unit_throughout_is_reported_by_how_much() {
    let mut noise = Noise::new(11, 0.0);
    let mut recordings = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise))).to_vec();
    recordings.iter_mut().for_each(|r| r.pressure.iter_mut().for_each(|p| *p /= 100.0));
    let error = fit(&Campaign::new(recordings), &description(), &Options::default()).unwrap_err();
    let advice = error.advice().unwrap();
    let times: f64 = advice.split_whitespace().find_map(|w| w.parse().ok()).unwrap();
    assert!((30.0..110.0).contains(&times) && advice.contains("what this braid makes"), "{advice}");
}

/// A recording in grams is named and left out, and the scale of the errors is that of the others.
#[test]
fn a_recording_in_grams_is_left_out_and_sets_no_scale() {
    let mut noise = Noise::new(13, 0.0);
    let mut recordings = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise))).to_vec();
    let summary =
        |all: &[_]| fit(&Campaign::new(all.to_vec()), &description(), &Options::default()).unwrap().summary;
    let largest = summary(&recordings).largest_force_N;
    recordings[2].force.iter_mut().flatten().for_each(|f| *f *= 1000.0 / 9.806_65);
    let odd = summary(&recordings);
    assert!(odd.warnings.iter().any(|w| w.contains("the ratio of N to gf")), "{:?}", odd.warnings);
    assert!((odd.largest_force_N / largest - 1.0).abs() < 0.05, "{} {largest}", odd.largest_force_N);
}

/// A motion that no braid permits is reported with the recording and the time.
#[test]
fn a_stroke_of_the_other_sign_is_reported_with_its_place() {
    let mut noise = Noise::new(9, 0.0);
    let mut recordings = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise))).to_vec();
    for r in &mut recordings {
        r.source = format!("{}.csv", r.name).into();
    }
    // One file among others is known by its disagreement, and left out.
    let mut one = recordings.clone();
    one[2].stroke.iter_mut().for_each(|x| *x = -*x);
    let message =
        fit(&Campaign::new(one), &description(), &Options::default()).unwrap().summary.warnings.join("; ");
    assert!(message.contains("its stroke agrees with theirs with the opposite sign"), "{message}");
    recordings.truncate(1);
    recordings[0].stroke.iter_mut().for_each(|x| *x = -*x);
    let error = fit(&Campaign::new(recordings.clone()), &description(), &Options::default()).unwrap_err();
    let place = format!("{}.csv", recordings[0].name);
    assert!(error.to_string().contains(&place) && error.to_string().contains(" mm at "), "{error}");
    assert!(error.advice().unwrap().contains("positive = \"extension\""), "{error:?}");
}

/// With decimal commas the output of a prediction is a table as well: no points among them.
#[test]
fn a_prediction_of_a_recording_with_decimal_commas_can_be_read_again() {
    let mut noise = Noise::new(10, 0.0);
    let recordings = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise)));
    let table = fit(&Campaign::new(recordings.to_vec()), &description(), &Options::default()).unwrap().table;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("european.csv");
    let rows = (0..40).map(|i| format!("0,{i:02};300,5;0,{i:02};40,25\n"));
    let text = "time_s;pressure_kPa;displacement_mm;force_N\n".to_owned() + &rows.collect::<String>();
    std::fs::write(&path, text).unwrap();
    let campaign = Reader::new().campaign([&path]).unwrap();
    let foretold = predict(&TableFile { table, about: About::default() }, &campaign).unwrap();
    std::fs::write(&path, to_csv(&campaign, &foretold, false).0).unwrap();
    let again = Reader::new().file(&path).unwrap().remove(0);
    assert_eq!((again.pressure[7], again.force.unwrap()[7]), (300.5e3, 40.25));
    let written = std::fs::read_to_string(&path).unwrap();
    let columns = written.lines().map(|l| l.split(',').count()).collect::<std::collections::HashSet<_>>();
    assert_eq!(columns.into_iter().collect::<Vec<_>>(), [5], "{written}");
}

/// The rig pushes the muscle against its contraction stop. Polynomials that followed the wall would be wrong where the muscle pulls; and
/// the wall is not noise, so that a diagnosis names it.
#[test]
fn a_contraction_stop_that_the_rig_pushes_against_is_named_and_does_not_bend_the_table() {
    let mut noise = Noise::new(8, 0.0);
    let mut recordings = SIX.map(|p| strokes(p, 3000, 100.0, 0.0, 0, (0.05, &mut noise)));
    for r in &mut recordings {
        for (force, stroke) in r.force.iter_mut().flatten().zip(&r.stroke) {
            *force -= 2e9 * (stroke - 2.3e-3).max(0.0).powi(2);
        }
    }
    let campaign = Campaign::new(recordings.to_vec());
    let found = fit(&campaign, &description(), &Options::default()).unwrap();
    // Between the stop and zero force the muscle pulls less than its polynomials can follow; elsewhere they are as good as ever.
    let highest = found.summary.pressures.last().unwrap();
    let blocked = force(SIX[5], 0.0, 0.0);
    let off = (highest.blocked_force_N - blocked).abs() / blocked;
    assert!(off < 0.02, "blocked force off by {off}");
    assert!((highest.k_F - friction(SIX[5])).abs() < 0.005, "k_F {}", highest.k_F);
    // 3.3 % where the polynomials follow the wall.
    assert!(found.summary.mean_error_pct < 2.8, "{} %", found.summary.mean_error_pct);
    let pushed = found.summary.warnings.iter().find(|w| w.contains("the rig pushes the muscle"));
    assert!(pushed.is_some(), "{:?}", found.summary.warnings);

    let answer = diagnose(&campaign, &description().geometry(), &pam_diagnose::Options::default()).unwrap();
    let names: Vec<&str> = answer.missing.iter().map(|m| m.effect.as_str()).collect();
    assert_eq!(names, ["strand-jamming"], "{:?}", words(&answer));
    let from = answer.missing[0].parameters.iter().find(|p| p.name == "jamming_contraction").unwrap().value;
    assert!((from - 2.3e-3 / REST).abs() < 0.003, "the strands jam at a contraction of {from}");
}

/// A muscle that hangs slack nearly everywhere leaves too few rows for an answer, and the answer states the reason.
#[test]
fn the_remarks_report_where_slack_rows_leave_too_few_to_judge() {
    let mut noise = Noise::new(9, 0.0);
    let mut recordings = SIX.map(|p| strokes(p, 40, 8.0, 0.0, 0, (0.05, &mut noise)));
    for r in &mut recordings {
        for (force, stroke) in r.force.iter_mut().flatten().zip(&r.stroke) {
            *force *= f64::from(u8::from(*stroke < 0.4e-3));
        }
    }
    let campaign = Campaign::new(recordings.to_vec());
    let answer = diagnose(&campaign, &description().geometry(), &pam_diagnose::Options::default()).unwrap();
    assert!(!answer.judged(), "{:?}", words(&answer));
    assert!(words(&answer).iter().any(|w| w.ends_with("muscle slack")), "{:?}", words(&answer));
}
