//! The frame between crosshead, muscle and load cell.

use serde::{Deserialize, Serialize};

/// What stands between the instruments and the muscle; everything off is a stiff, massless rig.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rig {
    /// Spring rate of frame and couplings, N/m; 0 for rigid. The muscle pulls its frame along and is shorter than the
    /// crosshead tells.
    pub stiffness: f64,
    /// Moving mass between muscle and cell, kg.
    pub mass: f64,
    /// Weight that hangs in the cell's reading, N.
    pub weight: f64,
    /// Force at the cell per pressure of the hose, N/Pa.
    pub hose: f64,
}

/// The rig's memory.
#[derive(Debug, Clone)]
pub struct RigState {
    with: Rig,
    pull: f64,
    last: Option<(f64, f64)>,
}

impl RigState {
    /// Unloaded.
    pub fn new(with: Rig) -> Self {
        Self { with, pull: 0.0, last: None }
    }

    /// Stroke of the muscle (m) when the crosshead stands at `crosshead` (m) under the force of the last step (N).
    pub fn stroke(&mut self, crosshead: f64, force: f64, _dt: f64) -> f64 {
        if self.with.stiffness <= 0.0 {
            return crosshead;
        }
        // Half of each change is taken per step: the muscle's own stiffness must not make the two chase each other.
        self.pull += 0.5 * (force - self.pull);
        crosshead + self.pull / self.with.stiffness
    }

    /// Force at the cell, N.
    pub fn at_cell(&mut self, force: f64, pressure: f64, stroke: f64, dt: f64) -> f64 {
        let (x, v) = self.last.unwrap_or((stroke, 0.0));
        let speed = if dt > 0.0 { (stroke - x) / dt } else { 0.0 };
        let acceleration = if dt > 0.0 { (speed - v) / dt } else { 0.0 };
        self.last = Some((stroke, speed));
        force - self.with.mass * acceleration + self.with.weight + self.with.hose * pressure
    }
}
