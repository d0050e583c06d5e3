//! The segments of a file, and the values in them.

use std::collections::HashMap;

use super::MAGIC;
use super::bytes::{Bytes, Kind};
use super::channel::{Channel, Property};
use crate::bounds::Budget;
use crate::error::{DataCode, Error, Result};
use crate::recording::column_table::damaged;

/// What a segment has, as bits of its lead-in.
mod contents {
    pub(super) const LIST: u32 = 1 << 1;
    pub(super) const NEW_LIST: u32 = 1 << 2;
    pub(super) const RAW_DATA: u32 = 1 << 3;
    pub(super) const INTERLEAVED: u32 = 1 << 5;
    pub(super) const BIG_ENDIAN: u32 = 1 << 6;
    pub(super) const DAQMX: u32 = 1 << 7;
}
/// Bytes of a lead-in.
const LEAD_IN: usize = 28;
/// The next segment's place where the program was interrupted before it knew it.
const OPEN: u64 = u64::MAX;
/// The index of an object without values, and of one whose values are as in the segment before.
const NONE: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;
/// Objects that are visited in all segments together: a file with more tiny segments takes minutes.
const MOST_VISITS: usize = 50_000_000;

/// How the values of a channel are stored in a chunk.
#[derive(Debug, Clone, Copy)]
struct Index {
    kind: Kind,
    count: u64,
    /// Bytes in a chunk.
    size: u64,
}

/// An object of the list.
struct Object {
    /// Its place among the channels; none for the file and its groups.
    channel: Option<usize>,
    index: Option<Index>,
}

/// What was read of a file.
pub(super) struct File {
    pub channels: Vec<Channel>,
    pub budget: Budget,
    objects: Vec<Object>,
    by_path: HashMap<String, usize>,
    /// The objects with values in the current segment, in its order.
    active: Vec<usize>,
    visits: usize,
}

impl File {
    pub(super) fn new(budget: Budget) -> Self {
        Self {
            channels: Vec::new(),
            budget,
            objects: Vec::new(),
            by_path: HashMap::new(),
            active: Vec::new(),
            visits: 0,
        }
    }

    /// Reads all segments. One whose length was left open, as after a crash, is read as far as it goes.
    pub(super) fn read(&mut self, mut file: &[u8]) -> Result<()> {
        while !file.is_empty() {
            let mut lead = Bytes { rest: file, big: false };
            if lead.rest.len() < LEAD_IN && self.channels.iter().any(|c| !c.is_empty()) {
                return Ok(());
            }
            if lead.take(4)? != MAGIC {
                return Err(damaged("a segment does not begin with TDSm"));
            }
            let has = lead.u32()?;
            lead.big = has & contents::BIG_ENDIAN != 0;
            let (_version, next, raw_at) = (lead.u32()?, lead.u64()?, lead.u64()?);
            let rest = lead.rest.len() as u64;
            // A program that was interrupted leaves the length open; a copy that was cut off is shorter than it says.
            if next != OPEN && next > rest {
                let cause = format!("the TDMS file ends {} bytes before its last segment does", next - rest);
                return Err(
                    Error::new(DataCode::RecordingContainer, cause).help("it is incomplete: copy it again")
                );
            }
            let length = next.min(rest);
            if raw_at > length {
                return Err(damaged("the place of the raw data in a segment leads out of it"));
            }
            let (segment, after) = lead.rest.split_at(length as usize);
            let (list, raw) = segment.split_at(raw_at as usize);
            if has & contents::DAQMX != 0 && has & contents::RAW_DATA != 0 {
                return Err(daqmx());
            }
            if has & contents::LIST != 0 {
                self.list(Bytes { rest: list, big: lead.big }, has & contents::NEW_LIST != 0)?;
            }
            if has & contents::RAW_DATA != 0 && !raw.is_empty() {
                self.raw(raw, lead.big, has & contents::INTERLEAVED != 0)?;
            }
            file = after;
        }
        Ok(())
    }

