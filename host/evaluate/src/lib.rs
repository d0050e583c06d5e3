//! How well a fit does on recordings that it has not seen.

pub mod hold_out;
pub mod other_length;
pub mod published;
