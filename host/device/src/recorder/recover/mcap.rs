//! Chunks of an MCAP whose checksum fits go over; behind damage the next such chunk is looked for.
//!
//! A record's length stands before it without a check, so one flipped bit there hides where every later record begins. A chunk is
//! recognised by its lengths, which must agree in two places, and by its checksum.

use std::io::{self, Read, Write};

use serde_json::Value;

use super::super::mcap::{END, Encoder};
use super::Tally;
use super::window::Window;
use pam_data::mcap_records::{Chunk, LARGEST, MAGIC, RECORD_HEADER, header, kind, message, plausible};

/// Largest record beside chunks that is taken over: the header, metadata, the attached side file.
const LARGEST_OTHER: u64 = 4 << 20;

/// What is at a position of the file.
enum Found {
    /// A record that goes over, with its length in all.
    Keep(usize),
    /// A record that the new file does not need: an index of what stands before it.
    Pass(usize),
    /// The end of the data.
    End,
    /// Nothing that can be trusted.
    Damage,
}

/// Copies what is whole and ends the new file.
pub(super) fn copy<R: Read>(source: &mut Window<R>, out: &mut impl Write) -> io::Result<Tally> {
    let mut copy = Copy { tally: Tally::default(), sequence: 0, headed: false, channels: false, out };
    copy.out.write_all(MAGIC)?;
    let begins = source.peek(MAGIC.len())? == MAGIC;
    if begins {
        source.skip(MAGIC.len());
    }
    // Samples of a damaged chunk, as far as its records can be counted: used where no later chunk's numbers say it.
    let mut uncounted = 0;
    let mut damaged = !begins;
    loop {
        if source.peek(1)?.is_empty() {
            break;
        }
        match if damaged { Found::Damage } else { read_record_header(source)? } {
            Found::End => break,
            Found::Pass(length) => source.skip(length),
            Found::Keep(length) => {
                uncounted = if copy.take(source.peek(length)?)? { 0 } else { uncounted };
                source.skip(length);
            }
            Found::Damage => {
                damaged = false;
                let (bytes, samples) = skip_to_chunk(source)?;
                copy.tally.bytes_lost += bytes;
                copy.tally.gaps += u64::from(bytes > 0);
                uncounted += samples;
            }
        }
    }
    copy.tally.samples_lost += uncounted;
    copy.header()?;
    copy.out.write_all(&END)?;
    Ok(copy.tally)
}

struct Copy<'a, W> {
    tally: Tally,
    /// Number of the last message that went over.
    sequence: u32,
    headed: bool,
    channels: bool,
    out: &'a mut W,
}

impl<W: Write> Copy<'_, W> {
    /// Takes a whole record over; says whether it held messages, which count those that are missing before them.
    fn take(&mut self, record: &[u8]) -> io::Result<bool> {
        let mut counted = false;
        match record[0] {
            kind::HEADER if self.headed => return Ok(false),
            kind::HEADER => self.headed = true,
            kind::CHUNK => {
                let Some(chunk) = Chunk::parse(&record[RECORD_HEADER..]) else { return Ok(false) };
                if chunk.iter().any(|(kind, _)| kind == kind::CHANNEL) {
                    self.channels = true;
                }
                self.channels()?;
                for (_, body) in chunk.iter().filter(|(kind, _)| *kind == kind::MESSAGE) {
                    counted |= self.count(body);
                }
            }
            _ => {}
        }
        self.header()?;
        self.out.write_all(record)?;
        Ok(counted)
    }

    fn count(&mut self, body: &[u8]) -> bool {
        let Some((_, sequence, _)) = message(body) else { return false };
        self.tally.samples_lost += u64::from(sequence.saturating_sub(self.sequence).saturating_sub(1));
        self.tally.samples += 1;
        self.sequence = sequence;
        true
    }

    /// A file without its header gets one.
    fn header(&mut self) -> io::Result<()> {
        if !std::mem::replace(&mut self.headed, true) {
            self.out.write_all(&own(kind::HEADER)?)?;
        }
        Ok(())
    }

    /// Messages need the channels that a damaged chunk held: those of every recording of `host record` are the same.
    fn channels(&mut self) -> io::Result<()> {
        self.header()?;
        if !std::mem::replace(&mut self.channels, true) {
            self.out.write_all(&own(kind::CHUNK)?)?;
        }
        Ok(())
    }
}

/// The first record of a kind of a recording that begins.
fn own(wanted: u8) -> io::Result<Vec<u8>> {
    let begun = Encoder::new(&Value::Null, 0).and_then(|mut e| e.take()).map_err(io::Error::other)?;
    let mut rest = &begun[MAGIC.len()..];
    while let Some((kind, length)) = header(rest) {
        let (record, after) = rest.split_at_checked(RECORD_HEADER + length as usize).unwrap_or((rest, &[]));
        if kind == wanted {
            return Ok(record.to_vec());
        }
        rest = after;
    }
    Ok(Vec::new())
}

