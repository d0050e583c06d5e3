//! Each effect against what its law says in a case that can be worked out by hand.

use model_core::braid::miniature;
use model_core::effects::{BraidTravel, Context, EffectName, Link, MEMORY, Memory, decay};
use model_core::motion::Motion;
use model_core::muscle::Muscle;
use model_core::table;
use model_core::units::{Length, Pressure};

/// An effect by name with parameters, and its memory.
struct Alone {
    effect: EffectName,
    parameters: Vec<f64>,
    memory: Memory<f64>,
}

impl Alone {
    fn new(name: &str, parameters: &[f64]) -> Self {
        let effect = EffectName::from_name(name).expect("in the catalogue");
        assert_eq!(parameters.len(), effect.info().parameters.len(), "{name}");
        Self { effect, parameters: parameters.to_vec(), memory: [0.0; MEMORY] }
    }
    fn at(&mut self, context: Context<f64>) -> f64 {
        self.effect.step(&self.parameters, &context, &mut self.memory);
        self.effect.force(&self.parameters, &context, &self.memory)
    }
}

fn moment() -> Context<f64> {
    Context {
        // It pulls: the elastic force is smaller than Gaylord's.
        gaylord: 500.0,
        rest_length: 0.1,
        length: 0.1,
        radius: 5e-3,
        stiffness: -1e4,
        pressure_slope: 1e-4,
        area: 1e-4,
        ..Context::default()
    }
}

/// A muscle whose gas pulls with `gas` and whose bladder takes `bladder` (negative) from it, N.
fn loaded(gas: f64, bladder: f64) -> Context<f64> {
    let area = moment().area;
    Context { pressure: gas / area, area, gaylord: gas, elastic: bladder, quasi: gas + bladder, ..moment() }
}

/// The same, well filled.
fn held(bladder: f64) -> Context<f64> {
    loaded(500.0, bladder)
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} and {b}");
}

#[test]
fn over_a_step_the_stress_relaxes_exponentially_however_time_is_cut() {
    for cuts in [1, 7, 1000, 30_000] {
        let mut alone = Alone::new("stress-relaxation", &[0.2, 0.0, 0.0, 10.0]);
        alone.at(moment());
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
    alone.at(moment());
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
        alone.at(moment());
        alone.at(Context { dt: 1e-6, ..held(-50.0) });
        close(alone.at(Context { dt: pause, ..held(-50.0) }), 0.0, 1e-3 * 25.0);
        let again = alone.at(Context { dt: 1e-9, ..held(-60.0) });
        close(again, -0.1 * 5.0 * 10.0, 0.03);
    }
}

#[test]
fn creep_falls_by_its_amplitude_in_each_decade_of_time() {
    let mut alone = Alone::new("log-creep", &[0.1, 0.0, 0.0, 1.0]);
    alone.at(moment());
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
    let pulling = Context { quasi: 100.0, friction: 0.1, direction: 1.0, ..moment() };
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
    assert!(left < -1.0, "let go, it comes back as slowly: {left}");
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
    effect.step(&parameters, &moment().cast(), &mut memory);
    let strained = Context { dt: 1e-3, ..held(-50.0) }.cast::<f32>();
    for _ in 0..200_000 {
        effect.step(&parameters, &strained, &mut memory);
    }
    let force = f64::from(effect.force(&parameters, &strained, &memory));
    close(force, -50.0 * (-0.2_f64).exp(), 50.0 * 1e-3);
}

