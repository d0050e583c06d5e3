//! How many steps a search takes, which steps it refuses, and what it reports of its end.

use super::*;
use crate::effects::{EffectName, FittedEffect};
use crate::motion::Motion;
use crate::table;
use crate::units::Length;

fn muscle() -> Muscle<f64> {
    Muscle::build(&table::example()).expect("a valid table")
}

fn fine(muscle: &Muscle<f64>) -> Search<f64> {
    Search { tolerance: Pressure::from_pascals(1e-4), ..muscle.search() }
}

/// Pressures of the same piece of the example: the answer, and the estimate.
const ON_A_PIECE: [(f64, f64); 5] =
    [(230e3, 215e3), (280e3, 335e3), (300e3, 340e3), (410e3, 350e3), (500e3, 545e3)];

#[test]
fn on_one_piece_a_search_needs_no_bracket() {
    let m = muscle();
    for (answer, guess) in ON_A_PIECE {
        for direction in [-1.0, 0.0, 1.0] {
            let stroke = Length::from_millimetres(1.0);
            let at_stroke = m.at_stroke(stroke);
            let force = m.force(Pressure::from_pascals(answer), stroke, direction);
            let from = |guess| {
                m.pressure_on_piece(force, &at_stroke, direction, Pressure::from_pascals(guess), &fine(&m))
            };
            let found = from(guess).expect("on the piece");
            assert!((found.pressure.pascals() - answer).abs() < 1e-3, "{found:?}, not {answer}");
            assert!(
                found.attainability == Attainability::Attainable && (2..=4).contains(&found.steps),
                "{found:?}"
            );
            let there = from(answer).expect("on the piece");
            assert_eq!(there.steps, 1, "{there:?} from the answer itself");
            let of_both =
                m.pressure_for(force, &at_stroke, direction, Pressure::from_pascals(guess), &fine(&m));
            assert_eq!(of_both, found);
        }
    }
}

#[test]
fn a_search_from_another_piece_counts_the_step_that_left_it() {
    let m = muscle();
    let stroke = Length::from_millimetres(1.0);
    let at_stroke = m.at_stroke(stroke);
    let force = m.force(Pressure::from_pascals(300e3), stroke, 1.0);
    let guess = Pressure::from_pascals(440e3);
    let next = m.pressure_on_piece(force, &at_stroke, 1.0, guess, &fine(&m)).expect_err("another piece");
    let rest = m.pressure_on_piece(force, &at_stroke, 1.0, next, &fine(&m)).expect("on the piece");
    let found = m.pressure_for(force, &at_stroke, 1.0, guess, &fine(&m));
    assert_eq!((found.pressure, found.steps), (rest.pressure, rest.steps + 1));
}

#[test]
fn a_search_within_a_bracket_is_as_quick_where_the_force_rises() {
    let m = muscle();
    for (answer, guess) in ON_A_PIECE.into_iter().chain([(300e3, 0.0), (500e3, 100e3), (220e3, 600e3)]) {
        let stroke = Length::from_millimetres(1.0);
        let at_stroke = m.at_stroke(stroke);
        let mut base = Base::new(&m, &at_stroke, 1.0);
        base.enter(answer);
        let (wanted, _) = base.force_and_slope(answer);
        let found = solve(&mut base, wanted, Pressure::from_pascals(guess), &fine(&m));
        assert!((found.pressure.pascals() - answer).abs() < 1e-3, "{found:?}, not {answer}");
        assert!(
            found.attainability == Attainability::Attainable && (2..=7).contains(&found.steps),
            "{found:?} from {guess}"
        );
        let there = solve(&mut base, wanted, Pressure::from_pascals(answer), &fine(&m));
        assert_eq!((there.pressure.pascals(), there.steps), (answer, 1));
    }
}

#[test]
fn a_bracket_whose_end_was_not_tried_sends_the_search_there() {
    let instead = |low: f64, high: f64| Bracket { low, high }.instead(0.0, 600.0);
    assert_eq!(instead(-1.0, 601.0), 0.0);
    assert_eq!(instead(-1.0, 300.0), 0.0);
    assert_eq!(instead(100.0, 601.0), 600.0);
    assert_eq!(instead(0.0, 600.0), 300.0);
    assert_eq!(instead(100.0, 300.0), 200.0);
}

/// A force that jumps, over which no pressure gives the middle.
struct Jumping;

impl Curve<f64> for Jumping {
    fn enter(&mut self, _: f64) {}

    fn holds(&self, _: f64) -> bool {
        true
    }

    fn force_and_slope(&mut self, p: f64) -> (f64, f64) {
        (if p < 1.0 / 3.0 { -1.0 } else { 1.0 }, 1e-9)
    }
}

#[test]
fn a_search_that_has_not_ended_after_its_most_steps_does_not_claim_an_answer() {
    let [low, high, tolerance] = [0.0, 1.0, 1e-15].map(Pressure::from_pascals);
    let found = solve(&mut Jumping, 0.0, Pressure::from_pascals(0.5), &Search { low, high, tolerance });
    assert_eq!(found.steps, MAX_STEPS);
    assert!((found.pressure.pascals() - 1.0 / 3.0).abs() < 1e-6);
    assert_ne!(found.attainability, Attainability::Attainable);
}

