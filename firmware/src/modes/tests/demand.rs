//! The force of a tick, its slopes and the muscle's air; the pressure for a demanded force.

use super::*;

#[test]
fn the_force_of_a_tick_is_that_of_the_table_with_its_friction_and_its_effects() {
    for (kpa, mm) in [(210.0_f32, 0.2_f32), (380.0, 1.0), (540.0, 2.5)] {
        let (pressure_pa, stroke_m) = (1e3 * kpa, 1e-3 * mm);
        let base = force(f64::from(pressure_pa), f64::from(stroke_m), 1.0) as f32;
        let close = |found: f32, wanted: f32| (found - wanted).abs() < 2e-3 * wanted.abs().max(1.0);
        let mut plain = shortened(&table::example(), stroke_m, pressure_pa);
        let found = plain.tick(&at(stroke_m), pressure_pa);
        assert!(close(found, base), "{found} N, not {base}");
        // Strands that rub by 3 N.
        let mut rubbing = shortened(&with(EffectName::CoulombFriction, &[0.0, 3.0]), stroke_m, pressure_pa);
        let found = rubbing.tick(&at(stroke_m), pressure_pa);
        assert!(close(found, base - 3.0), "{found} N, not {}", base - 3.0);
        for model in [&mut plain, &mut rubbing] {
            let (answer, reached) = model.pressure_for(found, pressure_pa, false, 1.0);
            let wanted = if model.chain.is_empty() { found } else { found + 3.0 };
            let got = force(f64::from(answer), f64::from(stroke_m), 1.0) as f32;
            assert!(reached && close(got, wanted), "{got} N at {answer} Pa, not {wanted}");
        }
    }
}

#[test]
fn a_share_of_friction_is_corrected_and_friction_stays_as_it_is() {
    let mut model = shortened(&table::example(), 1e-3, 300e3);
    for share in [0.0, 0.5, 0.75, 1.0] {
        let (answer, reached) = model.pressure_for(30.0, 300e3, false, share);
        let got = force(f64::from(answer), 1e-3, f64::from(share));
        assert!(reached && (got - 30.0).abs() < 0.02, "{got} N with {share} of friction");
        assert_eq!(model.direction(), 1.0);
    }
}

#[test]
fn a_force_that_the_muscle_does_not_have_is_not_reached() {
    let mut model = shortened(&table::example(), 1e-3, 300e3);
    assert_eq!(model.pressure_for(1e4, 300e3, false, 1.0), (600e3, false));
    assert_eq!(model.pressure_for(-1e4, 300e3, false, 1.0), (0.0, false));
}

#[test]
fn the_slopes_are_those_of_the_force() {
    for (kpa, mm) in [(230.0_f32, 0.3_f32), (380.0, 1.0), (500.0, 2.5)] {
        let (pressure_pa, stroke_m) = (1e3 * kpa, 1e-3 * mm);
        let model = shortened(&table::example(), stroke_m, pressure_pa);
        let (p, x) = (f64::from(pressure_pa), f64::from(stroke_m));
        let by_pressure = (force(p + 50.0, x, 1.0) - force(p - 50.0, x, 1.0)) / 100.0;
        // Of the middle between both directions: friction holds against a small motion.
        let by_stroke = (force(p, x + 1e-6, 0.0) - force(p, x - 1e-6, 0.0)) / 2e-6;
        let (found_p, found_x) = model.slopes(pressure_pa);
        assert!((f64::from(found_p) / by_pressure - 1.0).abs() < 1e-3, "{found_p}, not {by_pressure} N/Pa");
        assert!((f64::from(found_x) / by_stroke - 1.0).abs() < 1e-3, "{found_x}, not {by_stroke} N/m");
    }
}

