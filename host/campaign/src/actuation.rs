//! What carries out a profile: a controller over its link, or the virtual bench.

use pam_data::error::Result;
use pam_fit::checks;

use crate::step_profile::StepProfile;

/// One reading, SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// Clock of the campaign, s.
    pub time: f64,
    /// Measured pressure, Pa.
    pub pressure: f64,
    /// Commanded pressure, Pa.
    pub command: f64,
    /// Measured stroke, m.
    pub stroke: f64,
    /// Measured force, N.
    pub force: f64,
    /// Whether it belongs to the recording.
    pub recorded: bool,
}

/// How a profile ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// It is complete.
    Whole,
    /// The reader of the readings ended it.
    Ended,
}

/// Performs the setpoint profiles of steps. In all cases, errors included, the muscle is vented when [`Actuation::perform`] returns.
pub trait Actuation {
    /// The clock of the campaign, s.
    fn clock(&self) -> f64;

    /// Sets the clock: a resumed campaign continues later than it stopped.
    fn set_clock(&mut self, seconds: f64);

    /// Carries out a profile; `each` is handed every reading and says whether to go on.
    ///
    /// # Errors
    /// What the device or its link fails with, and what `each` fails with.
    fn perform(
        &mut self,
        profile: &StepProfile,
        each: &mut dyn FnMut(&Reading) -> Result<bool>,
    ) -> Result<Ending>;

    /// Carries out a check of the bench and gives its table as CSV; `None` where it cannot be made.
    ///
    /// # Errors
    /// As [`Actuation::perform`].
    fn check(&mut self, check: checks::Kind, force: f64, pressure: f64) -> Result<Option<String>>;

    /// Whether the clock can pause while the program computes. A real muscle waits vented.
    fn compute(&mut self, _computing: bool) {}
}
