//! Controllers at the other end of a cable: the port, the conversation, what is read and written over it.
//!
//! | layer | where |
//! | --- | --- |
//! | where a device is: a serial path, `tcp:HOST:PORT`, or `slcan:ADAPTER,address=N` | [`Address`] |
//! | bytes with time-outs | [`Port`] |
//! | serial CAN adapters | [`slcan`] |
//! | venting every controller on a CAN bus | [`vent_all`] |
//! | hello, typed calls, topics, losses | [`Client`] |
//! | tables: upload in pieces, read back | [`tables`] |
//! | setpoints over time | [`setpoint_profile`] |
//! | firmware over the link | [`mod@update`] |
//! | a run from start to vent | [`mod@run`] |
//! | telemetry beside other programs | [`Subscription`] |
//! | a controller that is only watched | [`mod@watch`] |
//! | venting while the conversation waits for something else | [`VentLine`] |
//! | the pressure regulator, found from steps | [`regulator`] |
//! | scales of sensors from known values | [`calibration`] |
//! | log lines of the firmware as text | [`log_table`] |
//! | telemetry to a recording | [`recorder`] |
//! | messages about refusals and faults, with their remedy | [`messages`] |
//! | what changes from one table to another | [`table_diff`] |
//! | why a setpoint could not be reached | [`reachability`] |

mod address;
pub mod calibration;
mod can_line;
mod client;
#[cfg(feature = "emulated")]
pub mod emulated;
pub mod error;
mod line_activity;
pub mod log_table;
pub mod messages;
mod port;
#[cfg(feature = "probe")]
pub mod probe;
pub mod reachability;
pub mod recorder;
pub mod regulator;
pub mod run;
pub mod setpoint_profile;
pub mod slcan;
mod subscription;
pub mod table_diff;
pub mod tables;
pub mod update;
mod vent_all;
mod vent_line;
pub mod watch;

pub use address::Address;
pub use client::{Client, Losses, Patience, Topic};
pub use port::{Port, available, plugged_in};
pub use subscription::Subscription;
pub use vent_all::{Answered, vent_all};
pub use vent_line::VentLine;
