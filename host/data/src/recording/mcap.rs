//! MCAP files of `host record`: the messages of the topic `/telemetry`, field by field, also of a file that was cut off.

use serde_json::Value;

use super::column_table::{Column, ColumnTable};
use crate::error::{DataCode, Error, Result};

/// The first eight bytes of such a file.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The topic that holds samples.
const TOPIC: &str = "/telemetry";

/// Every field of the samples that is a number in all of them.
pub(super) fn columns(bytes: &[u8]) -> Result<ColumnTable> {
    let damaged = |e: mcap::McapError| {
        Error::new(DataCode::RecordingContainer, format!("the MCAP file cannot be read: {e}"))
            .help("a file that was cut off (NAME.part) is mended by `host recover`; else copy it again")
    };
    let mut names: Vec<String> = Vec::new();
    let mut values: Vec<Vec<f64>> = Vec::new();
    let mut rows = 0;
    for message in mcap::MessageStream::new(bytes).map_err(damaged)? {
        let message = message.map_err(damaged)?;
        if message.channel.topic != TOPIC {
            continue;
        }
        let foreign = || {
            Error::new(
                DataCode::RecordingContainer,
                format!("message {} of {TOPIC} is no JSON object", rows + 1),
            )
            .help("only files of `host record` are read; take columns from others by their own tools as CSV")
        };
        let value: Value = serde_json::from_slice(&message.data).map_err(|_| foreign())?;
        let fields = value.as_object().ok_or_else(foreign)?;
        if rows == 0 {
            names = fields.iter().filter(|(_, v)| v.is_number()).map(|(k, _)| k.clone()).collect();
            values = vec![Vec::new(); names.len()];
        }
        rows += 1;
        for (name, column) in names.iter().zip(&mut values) {
            // A number that was none is `null` there; the reader of columns judges it as such.
            column.push(fields.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN));
        }
    }
    if rows == 0 {
        return Err(Error::new(DataCode::RecordingEmpty, format!("the MCAP file has no message of {TOPIC}"))
            .help("record again; `host record` writes at least a sample each tick"));
    }
    // A column that is null throughout was not measured.
    let kept = names.into_iter().zip(values).filter(|(_, v)| v.iter().any(|x| x.is_finite()));
    Ok(kept.map(|(name, v)| (name, Column::Numbers(v))).collect())
}
