//! The table of before with the changes of the actuator applied: what minutes of recordings allow where a fit needs a campaign.

use model_core::effects::FittedEffect;
use model_core::table::MuscleTable;
use pam_data::recording::{Campaign, Recording};
use pam_fit::bench::Candidate;
use pam_fit::predict::predict;
use pam_fit::table_file::TableFile;

use super::answer::{ChangeReport, Changed};
use super::criteria::{UPDATE_COVERED, UPDATE_LAWS, UPDATE_LEVELS};
use super::runs::mountings;
use super::shapes::{Change, Class, Coefficient};
use super::strokes::levels;
use pam_data::statistics::range;

/// Whether recordings reach over what the table was tested at, so that a table can be fitted to them.
pub(super) fn covers(after: &Campaign, table: &MuscleTable) -> bool {
    let rest = f64::from(table.geometry.rest_length.metres());
    let tested = &table.tested;
    let spans = |column: &dyn Fn(&Recording) -> &[f64], wanted: f64| {
        let values: Vec<f64> = after.recordings.iter().flat_map(column).copied().collect();
        range(&values) >= UPDATE_COVERED * wanted
    };
    let pressures = f64::from(tested.pressure_high.pascals() - tested.pressure_low.pascals());
    let strokes = rest * f64::from(tested.contraction_high - tested.contraction_low);
    let conditions = levels(&[after]).len().max(mountings(&after.recordings).len());
    spans(&|r| &r.pressure, pressures) && spans(&|r| &r.stroke, strokes) && conditions >= UPDATE_LEVELS
}

/// Whether a change is repaired at the bench: a slip of an end, and lost air.
pub(super) fn is_repaired(changed: &Changed) -> bool {
    changed.class == Class::EndSlip || changed.change.effect().is_some_and(|e| e.traits().loses_air)
}

/// Applies one change to the table; `false` where the table has no place for it. `which`: the law that a size without a law belongs to.
fn apply(table: &mut MuscleTable, changed: &Changed, which: usize) -> bool {
    let Some(size) = changed.parameters.first().map(|p| p.value) else { return false };
    match changed.change {
        Change::Coefficient(Coefficient::ElasticStiffening) => {
            let curves = table.elastic.iter_mut().flatten();
            curves.for_each(|e| *e = (f64::from(*e) * (1.0 + size)) as f32);
            true
        }
        Change::Coefficient(Coefficient::FrictionFactor) => {
            table.friction.iter_mut().for_each(|k| *k = (f64::from(*k) + size) as f32);
            true
        }
        change => match change.effect().and_then(|e| law(e, changed, which)) {
            Some(effect) => table.effects.push(effect).is_ok(),
            None => false,
        },
    }
}

/// The effect with the sizes of the change, by their names. `None` for a law that a table does not have.
fn law(candidate: Candidate, changed: &Changed, which: usize) -> Option<FittedEffect> {
    let Candidate::Muscle(effect) = candidate else { return None };
    let listed = effect.info().parameters;
    let position = |name: &str| listed.iter().position(|p| p.name == name);
    let mut values = vec![0.0; listed.len()];
    match changed.parameters.as_slice() {
        [only] if position(&only.name).is_none() && listed.len() == effect.info().amplitudes() => {
            *values.get_mut(which)? = only.value;
        }
        several => {
            for p in several {
                values[position(&p.name)?] = p.value;
            }
        }
    }
    Some(FittedEffect::new(effect, &values))
}

/// The table with all changes of the actuator. Recordings at held lengths give friction one size, and an effect may have several laws for it:
/// the one that predicts AFTER best is taken. Gives the rms of its error there, too, N.
///
/// # Errors
/// The name of the first change that a table has no place for.
pub(super) fn updated(
    file: &TableFile,
    report: &ChangeReport,
    after: &Campaign,
) -> Result<(f64, TableFile), String> {
    let mut best: Option<(f64, TableFile)> = None;
    let mut without_place = String::new();
    for which in 0..UPDATE_LAWS {
        let mut new = file.clone();
        let own = report.missing.iter().filter(|m| !m.correction);
        if let Some(m) = own.clone().find(|m| !apply(&mut new.table, m, which)) {
            without_place.clone_from(&m.effect);
            continue;
        }
        let rms = predict(&new, after).ok().and_then(|p| p.rms).unwrap_or(f64::INFINITY);
        if best.as_ref().is_none_or(|(least, _)| rms < *least) {
            best = Some((rms, new));
        }
    }
    best.ok_or(without_place)
}
