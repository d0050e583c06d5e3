//! One kind of value for every effect that a diagnosis may weigh, of the muscle or of the bench.

use model_core::effects::{Axis, Context, EffectName, Info, MEMORY, Memory, Parameter, Traits, Vented};
use serde::{Deserialize, Serialize};

use super::BenchName;

/// An effect of the catalogue, of the muscle or of the bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Candidate {
    /// Physics of the muscle: goes into the table and to the controller.
    Muscle(EffectName),
    /// An error of the bench: corrects the data and stays on the host.
    Bench(BenchName),
}

/// What the recordings can show of shapes that live on their own axes: a slip within their time, a wall within their
/// contractions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// First and last moment on the campaign's clock, s.
    pub time: (f64, f64),
    /// Least and greatest contraction.
    pub contraction: (f64, f64),
    /// Least and greatest stroke, m.
    pub stroke: (f64, f64),
}

/// Plays narrower than this share of the travel are not a memory of loops: they are a dry friction under another name.
const NARROWEST_PLAY: f64 = 0.02;

impl Span {
    /// The span of some moments; `None` where there is none.
    #[must_use]
    pub fn of(contexts: &[Context<f64>]) -> Option<Self> {
        let first = contexts.first()?;
        let range = |of: fn(&Context<f64>) -> f64| {
            let values = contexts.iter().map(of);
            values.fold((of(first), of(first)), |(low, high), v| (low.min(v), high.max(v)))
        };
        Some(Self {
            time: range(|c| c.time),
            contraction: range(|c| c.contraction),
            stroke: range(|c| c.stroke),
        })
    }

    /// The range of a shape parameter: the plausible one, within what the recordings can show of it.
    #[must_use]
    pub fn range(&self, shape: &Parameter) -> (f64, f64) {
        match shape.axis {
            Axis::Time => self.time,
            Axis::Contraction => (self.contraction.0.max(0.0), self.contraction.1),
            Axis::Travel => {
                let least = NARROWEST_PLAY * (self.stroke.1 - self.stroke.0);
                (shape.low.max(least), shape.high.max(2.0 * least))
            }
            Axis::Own => (shape.low, shape.high),
        }
    }
}

/// Whether the force of an amplitude is read while the muscle is vented and slack.
#[must_use]
pub fn read_when_vented(traits: &Traits, amplitude: usize) -> bool {
    match traits.vented {
        Vented::Everything | Vented::Constant => true,
        Vented::FirstLaw => amplitude == 0,
        Vented::Nothing => false,
    }
}

/// [`Candidate::columns`] of any equations, given by their steps in time and their force.
pub fn columns_of<'a>(
    info: &Info,
    (step, force): (
        impl Fn(&[f64], &Context<f64>, &mut Memory<f64>),
        impl Fn(&[f64], &Context<f64>, &Memory<f64>) -> f64,
    ),
    contexts: impl IntoIterator<Item = &'a Context<f64>>,
    shape: &[f64],
    memory: &mut Memory<f64>,
) -> Vec<Vec<f64>> {
    let amplitudes = info.amplitudes();
    let mut parameters = vec![0.0; info.parameters.len()];
    for (to, from) in parameters[amplitudes..].iter_mut().zip(shape) {
        *to = *from;
    }
    let contexts = contexts.into_iter();
    let mut columns = vec![Vec::with_capacity(contexts.size_hint().0); amplitudes];
    for context in contexts {
        step(&parameters, context, memory);
        for (i, column) in columns.iter_mut().enumerate() {
            parameters[i] = 1.0;
            column.push(force(&parameters, context, memory));
            parameters[i] = 0.0;
        }
    }
    columns
}

impl Candidate {
    /// Every effect, the muscle's first.
    pub fn all() -> impl Iterator<Item = Self> {
        let muscle = EffectName::ALL.iter().copied().map(Self::Muscle);
        muscle.chain(BenchName::ALL.iter().copied().map(Self::Bench))
    }

