//! Recordings at held lengths: which of them belong to one mounting, and how the muscle rested before each.

use super::{Campaign, Clock, Recording};
use crate::statistics::extremes;

/// The largest change of a held length within one mounting, m: half of a tape measure's ±1 mm.
pub const SAME_LENGTH: f64 = 0.5e-3;
/// An unknown pause between two recordings of one mounting counts as this long, s: someone saves a file and starts the next. The
/// memories of a muscle span decades of time, of which the recordings themselves are most.
const ASSUMED_REST: f64 = 5.0;
/// An unknown pause in which the muscle is remounted counts as this long, s. Between 300 and 1000 s the unseen error of eleven real
/// muscles changes by about a tenth at most (`trials festo-tables`); an endless pause is worse on most of them.
const ASSUMED_REMOUNTING: f64 = 600.0;
/// The time in which a muscle is vented after the last reading, s.
pub const VENTING: f64 = 2.0;

/// What a recording at a held length follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preceding {
    /// It is the first.
    Nothing,
    /// A recording of another mounting.
    OtherMounting,
    /// A recording of the same mounting.
    SameMounting,
}

/// The rest of a muscle before a recording at a held length, vented.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// What it follows.
    pub after: Preceding,
    /// How long the muscle rested, s; infinite before the first recording.
    pub seconds: f64,
    /// Whether the bench's clock says so; otherwise it is assumed.
    pub known: bool,
    /// From the end of the rest to the first reading, s.
    pub lead: f64,
}

/// The length that a recording held throughout, as a stroke in metres.
fn held(recording: &Recording) -> Option<f64> {
    let (low, high) = extremes(&recording.stroke);
    (high - low <= SAME_LENGTH).then_some(0.5 * (low + high))
}

/// What separates the parts of a file's name.
const SEPARATORS: &[char] = &['_', '-', ' '];

/// A file's name that says its mounting: what it calls the mounting, and the number of the run. `None` where it does not end in the number
/// of a run, as `short7_run2.csv` does.
fn mounting_and_run(name: &str) -> Option<(String, u64)> {
    let stem = name.split('.').next().unwrap_or("").to_ascii_lowercase();
    let bare = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let run = stem[bare.len()..].parse().ok()?;
    let runs = ["run", "cycle", "repeat", "trial"];
    let word = runs.iter().find_map(|word| bare.trim_end_matches(SEPARATORS).strip_suffix(word));
    Some((word.unwrap_or(bare).trim_end_matches(SEPARATORS).to_owned(), run))
}

/// The number that a file's name begins with, and what follows it, as in `04_short7_run1.csv`.
fn leading_number(name: &str) -> Option<(u64, &str)> {
    let rest = name.trim_start_matches(|c: char| c.is_ascii_digit());
    let bare = rest.trim_start_matches(SEPARATORS);
    let number = name[..name.len() - rest.len()].parse().ok()?;
    (bare.len() < rest.len()).then_some((number, bare))
}

/// Whether the number at the beginning of the names numbers the recordings: it rises with each of them, also where the rest differs in
/// the number of the run alone. Then it does not show the mounting.
fn are_numbered(recordings: &[Recording]) -> bool {
    let names: Option<Vec<(u64, &str)>> = recordings.iter().map(|r| leading_number(&r.name)).collect();
    let names = names.unwrap_or_default();
    let next_run = |before: &str, after: &str| {
        mounting_and_run(before).zip(mounting_and_run(after)).is_some_and(|(b, a)| b.0 == a.0 && b.1 < a.1)
    };
    names.windows(2).all(|pair| pair[0].0 < pair[1].0)
        && names.windows(2).any(|pair| next_run(pair[0].1, pair[1].1))
}

/// What the recording's labels or its file's name call its mounting; `None` where nothing says it.
fn called(recording: &Recording, numbered: bool) -> Option<String> {
    if !recording.labels.is_empty() {
        return Some(recording.mounting());
    }
    let name = leading_number(&recording.name).filter(|_| numbered).map_or(recording.name.as_str(), |n| n.1);
    mounting_and_run(name).map(|(mounting, _)| mounting)
}

impl Campaign {
    /// The number of the mounting of each recording, from zero. A mounting begins where the held length changes by more than
    /// [`SAME_LENGTH`], or where labels or file names call it otherwise. `None` where a recording did not hold its length.
    #[must_use]
    pub fn mountings(&self) -> Option<Vec<usize>> {
        let numbered = are_numbered(&self.recordings);
        let mut number = 0;
        let mut before: Option<(f64, Option<String>)> = None;
        let mut all = Vec::with_capacity(self.recordings.len());
        for recording in &self.recordings {
            let (stroke, name) = (held(recording)?, called(recording, numbered));
            if let Some((last, other)) = &before {
                let renamed = name.is_some() && other.is_some() && name != *other;
                number += usize::from((last - stroke).abs() > SAME_LENGTH || renamed);
            }
            before = Some((stroke, name));
            all.push(number);
        }
        Some(all)
    }

