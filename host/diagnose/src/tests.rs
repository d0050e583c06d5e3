//! Nulls with noise that is anything but white, one effect of each kind from equations written here, and bad input.
//!
//! The force comes from a table muscle, friction and faults from plain formulas below, not from the library of effects.

pub(crate) mod added;
mod beginnings;
mod filtered;
pub(crate) mod held_length;
mod plays;
mod ramps;
mod together;

use model_core::braid::Geometry;
use model_core::muscle::Muscle;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};

use self::together::Wrong;
use super::linear::Random;
use super::outcome::Verdict;
use super::protocol_simulation::{Place, Protocol, Step, play};
use super::remark::Remark;
use super::why::Why;
use super::{Diagnosis, Options, diagnose, history, refitted_table};
use pam_data::muscle_description::{Kind, MuscleDescription};
use pam_data::recording::{Campaign, Recording};
use pam_data::statistics::quantile;
use pam_fit::predict::predict;
use pam_fit::table_file::TableFile;
use pam_fit::{Options as FitOptions, fit};

fn one_bladder() -> MuscleTable {
    let mut one_bladder = table::example();
    for curve in &mut one_bladder.elastic {
        let middle = curve[2];
        curve.iter_mut().for_each(|e| *e = middle);
    }
    one_bladder
}

pub(crate) fn muscle() -> Muscle<f64> {
    Muscle::build(&one_bladder()).expect("the example table")
}

pub(crate) fn geometry() -> Geometry {
    table::example().geometry.cast()
}

/// Classic loops: six pressures, three triangular cycles each, one or more speeds (mm/s).
pub(crate) fn loops(speeds: &[f64]) -> Campaign {
    loops_of(&muscle(), speeds)
}

fn loops_of(muscle: &Muscle<f64>, speeds: &[f64]) -> Campaign {
    let mut step = Vec::new();
    for p in [230.0, 290.0, 350.0, 410.0, 480.0, 550.0] {
        step.push(Step::Pressure { to_kpa: p, rate_kpa_s: Some(50.0), settle_s: 1.0 });
        step.push(Step::File { name: format!("{p:.0}kPa") });
        for v in speeds {
            let to = Place { free: Some(0.95), ..Place::default() };
            step.push(Step::Cycles { to, speed_mm_s: *v, count: if speeds.len() > 1 { 2 } else { 3 } });
        }
        step.push(Step::EndFile);
    }
    let protocol = Protocol { name: "loops".into(), sample_hz: 10.0, step };
    play(&protocol, muscle).expect("playable")
}

/// Puts friction of 8 %, an effect and noise on the forces. `effect` sees speed, direction and the friction-free force.
pub(crate) fn recorded(
    mut campaign: Campaign,
    seed: u64,
    noise: impl Fn(&mut Random, &mut [f64; 2]) -> f64,
    effect: impl Fn(f64, f64, f64) -> f64,
) -> Campaign {
    let mut random = Random(seed);
    for r in &mut campaign.recordings {
        let Recording { time, stroke, force: Some(force), .. } = r else { continue };
        let mut state = [0.0; 2];
        let mut sign = 1.0;
        for i in 0..force.len() {
            let j = i.max(1);
            let v = (stroke[j] - stroke[j - 1]) / (time[j] - time[j - 1]);
            if v != 0.0 {
                sign = f64::signum(v);
            }
            let quasi = force[i];
            force[i] = quasi * (1.0 - 0.08 * sign) + effect(v, sign, quasi) + noise(&mut random, &mut state);
        }
        for x in stroke.iter_mut() {
            *x += 1e-6 * random.normal();
        }
    }
    campaign
}

fn ask(campaign: &Campaign) -> Diagnosis {
    diagnose(campaign, &geometry(), &Options { muscle: "test".into(), ..Options::default() })
        .expect("an answer")
}

