//! The rows of a campaign: averages of the recordings between reversals, with the motion in each.

mod blocks;
mod gather;
mod levels;

mod readings;
mod sensor_noise;
mod sleeve;
mod tares;

use std::ops::Deref;
use std::sync::Arc;

use model_core::braid::Braid;
use model_core::effects::Context;

pub(crate) use self::blocks::typical_step;
use self::levels::Levels;
pub(crate) use self::sleeve::{ORDERS, Shape, YEOH};
pub(crate) use self::tares::vented_below;
use super::criteria::noise::SAME_LENGTH;
use super::criteria::rows::{ONE_SPEED, PRESSURE_TRIM, SPEED_TRIM, SPIKES_MENTIONED};
use super::remark::Remark;
use pam_data::error::Result;
use pam_data::progress::SharedProgress;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, resolution};
use pam_data::statistics::{quantile, range};
use pam_fit::Clip;
use pam_fit::beginning::Beginning;

/// What was recorded, row by row. Nothing changes it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorded {
    /// The sleeve at each row.
    pub shapes: Vec<Shape>,
    /// Measured force, N.
    pub force: Vec<f64>,
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
    /// Whether temperature was measured throughout.
    pub has_temperature: bool,
    /// Whether the length never moved.
    pub isometric: bool,
    /// The coarsest step in which a recording's displacement is read, m; zero where all are read finely.
    pub stroke_step: f64,
}

/// What friction does at rest, row by row; all zeros where it stays as the model holds it.
#[derive(Clone, Debug, Default)]
pub(crate) struct RestFriction {
    /// How a settling of friction departs from an exponential.
    pub settling: Vec<f64>,
    /// At rest, the direction that the model holds less the one that friction was found to have settled to.
    pub unsettled: Vec<f64>,
    /// Number of the stretch over which friction has an unknown place in its gap, or keeps a part of one; zero elsewhere.
    pub rest: Vec<u32>,
    /// How much of the unknown place is kept at each row of such a stretch.
    pub kept: Vec<f64>,
    /// Where the length was held throughout: for each change of pressure over which a part of friction may turn, the direction of that part
    /// less the one that friction was found to have. Empty elsewhere.
    pub turning: Vec<Vec<f64>>,
}

impl RestFriction {
    /// Of `n` rows at which friction stays as the model holds it.
    pub(crate) fn as_modelled(n: usize) -> Self {
        Self {
            settling: vec![0.0; n],
            unsettled: vec![0.0; n],
            rest: vec![0; n],
            kept: vec![0.0; n],
            turning: Vec::new(),
        }
    }
}

/// What one bladder for all pressures may do near full contraction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum SingleBladder {
    /// It stiffens as a hyperelastic wall does: six orders, and a Yeoh wall.
    #[default]
    Stiffens,
    /// It has the orders of the table, so that a contraction stop is left to an effect.
    AsTable,
}

/// The rows of a campaign: what was recorded, a mask, and the model about which effects are linearised.
///
/// A value of it never changes. What masks rows or moves the linearisation gives another value, which shares what stays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    recorded: Arc<Recorded>,
    /// Motion and geometry of each row, with the parts of the base model about which effects are linear.
    contexts: Arc<Vec<Context<f64>>>,
    /// Square root of each row's weight; zero where the direction is in doubt or the muscle is slack.
    root_weight: Arc<Vec<f64>>,
    rest_friction: Arc<RestFriction>,
    single_bladder: SingleBladder,
    bladder_stiffens: bool,
    beginning: Beginning,
    progress: SharedProgress,
}

impl Deref for Rows {
    type Target = Recorded;

    fn deref(&self) -> &Recorded {
        &self.recorded
    }
}

