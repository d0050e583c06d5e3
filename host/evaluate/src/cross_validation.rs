//! Cross-validation: the error of a table on recordings that it was not fitted to.

use std::collections::BTreeMap;

use pam_data::error::{Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, HELD, Recording, largest_force};
use pam_data::statistics::extremes;
use pam_fit::error::FitCode;
use pam_fit::predict::predict;
use pam_fit::table_file::{self, About, TableFile};

use pam_fit::Fit;
use pam_fit::{Options, RecordingResidual, ResidualSums, by_recording, fit};

use crate::published::Published;

/// The groups of recordings that are left out in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Every run: recordings that share their label `run`, or else each recording alone.
    Run,
    /// Every contraction at which recordings were held.
    Contraction,
}

/// Sums of errors over rows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Score {
    /// The number of rows.
    pub rows: f64,
    /// `Σ |F − F_model|`, N.
    pub absolute: f64,
    /// `Σ (F − F_model)²`, N².
    pub square: f64,
    /// `Σ (F − F_model)`, N.
    pub signed: f64,
}

impl Score {
    fn add(&mut self, residual: f64) {
        self.rows += 1.0;
        self.absolute += residual.abs();
        self.square += residual * residual;
        self.signed += residual;
    }

    /// Mean size of the error, N.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.absolute / self.rows.max(1.0)
    }

    /// Root mean square of the error, N.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.square / self.rows.max(1.0)).sqrt()
    }

    /// Mean error with its sign, N.
    #[must_use]
    pub fn bias(&self) -> f64 {
        self.signed / self.rows.max(1.0)
    }
}

/// The errors at one contraction and direction of one left-out group.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// The left-out group: the label of its run, or its stroke.
    pub left_out: String,
    /// Contraction, in units of 0.001.
    pub contraction: i64,
    /// +1 filling or shortening, −1 emptying or lengthening.
    pub direction: i8,
    /// The errors of these rows.
    pub score: Score,
}

/// Errors, in total and by place.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    /// The errors of all rows.
    pub score: Score,
    spots: BTreeMap<(String, i64, i8), Score>,
}

impl Tally {
    pub(super) fn add(&mut self, left_out: &str, contraction: f64, direction: i8, residual: f64) {
        self.score.add(residual);
        let place = (left_out.to_owned(), (contraction * 1e3).round() as i64, direction);
        self.spots.entry(place).or_default().add(residual);
    }

    pub(super) fn spots(self) -> Vec<Spot> {
        let spot =
            |((left_out, contraction, direction), score)| Spot { left_out, contraction, direction, score };
        self.spots.into_iter().map(spot).collect()
    }
}

/// The errors on left-out recordings.
#[derive(Debug, Clone)]
pub struct CrossValidation {
    /// The errors of the table.
    pub table: Score,
    /// Of these, the errors at contractions between others: interpolation. `None` where runs are left out, or only two contractions were
    /// held.
    pub between: Option<Score>,
    /// The errors at the smallest and the largest contraction: extrapolation. `None` where runs are left out.
    pub ends: Option<Score>,
    /// The errors of a published formula on the same rows, where one was given.
    pub published: Option<Score>,
    /// The errors of the table by place.
    pub spots: Vec<Spot>,
    /// Blocked force at the highest tested pressure, by the fit to all recordings, N.
    pub blocked: f64,
    /// The largest measured force, N: what percentages refer to. A share of a fitted force would change with the fit.
    pub largest: f64,
    /// The errors of every recording, when it was left out.
    pub recordings: Vec<RecordingResidual>,
    /// The fit to all recordings.
    pub whole: Fit,
}

/// The table file of a fit, with the history that prediction needs.
#[must_use]
pub fn as_file(fit: &Fit) -> TableFile {
    let mountings = table_file::stored_mountings(&fit.solution.problem);
    TableFile { table: fit.table.clone(), about: About { mountings, ..About::default() } }
}

/// The mean stroke of a recording, m.
fn middle(recording: &Recording) -> f64 {
    recording.stroke.iter().sum::<f64>() / recording.len().max(1) as f64
}

