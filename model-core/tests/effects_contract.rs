//! What every effect promises, tried on all of them: a force that is linear in the amplitudes, memories that stay finite over any
//! motion and any pause, and the same answer in single precision as in double.

use model_core::effects::{
    Chain, Context, EffectName, FittedEffect, MAX_PARAMETERS, MEMORY, Memory, Role, Start,
};
use model_core::inverse::Attainability;
use model_core::motion::{MotionSettings, MotionTracker};
use model_core::muscle::{Muscle, OperatingPoint};
use model_core::table;
use model_core::units::{Force, Length, Pressure};
use proptest::prelude::*;

/// The catalogue's names of what belongs to the muscle.
const CATALOGUE: [&str; 25] = [
    "pressure-lag",
    "leak",
    "tip-effect",
    "braid-elasticity",
    "contact-loss",
    "strand-jamming",
    "end-slip",
    "permanent-set",
    "higher-order-elasticity",
    "mullins-softening",
    "cyclic-softening",
    "thermal-softening",
    "stress-relaxation",
    "log-creep",
    "coulomb-friction",
    "pressure-friction",
    "friction-asymmetry",
    "seal-friction",
    "breakaway-friction",
    "stribeck-friction",
    "presliding-hysteresis",
    "minor-loop-memory",
    "viscous-damping",
    "rate-power",
    "bladder-creep",
];

fn muscle() -> Muscle<f64> {
    Muscle::build(&table::example()).expect("a valid table")
}

/// One leg of a motion: where to, how fast, with how many readings.
#[derive(Clone, Debug)]
struct Leg {
    stroke: f64,
    pressure: f64,
    dt: f64,
    readings: usize,
}

fn leg() -> impl Strategy<Value = Leg> {
    let dt = prop_oneof![4 => Just(1e-3), 4 => Just(1e-2), 2 => 1e-3..0.2_f64, 1 => Just(1800.0)];
    (-0.5e-3..2.5e-3_f64, 0.0..560e3_f64, dt, 1..60_usize).prop_map(|(stroke, pressure, dt, readings)| Leg {
        stroke,
        pressure,
        dt,
        readings,
    })
}

fn motion(legs: &[Leg]) -> Vec<Context<f64>> {
    let muscle = muscle();
    let mut tracker = MotionTracker::new(MotionSettings::default());
    let (mut x, mut p) = (0.0, 100e3);
    let mut contexts = Vec::new();
    for leg in legs {
        let (x0, p0) = (x, p);
        for i in 1..=leg.readings {
            let share = i as f64 / leg.readings as f64;
            x = x0 + (leg.stroke - x0) * share;
            p = p0 + (leg.pressure - p0) * share;
            let mut m = *tracker.step(leg.dt, x, p);
            m.temperature = 295.0 + 3.0 * share;
            contexts.push(muscle.context(&m, Pressure::from_pascals(p)));
        }
    }
    contexts
}

/// Parameters in the middle of their ranges, with the amplitudes scaled.
fn middle(effect: EffectName, scale: f64) -> Vec<f64> {
    let mid =
        |low: f64, high: f64| if low > 0.0 { (low * high).sqrt() } else { 0.5 * (low + high) + 0.1 * high };
    effect
        .info()
        .parameters
        .iter()
        .map(|p| if p.role == Role::Amplitude { scale * mid(p.low, p.high) } else { mid(p.low, p.high) })
        .collect()
}

fn trace(effect: EffectName, parameters: &[f64], contexts: &[Context<f64>]) -> (Vec<f64>, Memory<f64>) {
    let mut memory = [0.0; MEMORY];
    let forces = contexts.iter().map(|c| {
        effect.step(parameters, c, &mut memory);
        effect.force(parameters, c, &memory)
    });
    (forces.collect(), memory)
}

#[test]
fn the_whole_catalogue_is_there_under_its_names() {
    for name in CATALOGUE {
        assert!(EffectName::from_name(name).is_some(), "{name} is missing");
    }
    assert_eq!(EffectName::ALL.len(), CATALOGUE.len());
}

