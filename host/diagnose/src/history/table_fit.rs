//! The memory in a table: the catalogue's `bladder-creep` beside a base model, fitted to the settled points of a campaign.
//!
//! The dimensions are those of the base model's fit; table and memory are then one least-squares problem (`held_table`).
//! The zero of the load cell is subtracted first, and the table contains it as `force-offset`.

use model_core::effects::EffectName;
use model_core::table::MuscleTable;
use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::pluralise::pluralise;
use pam_data::recording::{Campaign, Recording};
use pam_data::statistics::median;
use pam_fit::bench::BenchName;
use pam_fit::effect_columns::effect_columns;
use pam_fit::table_file::{About, Correction, TableFile};
use pam_fit::vented_rest::EarlierLoad;
use pam_fit::{Options as FitOptions, table_alone};

use super::campaign::{self, Points};
use super::criteria::{
    PULLS, TABLE_LEAST_DEADBAND, TABLE_LEAST_SLACK, TABLE_LOADED, TABLE_LOADED_GAIN, TABLE_ROUNDS,
    TABLE_SETTLED, TABLE_WIDTHS,
};
use super::held_table::{Open, Problem, Solution, predicts_better};
use super::law::thresholds_of;
use super::slack_reading::almost_pulls;
use super::staircase;

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

/// What is fitted, and what is assumed while it is.
#[derive(Clone, Copy)]
struct Assumed {
    open: Open,
    /// `P_c`, Pa.
    width: f64,
    earlier_load: Option<EarlierLoad>,
}

/// A solution, and the last round that gave it.
struct Found {
    solution: Solution,
    assumed: Assumed,
    columns: Vec<Vec<f64>>,
    before: Option<Solution>,
}

impl Found {
    /// What the layers of the solution's own table give beyond those it was fitted with: root mean square over the points, N.
    fn misses(&self, own: &[Vec<f64>]) -> f64 {
        let layers = self.solution.amplitudes.iter().zip(own.iter().zip(&self.columns));
        let mut differences = vec![0.0; own.first().map_or(0, Vec::len)];
        for (amplitude, (own, fitted)) in layers {
            differences
                .iter_mut()
                .zip(own.iter().zip(fitted))
                .for_each(|(d, (o, f))| *d += amplitude * (o - f));
        }
        (differences.iter().map(|d| d * d).sum::<f64>() / differences.len().max(1) as f64).sqrt()
    }

