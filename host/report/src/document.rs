//! Result documents: what a program reads. Typed, with the names of the enums of a diagnosis.

mod diagnosis;

pub use diagnosis::{DiagnosisDocument, diagnosis_json};
