//! Why an effect is named.

use pam_diagnose::why::{Chance, ChangePoint, Evidence, UnseenError, Why};

/// The reason as text without its full stop.
#[must_use]
pub(crate) fn why(why: &Why) -> String {
    match why {
        Why::Found(e) => evidence(e),
        Why::Measured { check, value } => format!("measured with {check}: {value}"),
        // What was found stands under the history.
        Why::Memory { without_pct, with_pct, gain, least_gain, one_time_constant_ratio } => format!(
            "error of unseen runs, at pressures that another run of the mounting reaches: {without_pct:.2} % of the largest force without \
             it, {with_pct:.2} % with it (rms); the squared error falls by {:.0} % (at least {:.0} % is required); a single time constant leaves {one_time_constant_ratio:.2} times as much",
            100.0 * gain,
            100.0 * least_gain,
        ),
        Why::SlackReading { reading, mountings, follows_pressure: false } => format!(
            "while the muscle is slack, the load cell reads {reading:.1} N, with the same sign in all {mountings} mountings"
        ),
        Why::SlackReading { reading, mountings, follows_pressure: true } => format!(
            "while the muscle is slack, the reading of the load cell grows with the pressure in all {mountings} mountings; the least slope \
             makes {reading:.1} N at the highest pressure"
        ),
        Why::GivenWithoutSize => {
            "given, but the recordings do not support it: its fitted amplitude is zero".to_owned()
        }
        Why::GivenSupported(e, u) => {
            format!("given, and the recordings support it: {}; {}", evidence(e), unseen(u))
        }
        Why::GivenNoImprovement(u) => format!("given, but the recordings do not support it: {}", unseen(u)),
        Why::GivenNoEvidence { share, unseen: u } => format!(
            "given, but the recordings do not support it: it explains {:.0} % of the excess error, no more than chance or the tables \
             do; {}",
            100.0 * share,
            unseen(u)
        ),
    }
}

fn evidence(e: &Evidence) -> String {
    let chance = match e.chance {
        Chance::Tested { effects, p } => {
            let p = if p < 5e-5 { "p < 0.0001".to_owned() } else { format!("p = {p:.4}") };
            format!("{p} of finding as much by chance among all {effects} effects")
        }
        Chance::FewStrokes { p, log_ratio } => format!(
            "it acts in too few half-strokes for a test by blocks (p = {p:.2}), but is {} as likely as chance",
            times(log_ratio)
        ),
    };
    let change =
        e.change_point.as_ref().map_or(String::new(), |c| format!("; it happened {}", change_point(c)));
    format!(
        "it explains {:.0} % of the excess error with the model refitted; {chance}{change}",
        100.0 * e.share
    )
}

fn unseen(u: &UnseenError) -> String {
    format!("error on held-out rows: {:.3} N without it, {:.3} N with it", u.without, u.with)
}

fn change_point(m: &ChangePoint) -> String {
    match m {
        ChangePoint::Before(name) => format!("before {name} began"),
        ChangePoint::After(name) => format!("after the end of {name}"),
        ChangePoint::Between(a, b) => format!("between {a} and {b}"),
        ChangePoint::In(name, seconds) => format!("in {name}, {seconds:.1} s after its first reading"),
    }
}

/// A ratio by its logarithm; beyond a million the digits carry nothing.
fn times(logarithm: f64) -> String {
    if logarithm < 1e6_f64.ln() {
        format!("{:.0} times", logarithm.exp())
    } else {
        "more than a million times".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_given_effect_is_reported_as_supported_or_not() {
        let unseen = UnseenError { without: 0.5, with: 0.2 };
        let found = Evidence {
            share: 0.83,
            chance: Chance::FewStrokes { p: 0.2, log_ratio: 1e3 },
            change_point: Some(ChangePoint::In("run-2".into(), 3.04)),
        };
        let text = why(&Why::GivenSupported(found, unseen));
        assert!(text.starts_with("given, and the recordings support it: it explains 83 %"), "{text}");
        assert!(
            text.contains("more than a million times") && text.contains("in run-2, 3.0 s after"),
            "{text}"
        );
        assert!(text.ends_with("error on held-out rows: 0.500 N without it, 0.200 N with it"), "{text}");
        for not in [
            Why::GivenWithoutSize,
            Why::GivenNoImprovement(unseen),
            Why::GivenNoEvidence { share: 0.1, unseen },
        ] {
            assert!(why(&not).contains("do not support it"), "{not:?}");
        }
    }
}
