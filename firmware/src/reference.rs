//! Wave-forms that the device makes itself.
//!
//! Phase is an integer that wraps with the wave (2³² steps a turn), so that a wave neither drifts nor loses resolution
//! however long it runs; frequency resolves to 1 kHz / 2³² ≈ 0.23 µHz. The sine is micromath's, whose error is measured by
//! the test below: at most 0.11 % of the amplitude.

use heapless::Vec;
use micromath::F32Ext;
use model_core::link::messages::{Field, REFERENCE_PIECE, Reference, ReferencePoints, Refusal};

use crate::compact_float::CompactFloat;
use crate::placement::{Placed, placed};
use crate::tick::{TICK_S, TICKS_PER_S};

/// Points that a reference table holds, three bytes each ([`CompactFloat`]).
pub const CAPACITY: usize = 256;

/// Ticks that a wave can be evaluated ahead of its time.
const AHEAD: usize = 16;

const TURN: f32 = 4_294_967_296.0;

/// A generator at work.
#[derive(Debug)]
pub struct Generator {
    reference: Reference,
    /// Ticks since it began.
    ticks: u32,
    phase: u32,
    /// Phase steps of a tick of a sine.
    sine_steps: u32,
    points: Placed<Vec<CompactFloat, CAPACITY>>,
    last: f32,
    /// The last values made, at their number; how many were made, and how many of these have had their time.
    lookahead: [f32; AHEAD],
    made: u32,
    given: u32,
}

impl Default for Generator {
    fn default() -> Self {
        Self {
            reference: Reference::SetPoint,
            ticks: 0,
            phase: 0,
            sine_steps: 0,
            points: placed!(Vec<CompactFloat, CAPACITY>, Vec::new()),
            last: 0.0,
            lookahead: [0.0; AHEAD],
            made: 0,
            given: 0,
        }
    }
}

/// Phase steps of one tick at a frequency.
fn steps(frequency_hz: f32) -> u32 {
    // Up to 500 Hz this fits; the cast saturates beyond.
    (frequency_hz / TICKS_PER_S as f32 * TURN) as u32
}

/// `sin(2π · phase / 2³²)`.
fn sine(phase: u32) -> f32 {
    // Between −π and π, where the approximation is meant to be used.
    let angle = phase as i32 as f32 * (core::f32::consts::TAU / TURN);
    F32Ext::sin(angle)
}

impl Generator {
    /// What is generated.
    pub fn reference(&self) -> Reference {
        self.reference
    }

    /// Whether setpoints come from the host.
    pub fn is_set_point(&self) -> bool {
        matches!(self.reference, Reference::SetPoint)
    }

    /// Begins a wave.
    ///
    /// # Errors
    /// [`Refusal::Value`] for a parameter that is not finite, a negative time, a frequency that is not between 0 and
    /// 100 Hz, or a table without points.
    pub fn begin(&mut self, reference: Reference) -> Result<(), Refusal> {
        let within = |value: f32, low: f32, high: f32| value >= low && value <= high;
        let finite = |value: f32| value.is_finite();
        let frequency = |hz: f32| within(hz, 0.0, 100.0);
        let good = match reference {
            Reference::SetPoint => true,
            Reference::Sine { mean, amplitude, frequency_hz } => {
                finite(mean) && finite(amplitude) && frequency(frequency_hz)
            }
            Reference::Trapezoid { low, high, ramp_s, hold_s } => {
                finite(low)
                    && finite(high)
                    && within(ramp_s, 0.0, 3600.0)
                    && within(hold_s, 0.0, 3600.0)
                    && ramp_s + hold_s >= TICK_S
            }
            Reference::Chirp { mean, amplitude, from_hz, to_hz, duration_s } => {
                finite(mean)
                    && finite(amplitude)
                    && frequency(from_hz)
                    && frequency(to_hz)
                    && within(duration_s, TICK_S, 36_000.0)
            }
            Reference::Table { step_s, .. } => within(step_s, TICK_S, 3600.0) && !self.points.is_empty(),
        };
        if !good {
            return Err(Refusal::Value(Field::Reference));
        }
        self.reference = reference;
        self.sine_steps = match reference {
            Reference::Sine { frequency_hz, .. } => steps(frequency_hz),
            _ => 0,
        };
        self.given = self.made;
        self.ticks = 0;
        self.phase = 0;
        Ok(())
    }

