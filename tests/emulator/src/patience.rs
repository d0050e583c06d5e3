//! Waiting for what must happen on any machine, however slow it is.

use std::time::{Duration, Instant};

/// Waits until a condition holds.
///
/// # Panics
/// When it does not within the patience.
pub fn until(patience: Duration, what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + patience;
    while !holds() {
        assert!(Instant::now() < deadline, "{what}: it does not happen");
        std::thread::sleep(Duration::from_millis(10));
    }
}
