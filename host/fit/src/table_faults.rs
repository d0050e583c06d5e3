//! What makes a table useless for control: values that no muscle has, a force that the recordings contradict, pressures that the inverse
//! cannot find. `host fit` and `host table check` use this one list.

use model_core::effects::EffectName;
use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use model_core::units::{Length, Pressure};

use crate::table_file::{FitQuality, Uncertainty};
use pam_data::statistics::NORMAL_95;

/// Values this close to zero, as a share of the highest tested pressure or of the blocked force, count as zero: an ordinary gauge or load
/// cell is no better.
const NEAR_ZERO: f64 = 0.01;
/// Creep between filling and emptying looks like a small negative friction. Its force, as a share of the blocked force, is no more than
/// the drift of a polymer bladder over one staircase, some per cent; below this the sign or the timing of a column is wrong.
const CREEP: f64 = 0.03;
/// A mean error above this, percent of blocked force, is not a description of the recordings: a wrong unit, sign or dimension is more likely
/// than physics that the model lacks.
pub(crate) const WORST_MEAN_ERROR: f64 = 10.0;
/// A force that rises by this share over the tested contraction is none that friction, creep, or a mounting error of a millimetre feigns.
const RISE: f64 = 0.1;
/// The inverse may fail at this share of the tested places (pressure and contraction) at most: the corners of the range.
const LOST_PLACES: f64 = 0.05;
/// Places over the ranges of pressure and contraction at which the inverse is examined.
const STEPS: usize = 20;

/// What is wrong with a table, a sentence each, with the remedy; empty where nothing is.
///
/// ```
/// use pam_fit::table_faults::table_faults;
/// use pam_fit::table_file::FitQuality;
/// use model_core::units::Pressure;
///
/// let mut table = model_core::table::example();
/// assert!(table_faults(&table, None, &FitQuality::default()).is_empty());
/// table.deadband = Pressure::from_pascals(-14e3);
/// assert!(table_faults(&table, None, &FitQuality::default())[0].contains("P0 is -14.0 kPa"));
/// ```
#[must_use]
pub fn table_faults(
    table: &MuscleTable,
    uncertainty: Option<&Uncertainty>,
    quality: &FitQuality,
) -> Vec<String> {
    let faults = [
        deadband(table, uncertainty),
        friction(table, uncertainty),
        error(quality),
        shortening(table),
        push(table),
        inverse(table),
    ];
    faults.into_iter().flatten().collect()
}

/// Half of the 95 % confidence interval of a number of the table; zero where nothing was estimated.
fn half_interval(uncertainty: Option<&Uncertainty>, row: usize) -> f64 {
    let Some(u) = uncertainty else { return 0.0 };
    let columns = u.columns as usize;
    let root = u.root.get(row * columns..(row + 1) * columns).unwrap_or(&[]);
    NORMAL_95 * root.iter().map(|s| s * s).sum::<f64>().sqrt()
}

/// A deadband below zero beyond its uncertainty. Pressure that a contact of bladder and braid takes is a part of the deadband.
fn deadband(table: &MuscleTable, uncertainty: Option<&Uncertainty>) -> Option<String> {
    let p0 = f64::from(table.deadband.pascals()) + contact(table);
    let half = half_interval(uncertainty, 0);
    let least = -NEAR_ZERO * f64::from(table.tested.pressure_high.pascals());
    (p0 < least && p0 + half < 0.0).then(|| {
        format!(
            "the deadband pressure P0 is {:.1} kPa: a muscle cannot pull without pressure; check the zero of the pressure sensor and the \
             dimensions of the muscle (--fit-geometry, --fit-lengths)",
            p0 / 1e3
        )
    })
}

/// What the contact of bladder and braid takes immediately at the highest tested pressure, Pa: `d (1 − e^(−P/P_c))` of `bladder-creep`.
fn contact(table: &MuscleTable) -> f64 {
    let high = f64::from(table.tested.pressure_high.pascals());
    let creep = table.effects.iter().find(|e| e.effect == EffectName::BladderCreep);
    creep.map_or(0.0, |creep| match creep.parameters[..] {
        [_, _, taken, width] => f64::from(taken) * (1.0 - (-high / f64::from(width).max(1.0)).exp()),
        _ => 0.0,
    })
}

