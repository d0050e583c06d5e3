//! The sentences of a diagnosis: one file per kind. The diagnosis itself holds values only.

pub mod change;
mod experiment;
mod headline;
mod hidden;
pub(crate) mod history;
mod outcome;
mod region;
mod remark;
pub(crate) mod separate;
mod summary;
pub mod timeline;
mod value;
mod why;
mod why_not;

pub(crate) use experiment::measure;
pub use experiment::proposal;
pub(crate) use hidden::{HiddenEffect, hidden};
pub(crate) use outcome::{one_bladder_misfits, only_first_runs_differ, split, unconfirmed};
pub use outcome::{pattern, verdict};
pub(crate) use region::region;
pub use remark::remark;
pub use summary::summary;
pub(crate) use summary::{traded_off, unexplained_base};
pub(crate) use value::with_interval;
pub(crate) use why::why;
pub use why_not::why_not;

/// `a`, `a and b`, `a, b and c`.
pub(crate) fn list(names: &[String]) -> String {
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}

/// With a capital and a full stop.
pub(crate) fn sentence(text: &str) -> String {
    let capital = capital(text);
    if capital.ends_with(['.', '!', '?']) || capital.is_empty() { capital } else { capital + "." }
}

/// With a capital.
pub(crate) fn capital(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or(String::new(), |first| first.to_uppercase().chain(characters).collect())
}
