//! Whether a table still describes its muscle: sums of what the load cell reads beyond the table, kept by the device.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::Side;
use crate::fields::{codes, fields};

codes! {
    /// What a change of muscle, rig or sensor does to the force, in the order of the sums. `F` is the force of the table.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Shape {
        /// 1: the load cell's zero.
        #[default]
        ForceOffset,
        /// F: the load cell's gain.
        ForceGain,
        /// P·∂F/∂P: the pressure sensor's gain.
        PressureGain,
        /// P: pressure that acts on the load cell.
        CrossTalk,
        /// ∂F/∂P: the pressure sensor's zero, or the deadband.
        PressureOffset,
        /// ∂F/∂x: the mounted length.
        Length,
        /// F·∂F/∂x: compliance of the rig.
        Compliance,
        /// Direction of friction.
        Friction,
        /// dF/dt: the force reads late.
        Lag,
        /// Time: drift of the load cell.
        Drift,
    }
}

/// Number of shapes.
pub const SHAPES: usize = Shape::ALL.len();
/// Columns of the normal equations: the shapes, and the residual as the last.
pub const COLUMNS: usize = SHAPES + 1;
/// Sums of the normal equations: the upper triangle, row by row.
pub const SUMS: usize = COLUMNS * (COLUMNS + 1) / 2;
/// Shapes whose serial correlation is kept: all but drift.
pub const WATCHED: usize = SHAPES - 1;
/// Sums over pairs of neighbouring blocks: three for each watched shape, that of the residual, and the weight of the pairs.
pub const LAGGED: usize = 3 * WATCHED + 2;

codes! {
    /// What the device says about a table.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum TableHealth {
        /// Too few blocks yet, no load cell, or no table.
        #[default]
        Unknown,
        /// No change beyond the tolerance is significant.
        Describes,
        /// The table no longer describes this muscle.
        Changed,
    }
}

/// Requests the sums of one muscle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct HealthRead {
    /// Which one.
    pub side: Side,
}

fields!(HealthRead { side });

/// The sums over blocks of equal length, each weighted by its age. Forces are in blocked forces, pressures and strokes in the scales
/// below, dF/dt in blocked forces per second, time in windows before now.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct HealthSums {
    /// What the device says.
    pub table: TableHealth,
    /// The shape that explains the residual best.
    pub suspect: Shape,
    /// By how many standard errors the suspect exceeds the tolerance.
    pub excess: f32,
    /// The largest part of the blocked force that a shape may explain, rms.
    pub tolerance: f32,
    /// Blocks since the sums began.
    pub blocks: u32,
    /// Sum of the weights.
    pub weight: f32,
    /// Ticks of a block.
    pub block_ticks: u16,
    /// Blocks after which a weight has fallen to 1/e.
    pub window_blocks: u16,
    /// Scale of forces: the blocked force, N.
    pub force_n: f32,
    /// Scale of pressures: the highest tested one, Pa.
    pub pressure_pa: f32,
    /// Scale of strokes: the longest tested one, m.
    pub stroke_m: f32,
    /// The normal equations.
    pub sums: Vec<f32, SUMS>,
    /// For each watched shape s and the residual r, with ′ for the block before: s·s′, s·r′, r·s′; then r·r′ and 1.
    pub lagged: Vec<f32, LAGGED>,
}

fields!(HealthSums {
    table,
    suspect,
    excess,
    tolerance,
    blocks,
    weight,
    block_ticks,
    window_blocks,
    force_n,
    pressure_pa,
    stroke_m,
    sums,
    lagged
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_one_sum_for_each_pair_of_columns_and_three_for_each_shape_that_is_watched() {
        let pairs = (0..COLUMNS).flat_map(|row| (row..COLUMNS).map(move |column| (row, column)));
        assert_eq!((SHAPES, COLUMNS, pairs.count()), (10, 11, SUMS));
        let watched = Shape::ALL.iter().filter(|shape| **shape != Shape::Drift).count();
        assert_eq!((watched, 3 * 9 + 2), (WATCHED, LAGGED));
    }
}