impl Rows {
    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.force.len()
    }
    /// Motion and geometry of each row, with the parts of the base model about which effects are linear.
    pub(crate) fn contexts(&self) -> &[Context<f64>] {
        &self.contexts
    }
    /// Square root of each row's weight; zero where the direction is in doubt or the muscle is slack.
    pub(crate) fn root_weight(&self) -> &[f64] {
        &self.root_weight
    }
    /// What friction does at rest.
    pub(crate) fn at_rest(&self) -> &RestFriction {
        &self.rest_friction
    }
    /// What one bladder for all pressures may do near full contraction.
    pub(crate) fn single_bladder(&self) -> SingleBladder {
        self.single_bladder
    }
    /// Whether the stiffness of one bladder for all pressures may change in proportion to the pressure.
    pub(crate) fn bladder_stiffens(&self) -> bool {
        self.bladder_stiffens
    }
    /// What is known of the muscle before the first row of a recording.
    pub(crate) fn beginning(&self) -> Beginning {
        self.beginning
    }
    /// Receives the progress of the work on them.
    pub(crate) fn progress(&self) -> &SharedProgress {
        &self.progress
    }
    /// Which blocks are the first of a recording.
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

    /// The same rows, with progress reported to someone.
    pub(crate) fn watched(self, progress: SharedProgress) -> Self {
        Self { progress, ..self }
    }
    /// The same rows about another model, or with another motion.
    pub(crate) fn with_contexts(&self, contexts: Vec<Context<f64>>) -> Self {
        Self { contexts: Arc::new(contexts), ..self.clone() }
    }
    /// The same rows, with what friction does at rest.
    pub(crate) fn with_rest_friction(&self, rest_friction: RestFriction) -> Self {
        Self { rest_friction: Arc::new(rest_friction), ..self.clone() }
    }
    /// The same rows, with another single bladder.
    pub(crate) fn with_single_bladder(&self, single_bladder: SingleBladder) -> Self {
        Self { single_bladder, ..self.clone() }
    }
    /// The same rows, where the stiffness of the single bladder may change in proportion to the pressure.
    pub(crate) fn with_stiffening_bladder(&self) -> Self {
        Self { bladder_stiffens: true, ..self.clone() }
    }
    /// The same rows, with another beginning of recordings.
    pub(crate) fn with_beginning(&self, beginning: Beginning) -> Self {
        Self { beginning, ..self.clone() }
    }
    /// The same rows, of which some no longer count.
    pub(crate) fn without(&self, masked: impl Fn(usize) -> bool) -> Self {
        let weights = self.root_weight.iter().enumerate();
        let root_weight = weights.map(|(i, w)| if masked(i) { 0.0 } else { *w }).collect();
        Self { root_weight: Arc::new(root_weight), ..self.clone() }
    }
    /// The same rows with other forces.
    pub(crate) fn with_force(&self, force: Vec<f64>) -> Self {
        Self { recorded: Arc::new(Recorded { force, ..Recorded::clone(&self.recorded) }), ..self.clone() }
    }
    /// Every n-th row.
    pub(crate) fn downsampled(&self, stride: usize) -> Self {
        fn pick<T: Clone>(stride: usize, column: &[T]) -> Vec<T> {
            column.iter().step_by(stride).cloned().collect()
        }
        let recorded = Recorded {
            shapes: pick(stride, &self.shapes),
            force: pick(stride, &self.force),
            vented: pick(stride, &self.vented),
            recording: pick(stride, &self.recording),
            block: pick(stride, &self.block),
            cycle: pick(stride, &self.cycle),
            level: pick(stride, &self.level),
            levels: self.levels.clone(),
            steady: self.steady,
            sign: pick(stride, &self.sign),
            still: pick(stride, &self.still),
            on_ramp: pick(stride, &self.on_ramp),
            largest: pick(stride, &self.largest),
            local_time: pick(stride, &self.local_time),
            blocks: self.blocks,
            names: self.names.clone(),
            samples: self.samples,
            has_temperature: self.has_temperature,
            isometric: self.isometric,
            stroke_step: self.stroke_step,
        };
        let rest_friction = RestFriction {
            settling: pick(stride, &self.at_rest().settling),
            unsettled: pick(stride, &self.at_rest().unsettled),
            rest: pick(stride, &self.at_rest().rest),
            kept: pick(stride, &self.at_rest().kept),
            turning: self.at_rest().turning.iter().map(|turned| pick(stride, turned)).collect(),
        };
        Self {
            recorded: Arc::new(recorded),
            contexts: Arc::new(pick(stride, &self.contexts)),
            root_weight: Arc::new(pick(stride, &self.root_weight)),
            rest_friction: Arc::new(rest_friction),
            single_bladder: self.single_bladder,
            bladder_stiffens: self.bladder_stiffens,
            beginning: self.beginning,
            progress: self.progress.clone(),
        }
    }
}

impl Rows {
    /// Whether the length was held throughout, and was the same in all recordings.
    pub(crate) fn have_one_held_length(&self) -> bool {
        self.isometric && range(self.contexts().iter().map(|c| c.contraction)) < SAME_LENGTH
    }
    /// Whether the muscle moved at one speed throughout, so that a law of speed is a constant.
    pub(crate) fn have_one_speed(&self) -> bool {
        let moving =
            self.contexts().iter().zip(self.root_weight()).filter(|(c, w)| **w > 0.0 && c.speed != 0.0);
        let mut speeds: Vec<f64> = moving.map(|(c, _)| c.speed.abs()).collect();
        quantile(&mut speeds, 1.0 - SPEED_TRIM) < ONE_SPEED * quantile(&mut speeds, SPEED_TRIM)
    }
}

