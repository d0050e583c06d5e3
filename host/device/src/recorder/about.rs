//! What a recording says of itself: which program, which device, which table, which settings, and what was lost.

use model_core::link::endpoints::{GetInfo, GetSettings};
use model_core::link::hello::{Board, Hello};
use model_core::link::messages::{DeviceInfo, TableInfo};
use model_core::link::settings::Settings;
use serde::Serialize;
use serde_json::Value;

use crate::run::Ending;
use crate::{Client, Losses};
use pam_data::date::now_utc;
use pam_data::error::Result;
use pam_data::output::json_of;

/// What is known when a recording begins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct About {
    /// The kind of recording.
    pub schema: &'static str,
    /// When it began, UTC.
    pub date: String,
    /// Release of this program.
    pub host: &'static str,
    /// Where the device is connected.
    pub port: String,
    /// The device.
    pub device: LinkedDevice,
}

/// A device, and the messages that it understands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinkedDevice {
    /// Versions, tables and settings.
    #[serde(flatten)]
    pub device: Device,
    /// Hash of the messages of the link, in hexadecimal.
    pub schema: String,
}

/// A device: every version, its tables, its settings. The fields have the order in which documents show them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Device {
    /// Name of the board.
    pub board: &'static str,
    /// Number of the message set.
    pub link_version: u16,
    /// Release of the firmware.
    pub release: String,
    /// The chip's serial number.
    pub serial: String,
    /// All settings, by group.
    pub settings: Value,
    /// Starts since the store was made.
    pub starts: u32,
    /// Version of the store's layout.
    pub store_format: u16,
    /// Version of table images.
    pub table_format: u16,
    /// The table of each muscle, where there is one.
    pub tables: Vec<Option<StoredTable>>,
    /// Ticks of the control loop in a second.
    pub ticks_per_s: u32,
}

/// A table in a device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredTable {
    /// Length of its image.
    pub bytes: u32,
    /// Check sum of its image, in hexadecimal.
    pub crc: String,
    /// Counts the tables of this muscle.
    pub generation: u32,
}

/// How a recording ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Ended {
    /// What did not arrive.
    pub losses: Losses,
    /// `time`, `interrupt`, or what went wrong.
    pub ended_by: String,
}

impl About {
    /// Asks the device for all of it; `schema` names the kind of recording.
    ///
    /// # Errors
    /// A device that does not answer.
    pub fn of(schema: &'static str, client: &mut Client) -> Result<Self> {
        let device = LinkedDevice::of(client)?;
        let port = client.port().to_owned();
        Ok(Self { schema, date: now_utc(), host: env!("CARGO_PKG_VERSION"), port, device })
    }
}

impl LinkedDevice {
    /// Asks the device.
    ///
    /// # Errors
    /// A device that does not answer.
    pub fn of(client: &mut Client) -> Result<Self> {
        let info = client.call::<GetInfo>(&())?;
        let settings = client.call::<GetSettings>(&())?;
        let hello = client.hello();
        let device = Device::of(hello, &info, &settings);
        Ok(Self { device, schema: format!("{:016x}", hello.schema_hash) })
    }
}

impl Device {
    /// What a device said about itself.
    #[must_use]
    pub fn of(hello: &Hello, info: &DeviceInfo, settings: &Settings) -> Self {
        let (major, minor, patch) = hello.release;
        let stored = |table: &TableInfo| StoredTable {
            bytes: table.length,
            crc: format!("{:08x}", table.crc),
            generation: table.generation,
        };
        Self {
            board: Board::from_code(hello.board).map_or("unknown", Board::name),
            link_version: hello.link_version,
            release: format!("{major}.{minor}.{patch}"),
            serial: serial(hello),
            settings: json_of(settings),
            starts: hello.starts,
            store_format: hello.store_format,
            table_format: hello.table_format,
            tables: info.tables.iter().map(|t| t.as_ref().map(stored)).collect(),
            ticks_per_s: info.ticks_per_s,
        }
    }
}

impl Ended {
    /// The end of a recording that was made while something ran.
    #[must_use]
    pub fn of(outcome: &Result<Ending>, losses: Losses) -> Self {
        let ended_by = match outcome {
            Ok(Ending::Done) => "time".to_owned(),
            Ok(Ending::Stopped) => "interrupt".to_owned(),
            Err(error) => error.to_string(),
        };
        Self { losses, ended_by }
    }
}

/// The chip's serial number: as text where it is text, else in hexadecimal.
#[must_use]
pub fn serial(hello: &Hello) -> String {
    let bytes = &hello.serial;
    if bytes.iter().all(|b| *b == 0) {
        return "none".to_owned();
    }
    let text: Vec<u8> = bytes.iter().copied().take_while(|b| *b != 0).collect();
    if text.iter().all(|b| b.is_ascii_graphic() || *b == b' ') {
        return String::from_utf8_lossy(&text).into_owned();
    }
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
