//! How quick a force can be requested: the frequency at which a small wave comes through with half its power.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use firmware::tick::TICK_S;
use model_core::link::messages::{Mode, SetPoint};
use virtual_bench::bench::BenchSpec;

use crate::closed_loop::Loop;
use crate::sweep::{Law, Load, Subject};

/// Frequencies that are tried, Hz.
const FREQUENCIES: [f64; 12] = [0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0];
/// Amplitude as a part of blocked force: the regulator's fastest change is not requested below some tens of hertz.
const AMPLITUDE: f64 = 0.02;

/// Where a law's waves fade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bandwidth {
    /// The true force's amplitude is 1/√2 of the setpoint at this frequency, Hz; the highest tried where it never is.
    pub hz: f64,
    /// The largest amplitude below it, as a part of the setpoint.
    pub peak: f64,
}

/// The true force's amplitude as a part of the setpoint, of a sine that a host sends tick by tick.
fn gain(subject: &Subject, law: Law, hz: f64) -> f64 {
    let bench = BenchSpec::laboratory(subject.spec.clone(), 11);
    let settings = subject.settings(law, Load::AtStroke);
    let mut control =
        Loop::start(&bench, &subject.motion(Load::AtStroke), &subject.table, settings, Mode::Force);
    let (mean, _) = subject.setpoint_range(Mode::Force);
    let amplitude = AMPLITUDE * subject.blocked();
    control.point(SetPoint::Force(mean));
    control.run(1_000);
    // Two seconds at least, in whole periods; as much before them.
    let ticks = ((2.0 * hz).ceil() / hz / f64::from(TICK_S)).round() as u32;
    let (mut sine, mut cosine) = (0.0, 0.0);
    for tick in 0..2 * ticks {
        let phase = TAU * hz * f64::from(tick) * f64::from(TICK_S);
        control.point(SetPoint::Force(mean + (amplitude * phase.sin()) as f32));
        let now = control.run(1)[0];
        if tick >= ticks {
            sine += (now.force - f64::from(mean)) * phase.sin();
            cosine += (now.force - f64::from(mean)) * phase.cos();
        }
    }
    2.0 * sine.hypot(cosine) / f64::from(ticks) / amplitude
}

impl Subject {
    /// Where a law's waves of force fade at held length.
    pub fn bandwidth(&self, law: Law) -> Bandwidth {
        let (mut last, mut peak) = ((FREQUENCIES[0], 1.0), 0.0_f64);
        for hz in FREQUENCIES {
            let now = gain(self, law, hz);
            if now < FRAC_1_SQRT_2 {
                // Straight between both on paper with a logarithm of frequency.
                let share = (last.1 - FRAC_1_SQRT_2) / (last.1 - now);
                return Bandwidth { hz: last.0 * (hz / last.0).powf(share.clamp(0.0, 1.0)), peak };
            }
            peak = peak.max(now);
            last = (hz, now);
        }
        Bandwidth { hz: last.0, peak }
    }
}
