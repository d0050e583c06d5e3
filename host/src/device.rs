//! Controllers at the other end of a cable: the port, the conversation, what is read and written over it.
//!
//! | layer | where |
//! | --- | --- |
//! | where a device is: a serial path or `tcp:HOST:PORT` | [`Address`] |
//! | bytes with time-outs | [`Port`] |
//! | hello, typed calls, topics, losses | [`Client`] |
//! | tables: upload in pieces, read back | [`tables`] |
//! | refusals and faults in words, with their remedy | [`words`] |

mod address;
mod client;
mod port;
pub mod tables;
pub mod words;

pub use address::Address;
pub use client::{Client, Losses, Patience, Topic};
pub use port::{Port, available};
