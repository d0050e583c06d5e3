//! A diagnosed table against a plain one, under control: muscles whose left-out physics the tool has to find first.

use emulator_tests::diagnosed::{self, Case, Tables};

/// Cases in which the named effect helps the controller, and how much of what it costs must come back at least.
const HELPED: [(&str, f64); 3] =
    [("coulomb-friction", 0.4), ("viscous-damping", 0.5), ("stress-relaxation", 0.3)];

fn case(effect: &str) -> (Case, Tables) {
    let case = diagnosed::cases().into_iter().find(|c| c.effect == effect).expect("a case");
    let tables = diagnosed::tables(&case);
    let first = tables.named.first().map(|n| n.0.as_str());
    assert_eq!(first, Some(effect), "{:?} {:#?}", tables.named, tables.remarks);
    assert!(tables.rms.1 < 0.8 * tables.rms.0, "{:?}", tables.rms);
    (case, tables)
}

#[test]
fn the_controllers_step_follows_better_with_the_diagnosed_table() {
    for (effect, least) in HELPED {
        let (case, tables) = case(effect);
        let before = diagnosed::here(&case.spec, &case, &tables.plain);
        let after = diagnosed::here(&case.spec, &case, &tables.diagnosed);
        let floor = diagnosed::here(&case.plain, &case, &diagnosed::table_without(&case));
        eprintln!("{effect}: {before:.2} % plain, {after:.2} % diagnosed, {floor:.2} % without the effect");
        assert!(before > 1.05 * floor, "{effect}: nothing to gain, {before} {floor}");
        assert!(before - after > least * (before - floor), "{effect}: {before} {after} {floor}");
    }
}

#[test]
fn the_image_in_the_emulator_does_too() {
    let (case, tables) = case("viscous-damping");
    let run = diagnosed::in_emulator(&case.spec, &case, &[&tables.plain, &tables.diagnosed]);
    let Ok(errors) = run else { return };
    eprintln!("viscous-damping: {:.2} % plain, {:.2} % diagnosed", errors[0], errors[1]);
    assert!(errors[1] < 0.8 * errors[0], "{errors:?}");
}
