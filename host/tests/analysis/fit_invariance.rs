//! What must not change a fit, and what any valid recording must give.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::fmt::Write;
use std::fs;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Import, Reader, Recording};
use pam_fit::{Fit, Options, fit};
use proptest::prelude::*;
use virtual_bench::presets;

use bench_campaign::{description, files, thesis};

use crate::bench_campaign;

/// The table's numbers agree to `share` of their size, the errors to ten times that: a last digit that rounds the other way puts a
/// point into the neighbouring chunk, which errors feel and the table does not.
fn assert_close(a: &Fit, b: &Fit, share: f64) {
    let close = |what: &str, a: f64, b: f64, share: f64| {
        assert!((a - b).abs() <= share * a.abs().max(1e-3), "{what}: {a} and {b}");
    };
    let (a, b) = (&a.summary, &b.summary);
    close("P0", a.deadband_kPa, b.deadband_kPa, share);
    close("mean error", a.mean_error_pct, b.mean_error_pct, 10.0 * share);
    close("rms", a.rms_N, b.rms_N, 10.0 * share);
    assert_eq!(a.pressures.len(), b.pressures.len());
    for (p, q) in a.pressures.iter().zip(&b.pressures) {
        close("k_F", p.k_F, q.k_F, share);
        close("F_B", p.blocked_force_N, q.blocked_force_N, share);
    }
}

/// Files of different pressures, each with its own clock: their order does not matter for a muscle without memory.
#[test]
fn the_order_of_files_changes_nothing() {
    let spec = presets::miniature();
    let mut campaign = thesis(&spec, &presets::miniature_pressures(), 5, 6.0);
    for r in &mut campaign.recordings {
        let start = r.time[0];
        r.time.iter_mut().for_each(|t| *t -= start);
    }
    let muscle = description(&spec);
    let one = fit(&Campaign::new(campaign.recordings.clone()), &muscle, &Options::default()).unwrap();
    for order in [[5, 4, 3, 2, 1, 0], [2, 0, 5, 1, 4, 3], [3, 4, 0, 5, 2, 1]] {
        let shuffled = order.map(|i| campaign.recordings[i].clone()).to_vec();
        let other = fit(&Campaign::new(shuffled), &muscle, &Options::default()).unwrap();
        assert_close(&one, &other, 1e-2);
    }
}

