//! The memory through a table: a muscle whose forces a table with `bladder-creep` makes, by the law as the catalogue has it.

use model_core::effects::{EffectName, FittedEffect};
use model_core::table;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_fit::predict::predict;
use pam_fit::table_file::{About, TableFile};
use pam_fit::vented_rest::EarlierLoad;

use super::super::table_fit;
use super::super::table_unseen::{LeftOut, unseen_by_table};
use crate::linear::Random;

const DESCRIPTION: &str = "name = \"mini\"\nkind = \"contractile\"\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
    bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\nmax_pressure_kPa = 600\n";
/// `c`, `b` and `d` in Pa, `P_c` in Pa.
const TRUTH: [f64; 4] = [0.5, 15e3, 20e3, 9e4];

/// Staircases at four lengths, five runs each, with the forces of a table that carries the memory, and noise.
fn campaign(effects: &[f64; 4]) -> Campaign {
    campaign_of(&[FittedEffect::new(EffectName::BladderCreep, effects)])
}

/// The same with any effects.
fn campaign_of(effects: &[FittedEffect]) -> Campaign {
    campaign_after(effects, None)
}

/// The same after a load before each change of the mounting.
fn campaign_after(effects: &[FittedEffect], earlier_load: Option<EarlierLoad>) -> Campaign {
    let mut recordings = Vec::new();
    for mounting in 0..4 {
        for run in 0..5 {
            let time: Vec<f64> = (0..100).map(|i| 0.4 + 0.5 * f64::from(i)).collect();
            let filled = |t: f64| if t < 27.0 { 1.0 - (-t / 6.0).exp() } else { (-(t - 27.0) / 5.0).exp() };
            recordings.push(Recording {
                name: format!("mounting{mounting}_run{run}"),
                stroke: vec![0.6e-3 * f64::from(mounting); time.len()],
                pressure: time.iter().map(|t| 9e3 + 560e3 * filled(*t)).collect(),
                direction: Some(time.iter().map(|t| if *t < 27.0 { 1 } else { -1 }).collect()),
                force: Some(vec![0.0; time.len()]),
                time,
                ..Recording::default()
            });
        }
    }
    let mut campaign = Campaign::new(recordings);
    let mut table = table::example();
    table.goes_slack = true;
    table.friction.iter_mut().for_each(|k| *k = 0.01);
    table.effects.extend(effects.iter().cloned());
    let about = About { earlier_load, ..About::default() };
    let made = predict(&TableFile { table, about }, &campaign).expect("a valid table");
    let mut random = Random(7);
    for (recording, made) in campaign.recordings.iter_mut().zip(&made.recordings) {
        recording.force = Some(made.force.iter().map(|f| f + 0.1 * random.normal()).collect());
    }
    campaign
}

#[test]
fn a_table_carries_the_memory_and_predicts_unseen_runs() {
    let muscle = MuscleDescription::parse(DESCRIPTION).expect("a description");
    let campaign = campaign(&TRUTH);
    let file = table_fit::table(&campaign, &muscle).expect("fitted").expect("staircases");
    let effect = &file.table.effects[0];
    assert_eq!(effect.effect, EffectName::BladderCreep);
    assert!((f64::from(effect.parameters[0]) / TRUTH[0] - 1.0).abs() < 0.2, "{effect:?}");
    assert_eq!(file.about.earlier_load, None, "nothing was loaded before");
    let [settled, recorded] =
        unseen_by_table(&campaign, &campaign, &muscle, LeftOut::Runs).expect("fitted").expect("staircases");
    assert!(settled.with_memory.rms_pct < 0.5 * settled.without_memory.rms_pct, "{settled:?}");
    assert_eq!(settled.with_memory, recorded.with_memory);
}

/// A mounting that is 0.4 mm from its stated place: with the length that suits its readings most of its error is gone.
#[test]
fn the_error_by_a_wrong_length_of_an_unseen_mounting_is_separated() {
    let muscle = MuscleDescription::parse(DESCRIPTION).expect("a description");
    let mut campaign = campaign(&TRUTH);
    let unseen = |campaign: &Campaign| {
        let errors = unseen_by_table(campaign, campaign, &muscle, LeftOut::Mountings);
        let [settled, _] = errors.expect("fitted").expect("staircases");
        (settled.with_memory.rms_pct, settled.with_own_length.rms_pct)
    };
    let (right, right_own) = unseen(&campaign);
    for recording in campaign.recordings.iter_mut().filter(|r| r.name.starts_with("mounting1")) {
        recording.stroke.iter_mut().for_each(|s| *s += 0.4e-3);
    }
    let (wrong, wrong_own) = unseen(&campaign);
    assert!(wrong > 2.0 * right, "a wrong length costs nothing: {right} and {wrong} %");
    assert!(
        wrong_own < 0.6 * wrong && right_own <= right,
        "{wrong_own} of {wrong}, {right_own} of {right} %"
    );
}

