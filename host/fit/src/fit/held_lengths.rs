//! Recordings at held lengths: force against pressure, each at one of a few lengths.
//!
//! Such recordings see length only at a few places, so an error of the braid angle, of the diameter or of a mounted length cannot hide
//! in the elastic polynomial: it makes the deadband negative or the friction senseless. Two fits are compared, one with the described
//! dimensions and one with dimensions and mounted lengths open (with the priors of [`super::dimensions`]). The open one is taken where
//! the Bayesian information criterion prefers it:
//!
//! ```text
//! N ln(S_described / S_open) > q ln N        G. Schwarz, Ann. Statist. 6 (1978) 461, doi 10.1214/aos/1176344136
//! ```
//! `S` is the sum of squared residuals by point, `q` the number of opened values, `N` the number of half-strokes (filling or emptying of
//! one recording): rows of one half-stroke are correlated and count once. It is also taken where the described dimensions give values
//! that no muscle has ([`crate::table_faults`]) and the open ones do not.

use pam_data::pluralise::pluralise;

use pam_data::muscle_description::MuscleDescription;

use crate::table_faults::table_faults;
use crate::table_file::FitQuality;

use super::Options;
use super::points::Points;
use super::result;
use super::screen::PointUse;
use super::solution::Solution;

/// With fewer lengths the braid's angle and its diameter are not separately identifiable.
const FEWEST_LENGTHS: usize = 3;

/// The options that open dimensions and lengths, where the recordings were held and no option was given.
pub(super) fn open(points: &Points, options: &Options) -> Option<Options> {
    let requested = options.fit_geometry || options.fit_lengths || options.as_described;
    let held = points.held_lengths();
    (!requested && held.len() >= FEWEST_LENGTHS).then(|| Options {
        fit_geometry: true,
        fit_lengths: true,
        ..options.clone()
    })
}

/// The fit that is taken, and why.
pub(super) struct Choice {
    pub(super) solution: Solution,
    pub(super) reason: String,
}

/// Decides between the described dimensions and open ones.
pub(super) fn choose(described: Solution, open: Solution, muscle: &MuscleDescription) -> Choice {
    let lengths = pluralise(described.problem.points.held_lengths().len(), "mounting");
    let (before, after) = (Misfit::of(&described), Misfit::of(&open));
    let halves = before.halves.min(after.halves).max(1) as f64;
    let gain = halves * (before.mean_square() / after.mean_square()).ln();
    let cost = open.problem.adjusted.len() as f64 * halves.ln();
    let rms = format!("rms {:.2} N as described, {:.2} N with them", before.rms(), after.rms());
    // A comparison that fails for NaN keeps the described dimensions.
    let explained = gain > cost;
    if explained || (within_physical_limits(&open, muscle) && !within_physical_limits(&described, muscle)) {
        let cause = if explained {
            ""
        } else {
            ", since the described ones give a table that is useless for control"
        };
        Choice {
            reason: format!(
                "recorded at held lengths ({lengths}): braid angle, diameter, wall and mounted lengths were fitted too, as with \
                 --fit-geometry --fit-lengths ({rms}){cause}; --as-described keeps the described ones"
            ),
            solution: open,
        }
    } else {
        Choice {
            reason: format!(
                "recorded at held lengths ({lengths}): the described dimensions and lengths are kept, since others describe the force no \
                 better than their number explains ({rms})"
            ),
            solution: described,
        }
    }
}

/// Whether a solution gives a table without faults. The uncertainty is not known yet, so every fault counts.
fn within_physical_limits(solution: &Solution, muscle: &MuscleDescription) -> bool {
    result::table(solution, muscle)
        .is_ok_and(|table| table_faults(&table, None, &FitQuality::default()).is_empty())
}

/// The squared residuals of a solution.
struct Misfit {
    square: f64,
    rows: f64,
    halves: usize,
}

impl Misfit {
    fn of(solution: &Solution) -> Self {
        let points = &solution.problem.points.list;
        let residuals = solution.problem.design.residuals(&solution.parameters);
        let mut misfit = Self { square: 0.0, rows: 0.0, halves: 0 };
        let mut last = None;
        for (i, p) in points.iter().enumerate().filter(|(i, _)| solution.screen.used[*i] == PointUse::Fitted)
        {
            let rows = f64::from(p.rows);
            misfit.square += rows * residuals[i].powi(2);
            misfit.rows += rows;
            if last.replace(p.block) != Some(p.block) {
                misfit.halves += 1;
            }
        }
        misfit
    }

    fn mean_square(&self) -> f64 {
        self.square / self.rows.max(1.0)
    }

    fn rms(&self) -> f64 {
        self.mean_square().sqrt()
    }
}