    /// The effect of this catalogue name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        EffectName::from_name(name).map(Self::Muscle).or_else(|| BenchName::from_name(name).map(Self::Bench))
    }

    /// What it is.
    #[must_use]
    pub const fn info(self) -> &'static Info {
        match self {
            Self::Muscle(e) => e.info(),
            Self::Bench(e) => e.info(),
        }
    }

    /// What a diagnosis has to know of it.
    #[must_use]
    pub const fn traits(self) -> &'static Traits {
        match self {
            Self::Muscle(e) => e.traits(),
            Self::Bench(e) => e.traits(),
        }
    }

    /// Its name in the catalogue.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.info().name
    }

    /// Whether it is an error of the bench.
    #[must_use]
    pub const fn is_bench(self) -> bool {
        matches!(self, Self::Bench(_))
    }

    /// Whether the force of an amplitude is read even when the muscle is vented and slack. A guide or a rod's seal that stuck holds
    /// what it held; strands that no pressure holds together do not rub.
    #[must_use]
    pub fn acts_on_a_slack_muscle(self, amplitude: usize) -> bool {
        read_when_vented(self.traits(), amplitude)
    }

    /// Lets time pass in its memory.
    pub fn step(self, parameters: &[f64], context: &Context<f64>, memory: &mut Memory<f64>) {
        match self {
            Self::Muscle(e) => e.step(parameters, context, memory),
            Self::Bench(e) => e.step(parameters, context, memory),
        }
    }

    /// The force it adds, N.
    #[must_use]
    pub fn force(self, parameters: &[f64], context: &Context<f64>, memory: &Memory<f64>) -> f64 {
        match self {
            Self::Muscle(e) => e.force(parameters, context, memory),
            Self::Bench(e) => e.force(parameters, context, memory),
        }
    }

    /// The parameters that scale its force.
    #[must_use]
    pub fn amplitudes(self) -> &'static [Parameter] {
        &self.info().parameters[..self.info().amplitudes()]
    }

    /// The parameters that shape its force.
    #[must_use]
    pub fn shapes(self) -> &'static [Parameter] {
        &self.info().parameters[self.info().amplitudes()..]
    }

    /// The force that each amplitude adds per unit, at every moment: one column per amplitude, N per its unit.
    ///
    /// `contexts` are all moments of a campaign in order, with the pause as `dt` where a recording begins; `shape` the values
    /// of [`Candidate::shapes`]; `memory` the state at the beginning, zeros where nothing is known, and the state at the end
    /// afterwards. The memory is stepped once for all columns, as it does not depend on the amplitudes.
    ///
    /// A shape with too few values reads as zeros there.
    pub fn columns<'a>(
        self,
        contexts: impl IntoIterator<Item = &'a Context<f64>>,
        shape: &[f64],
        memory: &mut Memory<f64>,
    ) -> Vec<Vec<f64>> {
        let step = |parameters: &[f64], context: &Context<f64>, memory: &mut Memory<f64>| {
            self.step(parameters, context, memory);
        };
        let force = |parameters: &[f64], context: &Context<f64>, memory: &Memory<f64>| {
            self.force(parameters, context, memory)
        };
        columns_of(self.info(), (step, force), contexts, shape, memory)
    }

    /// The traces that an unknown beginning leaves, one column for each slot of [`Info::fading`]: what the force would be
    /// more if that slot of the memory began at one instead of zero, with every amplitude at one.
    #[must_use]
    pub fn fading_columns(self, contexts: &[Context<f64>], shape: &[f64]) -> Vec<Vec<f64>> {
        let total = |memory: &mut Memory<f64>| {
            let columns = self.columns(contexts, shape, memory);
            (0..contexts.len()).map(|row| columns.iter().map(|c| c[row]).sum()).collect::<Vec<f64>>()
        };
        if self.info().fading.is_empty() {
            return Vec::new();
        }
        let plain = total(&mut [0.0; MEMORY]);
        let slots = self.info().fading.iter();
        slots
            .map(|slot| {
                let mut memory = [0.0; MEMORY];
                memory[*slot] = 1.0;
                total(&mut memory).iter().zip(&plain).map(|(a, b)| a - b).collect()
            })
            .collect()
    }

    /// The force at every moment, N, for given parameters; `memory` as in [`Candidate::columns`].
    pub fn trace(self, contexts: &[Context<f64>], parameters: &[f64], memory: &mut Memory<f64>) -> Vec<f64> {
        contexts
            .iter()
            .map(|context| {
                self.step(parameters, context, memory);
                self.force(parameters, context, memory)
            })
            .collect()
    }

    /// Shapes to try: every combination of `count` values of each shape parameter over its plausible range, spaced evenly
    /// or, where the range spans more than a decade, by equal ratios. One empty shape where there is none.
    ///
    /// Shapes on the recordings' own axes are kept within what they show.
    #[must_use]
    pub fn grid(self, count: usize, span: &Span) -> Vec<Vec<f64>> {
        let mut shapes = vec![Vec::new()];
        for parameter in self.shapes() {
            let (low, high) = span.range(parameter);
            let values = spaced(low, high, count);
            shapes = shapes
                .iter()
                .flat_map(|s| values.iter().map(move |v| s.iter().copied().chain([*v]).collect::<Vec<f64>>()))
                .collect();
        }
        shapes
    }
}

/// `count` values between two bounds: the middles of as many cells, so that neither end of a plausible range is wasted.
fn spaced(low: f64, high: f64, count: usize) -> Vec<f64> {
    let ratio = low > 0.0 && high > 10.0 * low;
    (0..count.max(1))
        .map(|i| {
            let share = (i as f64 + 0.5) / count.max(1) as f64;
            if ratio { low * (high / low).powf(share) } else { low + (high - low) * share }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_cover_each_range_by_equal_ratios_or_evenly() {
        let span = Span { time: (0.0, 100.0), contraction: (-0.01, 0.2), stroke: (-1e-3, 20e-3) };
        let relaxation = Candidate::from_name("stress-relaxation").expect("in the catalogue");
        let grid = relaxation.grid(4, &span);
        assert_eq!(grid.len(), 4);
        let ratio = grid[1][0] / grid[0][0];
        assert!((grid[3][0] / grid[2][0] - ratio).abs() < 1e-9 * ratio);
        let slip = Candidate::from_name("end-slip").expect("in the catalogue");
        assert_eq!(slip.grid(2, &span), vec![vec![25.0], vec![75.0]]);
        let seal = Candidate::from_name("seal-friction").expect("in the catalogue");
        assert_eq!(seal.grid(3, &span).len(), 9);
        let offset = Candidate::from_name("force-offset").expect("in the catalogue");
        assert_eq!(offset.grid(3, &span), vec![Vec::<f64>::new()]);
    }
}
