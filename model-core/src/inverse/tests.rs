use super::*;
use crate::table;
use crate::units::Length;
use proptest::prelude::*;

fn muscle() -> Muscle<f64> {
    Muscle::build(&table::example()).expect("a valid table")
}

proptest! {
    #[test]
    fn it_undoes_the_force(p in 80.0e3..540.0e3_f64, mm in 0.0..2.0_f64, s in -1..=1_i32, guess in 0.0..600.0e3_f64) {
        let m = muscle();
        let stroke = Length::from_millimetres(mm);
        let force = m.force(Pressure::from_pascals(p), stroke, f64::from(s));
        let found = m.pressure_for(force, &m.at_stroke(stroke), f64::from(s), Pressure::from_pascals(guess), &m.search());
        prop_assert_eq!(found.attainability, Attainability::Attainable);
        prop_assert!((found.pressure.pascals() - p).abs() < 2.0, "{:?} for {}", found, p);
    }

    #[test]
    fn in_single_precision_it_ends_and_says_what_it_found(f in -1.0e3..1.0e3_f32, mm in -5.0..20.0_f32, s in -1..=1_i32, guess in -1e6..1e6_f32) {
        let m = Muscle::<f32>::build(&table::example()).expect("a valid table");
        let at_stroke = m.at_stroke(Length::from_millimetres(mm));
        let found = m.pressure_for(Force::from_newtons(f), &at_stroke, s as f32, Pressure::from_pascals(guess), &m.search());
        prop_assert!(found.pressure.pascals() >= 0.0 && found.pressure <= m.max_pressure());
        prop_assert!(found.steps <= MAX_STEPS);
    }
}

/// Tables that pass their check but that no fit would give: curves that rise and fall at random.
fn wild() -> impl Strategy<Value = table::MuscleTable> {
    let curve = |n, size: f32| proptest::collection::vec(-size..size, n);
    (1_usize..=8, 1_usize..=table::MAX_ORDER)
        .prop_flat_map(move |(n, order)| {
            let elastic = proptest::collection::vec(curve(n, 4.0e6), order);
            (curve(n, 25.0e3), elastic, proptest::collection::vec(-0.2..0.5_f32, n))
        })
        .prop_map(|(nodes, elastic, friction)| table::MuscleTable {
            nodes: (0_u8..).zip(nodes).map(|(i, off)| 120.0e3 + 60.0e3 * f32::from(i) + off).collect(),
            elastic: elastic.into_iter().map(|curve| curve.into_iter().collect()).collect(),
            friction: friction.into_iter().collect(),
            ..table::example()
        })
        .prop_filter("a usable table", |table| table.check().is_ok())
}

proptest! {
    #[test]
    fn every_valid_table_is_inverted_or_said_why_not(
        table in wild(), mm in -0.5..4.0_f64, s in -1.0..=1.0_f64, wanted in -100.0..400.0_f64, guess in 0.0..600.0e3_f64,
    ) {
        let m = Muscle::<f64>::build(&table).expect("it passes its check");
        let at_stroke = m.at_stroke(Length::from_millimetres(mm));
        let at = |p: Pressure<f64>| m.parts(&at_stroke, p).force(s);
        let search = m.search();
        let found = m.pressure_for(Force::from_newtons(wanted), &at_stroke, s, Pressure::from_pascals(guess), &search);
        let miss = at(found.pressure) - wanted;
        match found.attainability {
            // The slope that is reported is that of the last step; on a bend it differs from the one at the answer.
            Attainability::Attainable => {
                let slope = m.parts(&at_stroke, found.pressure).slope(s).abs().max(found.slope.abs());
                prop_assert!(miss.abs() <= 2.0 * slope + 1e-6, "{found:?} misses by {miss} N");
            }
            Attainability::BeyondBlockedForce => prop_assert!(miss < 0.0 && found.pressure == search.high, "{found:?}"),
            Attainability::BelowDeadband => prop_assert!(miss > 0.0 && found.pressure == search.low, "{found:?}"),
            Attainability::NotRising => prop_assert!(found.slope <= 0.0 || found.steps == MAX_STEPS, "{found:?}"),
            Attainability::NotANumber => prop_assert!(false, "{found:?}"),
        }
    }
}