fn diagnosed_with(campaign: &Campaign, given: &[&str]) -> pam_data::error::Result<Diagnosis> {
    let given =
        given.iter().map(|n| pam_fit::bench::Candidate::from_name(n).expect("in the catalogue")).collect();
    diagnose(campaign, &geometry(), &Options { muscle: "test".into(), given, ..Options::default() })
}

fn names(d: &Diagnosis) -> Vec<&str> {
    d.missing.iter().map(|m| m.effect.as_str()).collect()
}

/// AR(1) of the given size and correlation time at 10 Hz.
pub(crate) fn coloured(size: f64, tau: f64) -> impl Fn(&mut Random, &mut [f64; 2]) -> f64 {
    let a = (-0.1 / tau).exp();
    move |r, s| {
        s[0] = a * s[0] + size * (1.0 - a * a).sqrt() * r.normal();
        s[0] + 0.3 * size * r.normal()
    }
}

#[test]
fn correlated_noise_is_not_named() {
    for seed in 0..4 {
        let d = ask(&recorded(loops(&[0.2]), seed, coloured(0.3, 10.0), |_, _, _| 0.0));
        assert_eq!(d.verdict(), Verdict::Consistent, "seed {seed}: {:?}", names(&d));
        assert!(d.missing.is_empty());
    }
}

/// Stiffness in proportion to the pressure is what tables are for: where noise hides what distinguishes it from an effect, no effect is named.
#[test]
fn a_bladder_that_stiffens_with_the_pressure_is_not_named() {
    let mut stiffening = one_bladder();
    let top = stiffening.nodes[stiffening.nodes.len() - 1];
    for curve in &mut stiffening.elastic {
        curve.iter_mut().zip(&stiffening.nodes).for_each(|(e, p)| *e *= 0.5 + p / top);
    }
    let muscle = Muscle::build(&stiffening).expect("a table");
    for seed in 3..6 {
        let d = ask(&recorded(loops_of(&muscle, &[0.5]), seed, coloured(0.4, 6.0), |_, _, _| 0.0));
        assert_eq!(names(&d), Vec::<&str>::new(), "seed {seed}: {:?}", d.verdict());
    }
}

#[test]
fn strokes_that_do_not_repeat_are_not_consistent() {
    let strongest = |c: &Campaign| {
        c.recordings.iter().filter_map(|r| r.force.as_deref()).flatten().copied().fold(0.0, f64::max)
    };
    let loops = loops(&[0.2]);
    let largest = strongest(&loops);
    for (share, verdict) in [(0.003, Verdict::Consistent), (0.01, Verdict::Unexplained)] {
        let d = ask(&recorded(loops.clone(), 21, coloured(share * largest, 2.0), |_, _, _| 0.0));
        assert_eq!((d.verdict(), names(&d)), (verdict, vec![]), "{share}: {:?}", d.remarks);
        let said = d.remarks.iter().any(|r| matches!(r, Remark::NotRepeatable(_)));
        assert_eq!(said, verdict == Verdict::Unexplained, "{share}");
        assert_eq!(d.unconfirmed(), [], "{share}");
    }
    // A sensor's own white noise is not physics, however coarse the sensor.
    let d = ask(&recorded(loops, 22, |random, _| 0.01 * largest * random.normal(), |_, _, _| 0.0));
    assert_eq!((d.verdict(), names(&d)), (Verdict::Consistent, vec![]), "{:?}", d.remarks);
}