/// The wall's drive in the fit is that of the round before: a table that is taken too early predicts worse than its own fit.
#[test]
fn a_table_predicts_its_recordings_as_well_as_it_was_fitted() {
    let muscle = MuscleDescription::parse(DESCRIPTION).expect("a description");
    let campaign = campaign(&[0.7, 10e3, 100e3, 6e4]);
    let file = table_fit::table(&campaign, &muscle).expect("fitted").expect("staircases");
    let predicted = predict(&file, &campaign).expect("a valid table");
    let (mut squares, mut count) = (0.0, 0.0);
    for (recording, predicted) in campaign.recordings.iter().zip(&predicted.recordings) {
        let read = recording.force.as_ref().expect("a force");
        for (read, predicted) in read.iter().zip(&predicted.force).filter(|(read, _)| **read > 10.0) {
            squares += (predicted - read).powi(2);
            count += 1.0;
        }
    }
    let (rms, fitted) = ((squares / count).sqrt(), file.about.fit.rms_newtons);
    assert!((rms / fitted - 1.0).abs() < 0.1, "predicted with {rms} N rms, fitted with {fitted} N");
}

#[test]
fn a_load_before_a_change_of_the_mounting_is_found_and_stored() {
    let muscle = MuscleDescription::parse(DESCRIPTION).expect("a description");
    let loaded = EarlierLoad { pressure: 569e3, seconds: 300.0 };
    let campaign = campaign_after(&[FittedEffect::new(EffectName::BladderCreep, &TRUTH)], Some(loaded));
    let file = table_fit::table(&campaign, &muscle).expect("fitted").expect("staircases");
    let found = file.about.earlier_load.expect("found");
    assert!((100.0..=1000.0).contains(&found.seconds), "{found:?}");
    assert!((found.pressure / loaded.pressure - 1.0).abs() < 0.02, "{found:?}");
    assert!(file.about.fit.warnings.iter().any(|w| w.contains("before")), "{:?}", file.about.fit.warnings);
}

#[test]
fn without_a_memory_none_is_found() {
    let muscle = MuscleDescription::parse(DESCRIPTION).expect("a description");
    let campaign = campaign(&[0.0, 0.0, TRUTH[2], TRUTH[3]]);
    let file = table_fit::table(&campaign, &muscle).expect("fitted").expect("staircases");
    let parameters = &file.table.effects[0].parameters;
    assert!((0.0..0.05).contains(&parameters[0]) && (0.0..5e3).contains(&parameters[1]), "{parameters:?}");
}

#[test]
fn friction_that_grows_with_the_radius_is_in_the_table() {
    let muscle = MuscleDescription::parse(DESCRIPTION).expect("a description");
    let grows = 0.3;
    let campaign = campaign_of(&[
        FittedEffect::new(EffectName::BladderCreep, &TRUTH),
        FittedEffect::new(EffectName::PressureFriction, &[f64::from(grows), -f64::from(grows)]),
    ]);
    let file = table_fit::table(&campaign, &muscle).expect("fitted").expect("staircases");
    let found = file.table.effects.iter().find(|e| e.effect == EffectName::PressureFriction);
    let found = found.expect("named").parameters[0];
    assert!((found / grows - 1.0).abs() < 0.2, "{found}");
}

#[test]
fn the_uncertainty_of_the_table_is_stored_with_it() {
    let muscle = MuscleDescription::parse(DESCRIPTION).expect("a description");
    let file = table_fit::table(&campaign(&TRUTH), &muscle).expect("fitted").expect("staircases");
    let uncertainty = file.about.uncertainty.as_ref().expect("a jackknife over runs");
    let numbers = 1 + (file.table.elastic.len() + 1) * file.table.nodes.len();
    assert_eq!(uncertainty.rows as usize, numbers);
    let deadband: f64 = uncertainty.root[..uncertainty.columns as usize].iter().map(|x| x * x).sum();
    assert!((1.0..2e4).contains(&deadband.sqrt()), "P0 ± {} Pa", deadband.sqrt());
    assert!((0.05..0.3).contains(&uncertainty.residual_newtons), "{}", uncertainty.residual_newtons);
}
