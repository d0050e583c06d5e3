//! Tables on their way, and what they say.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::Side;
use crate::fields::fields;

/// Bytes of a table or trace in one piece.
pub const PIECE: usize = 256;

/// Points in one [`Evaluate`].
pub const POINTS: usize = 16;

/// A table as the device knows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TableInfo {
    /// Length of the image in bytes.
    pub length: u32,
    /// Check sum of the image, [`check::of_image`](crate::check::of_image).
    pub crc: u32,
    /// Counts commits of this muscle; a roll-back goes back by one.
    pub generation: u32,
    /// Whether an older table is kept that [`rollback`](crate::link::endpoints) would restore.
    pub has_previous: bool,
}

fields!(TableInfo { length, crc, generation, has_previous });

/// Begins an upload; whatever was begun before is forgotten.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TableBegin {
    /// Muscle the table is for.
    pub side: Side,
    /// Length of the image in bytes.
    pub length: u32,
    /// Check sum of the image, [`check::of_image`](crate::check::of_image).
    pub crc: u32,
}

fields!(TableBegin { side, length, crc });

/// One piece of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TablePiece {
    /// Place of the first byte.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8, PIECE>,
}

fields!(TablePiece { offset, bytes });

/// Requests a piece of the table in use, from the store.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TableRead {
    /// The muscle whose table is read.
    pub side: Side,
    /// Place of the first byte.
    pub offset: u32,
}

fields!(TableRead { side, offset });

/// Asks to go back to the table before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct RollBack {
    /// The muscle whose table is replaced by the one before.
    pub side: Side,
    /// Generation of the table to go back from, so that a request that is repeated goes back once.
    pub generation: u32,
}

fields!(RollBack { side, generation });

/// A point to evaluate the table at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Point {
    /// Gauge pressure, Pa.
    pub pressure_pa: f32,
    /// Stroke, m.
    pub stroke_m: f32,
}

fields!(Point { pressure_pa, stroke_m });

/// Asks the device what its table says, so that a host can compare bit for bit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Evaluate {
    /// The muscle whose table is evaluated.
    pub side: Side,
    /// Direction of motion: −1 lengthening, 0 unknown, 1 shortening.
    pub direction: i8,
    /// The points.
    pub points: Vec<Point, POINTS>,
}

fields!(Evaluate { side, direction, points });

/// What the table says at the points requested.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Evaluated {
    /// Force and pressure at each point.
    pub values: Vec<Value, POINTS>,
}

fields!(Evaluated { values });

/// The table at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Value {
    /// Force, N.
    pub force_n: f32,
    /// Pressure that the inverse gives for this force, Pa.
    pub pressure_pa: f32,
}

fields!(Value { force_n, pressure_pa });

/// What happens to an effect's remembered state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct ForgetMemory {
    /// Muscle whose history is forgotten: a new one was fitted.
    pub side: Side,
}

fields!(ForgetMemory { side });
