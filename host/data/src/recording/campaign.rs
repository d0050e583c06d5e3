//! Several recordings of one muscle, in the order in which they happened.

use super::Recording;
use crate::statistics::{median, range};

/// A clock that shows more at the first reading was not started for the campaign, s (a day and some).
const LONGEST_CLOCK: f64 = 1.0e5;

/// How the times of different recordings relate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// All share the bench's clock: a later recording starts at a later time, and pauses are known.
    Shared,
    /// Each starts near zero: they follow one another with unknown pauses.
    Separate,
}

/// Recordings of one muscle in chronological order; the muscle remembers what earlier ones did to it.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// In chronological order.
    pub recordings: Vec<Recording>,
    /// Whether times of different recordings can be compared.
    pub clock: Clock,
    /// Remarks on the data, such as files that were put into order.
    pub warnings: Vec<String>,
}

impl Campaign {
    /// Decides from the times whether the clock is shared, and puts recordings with a shared clock into order.
    ///
    /// With one clock no two recordings overlap. They are sorted by time then, because a shell lists `run10` before `run2`.
    /// Recordings that overlap cannot share a clock; they keep the given order.
    #[must_use]
    pub fn new(mut recordings: Vec<Recording>) -> Self {
        let mut warnings = Vec::new();
        let span =
            |r: &Recording| (r.time.first().copied().unwrap_or(0.0), r.time.last().copied().unwrap_or(0.0));
        let mut order: Vec<usize> = (0..recordings.len()).collect();
        order.sort_by(|a, b| span(&recordings[*a]).0.total_cmp(&span(&recordings[*b]).0));
        let disjoint = order.windows(2).all(|w| span(&recordings[w[0]]).1 < span(&recordings[w[1]]).0);
        let clock = if disjoint { Clock::Shared } else { Clock::Separate };
        if disjoint && order.windows(2).any(|w| w[0] > w[1]) {
            warnings.push(
                "the recordings were not given in the order of their times; they were sorted".to_owned(),
            );
            let mut slots: Vec<Option<Recording>> = recordings.into_iter().map(Some).collect();
            recordings = order.iter().filter_map(|i| slots[*i].take()).collect();
        }
        if !disjoint {
            let near_zero = |r: &Recording| span(r).0.abs() <= 1.0_f64.max(0.1 * r.duration());
            if let Some(odd) = recordings.iter().find(|r| !near_zero(r)) {
                warnings.push(format!(
                    "the times of the recordings overlap, yet `{}` does not start near zero; they are taken in the order \
                     given, with unknown pauses",
                    odd.name
                ));
            }
        }
        warnings.extend(other_clock(&recordings));
        warnings.extend(recordings.iter().find_map(joined_runs));
        for (i, a) in recordings.iter().enumerate() {
            if let Some(b) = recordings[i + 1..].iter().find(|b| a.same_rows(b)) {
                warnings.push(if a.name == b.name {
                    format!("`{}` is given twice, and counts twice", a.name)
                } else {
                    format!("`{}` and `{}` hold the same rows, which count twice", a.name, b.name)
                });
            }
        }
        Self { recordings, clock, warnings }
    }

    /// Rows of all recordings together.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.recordings.iter().map(Recording::len).sum()
    }

    /// The first reading's moment on the clock on which effects are timed, s: the bench's own where all recordings share it and it counts
    /// from a beginning of its own; an absolute clock (time of day) does not start with the muscle, so that readings count from the first then.
    #[must_use]
    pub fn beginning(&self) -> f64 {
        let bench = if self.clock == Clock::Shared { self.first_time() } else { None };
        bench.filter(|time| (0.0..LONGEST_CLOCK).contains(time)).unwrap_or(0.0)
    }

    fn first_time(&self) -> Option<f64> {
        self.recordings.iter().find_map(|r| r.time.first().copied())
    }

    /// Seconds between the end of the recording before `index` and its start; `None` when unknown.
    #[must_use]
    pub fn pause_before(&self, index: usize) -> Option<f64> {
        if self.clock == Clock::Separate {
            return None;
        }
        let before = self.recordings.get(index.checked_sub(1)?)?;
        Some(self.recordings.get(index)?.time.first()? - before.time.last()?)
    }
}

/// Of ten thousand readings one may be a spike.
const SPIKES: f64 = 1e-4;

/// The largest force that was measured in a campaign, N; its sign is kept, and the few largest readings do not count. A scale for errors
/// that depends on no fit. 0 without force.
///
/// ```
/// use pam_data::recording::{Campaign, Recording, largest_force};
/// let recording = Recording { force: Some(vec![-1.0, 40.0, 130.5]), ..Recording::default() };
/// assert_eq!(largest_force(&Campaign::new(vec![recording])), 130.5);
/// ```
#[must_use]
pub fn largest_force(campaign: &Campaign) -> f64 {
    largest_force_of(campaign.recordings.iter())
}

