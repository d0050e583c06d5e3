//! Errors of the bench: corrections of the data that are never sent to a controller.
//!
//! A load cell's error must not be shipped as the muscle's physics. These effects obey the same contract as the muscle's in
//! [`model_core::effects`] (a force that is linear in its amplitudes, with a memory), so that the diagnosis weighs both kinds by
//! the same rule; but they are another type, which a table for a controller cannot hold. What a correction adds is the part of the
//! **reading** that is not the muscle's: subtract it from a recording's force to get the muscle's.

use serde::{Deserialize, Serialize};

mod backlash;
mod candidate;
mod cross_talk;
mod displacement_offset;
mod force_drift;
mod force_gain;
mod force_offset;
mod gauge_gain;
mod gauge_offset;
mod gravity;
mod inertia;
mod misalignment;
mod pressure_sensor_lag;
mod rig_compliance;
mod sensor_delay;

pub use candidate::{Candidate, Span, columns_of, read_when_vented};

model_core::effect_list! {
    /// A correction of the bench, by name. In files it is its place in this list: the order stays, new ones go to the end.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
    BenchName:
    /// The gauge's zero.
    GaugeOffset = gauge_offset;
    /// The gauge's scale.
    GaugeGain = gauge_gain;
    /// A late pressure sensor.
    PressureSensorLag = pressure_sensor_lag;
    /// Moving masses.
    Inertia = inertia;
    /// Weight in the load path.
    Gravity = gravity;
    /// Muscle and cell out of line.
    Misalignment = misalignment;
    /// A frame that gives.
    RigCompliance = rig_compliance;
    /// A loose joint.
    Backlash = backlash;
    /// The load cell's zero.
    ForceOffset = force_offset;
    /// A drifting zero.
    ForceDrift = force_drift;
    /// The load cell's scale.
    ForceGain = force_gain;
    /// Pressure that acts on the load cell.
    CrossTalk = cross_talk;
    /// A late force channel.
    SensorDelay = sensor_delay;
    /// The stroke's zero.
    DisplacementOffset = displacement_offset;
}
