//! The judgement, the residual, and how rows were held out.

use pam_diagnose::remark::Remark;
use pam_diagnose::verdict::{Diagnosis, Pattern, Split, Unconfirmed, Verdict};

use super::{list, region, remark};

/// Whether tables that differ between pressures hide an error of the model.
#[must_use]
pub(crate) fn one_bladder_misfits(d: &Diagnosis) -> bool {
    d.remarks.iter().any(|r| matches!(r, Remark::Concealed { .. }))
}

/// Whether the model agrees with all runs but the first of each mounting.
#[must_use]
pub(crate) fn only_first_runs_differ(d: &Diagnosis) -> bool {
    d.remarks.iter().any(|r| matches!(r, Remark::FirstRuns { others_agree: true, .. }))
}

/// The judgement in one sentence.
#[must_use]
pub fn verdict(d: &Diagnosis) -> String {
    let names: Vec<String> = d.missing.iter().map(|m| format!("`{}`", m.effect)).collect();
    match d.verdict() {
        Verdict::Consistent if !d.judged() => {
            "These recordings do not allow a judgement of the model.".to_owned()
        }
        Verdict::Consistent if one_bladder_misfits(d) => {
            "Model and recordings agree at each pressure, but one bladder does not describe all pressures."
                .to_owned()
        }
        Verdict::Consistent => {
            "Model and recordings agree: no error exceeds the noise and the model's stated inexactness."
                .to_owned()
        }
        Verdict::Explained if d.missing.iter().any(|m| !m.supported) => given(d),
        Verdict::Explained => match d.explained_beside_small_rest() {
            None => format!("The model lacks {}. This explains its error above the noise.", list(&names)),
            Some(share) => format!(
                "The model lacks {}. This explains {:.0} % of its error above the noise; the rest is within the model's stated inexactness.",
                list(&names),
                100.0 * share
            ),
        },
        Verdict::PartlyExplained => {
            format!("The model lacks {}. This explains a part of its error above the noise.", list(&names))
        }
        Verdict::Unexplained if only_first_runs_differ(d) => {
            "The model agrees with all runs but the first of each mounting, and no effect of the library explains these.".to_owned()
        }
        Verdict::Unexplained if !d.unconfirmed().is_empty() => {
            "The model lacks something. Effects of the library fit its error, but no better than chance or slow noise could.".to_owned()
        }
        Verdict::Unexplained if matches!(d.unexplained.pattern, Pattern::NotRepeatable(_)) => {
            noise(&d.unexplained.pattern)
        }
        Verdict::Unexplained => {
            "The model lacks something, but no effect of the library explains it well enough to be named."
                .to_owned()
        }
    }
}

/// What effects that were given, of which the recordings do not support all, leave: for the verdict "explained".
#[must_use]
pub fn given(d: &Diagnosis) -> String {
    let unsupported: Vec<String> =
        d.missing.iter().filter(|m| !m.supported).map(|m| format!("`{}`", m.effect)).collect();
    let share = 100.0 * (1.0 - d.unexplained.share).clamp(0.0, 1.0);
    format!(
        "The given effects explain {share:.0} % of the model's error above the noise; the rest is within the model's stated inexactness. The \
         recordings do not support {}.",
        list(&unsupported)
    )
}

/// An error that does not repeat is noise, whatever its size: no law of the muscle makes it.
fn noise(pattern: &Pattern) -> String {
    match pattern {
        Pattern::NotRepeatable(s) => format!(
            "The error is noise with a memory of about {:.1} s: it does not repeat under the same conditions, and no effect fits.",
            s.memory
        ),
        _ => String::new(),
    }
}

/// The effects that would remove much of an error for which nothing is named.
#[must_use]
pub(crate) fn unconfirmed(d: &Diagnosis) -> Option<String> {
    let effect = |u: &Unconfirmed| format!("{} ({:.0} %)", u.effect, 100.0 * u.share);
    let all: Vec<String> = d.unconfirmed().iter().map(effect).collect();
    (!all.is_empty()).then(|| {
        format!(
            "Not confirmed, because chance or slow noise could do the same, but they would remove at least half of the squared error: {}",
            all.join(", ")
        )
    })
}

/// The pattern of what no named effect explains; `none` where there is none.
#[must_use]
pub fn pattern(pattern: &Pattern) -> String {
    match pattern {
        Pattern::None => "none".to_owned(),
        Pattern::Periodic(hertz) => format!("periodic in time, {hertz:.2} Hz"),
        Pattern::Region(r) => region(r),
        Pattern::NotRepeatable(scatter) => remark::scatter(scatter),
    }
}

/// How rows were held out.
#[must_use]
pub(crate) fn split(split: Split) -> String {
    let text = match split {
        Split::Runs(runs) => {
            return format!(
                "each of {runs} runs predicted from the other runs of this muscle, on settled points"
            );
        }
        Split::NothingFitted => "none: nothing was fitted",
        Split::NothingLeftOut => {
            "none: no part of the recordings could be left out, so these are errors on the fitted rows"
        }
        Split::Pressures => "each pressure predicted from the others",
        Split::Cycles => "every fourth cycle predicted from the others, in turn",
        Split::Recordings => "each recording predicted from the others",
        Split::TenthRecordings => "every tenth recording predicted from the others, in turn",
        Split::Quarters => "each quarter of the time predicted from the rest",
        Split::StrokeParts => "every fourth part of the stroke predicted from the others, in turn",
    };
    text.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use pam_diagnose::remark::Scatter;

    #[test]
    fn noise_with_a_memory_is_called_so() {
        let said = noise(&Pattern::NotRepeatable(Scatter { sigma: 0.4, share: 0.003, memory: 6.2 }));
        assert!(
            said.contains("noise with a memory of about 6.2 s") && said.contains("no effect fits"),
            "{said}"
        );
    }
}
