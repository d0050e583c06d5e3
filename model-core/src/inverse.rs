//! The pressure that makes the muscle exert a wanted force at a measured stroke.
//!
//! At one stroke and within one segment of the table, `F_G + F_NLFB` and `1 − k_F s` are cubics in pressure. They are put
//! together once, and Newton's method runs on them; a bracket keeps it from leaving, so that it ends for every table.

use crate::effects::{Chain, Context};
use crate::muscle::{FRICTION, Held, Muscle};
use crate::scalar::Scalar;
use crate::spline::{self, Cubic};
use crate::units::{Force, Pressure};
use serde::{Deserialize, Serialize};

/// Whether the force can be had, and if not, why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reach {
    /// The pressure gives the wanted force.
    Reached,
    /// The muscle cannot pull that hard at this stroke: the pressure is the highest allowed.
    BeyondBlockedForce,
    /// Even the lowest pressure pulls harder: the pressure is the lowest allowed.
    BelowDeadband,
    /// More pressure does not pull harder here (contracted past the neutral angle, or a table that turns round).
    NotRising,
}

/// A pressure for a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<T> {
    /// What to command.
    pub pressure: Pressure<T>,
    /// `∂F/∂P` there, N/Pa.
    pub slope: T,
    /// Whether the force is reached.
    pub reach: Reach,
    /// Newton and bisection steps taken.
    pub steps: u8,
}

/// Where to look, and when to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search<T> {
    /// The lowest pressure allowed.
    pub low: Pressure<T>,
    /// The highest pressure allowed.
    pub high: Pressure<T>,
    /// A step smaller than this ends the search.
    pub tolerance: Pressure<T>,
}

const MAX_STEPS: u8 = 40;

/// One segment's cubics at a held stroke.
struct Segment<T> {
    quasi: Cubic<T>,
    grip: Cubic<T>,
    /// The pressure that the cubics count from.
    origin: T,
    /// Where they hold.
    from: T,
    to: T,
}

impl<T: Scalar> Segment<T> {
    #[inline]
    fn force_and_slope(&self, p: T) -> (T, T) {
        let u = p - self.origin;
        let quasi = spline::value(&self.quasi, u);
        let grip = spline::value(&self.grip, u);
        (quasi * grip, spline::slope(&self.quasi, u) * grip + quasi * spline::slope(&self.grip, u))
    }
}

impl<T: Scalar> Muscle<T> {
    /// The whole allowed range of pressure, to within 1 Pa.
    pub fn search(&self) -> Search<T> {
        Search {
            low: Pressure::ZERO,
            high: Pressure::from_pascals(self.max_pressure),
            tolerance: Pressure::from_pascals(T::ONE),
        }
    }

    /// The pressure for a wanted force of the base model, starting from a guess (best: the last tick's answer).
    ///
    /// `direction` as in [`Muscle::force`]. A force out of reach gives the nearest allowed pressure, and says so.
    pub fn pressure_for(
        &self,
        force: Force<T>,
        held: &Held<T>,
        direction: T,
        guess: Pressure<T>,
        search: &Search<T>,
    ) -> Solution<T> {
        let wanted = force.si();
        let (mut low, mut high) = (search.low.si(), search.high.si());
        let mut p = guess.si().clamp(low, high);
        if p != p {
            p = low;
        }
        let mut segment = self.segment(held, direction, p);
        let mut slope = T::ZERO;
        let mut steps = 0;
        // Whether the bracket's ends are known to enclose the answer, or are only the limits.
        let (mut low_tried, mut high_tried) = (false, false);
        while steps < MAX_STEPS {
            steps += 1;
            if p < segment.from || p > segment.to {
                segment = self.segment(held, direction, p);
            }
            let (f, df) = segment.force_and_slope(p);
            slope = df;
            let miss = f - wanted;
            if miss > T::ZERO {
                high = p;
                high_tried = true;
            } else {
                low = p;
                low_tried = true;
            }
            let step = miss / df;
            if step.abs() <= search.tolerance.si() {
                p = (p - step).clamp(search.low.si(), search.high.si());
                break;
            }
            let mut next = p - step;
            // `!(…)` also catches a quotient that is not a number.
            if !(next > low && next < high) {
                if !low_tried {
                    next = search.low.si();
                    low_tried = true;
                } else if !high_tried {
                    next = search.high.si();
                    high_tried = true;
                } else {
                    next = (low + high) * T::from_f32(0.5);
                }
            }
            let moved = (next - p).abs();
            p = next;
            if moved <= search.tolerance.si() {
                break;
            }
        }
        let reach = if p <= search.low.si() || p >= search.high.si() {
            self.why_not(held, direction, wanted, search, p, slope)
        } else {
            Reach::Reached
        };
        Solution { pressure: Pressure::from_pascals(p), slope, reach, steps }
    }