fn read_record_header<R: Read>(source: &mut Window<R>) -> io::Result<Found> {
    let Some((kind, length)) = header(source.peek(RECORD_HEADER)?) else { return Ok(Found::Damage) };
    let most = if kind == kind::CHUNK { LARGEST } else { LARGEST_OTHER };
    if length > most {
        return Ok(Found::Damage);
    }
    let whole = RECORD_HEADER + length as usize;
    // The record and the kind of the one behind it.
    let bytes = source.peek(whole + 1)?;
    if bytes.len() < whole {
        return Ok(Found::Damage);
    }
    let body = &bytes[RECORD_HEADER..whole];
    let after = bytes.get(whole).copied();
    // The kind of what follows shows whether the length was right, where no checksum does.
    let followed = after.is_none_or(|kind| (kind::HEADER..=kind::DATA_END).contains(&kind));
    Ok(match kind {
        kind::CHUNK if Chunk::parse(body).is_some_and(|c| c.intact() == Some(true)) => Found::Keep(whole),
        kind::DATA_END if length == 4 && followed => Found::End,
        kind::MESSAGE_INDEX if followed && index(body) => Found::Pass(whole),
        // Messages and channels be in chunks; beside them nothing would show that they are damaged chunks.
        kind::HEADER | kind::METADATA | kind::ATTACHMENT if followed && plausible(kind, body) => {
            Found::Keep(whole)
        }
        _ => Found::Damage,
    })
}

/// Whether this is an index of messages: a channel, a length, and as many pairs of a time and a place as the length says.
fn index(body: &[u8]) -> bool {
    let length = body.get(2..6).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    length.is_some_and(|length| length % 16 == 0 && length as usize + 6 == body.len())
}

/// Skips to the next complete chunk, or to the end; returns the bytes skipped, and the messages that can be counted among them.
fn skip_to_chunk<R: Read>(source: &mut Window<R>) -> io::Result<(u64, u64)> {
    let (mut bytes, mut samples) = (0, 0);
    loop {
        match chunk_here(source)? {
            Some(true) => return Ok((bytes, samples)),
            Some(false) => samples += countable(source)?,
            None => {}
        }
        let ahead = source.peek(1 << 16)?;
        if ahead.is_empty() {
            return Ok((bytes, samples));
        }
        let next = ahead[1..].iter().position(|b| *b == kind::CHUNK).map_or(ahead.len(), |at| at + 1);
        source.skip(next);
        bytes += next as u64;
    }
}

/// Whether a chunk begins here (`None`: no) and is whole.
fn chunk_here<R: Read>(source: &mut Window<R>) -> io::Result<Option<bool>> {
    /// The parts of a chunk before its records, uncompressed as ours are.
    const BEFORE: usize = RECORD_HEADER + 40;
    let start = source.peek(BEFORE)?;
    let number = |at: usize| start.get(at..at + 8).and_then(|b| header(&[&[0], b].concat())).map(|(_, n)| n);
    let (Some((kind::CHUNK, length)), Some(uncompressed), Some(records)) =
        (header(start), number(RECORD_HEADER + 16), number(RECORD_HEADER + 32))
    else {
        return Ok(None);
    };
    if length > LARGEST || length != records.saturating_add(40) || uncompressed != records {
        return Ok(None);
    }
    let whole = RECORD_HEADER + length as usize;
    let bytes = source.peek(whole)?;
    Ok(Some(
        bytes.len() == whole
            && Chunk::parse(&bytes[RECORD_HEADER..]).is_some_and(|c| c.intact() == Some(true)),
    ))
}

/// Messages in a damaged chunk at this position, as far as their lengths lead.
fn countable<R: Read>(source: &mut Window<R>) -> io::Result<u64> {
    const BEFORE: usize = RECORD_HEADER + 40;
    let Some((kind::CHUNK, length)) = header(source.peek(RECORD_HEADER)?) else { return Ok(0) };
    let bytes = source.peek(RECORD_HEADER + length.min(LARGEST) as usize)?;
    let mut rest = bytes.get(BEFORE..).unwrap_or_default();
    let mut count = 0;
    while let Some((kind, length)) = header(rest) {
        let body = rest.get(RECORD_HEADER..).and_then(|r| r.get(..usize::try_from(length).ok()?));
        let (kind::SCHEMA..=kind::MESSAGE, Some(body)) = (kind, body) else { break };
        count += u64::from(kind == kind::MESSAGE);
        rest = &rest[RECORD_HEADER + body.len()..];
    }
    Ok(count)
}
