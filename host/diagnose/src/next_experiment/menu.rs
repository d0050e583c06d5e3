//! The menu of recordings that separate effects.

use model_core::muscle::Muscle;

use crate::criteria::planning::{MENU_PRESSURES, SLOW_STROKE};
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
            |name: &str| [Step::File { name: name.into() }, Step::Tare { seconds: 10.0 }, Step::EndFile];
        let mut step = tare("tare_before").to_vec();
        for p in self.levels {
            step.push(Step::Pressure { to_kpa: p, rate_kpa_s: Some(50.0), settle_s: 2.0 });
            step.push(Step::File { name: format!("{name}_{p:.0}kPa") });
            step.extend(inner(p));
            step.push(Step::EndFile);
        }
        step.extend(tare("tare_after"));
        Protocol { name: name.to_owned(), sample_hz: 20.0, step }
    }

    fn speeds(&self) -> Protocol {
        self.each("speeds", |_| {
            [0.3, 1.0, 4.0, 16.0].map(|v| self.loops(0.9, v, if v < 1.0 { 1 } else { 2 })).to_vec()
        })
    }

    fn dwells(&self) -> Protocol {
        self.each("dwells", |_| {
            let mut steps = vec![self.loops(0.9, 2.0, 1)];
            for seconds in [1.0, 10.0, 100.0] {
                for turn in [0.9, 0.1] {
                    steps.extend([self.go(0.5, 2.0), Step::Hold { seconds }, self.go(turn, 2.0)]);
                }
            }
            steps
        })
    }

    fn nested(&self) -> Protocol {
        let places = [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0];
        self.each("nested", |_| {
            [1.0, 8.0].iter().flat_map(|times| places.map(|p| self.go(p, *times))).collect()
        })
    }

    fn ramps(&self) -> Protocol {
        self.each("ramps", |p| {
            let rate_kpa_s = Some(settable(p / 20.0));
            let to = |to: f64| Step::Pressure { to_kpa: settable(to), rate_kpa_s, settle_s: 2.0 };
            let ramps = || [0.4 * p, p, 0.4 * p, p].map(to);
            [0.0, 0.3, 0.6].iter().flat_map(|x| std::iter::once(self.go(*x, 4.0)).chain(ramps())).collect()
        })
    }

    fn rest(&self) -> Protocol {
        let mut rest = self.each("rest", |_| vec![self.loops(0.9, 1.0, 3)]);
        let again = rest.step.clone();
        rest.step.push(Step::Rest { seconds: 1800.0 });
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
        Item { motion: Motion::Speeds, minutes: 8.0, protocol: bench.speeds() },
        Item { motion: Motion::Dwells, minutes: 10.0, protocol: bench.dwells() },
        Item { motion: Motion::NestedLoops, minutes: 6.0, protocol: bench.nested() },
        Item { motion: Motion::PressureRamps, minutes: 9.0, protocol: bench.ramps() },
        Item { motion: Motion::Rest, minutes: 38.0, protocol: bench.rest() },
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
