//! What the controller takes of a chip: flash, static memory, stack.

use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};

use model_core::effects::{EffectName, FittedEffect};
use model_core::link::endpoints::{ArmTrace, EvaluateTable, Forget, GetInfo, GetPastFault, Restart, Stop};
use model_core::link::messages::{
    Evaluate, ForgetMemory, Mode, PastFault, Point, Reference, SetPoint, Side, TraceArm, Trigger, Variable,
};
use model_core::link::settings::FeedForward;
use model_core::table::{self, MuscleTable};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::presets;

use crate::joint::{self, Joint};
use crate::machine::{self, Folder, Machine, Options, Skipped};
use crate::tracking::{self, Stretch, Wanted};
use crate::{fitting, pair, roll_back, upload};

/// The most flash that an image without logs may take, bytes.
pub const FLASH: u32 = 160 * 1024;
/// The most memory, static and stack together, bytes.
pub const RAM: u32 = 48 * 1024;

/// What a board's image takes of the chip, bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Size {
    /// The board.
    pub board: &'static str,
    /// How many times what a task takes of the stack may lie there: twice where the control loop interrupts the others.
    pub deep: u32,
    /// Program and constants.
    pub flash: u32,
    /// Static memory, without the stack.
    pub ram: u32,
}

/// Builds the images of both boards and reads their sizes off what the build says.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When an image cannot be built.
pub fn sizes() -> Result<Vec<Size>, Skipped> {
    machine::image()?;
    let build = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/build");
    let size = |board, deep| {
        let output = Command::new(&build).arg(board).output().expect("the build runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let after =
            |word: &str| -> Option<u32> { text.split_once(word)?.1.split_whitespace().next()?.parse().ok() };
        let (flash, ram) = after(": flash ").zip(after(" RAM ")).unwrap_or_else(|| {
            panic!("the build of {board} says {text} {}", String::from_utf8_lossy(&output.stderr))
        });
        Size { board, deep, flash, ram }
    };
    Ok(vec![size("nucleo-f446re", 2), size("mps2-an386", 1)])
}

/// End of the emulated board's memory, where the stack begins.
const STACK_TOP: u32 = 0x2040_0000;

/// The most of the stack that the image used, bytes: the emulator gives the program memory of zeros, and what is not zero below
/// the stack's beginning has been written.
fn reached(machine: &Machine) -> u32 {
    let mut debugger = machine.debugger();
    let (mut lowest, mut at) = (STACK_TOP, STACK_TOP);
    // Eight kibibytes of zeros in a row were never reached.
    while lowest - at < 8192 {
        at -= 4;
        if debugger.word(at) != 0 {
            lowest = at;
        }
    }
    STACK_TOP - lowest
}

/// The example's table with the four effects that remember most or cost most.
fn with_effects() -> MuscleTable {
    let mut table = table::example();
    let names = [
        EffectName::LogCreep,
        EffectName::MinorLoopMemory,
        EffectName::PressureLag,
        EffectName::CyclicSoftening,
    ];
    for name in names {
        let small: Vec<f64> = name.info().parameters.iter().map(|p| p.low.max(0.0)).collect();
        table.effects.push(FittedEffect::new(name, &small)).expect("room for four");
    }
    table
}

/// Two tables with four effects each, uploaded, evaluated and gone back from; settings changed, a wave of force followed with trim,
/// trace and telemetry, what was remembered kept and forgotten, a restart.
fn of_one_muscle() -> Result<u32, Skipped> {
    let folder = Folder::new();
    let bench = BenchSpec::laboratory(presets::miniature(), 7);
    let motion = Motion::Sine { mean_mm: 0.9, amplitude_mm: 0.6, frequency_hz: 0.3 };
    let station = PlantStation::new(bench, vec![motion], 1e-3);
    let options = Options { first: Some(Box::new(station)), debugged: true, ..Options::default() };
    let mut machine = Machine::start(folder.path(), options)?;
    let mut client = machine.client();
    let table = with_effects();
    for side in [Side::Agonist, Side::Agonist, Side::Antagonist] {
        upload(&mut client, side, &table);
        let points = (0..16).map(|n| Point { pressure_pa: 40e3 * n as f32, stroke_m: 1e-3 }).collect();
        client.call::<EvaluateTable>(&Evaluate { side, direction: 1, points }).expect("an evaluation");
    }
    roll_back(&mut client, Side::Agonist);
    let variables = [Variable::Pressure, Variable::Force, Variable::Command].into_iter().collect();
    let trace = TraceArm { variables, every_ticks: 1, trigger: Trigger::UntilFault };
    client.call::<ArmTrace>(&trace).expect("a trace");
    tracking::set(&mut client, tracking::compare(FeedForward::Table, 0.0, 4e3));
    let sine = Reference::Sine { mean: 45.0, amplitude: 20.0, frequency_hz: 2.0 };
    let stretch = Stretch { wanted: Wanted::Wave(sine), ticks: 1000, unjudged: 0 };
    tracking::run(&mut client, Mode::Force, &[stretch]);
    pam_device::tables::read(&mut client, Side::Agonist).expect("it reads");
    client.call::<GetPastFault>(&PastFault { back: 0 }).expect("a log");
    client.call::<Forget>(&ForgetMemory { side: Side::Agonist }).expect("it forgets");
    let starts = client.hello().starts;
    client.call_once::<Restart>(&()).expect("it answers before it restarts");
    drop(client);
    machine.client_after(starts).call::<GetInfo>(&()).expect("it started again");
    Ok(reached(&machine))
}

/// A joint that is brought to an angle and a stiffness.
fn of_a_joint() -> Result<u32, Skipped> {
    let folder = Folder::new();
    let spec = presets::contractile();
    let joint: Arc<Mutex<Joint>> = Arc::new(Mutex::new(pair::elbow(&spec)));
    let [first, second] = joint::Side::both(&joint);
    let options =
        Options { first: Some(Box::new(first)), second: Some(Box::new(second)), debugged: true, speed: None };
    let machine = Machine::start(folder.path(), options)?;
    let mut client = machine.client();
    let table = fitting::fitted(&spec);
    for side in Side::ALL {
        upload(&mut client, side, &table);
    }
    tracking::set(&mut client, pair::adjust);
    let point = SetPoint::Pair { angle_rad: 0.05, stiffness_nm_per_rad: 120.0 };
    tracking::start(&mut client, Mode::Pair);
    client.set_point(point).expect("within reach");
    for _ in 0..500 {
        tracking::sample(&mut client).expect("no fault");
    }
    client.set_point(SetPoint::Pair { angle_rad: 0.0, stiffness_nm_per_rad: 100.0 }).expect("within reach");
    client.call::<Stop>(&()).expect("it stops");
    Ok(reached(&machine))
}

/// The most of the stack that the image uses, bytes.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When the board does not do what it is queried.
pub fn stack() -> Result<u32, Skipped> {
    Ok(of_one_muscle()?.max(of_a_joint()?))
}

impl Size {
    /// Static memory and the most of the stack, bytes, where a task takes at most `stack` of it.
    pub fn memory(&self, stack: u32) -> u32 {
        self.ram + self.deep * stack
    }
}

/// Sizes and stack as Markdown.
pub fn markdown(sizes: &[Size], stack: u32) -> String {
    let kib = |bytes: u32| f64::from(bytes) / 1024.0;
    let mut out = format!(
        "\n## Memory\n\nImages without logs, bytes. `nucleo-f446re` is the board for a muscle; `mps2-an386` is the one that QEMU \
         emulates: it drives two muscles, and has the virtual benches' lines beside the link. Allowed are {FLASH} of flash and {RAM} of \
         memory, the stack included, which the tests hold.\n\n| board | flash | static memory | stack | memory in all | KiB |\n\
         | --- | --- | --- | --- | --- | --- |\n"
    );
    for size in sizes {
        let (Size { board, deep, flash, ram }, all) = (size, size.memory(stack));
        out.push_str(&format!(
            "| {board} | {flash} | {ram} | {} | {all} | {:.1} |\n",
            deep * stack,
            kib(all)
        ));
    }
    out.push_str(&format!(
        "\nOn mps2-an386 {stack} bytes of stack were used, interrupts included, after uploads of tables with four effects, force control \
         with a trace, a joint of two muscles, and a restart. There one task runs at a time. On the Nucleo the control loop interrupts \
         the others, and it is counted twice: more than both together can take.\n"
    ));
    out
}
