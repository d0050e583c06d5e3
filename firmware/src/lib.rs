//! The controller without a board: what it does each millisecond, what it answers, what it keeps.
//!
//! | where is … | |
//! | --- | --- |
//! | the control step, one pure function | [`control`] |
//! | pressure for force and stroke | [`modes`] |
//! | a joint of two muscles: angle, stiffness, what is available | [`pair`] |
//! | states and faults, each in one table | [`safety`] |
//! | how faults are noticed | [`watch`] |
//! | whether the table still describes the muscle | [`health`] |
//! | sine, trapezoid, chirp, table | [`mod@reference`] |
//! | lag, limits and scaling of the pressure regulator | [`regulator`] |
//! | a pair of on/off valves as a regulator | [`valves`] |
//! | the record of every loop variable | [`trace`] |
//! | a number in three bytes | [`compact_float`] |
//! | tables and settings in flash | [`store`] |
//! | answers to the host | [`server`] |
//! | what the tasks share | [`shared`] |
//! | messages that wait to be sent to the host | [`outbox`] |
//! | static memory for large values | [`placement`], [`shared_buffer`] |
//! | the tasks that a board starts | [`tasks`] |
//! | signals to readings, filters | [`signals`] |
//! | the length of a tick | [`tick`] |
//! | another firmware over the link | [`update`] |
//! | what a board must give | [`board`] |
//! | log lines on their way to the host | `log` (feature of that name) |
//! | all of it in a host's own process | `native` (feature of that name) |
//!
//! Nothing here knows a board, and only `main` knows which board it is.

#![cfg_attr(not(any(test, feature = "std")), no_std)]

pub mod board;
pub mod compact_float;
pub mod control;
pub mod health;
#[cfg(feature = "log")]
pub mod log;
pub mod modes;
#[cfg(feature = "native")]
pub mod native;
pub mod outbox;
pub mod pair;
pub mod placement;
pub mod reference;
pub mod regulator;
pub mod safety;
pub mod server;
pub mod shared;
pub mod shared_buffer;
pub mod signals;
pub mod store;
pub mod tasks;
pub mod tick;
pub mod trace;
pub mod update;
pub mod valves;
pub mod watch;
