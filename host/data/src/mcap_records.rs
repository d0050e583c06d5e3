//! The records of an MCAP file as far as recordings need them, read with a bound on memory at any announced size.
//!
//! A file is magic, records, magic; a record is its kind (one byte), the length of its body (u64) and the body. Messages are in
//! chunks, each with a checksum over its records. Source of the layout: <https://mcap.dev/spec>.

use std::io::{self, Read};

/// The first eight bytes, and the last.
pub const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
/// Bytes before a record's body.
pub const RECORD_HEADER: usize = 9;
/// Largest chunk or message that is taken into memory. A tenth of a second of telemetry takes 32 KiB; other writers' chunks take
/// some MiB.
pub const LARGEST: u64 = 64 << 20;

/// Kinds of records.
pub mod kind {
    #![allow(missing_docs, reason = "named as in the specification")]
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const ATTACHMENT: u8 = 0x09;
    pub const METADATA: u8 = 0x0C;
    pub const DATA_END: u8 = 0x0F;
}

/// Kind and length of a record, from its first nine bytes.
#[must_use]
pub fn header(bytes: &[u8]) -> Option<(u8, u64)> {
    let (&kind, rest) = bytes.split_first()?;
    Some((kind, u64::from_le_bytes(*rest.first_chunk::<8>()?)))
}

/// Values one after the other.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (value, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*value)
    }

    fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let (text, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        std::str::from_utf8(text).ok()
    }
}

/// The body of a chunk.
#[derive(Debug, Clone, Copy)]
pub struct Chunk<'a> {
    /// How its records are compressed; empty where they are not.
    pub compression: &'a str,
    /// Its records as they are in the file.
    pub records: &'a [u8],
    crc: u32,
    /// Bytes of the records without compression.
    pub uncompressed: u64,
}

impl<'a> Chunk<'a> {
    /// `None` where the lengths in it contradict one another.
    #[must_use]
    pub fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        let (_start, _end, uncompressed) = (fields.u64()?, fields.u64()?, fields.u64()?);
        let crc = fields.u32()?;
        let compression = fields.text()?;
        let length = fields.u64()?;
        (length == fields.0.len() as u64).then_some(Self {
            compression,
            records: fields.0,
            crc,
            uncompressed,
        })
    }

    /// Whether its records are as they were written: `None` where they are compressed, or were written without a checksum.
    #[must_use]
    pub fn intact(&self) -> Option<bool> {
        if !self.compression.is_empty() || self.crc == 0 {
            return None;
        }
        let mut crc = flate2::Crc::new();
        crc.update(self.records);
        Some(self.uncompressed == self.records.len() as u64 && crc.sum() == self.crc)
    }

    /// The same chunk with its records decompressed.
    #[must_use]
    pub(crate) fn decompressed<'b>(&self, records: &'b [u8]) -> Chunk<'b> {
        Chunk { compression: "", records, crc: self.crc, uncompressed: self.uncompressed }
    }

    /// Kind and body of each record; ends at one whose length leads out of the chunk.
    pub fn iter(&self) -> impl Iterator<Item = (u8, &'a [u8])> + use<'a> {
        let mut rest = self.records;
        std::iter::from_fn(move || {
            let (kind, length) = header(rest)?;
            let length = usize::try_from(length).ok()?;
            let (body, after) = rest.get(RECORD_HEADER..)?.split_at_checked(length)?;
            rest = after;
            Some((kind, body))
        })
    }
}

/// Whether the lengths in a record that has no checksum, and is beside the chunks, lead to its end.
#[must_use]
pub fn plausible(kind: u8, body: &[u8]) -> bool {
    let mut fields = Fields(body);
    let map = |fields: &mut Fields<'_>| {
        let length = fields.u32()? as usize;
        let (entries, rest) = fields.0.split_at_checked(length)?;
        fields.0 = rest;
        let mut entries = Fields(entries);
        while !entries.0.is_empty() {
            entries.text()?;
            entries.text()?;
        }
        Some(())
    };
    let ends = match kind {
        kind::HEADER => fields.text().and_then(|_| fields.text()).map(|_| ()),
        kind::METADATA => fields.text().and_then(|_| map(&mut fields)),
        kind::ATTACHMENT => (|| {
            fields.take::<16>()?;
            fields.text()?;
            fields.text()?;
            let length = usize::try_from(fields.u64()?).ok()?;
            fields.0 = fields.0.split_at_checked(length)?.1;
            fields.u32().map(|_| ())
        })(),
        _ => None,
    };
    ends.is_some() && fields.0.is_empty()
}

/// What a channel says of its messages.
#[derive(Debug, Clone, Copy)]
pub struct Channel<'a> {
    /// Its number in the file.
    pub number: u16,
    /// The number of its schema; 0 where there is none.
    pub schema: u16,
    /// The topic.
    pub topic: &'a str,
    /// How messages are written, such as `json`, `cdr`, `ros1`.
    pub encoding: &'a str,
}

impl<'a> Channel<'a> {
    /// `None` where the lengths in it contradict one another.
    #[must_use]
    pub fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        Some(Self {
            number: fields.u16()?,
            schema: fields.u16()?,
            topic: fields.text()?,
            encoding: fields.text()?,
        })
    }
}

