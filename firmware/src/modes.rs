//! Which pressure a mode wants: the mathematics between a set-point and the regulator.

use model_core::effects::{Chain, EffectName};
use model_core::inverse::{Reach, Search, Solution};
use model_core::link::settings::{FeedForward, ForceLoop, Joint, Settings, StrokeLoop};
use model_core::motion::{Motion, Slide};
use model_core::muscle::{Held, Moment, Muscle};
use model_core::table::{MuscleTable, TableError};
use model_core::units::{Force, Length, Pressure};

use crate::tick::TICK_S;

/// A muscle's table in use: the form that is evaluated, its effects with what they remember, and the present tick.
#[derive(Clone, Debug)]
pub struct Model {
    /// Force and inverse.
    pub muscle: Muscle<f32>,
    /// Physics beyond the base model.
    pub chain: Chain<f32>,
    /// The muscle in this tick. Without effects its shape and direction are all that is kept up.
    now: Moment<f32>,
    /// Direction of friction; none where an effect of the table says how friction goes over from one to the other.
    slide: Option<Slide<f32>>,
    /// Distances of [`Slide`] in a metre of stroke, and in a pascal at held length.
    per_metre: f32,
    per_pascal: f32,
    last: Option<(f32, f32)>,
    /// `∂F/∂P` where the last search ended, N/Pa.
    slope: f32,
}

/// Travel over which friction goes over, as a part of the tested contraction: some micrometres of a small muscle, some tens of a
/// large one. What it is of one muscle only the effect `presliding-hysteresis` knows.
const SLIDE: f32 = 2.0e-3;
/// The part of the free motion that strands slip at held length. Half of what [`model_core::effects::BraidTravel`] takes: friction
/// that goes over with the pressure asks for more pressure, and must not ask for more than what turned it.
const SLIP: f32 = 0.025;

impl Model {
    /// Builds it from a table.
    ///
    /// # Errors
    /// The number of the table that cannot be used.
    pub fn build(table: &MuscleTable) -> Result<Self, TableError> {
        let muscle = Muscle::<f32>::build(table)?;
        let now = muscle.moment();
        let reach_m = table.tested.contraction_high.max(1.0e-2) * muscle.braid().rest_length();
        let distance_m = SLIDE * reach_m;
        // Free, the muscle would go all its way for the pressure that holds its blocked force.
        let blocked_pa = table.blocked_force.newtons().abs().max(1.0e-3) / now.held.posture.area;
        let slip = SLIP * reach_m / blocked_pa.abs().max(1.0);
        let knows = table.effects.iter().any(|e| e.effect == EffectName::PreslidingHysteresis);
        Ok(Self {
            chain: Chain::resumed(&table.effects),
            slide: (!knows).then(Slide::default),
            per_metre: 1.0 / distance_m,
            per_pascal: slip / distance_m,
            last: None,
            slope: now.held.posture.area,
            now,
            muscle,
        })
    }

    /// Direction of friction at these readings.
    fn slid(&mut self, motion: &Motion<f32>, pressure_pa: f32) -> f32 {
        let now = (motion.stroke, pressure_pa);
        let (stroke, pressure) = self.last.replace(now).unwrap_or(now);
        let travel = (motion.stroke - stroke) * self.per_metre + (pressure_pa - pressure) * self.per_pascal;
        self.slide.as_mut().map_or(motion.direction, |slide| slide.step(travel))
    }

    /// Lets one tick pass: the shape at the measured stroke, a step of the effects, and the force at the readings, N.
    pub fn tick(&mut self, motion: &Motion<f32>, pressure_pa: f32) -> f32 {
        let direction = self.slid(motion, pressure_pa);
        let Self { muscle, chain, now, .. } = self;
        let pressure = Pressure::from_pascals(pressure_pa);
        let newtons = if chain.is_empty() {
            now.held = muscle.held(Length::from_metres(motion.stroke));
            now.context.direction = direction;
            muscle.force_posed(&now.held.posture, pressure, direction)
        } else {
            muscle.update(now, motion, pressure);
            now.context.direction = direction;
            chain.step(&now.context);
            now.context.force() + chain.force(&now.context)
        };
        muscle.pull(newtons).newtons()
    }

