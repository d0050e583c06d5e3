//! The fit on muscles of other physics than its own: the virtual bench's, which store energy in a hyperelastic tube.

use host::fit::{Options, fit, result::Fit};
use host::muscle_description::MuscleDescription;
use host::recording::{Campaign, Recording};
use proptest::prelude::*;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::presets;

fn description(spec: &MuscleSpec) -> MuscleDescription {
    MuscleDescription::parse(&spec.description()).expect("the bench describes its muscles")
}

/// The thesis's test of a muscle: three slow loops at each pressure.
fn thesis(spec: &MuscleSpec, levels: &[f64], seed: u64, hz: f64) -> Campaign {
    let muscle = Muscle::new(spec.clone());
    let mut protocol = campaigns::thesis(&muscle, levels);
    protocol.sample_hz = hz;
    let files = Bench::new(&BenchSpec::laboratory(spec.clone(), seed)).run(&protocol).expect("a protocol");
    let column = |f: &virtual_bench::recording::Recording, of: fn(&virtual_bench::recording::Row) -> f64| {
        f.rows.iter().map(of).collect::<Vec<f64>>()
    };
    let recordings = files
        .iter()
        .map(|f| Recording {
            name: f.name.clone(),
            time: column(f, |r| r.time),
            pressure: column(f, |r| r.pressure),
            stroke: column(f, |r| r.stroke),
            force: Some(column(f, |r| r.force)),
            ..Recording::default()
        })
        .collect();
    Campaign::new(recordings)
}

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
        assert!(error("table") < 2.0 * error("m4"), "fitted together, hardly worse than each by itself");
    }
}

