//! `host campaign`: the program records, checks, fits and diagnoses automatically.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};

use super::interrupt::interrupts;
use super::port::PortOption;
use super::recording_files::positive;
use crate::campaign::page::page;
use crate::campaign::results::{RunFacts, document, pages, table};
use crate::campaign::rigging::{Rigging, emulated, real, tracked};
use crate::campaign::watching::Watching;
use crate::console::Console;
use crate::documents::text;
use crate::program_name::in_page;
use pam_campaign::campaign::{Done, Outcome, run};
use pam_campaign::engine::{Engine, Purpose};
use pam_campaign::journal::Journal;
use pam_campaign::rig::Rig;
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::write_whole;
use pam_device::emulated::Kind;
use pam_device::error::DeviceCode;
use pam_device::run::vent;
use pam_fit::checks;

/// Arguments of `host campaign`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Examples:\n  \
    host campaign --emulate mini -o campaign --minutes 10\n  \
    host campaign --muscle m.toml --port /dev/ttyACM0 --rig rig.toml -o new\n\n\
    The folder receives every recording, the log journal.jsonl, table.pam, campaign.json, report.html, fit.html and \
    diagnosis.html. The muscle is vented between two steps, at the end, on any error and on Ctrl-C. The same call continues a \
    campaign that was interrupted.")]
pub struct Arguments {
    /// The muscle's description; with --emulate that of the bench's muscle.
    #[arg(long, value_name = "M.toml", required_unless_present = "emulate")]
    muscle: Option<PathBuf>,
    #[command(flatten)]
    port: PortOption,
    /// Run on an emulated controller with a muscle of the virtual bench: mini, contractile, push or random:SEED.
    #[arg(long, value_name = "NAME", conflicts_with = "port")]
    emulate: Option<String>,
    /// Folder of the campaign; an interrupted one continues.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Bench time that is allowed, min.
    #[arg(long, value_name = "N", default_value_t = 30.0, allow_negative_numbers = true)]
    minutes: f64,
    /// What the campaign is for.
    #[arg(long = "for", value_enum, value_name = "PURPOSE", default_value_t = For::Both)]
    purpose: For,
    /// What the rig can do. By default the length is held; the virtual bench has an axis that the program moves.
    #[arg(long, value_name = "rig.toml")]
    rig: Option<PathBuf>,
    /// Recordings of an earlier campaign of the same muscle: changed.html says what has changed since.
    #[arg(long, value_name = "FOLDER")]
    reference: Option<PathBuf>,
    /// Where the emulated firmware runs: in this process, or in QEMU.
    #[arg(long, value_name = "WHERE", value_parser = ["native", "qemu"], requires = "emulate")]
    on: Option<String>,
    /// Largest ratio of emulated to real time, for the emulated controller: up to 100.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 20.0,
        requires = "emulate",
        allow_negative_numbers = true
    )]
    speed: f64,
    /// Print campaign.json.
    #[arg(long)]
    json: bool,
}

/// Most device seconds in a second. At 200, three of eight muscles of the virtual bench did not reach their pressure in time; at 100 these
/// three did.
const FASTEST: f64 = 100.0;

/// What recordings are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum For {
    /// The force table.
    Fit,
    /// What the model leaves out.
    Diagnosis,
    /// Both.
    Both,
}

impl For {
    /// The purpose, and its name in documents.
    pub(super) const fn purpose(self) -> (Purpose, &'static str) {
        match self {
            Self::Fit => (Purpose::Fit, "fit"),
            Self::Diagnosis => (Purpose::Diagnosis, "diagnosis"),
            Self::Both => (Purpose::Both, "both"),
        }
    }
}

