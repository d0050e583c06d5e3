//! Stress that relaxes, and creep.

use model_core::effects::{Context, EffectName, MEMORY};

use super::{Alone, close, context, held, loaded};

#[test]
fn over_a_step_the_stress_relaxes_exponentially_however_time_is_cut() {
    for cuts in [1, 7, 1000, 30_000] {
        let mut alone = Alone::new("stress-relaxation", &[0.2, 0.0, 0.0, 10.0]);
        alone.at(context());
        let strained = Context { dt: 1e-6, ..held(-50.0) };
        close(alone.at(strained), -10.0, 2e-3);
        for _ in 0..cuts {
            alone.at(Context { dt: 15.0 / f64::from(cuts), ..strained });
        }
        close(alone.at(Context { dt: 0.0, ..strained }), -10.0 * (-1.5_f64).exp(), 3e-3);
    }
}

#[test]
fn a_ramp_is_stepped_over_exactly() {
    // dq/dt = r − q/τ from rest: q = r τ (1 − e^(−t/τ)).
    let mut alone = Alone::new("stress-relaxation", &[1.0, 0.0, 0.0, 2.0]);
    alone.at(context());
    for i in 1..=3 {
        let t = 1.7 * f64::from(i);
        let force = alone.at(Context { dt: 1.7, ..held(-4.0 * t) });
        close(force, -8.0 * (1.0 - (-t / 2.0).exp()), 1e-12);
    }
}

#[test]
fn a_pause_of_a_month_or_without_end_relaxes_all_and_keeps_on() {
    for pause in [2.6e6, f64::INFINITY] {
        let mut alone = Alone::new("log-creep", &[0.1, 0.0, 0.0, 1.0]);
        alone.at(context());
        alone.at(Context { dt: 1e-6, ..held(-50.0) });
        close(alone.at(Context { dt: pause, ..held(-50.0) }), 0.0, 1e-3 * 25.0);
        let again = alone.at(Context { dt: 1e-9, ..held(-60.0) });
        close(again, -0.1 * 5.0 * 10.0, 0.03);
    }
}

#[test]
fn creep_falls_by_its_amplitude_in_each_decade_of_time() {
    let mut alone = Alone::new("log-creep", &[0.1, 0.0, 0.0, 1.0]);
    alone.at(context());
    let strained = Context { dt: 1e-6, ..held(-50.0) };
    let start = alone.at(strained);
    let mut time = 0.0;
    let mut dt = 0.05;
    while time < 300.0 {
        let force = alone.at(Context { dt, ..strained });
        time += dt;
        dt *= 1.05;
        // The step is 50 N: 5 N per decade, with the ripple of one branch per decade.
        let law = start + 5.0 * (1.0 + 5.0 * time).log10();
        close(force, law, 0.11 * 5.0);
    }
}

/// Integrates `dz/dt = (u − z)/τ` with small steps, apart from the exact ones: the sum over a spectrum of decades.
fn creeping(drive: impl Fn(f64) -> f64, until: f64) -> f64 {
    let steps = 200_000;
    let dt = until / f64::from(steps);
    let mut z = [0.0; 5];
    for i in 0..steps {
        let u = drive((f64::from(i) + 0.5) * dt);
        for (z, tau) in z.iter_mut().zip([1.0, 10.0, 100.0, 1e3, 1e4]) {
            *z += (u - *z) * dt / tau;
        }
    }
    z.iter().sum()
}

