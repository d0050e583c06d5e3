//! The loop of a campaign: choose a step, record it, check it, update the estimates, until a stopping rule holds.

mod resume;
mod sink;

use std::path::Path;

use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Reader, Recording};
use pam_fit::checks;

use self::resume::resume;
use self::sink::{InMemory, OnDisk, Sink};
use crate::actuation::{Actuation, Ending, Reading};
use crate::bench::VirtualBench;
use crate::criteria::{REPEATS, TOP_SHARE};
use crate::engine::{Decision, Engine};
use crate::journal::{Chosen, Completion, Event, Journal, unix_seconds};
use crate::step::Step;
use crate::step_profile::StepProfile;
use crate::watch::{Limits, Spoiled, Watch};

/// One step of the campaign, as it was carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    /// Why it was chosen.
    pub chosen: Chosen,
    /// Its recording or table; empty where nothing was recorded.
    pub file: String,
    /// Number of rows of its recording; 0 where it recorded no rows, as for a check of the bench.
    pub rows: u64,
    /// Clock at its beginning and end, s.
    pub clock_s: (f64, f64),
    /// Attempts that were spoiled, and why.
    pub spoiled: Vec<Spoiled>,
    /// What it showed, as text.
    pub finding: String,
}

/// Who watches a campaign.
pub trait Observer {
    /// A step was chosen.
    fn chosen(&mut self, _chosen: &Chosen) {}
    /// A reading came.
    fn reading(&mut self, _reading: &Reading) {}
    /// A recording was spoiled and is repeated or left out.
    fn spoiled(&mut self, _step: &Step, _reason: Spoiled) {}
    /// A step is done.
    fn done(&mut self, _done: &Done) {}
    /// Whether the campaign is to be interrupted.
    fn stop(&self) -> bool {
        false
    }
}

/// No observer.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Alone;

impl Observer for Alone {}

/// How a campaign ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It is complete; why, in one sentence.
    Complete(String),
    /// It was interrupted; the same call continues it.
    Interrupted,
}

/// Bench time that must be left for an ended campaign to continue, s: less fits no step.
const LEAST_MORE_S: f64 = 60.0;

/// Readings as a recording.
#[must_use]
pub fn recording(name: &str, rows: &[Reading]) -> Recording {
    let column = |of: fn(&Reading) -> f64| rows.iter().map(of).collect::<Vec<f64>>();
    Recording {
        name: name.to_owned(),
        time: column(|r| r.time),
        pressure: column(|r| r.pressure),
        stroke: column(|r| r.stroke),
        force: Some(column(|r| r.force)),
        pressure_command: Some(column(|r| r.command)),
        ..Recording::default()
    }
}

fn read(path: &Path, muscle: &MuscleDescription) -> Result<Recording> {
    let read = Reader::of(muscle).file(path)?;
    read.into_iter()
        .next()
        .ok_or_else(|| Error::new(DataCode::RecordingEmpty, "the recording holds no rows").file(path))
}

/// Carries out a whole campaign on the virtual bench, without files; checks of the bench need a folder.
///
/// # Errors
/// What a diagnosis fails with.
pub fn simulate(engine: &mut Engine, bench: &mut VirtualBench, checks: Option<&Path>) -> Result<Vec<Done>> {
    let mut steps = Vec::new();
    let mut sink = InMemory { checks };
    go(engine, bench, &mut sink, &mut Alone, 0.0, &mut steps)?;
    Ok(steps)
}

