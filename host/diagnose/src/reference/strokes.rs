//! Strokes at regulated pressures, reduced to cells: level of pressure, part of the stroke, direction, stroke.

use pam_data::statistics::{median, quantile, range};
use std::collections::BTreeMap;

use super::criteria::{
    LEVEL, STROKE_BINS, STROKE_ENDS, STROKE_SPEED, STROKE_SPEED_QUANTILE, STROKES_ENDS, STROKES_FEWEST_ROWS,
    STROKES_RUN_IN, STROKES_SPEED_OVER,
};
use super::surface::bin;
use pam_data::error::Result;
use pam_data::recording::motion;
use pam_data::recording::{Campaign, Recording};

/// Means of one stroke in one part of it.
#[derive(Debug, Clone, Copy)]
struct Part {
    direction: f64,
    pressure: f64,
    stroke: f64,
    force: f64,
    bin: usize,
    /// Counted through the campaign.
    number: usize,
}

/// Both directions of one cell.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Band {
    /// Mean of both directions, N.
    pub middle: f64,
    /// Half of (growing displacement minus shrinking) taken the other way: friction of a muscle makes it positive, N.
    pub half: f64,
    pub pressure: f64,
    /// Half of the pressure's difference between the directions, Pa.
    pub pressure_half: f64,
    pub stroke: f64,
    /// Standard error by the spread over strokes, N.
    pub error: f64,
    pub force: [f64; 2],
}

/// Level and part of the stroke.
pub(crate) type Key = (usize, usize);

/// Levels of pressure, Pa, ascending, of recordings on both sides.
pub(crate) fn levels(campaigns: &[&Campaign]) -> Vec<f64> {
    let mut means: Vec<f64> = campaigns
        .iter()
        .flat_map(|c| c.recordings.iter().flat_map(|r| strokes(r).into_iter().map(|s| s.1)))
        .collect();
    means.sort_by(f64::total_cmp);
    let top = means.last().copied().unwrap_or(0.0).abs();
    let mut groups: Vec<Vec<f64>> = Vec::new();
    for m in means {
        match groups.last_mut() {
            Some(group) if group.last().is_some_and(|l| m - l <= LEVEL * top) => group.push(m),
            _ => groups.push(vec![m]),
        }
    }
    groups.iter().map(|g| g.iter().sum::<f64>() / g.len() as f64).collect()
}

/// Median over the strokes of the range of pressure within one, Pa.
pub(super) fn unrest(recording: &Recording) -> f64 {
    let own = |rows: std::ops::Range<usize>| range(&recording.pressure[rows]);
    let mut ranges: Vec<f64> = strokes(recording).into_iter().map(|s| own(s.0)).collect();
    quantile(&mut ranges, 0.5)
}

/// Rows and mean pressure of every stroke.
fn strokes(recording: &Recording) -> Vec<(std::ops::Range<usize>, f64, f64)> {
    let direction = motion::way(&recording.stroke, motion::reversal_threshold(range(&recording.stroke)), 0.0);
    let mut all = Vec::new();
    let mut start = 0;
    for i in 1..=direction.len() {
        if i == direction.len() || direction[i] != direction[start] {
            let mean = recording.pressure[start..i].iter().sum::<f64>() / (i - start) as f64;
            all.push((start..i, mean, direction[start]));
            start = i;
        }
    }
    all
}

/// Speed as a centred mean of slopes, m/s.
fn speed(time: &[f64], stroke: &[f64]) -> Vec<f64> {
    let n = time.len();
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return vec![0.0; n];
    }
    let usual = median(&mut steps);
    let half = ((STROKES_SPEED_OVER / usual) as usize).max(3).div_ceil(2);
    (0..n)
        .map(|i| {
            let (a, b) = (i.saturating_sub(half), (i + half).min(n - 1));
            if b > a { (stroke[b] - stroke[a]) / (time[b] - time[a]) } else { 0.0 }
        })
        .collect()
}

/// Ends of the stroke of a campaign, m.
pub(crate) fn ends(campaign: &Campaign) -> (f64, f64) {
    let mut all: Vec<f64> = campaign.recordings.iter().flat_map(|r| r.stroke.iter().copied()).collect();
    (quantile(&mut all, STROKES_ENDS.0), quantile(&mut all, STROKES_ENDS.1))
}

