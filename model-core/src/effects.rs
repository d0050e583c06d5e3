//! Physics that the quasi-static model leaves out, one file per effect.
//!
//! Every effect adds a force to that of the base model, and that force is **linear in the effect's amplitudes**:
//!
//! ```text
//! F = F_base(P, L, s) + Σ_effects Σ_i amplitude_i · term_i(context, shape, memory)
//! ```
//!
//! Effects that act earlier in the chain (a shift of length, a lag of pressure, a softer bladder) enter by their first-order
//! change of the force, with the sensitivities that the [`Context`] carries. So one source serves three uses: the host
//! evaluates the terms as regressors to find out which effect a recording shows, the controller adds them to its
//! feed-forward, and `predict` runs them over a recording.
//!
//! A controller's tick, with a table that carries one effect:
//!
//! ```
//! use model_core::effects::{Chain, EffectName, FittedEffect};
//! use model_core::motion::{MotionSettings, MotionTracker};
//! use model_core::muscle::Muscle;
//! use model_core::units::{Force, Length, Pressure};
//!
//! let mut table = model_core::table::example();
//! let relaxing = FittedEffect::new(EffectName::StressRelaxation, &[0.2, 0.0, 0.0, 10.0]);
//! table.effects.push(relaxing).expect("room for four");
//! let muscle = Muscle::<f32>::build(&table).expect("a valid table");
//! let mut chain = Chain::resumed(&table.effects);
//! let mut tracker = MotionTracker::new(MotionSettings::default());
//! let mut point = muscle.operating_point();
//! let mut command = Pressure::from_kilopascals(300.0);
//! let demanded = Force::from_newtons(30.0);
//! for tick in 0..=1000 {
//!     let stroke = 1.0e-6 * tick as f32; // 1 mm in a second
//!     let motion = tracker.step(1.0e-3, stroke, command.pascals());
//!     muscle.update(&mut point, motion, command);
//!     chain.step(&point.context);
//!     command = muscle.pressure_with(demanded, &chain, &point, command, &muscle.search()).pressure;
//! }
//! // A tenth of the time constant has gone by: most of the over-stress is still there, and costs pressure.
//! let at_stroke = muscle.at_stroke(Length::from_metres(1.0e-3_f32));
//! let settled = muscle.pressure_for(demanded, &at_stroke, 1.0, command, &muscle.search());
//! let more = command.pascals() - settled.pressure.pascals();
//! assert!(more > 1.0e3 && more < 30.0e3, "{more} Pa");
//! ```
//!
//! Adding an effect: write its file, and add it to the list below. The file holds the equations, what they mean ([`Info`]) and what a
//! diagnosis has to know ([`Traits`]), with how a change of the effect shows between two campaigns ([`Changed`]).

use crate::fields::{Fields, Walk, fields};
use crate::scalar::Scalar;
use serde::{Deserialize, Serialize};

mod chain;
mod change;
mod context;
mod fading;
mod list;
mod traits;
mod travel;
mod work;

mod bladder_creep;
mod braid_elasticity;
mod breakaway_friction;
mod contact_loss;
mod coulomb_friction;
mod cyclic_softening;
mod end_slip;
mod friction_asymmetry;
mod higher_order_elasticity;
mod leak;
mod log_creep;
mod minor_loop_memory;
mod mullins_softening;
mod permanent_set;
mod presliding_hysteresis;
mod pressure_friction;
mod pressure_lag;
mod rate_power;
mod seal_friction;
mod strand_jamming;
mod stress_relaxation;
mod stribeck_friction;
mod thermal_softening;
mod tip_effect;
mod viscous_damping;

pub use chain::Chain;
pub use change::{Changed, Class, Course, ForceShape, FurtherLaw, Inspect, Owner};
pub use context::Context;
pub use fading::{Fading, decay};
pub use traits::{BenchCheck, Experiment, Imitates, Traits, Vented};
pub use travel::{BraidTravel, stroke_direction};