    /// The pressure for a wanted force with effects: `context` is the present moment, to which `chain` has been stepped.
    ///
    /// What the effects add regardless of pressure is subtracted exactly. Where an effect's force depends on the pressure the
    /// whole force is solved for, by Newton's method with the base model's slope and a secant for that of the effects, within
    /// a bracket that ends it for every table. So `force_with(pressure_with(F)) = F` wherever `F` can be reached, to within
    /// the tolerance times the slope.
    pub fn pressure_with(
        &self,
        force: Force<T>,
        held: &Held<T>,
        chain: &Chain<T>,
        context: &Context<T>,
        guess: Pressure<T>,
        search: &Search<T>,
    ) -> Solution<T> {
        let direction = context.direction;
        if chain.is_empty() {
            return self.pressure_for(force, held, direction, guess, search);
        }
        if !chain.depends_on_pressure() {
            let rest = Force::from_newtons(force.si() - chain.force(context));
            return self.pressure_for(rest, held, direction, guess, search);
        }
        let slopes = self.slopes(held);
        let at = |p: T| {
            let (moved, parts) = self.at_pressure(context, held, &slopes, Pressure::from_pascals(p));
            (parts.force(direction), parts.slope(direction), chain.force(&moved))
        };
        let wanted = force.si();
        let tolerance = search.tolerance.si();
        let (mut low, mut high) = (search.low.si(), search.high.si());
        let mut p = guess.si().clamp(low, high);
        if p != p {
            p = low;
        }
        let (mut low_tried, mut high_tried) = (false, false);
        let (mut effect_slope, mut last): (T, Option<(T, T)>) = (T::ZERO, None);
        let (mut miss, mut slope) = (T::ZERO, T::ZERO);
        let mut steps = 0;
        while steps < MAX_STEPS {
            steps += 1;
            let (base, base_slope, extra) = at(p);
            if let Some((p0, extra0)) = last
                && p != p0
            {
                effect_slope = (extra - extra0) / (p - p0);
            }
            last = Some((p, extra));
            slope = base_slope + effect_slope;
            miss = base + extra - wanted;
            if miss > T::ZERO {
                high = p;
                high_tried = true;
            } else {
                low = p;
                low_tried = true;
            }
            // The first step has no secant yet; a small miss there does not say that the pressure is right to the tolerance.
            if miss.abs() <= slope.abs() * tolerance * T::from_f32(0.5) {
                break;
            }
            let mut next = p - miss / slope;
            // `!(…)` also catches a quotient that is not a number.
            if !(next > low && next < high) {
                if !low_tried {
                    next = search.low.si();
                    low_tried = true;
                } else if !high_tried {
                    next = search.high.si();
                    high_tried = true;
                } else {
                    next = (low + high) * T::from_f32(0.5);
                }
            }
            if next == p || high - low <= tolerance * T::from_f32(0.01) {
                break;
            }
            p = next;
        }
        let at_limit = p <= search.low.si() || p >= search.high.si();
        let reach = if miss.abs() <= slope.abs() * tolerance * T::from_f32(2.0) {
            Reach::Reached
        } else if !at_limit || !(slope > T::ZERO) {
            Reach::NotRising
        } else if miss < T::ZERO {
            Reach::BeyondBlockedForce
        } else {
            Reach::BelowDeadband
        };
        Solution { pressure: Pressure::from_pascals(p), slope, reach, steps }
    }

    /// The cubics of the segment around `p`, valid up to its ends and, in the outer ones, beyond.
    fn segment(&self, held: &Held<T>, direction: T, p: T) -> Segment<T> {
        let place = self.nodes.place(p);
        let (from, to) = self.nodes.bounds(place.index);
        let cubics = &self.segments[place.index];
        let far = T::from_f32(f32::MAX);
        let area = held.posture.area;
        let base = (from - self.deadband) * area;
        if place.clamped {
            // Beyond the nodes the curves keep their end values: only pressure times area is left to vary.
            let below = p < from;
            let at_end = |c: &Cubic<T>| spline::value(c, if below { T::ZERO } else { to - from });
            let mut quasi = base;
            for (column, cubic) in held.columns.iter().zip(cubics).take(self.order) {
                quasi += *column * at_end(cubic);
            }
            let grip = [T::ONE - direction * at_end(&cubics[FRICTION]), T::ZERO, T::ZERO, T::ZERO];
            let (origin, from, to) = if below { (from, -far, from) } else { (to, to, far) };
            quasi += (origin - self.nodes.bounds(place.index).0) * area;
            return Segment { quasi: [quasi, area, T::ZERO, T::ZERO], grip, origin, from, to };
        }
        let mut quasi = [base, area, T::ZERO, T::ZERO];
        for (column, cubic) in held.columns.iter().zip(cubics).take(self.order) {
            for (sum, c) in quasi.iter_mut().zip(cubic) {
                *sum += *column * *c;
            }
        }
        let k = &cubics[FRICTION];
        let grip = [T::ONE - direction * k[0], -direction * k[1], -direction * k[2], -direction * k[3]];
        Segment { quasi, grip, origin: from, from, to }
    }

