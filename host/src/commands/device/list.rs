//! `host device list`: the serial devices, and which of them are controllers.

use std::time::Duration;

use model_core::link::SCHEMA_HASH;
use model_core::link::hello::Board;
use serde_json::json;

use crate::console::Console;
use pam_data::error::Result;
use pam_device::{Client, Patience, Port, available, recorder};

pub(super) fn run(json: bool, console: &Console) -> Result<()> {
    let patience = Patience { answer: Duration::from_millis(200), tries: 2, ..Patience::default() };
    let mut rows = Vec::new();
    for name in available() {
        let met = name.parse().and_then(|address| Client::greet(Port::open(&address)?, patience));
        rows.push(match met {
            Ok(client) => {
                let hello = client.hello();
                let (major, minor, patch) = hello.release;
                json!({
                    "port": name,
                    "controller": true,
                    "board": Board::from_code(hello.board).map_or("unknown", Board::name),
                    "serial": recorder::serial(hello),
                    "release": format!("{major}.{minor}.{patch}"),
                    "same_schema": hello.schema_hash == SCHEMA_HASH,
                })
            }
            Err(e) => json!({ "port": name, "controller": false, "why": e.cause() }),
        });
    }
    if json {
        console.result(format!("{:#}", json!({ "schema": "pam-ports/1", "ports": rows })));
    } else if rows.is_empty() {
        console.result("no serial device is connected; the port of an emulated device is tcp:HOST:PORT");
    } else {
        for row in rows {
            let text = |key: &str| row[key].as_str().unwrap_or_default().to_owned();
            console.result(if row["controller"] == true {
                let differs = if row["same_schema"] == true { "" } else { ", speaks another schema" };
                format!(
                    "{}: {}, release {}, serial {}{differs}",
                    text("port"),
                    text("board"),
                    text("release"),
                    text("serial")
                )
            } else {
                format!("{}: no controller ({})", text("port"), text("why"))
            });
        }
    }
    Ok(())
}
