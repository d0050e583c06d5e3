//! Which way friction points in every row of a campaign, and the motion that effects look at.

use model_core::motion::Motion;

use crate::recording::segment::{self, Rates};
use crate::recording::{Campaign, Recording};

/// A pause that nobody recorded counts as this long, s: the same as where effects are identified.
pub const UNKNOWN_PAUSE: f64 = 60.0;

/// +1 shortening or filling, −1 lengthening or emptying, 0 unknown; per recording, per row.
#[must_use]
pub fn directions(campaign: &Campaign) -> Vec<Vec<i8>> {
    segment::Motion::of_campaign(campaign).into_iter().map(|m| m.direction).collect()
}

/// Follows the motion through a campaign's recordings, one after another.
#[derive(Debug, Clone, Default)]
pub struct Follower {
    clock: f64,
    turns: usize,
    started: bool,
}

impl Follower {
    /// The motion in every row of the next recording. `pause` is the time since the recording before, where it is known.
    pub fn follow(
        &mut self,
        recording: &Recording,
        motion: &segment::Motion,
        pause: Option<f64>,
    ) -> Vec<Motion<f64>> {
        let columns = motion.columns(recording);
        let rates = Rates::of(recording, motion);
        let pause = if self.started { pause.unwrap_or(UNKNOWN_PAUSE).max(0.0) } else { 0.0 };
        self.started = true;
        self.clock += pause;
        let start = recording.time.first().copied().unwrap_or(0.0);
        let mut turn = motion.turns.iter().map(|t| t.index).peekable();
        let mut turns = self.turns;
        let mut resting = vec![0.0; recording.len()];
        for hold in &motion.holds {
            if let Some(part) = resting.get_mut(hold.start..=hold.end) {
                part.fill(1.0);
            }
        }
        let out = (0..recording.len())
            .map(|i| {
                while turn.next_if(|t| *t <= i).is_some() {
                    turns += 1;
                }
                Motion {
                    dt: if i == 0 { pause } else { recording.time[i] - recording.time[i - 1] },
                    time: self.clock + recording.time[i] - start,
                    stroke: recording.stroke[i],
                    speed: rates.speed[i],
                    acceleration: rates.acceleration[i],
                    pressure_rate: rates.pressure_rate[i],
                    direction: f64::from(motion.direction[i]),
                    travel: columns.travel[i],
                    since_reversal: columns.since_reversal[i],
                    resting: resting[i],
                    hold_time: columns.hold_time[i],
                    cycles: turns as f64 * 0.5,
                    temperature: recording.temperature.as_ref().map_or(0.0, |t| t[i]),
                }
            })
            .collect();
        self.turns = turns + 1;
        self.clock += recording.duration();
        out
    }
}