/// A curve through separate fits, as the thesis joins them: M = 4 at each pressure by itself, natural splines between.
fn joined(fitted: &Fit, pressure: f64, stroke: f64) -> f64 {
    let m4 = fitted.models.iter().find(|m| m.name == "m4").expect("a model");
    let levels = &fitted.prepared.pressures.levels;
    let phi = host::fit::basis::PressureBasis::new(levels).at(pressure);
    let columns = host::fit::basis::columns(&fitted.prepared.braid, stroke);
    let mut force = (pressure - fitted.prepared.deadband()) * columns.area;
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
        for pair in fitted.prepared.pressures.levels.windows(2) {
            let p = 0.5 * (pair[0] + pair[1]);
            let blocked = muscle.quasi_static(p, 0.0);
            // What both levels covered.
            let end = 0.98 * muscle.free_stroke(pair[0]);
            for i in 0..=40 {
                let x = end * f64::from(i) / 40.0;
                let truth = muscle.quasi_static(p, x);
                a += (fitted.prepared.quasi(p, x) - truth).abs() / blocked;
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
    // The truth is the model itself on the recording's motion; what is left after a turn is the model's too.
    let table = host::fit::hold_out::as_file(&truth);
    let clean = host::predict::predict(&table, &base).expect("a prediction");
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
            // The force at half the free stroke stands for the curve: single E_k trade with each other.
            let x = 0.5 * t.free_contraction.expect("a free contraction") * muscle.rest_length();
            let p = fitted.prepared.pressures.levels[i];
            let std = host::fit::hold_out::as_file(&fitted);
            let mut with_band = std;
            with_band.about.uncertainty = Some(fitted.stored_uncertainty());
            let band = with_band.force_std(p, x, 0.0).expect("a band");
            for (off, std) in [
                (f.k_F - t.k_F, f.k_F_std),
                (fitted.prepared.quasi(p, x) - truth.prepared.quasi(p, x), band),
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

/// What a fit says of a campaign, as few numbers that hang together.
fn figures(fitted: &Fit) -> Vec<f64> {
    let s = &fitted.summary;
    let mut all = vec![s.deadband_kPa, s.mean_error_pct, s.rms_N];
    for p in &s.pressures {
        all.extend([p.k_F, p.blocked_force_N, p.mean_error_pct]);
    }
    all
}

#[test]
fn the_order_of_files_changes_nothing() {
    let spec = presets::miniature();
    let campaign = thesis(&spec, &presets::miniature_pressures(), 5, 6.0);
    let mut turned = campaign.clone();
    turned.recordings.reverse();
    let muscle = description(&spec);
    let one = figures(&fit(&campaign, &muscle, &Options::default()).expect("a fit"));
    let other = figures(&fit(&turned, &muscle, &Options::default()).expect("a fit"));
    for (a, b) in one.iter().zip(&other) {
        assert!((a - b).abs() <= 2e-3 * (1.0 + a.abs()), "{a} {b}");
    }
}

/// A muscle ten times as long and thick in every direction pulls a hundred times as hard, with the same table.
#[test]
fn scaling_the_muscle_scales_the_force_and_nothing_else() {
    let spec = presets::miniature();
    let campaign = thesis(&spec, &presets::miniature_pressures(), 5, 6.0);
    let mut large = campaign.clone();
    for r in &mut large.recordings {
        r.stroke.iter_mut().for_each(|x| *x *= 10.0);
        r.force.iter_mut().flatten().for_each(|f| *f *= 100.0);
    }
    let small = description(&spec);
    let mut big = small.clone();
    big.rest_length_mm *= 10.0;
    big.bladder_outer_diameter_mm *= 10.0;
    big.bladder_wall_mm *= 10.0;
    let a = fit(&campaign, &small, &Options::default()).expect("a fit");
    let b = fit(&large, &big, &Options::default()).expect("a fit");
    assert!((a.summary.deadband_kPa - b.summary.deadband_kPa).abs() < 0.02);
    for (x, y) in a.summary.pressures.iter().zip(&b.summary.pressures) {
        assert!(
            (x.k_F - y.k_F).abs() < 1e-3
                && (100.0 * x.blocked_force_N - y.blocked_force_N).abs() < 1e-3 * y.blocked_force_N
        );
        for (e, f) in x.E_MPa.iter().zip(&y.E_MPa) {
            assert!((e - f).abs() < 0.02 * (1.0 + e.abs()), "{e} {f}");
        }
    }
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
    let found = b.summary.outliers.iter().find(|o| o.row == 501 && o.recording == spiked.recordings[2].name);
    assert!(found.is_some_and(|o| (o.off_N - 40.0).abs() < 4.0), "{:?}", b.summary.outliers);
    assert!((a.summary.deadband_kPa - b.summary.deadband_kPa).abs() < 0.1);
    assert!((a.summary.pressures[2].k_F - b.summary.pressures[2].k_F).abs() < 1e-3);
}

#[test]
fn stress_rises_with_strain_where_it_is_asked_for() {
    let spec = presets::contractile();
    let campaign = thesis(&spec, &presets::large_pressures(), 4, 8.0);
    let options = Options { physical: true, ..Options::default() };
    let fitted = fit(&campaign, &description(&spec), &options).expect("a fit");
    let braid = &fitted.prepared.braid;
    let largest = braid
        .posture(model_core::units::Length::from_metres(fitted.prepared.points.stroke.high))
        .radial_strain;
    for p in &fitted.prepared.pressures.levels {
        let (e, _) = fitted.prepared.curves_at(*p);
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Whatever a valid recording holds, a usable table comes out, or an error that says what is wrong.
    #[test]
    fn any_valid_recording_gives_a_usable_table_or_a_clear_error(
        rows in 3_usize..120,
        levels in 1_usize..4,
        stroke in 0.0_f64..0.12,
        force in prop_oneof![Just(0.0), 0.1_f64..300.0, Just(1e6)],
        jitter in 0.0_f64..2.0,
        seed in any::<u32>(),
        order in 1_usize..7,
        geometry in any::<bool>(),
    ) {
        let muscle = MuscleDescription::parse(
            "name=\"m\"\nkind=\"contractile\"\nrest_length_mm=100.0\nbraid_angle_deg=72.0\n\
             bladder_outer_diameter_mm=10.0\nbladder_wall_mm=1.0\n").expect("valid");
        let mut state = u64::from(seed) | 1;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let recordings = (0..levels).map(|l| {
            let phase = |i: usize| (i as f64 / rows as f64 * 3.0).fract();
            let x: Vec<f64> = (0..rows).map(|i| 0.1 * stroke * (1.0 - (1.0 - 2.0 * phase(i)).abs())).collect();
            Recording {
                name: format!("{l}"),
                time: (0..rows).map(|i| l as f64 * 1e3 + i as f64).collect(),
                pressure: (0..rows).map(|_| 1e5 * (1.0 + l as f64) + 1e3 * jitter * next()).collect(),
                force: Some(x.iter().map(|x| force * (1.0 - 50.0 * x) + jitter * next()).collect()),
                stroke: x,
                ..Recording::default()
            }
        }).collect();
        let options = Options { order, fit_geometry: geometry, fit_lengths: geometry, ..Options::default() };
        match fit(&Campaign::new(recordings), &muscle, &options) {
            Ok(fitted) => {
                prop_assert!(fitted.table.check().is_ok());
                prop_assert!(fitted.summary.rms_N.is_finite() && fitted.summary.mean_error_pct.is_finite());
                let bytes = host::fit::hold_out::as_file(&fitted).to_bytes().expect("a file");
                prop_assert!(host::table_file::TableFile::from_bytes(&bytes).is_ok());
            }
            Err(e) => prop_assert!(e.advice().is_some() && !e.cause().is_empty(), "{e}"),
        }
    }
}