/// The same of some recordings.
#[must_use]
pub fn largest_force_of<'a>(recordings: impl Iterator<Item = &'a Recording> + Clone) -> f64 {
    let forces = || recordings.clone().filter_map(|r| r.force.as_deref()).flatten().copied();
    // Only the upper end is sorted.
    let kept = 1 + (SPIKES * forces().count() as f64) as usize;
    let mut top: Vec<f64> = Vec::with_capacity(2 * kept);
    for force in forces() {
        top.push(force);
        if top.len() == 2 * kept {
            top.select_nth_unstable_by(kept - 1, |a, b| b.total_cmp(a));
            top.truncate(kept);
        }
    }
    top.sort_by(|a, b| b.total_cmp(a));
    top.get(kept - 1).or(top.last()).copied().unwrap_or(0.0)
}

/// A warning about a recording whose clock pauses while the length changes: runs at different lengths in one file look like motion.
fn joined_runs(recording: &Recording) -> Option<String> {
    /// The change of the stroke, as a share of its range: more than a held length yields in a pause.
    const CHANGE: f64 = 0.05;
    let (time, stroke) = (&recording.time, &recording.stroke);
    let least = least_pause(time)?;
    let pauses: Vec<usize> =
        (1..time.len().min(stroke.len())).filter(|i| time[*i] - time[i - 1] > least).collect();
    if pauses.is_empty() {
        return None;
    }
    let range = range(stroke.iter());
    let change = |i: &usize| (stroke[*i] - stroke[i - 1]).abs();
    let at = pauses.into_iter().find(|i| change(i) > CHANGE * range)?;
    Some(format!(
        "the clock of `{}` pauses for {:.0} s at {:.2} s, and the length changes by {:.2} mm: if several runs are in one file, set them apart \
         (`host import --guess` finds columns that number them)",
        recording.name,
        time[at] - time[at - 1],
        time[at - 1],
        1e3 * change(&at)
    ))
}

/// The shortest pause of a clock, s.
pub(super) fn least_pause(time: &[f64]) -> Option<f64> {
    /// A pause lasts this many sample intervals and seconds; rows that a logger lost are fewer.
    const PAUSE: (f64, f64) = (20.0, 2.0);
    Some(PAUSE.1.max(PAUSE.0 * typical_interval(time)?))
}

/// The median time between rows, s, of some rows at the beginning.
fn typical_interval(time: &[f64]) -> Option<f64> {
    const ROWS: usize = 1000;
    let mut steps: Vec<f64> = time.windows(2).take(ROWS).map(|w| w[1] - w[0]).collect();
    (!steps.is_empty()).then(|| median(&mut steps))
}

