//! The live view: a page of this program in a browser on this machine, nothing from elsewhere.
//!
//! | part | where |
//! | --- | --- |
//! | who may ask: loopback, origin, token | [`server`] |
//! | the thread that talks to the controller and keeps it safe | [`keeper`] |
//! | recordings, fit, diagnosis, comparison | [`workshop`] |
//! | the page itself, committed as it is served | `studio/page.html`, `studio.css`, `studio.js`, `plot.js` |

pub mod keeper;
pub mod server;
mod told;
pub mod workshop;