    /// The least and the greatest value of a wave.
    pub fn range(&self, reference: Reference) -> (f32, f32) {
        match reference {
            Reference::SetPoint => (self.last, self.last),
            Reference::Sine { mean, amplitude, .. } | Reference::Chirp { mean, amplitude, .. } => {
                (mean - amplitude.abs(), mean + amplitude.abs())
            }
            Reference::Trapezoid { low, high, .. } => (low.min(high), low.max(high)),
            Reference::Table { .. } => {
                let points = || self.points.iter().map(|point| point.value());
                let least = points().fold(f32::MAX, f32::min);
                (least, points().fold(least, f32::max))
            }
        }
    }

    /// Takes points for the table; `offset` 0 begins a new one. Returns how many there are.
    ///
    /// # Errors
    /// [`Refusal::Range`] when the piece does not follow what is there or does not fit; [`Refusal::Value`] for a point
    /// that is not finite. While the table is in use it is not touched.
    pub fn take_points(&mut self, piece: &ReferencePoints) -> Result<u16, Refusal> {
        const { assert!(REFERENCE_PIECE <= CAPACITY) };
        if matches!(self.reference, Reference::Table { .. })
            || piece.points.iter().any(|point| !point.is_finite())
        {
            return Err(Refusal::Value(Field::Reference));
        }
        if self.ends_with(piece) {
            return Ok(self.points.len() as u16);
        }
        if piece.offset == 0 {
            self.points.clear();
        }
        if usize::from(piece.offset) != self.points.len() {
            return Err(Refusal::Range);
        }
        for point in &piece.points {
            self.points.push(CompactFloat::of(*point)).map_err(|_| Refusal::Range)?;
        }
        Ok(self.points.len() as u16)
    }

    /// Whether a piece is the last one once more: its answer was lost, and the host repeats it.
    fn ends_with(&self, piece: &ReferencePoints) -> bool {
        let there = self.points.get(usize::from(piece.offset)..).unwrap_or_default();
        let same = |(there, point): (&CompactFloat, &f32)| *there == CompactFloat::of(*point);
        !there.is_empty() && there.len() == piece.points.len() && there.iter().zip(&piece.points).all(same)
    }

    /// Makes the values of this tick and n later ones, as far as they are not there yet: one each tick, and the first of them
    /// when a wave begins. `None` when setpoints come from the host.
    pub fn look_ahead(&mut self, ticks: usize) -> Option<()> {
        let ticks = ticks.min(AHEAD - 1) as u32;
        while self.made.wrapping_sub(self.given) <= ticks {
            self.make()?;
        }
        Some(())
    }

    /// One more value. Not inlined: nearly always just one is missing.
    #[inline(never)]
    fn make(&mut self) -> Option<()> {
        let value = self.step()?;
        self.lookahead[self.made as usize % AHEAD] = value;
        self.made = self.made.wrapping_add(1);
        Some(())
    }

    /// The value of this tick and that of n ticks later (at most 15); `None` when setpoints come from the host. Moves on
    /// by one tick.
    pub fn step_ahead(&mut self, ticks: usize) -> Option<(f32, f32)> {
        // Before anything is called: most ticks of most users have a setpoint.
        if self.is_set_point() {
            return None;
        }
        self.look_ahead(ticks)?;
        let now = self.lookahead[self.given as usize % AHEAD];
        self.given = self.given.wrapping_add(1);
        Some((now, self.last))
    }

    /// The value of this tick; `None` when setpoints come from the host. Moves on by one tick.
    fn step(&mut self) -> Option<f32> {
        // The commonest one first: it counts no ticks.
        if let Reference::Sine { mean, amplitude, .. } = self.reference {
            let value = mean + amplitude * sine(self.phase);
            self.phase = self.phase.wrapping_add(self.sine_steps);
            self.last = value;
            return Some(value);
        }
        self.step_other()
    }

