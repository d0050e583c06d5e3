//! Columns that seem to be in another unit than the reference's, and another actuator.

use super::answer::Remark;
use super::criteria::{FORCE_RATIO, SAME_PRESSURES, UNIT_FACTORS, UNIT_FAR, UNIT_NEAR};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_data::statistics::range;

/// The factor that a ratio is near to, either way round.
fn factor(ratio: f64) -> Option<&'static str> {
    let near = |f: f64| (ratio / f - 1.0).abs() < UNIT_NEAR || (ratio * f - 1.0).abs() < UNIT_NEAR;
    UNIT_FACTORS.iter().find(|(f, _)| near(*f)).map(|(_, text)| *text)
}

fn columns(campaign: &Campaign) -> (Vec<f64>, Vec<f64>) {
    let pressure = campaign.recordings.iter().flat_map(|r| r.pressure.iter().copied()).collect();
    let force = campaign.recordings.iter().filter_map(|r| r.force.as_ref()).flatten().copied().collect();
    (pressure, force)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a, v| f64::max(a, v.abs()))
}

/// Looks at both sides before anything is computed.
///
/// # Errors
/// Nothing that moves, columns in another unit.
pub(super) fn check(before: &Campaign, after: &Campaign) -> Result<Vec<Remark>> {
    let ((p0, f0), (p1, f1)) = (columns(before), columns(after));
    for (what, b, a) in [("pressure", &p0, &p1), ("force", &f0, &f1)] {
        if !(range(a) > 0.0) || !(range(b) > 0.0) {
            let side = if range(b) > 0.0 { "AFTER" } else { "the reference" };
            return Err(Error::new(
                DataCode::RecordingOutOfRange,
                format!("the {what} of {side} does not change"),
            )
            .help("a constant reading holds no information; look at its cable and at the column"));
        }
        if let Some(factor) =
            factor(range(a) / range(b)).filter(|_| factor(largest(a) / largest(b)).is_some())
        {
            return Err(Error::new(
                DataCode::RecordingUnknownUnit,
                format!("the {what} of AFTER and of the reference differ by a factor of about {factor}"),
            )
            .help(format!(
                "AFTER reaches {:.4}, the reference {:.4} (SI); put the unit that was logged into the column's name, or scale it in an import description",
                largest(a),
                largest(b)
            )));
        }
    }
    let ratio = largest(&f1) / largest(&f0);
    let same_pressures = (largest(&p1) / largest(&p0) - 1.0).abs() < SAME_PRESSURES;
    let mut remarks = Vec::new();
    if same_pressures && !(ratio >= FORCE_RATIO.0 && ratio <= FORCE_RATIO.1) {
        remarks.push(Remark::ForceRatio(ratio));
    }
    Ok(remarks)
}

/// Whether the pressure of AFTER is in the unit of a table's; `most`: the table's highest, Pa.
///
/// # Errors
/// Another unit.
pub(super) fn check_pressure(after: &Campaign, most: f64) -> Result<()> {
    same_unit("pressure", largest(&columns(after).0), most)
}

/// Whether the force of AFTER is in the unit of a table's; `most`: the largest that the table gives at the lengths of AFTER, N.
///
/// # Errors
/// Another unit.
pub(super) fn check_force(after: &Campaign, most: f64) -> Result<()> {
    same_unit("force", largest(&columns(after).1), most)
}

/// A table reaches to higher pressures and forces than many recordings: only a column that is larger than it can be, or by far too
/// small, is in another unit.
fn same_unit(what: &str, found: f64, known: f64) -> Result<()> {
    let ratio = found / known;
    let far = ratio > FORCE_RATIO.1 || ratio * UNIT_FAR < 1.0;
    match factor(ratio).filter(|_| far) {
        None => Ok(()),
        Some(factor) => Err(Error::new(
            DataCode::RecordingUnknownUnit,
            format!("the {what} of AFTER and of the table differ by a factor of about {factor}"),
        )
        .help(format!(
            "AFTER reaches {found:.4}, the table {known:.4} (SI); put the unit that was logged into the column's name, or scale it in an import description"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_may_be_smaller_than_the_table_and_not_in_another_unit() {
        // A seventh of the table's pressure is not psi; pounds are smaller than newtons, kilopascals a thousand times pascals.
        assert!(same_unit("pressure", 100e3, 690e3).is_ok() && same_unit("force", 400.0, 440.0).is_ok());
        assert!(same_unit("pressure", 690e6, 690e3).is_err() && same_unit("pressure", 620.0, 630e3).is_err());
        assert!(same_unit("force", 4.4e5, 440.0).is_err() && same_unit("force", f64::NAN, 1.0).is_ok());
    }

    #[test]
    fn factors_are_known_both_ways_and_a_gain_is_none() {
        assert!(factor(4.45).is_some() && factor(1.0 / 4.45).is_some() && factor(1e-3).is_some());
        assert!(factor(1.05).is_none() && factor(2.0).is_none() && factor(f64::NAN).is_none());
    }
}
