//! Which table and which settings a demand is answered by, and what changes when they are exchanged.

use super::*;

#[test]
fn a_seat_holds_the_last_table_that_could_be_used() {
    let deadband_kpa =
        |kpa: f32| MuscleTable { deadband: Pressure::from_kilopascals(kpa), ..table::example() };
    let held = |seat: &mut Seat| {
        let first = seat.as_ref().map(|model| model.muscle.deadband());
        assert_eq!(seat.as_mut().map(|model| model.muscle.deadband()), first);
        first.map(|deadband| deadband.kilopascals())
    };
    let [mut seat, mut other] = Seat::pair();
    assert_eq!(held(&mut seat), None);
    for kpa in [40.0, 60.0] {
        assert_eq!(seat.fill(&deadband_kpa(kpa)), Ok(()));
        assert_eq!((held(&mut seat), held(&mut other)), (Some(kpa), None));
    }
    assert_eq!(seat.fill(&MuscleTable::empty()).err(), MuscleTable::empty().check().err());
    assert_eq!(held(&mut seat), None, "the place is empty after a table that cannot be used");
    assert_eq!(seat.fill(&deadband_kpa(40.0)), Ok(()));
    seat.clear();
    assert_eq!(held(&mut seat), None);
    assert_eq!(other.fill(&deadband_kpa(50.0)), Ok(()));
    assert_eq!(held(&mut other), Some(50.0));
    let [mut only, mut none] = Seat::single();
    assert_eq!((only.fill(&deadband_kpa(40.0)), none.fill(&deadband_kpa(40.0))), (Ok(()), Ok(())));
    assert_eq!(
        (held(&mut only), held(&mut none)),
        (Some(40.0), None),
        "a muscle that the board does not have"
    );
}

#[test]
fn the_state_of_an_exchanged_table_restarts() {
    let rubbing = with(EffectName::CoulombFriction, &[2.0, 2.0]);
    let mut model = shortened(&rubbing, 2e-3, 400e3);
    for _ in 0..300 {
        model.pressure_for(20.0, 300e3, true, 1.0);
        model.tick(&at(2e-3), 400e3);
    }
    model.rebuild(&table::example()).expect("a table");
    let mut fresh = built(&table::example());
    assert_eq!((model.direction(), model.slope()), (fresh.direction(), fresh.slope()));
    // A first reading far from the last one of the table before is not travel.
    for (stroke_m, pressure_pa) in [(0.0, 100e3), (1e-6, 100e3), (3e-6, 110e3), (2e-5, 120e3)] {
        let found =
            [&mut model, &mut fresh].map(|one| (one.tick(&at(stroke_m), pressure_pa), one.direction()));
        assert_eq!(found[0], found[1], "at {stroke_m} m");
    }
}

#[test]
fn settings_choose_what_a_force_is_answered_by() {
    let with = |feed_forward| Settings { feed_forward, ..Settings::default() };
    let model = shortened(&table::example(), 1e-3, 300e3);
    let answer = |settings: &Settings, mode, force_n| {
        feed_forward(settings, mode, Some(&mut model.clone()), force_n, 300e3)
    };
    let (table, braid) = (with(FeedForward::Table), with(FeedForward::Gaylord));
    assert_eq!(answer(&with(FeedForward::Off), Mode::Force, 30.0), (0.0, true));
    assert_eq!(feed_forward(&table, Mode::Force, None, 30.0, 0.0), (0.0, true));
    let (pressure_pa, reached) = answer(&braid, Mode::Force, 30.0);
    assert!(reached && (f64::from(pressure_pa) * area(1e-3) - 30.0).abs() < 1e-3, "{pressure_pa}");
    // In a joint a quarter of friction is left to hold it.
    for (mode, share) in [(Mode::Force, 1.0), (Mode::Stroke, 1.0), (Mode::Pair, 0.75)] {
        let (pressure_pa, reached) = answer(&table, mode, 30.0);
        let newtons = force(f64::from(pressure_pa), 1e-3, share);
        assert!(reached && (newtons - 30.0).abs() < 0.02, "{newtons} N in {mode:?}");
        assert_eq!(answer(&table, mode, 1e4), (600e3, false));
    }
}

#[test]
fn friction_rests_where_a_trim_or_another_muscle_takes_care_of_it() {
    let cases = [
        (true, 50e3, Mode::Force, true),
        (true, 50e3, Mode::Stroke, true),
        (false, 50e3, Mode::Force, false),
        (true, 0.0, Mode::Force, false),
        (false, 0.0, Mode::Force, false),
        (false, 0.0, Mode::Pair, true),
        (true, 50e3, Mode::Pair, true),
    ];
    for (fitted, limit_pa, mode, rests) in cases {
        let mut settings = Settings { feed_forward: FeedForward::Table, ..Settings::default() };
        (settings.force.fitted, settings.force_loop.trim_limit_pa) = (fitted, limit_pa);
        let mut model = built(&table::example());
        for _ in 0..300 {
            model.tick(&at(0.0), 300e3);
            feed_forward(&settings, mode, Some(&mut model), 30.0, 300e3);
        }
        // Some hundredths of a millimetre, five times the travel in which friction turns.
        model.tick(&at(3e-5), 300e3);
        let direction = if rests { 0.0 } else { 1.0 };
        assert_eq!(model.direction(), direction, "{fitted}, {limit_pa} Pa, {mode:?}");
    }
}