    /// Direction of friction in this tick.
    pub fn direction(&self) -> f32 {
        self.now.context.direction
    }

    /// The muscle at this tick's stroke.
    pub fn held(&self) -> &Held<f32> {
        &self.now.held
    }

    /// The pressure for a wanted force in this tick, and whether it can be had.
    pub fn pressure_for(&mut self, force_n: f32, guess_pa: f32) -> (f32, bool) {
        let search = Search { tolerance: Pressure::from_pascals(20.0), ..self.muscle.search() };
        let force = Force::from_newtons(force_n);
        let guess = Pressure::from_pascals(guess_pa);
        let found = if self.chain.is_empty() {
            base_pressure(&self.muscle, &self.now.held, self.direction(), force, guess, &search)
        } else {
            self.muscle.pressure_with(force, &self.chain, &self.now, guess, &search)
        };
        self.slope = found.slope;
        (found.pressure.pascals(), found.reach == Reach::Reached)
    }

    /// `∂F/∂P` where the last search ended, N/Pa.
    pub fn slope(&self) -> f32 {
        self.slope
    }

    /// `P = F / g`, the ideal braid alone, `g = (3L² − B²)/(4πN²)`; the highest pressure past the neutral angle.
    pub fn gaylord_pressure(&self, force_n: f32) -> (f32, bool) {
        let high = self.muscle.max_pressure().pascals();
        let area = self.now.held.posture.area;
        if area <= 0.0 {
            return (high, false);
        }
        let free = force_n / area;
        let limited = free.clamp(0.0, high);
        (limited, limited == free)
    }
}

/// [`Muscle::pressure_for`], once in the image for all who ask.
#[inline(never)]
pub fn base_pressure(
    muscle: &Muscle<f32>,
    held: &Held<f32>,
    direction: f32,
    force: Force<f32>,
    guess: Pressure<f32>,
    search: &Search<f32>,
) -> Solution<f32> {
    muscle.pressure_for(force, held, direction, guess, search)
}

/// The feed-forward pressure of a wanted force, Pa; without a table there is none.
pub fn feed_forward(
    settings: &Settings,
    model: Option<&mut Model>,
    force_n: f32,
    guess_pa: f32,
) -> (f32, bool) {
    match (settings.feed_forward, model) {
        (FeedForward::Off, _) | (_, None) => (0.0, true),
        (FeedForward::Table, Some(model)) => model.pressure_for(force_n, guess_pa),
        (FeedForward::Gaylord, Some(model)) => model.gaylord_pressure(force_n),
    }
}

/// An integrator that stops where going on would only push further against a limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Integral(f32);

impl Integral {
    /// Its value.
    pub fn value(self) -> f32 {
        self.0
    }

    /// Forgets.
    pub fn reset(&mut self) {
        self.0 = 0.0;
    }

    /// One tick of `rate`, unless `cut` (last tick's command was limited) and the error points the way of the limit
    /// (`toward`: the sign of what was cut off).
    fn step(&mut self, rate: f32, limit: f32, cut: f32) {
        if cut * rate <= 0.0 {
            self.0 = (self.0 + rate * TICK_S).clamp(-limit, limit);
        }
    }
}

/// Trim of force on the load cell, Pa. `cut` is the sign of what the last command's limits took away.
///
/// Without a table the error is that of the wanted force, and the loop `L(s) = g (K_p + K_i/s)` with `g = ∂F/∂P` crosses over
/// near `g K_i` rad/s; the regulator's lag asks for a good deal less than `1/lag`. With one it is that of the force which the
/// table gives at the measured pressure, less what the trim has added: an observer of what the table leaves out. The
/// regulator's lag is not in that loop, which has to wait for nothing but its own filter of `g K_i` rad/s, and the trim does not
/// answer a wave with a wave of its own.
pub fn trim(force_loop: &ForceLoop, integral: &mut Integral, error_n: f32, cut: f32) -> f32 {
    let limit = force_loop.trim_limit_pa;
    if limit <= 0.0 {
        return 0.0;
    }
    integral.step(force_loop.integral_pa_per_n_s * error_n, limit, cut);
    (force_loop.proportional_pa_per_n * error_n + integral.value()).clamp(-limit, limit)
}

