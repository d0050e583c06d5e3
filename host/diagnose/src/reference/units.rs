//! Columns that seem to be in another unit than the reference's, recordings on both sides, and another actuator.

use super::answer::Remark;
use super::criteria::{FORCE_RATIO, UNIT_NEAR};
use super::motion::range;
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;

/// Factors between units that are often confused.
const FACTORS: [(f64, &str); 8] = [
    (1e3, "a thousand (such as N and kN, Pa and kPa)"),
    (1e6, "a million (such as Pa and MPa)"),
    (1e2, "a hundred (such as kPa and bar)"),
    (1e5, "a hundred thousand (such as Pa and bar)"),
    (4.448_222, "4.448 (N and lbf)"),
    (9.806_65, "9.807 (N and kgf)"),
    (6.894_757, "6.895 (kPa and psi)"),
    (14.503_8, "14.50 (bar and psi)"),
];

/// The factor that a ratio is near to, either way round.
fn factor(ratio: f64) -> Option<&'static str> {
    let near = |f: f64| (ratio / f - 1.0).abs() < UNIT_NEAR || (ratio * f - 1.0).abs() < UNIT_NEAR;
    FACTORS.iter().find(|(f, _)| near(*f)).map(|(_, words)| *words)
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
/// The same recording on both sides, nothing that moves, columns in another unit.
pub(super) fn check(before: &Campaign, after: &Campaign) -> Result<Vec<Remark>> {
    for a in &after.recordings {
        if let Some(b) = before.recordings.iter().find(|b| a.same_rows(b)) {
            let whom = if a.name == b.name {
                format!("`{}` is", a.name)
            } else {
                format!("`{}` and `{}` hold the same rows:", a.name, b.name)
            };
            return Err(Error::new(DataCode::CallInvalid, format!("{whom} on both sides of the comparison"))
                .file(&a.source)
                .help("give each recording once, before or after --reference; --where and --reference-where pick rows of one file"));
        }
    }
    let ((p0, f0), (p1, f1)) = (columns(before), columns(after));
    for (what, b, a) in [("pressure", &p0, &p1), ("force", &f0, &f1)] {
        if !(range(a) > 0.0) || !(range(b) > 0.0) {
            let side = if range(b) > 0.0 { "AFTER" } else { "the reference" };
            return Err(Error::new(
                DataCode::RecordingOutOfRange,
                format!("the {what} of {side} does not change"),
            )
            .help("a sensor that stands still says nothing; look at its cable and at the column"));
        }
        if let Some(words) = factor(range(a) / range(b)).filter(|_| factor(largest(a) / largest(b)).is_some())
        {
            return Err(Error::new(
                DataCode::RecordingUnknownUnit,
                format!("the {what} of AFTER and of the reference differ by a factor of about {words}"),
            )
            .help(format!(
                "AFTER reaches {:.4}, the reference {:.4} (SI); put the unit that was logged into the column's name, or scale it in an import description",
                largest(a),
                largest(b)
            )));
        }
    }
    let ratio = largest(&f1) / largest(&f0);
    let same_pressures = (largest(&p1) / largest(&p0) - 1.0).abs() < 0.1;
    let mut remarks = Vec::new();
    if same_pressures && !(ratio >= FORCE_RATIO.0 && ratio <= FORCE_RATIO.1) {
        remarks.push(Remark::ForceRatio(ratio));
    }
    Ok(remarks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_known_both_ways_and_a_gain_is_none() {
        assert!(factor(4.45).is_some() && factor(1.0 / 4.45).is_some() && factor(1e-3).is_some());
        assert!(factor(1.05).is_none() && factor(2.0).is_none() && factor(f64::NAN).is_none());
    }
}
