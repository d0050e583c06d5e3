//! The controller in the host's own process.