/// The same readings in other units, in a file of another form: the same table.
#[test]
fn units_and_forms_change_nothing() {
    let spec = presets::miniature();
    let campaign = thesis(&spec, &presets::miniature_pressures(), 5, 6.0);
    let muscle = description(&spec);
    let one = fit(&campaign, &muscle, &Options::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let rest = muscle.rest_length();
    // Name and SI per unit of time, pressure, stroke (by a function) and force; the delimiter.
    type Stroke<'a> = (&'a str, &'a dyn Fn(f64) -> f64);
    let (inch, length) = (|x: f64| x / 0.0254, |x: f64| (rest - x) * 1e3);
    let contraction = |x: f64| x / rest;
    type Form<'a> = (&'a str, f64, &'a str, f64, Stroke<'a>, &'a str, f64, char);
    let forms: [Form<'_>; 3] = [
        (
            "time_ms",
            1e-3,
            "pressure_psi",
            6_894.757_293_168,
            ("displacement_in", &inch),
            "force_lbf",
            4.448_221_615_260_5,
            ',',
        ),
        ("time_s", 1.0, "pressure_bar", 1e5, ("length_mm", &length), "force_kN", 1e3, '\t'),
        ("time_s", 1.0, "pressure_MPa", 1e6, ("contraction", &contraction), "force_N", 1.0, ','),
    ];
    for (n, (time, t, pressure, p, (stroke, x), force, f, d)) in forms.into_iter().enumerate() {
        let paths: Vec<_> = campaign
            .recordings
            .iter()
            .map(|r| {
                // Columns in another order, and one that no one requested.
                let mut text = format!("{force}{d}note{d}{time}{d}{stroke}{d}{pressure}\n");
                for i in 0..r.len() {
                    let reading = r.force.as_ref().unwrap()[i] / f;
                    writeln!(
                        text,
                        "{reading}{d}x{d}{}{d}{}{d}{}",
                        r.time[i] / t,
                        x(r.stroke[i]),
                        r.pressure[i] / p
                    )
                    .unwrap();
                }
                let path = folder.path().join(format!("{n}_{}.txt", r.name));
                fs::write(&path, text).unwrap();
                path
            })
            .collect();
        let read = Reader::of(&muscle).campaign(&paths).unwrap();
        assert_close(&one, &fit(&read, &muscle, &Options::default()).unwrap(), 1e-3);
    }
}

/// The thesis's own files (five header lines, tabs, inches of extension from an arbitrary zero, load-cell units, the pressure in the
/// file's name) give the table that the same readings give as CSV.
#[test]
fn the_raw_files_of_the_thesis_give_the_same_table() {
    let spec = presets::miniature();
    let muscle = description(&spec);
    let levels = presets::miniature_pressures();
    let folder = tempfile::tempdir().unwrap();
    let (mut raw, mut csv) = (Vec::new(), Vec::new());
    for (file, level) in files(&spec, &levels, 3, 15.0).into_iter().zip(&levels) {
        // The raw form knows one pressure for the whole file, rounded as its name has it.
        let named = (level * 1e-3).round() * 1e3;
        let mut same = file.clone();
        same.rows.iter_mut().for_each(|r| r.pressure = named);
        let path = folder.path().join(format!("{}_{:.0}kPa.txt", file.name, named * 1e-3));
        fs::write(&path, file.thesis("mini", *level, 1.7)).unwrap();
        raw.push(path);
        let path = folder.path().join(format!("{}.csv", file.name));
        fs::write(&path, same.csv(virtual_bench::recording::Columns::default())).unwrap();
        csv.push(path);
    }
    let own = fit(&Reader::of(&muscle).campaign(&csv).unwrap(), &muscle, &Options::default()).unwrap();
    let description_file = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/imports/thesis.toml");
    let text = fs::read_to_string(description_file).unwrap();
    let by = |text: &str| {
        let path = folder.path().join("import.toml");
        fs::write(&path, text).unwrap();
        let import = Import::read(&path).unwrap();
        let campaign = Reader::of(&muscle).import(Some(&import)).campaign(&raw).unwrap();
        fit(&campaign, &muscle, &Options::default()).unwrap()
    };
    // With the crosshead's zero known, the residual is rounding: 25 nm and 20 µN.
    let known = by(&text.replace("zero = \"longest\"", "zero = 1.7"));
    assert_eq!(known.summary.samples, own.summary.samples);
    let (a, b) = (known.summary.deadband_kPa, own.summary.deadband_kPa);
    assert!((a - b).abs() < 0.02, "P0 {a} and {b} kPa");
    for (level, (p, q)) in own
        .solution
        .problem
        .pressures
        .levels
        .iter()
        .zip(known.summary.pressures.iter().zip(&own.summary.pressures))
    {
        assert!((p.k_F - q.k_F).abs() < 1e-4, "k_F {} and {}", p.k_F, q.k_F);
        for i in 0..=20 {
            let x = own.solution.problem.points.stroke.high * f64::from(i) / 20.0;
            let off = (known.solution.quasi(*level, x) - own.solution.quasi(*level, x)).abs();
            assert!(off < 3e-4 * own.summary.blocked_force_N, "{off} N at {level} Pa and {x} m");
        }
    }
    // With the zero taken from where the muscle was longest, some micrometres of noise go into it, and into P0.
    let found = by(&text).summary;
    assert!((found.deadband_kPa - b).abs() < 1.0, "P0 {} and {b} kPa", found.deadband_kPa);
    assert!(found.mean_error_pct < 0.16, "{found}");
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
                let bytes = pam_evaluate::cross_validation::as_file(&fitted).to_bytes().expect("a file");
                prop_assert!(pam_fit::table_file::TableFile::from_bytes(&bytes).is_ok());
            }
            Err(e) => prop_assert!(e.advised() && !e.cause().is_empty(), "{e}"),
        }
    }
}
