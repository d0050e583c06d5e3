//! `host device list`: the serial devices, and which of them are controllers.

use std::time::Duration;

use model_core::link::SCHEMA_HASH;
use model_core::link::hello::Board;

use crate::console::Console;
use crate::documents::{device as document, text};
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
                document::Port::Controller(document::Controller {
                    port: name,
                    controller: true,
                    board: Board::from_code(hello.board).map_or("unknown", Board::name),
                    serial: recorder::serial(hello),
                    release: format!("{major}.{minor}.{patch}"),
                    same_schema: hello.schema_hash == SCHEMA_HASH,
                })
            }
            Err(e) => document::Port::Other(document::Other {
                port: name,
                controller: false,
                why: e.cause().to_string(),
            }),
        });
    }
    if json {
        console.result(text(&document::Ports { schema: "pam-ports/1", ports: rows })?);
    } else if rows.is_empty() {
        console.result("no serial device is connected; the port of an emulated device is tcp:HOST:PORT");
    } else {
        for row in rows {
            console.result(match row {
                document::Port::Controller(c) => {
                    let differs = if c.same_schema { "" } else { ", uses another link schema" };
                    format!("{}: {}, release {}, serial {}{differs}", c.port, c.board, c.release, c.serial)
                }
                document::Port::Other(o) => format!("{}: no controller ({})", o.port, o.why),
            });
        }
    }
    Ok(())
}
