//! Which steps a rig can do, and the first ones of every campaign.

use pam_fit::checks;

use crate::criteria::{FIRST_TARE, SURVEY_SPEED};
use crate::places::Places;
use crate::rig::{Axis, Rig};
use crate::step::Step;

/// Every step that the rig can do, in a fixed order.
#[must_use]
pub fn menu(places: &Places, rig: &Rig) -> Vec<Step> {
    let levels = places.levels();
    let middle = levels.get(levels.len() / 2).copied().unwrap_or(places.top);
    let mut steps = Vec::new();
    if rig.axis.moves() {
        for &level in &levels {
            steps.extend([
                Step::Loops { level, times: 1.0, count: 2 },
                Step::Loops { level, times: 8.0, count: 3 },
                Step::Speeds { level },
                Step::Dwells { level, seconds: 30.0 },
                Step::Dwells { level, seconds: 90.0 },
                Step::Nested { level, times: 4.0 },
            ]);
        }
        steps.push(Step::Rest { seconds: 300.0, level: middle });
    }
    let parts: &[f64] = if rig.axis.positions() { &[0.0, 0.3, 0.6] } else { &[0.0] };
    steps.extend(parts.iter().map(|part| Step::Ramps { part: *part }));
    if !rig.axis.moves() {
        let seconds = [4.0, 20.0];
        steps.extend(
            parts.iter().flat_map(|part| seconds.map(|seconds| Step::Staircase { part: *part, seconds })),
        );
    }
    steps.push(Step::Tare { seconds: 10.0 });
    if rig.checks {
        steps.extend(checks::Kind::ALL.map(|check| Step::Check { check }));
    }
    steps
}

/// The first steps of a campaign with the reason of each: before there is a table, nothing can be ranked.
#[must_use]
pub fn opening(rig: &Rig) -> Vec<(Step, &'static str)> {
    let mut steps = vec![
        (Step::Tare { seconds: FIRST_TARE }, "The zeros of the instruments are needed before anything else."),
        (
            Step::BlockedRamp,
            "It shows the deadband and the blocked force, from which the pressure levels follow.",
        ),
    ];
    if rig.axis.moves() {
        steps.push((
            Step::Survey { times: SURVEY_SPEED },
            "It shows the free stroke and the friction at all pressure levels, as soon as possible.",
        ));
    } else {
        steps.push((
            Step::Staircase { part: 0.0, seconds: 4.0 },
            "It shows the force at rest length over all pressures.",
        ));
        if rig.axis == Axis::Prompt {
            let held = |part: f64| Step::Staircase { part, seconds: 4.0 };
            steps.extend([
                (held(0.3), "A second length is needed for the elasticity of the bladder."),
                (held(0.6), "A third length limits the table on the other side."),
            ]);
        }
    }
    steps
}
