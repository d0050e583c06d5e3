//! Bytes of a file, decompressed on the way when it is compressed.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use sha2::{Digest, Sha256};

use crate::error::{DataCode, Error, Result};
use crate::progress::Progress;

/// Compression is recognised by the first bytes, not by the name: files get renamed.
const GZIP: [u8; 2] = [0x1f, 0x8b];
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// Byte-order marks of UTF-16, in which spreadsheets save "Unicode text".
const UTF_16_LITTLE: [u8; 2] = [0xff, 0xfe];
const UTF_16_BIG: [u8; 2] = [0xfe, 0xff];

/// An open file, read from its beginning.
pub(super) struct Source {
    pub reader: Box<dyn Read + Send>,
    /// Size of the text if it is known in advance, bytes.
    pub size: Option<u64>,
    /// The first bytes of the file itself, before any decompression.
    pub magic: Vec<u8>,
    /// Whether it can be opened again: a pipe gives its bytes once.
    pub rereadable: bool,
    pub bytes: Bytes,
}

pub(super) fn open(path: &Path, progress: Option<&Arc<dyn Progress>>, hashed: bool) -> Result<Source> {
    let unreadable = |e: io::Error| Error::unreadable(path, &e);
    let mut file = File::open(path).map_err(unreadable)?;
    let meta = file.metadata().map_err(unreadable)?;
    if meta.is_dir() {
        return Err(Error::new(DataCode::FileUnreadable, "is a folder")
            .file(path)
            .help("name the files in it"));
    }
    let mut magic = Vec::new();
    (&mut file).take(512).read_to_end(&mut magic).map_err(unreadable)?;
    // A pipe cannot be rewound, so the bytes already read go in front again.
    let counting = CountingReader {
        bytes: io::Cursor::new(magic.clone()).chain(file),
        hash: hashed.then(Sha256::new),
        progress: progress.cloned(),
    };
    let bytes = Bytes(Arc::new(Mutex::new(counting)));
    let (whole, rereadable) = (bytes.clone(), meta.is_file());
    let mut size = None;
    let reader: Box<dyn Read + Send> = if magic.starts_with(&GZIP) {
        Box::new(flate2::read::MultiGzDecoder::new(whole))
    } else if magic.starts_with(&ZSTD) {
        Box::new(ruzstd::decoding::StreamingDecoder::new(whole).map_err(|e| {
            Error::new(DataCode::RecordingContainer, format!("damaged zstd file: {e}")).file(path)
        })?)
    } else if magic.starts_with(&UTF_16_BIG) || magic.starts_with(&UTF_16_LITTLE) {
        io::copy(&mut whole.clone().take(2), &mut io::sink()).map_err(unreadable)?;
        Box::new(Utf16::new(Box::new(whole), magic.starts_with(&UTF_16_BIG)))
    } else {
        size = rereadable.then_some(meta.len());
        Box::new(whole)
    };
    Ok(Source { reader, size, magic, rereadable, bytes })
}

/// A file that counts and hashes the bytes that are read.
struct CountingReader {
    bytes: io::Chain<io::Cursor<Vec<u8>>, File>,
    hash: Option<Sha256>,
    progress: Option<Arc<dyn Progress>>,
}

impl Read for CountingReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        if let Some(hash) = &mut self.hash {
            hash.update(&buffer[..count]);
        }
        if let Some(progress) = &self.progress {
            progress.add(count as u64);
        }
        Ok(count)
    }
}

/// The file itself, which a decompressor reads and whose hash is requested in the end.
#[derive(Clone)]
pub(super) struct Bytes(Arc<Mutex<CountingReader>>);

impl Bytes {
    /// SHA-256 of all bytes, including those that were not needed, in hexadecimal; `None` where it was not requested.
    pub(super) fn sha256(&self) -> io::Result<Option<String>> {
        let mut counting = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if counting.hash.is_none() {
            return Ok(None);
        }
        io::copy(&mut *counting, &mut io::sink())?;
        let hash = counting.hash.take();
        Ok(hash.map(|hash| hash.finalize().iter().map(|b| format!("{b:02x}")).collect()))
    }
}

impl Read for Bytes {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).read(buffer)
    }
}

/// UTF-16 as UTF-8, as it is read. What is not a character becomes the sign for that.
struct Utf16 {
    units: Box<dyn Read + Send>,
    big_endian: bool,
    /// The first byte of a unit whose second is still to come.
    half: Option<u8>,
    /// The first unit of a pair.
    high: Option<u16>,
    /// Decoded bytes that were not read yet.
    ready: io::Cursor<Vec<u8>>,
}

impl Utf16 {
    /// Behind the byte-order mark.
    fn new(units: Box<dyn Read + Send>, big_endian: bool) -> Self {
        Self { units, big_endian, half: None, high: None, ready: io::Cursor::default() }
    }