/// Carries out a campaign in a folder, or continues the one that is there.
///
/// # Errors
/// What the device or the disk fails with; the muscle is then vented, and the same call continues the campaign.
pub fn run(
    engine: &mut Engine,
    actuation: &mut dyn Actuation,
    journal: &mut Journal,
    observer: &mut dyn Observer,
) -> Result<(Outcome, Vec<Done>)> {
    let muscle = engine.muscle().clone();
    let (mut steps, spent) = resume(engine, journal, &muscle)?;
    if let Some(clock) = journal.clock() {
        // How long the program was away; less than a second is none.
        let last = journal.events().iter().rev().find_map(|e| match e {
            Event::Begin { unix_s, .. } => Some(*unix_s),
            _ => None,
        });
        let away = last.map_or(1.0, |at| (unix_seconds().saturating_sub(at) as f64 - spent).max(1.0));
        actuation.set_clock(clock.max(last_time(engine)) + away);
    }
    // One that ended at its limit continues where the limit is higher now.
    let more = engine.budget() - spent > LEAST_MORE_S;
    if let Some(Event::Ended { reason, .. }) = journal.events().last()
        && !(more && reason.starts_with(crate::wording::TIME_IS_OVER))
    {
        return Ok((Outcome::Complete(reason.clone()), steps));
    }
    journal.write(Event::Begin {
        schema: "pam-campaign-journal/1".into(),
        muscle: muscle.name.clone(),
        unix_s: unix_seconds(),
        clock_s: actuation.clock(),
    })?;
    let mut sink = OnDisk { journal, muscle };
    let outcome = go(engine, actuation, &mut sink, observer, spent, &mut steps)?;
    Ok((outcome, steps))
}

fn last_time(engine: &Engine) -> f64 {
    engine.recordings().iter().filter_map(|r| r.time.last()).copied().fold(0.0, f64::max)
}

fn go(
    engine: &mut Engine,
    actuation: &mut dyn Actuation,
    sink: &mut dyn Sink,
    observer: &mut dyn Observer,
    mut spent: f64,
    steps: &mut Vec<Done>,
) -> Result<Outcome> {
    loop {
        if observer.stop() {
            return Ok(Outcome::Interrupted);
        }
        actuation.compute(true);
        let decision = engine.next(spent);
        actuation.compute(false);
        let chosen = match decision? {
            Decision::Stop(reason) => {
                sink.event(Event::Ended { reason: reason.clone(), clock_s: actuation.clock() })?;
                return Ok(Outcome::Complete(reason));
            }
            Decision::Step(chosen) => chosen,
        };
        observer.chosen(&chosen);
        sink.event(Event::Chosen(chosen.clone()))?;
        let begin = actuation.clock();
        let done = match chosen.step {
            Step::Check { check } => one_check(engine, actuation, sink, &chosen, check)?,
            _ => match one_step(engine, actuation, sink, observer, &chosen)? {
                Some(done) => done,
                None => return Ok(Outcome::Interrupted),
            },
        };
        spent += actuation.clock() - begin;
        let mut done = Done { clock_s: (begin, actuation.clock()), ..done };
        actuation.compute(true);
        let finding = engine.learn(spent);
        actuation.compute(false);
        done.finding = finding?;
        sink.event(Event::Finding { number: done.chosen.number, text: done.finding.clone() })?;
        observer.done(&done);
        steps.push(done);
    }
}

fn one_check(
    engine: &mut Engine,
    actuation: &mut dyn Actuation,
    sink: &mut dyn Sink,
    chosen: &Chosen,
    check: checks::Kind,
) -> Result<Done> {
    let (force, top) = (engine.places().blocked, engine.places().top);
    let name = format!("{:02}_{}.csv", chosen.number, check.file_name());
    let table = actuation.check(check, force, top)?;
    let path = table.map(|csv| sink.table(&name, &csv)).transpose()?.flatten();
    let end_s = actuation.clock();
    match path {
        Some(path) => {
            sink.event(Event::Checked { number: chosen.number, check, file: name.clone(), end_s })?;
            engine.add_check(check, path);
        }
        None => engine.leave_out(chosen.step),
    }
    let clock_s = (end_s, end_s);
    Ok(Done {
        chosen: chosen.clone(),
        file: name,
        rows: 0,
        clock_s,
        spoiled: Vec::new(),
        finding: String::new(),
    })
}

