//! The state of a muscle before the first row of a recording, for laws with a memory.
//!
//! A memory is carried on from recording to recording. Where the muscle was vented and filled in between, its strands have slipped, so that
//! friction opposes the first stroke from its beginning. Its bladder begins to creep or to relax under the whole pressure, not under the change
//! from the last one.

use model_core::effects::{Context, Info, Link, Start};
use serde::{Deserialize, Serialize};

/// How long a muscle was vented before it was just filled, s: a thousand times the longest memory of the catalogue.
const VENTED: f64 = 1e9;

/// What is known of the muscle before the first row of a recording. By default it is as the recording before left it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Beginning {
    /// The first stroke had begun long before, for laws that remember the last reversal.
    pub within_stroke: bool,
    /// The muscle had been vented for long and was just filled, for memories of the bladder.
    pub just_filled: bool,
}

impl Beginning {
    /// Whether a law remembers the last reversal.
    #[must_use]
    pub fn is_of_reversal(law: &Info) -> bool {
        law.start == Start::Branch
    }

    /// Whether a law remembers the load of the bladder.
    #[must_use]
    pub fn is_of_load(law: &Info) -> bool {
        law.link == Link::Memory && law.start == Start::Settled
    }

    /// Whether a law begins otherwise than the recording before ended.
    #[must_use]
    pub fn concerns(self, law: &Info) -> bool {
        self.within_stroke && Self::is_of_reversal(law) || self.just_filled && Self::is_of_load(law)
    }

    /// What a law that is concerned has seen before the first row of a recording. `stroke` is a row of the first stroke.
    #[must_use]
    pub fn before(first: &Context<f64>, stroke: &Context<f64>, law: &Info) -> Context<f64> {
        if Self::is_of_load(law) {
            let unloaded = Context { pressure: 0.0, corrected_pressure: 0.0, gaylord: 0.0, ..*first };
            Context { dt: VENTED, quasi: first.elastic, ..unloaded }
        } else {
            // A place from which the stroke comes, farther away than any memory reaches.
            let from = first.stroke - stroke.direction * first.rest_length;
            Context { stroke: from, direction: stroke.direction, speed: stroke.speed, ..*first }
        }
    }

    /// The first row of a recording, for a law that is concerned: no time has passed since.
    #[must_use]
    pub fn first(row: &Context<f64>) -> Context<f64> {
        Context { dt: 0.0, ..*row }
    }
}

/// Whether a row shows which way the stroke goes.
pub fn is_stroke(row: &Context<f64>) -> bool {
    row.speed != 0.0 && row.direction != 0.0
}
