//! Known answers on synthetic staircases.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]
