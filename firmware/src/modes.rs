//! The pressure demand of each mode: the mathematics between a setpoint and the regulator.

use model_core::effects::{Chain, EffectName};
use model_core::inverse::{Attainability, Search};
use model_core::link::messages::Mode;
use model_core::link::settings::{FeedForward, Settings};
use model_core::motion::{Motion, Slide};
use model_core::muscle::{AtStroke, Muscle, OperatingPoint};
use model_core::scalar::Scalar;
use model_core::single_precision;
use model_core::table::{MuscleTable, TableError};
use model_core::units::{Force, Length, Pressure};

use crate::placement::{Placed, placed};
use crate::regulator::Air;
use crate::tick::TICK_S;

mod loops;

pub use loops::{Integral, stroke_force, trim};

/// A muscle's table in use: the form that is evaluated, its effects with what they remember, and the present tick.
#[derive(Clone, Debug)]
pub struct Model {
    /// Force and inverse.
    pub muscle: Muscle<f32>,
    /// Physics beyond the base model.
    pub chain: Chain<f32>,
    /// The muscle in this tick. Without effects only its shape and direction are updated.
    now: OperatingPoint<f32>,
    /// Direction of friction; none where an effect of the table describes how friction changes after a reversal.
    slide: Option<Slide<f32>>,
    /// Distances of [`Slide`] in a metre of stroke, and in a pascal at held length.
    per_metre: f32,
    per_pascal: f32,
    last: Option<(f32, f32)>,
    /// Travel within the play, in distances.
    held_back: f32,
    /// The last force demand, and whether it was made since the last tick.
    demand: Demand,
    demanded: bool,
    /// `∂F/∂P` where the last search ended, N/Pa.
    slope: f32,
    /// Least force at which the muscle is taut, N.
    taut_n: f32,
    /// `1/V₀`, 1/m³.
    inv_rest_volume: f32,
}

/// Travel over which friction changes direction after a reversal, as a part of the tested contraction: some micrometres in a small
/// muscle, some tens in a large one. For a particular muscle only the effect `presliding-hysteresis` determines it.
const SLIDE: f32 = 2.0e-3;
/// Slip of the strands at held length, as a part of that of the free motion. No table contains it, and it differs between muscles
/// several times over; this is the middle of the virtual bench's range. It is less than half of the value in
/// [`model_core::effects::BraidTravel`]: friction that reverses with the pressure adds to the pressure command, and this addition must
/// be smaller than the change of pressure that reversed it.
const SLIP: f32 = 0.019;
/// Play of the travel that reverses friction, in distances: the noise of the stroke sensor that passes it is small compared with a
/// changing demand.
const PLAY: f32 = 0.05;
/// The same play after a demand has been constant for [`CALM_S`]: no noise passes. Then only the load moves the muscle, by any distance,
/// and friction reverses with it. Pressure no longer counts as travel: it would change only because friction has been compensated, and
/// reverse friction again.
const PLAY_CALM: f32 = 0.2;
/// The same where a trim removes the error of the table. If the trim and the compensation both correct one friction, they cause a limit
/// cycle: each swing of a mass on a spring reverses one before the other has settled. The direction of friction is therefore held until
/// the muscle has moved far, and the trim corrects the remainder. The same holds in a joint, where each muscle is the other's load and
/// an external torque must meet at least the stiffness that was requested.
const PLAY_RESTING: f32 = 20.0;
/// Part of friction that is corrected in a joint. Of two muscles that pull against each other, each is the other's load: with all
/// friction compensated, nothing holds the joint in place. It creeps, friction reverses, and it jumps to the other end of the range
/// that friction would have held, some hundredths of a radian back and forth. The stiffness against an external torque then depends on
/// the position in this range. The remaining quarter of friction holds the joint, and adds some stiffness to what was requested.
const JOINT_SHARE: f32 = 0.75;
/// Time after which an unchanged force demand counts as constant, s.
const CALM_S: f32 = 0.2;
/// Part of blocked force above which a muscle is taut despite errors of its table.
const TAUT: f32 = 0.02;

/// A force for which the table gives the pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Demand {
    force_n: f32,
    /// For how long it has been the same, s.
    still_s: f32,
    /// Whether friction rests while it stays the same.
    rests: bool,
}

impl Model {
    /// Builds it from a table.
    ///
    /// # Errors
    /// The number of the table that cannot be used.
    pub fn build(table: &MuscleTable) -> Result<Self, TableError> {
        let mut model = Self::blank();
        model.rebuild(table)?;
        Ok(model)
    }

    /// A place for [`Model::rebuild`].
    pub const fn blank() -> Self {
        Self {
            chain: Chain::none(),
            slide: None,
            per_metre: 0.0,
            per_pascal: 0.0,
            last: None,
            held_back: 0.0,
            demand: Demand { force_n: 0.0, still_s: 0.0, rests: false },
            demanded: false,
            slope: 0.0,
            inv_rest_volume: 0.0,
            taut_n: 0.0,
            now: OperatingPoint::NONE,
            muscle: Muscle::blank(),
        }
    }