crate::effect_list! {
    /// An effect of the muscle, by name. On the wire and in files it is its place in this list: the order stays, and new
    /// ones go to the end.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
    EffectName:
    /// Friction of constant size.
    CoulombFriction = coulomb_friction;
    /// Friction proportional to speed.
    ViscousDamping = viscous_damping;
    /// Part of the bladder's stress relaxes exponentially.
    StressRelaxation = stress_relaxation;
    /// The pressure at the muscle lags that at the sensor.
    PressureLag = pressure_lag;
    /// Air lost on the way costs pressure.
    Leak = leak;
    /// The ends are not cylinders.
    TipEffect = tip_effect;
    /// The braid's fibres stretch.
    BraidElasticity = braid_elasticity;
    /// The bladder does not touch the braid yet.
    ContactLoss = contact_loss;
    /// The braid's strands lock.
    StrandJamming = strand_jamming;
    /// An end slipped in its clamp.
    EndSlip = end_slip;
    /// The muscle stays a little longer with every cycle.
    PermanentSet = permanent_set;
    /// The bladder's elastic law has more terms than the table.
    HigherOrderElasticity = higher_order_elasticity;
    /// The first stretch breaks bonds in the rubber.
    MullinsSoftening = mullins_softening;
    /// The bladder softens with the number of cycles.
    CyclicSoftening = cyclic_softening;
    /// The bladder softens as it warms.
    ThermalSoftening = thermal_softening;
    /// Force creeps with the logarithm of time.
    LogCreep = log_creep;
    /// Friction proportional to pressure.
    PressureFriction = pressure_friction;
    /// Friction differs between shortening and lengthening.
    FrictionAsymmetry = friction_asymmetry;
    /// A rod's seal rubs.
    SealFriction = seal_friction;
    /// Friction is higher just after a rest.
    BreakawayFriction = breakaway_friction;
    /// Friction falls with speed.
    StribeckFriction = stribeck_friction;
    /// Friction builds up over a distance after a reversal.
    PreslidingHysteresis = presliding_hysteresis;
    /// Small loops remember at the reversal.
    MinorLoopMemory = minor_loop_memory;
    /// Friction proportional to a power of speed.
    RatePower = rate_power;
    /// The bladder's stress and its contact creep over decades.
    BladderCreep = bladder_creep;
}

/// Where in the chain from the air to the reading an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Link {
    /// The pressure at the muscle.
    Air,
    /// The braid and the muscle's shape.
    Braid,
    /// The bladder's elastic stress.
    Bladder,
    /// The bladder's memory of the past.
    Memory,
    /// Friction: the force that depends on the direction or speed of motion.
    Friction,
    /// Masses and springs between the muscle and the load cell.
    LoadPath,
    /// The sensors.
    Reading,
}

/// Whether a parameter scales the force or shapes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The effect's force is proportional to it.
    Amplitude,
    /// The force depends on it in another way (a time constant, a length).
    Shape,
}

/// The axis of the recordings on which a shape parameter lives, so that they limit its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// None: its range is its own.
    Own,
    /// The campaign's time: it is a change point.
    Time,
    /// The contractions that were reached.
    Contraction,
    /// The length of the travel.
    Travel,
}

/// One parameter of an effect, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// What the effect's equation calls it.
    pub symbol: &'static str,
    /// Its name, as in the effect's documentation.
    pub name: &'static str,
    /// Its SI unit, or an empty string.
    pub unit: &'static str,
    /// The smallest plausible value, in SI units.
    pub low: f64,
    /// The largest plausible value, in SI units.
    pub high: f64,
    /// What it does to the force.
    pub role: Role,
    /// The axis of the recordings that it lives on.
    pub axis: Axis,
    /// Whether no muscle and no bench exceeds the range, as of the lags; other sizes depend on muscle and bench.
    pub bounded: bool,
}

impl Parameter {
    /// The largest size in its range, without the sign.
    #[must_use]
    pub const fn largest(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// A parameter that the force is proportional to.
    pub const fn amplitude(
        symbol: &'static str,
        name: &'static str,
        unit: &'static str,
        low: f64,
        high: f64,
    ) -> Self {
        Self { symbol, name, unit, low, high, role: Role::Amplitude, axis: Axis::Own, bounded: false }
    }
    /// A parameter that shapes the force.
    pub const fn shape(
        symbol: &'static str,
        name: &'static str,
        unit: &'static str,
        low: f64,
        high: f64,
    ) -> Self {
        Self { symbol, name, unit, low, high, role: Role::Shape, axis: Axis::Own, bounded: false }
    }
    /// The same with a range that no muscle and no bench exceeds.
    #[must_use]
    pub const fn bounded(mut self) -> Self {
        self.bounded = true;
        self
    }
    /// The same on an axis of the recordings.
    #[must_use]
    pub const fn along(self, axis: Axis) -> Self {
        Self { axis, ..self }
    }
}

/// What is known of an effect's memory when a recording begins. All zeros is the memory handed in first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Nothing is remembered, or what is remembered begins known.
    Known,
    /// Zeros mean that the muscle has long been at rest in the state of the first reading. If it had not, an over-stress was
    /// left, which fades without a request: the slots of [`Info::fading`] hold it, and its trace is linear in them.
    Settled,
    /// Zeros are an estimate in the middle; the memory finds itself once the muscle has travelled far enough one way.
    Branch,
    /// Zeros mean a new specimen. One that has been worked before begins with a memory no one recorded.
    Virgin,
}