/// Wanted force of the stroke loop, N.
pub fn stroke_force(
    stroke_loop: &StrokeLoop,
    integral: &mut Integral,
    wanted_m: f32,
    stroke_m: f32,
    speed_m_per_s: f32,
    cut: f32,
) -> f32 {
    let error = wanted_m - stroke_m;
    integral.step(stroke_loop.integral_n_per_m_s * error, stroke_loop.force_limit_n, cut);
    let force = stroke_loop.load_n
        + stroke_loop.load_stiffness_n_per_m * wanted_m
        + stroke_loop.proportional_n_per_m * error
        + integral.value()
        - stroke_loop.damping_n_s_per_m * speed_m_per_s;
    force.clamp(0.0, stroke_loop.force_limit_n)
}

/// What the pair's loop keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairState {
    integral: Integral,
    /// The common pressure that gives the wanted stiffness, Pa.
    common_pa: f32,
}

/// What the joint is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posed {
    /// Wanted angle, rad.
    pub angle_rad: f32,
    /// Wanted stiffness, N·m/rad.
    pub stiffness_nm_per_rad: f32,
    /// Measured angle, rad.
    pub measured_rad: f32,
    /// Its rate, rad/s.
    pub rate_rad_per_s: f32,
}

impl PairState {
    /// Begins anew at a common pressure.
    pub fn begin(&mut self, common_pa: f32) {
        *self = Self { integral: Integral::default(), common_pa: common_pa.max(0.0) };
    }

    /// Wanted forces of both muscles, N.
    ///
    /// The joint's stiffness at held pressures is `r² Σ −∂F_i/∂x`; one Newton step a tick moves the common pressure to where
    /// it is the wanted one. Around the forces that this pressure gives, a torque is split evenly: `K θ*`, which moves the
    /// equilibrium of that stiffness from zero to the wanted angle, and the angle's loop for what is left.
    pub fn forces(&mut self, joint: &Joint, posed: &Posed, sides: [(&Model, f32); 2], cut: f32) -> [f32; 2] {
        let r = joint.radius_m;
        let probe_pa = 10e3;
        let mut stiffness = [0.0; 2];
        let mut common_n = [0.0; 2];
        for ((model, stroke_m), common) in sides.into_iter().zip(&mut common_n) {
            let h = model.muscle.braid().rest_length() * 1.0e-3;
            let nearer = model.muscle.held(Length::from_metres(stroke_m - h));
            let farther = model.muscle.held(Length::from_metres(stroke_m + h));
            for (n, sum) in stiffness.iter_mut().enumerate() {
                let p = Pressure::from_pascals(self.common_pa + n as f32 * probe_pa);
                let fall = model.muscle.parts(&nearer, p).quasi() - model.muscle.parts(&farther, p).quasi();
                *sum += r * r * fall / (2.0 * h);
            }
            *common = model
                .muscle
                .parts(model.held(), Pressure::from_pascals(self.common_pa))
                .force(model.direction());
        }
        let high = sides[0].0.muscle.max_pressure().min(sides[1].0.muscle.max_pressure()).pascals();
        let slope = (stiffness[1] - stiffness[0]) / probe_pa;
        if slope > 0.0 {
            // At most 1 kPa a tick, so that the forces never jump.
            let step = ((posed.stiffness_nm_per_rad - stiffness[0]) / slope).clamp(-1e3, 1e3);
            self.common_pa = (self.common_pa + step).clamp(0.0, high);
        }
        let error = posed.angle_rad - posed.measured_rad;
        self.integral.step(joint.integral_nm_per_rad_s * error, joint.torque_limit_nm, cut);
        let torque = (posed.stiffness_nm_per_rad * posed.angle_rad
            + joint.proportional_nm_per_rad * error
            + self.integral.value()
            - joint.damping_nm_s_per_rad * posed.rate_rad_per_s)
            .clamp(-joint.torque_limit_nm, joint.torque_limit_nm);
        let share = torque / (2.0 * r);
        [(common_n[0] + share).max(0.0), (common_n[1] - share).max(0.0)]
    }
}
