//! `host campaign` behind its options: the controller and what moves the muscle, progress, results, the page.

pub(crate) mod page;
pub(crate) mod results;
pub(crate) mod rigging;
pub(crate) mod watching;
