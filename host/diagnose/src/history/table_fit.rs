//! The memory in a table: the catalogue's `bladder-creep` beside a base model, fitted to the settled points of a campaign.
//!
//! What differs between visits to one pressure at one length needs no static model. So the amplitudes are found first, beside a free curve
//! for each mounting; only at full length, where the base model's force is a straight line in pressure, is the curve that line and the
//! contact's part. The table is then fitted to the forces without the effect, and the wall's drive is computed again from that table.
//!
//! What a slack muscle reads is the zero of the load cell, and no force: it is subtracted first, and the table contains it as `force-offset`.

use model_core::effects::{EffectName, FittedEffect};
use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_fit::effect_columns::effect_columns;
use pam_fit::numerics::median;
use pam_fit::predict::predict;
use pam_fit::table_file::{About, Correction, TableFile, stored_mountings};
use pam_fit::{Options as FitOptions, fit, table_alone};

use super::campaign::{self, Points};
use super::criteria::{
    PULLS, RAMP, RIDGE, SMOOTHNESS_STATIC, TABLE_LEAST_DEADBAND, TABLE_LEAST_SLACK, TABLE_ROUNDS,
    TABLE_WIDTHS,
};
use super::law::thresholds;
use super::shift_fit::static_spline;
use super::staircase;
use crate::linear::solve_symmetric;

/// The amplitudes of [`EffectName::BladderCreep`], in its order.
#[derive(Clone, Copy)]
enum Amplitude {
    /// `c`: the relaxing share of the wall.
    Wall,
    /// `b`: contact that grows with time.
    Growing,
    /// `d`: contact without memory.
    Contact,
}

const AMPLITUDES: [Amplitude; 3] = [Amplitude::Wall, Amplitude::Growing, Amplitude::Contact];

/// Which amplitudes are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layers {
    /// The contact without memory.
    Contact,
    /// Contact and memory.
    Memory,
}

/// The settled points of every recording as recordings of their own. Settled points stay as they are.
#[must_use]
pub fn settled(campaign: &Campaign) -> Campaign {
    let of = |recording: &Recording| {
        let force = recording.force.as_deref().unwrap_or(&[]);
        if force.len() != recording.len() || recording.is_empty() {
            return recording.clone();
        }
        let (points, averaged) = staircase::settled(recording, force);
        if !averaged {
            return recording.clone();
        }
        Recording {
            name: recording.name.clone(),
            source: recording.source.clone(),
            labels: recording.labels.clone(),
            rest_length: recording.rest_length,
            time: points.iter().map(|p| p.time).collect(),
            stroke: vec![recording.stroke.first().copied().unwrap_or(0.0); points.len()],
            pressure: points.iter().map(|p| p.pressure).collect(),
            force: Some(points.iter().map(|p| p.force).collect()),
            direction: Some(points.iter().map(|p| p.direction).collect()),
            ..Recording::default()
        }
    };
    Campaign {
        recordings: campaign.recordings.iter().map(of).collect(),
        clock: campaign.clock,
        warnings: campaign.warnings.clone(),
    }
}

/// Settled recordings on their way to tables.
pub(super) struct Prepared<'a> {
    muscle: &'a MuscleDescription,
    used: Vec<bool>,
    points: Points,
    use_point: Vec<bool>,
    /// What the load cell reads of a slack muscle, N.
    pub(super) zero: f64,
    /// The recordings with that taken off.
    loaded: Campaign,
    /// The base model's table of it, without the zero.
    base: TableFile,
}

impl<'a> Prepared<'a> {
    /// Recordings that are not `used` count as the muscle's past, but their forces are not looked at. `None` where the campaign is none
    /// of isometric staircases with repeated runs.
    ///
    /// # Errors
    /// Recordings that cannot be fitted.
    pub(super) fn of(
        settled: &Campaign,
        muscle: &'a MuscleDescription,
        used: &[bool],
    ) -> Result<Option<Self>> {
        let rest_length = muscle.geometry().rest_length.metres();
        let Some(points) = campaign::points(settled, rest_length).filter(|p| p.len() == settled.samples())
        else {
            return Ok(None);
        };
        let use_point: Vec<bool> =
            points.run.iter().map(|r| used.get(*r).copied().unwrap_or(false)).collect();
        let zero = slack_reading(&points, &use_point);
        let mut loaded = settled.clone();
        for force in loaded.recordings.iter_mut().filter_map(|r| r.force.as_mut()) {
            force.iter_mut().for_each(|f| *f -= zero);
        }
        let base = alone(&chosen(&loaded, used), muscle)?;
        Ok(Some(Self { muscle, used: used.to_vec(), points, use_point, zero, loaded, base }))
    }

