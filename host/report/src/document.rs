//! Result documents: what a program reads. Typed, with the names of the enums of a diagnosis.

mod change;
mod diagnosis;
mod history;

pub use change::change_json;
pub use diagnosis::{DiagnosisDocument, diagnosis_json};
