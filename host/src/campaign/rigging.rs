//! The controller of a campaign and what moves its muscle's free end.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use model_core::image;
use model_core::link::endpoints::{ClearFault, GetFaults, GetSettings, GetStatus, SetSettings};
use model_core::link::messages::{Fault, Side, State};
use pam_campaign::controller::{Controller, MakeCheck};
use pam_campaign::prompt::Prompt;
use pam_campaign::rig::{Axis as RigAxis, Rig};
use pam_campaign::stroke_axis::{BAUD, Line, NoAxis, StrokeAxis};
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_device::emulated::{Axis, Emulated, Kind, Stand};
use pam_device::{Client, tables};
use pam_fit::table_file::TableFile;
use virtual_bench::bench::BenchSpec;
use virtual_bench::checks;

use crate::commands::port::PortOption;
use crate::console::Console;
use crate::demo::campaign::muscle;
use crate::demo::tracking::{Law, Task, choose, track};

/// Most ticks without a host that the firmware's settings allow while a mode runs, and while the device is armed.
const LONGEST_SILENCE: u32 = 60_000;
const LONGEST_ARMED_SILENCE: u32 = 3_600_000;

/// Time beyond the silence of a host until its fault shows.
const MARGIN: Duration = Duration::from_secs(2);
/// Time between two checks of the state of a controller.
const POLL: Duration = Duration::from_millis(50);

/// Everything that carries out steps.
pub(crate) struct Rigging {
    pub(crate) controller: Controller,
    pub(crate) rig: Rig,
    pub(crate) muscle: MuscleDescription,
    /// Where the firmware runs, as text.
    pub(crate) description: String,
    /// The axis of the virtual bench, and the board that lives as long as this.
    pub(crate) emulated: Option<(Emulated, Axis)>,
}

/// An emulated controller with a muscle of the virtual bench on a commanded axis.
pub(crate) fn emulated(
    name: &str,
    description: Option<&Path>,
    rig: Option<Rig>,
    (only, speed): (Option<Kind>, f64),
    folder: &Path,
) -> Result<Rigging> {
    let spec = muscle(name)?;
    let bench = BenchSpec::laboratory(spec.clone(), 1);
    let muscle = match description {
        Some(path) => MuscleDescription::read(path)?,
        None => {
            std::fs::create_dir_all(folder).map_err(|e| Error::unwritable(folder, &e))?;
            let path = folder.join("muscle.toml");
            write_whole(&path, spec.description().as_bytes())?;
            MuscleDescription::read(&path)?
        }
    };
    let mut rig = rig.unwrap_or_else(|| Rig { checks: true, ..Rig::commanded() });
    if let Some(axis) = not_emulated(rig.axis) {
        return Err(Error::new(DataCode::CallInvalid, format!("the virtual bench has no {axis}"))
            .help("with --emulate, write axis = \"commanded\" or \"held\" in rig.toml"));
    }
    let axis = Axis::default();
    let emulated = Emulated::start(Stand::commanded(bench.clone(), axis.clone()), only, speed)?;
    let mut client = Client::open(emulated.address())?;
    allow_silence(&mut client, speed)?;
    limit(&mut rig, &mut client)?;
    let made: MakeCheck = Box::new(move |check, force, pressure, clock| {
        let made = checks::all(&bench, force, pressure, clock);
        Ok(made.into_iter().find(|c| c.name == check.file_name()).map(|c| c.csv))
    });
    let description = emulated.description();
    let controller = Controller::new(client, Box::new(axis.clone()), made);
    Ok(Rigging { controller, rig, muscle, description, emulated: Some((emulated, axis)) })
}

/// What the virtual bench does not have of a rig with this axis.
fn not_emulated(axis: RigAxis) -> Option<&'static str> {
    match axis {
        RigAxis::Weight => Some("hanging weight"),
        RigAxis::Pair => Some("second muscle"),
        _ => None,
    }
}

/// Allows an emulated host to be silent as long as a real one: the watch counts device time, which goes so much faster, and twice as fast
/// again after a pause of a busy machine, which may last as long.
pub(crate) fn allow_silence(client: &mut Client, speed: f64) -> Result<()> {
    let mut settings = client.call::<GetSettings>(&())?;
    let faster = (4.0 * speed).ceil().max(1.0) as u32;
    let watch = &mut settings.watch;
    watch.host_silence_ticks = watch.host_silence_ticks.saturating_mul(faster).min(LONGEST_SILENCE);
    watch.armed_silence_ticks = watch.armed_silence_ticks.saturating_mul(faster).min(LONGEST_ARMED_SILENCE);
    client.call_once::<SetSettings>(&settings).map(drop)
}

