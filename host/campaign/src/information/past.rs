//! The columns of everything recorded so far. Motion and memories are followed at the full rate; only the rows that count are thinned, because
//! a stroke of two seconds has no direction in rows two seconds apart.

use model_core::effects::Context;
use model_core::muscle::Muscle;
use model_core::units::Pressure;
use nalgebra::DMatrix;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, Clock, Follower, Recording};
use pam_fit::bench::Span;

use super::Knowledge;
use crate::columns::{Library, Memories, RowsOf, Table, Where, columns_of_rows, layout};
use crate::left_over::LeftOver;

/// The columns of everything recorded so far, as products, and the state of the motion at its end. A candidate adds its own rows to it.
#[derive(Debug)]
pub(super) struct Past {
    pub(super) span: Span,
    pub(super) places: Vec<Where>,
    pub(super) memories: Memories,
    /// Products of weighted columns.
    pub(super) gram: DMatrix<f64>,
    /// Largest value of each column.
    pub(super) peak: Vec<f64>,
    /// What the table leaves of them.
    pub(super) left: LeftOver,
    follower: Follower,
    /// When the last recording ended, s.
    pub(super) end: f64,
    shared_clock: bool,
}

impl Past {
    /// Of recordings; `most` is the largest number of rows that count.
    pub(super) fn of(known: &Knowledge<'_>, table: &Table, library: &Library, most: usize) -> Option<Self> {
        let unforced = |r: &Recording| Recording {
            name: r.name.clone(),
            time: r.time.clone(),
            pressure: r.pressure.clone(),
            stroke: r.stroke.clone(),
            ..Recording::default()
        };
        let campaign = Campaign::new(known.past.iter().map(unforced).collect());
        let mut follower = Follower::of(&campaign);
        let mut contexts = Vec::with_capacity(campaign.samples());
        for (i, (r, motion)) in campaign.recordings.iter().zip(Motion::of_campaign(&campaign)).enumerate() {
            let pause = campaign.pause_before(i);
            contexts.extend(followed(known.model, &mut follower, r, &motion, pause));
        }
        let span = Span::of(&contexts)?;
        let (places, mut memories) = layout(table, library, &span);
        let kept = kept(&campaign.recordings, most);
        let rows = columns_of_rows(table, library, &contexts, &kept.rows, &places, &mut memories);
        let gram = products(&rows, &kept, known);
        let left = LeftOver::of(table, &gram)?;
        let end = campaign.recordings.iter().filter_map(|r| r.time.last()).copied().fold(0.0, f64::max);
        let shared_clock = campaign.clock == Clock::Shared;
        Some(Self { span, places, memories, gram, peak: rows.peak, left, follower, end, shared_clock })
    }

    /// Columns of a recording that follows, and their products.
    pub(super) fn then(
        &self,
        step: &Recording,
        known: &Knowledge<'_>,
        (table, library): (&Table, &Library),
        most: usize,
    ) -> (RowsOf, DMatrix<f64>) {
        let begin = step.time.first().copied().unwrap_or(self.end);
        let pause = self.shared_clock.then_some(begin - self.end);
        let motion = Motion::of(step);
        let contexts = followed(known.model, &mut self.follower.clone(), step, &motion, pause);
        let kept = kept(std::slice::from_ref(step), most);
        let mut memories = self.memories.clone();
        let rows = columns_of_rows(table, library, &contexts, &kept.rows, &self.places, &mut memories);
        let gram = products(&rows, &kept, known);
        (rows, gram)
    }
}

fn followed(
    model: &Muscle<f64>,
    follower: &mut Follower,
    recording: &Recording,
    motion: &Motion,
    pause: Option<f64>,
) -> Vec<Context<f64>> {
    let motions = follower.follow(recording, motion, pause);
    let rows = motions.iter().zip(&recording.pressure);
    rows.map(|(m, p)| model.context(m, Pressure::from_pascals(*p))).collect()
}

/// Rows that count.
struct Kept {
    rows: Vec<usize>,
    /// The time of each and of those left out after it, s.
    seconds: Vec<f64>,
}

/// Every nth row of each recording, `most` at most.
fn kept(recordings: &[Recording], most: usize) -> Kept {
    let all: usize = recordings.iter().map(Recording::len).sum();
    let stride = all.div_ceil(most).max(1);
    let mut kept = Kept { rows: Vec::new(), seconds: Vec::new() };
    let mut first = 0;
    for r in recordings {
        let step = r.duration() / r.len().saturating_sub(1).max(1) as f64;
        kept.rows.extend((first..first + r.len()).step_by(stride));
        kept.seconds.resize(kept.rows.len(), step * stride as f64);
        first += r.len();
    }
    kept
}

/// Products of columns over rows, each of which counts its share of the time between independent readings.
fn products(rows: &RowsOf, kept: &Kept, known: &Knowledge<'_>) -> DMatrix<f64> {
    let mut matrix = rows.matrix.clone();
    for (mut row, seconds) in matrix.row_iter_mut().zip(&kept.seconds) {
        row *= (seconds / known.independent_s.max(1e-3)).min(1.0).sqrt() / known.sigma;
    }
    matrix.tr_mul(&matrix)
}
