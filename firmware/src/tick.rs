//! The clock of the control loop.

/// Control ticks in a second.
pub const TICKS_PER_S: u32 = 1000;
/// Length of a tick, s.
pub const TICK_S: f32 = 1.0e-3;
/// Length of a tick, µs.
pub const TICK_US: u64 = 1000;
