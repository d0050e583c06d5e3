//! MCAP files: those of `host record`, by the fields of the topic `/telemetry`, also where the file was cut off; and those of other
//! programs, by the numbers in all their topics.

mod decompress;
mod join;
mod json;
mod ros;
mod ros_definition;
#[cfg(test)]
mod tests;
mod topics;
mod values;

use std::collections::HashMap;
use std::io::Read;

use serde_json::Value;

use super::column_table::{Column, ColumnTable};
use crate::bounds::Budget;
use crate::error::{DataCode, Error, Result};
use crate::mcap_records::{Channel, Chunk, Records, Schema, Trouble, kind, log_time, message};

pub(super) use self::join::Needed;
use self::topics::Topics;
pub(super) use crate::mcap_records::MAGIC;

/// The topic of `host record` that holds samples.
const TOPIC: &str = "/telemetry";

/// The columns, and what the user has to know of them: of `host record`, every field of the samples that is a number in all of them; of
/// others, every number of every topic that is needed, at the times of one of them.
pub(super) fn columns(
    reader: impl Read,
    budget: Budget,
    needed: Needed<'_>,
) -> Result<(ColumnTable, Vec<String>)> {
    let mut file = File {
        samples: Samples { topics: HashMap::new(), table: Vec::new(), rows: 0, budget },
        others: Some(Topics::new(needed.columns, budget)),
    };
    let mut records = Records::new(reader);
    while let Some((kind, body)) = records.read().map_err(trouble)? {
        if kind != kind::CHUNK {
            file.take(kind, body)?;
            continue;
        }
        let chunk =
            Chunk::parse(body).ok_or_else(|| damaged("the lengths in a chunk contradict one another"))?;
        let decompressed;
        let chunk = if chunk.compression.is_empty() {
            chunk
        } else {
            decompressed = decompress::records(&chunk).map_err(|e| damaged(&e))?;
            chunk.decompressed(&decompressed)
        };
        if chunk.intact() == Some(false) {
            return Err(damaged("the checksum of a chunk does not fit"));
        }
        for (kind, body) in chunk.iter() {
            file.take(kind, body)?;
        }
    }
    match file.others {
        Some(mut others) => join::join(&others.list, needed, &mut others.budget),
        None => Ok((file.samples.finish()?, Vec::new())),
    }
}

/// What was read of a file.
struct File<'a> {
    samples: Samples,
    /// None where the file is of `host record`.
    others: Option<Topics<'a>>,
}

impl File<'_> {
    fn take(&mut self, kind: u8, body: &[u8]) -> Result<()> {
        match kind {
            kind::SCHEMA => {
                let schema = Schema::parse(body).ok_or_else(|| damaged("a schema without a name"))?;
                self.others.as_mut().map_or(Ok(()), |others| others.schema(&schema))
            }
            kind::CHANNEL => {
                let channel = Channel::parse(body).ok_or_else(|| damaged("a channel without a topic"))?;
                let own = channel.topic == TOPIC && ["json", ""].contains(&channel.encoding);
                self.samples.topics.insert(channel.number, own);
                if own {
                    self.others = None;
                }
                self.others.as_mut().map_or(Ok(()), |others| others.channel(&channel))
            }
            kind::MESSAGE => {
                let parts = message(body).zip(log_time(body));
                let ((number, _, data), logged) =
                    parts.ok_or_else(|| damaged("a message without a header"))?;
                let known = match &mut self.others {
                    Some(others) => others.message(number, logged, data)?,
                    None => self.samples.message(number, data)?,
                };
                if known { Ok(()) } else { Err(damaged("a message of a channel that is not in the file")) }
            }
            _ => Ok(()),
        }
    }
}

fn damaged(what: &str) -> Error {
    Error::new(DataCode::RecordingContainer, format!("the MCAP file cannot be read: {what}"))
        .help("`host recover` takes over what is whole; else copy the file again")
}

fn trouble(trouble: Trouble) -> Error {
    match trouble {
        Trouble::Io(e) => Error::new(DataCode::FileUnreadable, format!("cannot be read: {e}")),
        Trouble::NoMagic => damaged("it does not begin as an MCAP file does"),
        Trouble::Cut => damaged("it ends in the middle of a record"),
        Trouble::TooLong(length) => damaged(&format!("a record announces {length} bytes")),
    }
}

struct Samples {
    topics: HashMap<u16, bool>,
    table: Vec<(String, Vec<f64>)>,
    rows: usize,
    budget: Budget,
}

impl Samples {
    /// Takes a message; whether its channel is known.
    fn message(&mut self, number: u16, data: &[u8]) -> Result<bool> {
        match self.topics.get(&number) {
            Some(true) => self.sample(data).map(|()| true),
            Some(false) => Ok(true),
            None => Ok(false),
        }
    }

    fn sample(&mut self, data: &[u8]) -> Result<()> {
        let foreign = || {
            Error::new(
                DataCode::RecordingContainer,
                format!("message {} of {TOPIC} is not a JSON object", self.rows + 1),
            )
            .help("only files of `host record` are read; take columns from others by their own tools as CSV")
        };
        let value: Value = serde_json::from_slice(data).map_err(|_| foreign())?;
        let fields = value.as_object().ok_or_else(foreign)?;
        if self.rows == 0 {
            let numbers = fields.iter().filter(|(_, v)| v.is_number());
            self.table = numbers.map(|(k, _)| (k.clone(), Vec::new())).collect();
        }
        self.rows += 1;
        // A message takes memory for every column, whatever little it says.
        self.budget.take(self.table.len())?;
        for (name, column) in &mut self.table {
            // A number that was none is `null` there; the reader of columns judges it as such.
            column.push(fields.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN));
        }
        Ok(())
    }

    fn finish(self) -> Result<ColumnTable> {
        if self.rows == 0 {
            let cause = format!("the MCAP file has no message of {TOPIC}");
            return Err(Error::new(DataCode::RecordingEmpty, cause)
                .help("record again; `host record` writes at least a sample each tick"));
        }
        // A column that is null throughout was not measured.
        let kept = self.table.into_iter().filter(|(_, v)| v.iter().any(|x| x.is_finite()));
        Ok(kept.map(|(name, v)| (name, Column::Numbers(v))).collect())
    }
}
