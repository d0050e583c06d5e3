//! The line to a CAN bus.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::fields::fields;

/// Place and speed of the device on a CAN bus that it may share with others, see [`link::can`](crate::link::can). Both apply from the next
/// start on, so that the answer to their change still arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CanLine {
    /// Address of the device, 1 to 8, different for each on the bus; 0 keeps the device off the bus.
    pub address: u8,
    /// Bit rate of the bus, kbit/s: 125, 250, 500 or 1000.
    pub kbit_per_s: u16,
}

impl CanLine {
    /// Bit rates that a bus can have, kbit/s: the common ones of CiA 102 from 125 on.
    pub const RATES: [u16; 4] = [125, 250, 500, 1000];
    /// Off the bus.
    pub const OFF: Self = Self { address: 0, kbit_per_s: 500 };

    /// Whether the device takes part in the bus.
    #[inline]
    pub const fn is_used(&self) -> bool {
        self.address > 0
    }
}

fields!(CanLine { address, kbit_per_s });
