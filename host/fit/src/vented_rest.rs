//! The time before recordings at held lengths, as memories of the load see it.
//!
//! Between two recordings the muscle is vented in [`VENTING`] seconds, rests without pressure, and is filled from there to the first
//! reading. Where it was remounted in between, it may have carried a load without a recording ([`EarlierLoad`]). Recordings
//! in motion do not show the time between them.

use model_core::effects::{Context, EffectName, FittedEffect};
use model_core::motion::Motion;
use model_core::muscle::Muscle;
use model_core::units::Pressure;
use serde::{Deserialize, Serialize};

use pam_data::pluralise::pluralise;
use pam_data::recording::{Preceding, Rest, VENTING};

/// A load without a recording: before the first recording of each mounting that follows another, the muscle was filled at that length.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct EarlierLoad {
    /// To this pressure, Pa.
    pub pressure: f64,
    /// For this long, s.
    pub seconds: f64,
}

/// The time in which a muscle is filled for an earlier load, s.
const FILLING: f64 = 1.0;
/// From the end of an earlier load to the first recording, s.
const VENTED_BEFORE: f64 = 30.0;

/// Whether an effect of a table requires the time before recordings.
#[must_use]
pub(crate) fn matters(effects: &[FittedEffect]) -> bool {
    effects.iter().any(|e| e.effect == EffectName::BladderCreep)
}

/// The moments before a recording whose motions are given. The first of these then follows the rest, not the recording before.
pub(crate) fn contexts(
    muscle: &Muscle<f64>,
    motions: &mut [Motion<f64>],
    rest: &Rest,
    earlier: Option<&EarlierLoad>,
) -> Vec<Context<f64>> {
    let Some(first) = motions.first_mut() else { return Vec::new() };
    let venting = VENTING.min(0.5 * rest.seconds);
    first.dt = rest.lead;
    let held = Motion { speed: 0.0, acceleration: 0.0, pressure_rate: 0.0, resting: 1.0, ..*first };
    let at =
        |dt: f64, pressure: f64| muscle.context(&Motion { dt, ..held }, Pressure::from_pascals(pressure));
    let mut moments = vec![at(venting, 0.0), at(rest.seconds - venting, 0.0)];
    if let Some(load) = earlier.filter(|_| rest.after == Preceding::OtherMounting) {
        moments.extend([at(FILLING, load.pressure), at(load.seconds, load.pressure)]);
        moments.extend([at(VENTING, 0.0), at(VENTED_BEFORE, 0.0)]);
    }
    moments
}

/// What is assumed about rests that no clock shows.
#[must_use]
pub fn remark(rests: &[Rest]) -> Option<String> {
    let assumed = |after: Preceding, what: &str| {
        let mut of = rests.iter().filter(|r| !r.known && r.after == after);
        let seconds = of.next()?.seconds;
        Some(format!("{} {what} ({seconds} s without pressure assumed)", pluralise(1 + of.count(), "pause")))
    };
    let all = [
        assumed(Preceding::SameMounting, "between recordings of one mounting"),
        assumed(Preceding::OtherMounting, "between mountings"),
    ];
    let all: Vec<String> = all.into_iter().flatten().collect();
    (!all.is_empty()).then(|| format!("the recordings do not contain {}", all.join(" and ")))
}