    /// The base model's table.
    pub(super) fn base(&self) -> TableFile {
        self.zeroed(self.base.clone())
    }

    fn zeroed(&self, mut file: TableFile) -> TableFile {
        if self.zero != 0.0 {
            let parameters = vec![self.zero];
            file.about.corrections.push(Correction { effect: "force-offset".into(), parameters });
        }
        file
    }

    /// The table with some layers of the effect: with the contact's static part where the recordings in use follow it more closely.
    ///
    /// # Errors
    /// Recordings that cannot be fitted.
    pub(super) fn table(&self, layers: Layers) -> Result<TableFile> {
        let with = self.layered(layers, true)?;
        let without = match layers {
            Layers::Contact => self.base(),
            Layers::Memory => self.layered(layers, false)?,
        };
        Ok(if self.squares(&with)? < self.squares(&without)? { with } else { without })
    }

    /// Squared errors of a table on the recordings in use, N². A slack muscle pulls no more than it reads.
    fn squares(&self, file: &TableFile) -> Result<f64> {
        let predicted = predict(file, &self.loaded)?;
        let least = PULLS * self.points.largest_force();
        let mut sum = 0.0;
        let pairs = self.loaded.recordings.iter().zip(&predicted.recordings).zip(&self.used);
        for ((recording, predicted), _) in pairs.filter(|(_, used)| **used) {
            let force = recording.force.iter().flatten();
            for (read, model) in force.zip(&predicted.force) {
                // The prediction has the zero of the load cell, which the recordings have lost.
                let model = model - self.zero;
                let error = if *read > least { model - read } else { (model - least).max(0.0) };
                sum += error * error;
            }
        }
        Ok(sum)
    }

    fn layered(&self, layers: Layers, contact: bool) -> Result<TableFile> {
        let Self { muscle, used, .. } = self;
        let everything = used.iter().all(|used| *used);
        // The contact depends on pressure and geometry alone, the wall's drive on the table.
        let rounds = if layers == Layers::Contact { 1 } else { TABLE_ROUNDS };
        let mut file = self.base.clone();
        for round in 1..=rounds {
            let mut bare = file.clone();
            bare.table.effects.clear();
            let effect = self.amplitudes(&bare, (layers, contact))?;
            let freed = chosen(&self.freed(&bare, &effect)?, used);
            let last = round == rounds && everything;
            file = if last { complete(&freed, muscle)? } else { alone(&freed, muscle)? };
            // Slack readings are not in that fit.
            file.table.goes_slack = self.base.table.goes_slack;
            let _ = file.table.effects.push(effect);
        }
        Ok(self.zeroed(file))
    }

    /// The readings that pull, without the effect's force. What a slack muscle would pull without it is not known.
    fn freed(&self, bare: &TableFile, effect: &FittedEffect) -> Result<Campaign> {
        let values: Vec<f64> = effect.parameters.iter().map(|p| f64::from(*p)).collect();
        let columns = effect_columns(bare, &self.loaded, effect.effect, &values[AMPLITUDES.len()..])?;
        let least = PULLS * self.points.largest_force();
        let mut freed = self.loaded.clone();
        let mut first = 0;
        for recording in &mut freed.recordings {
            let force = recording.force.take().unwrap_or_default();
            let keep: Vec<usize> = (0..force.len()).filter(|i| force[*i] > least).collect();
            let part = |i: usize| -> f64 { columns.iter().zip(&values).map(|(c, v)| c[first + i] * v).sum() };
            recording.force = Some(keep.iter().map(|i| force[*i] - part(*i)).collect());
            for column in [&mut recording.time, &mut recording.stroke, &mut recording.pressure] {
                *column = keep.iter().map(|i| column[*i]).collect();
            }
            recording.direction = recording.direction.take().map(|d| keep.iter().map(|i| d[*i]).collect());
            (recording.temperature, recording.pressure_command) = (None, None);
            (recording.cycle, recording.rows) = (None, None);
            first += force.len();
        }
        Ok(freed)
    }

