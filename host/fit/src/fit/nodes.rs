//! Where the curves over pressure get their nodes: at the tested levels, or spread over a continuous range.

use pam_data::statistics::{extremes, median};
use std::collections::HashMap;

use model_core::spline::MAX_NODES;

use super::points::{Point, Points, Range};

/// The pressures of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressures {
    /// The tested levels, or the middle of each interval of a continuous range, Pa, increasing.
    pub levels: Vec<f64>,
    /// Whether `levels` are pressures that were held; otherwise the pressure moved through the whole range.
    pub held: bool,
    /// The curves' nodes, Pa: the levels, and guards beyond them where the controller will need values.
    pub nodes: Vec<f64>,
}

impl Pressures {
    /// The tested level, or the interval, that a pressure in Pa belongs to.
    pub(super) fn nearest(&self, pressure: f64) -> u32 {
        let levels = &self.levels;
        let nearest = (0..levels.len())
            .min_by(|a, b| (levels[*a] - pressure).abs().total_cmp(&(levels[*b] - pressure).abs()));
        nearest.unwrap_or(0) as u32
    }
}

/// Intervals of a continuous range.
const INTERVALS: usize = 8;
const BINS: usize = 1024;

/// Finds the tested pressures from the distribution of rows. `max_pressure` is the highest that a controller may command, Pa.
#[must_use]
pub fn pressures(points: &Points, max_pressure: f64) -> Pressures {
    let range = points.pressure;
    let levels = held_levels(points);
    if let Some(levels) = levels {
        let nodes = guarded(&levels, max_pressure);
        return Pressures { levels, held: true, nodes };
    }
    let step = range.span() / INTERVALS as f64;
    let levels = (0..INTERVALS).map(|i| range.low + (i as f64 + 0.5) * step).collect();
    // One node more than intervals: the ends of the range are nodes.
    let inner: Vec<f64> = (0..=INTERVALS).map(|i| range.low + i as f64 * step).collect();
    Pressures { levels, held: false, nodes: guarded(&inner, max_pressure) }
}

/// Half-widths that a level may have, as shares of the range: the steps between few pressures may be small against the ripple
/// of the regulator and the noise of the sensor, which are what makes a level wide.
const HALF_WIDTHS: [f64; 4] = [0.0075, 0.015, 0.03, 0.06];

/// Levels hold at least this share of the rows: the rest are ramps between them.
const HELD: f64 = 0.8;
/// Rows away from the longest level matter from this share on; fewer are its regulator's transients.
const MOVING: f64 = 0.1;

/// The pressures that were held, if nearly all rows lie at a few of them.
fn held_levels(points: &Points) -> Option<Vec<f64>> {
    let range = points.pressure;
    // A regulator's ripple is not a range of pressures.
    if range.span() <= 0.02 * range.high.abs().max(range.low.abs()) {
        let rows = points.rows.max(1) as f64;
        return Some(vec![points.list.iter().map(|p| f64::from(p.rows) * p.pressure).sum::<f64>() / rows]);
    }
    let weight = row_weights(points);
    let mut rows = vec![0.0; BINS];
    for p in &points.list {
        rows[bin(range, p.pressure)] += weight(p);
    }
    HALF_WIDTHS.into_iter().find_map(|share| {
        let half = (BINS as f64 * share) as usize;
        let peaks = peaks(&rows, half)?;
        let mut sums = vec![(0.0, 0.0); peaks.len()];
        for p in &points.list {
            let b = bin(range, p.pressure);
            // Twice as far as a level is wide, so that its mean is not that of the densest part alone.
            let nearest = (0..peaks.len()).min_by_key(|i| peaks[*i].abs_diff(b));
            if let Some(i) = nearest.filter(|i| peaks[*i].abs_diff(b) <= 2 * half) {
                let n = weight(p);
                sums[i] = (sums[i].0 + n * p.pressure, sums[i].1 + n);
            }
        }
        let mut levels: Vec<f64> = sums.iter().map(|(sum, n)| sum / n).collect();
        levels.sort_by(f64::total_cmp);
        Some(levels)
    })
}

/// Recordings whose sampling rates differ by less than this factor count row by row.
const RATES: f64 = 2.0;