impl Arguments {
    /// Runs the campaign, or continues it.
    ///
    /// # Errors
    /// A muscle without a pressure limit, a device that fails, a disk that is full. The muscle is vented in every case.
    pub fn run(self, console: &Console) -> Result<()> {
        positive([("--minutes", Some(self.minutes)), ("--speed", Some(self.speed))])?;
        if self.speed > FASTEST {
            return Err(Error::new(DataCode::CallInvalid, format!("--speed is at most {FASTEST}"))
                .value(self.speed.to_string())
                .help("a faster controller receives its setpoints too late from this program"));
        }
        let interrupted = interrupts()?;
        // The log is opened before any device moves: a folder that is in use, or is none, costs nothing then.
        let mut journal = Journal::open(&self.output)?;
        let continued = !journal.events().is_empty();
        let mut rigging = self.rigging(continued, &interrupted, console)?;
        console
            .note(format!("{}; Ctrl-C vents the muscle, and the same call continues", rigging.description));
        let (purpose, purpose_name) = self.purpose.purpose();
        let mut engine =
            Engine::new(rigging.muscle.clone(), rigging.rig.clone(), purpose, 60.0 * self.minutes)?;
        if let Some(limitation) = engine.places().limitation() {
            console.note(limitation);
        }
        let mut watching = Watching::new(console, interrupted, 60.0 * self.minutes, 0.0);
        let outcome = run(&mut engine, &mut rigging.controller, &mut journal, &mut watching);
        drop(watching);
        // Vented already where the run ended in order; a second time does no harm, and covers errors of the program.
        // What another program runs is left alone.
        let foreign = outcome.as_ref().is_err_and(|error| error.code() == DeviceCode::DeviceInUse);
        let vented = if foreign { Ok(()) } else { vent(rigging.controller.client()).map(drop) };
        let (outcome, steps) = outcome?;
        vented?;
        let (complete, reason) = match outcome {
            Outcome::Complete(reason) => (true, reason),
            Outcome::Interrupted => {
                console.note("interrupted; the muscle is vented; the same call continues it");
                (false, "The campaign was interrupted; the same call continues it.".to_owned())
            }
        };
        let facts = RunFacts {
            controller: &rigging.description.clone(),
            purpose: purpose_name,
            minutes: self.minutes,
            complete,
            ended_by: &reason,
            tracking: Vec::new(),
        };
        self.results(&mut engine, &mut rigging, &steps, facts, console)
    }

    fn rigging(&self, continued: bool, interrupted: &Arc<AtomicBool>, console: &Console) -> Result<Rigging> {
        let rig = self.rig.as_deref().map(Rig::read).transpose()?;
        let only = match self.on.as_deref() {
            Some("native") => Some(Kind::Native),
            Some("qemu") => Some(Kind::Qemu),
            _ => None,
        };
        match (&self.emulate, &self.muscle) {
            (Some(name), muscle) => emulated(name, muscle.as_deref(), rig, (only, self.speed), &self.output),
            (None, Some(muscle)) => real(&self.port, muscle, rig, continued, interrupted, console),
            (None, None) => Err(Error::new(DataCode::CallInvalid, "the muscle's description is missing")
                .help("give --muscle M.toml")),
        }
    }

    fn results(
        &self,
        engine: &mut Engine,
        rigging: &mut Rigging,
        steps: &[Done],
        mut facts: RunFacts<'_>,
        console: &Console,
    ) -> Result<()> {
        if facts.complete && engine.findings().is_some() {
            engine.diagnose()?;
        }
        let table = table(engine, &self.output)?;
        facts.tracking = match &table {
            Some(table) if facts.complete => tracked(rigging, table)?,
            _ => Vec::new(),
        };
        pages(engine, &self.output)?;
        let document = document(engine, steps, &facts);
        let json = text(&document)?;
        write_whole(&self.output.join("campaign.json"), format!("{json}\n").as_bytes())?;
        let report = self.output.join("report.html");
        write_whole(&report, in_page(page(engine, steps, &document).html()).as_bytes())?;
        if let (Some(before), true) = (&self.reference, facts.complete) {
            self.changed(engine, before, console)?;
        }
        if self.json {
            console.result(json);
        } else {
            console.result(facts.ended_by);
            if let Some(t) = &document.table {
                console.result(format!(
                    "table: deadband {:.1} kPa, blocked force {:.1} N, mean error {:.2} % of it, in {}",
                    t.deadband_kPa,
                    t.blocked_force_N,
                    t.mean_error_pct,
                    self.output.join("table.pam").display()
                ));
            }
            if let Some(d) = &document.diagnosis {
                let names = if d.possible.is_empty() { "nothing".to_owned() } else { d.possible.join(", ") };
                console.result(format!("diagnosis: {}; possible: {names}", d.verdict));
            }
            console.result(format!("page with pictures: {}", report.display()));
        }
        Ok(())
    }

    /// What has changed since an earlier campaign, by `host diagnose --reference`.
    fn changed(&self, engine: &Engine, before: &Path, console: &Console) -> Result<()> {
        let mut earlier: Vec<PathBuf> = std::fs::read_dir(before)
            .map_err(|e| Error::unreadable(before, &e))?
            .filter_map(|f| Some(f.ok()?.path()))
            .filter(|p| {
                let name = p.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                let check = checks::Kind::ALL.iter().any(|c| name.contains(c.file_name()));
                name.ends_with(".csv") && !check
            })
            .collect();
        earlier.sort();
        let now = engine.recordings().iter().map(|r| r.source.clone().into_os_string());
        let report = self.output.join("changed.html").into_os_string();
        let mut arguments = vec!["diagnose".into(), "--report".into(), report];
        if let Some(muscle) = &self.muscle {
            arguments.extend(["--muscle".into(), muscle.clone().into_os_string()]);
        }
        arguments.extend(now);
        arguments.push("--reference".into());
        arguments.extend(earlier.into_iter().map(PathBuf::into_os_string));
        super::diagnose::Arguments::of(arguments)?.run(console)
    }
}
