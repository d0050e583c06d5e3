//! Friction: of reversals, rests, speed and pressure.

use model_core::effects::{BraidTravel, Context, EffectName, Link, MEMORY};
use model_core::motion::Motion;
use model_core::muscle::Muscle;
use model_core::table;
use model_core::units::Pressure;

use super::{Alone, close, context};

/// The strands' travel without the pressure's part.
fn travelled(alone: &mut Alone, from: f64, to: f64, direction: f64) -> f64 {
    let mut force = 0.0;
    for i in 1..=200 {
        let stroke = from + (to - from) * f64::from(i) / 200.0;
        force = alone.at(Context { stroke, direction, friction: 0.1, quasi: 100.0, ..context() });
    }
    force
}

#[test]
fn after_a_turn_the_friction_is_the_virgin_curve_doubled() {
    // Masing: F(turn + d) = F(turn) − 2 F_virgin(d/2). The dry part is W(s − mean z), W = 4 N.
    let delta = 2e-3;
    let sliding = |alone: &Alone| alone.memory[..4].iter().sum::<f64>() / 4.0;
    for d in [0.1e-3, 0.4e-3, 1.0e-3, 1.7e-3] {
        let mut virgin = Alone::new("presliding-hysteresis", &[0.0, 4.0, delta]);
        travelled(&mut virgin, 0.0, 0.0, 1.0);
        travelled(&mut virgin, 0.0, d / 2.0, 1.0);
        let mut turned = Alone::new("presliding-hysteresis", &[0.0, 4.0, delta]);
        travelled(&mut turned, 0.0, 10e-3, 1.0);
        close(sliding(&turned), 1.0, 1e-12);
        travelled(&mut turned, 10e-3, 10e-3 - d, -1.0);
        close(sliding(&turned), 1.0 - 2.0 * sliding(&virgin), 1e-9);
    }
}

#[test]
fn once_all_strands_slide_presliding_adds_nothing() {
    let mut alone = Alone::new("presliding-hysteresis", &[1.0, 4.0, 2e-3]);
    close(travelled(&mut alone, 0.0, 5e-3, 1.0), 0.0, 1e-9);
    // Just after the reversal all of the jump is taken back: 2 (0.1 · 100 + 4) N.
    close(travelled(&mut alone, 5e-3, 5e-3 - 1e-9, -1.0), -28.0, 1e-3);
    close(travelled(&mut alone, 5e-3, 2.9e-3, -1.0), 0.0, 1e-9);
}

#[test]
fn an_inner_loop_closes_and_a_larger_one_wipes_it_out() {
    let mut alone = Alone::new("minor-loop-memory", &[10.0, 0.0, 4e-3]);
    travelled(&mut alone, 0.0, 6e-3, 1.0);
    travelled(&mut alone, 6e-3, 3e-3, -1.0);
    let at_turn = alone.memory;
    travelled(&mut alone, 3e-3, 5e-3, 1.0);
    travelled(&mut alone, 5e-3, 3e-3, -1.0);
    for (a, b) in at_turn[..6].iter().zip(&alone.memory[..6]) {
        close(*a, *b, 1e-9);
    }
    // Rate independent: the same way in one reading.
    let mut quick = Alone::new("minor-loop-memory", &[10.0, 0.0, 4e-3]);
    for stroke in [0.0, 6e-3, 3e-3, 5e-3, 3e-3] {
        quick.at(Context { stroke, ..context() });
    }
    for (a, b) in quick.memory[..6].iter().zip(&alone.memory[..6]) {
        close(*a, *b, 1e-9);
    }
    // A full loop is dry friction of the amplitude.
    close(travelled(&mut alone, 3e-3, 20e-3, 1.0), -10.0, 1e-9);
}

