//! The arithmetic of integral, trim and stroke loop.

use super::*;

fn stepped(from: f32, rate: f32, limit: f32, saturation: f32) -> f32 {
    let mut integral = Integral(from);
    integral.step(rate, limit, saturation);
    integral.value()
}

#[test]
fn an_integral_moves_by_its_rate_unless_it_pushes_further_against_a_limit() {
    // Value before, rate per second, limit, what was cut off the last command; value after a thousandth of a second.
    let cases = [
        (2.0, 500.0, 10.0, 0.0, 2.5),
        (2.0, -500.0, 10.0, 0.0, 1.5),
        (9.9, 500.0, 10.0, 0.0, 10.0),
        (-9.9, -500.0, 10.0, 0.0, -10.0),
        (2.0, 500.0, 10.0, 3.0, 2.0),
        (2.0, -500.0, 10.0, -3.0, 2.0),
        (2.0, -500.0, 10.0, 3.0, 1.5),
        (2.0, 500.0, 10.0, -3.0, 2.5),
        // A smaller limit comes into force without an error.
        (10.0, 0.0, 5.0, 0.0, 5.0),
    ];
    for (from, rate, limit, saturation, to) in cases {
        let found = stepped(from, rate, limit, saturation);
        assert!(
            (found - to).abs() < 1e-5,
            "{found}, not {to}, from {from} at {rate} ({limit}, {saturation})"
        );
    }
    let mut integral = Integral(3.0);
    integral.reset();
    assert_eq!(integral, Integral::default());
    assert_eq!(integral.value(), 0.0);
}

#[test]
fn a_trim_is_proportional_and_integral_within_its_limit() {
    let mut law =
        ForceLoop { proportional_pa_per_n: 100.0, integral_pa_per_n_s: 5_000.0, trim_limit_pa: 1e4 };
    for (error_n, after, trim_pa) in
        [(2.0, 13.0, 213.0), (-2.0, -7.0, -207.0), (200.0, 1_003.0, 1e4), (-200.0, -997.0, -1e4)]
    {
        let mut integral = Integral(3.0);
        let found = trim(&law, &mut integral, error_n, 0.0);
        assert!((found - trim_pa).abs() < 1e-2, "{found} Pa for {error_n} N");
        assert!((integral.value() - after).abs() < 1e-2, "{integral:?} after {error_n} N");
    }
    let mut held = Integral(3.0);
    assert!((trim(&law, &mut held, 2.0, 1.0) - 203.0).abs() < 1e-3 && held == Integral(3.0));
    law.trim_limit_pa = 0.0;
    assert_eq!(trim(&law, &mut held, 2.0, 0.0), 0.0);
}

#[test]
fn a_stroke_loop_adds_load_error_integral_and_damping_within_its_limit() {
    let law = StrokeLoop {
        proportional_n_per_m: 2_000.0,
        integral_n_per_m_s: 50_000.0,
        damping_n_s_per_m: 50.0,
        load_n: 5.0,
        load_stiffness_n_per_m: 1_000.0,
        force_limit_n: 40.0,
    };
    // Integral before, stroke, and what was cut off the last command; force and integral after.
    let cases = [
        // 5 + 1000·0.004 + 2000·0.002 + 3 − 50·0.02 = 15, and 50 N/(mm·s) of 2 mm in a millisecond are 0.1.
        (3.0, 1e-3, 0.0, 15.0, 3.1),
        (3.0, 1e-3, 2.0, 15.0, 3.0),
        (3.0, 5e-3, 2.0, 7.0, 2.9),
        (3.0, 5e-3, -2.0, 7.0, 3.0),
        // At its own limits the loop holds the integral.
        (35.0, 1e-3, 0.0, 40.0, 35.0),
        (35.0, 1e-3, -2.0, 40.0, 35.0),
        (-30.0, 5e-3, 0.0, 0.0, -30.0),
        (-30.0, 1e-3, 2.0, 0.0, -29.9),
    ];
    for (from, stroke_m, saturation, newtons, after) in cases {
        let mut integral = Integral(from);
        let found = stroke_force(&law, &mut integral, [3e-3, 4e-3], stroke_m, 0.02, saturation);
        assert!((found - newtons).abs() < 1e-3, "{found} N, not {newtons}, from {from} at {stroke_m}");
        assert!(
            (integral.value() - after).abs() < 1e-4,
            "{integral:?}, not {after}, from {from} at {stroke_m}"
        );
    }
    // A smaller limit comes into force without an error, and where the load wants no pull.
    let narrow = StrokeLoop { load_n: -100.0, force_limit_n: 20.0, ..law };
    let mut integral = Integral(50.0);
    assert_eq!(stroke_force(&narrow, &mut integral, [3e-3; 2], 3e-3, 0.0, 0.0), 0.0);
    assert_eq!(integral.value(), 20.0);
}
