//! Options that all commands with a device share.

use std::time::Duration;

use clap::Args;
use model_core::link::hello::Board;
use model_core::link::messages::Side;

use crate::console::Console;
use pam_data::error::{DataCode, Error, Result};
use pam_device::{Address, Client, Patience, Port, plugged_in};

/// Which device.
#[derive(Debug, Clone, Args)]
pub struct PortOption {
    /// A serial device, tcp:HOST:PORT for an emulated one, or slcan:ADAPTER,address=N on a CAN bus [default: the only USB serial device that is a controller].
    #[arg(short, long, value_name = "PORT", env = "PAM_PORT")]
    port: Option<String>,
}

impl PortOption {
    /// The address: what was given, or the only controller that is plugged in.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] when nothing was given and there is none, or more than one controller.
    pub fn address(&self) -> Result<Address> {
        if let Some(port) = &self.port {
            return port.parse();
        }
        chosen(&plugged_in(), is_controller)?.parse()
    }

    /// Opens the device and compares versions.
    ///
    /// # Errors
    /// As [`Self::address`] and [`Client::open`].
    pub fn connect(&self, console: &Console) -> Result<Client> {
        let address = self.address()?;
        let client = Client::open(&address)?;
        let hello = client.hello();
        let (major, minor, patch) = hello.release;
        console.detail(format!(
            "{address}: {}, release {major}.{minor}.{patch}, schema {:016x}",
            Board::from_code(hello.board).map_or("unknown board", Board::name),
            hello.schema_hash
        ));
        Ok(client)
    }
}

/// The only device there is, or the only one of several that says a controller's hello.
fn chosen(plugged_in: &[String], is_controller: impl Fn(&str) -> bool) -> Result<&str> {
    if plugged_in.is_empty() {
        return Err(Error::new(
            DataCode::CallInvalid,
            "no port is given, and no USB serial device is connected",
        )
        .help("give --port /dev/ttyACM0, or --port tcp:HOST:PORT for an emulated device"));
    }
    if let [only] = plugged_in {
        return Ok(only);
    }
    let controllers: Vec<&str> =
        plugged_in.iter().map(String::as_str).filter(|name| is_controller(name)).collect();
    let several = |count: usize, what: &str, names: String| {
        Error::new(DataCode::CallInvalid, format!("no port is given, and this machine has {count} {what}"))
            .help(format!("name one: --port {names}"))
    };
    match controllers[..] {
        [only] => Ok(only),
        [] => Err(several(
            plugged_in.len(),
            "USB serial devices, none of which answers as a controller",
            plugged_in.join(", or --port "),
        )),
        _ => Err(several(controllers.len(), "controllers", controllers.join(", or --port "))),
    }
}

/// Whether what is on a port says a controller's hello, of whatever version.
fn is_controller(name: &str) -> bool {
    let patience = Patience { answer: Duration::from_millis(200), tries: 2, ..Patience::default() };
    name.parse().and_then(|address| Client::greet(Port::open(&address)?, patience)).is_ok()
}

/// Which muscle of the device.
#[derive(Debug, Clone, Copy, Args)]
pub struct Muscle {
    /// Which muscle of a board that drives two.
    #[arg(long = "muscle", value_name = "1|2", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=2))]
    number: u8,
}

impl Muscle {
    /// As the link names it.
    #[must_use]
    pub fn side(self) -> Side {
        if self.number == 2 { Side::Antagonist } else { Side::Agonist }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_only_device_is_taken_and_of_several_the_only_controller() {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let never = |_: &str| panic!("one device is not asked: opening it is enough");
        assert_eq!(chosen(&names(&["/dev/ttyACM0"]), never).unwrap(), "/dev/ttyACM0");
        let three = names(&["/dev/ttyACM0", "/dev/ttyUSB0", "/dev/ttyUSB1"]);
        assert_eq!(chosen(&three, |name| name.ends_with("B1")).unwrap(), "/dev/ttyUSB1");
        let parts = |error: Error| (error.cause().to_owned(), error.advice().unwrap_or_default().to_owned());
        let (cause, help) = parts(chosen(&three, |_| false).unwrap_err());
        assert!(
            cause.contains("3 USB serial devices, none of which") && help.contains("ttyUSB0"),
            "{cause} {help}"
        );
        let (cause, help) = parts(chosen(&three, |name| name.contains("USB")).unwrap_err());
        assert!(cause.contains("2 controllers") && !help.contains("ttyACM0"), "{cause} {help}");
        assert!(parts(chosen(&[], never).unwrap_err()).0.contains("no USB serial device"));
    }
}
