//! The ways to spend half an hour at the bench.

use super::Said;
use crate::generate::Trial as Made;
use crate::spec::Spec;
use pam_campaign::actuation::{Actuation, Reading};
use pam_campaign::analysis::{diagnosed, fitted};
use pam_campaign::bench::VirtualBench;
use pam_campaign::campaign::{recording, simulate};
use pam_campaign::engine::{Engine, Purpose};
use pam_campaign::menu::{menu, opening};
use pam_campaign::places::Places;
use pam_campaign::rig::Rig;
use pam_campaign::step::Step;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Recording;
use pam_diagnose::next_experiment::next_experiment;
use pam_diagnose::verdict::Considered;
use pam_fit::checks;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use virtual_bench::bench::Bench;
use virtual_bench::campaigns;
use virtual_bench::muscle::Muscle;
use virtual_bench::protocol::Protocol;
use virtual_bench::recording::{Columns, Recording as File, Row};
use virtual_bench::rng::Rng;

/// A way to record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The campaign that chooses its own steps.
    Chosen,
    /// Protocol C, interrupted after the same time; its checks of the bench are given to it.
    Complete,
    /// The same first steps, then steps of the same menu at random.
    Random,
    /// Protocol A, then what `host diagnose` proposes, interrupted after the same time.
    Proposed,
}

impl Method {
    /// All.
    pub const ALL: [Self; 4] = [Self::Chosen, Self::Complete, Self::Random, Self::Proposed];

    /// As text.
    pub const fn description(self) -> &'static str {
        match self {
            Self::Chosen => "steps chosen by expected information",
            Self::Complete => "protocol C for the same time, with its checks",
            Self::Random => "the same menu at random",
            Self::Proposed => "protocol A, then single proposals",
        }
    }
}

/// What a method recorded.
#[derive(Debug)]
pub struct Recorded {
    pub recordings: Vec<Recording>,
    checks: Vec<PathBuf>,
    bench_s: f64,
    choosing_s: f64,
    ended: String,
    /// Holds the checks' files.
    _folder: Scratch,
}

