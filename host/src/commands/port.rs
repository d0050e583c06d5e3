//! Options that all commands with a device share.

use clap::Args;
use model_core::link::hello::Board;
use model_core::link::messages::Side;

use crate::console::Console;
use crate::device::{Address, Client, plugged_in};
use crate::error::{Code, Error, Result};

/// Which device.
#[derive(Debug, Clone, Args)]
pub struct PortOption {
    /// A serial device, or tcp:HOST:PORT for an emulated one [default: the only USB serial device].
    #[arg(short, long, value_name = "PORT", env = "PAM_PORT")]
    port: Option<String>,
}

impl PortOption {
    /// The address: what was given, or the only serial device that is plugged in.
    ///
    /// # Errors
    /// [`Code::CallInvalid`] when nothing was given and there is none or more than one.
    pub fn address(&self) -> Result<Address> {
        if let Some(port) = &self.port {
            return port.parse();
        }
        match &plugged_in()[..] {
            [only] => only.parse(),
            [] => {
                Err(Error::new(Code::CallInvalid, "no port is given, and no USB serial device is plugged in")
                    .help("name it: --port /dev/ttyACM0, or --port tcp:HOST:PORT for an emulated one"))
            }
            several => Err(Error::new(
                Code::CallInvalid,
                format!("no port is given, and there are {} USB serial devices", several.len()),
            )
            .help(format!("name one: --port {}", several.join(", or --port ")))),
        }
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