    fn why_not(&self, held: &Held<T>, direction: T, wanted: T, search: &Search<T>, p: T, slope: T) -> Reach {
        let (f, _) = self.segment(held, direction, p).force_and_slope(p);
        let near = slope.abs() * search.tolerance.si() * T::from_f32(2.0);
        if (f - wanted).abs() <= near {
            Reach::Reached
        } else if !(slope > T::ZERO) {
            Reach::NotRising
        } else if f < wanted {
            Reach::BeyondBlockedForce
        } else {
            Reach::BelowDeadband
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table;
    use crate::units::Length;
    use proptest::prelude::*;

    fn muscle() -> Muscle<f64> {
        Muscle::build(&table::example()).expect("a valid table")
    }

    proptest! {
        #[test]
        fn it_undoes_the_force(p in 80.0e3..540.0e3_f64, mm in 0.0..2.0_f64, s in -1..=1_i32, guess in 0.0..600.0e3_f64) {
            let m = muscle();
            let stroke = Length::from_millimetres(mm);
            let force = m.force(Pressure::from_pascals(p), stroke, f64::from(s));
            let found = m.pressure_for(force, &m.held(stroke), f64::from(s), Pressure::from_pascals(guess), &m.search());
            prop_assert_eq!(found.reach, Reach::Reached);
            prop_assert!((found.pressure.pascals() - p).abs() < 2.0, "{:?} for {}", found, p);
        }

        #[test]
        fn in_single_precision_it_ends_and_says_what_it_found(f in -1.0e3..1.0e3_f32, mm in -5.0..20.0_f32, s in -1..=1_i32, guess in -1e6..1e6_f32) {
            let m = Muscle::<f32>::build(&table::example()).expect("a valid table");
            let held = m.held(Length::from_millimetres(mm));
            let found = m.pressure_for(Force::from_newtons(f), &held, s as f32, Pressure::from_pascals(guess), &m.search());
            prop_assert!(found.pressure.pascals() >= 0.0 && found.pressure <= m.max_pressure());
            prop_assert!(found.steps <= MAX_STEPS);
        }
    }

    #[test]
    fn from_five_kilopascals_away_three_steps_are_enough() {
        let m = muscle();
        for kpa in [150.0, 275.0, 410.0, 520.0] {
            let stroke = Length::from_millimetres(1.0);
            let force = m.force(Pressure::from_kilopascals(kpa), stroke, 1.0);
            let guess = Pressure::from_kilopascals(kpa + 5.0);
            let found = m.pressure_for(force, &m.held(stroke), 1.0, guess, &m.search());
            assert!(found.steps <= 3, "{} steps at {kpa} kPa", found.steps);
        }
    }

    #[test]
    fn what_is_out_of_reach_is_said() {
        let m = muscle();
        let held = m.held(Length::ZERO);
        let at = |n| m.pressure_for(Force::from_newtons(n), &held, 0.0, Pressure::ZERO, &m.search());
        assert_eq!(at(1.0e4).reach, Reach::BeyondBlockedForce);
        assert_eq!(at(1.0e4).pressure, m.max_pressure());
        assert_eq!(at(-1.0e4).reach, Reach::BelowDeadband);
        assert_eq!(at(-1.0e4).pressure, Pressure::ZERO);
        let past_neutral = m.held(Length::from_millimetres(30.0));
        let found =
            m.pressure_for(Force::from_newtons(50.0), &past_neutral, 0.0, Pressure::ZERO, &m.search());
        assert_eq!(found.reach, Reach::NotRising);
        let nan = m.pressure_for(Force::from_newtons(f64::NAN), &held, 0.0, Pressure::ZERO, &m.search());
        assert_ne!(nan.reach, Reach::Reached);
        assert!(nan.pressure.is_finite());
    }
}