#[test]
fn a_force_that_beats_while_the_length_is_held_gets_an_answer() {
    let mut step = Vec::new();
    for p in [230.0, 350.0, 480.0] {
        step.push(Step::Pressure { to_kpa: p, rate_kpa_s: Some(50.0), settle_s: 1.0 });
        step.push(Step::File { name: format!("{p:.0}kPa") });
        let [up, down] = [0.9, 0.1].map(|free| Place { free: Some(free), ..Place::default() });
        for _ in 0..3 {
            step.push(Step::Move { to: up, speed_mm_s: 0.2 });
            step.push(Step::Hold { seconds: 40.0 });
            step.push(Step::Move { to: down, speed_mm_s: 0.2 });
            step.push(Step::Hold { seconds: 40.0 });
        }
        step.push(Step::EndFile);
    }
    let held = play(&Protocol { name: "held".into(), sample_hz: 10.0, step }, &muscle()).expect("playable");
    let mut beating = recorded(held, 23, coloured(0.02, 0.2), |_, _, _| 0.0);
    for r in &mut beating.recordings {
        let Recording { time, force: Some(force), .. } = r else { continue };
        for (f, t) in force.iter_mut().zip(time.iter()) {
            *f += if t.rem_euclid(4.0) < 2.0 { 5.0 } else { -5.0 };
        }
    }
    let d = ask(&beating);
    assert_eq!((d.verdict(), names(&d)), (Verdict::Unexplained, vec![]), "{:?}", d.unexplained);
}

#[test]
fn a_coarse_displacement_is_no_physics() {
    let mut campaign = recorded(loops(&[0.2]), 5, coloured(0.1, 2.0), |_, _, _| 0.0);
    for r in &mut campaign.recordings {
        r.stroke.iter_mut().for_each(|x| *x = (*x / 2e-4).round() * 2e-4);
        // Few rows in each step: no smoothing brings back what was between.
        let few = |column: &mut Vec<f64>| *column = column.iter().step_by(8).copied().collect();
        [&mut r.time, &mut r.pressure, &mut r.stroke].into_iter().chain(&mut r.force).for_each(few);
    }
    let d = ask(&campaign);
    assert_eq!((d.verdict(), names(&d)), (Verdict::Consistent, vec![]), "{:?}", d.unexplained);
    let coarse = d.remarks.iter().find_map(|r| match r {
        Remark::CoarseStroke { step, force } => Some((*step, *force)),
        _ => None,
    });
    let (step, force) = coarse.unwrap_or_else(|| panic!("{:?}", d.remarks));
    assert!((step - 2e-4).abs() < 1e-9, "{step} m");
    // Repeats of a stroke are read in the same steps, and do not show them.
    assert!(d.noise_N > 0.2 && force > d.noise_N, "{} N of noise, {force} N by the steps", d.noise_N);
}

/// A stroke of seven steps: their error follows the reversals as a friction might.
#[test]
fn very_coarse_steps_of_the_displacement_are_no_friction() {
    let mut campaign = recorded(loops(&[0.2]), 5, coloured(0.1, 2.0), |_, _, _| 0.0);
    for r in &mut campaign.recordings {
        r.stroke.iter_mut().for_each(|x| *x = (*x / 4e-4).round() * 4e-4);
    }
    let d = ask(&campaign);
    assert_eq!(names(&d), Vec::<&str>::new(), "{:?}", d.unexplained);
}

#[test]
fn the_end_of_the_sensors_range_is_no_physics() {
    let mut campaign = recorded(loops(&[0.2]), 5, coloured(0.3, 2.0), |_, _, _| 0.0);
    let forces = || campaign.recordings.iter().flat_map(|r| r.force.clone().unwrap_or_default());
    let end = 0.8 * forces().fold(0.0, f64::max);
    for r in &mut campaign.recordings {
        r.force.iter_mut().flatten().for_each(|f| *f = f.min(end));
    }
    let d = ask(&campaign);
    assert_eq!(d.verdict(), Verdict::Consistent, "{:?}", names(&d));
    assert!(d.remarks.iter().any(|r| matches!(r, Remark::SensorEnd { .. })), "{:?}", d.remarks);
}

#[test]
fn drifting_noise_and_outliers_are_not_named() {
    for seed in 10..13 {
        let wander = |r: &mut Random, s: &mut [f64; 2]| {
            s[0] += 0.02 * r.normal();
            let outlier = if r.uniform() < 2e-3 { 20.0 * r.normal() } else { 0.0 };
            s[0] + 0.1 * r.normal() + outlier
        };
        let d = ask(&recorded(loops(&[0.1, 0.4]), seed, wander, |_, _, _| 0.0));
        assert!(d.missing.is_empty(), "seed {seed}: {:?}", names(&d));
    }
}