/// What an effect is, for people and programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Info {
    /// The name in the catalogue, for example `viscous-damping`.
    pub name: &'static str,
    /// Where it acts.
    pub link: Link,
    /// Its parameters, in the order in which they are stored; amplitudes first.
    pub parameters: &'static [Parameter],
    /// Whether its force depends on the present pressure (then the inverse has to iterate).
    pub depends_on_pressure: bool,
    /// Whether its memory has to survive a power cycle.
    pub persistent: bool,
    /// Whether each amplitude is a law of its own (another drive, another scaling), so that they may be tried singly;
    /// otherwise they are parts of one law.
    pub alternatives: bool,
    /// What is known of its memory when a recording begins.
    pub start: Start,
    /// The slots of its memory whose unknown beginning fades. The memory is linear in them: starting one at 1 instead of 0
    /// adds a trace that can be fitted as one more column. Slots that would give the same trace are named once. Empty unless
    /// [`Info::start`] is [`Start::Settled`].
    pub fading: &'static [usize],
    /// The force it adds, as an equation in the symbols of [`Context`].
    pub equation: &'static str,
    /// One sentence for a reader who does not know the effect.
    pub summary: &'static str,
    /// Where the equation and the plausible ranges come from.
    pub source: &'static str,
}

impl Info {
    /// How many of the parameters are amplitudes (they come first).
    pub fn amplitudes(&self) -> usize {
        self.parameters.iter().take_while(|p| p.role == Role::Amplitude).count()
    }
}

/// How many numbers an effect may remember.
pub const MEMORY: usize = 29;
/// How many parameters an effect may have.
pub const MAX_PARAMETERS: usize = 6;
/// How many numbers of a persistent memory a table may carry.
pub const REMEMBERED: usize = 10;
/// How many effects a table may carry.
pub const MAX_EFFECTS: usize = 4;

/// An effect's memory; all zeros at the beginning of its life.
pub type Memory<T> = [T; MEMORY];

/// One effect's equations.
pub trait Effect {
    /// What it is.
    const INFO: Info;
    /// What a diagnosis has to know of it.
    const TRAITS: Traits;
    /// Lets time pass: `memory` goes from the last tick to this one.
    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let _ = (parameters, context, memory);
    }
    /// The force it adds, N. Linear in the amplitudes.
    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T;
}

/// An effect with its parameters, as a table carries it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedEffect {
    /// Which one.
    pub effect: EffectName,
    /// Its parameters in SI units, in the order of [`Info::parameters`].
    pub parameters: heapless::Vec<f32, MAX_PARAMETERS>,
    /// What its memory held when the recordings behind the table ended, where that must outlive a power cycle
    /// ([`Info::persistent`]): a controller takes over a muscle that has been worked, not a new one. Further slots are zero.
    pub remembered: heapless::Vec<f32, REMEMBERED>,
}

fields!(FittedEffect { effect, parameters, remembered });

impl Default for FittedEffect {
    /// The first of the list, with nothing known of it.
    fn default() -> Self {
        Self {
            effect: EffectName::CoulombFriction,
            parameters: heapless::Vec::new(),
            remembered: heapless::Vec::new(),
        }
    }
}

impl Fields for EffectName {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        if let Some(found) = Self::ALL.get(usize::from(walk.variant(*self as u8, Self::ALL.len() as u8))) {
            *self = *found;
        }
    }
}

impl FittedEffect {
    /// An effect on a muscle that is as new. Parameters beyond [`MAX_PARAMETERS`] are dropped; a wrong number of them is found by
    /// [`crate::table::MuscleTable::check`].
    pub fn new(effect: EffectName, parameters: &[f64]) -> Self {
        let parameters = parameters.iter().take(MAX_PARAMETERS).map(|p| *p as f32).collect();
        Self { effect, parameters, remembered: heapless::Vec::new() }
    }

    /// The same on a muscle that the recordings left with this memory.
    #[must_use]
    pub fn left_with(mut self, memory: &Memory<f64>) -> Self {
        self.remembered.clear();
        if self.effect.is_persistent() {
            let used = memory.iter().rposition(|m| *m != 0.0).map_or(0, |last| last + 1);
            self.remembered.extend(memory[..used.min(REMEMBERED)].iter().map(|m| *m as f32));
        }
        self
    }
}