    #[inline(never)]
    fn step_other(&mut self) -> Option<f32> {
        let value = match self.reference {
            Reference::SetPoint => return None,
            Reference::Sine { .. } => self.last,
            Reference::Chirp { mean, amplitude, from_hz, to_hz, duration_s } => {
                let value = mean + amplitude * sine(self.phase);
                let time_s = self.ticks as f32 * TICK_S;
                if time_s < duration_s {
                    let hz = from_hz + (to_hz - from_hz) * (time_s / duration_s);
                    self.phase = self.phase.wrapping_add(steps(hz));
                    value
                } else {
                    self.last
                }
            }
            Reference::Trapezoid { low, high, ramp_s, hold_s } => {
                let ramp = (ramp_s * TICKS_PER_S as f32) as u32;
                let hold = (hold_s * TICKS_PER_S as f32) as u32;
                let period = 2 * (ramp + hold).max(1);
                let mut at = self.ticks % period;
                let (mut from, mut to) = (low, high);
                if at >= period / 2 {
                    at -= period / 2;
                    (from, to) = (high, low);
                }
                if at < ramp { from + (to - from) * (at as f32 / ramp as f32) } else { to }
            }
            Reference::Table { step_s, repeat } => self.table(step_s, repeat),
        };
        // The counter of a repeating wave is brought back by whole periods where it is used; a chirp stops counting.
        self.ticks = match self.reference {
            Reference::Trapezoid { ramp_s, hold_s, .. } => {
                let half = (ramp_s * TICKS_PER_S as f32) as u32 + (hold_s * TICKS_PER_S as f32) as u32;
                (self.ticks + 1) % (2 * half.max(1))
            }
            _ => self.ticks.saturating_add(1),
        };
        self.last = value;
        Some(value)
    }