/// The model sees noise of pressure and stroke, and the force does not: a filter that smooths the model's force fits better. No industrial
/// sensor has more noise than 0.5 % of its range.
#[test]
fn the_noise_of_pressure_and_stroke_is_no_lag_of_the_force() {
    for (seed, pressure_noise, stroke_noise) in [(30, 2000.0, 1e-6), (31, 2500.0, 1e-6), (33, 20.0, 24e-6)] {
        let white = |r: &mut Random, _: &mut [f64; 2]| 0.03 * r.normal();
        let mut campaign = recorded(loops(&[0.1, 0.4]), seed, white, |_, _, _| 0.0);
        let mut random = Random(seed);
        for r in &mut campaign.recordings {
            r.pressure.iter_mut().for_each(|p| *p += pressure_noise * random.normal());
            r.stroke.iter_mut().for_each(|x| *x += stroke_noise * random.normal());
        }
        let d = ask(&campaign);
        assert!(d.missing.is_empty(), "{pressure_noise} Pa, {stroke_noise} m: {:?}", names(&d));
    }
}

/// The force of another row, `late` samples before.
fn delayed(mut campaign: Campaign, late: impl Fn(usize) -> usize) -> Campaign {
    for r in &mut campaign.recordings {
        let Some(force) = &mut r.force else { continue };
        *force = (0..force.len()).map(|i| force[i.saturating_sub(late(i))]).collect();
    }
    campaign
}

#[test]
fn a_reading_now_and_then_late_at_a_turn_is_no_physics() {
    for seed in 20..23 {
        let plain = recorded(loops(&[0.2]), seed, coloured(0.1, 2.0), |_, _, _| 0.0);
        let d = ask(&delayed(plain, |i| usize::from(i % 7 == 0)));
        assert_eq!(d.verdict(), Verdict::Consistent, "seed {seed}: {:?}", names(&d));
    }
}

#[test]
fn a_late_cell_is_distinguished_from_a_loose_joint_and_its_dead_time_found() {
    for late in [2, 4] {
        let d = ask(&delayed(recorded(loops(&[0.2]), 4, coloured(0.1, 2.0), |_, _, _| 0.0), |_| late));
        assert_eq!(names(&d), ["sensor-delay"], "{late} samples");
        let of = |name: &str| d.missing[0].parameters.iter().find(|p| p.name == name).map(|p| p.value);
        let (part, time) = (of("delayed_part").unwrap_or(0.0), of("filter_time").unwrap_or(0.0));
        let truth = 0.1 * late as f64;
        assert!(
            (part - 1.0).abs() < 0.1 && (time - truth).abs() < 0.1 * truth,
            "{part} of it {time} s, not {truth} s, late"
        );
    }
}

#[test]
fn an_unknown_zero_is_not_called_an_unobserved_lag() {
    // At one speed a settling of most of the pull within 0.3 s would take the misfit as well.
    for (speed, offset) in [(1.0, 4.0), (1.0, 8.0), (3.0, 8.0)] {
        let d = ask(&recorded(loops(&[speed]), 5, coloured(0.1, 2.0), |_, _, _| offset));
        assert_eq!(names(&d), ["force-offset"], "{offset} N at {speed} mm/s");
        let found = d.missing[0].parameters[0].value;
        assert!((found - offset).abs() < 0.1 * offset, "{found} N for {offset} N at {speed} mm/s");
    }
}

