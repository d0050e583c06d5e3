//! What to record or to measure next.

use pam_diagnose::experiment::{BenchCheck, Measure, Motion, Proposal};

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
        BenchCheck::ReferenceGauge => {
            "compare the gauge with a reference at three pressures, and close the valve for a minute"
        }
        BenchCheck::VentedLength => "measure the vented length with a calliper before and after",
        BenchCheck::Weight => "weigh the muscle, and record the vented load cell before and after",
        BenchCheck::Photographs => "photograph the ends and measure the diameter at three pressures",
    }
}

/// What to do so that an effect would show which recordings like these conceal.
#[must_use]
pub fn measure(measure: Measure) -> &'static str {
    match measure {
        Measure::VentedCell => "record the vented load cell before, between and after the tests",
        Measure::Weigh => "weigh the muscle and its fittings, or turn the bench by 90°",
        Measure::ReferenceGauge => "compare the gauge with a reference, vented and at three pressures",
        Measure::DeadWeights => "hang dead weights on the load cell, with and without pressure in the line",
        Measure::RigidBar => "put a rigid bar in the muscle's place and load it once",
        Measure::VentedLength => "measure the vented length with a calliper before and after",
        Measure::Photographs => {
            "photograph the ends and measure the diameter at three pressures, or test two lengths of the same stock"
        }
        Measure::PressureRamps => "record slow pressure ramps from zero at three held lengths",
        Measure::FastRests => "record holds of 1, 10 and 100 s at one length, sampled at 100 Hz or faster",
        Measure::NestedLoops => "record nested small loops at two speeds",
        Measure::FourSpeeds => "record loops at four speeds over two decades",
        Measure::FourPressures => "record loops at four pressures and slow pressure ramps at held lengths",
        Measure::RestBothSides => {
            "hold one length reached from both sides: the gap closes to the true middle"
        }
        Measure::LongHolds => "hold the length for 100 s at two pressures, reached from both sides",
        Measure::FirstStrokes => "record a new specimen's first strokes, and the same again after a day",
        Measure::RepeatFirst => {
            "repeat the first loops at the end, and again after half an hour of vented rest"
        }
        Measure::FreeStrokeEnd => "record up to the end of the free stroke",
        Measure::Varied => "record several speeds, with holds, and repeat the first pressure at the end",
    }
}