    /// The effect beside a free curve for each mounting, at the width of the contact that leaves the least.
    fn amplitudes(&self, bare: &TableFile, layers: (Layers, bool)) -> Result<FittedEffect> {
        let (points, zero) = (&self.points, self.zero);
        let least = PULLS * points.largest_force();
        let pulls: Vec<bool> = self
            .use_point
            .iter()
            .zip(&points.force)
            .map(|(used, force)| *used && force - zero > least)
            .collect();
        let mut best: Option<(f64, [f64; AMPLITUDES.len()], f64)> = None;
        for width in TABLE_WIDTHS {
            let columns = effect_columns(bare, &self.loaded, EffectName::BladderCreep, &[width])?;
            let found = beside_curves(points, &pulls, zero, &columns, layers);
            let possible = found.deadband > TABLE_LEAST_DEADBAND || width == TABLE_WIDTHS[0];
            if possible && best.as_ref().is_none_or(|(least, ..)| found.squares < *least) {
                best = Some((found.squares, found.amplitudes, width));
            }
        }
        let (_, found, width) = best.unwrap_or((0.0, [0.0; AMPLITUDES.len()], TABLE_WIDTHS[0]));
        Ok(FittedEffect::new(EffectName::BladderCreep, &[found[0], found[1], found[2], width]))
    }
}

/// The table of settled recordings with the memory; `None` where the campaign is none of isometric staircases with repeated runs.
///
/// # Errors
/// Recordings that cannot be fitted.
pub fn table(settled: &Campaign, muscle: &MuscleDescription) -> Result<Option<TableFile>> {
    let used = vec![true; settled.recordings.len()];
    let prepared = Prepared::of(settled, muscle, &used)?;
    prepared.map(|prepared| prepared.table(Layers::Memory)).transpose()
}

/// The table of recordings with all that its file tells.
fn complete(campaign: &Campaign, muscle: &MuscleDescription) -> Result<TableFile> {
    let with =
        |as_described: bool| fit(campaign, muscle, &FitOptions { as_described, ..FitOptions::default() });
    let fitted = with(false).or_else(|_| with(true))?;
    let about = About {
        muscle: muscle.name.clone(),
        tool: format!("host {}", env!("CARGO_PKG_VERSION")),
        fit: fitted.summary.quality(),
        uncertainty: Some(fitted.stored_uncertainty()),
        mountings: stored_mountings(&fitted.solution.problem),
        ..About::default()
    };
    Ok(TableFile { table: fitted.table, about })
}

/// The same for a prediction only. Few recordings may ask for dimensions that no table has: then those of the description stay.
fn alone(campaign: &Campaign, muscle: &MuscleDescription) -> Result<TableFile> {
    let with = |as_described: bool| {
        table_alone(campaign, muscle, &FitOptions { as_described, ..FitOptions::default() })
    };
    let (table, mountings) = with(false).or_else(|_| with(true))?;
    Ok(TableFile { table, about: About { mountings, ..About::default() } })
}

fn chosen(campaign: &Campaign, used: &[bool]) -> Campaign {
    let recordings = campaign
        .recordings
        .iter()
        .zip(used)
        .filter(|(r, used)| **used && !r.is_empty())
        .map(|(r, _)| r.clone());
    Campaign { recordings: recordings.collect(), clock: campaign.clock, warnings: Vec::new() }
}

/// What the load cell reads of a slack muscle, N; 0 without enough points.
fn slack_reading(points: &Points, use_point: &[bool]) -> f64 {
    let thresholds = thresholds(points);
    let slack = |i: &usize| use_point[*i] && points.pressure[*i] < thresholds[points.mounting[*i]] - RAMP;
    let mut read: Vec<f64> = (0..points.len()).filter(slack).map(|i| points.force[i]).collect();
    if read.len() < TABLE_LEAST_SLACK { 0.0 } else { median(&mut read) }
}