    fn table(&mut self, step_s: f32, repeat: bool) -> f32 {
        let ticks_per_point = ((step_s * TICKS_PER_S as f32) as u32).max(1);
        let count = self.points.len() as u32;
        let length = count * ticks_per_point;
        if repeat && self.ticks >= length {
            self.ticks = 0;
        }
        let index = self.ticks / ticks_per_point;
        let share = (self.ticks % ticks_per_point) as f32 / ticks_per_point as f32;
        let point = |at: u32| {
            let place = at.min(count.saturating_sub(1)) as usize;
            self.points.get(place).map_or(self.last, |point| point.value())
        };
        let next = if repeat && index + 1 >= count { 0 } else { index + 1 };
        let from = point(index);
        from + (point(next) - from) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(generator: &mut Generator, ticks: usize) -> std::vec::Vec<f32> {
        (0..ticks).filter_map(|_| generator.step()).collect()
    }

    #[test]
    fn the_sine_is_right_to_a_fifth_of_a_percent() {
        let worst = (0..100_000_u32)
            .map(|n| {
                let phase = n * 42_949;
                let exact = (f64::from(phase) / 4_294_967_296.0 * std::f64::consts::TAU).sin();
                (f64::from(sine(phase)) - exact).abs()
            })
            .fold(0.0, f64::max);
        assert!((0.0005..0.0012).contains(&worst), "micromath's sine is off by {worst}");
    }

    #[test]
    fn a_sine_has_its_frequency_after_an_hour() {
        let mut generator = Generator::default();
        let sine = Reference::Sine { mean: 5.0, amplitude: 2.0, frequency_hz: 0.5 };
        assert_eq!(generator.begin(sine), Ok(()));
        let first = run(&mut generator, 2000);
        run(&mut generator, 3_598_000);
        let later = run(&mut generator, 2000);
        let drift = first.iter().zip(&later).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(drift < 0.01, "after an hour the wave has moved by {drift}");
        let mean = first.iter().sum::<f32>() / 2000.0;
        assert!((mean - 5.0).abs() < 0.01);
    }

    #[test]
    fn a_trapezoid_rises_holds_falls_and_rests() {
        let mut generator = Generator::default();
        let shape = Reference::Trapezoid { low: 1.0, high: 3.0, ramp_s: 0.1, hold_s: 0.05 };
        assert_eq!(generator.begin(shape), Ok(()));
        let values = run(&mut generator, 600);
        assert_eq!(values[0], 1.0);
        assert!((values[50] - 2.0).abs() < 0.03);
        assert_eq!(values[120], 3.0);
        assert!((values[200] - 2.0).abs() < 0.03);
        assert_eq!(values[280], 1.0);
        assert_eq!(values[..300], values[300..]);
    }

    #[test]
    fn a_chirp_ends_and_holds() {
        let mut generator = Generator::default();
        let chirp = Reference::Chirp { mean: 0.0, amplitude: 1.0, from_hz: 1.0, to_hz: 5.0, duration_s: 2.0 };
        assert_eq!(generator.begin(chirp), Ok(()));
        let values = run(&mut generator, 3000);
        let crossings = values.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
        // (1 + 5)/2 Hz over 2 s are six turns.
        assert!((5..=6).contains(&crossings), "{crossings}");
        assert_eq!(values[2500], values[2999]);
    }

    #[test]
    fn a_table_is_followed_and_ends_or_repeats() {
        let points =
            ReferencePoints { points: [0.0, 10.0, 4.0].into_iter().collect(), ..ReferencePoints::default() };
        let mut generator = Generator::default();
        assert_eq!(
            generator.begin(Reference::Table { step_s: 0.01, repeat: false }),
            Err(Refusal::Value(Field::Reference))
        );
        assert_eq!(generator.take_points(&points), Ok(3));
        assert_eq!(generator.begin(Reference::Table { step_s: 0.01, repeat: false }), Ok(()));
        let values = run(&mut generator, 60);
        assert_eq!((values[0], values[5], values[10], values[15], values[59]), (0.0, 5.0, 10.0, 7.0, 4.0));
        assert_eq!(generator.begin(Reference::Table { step_s: 0.01, repeat: true }), Ok(()));
        let values = run(&mut generator, 60);
        assert_eq!((values[25], values[30], values[35]), (2.0, 0.0, 5.0));
    }

    /// The answer to a piece was lost on the line, and the host sends it again.
    #[test]
    fn the_last_piece_of_a_table_may_come_twice_and_no_other() {
        let piece = |offset, points: &[f32]| ReferencePoints {
            offset,
            points: points.iter().copied().collect(),
            ..ReferencePoints::default()
        };
        let mut generator = Generator::default();
        for _ in 0..3 {
            assert_eq!(generator.take_points(&piece(0, &[0.0, 0.1, 4.0])), Ok(3));
        }
        for _ in 0..3 {
            assert_eq!(generator.take_points(&piece(3, &[7.0, 0.3])), Ok(5));
        }
        for other in [
            piece(3, &[7.0, 0.4]),
            piece(3, &[7.0]),
            piece(2, &[4.0]),
            piece(4, &[0.3, 1.0]),
            piece(6, &[1.0]),
        ] {
            assert_eq!(generator.take_points(&other), Err(Refusal::Range), "{other:?}");
        }
        assert_eq!(generator.take_points(&piece(5, &[2.0])), Ok(6));
        assert_eq!(generator.begin(Reference::Table { step_s: 0.001, repeat: false }), Ok(()));
        assert_eq!(
            run(&mut generator, 6),
            [0.0, 0.1, 4.0, 7.0, 0.3, 2.0].map(|v| CompactFloat::of(v).value())
        );
    }

    #[test]
    fn nonsense_is_refused() {
        let mut generator = Generator::default();
        for reference in [
            Reference::Sine { mean: f32::NAN, amplitude: 1.0, frequency_hz: 1.0 },
            Reference::Sine { mean: 0.0, amplitude: 1.0, frequency_hz: -1.0 },
            Reference::Trapezoid { low: 0.0, high: 1.0, ramp_s: 0.0, hold_s: 0.0 },
            Reference::Chirp { mean: 0.0, amplitude: 1.0, from_hz: 0.0, to_hz: 1e9, duration_s: 1.0 },
        ] {
            assert_eq!(generator.begin(reference), Err(Refusal::Value(Field::Reference)), "{reference:?}");
        }
        assert!(generator.is_set_point());
    }
}