/// How messages are arranged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Schema<'a> {
    /// Its number in the file.
    pub number: u16,
    /// The type of the messages, such as `sensor_msgs/msg/FluidPressure`.
    pub name: &'a str,
    /// How the schema is written, such as `ros2msg`.
    pub encoding: &'a str,
    /// The schema.
    pub data: &'a [u8],
}

impl<'a> Schema<'a> {
    /// `None` where the lengths in it contradict one another.
    #[must_use]
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        let (number, name, encoding) = (fields.u16()?, fields.text()?, fields.text()?);
        let length = fields.u32()? as usize;
        Some(Self { number, name, encoding, data: fields.0.get(..length)? })
    }
}

/// When a message was logged, ns since 1970.
#[must_use]
pub(crate) fn log_time(body: &[u8]) -> Option<u64> {
    let mut fields = Fields(body);
    let (_channel, _sequence) = (fields.u16()?, fields.u32()?);
    fields.u64()
}

/// Channel, sequence number and data of a message.
#[must_use]
pub fn message(body: &[u8]) -> Option<(u16, u32, &[u8])> {
    let mut fields = Fields(body);
    let (channel, sequence) = (fields.u16()?, fields.u32()?);
    let (_logged, _published) = (fields.u64()?, fields.u64()?);
    Some((channel, sequence, fields.0))
}

/// Why a file cannot be read on.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// The system's reason.
    Io(io::Error),
    /// It does not begin with the magic.
    NoMagic,
    /// It ends in the middle of a record.
    Cut,
    /// A record announces more than [`LARGEST`].
    TooLong(u64),
}

/// Reads one record after the other.
#[derive(Debug)]
pub(crate) struct Records<R> {
    reader: R,
    begun: bool,
    body: Vec<u8>,
}

impl<R: Read> Records<R> {
    /// From the first byte of a file on.
    pub(crate) fn new(reader: R) -> Self {
        Self { reader, begun: false, body: Vec::new() }
    }

    /// The next record of a kind that holds samples: schemas, channels, messages, chunks. Others are passed over; `None` at the end of data.
    ///
    /// # Errors
    /// [`Trouble`].
    pub(crate) fn read(&mut self) -> Result<Option<(u8, &[u8])>, Trouble> {
        if !self.begun {
            self.begun = true;
            let mut magic = [0; MAGIC.len()];
            self.reader.read_exact(&mut magic).map_err(read_failure)?;
            if magic != *MAGIC {
                return Err(Trouble::NoMagic);
            }
        }
        loop {
            let mut bytes = [0; RECORD_HEADER];
            self.reader.read_exact(&mut bytes).map_err(read_failure)?;
            let (kind, length) = header(&bytes).ok_or(Trouble::Cut)?;
            let mut body = (&mut self.reader).take(length);
            match kind {
                kind::DATA_END | kind::FOOTER => return Ok(None),
                kind::SCHEMA | kind::CHANNEL | kind::MESSAGE | kind::CHUNK => {
                    if length > LARGEST {
                        return Err(Trouble::TooLong(length));
                    }
                    // Grows with what is there, not with what is announced.
                    self.body.clear();
                    body.read_to_end(&mut self.body).map_err(Trouble::Io)?;
                    if self.body.len() as u64 != length {
                        return Err(Trouble::Cut);
                    }
                    return Ok(Some((kind, &self.body)));
                }
                _ => {
                    if io::copy(&mut body, &mut io::sink()).map_err(Trouble::Io)? != length {
                        return Err(Trouble::Cut);
                    }
                }
            }
        }
    }
}

fn read_failure(reason: io::Error) -> Trouble {
    if reason.kind() == io::ErrorKind::UnexpectedEof { Trouble::Cut } else { Trouble::Io(reason) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_length_beyond_the_file_is_noticed_before_memory_is_taken() {
        for (kind, length) in [(kind::CHUNK, LARGEST), (kind::CHUNK, u64::MAX), (kind::METADATA, u64::MAX)] {
            let mut bytes = MAGIC.to_vec();
            bytes.push(kind);
            bytes.extend(length.to_le_bytes());
            bytes.extend([7; 100]);
            let mut records = Records::new(bytes.as_slice());
            assert!(records.read().is_err());
            assert!(records.body.capacity() < 4096);
        }
        // A text, an array of records: their announced lengths are looked for in what is there.
        assert!(Chunk::parse(&[0xff; 60]).is_none());
        assert!(Channel::parse(&[0xff; 60]).is_none() && Schema::parse(&[0xff; 60]).is_none());
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes: Vec<u8>, kind in 3_u8..8) {
            let mut file = MAGIC.to_vec();
            file.push(kind);
            file.extend((bytes.len() as u64).to_le_bytes());
            file.extend(&bytes);
            let mut records = Records::new(file.as_slice());
            while let Ok(Some((_, body))) = records.read() {
                if let Some(chunk) = Chunk::parse(body) {
                    prop_assert!(chunk.iter().count() <= body.len());
                    let _ = chunk.intact();
                }
                let _ = (Channel::parse(body), Schema::parse(body), message(body), log_time(body));
            }
        }
    }
}
