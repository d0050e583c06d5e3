//! What a host asks a controller to do.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::Mode;
use crate::fields::{choices, fields};

/// Points of a reference table in one piece.
pub const REFERENCE_PIECE: usize = 32;

/// Starts a mode; from `Armed`, or from `Running` to change over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Start {
    /// What to control.
    pub mode: Mode,
    /// The session that owns the mode from now on.
    pub session: Session,
}

fields!(Start { mode, session });

/// The session of one program, from when it opens the link until it ends: a number that the program draws at random. The session that
/// armed the device or started its mode owns it: only its orders are carried out, and only its keep-alive requests count for the watch
/// of host silence. Each session may vent and read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Session {
    /// The number.
    pub id: u32,
}

fields!(Session { id });

/// What is demanded, in the terms of a mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum SetPoint {
    /// Pressure, Pa.
    Pressure(f32),
    /// Force, N.
    Force(f32),
    /// Stroke, m.
    Stroke(f32),
    /// A joint.
    Pair {
        /// Angle, rad.
        angle_rad: f32,
        /// Stiffness, N·m/rad.
        stiffness_nm_per_rad: f32,
    },
}

impl Default for SetPoint {
    /// No pressure.
    fn default() -> Self {
        Self::Pressure(0.0)
    }
}

choices!(SetPoint {
    0 Pressure { 0: pascals },
    1 Force { 0: newtons },
    2 Stroke { 0: metres },
    3 Pair { angle_rad: angle, stiffness_nm_per_rad: stiffness },
});

/// A setpoint with the session that sends it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct SetPointOrder {
    /// What is demanded.
    pub set_point: SetPoint,
    /// The session that owns the mode.
    pub session: Session,
}

fields!(SetPointOrder { set_point, session });

/// A reference with the session that sends it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct ReferenceOrder {
    /// What is generated.
    pub reference: Reference,
    /// The session that owns the mode.
    pub session: Session,
}

fields!(ReferenceOrder { reference, session });

/// A wave that the device makes itself, in the unit of the mode's first value (Pa, N, m, rad); it begins immediately and
/// holds its last value at its end. A pair's stiffness is the last setpoint's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub enum Reference {
    /// None: setpoints of the host.
    #[default]
    SetPoint,
    /// `mean + amplitude · sin(2π f t)`, without end.
    Sine {
        /// Value that the sine swings about, in the unit of the mode.
        mean: f32,
        /// Largest distance from the mean, in the unit of the mode.
        amplitude: f32,
        /// Frequency, Hz.
        frequency_hz: f32,
    },
    /// Rise, hold, fall, rest, again and again.
    Trapezoid {
        /// Lower value.
        low: f32,
        /// Upper value.
        high: f32,
        /// Time of each ramp, s.
        ramp_s: f32,
        /// Time at each value, s.
        hold_s: f32,
    },
    /// A sine whose frequency goes from one value to another in proportion to time.
    Chirp {
        /// Value that the sine swings about, in the unit of the mode.
        mean: f32,
        /// Largest distance from the mean, in the unit of the mode.
        amplitude: f32,
        /// First frequency, Hz.
        from_hz: f32,
        /// Last frequency, Hz.
        to_hz: f32,
        /// Duration, s.
        duration_s: f32,
    },
    /// The points sent by `reference_points`, joined by straight lines.
    Table {
        /// Time between points, s.
        step_s: f32,
        /// Whether to begin again at the end.
        repeat: bool,
    },
}

choices!(Reference {
    0 SetPoint {},
    1 Sine { mean: mean, amplitude: amplitude, frequency_hz: frequency },
    2 Trapezoid { low: low, high: high, ramp_s: ramp, hold_s: hold },
    3 Chirp { mean: mean, amplitude: amplitude, from_hz: from, to_hz: to, duration_s: duration },
    4 Table { step_s: step, repeat: repeat },
});

/// Points of the reference table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct ReferencePoints {
    /// Place of the first; 0 begins a new table.
    pub offset: u16,
    /// The points, in the unit of the mode.
    pub points: Vec<f32, REFERENCE_PIECE>,
    /// The session that sends them; that of the owner, where the device has one.
    pub session: Session,
}

fields!(ReferencePoints { offset, points, session });
