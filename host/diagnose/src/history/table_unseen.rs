//! Each run predicted from the others by tables with and without memory: through the bytes of a table file, and the prediction that
//! `host predict` makes.

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording, largest_force};
use pam_data::statistics::extremes;
use pam_fit::predict::predict;
use pam_fit::table_file::{About, TableFile};
use rayon::prelude::*;

use super::criteria::{LENGTH_ERROR, LENGTH_STEPS, PULLS, SUPPORT, TABLE_FOLDS};
use super::table_fit::{self, Layers, Prepared};
use crate::valve_pulses;

/// Sizes of errors of unseen runs, % of the largest force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnseenError {
    /// Root mean square.
    pub rms_pct: f64,
    /// Mean absolute.
    pub mean_pct: f64,
    /// Readings that count.
    pub readings: usize,
}

/// The errors of one form of a campaign's readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnseenErrors {
    /// The base model alone, with the zero of the load cell.
    pub base: UnseenError,
    /// The static model without the memory: base model and contact.
    pub without_memory: UnseenError,
    /// Contact and memory.
    pub with_memory: UnseenError,
    /// The same with the length of each left-out mounting, within `LENGTH_ERROR` of the one that was set, that suits its own readings
    /// best. This is not a prediction: it shows how much of the error comes from the lengths. As `with_memory` where runs are left out.
    pub with_own_length: UnseenError,
    /// The errors without memory of the readings whose pressure another run of the mounting reaches.
    pub supported_without_memory: UnseenError,
    /// And with memory.
    pub supported_with_memory: UnseenError,
    /// Share of the readings set aside because they ring after a valve's pulse, %.
    pub ringing_pct: f64,
    /// Share of the others that are slack or at the converter's end, %: a prediction errs there only by what it pulls too much.
    pub slack_pct: f64,
}

/// Which readings of each recording count.
struct ReadingSelection {
    rings: Vec<Vec<bool>>,
    /// A reading up to this is slack, N.
    slack: f64,
    largest: f64,
    /// The pressure up to which the other runs of its mounting reach, Pa, by recording.
    reached: Vec<f64>,
}

/// Sums over the readings of recordings.
#[derive(Clone, Copy, Default)]
struct Sums {
    squares: f64,
    sizes: f64,
    count: f64,
    slack: f64,
}

/// The sums of all readings, and of those whose pressure another run of the mounting reaches.
#[derive(Clone, Copy, Default)]
struct Both {
    all: Sums,
    supported: Sums,
}

impl std::ops::Add for Sums {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            sizes: self.sizes + other.sizes,
            count: self.count + other.count,
            slack: self.slack + other.slack,
        }
    }
}

/// Up to which pressure the other runs of each recording's mounting reach, Pa.
fn reached(campaign: &Campaign) -> Vec<f64> {
    let top = |r: &Recording| r.pressure.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let tops: Vec<f64> = campaign.recordings.iter().map(top).collect();
    let mountings = campaign.mountings().unwrap_or_default();
    let same = |r: usize, o: usize| o != r && mountings.get(o) == mountings.get(r);
    let of =
        |r: usize| (0..tops.len()).filter(|o| same(r, *o)).map(|o| tops[o]).fold(f64::NEG_INFINITY, f64::max);
    (0..tops.len()).map(of).collect()
}

impl ReadingSelection {
    fn of(campaign: &Campaign, zero: f64) -> Self {
        let rings = campaign.recordings.par_iter().map(valve_pulses::ringing).collect();
        let largest = largest_force(campaign).max(f64::MIN_POSITIVE);
        Self { rings, slack: zero + PULLS * largest, largest, reached: reached(campaign) }
    }

    fn add(&self, both: &mut Both, campaign: &Campaign, index: usize, predicted: &[f64]) {
        let recording = &campaign.recordings[index];
        let Some(force) = &recording.force else { return };
        let limit = self.reached[index] + SUPPORT * 1e3;
        let readings = force.iter().zip(predicted).zip(&self.rings[index]).zip(&recording.pressure);
        for (((read, model), rings), pressure) in readings {
            if *rings || !read.is_finite() || !model.is_finite() {
                continue;
            }
            let slack = *read <= self.slack;
            // A slack reading says that the muscle pulls no more than that.
            let error = if slack { (model - self.slack).max(0.0) } else { model - read };
            let one = Sums {
                squares: error * error,
                sizes: error.abs(),
                count: 1.0,
                slack: f64::from(u8::from(slack)),
            };
            both.all = both.all + one;
            if *pressure <= limit {
                both.supported = both.supported + one;
            }
        }
    }

