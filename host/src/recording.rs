//! Recordings: read once into SI columns, then passed down.
//!
//! A file becomes one [`Recording`], or several when an import description splits it; the recordings of one call become a
//! [`Campaign`] in chronological order. Nothing behind this door parses text or knows a unit other than SI.

mod campaign;
mod columns;

pub use campaign::{Campaign, Clock};
pub use columns::Recording;
