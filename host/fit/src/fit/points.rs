//! Rows to points: means over short pieces of the motion, in time order.
//!
//! Ten million rows hold no more about a quasi-static force than some ten thousand means over pieces so short that
//! pressure and stroke hardly change within. A piece ends where the direction turns, where stroke or pressure has moved on
//! by a small share of their ranges, or where it holds enough rows. One pass, linear in rows; memory is that of the points.

use pam_data::recording::dropouts::Screened;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, HELD, Recording, white_noise};
use pam_data::statistics::{deviation_from_median, median};

/// A mean over consecutive rows of one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Index of the recording in the campaign.
    pub recording: u32,
    /// Index of its first row in that recording.
    pub first_row: u32,
    /// The number of rows.
    pub rows: u32,
    /// The half-stroke that it belongs to, numbered through the campaign: the rows between two reversals.
    pub block: u32,
    /// +1 shortening or filling, −1 lengthening or emptying, 0 unknown.
    pub direction: f64,
    /// Mean time, s.
    pub time: f64,
    /// Mean gauge pressure, Pa.
    pub pressure: f64,
    /// Mean stroke, m.
    pub stroke: f64,
    /// Mean force, N.
    pub force: f64,
    /// Lowest and highest force among its rows, N; spikes show here.
    pub force_range: (f64, f64),
    /// Distance from the last reversal, or from the start of the recording, as a share of the ranges of stroke and pressure.
    pub since_reversal: f64,
    /// Whether the pressure sensor failed: the pressure is interpolated.
    pub dropout: bool,
}

/// The smallest and the largest value of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
}

impl Range {
    /// Of numbers; `0..0` of none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut range = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };
        for v in values {
            range.low = range.low.min(v);
            range.high = range.high.max(v);
        }
        if range.low <= range.high { range } else { Self { low: 0.0, high: 0.0 } }
    }

    /// Of numbers in slices, several at a time.
    fn of_slices<'a>(slices: impl IntoIterator<Item = &'a [f64]>) -> Self {
        const LANES: usize = 8;
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        for slice in slices {
            let (chunks, rest) = slice.as_chunks::<LANES>();
            for chunk in chunks {
                for lane in 0..LANES {
                    low[lane] = low[lane].min(chunk[lane]);
                    high[lane] = high[lane].max(chunk[lane]);
                }
            }
            for (lane, v) in rest.iter().enumerate() {
                low[lane] = low[lane].min(*v);
                high[lane] = high[lane].max(*v);
            }
        }
        let finite = low.into_iter().chain(high).filter(|v| v.is_finite());
        Self::of(finite)
    }

    /// `high − low`.
    #[must_use]
    pub fn span(&self) -> f64 {
        self.high - self.low
    }
}

/// All points of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// The points, in time order.
    pub list: Vec<Point>,
    /// The number of rows.
    pub rows: usize,
    /// The number of half-strokes.
    pub blocks: u32,
    /// Range of the gauge pressure, Pa.
    pub pressure: Range,
    /// Range of the stroke, m.
    pub stroke: Range,
    /// Range of the force, N.
    pub force: Range,
    /// Standard deviation of the force from row to row, without its trend, N.
    pub row_noise: f64,
    /// Standard deviation of a single reading of the stroke, m.
    pub stroke_noise: f64,
    /// The mounting of each recording of the campaign where its length was held.
    pub mountings: Vec<Option<HeldMounting>>,
}

/// A length at which whole recordings were held.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldMounting {
    /// What the file calls it; empty where it has no label.
    pub label: String,
    /// The stroke as recorded, m.
    pub stroke: f64,
}

impl HeldMounting {
    /// The mounting of a recording that was held at one length.
    #[must_use]
    pub fn of(recording: &Recording) -> Option<Self> {
        Some(Self { label: recording.mounting(), stroke: recording.held_stroke()? })
    }

    /// Whether two recordings were made in one mounting: one label, and one stroke. Two mountings may have equal lengths.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        self.label == other.label && (self.stroke - other.stroke).abs() <= HELD
    }
}

