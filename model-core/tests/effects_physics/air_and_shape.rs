//! The air on its way to the muscle, the ends, the fibres, and the elastic law.

use model_core::braid::miniature;
use model_core::effects::{Context, decay};
use model_core::motion::Motion;
use model_core::muscle::Muscle;
use model_core::table;
use model_core::units::{Length, Pressure};

use super::{Alone, close, context};

#[test]
fn a_late_pressure_costs_flow_times_resistance() {
    let mut alone = Alone::new("pressure-lag", &[1e9, 0.1, 0.0, 0.2]);
    alone.at(context());
    // 10 mm/s with 1 cm² draw 1 cm³/s; 1e9 Pa·s/m³ cost 1 kPa of 1e-4 N/Pa. 20 kPa/s for 0.1 s cost 2 kPa.
    let moving = Context { dt: 0.1, speed: 0.01, pressure_rate: 20e3, ..context() };
    for _ in 0..100 {
        alone.at(moving);
    }
    close(alone.at(moving), -0.1 - 0.2, 1e-9);
    // It decays in a dwell, as viscous friction does not.
    let dwell = Context { dt: 1e-9, ..context() };
    close(alone.at(dwell), -0.3, 2e-3);
    close(alone.at(Context { dt: 0.2, ..context() }), -0.3 * (-1.0_f64).exp(), 2e-2);
}

#[test]
fn a_muscle_that_fills_by_mass_loses_what_the_gas_law_asks_for() {
    let mut alone = Alone::new("pressure-lag", &[0.0, 0.0, 0.1, 0.2]);
    let moving = Context {
        dt: 0.1,
        speed: 0.01,
        pressure: 200e3,
        pressure_rate: 20e3,
        rest_radius: 4e-3,
        ..context()
    };
    for _ in 0..100 {
        alone.at(moving);
    }
    // d(p V)/dt over the volume at rest, a tenth of a second of it.
    let volume = |radius: f64, length: f64| std::f64::consts::PI * radius * radius * length;
    let (now, rest) = (volume(moving.radius, moving.length), volume(moving.rest_radius, moving.rest_length));
    let lost = 0.1 * (now * 20e3 + (200e3 + 101_325.0) * moving.area * 0.01) / rest;
    close(alone.at(moving), -lost * moving.area, 1e-6 * lost * moving.area);
}

#[test]
fn below_contact_the_pressure_does_not_pull_and_above_it_lost_what_contact_took() {
    let at = |corrected_pressure: f64| {
        let c = Context { corrected_pressure, radial_strain: 0.5, ..context() };
        corrected_pressure * c.area + Alone::new("contact-loss", &[1.0, 0.0, 1e5]).at(c)
    };
    close(at(20e3), 0.0, 1e-12);
    close(at(50e3), 0.0, 1e-12);
    close(at(150e3), 10.0, 1e-9);
    close(at(-10e3), -1.0, 1e-12);
}

#[test]
fn stretching_fibres_change_gaylords_force_by_their_first_order() {
    let braid = miniature().build().expect("a valid geometry");
    let (b, n) = (braid.fibre_length(), braid.turns());
    let (length, pressure, compliance) = (0.037_f64, 4e5, 1e-6);
    let tension = pressure * length * b / (2.0 * core::f64::consts::PI * n * n);
    let gaylord = |b: f64| pressure * (3.0 * length * length - b * b) / (4.0 * core::f64::consts::PI * n * n);
    let change = gaylord(b * (1.0 + tension * compliance)) - gaylord(b);
    let c = Context { corrected_pressure: pressure, length, fibre_length: b, turns: n, ..context() };
    let force = Alone::new("braid-elasticity", &[compliance]).at(c);
    close(force, change, 1e-3 * change.abs());
    assert!(force < 0.0);
}

#[test]
fn load_carried_by_the_wall_does_not_stretch_the_fibres() {
    let muscle = Muscle::<f64>::build(&table::example()).expect("a valid table");
    let braid = muscle.braid();
    let (b, n, compliance) = (braid.fibre_length(), braid.turns(), 1e-6);
    for (stroke, kilopascals) in [(0.2e-3, 300.0), (1e-3, 400.0), (2e-3, 600.0)] {
        let at = Motion { stroke, ..Motion::default() };
        let c = muscle.context(&at, Pressure::from_kilopascals(kilopascals));
        let modulus = c.elastic / c.unit_elastic();
        // The fibres' energy at a length, with the wall's own thickness there.
        let given_way = |stroke: f64| {
            let p = braid.posture(Length::from_metres(stroke));
            let carried = modulus * p.wall * p.radial_strain / p.radius;
            let tension =
                (c.corrected_pressure - carried) * p.length * b / (2.0 * core::f64::consts::PI * n * n);
            0.5 * compliance * b * tension * tension
        };
        let h = 1e-6;
        // F = −dW/dL of their elastic energy; L falls as the stroke grows.
        let force = (given_way(stroke + h) - given_way(stroke - h)) / (2.0 * h);
        let law = Alone::new("braid-elasticity", &[compliance]).at(c);
        close(law, force, 0.05 * force.abs());
        let without = Alone::new("braid-elasticity", &[compliance]).at(Context { elastic: 0.0, ..c });
        assert!((law - without).abs() > 0.03 * without.abs(), "the wall matters: {law} {without}");
    }
}

