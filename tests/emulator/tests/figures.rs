//! Instructions per call, with bounds on both sides: an improvement is committed on purpose.

use emulator_tests::figures;

#[test]
fn instruction_counts_stay_where_they_are() {
    let Ok(counted) = figures::count() else { return };
    eprintln!("{}", figures::markdown(&counted));
    let of = |name: &str| counted.iter().find(|figure| figure.name == name).expect("counted");
    let (force, inverse, direct, step) = (of("force"), of("inverse"), of("direct-port"), of("step"));
    assert!((100.0..260.0).contains(&force.mean), "force: {force:?}");
    assert!((200.0..620.0).contains(&inverse.mean), "inverse: {inverse:?}");
    assert!(
        direct.mean > 5.0 * force.mean,
        "the direct port is {:.1} times the force",
        direct.mean / force.mean
    );
    assert!((1000.0..3000.0).contains(&step.mean), "step: {step:?}");
    for figure in [force, inverse, step] {
        assert!(figure.worst <= 1.5 * figure.mean, "{figure:?}");
    }
    assert!(of("table-image").mean <= 1024.0);
}
