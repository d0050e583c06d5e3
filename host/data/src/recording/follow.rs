//! The motion that effects look at, row by row, followed through the recordings of a campaign.

use model_core::motion::Motion;

use super::motion::{self, Rates};
use super::{Campaign, Recording};

/// An unknown pause between recordings counts as this long, s.
const UNKNOWN_PAUSE: f64 = 60.0;

/// Follows the motion through a campaign's recordings, one after another.
#[derive(Debug, Clone, Default)]
pub struct Follower {
    clock: f64,
    reversals: usize,
    started: bool,
}

impl Follower {
    /// Before the first recording of a campaign.
    #[must_use]
    pub fn of(campaign: &Campaign) -> Self {
        Self { clock: campaign.beginning(), ..Self::default() }
    }

    /// The motion in every row of the next recording. `pause` is the time since the recording before, where it is known.
    pub fn follow(
        &mut self,
        recording: &Recording,
        motion: &motion::Motion,
        pause: Option<f64>,
    ) -> Vec<Motion<f64>> {
        let columns = motion.columns(recording);
        let rates = Rates::of(recording, motion);
        let stood = pause.unwrap_or(UNKNOWN_PAUSE).max(0.0);
        let pause = if self.started { stood } else { 0.0 };
        self.started = true;
        self.clock += pause;
        let start = recording.time.first().copied().unwrap_or(0.0);
        let mut reversal = motion.reversals.iter().map(|t| t.index).peekable();
        let mut reversals = self.reversals;
        let mut resting = vec![0.0; recording.len()];
        for hold in &motion.holds {
            if let Some(part) = resting.get_mut(hold.start..=hold.end) {
                part.fill(1.0);
            }
        }
        // Between two recordings the muscle rests, so its first motion follows a rest.
        if let Some(first) = resting.first_mut() {
            *first = 1.0;
        }
        let first_motion = first_motion(motion);
        let out = (0..recording.len())
            .map(|i| {
                while reversal.next_if(|t| *t <= i).is_some() {
                    reversals += 1;
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
                    hold_time: columns.hold_time[i] + if i < first_motion { stood } else { 0.0 },
                    cycles: reversals as f64 * 0.5,
                    temperature: recording.temperature.as_ref().map_or(0.0, |t| t[i]),
                }
            })
            .collect();
        self.reversals = reversals + 1;
        self.clock += recording.duration();
        out
    }
}

/// Where the first motion of a recording ends: at its first reversal or rest.
fn first_motion(motion: &motion::Motion) -> usize {
    let n = motion.direction.len();
    let begun = motion.direction.iter().position(|d| *d != 0).unwrap_or(n);
    let reversed = (begun..n).find(|i| motion.direction[*i] != motion.direction[begun]).unwrap_or(n);
    let rested = motion.holds.iter().map(|h| h.start).find(|s| *s > begun).unwrap_or(n);
    reversed.min(rested)
}
