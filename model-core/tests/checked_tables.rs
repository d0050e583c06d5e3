//! Every table that passes its check can be evaluated and inverted: no number of it makes the model fail.

use model_core::inverse::Attainability;
use model_core::muscle::Muscle;
use model_core::table::{self, MuscleTable};
use model_core::units::{Angle, Force, Length, Pressure};
use proptest::prelude::*;

/// Numbers of any size, and those that a muscle has.
fn number(usual: core::ops::Range<f32>) -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => usual.clone(),
        1 => (-40.0..38.0_f32).prop_map(|exponent| 10.0_f32.powf(exponent)),
        1 => (-40.0..38.0_f32, usual).prop_map(|(exponent, value)| value * 10.0_f32.powf(exponent)),
    ]
}

fn tables() -> impl Strategy<Value = MuscleTable> {
    let curve = |n, usual: core::ops::Range<f32>| proptest::collection::vec(number(usual), n);
    (1_usize..=7, 1_usize..=6).prop_flat_map(move |(n, order)| {
        let geometry =
            (number(0.02..0.3), number(0.1..1.57), number(2e-3..30e-3), number(0.2e-3..2e-3), any::<bool>());
        let tested = (number(-0.05..0.0), number(0.0..0.3));
        let curves = (
            curve(n, 1e3..200e3),
            proptest::collection::vec(curve(n, -3e6..3e6), order),
            curve(n, -0.1..0.3),
        );
        (geometry, tested, curves, number(1e5..1e6), number(-5e4..1e5)).prop_map(
            |(
                (length, angle, diameter, wall, tip),
                (low, high),
                (gaps, elastic, friction),
                most,
                deadband,
            )| {
                let mut t = table::example();
                t.geometry.rest_length = Length::from_metres(length);
                t.geometry.braid_angle = Angle::from_radians(angle);
                t.geometry.outer_diameter = Length::from_metres(diameter);
                t.geometry.wall = Length::from_metres(wall);
                t.geometry.tip_correction = tip;
                (t.tested.contraction_low, t.tested.contraction_high) = (low, high);
                t.nodes = gaps
                    .iter()
                    .scan(0.0, |sum, gap| {
                        *sum += gap;
                        Some(*sum)
                    })
                    .collect();
                t.elastic = elastic.into_iter().map(|curve| curve.into_iter().collect()).collect();
                t.friction = friction.into_iter().collect();
                t.max_pressure = Pressure::from_pascals(most);
                t.deadband = Pressure::from_pascals(deadband);
                t
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4_000, max_global_rejects: 1_000_000, ..ProptestConfig::default() })]

    #[test]
    fn every_table_that_passes_its_check_gives_forces_that_are_numbers(
        table in tables().prop_filter("a usable table", |table| table.check().is_ok()),
        part in 0.0..=1.0_f32, pressure in 0.0..=1.0_f32, wanted in -1e4..1e4_f32, s in -1..=1_i32,
    ) {
        let muscle = Muscle::<f32>::build(&table).expect("it passes its check");
        let (low, high) = (table.tested.contraction_low, table.tested.contraction_high);
        for part in [0.0, part, 1.0] {
            let stroke = Length::from_metres((low + part * (high - low)) * table.geometry.rest_length.si());
            for pressure in [0.0, pressure, 1.0] {
                let pressure = Pressure::from_pascals(pressure * table.max_pressure.pascals());
                let force = muscle.force(pressure, stroke, s as f32);
                prop_assert!(force.is_finite(), "{force:?} at {pressure:?}, {stroke:?}");
            }
            let held = muscle.at_stroke(stroke);
            let found = muscle.pressure_for(Force::from_newtons(wanted), &held, s as f32, Pressure::ZERO, &muscle.search());
            prop_assert!(found.attainability != Attainability::NotANumber, "{found:?} at {stroke:?}");
            prop_assert!(found.pressure >= Pressure::ZERO && found.pressure <= muscle.max_pressure(), "{found:?}");
        }
    }
}