fn parts(
    recording: &Recording,
    force: &[f64],
    (low, high): (f64, f64),
    number: &mut usize,
) -> Vec<(f64, Part)> {
    let speed = speed(&recording.time, &recording.stroke);
    let mut speeds: Vec<f64> = speed.iter().map(|v| v.abs()).collect();
    let fast = STROKE_SPEED * quantile(&mut speeds, STROKE_SPEED_QUANTILE);
    let margin = STROKE_ENDS * (high - low);
    let mut all = Vec::new();
    for (rows, level, direction) in strokes(recording) {
        let mut sums = [(0.0, 0.0, 0.0, 0usize); STROKE_BINS];
        for i in rows {
            let x = recording.stroke[i];
            let moving = speed[i].abs() > fast && speed[i] * direction > 0.0;
            if moving && x > low + margin && x < high - margin {
                let s = &mut sums[bin(x, low, high, STROKE_BINS)];
                *s = (s.0 + recording.pressure[i], s.1 + x, s.2 + force[i], s.3 + 1);
            }
        }
        for (bin, (p, x, f, n)) in sums.into_iter().enumerate().filter(|(_, s)| s.3 >= STROKES_FEWEST_ROWS) {
            let n = n as f64;
            let part = Part { direction, pressure: p / n, stroke: x / n, force: f / n, bin, number: *number };
            all.push((level, part));
        }
        *number += 1;
    }
    all
}

/// Bands of every level and part of the stroke.
///
/// # Errors
/// A recording without force.
pub(crate) fn bands(campaign: &Campaign, levels: &[f64], ends: (f64, f64)) -> Result<BTreeMap<Key, Band>> {
    let mut by_level: BTreeMap<usize, Vec<Part>> = BTreeMap::new();
    let mut number = 0;
    for recording in &campaign.recordings {
        let force = recording.require_force()?;
        for (level, part) in parts(recording, force, ends, &mut number) {
            let near = |i: &usize| (levels[*i] - level).abs();
            let index = (0..levels.len()).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or(0);
            by_level.entry(index).or_default().push(part);
        }
    }
    let mut all = BTreeMap::new();
    for (level, mut parts) in by_level {
        let mut numbers: Vec<usize> = parts.iter().map(|p| p.number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        if numbers.len() > STROKES_RUN_IN {
            let last = numbers[1.min(numbers.len() - 3)];
            parts.retain(|p| p.number > last);
        }
        for bin in 0..STROKE_BINS {
            if let Some(band) = band(&parts, bin) {
                all.insert((level, bin), band);
            }
        }
    }
    Ok(all)
}

fn band(parts: &[Part], bin: usize) -> Option<Band> {
    let side = |d: f64| parts.iter().filter(|p| p.bin == bin && p.direction == d).collect::<Vec<_>>();
    let (a, b) = (side(1.0), side(-1.0));
    if a.len() < 2 || b.len() < 2 {
        return None;
    }
    let mean = |s: &[&Part], of: &dyn Fn(&Part) -> f64| s.iter().map(|p| of(p)).sum::<f64>() / s.len() as f64;
    let variance = |s: &[&Part]| {
        let m = mean(s, &|p| p.force);
        s.iter().map(|p| (p.force - m).powi(2)).sum::<f64>() / (s.len() - 1) as f64 / s.len() as f64
    };
    let (fa, fb) = (mean(&a, &|p| p.force), mean(&b, &|p| p.force));
    let (pa, pb) = (mean(&a, &|p| p.pressure), mean(&b, &|p| p.pressure));
    Some(Band {
        middle: (fa + fb) / 2.0,
        half: (fb - fa) / 2.0,
        pressure: (pa + pb) / 2.0,
        pressure_half: (pa - pb) / 2.0,
        stroke: (mean(&a, &|p| p.stroke) + mean(&b, &|p| p.stroke)) / 2.0,
        error: (variance(&a) + variance(&b)).sqrt() / 2.0,
        force: [fa, fb],
    })
}
