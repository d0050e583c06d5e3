//! What to record or to measure next.

use pam_diagnose::experiment::{BenchCheck, Experiment, Motion, Proposal};

/// A proposal as text without its full stop.
#[must_use]
pub fn proposal(p: &Proposal) -> String {
    let motion = motion(p.motion);
    match p.check {
        Some(check) if !p.motion_separates => {
            format!("no motion separates these effects; {}", bench_check(check))
        }
        Some(check) => format!("{motion}; also, {}", bench_check(check)),
        None => motion.to_owned(),
    }
}

fn motion(motion: Motion) -> &'static str {
    match motion {
        Motion::Speeds => "loops at 0.3, 1, 4 and 16 times the slow speed, at two pressures",
        Motion::Dwells => "holds of 1, 10 and 100 s at one length, reached from both sides, at two pressures",
        Motion::NestedLoops => "nested small loops at two speeds, at two pressures",
        Motion::PressureRamps => "slow pressure ramps at three held lengths",
        Motion::Rest => {
            "the same loops before and after half an hour of vented rest, with the load cell's zero before and after"
        }
    }
}

fn bench_check(check: BenchCheck) -> &'static str {
    match check {
        BenchCheck::RigidBar => {
            "put a rigid bar in the muscle's place and load it once: this shows the compliance and play of the frame"
        }
        BenchCheck::DeadWeights => {
            "hang dead weights on the load cell, with and without pressure in the line"
        }
        BenchCheck::ReferenceGauge => "compare the gauge with a reference at three pressures",
        BenchCheck::ClosedValve => {
            "close the valve of the muscle under pressure for half a minute, three times"
        }
        BenchCheck::VentedLength => "measure the vented length with a calliper before and after",
        BenchCheck::Weighing => {
            "read the vented load cell with muscle and fittings attached, and with nothing attached, in turn"
        }
        BenchCheck::EndsAndDiameter => "photograph the ends and measure the diameter at three pressures",
    }
}

/// Whether an effect shows only where the muscle moves.
#[must_use]
pub(super) fn needs_strokes(measure: Experiment) -> bool {
    match measure {
        Experiment::NestedLoops
        | Experiment::Speeds
        | Experiment::PressuresAndRamps
        | Experiment::RestsFromBothSides
        | Experiment::FirstStrokes
        | Experiment::RepeatsAfterRest
        | Experiment::EndOfStroke
        | Experiment::Varied => true,
        Experiment::VentedReadings
        | Experiment::Weighing
        | Experiment::ReferenceGauge
        | Experiment::ClosedValve
        | Experiment::DeadWeights
        | Experiment::RigidBar
        | Experiment::VentedLength
        | Experiment::EndsAndDiameter
        | Experiment::PressureRamps
        | Experiment::Rests
        | Experiment::LongHolds => false,
    }
}

/// What to do so that an effect would show which recordings like these conceal.
#[must_use]
pub(crate) fn measure(measure: Experiment) -> &'static str {
    match measure {
        Experiment::VentedReadings => "record the vented load cell before, between and after the tests",
        Experiment::Weighing => "weigh the muscle and its fittings, or turn the bench by 90°",
        Experiment::ReferenceGauge => "compare the gauge with a reference, vented and at three pressures",
        Experiment::ClosedValve => {
            "close the valve of the muscle under pressure for half a minute, three times"
        }
        Experiment::DeadWeights => {
            "hang dead weights on the load cell, with and without pressure in the line"
        }
        Experiment::RigidBar => "put a rigid bar in the muscle's place and load it once",
        Experiment::VentedLength => "measure the vented length with a calliper before and after",
        Experiment::EndsAndDiameter => {
            "photograph the ends and measure the diameter at three pressures, or test two lengths of the same stock"
        }
        Experiment::PressureRamps => "record slow pressure ramps from zero at three held lengths",
        Experiment::Rests => "record holds of 1, 10 and 100 s at one length, sampled at 100 Hz or faster",
        Experiment::NestedLoops => "record nested small loops at two speeds",
        Experiment::Speeds => "record loops at four speeds over two decades",
        Experiment::PressuresAndRamps => {
            "record loops at four pressures and slow pressure ramps at held lengths"
        }
        Experiment::RestsFromBothSides => {
            "hold one length reached from both sides: the gap closes to the true middle"
        }
        Experiment::LongHolds => "hold the length for 100 s at two pressures, reached from both sides",
        Experiment::FirstStrokes => "record a new specimen's first strokes, and the same again after a day",
        Experiment::RepeatsAfterRest => {
            "repeat the first loops at the end, and again after half an hour of vented rest"
        }
        Experiment::EndOfStroke => "record up to the end of the free stroke",
        Experiment::Varied => "record several speeds, with holds, and repeat the first pressure at the end",
    }
}