#[test]
fn a_slip_gives_the_force_of_a_longer_muscle_from_its_moment_on() {
    let muscle = Muscle::<f64>::build(&table::example()).expect("a valid table");
    let pressure = Pressure::from_kilopascals(400.0);
    let at = |stroke: f64, time: f64| muscle.context(&Motion { stroke, time, ..Motion::default() }, pressure);
    let slip = 10e-6;
    let mut alone = Alone::new("end-slip", &[slip, 30.0]);
    assert_eq!(alone.at(at(1e-3, 29.9)), 0.0);
    let force = alone.at(at(1e-3, 30.0));
    let difference = muscle.force(pressure, Length::from_metres(1e-3 - slip), 0.0).newtons()
        - muscle.force(pressure, Length::from_metres(1e-3), 0.0).newtons();
    close(force, difference, 1e-2 * difference.abs());
    // It does not heal when the clock begins again.
    assert!(alone.at(at(1e-3, 0.0)) != 0.0);
}

#[test]
fn a_table_of_lower_order_is_completed_by_the_next_terms() {
    let muscle = Muscle::<f64>::build(&table::example()).expect("a valid table");
    let order = table::example().order();
    let c = muscle.context(&Motion { stroke: 2e-3, ..Motion::default() }, Pressure::from_kilopascals(300.0));
    let posture = muscle.braid().posture(Length::from_metres(2e-3));
    let columns = posture.elastic_columns::<8>();
    let alone = |parameters: &[f64]| Alone::new("higher-order-elasticity", parameters).at(c);
    close(alone(&[1e6, 0.0, 0.0]), 1e6 * columns[order], 1e-9);
    close(alone(&[0.0, 1e6, 0.0]), 1e6 * columns[order + 1], 1e-9);
    // Small strains: λ − 1/λ² → 3 ε, so G acts as E/3.
    let small = Context { radial_strain: 1e-6, axial_strain: -1e-7, ..c };
    let hooke = Alone::new("higher-order-elasticity", &[0.0, 0.0, 1e6]).at(small);
    close(hooke, 3e6 * small.unit_elastic(), 1e-4 * hooke.abs());
}

#[test]
fn shapes_of_the_ends_the_wall_and_the_leak() {
    let c = Context { contraction: 0.1, corrected_pressure: 3e5, pressure: 3e5, ..context() };
    let area = core::f64::consts::PI * 25e-6;
    close(Alone::new("tip-effect", &[1.0, 0.0]).at(c), -3e5 * area * 0.05 * 0.1, 1e-12);
    // The slope of the air that tapers do not hold, π R (R − R0)².
    let braid = miniature().build().expect("a valid geometry");
    let at = |stroke: f64| braid.posture(Length::from_metres(stroke));
    let lost = |stroke: f64| {
        let r = at(stroke).radius;
        core::f64::consts::PI * r * (r - braid.rest_radius()).powi(2)
    };
    let (stroke, h) = (3e-3, 1e-6);
    let tapered = Context {
        radius: at(stroke).radius,
        rest_radius: braid.rest_radius(),
        length: at(stroke).length,
        turns: braid.turns(),
        corrected_pressure: 3e5,
        ..context()
    };
    let slope = (lost(stroke + h) - lost(stroke - h)) / (2.0 * h);
    close(Alone::new("tip-effect", &[0.0, 1.0]).at(tapered), -3e5 * slope, 1e-4 * 3e5 * slope);
    assert_eq!(Alone::new("strand-jamming", &[1e4, 0.1]).at(c), 0.0);
    close(Alone::new("strand-jamming", &[1e4, 0.08]).at(c), -4.0, 1e-9);
    close(Alone::new("leak", &[0.02]).at(c), -0.02 * 30.0, 1e-12);
}

#[test]
fn the_cheap_decay_is_an_exponential_to_three_parts_in_ten_thousand() {
    let mut last = 1.0 + 1e-12;
    for i in 0..100_000 {
        let x = 1e-3 * f64::from(i);
        let d = decay(x);
        assert!((d - (-x).exp()).abs() < 3e-4 && d < last, "{x}: {d}");
        last = d;
    }
    assert_eq!(decay(f32::INFINITY), 0.0);
}
