//! The rest between recordings at held lengths, as memories of the load see it.
//!
//! The muscle is vented in [`VENTING`] seconds, rests without pressure, and is filled from there to the first reading. Other recordings
//! say nothing about the time between them.

use model_core::effects::{Context, EffectName, FittedEffect};
use model_core::motion::Motion;
use model_core::muscle::Muscle;
use model_core::units::Pressure;

use pam_data::pluralise::pluralise;
use pam_data::recording::{Rest, VENTING};

/// Whether an effect of a table asks for the rest between recordings.
#[must_use]
pub fn matters(effects: &[FittedEffect]) -> bool {
    effects.iter().any(|e| e.effect == EffectName::BladderCreep)
}

/// The moments of the rest before a recording whose motions are given. The first of these then follows the rest, not the recording before.
pub fn contexts(muscle: &Muscle<f64>, motions: &mut [Motion<f64>], rest: &Rest) -> Vec<Context<f64>> {
    let Some(first) = motions.first_mut() else { return Vec::new() };
    let venting = VENTING.min(0.5 * rest.seconds);
    let resting = if rest.remounted { f64::INFINITY } else { rest.seconds - venting };
    first.dt = rest.lead;
    let vented = Motion { speed: 0.0, acceleration: 0.0, pressure_rate: 0.0, resting: 1.0, ..*first };
    let at = |dt: f64| muscle.context(&Motion { dt, ..vented }, Pressure::from_pascals(0.0));
    vec![at(venting), at(resting)]
}

/// What is assumed about rests that no clock tells.
#[must_use]
pub fn remark(rests: &[Rest]) -> Option<String> {
    let mut assumed = rests.iter().filter(|r| !r.known && !r.remounted);
    let seconds = assumed.next()?.seconds;
    let pauses = pluralise(1 + assumed.count(), "pause");
    Some(format!(
        "the clock does not show {pauses} between recordings of one mounting: counted as {seconds} s without pressure"
    ))
}
