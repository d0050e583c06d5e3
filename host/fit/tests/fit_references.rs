//! The fit against numbers of other implementations (tests/references/separate_fits.py and joint_fit.py: numpy and SciPy).

use std::fs;
use std::path::PathBuf;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_fit::{Design, Measured};
use pam_fit::{Options, fit, midline, side_by_side};

fn table(name: &str) -> Vec<Vec<f64>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/references").join(name);
    let text = fs::read_to_string(path).expect("a reference file");
    text.lines().skip(1).map(|l| l.split(',').map(|c| c.parse().expect("a number")).collect()).collect()
}

/// The points as a recording with both branches, a friction factor of 0.1 about the mid-line; one sample per chunk and branch.
fn loops(points: &[Vec<f64>]) -> Campaign {
    let mut levels: Vec<f64> = points.iter().map(|p| p[0]).collect();
    levels.dedup();
    let recordings = levels
        .iter()
        .enumerate()
        .map(|(k, level)| {
            let of: Vec<&Vec<f64>> = points.iter().filter(|p| p[0] == *level).collect();
            let mut r =
                Recording { name: format!("{level}"), force: Some(Vec::new()), ..Recording::default() };
            let mut time = k as f64 * 1e4;
            // Three cycles; every pass over a chunk takes a second.
            for pass in 0..6 {
                let up = pass % 2 == 0;
                let order: Vec<usize> =
                    if up { (0..of.len()).collect() } else { (0..of.len()).rev().collect() };
                for i in order {
                    time += 1.0;
                    r.time.push(time);
                    r.pressure.push(*level);
                    r.stroke.push(of[i][1]);
                    let friction = if up { -0.1 } else { 0.1 };
                    r.force.iter_mut().for_each(|f| f.push(of[i][2] * (1.0 + friction)));
                }
            }
            r
        })
        .collect();
    Campaign::new(recordings)
}

/// The miniature muscle.
fn miniature() -> MuscleDescription {
    MuscleDescription::parse(
        "name=\"m\"\nkind=\"contractile\"\nrest_length_mm=39.16\nbraid_angle_deg=77.4\n\
         bladder_outer_diameter_mm=3.0\nbladder_wall_mm=0.5\n",
    )
    .expect("valid")
}

/// Inches under the heading of millimetres: the force reaches zero long before any braid allows it.
#[test]
fn a_force_that_reaches_zero_far_too_early_questions_the_unit_of_the_displacement() {
    // About the miniature muscle's: 7.7 % of free contraction at 552 kPa.
    let at = |p: f64, k: i32| {
        let x = 3.02e-3 * f64::from(k) / 60.0 * (p - 76.5e3) / 475.5e3;
        [p, x, (2.75e-4 * (p - 76.5e3) - 43e3 * x).max(0.0)].to_vec()
    };
    let levels = [207e3, 276e3, 345e3, 414e3, 483e3, 552e3];
    let points: Vec<Vec<f64>> = levels.into_iter().flat_map(|p| (0..=60).map(move |k| at(p, k))).collect();
    let mut campaign = loops(&points);
    let questions = |campaign: &Campaign| {
        let fitted = fit(campaign, &miniature(), &Options::default()).expect("a fit");
        fitted.summary.warnings.iter().any(|w| w.contains("check the unit of the displacement (inches?)"))
    };
    assert!(!questions(&campaign));
    campaign.recordings.iter_mut().flat_map(|r| &mut r.stroke).for_each(|x| *x /= 25.4);
    assert!(questions(&campaign));
}

#[test]
fn separate_fits_are_those_of_numpy() {
    let campaign = loops(&table("separate_fits_points.csv"));
    let muscle = miniature();
    let mut fitted = fit(&campaign, &muscle, &Options::default()).expect("a fit");
    assert!((fitted.summary.deadband_kPa - 76.5).abs() < 1.0, "P0 {}", fitted.summary.deadband_kPa);
    // The reference takes P0 as given.
    fitted.solution.problem.design.origin = 76.5e3;
    fitted.solution.parameters[0] = 0.0;
    let mid = midline(&fitted.solution);
    let all = side_by_side(&fitted.solution, &mid, None);
    let m4 = all.iter().find(|m| m.name == "m4").expect("a model");
    let expected = table("separate_fits.csv");
    // The reference has every chunk; here those at the reversals are set aside, so the comparison is of forces.
    for (g, row) in expected.iter().enumerate() {
        let at = |i: usize| {
            let c = pam_fit::columns(&fitted.solution.problem.braid, mid[i].stroke);
            let reference: f64 = (0..4).map(|k| row[1 + k] * 1e6 * c.elastic[k]).sum();
            (row[0] - 76.5e3) * c.area + reference
        };
        for i in (0..mid.len()).filter(|i| mid[*i].group as usize == g) {
            assert!(
                (at(i) - m4.force[i]).abs() < 0.15,
                "at {} Pa: {} N, numpy {} N",
                row[0],
                m4.force[i],
                at(i)
            );
        }
    }
}

/// P0, every E_k and every k_F together, both branches, nothing smoothed: the least squares of SciPy's minimiser.
#[test]
fn the_joint_fit_is_that_of_scipy() {
    let points: Vec<Measured> = table("joint_fit_points.csv")
        .iter()
        .map(|r| Measured { pressure: r[0], stroke: r[1], direction: r[2], force: r[3] })
        .collect();
    let braid = model_core::braid::miniature().build().expect("a valid geometry");
    let design = Design::at_levels(&points, &braid, 4, true);
    let weights = vec![1.0; points.len()];
    let mut found = design.start(50e3);
    let mut penalty = design.penalty(&design.normal(&found, &weights), 0.0, 0.0);
    penalty.a.fill(0.0);
    let end = design.solve(&mut found, &weights, &penalty, 50);
    let layout = design.layout();
    for (j, row) in table("joint_fit.csv").iter().enumerate() {
        let (deadband, std, friction, square) = (row[1], row[2], row[3], row[8]);
        assert!(
            (found[0] / 1e3 - deadband).abs() < 1e-3 * std,
            "P0 {} kPa, SciPy {deadband}",
            found[0] / 1e3
        );
        assert!((end.misfit - square).abs() < 1e-8 * square, "{} N², SciPy {square}", end.misfit);
        assert!((found[layout.friction(j)] - friction).abs() < 1e-6, "k_F {}", found[layout.friction(j)]);
        let reduced: Vec<f64> = (0..4).map(|k| found[layout.elastic(k, j)]).collect();
        for (e, expected) in design.orthonormal.to_moduli(&reduced).iter().zip(&row[4..8]) {
            assert!(
                (e * 1e-6 - expected).abs() < 1e-4 * (1.0 + expected.abs()),
                "{} MPa, SciPy {expected}",
                e * 1e-6
            );
        }
    }
}
