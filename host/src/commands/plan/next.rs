//! The next recordings of a muscle, best first, for people: the choice of `host campaign` without hardware.

use std::fmt::Write as _;
use std::path::Path;

use super::Arguments;
use crate::console::Console;
use crate::documents::{bench, text};
use pam_campaign::analysis::names;
use pam_campaign::engine::{Engine, Plan, PlannedStep};
use pam_campaign::instructions::{instructions, protocol};
use pam_campaign::rig::Rig;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_data::recording::{Import, Reader};
use pam_fit::checks;

/// The page of a plan.
const PAGE: &str = "plan.md";

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let Some(path) = &arguments.muscle else {
        return Err(Error::new(DataCode::CallInvalid, "the muscle's description is missing")
            .help("give --muscle M.toml"));
    };
    let muscle = MuscleDescription::read(path)?;
    let rig = match &arguments.rig {
        Some(path) => Rig::read(path)?,
        None => Rig { checks: true, ..Rig::commanded() },
    };
    let import = arguments.import.as_ref().map(Import::read).transpose()?;
    let recordings = match arguments.files.as_slice() {
        [] => Vec::new(),
        files => {
            let campaign = Reader::of(&muscle).import(import.as_ref()).campaign(files)?;
            campaign.warnings.iter().for_each(|warning| console.warning(warning));
            campaign.recordings
        }
    };
    let checks = arguments
        .check
        .iter()
        .map(|file| Ok((checks::Kind::of(file)?, file.clone())))
        .collect::<Result<Vec<_>>>()?;
    let (purpose, purpose_name) = arguments.purpose.purpose();
    let count = recordings.len();
    let engine = Engine::of_recordings(muscle, rig, purpose, recordings, checks)?;
    let plan = engine.plan(usize::from(arguments.steps), 60.0 * arguments.minutes);
    let document = document(&engine, &plan, purpose_name, count);
    if let Some(folder) = &arguments.output {
        write(&engine, &plan, &document, folder)?;
    }
    if let Some(path) = &arguments.json {
        write_whole(path, format!("{}\n", text(&document)?).as_bytes())?;
    }
    if arguments.json.as_deref() != Some(Path::new("-")) {
        for step in &document.steps {
            console.result(format!("{:2}. {} ({:.0} s). {}", step.number, step.what, step.seconds, step.why));
        }
        console.result(&plan.ends);
        if let Some(folder) = &arguments.output {
            console.result(format!("instructions: {}", folder.join(PAGE).display()));
        }
    }
    Ok(())
}

/// The name of a step's file, without extension.
fn file_name(number: usize, planned: &PlannedStep) -> String {
    format!("{number:02}_{}", planned.step.name())
}

fn document<'a>(
    engine: &'a Engine,
    plan: &'a Plan,
    purpose: &'static str,
    recordings: usize,
) -> bench::PlanOfRecordings<'a> {
    let steps = plan.steps.iter().enumerate().map(|(at, p)| {
        let name = file_name(at + 1, p);
        let protocol = protocol(&p.step, engine.places(), &name).map(|_| format!("{name}.toml"));
        bench::PlannedStep {
            number: at + 1,
            name: p.step.name(),
            what: p.step.description(),
            why: p.why.clone(),
            seconds: p.seconds,
            table_nats: p.gain.table,
            effect_nats: p.gain.set,
            unseen_nats: p.gain.unseen,
            predicted_error_N: (p.gain.error_after > 0.0).then_some(p.gain.error_after),
            protocol,
            instructions: instructions(&p.step, engine.places()),
        }
    });
    bench::PlanOfRecordings {
        schema: "pam-plan-protocols/1",
        muscle: &engine.muscle().name,
        purpose,
        recordings,
        ended_by: &plan.ends,
        predicted_error_N: plan.error.filter(|e| e.is_finite()),
        possible: engine.diagnosis().map(names).unwrap_or_default(),
        steps: steps.collect(),
    }
}

/// Writes the page and the protocols. Protocols of an earlier plan are removed: a folder holds one plan.
fn write(engine: &Engine, plan: &Plan, document: &bench::PlanOfRecordings<'_>, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::unwritable(folder, &e))?;
    let there = std::fs::read_dir(folder).map_err(|e| Error::unreadable(folder, &e))?;
    let names: Vec<_> = there.filter_map(|f| Some(f.ok()?.file_name())).collect();
    if !names.is_empty() && !names.iter().any(|n| n == PAGE) {
        return Err(Error::new(DataCode::CallInvalid, "the folder holds other files than a plan")
            .file(folder)
            .help("choose another folder with -o"));
    }
    for name in names.iter().filter(|n| is_of_a_plan(&n.to_string_lossy())) {
        let old = folder.join(name);
        std::fs::remove_file(&old).map_err(|e| Error::unwritable(&old, &e))?;
    }
    let mut page = format!("# Plan for {}\n\n", document.muscle);
    if !document.possible.is_empty() {
        let _ = writeln!(page, "The recordings so far leave possible: {}.\n", document.possible.join(", "));
    }
    for (planned, step) in plan.steps.iter().zip(&document.steps) {
        let _ = writeln!(page, "## {}. {} ({:.0} s)\n\n{}\n", step.number, step.what, step.seconds, step.why);
        for (at, line) in step.instructions.iter().enumerate() {
            let _ = writeln!(page, "{}. {line}", at + 1);
        }
        let name = file_name(step.number, planned);
        if let Some(protocol) = protocol(&planned.step, engine.places(), &name) {
            let file = format!("{name}.toml");
            let toml =
                protocol.to_toml().map_err(|e| Error::new(DataCode::ProtocolInvalid, e.to_string()))?;
            write_whole(&folder.join(&file), toml.as_bytes())?;
            let _ = writeln!(page, "\nThe same as a protocol file: `{file}`.");
        }
        page.push('\n');
    }
    let _ = writeln!(page, "{}", document.ended_by);
    write_whole(&folder.join(PAGE), page.as_bytes())
}

/// `NN_NAME.toml`, as a plan names its protocols.
fn is_of_a_plan(name: &str) -> bool {
    let digits = name.bytes().take_while(u8::is_ascii_digit).count();
    digits >= 2 && name[digits..].starts_with('_') && name.ends_with(".toml")
}
