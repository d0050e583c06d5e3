//! Ctrl-C and requests to end, as a flag.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pam_data::error::{DataCode, Error, Result};

/// A flag that Ctrl-C and a request to end set.
pub(crate) fn interrupts() -> Result<Arc<AtomicBool>> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&flag);
    ctrlc::set_handler(move || seen.store(true, Ordering::Relaxed))
        .map_err(|e| Error::new(DataCode::CallInvalid, format!("Ctrl-C cannot be handled: {e}")))?;
    Ok(flag)
}