impl Points {
    /// How far single rows scatter about their point's mean, N, by the median: noise that is correlated over some rows shows here
    /// and not in `row_noise`. 0 where points hold too few rows to show it.
    #[must_use]
    pub(crate) fn scatter_within(&self) -> f64 {
        // The range of n normal values is about 2 √(2 ln n) standard deviations.
        let deviation =
            |p: &Point| (p.force_range.1 - p.force_range.0) / (2.0 * (2.0 * f64::from(p.rows).ln()).sqrt());
        median(&mut self.list.iter().filter(|p| p.rows >= 4).map(deviation).collect::<Vec<_>>())
    }

    /// All but the points.
    pub(super) fn without_list(&self) -> Self {
        Self { list: Vec::new(), mountings: self.mountings.clone(), ..*self }
    }

    /// The mountings, where every recording was held at one length and there are at least two: isometric tests. Empty otherwise.
    #[must_use]
    pub fn held_lengths(&self) -> Vec<HeldMounting> {
        let mut distinct: Vec<HeldMounting> = Vec::new();
        let mut taken = vec![false; self.mountings.len()];
        for p in &self.list {
            taken[p.recording as usize] = true;
        }
        for (held, _) in self.mountings.iter().zip(&taken).filter(|(_, taken)| **taken) {
            let Some(held) = held else { return Vec::new() };
            if !distinct.iter().any(|d| d.is(held)) {
                distinct.push(held.clone());
            }
        }
        let first = distinct.first().map_or(0.0, |d| d.stroke);
        if distinct.iter().all(|d| (d.stroke - first).abs() <= HELD) { Vec::new() } else { distinct }
    }

    /// Whether a reversal of the motion lies just before and just after a point.
    #[must_use]
    pub(crate) fn beside_reversal(&self, i: usize) -> (bool, bool) {
        let here = &self.list[i];
        let reverses = |there: Option<&Point>| there.is_some_and(|p| p.block != here.block);
        (reverses(i.checked_sub(1).and_then(|k| self.list.get(k))), reverses(self.list.get(i + 1)))
    }
}

/// About how many points a campaign becomes when its motion is slow against its sampling.
const AIM: usize = 16_000;
/// A piece ends after this share of the range of stroke.
const STROKE_STEP: f64 = 1.0 / 500.0;
/// A piece ends after this share of the range of pressure.
const PRESSURE_STEP: f64 = 1.0 / 100.0;
/// Or after this many standard deviations of a single reading, where that is more: otherwise noise would end a piece after every row.
const NOISE_STEP: f64 = 6.0;

/// More points than this make pieces longer, as long as they stay below [`COARSEST`].
const MOST: usize = 300_000;
/// The longest piece, as a share of the range of stroke or pressure: the zone in which friction changes sign is about as long.
const COARSEST: f64 = 0.05;

/// Cuts a campaign into points; a dropout of the gauge shares none with what is beside it. `motions` are those of its recordings;
/// recordings without a force, and those in another unit than the rest, are passed over.
#[must_use]
pub fn points(screened: &Screened<'_>, motions: &[Motion]) -> Points {
    let campaign = screened.campaign.as_ref();
    let taken = |index: usize| campaign.recordings[index].force.is_some() && !screened.is_inconsistent(index);
    let with_force = || (0..campaign.recordings.len()).filter(|i| taken(*i)).map(|i| &campaign.recordings[i]);
    let rows: usize = with_force().map(Recording::len).sum();
    let pressure = Range::of_slices(with_force().map(|r| r.pressure.as_slice()));
    let stroke = Range::of_slices(with_force().map(|r| r.stroke.as_slice()));
    let force = Range::of_slices(with_force().filter_map(|r| r.force.as_deref()));
    let most_rows = (rows / AIM).max(1) as u32;
    let noise = |of: fn(&Recording) -> &[f64]| with_force().map(|r| white_noise(of(r))).fold(0.0, f64::max);
    let stroke_noise = noise(|r| &r.stroke);
    let stroke_step = (stroke.span() * STROKE_STEP).max(NOISE_STEP * stroke_noise);
    let pressure_step = (pressure.span() * PRESSURE_STEP).max(NOISE_STEP * noise(|r| &r.pressure));
    let per_stroke = if stroke.span() > 0.0 { 1.0 / stroke.span() } else { 0.0 };
    let per_pressure = if pressure.span() > 0.0 { 1.0 / pressure.span() } else { 0.0 };
    let mut steps =
        Steps { stroke: stroke_step, pressure: pressure_step, rows: most_rows, per_stroke, per_pressure };
    // Many short strokes make many points, of which no more is known of the force: then pieces are longer.
    let (mut list, block) = loop {
        match average_stretches(screened, motions, &taken, &steps) {
            Some(cut) => break cut,
            None => steps = steps.longer(),
        }
    };
    list.shrink_to_fit();
    let row_noise = row_noise(campaign, rows);
    let mountings = campaign.recordings.iter().map(HeldMounting::of).collect();
    Points { list, rows, blocks: block, pressure, stroke, force, row_noise, stroke_noise, mountings }
}

