//! The muscle model.
#![no_std]

pub mod link;
