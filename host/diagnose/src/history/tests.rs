//! Synthetic campaigns whose truth is known, nulls, and the Festo recordings where they are available.
//!
//! The synthetic muscle is integrated here in small steps from the law's equations, apart from the code under test.

mod additional_effect;
mod festo;
mod synthetic;
mod table;
