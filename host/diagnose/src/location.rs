//! Location of the error: its energy above the noise along every coordinate, with a p-value from shuffled blocks.

use rayon::prelude::*;

use super::criteria::location::{
    BINS, DISCRETE_BINS, MOST_REGIONS, REGION_ALPHA, REGION_ROWS, REGION_SHUFFLES, REGION_SMOOTHING,
    REGION_VARIANCE, SMOOTHED_NOISE, SMOOTHED_NOISE_MOST,
};
use super::criteria::rows::MOST_LEVELS;
use super::linear::{Random, energy};
use super::rows::Rows;
use super::verdict::{Profile, Region};

struct Coordinate {
    name: &'static str,
    unit: &'static str,
    values: Vec<f64>,
    /// Only a few values, each a bin of its own.
    discrete: bool,
}

fn coordinates(rows: &Rows) -> Vec<Coordinate> {
    let c = rows.contexts();
    let of = |name, unit, discrete, f: &dyn Fn(usize) -> f64| Coordinate {
        name,
        unit,
        values: (0..rows.len()).map(f).collect(),
        discrete,
    };
    let mut all = vec![
        of("recording", "", true, &|i| f64::from(rows.recording[i]) + 1.0),
        of("time", "s", false, &|i| c[i].time),
        of("cycle", "", true, &|i| f64::from(rows.cycle[i])),
        of("pressure", "Pa", rows.levels.len() > 1 && rows.levels.len() <= MOST_LEVELS, &|i| {
            rows.levels[rows.level[i] as usize]
        }),
        of("contraction", "", false, &|i| c[i].contraction),
        of("direction", "", true, &|i| rows.sign[i]),
        of("speed", "m/s", false, &|i| c[i].speed.abs()),
        of("acceleration", "m/s²", false, &|i| c[i].acceleration),
        of("force", "N", false, &|i| c[i].quasi),
        of("pressure-rate", "Pa/s", false, &|i| c[i].pressure_rate),
        of("since-reversal", "s", false, &|i| c[i].since_reversal),
        of("hold-time", "s", false, &|i| if c[i].speed == 0.0 { c[i].hold_time } else { 0.0 }),
        of("largest-contraction-so-far", "", false, &|i| c[i].contraction - rows.largest[i]),
    ];
    if rows.has_temperature {
        all.push(of("temperature", "K", false, &|i| c[i].temperature));
    }
    all
}

/// Edges of bins with about as many rows in each; few values become a bin each.
fn edges(values: &[f64], weight: &[f64], discrete: bool) -> Vec<f64> {
    let mut live: Vec<f64> = values.iter().zip(weight).filter(|(_, w)| **w > 0.0).map(|(v, _)| *v).collect();
    live.sort_by(f64::total_cmp);
    if live.is_empty() {
        return Vec::new();
    }
    let span = live[live.len() - 1] - live[0];
    if !(span > 0.0) {
        return Vec::new();
    }
    let mut edges = vec![live[0]];
    if discrete {
        live.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * span);
        if live.len() <= DISCRETE_BINS * BINS {
            for w in live.windows(2) {
                edges.push(0.5 * (w[0] + w[1]));
            }
            edges.push(live[live.len() - 1]);
            return edges;
        }
    }
    for k in 1..BINS {
        let at = live[live.len() * k / BINS];
        if at > edges[edges.len() - 1] + 1e-9 * span {
            edges.push(at);
        }
    }
    edges.push(live[live.len() - 1]);
    edges
}

fn bin_of(edges: &[f64], value: f64) -> usize {
    edges[1..edges.len() - 1].partition_point(|e| *e <= value)
}

/// The best contiguous run of bins: the one whose share of energy most exceeds its share of rows, in units of the
/// spread that a share of rows has.
fn best_run(energy_in: &[f64], rows_in: &[f64]) -> (usize, usize, f64) {
    let (total, count): (f64, f64) = (energy_in.iter().sum(), rows_in.iter().sum());
    let mut best = (0, energy_in.len(), 0.0);
    if !(total > 0.0 && count > 0.0) {
        return best;
    }
    for a in 0..energy_in.len() {
        let (mut e, mut r) = (0.0, 0.0);
        for b in a..energy_in.len() {
            e += energy_in[b] / total;
            r += rows_in[b] / count;
            if r > 0.0 && r < REGION_ROWS {
                // The floor keeps a handful of rows from looking like a place.
                let excess = (e - r) / (r * (1.0 - r)).max(REGION_VARIANCE).sqrt();
                if excess > best.2 {
                    best = (a, b + 1, excess);
                }
            }
        }
    }
    best
}

