//! Device time compared with the computer's clock.

use std::thread;
use std::time::{Duration, Instant};

use crate::tick::TICKS_PER_S;

/// Delay of a process on a busy machine that is compensated immediately.
const AT_ONCE: Duration = Duration::from_millis(100);
/// Longest delay that is compensated: after a longer pause device time continues from now.
const AT_ALL: Duration = Duration::from_secs(1);

/// Synchronises device time with the computer's clock.
#[derive(Debug)]
pub struct Pace {
    tick: Option<Duration>,
    next: Instant,
    /// Delay of device time that is compensated slowly.
    behind: Duration,
}

impl Pace {
    /// N device seconds in a second; infinite: as fast as possible.
    #[must_use]
    pub fn new(speed: f64) -> Self {
        let seconds = 1.0 / (f64::from(TICKS_PER_S) * speed);
        let tick = Duration::try_from_secs_f64(seconds).ok().filter(|tick| !tick.is_zero());
        Self { tick, next: Instant::now(), behind: Duration::ZERO }
    }

    /// Waits for the next tick. Sleeps are coarse, so ticks come in small groups. A pause of up to 100 ms is compensated immediately, one
    /// of up to a second at twice the speed: a host that was delayed as well can send before a watch counts its silence.
    pub fn wait(&mut self) {
        let pause = self.pause(Instant::now());
        if !pause.is_zero() {
            thread::sleep(pause);
        }
    }

    /// How long to sleep before the next tick.
    fn pause(&mut self, now: Instant) -> Duration {
        let Some(tick) = self.tick else { return Duration::ZERO };
        let made_up = self.behind.min(tick / 2);
        self.behind -= made_up;
        self.next += tick - made_up;
        if self.next > now + Duration::from_millis(1) {
            return self.next - now;
        }
        if now > self.next + AT_ONCE {
            let behind = self.behind + (now - self.next);
            self.behind = if behind > AT_ALL { Duration::ZERO } else { behind };
            self.next = now;
        }
        Duration::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_never_ahead_of_the_clock() {
        let (mut pace, began) = (Pace::new(2.0), Instant::now());
        (0..200).for_each(|_| pace.wait());
        // Less the bunch of a millisecond.
        assert!(began.elapsed() >= Duration::from_millis(99), "{:?}", began.elapsed());
        let mut unbound = Pace::new(f64::INFINITY);
        (0..1_000_000).for_each(|_| unbound.wait());
    }

    /// Milliseconds that n ticks take where a sleep has exactly the requested length, to within one group of ticks.
    fn milliseconds(pace: &mut Pace, now: &mut Instant, ticks: u32) -> i32 {
        let began = *now;
        (0..ticks).for_each(|_| *now += pace.pause(*now));
        (*now - began).as_secs_f64().mul_add(1e3, 0.5) as i32
    }

    #[test]
    fn a_short_pause_is_made_up_for_at_twice_the_speed_and_a_long_one_not_at_all() {
        let mut pace = Pace::new(2.0);
        let mut now = pace.next;
        let mut takes = |pause_ms: u64, ticks: u32, expected: i32, what: &str| {
            now += Duration::from_millis(pause_ms);
            let found = milliseconds(&mut pace, &mut now, ticks);
            assert!((found - expected).abs() <= 2, "{what}: {found} ms instead of {expected}");
        };
        takes(0, 1_000, 500, "no pause");
        takes(60, 1_000, 440, "a short pause, immediately");
        // 600 ticks are behind; they and the 600 of the same 300 ms come at twice the speed.
        takes(300, 1_200, 300, "a longer pause");
        takes(0, 1_000, 500, "the whole delay is compensated");
        takes(1_100, 1_000, 500, "a long pause: device time continues from now");
    }
}
