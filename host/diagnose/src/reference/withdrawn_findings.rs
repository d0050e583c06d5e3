//! Findings that are withdrawn: the difference is that of another actuator, or the named changes make held-out recordings worse.

use super::answer::{ChangeReport, Considered, Left, Remark, Split, Verdict, WhyNot};
use super::criteria::{LEFT_BY_NAMES, OTHER_ACTUATOR, UNSEEN_LEAST};

/// Withdraws the names of a report where it must not give any.
pub(super) fn withdraw(report: &mut ChangeReport) {
    if report.misfit_rms_N > OTHER_ACTUATOR * report.largest_force_N {
        report.remarks.push(Remark::OtherActuator);
        // Of another actuator everything differs, and the nearest shape is not a change.
        if report.held_out.rms_after_N > LEFT_BY_NAMES * report.largest_force_N {
            without_names(report);
        }
    }
    // A lag shows in rows in motion; the held-out cells are of rows at rest.
    let judged = !report.missing.iter().any(|m| m.change.is_lag());
    // A change that happened describes the recordings that did not determine its size, too, where it shows.
    let held = report.held_out.split != Split::None;
    if judged && held && report.held_out.share_where_shown < UNSEEN_LEAST {
        without_names(report);
    }
}

fn without_names(report: &mut ChangeReport) {
    if report.missing.is_empty() {
        return;
    }
    for named in std::mem::take(&mut report.missing) {
        report.considered.push(Considered {
            effect: named.effect,
            gain: named.probability,
            why_not: WhyNot::HeldOutWorse,
            detectable: None,
            unit: named.parameters.first().map(|p| p.unit.clone()).unwrap_or_default(),
        });
    }
    report.verdict = Verdict::Unexplained;
    report.held_out.rms_after_N = report.held_out.rms_before_N;
    report.held_out.share_where_shown = 0.0;
    report.unexplained = Left { share: 1.0, place: report.r#where.first().cloned() };
}

#[cfg(test)]
mod tests {
    use super::super::answer::Verdict;
    use super::super::{Against, Options, compare};
    use pam_data::recording::{Campaign, Recording};

    /// Pressure sweeps at three held lengths, two runs each; `more` is added to the force, by stroke, pressure and run.
    fn sweeps(start: f64, more: impl Fn(f64, f64, usize) -> f64) -> Campaign {
        let mut all = Vec::new();
        for (i, stroke) in [0.0, 4e-3, 8e-3].into_iter().enumerate() {
            for run in 0..2 {
                let begin = start + 100.0 * (2 * i + run) as f64;
                let time: Vec<f64> = (0..600).map(|k| begin + 0.1 * f64::from(k)).collect();
                let pressure: Vec<f64> = (0..600)
                    .map(|k| 300e3 * (1.0 - (f64::from(k) / 300.0 * std::f64::consts::TAU).cos()))
                    .collect();
                let ripple = |k: usize| 0.05 * ((7 * k % 13) as f64 / 6.0 - 1.0);
                let force = |(k, p): (usize, &f64)| {
                    (p - 50e3) * (3e-4 - 0.02 * stroke) + ripple(k) + more(stroke, *p, run)
                };
                let force = pressure.iter().enumerate().map(force).collect();
                let name = format!("{stroke} run {run} from {start}");
                all.push(Recording {
                    name,
                    stroke: vec![stroke; 600],
                    time,
                    pressure,
                    force: Some(force),
                    ..Recording::default()
                });
            }
        }
        Campaign::new(all)
    }

    #[test]
    fn a_name_that_does_not_describe_held_out_recordings_is_withdrawn() {
        let before = sweeps(0.0, |_, _, _| 0.0);
        let options = Options::default();
        // The same change in every run is named; one that turns round from run to run is not.
        let lasting = sweeps(700.0, |_, _, _| 6.0);
        let report = compare(&lasting, Against::Recordings(&before), &options).expect("comparable");
        assert_eq!(report.missing.first().map(|m| m.effect.as_str()), Some("force-offset"), "{report:?}");
        let turning = sweeps(700.0, |stroke, p, run| {
            let sign = if (run + (stroke * 250.0) as usize).is_multiple_of(2) { 1.0 } else { -1.0 };
            sign * 12.0 * (p / 150e3).sin()
        });
        let report = compare(&turning, Against::Recordings(&before), &options).expect("comparable");
        assert!(report.missing.is_empty(), "{:?}", report.missing);
        assert_ne!(report.verdict, Verdict::Explained);
    }
}
