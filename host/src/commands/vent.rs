//! `host vent`: make a controller safe.

use clap::Args;
use pam_data::error::Result;
use pam_device::messages;
use pam_device::run::vent;

use super::port::PortOption;
use crate::console::Console;
use crate::documents::{device, line};

/// Arguments of `host vent`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  host vent --port /dev/ttyACM0\n  host vent --json")]
pub struct Arguments {
    #[command(flatten)]
    port: PortOption,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Vents and disarms.
    ///
    /// # Errors
    /// A device that does not answer; then it must be vented by hand.
    pub fn run(self, console: &Console) -> Result<()> {
        let status = vent(&mut self.port.connect(console)?)?;
        let state = messages::state(status.state);
        console.result(if self.json {
            line(&device::Vent { schema: "pam-vent/1", vented: true, state })?
        } else {
            format!("vented; the device is {state}")
        });
        Ok(())
    }
}
