//! How long a program waits for a controller.

use std::time::Duration;

/// How long to wait for answers.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// Time for one answer.
    pub answer: Duration,
    /// Time for an answer that waits for flash memory to be erased.
    pub slow_answer: Duration,
    /// Attempts of a request that may be repeated, on a silent line.
    pub tries: u32,
    /// The same on a noisy line: frames arrive and fail their check.
    pub noisy_tries: u32,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            answer: Duration::from_millis(600),
            slow_answer: Duration::from_secs(6),
            tries: 3,
            noisy_tries: 60,
        }
    }
}
