//! Which way friction points: over which travel it turns while the muscle moves, and what holds it while a demand stays the same.

use super::*;

/// Travel in which the strands change their direction: 2 ‰ of the tested contraction of 7.7 %.
const DISTANCE_M: f32 = 2e-3 * 0.077 * 39.16e-3;

/// Pressure that moves the strands as far at held length: the pressure that holds the blocked force would move the free muscle through its
/// tested contraction, and 1.9 % of that at held length.
fn distance_pa() -> f32 {
    let blocked_pa = 135.7 / area(0.0) as f32;
    blocked_pa * DISTANCE_M / (0.019 * 0.077 * 39.16e-3)
}

/// Three strands that slide at 0.3, 0.8 and 1.8 distances; the share of friction after a travel, and after it was reversed.
const TURNS: [(f32, f32); 8] = [
    // A travel of 0.05 is noise: nothing turns.
    (0.05, 0.0),
    (0.3, (1.0 + 0.3 / 0.8 + 0.3 / 1.8) / 3.0),
    (0.5, (1.0 + 1.0 + 0.8 / 1.8) / 3.0),
    (1.0, 1.0),
    (3.0, 1.0),
    // A travel back of twice that is noise as well.
    (-0.1, 1.0),
    (-0.6, (-1.0 + 0.25 + 1.0 - 0.6 / 1.8) / 3.0),
    (-3.0, -1.0),
];

#[test]
fn friction_turns_over_a_travel_of_stroke_or_of_pressure() {
    let mut by_stroke = built(&table::example());
    let mut by_pressure = by_stroke.clone();
    let mut by_both = by_stroke.clone();
    let (start_m, start_pa) = (1e-4, 200e3);
    let mut travelled = 0.0;
    let turns = core::iter::once((0.0, 0.0)).chain(TURNS);
    for (travel, direction) in turns {
        travelled += travel;
        let (stroke_m, pressure_pa) =
            (start_m + travelled * DISTANCE_M, start_pa + travelled * distance_pa());
        by_stroke.tick(&at(stroke_m), start_pa);
        by_pressure.tick(&at(start_m), pressure_pa);
        let half = 0.5 * travelled;
        by_both.tick(&at(start_m + half * DISTANCE_M), start_pa + half * distance_pa());
        for (of, model) in [("stroke", &by_stroke), ("pressure", &by_pressure), ("both", &by_both)] {
            let found = model.direction();
            assert!((found - direction).abs() < 2e-3, "{found} after {travelled} of {of}, not {direction}");
        }
    }
}

#[test]
fn the_travel_of_a_turn_grows_with_what_was_tested() {
    let mut wide = table::example();
    wide.tested.contraction_high = 0.154;
    let mut model = built(&wide);
    model.tick(&at(0.0), 200e3);
    model.tick(&at(2.0 * (0.05 + 0.3) * DISTANCE_M), 200e3);
    assert!((model.direction() - TURNS[1].1).abs() < 2e-3, "{}", model.direction());
    let mut strong = table::example();
    strong.blocked_force = Force::from_newtons(-271.4);
    let mut model = built(&strong);
    model.tick(&at(0.0), 100e3);
    model.tick(&at(0.0), 100e3 + 2.0 * (0.05 + 0.3) * distance_pa());
    assert!((model.direction() - TURNS[1].1).abs() < 2e-3, "{}", model.direction());
}

#[test]
fn only_an_effect_that_describes_a_turn_replaces_it() {
    let tables = [
        (with(EffectName::CoulombFriction, &[1.0, 1.0]), 1.0),
        (with(EffectName::PreslidingHysteresis, &[0.5, 1.0, 1e-4]), -1.0),
    ];
    for (table, direction) in tables {
        let mut model = built(&table);
        // A tracker of the motion that has not noticed the turn yet.
        for stroke_m in [0.0, 1e-4] {
            model.tick(&Motion { direction: -1.0, ..at(stroke_m) }, 200e3);
        }
        assert_eq!(model.direction(), direction, "{:?}", table.effects);
    }
}

/// Lets a force be demanded for some ticks, at rest; then moves the muscle and gives the direction of friction.
fn moved_after(ticks: u32, rests: bool, strokes: f32, pressures: f32) -> f32 {
    let mut model = built(&table::example());
    for _ in 0..ticks {
        model.tick(&at(1e-4), 200e3);
        model.pressure_for(20.0, 200e3, rests, 1.0);
    }
    model.tick(&at(1e-4 + strokes * DISTANCE_M), 200e3 + pressures * distance_pa());
    model.direction()
}

#[test]
fn a_demand_that_stays_the_same_holds_friction_as_long_as_it_is_made() {
    let third = TURNS[1].1;
    let cases = [
        // Not yet constant for 0.2 s: any travel turns friction.
        (150, false, 0.35, 0.0, third),
        (150, true, 0.35, 0.0, third),
        (150, true, 0.0, 0.35, third),
        // Then only stroke beyond a play of 0.2 does,
        (300, false, 0.2, 0.0, 0.0),
        (300, false, 0.5, 0.0, third),
        (300, false, -0.5, 0.0, -third),
        (300, false, 0.0, 3.0, 0.0),
        // and where a trim takes care of the rest, a travel of either beyond 20.
        (300, true, 19.9, 0.0, 0.0),
        (300, true, 20.3, 0.0, third),
        (300, true, -20.3, 0.0, -third),
        (300, true, 10.15, 10.15, third),
        (300, true, 15.0, -15.0, 0.0),
    ];
    for (ticks, rests, strokes, pressures, direction) in cases {
        let found = moved_after(ticks, rests, strokes, pressures);
        let case = (ticks, rests, strokes, pressures);
        assert!((found - direction).abs() < 2e-3, "{case:?}: {found}, not {direction}");
    }
}

#[test]
fn another_demand_or_none_sets_friction_free_and_forgets_what_was_held() {
    for force_n in [Some(21.0), None] {
        let mut model = built(&table::example());
        for _ in 0..300 {
            model.tick(&at(0.0), 200e3);
            model.pressure_for(20.0, 200e3, true, 1.0);
        }
        let mut stroke_m = 15.0 * DISTANCE_M;
        model.tick(&at(stroke_m), 200e3);
        assert_eq!(model.direction(), 0.0, "held");
        if let Some(force_n) = force_n {
            model.pressure_for(force_n, 200e3, true, 1.0);
        }
        stroke_m += 0.3 * DISTANCE_M;
        model.tick(&at(stroke_m), 200e3);
        assert!((model.direction() - TURNS[1].1).abs() < 2e-3, "{force_n:?}: {}", model.direction());
    }
    // After a travel back within the play as well.
    let mut model = built(&table::example());
    for (travelled, direction) in [(0.0, 0.0), (-0.35, -TURNS[1].1), (-0.25, -TURNS[1].1), (0.05, 0.0)] {
        model.tick(&at(1e-4 + travelled * DISTANCE_M), 200e3);
        assert!((model.direction() - direction).abs() < 2e-3, "{travelled}: {}", model.direction());
    }
}