/// The strands' travel without the pressure's part.
fn travelled(alone: &mut Alone, from: f64, to: f64, direction: f64) -> f64 {
    let mut force = 0.0;
    for i in 1..=200 {
        let stroke = from + (to - from) * f64::from(i) / 200.0;
        force = alone.at(Context { stroke, direction, friction: 0.1, quasi: 100.0, ..moment() });
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
        quick.at(Context { stroke, ..moment() });
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
    BraidTravel::step(&Context { pressure: 1e5, ..moment() }, &mut memory, 0);
    // 10 kPa on 1 cm² pull 1 N more; at 10 N/mm that is 0.1 mm of free motion, and a twentieth of it of slip.
    close(BraidTravel::step(&Context { pressure: 1.1e5, ..moment() }, &mut memory, 0), 5e-6, 1e-12);
    close(BraidTravel::step(&Context { pressure: 1e5, ..moment() }, &mut memory, 0), -5e-6, 1e-12);
    // Without stiffness the travel stays bounded.
    let limp = Context { pressure: 2e5, stiffness: 0.0, ..moment() };
    assert!(BraidTravel::step(&limp, &mut memory, 0).abs() <= 0.1);
}

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
fn after_a_rest_it_sticks_the_longer_the_rest_and_lets_go_over_its_distance() {
    let stuck = |rest: f64, gone: f64| {
        let mut alone = Alone::new("breakaway-friction", &[5.0, 0.0, 0.0, 0.2e-3, 10.0]);
        let mut force = 0.0;
        for i in 1..=10 {
            force = alone.at(Context { hold_time: rest * f64::from(i) / 10.0, direction: 1.0, ..moment() });
        }
        assert_eq!(force, 0.0, "nothing is added at rest");
        alone.at(Context { stroke: gone, hold_time: rest, direction: 1.0, speed: 1e-3, ..moment() })
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
        ..moment()
    };
    alone.at(Context { hold_time: 50.0, resting: 1.0, direction: 1.0, ..moment() });
    assert!(alone.at(moving(1e-5, 50.0, 1.0)) < -4.0);
    assert!(alone.at(moving(5e-3, 50.0, 1.0)).abs() < 1e-6);
    close(alone.at(moving(4.9e-3, 0.0, -1.0)), 0.0, 1e-12);
    close(alone.at(moving(1e-5, 0.0, -1.0)), 0.0, 1e-12);
}

#[test]
fn slow_motion_rubs_more_and_the_seal_at_any_force() {
    let at = |name: &str, parameters: &[f64], speed: f64, direction: f64| {
        Alone::new(name, parameters).at(Context { speed, direction, pressure: 2e5, quasi: 0.0, ..moment() })
    };
    let stribeck = |v: f64| at("stribeck-friction", &[2.0, 0.0, 1e-3], v, 1.0);
    close(stribeck(0.0), -2.0, 1e-12);
    close(stribeck(1e-3), -2.0 * (-1.0_f64).exp(), 1e-3);
    assert!(stribeck(20e-3).abs() < 1e-6);
    // 1 N + 1e-5 m² (101.325 + 200) kPa, twice that at rest.
    let mut seal = Alone::new("seal-friction", &[1.0, 1e-5, 2.0, 1e-3]);
    let mut seal =
        |speed: f64, direction: f64| seal.at(Context { speed, direction, pressure: 2e5, ..moment() });
    close(seal(1.0, 1.0), -4.013_25, 1e-9);
    close(seal(0.0, -1.0), -2.0 * 4.013_25, 1e-9);
}

#[test]
fn speed_and_pressure_laws() {
    let moving = Context { speed: 4e-3, direction: 1.0, pressure: 2e5, quasi: 50.0, ..moment() };
    close(Alone::new("viscous-damping", &[100.0, 1e-3]).at(moving), -(100.0 + 200.0) * 4e-3, 1e-12);
    close(Alone::new("rate-power", &[0.01, 0.5]).at(moving), -0.01 * 50.0 * 2.0, 1e-12);
    let mut coulomb = Alone::new("coulomb-friction", &[3.0, 0.0]);
    // At held length the pressure turns the braid's friction, not a guide's.
    assert_eq!(coulomb.at(Context { direction: -1.0, ..moment() }), 0.0);
    close(coulomb.at(Context { direction: -1.0, speed: -1e-3, ..moment() }), 3.0, 0.0);
    close(coulomb.at(Context { direction: 1.0, ..moment() }), 3.0, 0.0);
    // Found at rest a centimetre further in, it came there by shortening.
    let mut moved = Alone::new("coulomb-friction", &[3.0, 0.0]);
    moved.at(Context { stroke: 0.0, resting: 1.0, ..moment() });
    close(moved.at(Context { stroke: 0.01, resting: 1.0, direction: -1.0, ..moment() }), -3.0, 0.0);
    // Strands that rub follow the pressure.
    let mut strands = Alone::new("coulomb-friction", &[0.0, 3.0]);
    close(strands.at(Context { resting: 1.0, direction: -1.0, ..moment() }), 3.0, 0.0);
    let area = core::f64::consts::PI * 25e-6;
    close(Alone::new("pressure-friction", &[0.1, 0.0]).at(moving), -0.1 * 2e5 * area, 1e-12);
    let unchanging = Alone::new("pressure-friction", &[0.0, 0.1]).at(Context { rest_radius: 4e-3, ..moving });
    close(unchanging, -0.1 * 2e5 * core::f64::consts::PI * 16e-6, 1e-12);
    close(Alone::new("friction-asymmetry", &[0.1]).at(moving), -2.5, 1e-12);
    close(Alone::new("friction-asymmetry", &[0.1]).at(Context { direction: -1.0, ..moving }), -2.5, 1e-12);
    assert_eq!(Alone::new("friction-asymmetry", &[0.1]).at(Context { direction: 0.0, ..moving }), 0.0);
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
        alone.at(Context { stroke: 5e-5 * f64::from(stroke), direction, ..moment() });
    }
    let expected = -1e4 * 1e-3 * (1.0 - (-2.0_f64).exp());
    close(alone.at(moment()), expected, 2e-2);
    // Somewhere else after a power-up, with the direction unknown.
    close(alone.at(Context { stroke: 4e-3, ..moment() }), expected, 2e-2);
}

