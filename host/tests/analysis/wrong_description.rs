//! Recordings whose units no muscle agrees with, and descriptions whose dimensions are wrong: no physics is named for them without a remark.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use bench_campaign::{description, thesis};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_diagnose::remark::{Dimension, Remark, Unjudgeable};
use pam_diagnose::verdict::{Diagnosis, Outcome};
use pam_diagnose::{Options, diagnose_described};
use pam_fit::fit;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::{campaigns, presets};

use crate::bench_campaign;

/// One newton in pounds of force.
const NEWTON: f64 = 1.0 / 4.448_221_6;

fn recorded() -> (MuscleSpec, Campaign) {
    let spec = presets::contractile();
    let levels = campaigns::levels(&Muscle::new(spec.clone()));
    let campaign = thesis(&spec, &levels, 1, 10.0);
    (spec, campaign)
}

fn diagnosed(campaign: &Campaign, muscle: &MuscleDescription) -> Diagnosis {
    let plain = fit(campaign, muscle, &pam_fit::Options::default());
    diagnose_described(campaign, muscle, &Options::default(), plain.as_ref()).unwrap()
}

fn dimensions(diagnosis: &Diagnosis) -> Option<&[Dimension]> {
    diagnosis.remarks.iter().find_map(|r| match r {
        Remark::Dimensions(all) => Some(all.as_slice()),
        _ => None,
    })
}

#[test]
fn a_force_in_another_unit_is_not_judged() {
    let (spec, mut campaign) = recorded();
    for r in &mut campaign.recordings {
        r.force.as_mut().unwrap().iter_mut().for_each(|f| *f *= NEWTON);
    }
    let answer = diagnosed(&campaign, &description(&spec));
    let Outcome::NotJudged(Unjudgeable::Implausible(why)) = &answer.outcome else {
        panic!("{:?}", answer.outcome)
    };
    assert!(why.contains("units"), "{why}");
    assert!(answer.missing.is_empty() && answer.next_experiment.is_none());
}

#[test]
fn pressures_in_two_units_are_not_judged() {
    let (spec, mut campaign) = recorded();
    for r in campaign.recordings.iter_mut().step_by(2) {
        r.pressure.iter_mut().for_each(|p| *p /= 6.894_757);
    }
    let answer = diagnosed(&campaign, &description(&spec));
    assert!(!answer.judged(), "{:?}", answer.missing);
}

/// Names stay: the recordings do not distinguish dimensions from physics, and a remark says so.
#[test]
fn dimensions_that_explain_as_much_as_an_effect_are_mentioned() {
    let (spec, campaign) = recorded();
    let mut muscle = description(&spec);
    assert!(dimensions(&diagnosed(&campaign, &muscle)).is_none());
    let right = muscle.braid_angle_deg;
    muscle.braid_angle_deg -= 2.0;
    let answer = diagnosed(&campaign, &muscle);
    let all = dimensions(&answer).unwrap_or_else(|| panic!("{:?} {:?}", answer.missing, answer.remarks));
    let angle = all.iter().find(|d| d.name == "braid_angle").unwrap();
    assert!((angle.fitted - right).abs() < 1.5 && (angle.described - right + 2.0).abs() < 1e-9, "{angle:?}");
}
