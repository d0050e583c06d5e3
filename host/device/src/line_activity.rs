//! What arrives on a line before the first hello, and the error that it shows: no controller, or not the expected one.

use model_core::link::hello::{Board, Hello};
use model_core::link::{LINK_VERSION, SCHEMA_HASH};

use super::Port;
use crate::error::DeviceCode;
use pam_data::error::Error;
use pam_data::pluralise::pluralise;

/// What came before any hello, to distinguish a silent line from a other peer.
#[derive(Default)]
pub(super) struct LineActivity {
    /// Everything that arrived.
    pub bytes: usize,
    /// Whole frames.
    pub frames: usize,
    /// Questions of our own, sent back.
    pub echoes: usize,
    first: Vec<u8>,
}

impl LineActivity {
    /// Takes note of what arrived.
    pub fn take(&mut self, bytes: &[u8]) {
        self.bytes += bytes.len();
        let room = 32usize.saturating_sub(self.first.len());
        self.first.extend_from_slice(&bytes[..bytes.len().min(room)]);
    }

    /// Why there is no controller at this port, as far as one can receive.
    pub fn error(&self, port: &Port) -> Error {
        if self.bytes == 0
            && let Some(troubles) = port.troubles()
        {
            return silent_bus(port, troubles);
        }
        if self.bytes == 0 {
            return Error::new(DeviceCode::DeviceSilent, "nothing answers on this port")
                .value(port.name())
                .help("check that the controller is powered and flashed, and that this is its port; `host device list` shows the ports");
        }
        if self.echoes > 0 {
            return Error::new(DeviceCode::DeviceForeign, "the line echoes what it is sent")
                .value(port.name())
                .help("check whether transmit and receive are connected, or a terminal program is at the other end");
        }
        if self.frames > 0 {
            return Error::new(
                DeviceCode::DeviceSilent,
                "a controller is connected, but it does not answer hello",
            )
            .value(port.name())
            .help("close any other program that uses the port, or restart the controller");
        }
        let shown = String::from_utf8_lossy(&self.first);
        let printable = shown.chars().filter(|c| c.is_ascii_graphic() || c.is_ascii_whitespace()).count();
        let begins = if printable * 2 > shown.chars().count() {
            format!("`{}`", shown.trim().chars().flat_map(char::escape_debug).collect::<String>())
        } else {
            self.first.iter().take(12).map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ")
        };
        Error::new(
            DeviceCode::DeviceForeign,
            format!(
                "something answers here, but it is not a controller of this project: it sent {}, beginning {begins}",
                pluralise(self.bytes, "byte")
            ),
        )
        .value(port.name())
        .help("check the port; if it is the right board, flash it first: host flash --firmware ELF --chip CHIP")
    }
}

/// Why no device answers at an address of a CAN bus.
fn silent_bus(port: &Port, (refused, foreign): (u64, u64)) -> Error {
    let cause = match (refused, foreign) {
        (0, 0) => "nothing answers at this address of the CAN bus".to_owned(),
        (0, _) => format!(
            "no device answers, and the CAN adapter sends {} that mean nothing",
            pluralise(foreign as usize, "line")
        ),
        _ => format!(
            "no device answers, and the CAN adapter refuses {}",
            pluralise(refused as usize, "message")
        ),
    };
    Error::new(DeviceCode::DeviceSilent, cause).value(port.name()).help(
        "check `can.address` and `can.kbit_per_s` of the controller over its serial port, that the bus has 120 Ω at both ends, and that CANH \
         and CANL are not swapped",
    )
}

/// The line is gone in the middle of a conversation.
pub(super) fn lost(port: &Port, reason: &std::io::Error) -> Error {
    Error::new(DeviceCode::DeviceSilent, format!("the connection to the device is lost: {reason}"))
        .value(port.name())
        .help("check the cable and the supply, then try again; a running controller without its host stops within a second by default")
}

/// It is a controller, of another schema.
pub(super) fn version_error(port: &Port, hello: &Hello) -> Error {
    let (major, minor, patch) = hello.release;
    let ours = env!("CARGO_PKG_VERSION");
    let older = match hello.link_version.cmp(&LINK_VERSION) {
        std::cmp::Ordering::Less => "the device is older: flash the firmware of this release onto it",
        std::cmp::Ordering::Greater => "the device is newer: update this program",
        std::cmp::Ordering::Equal => {
            "they were built from different sources: build and flash both from the same release"
        }
    };
    Error::new(
        DeviceCode::DeviceVersion,
        format!(
            "the device ({}, release {major}.{minor}.{patch}) speaks link version {} with schema {:016x}; this program ({ours}) \
             speaks version {LINK_VERSION} with schema {:016x}",
            Board::from_code(hello.board).map_or("unknown board", Board::name),
            hello.link_version,
            hello.schema_hash,
            SCHEMA_HASH
        ),
    )
    .value(port.name())
    .help(older)
}
