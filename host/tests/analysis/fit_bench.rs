//! The fit on muscles of other physics than its own: the virtual bench's, which store energy in a hyperelastic tube.

use pam_evaluate::length_transfer::predict_unseen_length;
use pam_fit::confidence_band::ConfidenceBand;
use pam_fit::{Fit, Options, fit};
use virtual_bench::campaigns;
use virtual_bench::muscle::Muscle;
use virtual_bench::presets;
use virtual_bench::rng::Rng;

use bench_campaign::{description, thesis};

use crate::bench_campaign;

/// The three muscles of the thesis: errors, P0 and k_F against the truth, with bounds on both sides so that a change for the
/// better is noticed too.
#[test]
fn the_three_muscles_of_the_thesis() {
    let cases = [
        (presets::miniature(), presets::miniature_pressures(), 0.16),
        (presets::contractile(), presets::large_pressures(), 0.22),
        (presets::push(), presets::large_pressures(), 0.34),
    ];
    for (spec, levels, most) in cases {
        let truth = Muscle::new(spec.clone()).truth(&levels);
        let fitted =
            fit(&thesis(&spec, &levels, 1, 30.0), &description(&spec), &Options::default()).expect("a fit");
        let s = &fitted.summary;
        println!(
            "{}: {:.3} %, {:.3} %, P0 {:.2} kPa of {:.2}",
            s.muscle, s.mean_error_pct, s.max_error_pct, s.deadband_kPa, truth.deadband_kpa
        );
        assert!((0.005..most).contains(&s.mean_error_pct), "mean {} %", s.mean_error_pct);
        assert!((0.02..1.2).contains(&s.max_error_pct), "max {} %", s.max_error_pct);
        assert!((s.deadband_kPa - truth.deadband_kpa).abs() < 1.0, "P0 {} kPa", s.deadband_kPa);
        assert_eq!(s.pressures.len(), levels.len());
        for (found, true_at) in s.pressures.iter().zip(&truth.pressures) {
            assert!((found.k_F - true_at.k_f).abs() < 0.005, "k_F {} of {}", found.k_F, true_at.k_f);
        }
        let error = |name: &str| s.models.iter().find(|m| m.name == name).expect("a model").mean_error_pct;
        for better in [["m2", "gaylord-corrected"], ["m3", "m2"], ["m4", "m3"], ["m2", "m2-linear-part"]] {
            assert!(error(better[0]) < error(better[1]), "{better:?}");
        }
        assert!(error("table") < 2.0 * error("m4"), "fitted together, hardly worse than each alone");
    }
}

/// Noise of force requires stiff curves over pressure. Friction, which falls with pressure, must not become flatter by it: the mean of
/// several noisy campaigns is the truth.
#[test]
fn noise_of_force_does_not_flatten_friction_over_pressure() {
    const CAMPAIGNS: u64 = 4;
    let spec = presets::miniature();
    let levels = presets::miniature_pressures();
    let truth = Muscle::new(spec.clone()).truth(&levels);
    let mut off = vec![0.0; levels.len()];
    for seed in 0..CAMPAIGNS {
        let mut campaign = thesis(&spec, &levels, 1 + seed, 30.0);
        let mut noise = Rng::new(100 + seed);
        for force in campaign.recordings.iter_mut().filter_map(|r| r.force.as_mut()).flatten() {
            *force += 3.0 * noise.normal();
        }
        let fitted = fit(&campaign, &description(&spec), &Options::default()).expect("a fit");
        for ((off, found), true_at) in off.iter_mut().zip(&fitted.summary.pressures).zip(&truth.pressures) {
            *off += (found.k_F - true_at.k_f) / CAMPAIGNS as f64;
        }
    }
    println!("k_F is off by {off:.4?} in the mean");
    assert!(off.iter().all(|d| d.abs() < 0.005), "{off:?}");
}