/// Prepares a campaign, with remarks on its data. The result depends on the data alone.
///
/// # Errors
/// A recording without force.
pub(crate) fn prepare(campaign: &Campaign, braid: &Braid<f64>) -> Result<(Rows, Vec<Remark>)> {
    prepare_corrected(campaign, None, braid)
}

/// The same of a campaign that was corrected for faults of the bench, with the readings as they were. The bench moved as it was read: a
/// length that was held stays held where a frame that gives made the muscle follow its own force.
pub(crate) fn prepare_corrected(
    campaign: &Campaign,
    as_read: Option<&Campaign>,
    braid: &Braid<f64>,
) -> Result<(Rows, Vec<Remark>)> {
    let screened = Screened::of(campaign);
    let campaign = screened.campaign.as_ref();
    let pressures = pressure_range(campaign);
    let motions = Motion::of_campaign(as_read.map(Screened::of).as_ref().map_or(campaign, |s| &s.campaign));
    let isometric = motions.iter().all(|m| m.is_isometric);
    let ends = readings::ends(campaign);
    let gathered = gather::gather(campaign, &screened, &motions, as_read.is_some(), braid, &ends)?;
    let remarks = remarks(&screened, &ends, &gathered, campaign.samples());
    let levels = Levels::find(&gathered.contexts, &gathered.piece, pressures);
    let vented = tares::vented(&gathered.contexts);
    let levels = tares::without_vented(levels, &gathered.contexts);
    let root_weight = tares::weights(&gathered, &vented, &levels);
    let level = levels.of_rows(&gathered.contexts);
    let block = blocks::merge(&gathered, &vented);
    let cycle = blocks::cycles(&gathered, &level);
    let whole = if isometric { &gathered.recording } else { &block };
    let root_weight = readings::blurred(&gathered.force, root_weight, whole, &gathered.recording);
    let blocks = block.last().map_or(0, |last| *last as usize + 1);
    let n = gathered.force.len();
    let recorded = Recorded {
        shapes: gathered.shapes,
        force: gathered.force,
        vented,
        recording: gathered.recording,
        block,
        cycle,
        level,
        levels: levels.pressures,
        steady: levels.steady,
        sign: gathered.sign,
        still: gathered.still,
        on_ramp: gathered.on_ramp,
        largest: gathered.largest,
        local_time: gathered.local_time,
        blocks,
        names: gathered.names,
        samples: campaign.samples(),
        has_temperature: gathered.has_temperature,
        isometric,
        stroke_step: campaign.recordings.iter().map(|r| resolution(&r.stroke)).fold(0.0, f64::max),
    };
    let rows = Rows {
        recorded: Arc::new(recorded),
        contexts: Arc::new(gathered.contexts),
        root_weight: Arc::new(root_weight),
        rest_friction: Arc::new(RestFriction::as_modelled(n)),
        single_bladder: SingleBladder::default(),
        bladder_stiffens: false,
        beginning: Beginning::default(),
        progress: SharedProgress::default(),
    };
    Ok((rows, remarks))
}

/// Remarks on the data.
fn remarks(screened: &Screened<'_>, ends: &[Clip], gathered: &gather::Gathered, total: usize) -> Vec<Remark> {
    let spiked = gathered.spiked;
    let mut remarks: Vec<Remark> =
        ends.iter().map(|end| Remark::SensorEnd { rows: end.rows, force: end.force }).collect();
    remarks.extend(screened.remark().map(Remark::Screening));
    if spiked * SPIKES_MENTIONED > total {
        remarks.push(Remark::Spikes { excluded: spiked, total });
    }
    if gathered.ringing > 0 {
        remarks.push(Remark::Ringing { excluded: gathered.ringing, total });
    }
    remarks
}

/// The range of the pressure over all recordings, without its few farthest values, Pa.
fn pressure_range(campaign: &Campaign) -> (f64, f64) {
    let mut all: Vec<f64> = campaign.recordings.iter().flat_map(|r| r.pressure.iter().copied()).collect();
    (quantile(&mut all, PRESSURE_TRIM), quantile(&mut all, 1.0 - PRESSURE_TRIM))
}
