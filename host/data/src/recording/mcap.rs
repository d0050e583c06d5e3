//! MCAP files of `host record`: the messages of the topic `/telemetry`, field by field, also of a file that was cut off.

use std::collections::HashMap;
use std::io::Read;

use serde_json::Value;

use super::column_table::{Column, ColumnTable};
use crate::bounds::Budget;
use crate::error::{DataCode, Error, Result};
use crate::mcap_records::{Chunk, Records, Trouble, channel, kind, message};

pub(super) use crate::mcap_records::MAGIC;

/// The topic that holds samples.
const TOPIC: &str = "/telemetry";

/// Every field of the samples that is a number in all of them.
pub(super) fn columns(reader: impl Read, budget: Budget) -> Result<ColumnTable> {
    let mut samples = Samples { topics: HashMap::new(), table: Vec::new(), rows: 0, budget };
    let mut records = Records::new(reader);
    while let Some((kind, body)) = records.read().map_err(trouble)? {
        match kind {
            kind::CHUNK => {
                let chunk = Chunk::parse(body)
                    .ok_or_else(|| damaged("the lengths in a chunk contradict one another"))?;
                if !chunk.compression.is_empty() {
                    return Err(Error::new(
                        DataCode::RecordingContainer,
                        format!("the MCAP file is compressed by {}", chunk.compression),
                    )
                    .help("only files of `host record` are read; `mcap compress --compression none` writes such a file plain"));
                }
                if chunk.intact() == Some(false) {
                    return Err(damaged("the checksum of a chunk does not fit"));
                }
                for (kind, body) in chunk.iter() {
                    samples.take(kind, body)?;
                }
            }
            other => samples.take(other, body)?,
        }
    }
    samples.finish()
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
    fn take(&mut self, kind: u8, body: &[u8]) -> Result<()> {
        match kind {
            kind::CHANNEL => {
                let (number, topic) = channel(body).ok_or_else(|| damaged("a channel without a topic"))?;
                self.topics.insert(number, topic == TOPIC);
                Ok(())
            }
            kind::MESSAGE => {
                let (number, _, data) = message(body).ok_or_else(|| damaged("a message without a head"))?;
                match self.topics.get(&number) {
                    Some(true) => self.sample(data),
                    Some(false) => Ok(()),
                    None => Err(damaged("a message of a channel that is not in the file")),
                }
            }
            _ => Ok(()),
        }
    }

    fn sample(&mut self, data: &[u8]) -> Result<()> {
        let foreign = || {
            Error::new(
                DataCode::RecordingContainer,
                format!("message {} of {TOPIC} is no JSON object", self.rows + 1),
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

#[cfg(test)]
mod tests {
    use super::*;

    fn record(out: &mut Vec<u8>, kind: u8, body: &[u8]) {
        out.push(kind);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
    }

    fn file(messages: &[&str]) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        let topic = [&[1, 0, 0, 0][..], &10_u32.to_le_bytes(), TOPIC.as_bytes(), &[0; 8]].concat();
        record(&mut out, kind::CHANNEL, &topic);
        for message in messages {
            let body = [&[1, 0][..], &[0; 20], message.as_bytes()].concat();
            record(&mut out, kind::MESSAGE, &body);
        }
        record(&mut out, kind::DATA_END, &[0; 4]);
        out
    }

    #[test]
    fn many_columns_and_many_short_messages_take_no_more_than_the_budget() {
        let wide = (0..100).map(|i| format!("\"c{i}\":1")).collect::<Vec<_>>().join(",");
        let wide = format!("{{{wide}}}");
        let mut messages = vec![wide.as_str()];
        messages.extend(["{}"; 99]);
        let bytes = file(&messages);
        assert_eq!(columns(bytes.as_slice(), Budget::new(10_000)).expect("fits").len(), 100);
        let error = columns(bytes.as_slice(), Budget::new(9_999)).expect_err("does not fit");
        assert_eq!(error.code(), DataCode::FileUnreadable);
    }

    #[test]
    fn lengths_that_lead_out_of_the_file_are_refused() {
        let mut bytes = MAGIC.to_vec();
        record(&mut bytes, kind::CHANNEL, &[1, 0, 0, 0, 0xff, 0xff, 0xff, 0x7f]);
        assert!(columns(bytes.as_slice(), Budget::default()).is_err());
        let mut bytes = MAGIC.to_vec();
        bytes.push(kind::CHUNK);
        bytes.extend(2_700_000_000_u64.to_le_bytes());
        let error = columns(bytes.as_slice(), Budget::default()).expect_err("too long");
        assert!(error.cause().contains("2700000000"), "{error}");
    }
}
