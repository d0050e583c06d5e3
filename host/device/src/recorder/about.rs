//! What a recording says of itself: which program, which device, which table, which settings, and what was lost.

use model_core::link::endpoints::{GetInfo, GetSettings};
use model_core::link::hello::{Board, Hello};
use model_core::link::messages::DeviceInfo;
use model_core::link::settings::Settings;
use serde_json::{Value, json};

use crate::{Client, Losses};
use pam_data::date::now_utc;
use pam_data::error::Result;
use pam_data::output::json_of;

/// What is known when a recording begins: date, versions of host and device, tables, settings. `schema` names the kind of
/// recording.
///
/// # Errors
/// A device that does not answer.
pub fn about_start(schema: &str, client: &mut Client) -> Result<Value> {
    let info = client.call::<GetInfo>(&())?;
    let settings = client.call::<GetSettings>(&())?;
    Ok(json!({
        "schema": schema,
        "date": now_utc(),
        "host": env!("CARGO_PKG_VERSION"),
        "port": client.port(),
        "device": about_device(client.hello(), &info, &settings),
    }))
}

/// What a side file says about a device: every version, its table, its settings.
#[must_use]
pub fn about_device(hello: &Hello, info: &DeviceInfo, settings: &Settings) -> Value {
    let (major, minor, patch) = hello.release;
    json!({
        "board": Board::from_code(hello.board).map_or("unknown", Board::name),
        "serial": serial(hello),
        "release": format!("{major}.{minor}.{patch}"),
        "link_version": hello.link_version,
        "table_format": hello.table_format,
        "store_format": hello.store_format,
        "schema": format!("{:016x}", hello.schema_hash),
        "starts": hello.starts,
        "ticks_per_s": info.ticks_per_s,
        "tables": info.tables.iter().map(|t| t.map(|t| json!({
            "crc": format!("{:08x}", t.crc), "bytes": t.length, "generation": t.generation,
        }))).collect::<Vec<_>>(),
        "settings": json_of(settings),
    })
}

/// What a side file says about losses: samples that are missing by the tick counter, and what is known of the cause.
#[must_use]
pub fn about_losses(losses: Losses) -> Value {
    json!({
        "samples": losses.samples,
        "gaps": losses.gaps,
        "unreceived": losses.unreceived,
        "bad_frames": losses.bad_frames,
        "repeated_requests": losses.repeats,
        "unread": losses.unread,
    })
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