/// A warning about a recording whose time has another unit than that of the others: its sample interval is a thousand times theirs, or a
/// thousandth, and the stroke per row is the same; where lengths are held, the change of pressure per row.
fn other_clock(recordings: &[Recording]) -> Option<String> {
    if recordings.len() < 3 {
        return None;
    }
    let held = recordings.iter().all(|r| r.held_stroke().is_some());
    let what = if held { "change of pressure" } else { "stroke" };
    let a_row = |r: &Recording| {
        let steps = r.len().saturating_sub(1).max(1) as f64;
        let way = |of: &[f64]| of.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>() / steps;
        let moved = if held { way(&r.pressure) } else { way(&r.stroke) };
        (r.duration() / steps, moved)
    };
    let rows: Vec<(f64, f64)> = recordings.iter().map(a_row).collect();
    let middle = |of: &dyn Fn(&(f64, f64)) -> f64| median(&mut rows.iter().map(of).collect::<Vec<_>>());
    let (interval, way) = (middle(&|r| r.0), middle(&|r| r.1));
    let odd = |(time, moved): &(f64, f64)| {
        let thousand = [1e3, 1e-3].iter().any(|f| (time / interval / f - 1.0).abs() < 0.02);
        thousand && (0.5..2.0).contains(&(moved / way))
    };
    let i = rows.iter().position(odd)?;
    Some(format!(
        "the sample interval of `{}` is {:.4} s, that of the others {:.4} s, with the same {what} per row: its time seems to have another \
         unit; put the logged unit into the column's name",
        recordings[i].name, rows[i].0, interval
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(name: &str, start: f64, end: f64) -> Recording {
        Recording { name: name.into(), time: vec![start, end], ..Recording::default() }
    }

    #[test]
    fn disjoint_times_are_one_clock_and_are_sorted() {
        let campaign = Campaign::new(vec![from("b", 100.0, 150.0), from("a", 0.0, 50.0)]);
        assert_eq!(campaign.clock, Clock::Shared);
        assert_eq!(campaign.recordings[0].name, "a");
        assert_eq!(campaign.pause_before(1), Some(50.0));
        assert_eq!(campaign.pause_before(0), None);
        assert_eq!(campaign.warnings.len(), 1);
    }

    #[test]
    fn files_that_all_start_near_zero_keep_their_order_with_unknown_pauses() {
        let campaign = Campaign::new(vec![from("b", 0.2, 50.0), from("a", 0.0, 60.0)]);
        assert_eq!((campaign.clock, campaign.recordings[0].name.as_str()), (Clock::Separate, "b"));
        assert_eq!(campaign.pause_before(1), None);
        assert!(campaign.warnings.is_empty());
    }

    #[test]
    fn a_recording_that_is_given_twice_is_reported() {
        let warned = |recordings| Campaign::new(recordings).warnings.join("; ");
        assert_eq!(warned(vec![from("a", 0.0, 60.0), from("b", 0.0, 50.0)]), "");
        let twice = warned(vec![from("a", 0.0, 60.0), from("b", 0.0, 50.0), from("a", 0.0, 60.0)]);
        assert_eq!(twice, "`a` is given twice, and counts twice");
        let copied = warned(vec![from("a", 0.0, 60.0), from("copy", 0.0, 60.0)]);
        assert_eq!(copied, "`a` and `copy` hold the same rows, which count twice");
    }

    #[test]
    fn a_clock_in_another_unit_is_reported_at_held_lengths_too() {
        let staircase = |unit: f64| Recording {
            time: (0..60).map(|i| unit * 0.1 * f64::from(i)).collect(),
            pressure: (0..60).map(|i| 1e4 * f64::from(30 - (i - 30_i32).abs())).collect(),
            stroke: vec![5e-3; 60],
            ..Recording::default()
        };
        let warned = |of: [f64; 3]| Campaign::new(of.map(staircase).to_vec()).warnings.join("; ");
        assert!(
            warned([1.0, 1e3, 1.0]).contains("same change of pressure per row"),
            "{}",
            warned([1.0, 1e3, 1.0])
        );
        assert!(!warned([1.0, 2.0, 1.0]).contains("another unit"));
    }

    #[test]
    fn runs_at_different_lengths_in_one_file_are_reported() {
        let remark = |pause: f64, mm: f64| {
            let row = |i: i32| {
                (0.1 * f64::from(i) + if i < 50 { 0.0 } else { pause }, if i < 50 { 0.0 } else { 1e-3 * mm })
            };
            let (time, stroke) = (0..100).map(row).unzip();
            let recording = Recording { name: "a".into(), time, stroke, ..Recording::default() };
            Campaign::new(vec![recording]).warnings.join("; ")
        };
        assert!(
            remark(30.0, 7.5)
                .starts_with("the clock of `a` pauses for 30 s at 4.90 s, and the length changes by 7.50 mm")
        );
        // Lost rows during a motion, and a pause at one length, are not runs.
        assert_eq!((remark(1.0, 7.5), remark(30.0, 0.0)), (String::new(), String::new()));
    }

    #[test]
    fn milliseconds_under_a_heading_in_seconds_are_reported() {
        let loops = |name: &str, start: f64, interval: f64, way: f64| Recording {
            name: name.into(),
            time: (0..100).map(|i| start + interval * f64::from(i)).collect(),
            stroke: (0..100).map(|i| way * f64::from(i % 20)).collect(),
            ..Recording::default()
        };
        let remark = |interval: f64, way: f64| {
            let files = [("a", 0.0, 0.1, 1e-4), ("b", 20.0, interval, way), ("c", 1e6, 0.1, 1e-4)];
            Campaign::new(files.map(|(n, s, i, w)| loops(n, s, i, w)).to_vec()).warnings.join("; ")
        };
        let said = remark(100.0, 1e-4);
        assert!(said.contains("`b` is 100.0000 s, that of the others 0.1000 s"), "{said}");
        assert!(remark(1e-4, 1e-4).contains("another unit"));
        // A logger that was set to another rate sees the same motion.
        assert_eq!(remark(1e-4, 1e-7), "");
        assert_eq!(remark(0.1, 1e-4), "");
        assert_eq!(remark(10.0, 1e-4), "");
    }

    #[test]
    fn overlap_far_from_zero_is_reported() {
        let campaign = Campaign::new(vec![from("a", 500.0, 600.0), from("b", 550.0, 650.0)]);
        assert_eq!(campaign.clock, Clock::Separate);
        assert_eq!(campaign.warnings.len(), 1);
    }

    #[test]
    fn a_bench_s_clock_is_kept_and_a_clock_of_the_world_or_of_each_file_is_not() {
        let beginning = |files: &[(f64, f64)]| {
            Campaign::new(files.iter().map(|(start, end)| from("r", *start, *end)).collect()).beginning()
        };
        assert_eq!(beginning(&[(6.0, 25.0), (28.2, 71.9)]), 6.0);
        assert_eq!(beginning(&[(0.5, 25.0), (0.4, 71.9)]), 0.0);
        assert_eq!(beginning(&[(1.7e9, 1.7e9 + 25.0)]), 0.0);
        assert_eq!(beginning(&[(-3.0, 25.0)]), 0.0);
        assert_eq!(beginning(&[]), 0.0);
    }
}
