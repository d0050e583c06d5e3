//! A step for people: as a protocol file that a bench runs, and as numbered instructions.

use pam_fit::checks;
use pam_protocol::{Place, Protocol, Step as ProtocolStep};

use crate::criteria::SAMPLE_HZ;
use crate::places::Places;
use crate::step::Step;
use crate::step_profile::{Segment, StepProfile};

/// Speed at which the free end returns to rest length while nothing is recorded, mm/s.
const RETURN_MM_S: f64 = 2.0;

/// The protocol file of a step, recorded under a name; nothing for a check, which has no muscle.
#[must_use]
pub fn protocol(step: &Step, places: &Places, name: &str) -> Option<Protocol> {
    let profile = step.profile(places);
    if profile.segments.is_empty() {
        return None;
    }
    // As long as the free stroke is unknown, a full stroke is one to wherever the muscle is free.
    let unknown = places.model.is_none() && !(places.free > 0.0);
    let mut steps = Vec::new();
    let (mut recording, mut stroke) = (false, 0.0_f64);
    let recorded = recorded(&profile);
    for (at, (segment, _)) in profile.segments.iter().enumerate() {
        if recorded.contains(&at) != recording {
            recording = !recording;
            let file = ProtocolStep::File { name: name.to_owned() };
            steps.push(if recording { file } else { ProtocolStep::EndFile });
        }
        match *segment {
            Segment::Travel { to, speed, until_force } => {
                let place = if unknown && until_force.is_some() {
                    Place::free(1.0)
                } else {
                    Place { mm: Some(to * 1e3), ..Place::default() }
                };
                steps.push(ProtocolStep::Move { to: place, speed_mm_s: speed * 1e3 });
                stroke = to;
            }
            Segment::Ramp { to, rate } => steps.push(ProtocolStep::Pressure {
                to_kpa: to * 1e-3,
                rate_kpa_s: Some(rate * 1e-3),
                settle_s: 0.0,
            }),
            Segment::Hold { seconds } => steps.push(ProtocolStep::Hold { seconds }),
            Segment::Vented { seconds } => {
                if stroke.abs() > 0.0 {
                    let rest = Place { mm: Some(0.0), ..Place::default() };
                    steps.push(ProtocolStep::Move { to: rest, speed_mm_s: RETURN_MM_S });
                    stroke = 0.0;
                }
                steps.push(if recording {
                    ProtocolStep::Tare { seconds }
                } else {
                    ProtocolStep::Rest { seconds }
                });
            }
        }
    }
    Some(Protocol { name: name.to_owned(), sample_hz: SAMPLE_HZ, step: steps })
}

/// A step as instructions for the operator, one sentence each.
#[must_use]
pub fn instructions(step: &Step, places: &Places) -> Vec<String> {
    if let Step::Check { check } = step {
        return of_check(*check);
    }
    let profile = step.profile(places);
    let mut lines: Vec<String> = Vec::new();
    let recorded = recorded(&profile);
    let mut recording = false;
    let mut at = 0;
    while at < profile.segments.len() {
        let segment = profile.segments[at].0;
        if recorded.contains(&at) != recording {
            recording = !recording;
            lines.push(if recording { "Start the recording." } else { "Stop the recording." }.to_owned());
        }
        let times = repeats(&profile, at);
        if times > 1 {
            let pair: Vec<String> =
                profile.segments[at..at + 2].iter().map(|s| sentence(&s.0, places)).collect();
            lines.push(format!("{times} times: {} {}", pair[0], pair[1]));
            at += 2 * times;
        } else {
            lines.push(sentence(&segment, places));
            at += 1;
        }
    }
    if recording {
        lines.push("Stop the recording.".to_owned());
    }
    lines
}

/// Segments from the first that is recorded to the last: an operator records them into one file.
fn recorded(profile: &StepProfile) -> std::ops::Range<usize> {
    let first = profile.segments.iter().position(|s| s.1);
    let last = profile.segments.iter().rposition(|s| s.1);
    first.unwrap_or(0)..last.map_or(0, |last| last + 1)
}

/// How often the pair of segments that begins here follows itself; at least once.
fn repeats(profile: &StepProfile, at: usize) -> usize {
    let Some(pair) = profile.segments.get(at..at + 2) else { return 1 };
    profile.segments[at..].chunks_exact(2).take_while(|next| *next == pair).count().max(1)
}

