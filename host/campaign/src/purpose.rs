//! What a campaign is for.

use serde::{Deserialize, Serialize};

/// What a campaign is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Purpose {
    /// The force table.
    Fit,
    /// What the model leaves out.
    Diagnosis,
    /// The force table and what the model leaves out.
    #[default]
    Both,
}
