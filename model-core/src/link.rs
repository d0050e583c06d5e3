//! The link between a host and a controller: what both ends must agree on, and nothing else.
//!
//! | layer | where | what |
//! | --- | --- | --- |
//! | frame | [`frame`] | COBS(header ‖ body ‖ CRC-32) followed by one zero byte |
//! | CAN | [`can`] | the bytes of frames in messages, for several devices on one bus |
//! | hello | [`hello`] | the first answer, whose layout never changes: every version of the peer |
//! | messages | [`messages`], [`settings`] | the bodies, as postcard writes them; closed enums, never text |
//! | endpoints | [`endpoints`] | ONE table: number, name, request, response; and the hash of all of it |
//!
//! A conversation begins with `hello`. The host compares [`endpoints::SCHEMA_HASH`] with the peer's and continues only
//! when they are equal, because from there on nothing in a body says what it is.

pub mod can;
pub mod endpoints;
pub mod frame;
pub mod hello;
pub mod messages;
pub mod settings;

pub use endpoints::{Endpoint, SCHEMA_HASH, Service};
pub use frame::{Accumulator, Exchange, Frame, FrameError, Header, Kind};
pub use hello::Hello;

/// Number of the message set. It moves when the meaning of a message changes; the hash beside it moves with any change.
pub const LINK_VERSION: u16 = 6;
