//! Device time beside the clock on the wall.

use std::thread;
use std::time::{Duration, Instant};

use crate::tick::TICKS_PER_S;

/// Keeps device time in step with the clock on the wall.
#[derive(Debug)]
pub struct Pace {
    tick: Option<Duration>,
    next: Instant,
}

impl Pace {
    /// So many device seconds in a second; infinite: as fast as it goes.
    #[must_use]
    pub fn new(speed: f64) -> Self {
        let seconds = 1.0 / (f64::from(TICKS_PER_S) * speed);
        let tick = Duration::try_from_secs_f64(seconds).ok().filter(|tick| !tick.is_zero());
        Self { tick, next: Instant::now() }
    }

    /// Waits for the next tick. Sleeps are coarse, so ticks come in small bunches; after a pause of the whole machine
    /// time goes on from now instead of catching up.
    pub fn wait(&mut self) {
        let Some(tick) = self.tick else { return };
        self.next += tick;
        let now = Instant::now();
        if self.next > now + Duration::from_millis(1) {
            thread::sleep(self.next - now);
        } else if now > self.next + Duration::from_millis(100) {
            self.next = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_never_ahead_of_the_clock_and_a_pause_is_not_made_up_for() {
        let (mut pace, began) = (Pace::new(2.0), Instant::now());
        (0..200).for_each(|_| pace.wait());
        // Less the bunch of a millisecond.
        assert!(began.elapsed() >= Duration::from_millis(99), "{:?}", began.elapsed());
        thread::sleep(Duration::from_millis(300));
        let again = Instant::now();
        (0..300).for_each(|_| pace.wait());
        assert!(again.elapsed() >= Duration::from_millis(140), "{:?}", again.elapsed());
        let mut unbound = Pace::new(f64::INFINITY);
        (0..1_000_000).for_each(|_| unbound.wait());
    }
}
