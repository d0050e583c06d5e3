//! The whole workflow on one machine: a campaign on the virtual bench, a table, a controller, force tracking, and back.
//!
//! | step | where |
//! | --- | --- |
//! | a muscle's recordings and description, written as files | [`campaign`] |
//! | control laws, compared on the moving muscle | [`tracking`] |
//! | one page with the pictures | [`page`] |

pub mod campaign;
pub mod page;
pub mod tracking;