#[test]
fn tares_in_files_of_their_own_show_the_cells_zero() {
    let mut campaign = recorded(loops(&[0.2]), 6, coloured(0.1, 2.0), |_, _, _| 4.0);
    let tare = |name: &str| {
        let mut r = campaign.recordings[0].clone();
        r.name = name.into();
        let n = 200;
        r.time = (0..n).map(|i| 0.1 * f64::from(i)).collect();
        r.pressure = vec![0.0; n as usize];
        r.stroke = vec![0.0; n as usize];
        r.force = Some((0..n).map(|i| 4.0 + 0.05 * f64::from(i % 3 - 1)).collect());
        (r.direction, r.cycle, r.temperature) = (None, None, None);
        r
    };
    let (before, after) = (tare("before"), tare("after"));
    campaign.recordings.insert(0, before);
    campaign.recordings.push(after);
    let d = ask(&campaign);
    let first = d.missing.first().expect("a zero");
    assert!(["force-offset", "gravity"].contains(&first.effect.as_str()), "{:?}", names(&d));
    assert!((first.parameters[0].value.abs() - 4.0).abs() < 0.5, "{:?}", first.parameters);
}

#[test]
fn constant_friction_is_found_with_its_size() {
    let d = ask(&recorded(loops(&[0.1, 0.4]), 3, coloured(0.1, 2.0), |_, sign, _| -4.0 * sign));
    let first = d.missing.first().expect("something is missing");
    let set: Vec<&str> = std::iter::once(first.effect.as_str())
        .chain(first.confusable_with.iter().map(String::as_str))
        .collect();
    assert!(set.contains(&"coulomb-friction"), "{set:?}");
    assert!(d.held_out.rms_after_N < 0.5 * d.held_out.rms_before_N, "{:?}", d.held_out);
    assert!((first.peak_N - 4.0).abs() < 1.0, "{} N", first.peak_N);
}

#[test]
fn at_one_speed_friction_is_not_called_a_law_of_speed() {
    for friction_per_pascal in [1.0e-6, 3.0e-6, 8.0e-6] {
        let d = ask(&together::on_a_bench_with(&Wrong { friction_per_pascal, ..Wrong::default() }));
        let first = d.missing.first().expect("something is missing");
        let of_speed = ["viscous-damping", "rate-power", "stribeck-friction", "pressure-lag"];
        assert!(!of_speed.contains(&first.effect.as_str()), "{}", first.effect);
        assert!(first.confusable_with.iter().any(|n| n == "viscous-damping"), "{:?}", first.confusable_with);
    }
}

#[test]
fn viscous_damping_is_found_with_its_size() {
    let d = ask(&recorded(loops(&[0.05, 0.2, 0.8]), 4, coloured(0.1, 2.0), |v, _, _| -5.0e3 * v));
    assert_eq!(names(&d).first(), Some(&"viscous-damping"), "{:?}", names(&d));
    let c = &d.missing[0].parameters[0];
    let std = c.std.expect("determined");
    assert!((c.value - 5.0e3).abs() < 4.0 * std.max(150.0), "{} ± {std}", c.value);
}

#[test]
fn given_effects_are_fitted_and_judged_by_the_recordings() {
    let rubbed = recorded(loops(&[0.1, 0.4]), 3, coloured(0.1, 2.0), |_, sign, _| -4.0 * sign);
    // What is there is found with its size whatever else was tested …
    let d = diagnosed_with(&rubbed, &["coulomb-friction"]).expect("an answer");
    assert_eq!(names(&d), ["coulomb-friction"]);
    let m = &d.missing[0];
    assert!(m.given && m.supported && m.probability == 1.0, "{:?}", m.why);
    assert!((m.parameters[0].value - 4.0).abs() < 0.3, "{:?}", m.parameters);
    assert!(d.held_out.rms_after_N < 0.5 * d.held_out.rms_before_N, "{:?}", d.held_out);
    // … beside another, of which nothing is there; and what is not there is fitted too, and said not to be supported.
    let d = diagnosed_with(&rubbed, &["backlash", "coulomb-friction"]).expect("an answer");
    assert_eq!(names(&d), ["backlash", "coulomb-friction"]);
    assert!(
        !d.missing[0].supported && d.missing[1].supported,
        "{:?} | {:?}",
        d.missing[0].why,
        d.missing[1].why
    );
    assert!((d.missing[1].parameters[0].value - 4.0).abs() < 0.6, "{:?}", d.missing[1].parameters);
    let nothing = recorded(loops(&[0.1, 0.4]), 9, coloured(0.3, 10.0), |_, _, _| 0.0);
    let d = diagnosed_with(&nothing, &["stress-relaxation"]).expect("an answer");
    assert_eq!(names(&d), ["stress-relaxation"]);
    let m = &d.missing[0];
    assert!(!m.supported, "{:?}", m.why);
    assert!(!matches!(m.why, Why::Found(_) | Why::GivenSupported(..)), "{:?}", m.why);
}

