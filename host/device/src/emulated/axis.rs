//! An axis that moves the muscle's free end to a target position at a set speed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Where the axis is and goes.
#[derive(Debug, Clone, Copy, Default)]
struct AxisState {
    now_m: f64,
    to_m: f64,
    speed_m_per_s: f64,
    pressure_pa: f64,
    time_s: f64,
}

/// The command of the axis; clones command the same one.
///
/// ```
/// let axis = pam_device::emulated::Axis::default();
/// axis.go(1e-3, 2e-3);
/// assert!((axis.advance(0.25) - 0.5e-3).abs() < 1e-12);
/// assert_eq!(axis.advance(10.0), 1e-3);
/// ```
#[derive(Debug, Clone, Default)]
pub struct Axis {
    state: Arc<Mutex<AxisState>>,
    waits: Arc<AtomicBool>,
}

impl Axis {
    /// Moves to a stroke, m, at a speed, m/s, from now on. A number that is none changes nothing.
    pub fn go(&self, to_m: f64, speed_m_per_s: f64) {
        if to_m.is_finite() && speed_m_per_s > 0.0 {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            (state.to_m, state.speed_m_per_s) = (to_m, speed_m_per_s);
        }
    }

    /// Stops where it is.
    pub fn stop(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.to_m = state.now_m;
    }

    /// Where it is, m.
    #[must_use]
    pub fn now(&self) -> f64 {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).now_m
    }

    /// True pressure of the muscle, Pa, and the time of the bench, s, for who watches from outside.
    #[must_use]
    pub fn seen(&self) -> (f64, f64) {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        (state.pressure_pa, state.time_s)
    }

    /// Notes the true pressure of the muscle.
    pub(super) fn notes(&self, pressure_pa: f64) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).pressure_pa = pressure_pa;
    }

    /// Where it is after another `dt` seconds, m.
    pub fn advance(&self, dt: f64) -> f64 {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.time_s += dt;
        let way = state.speed_m_per_s * dt;
        state.now_m += (state.to_m - state.now_m).clamp(-way, way);
        state.now_m
    }

    /// Pauses the bench, or lets it continue: an emulated muscle need not change while a program computes.
    pub fn wait(&self, waits: bool) {
        self.waits.store(waits, Ordering::Relaxed);
    }

    /// Returns when the bench may continue.
    pub(super) fn until_due(&self) {
        while self.waits.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}
