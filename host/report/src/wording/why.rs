//! Why an effect is named.

use pam_diagnose::why::{Chance, Evidence, Moment, UnseenError, Why};

/// The reason as text without its full stop.
#[must_use]
pub fn why(why: &Why) -> String {
    match why {
        Why::Found(e) => evidence(e),
        Why::Measured { check, value } => format!("measured with {check}: {value}"),
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
            format!("p = {p:.4} of finding as much by chance among all {effects} effects")
        }
        Chance::FewStrokes { p, log_ratio } => format!(
            "it acts in too few half-strokes for a test by blocks (p = {p:.2}), but is {} as likely as chance",
            times(log_ratio)
        ),
    };
    let moment = e.moment.as_ref().map_or(String::new(), |m| format!("; it happened {}", moment(m)));
    format!(
        "it explains {:.0} % of the excess error with the model refitted; {chance}{moment}",
        100.0 * e.share
    )
}

fn unseen(u: &UnseenError) -> String {
    format!("error on held-out rows: {:.3} N without it, {:.3} N with it", u.without, u.with)
}

fn moment(m: &Moment) -> String {
    match m {
        Moment::Before(name) => format!("before {name} began"),
        Moment::After(name) => format!("after the end of {name}"),
        Moment::Between(a, b) => format!("between {a} and {b}"),
        Moment::In(name, seconds) => format!("in {name}, {seconds:.1} s after its first reading"),
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
