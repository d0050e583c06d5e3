//! The menu of recordings that separate effects.

use model_core::muscle::Muscle;

use crate::criteria::planning::{
    MENU_DWELL_AT, MENU_DWELL_SPEED, MENU_DWELL_TURNS, MENU_DWELLS, MENU_MINUTES, MENU_NESTED,
    MENU_NESTED_SPEEDS, MENU_PART, MENU_PRESSURE_RATE, MENU_PRESSURES, MENU_RAMP_LENGTHS, MENU_RAMP_SPEED,
    MENU_RAMP_TIME, MENU_RAMPS, MENU_REST, MENU_REST_LOOPS, MENU_SAMPLES, MENU_SETTLE, MENU_SPEEDS,
    MENU_TARE, SLOW_STROKE,
};
use crate::experiment::Motion;
use crate::protocol_simulation::{Place, Protocol, Step, free_stroke};

/// One entry of the menu: what it is, what it costs, its protocol.
pub(super) struct Item {
    pub motion: Motion,
    pub minutes: f64,
    pub protocol: Protocol,
}

/// A value with three figures, as set on a bench.
fn settable(value: f64) -> f64 {
    if !(value.abs() > 0.0 && value.is_finite()) {
        return value;
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    // By division where the number is large: a power of ten below one is not exact.
    if digits < 0 {
        let step = 10_f64.powi(-digits);
        (value / step).round() * step
    } else {
        let parts = 10_f64.powi(digits);
        (value * parts).round() / parts
    }
}

/// What the protocols of the menu are made of, for one muscle.
struct Bench {
    /// Two pressures, kPa.
    levels: [f64; 2],
    /// A slow speed, mm/s.
    slow: f64,
}

impl Bench {
    fn new(muscle: &Muscle<f64>, low: f64, high: f64) -> Self {
        Self {
            levels: MENU_PRESSURES.map(|part| settable((part * high + (1.0 - part) * low) * 1e-3)),
            slow: settable((free_stroke(muscle, high) * 1e3 / SLOW_STROKE).max(1e-3)),
        }
    }

    /// Loops to a part of the free stroke, at a multiple of the slow speed.
    fn loops(&self, part: f64, times: f64, count: u32) -> Step {
        let to = Place { free: Some(part), ..Place::default() };
        Step::Cycles { to, speed_mm_s: settable(times * self.slow), count }
    }

    /// A way to a part of the free stroke.
    fn go(&self, part: f64, times: f64) -> Step {
        let to = Place { free: Some(part), ..Place::default() };
        Step::Move { to, speed_mm_s: settable(times * self.slow) }
    }

    /// The same steps at both pressures, with tares before and after.
    fn each(&self, name: &str, inner: impl Fn(f64) -> Vec<Step>) -> Protocol {
        let tare =
            |name: &str| [Step::File { name: name.into() }, Step::Tare { seconds: MENU_TARE }, Step::EndFile];
        let mut step = tare("tare_before").to_vec();
        for p in self.levels {
            step.push(Step::Pressure {
                to_kpa: p,
                rate_kpa_s: Some(MENU_PRESSURE_RATE),
                settle_s: MENU_SETTLE,
            });
            step.push(Step::File { name: format!("{name}_{p:.0}kPa") });
            step.extend(inner(p));
            step.push(Step::EndFile);
        }
        step.extend(tare("tare_after"));
        Protocol { name: name.to_owned(), sample_hz: MENU_SAMPLES, step }
    }

    fn speeds(&self) -> Protocol {
        self.each("speeds", |_| {
            MENU_SPEEDS.map(|(times, count)| self.loops(MENU_PART, times, count)).to_vec()
        })
    }

    fn dwells(&self) -> Protocol {
        self.each("dwells", |_| {
            let mut steps = vec![self.loops(MENU_PART, MENU_DWELL_SPEED, 1)];
            for seconds in MENU_DWELLS {
                for turn in MENU_DWELL_TURNS {
                    let go = |part: f64| self.go(part, MENU_DWELL_SPEED);
                    steps.extend([go(MENU_DWELL_AT), Step::Hold { seconds }, go(turn)]);
                }
            }
            steps
        })
    }

    fn nested(&self) -> Protocol {
        self.each("nested", |_| {
            MENU_NESTED_SPEEDS.iter().flat_map(|times| MENU_NESTED.map(|p| self.go(p, *times))).collect()
        })
    }

    fn ramps(&self) -> Protocol {
        self.each("ramps", |p| {
            let rate_kpa_s = Some(settable(p / MENU_RAMP_TIME));
            let to = |to: f64| Step::Pressure { to_kpa: settable(to), rate_kpa_s, settle_s: MENU_SETTLE };
            let ramps = || MENU_RAMPS.map(|part| to(part * p));
            let at = |x: &f64| std::iter::once(self.go(*x, MENU_RAMP_SPEED)).chain(ramps());
            MENU_RAMP_LENGTHS.iter().flat_map(at).collect()
        })
    }

    fn rest(&self) -> Protocol {
        let mut rest = self.each("rest", |_| vec![self.loops(MENU_PART, 1.0, MENU_REST_LOOPS)]);
        let again = rest.step.clone();
        rest.step.push(Step::Rest { seconds: MENU_REST });
        rest.step.extend(again.into_iter().map(|s| match s {
            Step::File { name } => Step::File { name: format!("{name}_again") },
            other => other,
        }));
        rest
    }
}

/// Recordings that separate effects, cheapest first, for a muscle and its pressures (Pa).
pub(super) fn menu(muscle: &Muscle<f64>, low: f64, high: f64) -> Vec<Item> {
    let bench = Bench::new(muscle, low, high);
    vec![
        Item { motion: Motion::Speeds, minutes: MENU_MINUTES[0], protocol: bench.speeds() },
        Item { motion: Motion::Dwells, minutes: MENU_MINUTES[1], protocol: bench.dwells() },
        Item { motion: Motion::NestedLoops, minutes: MENU_MINUTES[2], protocol: bench.nested() },
        Item { motion: Motion::PressureRamps, minutes: MENU_MINUTES[3], protocol: bench.ramps() },
        Item { motion: Motion::Rest, minutes: MENU_MINUTES[4], protocol: bench.rest() },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol_simulation::{parse, play};
    use model_core::table;

    #[test]
    fn protocols_survive_their_own_text() {
        let muscle = Muscle::<f64>::build(&table::example()).expect("the example table");
        for item in menu(&muscle, 207e3, 552e3) {
            let text = item.protocol.to_toml().expect("writable");
            assert_eq!(parse(&text).expect("readable"), item.protocol);
            let longest = text.split([' ', '\n']).filter(|w| w.parse::<f64>().is_ok()).map(str::len).max();
            assert!(longest.is_some_and(|l| l <= 7), "{text}");
            assert!(play(&item.protocol, &muscle).expect("playable").samples() > 100);
        }
    }
}
