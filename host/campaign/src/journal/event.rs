//! The events of a campaign, as the lines of its log hold them.

use pam_fit::checks;
use serde::{Deserialize, Serialize};

use crate::step::Step;
use crate::watch::Spoiled;

/// Why a step was chosen and what was expected of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chosen {
    /// Number of the step in the campaign, from 1.
    pub number: u32,
    /// The step.
    pub step: Step,
    /// Why, in one sentence.
    pub why: String,
    /// Expected information about the table, nats.
    pub table_nats: f64,
    /// About which effect it is, nats.
    pub effect_nats: f64,
    /// About effects that nothing has shown yet, nats.
    pub unseen_nats: f64,
    /// Predicted standard error of the table on unseen pressures and strokes before the step, N; zero while it is not known.
    pub predicted_error: f64,
    /// Bench time that was expected, s.
    pub expected_s: f64,
    /// Time that choosing took, s.
    pub choosing_s: f64,
}

/// One line of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// A campaign began, or continued after an interruption.
    Begin {
        /// Schema of the log.
        schema: String,
        /// The muscle's name.
        muscle: String,
        /// Seconds since 1970.
        unix_s: u64,
        /// Clock of the campaign, s.
        clock_s: f64,
    },
    /// A step was chosen.
    Chosen(Chosen),
    /// A step is recorded.
    Recorded {
        /// Its number.
        number: u32,
        /// The recording; none for a step that records nothing.
        file: String,
        /// Its rows.
        rows: u64,
        /// Clock at its beginning, s.
        begin_s: f64,
        /// Clock at its end, s.
        end_s: f64,
    },
    /// A step was recorded and is worth nothing.
    Spoiled {
        /// Its number.
        number: u32,
        /// The recording, kept under a name that the fit does not read.
        file: String,
        /// Rows in it.
        rows: u64,
        /// Why it is worth nothing.
        reason: Spoiled,
        /// Clock at its end, s.
        end_s: f64,
    },
    /// Rows of an interrupted step.
    Cut {
        /// Its number.
        number: u32,
        /// What was kept of it.
        file: String,
        /// Rows in it.
        rows: u64,
    },
    /// A check of the bench was made.
    Checked {
        /// Number of the step.
        number: u32,
        /// Which check of the bench it was.
        check: checks::Kind,
        /// Its file.
        file: String,
        /// Clock at its end, s.
        end_s: f64,
    },
    /// What a step showed.
    #[serde(rename = "finding", alias = "told")]
    Finding {
        /// Its number.
        number: u32,
        /// As text.
        #[serde(rename = "words")]
        text: String,
    },
    /// The campaign ended.
    Ended {
        /// The reason, as text.
        reason: String,
        /// Clock, s.
        clock_s: f64,
    },
}