#[test]
fn effects_of_the_base_model_cannot_be_given() {
    let campaign = recorded(loops(&[0.2]), 5, coloured(0.1, 2.0), |_, _, _| 0.0);
    let refused = |given: &[&str]| diagnosed_with(&campaign, given).expect_err("refused").to_string();
    assert!(refused(&["gauge-offset"]).contains("deadband"));
    assert!(refused(&["higher-order-elasticity"]).contains("offered before"));
    assert!(refused(&["backlash", "backlash"]).contains("twice"));
    let six = ["backlash", "leak", "inertia", "gravity", "log-creep", "end-slip"];
    assert!(refused(&six).contains("most that recordings can bear"));
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let campaign = recorded(loops(&[0.2]), 5, coloured(0.1, 2.0), |_, sign, _| -3.0 * sign);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| format!("{:?}", ask(&campaign)))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn bad_input_is_answered_with_a_message() {
    let straight = |n: usize, f: &dyn Fn(f64) -> (f64, f64, f64)| {
        let mut r = Recording { name: "r".into(), ..Recording::default() };
        let mut force = Vec::new();
        for i in 0..n {
            let t = i as f64 * 0.1;
            let (p, x, y) = f(t);
            r.time.push(t);
            r.pressure.push(p);
            r.stroke.push(x);
            force.push(y);
        }
        r.force = Some(force);
        Campaign::new(vec![r])
    };
    let cases = [
        ("fifty rows", straight(50, &|t| (3e5, 1e-4 * t, 50.0 - t))),
        ("two rows", straight(2, &|t| (3e5, 1e-4 * t, 50.0 - t))),
        ("constant force", straight(2000, &|t| (3e5, 1e-3 * (t * 0.1).sin(), 40.0))),
        ("no force at all", straight(2000, &|t| (3e5, 1e-3 * (t * 0.1).sin(), 0.0))),
        ("one way only", straight(2000, &|t| (3e5, 1e-5 * t, 60.0 - 0.1 * t))),
        ("nothing moves", straight(2000, &|_| (3e5, 0.0, 60.0))),
        ("no pressure", straight(2000, &|t| (0.0, 1e-3 * (t * 0.1).sin(), 1.0))),
        ("pushed only", straight(2000, &|t| (3e5, 1e-3 * (t * 0.1).sin(), -5.0 - t))),
        (
            "stairs of pressure at one length",
            straight(3000, &|t| ((t / 10.0).floor() * 2e4, 1e-3, (t / 10.0).floor() * 4.0)),
        ),
    ];
    for (what, campaign) in cases {
        let d = ask(&campaign);
        assert!(d.missing.is_empty(), "{what}: {:?}", names(&d));
        assert!(!d.remarks.is_empty(), "{what}");
        let said = d.remarks.iter().any(|r| matches!(r, Remark::NotJudged(_)));
        assert!(d.judged() != said, "{what}");
    }
}

#[test]
fn limits_of_the_judgement_are_reported() {
    let whole = recorded(loops(&[0.2]), 7, coloured(0.1, 2.0), |_, _, _| 0.0);
    let one_pressure = Campaign::new(vec![whole.recordings[2].clone()]);
    let mut short = one_pressure.clone();
    let r = &mut short.recordings[0];
    for column in [&mut r.time, &mut r.stroke, &mut r.pressure] {
        column.truncate(50);
    }
    if let Some(force) = &mut r.force {
        force.truncate(50);
    }
    let no_gap = recorded(loops(&[0.2]), 8, coloured(0.02, 2.0), |_, sign, quasi| 0.08 * sign * quasi);
    assert!(ask(&whole).remarks.contains(&Remark::NoTemperature));
    assert!(ask(&one_pressure).remarks.contains(&Remark::OnePressure));
    assert!(matches!(ask(&short).remarks[0], Remark::NotJudged(_)));
    assert!(ask(&no_gap).missing.is_empty(), "a muscle without hysteresis lacks nothing");
}

