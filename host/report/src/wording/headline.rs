//! The sentence with which an answer about changes begins.

use pam_diagnose::reference::{ChangeReport, Verdict};

/// "Nothing changed" is stated with its probability where the recordings make it less probable than it counts before them.
const DOUBTFUL: f64 = 0.8;

/// The sentence that stands first.
#[must_use]
pub fn headline(r: &ChangeReport) -> String {
    let names: Vec<&str> = r.missing.iter().map(|m| m.effect.as_str()).collect();
    let explained = 1.0 - r.unexplained.share;
    match r.verdict {
        Verdict::Consistent => consistent(r.probability("none")),
        Verdict::Explained => format!("What changed: {}.", names.join(", ")),
        Verdict::PartlyExplained if explained < 0.5 => format!(
            "What changed: {}. This explains {:.0} % of the difference; the larger part has no name.",
            names.join(", "),
            100.0 * explained
        ),
        Verdict::PartlyExplained => format!("What changed: {}; something else is left.", names.join(", ")),
        Verdict::Unexplained => {
            "Something changed, and no single known change describes it well enough to be named.".into()
        }
    }
}

fn consistent(none: f64) -> String {
    if none < DOUBTFUL {
        format!("No change stands out, but the probability that nothing changed is only {none:.2}.")
    } else {
        "No change beyond the normal repeatability of this actuator.".into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_changed_is_stated_with_its_doubt() {
        assert!(consistent(0.58).contains("is only 0.58"));
        assert!(consistent(0.97).starts_with("No change beyond"));
    }
}
