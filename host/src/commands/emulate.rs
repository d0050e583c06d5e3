//! `host emulate`: a controller without hardware, for every other command to talk to.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;

use super::interrupt::interrupts;
use super::recording_files::positive;
use crate::campaign::rigging::allow_silence;
use crate::console::Console;
use crate::demo::campaign::muscle;
use crate::documents::{bench, line};
use pam_data::error::{Error, Result};
use pam_device::Client;
use pam_device::emulated::{Axis, Emulated, Kind, Stand, axis_server};
use pam_device::error::DeviceCode;
use virtual_bench::bench::BenchSpec;

/// Arguments of `host emulate`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host emulate\n  host emulate contractile --on native\n  host emulate --axis --speed 5\n\n\
    The firmware runs in QEMU where that and its image are there (`firmware/build mps2-an386`), else in this process, on a \
    muscle of the virtual bench that is moved back and forth. The first line says at which port: give it to the other commands \
    by --port, or write it into the variable PAM_PORT. One program may connect at a time."
)]
pub struct Arguments {
    /// The muscle of the bench: mini, contractile, push or random:SEED.
    #[arg(value_name = "MUSCLE", default_value = "mini")]
    muscle: String,
    /// Run the firmware in this process, or insist on QEMU.
    #[arg(long, value_name = "WHERE", value_parser = ["native", "qemu"])]
    on: Option<String>,
    /// Hold the muscle by an axis that takes lines, as a testing machine does, in place of moving it back and forth; the second line says
    /// where: write it as axis_address into rig.toml.
    #[arg(long)]
    axis: bool,
    /// Largest ratio of emulated to real time.
    #[arg(long, value_name = "N", default_value_t = 1.0, allow_negative_numbers = true)]
    speed: f64,
    /// How long, s [default: until Ctrl-C].
    #[arg(short, long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Print the first line as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Runs the controller until Ctrl-C, or until the time is over.
    ///
    /// # Errors
    /// A muscle that the bench does not have, a controller that cannot be started.
    pub fn run(self, console: &Console) -> Result<()> {
        positive([("--seconds", self.seconds), ("--speed", Some(self.speed))])?;
        let only = match self.on.as_deref() {
            Some("native") => Some(Kind::Native),
            Some("qemu") => Some(Kind::Qemu),
            _ => None,
        };
        let interrupted = interrupts()?;
        let spec = muscle(&self.muscle)?;
        let (stand, axis) = if self.axis {
            let axis = Axis::default();
            let address = axis_server::serve(axis.clone()).map_err(|e| {
                Error::new(DeviceCode::DevicePort, format!("the system gives no port for the axis: {e}"))
            })?;
            (Stand::commanded(BenchSpec::laboratory(spec, 1), axis), Some(address))
        } else {
            (Stand::swinging(spec), None)
        };
        let emulated = Emulated::start(stand, only, self.speed)?;
        if self.speed > 1.0 {
            allow_silence(&mut Client::open(emulated.address())?, self.speed)?;
        }
        if self.json {
            let (port, description) = (emulated.address().to_string(), emulated.description());
            let axis = axis.as_deref();
            let document =
                bench::Emulate { schema: "pam-emulate/1", port: &port, controller: &description, axis };
            console.result(line(&document)?);
        } else {
            console.result(emulated.address());
            if let Some(axis) = &axis {
                console.result(axis);
            }
        }
        console.note(format!("{}; Ctrl-C ends it", emulated.description()));
        console.note(format!("next: host device info --port {}", emulated.address()));
        let begun = Instant::now();
        let over = || self.seconds.is_some_and(|s| begun.elapsed().as_secs_f64() >= s);
        while !interrupted.load(Ordering::Relaxed) && !over() {
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(())
    }
}
