//! The pressures that a campaign was made at, where it was made at constant ones.

use super::Recording;
use super::scale;

/// One constant pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureLevel {
    /// Mean of its samples, Pa.
    pub mean: f64,
    /// Their standard deviation, Pa.
    pub std: f64,
    /// How many samples it has.
    pub samples: usize,
    /// Samples from here …
    pub low: f64,
    /// … to here belong to it, Pa.
    pub high: f64,
}

/// What pressures a campaign was made at.
#[derive(Debug, Clone, PartialEq)]
pub enum PressureLevels {
    /// A few constant ones, in ascending order.
    Constant(Vec<PressureLevel>),
    /// Everywhere between these two, Pa.
    Continuous {
        /// The lowest.
        low: f64,
        /// The highest.
        high: f64,
    },
}

/// More levels than this are not levels.
const MOST: usize = 40;
const BINS: usize = 4096;

impl PressureLevels {
    /// Groups the samples of some recordings by pressure: levels are where samples crowd, with gaps of at least 2 % of the top
    /// pressure between them. If less than 80 % of the samples are on levels, pressure is continuous.
    #[must_use]
    pub fn of<'a>(recordings: impl IntoIterator<Item = &'a Recording> + Clone) -> Self {
        let samples = || recordings.clone().into_iter().flat_map(|r| r.pressure.iter().copied());
        let (low, high) =
            samples().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        if !(low <= high) {
            return Self::Constant(Vec::new());
        }
        let noise =
            recordings.clone().into_iter().map(|r| scale::of_pressure(&r.pressure).noise).fold(0.0, f64::max);
        let gap = (0.02 * high.abs().max(low.abs())).max(4.0 * noise).max(1.0);
        if high - low < gap {
            return Self::Constant(vec![statistics(samples(), low, high)]);
        }
        let width = (high - low) / BINS as f64;
        let bin = |p: f64| (((p - low) / width) as usize).min(BINS - 1);
        let mut counts = vec![0usize; BINS];
        let mut total = 0;
        for p in samples() {
            counts[bin(p)] += 1;
            total += 1;
        }
        // Samples within a gap's width about each bin; a level holds a good share of all samples, a ramp does not.
        let reach = ((gap / width) as usize / 2).max(1);
        let mut near = vec![0usize; BINS + 1];
        for i in 0..BINS {
            near[i + 1] = near[i] + counts[i];
        }
        let crowd = |i: usize| near[(i + reach + 1).min(BINS)] - near[i.saturating_sub(reach)];
        let least = (total / 200).max(5);
        let mut levels: Vec<PressureLevel> = Vec::new();
        let mut taken = vec![false; BINS];
        let mut order: Vec<usize> = (0..BINS).filter(|i| crowd(*i) >= least).collect();
        order.sort_by_key(|i| std::cmp::Reverse(crowd(*i)));
        for i in order {
            let around = i.saturating_sub(2 * reach)..(i + 2 * reach + 1).min(BINS);
            if taken[around.clone()].iter().any(|t| *t) {
                continue;
            }
            taken[i] = true;
            let at = |bin: usize| low + width * bin as f64;
            let inside = (at(i.saturating_sub(reach)), at(i + reach + 1));
            levels.push(statistics(
                samples().filter(|p| *p >= inside.0 && *p < inside.1),
                inside.0,
                inside.1,
            ));
            if levels.len() > MOST {
                break;
            }
        }
        let on_levels: usize = levels.iter().map(|l| l.samples).sum();
        // Uniformly spread samples would fill levels in proportion to their width alone.
        let by_chance = levels.len() as f64 * gap / (high - low);
        let share = on_levels as f64 / total.max(1) as f64;
        // Samples that merely fill the width of a level have a standard deviation of 0.29 of it.
        let spread = levels.iter().map(|l| l.std * l.samples as f64).sum::<f64>() / on_levels.max(1) as f64;
        if levels.len() > MOST || spread > 0.2 * gap || share < 0.8 || share < 1.25 * by_chance {
            return Self::Continuous { low, high };
        }
        levels.sort_by(|a, b| a.mean.total_cmp(&b.mean));
        Self::Constant(levels)
    }

    /// The number of the level that a pressure (Pa) belongs to.
    #[must_use]
    pub fn level(&self, pressure: f64) -> Option<usize> {
        match self {
            Self::Constant(levels) => levels.iter().position(|l| (l.low..=l.high).contains(&pressure)),
            Self::Continuous { .. } => None,
        }
    }
}

fn statistics(samples: impl Iterator<Item = f64>, low: f64, high: f64) -> PressureLevel {
    // Welford's recurrence: one pass, no cancellation.
    let (mut n, mut mean, mut squares) = (0usize, 0.0, 0.0);
    for p in samples {
        n += 1;
        let off = p - mean;
        mean += off / n as f64;
        squares += off * (p - mean);
    }
    let std = if n > 1 { (squares / (n - 1) as f64).sqrt() } else { 0.0 };
    PressureLevel { mean, std, samples: n, low, high }
}