/// Smooths a residual within blocks so that white noise leaves its energy.
fn smoothed(rows: &Rows, residual: &[f64], half: usize) -> Vec<f64> {
    let n = rows.len();
    let mut prefix = vec![(0.0, 0.0); n + 1];
    for i in 0..n {
        let w = rows.root_weight()[i];
        prefix[i + 1] = (prefix[i].0 + residual[i] * w, prefix[i].1 + w * w);
    }
    let mut out = vec![0.0; n];
    let mut from = 0;
    for i in 1..=n {
        if i == n || rows.block[i] != rows.block[from] {
            for (j, o) in out.iter_mut().enumerate().take(i).skip(from) {
                let (a, b) = (j.saturating_sub(half).max(from), (j + half + 1).min(i));
                let w = prefix[b].1 - prefix[a].1;
                if w > 0.0 && rows.root_weight()[j] > 0.0 {
                    *o = (prefix[b].0 - prefix[a].0) / w;
                }
            }
            from = i;
        }
    }
    out
}

/// Where the error is along every coordinate.
pub(crate) struct Location {
    /// Significant regions, strongest first.
    pub regions: Vec<Region>,
    /// For pictures.
    pub profiles: Vec<Profile>,
    /// How often whole blocks, shuffled, concentrate as much along any of the coordinates as the error does along its most significant one.
    pub p: f64,
}

/// Locates the error; `before` and `after` are weighted residuals without and with the named effects.
pub(crate) fn locate(rows: &Rows, before: &[f64], after: &[f64], sigma: f64, seed: u64) -> Location {
    let smooth = smoothed(rows, before, REGION_SMOOTHING);
    let mut excess: Vec<f64> = smooth.iter().map(|s| s * s).collect();
    // Noise that the smoothing leaves; independent rows would leave a fifth.
    let floor = (SMOOTHED_NOISE * sigma * sigma)
        .min(SMOOTHED_NOISE_MOST * excess.iter().sum::<f64>() / rows.effective().max(1) as f64);
    for (e, w) in excess.iter_mut().zip(rows.root_weight()) {
        *e = if *w > 0.0 { *e - floor } else { 0.0 };
    }
    let blocks = block_ranges(rows);
    let steady = (energy(before) / energy(rows.root_weight()).max(1e-12)).sqrt();
    let found: Vec<(Option<Standing>, Profile)> = coordinates(rows)
        .par_iter()
        .filter_map(|c| {
            let edges = edges(&c.values, rows.root_weight(), c.discrete);
            if edges.len() < 3 {
                return None;
            }
            let binned = Binned::new(rows, c, edges);
            let region = if steady < 1e-12 { None } else { binned.region(rows, c, &excess, &blocks, seed) };
            Some((region, binned.profile(rows, c, before, after)))
        })
        .collect();
    let (standing, profiles): (Vec<Option<Standing>>, Vec<Profile>) = found.into_iter().unzip();
    let standing: Vec<Standing> = standing.into_iter().flatten().collect();
    let p = family_p(&standing);
    let mut regions: Vec<Region> = standing.into_iter().map(|s| s.region).collect();
    let strength = |r: &Region| (r.share - r.rows) / (r.rows * (1.0 - r.rows)).max(REGION_VARIANCE).sqrt();
    regions.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    regions.retain(|r| r.p <= REGION_ALPHA);
    regions.truncate(MOST_REGIONS);
    Location { regions, profiles, p }
}

/// A region that stands out, beside what shuffled blocks make along the same coordinate.
struct Standing {
    region: Region,
    /// How much the region stands out.
    strength: f64,
    /// The same of each shuffle; the shuffles of all coordinates are the same.
    shuffled: Vec<f64>,
}

