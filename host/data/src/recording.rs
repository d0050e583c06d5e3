//! Recordings: read once into SI columns, then passed down.
//!
//! A file becomes one [`Recording`], or several when an import description splits it; the recordings of one call become a
//! [`Campaign`] in chronological order. Nothing behind this door parses text or knows a unit other than SI.

mod assemble;
mod blocks;
mod campaign;
mod cells;
mod column_plan;
mod column_table;
mod columns;
mod constant_load;
mod container;
mod decimal;
pub mod dropouts;
mod follow;
mod force_surface;
#[cfg(feature = "hdf5")]
mod hdf5;
mod header;
pub mod import;
pub mod import_guess;
mod line;
mod lookup;
mod matlab;
mod mcap;
pub mod motion;
mod mountings;
mod noise;
#[cfg(feature = "parquet")]
mod parquet;
mod places;
mod plausibility;
mod quantity;
mod read;
pub mod sensor_faults;
mod source;
mod spikes;
mod stroke_zero;
mod tdms;
mod text_column;
mod thousands;
mod time_of_day;
mod unit_check;
mod usual_line;
#[cfg(feature = "excel")]
mod workbook;

pub use campaign::{Campaign, Clock, largest_force, largest_force_of};
pub use column_table::Column as TableColumn;
pub use columns::{HELD, Recording};
pub use follow::Follower;
pub use header::has_decimal_commas;
pub use import::{Import, Missing};
pub use mountings::{Preceding, Rest, SAME_LENGTH, VENTING};
pub use noise::{resolution, white_noise};
pub use quantity::{HeaderName, Quantity, Unit, parse_header};
pub use read::{FilterValues, Hashes, Reader};
pub use spikes::usual_change;
