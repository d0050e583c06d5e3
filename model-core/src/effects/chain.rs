//! The effects of one muscle at work.

use super::{Context, EffectName, FittedEffect, MAX_EFFECTS, MAX_PARAMETERS, MEMORY, Memory};
use crate::scalar::Scalar;

/// The effects of one muscle at work, with their memories.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain<T> {
    effects: heapless::Vec<Running<T>, MAX_EFFECTS>,
    depends_on_pressure: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Running<T> {
    effect: EffectName,
    /// Those beyond the effect's own are zero: an effect with n parameters reads the first n only.
    parameters: [T; MAX_PARAMETERS],
    memory: Memory<T>,
}

/// Functions that are not inlined into the loop over effects. A compiler moves expressions that do not change out of a loop: here the
/// arithmetic of all effects on their common context. A table with one effect would then cost as much as one with all.
impl<T: Scalar> Running<T> {
    #[inline(never)]
    fn step(&mut self, context: &Context<T>) {
        self.effect.step(&self.parameters, context, &mut self.memory);
    }

    #[inline(never)]
    fn force(&self, context: &Context<T>) -> T {
        self.effect.force(&self.parameters, context, &self.memory)
    }
}

impl<T: Scalar> Chain<T> {
    /// The effects of a table on a muscle as new and at rest: for running through recordings from their beginning.
    pub fn new(fitted: &[FittedEffect]) -> Self {
        let mut chain = Self::none();
        chain.begin(fitted);
        chain
    }

    /// No effect.
    pub const fn none() -> Self {
        Self { effects: heapless::Vec::new(), depends_on_pressure: false }
    }

    fn begin(&mut self, fitted: &[FittedEffect]) {
        self.effects.clear();
        for one in fitted.iter().take(MAX_EFFECTS) {
            let mut parameters = [T::ZERO; MAX_PARAMETERS];
            for (to, from) in parameters.iter_mut().zip(&one.parameters) {
                *to = T::from_f32(*from);
            }
            // The iterator is no longer than the vector.
            let _ = self.effects.push(Running { effect: one.effect, parameters, memory: [T::ZERO; MEMORY] });
        }
        self.depends_on_pressure = fitted.iter().any(|e| e.effect.depends_on_pressure());
    }

    /// The effects of a table on the muscle as its recordings left it: for a controller.
    pub fn resumed(fitted: &[FittedEffect]) -> Self {
        let mut chain = Self::none();
        chain.resume(fitted);
        chain
    }

    /// The same in a place that is there already.
    pub fn resume(&mut self, fitted: &[FittedEffect]) {
        self.begin(fitted);
        for (running, one) in self.effects.iter_mut().zip(fitted) {
            for (to, from) in running.memory.iter_mut().zip(&one.remembered) {
                *to = T::from_f32(*from);
            }
        }
    }

    /// Whether the table carries no effect.
    pub fn is_empty(&self) -> bool {
        self.effects.is_empty()
    }

    /// Whether any effect's force changes with the present pressure.
    pub fn depends_on_pressure(&self) -> bool {
        self.depends_on_pressure
    }

    /// Lets time pass in every memory.
    pub fn step(&mut self, context: &Context<T>) {
        for e in &mut self.effects {
            e.step(context);
        }
    }

    /// The same with a context of its own for each effect; where there is none, no time passes.
    pub fn step_each(&mut self, context: impl Fn(EffectName) -> Option<Context<T>>) {
        for e in &mut self.effects {
            if let Some(context) = context(e.effect) {
                e.step(&context);
            }
        }
    }

    /// The force that all effects together add, N.
    pub fn force(&self, context: &Context<T>) -> T {
        let mut sum = T::ZERO;
        for e in &self.effects {
            sum += e.force(context);
        }
        sum
    }

    /// All memories, by position in the table. Those of effects with [`Info::persistent`](super::Info::persistent) must survive a power cycle.
    pub fn memories(&self) -> impl Iterator<Item = (EffectName, &Memory<T>)> {
        self.effects.iter().map(|e| (e.effect, &e.memory))
    }

    /// Puts a memory back; a position that the table does not have is ignored.
    pub fn restore(&mut self, position: usize, memory: &Memory<T>) {
        if let Some(e) = self.effects.get_mut(position) {
            e.memory = *memory;
        }
    }
}