impl Standing {
    /// The strength, then that of each shuffle, in standard deviations of the shuffles.
    fn standardised(&self) -> Vec<f64> {
        let n = self.shuffled.len() as f64;
        let mean = self.shuffled.iter().sum::<f64>() / n;
        let variance = self.shuffled.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / n;
        let all = std::iter::once(&self.strength).chain(&self.shuffled);
        all.map(|s| (s - mean) / variance.sqrt().max(f64::MIN_POSITIVE)).collect()
    }
}

/// The p-value of the most significant of all coordinates; one without any.
///
/// Westfall and Young, Resampling-Based Multiple Testing, 1993: the largest standardised statistic of the same shuffles.
fn family_p(standing: &[Standing]) -> f64 {
    let standardised: Vec<Vec<f64>> = standing.iter().map(Standing::standardised).collect();
    let largest = |k: usize| standardised.iter().map(|s| s[k]).fold(f64::NEG_INFINITY, f64::max);
    let observed = largest(0);
    let beyond = (1..=REGION_SHUFFLES).filter(|k| largest(*k) >= observed).count();
    (beyond as f64 + 1.0) / (REGION_SHUFFLES as f64 + 1.0)
}

/// The rows in the bins of a coordinate.
struct Binned {
    edges: Vec<f64>,
    /// The bin of each row.
    bin: Vec<usize>,
    /// Rows that count in each bin.
    rows_in: Vec<f64>,
}

impl Binned {
    fn new(rows: &Rows, c: &Coordinate, edges: Vec<f64>) -> Self {
        let bin: Vec<usize> = c.values.iter().map(|v| bin_of(&edges, *v)).collect();
        let mut rows_in = vec![0.0; edges.len() - 1];
        for (bin, w) in bin.iter().zip(rows.root_weight()) {
            if *w > 0.0 {
                rows_in[*bin] += 1.0;
            }
        }
        Self { edges, bin, rows_in }
    }

    /// Means over the rows of each bin, for a picture.
    fn profile(&self, rows: &Rows, c: &Coordinate, before: &[f64], after: &[f64]) -> Profile {
        let mut sums = vec![[0.0; 4]; self.rows_in.len()];
        for i in 0..rows.len() {
            let w = rows.root_weight()[i];
            if w > 0.0 {
                let s = &mut sums[self.bin[i]];
                s[0] += before[i] * w;
                s[1] += before[i] * before[i];
                s[2] += after[i] * after[i];
                s[3] += w * w;
            }
        }
        Profile {
            coordinate: c.name.into(),
            unit: c.unit.into(),
            at: self.edges.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect(),
            mean_before: sums.iter().map(|s| s[0] / s[3].max(1e-12)).collect(),
            rms_before: sums.iter().map(|s| (s[1] / s[3].max(1e-12)).sqrt()).collect(),
            rms_after: sums.iter().map(|s| (s[2] / s[3].max(1e-12)).sqrt()).collect(),
        }
    }

    /// Energy above the noise in each bin.
    fn energy_in(&self, excess: &[f64]) -> Vec<f64> {
        let mut energy = vec![0.0; self.rows_in.len()];
        for (bin, e) in self.bin.iter().zip(excess) {
            energy[*bin] += e;
        }
        energy.iter_mut().for_each(|e| *e = e.max(0.0));
        energy
    }

    /// The region that stands out, with how often whole blocks, shuffled, concentrate as much.
    fn region(
        &self,
        rows: &Rows,
        c: &Coordinate,
        excess: &[f64],
        blocks: &[(usize, usize)],
        seed: u64,
    ) -> Option<Standing> {
        let energy_in = self.energy_in(excess);
        let (a, b, strength) = best_run(&energy_in, &self.rows_in);
        if strength <= 0.0 {
            return None;
        }
        let mut random = Random(seed);
        let shuffled: Vec<f64> = (0..REGION_SHUFFLES)
            .map(|_| best_run(&self.energy_in(&shuffled(excess, blocks, &mut random)), &self.rows_in).2)
            .collect();
        let as_good = shuffled.iter().filter(|s| **s >= strength).count();
        let share = energy_in[a..b].iter().sum::<f64>() / energy_in.iter().sum::<f64>();
        let part = self.rows_in[a..b].iter().sum::<f64>() / self.rows_in.iter().sum::<f64>();
        let (low, high) = (self.edges[a], self.edges[b]);
        let (from, to) = if c.discrete {
            let last = b == self.rows_in.len();
            let at = distinct_between(&c.values, rows.root_weight(), low, high, last);
            (at.first().copied().unwrap_or(low), at.last().copied().unwrap_or(high))
        } else {
            (low, high)
        };
        let region = Region {
            coordinate: c.name.into(),
            from,
            to,
            share,
            rows: part,
            p: (as_good as f64 + 1.0) / (REGION_SHUFFLES as f64 + 1.0),
            unit: c.unit.into(),
            recordings: if c.name == "recording" { names(rows, from, to) } else { Vec::new() },
        };
        Some(Standing { region, strength, shuffled })
    }
}

