//! Recordings of pneumatic muscles and the files around them.
//!
//! | what | where |
//! | --- | --- |
//! | recordings, campaigns, import descriptions, motion | [`recording`] |
//! | the description of a muscle | [`muscle_description`] |
//! | limits of pressure, force and contraction | [`physical_limits`] |
//! | errors with cause, place and remedy | [`error`], [`toml_errors`] |
//! | recognising files, writing them atomically | [`file_kind`], [`output`] |
//! | comparing two recordings | [`compare`] |
//! | order statistics | [`statistics`] |
//! | thresholds with symbol, unit, meaning and source | [`mod@criteria`] |
//! | progress reports, dates, plurals | [`progress`], [`date`], [`pluralise`] |
//! | numbers in messages | [`short_number`] |
//!
//! A file is parsed and converted to SI units once, at [`Reader`](recording::Reader); nothing behind it knows another unit. The crate
//! knows no force model: `pam-fit` and the crates above it use it.
//!
//! ```
//! use pam_data::recording::Reader;
//!
//! let file = tempfile::NamedTempFile::with_suffix(".csv")?;
//! let rows: String = (0..10).map(|i| format!("{},300,{},50\n", 0.1 * f64::from(i), 0.01 * f64::from(i))).collect();
//! std::fs::write(&file, format!("time_s,pressure_kPa,displacement_mm,force_N\n{rows}"))?;
//!
//! let campaign = Reader::new().campaign([file.path()])?;
//! let recording = &campaign.recordings[0];
//! assert_eq!((recording.len(), recording.pressure[0]), (10, 300e3)); // Pa
//!
//! // An error names cause, place and remedy.
//! std::fs::write(&file, "time_s,pressure_kpa,displacement_mm\n0,300,0\n")?;
//! let error = Reader::new().file(file.path()).unwrap_err();
//! assert!(error.advice().is_some_and(|help| help.contains("did you mean `pressure_kPa`?")), "{error:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(unreachable_pub)]

pub mod bounds;
pub mod compare;
pub mod criteria;
pub mod date;
pub mod error;
pub mod file_kind;
pub mod mcap_records;
pub mod muscle_description;
pub mod output;
pub mod physical_limits;
pub mod pluralise;
pub mod progress;
pub mod recording;
pub mod short_number;
pub mod statistics;
pub mod toml_errors;