    /// What changes in the list of objects.
    fn list(&mut self, mut list: Bytes<'_>, new: bool) -> Result<()> {
        if new {
            self.active.clear();
        }
        for _ in 0..list.u32()? {
            let path = list.text()?;
            let object = match self.by_path.get(&path) {
                Some(object) => *object,
                None => {
                    // An object takes memory beside its name.
                    self.budget.take(path.len() / 4 + 50)?;
                    let channel = Channel::of(&path).map(|channel| {
                        self.channels.push(channel);
                        self.channels.len() - 1
                    });
                    self.objects.push(Object { channel, index: None });
                    self.by_path.insert(path.clone(), self.objects.len() - 1);
                    self.objects.len() - 1
                }
            };
            match list.u32()? {
                NONE => self.active.retain(|active| *active != object),
                AS_BEFORE if self.objects[object].index.is_none() => {
                    return Err(damaged(format!("{path} has values as before, but had none")));
                }
                AS_BEFORE => self.activate(object)?,
                // As in the files, "69 12 00 00" and "69 13 00 00".
                0x0000_1269 | 0x0000_1369 | 0x0000_126A => return Err(daqmx()),
                _ => {
                    self.objects[object].index = Some(index(&mut list, &path)?);
                    self.activate(object)?;
                }
            }
            for _ in 0..list.u32()? {
                let name = list.text()?;
                let value = Property::read(&mut list)?;
                if let Some(channel) = self.objects[object].channel {
                    self.channels[channel].property(&name, value);
                }
            }
        }
        Ok(())
    }

    fn activate(&mut self, object: usize) -> Result<()> {
        self.visit(self.active.len())?;
        if !self.active.contains(&object) {
            self.active.push(object);
        }
        Ok(())
    }

    fn visit(&mut self, objects: usize) -> Result<()> {
        self.visits = self.visits.saturating_add(objects);
        if self.visits > MOST_VISITS {
            return Err(Error::new(DataCode::RecordingContainer, "it has too many small segments")
                .help("defragment it: the function TDMS Defragment of LabVIEW, or save it again"));
        }
        Ok(())
    }

    /// The values of a segment: chunks, each with the values of all objects.
    fn raw(&mut self, raw: &[u8], big: bool, interleaved: bool) -> Result<()> {
        self.visit(self.active.len())?;
        let parts: Vec<(Option<usize>, Index)> = self
            .active
            .iter()
            .filter_map(|o| Some((self.objects[*o].channel, self.objects[*o].index?)))
            .filter(|(_, index)| index.size > 0)
            .collect();
        if interleaved {
            return self.interleaved(raw, big, &parts);
        }
        let chunk = parts.iter().fold(0_u64, |sum, (_, index)| sum.saturating_add(index.size));
        let mut rest = raw;
        while chunk > 0 && !rest.is_empty() {
            self.visit(parts.len())?;
            for (channel, index) in &parts {
                let (part, after) = rest.split_at(index.size.min(rest.len() as u64) as usize);
                rest = after;
                let Some(channel) = channel.map(|c| &mut self.channels[c]) else { continue };
                match index.kind {
                    // Texts that are cut off have lost the characters.
                    Kind::Text if (part.len() as u64) < index.size => {}
                    Kind::Text => channel.add_texts(part, index.count as usize, big, &mut self.budget)?,
                    kind => channel.add(kind, part, kind.size(), big, &mut self.budget)?,
                }
            }
        }
        Ok(())
    }

    /// One value of each channel after the other.
    fn interleaved(&mut self, raw: &[u8], big: bool, parts: &[(Option<usize>, Index)]) -> Result<()> {
        if parts.iter().any(|(_, index)| index.kind == Kind::Text) {
            return Err(damaged("it has interleaved texts, which the format does not allow"));
        }
        let row: usize = parts.iter().map(|(_, index)| index.kind.size()).sum();
        let mut at = 0;
        for (channel, index) in parts {
            if let (Some(channel), Some(raw)) = (channel, raw.get(at..)) {
                self.channels[*channel].add(index.kind, raw, row, big, &mut self.budget)?;
            }
            at += index.kind.size();
        }
        Ok(())
    }
}

fn index(list: &mut Bytes<'_>, path: &str) -> Result<Index> {
    let number = list.u32()?;
    let kind =
        Kind::of(number).ok_or_else(|| damaged(format!("{path} has values of the unknown type {number}")))?;
    let (dimensions, count) = (list.u32()?, list.u64()?);
    if dimensions != 1 {
        return Err(damaged(format!("{path} has arrays of {dimensions} dimensions, the format has one")));
    }
    let size = if kind == Kind::Text { list.u64()? } else { count.saturating_mul(kind.size() as u64) };
    Ok(Index { kind, count, size })
}

fn daqmx() -> Error {
    Error::new(DataCode::RecordingContainer, "the TDMS file holds raw data of DAQmx, which are not read")
        .help("in LabVIEW, read the file and write it again with scaled values, or export it as CSV")
}