/// The names of recordings by their numbers, from 1.
fn names(rows: &Rows, from: f64, to: f64) -> Vec<String> {
    let number = |i: usize| (i + 1) as f64;
    let within = |i: &usize| number(*i) >= from && number(*i) <= to;
    (0..rows.names.len()).filter(within).map(|i| rows.names[i].clone()).collect()
}

/// Values with whole blocks in another order, each rotated in itself: both what belongs to a block and what belongs to a place
/// within it are separated from the coordinate, while the residual's own correlation stays.
pub(crate) fn shuffled(values: &[f64], blocks: &[(usize, usize)], random: &mut Random) -> Vec<f64> {
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i + 1));
    }
    let mut shuffled = Vec::with_capacity(values.len());
    for o in order {
        let (from, until) = blocks[o];
        let shift = random.below(until - from);
        shuffled.extend_from_slice(&values[from + shift..until]);
        shuffled.extend_from_slice(&values[from..from + shift]);
    }
    shuffled
}

fn distinct_between(values: &[f64], weight: &[f64], from: f64, to: f64, last: bool) -> Vec<f64> {
    let mut inside: Vec<f64> = values
        .iter()
        .zip(weight)
        .filter(|(v, w)| **w > 0.0 && **v >= from && (**v < to || last))
        .map(|(v, _)| *v)
        .collect();
    inside.sort_by(f64::total_cmp);
    inside.dedup();
    inside
}

/// First row and the one behind the last of every block.
pub(crate) fn block_ranges(rows: &Rows) -> Vec<(usize, usize)> {
    let mut ranges = Vec::new();
    let mut from = 0;
    for i in 1..=rows.len() {
        if i == rows.len() || rows.block[i] != rows.block[from] {
            ranges.push((from, i));
            from = i;
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::prepare;
    use crate::tests::{coloured, geometry, loops, recorded};

    /// The located weighted residual: noise of 1 N with a memory of 6 s, and a bump of this size (N) in the middle of the contraction.
    fn located(rows: &Rows, bump: f64, seed: u64) -> Location {
        let mut random = Random(seed);
        let mut state = [0.0; 2];
        let noise = coloured(1.0, 6.0);
        let largest = rows.contexts().iter().map(|c| c.contraction).fold(0.0, f64::max);
        let added =
            |i: usize| bump * (-(20.0 * (rows.contexts()[i].contraction / largest - 0.5)).powi(2)).exp();
        let residual: Vec<f64> = (0..rows.len())
            .map(|i| rows.root_weight()[i] * (noise(&mut random, &mut state) + added(i)))
            .collect();
        locate(rows, &residual, &residual, 0.3, 8)
    }

    #[test]
    fn noise_that_lasts_has_no_place_and_a_bump_has_one() {
        let campaign = recorded(loops(&[0.4]), 4, |_, _| 0.0, |_, _, _| 0.0);
        let (rows, _) = prepare(&campaign, &geometry().build().expect("a braid")).expect("rows");
        const SEEDS: u64 = 12;
        let noise: Vec<Location> = (1..=SEEDS).map(|seed| located(&rows, 0.0, seed)).collect();
        let along_one = noise.iter().filter(|l| !l.regions.is_empty()).count();
        let along_any = noise.iter().filter(|l| l.p <= REGION_ALPHA).count();
        assert!(along_one > 2 * along_any && along_any <= 3, "{along_one} {along_any} of {SEEDS}");
        for seed in 1..=3 {
            let l = located(&rows, 6.0, seed);
            assert!(
                l.p <= REGION_ALPHA && l.regions[0].coordinate == "contraction",
                "{} {:?}",
                l.p,
                l.regions
            );
        }
    }
}
