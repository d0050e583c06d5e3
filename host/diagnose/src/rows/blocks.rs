//! Half-strokes and cycles: the pieces of a recording that are tested and left out whole.

use super::Rows;
use super::gather::Gathered;
use crate::criteria::rows::{LONGEST_BLOCK, SHORTEST_BLOCK, TYPICAL_BLOCK};
use pam_data::statistics::{median, quantile};

/// Half-strokes become blocks; those that are very short join the one before, those very long are cut, so that blocks
/// outlast the noise's memory and are still many.
pub(super) fn merge(rows: &Gathered, vented: &[bool]) -> Vec<u32> {
    let n = rows.piece.len();
    let mut spans: Vec<f64> = Vec::new();
    let mut from = 0;
    for i in 1..=n {
        if i == n || rows.piece[i] != rows.piece[from] {
            spans.push(rows.local_time[i - 1] - rows.local_time[from]);
            from = i;
        }
    }
    let mut sorted: Vec<f64> = spans.iter().copied().filter(|s| *s > 0.0).collect();
    let typical = quantile(&mut sorted, TYPICAL_BLOCK).max(1e-9);
    let (shortest, longest) = (SHORTEST_BLOCK * typical, LONGEST_BLOCK * typical);
    let mut number = 0_u32;
    let mut start = 0;
    let mut merged = vec![0_u32; n];
    for i in 0..n {
        if i > 0 {
            let age = rows.local_time[i - 1] - rows.local_time[start];
            let other_recording = rows.recording[i] != rows.recording[i - 1];
            let other_piece = rows.piece[i] != rows.piece[i - 1];
            let vent = vented[i] != vented[i - 1];
            if other_recording || vent || (other_piece && age >= shortest) || age >= longest {
                number += 1;
                start = i;
            }
        }
        merged[i] = number;
    }
    merged
}

/// The middle distance in time between rows, s.
pub(crate) fn typical_step(rows: &Rows) -> f64 {
    let mut steps: Vec<f64> = rows
        .local_time
        .windows(2)
        .zip(rows.recording.windows(2))
        .filter(|(_, r)| r[0] == r[1])
        .map(|(t, _)| t[1] - t[0])
        .collect();
    median(&mut steps).max(1e-9)
}

/// Cycles within a stay at one pressure level, from 1, where the recording does not number them itself.
pub(super) fn cycles(rows: &Gathered, level: &[u32]) -> Vec<u32> {
    if rows.cycle.iter().any(|c| *c > 0) {
        return rows.cycle.clone();
    }
    let (mut base, mut stay) = (0.0, None);
    let cycle = |i: usize| {
        let cycles = rows.contexts[i].cycles;
        let here = Some((level[i], rows.recording[i]));
        if stay != here {
            (base, stay) = (cycles, here);
        }
        (cycles - base).max(0.0).floor() as u32 + 1
    };
    (0..level.len()).map(cycle).collect()
}