#[test]
fn a_bladder_creeps_with_two_signs_and_the_next_run_remembers_it() {
    let (share, creeping_contact, contact, width) = (0.4, 50e3, 30e3, 100e3);
    let parameters = [share, creeping_contact, contact, width];
    // 500 kPa for 40 s, vented for 20 s, and again for 40 s, of a muscle whose wall takes much or little.
    for (wall, grows) in [(40.0, true), (2.0, false)] {
        let mut alone = Alone::new("bladder-creep", &parameters);
        let filled = loaded(50.0, -wall);
        let vented = loaded(0.0, 0.0);
        let engaged = filled.area * (1.0 - (-filled.pressure / width).exp());
        let steps = |alone: &mut Alone, at: Context<f64>, seconds: f64, n: i32| {
            (0..n).fold(0.0, |_, _| alone.at(Context { dt: seconds / f64::from(n), ..at }))
        };
        alone.at(vented);
        alone.at(Context { dt: 1e-9, ..filled });
        let first = steps(&mut alone, filled, 40.0, 7);
        let drive = |t: f64| if !(40.0..60.0).contains(&t) { 1.0 } else { 0.0 };
        let law = |z: f64| 0.2 * (share * wall - creeping_contact * engaged) * z - contact * engaged;
        close(first, law(creeping(drive, 40.0)), 0.01);
        assert_eq!(first > -contact * engaged, grows);
        alone.at(Context { dt: 1e-9, ..vented });
        steps(&mut alone, vented, 20.0, 3);
        alone.at(Context { dt: 1e-9, ..filled });
        let again = steps(&mut alone, filled, 40.0, 11);
        close(again, law(creeping(drive, 100.0)), 0.01);
        assert!((again - first).abs() > 0.02 * first.abs(), "{first} {again}");
        // Vented for long, it is as when it was mounted.
        alone.at(Context { dt: f64::INFINITY, ..vented });
        alone.at(Context { dt: 1e-9, ..filled });
        close(steps(&mut alone, filled, 40.0, 5), first, 1e-6);
    }
}

#[test]
fn a_fresh_pull_yields_and_remembers_it() {
    let mut alone = Alone::new("log-creep", &[0.0, 0.0, 0.02, 0.5]);
    let pulling = Context { quasi: 100.0, friction: 0.1, direction: 1.0, ..context() };
    // The first moment is a fresh load, of which nothing has yielded; then 2 % of what it pulls in each decade of time.
    assert_eq!(alone.at(pulling), 0.0);
    for (time, dt) in [(1.0, 1.0), (10.0, 9.0), (100.0, 90.0)] {
        let mut yielded = 0.0;
        for _ in 0..100 {
            yielded = alone.at(Context { dt: dt / 100.0, ..pulling });
        }
        let law = -0.02 * 100.0 * (1.0 + 5.0 * time / 0.5_f64).log10() * 0.9;
        close(yielded, law, 0.11 * 2.0);
    }
    let left = alone.at(Context { dt: 0.1, quasi: 0.0, ..pulling });
    assert!(left < -1.0, "released, it comes back as slowly: {left}");
    let second_run = alone.at(Context { dt: 0.1, ..pulling });
    assert!(second_run < -3.0, "and pulls less from the first moment: {second_run}");
}

#[test]
fn a_slack_muscle_loads_neither_bladder_nor_braid() {
    let mut alone = Alone::new("stress-relaxation", &[0.2, 0.0, 0.1, 10.0]);
    alone.at(loaded(0.0, 0.0));
    let vented = Context { dt: 1.0, gaylord: -20.0, ..loaded(0.0, -30.0) };
    assert_eq!(alone.at(vented), 0.0);
    // Pressurised until it just does not pull: the bladder carries what the pressure gives.
    let barely = Context { dt: 1e-6, ..loaded(20.0, -30.0) };
    close(alone.at(barely), -0.2 * 20.0 - 0.1 * 20.0, 1e-4);
}

#[test]
fn at_a_thousand_ticks_a_second_single_precision_keeps_slow_memories() {
    let effect = EffectName::StressRelaxation;
    let parameters = [1.0_f32, 0.0, 0.0, 1000.0];
    let mut memory = [0.0_f32; MEMORY];
    effect.step(&parameters, &context().cast(), &mut memory);
    let strained = Context { dt: 1e-3, ..held(-50.0) }.cast::<f32>();
    for _ in 0..200_000 {
        effect.step(&parameters, &strained, &mut memory);
    }
    let force = f64::from(effect.force(&parameters, &strained, &memory));
    close(force, -50.0 * (-0.2_f64).exp(), 50.0 * 1e-3);
}
