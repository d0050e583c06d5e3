//! What a board's timer makes of the controller's orders to a pair of on/off valves: signals at each time within a tick.

use firmware::tick::TICK_US;
use firmware::valves::Valves;
use model_core::link::settings::ValvePair as Stated;
use virtual_bench::valves::{Open, ValvePair};

/// The timer: pulses lie at the end of a period, and behind it both valves are closed.
#[derive(Clone, Copy, Debug)]
pub struct Pulses {
    order: Valves,
    since_us: u32,
}

impl Default for Pulses {
    /// As a board starts: vented.
    fn default() -> Self {
        Self { order: Valves::Vent, since_us: 0 }
    }
}

impl Pulses {
    /// The signals in a tick, by the time in it, s.
    pub fn tick(&mut self, order: Valves, dump: bool) -> impl Fn(f64) -> Open + use<> {
        if order != Valves::Continue {
            (self.order, self.since_us) = (order, 0);
        }
        let (order, since_us) = (self.order, self.since_us);
        self.since_us += TICK_US as u32;
        move |time_s| {
            let at_us = f64::from(since_us) + 1e6 * time_s;
            let within = |pulse_us: u16, length_us: u16| {
                let length_us = f64::from(length_us);
                at_us >= length_us - f64::from(pulse_us) && at_us < length_us
            };
            let (fill, vent) = match order {
                Valves::Period { fill_us, vent_us, length_us } => {
                    (within(fill_us, length_us), within(vent_us, length_us))
                }
                Valves::Vent | Valves::Absent => (false, true),
                Valves::Closed | Valves::Continue => (false, false),
            };
            Open { fill, vent, dump }
        }
    }
}

/// Valves of which the settings are not quite true: both let a tenth less through.
pub fn real_valves(stated: &Stated) -> ValvePair {
    let closes = 1e-3;
    ValvePair {
        supply: f64::from(stated.supply_pa),
        fill: 0.9 * f64::from(stated.fill_pa_per_s),
        vent: 0.9 * f64::from(stated.vent_pa_per_s),
        delays: (closes + f64::from(stated.dead_s), closes),
        ..ValvePair::default()
    }
}
