//! Diagnosis against a reference: what has changed since earlier recordings of the same actuator.
//!
//! ```text
//! rows → settled rows with direction → reference surface (BEFORE only) → residual cells, shapes of change, lag scores
//!      → what repeats (covariance) → generalised least squares → evidence of each change → gate → posterior → answer
//! ```
//! | file | what |
//! | --- | --- |
//! | [`crate::criteria`] | every constant with its meaning and source |
//! | `runs` | recordings as runs: mountings, run numbers, what cannot be compared |
//! | `stages` | lengths held one after another in one recording |
//! | `motion` | settled rows; which way the pressure or the stroke moves |
//! | `spline`, `surface` | the force before, over pressure and direction, by mounting; its slopes |
//! | `interpolate` | the same at a length between those of the reference |
//! | `table_surface` | the same from a table file |
//! | `table_error` | what a table is wrong by where nothing changed |
//! | `cells` | residuals and shapes as means over cells of pressure |
//! | [`shapes`] | the changes that can be named: shape, class, owner |
//! | `repeatability` | how far untouched recordings differ: a Gaussian covariance |
//! | `contrast` | generalised least squares and Bayes factors |
//! | `lag` | delays between the channels, by rows in motion |
//! | `closed_valves` | a leak, by the pressure that closed valves lose |
//! | `unknown` | a smooth change that no name describes |
//! | `weighing` | how strongly the cells support each change |
//! | `leave_one_mounting_out` | a change must show without any single mounting |
//! | `naming` | one name after the other |
//! | `pairs` | two changes of which neither leads alone |
//! | `withdrawn_findings` | findings that are withdrawn: another actuator, held-out recordings that get worse |
//! | `posterior` | probabilities, set, verdict |
//! | `isometric` | all of this for pressure staircases at held lengths |
//! | `combined` | length and pressure that move together, taken apart into runs at nearly held lengths |
//! | `catalogue` | strokes of a described muscle: every effect of the catalogue as a change |
//! | `strokes`, `stroked` | the same question for strokes at regulated pressures |
//! | `sweeps` | runs at the reference's lengths, for quantities that are followed over campaigns |
//! | `localise` | which cells differ |
//! | `time_course` | since what moment, suddenly or gradually |
//! | `held_out` | how much of the difference is removed on held-out recordings |
//! | `units` | columns in other units, another actuator |
//! | `input_checks` | rows on both sides, sides in the wrong order |
//! | `report`, `staircase_answer`, `stroke_answer` | from two sides to the answer |
//! | `detectable` | the size from which on a change would be named |
//! | [`answer`] | the answer as values |
//! | [`correction`] | what the answer means for a table |
//! | `updated` | the table of before with the changes of the actuator applied |
//!
//! The same recordings give the same answer on any number of threads.

pub mod answer;
mod catalogue;
mod cells;
mod closed_valves;
mod combined;
mod contrast;
pub mod correction;
mod detectable;
mod held_out;
mod input_checks;
mod interpolate;
mod isometric;
mod lag;
mod leave_one_mounting_out;
mod localise;
mod naming;
mod pairs;
mod posterior;
pub(crate) mod repeatability;
mod report;
mod runs;
pub mod shapes;
mod spline;
mod stages;
mod staircase_answer;
mod stroke_answer;
pub(crate) mod stroked;
pub(crate) mod strokes;
mod surface;
pub(crate) mod sweeps;
mod table_error;
mod table_surface;
#[cfg(test)]
mod tests;
mod time_course;
mod units;
mod unknown;
mod updated;
mod weighing;
mod withdrawn_findings;

pub(crate) use crate::criteria::reference as criteria;
pub use answer::{ChangeReport, Verdict};
pub(crate) use contrast::{log_mean, log_sum};
pub(crate) use report::protocol_is_held;
pub use report::{Against, Mounted, Options, compare};