/// Amplitudes beside free curves.
struct Beside {
    amplitudes: [f64; AMPLITUDES.len()],
    /// Sum of squared residuals, N².
    squares: f64,
    /// Deadband of the straight line at full length, Pa.
    deadband: f64,
}

/// Least squares in which the columns `limited` have no negative coefficient: of those that would, the most negative is left out until
/// none is left. A wall relaxes and a contact spreads with time; the reverse is no memory.
fn without_negative(
    gram: &[Vec<f64>],
    moment: &[f64],
    mut open: Vec<usize>,
    limited: std::ops::Range<usize>,
) -> Vec<f64> {
    loop {
        let solved = solve_symmetric(gram, moment, &open).unwrap_or_default();
        let mut weights = vec![0.0; moment.len()];
        open.iter().zip(&solved).for_each(|(a, w)| weights[*a] = *w);
        let negative = |a: &usize| weights[*a] * gram[*a][*a].sqrt();
        let worst = limited
            .clone()
            .filter(|a| weights[*a] < 0.0 && open.contains(a))
            .min_by(|a, b| negative(a).total_cmp(&negative(b)));
        match worst {
            Some(worst) => open.retain(|a| *a != worst),
            None => return weights,
        }
    }
}

/// Least squares of the amplitudes beside the curves.
fn beside_curves(
    points: &Points,
    pulls: &[bool],
    zero: f64,
    columns: &[Vec<f64>],
    (layers, contact): (Layers, bool),
) -> Beside {
    let spline = static_spline(points.highest());
    let (longest, knots) = (points.longest(), spline.len());
    let curves = knots * points.mountings.len();
    let count = curves + AMPLITUDES.len();
    let row = |i: usize| -> Vec<(usize, f64)> {
        let (m, p) = (points.mounting[i], points.pressure[i]);
        let mut row: Vec<(usize, f64)> = if m == longest {
            vec![(knots * m, 1.0), (knots * m + 1, p / points.highest())]
        } else {
            let local = spline.at(p);
            (0..4).map(|k| (knots * m + local.first + k, local.value[k])).collect()
        };
        let memory = layers == Layers::Memory;
        // Elsewhere a free curve has the contact's part.
        let fitted =
            |a: &usize| if *a == (Amplitude::Contact as usize) { contact && m == longest } else { memory };
        row.extend((0..AMPLITUDES.len()).filter(fitted).map(|a| (curves + a, columns[a][i])));
        row
    };
    let mut gram = vec![vec![0.0; count]; count];
    let mut moment = vec![0.0; count];
    for i in (0..points.len()).filter(|i| pulls[*i]) {
        let row = row(i);
        for (a, x) in &row {
            moment[*a] += x * (points.force[i] - zero);
            row.iter().for_each(|(b, y)| gram[*a][*b] += x * y);
        }
    }
    for m in (0..points.mountings.len()).filter(|m| *m != longest) {
        for first in knots * m..knots * (m + 1) - 2 {
            for (a, x) in [1.0, -2.0, 1.0].iter().enumerate() {
                for (b, y) in [1.0, -2.0, 1.0].iter().enumerate() {
                    gram[first + a][first + b] += SMOOTHNESS_STATIC * x * y;
                }
            }
        }
    }
    // Columns of forces per unit of an amplitude are of very different size: the solution scales them.
    let open: Vec<usize> = (0..count).filter(|a| gram[*a][*a] > 0.0).collect();
    open.iter().for_each(|a| gram[*a][*a] *= 1.0 + RIDGE);
    let weights = without_negative(&gram, &moment, open, curves..curves + Amplitude::Contact as usize);
    let left = |i: usize| points.force[i] - zero - row(i).iter().map(|(a, x)| x * weights[*a]).sum::<f64>();
    let squares = (0..points.len()).filter(|i| pulls[*i]).map(|i| left(i).powi(2)).sum();
    let of = |a: usize| weights[curves + a];
    let line = knots * longest;
    let deadband = -1e3 * points.highest() * weights[line] / weights[line + 1];
    // Contact takes pressure and gives none.
    Beside {
        amplitudes: [
            of(Amplitude::Wall as usize),
            of(Amplitude::Growing as usize),
            of(Amplitude::Contact as usize).max(0.0),
        ],
        squares,
        deadband,
    }
}