fn sentence(segment: &Segment, places: &Places) -> String {
    match *segment {
        Segment::Travel { to, speed, until_force } => {
            let (mm, speed) = (to * 1e3, speed * 1e3);
            match until_force {
                Some(least) if places.blocked > 0.0 => format!(
                    "Move to a stroke of {mm:.2} mm at {speed:.3} mm/s, or until the force has fallen to {least:.2} N."
                ),
                Some(_) => format!(
                    "Let the muscle shorten at {speed:.3} mm/s until the force has fallen to 1 % of its largest value, at most to \
                     {mm:.2} mm."
                ),
                None => format!("Move to a stroke of {mm:.2} mm at {speed:.3} mm/s."),
            }
        }
        Segment::Ramp { to, rate } => {
            format!("Change the pressure to {:.1} kPa at {:.1} kPa/s.", to * 1e-3, rate * 1e-3)
        }
        Segment::Hold { seconds } => format!("Hold for {seconds:.0} s."),
        Segment::Vented { seconds } => format!("Vent, return to rest length, and wait {seconds:.0} s."),
    }
}

fn of_check(check: checks::Kind) -> Vec<String> {
    let lines: &[&str] = match check {
        checks::Kind::DeadWeights => &[
            "Take the muscle out.",
            "Hang at least three known weights on the load cell, each for some seconds, up to the force of the muscle: once with the air \
             line vented, once under pressure.",
            "Record time_, force_, reference_force_ and pressure_.",
        ],
        checks::Kind::RigidBar => &[
            "Put a rigid bar in the place of the muscle.",
            "Pull and push slowly, up to the force of the muscle.",
            "Record time_, displacement_, force_ and reference_displacement_.",
        ],
        checks::Kind::ReferenceGauge => &[
            "Connect a more accurate gauge beside that of the bench.",
            "Set at least three pressures, each for some seconds.",
            "Record time_, pressure_ and reference_pressure_.",
        ],
        checks::Kind::Weighing => &[
            "Vent the muscle. Read the load cell with the muscle and its fittings attached, and with nothing attached: in turn, at least \
             twice each, each for some seconds.",
            "Record time_, force_ and attached, which is 1 or 0.",
        ],
        checks::Kind::ClosedValve => &[
            "Hold the muscle at rest length at the highest pressure, and wait until pressure and force are steady.",
            "Close the valve between supply and gauge for half a minute, and open it again: at least three times.",
            "Record time_, pressure_ and valve_closed, which is 1 or 0.",
        ],
    };
    lines.iter().map(|l| (*l).to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;
    use pam_data::muscle_description::MuscleDescription;
    use virtual_bench::presets;

    fn places() -> Places {
        let muscle = MuscleDescription::parse(&presets::miniature().description()).unwrap();
        Places::new(&muscle, &Rig::commanded()).unwrap()
    }

    #[test]
    fn the_protocol_of_every_step_passes_its_own_check_and_repeats_become_one_line() {
        let mut places = places();
        places.free = 8e-3;
        places.blocked = 100.0;
        for step in crate::menu::menu(&places, &Rig { checks: true, ..Rig::commanded() }) {
            let lines = instructions(&step, &places);
            assert!(!lines.is_empty() && lines.iter().all(|l| l.ends_with('.')), "{lines:#?}");
            match (protocol(&step, &places, "x"), step) {
                (Some(p), _) => p.check().unwrap(),
                (None, Step::Check { .. }) => {}
                (None, other) => panic!("no protocol for {other:?}"),
            }
        }
        let loops = Step::Loops { level: 300e3, times: 8.0, count: 3 };
        let lines = instructions(&loops, &places);
        assert_eq!(lines.iter().filter(|l| l.starts_with("3 times: Move")).count(), 1, "{lines:#?}");
    }

    #[test]
    fn a_stroke_ends_where_the_muscle_is_free_before_the_free_stroke_is_known() {
        let protocol = protocol(&Step::Survey { times: 8.0 }, &places(), "x").unwrap();
        assert!(protocol.step.iter().any(
            |s| matches!(s, ProtocolStep::Move { to: Place { free: Some(part), .. }, .. } if *part == 1.0)
        ));
    }
}
