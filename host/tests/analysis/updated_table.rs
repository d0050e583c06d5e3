//! `host diagnose --reference … -o`: what becomes of the table after a change of the actuator.

use model_core::effects::EffectName;
use pam_data::recording::Campaign;
use pam_diagnose::reference::answer::ChangeReport;
use pam_diagnose::reference::correction::{self, Done};
use pam_diagnose::reference::{Against, Options, compare};
use pam_fit::predict::predict;
use pam_fit::table_file::TableFile;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::muscle::Muscle;
use virtual_bench::physics::{Seal, Slip};
use virtual_bench::{campaigns, presets};

use crate::bench_campaign;

fn bench(seed: u64) -> BenchSpec {
    BenchSpec::laboratory(presets::by_name("mini").expect("a preset"), seed)
}

/// Loops at some of the muscle's pressures.
fn recorded(bench: &BenchSpec, levels: impl Fn(usize) -> bool) -> Campaign {
    let muscle = Muscle::new(bench.muscle.clone());
    let all = campaigns::levels(&muscle);
    let some: Vec<f64> = all.iter().enumerate().filter(|(i, _)| levels(*i)).map(|(_, p)| *p).collect();
    let files = Bench::new(bench).run(&campaigns::classic(&muscle, &some)).expect("a protocol");
    Campaign::new(bench_campaign::recordings(&files))
}

fn compared(before: &Campaign, after: &Campaign) -> ChangeReport {
    let description = bench_campaign::description(&bench(1).muscle);
    let options = Options { geometry: Some(description.geometry()), ..Options::default() };
    compare(after, Against::Recordings(before), &options).expect("comparable")
}

fn table(
    report: &ChangeReport,
    before: &Campaign,
    after: &Campaign,
) -> pam_data::error::Result<(TableFile, Done)> {
    let description = bench_campaign::description(&bench(1).muscle);
    correction::table(report, || correction::fitted(before, &description), after, &description)
}

fn rms(file: &TableFile, campaign: &Campaign) -> f64 {
    predict(file, campaign).expect("a prediction").rms.expect("a force")
}

#[test]
fn two_pressures_after_more_friction_update_the_table_for_all_of_them() {
    let before = recorded(&bench(1), |_| true);
    let mut rubbing = bench(2);
    let force = 300.0;
    rubbing.muscle.physics.seal =
        Some(Seal { dry: 0.02 * force, per_pressure: 0.0, travel: 1e-5, slow: 0.0, slow_speed: 0.0 });
    let after = recorded(&rubbing, |i| i == 2 || i == 4);
    let report = compared(&before, &after);
    assert_eq!(report.missing.first().map(|m| m.effect.as_str()), Some("coulomb-friction"), "{report:?}");
    let (file, done) = table(&report, &before, &after).expect("a table");
    assert_eq!(done, Done::Updated);
    assert_eq!(file.table.effects[0].effect, EffectName::CoulombFriction);
    // Judged at pressures that were not recorded after the change.
    let elsewhere = recorded(&rubbing, |i| i != 2 && i != 4);
    let old = correction::fitted(&before, &bench_campaign::description(&bench(1).muscle)).expect("a table");
    let (without, with) = (rms(&old, &elsewhere), rms(&file, &elsewhere));
    assert!(with < 0.5 * without, "{with} N with the change, {without} N without");
}

#[test]
fn a_whole_campaign_after_the_change_is_refitted_and_a_slip_is_refused() {
    let before = recorded(&bench(1), |_| true);
    let mut rubbing = bench(2);
    rubbing.muscle.physics.seal =
        Some(Seal { dry: 6.0, per_pressure: 0.0, travel: 1e-5, slow: 0.0, slow_speed: 0.0 });
    let after = recorded(&rubbing, |_| true);
    let (_, done) = table(&compared(&before, &after), &before, &after).expect("a table");
    assert_eq!(done, Done::Refitted);
    let mut slipping = bench(3);
    slipping.muscle.physics.slip = Some(Slip { time: 200.0, travel: 1.2e-3 });
    let slipped = recorded(&slipping, |_| true);
    let report = compared(&before, &slipped);
    assert_eq!(report.missing.first().map(|m| m.effect.as_str()), Some("end-slip"), "{report:?}");
    let error = table(&report, &before, &slipped).expect_err("a slip is repaired at the bench");
    assert!(error.cause().contains("repaired at the bench"), "{error}");
}