    /// The rest before each recording; `None` where a recording did not hold its length: what happened between the others is not known.
    #[must_use]
    pub fn rests(&self) -> Option<Vec<Rest>> {
        let mountings = self.mountings()?;
        let rest = |index: usize| {
            let recording = &self.recordings[index];
            let after = match index.checked_sub(1) {
                None => Preceding::Nothing,
                Some(before) if mountings[before] != mountings[index] => Preceding::OtherMounting,
                Some(_) => Preceding::SameMounting,
            };
            let first = recording.time.first().copied().unwrap_or(0.0);
            let interval = recording.duration() / recording.len().saturating_sub(1).max(1) as f64;
            let known = self.pause_before(index);
            // A clock that starts near zero was started with the recording.
            let own = self.clock == Clock::Separate && (0.0..=2.0 * interval).contains(&first);
            let lead = if own { first } else { known.map_or(interval, |pause| interval.min(pause)) };
            let assumed = match after {
                Preceding::Nothing => f64::INFINITY,
                Preceding::OtherMounting => ASSUMED_REMOUNTING,
                Preceding::SameMounting => ASSUMED_REST,
            };
            let seconds = known.map_or(assumed, |pause| (pause - lead).max(0.0));
            Rest { after, seconds, known: known.is_some(), lead }
        };
        Some((0..self.recordings.len()).map(rest).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(name: &str, stroke: f64, times: [f64; 3], labels: &[(&str, &str)]) -> Recording {
        let labels = labels.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        Recording {
            name: name.into(),
            stroke: vec![stroke; 3],
            time: times.to_vec(),
            labels,
            ..Recording::default()
        }
    }

    #[test]
    fn a_mounting_begins_with_another_length_label_or_name() {
        let of = |recordings: Vec<Recording>| Campaign::new(recordings).mountings();
        let times = [0.0, 1.0, 2.0];
        let lengths = [0.0, 0.2e-3, 9e-3, 9e-3, 0.0].map(|s| run("r.csv", s, times, &[]));
        assert_eq!(of(lengths.to_vec()), Some(vec![0, 0, 1, 1, 2]));
        let labelled = [("a", "1"), ("a", "2"), ("b", "1")]
            .map(|(m, r)| run("x.csv", 0.0, times, &[("condition", m), ("run", r)]));
        assert_eq!(of(labelled.to_vec()), Some(vec![0, 0, 1]));
        let named = ["short7_run1.csv", "short7_run2.csv", "short9-run1.csv", "short9-run2.csv.gz"]
            .map(|n| run(n, 0.0, times, &[]));
        assert_eq!(of(named.to_vec()), Some(vec![0, 0, 1, 1]));
        // A number that rises with every recording is not a mounting.
        let numbered = ["08_a_run1.csv", "09_a_run2.csv", "10_b_run1.csv", "11_b_run2.csv"]
            .map(|n| run(n, 0.0, times, &[]));
        assert_eq!(of(numbered.to_vec()), Some(vec![0, 0, 1, 1]));
        let mountings = ["1_run1.csv", "1_run2.csv", "2_run1.csv"].map(|n| run(n, 0.0, times, &[]));
        assert_eq!(of(mountings.to_vec()), Some(vec![0, 0, 1]));
        let once = ["1_run1.csv", "2_run1.csv", "3_run1.csv"].map(|n| run(n, 0.0, times, &[]));
        assert_eq!(of(once.to_vec()), Some(vec![0, 1, 2]));
        // Names without a number do not show one.
        assert_eq!(of(["a.csv", "b.csv"].map(|n| run(n, 0.0, times, &[])).to_vec()), Some(vec![0, 0]));
        let mut moved = run("r.csv", 0.0, times, &[]);
        moved.stroke[2] = 2e-3;
        assert_eq!(of(vec![moved]), None);
    }

    #[test]
    fn a_rest_is_known_from_the_bench_s_clock_and_assumed_without_it() {
        let shared =
            Campaign::new(vec![run("a", 0.0, [0.0, 1.0, 2.0], &[]), run("b", 0.0, [12.0, 13.0, 14.0], &[])]);
        let rests = shared.rests().expect("held");
        assert_eq!((rests[0].after, rests[1].after), (Preceding::Nothing, Preceding::SameMounting));
        assert!(rests[0].seconds.is_infinite() && !rests[0].known);
        assert_eq!((rests[1].known, rests[1].lead, rests[1].seconds), (true, 1.0, 9.0));
        let separate =
            Campaign::new(vec![run("a", 0.0, [0.4, 0.9, 1.4], &[]), run("b", 0.0, [0.4, 0.9, 1.4], &[])]);
        let rests = separate.rests().expect("held");
        assert_eq!((rests[1].known, rests[1].lead, rests[1].seconds), (false, 0.4, ASSUMED_REST));
        let remounted =
            Campaign::new(vec![run("a", 0.0, [0.4, 0.9, 1.4], &[]), run("b", 9e-3, [0.4, 0.9, 1.4], &[])]);
        let rests = remounted.rests().expect("held");
        assert_eq!((rests[1].after, rests[1].seconds), (Preceding::OtherMounting, ASSUMED_REMOUNTING));
    }
}
