//! The table's error on held-out motion after some minutes, compared with the thesis's protocol for the same time.

use crate::campaign::methods::{LEAST_ROWS, until};
use crate::spec::Spec;
use model_core::units::{Length, Pressure};
use pam_campaign::analysis::fitted;
use pam_campaign::bench::VirtualBench;
use pam_campaign::campaign::simulate;
use pam_campaign::engine::{Engine, Purpose};
use pam_campaign::rig::Rig;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Recording;
use serde::{Deserialize, Serialize};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::Muscle;

/// Bench time between two comparisons, min: five seconds, a tenth of what the first table takes.
const EVERY: f64 = 1.0 / 12.0;
/// Bench time of the last comparison, min.
const LAST: f64 = 10.0;

/// The error after this many minutes, % of the blocked force; absent where no table can be fitted yet.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct After {
    /// Bench time, min.
    pub minutes: f64,
    /// Steps chosen by expected information.
    pub chosen: Option<f64>,
    /// The thesis's protocol.
    pub thesis: Option<f64>,
}

/// Root mean square of the table's friction-free force against the bench's own, on a grid of pressures and strokes that no protocol has
/// as its levels, % of the blocked force.
fn error(recordings: &[Recording], description: &MuscleDescription, muscle: &Muscle) -> Option<f64> {
    let model = fitted(recordings, description)?.model;
    let levels = campaigns::levels(muscle);
    let top = *levels.last()?;
    let blocked = muscle.quasi_static(top, 0.0);
    let (mut sum, mut n) = (0.0, 0);
    for w in levels.windows(2) {
        for share in [0.3, 0.7] {
            let p = w[0] + share * (w[1] - w[0]);
            for i in 0..10 {
                let x = 0.09 * f64::from(i) * muscle.free_stroke(p);
                let table = model.force(Pressure::from_pascals(p), Length::from_metres(x), 0.0).newtons();
                sum += (table - muscle.quasi_static(p, x)).powi(2);
                n += 1;
            }
        }
    }
    Some(100.0 * (sum / f64::from(n)).sqrt() / blocked)
}

/// The rows until a time, s, as [`until`] takes them of the thesis's protocol.
fn before(recordings: &[Recording], seconds: f64) -> Vec<Recording> {
    let cut = |r: &Recording| {
        let rows = r.time.partition_point(|t| *t <= seconds);
        Recording {
            time: r.time[..rows].to_vec(),
            pressure: r.pressure[..rows].to_vec(),
            stroke: r.stroke[..rows].to_vec(),
            force: r.force.as_ref().map(|f| f[..rows].to_vec()),
            ..Recording { name: r.name.clone(), source: r.source.clone(), ..Recording::default() }
        }
    };
    recordings.iter().map(cut).filter(|r| r.len() > LEAST_ROWS).collect()
}

/// Both errors at all times, for a muscle without effects. The chosen campaign is for the table alone (`--for fit`).
pub fn after(spec: &Spec, bench: &BenchSpec) -> Result<Vec<After>, String> {
    let muscle = Muscle::new(spec.bench.muscle.clone());
    let description =
        MuscleDescription::parse(&spec.bench.muscle.description()).map_err(|e| e.to_string())?;
    let levels = campaigns::levels(&muscle);
    let budget = 60.0 * LAST;
    let mut engine = Engine::new(description.clone(), Rig::commanded(), Purpose::Fit, budget)
        .map_err(|e| e.to_string())?;
    simulate(&mut engine, &mut VirtualBench::new(bench), None).map_err(|e| e.to_string())?;
    let chosen = engine.recordings();
    let files =
        Bench::new(&spec.bench).run(&campaigns::thesis(&muscle, &levels)).map_err(|e| e.to_string())?;
    Ok((1..=(LAST / EVERY).round() as u32)
        .map(|n| {
            let minutes = EVERY * f64::from(n);
            let seconds = 60.0 * minutes;
            let thesis = until(files.iter().map(|f| (f.name.as_str(), f.rows.as_slice())), seconds);
            After {
                minutes,
                chosen: error(&before(chosen, seconds), &description, &muscle),
                thesis: error(&thesis, &description, &muscle),
            }
        })
        .collect())
}
