//! Bytes of a file, decompressed on the way when it is compressed.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use crate::error::{Code, Error, Result};
use crate::progress::Progress;

/// Compression is recognised by the first bytes, not by the name: files get renamed.
const GZIP: [u8; 2] = [0x1f, 0x8b];
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// An open file, read from its beginning.
pub(super) struct Source {
    pub reader: Box<dyn Read + Send>,
    /// Size of the text if it is known beforehand, bytes.
    pub size: Option<u64>,
    /// The first bytes of the file itself, before any decompression.
    pub magic: Vec<u8>,
}

pub(super) fn open(path: &Path, progress: Option<&Arc<Progress>>) -> Result<Source> {
    let unreadable = |e: io::Error| Error::unreadable(path, &e);
    let mut file = File::open(path).map_err(unreadable)?;
    let meta = file.metadata().map_err(unreadable)?;
    if meta.is_dir() {
        return Err(Error::new(Code::FileUnreadable, "is a folder").file(path).help("name the files in it"));
    }
    let counted = |file: File| Counted { file, progress: progress.cloned() };
    let mut magic = Vec::new();
    (&mut file).take(512).read_to_end(&mut magic).map_err(unreadable)?;
    if magic.starts_with(&GZIP) || magic.starts_with(&ZSTD) {
        // A pipe cannot be rewound, so the bytes already read go in front again.
        let whole = io::Cursor::new(magic.clone()).chain(counted(file));
        let reader: Box<dyn Read + Send> = if magic.starts_with(&GZIP) {
            Box::new(flate2::read::MultiGzDecoder::new(whole))
        } else {
            let decoder = ruzstd::decoding::StreamingDecoder::new(whole).map_err(|e| {
                Error::new(Code::RecordingContainer, format!("damaged zstd file: {e}")).file(path)
            })?;
            Box::new(decoder)
        };
        return Ok(Source { reader, size: None, magic });
    }
    if meta.is_file() {
        file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
        return Ok(Source { reader: Box::new(counted(file)), size: Some(meta.len()), magic });
    }
    Ok(Source { reader: Box::new(io::Cursor::new(magic.clone()).chain(counted(file))), size: None, magic })
}

/// A file that tells how far it is read.
struct Counted {
    file: File,
    progress: Option<Arc<Progress>>,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        if let Some(progress) = &self.progress {
            progress.add(count as u64);
        }
        Ok(count)
    }
}

/// Refuses what is not UTF-8 text, from the first block of it, and gives the length of a byte order mark to be skipped.
pub(super) fn check_text(first: &[u8]) -> Result<usize> {
    let not_text = |cause: &str, help: &str| Err(Error::new(Code::RecordingNotText, cause).help(help));
    if first.starts_with(&[0xff, 0xfe]) || first.starts_with(&[0xfe, 0xff]) {
        return not_text("the file is UTF-16 text", "save it as UTF-8, or as plain text");
    }
    if first.starts_with(b"\x89HDF") || first.starts_with(b"PAR1") || first.starts_with(b"PK\x03\x04") {
        return not_text(
            "the file is a container, not text",
            "see the manual for the formats that are read directly",
        );
    }
    let head = &first[..first.len().min(1 << 16)];
    let zeros = memchr::memchr_iter(0, head).count();
    if zeros > 0 && zeros * 3 > head.len() && zeros * 3 < head.len() * 2 {
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