    fn left_out(&self, problem: &Problem<'_>) -> Vec<f64> {
        problem.left_out(&self.columns, self.assumed.open, self.before.as_ref(), &self.solution)
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
    /// Recordings that are not `used` count as the muscle's past, but their forces are not used. `None` where the campaign is none
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
            file.about
                .corrections
                .push(Correction { effect: BenchName::ForceOffset.info().name.into(), parameters });
        }
        file
    }

    /// The table with some layers: the contact, and friction that follows pressure, where runs that are left out require them.
    ///
    /// # Errors
    /// Recordings that cannot be fitted.
    pub(super) fn table(&self, layers: Layers) -> Result<TableFile> {
        let least = PULLS * self.points.largest_force();
        let force: Vec<f64> = self.points.force.iter().map(|f| f - self.zero).collect();
        let problem = Problem::new(&self.points, &force, &self.use_point, least, &self.base.table);
        let Some(problem) = problem else { return Ok(self.base()) };
        let memory = layers == Layers::Memory;
        let widths = TABLE_WIDTHS.iter().flat_map(|width| [(*width, true), (*width, false)]);
        let mut best: Option<Found> = None;
        for (width, contact) in
            widths.filter(|(width, contact)| memory || *contact || *width == TABLE_WIDTHS[0])
        {
            let open = [memory, memory, contact, false, false];
            let better = |s: &Solution| best.as_ref().is_none_or(|b| s.squares < b.solution.squares);
            let found = self.rounds(&problem, Assumed { open, width, earlier_load: None })?;
            if let Some(found) = found.filter(|f| within_physical_limits(&f.solution) && better(&f.solution))
            {
                best = Some(found);
            }
        }
        let Some(mut best) = best else { return Ok(self.base()) };
        let [wall, growing, contact, ..] = best.assumed.open;
        let open = [wall, growing, contact, true, true];
        if let Some(found) = self.rounds(&problem, Assumed { open, ..best.assumed })?
            && predicts_better(&found.left_out(&problem), &best.left_out(&problem))
        {
            best = found;
        }
        // Last, as no recording shows it: effects that the recordings show come first.
        if memory {
            best = self.with_earlier_load(&problem, best)?;
        }
        let Found { solution, assumed, .. } = best;
        let about = if self.used.iter().all(|used| *used) {
            self.about(&problem, &solution, assumed)?
        } else {
            About { earlier_load: assumed.earlier_load, ..About::default() }
        };
        let mut table = solution.with_layers(assumed.width);
        table.goes_slack = self.base.table.goes_slack;
        Ok(self.zeroed(TableFile { table, about }))
    }

    /// The solution with the earlier load that predicts left-out runs best, if it predicts them clearly better than none.
    fn with_earlier_load(&self, problem: &Problem<'_>, without: Found) -> Result<Found> {
        let pressure = 1e3 * self.points.highest();
        let error = |found: &Found| found.left_out(problem).iter().sum::<f64>();
        let mut least = (1.0 - TABLE_LOADED_GAIN) * error(&without);
        let unloaded = without.assumed;
        let mut best = without;
        for seconds in TABLE_LOADED {
            let assumed = Assumed { earlier_load: Some(EarlierLoad { pressure, seconds }), ..unloaded };
            if let Some(found) =
                self.rounds(problem, assumed)?.filter(|f| within_physical_limits(&f.solution))
            {
                let error = error(&found);
                if error < least {
                    least = error;
                    best = found;
                }
            }
        }
        Ok(best)
    }

    /// The columns of the layers beside a table.
    fn columns(&self, file: &TableFile, width: f64) -> Result<Vec<Vec<f64>>> {
        let mut columns = effect_columns(file, &self.loaded, EffectName::BladderCreep, &[width])?;
        let mut friction = effect_columns(file, &self.loaded, EffectName::PressureFriction, &[])?.into_iter();
        if let (Some(now), Some(at_rest)) = (friction.next(), friction.next()) {
            columns.push(now.iter().zip(&at_rest).map(|(now, at_rest)| now - at_rest).collect());
            columns.push(at_rest);
        }
        Ok(columns)
    }

    /// A table without the history of its fit, except the earlier load.
    fn bare(&self, table: MuscleTable, assumed: Assumed) -> TableFile {
        TableFile { table, about: About { earlier_load: assumed.earlier_load, ..About::default() } }
    }

    /// Friction and the wall's drive come from the last solution.
    fn rounds(&self, problem: &Problem<'_>, assumed: Assumed) -> Result<Option<Found>> {
        let mut file = self.bare(self.base.table.clone(), assumed);
        let mut found: Option<Found> = None;
        let settled = TABLE_SETTLED * self.points.largest_force();
        for _ in 0..TABLE_ROUNDS {
            let columns = self.columns(&file, assumed.width)?;
            if found.as_ref().is_some_and(|found| found.misses(&columns) < settled) {
                break;
            }
            let before = found.map(|f| f.solution);
            let Some(solution) = problem.solve(&columns, assumed.open, before.as_ref()) else {
                return Ok(None);
            };
            file.table = solution.table.clone();
            file.table.goes_slack = self.base.table.goes_slack;
            found = Some(Found { solution, assumed, columns, before });
        }
        Ok(found)
    }

    /// What the file reports.
    fn about(&self, problem: &Problem<'_>, solution: &Solution, assumed: Assumed) -> Result<About> {
        let columns = self.columns(&self.bare(solution.table.clone(), assumed), assumed.width)?;
        let mountings = pluralise(self.points.mountings.len(), "mounting");
        let together = format!(
            "recorded at held lengths ({mountings}): static part, friction and the bladder's memory were fitted together, with the braid \
             angle, diameter and wall that these lengths require"
        );
        let earlier = assumed.earlier_load.map(|load| {
            format!(
                "the first runs after a change of the mounting are predicted better if the muscle was filled to {:.0} kPa for about {:.0} s \
                 before: the table stores this for predictions of these recordings",
                1e-3 * load.pressure,
                load.seconds
            )
        });
        let warnings = self.loaded.warnings.iter().cloned().chain([together]).chain(earlier).collect();
        Ok(About {
            muscle: self.muscle.name.clone(),
            tool: format!("host {}", env!("CARGO_PKG_VERSION")),
            fit: problem.quality(solution, warnings),
            uncertainty: problem.uncertainty(&columns, solution),
            earlier_load: assumed.earlier_load,
            ..About::default()
        })
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

/// The base model's table. Few recordings may require dimensions that no table has: then those of the description stay.
fn alone(campaign: &Campaign, muscle: &MuscleDescription) -> Result<TableFile> {
    let with = |as_described: bool| {
        table_alone(campaign, muscle, &FitOptions { as_described, ..FitOptions::default() })
    };
    let (table, mountings) = with(false).or_else(|_| with(true))?;
    Ok(TableFile { table, about: About { mountings, ..About::default() } })
}

/// Whether a table may have its deadband.
fn within_physical_limits(solution: &Solution) -> bool {
    f64::from(solution.table.deadband.pascals()) > TABLE_LEAST_DEADBAND
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

/// The zero of the load cell: what it reads of a muscle that almost pulls, N; 0 without enough points. A tube that lies slack pushes or
/// hangs, and lifts as it is filled: at lower pressures that is in the reading too.
fn slack_reading(points: &Points, use_point: &[bool]) -> f64 {
    let thresholds = thresholds_of(points, use_point);
    let almost = |i: &usize| use_point[*i] && almost_pulls(points, &thresholds, *i);
    let mut read: Vec<f64> = (0..points.len()).filter(almost).map(|i| points.force[i]).collect();
    if read.len() < TABLE_LEAST_SLACK { 0.0 } else { median(&mut read) }
}
