//! What a table makes of readings and demands, against double precision and the braid's geometry.

use model_core::effects::{EffectName, FittedEffect};
use model_core::motion::Motion;
use model_core::muscle::Muscle;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};

use super::*;

mod demand;
mod exchange;
mod friction;

/// The example's braid: rest length and length of a fibre, m, and its turns.
fn braid() -> (f64, f64, f64) {
    let (rest_length, angle, radius) = (39.16e-3, 77.4_f64.to_radians(), 1.5e-3);
    let fibre = rest_length / angle.sin();
    (rest_length, fibre, fibre * angle.cos() / (core::f64::consts::TAU * radius))
}

/// `(3L² − B²)/(4πN²)`, m².
fn area(stroke_m: f64) -> f64 {
    let (rest_length, fibre, turns) = braid();
    (3.0 * (rest_length - stroke_m).powi(2) - fibre * fibre) / (4.0 * core::f64::consts::PI * turns * turns)
}

fn built(table: &MuscleTable) -> Model {
    Model::build(table).expect("a table")
}

/// The example with one effect.
fn with(effect: EffectName, parameters: &[f64]) -> MuscleTable {
    MuscleTable { effects: [FittedEffect::new(effect, parameters)].into_iter().collect(), ..table::example() }
}

fn at(stroke_m: f32) -> Motion<f32> {
    Motion { stroke: stroke_m, dt: TICK_S, ..Motion::default() }
}

/// Force of the example in double precision, N.
fn force(pressure_pa: f64, stroke_m: f64, direction: f64) -> f64 {
    let muscle = Muscle::<f64>::build(&table::example()).expect("a table");
    let (pressure, stroke) = (Pressure::from_pascals(pressure_pa), Length::from_metres(stroke_m));
    muscle.force(pressure, stroke, direction).newtons()
}

/// A muscle that has shortened to a stroke until all of its friction points one way.
fn shortened(table: &MuscleTable, stroke_m: f32, pressure_pa: f32) -> Model {
    let mut model = built(table);
    for part in [0.5, 1.0] {
        model.tick(&at(part * stroke_m), pressure_pa);
    }
    assert_eq!(model.direction(), 1.0);
    model
}
