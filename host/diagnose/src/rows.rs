//! The rows that everything else works on: block averages of the recordings that keep turns, with the motion in each.

mod blocks;
mod gather;
mod levels;
mod readings;
mod sleeve;
mod tares;

use model_core::braid::Braid;
use model_core::effects::Context;

pub(crate) use self::blocks::typical_step;
use self::gather::Gathering;
pub(crate) use self::sleeve::{ORDERS, Shape, YEOH};
use super::kinematics::{Thresholds, white_noise};
use super::linear::quantile;
use pam_data::error::Result;
use pam_data::pluralise::pluralise;
use pam_data::progress::SharedProgress;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::{Campaign, Recording};

/// Rows aimed at: enough for every reversal, few enough for seconds.
pub(crate) const TARGET_ROWS: usize = 24_000;

/// All recordings of a campaign as one sequence of rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    /// Who watches how far the work on them has come.
    pub progress: SharedProgress,
    /// Motion and geometry of each row; the base model's parts are filled in by a fitted baseline.
    pub contexts: Vec<Context<f64>>,
    /// The sleeve at each row.
    pub shapes: Vec<Shape>,
    /// Measured force, N.
    pub force: Vec<f64>,
    /// Square root of each row's weight; zero where the direction is in doubt or the muscle is slack.
    pub root_weight: Vec<f64>,
    /// Whether the muscle was vented: the model's force is zero there, what is read is the bench's.
    pub vented: Vec<bool>,
    /// Which recording a row belongs to.
    pub recording: Vec<u32>,
    /// Half-stroke block of each row, counted over the campaign.
    pub block: Vec<u32>,
    /// Cycle within its pressure level (or as the recording numbers it), from 1.
    pub cycle: Vec<u32>,
    /// Pressure level of a row; an index into `levels`.
    pub level: Vec<u32>,
    /// Mean pressure of each level, Pa, increasing.
    pub levels: Vec<f64>,
    /// Whether the levels are pressures at which the muscle was worked (else they are places on the pressure's range).
    pub steady: bool,
    /// Which way the muscle moved last: the sign behind `direction`, which fades while friction settles.
    pub sign: Vec<f64>,
    /// Time since the braid last moved, s.
    pub still: Vec<f64>,
    /// How a settling of friction at rest departs from an exponential; all zeros where it does not settle.
    pub settling: Vec<f64>,
    /// At rest, the direction that the model holds less the one that friction was found to have settled to; zero elsewhere.
    pub unsettled: Vec<f64>,
    /// Number of the stretch of a hold over which friction rests somewhere in its gap, nobody knows where; zero elsewhere.
    pub rest: Vec<u32>,
    /// Whether the pressure ramps at held length, where friction turns by a share that is fitted.
    pub on_ramp: Vec<bool>,
    /// Largest contraction so far in the campaign.
    pub largest: Vec<f64>,
    /// Time within the recording, s.
    pub local_time: Vec<f64>,
    /// Number of blocks.
    pub blocks: usize,
    /// Recording names.
    pub names: Vec<String>,
    /// Raw samples behind the rows.
    pub samples: usize,
    /// Things worth saying about the data.
    pub remarks: Vec<String>,
    /// Whether temperature was measured throughout.
    pub has_temperature: bool,
    /// Whether the length never moved.
    pub isometric: bool,
}

impl Rows {
    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.force.len()
    }
    /// Which blocks a recording begins with.
    pub(crate) fn first_strokes(&self) -> Vec<bool> {
        let mut first = vec![false; self.blocks];
        for recording in 0..self.names.len() as u32 {
            if let Some(row) = self.recording.iter().position(|r| *r == recording) {
                first[self.block[row] as usize] = true;
            }
        }
        first
    }
    /// Rows that count.
    pub(crate) fn effective(&self) -> usize {
        self.root_weight.iter().filter(|w| **w > 0.0).count()
    }
}

/// Prepares a campaign. The result depends on the data alone.
///
/// # Errors
/// A recording without force.
pub(crate) fn prepare(campaign: &Campaign, braid: &Braid<f64>) -> Result<Rows> {
    let screened = Screened::of(campaign);
    let campaign = screened.campaign.as_ref();
    let pressures = range(campaign, |r| &r.pressure);
    let thresholds = thresholds(campaign, braid, pressures);
    let total = campaign.samples();
    let mut rows = Rows { samples: total, has_temperature: total > 0, ..Rows::default() };
    rows.isometric = held(campaign, thresholds.stroke);
    let ends = readings::ends(campaign);
    rows.remarks.extend(ends.iter().map(|end| {
        format!(
            "left out: {} of exactly {:.2} N, where the force sensor stands at the end of its range",
            pluralise(end.rows, "reading"),
            end.force
        )
    }));
    rows.remarks.extend(screened.remark());
    let mut gathering = Gathering::begin(&mut rows, braid, thresholds, &ends, campaign.beginning());
    for (index, recording) in campaign.recordings.iter().enumerate() {
        gathering.add(recording, &screened.read(index), campaign.pause_before(index))?;
    }
    let (readable, spiked) = gathering.end();
    if spiked * 200 > total {
        rows.remarks.push(format!(
            "{spiked} of {total} force readings stand out alone and were left out as outliers"
        ));
    }
    levels::find(&mut rows, pressures);
    tares::mark_vented(&mut rows, &readable);
    blocks::merge(&mut rows);
    blocks::number_cycles(&mut rows);
    readings::blur(&mut rows);
    Ok(rows)
}

/// The range of a column over all recordings, without its few farthest values.
fn range(campaign: &Campaign, column: impl Fn(&Recording) -> &Vec<f64>) -> (f64, f64) {
    let mut all: Vec<f64> = campaign.recordings.iter().flat_map(|r| column(r).iter().copied()).collect();
    (quantile(&mut all, 0.002), quantile(&mut all, 0.998))
}

/// What counts as a motion: well above the noise, and a noticeable part of the range.
fn thresholds(campaign: &Campaign, braid: &Braid<f64>, pressures: (f64, f64)) -> Thresholds {
    let strokes = range(campaign, |r| &r.stroke);
    let noise =
        |column: &dyn Fn(&Recording) -> f64| campaign.recordings.iter().map(column).fold(0.0, f64::max);
    Thresholds {
        stroke: (8.0 * noise(&|r| white_noise(&r.stroke)))
            .max(0.004 * (strokes.1 - strokes.0))
            .max(1e-3 * braid.rest_length() * 0.05),
        pressure: (8.0 * noise(&|r| white_noise(&r.pressure)))
            .max(0.02 * (pressures.1 - pressures.0))
            .max(2e3),
    }
}

/// Mounted at several lengths, but never moved while recording, is held all the same.
fn held(campaign: &Campaign, least_motion: f64) -> bool {
    campaign.recordings.iter().all(|r| {
        let (low, high) =
            r.stroke.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(*s), h.max(*s)));
        !(high - low > 3.0 * least_motion)
    })
}