/// When a piece ends.
struct Steps {
    /// Most that the stroke may change within a piece, m.
    stroke: f64,
    /// Most that the pressure may change within a piece, Pa.
    pressure: f64,
    rows: u32,
    /// One over the ranges of stroke and pressure, 1/m and 1/Pa.
    per_stroke: f64,
    per_pressure: f64,
}

impl Steps {
    /// Twice as long pieces.
    fn longer(self) -> Self {
        Self {
            stroke: 2.0 * self.stroke,
            pressure: 2.0 * self.pressure,
            rows: self.rows.saturating_mul(2),
            ..self
        }
    }

    /// Whether longer pieces still resolve a stroke.
    fn can_grow(&self) -> bool {
        let share = (self.stroke * self.per_stroke).max(self.pressure * self.per_pressure);
        2.0 * share <= COARSEST && self.rows < u32::MAX / 2
    }
}

/// The points of a campaign and the number of half-strokes; `None` where there are more than [`MOST`] and longer pieces are possible.
fn average_stretches(
    screened: &Screened<'_>,
    motions: &[Motion],
    taken: &dyn Fn(usize) -> bool,
    steps: &Steps,
) -> Option<(Vec<Point>, u32)> {
    let campaign = screened.campaign.as_ref();
    let mut list: Vec<Point> = Vec::new();
    let mut block = 0_u32;
    for (index, recording) in campaign.recordings.iter().enumerate() {
        let force = recording.force.as_ref().filter(|_| taken(index));
        let (Some(f), Some(motion)) = (force, motions.get(index)) else { continue };
        let directions = &motion.direction;
        let (p, x, t) = (&recording.pressure, &recording.stroke, &recording.time);
        let n = recording.len().min(directions.len());
        // What the muscle did before is not recorded: a beginning is as good as a reversal, and may be one.
        let mut reversal = 0;
        let mut start = 0;
        let mut dropouts = screened.of_recording(index).peekable();
        while start < n {
            if list.len() >= MOST && steps.can_grow() {
                return None;
            }
            while dropouts.next_if(|d| d.end <= start).is_some() {}
            let dropout = dropouts.peek().is_some_and(|d| d.start <= start);
            let limit = dropouts.peek().map_or(n, |d| if dropout { d.end } else { d.start }).min(n);
            let direction = directions[start];
            let mut sums = [0.0; 4];
            let mut range = (f64::INFINITY, f64::NEG_INFINITY);
            let mut end = start;
            while end < limit
                && directions[end] == direction
                && ((end - start) as u32) < steps.rows
                && (x[end] - x[start]).abs() <= steps.stroke
                && (p[end] - p[start]).abs() <= steps.pressure
            {
                for (sum, v) in sums.iter_mut().zip([t[end], p[end], x[end], f[end]]) {
                    *sum += v;
                }
                range = (range.0.min(f[end]), range.1.max(f[end]));
                end += 1;
            }
            let count = (end - start) as f64;
            let [time, pressure, stroke, force] = sums.map(|s| s / count);
            let since_reversal = (stroke - x[reversal]).abs() * steps.per_stroke
                + (pressure - p[reversal]).abs() * steps.per_pressure;
            list.push(Point {
                recording: index as u32,
                first_row: start as u32,
                rows: (end - start) as u32,
                block,
                direction: f64::from(direction),
                time,
                pressure,
                stroke,
                force,
                force_range: range,
                since_reversal,
                dropout,
            });
            if end < n && directions[end] != direction {
                block += 1;
                reversal = end.saturating_sub(1);
            }
            start = end;
        }
        block += 1;
    }
    Some((list, block))
}