/// Without rows near rest length the blocked force is a continuation: the interval of `P0` says how little that is worth.
#[test]
fn without_blocked_force_the_interval_of_the_deadband_holds_the_truth() {
    let spec = presets::miniature();
    let levels = presets::miniature_pressures();
    let truth = Muscle::new(spec.clone()).truth(&levels).deadband_kpa;
    let whole = thesis(&spec, &levels, 1, 30.0);
    let mut last = 0.0;
    for least_mm in [0.1, 0.15, 0.2, 0.25, 0.3] {
        let mut campaign = whole.clone();
        for r in &mut campaign.recordings {
            let kept: Vec<bool> = r.stroke.iter().map(|x| *x > least_mm * 1e-3).collect();
            for column in [&mut r.time, &mut r.pressure, &mut r.stroke].into_iter().chain(&mut r.force) {
                let mut of = kept.iter();
                column.retain(|_| *of.next().expect("as many as rows"));
            }
        }
        let s = fit(&campaign, &description(&spec), &Options::default()).expect("a fit").summary;
        println!(
            "from {least_mm} mm: P0 {:.2} ± {:.2} kPa of {truth:.2}",
            s.deadband_kPa,
            1.96 * s.deadband_std_kPa
        );
        assert!((s.deadband_kPa - truth).abs() < 1.96 * s.deadband_std_kPa, "from {least_mm} mm");
        // Nor is it so wide that it says nothing, and it widens the further the way is.
        assert!(s.deadband_std_kPa < 5.0, "{}", s.deadband_std_kPa);
        last = s.deadband_std_kPa;
    }
    assert!(last > 1.0, "{last}");
}

/// A curve through separate fits, as the thesis joins them: M = 4 at each pressure alone, natural splines between.
fn joined(fitted: &Fit, pressure: f64, stroke: f64) -> f64 {
    let m4 = fitted.models.iter().find(|m| m.name == "m4").expect("a model");
    let levels = &fitted.solution.problem.pressures.levels;
    let phi = pam_fit::numerics::spline_basis::SplineBasis::new(levels).at(pressure);
    let columns = pam_fit::columns(&fitted.solution.problem.braid, stroke);
    let mut force = (pressure - fitted.solution.deadband()) * columns.area;
    for (name, group, value) in &m4.constants {
        let Some(g) = group else { continue };
        let k: usize = name[2..].parse().expect("E_k");
        force += value * columns.elastic[k - 1] * phi[*g as usize];
    }
    force
}

/// Pressures that were never tested, on twenty muscles drawn at random: the joint fit's error is at most half of what separate
/// fits joined by splines give.
#[test]
fn between_pressures_it_is_twice_as_good_as_separate_fits() {
    let (mut together, mut apart) = (0.0, 0.0);
    let mut worse = 0;
    for seed in 0..20 {
        let spec = presets::random(100 + seed);
        let muscle = Muscle::new(spec.clone());
        let levels = campaigns::levels(&muscle);
        let fitted =
            fit(&thesis(&spec, &levels, seed, 8.0), &description(&spec), &Options::default()).expect("a fit");
        let (mut a, mut b, mut n) = (0.0, 0.0, 0.0);
        for pair in fitted.solution.problem.pressures.levels.windows(2) {
            let p = 0.5 * (pair[0] + pair[1]);
            let blocked = muscle.quasi_static(p, 0.0);
            // What both levels covered.
            let end = 0.98 * muscle.free_stroke(pair[0]);
            for i in 0..=40 {
                let x = end * f64::from(i) / 40.0;
                let truth = muscle.quasi_static(p, x);
                a += (fitted.solution.quasi(p, x) - truth).abs() / blocked;
                b += (joined(&fitted, p, x) - truth).abs() / blocked;
                n += 1.0;
            }
        }
        println!("{seed}: {:.4} % together, {:.4} % apart", 100.0 * a / n, 100.0 * b / n);
        together += a / n;
        apart += b / n;
        worse += usize::from(a > b);
    }
    println!("mean: {:.4} % together, {:.4} % apart; worse on {worse}", 5.0 * together, 5.0 * apart);
    assert!(together <= 0.5 * apart, "{together} {apart}");
}