/// A bladder that gives up a fifth of its modulus over the first strokes, tested in ascending pressures, and what it pulls afterwards. Every
/// pressure has a bladder of its own then, which tables follow as well as the effect does.
fn wearing() -> (Campaign, Campaign) {
    let mut worn = one_bladder();
    worn.elastic.iter_mut().flatten().for_each(|e| *e *= 0.8);
    let worn: Muscle<f64> = Muscle::build(&worn).expect("a softer bladder");
    let softer = |r: &Recording, i: usize| {
        worn.force(Pressure::from_pascals(r.pressure[i]), Length::from_metres(r.stroke[i]), 0.0).newtons()
    };
    let mut now = loops(&[0.2]);
    let mut later = now.clone();
    for (k, (now, later)) in now.recordings.iter_mut().zip(&mut later.recordings).enumerate() {
        let (start, duration) = (now.time[0], now.duration());
        let soft: Vec<f64> = (0..now.len()).map(|i| softer(now, i)).collect();
        let Recording { time, force: Some(force), .. } = now else { continue };
        for ((force, soft), time) in force.iter_mut().zip(&soft).zip(time) {
            let cycles = 3.0 * (k as f64 + (*time - start) / duration);
            *force += (soft - *force) * (1.0 - (-cycles / 5.0).exp());
        }
        later.force = Some(soft);
    }
    let with_noise = |campaign, seed| recorded(campaign, seed, coloured(0.1, 2.0), |_, _, _| 0.0);
    (with_noise(now, 3), with_noise(later, 4))
}

/// The description of the muscle of all tests.
fn described() -> MuscleDescription {
    let of = geometry();
    MuscleDescription {
        name: "test".into(),
        kind: Kind::Contractile,
        rest_length_mm: of.rest_length.metres() * 1e3,
        braid_angle_deg: of.braid_angle.degrees(),
        bladder_outer_diameter_mm: of.outer_diameter.metres() * 1e3,
        bladder_wall_mm: of.wall.metres() * 1e3,
        young_modulus_MPa: None,
        max_pressure_kPa: None,
        max_contraction: None,
    }
}

#[test]
fn an_effect_that_tables_share_out_between_pressures_is_written_into_the_table() {
    let (now, later) = wearing();
    let diagnosis = ask(&now);
    assert_eq!(names(&diagnosis), ["cyclic-softening"], "{:?}", diagnosis.missing);
    let muscle = described();
    let mut with = refitted_table::refit(&now, &muscle, &diagnosis).expect("a table").file;
    assert_eq!(with.table.effects.len(), 1);
    // The worn muscle after all that it went through; the readings about each turn, a jump of friction, are not what this is about.
    let history = Campaign::new(now.recordings.iter().chain(&later.recordings).cloned().collect());
    let missed = |file: &TableFile| {
        let predicted = predict(file, &history).expect("forces").recordings.split_off(now.recordings.len());
        let mut off: Vec<f64> = predicted
            .iter()
            .zip(&later.recordings)
            .flat_map(|(p, r)| p.force.iter().zip(r.force.iter().flatten()).map(|(p, f)| (p - f).abs()))
            .collect();
        quantile(&mut off, 0.8)
    };
    let after = missed(&with);
    with.table = fit(&now, &muscle, &FitOptions::default()).expect("a table").table;
    let before = missed(&with);
    assert!(
        after < 0.6 * before,
        "four fifths of the worn muscle's readings within {after:.3} N with the effect, {before:.3} N without"
    );
}