/// From the median size of second differences of the force, of at most some 40,000 rows spread evenly: trends drop out, and
/// a few spikes or reversals do not matter. For white noise the second difference has variance 6 σ².
fn row_noise(campaign: &Campaign, rows: usize) -> f64 {
    let stride = (rows / 40_000).max(1);
    let mut seconds: Vec<f64> = campaign
        .recordings
        .iter()
        .filter_map(|r| r.force.as_deref())
        .flat_map(|f| f.windows(3).step_by(stride).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()))
        .collect();
    deviation_from_median(median(&mut seconds)) / 6.0_f64.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loops(rows: usize) -> (Campaign, Vec<Motion>) {
        let phase = |i: usize| (i as f64 / rows as f64 * 6.0).fract();
        let stroke: Vec<f64> = (0..rows).map(|i| 3e-3 * (1.0 - (1.0 - 2.0 * phase(i)).abs())).collect();
        let direction = (0..rows).map(|i| if phase(i) < 0.5 { 1 } else { -1 }).collect();
        let recording = Recording {
            time: (0..rows).map(|i| i as f64 * 1e-3).collect(),
            pressure: vec![3e5; rows],
            force: Some(stroke.iter().map(|x| 40.0 - 1e4 * x).collect()),
            stroke,
            ..Recording::default()
        };
        (Campaign::new(vec![recording]), vec![Motion { direction, ..Motion::default() }])
    }

    #[test]
    fn ranges_of_slices_are_those_of_their_numbers() {
        for lengths in [vec![], vec![0], vec![1], vec![7, 8, 9], vec![3, 40, 0, 17]] {
            let value = |i: usize| ((i * 7919 + 3) % 101) as f64 - 60.0;
            let slices: Vec<Vec<f64>> = lengths
                .iter()
                .enumerate()
                .map(|(k, n)| (0..*n).map(|i| value(100 * k + i)).collect())
                .collect();
            let expected = Range::of(slices.iter().flatten().copied());
            assert_eq!(Range::of_slices(slices.iter().map(Vec::as_slice)), expected, "{lengths:?}");
        }
    }

    #[test]
    fn many_rows_become_few_points_with_the_same_content() {
        let (campaign, motions) = loops(400_000);
        let points = points(&Screened::of(&campaign), &motions);
        assert!(points.list.len() < 30_000, "{}", points.list.len());
        assert_eq!(points.list.iter().map(|p| p.rows as usize).sum::<usize>(), 400_000);
        assert_eq!(points.blocks, 12);
        let mean = points.list.iter().map(|p| f64::from(p.rows) * p.force).sum::<f64>() / 4e5;
        assert!((mean - 25.0).abs() < 1e-3, "{mean}");
        for p in &points.list {
            assert!((p.force - (40.0 - 1e4 * p.stroke)).abs() < 1e-9, "means of a line lie on it");
        }
        assert!(points.row_noise < 1e-6);
    }

    #[test]
    fn noise_of_the_stroke_makes_no_more_points() {
        let (mut campaign, motions) = loops(400_000);
        let quiet = points(&Screened::of(&campaign), &motions).list.len();
        let mut state = 1_u32;
        for x in &mut campaign.recordings[0].stroke {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Uniform over a step of the stroke on either side.
            *x += 6e-6 * (f64::from(state >> 8) / f64::from(1 << 23) - 1.0);
        }
        let noisy = points(&Screened::of(&campaign), &motions).list.len();
        assert!(noisy < quiet + quiet / 10, "{noisy} points instead of {quiet}");
    }

    #[test]
    fn distance_from_a_turn_starts_at_the_turn() {
        let (campaign, motions) = loops(6000);
        let points = points(&Screened::of(&campaign), &motions);
        let first = points.list.iter().position(|p| p.direction < 0.0).expect("a way back");
        assert!((points.list[first - 1].since_reversal - 1.0).abs() < 0.01);
        assert!(points.list[first].since_reversal < 0.01);
        assert!(points.list[first + 100].since_reversal > 0.15);
    }
}
