//! Each effect against what its law says in a case that can be worked out by hand.

mod air_and_shape;
mod friction;
mod relaxation;
mod wear;

use model_core::effects::{Context, EffectName, MEMORY, Memory};

/// An effect by name with parameters, and its memory.
struct Alone {
    effect: EffectName,
    parameters: Vec<f64>,
    memory: Memory<f64>,
}

impl Alone {
    fn new(name: &str, parameters: &[f64]) -> Self {
        let effect = EffectName::from_name(name).expect("in the catalogue");
        assert_eq!(parameters.len(), effect.info().parameters.len(), "{name}");
        Self { effect, parameters: parameters.to_vec(), memory: [0.0; MEMORY] }
    }
    fn at(&mut self, context: Context<f64>) -> f64 {
        self.effect.step(&self.parameters, &context, &mut self.memory);
        self.effect.force(&self.parameters, &context, &self.memory)
    }
}

fn context() -> Context<f64> {
    Context {
        // It pulls: the elastic force is smaller than Gaylord's.
        gaylord: 500.0,
        rest_length: 0.1,
        length: 0.1,
        radius: 5e-3,
        stiffness: -1e4,
        pressure_slope: 1e-4,
        area: 1e-4,
        ..Context::default()
    }
}

/// A muscle whose gas pulls with `gas` and whose bladder takes `bladder` (negative) from it, N.
fn loaded(gas: f64, bladder: f64) -> Context<f64> {
    let area = context().area;
    Context { pressure: gas / area, area, gaylord: gas, elastic: bladder, quasi: gas + bladder, ..context() }
}

/// The same, well filled.
fn held(bladder: f64) -> Context<f64> {
    loaded(500.0, bladder)
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} and {b}");
}