#[test]
fn from_five_kilopascals_away_three_steps_are_enough() {
    let m = muscle();
    for kpa in [150.0, 275.0, 410.0, 520.0] {
        let stroke = Length::from_millimetres(1.0);
        let force = m.force(Pressure::from_kilopascals(kpa), stroke, 1.0);
        let guess = Pressure::from_kilopascals(kpa + 5.0);
        let found = m.pressure_for(force, &m.at_stroke(stroke), 1.0, guess, &m.search());
        assert!(found.steps <= 3, "{} steps at {kpa} kPa", found.steps);
    }
}

#[test]
fn unreachable_forces_are_reported() {
    let m = muscle();
    let at_stroke = m.at_stroke(Length::ZERO);
    let at = |n| m.pressure_for(Force::from_newtons(n), &at_stroke, 0.0, Pressure::ZERO, &m.search());
    assert_eq!(at(1.0e4).attainability, Attainability::BeyondBlockedForce);
    assert_eq!(at(1.0e4).pressure, m.max_pressure());
    assert_eq!(at(-1.0e4).attainability, Attainability::BelowDeadband);
    assert_eq!(at(-1.0e4).pressure, Pressure::ZERO);
    let past_neutral = m.at_stroke(Length::from_millimetres(30.0));
    let found = m.pressure_for(Force::from_newtons(50.0), &past_neutral, 0.0, Pressure::ZERO, &m.search());
    assert_eq!(found.attainability, Attainability::NotRising);
    let nan = m.pressure_for(Force::from_newtons(f64::NAN), &at_stroke, 0.0, Pressure::ZERO, &m.search());
    assert_eq!((nan.attainability, nan.pressure), (Attainability::NotANumber, Pressure::ZERO));
}

#[test]
fn a_force_that_is_no_number_gives_the_lowest_pressure() {
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for kpa in [0.0, 100.0, 300.0, 599.0, 600.0] {
            let m = Muscle::<f32>::build(&table::example()).expect("a valid table");
            let (force, guess) = (Force::from_newtons(number), Pressure::from_kilopascals(kpa));
            let search = Search { low: Pressure::from_pascals(10.0), ..m.search() };
            let found = m.pressure_for(force, &m.at_stroke(Length::ZERO), 0.0, guess, &search);
            assert_eq!(
                (found.attainability, found.pressure),
                (Attainability::NotANumber, search.low),
                "{number} from {kpa} kPa"
            );
            let chain = Chain::none();
            let point = m.operating_point();
            let found = m.pressure_by_search(force, &chain, &point, guess, &search);
            assert_eq!(
                (found.attainability, found.pressure),
                (Attainability::NotANumber, search.low),
                "with effects, {number}"
            );
        }
    }
}

/// A demand that rises evenly through a pressure of the table is answered without a step and without a kink.
#[test]
fn the_pressure_is_smooth_where_one_piece_of_the_table_ends() {
    let m = muscle();
    let table = table::example();
    let search = Search { tolerance: Pressure::from_pascals(1e-7), ..m.search() };
    let mut compared = 0;
    for node in &table.nodes[1..table.nodes.len() - 1] {
        for (mm, s) in [(0.0, 1.0), (0.7, -1.0), (1.4, 1.0)] {
            let at_stroke = m.at_stroke(Length::from_millimetres(mm));
            let node = Pressure::from_pascals(f64::from(*node));
            let parts = m.parts(&at_stroke, node);
            let step = 100.0 * parts.slope(s);
            let at = |wanted: f64| {
                let found = m.pressure_for(Force::from_newtons(wanted), &at_stroke, s, node, &search);
                assert_eq!(found.attainability, Attainability::Attainable, "{wanted} N at {mm} mm");
                found.pressure.pascals()
            };
            let [before, there, after] = [-1.0, 0.0, 1.0].map(|n| at(parts.force(s) + n * step));
            assert!((there - node.pascals()).abs() < 1e-3, "{there} Pa for {node:?}");
            // A hundred pascals to either side: their slopes differ by as much as the curve bends, which a kink would exceed.
            let kink = (after - there) / (there - before) - 1.0;
            assert!(kink.abs() < 5e-3, "{kink} at {node:?}, {mm} mm");
            compared += 1;
        }
    }
    assert_eq!(compared, 12);
}