/// A force of friction noticeably below zero, beyond its uncertainty, at a node inside the tested pressures.
fn friction(table: &MuscleTable, uncertainty: Option<&Uncertainty>) -> Option<String> {
    let nodes = table.nodes.len();
    let tested = table.tested.pressure_low.pascals()..=table.tested.pressure_high.pascals();
    let p0 = table.deadband.pascals();
    let negative = |i: &usize| {
        let k = f64::from(table.friction[*i]);
        // Without elasticity the force at rest length is proportional to `P − P0`.
        let share = f64::from((table.nodes[*i] - p0) / (table.tested.pressure_high.pascals() - p0));
        let half = half_interval(uncertainty, 1 + table.order() * nodes + i);
        tested.contains(&table.nodes[*i]) && k * share.clamp(0.0, 1.0) < -CREEP && k + half < 0.0
    };
    let worst =
        (0..nodes).filter(negative).min_by(|a, b| table.friction[*a].total_cmp(&table.friction[*b]))?;
    Some(format!(
        "k_F is {:.3} at {:.0} kPa: negative friction is impossible; check the sign of the displacement, whether the readings are \
         synchronous, and whether several pressures were tested",
        table.friction[worst],
        table.nodes[worst] / 1e3
    ))
}

/// A force that the recordings contradict.
fn error(quality: &FitQuality) -> Option<String> {
    // A table of unknown origin has no figures.
    let bad = quality.samples > 0 && !(quality.mean_error_percent <= WORST_MEAN_ERROR);
    bad.then(|| {
        format!(
            "the table does not describe its recordings: the mean error is {:.0} % of the blocked force (bound: {WORST_MEAN_ERROR:.0} %); \
             check units, signs and the dimensions of the muscle",
            quality.mean_error_percent
        )
    })
}

/// A force that rises as the muscle shortens: the fibres of every braid then pull at a flatter angle, and the force falls.
fn shortening(table: &MuscleTable) -> Option<String> {
    let muscle = Muscle::<f64>::build(table).ok()?;
    let (t, l0) = (&table.tested, f64::from(table.geometry.rest_length.metres()));
    let at = |contraction: f32| {
        let held = muscle.at_stroke(Length::from_metres(f64::from(contraction) * l0));
        muscle.parts(&held, Pressure::from_pascals(f64::from(t.pressure_high.pascals()))).quasi()
    };
    let (long, short) = (at(t.contraction_low), at(t.contraction_high));
    (short > 0.0 && short - long > RISE * short).then(|| {
        format!(
            "the force rises from {long:.0} to {short:.0} N at {:.0} kPa as the muscle shortens by {:.1} % of its length: check the sign of \
             the displacement (positive = \"extension\" in an import description inverts it)",
            t.pressure_high.pascals() / 1e3,
            100.0 * (t.contraction_high - t.contraction_low)
        )
    })
}

