//! The ZIP archive of a workbook.

use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::super::column_table::damaged;
use super::grid::too_large;
use crate::bounds::WHOLE;
use crate::error::{DataCode, Error, Result};

/// Files in a workbook; one with thousands of sheets has fewer.
const FILES: usize = 10_000;

/// What is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Excel,
    OpenDocument,
}

/// What a ZIP archive is, after all of it was unpacked once to see that it is within the bound: sizes that an archive states may be wrong.
pub(super) fn kind(bytes: &[u8]) -> Result<Kind> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    if archive.len() > FILES {
        return Err(damaged(format!("the archive holds {} files", archive.len())));
    }
    let mut left = WHOLE;
    let mut kind = None;
    for index in 0..archive.len() {
        let mut file = archive.by_index(index).map_err(damaged)?;
        let name = file.name().map_err(damaged)?.to_ascii_lowercase();
        kind = kind.or(match name.as_str() {
            "xl/workbook.xml" => Some(Kind::Excel),
            "content.xml" => Some(Kind::OpenDocument),
            _ => None,
        });
        let unpacked = if name.ends_with("sharedstrings.xml") {
            let mut text = Vec::new();
            (&mut file).take(left + 1).read_to_end(&mut text).map_err(damaged)?;
            check_strings(&text)?;
            text.len() as u64
        } else {
            std::io::copy(&mut (&mut file).take(left + 1), &mut std::io::sink()).map_err(damaged)?
        };
        left = left.checked_sub(unpacked).ok_or_else(too_large)?;
    }
    kind.ok_or_else(|| {
        Error::new(DataCode::RecordingContainer, "this ZIP archive is not an Excel or OpenDocument workbook")
            .help("unpack it and name the files in it, or save the sheet as .xlsx or CSV")
    })
}

/// A count of strings that the file states is reserved by the reader, so that one beyond the file's own size is refused here.
fn check_strings(text: &[u8]) -> Result<()> {
    let plain = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    if plain.first().is_some_and(|b| *b != b'<') || plain.get(1) == Some(&0) {
        return Err(damaged("its list of texts is not in UTF-8"));
    }
    const COUNT: &[u8] = b"uniqueCount";
    for at in memchr::memmem::find_iter(text, COUNT) {
        let digits = text[at + COUNT.len()..].iter().skip_while(|b| b" =\"'\t\r\n".contains(b));
        let count = digits
            .take_while(|b| b.is_ascii_digit())
            .fold(0_usize, |n, b| n.saturating_mul(10).saturating_add(usize::from(b - b'0')));
        if count > text.len() {
            return Err(damaged("its list of texts states more entries than it has"));
        }
    }
    Ok(())
}

/// One file of the archive as text.
pub(super) fn text(bytes: &[u8], name: &str) -> Result<String> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    let file = archive.by_name(name).map_err(damaged)?;
    let mut text = String::new();
    file.take(WHOLE).read_to_string(&mut text).map_err(damaged)?;
    Ok(text)
}
