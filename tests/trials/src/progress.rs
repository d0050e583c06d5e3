//! A progress line with the estimated remaining time.

use std::io::{IsTerminal as _, Write as _};
use std::sync::Mutex;
use std::time::Instant;

/// Progress through a known number of equal parts.
#[derive(Debug)]
pub struct Progress {
    what: &'static str,
    total: usize,
    began: Instant,
    done: Mutex<usize>,
}

impl Progress {
    /// Nothing done of `total`.
    pub fn new(what: &'static str, total: usize) -> Self {
        Self { what, total, began: Instant::now(), done: Mutex::new(0) }
    }

    /// One more part is done. A terminal's line is written over; elsewhere a line appears for every tenth.
    pub fn one(&self) {
        let mut done = self.done.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *done += 1;
        let (n, total) = (*done, self.total);
        let spent = self.began.elapsed().as_secs_f64();
        let left = spent / n as f64 * (total - n.min(total)) as f64;
        let mut out = std::io::stderr();
        // What cannot be written to a closed terminal is not worth an error.
        let _ = if out.is_terminal() {
            let end = if n == total { "\n" } else { "" };
            write!(out, "\r\u{1b}[2K{} {n} of {total}, {left:.0} s left{end}", self.what)
        } else if n == total || n * 10 / total.max(1) != (n - 1) * 10 / total.max(1) {
            writeln!(out, "{} {n} of {total} in {spent:.0} s, {left:.0} s left", self.what)
        } else {
            Ok(())
        };
    }
}
