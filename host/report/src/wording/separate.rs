//! What separates changes that recordings do not.

use pam_diagnose::reference::answer::{ChangeReport, Changed};
use pam_diagnose::reference::shapes::Change;

use super::experiment::measure;

/// Proposals in one answer, at most.
const MOST_PROPOSALS: usize = 3;
/// A name that is more improbable is none of those to separate.
const LEAST: f64 = 0.05;

/// What shows each of these changes, in their order.
fn shows<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'static str> {
    let mut all = Vec::new();
    for effect in names.filter_map(Change::from_name).filter_map(Change::effect) {
        let proposal = measure(effect.traits().shown_by);
        if !all.contains(&proposal) && all.len() < MOST_PROPOSALS {
            all.push(proposal);
        }
    }
    all
}

/// What to record or to measure to separate a named change from those that may be meant instead; nothing without such.
#[must_use]
pub(crate) fn of_change(m: &Changed) -> Vec<&'static str> {
    if m.confusable_with.is_empty() {
        return Vec::new();
    }
    shows(std::iter::once(m.effect.as_str()).chain(m.confusable_with.iter().map(String::as_str)))
}

/// The names that are possible where none is given, with what separates them; nothing where they are improbable even together.
#[must_use]
pub(crate) fn of_unnamed(r: &ChangeReport) -> Option<(Vec<&str>, Vec<&'static str>)> {
    let possible = || r.probabilities.iter().filter(|p| Change::from_name(&p.cause).is_some());
    let together: f64 = possible().map(|p| p.probability).sum();
    let withdrawn = possible().any(|p| p.probability >= 0.5);
    if !r.missing.is_empty() || together < 0.5 || withdrawn {
        return None;
    }
    let names: Vec<&str> = possible().filter(|p| p.probability >= LEAST).map(|p| p.cause.as_str()).collect();
    let proposals = shows(names.iter().copied());
    Some((names, proposals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_one_experiment_need_it_once() {
        let both = shows(["viscous-damping", "rate-power"].into_iter());
        assert_eq!(both.len(), 1, "{both:?}");
        assert!(both[0].contains("speeds"), "{both:?}");
        assert_eq!(
            shows(["displacement-offset", "coulomb-friction", "contact-loss", "leak"].into_iter()).len(),
            3
        );
        assert!(shows(["none", "friction-factor"].into_iter()).is_empty());
    }
}