/// A root, on which Newton's method goes back and forth between two pressures without end.
struct Root;

impl Curve<f64> for Root {
    fn enter(&mut self, _: f64) {}

    fn holds(&self, _: f64) -> bool {
        true
    }

    fn force_and_slope(&mut self, p: f64) -> (f64, f64) {
        (p.signum() * p.abs().sqrt(), 0.5 / p.abs().sqrt())
    }
}

#[test]
fn a_step_back_to_a_pressure_that_was_tried_is_not_taken() {
    let [low, high, tolerance] = [-1.0, 1.0, 1e-9].map(Pressure::from_pascals);
    for guess in [0.25, -0.25] {
        let found = solve(&mut Root, 0.0, Pressure::from_pascals(guess), &Search { low, high, tolerance });
        assert_eq!(
            (found.pressure.pascals(), found.attainability),
            (0.0, Attainability::Attainable),
            "{found:?} from {guess}"
        );
        assert_eq!(found.steps, 3, "there, halfway back, and the end: {found:?}");
    }
}

/// A force that rises from the middle on.
struct Flat;

impl Curve<f64> for Flat {
    fn enter(&mut self, _: f64) {}

    fn holds(&self, _: f64) -> bool {
        true
    }

    fn force_and_slope(&mut self, p: f64) -> (f64, f64) {
        if p < 0.5 { (0.0, 0.0) } else { (p - 0.5, 1.0) }
    }
}

#[test]
fn where_nothing_is_missed_on_a_flat_part_the_search_continues_upwards() {
    let [low, high, tolerance] = [0.0, 1.0, 1e-9].map(Pressure::from_pascals);
    let found = solve(&mut Flat, 0.0, Pressure::from_pascals(0.25), &Search { low, high, tolerance });
    assert_eq!((found.pressure.pascals(), found.attainability), (0.5, Attainability::Attainable));
}

#[test]
fn no_piece_is_assumed_where_effects_may_bend_the_force() {
    let m = muscle();
    let OperatingPoint { at_stroke, slopes, context } = &m.operating_point();
    let (chain, context) = (&Chain::none(), *context);
    let whole = Whole { muscle: &m, at_stroke, slopes, chain, context, last: None, effect_slope: 0.0 };
    assert!([0.0, 76.5e3, 300e3, 600e3].into_iter().all(|pascals| !whole.holds(pascals)));
}

#[test]
fn an_end_is_judged_by_what_was_missed_there() {
    // Missed, N, slope, N/Pa, and tolerance, Pa.
    let cases = [
        (1.9e-3, 1e-3, 1.0, Attainability::Attainable),
        (-1.9e-3, -1e-3, 1.0, Attainability::Attainable),
        (0.0, 0.0, 1.0, Attainability::Attainable),
        (1.9e-2, 1e-3, 10.0, Attainability::Attainable),
        (2.1e-2, 1e-3, 10.0, Attainability::BelowDeadband),
        (-2.1e-3, 1e-3, 1.0, Attainability::BeyondBlockedForce),
        (1.0, 0.0, 1.0, Attainability::NotRising),
        (-1.0, -1e-3, 1.0, Attainability::NotRising),
        (f64::NAN, f64::NAN, 1.0, Attainability::NotRising),
    ];
    for (miss, slope, tolerance, attainability) in cases {
        assert_eq!(judge(miss, slope, tolerance), attainability, "{miss} N at {slope} N/Pa");
    }
}

#[test]
fn a_force_with_effects_is_inverted_in_few_steps() {
    let m = muscle();
    let effects: [(EffectName, &[f64]); 2] =
        [(EffectName::PressureFriction, &[0.5, 0.5]), (EffectName::CoulombFriction, &[0.0, 5.0])];
    for (effect, parameters) in effects {
        let mut chain = Chain::<f64>::new(&[FittedEffect::new(effect, parameters)]);
        let mut point = m.operating_point();
        for (answer, guess) in ON_A_PIECE {
            let motion = Motion { stroke: 1e-3, direction: 1.0, dt: 1e-3, ..Motion::default() };
            m.update(&mut point, &motion, Pressure::from_pascals(answer));
            chain.step(&point.context);
            let added = chain.force(&point.context);
            assert!(added < -1.0, "{effect:?} adds {added} N");
            let force = m.force_with(&chain, &point.context);
            m.update(&mut point, &motion, Pressure::from_pascals(guess));
            let found = m.pressure_with(force, &chain, &point, Pressure::from_pascals(guess), &fine(&m));
            assert!((found.pressure.pascals() - answer).abs() < 1e-3, "{found:?}, not {answer}: {effect:?}");
            assert!(found.steps <= 5, "{} steps from {guess} to {answer}: {effect:?}", found.steps);
        }
    }
}
