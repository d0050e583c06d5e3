//! The virtual bench as a rig: whole campaigns in a second, for trials and plans.

use pam_data::error::{DataCode, Error, Result};
use pam_fit::checks::Kind;
use pam_protocol::{Place, Protocol, Step as BenchStep};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::checks;

use crate::actuation::{Actuation, Ending, Reading};
use crate::criteria::SAMPLE_HZ;
use crate::step_profile::{Segment, StepProfile};

/// A muscle on the virtual bench.
#[derive(Debug)]
pub struct VirtualBench {
    spec: BenchSpec,
    bench: Bench,
    ahead: f64,
    command: f64,
    stroke: f64,
}

/// Samples between two checks of the force while a motion may end early.
const LOOK: f64 = 3.0;

impl VirtualBench {
    /// Mounts a muscle.
    #[must_use]
    pub fn new(spec: &BenchSpec) -> Self {
        Self { spec: spec.clone(), bench: Bench::new(spec), ahead: 0.0, command: 0.0, stroke: 0.0 }
    }

    /// The bench, for what follows a campaign.
    pub fn bench(&mut self) -> &mut Bench {
        &mut self.bench
    }

    /// Lets the bench do one thing and gives its readings.
    fn act(&mut self, step: BenchStep, recorded: bool) -> Result<Vec<Reading>> {
        let file = BenchStep::File { name: "rows".into() };
        let protocol = Protocol { name: "step".into(), sample_hz: SAMPLE_HZ, step: vec![file, step] };
        let files = self
            .bench
            .run(&protocol)
            .map_err(|e| Error::new(DataCode::ProtocolInvalid, format!("the bench refuses a step: {e}")))?;
        let rows = files.into_iter().flat_map(|f| f.rows);
        Ok(rows
            .map(|r| Reading {
                time: r.time + self.ahead,
                pressure: r.pressure,
                command: r.command,
                stroke: r.stroke,
                force: r.force,
                recorded,
            })
            .collect())
    }

    fn segment(
        &mut self,
        segment: &Segment,
        recorded: bool,
        each: &mut dyn FnMut(&Reading) -> Result<bool>,
    ) -> Result<bool> {
        match *segment {
            Segment::Travel { to, speed, until_force } => self.travel(to, speed, until_force, recorded, each),
            Segment::Ramp { to, rate } => {
                self.command = to;
                let step =
                    BenchStep::Pressure { to_kpa: to * 1e-3, rate_kpa_s: Some(rate * 1e-3), settle_s: 0.0 };
                handed(&self.act(step, recorded)?, each)
            }
            Segment::Hold { seconds } => handed(&self.act(BenchStep::Hold { seconds }, recorded)?, each),
            Segment::Vented { seconds } => {
                (self.command, self.stroke) = (0.0, 0.0);
                let step = if recorded { BenchStep::Tare { seconds } } else { BenchStep::Rest { seconds } };
                let rows = self.act(step, recorded)?;
                // What the bench does not record is not reported.
                if recorded { handed(&rows, each) } else { Ok(true) }
            }
        }
    }

    fn travel(
        &mut self,
        to: f64,
        speed: f64,
        until_force: Option<f64>,
        recorded: bool,
        each: &mut dyn FnMut(&Reading) -> Result<bool>,
    ) -> Result<bool> {
        let piece = if until_force.is_some() { speed * LOOK / SAMPLE_HZ } else { f64::INFINITY };
        while (to - self.stroke).abs() > 1e-9 {
            let way = (to - self.stroke).clamp(-piece, piece);
            self.stroke += way;
            let place = Place { mm: Some(self.stroke * 1e3), ..Place::default() };
            let rows = self.act(BenchStep::Move { to: place, speed_mm_s: speed * 1e3 }, recorded)?;
            if !handed(&rows, each)? {
                return Ok(false);
            }
            let free = until_force.is_some_and(|least| mean_force(&rows) <= least);
            if free && self.stroke > 0.0 {
                break;
            }
        }
        Ok(true)
    }
}

fn handed(rows: &[Reading], each: &mut dyn FnMut(&Reading) -> Result<bool>) -> Result<bool> {
    for row in rows {
        if !each(row)? {
            return Ok(false);
        }
    }
    Ok(true)
}

fn mean_force(rows: &[Reading]) -> f64 {
    if rows.is_empty() {
        return f64::INFINITY;
    }
    rows.iter().map(|r| r.force).sum::<f64>() / rows.len() as f64
}

impl Actuation for VirtualBench {
    fn clock(&self) -> f64 {
        self.bench.clock() + self.ahead
    }

    fn set_clock(&mut self, seconds: f64) {
        self.ahead = seconds - self.bench.clock();
    }

    fn perform(
        &mut self,
        profile: &StepProfile,
        each: &mut dyn FnMut(&Reading) -> Result<bool>,
    ) -> Result<Ending> {
        let mut ending = Ending::Whole;
        let mut failed = None;
        for (segment, recorded) in &profile.segments {
            match self.segment(segment, *recorded, each) {
                Ok(true) => {}
                Ok(false) => {
                    ending = Ending::Ended;
                    break;
                }
                Err(e) => {
                    failed = Some(e);
                    break;
                }
            }
        }
        if ending == Ending::Ended || failed.is_some() {
            (self.command, self.stroke) = (0.0, 0.0);
            self.act(BenchStep::Rest { seconds: 0.0 }, false)?;
        }
        failed.map_or(Ok(ending), Err)
    }

    fn check(&mut self, check: Kind, force: f64, pressure: f64) -> Result<Option<String>> {
        let made = checks::all(&self.spec, force, pressure, self.bench.clock());
        let seconds = crate::step::check_seconds(check);
        self.act(BenchStep::Rest { seconds }, false)?;
        Ok(made.into_iter().find(|c| c.name == check.file_name()).map(|c| c.csv))
    }
}
