//! A recording, and what it reports as missing.

use std::path::Path;

/// Samples of a recording.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recorded {
    pub samples: u64,
    /// Ticks between the first and the last sample that have none.
    pub missing: u64,
    /// Samples that its side file, or the program that recovered it, says are lost.
    pub reported: u64,
}

/// Reads a recording at the device's own rate, and the file beside it.
pub fn recorded(path: &Path) -> Recorded {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut rows = text.lines();
    let names: Vec<&str> = rows.next().expect("a header").split(',').collect();
    let at = names.iter().position(|name| *name == "time_s").expect("a time");
    let tick = |row: &str| {
        let cell = row.split(',').nth(at).and_then(|cell| cell.parse::<f64>().ok());
        (cell.unwrap_or_else(|| panic!("{}: no time in {row}", path.display())) * 1e3).round() as u64
    };
    let ticks: Vec<u64> = rows.map(tick).collect();
    let missing = ticks.windows(2).map(|pair| pair[1] - pair[0] - 1).sum();
    let mut side = path.as_os_str().to_owned();
    side.push(".json");
    let reported = std::fs::read(side)
        .ok()
        .and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok())
        .and_then(|about| about["losses"]["samples"].as_u64())
        .unwrap_or(0);
    Recorded { samples: ticks.len() as u64, missing, reported }
}
