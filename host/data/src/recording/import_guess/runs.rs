//! Where one run of a file ends and the next begins: time begins again, and columns of labels change there; or a column numbers them.

use std::collections::{HashMap, HashSet};

use super::sample::{Levels, SampleColumn};

/// Rows of a run at least, on average: what changes more often is a reading.
const LEAST_ROWS: usize = 10;

/// The columns, by their index, whose values set the runs of a file apart, none where time increases throughout; and how often time
/// does not increase within the runs.
pub(super) fn splits(columns: &[SampleColumn], time: usize) -> (Vec<usize>, usize) {
    let clock = time;
    let time = &columns[clock].numbers;
    let restarts: Vec<bool> = (0..time.len()).map(|i| i > 0 && !(time[i] > time[i - 1])).collect();
    // Where time runs backwards, every row would begin a run.
    if runs_backwards(&columns[clock]) {
        return (Vec::new(), restarts.iter().filter(|r| **r).count());
    }
    let labels = |c: &SampleColumn| -> Option<bool> {
        // A note beside the table leaves most cells of its column empty.
        let noted = c.header.is_empty() || 2 * c.missing > c.numbers.len();
        let long = |l: &&Levels| l.words.len() > 1 && LEAST_ROWS * l.words.len() <= l.codes.len() && !noted;
        let levels = c.levels.as_ref().filter(long)?;
        // A label changes only where a run begins; what changes within a run is a measurement or a direction.
        let at_starts = levels.codes.windows(2).zip(&restarts[1..]).all(|(w, start)| w[0] == w[1] || *start);
        at_starts.then(|| c.name.sets_apart())
    };
    let mut candidates: Vec<(bool, usize)> = columns
        .iter()
        .enumerate()
        // A time of day is no label of a run, although a coarse one changes only where the parts of its second begin again.
        .filter(|(n, c)| *n != clock && !c.is_stamped())
        .filter_map(|(n, c)| Some((labels(c)?, n)))
        .collect();
    // Columns that are called run or condition before those of lengths and other settings.
    candidates.sort_by_key(|(named, n)| (!*named, *n));
    let mut chosen: Vec<usize> = Vec::new();
    let mut left = violations(columns, &chosen, time);
    while left > 0 {
        let open = candidates.iter().filter(|(_, n)| !chosen.contains(n));
        let after = open.map(|(_, n)| {
            let with: Vec<usize> = chosen.iter().copied().chain([*n]).collect();
            (violations(columns, &with, time), *n)
        });
        match after.min_by_key(|(count, _)| *count) {
            Some((count, n)) if count < left => {
                chosen.push(n);
                left = count;
            }
            _ => break,
        }
    }
    if chosen.is_empty() && left == 0 {
        chosen = numbered(columns);
    }
    chosen.sort_unstable();
    (chosen, left)
}

/// Whether time decreases at most rows.
pub(super) fn runs_backwards(time: &SampleColumn) -> bool {
    2 * time.numbers.windows(2).filter(|w| w[1] < w[0]).count() > time.numbers.len()
}

/// Whether the clock begins again with each run: wherever the time goes back, it goes back to where it began.
pub(super) fn by_clock(time: &SampleColumn) -> bool {
    /// Of the time of the run before, how near to the beginning of the first.
    const NEAR: f64 = 0.1;
    let time = &time.numbers;
    let starts: Vec<usize> =
        (0..time.len()).filter(|i| *i == 0 || !(time[*i] > time[i - 1])).chain([time.len()]).collect();
    let long = starts.windows(2).all(|w| w[1] - w[0] >= LEAST_ROWS);
    let again = |i: &usize| {
        let before = time[i - 1] - time[0];
        before > 0.0 && (time[*i] - time[0]).abs() <= NEAR * before
    };
    long && starts[1..starts.len() - 1].iter().all(again)
}

/// Columns called run, mounting or so that number the runs of a file whose clock continues: together they never come back to an earlier
/// value. Joined into one recording, runs at different held lengths would look like motion.
fn numbered(columns: &[SampleColumn]) -> Vec<usize> {
    let named =
        |c: &SampleColumn| c.name.sets_apart() && c.levels.as_ref().is_some_and(|l| l.words.len() > 1);
    let found: Vec<usize> = (0..columns.len()).filter(|n| named(&columns[*n])).collect();
    let levels: Vec<&Levels> = found.iter().filter_map(|n| columns[*n].levels.as_ref()).collect();
    let rows = levels.first().map_or(0, |l| l.codes.len());
    let key = |row: usize| -> Vec<u32> { levels.iter().map(|l| l.codes[row]).collect() };
    let stretches = (1..rows).filter(|row| key(*row) != key(row - 1)).count() + 1;
    let different = (0..rows).map(key).collect::<HashSet<_>>().len();
    if stretches == different && rows >= LEAST_ROWS * stretches { found } else { Vec::new() }
}

/// Rows whose time is not later than that of the row before them in the same group.
fn violations(columns: &[SampleColumn], by: &[usize], time: &[f64]) -> usize {
    let levels: Vec<&Levels> = by.iter().filter_map(|n| columns[*n].levels.as_ref()).collect();
    let mut last: HashMap<Vec<u32>, f64> = HashMap::new();
    let mut count = 0;
    for (row, time) in time.iter().enumerate() {
        let key: Vec<u32> = levels.iter().map(|l| l.codes[row]).collect();
        let before = last.insert(key, *time);
        count += usize::from(before.is_some_and(|b| !(*time > b)));
    }
    count
}

/// The direction of each word of a column of phases; `None` where one of them is not known.
pub(super) fn directions(column: &SampleColumn) -> Option<Vec<(String, i8)>> {
    const UP: [&str; 14] = [
        "up",
        "fill",
        "filling",
        "inflate",
        "inflating",
        "inflation",
        "pressurising",
        "pressurizing",
        "shortening",
        "contracting",
        "auf",
        "steigend",
        "rising",
        "hin",
    ];
    const DOWN: [&str; 14] = [
        "down",
        "empty",
        "emptying",
        "deflate",
        "deflating",
        "deflation",
        "depressurising",
        "depressurizing",
        "lengthening",
        "extending",
        "ab",
        "fallend",
        "falling",
        "rueck",
    ];
    const STILL: [&str; 4] = ["", "hold", "rest", "wait"];
    let levels = column.levels.as_ref().filter(|_| column.name.is_way())?;
    let direction = |word: &String| {
        let bare = word.trim().to_lowercase();
        let way = if UP.contains(&bare.as_str()) {
            1
        } else if DOWN.contains(&bare.as_str()) {
            -1
        } else if STILL.contains(&bare.as_str()) {
            0
        } else {
            return None;
        };
        Some((word.clone(), way))
    };
    levels.words.iter().map(direction).collect()
}
