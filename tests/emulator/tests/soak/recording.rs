//! A recording, and what it reports as missing.

use std::path::Path;

/// A stream that another program has ended is requested again after half a second.
const INTERRUPTED: u64 = 450;

/// Samples of a recording.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recorded {
    pub samples: u64,
    /// Ticks between the first and the last sample that have none.
    pub missing: u64,
    /// Of these, ticks in gaps that last as long as a stream which another program has ended, until it is requested again.
    pub interrupted: u64,
    /// Samples that its side file, or the program that recovered it, says are lost.
    pub told: u64,
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
    let gaps = || ticks.windows(2).map(|pair| pair[1] - pair[0] - 1);
    let missing = gaps().sum();
    let interrupted = gaps().filter(|gap| *gap >= INTERRUPTED).sum();
    let mut side = path.as_os_str().to_owned();
    side.push(".json");
    let told = std::fs::read(side)
        .ok()
        .and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok())
        .map_or(0, |about| {
            ["samples", "unread"].iter().filter_map(|name| about["losses"][name].as_u64()).sum()
        });
    Recorded { samples: ticks.len() as u64, missing, interrupted, told }
}
