//! The pressure that makes the muscle exert a demanded force at a measured stroke.
//!
//! At one stroke and within one segment of the table, `F_G + F_NLFB` and `1 − k_F s` are cubics in pressure. They are put
//! together once, and Newton's method runs on them; a bracket keeps it from leaving, so that it ends for every table.

use crate::effects::{Chain, Context};
use crate::muscle::{AtStroke, COMMON_ORDER, Muscle, OperatingPoint, Piece, StrokeSlopes};
use crate::scalar::Scalar;
use crate::spline::{self, Cubic};
use crate::units::{Force, Pressure};
use serde::{Deserialize, Serialize};

/// Whether a pressure gives the demanded force, and if not, why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Attainability {
    /// The pressure gives the demanded force.
    Attainable,
    /// The muscle cannot pull that hard at this stroke: the pressure is the highest allowed.
    BeyondBlockedForce,
    /// Even the lowest pressure pulls harder: the pressure is the lowest allowed.
    BelowDeadband,
    /// More pressure does not pull harder here (contracted past the neutral angle, or a table that turns round).
    NotRising,
    /// The demanded force, or that of the muscle, is not a finite number: the pressure is the lowest allowed.
    NotANumber,
}

/// A pressure for a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<T> {
    /// What to command.
    pub pressure: Pressure<T>,
    /// `∂F/∂P` there, N/Pa.
    pub slope: T,
    /// Whether it gives the demanded force.
    pub attainability: Attainability,
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
/// Steps on one piece after which the bracket takes over: from an estimate as far away as a piece is long, three end the search.
const MAX_STEPS_ON_PIECE: u8 = 4;

/// Force as a function of pressure alone, piece by piece smooth.
trait Curve<T> {
    /// Makes ready the piece around a pressure.
    fn enter(&mut self, p: T);
    /// Whether a pressure lies on the piece that was entered.
    fn holds(&self, p: T) -> bool;
    /// Force and its slope at a pressure of the piece.
    fn force_and_slope(&mut self, p: T) -> (T, T);
}

/// The pressures between which the answer lies, if force rises with pressure and the answer is within the limits. An end that
/// has not been tried lies a tolerance outside.
struct Bracket<T> {
    low: T,
    high: T,
}

impl<T: Scalar> Bracket<T> {
    /// Where to go instead of a step that leaves the bracket or is not a number.
    #[cold]
    #[inline(never)]
    fn instead(&self, lowest: T, highest: T) -> T {
        if self.low < lowest {
            lowest
        } else if self.high > highest {
            highest
        } else {
            (self.low + self.high) * T::from_f32(0.5)
        }
    }
}

/// Newton's method within a bracket, which ends for every curve.
///
/// It ends with a step below the tolerance. It also ends when the step `s` and the one before it, `s₀`, both on one piece,
/// predict that the next would be: steps of Newton's method shrink by a ratio that shrinks itself, so that it would be less
/// than `s²/s₀`.
#[inline(always)]
fn solve<T: Scalar>(
    curve: &mut impl Curve<T>,
    wanted: T,
    guess: Pressure<T>,
    search: &Search<T>,
) -> Solution<T> {
    let (lowest, highest, tolerance) = (search.low.si(), search.high.si(), search.tolerance.si());
    let mut bracket = Bracket { low: lowest - tolerance, high: highest + tolerance };
    let mut p = guess.si().at_least(lowest).at_most(highest);
    let mut steps = 0;
    let (miss, slope) = 'search: loop {
        curve.enter(p);
        let mut before = T::ZERO;
        loop {
            let (force, slope) = curve.force_and_slope(p);
            let miss = force - wanted;
            if miss > T::ZERO {
                bracket.high = p;
            } else {
                bracket.low = p;
            }
            let mut next = p - miss / slope;
            // A quotient that is not a number is not within either.
            let within = next > bracket.low && next < bracket.high;
            let jumps = !within && !((next - p).abs() <= tolerance);
            if jumps {
                next = bracket.instead(lowest, highest);
            }
            let size = (next - p).abs();
            p = next;
            steps += 1;
            if size <= tolerance || steps >= MAX_STEPS {
                break 'search (miss, slope);
            }
            if !curve.holds(p) {
                break;
            }
            if size * size <= tolerance * before {
                break 'search (miss, slope);
            }
            // A jump predicts nothing.
            before = if jumps { T::ZERO } else { size };
        }
    };
    if !(p > lowest && p < highest && steps < MAX_STEPS) {
        let last = Solution {
            pressure: Pressure::from_pascals(p),
            slope,
            attainability: Attainability::Attainable,
            steps,
        };
        return ended(last, miss, search);
    }
    Solution { pressure: Pressure::from_pascals(p), slope, attainability: Attainability::Attainable, steps }
}