/// A muscle that pushes at its longest tested length although its pressure is above the deadband.
fn push(table: &MuscleTable) -> Option<String> {
    let muscle = Muscle::<f64>::build(table).ok()?;
    let (t, l0) = (&table.tested, f64::from(table.geometry.rest_length.metres()));
    let held = muscle.at_stroke(Length::from_metres(f64::from(t.contraction_low) * l0));
    let (low, high) = (f64::from(t.pressure_low.pascals()), f64::from(t.pressure_high.pascals()));
    let onset = f64::from(table.deadband.pascals()) + contact(table);
    let pressures = (0..=STEPS).map(|i| low + (high - low) * i as f64 / STEPS as f64).filter(|p| *p > onset);
    let force = |p: f64| muscle.parts(&held, Pressure::from_pascals(p)).quasi();
    let (pressure, least) = pressures.map(|p| (p, force(p))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (least < -CREEP * force(high).abs()).then(|| {
        format!(
            "the force is {least:.0} N at {:.0} kPa and the longest tested length: a muscle under pressure pulls there; check the dimensions of \
             the muscle and the units (--fit-geometry)",
            pressure / 1e3
        )
    })
}

/// A mean error of more than [`WORST_MEAN_ERROR`] of the largest measured force, N: a table may be small beside its own blocked force, and
/// far from what was measured. For a fit, which knows the measured force.
pub(crate) fn far_from_measured(quality: &FitQuality, blocked: f64, largest: f64) -> Option<String> {
    let error = 0.01 * quality.mean_error_percent * blocked.abs();
    let percent = 100.0 * error / largest;
    (largest > 0.0 && blocked > largest && percent > WORST_MEAN_ERROR).then(|| {
        format!(
            "the table does not describe its recordings: the mean error is {error:.1} N, {percent:.0} % of the largest measured force (bound: \
             {WORST_MEAN_ERROR:.0} %); check units, signs and the dimensions of the muscle"
        )
    })
}

/// Places in the tested range where the force falls with rising pressure, so that the inverse may not find a pressure.
fn inverse(table: &MuscleTable) -> Option<String> {
    let muscle = Muscle::<f64>::build(table).ok()?;
    let l0 = f64::from(table.geometry.rest_length.metres());
    let between =
        |low: f32, high: f32, i: usize| f64::from(low) + f64::from(high - low) * i as f64 / STEPS as f64;
    let (t, blocked) = (&table.tested, table.blocked_force.newtons());
    let (mut pulling, mut lost) = (0_usize, Vec::new());
    for i in 0..=STEPS {
        let contraction = between(t.contraction_low, t.contraction_high, i);
        let held = muscle.at_stroke(Length::from_metres(contraction * l0));
        for j in 0..=STEPS {
            let pressure = between(t.pressure_low.pascals(), t.pressure_high.pascals(), j);
            let parts = muscle.parts(&held, Pressure::from_pascals(pressure));
            if parts.quasi() > NEAR_ZERO * f64::from(blocked) {
                pulling += 1;
                if !(parts.pressure_slope >= 0.0) {
                    lost.push((pressure, contraction));
                }
            }
        }
    }
    let (pressure, contraction) = *lost.get(lost.len() / 2)?;
    (lost.len() as f64 > LOST_PLACES * pulling as f64).then(|| {
        format!(
            "the force falls with rising pressure in {:.0} % of the tested range (about {:.0} kPa, contraction {contraction:.3}): the inverse \
             may not find a pressure there; record more pressures and lengths, or use a lower order",
            100.0 * lost.len() as f64 / pulling as f64,
            pressure / 1e3
        )
    })
}

#[cfg(test)]
mod tests {
    use model_core::effects::FittedEffect;

    use super::*;

    fn faults(table: &MuscleTable, uncertainty: Option<&Uncertainty>) -> Vec<String> {
        table_faults(table, uncertainty, &FitQuality::default())
    }

    #[test]
    fn a_value_that_its_uncertainty_explains_is_no_fault() {
        let mut table = model_core::table::example();
        table.friction[1] = -0.2;
        assert!(faults(&table, None).iter().any(|f| f.contains("k_F is -0.200")));
        let rows = 1 + table.nodes.len() * (table.order() + 1);
        let wide =
            Uncertainty { rows: rows as u32, columns: 1, root: vec![0.15; rows], residual_newtons: 1.0 };
        assert!(faults(&table, Some(&wide)).is_empty());
    }

    #[test]
    fn the_pressure_of_the_contact_is_a_part_of_the_deadband() {
        let mut table = model_core::table::example();
        table.deadband = Pressure::from_pascals(-18e3);
        assert!(faults(&table, None)[0].contains("P0 is -18.0 kPa"));
        let creep = |contact| FittedEffect::new(EffectName::BladderCreep, &[0.7, 1.7e4, contact, 1.2e5]);
        assert!(table.effects.push(creep(8e4)).is_ok());
        assert!(faults(&table, None).is_empty());
        table.effects[0] = creep(5e3);
        assert!(!faults(&table, None).is_empty());
    }

    #[test]
    fn a_muscle_that_pushes_under_pressure_is_a_fault() {
        let mut table = model_core::table::example();
        assert!(push(&table).is_none());
        // Beyond its free contraction every muscle pushes.
        (table.tested.contraction_low, table.tested.contraction_high) = (0.15, 0.2);
        assert!(push(&table).is_some_and(|f| f.contains("pulls there")), "{:?}", push(&table));
    }

    #[test]
    fn an_error_is_compared_with_the_measured_force_too() {
        let quality = FitQuality { samples: 10, mean_error_percent: 4.0, ..FitQuality::default() };
        assert!(
            far_from_measured(&quality, 1000.0, 100.0).is_some_and(|f| f.contains("40 % of the largest"))
        );
        assert!(far_from_measured(&quality, 130.0, 100.0).is_none());
    }

    #[test]
    fn an_error_without_a_number_is_a_fault() {
        let table = model_core::table::example();
        let of = |mean_error_percent| {
            let quality = FitQuality { samples: 10, mean_error_percent, ..FitQuality::default() };
            table_faults(&table, None, &quality).len()
        };
        assert_eq!([of(3.0), of(11.0), of(f64::NAN)], [0, 1, 1]);
    }

    #[test]
    fn a_force_that_rises_as_the_muscle_shortens_is_a_fault() {
        let mut table = model_core::table::example();
        assert!(faults(&table, None).is_empty());
        // Of a displacement with the other sign, the tested range lies on the other side of the rest length, and elasticity makes up for it.
        (table.tested.contraction_low, table.tested.contraction_high) = (-0.05, 0.0);
        table.elastic[1].iter_mut().for_each(|e| *e += 4e7);
        let found = faults(&table, None);
        assert!(found.iter().any(|f| f.contains("as the muscle shortens")), "{found:?}");
    }

    #[test]
    fn a_force_that_falls_with_pressure_is_a_fault() {
        let mut table = model_core::table::example();
        let last = table.nodes.len() - 1;
        table.elastic[0][last] -= 3e7;
        let message = faults(&table, None).join(" ");
        assert!(message.contains("may not find a pressure"), "{message}");
    }
}