    /// As [`Model::build`], in a place that is there already: it is kept once and never moved.
    ///
    /// # Errors
    /// As [`Model::build`]; what was in the place is lost then.
    #[inline(never)]
    pub fn rebuild(&mut self, table: &MuscleTable) -> Result<(), TableError> {
        self.muscle.rebuild(table)?;
        self.chain.resume(&table.effects);
        self.muscle.begin(&mut self.now);
        // At rest, without pressure. As the control step does it, so that no other form of it is in the image.
        single_precision::update(&self.muscle, &mut self.now, &Motion::default(), Pressure::ZERO);
        let reach_m = table.tested.contraction_high.at_least(1.0e-2) * self.muscle.braid().rest_length();
        let distance_m = SLIDE * reach_m;
        let area = self.now.at_stroke.posture.area;
        // Free, the muscle would go all its way for the pressure that holds its blocked force.
        let blocked_pa = table.blocked_force.newtons().abs().at_least(1.0e-3) / area;
        let slip = SLIP * reach_m / blocked_pa.abs().at_least(1.0);
        let knows = table.effects.iter().any(|e| e.effect == EffectName::PreslidingHysteresis);
        self.slide = (!knows).then(Slide::default);
        self.per_metre = 1.0 / distance_m;
        self.per_pascal = slip / distance_m;
        self.last = None;
        self.held_back = 0.0;
        self.demanded = false;
        self.slope = area;
        self.inv_rest_volume =
            1.0 / self.muscle.braid().gas_volume(&self.now.at_stroke.posture).at_least(1.0e-12);
        self.taut_n = TAUT * table.blocked_force.newtons().abs();
        Ok(())
    }

    /// Direction of friction at these readings.
    fn slid(&mut self, motion: &Motion<f32>, pressure_pa: f32) -> f32 {
        let now = (motion.stroke, pressure_pa);
        let (stroke, pressure) = self.last.replace(now).unwrap_or(now);
        let by_stroke = (motion.stroke - stroke) * self.per_metre;
        let by_pressure = (pressure_pa - pressure) * self.per_pascal;
        if !core::mem::take(&mut self.demanded) {
            self.demand.still_s = 0.0;
        }
        let (travel, play) = match (self.demand.still_s >= CALM_S, self.demand.rests) {
            (false, _) => (by_stroke + by_pressure, PLAY),
            (true, false) => (by_stroke, PLAY_CALM),
            (true, true) => (by_stroke + by_pressure, PLAY_RESTING),
        };
        // What a change of the play leaves over is forgotten, not travelled.
        let back = self.held_back.within(-play, play) + travel;
        self.held_back = back.within(-play, play);
        let travel = back - self.held_back;
        self.slide.as_mut().map_or(motion.direction, |slide| slide.step(travel))
    }

    /// Lets one tick pass: the shape at the measured stroke, a step of the effects, and the force at the readings, N.
    #[inline(always)]
    pub fn tick(&mut self, motion: &Motion<f32>, pressure_pa: f32) -> f32 {
        self.tick_trusted(motion, pressure_pa, true)
    }

    /// The same where the readings may be false: then no effect remembers them.
    pub fn tick_trusted(&mut self, motion: &Motion<f32>, pressure_pa: f32, trusted: bool) -> f32 {
        let direction = self.slid(motion, pressure_pa);
        let Self { muscle, chain, now, .. } = self;
        let pressure = Pressure::from_pascals(pressure_pa);
        let newtons = if chain.is_empty() {
            now.context.direction = direction;
            single_precision::pose(
                muscle,
                &mut now.at_stroke,
                Length::from_metres(motion.stroke),
                pressure,
                direction,
            )
        } else {
            single_precision::update(muscle, now, motion, pressure);
            now.context.direction = direction;
            if trusted {
                single_precision::step(chain, &now.context);
            }
            muscle.pull(now.context.force() + single_precision::effects(chain, &now.context))
        };
        newtons.newtons()
    }

    /// Direction of friction in this tick.
    pub fn direction(&self) -> f32 {
        self.now.context.direction
    }

    /// `∂F/∂P`, N/Pa, and `∂F/∂x`, N/m, of the base model at this tick's stroke.
    pub fn slopes(&self, pressure_pa: f32) -> (f32, f32) {
        let pressure = Pressure::from_pascals(pressure_pa);
        let (parts, by_stroke) =
            single_precision::parts_and_stiffness(&self.muscle, &self.now.at_stroke, pressure);
        (parts.slope(self.now.context.direction), by_stroke)
    }

    /// The muscle at this tick's stroke.
    pub fn at_stroke(&self) -> &AtStroke<f32> {
        &self.now.at_stroke
    }

    /// The air in it at this tick's stroke and a speed of contraction, m/s: its volume grows by the braid's area times the
    /// stroke.
    pub fn air(&self, speed_m_per_s: f32) -> Air {
        let Self { muscle, now, inv_rest_volume, .. } = self;
        let posture = &now.at_stroke.posture;
        let volume = muscle.braid().gas_volume(posture).at_least(0.1 / inv_rest_volume);
        Air { fill: volume * inv_rest_volume, widening_per_s: posture.area * speed_m_per_s / volume }
    }

