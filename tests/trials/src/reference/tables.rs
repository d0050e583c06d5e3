//! The same question with only the table of then: fitted to the runs before, compared with the runs after.

use std::collections::BTreeMap;
use std::path::Path;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_diagnose::reference::{Against, Options, compare};
use pam_fit::table_file::{About, TableFile};
use rayon::prelude::*;

use super::injection::{EFFECTS, Slopes, inject};
use super::staircases::{Muscle, Run};
use super::{Answer, Trial};

/// Sizes put in, % of the largest force rms.
const SIZES: [f64; 3] = [3.0, 5.0, 10.0];

fn campaign(runs: &[Run]) -> Campaign {
    Campaign::new(runs.iter().map(Run::recording).collect())
}

/// The description of a muscle among the examples, by its year and rest length.
fn description(muscle: &Muscle) -> Option<MuscleDescription> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/muscles");
    let (year, name) = muscle.name.split_once(' ')?;
    // The sets name their muscles by the length that was cut, and by the rest length.
    let own = match year {
        "2021" => name.rsplit('_').next()?.to_owned(),
        _ => format!("{:.0}mm", muscle.rest_length_mm),
    };
    MuscleDescription::read(folder.join(format!("festo10-{year}-{own}.toml"))).ok()
}

/// The table of the runs up to one number.
fn table(muscle: &Muscle, until: usize) -> Option<TableFile> {
    let described = description(muscle)?;
    let options = pam_fit::Options { fit_geometry: true, fit_lengths: true, ..pam_fit::Options::default() };
    let fitted = pam_fit::fit(&campaign(&muscle.between(1, until)), &described, &options).ok()?;
    let about = About {
        fit: fitted.summary.quality(),
        uncertainty: Some(fitted.stored_uncertainty()),
        mountings: pam_fit::table_file::stored_mountings(&fitted.solution.problem),
        ..About::default()
    };
    Some(TableFile { table: fitted.table, about })
}

/// Middle split of each muscle; untouched windows of the later runs, and every effect in all of them.
pub fn run(muscles: &[Muscle], slopes: &BTreeMap<&str, Slopes>, short: bool) -> Vec<Trial> {
    let one = |muscle: &Muscle| -> Vec<Trial> {
        let split = muscle.runs / 2;
        let Some(table) = table(muscle, split.max(1)) else {
            println!("{}: no table", muscle.name);
            return Vec::new();
        };
        let slopes = &slopes[muscle.name.as_str()];
        let ask = |from: usize, to: usize, put_in: Option<(&'static str, f64)>| -> Option<Trial> {
            let mut after = muscle.between(from, to);
            after.sort_by_key(|r| (r.run, r.mounting));
            let mut size = 0.0;
            if let Some((effect, percent)) = put_in {
                (after, size) = inject(&after, effect, percent, slopes, &muscle.name, split, 0.5);
            }
            let start = std::time::Instant::now();
            let report =
                compare(&campaign(&after), Against::Table(&table, "then.pam"), &Options::default()).ok()?;
            Some(Trial {
                muscle: muscle.name.clone(),
                half: muscle.half,
                runs: (1, from - 1, to),
                effect: put_in.map(|p| p.0),
                percent: put_in.map_or(0.0, |p| p.1),
                size,
                answer: Answer::of(&report, start.elapsed().as_secs_f64()),
                simple: String::new(),
            })
        };
        let mut all = Vec::new();
        for from in split + 1..=muscle.runs {
            all.extend(
                (from..=muscle.runs)
                    .filter(|to| !short || *to == muscle.runs)
                    .filter_map(|to| ask(from, to, None)),
            );
        }
        for percent in SIZES.into_iter().filter(|p| !short || *p == 5.0) {
            all.extend(EFFECTS.into_iter().filter_map(|e| ask(split + 1, muscle.runs, Some((e, percent)))));
        }
        all
    };
    muscles.par_iter().flat_map_iter(one).collect()
}
