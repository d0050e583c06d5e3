//! Several recordings of one muscle, in the order in which they happened.

use super::Recording;

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
    /// What a careful reader should know, such as files that were put into order.
    pub warnings: Vec<String>,
}

impl Campaign {
    /// Decides from the times whether the clock is shared, and puts recordings with a shared clock into order.
    ///
    /// With one clock no two recordings overlap. They are sorted by time then, because a shell lists `run10` before `run2`.
    /// Recordings that overlap cannot share a clock; their given order stands.
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
    /// from a beginning of its own; a clock of the world's says nothing of the muscle, and readings count from the first then.
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
    fn a_recording_that_is_given_twice_is_told() {
        let warned = |recordings| Campaign::new(recordings).warnings.join("; ");
        assert_eq!(warned(vec![from("a", 0.0, 60.0), from("b", 0.0, 50.0)]), "");
        let twice = warned(vec![from("a", 0.0, 60.0), from("b", 0.0, 50.0), from("a", 0.0, 60.0)]);
        assert_eq!(twice, "`a` is given twice, and counts twice");
        let copied = warned(vec![from("a", 0.0, 60.0), from("copy", 0.0, 60.0)]);
        assert_eq!(copied, "`a` and `copy` hold the same rows, which count twice");
    }

    #[test]
    fn overlap_far_from_zero_is_told() {
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