#[test]
fn at_held_length_filling_slides_the_strands_as_shortening_does() {
    let mut memory = [0.0; MEMORY];
    BraidTravel::step(&Context { pressure: 1e5, ..context() }, &mut memory, 0);
    // 10 kPa on 1 cm² pull 1 N more; at 10 N/mm that is 0.1 mm of free motion, and a twentieth of it of slip.
    close(BraidTravel::step(&Context { pressure: 1.1e5, ..context() }, &mut memory, 0), 5e-6, 1e-12);
    close(BraidTravel::step(&Context { pressure: 1e5, ..context() }, &mut memory, 0), -5e-6, 1e-12);
    // Without stiffness the travel stays bounded.
    let limp = Context { pressure: 2e5, stiffness: 0.0, ..context() };
    assert!(BraidTravel::step(&limp, &mut memory, 0).abs() <= 0.1);
}

#[test]
fn after_a_rest_it_sticks_the_longer_the_rest_and_lets_go_over_its_distance() {
    let stuck = |rest: f64, gone: f64| {
        let mut alone = Alone::new("breakaway-friction", &[5.0, 0.0, 0.0, 0.2e-3, 10.0]);
        let mut force = 0.0;
        for i in 1..=10 {
            force = alone.at(Context { hold_time: rest * f64::from(i) / 10.0, direction: 1.0, ..context() });
        }
        assert_eq!(force, 0.0, "nothing is added at rest");
        alone.at(Context { stroke: gone, hold_time: rest, direction: 1.0, speed: 1e-3, ..context() })
    };
    let aged = |age: f64| -5.0 * (age / 10.0).ln_1p();
    close(stuck(10.0, 0.0), aged(10.0), 1e-6);
    close(stuck(1e4, 0.0), aged(1e4), 1e-6);
    // Over its distance a contact loses its age, not its grip.
    close(stuck(1e4, 0.2e-3), aged(1e4 * (-1.0_f64).exp()), 1e-3);
    assert!(stuck(1.0, 0.0).abs() < stuck(10.0, 0.0).abs());
    assert!(stuck(100.0, 5e-3).abs() < 1e-6);
    // Back where it stood, but after a reversal without a rest, nothing holds it.
    let mut alone = Alone::new("breakaway-friction", &[5.0, 0.0, 0.0, 0.2e-3, 10.0]);
    let moving = |stroke: f64, hold_time: f64, direction: f64| Context {
        stroke,
        hold_time,
        direction,
        speed: 1e-3,
        ..context()
    };
    alone.at(Context { hold_time: 50.0, resting: 1.0, direction: 1.0, ..context() });
    assert!(alone.at(moving(1e-5, 50.0, 1.0)) < -4.0);
    assert!(alone.at(moving(5e-3, 50.0, 1.0)).abs() < 1e-6);
    close(alone.at(moving(4.9e-3, 0.0, -1.0)), 0.0, 1e-12);
    close(alone.at(moving(1e-5, 0.0, -1.0)), 0.0, 1e-12);
}

#[test]
fn slow_motion_rubs_more_and_the_seal_at_any_force() {
    let at = |name: &str, parameters: &[f64], speed: f64, direction: f64| {
        Alone::new(name, parameters).at(Context { speed, direction, pressure: 2e5, quasi: 0.0, ..context() })
    };
    let stribeck = |v: f64| at("stribeck-friction", &[2.0, 0.0, 1e-3], v, 1.0);
    close(stribeck(0.0), -2.0, 1e-12);
    close(stribeck(1e-3), -2.0 * (-1.0_f64).exp(), 1e-3);
    assert!(stribeck(20e-3).abs() < 1e-6);
    // 1 N + 1e-5 m² (101.325 + 200) kPa, twice that at rest.
    let mut seal = Alone::new("seal-friction", &[1.0, 1e-5, 2.0, 1e-3]);
    let mut seal =
        |speed: f64, direction: f64| seal.at(Context { speed, direction, pressure: 2e5, ..context() });
    close(seal(1.0, 1.0), -4.013_25, 1e-9);
    close(seal(0.0, -1.0), -2.0 * 4.013_25, 1e-9);
}

