//! A joint of two muscles, as physical statements, without the emulator.

use emulator_tests::fitting;
use emulator_tests::joint::Joint;
use emulator_tests::pair::{self, PairLoop};
use model_core::link::messages::Refusal;
use model_core::link::settings::Settings;
use virtual_bench::bench::BenchSpec;
use virtual_bench::presets;

fn elbow() -> PairLoop {
    elbow_with(|_| ())
}

fn elbow_with(change: impl FnOnce(&mut Settings)) -> PairLoop {
    let spec = presets::contractile();
    let mut settings = Settings::default();
    pair::adjust(&mut settings);
    change(&mut settings);
    PairLoop::start(pair::elbow(&spec), &fitting::fitted(&spec), settings)
}

#[test]
fn angle_and_stiffness_are_both_reached_wherever_both_muscles_can_pull() {
    for stiffness in [80.0, 120.0, 200.0, 250.0] {
        for angle in [-0.1, 0.0, 0.05] {
            let mut joint = elbow();
            joint.ask(angle, stiffness).expect("within reach");
            let pose = joint.run(3_000, 1_000);
            let missed = (pose.stiffness / f64::from(stiffness) - 1.0).abs();
            eprintln!("{angle} rad at {stiffness} N·m/rad: {pose:.4?}");
            assert!(missed < 0.03, "{} N·m/rad for {stiffness} at {angle} rad", pose.stiffness);
            assert!((pose.angle - f64::from(angle)).abs() < 0.004, "{} rad for {angle}", pose.angle);
        }
    }
}

#[test]
fn a_stiffer_joint_yields_less_to_a_push_and_roughly_as_much_as_stated() {
    let stiffnesses = [80.0, 110.0, 140.0, 170.0, 200.0, 230.0, 260.0];
    let mut ratios = Vec::new();
    let mut gave = Vec::new();
    for stiffness in stiffnesses {
        for push in [-8.0, 8.0] {
            // Nothing holds the angle but the muscles themselves.
            let mut joint = elbow_with(|settings| settings.joint.integral_nm_per_rad_s = 0.0);
            joint.ask(0.0, stiffness).expect("within reach");
            joint.run(2_000, 200);
            let still: Vec<f64> = (0..75).map(|_| joint.run(20, 20).angle).collect();
            let drift = still.iter().copied().fold(f64::MIN, f64::max)
                - still.iter().copied().fold(f64::MAX, f64::min);
            // With friction fully compensated a joint drifts by 0.012 rad.
            assert!(drift < 0.005, "a joint of {stiffness} N·m/rad drifts by {drift} rad");
            joint.joint.load = push;
            let moved = still[still.len() - 1] - joint.run(1_500, 1_000).angle;
            let ratio = push / moved / f64::from(stiffness);
            eprintln!(
                "at {stiffness} N·m/rad {push} N·m move it by {moved:.4} rad, {ratio:.2} of it; drift {drift:.4} rad"
            );
            // How far the strands slip within the push is worth a fifth either way.
            assert!((0.75..1.25).contains(&ratio), "{ratio} of {stiffness} N·m/rad");
            ratios.push(ratio);
            gave.push(moved.abs());
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    eprintln!("mean {mean:.3} of the required stiffness");
    assert!((0.9..1.1).contains(&mean), "{mean}");
    assert!(gave[12].max(gave[13]) < 0.6 * gave[0].min(gave[1]), "{gave:?}");
}

#[test]
fn unavailable_angles_and_stiffnesses_are_refused_with_the_range() {
    let spec = presets::miniature();
    let bench = BenchSpec::laboratory(spec.clone(), 5);
    let start = || {
        let joint = Joint::new(&bench, 0.02, 0.002);
        PairLoop::start(joint, &fitting::fitted(&spec), Settings::default())
    };
    let mut joint = start();
    let Err(Refusal::Stiffness { low_nm_per_rad: low, high_nm_per_rad: high }) = joint.ask(0.0, 20.0) else {
        panic!("a miniature pair at 2 mm is stiffer than 20 N·m/rad wherever both muscles pull");
    };
    // The truth: taut from 400 kPa on, at most 620 kPa.
    let truth = Joint::new(&bench, 0.02, 0.002);
    assert!(truth.stiffness_at([380e3; 2], 0.0) < 0.01, "slack");
    let ends = [410e3, 620e3].map(|pascals| truth.stiffness_at([pascals; 2], 0.0));
    eprintln!("{low:.2} to {high:.2} N·m/rad, in fact {ends:.2?}");
    assert!((f64::from(low) / ends[0] - 1.0).abs() < 0.04 && (f64::from(high) / ends[1] - 1.0).abs() < 0.04);
    // Both ends are taken, and reached.
    for stiffness in [low + 0.2, high - 0.2] {
        let mut joint = start();
        joint.ask(0.0, stiffness).expect("within reach");
        let pose = joint.run(2_500, 500);
        assert!((pose.stiffness / f64::from(stiffness) - 1.0).abs() < 0.04, "{pose:?} for {stiffness}");
    }
    let Err(Refusal::Angle { low_rad, high_rad }) = joint.ask(0.5, 27.0) else {
        panic!("half a radian is beyond both muscles");
    };
    assert!(low_rad < -0.02 && high_rad < 0.2 && high_rad > 0.02, "{low_rad} to {high_rad}");
    assert!(joint.ask(0.9 * high_rad, 0.0).is_err_and(|why| matches!(why, Refusal::Stiffness { .. })));
}
