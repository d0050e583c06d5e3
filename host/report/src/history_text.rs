//! The history of a campaign as text for a terminal.

use std::fmt::Write;

use pam_diagnose::history::History;
use pam_diagnose::history::answer::Estimate;

use crate::wording::history as wording;

/// A number with the half-width of its interval.
pub(crate) fn with_half(estimate: &Estimate, scale: f64, decimals: usize) -> String {
    let value = scale * estimate.value;
    match estimate.half() {
        Some(half) => format!("{value:.decimals$} ± {:.decimals$}", scale * half),
        None => format!("{value:.decimals$} (no interval)"),
    }
}

/// Assumptions about times that are not recorded.
pub(crate) fn assumed(history: &History) -> String {
    let loaded = format!("loaded for {:.0} s before the first run", history.law.loaded_before_s);
    match history.law.pause_s {
        Some(pause) => format!("chosen on a grid, uncertain: pause between runs {pause} s, {loaded}"),
        None => format!("pauses between runs by the clock; chosen on a grid, uncertain: {loaded}"),
    }
}

/// Why no memory is named.
pub(crate) fn why_not(history: &History) -> String {
    history.why_not.iter().map(wording::memory_refusal).collect::<Vec<_>>().join("; ")
}

/// The history as text.
#[must_use]
pub fn text(history: &History) -> String {
    let mut s = String::new();
    let u = &history.unseen;
    let _ = writeln!(
        s,
        "History of {} runs in {} mountings ({} settled points{})",
        history.runs.len(),
        history.mountings.len(),
        history.points,
        if history.averaged { ", averaged from the rows after each pulse" } else { "" }
    );
    let _ = writeln!(
        s,
        "  each run predicted from the others: {:.2} % of the largest force (rms) by static curves, {:.2} % with memory{}",
        u.without_memory.rms_pct,
        u.with_memory.rms_pct,
        u.with_slips.map_or(String::new(), |e| format!(", {:.2} % beside the slips", e.rms_pct))
    );
    if let Some(friction) = history.friction {
        let _ = writeln!(
            s,
            "  friction of the base model, k_F = {friction:.3}, is removed first: unseen runs are predicted better with it"
        );
    }
    if u.supported_with.points < u.with_memory.points {
        let _ = writeln!(
            s,
            "  over {} of {} points, whose pressure another run of the mounting reaches: {:.2} % and {:.2} %",
            u.supported_with.points,
            u.with_memory.points,
            u.supported_without.rms_pct,
            u.supported_with.rms_pct
        );
    }
    if history.named {
        let _ = writeln!(
            s,
            "  memory of the bladder: the carried part of the pressure relaxes by {} % in all ({} % per decade); the bladder carries nothing at {} kPa{}",
            with_half(&history.law.relaxed_share, 100.0, 0),
            with_half(
                &history.law.relaxed_share,
                100.0 / history.law.time_constants_s.len().max(1) as f64,
                1
            ),
            with_half(&history.law.balance_pressure, 1.0, 0),
            if history.law.balance_identifiable { "" } else { " (assumed: not identifiable here)" }
        );
        let _ = writeln!(s, "  {}", assumed(history));
    } else {
        let _ = writeln!(s, "  no memory is named: {}", why_not(history));
    }
    for f in &history.findings {
        let _ =
            writeln!(s, "  {} {}", if f.found { "found:    " } else { "not found:" }, wording::finding(f));
    }
    if !history.layers.is_empty() {
        let shares: Vec<String> = history
            .layers
            .iter()
            .map(|l| {
                format!(
                    "{} {:.0} % ({:.0} %)",
                    wording::layer(l.layer),
                    100.0 * l.in_order,
                    100.0 * l.last_in
                )
            })
            .collect();
        let _ = writeln!(
            s,
            "  shares of the squared error of unseen runs, in the order of entry (and when entered last): {}",
            shares.join(", ")
        );
    }
    s
}