/// A folder that is removed with this.
#[derive(Debug)]
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Result<Self, String> {
        let path = std::env::temp_dir().join(format!("pam-campaign-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(|e| e.to_string())?;
        Ok(Self(path))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A temporary folder that remains is harmless.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn message(e: pam_data::error::Error) -> String {
    e.to_string()
}

/// Records for so much bench time.
pub fn record(method: Method, spec: &Spec, made: &Made, bench_s: f64) -> Result<Recorded, String> {
    let folder = Scratch::new(&format!("{}-{method:?}", spec.id))?;
    match method {
        Method::Chosen => chosen(made, bench_s, folder),
        Method::Random => random(spec, made, bench_s, folder),
        Method::Complete => {
            let files = made.recordings.iter().map(|f| (f.name.as_str(), f.rows.as_slice()));
            let checks =
                made.checks.iter().map(|c| written(&folder.0, c.name, &c.csv)).collect::<Result<_, _>>()?;
            Ok(Recorded {
                recordings: until(files, bench_s),
                checks,
                bench_s,
                choosing_s: 0.0,
                ended: String::new(),
                _folder: folder,
            })
        }
        Method::Proposed => proposed(spec, made, bench_s, folder),
    }
}

/// Asks the diagnosis about what was recorded.
pub fn ask(method: Method, made: &Made, recorded: &Recorded) -> Result<Said, String> {
    let muscle = MuscleDescription::parse(&made.description).map_err(message)?;
    let d = diagnosed(&recorded.recordings, &muscle, &recorded.checks).map_err(message)?;
    let sets = d
        .missing
        .iter()
        .map(|m| std::iter::once(&m.effect).chain(&m.confusable_with).cloned().collect())
        .collect();
    let why_not = |c: &Considered| format!("{} {:.3} {:?}", c.effect, c.gain, c.why_not);
    Ok(Said {
        method,
        not_named: d
            .considered
            .iter()
            .filter(|c| made.truth.effects.iter().any(|e| e.name == c.effect))
            .map(why_not)
            .collect(),
        sets,
        rows: recorded.recordings.iter().map(Recording::len).sum(),
        bench_s: recorded.bench_s,
        choosing_s: recorded.choosing_s,
        ended: recorded.ended.clone(),
        steps: recorded.recordings.iter().map(|r| r.name.clone()).collect(),
    })
}

/// Writes what was recorded, so that it can be diagnosed by hand.
pub fn keep(folder: &Path, made: &Made, recorded: &Recorded) -> Result<(), String> {
    let mut files = vec![("muscle.toml".to_owned(), made.description.clone())];
    for (number, r) in recorded.recordings.iter().enumerate() {
        let force = r.force.as_deref().unwrap_or(&[]);
        let rows = (0..r.len()).map(|i| Row {
            time: r.time[i],
            pressure: r.pressure[i],
            stroke: r.stroke[i],
            force: force.get(i).copied().unwrap_or(f64::NAN),
            ..Row::default()
        });
        let file = File { name: String::new(), rows: rows.collect() };
        files.push((format!("{number:02}_{}.csv", r.name), file.csv(Columns::default())));
    }
    std::fs::create_dir_all(folder.join("checks")).map_err(|e| e.to_string())?;
    for (name, text) in files {
        std::fs::write(folder.join(name), text).map_err(|e| e.to_string())?;
    }
    for check in &recorded.checks {
        let name = check.file_name().unwrap_or_default();
        std::fs::copy(check, folder.join("checks").join(name)).map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn rig() -> Rig {
    Rig { checks: true, ..Rig::commanded() }
}

fn chosen(made: &Made, bench_s: f64, folder: Scratch) -> Result<Recorded, String> {
    let muscle = MuscleDescription::parse(&made.description).map_err(message)?;
    let mut engine = Engine::new(muscle, rig(), Purpose::Both, bench_s).map_err(message)?;
    let mut bench = VirtualBench::new(&made.truth.bench);
    let steps = simulate(&mut engine, &mut bench, Some(&folder.0)).map_err(message)?;
    let checks = steps.iter().filter(|d| matches!(d.chosen.step, Step::Check { .. }));
    Ok(Recorded {
        recordings: engine.recordings().to_vec(),
        checks: checks.map(|d| folder.0.join(&d.file)).collect(),
        bench_s: bench.clock(),
        choosing_s: steps.iter().map(|d| d.chosen.choosing_s).fold(0.0, f64::max),
        ended: steps.last().map_or(String::new(), |d| d.chosen.why.clone()),
        _folder: folder,
    })
}

/// The first steps, then steps drawn without regard to their information.
fn random(spec: &Spec, made: &Made, bench_s: f64, folder: Scratch) -> Result<Recorded, String> {
    let muscle = MuscleDescription::parse(&made.description).map_err(message)?;
    let mut places = Places::new(&muscle, &rig()).map_err(message)?;
    let mut bench = VirtualBench::new(&made.truth.bench);
    let mut r = Rng::stream(spec.seed, "random menu");
    let (mut recordings, mut checks) = (Vec::new(), Vec::new());
    let mut made_checks: Vec<checks::Kind> = Vec::new();
    let mut number = 0;
    loop {
        let begin = opening(&rig());
        let step = if let Some((first, _)) = begin.get(number) {
            *first
        } else {
            let left = bench_s - bench.clock();
            let fits: Vec<Step> = menu(&places, &rig())
                .into_iter()
                .filter(|s| s.seconds(&places) <= left)
                .filter(|s| !matches!(s, Step::Check { check } if made_checks.contains(check)))
                .collect();
            if fits.is_empty() {
                break;
            }
            fits[r.index(fits.len())]
        };
        number += 1;
        if let Step::Check { check } = step {
            if let Some(csv) = bench.check(check, places.blocked, places.top).map_err(message)? {
                checks.push(written(&folder.0, check.file_name(), &csv)?);
            }
            made_checks.push(check);
            continue;
        }
        let mut rows: Vec<Reading> = Vec::new();
        let mut take = |r: &Reading| {
            if r.recorded {
                rows.push(*r);
            }
            Ok(true)
        };
        bench.perform(&step.profile(&places), &mut take).map_err(message)?;
        let recorded = recording(&step.name(), &rows);
        match step {
            Step::BlockedRamp => places.learn_ramp(&recorded),
            Step::Survey { .. } => places.learn_survey(&recorded),
            Step::Loops { .. } => places.learn_strokes(&recorded),
            _ => {}
        }
        recordings.push(recorded);
        if number >= begin.len()
            && let Some(findings) = fitted(&recordings, &muscle)
        {
            places.learn_model(findings.model);
        }
    }
    let ended = String::new();
    Ok(Recorded { recordings, checks, bench_s: bench.clock(), choosing_s: 0.0, ended, _folder: folder })
}

fn proposed(spec: &Spec, made: &Made, bench_s: f64, folder: Scratch) -> Result<Recorded, String> {
    let muscle = MuscleDescription::parse(&made.description).map_err(message)?;
    let clean = Muscle::new(spec.bench.muscle.clone());
    let levels = campaigns::levels(&clean);
    let mut bench = Bench::new(&made.truth.bench);
    let mut files = bench.run(&campaigns::classic(&clean, &levels)).map_err(|e| e.to_string())?;
    let named = |f: &virtual_bench::recording::Recording| (f.name.clone(), f.rows.clone());
    let first: Vec<(String, Vec<Row>)> = files.iter().map(named).collect();
    let recordings = until(first.iter().map(|f| (f.0.as_str(), f.1.as_slice())), bench_s);
    let d = diagnosed(&recordings, &muscle, &[]).map_err(message)?;
    if let Some(findings) = fitted(&recordings, &muscle) {
        let (low, high) = (levels[0], levels[levels.len() - 1]);
        let next = next_experiment(&d, &findings.model, low, high).map_err(message)?;
        if let Some(Ok(next)) = next.map(|n| Protocol::from_toml(&n.protocol)) {
            files.extend(bench.run(&next).map_err(|e| e.to_string())?);
        }
    }
    let all: Vec<(String, Vec<Row>)> = files.iter().map(named).collect();
    Ok(Recorded {
        recordings: until(all.iter().map(|f| (f.0.as_str(), f.1.as_slice())), bench_s),
        checks: Vec::new(),
        bench_s: bench.clock().min(bench_s),
        choosing_s: 0.0,
        ended: String::new(),
        _folder: folder,
    })
}

fn written(folder: &Path, name: &str, csv: &str) -> Result<PathBuf, String> {
    let path = folder.join(format!("{name}.csv"));
    std::fs::write(&path, csv).map_err(|e| e.to_string())?;
    Ok(path)
}

/// Rows that a recording must have more than, to be used.
pub const LEAST_ROWS: usize = 20;

/// What the bench recorded until a time, s.
pub fn until<'a>(files: impl Iterator<Item = (&'a str, &'a [Row])>, seconds: f64) -> Vec<Recording> {
    let reading = |r: &Row| Reading {
        time: r.time,
        pressure: r.pressure,
        command: r.command,
        stroke: r.stroke,
        force: r.force,
        recorded: true,
    };
    files
        .map(|(name, rows)| {
            let kept: Vec<Reading> = rows.iter().filter(|r| r.time <= seconds).map(reading).collect();
            recording(name, &kept)
        })
        .filter(|r| r.len() > LEAST_ROWS)
        .collect()
}