#[test]
fn set_by_load_grows_with_its_impulse() {
    let mut alone = Alone::new("permanent-set", &[0.0, 1e-3, 0.5, 1e4]);
    for _ in 0..1000 {
        alone.at(Context { dt: 0.1, quasi: 50.0, ..moment() });
    }
    close(alone.at(moment()), -1e4 * 1e-3 * (1.0 - (-0.5_f64).exp()), 1e-2);
}

#[test]
fn a_late_pressure_costs_flow_times_resistance() {
    let mut alone = Alone::new("pressure-lag", &[1e9, 0.1, 0.0, 0.2]);
    alone.at(moment());
    // 10 mm/s with 1 cm² draw 1 cm³/s; 1e9 Pa·s/m³ cost 1 kPa of 1e-4 N/Pa. 20 kPa/s for 0.1 s cost 2 kPa.
    let moving = Context { dt: 0.1, speed: 0.01, pressure_rate: 20e3, ..moment() };
    for _ in 0..100 {
        alone.at(moving);
    }
    close(alone.at(moving), -0.1 - 0.2, 1e-9);
    // It decays in a dwell, as viscous friction does not.
    let dwell = Context { dt: 1e-9, ..moment() };
    close(alone.at(dwell), -0.3, 2e-3);
    close(alone.at(Context { dt: 0.2, ..moment() }), -0.3 * (-1.0_f64).exp(), 2e-2);
}

#[test]
fn a_muscle_that_fills_by_mass_loses_what_the_gas_law_asks_for() {
    let mut alone = Alone::new("pressure-lag", &[0.0, 0.0, 0.1, 0.2]);
    let moving =
        Context { dt: 0.1, speed: 0.01, pressure: 200e3, pressure_rate: 20e3, rest_radius: 4e-3, ..moment() };
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
        let c = Context { corrected_pressure, radial_strain: 0.5, ..moment() };
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
    let c = Context { corrected_pressure: pressure, length, fibre_length: b, turns: n, ..moment() };
    let force = Alone::new("braid-elasticity", &[compliance]).at(c);
    close(force, change, 1e-3 * change.abs());
    assert!(force < 0.0);
}

#[test]
fn what_the_wall_carries_does_not_stretch_the_fibres() {
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
    let c = Context { contraction: 0.1, corrected_pressure: 3e5, pressure: 3e5, ..moment() };
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
        ..moment()
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

#[test]
fn what_changes_the_balance_is_rubbed_with_it() {
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
                // What warmth does to friction itself is no part of the balance.
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