#[test]
fn the_description_of_each_effect_is_consistent() {
    for effect in EffectName::ALL {
        let info = effect.info();
        let shapes = info.parameters.len() - info.amplitudes();
        assert!(info.amplitudes() >= 1 && shapes <= 2, "{}", info.name);
        assert!(info.parameters.len() <= MAX_PARAMETERS, "{}", info.name);
        assert!(info.parameters[info.amplitudes()..].iter().all(|p| p.role == Role::Shape), "{}", info.name);
        for p in info.parameters {
            assert!(p.low < p.high && p.low.is_finite() && p.high.is_finite(), "{} of {}", p.name, info.name);
        }
        assert!(info.fading.iter().all(|s| *s < MEMORY), "{}", info.name);
        assert!(info.fading.is_empty() || info.start == Start::Settled, "{}", info.name);
        assert!(!info.persistent || info.start != Start::Settled, "{}", info.name);
    }
}

/// Postcard writes an effect as its place in the list. If this fails an effect was inserted: tables that are out there would
/// name another one. Move it to the end.
#[test]
fn the_order_on_the_wire_stays() {
    let first: Vec<&str> = EffectName::ALL.iter().map(|e| e.info().name).take(6).collect();
    let expected =
        ["coulomb-friction", "viscous-damping", "stress-relaxation", "pressure-lag", "leak", "tip-effect"];
    assert_eq!(first, expected);
    assert_eq!(EffectName::ALL[23].info().name, "rate-power");
    let mut buffer = [0; 8];
    let bytes = postcard::to_slice(&EffectName::RatePower, &mut buffer).expect("one byte");
    assert_eq!(bytes, [23]);
}

