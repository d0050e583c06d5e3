//! The muscle model.
#![no_std]
