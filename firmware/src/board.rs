//! What a board must give: readings, a regulator, a place to keep things, and its identity.

use model_core::link::hello::Board;
pub use model_core::link::messages::Signals;
use model_core::link::messages::{Fault, StartedBy, State};
use model_core::link::settings::{SensorScale, Settings};

use crate::valves::Valves;

/// Readings of the sensors of one muscle, in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Gauge pressure at the muscle, Pa.
    pub pressure_pa: f32,
    /// Contraction stroke, m.
    pub stroke_m: f32,
    /// Load cell, N.
    pub force_n: f32,
}

/// The signals of a simulated bench are its readings.
impl From<Readings> for Signals {
    fn from(now: Readings) -> Self {
        Self { pressure: now.pressure_pa, stroke: now.stroke_m, force: now.force_n, second_pressure: None }
    }
}

/// What one regulator and its dump valve are given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Gauge pressure requested of the regulator, Pa; above zero with an open dump valve in the test of that valve only.
    pub pressure_pa: f32,
    /// Open the dump valve, regardless of the pressure.
    pub vent: bool,
}

impl Command {
    /// No pressure, and the dump valve open.
    pub const VENT: Self = Self { pressure_pa: 0.0, vent: true };
}

/// All that the control step is given each tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Signals of each muscle's sensors, `None` where none came in time.
    pub sides: [Option<Signals>; 2],
    /// Signal of the supply air's sensor, where the board has an input for it.
    pub supply_air: Option<f32>,
    /// Whether the enable input is open.
    pub enable_open: bool,
    /// Ticks that were missed since the last step.
    pub missed_ticks: u16,
    /// Whether the supply is below what the regulator needs.
    pub supply_low: bool,
    /// Time that the last step took, µs.
    pub step_us: f32,
}

/// All that the control step decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outputs {
    /// Command to each regulator.
    pub sides: [Command; 2],
    /// The same as a part of the range of each analogue output, 0 to 1.
    pub levels: [f32; 2],
    /// What the valves do that are fitted in place of a regulator.
    pub valves: [Valves; 2],
    /// State of safety, for a status light.
    pub state: State,
    /// The setpoint, for a plant that logs it.
    pub setpoint: f32,
}

impl Outputs {
    /// Every muscle vented: what a board does before the first step.
    pub const VENT: Self = Self {
        sides: [Command::VENT; 2],
        levels: [0.0; 2],
        valves: [Valves::Absent; 2],
        state: State::Disarmed,
        setpoint: 0.0,
    };
}

/// The sensors and regulators of a board, which also keep its time: one return is one control tick.
pub trait Plant {
    /// Gives the regulators their commands and returns the readings of the next tick.
    fn exchange(&mut self, outputs: &Outputs) -> impl core::future::Future<Output = Inputs>;
}

/// The ends of the signal that a converter can deliver: a signal there is a broken wire or a short, not a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Value of the lowest code.
    pub low: f32,
    /// Value of the highest code.
    pub high: f32,
}

impl Span {
    /// The readings that a scale makes of these signals.
    pub fn scaled(&self, scale: &SensorScale) -> Self {
        let (a, b) = (scale.reading(self.low), scale.reading(self.high));
        if scale.per_unit < 0.0 { Self { low: b, high: a } } else { Self { low: a, high: b } }
    }
}

/// What a board's converters and regulator can do, independent of the settings. A watch or a limit outside a span could never trip:
/// such settings are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// Pressure sensor's converter, volts (on a simulated bench Pa).
    pub pressure: Span,
    /// Stroke sensor's converter, volts (m).
    pub stroke: Span,
    /// Load cell's converter, volts (N).
    pub force: Span,
    /// Converter of the second pressure sensor, where the board has one.
    pub second_pressure: Option<Span>,
    /// Converter of the supply air's sensor, where the board has one.
    pub supply: Option<Span>,
    /// Whether the board has an enable input.
    pub enable_input: bool,
    /// Whether the board has outputs for a pair of on/off valves.
    pub valve_pair: bool,
    /// Whether the board has a CAN controller.
    pub can: bool,
    /// Highest command that is ever given to a regulator, Pa.
    pub command_ceiling_pa: f32,
    /// Settings of a new device.
    pub settings: Settings,
}

impl Hardware {
    /// Numbers of a simulated bench, which no converter limits: bounded by what any muscle could bear.
    pub const SIMULATED: Self = Self {
        pressure: Span { low: -1e6, high: 10e6 },
        stroke: Span { low: -2.0, high: 2.0 },
        force: Span { low: -100e3, high: 100e3 },
        second_pressure: None,
        supply: None,
        enable_input: false,
        valve_pair: false,
        can: false,
        command_ceiling_pa: 2e6,
        settings: Settings::DEFAULT,
    };
}

/// Who a board is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Which board.
    pub board: Board,
    /// Muscles that it can drive.
    pub muscles: u8,
    /// Serial number of its chip.
    pub serial: [u8; 12],
    /// Why it started.
    pub started_by: StartedBy,
    /// What the board itself found wrong while it started.
    pub fault: Option<Fault>,
}
