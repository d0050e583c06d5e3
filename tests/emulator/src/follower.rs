//! A muscle that follows its command, for tests of what happens around a controller.

use firmware::board::{Inputs, Outputs, Readings};

/// A muscle whose pressure follows its command within 30 ms, at a held length.
#[derive(Clone, Copy, Debug, Default)]
pub struct Follower {
    pressure_pa: f32,
    tick: u64,
}

impl Follower {
    /// The pressure, Pa.
    #[must_use]
    pub fn pressure_pa(&self) -> f32 {
        self.pressure_pa
    }

    /// One tick: what the sensors read after it.
    pub fn exchange(&mut self, outputs: &Outputs) -> Inputs {
        let command = outputs.sides[0];
        let target = if command.vent { 0.0 } else { command.pressure_pa };
        self.pressure_pa += (target - self.pressure_pa) / 31.0;
        self.tick += 1;
        // Live sensors never read the same twice.
        let wiggle = (self.tick % 7) as f32 - 3.0;
        let now = Readings {
            pressure_pa: self.pressure_pa + wiggle,
            stroke_m: 1e-7 * wiggle,
            force_n: 1e-3 * wiggle,
        };
        Inputs { sides: [Some(now.into()), None], ..Inputs::default() }
    }
}