#[test]
fn the_slope_of_a_demand_is_that_where_its_search_ended() {
    let mut model = built(&table::example());
    assert!((f64::from(model.slope()) / area(0.0) - 1.0).abs() < 1e-5, "at rest the braid's area");
    model = shortened(&table::example(), 1e-3, 300e3);
    let (answer, _) = model.pressure_for(force(400e3, 1e-3, 1.0) as f32, 350e3, false, 1.0);
    assert!((answer - 400e3).abs() < 20.0, "{answer}");
    let (by_pressure, _) = model.slopes(400e3);
    assert!((model.slope() / by_pressure - 1.0).abs() < 1e-3, "{} N/Pa, not {by_pressure}", model.slope());
    // An estimate within 20 Pa is answered in one step: the slope is that at the estimate.
    let guess_pa = 400e3 + 18.0;
    model.pressure_for(force(400e3, 1e-3, 1.0) as f32, guess_pa, false, 1.0);
    let [there, near] = [guess_pa, 400e3].map(|pascals| (model.slope() - model.slopes(pascals).0).abs());
    assert!(there < near, "{there} from the slope at the estimate, {near} from that at the answer");
}

#[test]
fn the_air_widens_as_the_braid_does() {
    let (rest_length, fibre, turns) = braid();
    // Less than the cylinder within the braid by what the rubber takes.
    let rubber = core::f64::consts::PI * rest_length * (1.5e-3_f64.powi(2) - 1e-3_f64.powi(2));
    let volume = |stroke_m: f64| {
        let length = rest_length - stroke_m;
        let radius_squared = (fibre * fibre - length * length) / (core::f64::consts::TAU * turns).powi(2);
        core::f64::consts::PI * radius_squared * length - rubber
    };
    for stroke_m in [0.0, 1e-3, 2.5e-3] {
        let mut model = built(&table::example());
        model.tick(&at(stroke_m as f32), 300e3);
        let air = model.air(0.02);
        let fill = volume(stroke_m) / volume(0.0);
        let widening = (volume(stroke_m + 1e-7) - volume(stroke_m - 1e-7)) / 2e-7 * 0.02 / volume(stroke_m);
        assert!((f64::from(air.fill) / fill - 1.0).abs() < 1e-4, "{air:?}, not {fill}");
        assert!((f64::from(air.widening_per_s) / widening - 1.0).abs() < 1e-4, "{air:?}, not {widening}");
    }
    // Drawn out straight there would be none; a tenth is assumed at least.
    let mut straight = built(&table::example());
    straight.tick(&at((rest_length - fibre) as f32), 300e3);
    assert!((straight.air(0.02).fill - 0.1).abs() < 1e-6, "{:?}", straight.air(0.02));
}

#[test]
fn a_muscle_is_taut_above_a_fiftieth_of_its_blocked_force() {
    assert!((built(&table::example()).taut_n() - 2.714).abs() < 1e-5);
    let pushes = MuscleTable { blocked_force: Force::from_newtons(-135.7), ..table::example() };
    assert!((built(&pushes).taut_n() - 2.714).abs() < 1e-5);
}

#[test]
fn the_ideal_braid_needs_the_force_over_its_area() {
    let mut model = built(&table::example());
    for stroke_m in [0.0, 2e-3] {
        model.tick(&at(stroke_m as f32), 300e3);
        let newtons = |pascals: f64| (pascals * area(stroke_m)) as f32;
        let (found, reached) = model.gaylord_pressure(newtons(250e3));
        assert!(reached && (found - 250e3).abs() < 5.0, "{found}");
        assert_eq!(model.gaylord_pressure(newtons(-1e3)), (0.0, false));
        assert_eq!(model.gaylord_pressure(newtons(601e3)), (600e3, false));
    }
    // Past the neutral length no pressure pulls.
    let (rest_length, fibre, _) = braid();
    model.tick(&at((rest_length - fibre / 3.0_f64.sqrt()) as f32 + 1e-4), 300e3);
    assert_eq!(model.gaylord_pressure(10.0), (600e3, false));
}