/// A search that ended at a limit. One for a force that is not a number goes up to the highest pressure, as each step counts as too little:
/// its answer is the lowest.
#[cold]
#[inline(never)]
fn ended<T: Scalar>(last: Solution<T>, miss: T, search: &Search<T>) -> Solution<T> {
    if !miss.is_finite() {
        return Solution {
            pressure: search.low,
            slope: T::ZERO,
            attainability: Attainability::NotANumber,
            ..last
        };
    }
    let pressure = last.pressure.si().at_least(search.low.si()).at_most(search.high.si());
    let attainability = judge(miss, last.slope, search.tolerance.si());
    Solution { pressure: Pressure::from_pascals(pressure), attainability, ..last }
}

/// Why a search ended at a limit: by what was missed at its last pressure.
fn judge<T: Scalar>(miss: T, slope: T, tolerance: T) -> Attainability {
    if miss.abs() <= slope.abs() * tolerance * T::from_f32(2.0) {
        Attainability::Attainable
    } else if !(slope > T::ZERO) {
        Attainability::NotRising
    } else if miss < T::ZERO {
        Attainability::BeyondBlockedForce
    } else {
        Attainability::BelowDeadband
    }
}

/// The base model at one stroke and direction: one product of two cubics in each piece.
struct Base<'a, T> {
    muscle: &'a Muscle<T>,
    at_stroke: &'a AtStroke<T>,
    direction: T,
    quasi: Cubic<T>,
    grip: Cubic<T>,
    /// The pressure that the cubics count from.
    origin: T,
    /// Where they hold.
    from: T,
    to: T,
}

impl<'a, T: Scalar> Base<'a, T> {
    /// Without cubics yet; they are put together where the search enters.
    #[inline(always)]
    fn new(muscle: &'a Muscle<T>, at_stroke: &'a AtStroke<T>, direction: T) -> Self {
        let (quasi, grip) = ([T::ZERO; 4], [T::ZERO; 4]);
        Self { muscle, at_stroke, direction, quasi, grip, origin: T::ZERO, from: T::ZERO, to: T::ZERO }
    }
}

impl<T: Scalar> Curve<T> for Base<'_, T> {
    #[inline(always)]
    fn enter(&mut self, p: T) {
        let muscle = self.muscle;
        let index = muscle.nodes.place(p);
        (self.from, self.to) = muscle.nodes.bounds(index);
        let Piece { origin, elastic: e, friction } = &muscle.pieces[index];
        let (c, area, s) = (&self.at_stroke.columns, self.at_stroke.posture.area, -self.direction);
        let sum = |n: usize, of: T| of + c[0] * e[0][n] + c[1] * e[1][n] + c[2] * e[2][n] + c[3] * e[3][n];
        let steady = (*origin - muscle.deadband) * area;
        self.quasi = [sum(0, steady), sum(1, area), sum(2, T::ZERO), sum(3, T::ZERO)];
        if muscle.order > COMMON_ORDER {
            let more = |n: usize| c[4] * e[4][n] + c[5] * e[5][n];
            let [q0, q1, q2, q3] = self.quasi;
            self.quasi = [q0 + more(0), q1 + more(1), q2 + more(2), q3 + more(3)];
        }
        self.origin = *origin;
        self.grip = [T::ONE + s * friction[0], s * friction[1], s * friction[2], s * friction[3]];
    }

    #[inline(always)]
    fn holds(&self, p: T) -> bool {
        p >= self.from && p <= self.to
    }

    #[inline(always)]
    fn force_and_slope(&mut self, p: T) -> (T, T) {
        let u = p - self.origin;
        let (quasi, quasi_slope) = spline::value_and_slope(&self.quasi, u);
        let (grip, grip_slope) = spline::value_and_slope(&self.grip, u);
        (quasi * grip, quasi_slope * grip + quasi * grip_slope)
    }
}

/// The base model and effects that change with pressure.
struct Whole<'a, T> {
    muscle: &'a Muscle<T>,
    at_stroke: &'a AtStroke<T>,
    slopes: &'a StrokeSlopes<T>,
    chain: &'a Chain<T>,
    /// The present operating point, moved to the pressures that are tried.
    context: Context<T>,
    /// The last pressure tried and what the effects added there.
    last: Option<(T, T)>,
    /// `∂F_effects/∂P` by the last two.
    effect_slope: T,
}

