//! What work, heat and load leave in the muscle.

use model_core::effects::Context;

use super::{Alone, close, context, held, loaded};

/// A stretch of the bladder: radial strain up, axial down, an elastic force that resists.
fn stretched(strain: f64) -> Context<f64> {
    Context { radial_strain: strain, axial_strain: -0.1 * strain, ..held(-100.0 * strain) }
}

#[test]
fn the_first_stroke_is_stiff_and_later_ones_soft_up_to_the_same_strain() {
    let mut alone = Alone::new("mullins-softening", &[0.3, 0.1, 0.1]);
    for i in 0..=100 {
        close(alone.at(stretched(0.01 * f64::from(i))), 0.0, 1e-12);
    }
    // On the way back and again: less resistance, so the muscle pulls more, by at most the largest loss.
    let back = alone.at(stretched(0.5));
    assert!(back > 0.5 * 0.3 * 50.0 && back <= 0.3 * 50.0, "{back} N");
    // Lower strains soften no further, and the old maximum has no softening at all.
    close(alone.at(stretched(0.2)), alone.at(stretched(0.2)), 1e-12);
    close(alone.at(stretched(0.5)), back, 1e-12);
    close(alone.at(stretched(1.0)), 0.0, 1e-9);
    // A day's rest heals nothing; new strain moves the maximum.
    alone.at(Context { dt: 86_400.0, ..stretched(0.0) });
    close(alone.at(stretched(0.5)), back, 1e-12);
    close(alone.at(stretched(1.2)), 0.0, 1e-12);
    assert!(alone.at(stretched(1.0)) > 1.0);
}

#[test]
fn work_warms_and_rest_cools() {
    let mut thermal = Alone::new("thermal-softening", &[1.0, 0.0, 0.0, 0.0, 600.0]);
    let mut time = 0.0;
    // 100 N over 10 mm back and forth at 10 mm/s: 1 W.
    for i in 0..20_000_i32 {
        let phase = (i % 200) as f64 / 100.0;
        let (stroke, direction) = if phase <= 1.0 { (phase, 1.0) } else { (2.0 - phase, -1.0) };
        thermal.at(Context { dt: 1e-2, stroke: 10e-3 * stroke, direction, ..loaded(120.0, -20.0) });
        time += 1e-2;
    }
    let rest = loaded(120.0, -20.0);
    let warm = thermal.at(rest);
    close(warm, 20.0 * (1.0 - (-time / 600.0_f64).exp()), 0.2);
    close(thermal.at(Context { dt: 600.0, ..rest }), warm * (-1.0_f64).exp(), 2e-2);
}

#[test]
fn the_bladder_wears_with_the_path_of_its_strands_and_does_not_recover() {
    let whole = |order: f64, relative: f64| match order {
        1.0 => 1.0 - (-relative).exp(),
        _ => 1.0 - (1.0 + (order - 1.0) * relative).powf(-1.0 / (order - 1.0)),
    };
    for order in [1.0, 2.0, 3.0, 8.0] {
        let mut alone = Alone::new("cyclic-softening", &[0.1, 20.0, order]);
        for i in 0..=20_000_i32 {
            let phase = (i % 200) as f64 / 100.0;
            let (stroke, direction) = if phase <= 1.0 { (phase, 1.0) } else { (2.0 - phase, -1.0) };
            let direction = if i % 200 == 0 { -1.0 } else { direction };
            alone.at(Context { stroke: 10e-3 * stroke, direction, ..held(-100.0) });
        }
        let worn = alone.at(held(-100.0));
        // 100 cycles of 10 mm each way on 0.1 m are 20 rest lengths. The path is taken up by thousandths, and an order of one is a
        // power of a hundred.
        close(worn, 0.1 * 100.0 * whole(order, 1.0), 0.003 * 10.0);
        // Rest heals nothing, and a stroke that only trembles wears nothing.
        for i in 0..1000 {
            let stroke = if i % 2 == 0 { 1e-4 } else { 0.0 };
            alone.at(Context { dt: 1.0, stroke, direction: 1.0, ..held(-100.0) });
        }
        close(alone.at(held(-100.0)), worn, 0.01);
    }
}

#[test]
fn a_thermometer_is_believed() {
    let mut alone = Alone::new("thermal-softening", &[0.0, 0.0, -0.0034, 0.02, 600.0]);
    let c = Context { temperature: 295.0, friction: 0.1, direction: 1.0, ..loaded(120.0, -20.0) };
    assert_eq!(alone.at(c), 0.0);
    // 10 K: rubber 3.4 % stiffer, and a tenth of that rubbed away; friction 20 % less.
    close(alone.at(Context { temperature: 305.0, ..c }), -0.68 * 0.9 + 2.0, 1e-9);
}

#[test]
fn set_grows_with_the_path_and_a_power_up_does_not_undo_it() {
    let mut alone = Alone::new("permanent-set", &[1e-3, 0.0, 0.5, 1e4]);
    // Back and forth by 5 mm ten times on 0.1 m: one rest length.
    for i in 0..=2000_i32 {
        let phase = i % 200;
        let (stroke, direction) = match phase {
            0 => (0, -1.0),
            1..=100 => (phase, 1.0),
            _ => (200 - phase, -1.0),
        };
        alone.at(Context { stroke: 5e-5 * f64::from(stroke), direction, ..context() });
    }
    let expected = -1e4 * 1e-3 * (1.0 - (-2.0_f64).exp());
    close(alone.at(context()), expected, 2e-2);
    // Somewhere else after a power-up, with the direction unknown.
    close(alone.at(Context { stroke: 4e-3, ..context() }), expected, 2e-2);
}

#[test]
fn set_by_load_grows_with_its_impulse() {
    let mut alone = Alone::new("permanent-set", &[0.0, 1e-3, 0.5, 1e4]);
    for _ in 0..1000 {
        alone.at(Context { dt: 0.1, quasi: 50.0, ..context() });
    }
    close(alone.at(context()), -1e4 * 1e-3 * (1.0 - (-0.5_f64).exp()), 1e-2);
}
