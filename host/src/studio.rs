//! The live view: a page of this program in a browser on this machine, nothing from elsewhere.
//!
//! | part | where |
//! | --- | --- |
//! | who may use it: loopback, origin, token | `access` |
//! | connections with bounds on number, time and size | `connections` |
//! | the page and its requests | [`server`], `orders` |
//! | the path of a vent, which nothing else uses | [`vent`] |
//! | the thread that talks to the controller and keeps it safe | [`session`] |
//! | samples, states and faults for the page | `events` |
//! | recordings, fit, diagnosis, comparison | [`analysis`] |
//! | the page itself, committed as it is served | `studio/page.html`, `studio.css`, `studio.js`, `plot.js` |

mod access;
pub mod analysis;
mod answers;
mod connections;
mod events;
mod orders;
pub mod server;
pub mod session;
pub mod vent;

#[cfg(test)]
mod tests;
