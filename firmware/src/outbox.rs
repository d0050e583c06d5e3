//! What the device says without a request, as it waits for the link.

use model_core::fields::{Fields, Walk};
use model_core::link::endpoints::{EVENT, TELEMETRY};
use model_core::link::frame::{self, Header, Kind, MAX_TOPIC};
use model_core::link::messages::{Event, Mode, SideSample, State};

use crate::pair;
use crate::tick::TICK_US;

/// Muscles of a sample: a board that cannot move a joint keeps no place for a second one in all that wait.
pub(crate) const SIDES: usize = if pair::SUPPORTED { 2 } else { 1 };

/// One tick. On the wire it is a [`Telemetry`](model_core::link::messages::Telemetry); here it is as small as it can be, since many
/// wait immediately.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Number of the sample: a gap is a loss on the way.
    pub number: u16,
    /// Number of the tick.
    pub tick: u64,
    /// State of safety.
    pub state: State,
    /// What the controller controls.
    pub mode: Mode,
    /// The setpoint, in the unit of the mode.
    pub setpoint: f32,
    /// A pair's second value.
    pub setpoint_second: f32,
    /// How many muscles are in use.
    pub(crate) used: u8,
    /// All that the image can drive.
    pub(crate) all: [SideSample; SIDES],
}

impl Sample {
    /// The muscles in use.
    pub fn sides(&self) -> &[SideSample] {
        self.all.get(..usize::from(self.used)).unwrap_or(&self.all)
    }

    /// Device time of the tick, µs.
    pub fn time_us(&self) -> u64 {
        self.tick * TICK_US
    }
}

/// Only ever written.
impl Fields for Sample {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        self.time_us().walk(walk);
        self.tick.walk(walk);
        self.state.walk(walk);
        self.mode.walk(walk);
        self.setpoint.walk(walk);
        self.setpoint_second.walk(walk);
        // A list is its length and its elements.
        u32::from(self.used).walk(walk);
        for side in self.all.iter_mut().take(usize::from(self.used)) {
            side.walk(walk);
        }
    }
}

/// What the device says without a request.
#[derive(Clone, Debug)]
pub(crate) enum Outgoing {
    Sample(Sample),
    Event(Event),
    #[cfg(feature = "log")]
    Log(crate::log::Frame),
}

impl Outgoing {
    /// Writes its frame; gives the length.
    pub(crate) fn encode(&mut self, out: &mut [u8; MAX_TOPIC]) -> usize {
        let header = |id, sequence| Header { kind: Kind::Topic, id, sequence };
        let written = match self {
            Self::Sample(sample) => frame::encode_fields(header(TELEMETRY, sample.number), sample, out),
            Self::Event(event) => frame::encode_fields(header(EVENT, 0), event, out),
            #[cfg(feature = "log")]
            Self::Log(line) => frame::encode_bytes(header(model_core::link::endpoints::LOG, 0), line, out),
        };
        // The largest of both fits, which `model_core::link::endpoints` tests.
        written.unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::messages::Telemetry;

    #[test]
    fn a_sample_is_a_telemetry_message_on_the_wire() {
        let side =
            |n: f32| SideSample { pressure_pa: n, stroke_m: 2.0 * n, force_n: -n, ..SideSample::default() };
        for count in 0..=2 {
            let sample = Sample {
                number: 7,
                tick: 1 << 40,
                state: State::Running,
                mode: Mode::Pair,
                setpoint: 0.5,
                setpoint_second: 150.0,
                used: count,
                all: [side(1.0), side(2.0)],
            };
            let message = Telemetry {
                time_us: 1000 << 40,
                tick: 1 << 40,
                state: State::Running,
                mode: Mode::Pair,
                setpoint: 0.5,
                setpoint_second: 150.0,
                sides: sample.sides().iter().copied().collect(),
            };
            assert_eq!(message.sides.len(), usize::from(count));
            let (mut here, mut there) = ([0; MAX_TOPIC], [0; MAX_TOPIC]);
            let header = Header { kind: Kind::Topic, id: TELEMETRY, sequence: 7 };
            let length = frame::encode(header, &message, &mut there).expect("it fits");
            assert_eq!(Outgoing::Sample(sample).encode(&mut here), length);
            assert_eq!(here[..length], there[..length]);
        }
    }

    #[test]
    fn queued_messages_are_small() {
        assert!(size_of::<Outgoing>() <= 80, "{}", size_of::<Outgoing>());
    }
}