    /// Least force at which the muscle is taut, N.
    pub fn taut_n(&self) -> f32 {
        self.taut_n
    }

    /// Half of the blocked force, N: more than a usable table is wrong by.
    pub fn half_blocked_n(&self) -> f32 {
        (0.5 / TAUT) * self.taut_n
    }

    /// The pressure for a demanded force in this tick, not a number where the force or that of the table is none, and whether it can be reached; `rests` where friction is not to turn while the same
    /// force is demanded, `share` of it corrected.
    pub fn pressure_for(&mut self, force_n: f32, guess_pa: f32, rests: bool, share: f32) -> (f32, bool) {
        let still_s = if self.demand.force_n == force_n { self.demand.still_s + TICK_S } else { 0.0 };
        self.demand = Demand { force_n, still_s, rests };
        self.demanded = true;
        let search = Search { tolerance: Pressure::from_pascals(20.0), ..self.muscle.search() };
        let force = Force::from_newtons(force_n);
        let guess = Pressure::from_pascals(guess_pa);
        let Self { muscle, chain, now, .. } = self;
        let direction = now.context.direction;
        now.context.direction = share * direction;
        let found = if chain.is_empty() {
            single_precision::pressure_for(
                muscle,
                &now.at_stroke,
                now.context.direction,
                force,
                guess,
                &search,
            )
        } else {
            single_precision::pressure_with(muscle, chain, now, force, guess, &search)
        };
        now.context.direction = direction;
        self.slope = found.slope;
        match found.attainability {
            // No pressure: the tick that demands it is a fault, and vents.
            Attainability::NotANumber => (f32::NAN, false),
            attainability => (found.pressure.pascals(), attainability == Attainability::Attainable),
        }
    }

    /// `∂F/∂P` where the last search ended, N/Pa.
    pub fn slope(&self) -> f32 {
        self.slope
    }

    /// `P = F / g`, the ideal braid alone, `g = (3L² − B²)/(4πN²)`; the highest pressure past the neutral angle.
    pub fn gaylord_pressure(&self, force_n: f32) -> (f32, bool) {
        let high = self.muscle.max_pressure().pascals();
        let area = self.now.at_stroke.posture.area;
        if area <= 0.0 {
            return (high, false);
        }
        let free = force_n / area;
        let limited = free.within(0.0, high);
        (limited, limited == free)
    }
}

/// The place of one muscle's table.
#[derive(Debug)]
pub struct Seat {
    model: Option<Placed<Model>>,
    taken: bool,
}

impl Seat {
    /// Empty ones of a board that drives two muscles.
    pub fn pair() -> [Self; 2] {
        [placed!(Model, Model::blank()), placed!(Model, Model::blank())]
            .map(|model| Self { model: Some(model), taken: false })
    }

    /// The same where there is no second muscle, and no memory for its table.
    pub fn single() -> [Self; 2] {
        let first = placed!(Model, Model::blank());
        [Some(first), None].map(|model| Self { model, taken: false })
    }

    /// The table in use.
    #[inline(always)]
    pub fn as_ref(&self) -> Option<&Model> {
        match &self.model {
            Some(model) if self.taken => Some(model),
            _ => None,
        }
    }

    /// The same, to bring it to a tick.
    #[inline(always)]
    pub fn as_mut(&mut self) -> Option<&mut Model> {
        match &mut self.model {
            Some(model) if self.taken => Some(model),
            _ => None,
        }
    }

    /// Puts a table here; a muscle that the board does not have gets none.
    ///
    /// # Errors
    /// The number of the table that cannot be used; the place is empty then.
    pub fn fill(&mut self, table: &MuscleTable) -> Result<(), TableError> {
        self.taken = false;
        if let Some(model) = &mut self.model {
            model.rebuild(table)?;
            self.taken = true;
        }
        Ok(())
    }

    /// Uses no table.
    pub fn clear(&mut self) {
        self.taken = false;
    }
}

/// The feed-forward pressure of a demanded force, Pa; without a table there is none.
pub fn feed_forward(
    settings: &Settings,
    mode: Mode,
    model: Option<&mut Model>,
    force_n: f32,
    guess_pa: f32,
) -> (f32, bool) {
    match (settings.feed_forward, model) {
        (FeedForward::Off, _) | (_, None) => (0.0, true),
        (FeedForward::Table, Some(model)) => {
            let trimmed = settings.force.fitted && settings.force_loop.trim_limit_pa > 0.0;
            let joint = mode == Mode::Pair;
            model.pressure_for(force_n, guess_pa, trimmed || joint, if joint { JOINT_SHARE } else { 1.0 })
        }
        (FeedForward::Gaylord, Some(model)) => model.gaylord_pressure(force_n),
    }
}

#[cfg(test)]
mod tests;