#[test]
fn whether_the_force_depends_on_the_pressure_of_the_moment_is_reported() {
    let contexts = motion(&[
        Leg { stroke: 2e-3, pressure: 400e3, dt: 1e-2, readings: 200 },
        Leg { stroke: 0.5e-3, pressure: 450e3, dt: 1e-2, readings: 100 },
    ]);
    let last = contexts.last().expect("readings");
    let mut moved = muscle().context(
        &MotionTracker::new(MotionSettings::default()).step(0.0, last.stroke, 0.0).clone(),
        Pressure::from_pascals(300e3),
    );
    moved = Context {
        pressure: 300e3,
        corrected_pressure: moved.corrected_pressure,
        gaylord: moved.gaylord,
        elastic: moved.elastic,
        quasi: moved.quasi,
        friction: moved.friction,
        stiffness: moved.stiffness,
        pressure_slope: moved.pressure_slope,
        ..*last
    };
    for effect in EffectName::ALL {
        let parameters = middle(*effect, 1.0);
        let (_, memory) = trace(*effect, &parameters, &contexts);
        let change = effect.force(&parameters, &moved, &memory) - effect.force(&parameters, last, &memory);
        if change != 0.0 {
            assert!(effect.info().depends_on_pressure, "{}", effect.info().name);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn the_force_is_linear_in_the_amplitudes(legs in prop::collection::vec(leg(), 1..8)) {
        let contexts = motion(&legs);
        for effect in EffectName::ALL {
            let amplitudes = effect.info().amplitudes();
            let whole = middle(*effect, 1.0);
            let (force, memory) = trace(*effect, &whole, &contexts);
            let mut sum = vec![0.0; force.len()];
            for i in 0..amplitudes {
                let mut one = whole.clone();
                for (j, a) in one.iter_mut().take(amplitudes).enumerate() {
                    *a = if i == j { 1.0 } else { 0.0 };
                }
                let (column, alone) = trace(*effect, &one, &contexts);
                prop_assert_eq!(alone, memory, "the memory of {} depends on an amplitude", effect.info().name);
                for (s, c) in sum.iter_mut().zip(column) {
                    *s += whole[i] * c;
                }
            }
            let size = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            for (a, b) in force.iter().zip(&sum) {
                prop_assert!((a - b).abs() <= 1e-9 * size.max(1e-9), "{}: {} and {}", effect.info().name, a, b);
            }
        }
    }

    #[test]
    fn memories_stay_finite_over_any_motion_and_pause(legs in prop::collection::vec(leg(), 1..12), endless in any::<bool>()) {
        let mut contexts = motion(&legs);
        if endless && let Some(c) = contexts.last_mut() {
            c.dt = f64::INFINITY;
        }
        for effect in EffectName::ALL {
            // The ends of the plausible range and beyond: zeros, as a careless table may hold them.
            for parameters in [middle(*effect, 1.0), vec![0.0; effect.info().parameters.len()], vec![1e6; effect.info().parameters.len()]] {
                let parameters32: Vec<f32> = parameters.iter().map(|p| *p as f32).collect();
                let mut memory = [0.0_f32; MEMORY];
                for c in &contexts {
                    let c = c.cast::<f32>();
                    effect.step(&parameters32, &c, &mut memory);
                    let force = effect.force(&parameters32, &c, &memory);
                    prop_assert!(force.is_finite(), "{} gives {} with {:?}", effect.info().name, force, parameters);
                }
                prop_assert!(memory.iter().all(|m| m.is_finite() && m.abs() < 1e12), "{}: {:?}", effect.info().name, memory);
            }
        }
    }

    #[test]
    fn single_precision_gives_the_same_force(legs in prop::collection::vec(leg(), 2..8)) {
        let contexts = motion(&legs);
        for effect in EffectName::ALL {
            let parameters = middle(*effect, 1.0);
            let (exact, _) = trace(*effect, &parameters, &contexts);
            let parameters32: Vec<f32> = parameters.iter().map(|p| *p as f32).collect();
            let mut memory = [0.0_f32; MEMORY];
            let size = exact.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            // Sums of the parts' sizes, as a small difference of large parts keeps only their digits.
            let parts = contexts.iter().fold(0.0_f64, |m, c| m.max(c.quasi.abs()));
            for (c, exact) in contexts.iter().zip(&exact) {
                let c = c.cast::<f32>();
                effect.step(&parameters32, &c, &mut memory);
                let force = f64::from(effect.force(&parameters32, &c, &memory));
                prop_assert!(
                    (force - exact).abs() <= 3e-3 * size + 1e-6 * parts,
                    "{}: {} and {} of {}", effect.info().name, force, exact, size
                );
            }
        }
    }
}

#[test]
fn a_chain_adds_its_effects_and_gives_its_memories_back() {
    let fitted = |effect: EffectName| FittedEffect::new(effect, &middle(effect, 1.0));
    let effects = [EffectName::MullinsSoftening, EffectName::StressRelaxation, EffectName::CoulombFriction];
    let list: Vec<FittedEffect> = effects.iter().copied().map(fitted).collect();
    let mut chain = Chain::<f64>::new(&list);
    let contexts = motion(&[
        Leg { stroke: 2e-3, pressure: 400e3, dt: 1e-2, readings: 50 },
        Leg { stroke: 1e-3, pressure: 400e3, dt: 1e-2, readings: 50 },
    ]);
    let alone: Vec<Vec<f64>> = effects
        .iter()
        .zip(&list)
        .map(|(e, f)| trace(*e, &f.parameters.iter().map(|p| f64::from(*p)).collect::<Vec<_>>(), &contexts).0)
        .collect();
    for (i, c) in contexts.iter().enumerate() {
        chain.step(c);
        let sum: f64 = alone.iter().map(|a| a[i]).sum();
        assert!((chain.force(c) - sum).abs() < 1e-12 * sum.abs().max(1.0));
    }
    let mut woken = Chain::<f64>::new(&list);
    let kept: Vec<Memory<f64>> = chain.memories().map(|(_, m)| *m).collect();
    for (position, memory) in kept.iter().enumerate() {
        woken.restore(position, memory);
    }
    assert_eq!(woken, chain);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// `force_with(pressure_with(F)) = F` with every effect, alone and all four places of a table taken, where the force rises.
    #[test]
    fn the_inverse_undoes_the_force_with_every_effect(
        legs in prop::collection::vec(leg(), 1..5),
        stroke in 0.0..2.0e-3_f64,
        truth in 120e3..540e3_f64,
        guess in 80e3..560e3_f64,
        others in prop::array::uniform3(0..24_usize),
        scale in 0.02..1.0_f64,
    ) {
        let muscle = muscle();
        let mut legs = legs;
        legs.push(Leg { stroke, pressure: 300e3, dt: 1e-3, readings: 20 });
        let contexts = motion(&legs);
        for effect in EffectName::ALL {
            let names = [*effect, EffectName::ALL[others[0]], EffectName::ALL[others[1]], EffectName::ALL[others[2]]];
            for count in [1, 4] {
                let list: Vec<FittedEffect> = names[..count]
                    .iter()
                    .map(|e| FittedEffect::new(*e, &middle(*e, scale)))
                    .collect();
                let mut chain = Chain::<f64>::new(&list);
                for c in &contexts {
                    chain.step(c);
                }
                let now = contexts.last().expect("readings");
                let at_stroke = muscle.at_stroke(Length::from_metres(now.stroke));
                let slopes = muscle.slopes(&at_stroke);
                let point = OperatingPoint { at_stroke, slopes, context: *now };
                let force_at = |p: f64| {
                    let mut moved = *now;
                    muscle.move_to(&mut moved, &at_stroke, &slopes, Pressure::from_pascals(p));
                    moved.force() + chain.force(&moved)
                };
                // Only a force that rises with pressure has one pressure that belongs to it.
                let rises = (0..100).all(|i| force_at(6e3 * f64::from(i + 1)) > force_at(6e3 * f64::from(i)));
                if !rises {
                    continue;
                }
                let wanted = force_at(truth);
                let found = muscle.pressure_with(
                    Force::from_newtons(wanted), &chain, &point, Pressure::from_pascals(guess), &muscle.search(),
                );
                prop_assert_eq!(found.attainability, Attainability::Attainable, "{:?}", names);
                let again = force_at(found.pressure.pascals());
                let near = (found.slope.abs() * 2.0).max(1e-9);
                prop_assert!((again - wanted).abs() <= near, "{:?}: {} for {}", &names[..count], again, wanted);
                prop_assert!(found.steps <= 12, "{:?}: {} steps", &names[..count], found.steps);
            }
        }
    }

    /// Whatever a table holds, in single precision and for a force saturated: it ends within the limits and says so.
    #[test]
    fn the_inverse_ends_for_every_table(
        stroke in -2.0e-3..20.0e-3_f64,
        wanted in -1e3..1e3_f32,
        names in prop::array::uniform4(0..24_usize),
        scale in prop_oneof![Just(1.0), Just(1e3), Just(-30.0), Just(0.0)],
    ) {
        let muscle = Muscle::<f32>::build(&table::example()).expect("a valid table");
        let list: Vec<FittedEffect> = names
            .iter()
            .map(|i| FittedEffect::new(EffectName::ALL[*i], &middle(EffectName::ALL[*i], scale)))
            .collect();
        let mut chain = Chain::<f32>::new(&list);
        let contexts = motion(&[Leg { stroke, pressure: 300e3, dt: 1e-2, readings: 10 }]);
        for c in &contexts {
            chain.step(&c.cast());
        }
        let context = contexts.last().expect("readings").cast::<f32>();
        let at_stroke = muscle.at_stroke(Length::from_metres(context.stroke));
        let point = OperatingPoint { slopes: muscle.slopes(&at_stroke), at_stroke, context };
        let found = muscle.pressure_with(
            Force::from_newtons(wanted), &chain, &point, Pressure::from_kilopascals(300.0), &muscle.search(),
        );
        prop_assert!(found.pressure.pascals() >= 0.0 && found.pressure <= muscle.max_pressure());
        if found.attainability == Attainability::BeyondBlockedForce {
            prop_assert_eq!(found.pressure, muscle.max_pressure());
        }
    }
}

#[test]
fn a_controller_takes_over_the_muscle_as_its_recordings_left_it() {
    let contexts = motion(&[
        Leg { stroke: 2e-3, pressure: 400e3, dt: 1e-2, readings: 100 },
        Leg { stroke: 0.0, pressure: 400e3, dt: 1e-2, readings: 100 },
        Leg { stroke: 1e-3, pressure: 400e3, dt: 1e-2, readings: 50 },
    ]);
    let last = contexts.last().expect("readings");
    for effect in EffectName::ALL {
        let mut parameters = middle(*effect, 0.5);
        if *effect == EffectName::EndSlip {
            parameters[1] = 0.5;
        }
        let (forces, memory) = trace(*effect, &parameters, &contexts);
        let fitted = FittedEffect::new(*effect, &parameters).left_with(&memory);
        assert_eq!(fitted.remembered.is_empty(), !effect.info().persistent, "{}", effect.info().name);
        if !effect.info().persistent {
            continue;
        }
        // The controller's clock and count begin again; the force is the one the recording ended with.
        let mut chain = Chain::<f64>::resumed(&[fitted]);
        let first = Context { dt: 0.0, time: 0.0, cycles: 0.0, ..*last };
        chain.step(&first);
        let end = forces.last().expect("readings");
        assert!(
            (chain.force(&first) - end).abs() <= 1e-5 * end.abs() + 1e-9,
            "{}: {} after {end}",
            effect.info().name,
            chain.force(&first)
        );
    }
}
