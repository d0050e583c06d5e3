//! `host device info`: every version, what it is doing, its tables.

use model_core::link::endpoints::{GetInfo, GetSettings, GetStatus};
use model_core::link::hello::{Board, Hello};
use model_core::link::messages::{DeviceInfo, Status};
use model_core::link::settings::Settings;
use model_core::link::{LINK_VERSION, SCHEMA_HASH};

use crate::commands::port::PortOption;
use crate::console::Console;
use crate::documents::{device, text};
use pam_data::error::Result;
use pam_data::pluralise::pluralise;
use pam_device::recorder::Device;
use pam_device::{Client, Patience, Port, messages, recorder};

pub(super) fn run(port: &PortOption, json: bool, console: &Console) -> Result<()> {
    // The versions are reported even when they do not fit, and the refusal follows.
    let greeted = Client::greet(Port::open(&port.address()?)?, Patience::default())?;
    let hello = *greeted.hello();
    drop(greeted);
    if !json {
        console.result(versions(&hello));
    }
    let mut client = port.connect(console)?;
    let info = client.call::<GetInfo>(&())?;
    let status = client.call::<GetStatus>(&())?;
    if json {
        let settings = client.call::<GetSettings>(&())?;
        console.result(text(&document(&hello, &info, &status, &settings))?);
        return Ok(());
    }
    console.result(format!(
        "{}{} in {} mode, {:.1} s and {} ticks at {} Hz since its start ({}), {}",
        messages::state(status.state),
        status.fault.map(|f| format!(" ({})", messages::fault(f).cause)).unwrap_or_default(),
        messages::mode(status.mode),
        status.time_us as f64 * 1e-6,
        status.ticks,
        info.ticks_per_s,
        messages::started_by(info.started_by),
        pluralise(status.overruns, "overrun"),
    ));
    for (number, table) in info.tables.iter().take(usize::from(info.muscles)).enumerate() {
        console.result(match table {
            Some(t) => format!(
                "muscle {}: table {:08x}, {} bytes, generation {}{}",
                number + 1,
                t.crc,
                t.length,
                t.generation,
                if t.has_previous { ", the one before is kept" } else { "" }
            ),
            None => format!("muscle {}: no table", number + 1),
        });
    }
    Ok(())
}

/// Board and versions, beside those of this program.
fn versions(hello: &Hello) -> String {
    let (major, minor, patch) = hello.release;
    let board = Board::from_code(hello.board).map_or("unknown board", Board::name);
    format!(
        "{board}, release {major}.{minor}.{patch}, serial {}, {}\n\
         link version {} (this program {LINK_VERSION}), schema {:016x} (this program {SCHEMA_HASH:016x})\n\
         table format {}, store format {}, {}",
        recorder::serial(hello),
        pluralise(hello.starts, "start"),
        hello.link_version,
        hello.schema_hash,
        hello.table_format,
        hello.store_format,
        pluralise(hello.muscles, "muscle"),
    )
}

fn document(hello: &Hello, info: &DeviceInfo, status: &Status, settings: &Settings) -> device::Info {
    device::Info {
        schema: "pam-device/1",
        device: Device::of(hello, info, settings),
        link_schema: format!("{:016x}", hello.schema_hash),
        muscles: info.muscles,
        table_capacity: info.table_capacity,
        trace_capacity: info.trace_capacity,
        reference_capacity: info.reference_capacity,
        started_by: messages::started_by(info.started_by),
        status: device::Status {
            state: messages::state(status.state),
            mode: messages::mode(status.mode),
            fault: status.fault.map(|f| messages::fault(f).name),
            time_s: status.time_us as f64 * 1e-6,
            ticks: status.ticks,
            overruns: status.overruns,
            frames_good: status.frames_good,
            frames_bad: status.frames_bad,
            telemetry_dropped: status.telemetry_dropped,
            saturated_ticks: status.saturated_ticks,
            line_errors: status.line_errors,
            bus_offs: status.bus_offs,
        },
    }
}