/// Loops of a fitted muscle with coloured noise: how often the stated 95 % hold the truth.
#[test]
fn stated_intervals_cover() {
    let spec = presets::miniature();
    let levels = presets::miniature_pressures();
    let base = thesis(&spec, &levels, 3, 6.0);
    let muscle = description(&spec);
    let options = Options { order: 2, ..Options::default() };
    let truth = fit(&base, &muscle, &options).expect("a fit");
    // The truth is the model itself on the recording's motion; the force after a reversal is the model's too.
    let table = pam_evaluate::cross_validation::as_file(&truth);
    let clean = pam_fit::predict::predict(&table, &base).expect("a prediction");
    let (mut inside, mut all) = (0, 0);
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut uniform = || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..60 {
        let mut campaign = base.clone();
        for (r, c) in campaign.recordings.iter_mut().zip(&clean.recordings) {
            let mut noise = 0.0;
            let force = c.force.iter().map(|f| {
                let white = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                noise = 0.9 * noise + 0.436 * white;
                f + 0.3 * noise
            });
            r.force = Some(force.collect());
        }
        let fitted = fit(&campaign, &muscle, &options).expect("a fit");
        for i in 0..levels.len() {
            let (f, t) = (&fitted.summary.pressures[i], &truth.summary.pressures[i]);
            // The force at half the free stroke represents the curve: single E_k trade with each other.
            let x = 0.5 * t.free_contraction.expect("a free contraction") * muscle.rest_length();
            let p = fitted.solution.problem.pressures.levels[i];
            let mut with_band = pam_evaluate::cross_validation::as_file(&fitted);
            with_band.about.uncertainty = Some(fitted.stored_uncertainty());
            let band = ConfidenceBand::of(&with_band).expect("a band").std(p, x, 0.0);
            for (off, std) in [
                (f.k_F - t.k_F, f.k_F_std),
                (fitted.solution.quasi(p, x) - truth.solution.quasi(p, x), band),
                (f.E_MPa[0] - t.E_MPa[0], f.E_std_MPa[0]),
            ] {
                inside += usize::from(off.abs() <= 1.96 * std);
                all += 1;
            }
        }
    }
    let share = f64::from(inside as u32) / f64::from(all as u32);
    println!("{inside} of {all} inside: {:.1} %", 100.0 * share);
    assert!((0.90..=0.98).contains(&share), "{share}");
}

#[test]
fn thin_data_are_fitted_with_a_word_of_warning() {
    let spec = presets::miniature();
    let muscle = description(&spec);
    let one = thesis(&spec, &[414e3], 2, 10.0);
    let fitted = fit(&one, &muscle, &Options::default()).expect("a fit");
    assert!(
        fitted.summary.warnings.iter().any(|w| w.contains("only one pressure")),
        "{:?}",
        fitted.summary.warnings
    );
    assert!(fitted.summary.left_out_pressure_mean_error_pct.is_none());
    // No interval for what one pressure does not separate.
    assert_eq!(fitted.summary.not_determined.first().map(|n| n.parameter.as_str()), Some("P0"));
    assert!(!fitted.summary.to_string().lines().next().unwrap_or("").contains('±'), "{}", fitted.summary);
    fitted.table.check().expect("a table that can be used");
    // One way only.
    let mut up = one.clone();
    let r = &mut up.recordings[0];
    let top = (0..r.len()).max_by(|a, b| r.stroke[*a].total_cmp(&r.stroke[*b])).unwrap_or(0).min(r.len() / 4);
    for column in [&mut r.time, &mut r.pressure, &mut r.stroke] {
        column.truncate(top);
    }
    r.force.iter_mut().for_each(|f| f.truncate(top));
    let fitted = fit(&up, &muscle, &Options::default()).expect("a fit");
    assert!(
        fitted.summary.warnings.iter().any(|w| w.contains("one direction only")),
        "{:?}",
        fitted.summary.warnings
    );
    assert!(fitted.table.friction.iter().all(|k| k.abs() < 1e-6));
}

/// A seal or a guide beside the muscle, which resists by the same force at all pressures; then the same force against all friction.
#[test]
fn friction_that_no_muscle_has_is_warned_of_and_the_table_is_valid() {
    let spec = presets::miniature();
    let clean = thesis(&spec, &presets::miniature_pressures(), 5, 15.0);
    let with_resistance = |newtons: f64| {
        let mut campaign = clean.clone();
        for recording in &mut campaign.recordings {
            let steps: Vec<f64> = recording.stroke.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let force = recording.force.as_mut().expect("a force");
            force.iter_mut().skip(1).zip(steps).for_each(|(f, step)| *f -= newtons * step.signum());
        }
        let fitted = fit(&campaign, &description(&spec), &Options::default()).expect("a fit");
        assert_eq!(fitted.table.check(), Ok(()));
        fitted
    };
    let warns = |fitted: &Fit, of: &str| fitted.summary.warnings.iter().any(|w| w.contains(of));
    let (usual, resists, drives) = (with_resistance(0.0), with_resistance(30.0), with_resistance(-10.0));
    let (absurd, negative) = ("the table holds 0.95 at most", "below zero, which no friction is");
    assert!(!warns(&usual, absurd) && !warns(&usual, negative), "{:?}", usual.summary.warnings);
    assert!(warns(&resists, absurd) && !warns(&resists, negative), "{:?}", resists.summary.warnings);
    assert!(warns(&drives, negative) && !warns(&drives, absurd), "{:?}", drives.summary.warnings);
}

