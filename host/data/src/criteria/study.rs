//! Criteria that a study scales when the program starts. A release has none of this: it is compiled with `--cfg pam_study` only.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// The factor for a criterion, from the environment of the study's program: for one criterion, or for several separated by commas.
fn factor(criterion: &str) -> Option<f64> {
    if !std::env::var("PAM_CRITERION").ok()?.split(',').any(|name| name == criterion) {
        return None;
    }
    let text = std::env::var("PAM_CRITERION_FACTOR").unwrap_or_default();
    match text.parse::<f64>() {
        Ok(factor) if factor.is_finite() && factor > 0.0 => Some(factor),
        _ => {
            eprintln!("PAM_CRITERION_FACTOR is `{text}`; write a number above 0, for example 0.5");
            std::process::exit(2)
        }
    }
}

/// A type of criterion that can be scaled.
pub trait Scaled {
    /// Where its value is kept: the same bits, and the compiler does not assume them.
    type Cell;
    /// Scales it, where the study says so.
    fn scale(criterion: &str, cell: &Self::Cell);
}

impl Scaled for f64 {
    type Cell = AtomicU64;
    fn scale(criterion: &str, cell: &Self::Cell) {
        if let Some(factor) = factor(criterion) {
            cell.store((Self::from_bits(cell.load(Ordering::Relaxed)) * factor).to_bits(), Ordering::Relaxed);
        }
    }
}

impl Scaled for usize {
    type Cell = AtomicUsize;
    /// A count stays at least one.
    fn scale(criterion: &str, cell: &Self::Cell) {
        if let Some(factor) = factor(criterion) {
            let value = cell.load(Ordering::Relaxed);
            cell.store(((value as f64 * factor) as Self).max(value.min(1)), Ordering::Relaxed);
        }
    }
}
