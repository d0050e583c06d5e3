//! Virtual test bench.
