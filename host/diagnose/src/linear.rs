//! The linear algebra of the diagnosis: orthonormal bases of tall thin sets of columns, and amplitudes with signs.
//!
//! Columns are long (one entry per row of a recording) and few. Everything is computed column by column in a fixed
//! order, so a result does not depend on how many threads share the columns among them.

mod amplitudes;
mod basis;
mod products;
mod random;
#[cfg(test)]
mod tests;

pub(crate) use amplitudes::{Sign, amplitudes, solve_symmetric};
pub(crate) use basis::{Basis, weighted};
pub(crate) use products::{Stretch, add_all, add_scaled, dot, energy, products};
pub(crate) use random::Random;