fn key(recording: &Recording, index: usize, split: Split) -> String {
    match split {
        Split::Run => {
            let label = recording.labels.iter().find(|(name, _)| name.starts_with("run"));
            label.map_or_else(|| format!("{} ({})", recording.title(), index + 1), |(_, v)| v.clone())
        }
        Split::Contraction => {
            format!("{:.1} mm", middle(recording) * 1e3)
        }
    }
}

/// The groups that are left out in turn.
///
/// # Errors
/// Fewer than two groups, or contractions of a muscle that moves.
fn groups(campaign: &Campaign, keys: &[String], split: Split) -> Result<Vec<String>> {
    if split == Split::Contraction && campaign.recordings.iter().any(|r| r.held_stroke().is_none()) {
        return Err(Error::new(
            FitCode::FitUnderdetermined,
            "contractions are left out where every recording has a held length, and here the muscle moves",
        )
        .help("leave runs out instead"));
    }
    let mut values = keys.to_vec();
    values.sort();
    values.dedup();
    if values.len() < 2 {
        return Err(Error::new(
            FitCode::FitUnderdetermined,
            "cross-validation needs at least two groups, and all recordings belong to one",
        )
        .help("give several recordings, or an import description that splits the file by run"));
    }
    Ok(values)
}

/// Leaves each run or contraction out in turn, fits the others, and scores the prediction of what was left out.
///
/// # Errors
/// [`FitCode::FitUnderdetermined`] with fewer than two groups, contractions of a muscle that moves, or a fit that fails.
pub fn cross_validate(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    options: &Options,
    split: Split,
    published: Option<&Published>,
) -> Result<CrossValidation> {
    let keys: Vec<String> = campaign.recordings.iter().enumerate().map(|(i, r)| key(r, i, split)).collect();
    let values = groups(campaign, &keys, split)?;
    let whole = fit(campaign, muscle, options)?;
    let clip = whole.solution.problem.clips.0.map(|c| c.force);
    let blocked = f64::from(whole.table.blocked_force.newtons());
    let mut out = CrossValidation {
        table: Score::default(),
        between: None,
        ends: None,
        published: None,
        spots: Vec::new(),
        blocked,
        largest: largest_force(campaign),
        recordings: Vec::new(),
        whole,
    };
    let mut sums = vec![ResidualSums::default(); campaign.recordings.len()];
    let mut reference = Score::default();
    let mut tally = Tally::default();
    let (low, high) = extremes(campaign.recordings.iter().map(middle));
    for value in &values {
        let part = |inside: bool| Campaign {
            recordings: campaign
                .recordings
                .iter()
                .zip(&keys)
                .filter(|(_, k)| (*k == value) == inside)
                .map(|(r, _)| r.clone())
                .collect(),
            clock: campaign.clock,
            warnings: Vec::new(),
        };
        let fitted = fit(&part(false), muscle, options)?;
        let test = part(true);
        let prediction = predict(&as_file(&fitted), &test)?;
        let motions = Motion::of_campaign(&test);
        let index = (0..keys.len()).filter(|i| keys[*i] == *value);
        let screened = Screened::of(&test);
        for (k, ((recording, predicted), (motion, index))) in
            test.recordings.iter().zip(&prediction.recordings).zip(motions.iter().zip(index)).enumerate()
        {
            let read = screened.read(k);
            let inner = [low, high].iter().all(|end| (middle(recording) - end).abs() > HELD);
            let place = if inner { &mut out.between } else { &mut out.ends };
            let mut place = (split == Split::Contraction).then(|| place.get_or_insert_default());
            let measured = recording.require_force()?;
            for (i, force) in measured.iter().enumerate() {
                // A saturated or failed sensor does not measure the force.
                if clip.is_some_and(|c| *force <= c) || !read[i] {
                    continue;
                }
                let residual = force - predicted.force[i];
                let contraction = recording.stroke[i] / muscle.rest_length();
                sums[index].add(1.0, residual);
                tally.add(value, contraction, motion.direction[i], residual);
                if let Some(place) = &mut place {
                    place.add(residual);
                }
                if let Some(p) = published {
                    reference.add(force - p.force(muscle, recording.pressure[i], contraction));
                }
            }
        }
    }
    out.published = published.map(|_| reference);
    out.recordings = by_recording(campaign, &sums);
    out.table = tally.score;
    out.spots = tally.spots();
    Ok(out)
}
