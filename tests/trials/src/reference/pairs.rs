//! The pairs as tables, for other methods: mean force of every run by mounting, direction and bin of pressure, and what a change of unit
//! size adds to each; the same bins and slopes as the simpler method has.

use std::collections::BTreeSet;

use serde::Serialize;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::muscle::Muscle as Simulated;
use virtual_bench::{campaigns, presets};

use super::injection::{EFFECTS, Slopes, added, inject};
use super::single_effects::{BINS, means};
use super::staircases::{Half, Run};

/// Part of AFTER from which on a slip is assumed.
const MIDDLE: f64 = 0.5;
/// Runs of a simulated muscle, half of them before.
const RUNS: usize = 4;
/// Sizes in the simulated pairs, % of the largest force rms.
const SIZES: [f64; 4] = [1.0, 2.0, 3.0, 5.0];

/// One pair.
#[derive(Debug, Serialize)]
pub struct Pair {
    /// Muscle.
    pub muscle: String,
    /// Which half; absent for a simulated muscle.
    pub half: Option<Half>,
    /// What was put in; absent for untouched pairs.
    pub effect: Option<&'static str>,
    /// % of the largest force rms.
    pub percent: f64,
    /// First and last run before, last run after.
    pub runs: (usize, usize, usize),
    /// N.
    pub largest: f64,
    /// Mounting, direction and bin of each cell.
    pub cells: Vec<(usize, i8, usize)>,
    /// Mean force of each run before, N; null where a run has no rows in a cell.
    pub before: Vec<Vec<Option<f32>>>,
    /// The same after.
    pub after: Vec<Vec<Option<f32>>>,
    /// By effect, mean over the runs after of what a unit adds, N.
    pub columns: Vec<(&'static str, Vec<f32>)>,
}

fn short(v: f64) -> Option<f32> {
    v.is_finite().then_some(v as f32)
}

/// Name of the muscle, its half, the change, its size, and the runs.
type About = (String, Option<Half>, Option<&'static str>, f64, (usize, usize, usize));

/// The table of a pair.
pub fn table((before, after): (&[Run], &[Run]), slopes: &Slopes, largest: f64, about: About) -> Pair {
    let mountings = before.iter().chain(after).map(|r| r.mounting).max().map_or(0, |m| m + 1);
    let side = |runs: &[Run]| -> Vec<Vec<f64>> {
        let numbers: BTreeSet<usize> = runs.iter().map(|r| r.run).collect();
        let own = |n: &usize| runs.iter().filter(|r| r.run == *n).cloned().collect::<Vec<Run>>();
        let of = |runs: Vec<Run>| means(&runs, &|k| runs[k].force.clone(), mountings);
        numbers.iter().map(|n| of(own(n))).collect()
    };
    let (old, new) = (side(before), side(after));
    let any = |all: &[Vec<f64>], i: usize| all.iter().any(|run| run[i].is_finite());
    let kept: Vec<usize> = (0..mountings * 2 * BINS).filter(|i| any(&old, *i) && any(&new, *i)).collect();
    let pick = |all: &[Vec<f64>]| -> Vec<Vec<Option<f32>>> {
        all.iter().map(|run| kept.iter().map(|i| short(run[*i])).collect()).collect()
    };
    let columns = EFFECTS.into_iter().map(|effect| {
        let traces = added(after, effect, slopes, MIDDLE);
        let column = means(after, &|k| traces[k].clone(), mountings);
        (effect, kept.iter().map(|i| short(column[*i]).unwrap_or(0.0)).collect())
    });
    let (muscle, half, effect, percent, runs) = about;
    Pair {
        muscle,
        half,
        effect,
        percent,
        runs,
        largest,
        cells: kept
            .iter()
            .map(|i| (i / (2 * BINS), if (i / BINS).is_multiple_of(2) { 1 } else { -1 }, i % BINS))
            .collect(),
        before: pick(&old),
        after: pick(&new),
        columns: columns.collect(),
    }
}

/// Runs of a simulated muscle at held lengths, with pressures in the range of the real recordings.
fn simulated(seed: u64) -> Vec<Run> {
    let mut muscle = presets::random(seed);
    muscle.name = format!("simulated {seed}");
    let made = Simulated::new(muscle.clone());
    let levels = campaigns::levels(&made);
    let protocol = campaigns::staircase(&made, &levels);
    let top = levels.iter().copied().fold(0.0, f64::max);
    let mut all = Vec::new();
    for run in 1..=RUNS {
        let bench = BenchSpec::laboratory(muscle.clone(), seed * 100 + run as u64);
        let files = Bench::new(&bench).run(&protocol).unwrap_or_default();
        for (mounting, file) in files.iter().enumerate() {
            let begin = file.rows.first().map_or(0.0, |r| r.time);
            let column =
                |of: &dyn Fn(&virtual_bench::recording::Row) -> f64| file.rows.iter().map(of).collect();
            all.push(Run {
                source: file.name.clone().into(),
                mounting,
                run,
                stroke: file.rows.first().map_or(0.0, |r| r.stroke),
                time: column(&|r| r.time - begin),
                // The bins are those of a muscle for 650 kPa.
                pressure: column(&|r| r.pressure / top * 620e3),
                force: column(&|r| r.force),
            });
        }
    }
    all
}

/// Pairs of simulated muscles, on which a classifier can be trained: every change at every size, and none.
pub fn of_the_bench(muscles: u64) -> Vec<Pair> {
    use rayon::prelude::*;
    let one = |seed: u64| {
        let runs = simulated(seed);
        let largest = runs.iter().flat_map(|r| r.force.iter().copied()).fold(0.0, f64::max);
        let slopes = Slopes::of(&runs);
        let (before, after): (Vec<Run>, Vec<Run>) = runs.into_iter().partition(|r| r.run <= RUNS / 2);
        let name = format!("simulated {seed}");
        let about = |effect, percent| (name.clone(), None, effect, percent, (1, RUNS / 2, RUNS));
        let mut all = vec![table((&before, &after), &slopes, largest, about(None, 0.0))];
        for effect in EFFECTS {
            for (k, percent) in SIZES.into_iter().enumerate() {
                let moment = 0.35 + 0.1 * k as f64;
                let (changed, _) = inject(&after, effect, percent, &slopes, &name, k, moment);
                all.push(table((&before, &changed), &slopes, largest, about(Some(effect), percent)));
            }
        }
        all
    };
    (1..=muscles).into_par_iter().flat_map_iter(one).collect()
}