/// How one attempt ended.
enum Attempt {
    /// All steps are complete.
    Whole,
    /// A stop was requested.
    Stopped,
}

/// Records a step, repeated while it is spoiled; `None` where it was interrupted.
fn one_step(
    engine: &mut Engine,
    actuation: &mut dyn Actuation,
    sink: &mut dyn Sink,
    observer: &mut dyn Observer,
    chosen: &Chosen,
) -> Result<Option<Done>> {
    let (top, blocked) = (engine.places().top, engine.places().blocked);
    let limits = Limits {
        pressure: top / TOP_SHARE,
        force: engine.rig().force_max.unwrap_or(f64::MAX),
        stroke: engine.places().stroke_max,
    };
    let begin_s = actuation.clock();
    let mut spoiled = Vec::new();
    loop {
        // What an attempt showed may change the next one.
        let profile = chosen.step.profile(engine.places());
        let mut watch = Watch::new(limits, top, blocked);
        sink.begin(chosen.number, &chosen.step.name())?;
        let attempt = attempt(actuation, sink, observer, &profile, &mut watch);
        let end_s = actuation.clock();
        if !matches!(attempt, Ok(Attempt::Whole)) {
            let (file, rows) = sink.finish(Completion::Cut, watch.rows())?;
            sink.event(Event::Cut { number: chosen.number, file, rows })?;
            return attempt.map(|_| None);
        }
        match watch.judge(&chosen.step) {
            None => {
                let (file, rows) = sink.finish(Completion::Whole, watch.rows())?;
                sink.event(Event::Recorded {
                    number: chosen.number,
                    file: file.clone(),
                    rows,
                    begin_s,
                    end_s,
                })?;
                let recorded = sink.recording(&file, watch.rows())?;
                engine.add(chosen.step, Some(Recording { name: chosen.step.name(), ..recorded }));
                let clock_s = (begin_s, end_s);
                let finding = String::new();
                return Ok(Some(Done { chosen: chosen.clone(), file, rows, clock_s, spoiled, finding }));
            }
            Some(reason) => {
                let (file, rows) = sink.finish(Completion::Spoiled, watch.rows())?;
                sink.event(Event::Spoiled {
                    number: chosen.number,
                    file: file.clone(),
                    rows,
                    reason,
                    end_s,
                })?;
                let longest = watch.rows().iter().map(|r| r.stroke).fold(0.0, f64::max);
                engine.spoiled(&chosen.step, reason, longest);
                observer.spoiled(&chosen.step, reason);
                spoiled.push(reason);
                if spoiled.len() as u32 > REPEATS {
                    engine.leave_out(chosen.step);
                    let clock_s = (begin_s, end_s);
                    let finding = format!("Left out: {reason}.");
                    return Ok(Some(Done { chosen: chosen.clone(), file, rows, clock_s, spoiled, finding }));
                }
            }
        }
    }
}

fn attempt(
    actuation: &mut dyn Actuation,
    sink: &mut dyn Sink,
    observer: &mut dyn Observer,
    profile: &StepProfile,
    watch: &mut Watch,
) -> Result<Attempt> {
    let mut danger = None;
    let ending = actuation.perform(profile, &mut |reading| {
        observer.reading(reading);
        // The journal first: what the watch says of a row must not cost the row.
        if reading.recorded {
            sink.row(reading)?;
        }
        danger = watch.add(reading);
        Ok(danger.is_none() && !observer.stop())
    })?;
    match (danger, ending) {
        (Some(danger), _) => {
            Err(Error::new(DataCode::RecordingOutOfRange, format!("the muscle was vented: {danger}"))
                .help("find the cause; the same call continues the campaign"))
        }
        (None, Ending::Ended) => Ok(Attempt::Stopped),
        (None, Ending::Whole) => Ok(Attempt::Whole),
    }
}