/// How many rows a point counts for. Where one recording was sampled much faster than another, time decides instead of rows: else the
/// pressures of the slow one would vanish beside its rows.
fn row_weights(points: &Points) -> impl Fn(&Point) -> f64 {
    let mut spans: HashMap<u32, (f64, f64, f64)> = HashMap::new();
    for p in &points.list {
        let (first, last, rows) = spans.entry(p.recording).or_insert((p.time, p.time, 0.0));
        (*first, *last, *rows) = (first.min(p.time), last.max(p.time), *rows + f64::from(p.rows));
    }
    let intervals: HashMap<u32, f64> =
        spans.into_iter().map(|(r, (first, last, rows))| (r, (last - first) / rows)).collect();
    let mut known: Vec<f64> = intervals.values().copied().filter(|i| *i > 0.0).collect();
    let (least, most) = extremes(&known);
    let usual = median(&mut known);
    let differ = most > RATES * least;
    move |p| {
        let interval = intervals.get(&p.recording).copied().filter(|i| differ && *i > 0.0);
        f64::from(p.rows) * interval.map_or(1.0, |i| i / usual)
    }
}

fn bin(range: Range, pressure: f64) -> usize {
    (((pressure - range.low) / range.span() * BINS as f64) as usize).min(BINS - 1)
}

/// Where rows crowd within `half` bins, if nearly all of them do: `rows` counts them by bin of pressure.
fn peaks(rows: &[f64], half: usize) -> Option<Vec<usize>> {
    let total: f64 = rows.iter().sum();
    let within = |i: usize| rows[i.saturating_sub(half)..(i + half + 1).min(BINS)].iter().sum::<f64>();
    let near: Vec<f64> = (0..BINS).map(within).collect();
    let width = 2 * half + 1;
    // A level exceeds its surroundings, however few rows it has: short strokes at low pressure are a level too.
    let stands_out = |i: usize| {
        let around = [i.checked_sub(2 * width), i.checked_sub(width), Some(i + width), Some(i + 2 * width)];
        let beside: f64 = around.into_iter().flatten().filter_map(|k| near.get(k)).sum::<f64>() / 4.0;
        near[i] > 4.0 * beside && near[i] > (0.003 * total).max(8.0)
    };
    let mut order: Vec<usize> = (0..BINS).filter(|i| stands_out(*i)).collect();
    order.sort_by(|a, b| near[*b].total_cmp(&near[*a]).then(a.cmp(b)));
    let mut peaks: Vec<usize> = Vec::new();
    for i in order {
        if peaks.iter().all(|p| p.abs_diff(i) > width) {
            peaks.push(i);
        }
    }
    // Ramps between levels are used as data, but do not hide the levels.
    let held: f64 = peaks.iter().map(|i| near[*i]).sum();
    // A long stay at one pressure does not make a ramp to it levels: the rows elsewhere must lie at levels too.
    let longest = peaks.iter().map(|i| near[*i]).fold(0.0, f64::max);
    let elsewhere = (total - longest, held - longest);
    let ramp = elsewhere.0 > MOVING * total && elsewhere.1 < HELD * elsewhere.0;
    (!peaks.is_empty() && peaks.len() <= MAX_NODES - 2 && held >= HELD * total && !ramp).then_some(peaks)
}

