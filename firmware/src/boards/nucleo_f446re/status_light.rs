//! The status light: what the board does, seen from across the laboratory.
//!
//! | state | light |
//! | --- | --- |
//! | disarmed | a short flash every two seconds |
//! | armed | half a second on, half a second off |
//! | running | on |
//! | fault | ten flashes a second |

use model_core::link::messages::State;

/// Ticks of the longest pattern.
const ROUND: u16 = 2_000;

/// Where the pattern is.
#[derive(Default)]
pub struct StatusLight {
    tick: u16,
}

impl StatusLight {
    /// Whether the light is on in this tick.
    pub fn tick(&mut self, state: State) -> bool {
        self.tick = if self.tick + 1 < ROUND { self.tick + 1 } else { 0 };
        match state {
            State::Disarmed => self.tick < 50,
            State::Armed => self.tick % 1_000 < 500,
            State::Running => true,
            State::Fault => self.tick % 100 < 50,
        }
    }
}
