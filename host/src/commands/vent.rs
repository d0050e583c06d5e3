//! `host vent`: make a controller safe.

use clap::Args;
use model_core::link::messages::State;
use pam_data::error::{Error, Result};
use pam_device::error::DeviceCode;
use pam_device::run::vent;
use pam_device::{Address, messages, vent_all};

use super::port::PortOption;
use crate::console::Console;
use crate::documents::{device, line};

/// Arguments of `host vent`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host vent --port /dev/ttyACM0\n  host vent --json\n  host vent --port slcan:/dev/ttyACM0,address=all"
)]
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
        let address = self.port.address()?;
        if address.is_whole_bus() {
            return self.all(&address, console);
        }
        let status = vent(&mut self.port.connect(console)?)?;
        let state = messages::state(status.state);
        console.result(if self.json {
            line(&device::Vent { schema: "pam-vent/1", vented: true, state })?
        } else {
            format!("vented; the device is {state}")
        });
        Ok(())
    }

    /// Vents every device on a CAN bus.
    fn all(&self, bus: &Address, console: &Console) -> Result<()> {
        let answered = vent_all(bus)?;
        let list = |vented: bool| {
            let those = answered.iter().filter(|one| one.is_vented() == vented);
            those.map(|one| one.address.to_string()).collect::<Vec<_>>().join(", ")
        };
        if answered.is_empty() || answered.iter().any(|one| !one.is_vented()) {
            let cause = if answered.is_empty() {
                "no device on the bus answers after the message to vent".to_owned()
            } else {
                format!("the devices at these addresses may not have vented: {}", list(false))
            };
            return Err(Error::new(DeviceCode::DeviceSilent, cause)
                .value(bus.to_string())
                .help("shut off the air supply of the muscles by hand"));
        }
        console.result(if self.json {
            line(&device::Vent {
                schema: "pam-vent/1",
                vented: true,
                state: messages::state(State::Disarmed),
            })?
        } else {
            format!("vented; these addresses answer: {}", list(true))
        });
        Ok(())
    }
}