/// A controller at a port, on the rig that is described.
pub(crate) fn real(
    port: &PortOption,
    description: &Path,
    rig: Option<Rig>,
    continued: bool,
    interrupted: &Arc<AtomicBool>,
    console: &Console,
) -> Result<Rigging> {
    let mut rig = rig.unwrap_or_default();
    let muscle = MuscleDescription::read(description)?;
    let mut client = port.connect(console)?;
    if continued {
        clear_silence(&mut client, console)?;
    }
    limit(&mut rig, &mut client)?;
    let axis: Box<dyn StrokeAxis> = match (rig.axis, &rig.axis_address) {
        (RigAxis::Line, Some(address)) => Box::new(Line::open(address, rig.axis_baud.unwrap_or(BAUD))?),
        (RigAxis::Prompt, _) => {
            let input = std::io::BufReader::new(std::io::stdin());
            Box::new(Prompt::new(input, std::io::stderr(), Arc::clone(interrupted)))
        }
        (RigAxis::Commanded, _) => {
            return Err(Error::new(
                DataCode::CallInvalid,
                "the axis `commanded` is that of the virtual bench",
            )
            .help("write axis = \"line\" with axis_address, \"prompt\", \"weight\", \"pair\" or \"held\" in rig.toml"));
        }
        _ => Box::new(NoAxis),
    };
    // A check without the muscle is done by hand; the program says when it is needed.
    rig.checks = false;
    let none: MakeCheck = Box::new(|_, _, _, _| Ok(None));
    let description = format!("the controller at {}", client.port());
    Ok(Rigging { controller: Controller::new(client, axis, none), rig, muscle, description, emulated: None })
}

/// A campaign that was stopped by force leaves a controller that runs until its host has been silent for long enough, and is then vented
/// by that fault. This call is the host that was missing, so it waits, and clears the fault; any other fault stays.
fn clear_silence(client: &mut Client, console: &Console) -> Result<()> {
    let ticks = client.call::<GetSettings>(&())?.watch.host_silence_ticks;
    let deadline = Instant::now() + Duration::from_millis(ticks.into()) + MARGIN;
    while client.call::<GetStatus>(&())?.state == State::Running && Instant::now() < deadline {
        std::thread::sleep(POLL);
    }
    if client.call::<GetStatus>(&())?.state != State::Fault {
        return Ok(());
    }
    let latched = client.call::<GetFaults>(&())?.latched;
    if latched.is_some_and(|report| report.fault == Fault::HostSilence) {
        client.call_once::<ClearFault>(&())?;
        console.note("the controller had vented the muscle because the interrupted campaign fell silent; the fault is cleared");
    }
    Ok(())
}

/// No more pressure, stroke, and force than the controller itself allows.
fn limit(rig: &mut Rig, client: &mut Client) -> Result<()> {
    let settings = client.call::<GetSettings>(&())?;
    // A twentieth below the fault: ripple and overshoot of the regulator.
    let allowed = settings.regulator.command_max_pa.min(0.95 * settings.limits.pressure_pa);
    let kpa = f64::from(allowed) * 1e-3;
    rig.pressure_max_kpa = Some(rig.pressure_max_kpa.map_or(kpa, |own| own.min(kpa)));
    let mm = f64::from(settings.limits.stroke_max_m) * 1e3;
    rig.stroke_max_mm = Some(rig.stroke_max_mm.map_or(mm, |own| own.min(mm)));
    let newtons = f64::from(settings.limits.force_n);
    rig.force_max = Some(rig.force_max.map_or(newtons, |own| own.min(newtons)));
    Ok(())
}

/// Force tracking on the emulated bench without the table and with it: feed-forward, and root mean square of the error, N.
pub(crate) fn tracked(rigging: &mut Rigging, table: &TableFile) -> Result<Vec<(&'static str, f64)>> {
    let Some((_, axis)) = &rigging.emulated else { return Ok(Vec::new()) };
    let axis = axis.clone();
    let client = rigging.controller.client();
    let blocked = f64::from(table.table.blocked_force.newtons());
    let mut buffer = [0; image::MAX_LEN];
    let image = image::write(&table.table, &mut buffer)
        .map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
    tables::write(client, Side::Agonist, image, |_| ())?;
    let mut errors = Vec::new();
    for law in [Law::Gaylord, Law::Table] {
        choose(client, law, 1.0)?;
        axis.go(0.0, 1e-2);
        let track = track(client, law, Task::Sine, 0.35 * blocked, |_| ())?;
        errors.push((law.name(), track.rms));
    }
    Ok(errors)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both times are counted in device time: one that did not follow disarmed the controller between two requests.
    #[test]
    fn a_fast_controller_allows_its_host_as_much_silence_as_a_real_one() {
        let bench = BenchSpec::laboratory(muscle("mini").unwrap(), 1);
        let emulated =
            Emulated::start(Stand::commanded(bench, Axis::default()), Some(Kind::Native), 10.0).unwrap();
        let mut client = Client::open(emulated.address()).unwrap();
        let before = client.call::<GetSettings>(&()).unwrap().watch;
        allow_silence(&mut client, 10.0).unwrap();
        let after = client.call::<GetSettings>(&()).unwrap().watch;
        assert_eq!(after.host_silence_ticks, 40 * before.host_silence_ticks);
        assert_eq!(after.armed_silence_ticks, 40 * before.armed_silence_ticks);
        allow_silence(&mut client, 1e6).unwrap();
        let most = client.call::<GetSettings>(&()).unwrap().watch;
        assert_eq!(most.host_silence_ticks, LONGEST_SILENCE);
        assert_eq!(most.armed_silence_ticks, LONGEST_ARMED_SILENCE);
    }
}
