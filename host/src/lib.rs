//! Host library.

pub mod error;
pub mod muscle_description;
pub mod recording;
