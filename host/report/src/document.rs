//! Result documents: what a program reads. Typed, with the words that the enums of a diagnosis stand for.

mod diagnosis;

pub use diagnosis::{DiagnosisDocument, diagnosis_json};