    /// The next characters; none at the end.
    fn decode(&mut self) -> io::Result<String> {
        let mut raw = [0; 1 << 13];
        let mut text = String::new();
        while text.is_empty() {
            let count = self.units.read(&mut raw)?;
            if count == 0 {
                text.extend(self.high.take().map(|_| char::REPLACEMENT_CHARACTER));
                break;
            }
            let bytes: Vec<u8> = self.half.take().into_iter().chain(raw[..count].iter().copied()).collect();
            let (pairs, rest) = bytes.as_chunks::<2>();
            self.half = rest.first().copied();
            let unit =
                |b: &[u8; 2]| if self.big_endian { u16::from_be_bytes(*b) } else { u16::from_le_bytes(*b) };
            let mut units: Vec<u16> = self.high.take().into_iter().chain(pairs.iter().map(unit)).collect();
            if units.last().is_some_and(|u| (0xd800..0xdc00).contains(u)) {
                self.high = units.pop();
            }
            text.extend(char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)));
        }
        Ok(text)
    }
}

impl Read for Utf16 {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.ready.position() == self.ready.get_ref().len() as u64 {
            self.ready = io::Cursor::new(self.decode()?.into_bytes());
        }
        self.ready.read(buffer)
    }
}

/// Refuses what is not text in UTF-8 or UTF-16, from the first block of it, and gives the length of a byte order mark to be skipped.
pub(super) fn check_text(first: &[u8]) -> Result<usize> {
    let not_text = |cause: &str, help: &str| Err(Error::new(DataCode::RecordingNotText, cause).help(help));
    if first.starts_with(&UTF_16_LITTLE) || first.starts_with(&UTF_16_BIG) {
        return not_text("the file is UTF-16 text", "save it as UTF-8, or as plain text");
    }
    if first.starts_with(b"PK\x03\x04") || first.starts_with(b"\xd0\xcf\x11\xe0") {
        return not_text(
            "the file is an Excel workbook or another archive, not text",
            "in the spreadsheet program, save the sheet as CSV (UTF-8)",
        );
    }
    if first.starts_with(b"\x89HDF") || first.starts_with(b"PAR1") {
        return not_text(
            "the file is a damaged HDF5 or Parquet file, not text",
            "copy the file again, or export its columns as CSV",
        );
    }
    let start = &first[..first.len().min(1 << 16)];
    if is_json(start) {
        return not_text(
            "the file is JSON, which is not read",
            "write it as CSV, with one row for each reading: in Python, pandas.read_json(FILE, lines=True).to_csv(OUT, index=False)",
        );
    }
    let end = start.iter().rposition(|b| *b != 0).map_or(0, |at| at + 1);
    if (1..start.len()).contains(&end) && memchr::memchr(0, &start[..end]).is_none() {
        return not_text(
            "the file ends in zero bytes: the program that wrote it was stopped before it wrote the last rows",
            "cut the zero bytes off, as `tr -d '\\000' < FILE > NEW` does",
        );
    }
    let zeros = memchr::memchr_iter(0, start).count();
    if zeros > 0 && zeros * 3 > start.len() && zeros * 3 < start.len() * 2 {
        return not_text(
            "the file looks like UTF-16 text without a mark",
            "save it as UTF-8, or as plain text",
        );
    }
    if zeros > 0 {
        return not_text(
            "the file is binary, not text",
            "give a CSV or tab-separated file with one header line",
        );
    }
    Ok(if first.starts_with(&[0xef, 0xbb, 0xbf]) { 3 } else { 0 })
}

/// Whether a text begins as JSON does, with an object that has a name, or with a list.
fn is_json(text: &[u8]) -> bool {
    let mut signs = text.iter().filter(|b| !b.is_ascii_whitespace());
    match (signs.next(), signs.next()) {
        (Some(b'{'), Some(b'"')) => true,
        (Some(b'['), Some(b'{')) => signs.next() == Some(&b'"'),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns at most a given number of bytes per call.
    struct Slowly(Vec<u8>, usize);

    impl Read for Slowly {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let count = self.1.min(buffer.len()).min(self.0.len());
            buffer[..count].copy_from_slice(&self.0[..count]);
            self.0.drain(..count);
            Ok(count)
        }
    }

    #[test]
    fn utf_16_is_read_whole_in_pieces_of_any_size() {
        let text = "time_s\t°C\t\u{1d53d}\u{20ac}\n".repeat(40);
        for big_endian in [false, true] {
            let bytes = |u: u16| if big_endian { u.to_be_bytes() } else { u.to_le_bytes() };
            let raw: Vec<u8> = text.encode_utf16().flat_map(bytes).collect();
            for (given, asked) in [(1, 1), (3, 2), (5, 7), (1 << 20, 1), (1 << 20, 1 << 20)] {
                let mut reader = Utf16::new(Box::new(Slowly(raw.clone(), given)), big_endian);
                let (mut all, mut some) = (Vec::new(), vec![0; asked]);
                loop {
                    let count = reader.read(&mut some).expect("bytes");
                    if count == 0 {
                        break;
                    }
                    all.extend_from_slice(&some[..count]);
                }
                assert_eq!(String::from_utf8(all).as_deref(), Ok(text.as_str()), "{given} {asked}");
            }
        }
    }
}
