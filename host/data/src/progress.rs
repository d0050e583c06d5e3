//! Progress of long computations. Libraries report it; the caller decides whether and where to show it.

use std::fmt::Debug;
use std::ops::Deref;
use std::sync::Arc;

/// Receives progress reports. Steps may be counted from several threads. Every method does nothing by default.
///
/// ```
/// use pam_data::progress::Progress;
/// use std::sync::atomic::{AtomicU64, Ordering};
///
/// #[derive(Debug, Default)]
/// struct Counter(AtomicU64);
/// impl Progress for Counter {
///     fn add(&self, steps: u64) {
///         self.0.fetch_add(steps, Ordering::Relaxed);
///     }
/// }
/// let counter = Counter::default();
/// (0..200).for_each(|_| counter.step());
/// assert_eq!(counter.0.into_inner(), 200);
/// ```
pub trait Progress: Debug + Send + Sync {
    /// Sets the number of steps of the whole; may be called again when more is known. 0 means unknown.
    fn total(&self, _steps: u64) {}

    /// Begins another stage of `steps` steps: count and remaining time start again. For work whose later stages depend on what
    /// the earlier ones find.
    fn stage(&self, _name: &str, _steps: u64) {}

    /// Counts `steps` more steps as done.
    fn add(&self, _steps: u64) {}

    /// Sets the number of steps done so far.
    fn set(&self, _done: u64) {}

    /// Counts one step as done.
    fn step(&self) {
        self.add(1);
    }
}

/// Ignores all reports.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {}

/// A progress receiver that is shared by value; ignores reports by default.
#[derive(Debug, Clone)]
pub struct SharedProgress(Arc<dyn Progress>);

impl SharedProgress {
    /// Shares a receiver.
    #[must_use]
    pub fn new(progress: Arc<dyn Progress>) -> Self {
        Self(progress)
    }
}

impl Default for SharedProgress {
    fn default() -> Self {
        Self(Arc::new(Silent))
    }
}

impl Deref for SharedProgress {
    type Target = dyn Progress;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}