/// Nodes beyond the tested pressures: down to where the muscle begins to pull, up to what may be commanded. The evaluator
/// holds a curve's end value outside its nodes; with a guard the smoothness penalty continues the trend instead.
fn guarded(tested: &[f64], max_pressure: f64) -> Vec<f64> {
    let mut nodes = tested.to_vec();
    let (Some(&low), Some(&high)) = (tested.first(), tested.last()) else { return nodes };
    if tested.len() < 2 {
        return nodes;
    }
    let step = (high - low) / (tested.len() - 1) as f64;
    let guard = (low - 2.0 * step).max(0.3 * low);
    if low > 0.1 * high && low - guard > 0.3 * step && nodes.len() < MAX_NODES {
        nodes.insert(0, guard);
    }
    if max_pressure > high + 0.3 * step && nodes.len() < MAX_NODES {
        nodes.push(max_pressure.min(high + 2.0 * step));
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::points::points;
    use pam_data::recording::dropouts::Screened;
    use pam_data::recording::motion::Motion;
    use pam_data::recording::{Campaign, Recording};

    fn at(pressures: Vec<f64>) -> Points {
        let n = pressures.len();
        let recording = Recording {
            time: (0..n).map(|i| i as f64).collect(),
            stroke: (0..n).map(|i| 1e-3 * (i as f64 * 0.1).sin()).collect(),
            force: Some(vec![1.0; n]),
            pressure: pressures,
            ..Recording::default()
        };
        points(
            &Screened::of(&Campaign::new(vec![recording])),
            &[Motion { direction: vec![1; n], ..Motion::default() }],
        )
    }

    #[test]
    fn the_pressure_of_a_slow_recording_is_a_level_beside_a_fast_one() {
        let held = |rows: usize, interval: f64, pressure: f64| Recording {
            time: (0..rows).map(|i| i as f64 * interval).collect(),
            stroke: (0..rows).map(|i| 1e-3 * (i as f64 * interval).sin()).collect(),
            force: Some(vec![1.0; rows]),
            pressure: (0..rows).map(|i| pressure + 500.0 * (i as f64 * 0.7).sin()).collect(),
            ..Recording::default()
        };
        // A minute each: 240 of 120,240 rows are at the lower pressure.
        let recordings = vec![held(240, 0.25, 200e3), held(60_000, 1e-3, 300e3), held(60_000, 1e-3, 400e3)];
        let motions: Vec<Motion> =
            recordings.iter().map(|r| Motion { direction: vec![1; r.len()], ..Motion::default() }).collect();
        let found = pressures(&points(&Screened::of(&Campaign::new(recordings)), &motions), 500e3);
        assert_eq!(found.levels.len(), 3, "{found:?}");
        assert!((found.levels[0] - 200e3).abs() < 1e3, "{found:?}");
    }

    #[test]
    fn levels_with_ripple_and_ramps_between_are_found() {
        let levels = [207e3, 276e3, 345e3, 414e3, 483e3, 552e3];
        let mut p = Vec::new();
        for (k, level) in levels.iter().enumerate() {
            p.extend((0..2000).map(|i| level + 800.0 * (f64::from(i) * 0.7).sin()));
            if k + 1 < levels.len() {
                p.extend((0..50).map(|i| level + 69e3 / 50.0 * f64::from(i)));
            }
        }
        let found = pressures(&at(p), 600e3);
        assert!(found.held);
        assert_eq!(found.levels.len(), 6);
        for (f, l) in found.levels.iter().zip(levels) {
            assert!((f - l).abs() < 500.0, "{f} {l}");
        }
        assert_eq!(found.nodes.len(), 8, "one guard below, one above: {:?}", found.nodes);
    }

    #[test]
    fn levels_close_to_one_another_are_found_beside_ripple_and_noise() {
        // Two pressures 60 kPa apart under ±1.5 kPa of ripple; six under noise of 4 kPa, which is what a poor sensor reads.
        let rippled = |level: f64| (0..3000).map(move |i| level + 1500.0 * (f64::from(i) * 0.044).sin());
        let two = pressures(&at(rippled(300e3).chain(rippled(360e3)).collect()), 400e3);
        assert!(two.held, "{two:?}");
        assert_eq!(two.levels.len(), 2);
        let noisy = |level: f64| {
            // A sum of incommensurate waves is about normal.
            (0..3000).map(move |i| {
                let wave = |w: f64| (f64::from(i) * w + level).sin();
                level + 4e3 * (wave(0.7) + wave(1.9) + wave(2.6) + wave(1.23)) / 2f64.sqrt()
            })
        };
        let levels = [207e3, 276e3, 345e3, 414e3, 483e3, 552e3];
        let six = pressures(&at(levels.into_iter().flat_map(noisy).collect()), 620e3);
        assert!(six.held, "{six:?}");
        assert_eq!(six.levels.len(), 6);
        for (found, level) in six.levels.iter().zip(levels) {
            assert!((found - level).abs() < 500.0, "{found} {level}");
        }
    }

    #[test]
    fn a_slow_wave_of_pressure_is_a_range() {
        let wave = (0..5000).map(|i| 380e3 + 170e3 * (f64::from(i) * 0.01).sin());
        assert!(!pressures(&at(wave.collect()), 620e3).held);
    }

    #[test]
    fn a_staircase_without_held_levels_is_a_range() {
        let found = pressures(&at((0..5000).map(|i| 8e3 + 120.0 * f64::from(i)).collect()), 620e3);
        assert!(!found.held);
        assert_eq!((found.levels.len(), found.nodes.len()), (INTERVALS, INTERVALS + 1));
    }

    #[test]
    fn a_long_stay_at_the_top_of_a_ramp_makes_no_levels_of_it() {
        // Staircases of a muscle that pulls from 60 kPa on, and stays at 620 kPa for most of the time.
        let ramp = |turn: u32| (0..40).map(move |i| 60e3 + 14e3 * f64::from(i) + 1e3 * f64::from(turn));
        let stay = (0..60).map(|i| 620e3 + 500.0 * f64::from(i).sin());
        let staircases: Vec<f64> = (0..12).flat_map(|turn| ramp(turn).chain(stay.clone())).collect();
        let found = pressures(&at(staircases), 650e3);
        assert!(!found.held, "{found:?}");
        assert!(found.nodes.len() > INTERVALS);
    }

    #[test]
    fn one_pressure_is_one_level() {
        let found = pressures(&at((0..500).map(|i| 3e5 + 900.0 * f64::from(i).sin()).collect()), 4e5);
        assert_eq!((found.levels.len(), found.nodes.len(), found.held), (1, 1, true));
    }
}
