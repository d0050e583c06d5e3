//! A recording as MCAP, the container of robotics' viewers: messages in JSON with their schema, one piece per chunk.
//!
//! | in the file | what |
//! | --- | --- |
//! | topic `/telemetry` | one message a sample; its schema names every field with its unit |
//! | topic `/events` | states and faults, as text |
//! | metadata `recording` | versions of host and device, check sums of the tables, settings, date: there from the first byte on |
//! | attachment `about.json` | the side file, once the recording has ended |
//!
//! Source of the layout: <https://mcap.dev/spec>.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::{Arc, Mutex, PoisonError};

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::write::NoSeek;
use ::mcap::{Attachment, WriteOptions, Writer};
use serde::Serialize;
use serde_json::Value;

use super::columns::{COLUMNS, Column, SECOND};
use pam_data::mcap_records::MAGIC;
use pam_data::output::json_of;

/// The end of a file without an index: end of data (0x0F), footer (0x02), magic.
pub(super) const END: [u8; 13 + 29 + 8] = {
    let mut end = [0; 50];
    (end[0], end[1]) = (0x0F, 4);
    (end[13], end[14]) = (0x02, 20);
    let mut i = 0;
    while i < 8 {
        end[42 + i] = MAGIC[i];
        i += 1;
    }
    end
};

/// Bytes that the writer has finished and that are not in the file yet.
#[derive(Clone, Default)]
struct Finished(Arc<Mutex<Vec<u8>>>);

impl Write for Finished {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Turns samples into the bytes of a file.
pub(super) struct Encoder {
    writer: Writer<NoSeek<Finished>>,
    finished: Finished,
    telemetry: u16,
    events: u16,
    begun_ns: u64,
    sequence: u32,
}

impl std::fmt::Debug for Encoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Encoder({} messages)", self.sequence)
    }
}

fn flat(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

impl Encoder {
    /// Begins a file; `about` is what is known at the start, `begun_ns` the time of day, ns since 1970.
    pub fn new(about: &Value, begun_ns: u64) -> ::mcap::McapResult<Self> {
        let finished = Finished::default();
        let mut writer = WriteOptions::new()
            .compression(None)
            .chunk_size(None)
            .disable_seeking(true)
            .library(concat!("host ", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(finished.clone()))?;
        let mut metadata = BTreeMap::new();
        for (key, value) in about.as_object().into_iter().flatten() {
            match value {
                Value::Object(inner) => {
                    metadata.extend(inner.iter().map(|(k, v)| (format!("{key}.{k}"), flat(v))));
                }
                other => {
                    metadata.insert(key.clone(), flat(other));
                }
            }
        }
        writer.write_metadata(&Metadata { name: "recording".into(), metadata })?;
        let schema = writer.add_schema(
            "pam.Telemetry",
            "jsonschema",
            json_of(&telemetry_schema()).to_string().as_bytes(),
        )?;
        let telemetry = writer.add_channel(schema, "/telemetry", "json", &BTreeMap::new())?;
        let schema =
            writer.add_schema("pam.Event", "jsonschema", json_of(&event_schema()).to_string().as_bytes())?;
        let events = writer.add_channel(schema, "/events", "json", &BTreeMap::new())?;
        Ok(Self { writer, finished, telemetry, events, begun_ns, sequence: 0 })
    }

    fn write(&mut self, channel_id: u16, since_start_us: u64, message: &str) -> ::mcap::McapResult<()> {
        let time = self.begun_ns.saturating_add(since_start_us.saturating_mul(1000));
        self.sequence = self.sequence.wrapping_add(1);
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.writer.write_to_known_channel(&header, message.as_bytes())
    }

    /// Adds a sample, as the text of a JSON object.
    pub fn sample(&mut self, since_start_us: u64, message: &str) -> ::mcap::McapResult<()> {
        self.write(self.telemetry, since_start_us, message)
    }

    /// Adds an event, as the text of a JSON object.
    pub fn event(&mut self, since_start_us: u64, message: &str) -> ::mcap::McapResult<()> {
        self.write(self.events, since_start_us, message)
    }

    /// Ends the chunk and takes all finished bytes.
    pub fn take(&mut self) -> ::mcap::McapResult<Vec<u8>> {
        self.writer.flush()?;
        Ok(self.taken())
    }

    fn taken(&self) -> Vec<u8> {
        std::mem::take(&mut *self.finished.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The last bytes: the side file as an attachment, the index, the end.
    pub fn end(&mut self, about: &Value) -> ::mcap::McapResult<Vec<u8>> {
        let text = format!("{about:#}");
        self.writer.attach(&Attachment {
            log_time: self.begun_ns,
            create_time: self.begun_ns,
            name: "about.json".into(),
            media_type: "application/json".into(),
            data: text.as_bytes().into(),
        })?;
        self.writer.finish()?;
        Ok(self.taken())
    }
}

/// The JSON Schema of a topic's messages.
#[derive(Serialize)]
struct Schema {
    #[serde(rename = "$schema")]
    dialect: &'static str,
    title: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    description: Option<&'static str>,
    r#type: &'static str,
    properties: BTreeMap<&'static str, Property>,
    required: Vec<&'static str>,
}

/// One field of a message.
#[derive(Serialize)]
struct Property {
    r#type: Type,
    description: &'static str,
}

/// The type of a field.
#[derive(Serialize)]
#[serde(untagged)]
enum Type {
    Always(&'static str),
    OrNull([&'static str; 2]),
}

const DIALECT: &str = "https://json-schema.org/draft/2020-12/schema";

fn telemetry_schema() -> Schema {
    let property = |c: &Column| (c.name, Property { r#type: Type::Always(c.kind()), description: c.about });
    Schema {
        dialect: DIALECT,
        title: "pam.Telemetry",
        description: Some(
            "One tick of a controller's loop; fields that begin with second_ are those of a board's second muscle",
        ),
        r#type: "object",
        properties: COLUMNS.iter().chain(SECOND).map(property).collect(),
        required: COLUMNS.iter().map(|c| c.name).collect(),
    }
}

fn event_schema() -> Schema {
    let text = |description| Property { r#type: Type::Always("string"), description };
    let time = Property { r#type: Type::OrNull(["number", "null"]), description: "time of the device, s" };
    Schema {
        dialect: DIALECT,
        title: "pam.Event",
        description: None,
        r#type: "object",
        properties: BTreeMap::from([
            ("time_s", time),
            ("event", text("state, fault or trace-full")),
            ("text", text("description of the event")),
            ("remedy", text("what to do about a fault")),
        ]),
        required: vec!["event", "text"],
    }
}