#[test]
fn speed_and_pressure_laws() {
    let moving = Context { speed: 4e-3, direction: 1.0, pressure: 2e5, quasi: 50.0, ..context() };
    close(Alone::new("viscous-damping", &[100.0, 1e-3]).at(moving), -(100.0 + 200.0) * 4e-3, 1e-12);
    close(Alone::new("rate-power", &[0.01, 0.5]).at(moving), -0.01 * 50.0 * 2.0, 1e-12);
    let mut coulomb = Alone::new("coulomb-friction", &[3.0, 0.0]);
    // At held length the pressure turns the braid's friction, not a guide's.
    assert_eq!(coulomb.at(Context { direction: -1.0, ..context() }), 0.0);
    close(coulomb.at(Context { direction: -1.0, speed: -1e-3, ..context() }), 3.0, 0.0);
    close(coulomb.at(Context { direction: 1.0, ..context() }), 3.0, 0.0);
    // Found at rest a centimetre further in, it came there by shortening.
    let mut moved = Alone::new("coulomb-friction", &[3.0, 0.0]);
    moved.at(Context { stroke: 0.0, resting: 1.0, ..context() });
    close(moved.at(Context { stroke: 0.01, resting: 1.0, direction: -1.0, ..context() }), -3.0, 0.0);
    // Strands that rub follow the pressure.
    let mut strands = Alone::new("coulomb-friction", &[0.0, 3.0]);
    close(strands.at(Context { resting: 1.0, direction: -1.0, ..context() }), 3.0, 0.0);
    let area = core::f64::consts::PI * 25e-6;
    close(Alone::new("pressure-friction", &[0.1, 0.0]).at(moving), -0.1 * 2e5 * area, 1e-12);
    let unchanging = Alone::new("pressure-friction", &[0.0, 0.1]).at(Context { rest_radius: 4e-3, ..moving });
    close(unchanging, -0.1 * 2e5 * core::f64::consts::PI * 16e-6, 1e-12);
    close(Alone::new("friction-asymmetry", &[0.1]).at(moving), -2.5, 1e-12);
    close(Alone::new("friction-asymmetry", &[0.1]).at(Context { direction: -1.0, ..moving }), -2.5, 1e-12);
    assert_eq!(Alone::new("friction-asymmetry", &[0.1]).at(Context { direction: 0.0, ..moving }), 0.0);
}

#[test]
fn friction_scales_with_effects_that_change_the_balance() {
    let muscle = Muscle::<f64>::build(&table::example()).expect("a valid table");
    let pressure = Pressure::from_kilopascals(400.0);
    let motion = |stroke: f64, direction: f64| Motion { stroke, speed: 1e-3, direction, ..Motion::default() };
    for effect in EffectName::ALL {
        let info = effect.info();
        if !matches!(info.link, Link::Air | Link::Braid | Link::Bladder | Link::Memory) {
            continue;
        }
        let parameters: Vec<f64> = info
            .parameters
            .iter()
            .map(|p| match (info.name, p.name) {
                // What warmth does to friction itself is not part of the balance.
                (_, "friction_loss_per_watt" | "friction_loss_per_kelvin" | "slip_time") => 0.0,
                (_, "jamming_contraction") | ("cyclic-softening", "path") => p.low,
                _ => 0.3 * p.low.max(0.0) + 0.7 * p.high,
            })
            .collect();
        let mut memory = [0.0; MEMORY];
        for i in 0..100 {
            let c = muscle.context(&motion(1e-5 * f64::from(i), 1.0), pressure);
            effect.step(
                &parameters,
                &Context { dt: 0.1, time: 0.1 * f64::from(i), pressure_rate: 1e3, ..c },
                &mut memory,
            );
        }
        let c = muscle.context(&motion(0.9e-3, 0.0), pressure);
        let force = |direction: f64| effect.force(&parameters, &Context { direction, ..c }, &memory);
        assert!(force(0.0) != 0.0, "{} makes a force", info.name);
        for direction in [-1.0, 0.5, 1.0] {
            let ratio = force(direction) / force(0.0);
            assert!((ratio - (1.0 - direction * c.friction)).abs() < 1e-9, "{}: {ratio}", info.name);
        }
    }
}
