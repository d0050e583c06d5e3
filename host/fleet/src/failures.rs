//! What went wrong with a muscle, as a row of the table `failures`.

use std::path::Path;

use pam_data::error::Error;
use serde::Serialize;

/// The step at which a muscle failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// The row of the manifest.
    Manifest,
    /// Finding and reading the input files.
    Read,
    /// The fit of the table.
    Fit,
    /// The diagnosis, or the comparison with a reference.
    Diagnose,
}

impl Stage {
    /// Its name in the column `stage`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Manifest => "manifest",
            Self::Read => "read",
            Self::Fit => "fit",
            Self::Diagnose => "diagnose",
        }
    }
}

/// One failure: code, cause, place and remedy.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Failure {
    /// The step that failed.
    pub stage: Stage,
    /// The stable code, such as `recording::not-a-number`.
    pub code: String,
    /// What is wrong.
    pub cause: String,
    /// File, line, column and value, as far as they apply.
    pub place: String,
    /// What to do about it.
    pub remedy: String,
}

impl Failure {
    /// Of an error; places in `folder` are named relative to it, so that the same inputs give the same row wherever they lie.
    #[must_use]
    pub fn of(stage: Stage, error: &Error, folder: &Path) -> Self {
        let mut place = error.place().clone();
        if let Some(file) = &mut place.file
            && let Ok(inner) = file.strip_prefix(folder)
        {
            *file = inner.to_path_buf();
        }
        Self {
            stage,
            code: error.code().name().to_owned(),
            cause: error.cause().to_owned(),
            place: place.to_string(),
            remedy: error.advice().unwrap_or_else(|| error.code().remedy()).to_owned(),
        }
    }
}
