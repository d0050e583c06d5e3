//! `host device`: ask a controller what it is, what it does, what went wrong, and how it is set. One file for each.

mod faults;
mod identify;
mod info;
mod list;
mod log;
mod sensors;
mod settings;
mod trace;

use clap::{Args, Subcommand};
use model_core::link::endpoints::{Forget, GetInfo, RollBackTable};
use model_core::link::messages::{ForgetMemory, RollBack};

use super::port::{Muscle, PortOption};
use crate::console::Console;
use crate::documents::{device as document, text};
use pam_data::error::Result;

pub(crate) use identify::{regulator_steps, regulator_text};
pub(crate) use settings::changed;

/// Arguments of `host device`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the serial devices, and which of them are controllers.
    #[command(after_help = "Example:\n  host device list")]
    List {
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Every version, what it is doing, its tables.
    #[command(
        after_help = "Examples:\n  host device info\n  host device info --port tcp:127.0.0.1:4321 --json"
    )]
    Info {
        #[command(flatten)]
        port: PortOption,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Follow the device's own reports: states, faults, and its log.
    #[command(after_help = "Examples:\n  host device log\n  host device log --seconds 10\n  \
        host device log --elf target/firmware/nucleo-f446re-log.elf")]
    Log(log::Arguments),
    /// Record variables of the control loop at every tick, in the device's own memory.
    #[command(after_help = "Examples:\n  \
        host device trace --variables pressure,force,command -o trace.csv\n  \
        host device trace --trigger until-fault --variables pressure,command\n  \
        host device trace --read -o before-the-fault.csv")]
    Trace(trace::Arguments),
    /// Show, change, save or restore the settings.
    #[command(after_help = "Examples:\n  \
        host device settings > settings.toml\n  \
        host device settings --set limits.pressure_pa=500e3 \\\n      \
            --set watch.silence_ticks=200\n  \
        host device settings --from settings.toml")]
    Settings(settings::Arguments),
    /// Signals and readings of every sensor; calibrate a sensor with known values.
    #[command(after_help = "Examples:\n  \
        host device sensors\n  \
        host device sensors --calibrate force --known 0\n  \
        host device sensors --calibrate force --known 0 --known 49.05 --known 98.1\n  \
        host device sensors --calibrate pressure --point 0.333=0 --point 3=1000\n\n\
        reading = at_zero + per_unit · signal. The device refuses a scale with which a limit or a range lies outside what the \
        sensor can read.")]
    Sensors(sensors::Arguments),
    /// Find the pressure regulator's gain, offset, lag, rate and deadband by steps, and keep them in the settings.
    #[command(after_help = "Examples:\n  \
        host device identify --low 100 --high 250\n  \
        host device identify --low 100 --high 250 --dry-run --json\n\n\
        The muscle is pressurised between the two pressures for about half a minute, and vented at the end.")]
    Identify(identify::Arguments),
    /// The latched fault, counts, and past faults, with the remedy.
    #[command(after_help = "Examples:\n  host device faults\n  host device faults --clear")]
    Faults {
        #[command(flatten)]
        port: PortOption,
        /// Forget the latched fault; refused while its cause is still there.
        #[arg(long)]
        clear: bool,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Go back to the table before.
    #[command(after_help = "Example:\n  host device rollback")]
    Rollback {
        #[command(flatten)]
        port: PortOption,
        #[command(flatten)]
        muscle: Muscle,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Forget what a muscle's effects remember of its history: another muscle of the same kind was fitted.
    #[command(after_help = "Example:\n  host device forget --muscle 1")]
    Forget {
        #[command(flatten)]
        port: PortOption,
        #[command(flatten)]
        muscle: Muscle,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
}

impl Arguments {
    /// Does what was requested.
    ///
    /// # Errors
    /// A device that is silent, of another kind, or refuses; a file that cannot be read or written.
    pub fn run(self, console: &Console) -> Result<()> {
        match self.action {
            Action::List { json } => list::run(json, console),
            Action::Info { port, json } => info::run(&port, json, console),
            Action::Log(arguments) => log::run(&arguments, console),
            Action::Trace(arguments) => trace::run(&arguments, console),
            Action::Settings(arguments) => settings::run(&arguments, console),
            Action::Sensors(arguments) => sensors::run(&arguments, console),
            Action::Identify(arguments) => identify::run(&arguments, console),
            Action::Faults { port, clear, json } => faults::run(&port, clear, json, console),
            Action::Rollback { port, muscle, json } => {
                let mut client = port.connect(console)?;
                let side = muscle.side();
                // Named by its generation, the table is gone back from once, however often the request is repeated.
                let now = client.call::<GetInfo>(&())?.tables[side.index()];
                let generation = now.map_or(0, |table| table.generation);
                let info = client.call::<RollBackTable>(&RollBack { side, generation })?;
                let crc = format!("{:08x}", info.crc);
                console.result(if json {
                    text(&document::Rollback {
                        schema: "pam-rollback/1",
                        crc,
                        bytes: info.length,
                        generation: info.generation,
                        has_previous: info.has_previous,
                    })?
                } else {
                    format!("back to the table with check sum {crc}")
                });
                Ok(())
            }
            Action::Forget { port, muscle, json } => {
                let side = muscle.side();
                port.connect(console)?.call_once::<Forget>(&ForgetMemory { side })?;
                console.result(if json {
                    text(&document::Forget { schema: "pam-forget/1", muscle: side.index() + 1 })?
                } else {
                    format!("the history of muscle {} is forgotten", side.index() + 1)
                });
                Ok(())
            }
        }
    }
}