    /// Over the readings that pull.
    fn size(&self, sums: Sums) -> UnseenError {
        let n = (sums.count - sums.slack).max(1.0);
        UnseenError {
            rms_pct: 100.0 * (sums.squares / n).sqrt() / self.largest,
            mean_pct: 100.0 * sums.sizes / n / self.largest,
            readings: n as usize,
        }
    }
}

/// Through the bytes of a file, as `host predict` reads it.
fn reread(file: &TableFile) -> Result<TableFile> {
    TableFile::from_bytes(&file.to_bytes()?)
}

/// Which runs are held out together and predicted from the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOut {
    /// A run; of many, every n-th.
    Runs,
    /// All runs of a mounting between others: a contraction of which the fit has no recording.
    Mountings,
}

impl LeftOut {
    /// Which recordings each fold uses.
    fn folds(self, campaign: &Campaign) -> Vec<Vec<bool>> {
        let runs = campaign.recordings.len();
        let mountings = campaign.mountings().unwrap_or_default();
        let every = |count: usize, of: &dyn Fn(usize) -> usize| -> Vec<Vec<bool>> {
            (0..count).map(|fold| (0..runs).map(|r| of(r) != fold).collect()).collect()
        };
        match self {
            Self::Runs => every(runs.min(TABLE_FOLDS), &|r| r % TABLE_FOLDS.min(runs)),
            Self::Mountings => {
                let stroke = |r: usize| campaign.recordings[r].stroke.first().copied().unwrap_or(0.0);
                let strokes = || (0..runs).map(stroke);
                let (low, high) = extremes(strokes());
                let between = |fold: &Vec<bool>| {
                    let own = (0..runs).find(|r| !fold[*r]).map(stroke);
                    own.is_some_and(|s| s > low && s < high)
                };
                let count = mountings.iter().max().map_or(0, |last| last + 1);
                every(count, &|r| mountings[r]).into_iter().filter(between).collect()
            }
        }
    }
}

/// The errors of unseen runs over the readings of two forms of one campaign: the one that the tables are fitted to (at its settled points), and
/// another of the same runs, as recorded. `None` where the campaign is none of isometric staircases with repeated runs, or the other has
/// other runs. Of many runs every n-th is left out together.
///
/// # Errors
/// Recordings that cannot be fitted or predicted.
pub fn unseen_by_table(
    campaign: &Campaign,
    recorded: &Campaign,
    muscle: &MuscleDescription,
    left_out: LeftOut,
) -> Result<Option<[UnseenErrors; 2]>> {
    let settled = table_fit::settled(campaign);
    let runs = settled.recordings.len();
    if settled.mountings() != recorded.mountings() {
        return Ok(None);
    }
    let Some(whole) = Prepared::of(&settled, muscle, &vec![true; runs])? else { return Ok(None) };
    let forms = [
        (&settled, ReadingSelection::of(&settled, whole.zero)),
        (recorded, ReadingSelection::of(recorded, whole.zero)),
    ];
    let fold = |used: &Vec<bool>| -> Result<[[Both; 4]; 2]> {
        let mut sums = [[Both::default(); 4]; 2];
        let Some(prepared) = Prepared::of(&settled, muscle, used)? else { return Ok(sums) };
        let tables = [prepared.base(), prepared.table(Layers::Contact)?, prepared.table(Layers::Memory)?];
        for (k, table) in tables.iter().enumerate() {
            let table = reread(table)?;
            for (f, (form, selection)) in forms.iter().enumerate() {
                let predicted = predict(&table, form)?;
                for r in (0..runs).filter(|r| !used[*r]) {
                    selection.add(&mut sums[f][k], form, r, &predicted.recordings[r].force);
                }
            }
        }
        for (f, (form, selection)) in forms.iter().enumerate() {
            sums[f][3] = match left_out {
                LeftOut::Runs => sums[f][2],
                LeftOut::Mountings => own_length(&reread(&tables[2])?, form, selection, used)?,
            };
        }
        Ok(sums)
    };
    let parts: Vec<[[Both; 4]; 2]> = left_out.folds(&settled).par_iter().map(fold).collect::<Result<_>>()?;
    let form = |f: usize| {
        let selection = &forms[f].1;
        let total = |k: usize, of: fn(&Both) -> Sums| {
            parts.iter().map(|p| of(&p[f][k])).fold(Sums::default(), std::ops::Add::add)
        };
        let all = |k: usize| total(k, |both| both.all);
        let supported = |k: usize| total(k, |both| both.supported);
        let rings = selection.rings.iter().flatten().filter(|r| **r).count() as f64;
        let readings = selection.rings.iter().map(Vec::len).sum::<usize>().max(1) as f64;
        UnseenErrors {
            base: selection.size(all(0)),
            without_memory: selection.size(all(1)),
            with_memory: selection.size(all(2)),
            with_own_length: selection.size(all(3)),
            supported_without_memory: selection.size(supported(1)),
            supported_with_memory: selection.size(supported(2)),
            ringing_pct: 100.0 * rings / readings,
            slack_pct: 100.0 * all(2).slack / all(2).count.max(1.0),
        }
    };
    Ok(Some([form(0), form(1)]))
}