impl<T: Scalar> Curve<T> for Whole<'_, T> {
    fn enter(&mut self, _: T) {}

    /// Never: effects may bend anywhere, so that no step predicts the next.
    fn holds(&self, _: T) -> bool {
        false
    }

    fn force_and_slope(&mut self, p: T) -> (T, T) {
        let direction = self.context.direction;
        let pressure = Pressure::from_pascals(p);
        let parts = self.muscle.move_to(&mut self.context, self.at_stroke, self.slopes, pressure);
        let extra = self.chain.force(&self.context);
        if let Some((p0, extra0)) = self.last
            && p != p0
        {
            self.effect_slope = (extra - extra0) / (p - p0);
        }
        self.last = Some((p, extra));
        (parts.force(direction) + extra, parts.slope(direction) + self.effect_slope)
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

    /// The pressure for a demanded force of the base model, starting from an estimate (best: the last tick's answer).
    ///
    /// `direction` as in [`Muscle::force`]. A force saturated gives the nearest allowed pressure, and says so.
    #[inline(always)]
    pub fn pressure_for(
        &self,
        force: Force<T>,
        at_stroke: &AtStroke<T>,
        direction: T,
        guess: Pressure<T>,
        search: &Search<T>,
    ) -> Solution<T> {
        match self.pressure_on_piece(force, at_stroke, direction, guess, search) {
            Ok(found) => found,
            Err(next) => self.pressure_over_pieces(force, at_stroke, direction, [guess, next], search),
        }
    }

    /// The search from piece to piece. It continues where the search on the first piece left it, and if that is not enough, it restarts
    /// within a bracket.
    #[cold]
    #[inline(never)]
    fn pressure_over_pieces(
        &self,
        force: Force<T>,
        at_stroke: &AtStroke<T>,
        direction: T,
        [guess, next]: [Pressure<T>; 2],
        search: &Search<T>,
    ) -> Solution<T> {
        match self.pressure_on_piece(force, at_stroke, direction, next, search) {
            Ok(found) => Solution { steps: found.steps + 1, ..found },
            Err(_) => solve(&mut Base::new(self, at_stroke, direction), force.si(), guess, search),
        }
    }

    /// The same search as long as it needs no bracket: on the piece of the estimate, where the force rises, by steps that each become
    /// smaller, so that none leaves the bracket that those before it make. Within a few steps; otherwise the pressure where it ended.
    #[inline(always)]
    fn pressure_on_piece(
        &self,
        force: Force<T>,
        at_stroke: &AtStroke<T>,
        direction: T,
        guess: Pressure<T>,
        search: &Search<T>,
    ) -> Result<Solution<T>, Pressure<T>> {
        let (lowest, highest, tolerance) = (search.low.si(), search.high.si(), search.tolerance.si());
        let wanted = force.si();
        let mut p = guess.si().at_least(lowest).at_most(highest);
        let mut base = Base::new(self, at_stroke, direction);
        base.enter(p);
        let mut before = T::ZERO;
        for steps in 1..=MAX_STEPS_ON_PIECE {
            let (force, slope) = base.force_and_slope(p);
            let next = p - (force - wanted) / slope;
            let size = (next - p).abs();
            // With `!(…)`, a number that is not one ends it.
            if !(slope > T::ZERO && next > lowest && next < highest) {
                break;
            }
            let ends = size <= tolerance;
            let holds = base.holds(next);
            if ends || (holds && size * size <= tolerance * before) {
                let (pressure, attainability) = (Pressure::from_pascals(next), Attainability::Attainable);
                return Ok(Solution { pressure, slope, attainability, steps });
            }
            if !holds {
                return Err(Pressure::from_pascals(next));
            }
            if !(steps == 1 || size < before) {
                break;
            }
            before = size;
            p = next;
        }
        Err(guess)
    }

    /// The pressure for a demanded force with effects, at an operating point to which `chain` has been stepped.
    ///
    /// The force of effects that do not depend on pressure is subtracted exactly. Otherwise the whole force is solved for by Newton's
    /// method, with the base model's slope and a secant for that of the effects. A bracket makes the search end for every table.
    /// Therefore `force_with(pressure_with(F)) = F` for every `F` within the limits, to within the tolerance times the slope.
    pub fn pressure_with(
        &self,
        force: Force<T>,
        chain: &Chain<T>,
        point: &OperatingPoint<T>,
        guess: Pressure<T>,
        search: &Search<T>,
    ) -> Solution<T> {
        if chain.depends_on_pressure() {
            return self.pressure_by_search(force, chain, point, guess, search);
        }
        let rest = Force::from_newtons(force.si() - chain.force(&point.context));
        self.pressure_for(rest, &point.at_stroke, point.context.direction, guess, search)
    }

    /// The same where an effect's force depends on the pressure.
    #[inline(always)]
    pub(crate) fn pressure_by_search(
        &self,
        force: Force<T>,
        chain: &Chain<T>,
        point: &OperatingPoint<T>,
        guess: Pressure<T>,
        search: &Search<T>,
    ) -> Solution<T> {
        let OperatingPoint { at_stroke, slopes, context } = point;
        let context = *context;
        let mut whole =
            Whole { muscle: self, at_stroke, slopes, chain, context, last: None, effect_slope: T::ZERO };
        solve(&mut whole, force.si(), guess, search)
    }
}

#[cfg(test)]
mod step_tests;
#[cfg(test)]
mod tests;
