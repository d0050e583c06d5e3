//! The effects that recordings could hide, by what would show them.

use pam_diagnose::experiment::what_would_show;
use pam_diagnose::remark::Remark;
use pam_diagnose::verdict::{Considered, Diagnosis};

use super::experiment::{measure, needs_strokes};

/// An effect, and the size up to which it could be hidden as text.
pub(crate) struct HiddenEffect<'a> {
    pub(crate) effect: &'a str,
    pub(crate) size: String,
}

/// What recordings could hide.
#[derive(Default)]
pub(crate) struct Hidden<'a> {
    /// By what would show it.
    pub(crate) by_measure: Vec<(&'static str, Vec<HiddenEffect<'a>>)>,
    /// What only a moving muscle shows, of one that is used at held lengths: strokes are not advice for it.
    pub(crate) moving: Vec<HiddenEffect<'a>>,
}

/// The effects that the recordings of a diagnosis could hide.
pub(crate) fn hidden(d: &Diagnosis) -> Hidden<'_> {
    let held = d.remarks.contains(&Remark::HeldLength);
    let mut hidden = Hidden::default();
    for considered in d.could_hide() {
        let effect = HiddenEffect { effect: &considered.effect, size: size(considered) };
        let shown_by = what_would_show(&considered.effect);
        if held && needs_strokes(shown_by) {
            hidden.moving.push(effect);
            continue;
        }
        let measure = measure(shown_by);
        match hidden.by_measure.iter_mut().find(|m| m.0 == measure) {
            Some(known) => known.1.push(effect),
            None => hidden.by_measure.push((measure, vec![effect])),
        }
    }
    hidden
}

fn size(of: &Considered) -> String {
    of.hidden_up_to_N.map_or_else(|| "of any size".to_owned(), |n| format!("up to {n:.1} N"))
}