/// The errors of the recordings that are not used, with one shift of their length that gives the least.
fn own_length(
    table: &TableFile,
    form: &Campaign,
    selection: &ReadingSelection,
    used: &[bool],
) -> Result<Both> {
    let mut best: Option<Both> = None;
    for step in 0..LENGTH_STEPS {
        let shift = LENGTH_ERROR * (2.0 * step as f64 / (LENGTH_STEPS - 1) as f64 - 1.0);
        let mut shifted = form.clone();
        for (recording, _) in shifted.recordings.iter_mut().zip(used).filter(|(_, used)| !**used) {
            recording.stroke.iter_mut().for_each(|x| *x += shift);
        }
        let predicted = predict(table, &shifted)?;
        let mut both = Both::default();
        for r in (0..used.len()).filter(|r| !used[*r]) {
            selection.add(&mut both, form, r, &predicted.recordings[r].force);
        }
        if best.is_none_or(|b| both.all.squares < b.all.squares) {
            best = Some(both);
        }
    }
    Ok(best.unwrap_or_default())
}

/// What a held length that is wrong by a millimetre changes of the force at settled points that pull, mean absolute, % of the largest
/// force: a table of other lengths cannot be better than the lengths were set. `None` as for [`unseen_by_table`].
///
/// # Errors
/// Recordings that cannot be fitted or predicted.
pub fn error_of_a_millimetre(campaign: &Campaign, muscle: &MuscleDescription) -> Result<Option<f64>> {
    let settled = table_fit::settled(campaign);
    let used = vec![true; settled.recordings.len()];
    let Some(prepared) = Prepared::of(&settled, muscle, &used)? else { return Ok(None) };
    let table = prepared.base();
    let mut shifted = settled.clone();
    for recording in &mut shifted.recordings {
        recording.stroke.iter_mut().for_each(|s| *s += 1e-3);
    }
    // The table's corrections of the mountings belong to the lengths as recorded.
    let bare = TableFile { table: table.table, about: About::default() };
    let (at, beside) = (predict(&bare, &settled)?, predict(&bare, &shifted)?);
    let largest = largest_force(&settled).max(f64::MIN_POSITIVE);
    let pairs = at.recordings.iter().zip(&beside.recordings).flat_map(|(a, b)| a.force.iter().zip(&b.force));
    let differences: Vec<f64> =
        pairs.filter(|(a, _)| **a > PULLS * largest).map(|(a, b)| (a - b).abs()).collect();
    let count = differences.len().max(1) as f64;
    Ok(Some(100.0 * differences.iter().sum::<f64>() / count / largest))
}
