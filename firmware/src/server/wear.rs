//! How often flash may be written for what no one asked to be kept.
//!
//! A muscle's remembered history moves a little with every run. A page of the emulated board takes some fifty records of it
//! before it is erased, one of the Nucleo over a thousand, and a page stands 10,000 erasures at least: written at most once in
//! [`REFILL_TICKS`] on the long run, the memory outlasts years of operation on either. Within that, a few writes in a row are
//! free, so that what was learnt by the runs before a power cut is there after it.

use model_core::effects::Memory;

/// Writes that may follow each other immediately.
const BURST: u8 = 16;
/// Ticks after which one more is allowed: a minute.
const REFILL_TICKS: u32 = 60_000;
/// Relative change of a memory that is worth a write.
const WORTH: f32 = 1.0e-3;

/// An allowance of writes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wear {
    left: u8,
    refilled: u64,
}

impl Default for Wear {
    fn default() -> Self {
        Self { left: BURST, refilled: 0 }
    }
}

impl Wear {
    /// Whether one write is allowed at a tick; it is then counted.
    pub(super) fn allows(&mut self, tick: u64) -> bool {
        // Ticks restart with a controller that was restarted.
        let ticks = tick.saturating_sub(self.refilled).min(u64::from(u32::MAX)) as u32;
        let passed = ticks / REFILL_TICKS;
        if passed > 0 || tick < self.refilled {
            self.left = self.left.saturating_add(passed.min(u32::from(BURST)) as u8).min(BURST);
            self.refilled = tick;
        }
        let allowed = self.left > 0;
        self.left = self.left.saturating_sub(1);
        allowed
    }
}

/// Whether a memory has moved enough to be written again.
pub(super) fn has_moved(kept: &Memory<f32>, now: &Memory<f32>) -> bool {
    kept.iter().zip(now).any(|(kept, now)| !((now - kept).abs() <= WORTH * kept.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_free_and_then_one_a_minute() {
        let mut wear = Wear::default();
        let mut written = (0..1000).filter(|tick| wear.allows(*tick)).count();
        assert_eq!(written, usize::from(BURST));
        written += (1..=10).filter(|minute| wear.allows(minute * u64::from(REFILL_TICKS) + 5)).count();
        assert_eq!(written, usize::from(BURST) + 10);
        // An hour of starting and stopping ten times a second.
        let mut wear = Wear::default();
        let hour = (0..36_000_u64).filter(|n| wear.allows(n * 100)).count();
        assert!((60..=80).contains(&hour), "{hour}");
    }

    #[test]
    fn ticks_that_restart_do_not_remove_the_allowance() {
        let minutes = |count: u64| count * u64::from(REFILL_TICKS);
        let mut wear = Wear::default();
        let used = minutes(1_000);
        assert_eq!((used..used + 100).filter(|tick| wear.allows(*tick)).count(), usize::from(BURST));
        // The controller is restarted: a restart gives nothing, and a minute after it one write.
        let found = [5, minutes(1) + 4, minutes(1) + 5, minutes(1) + 6].map(|tick| wear.allows(tick));
        assert_eq!(found, [false, false, true, false]);
    }

    #[test]
    fn only_what_moved_is_written() {
        let memory = |value: f32| {
            let mut one = Memory::default();
            one[0] = value;
            one
        };
        assert!(!has_moved(&memory(1.0), &memory(1.0005)));
        assert!(has_moved(&memory(1.0), &memory(1.01)));
        assert!(has_moved(&memory(0.0), &memory(1e-9)), "the first stroke of a new muscle");
        assert!(!has_moved(&memory(0.0), &memory(0.0)));
    }
}
