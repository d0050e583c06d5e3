//! The document of `host import --json`.

// Field names carry their unit as the JSON does.
#![allow(non_snake_case)]

use serde::Serialize;

/// What a file seems to be.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Import {
    pub schema: &'static str,
    pub file: String,
    /// Whether the file is read without a description, with the same signs, zeros and runs.
    pub usual: bool,
    pub rows: usize,
    pub columns: Vec<Column>,
    /// Columns that set runs apart.
    pub split_by: Vec<String>,
    /// The recordings that the description gives; none where it does not suffice.
    pub recordings: Vec<Recording>,
    pub unused: Vec<String>,
    /// What could not be understood.
    pub unknown: Vec<String>,
    /// What the user has to check.
    pub checks: Vec<String>,
    /// The import description, TOML.
    pub description: String,
}

/// One column that was understood.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Column {
    pub quantity: &'static str,
    pub column: String,
    pub unit: &'static str,
    /// Value in `unit` = cell · scale + offset.
    pub scale: f64,
    pub offset: f64,
    /// The least cell.
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// One recording.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Recording {
    pub name: String,
    pub rows: usize,
    pub rows_per_s: f64,
    pub held_stroke_mm: Option<f64>,
}
