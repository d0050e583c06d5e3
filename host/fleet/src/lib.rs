//! Fleets of muscles.
//!
//! | what | where |
//! | --- | --- |
//! | the manifest: one row per muscle | `manifest`, `work_item` |
//! | every muscle computed once, in parallel | [`batch`], [`Shard`] |
//! | results: four Parquet tables per muscle, whole or not at all | [`columns`], [`partition`], [`failures`] |
//! | all results as one fleet: outlying muscles, groups that differ, a page | [`fleet`], [`robust`], [`groups`], [`overview`], [`page`] |
//! | the same with manifests, recordings and results in buckets | `storage`, `objects` |
//! | a table for a muscle with few recordings, from its kin | [`stock`] |
//!
//! It imports recordings, fits, diagnoses and reports, and knows no command line.

pub mod batch;
pub mod columns;
pub mod error;
pub mod failures;
pub mod fleet;
pub mod groups;
pub mod overview;
pub mod page;
pub mod partition;
pub mod robust;
pub mod stock;

mod analysis;
mod manifest;
mod objects;
mod results;
mod shard;
mod storage;
mod work_item;

pub use shard::Shard;
