//! Controllers at the other end of a cable: the port, the conversation, what is read and written over it.
//!
//! | layer | where |
//! | --- | --- |
//! | where a device is: a serial path or `tcp:HOST:PORT` | [`Address`] |
//! | bytes with time-outs | [`Port`] |
//! | hello, typed calls, topics, losses | [`Client`] |
//! | tables: upload in pieces, read back | [`tables`] |
//! | what is asked over time | [`course`] |
//! | a run from start to vent | [`mod@run`] |
//! | venting while the conversation waits for something else | [`VentLine`] |
//! | the pressure regulator, found from steps | [`regulator`] |
//! | log lines of the firmware in words | [`log_table`] |
//! | telemetry to a recording | [`recorder`] |
//! | refusals and faults in words, with their remedy | [`words`] |

mod address;
mod client;
pub mod course;
pub mod difference;
#[cfg(feature = "emulated")]
pub mod emulated;
pub mod error;
mod heard;
pub mod log_table;
mod port;
#[cfg(feature = "probe")]
pub mod probe;
pub mod reach;
pub mod recorder;
pub mod regulator;
pub mod run;
pub mod tables;
mod vent_line;
pub mod words;

pub use address::Address;
pub use client::{Client, Losses, Patience, Topic};
pub use port::{Port, available, plugged_in};
pub use vent_line::VentLine;
