//! TDMS files of LabVIEW: each channel is a column, and the properties of its waveform give the time.
//!
//! A file consists of segments: a lead-in, what changed in the list of objects, raw data. Source of the layout: National Instruments,
//! "TDMS File Format Internal Structure" (<https://www.ni.com/en/support/documentation/supplemental/07/tdms-file-format-internal-structure.html>).
//! Raw data of DAQmx, whose scaling is in further structures, are refused.

mod bytes;
mod channel;
mod segment;
#[cfg(test)]
mod tests;
mod waveform;

use super::column_table::{Column, damaged};
use super::container::Contents;
use crate::bounds::Budget;
use crate::error::Result;
use channel::{Channel, Data};

/// The first four bytes.
pub(super) const MAGIC: &[u8; 4] = b"TDSm";

/// The channels as columns, and what the user has to know of their times.
pub(super) fn columns(bytes: &[u8], budget: Budget) -> Result<Contents> {
    let mut file = segment::File::new(budget);
    file.read(bytes)?;
    let channels: Vec<Channel> = file.channels.into_iter().filter(|c| !c.is_empty()).collect();
    if channels.is_empty() {
        return Err(damaged("it has no channel with values"));
    }
    let one_group = channels.iter().all(|c| c.group == channels[0].group);
    let (time, notes, channels) = waveform::timed(channels, &mut file.budget)?;
    let mut table: Vec<(String, Column)> = Vec::with_capacity(channels.len() + 1);
    table.extend(time.map(|time| (waveform::TIME.to_owned(), Column::Numbers(time))));
    for channel in channels {
        let name = channel.column_name(one_group);
        let column = match channel.data {
            _ if channel.unscaled => {
                Column::Other("readings that LabVIEW stored without their scale".to_owned())
            }
            Data::Numbers(values) => Column::Numbers(values),
            Data::Texts(texts) => Column::Texts(texts),
            Data::Other(kind) => Column::Other(kind),
        };
        table.push((name, column));
    }
    Ok((table, notes))
}