#[test]
fn a_spike_is_found_listed_and_does_no_harm() {
    let spec = presets::miniature();
    let muscle = description(&spec);
    let clean = thesis(&spec, &presets::miniature_pressures(), 5, 15.0);
    let mut spiked = clean.clone();
    let force = spiked.recordings[2].force.as_mut().expect("a force");
    force[500] += 40.0;
    let a = fit(&clean, &muscle, &Options::default()).expect("a fit");
    let b = fit(&spiked, &muscle, &Options::default()).expect("a fit");
    // The check of the sensors finds it before the fit.
    let name = &spiked.recordings[2].name;
    let warned = b.summary.warnings.iter().any(|w| w.contains(name.as_str()) && w.contains("501"));
    assert!(warned && b.summary.rows.dropouts == 1, "{:?} {:?}", b.summary.rows, b.summary.warnings);
    assert!((a.summary.deadband_kPa - b.summary.deadband_kPa).abs() < 0.1);
    assert!((a.summary.pressures[2].k_F - b.summary.pressures[2].k_F).abs() < 1e-3);
}

#[test]
fn stress_rises_with_strain_where_it_is_required() {
    let spec = presets::contractile();
    let campaign = thesis(&spec, &presets::large_pressures(), 4, 8.0);
    let options = Options { physical: true, ..Options::default() };
    let fitted = fit(&campaign, &description(&spec), &options).expect("a fit");
    let braid = &fitted.solution.problem.braid;
    let largest = braid
        .posture(model_core::units::Length::from_metres(fitted.solution.problem.points.stroke.high))
        .radial_strain;
    for p in &fitted.solution.problem.pressures.levels {
        let (e, _) = fitted.solution.curves_at(*p);
        for i in 0..=40 {
            let x = largest * f64::from(i) / 40.0;
            let slope: f64 = e.iter().enumerate().map(|(k, e)| (k + 1) as f64 * e * x.powi(k as i32)).sum();
            let scale: f64 =
                e.iter().enumerate().map(|(k, e)| (k + 1) as f64 * e.abs() * x.powi(k as i32)).sum();
            assert!(slope > -0.02 * scale, "at {p} Pa, strain {x}: {slope}");
        }
    }
    assert!(fitted.summary.mean_error_pct < 2.0);
}

/// A muscle's length that was not recorded, from three others of its stock. The bench has no ends that pull less: the end effect
/// found is small, and the prediction is no worse than what the nearest length's table alone gives.
#[test]
fn a_length_that_was_not_recorded_comes_from_the_others() {
    let lengths = [0.6, 1.0, 1.6, 2.5].map(|times| {
        let mut spec = presets::contractile();
        spec.geometry.rest_length *= times;
        let campaign = thesis(&spec, &presets::large_pressures(), 3, 10.0);
        let fitted = fit(&campaign, &description(&spec), &Options::default()).expect("a fit");
        (spec, campaign, fitted)
    });
    for left_out in 0..lengths.len() {
        let (spec, campaign, own) = &lengths[left_out];
        let others: Vec<&Fit> =
            lengths.iter().enumerate().filter(|(i, _)| *i != left_out).map(|(_, l)| &l.2).collect();
        let clip = own.solution.problem.clips.0.map(|c| c.force);
        let percent = |from: &[&Fit]| {
            let carried =
                predict_unseen_length(from, campaign, &description(spec), clip).expect("a prediction");
            (100.0 * carried.score.mean() / own.summary.blocked_force_N, carried.end_effect)
        };
        let (all, end_effect) = percent(&others);
        let nearest = others.iter().map(|o| percent(&[o]).0).fold(f64::INFINITY, f64::min);
        println!(
            "{left_out}: {all:.3} % from all, {nearest:.3} % from the best one, end effect {:.2} mm",
            1e3 * end_effect
        );
        assert!(all < 1.0 && all < nearest + 0.2, "{all} % from all, {nearest} % from the best");
        assert!(end_effect.abs() < 0.1 * 15.9e-3, "{end_effect} m");
    }
}
