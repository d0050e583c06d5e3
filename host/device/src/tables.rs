//! Tables on a device: read, sent in pieces, read back, compared.

use model_core::check;
use model_core::link::endpoints::{BeginTable, CommitTable, GetInfo, GetStatus, ReadTable, SendTablePiece};
use model_core::link::messages::{
    PIECE, Refusal, Side, TableBegin, TableFault, TableInfo, TablePiece, TableRead,
};

use super::{Client, messages};
use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

/// Shortest piece that is tried on a noisy line, bytes.
const SMALLEST: usize = 32;
/// Times that a commit is requested when its answers are lost.
const COMMITS: u32 = 20;

/// The image that a device keeps for a muscle; `None` when it has none.
///
/// # Errors
/// What the device refuses, silence, or [`DeviceCode::DeviceVerify`] when the bytes do not fit the device's own check sum.
pub fn read(client: &mut Client, side: Side) -> Result<Option<Vec<u8>>> {
    let info = client.call::<GetInfo>(&())?;
    let Some(kept) = info.tables[side.index()] else { return Ok(None) };
    let mut image = Vec::with_capacity(kept.length as usize);
    while image.len() < kept.length as usize {
        let offset = image.len() as u32;
        let piece = client.call::<ReadTable>(&TableRead { side, offset })?;
        if piece.offset != offset || piece.bytes.is_empty() {
            break;
        }
        image.extend_from_slice(&piece.bytes);
    }
    image.truncate(kept.length as usize);
    if image.len() != kept.length as usize || check::of_image(&image) != kept.crc {
        return Err(Error::new(
            DeviceCode::DeviceVerify,
            format!(
                "the device's table cannot be read back whole: {} of {} bytes, check sum {:08x} instead of {:08x}",
                image.len(),
                kept.length,
                check::of_image(&image),
                kept.crc
            ),
        )
        .help("send the table again; if the error returns, the memory of the device is failing"));
    }
    Ok(Some(image))
}

/// Commits an upload. The answer may be lost while the device is busy with its flash, and a second commit would be refused:
/// this function then queries the table in use instead.
fn commit(client: &mut Client, side: Side, crc: u32, before: Option<TableInfo>) -> Result<TableInfo> {
    let mut last = None;
    for _ in 0..COMMITS {
        match client.try_once::<CommitTable>(&()) {
            Ok(Ok(kept)) => return Ok(kept),
            Ok(Err(Refusal::Table(TableFault::NotBegun))) if last.is_some() => {}
            Ok(Err(refusal)) => return Err(messages::refused("table_commit", refusal)),
            Err(silent) => last = Some(silent),
        }
        let mut info = client.call::<GetInfo>(&());
        for _ in 0..2 {
            // Erasing flash takes seconds, in which a device says nothing.
            info = info.or_else(|_| client.call::<GetInfo>(&()));
        }
        match info?.tables[side.index()] {
            Some(kept) if kept.crc == crc && Some(kept) != before => return Ok(kept),
            _ => {}
        }
    }
    Err(last.unwrap_or_else(|| messages::refused("table_commit", Refusal::Table(TableFault::NotBegun))))
}

/// Sends an image, has it committed, reads it back and compares every byte. `progress` is reported the bytes sent.
///
/// A piece whose answer was lost is not sent twice: the device says how much it has.
///
/// # Errors
/// Refusals as text (the device keeps the table before), silence, or [`DeviceCode::DeviceVerify`].
pub fn write(
    client: &mut Client,
    side: Side,
    image: &[u8],
    mut progress: impl FnMut(usize),
) -> Result<TableInfo> {
    let capacity = client.call::<GetInfo>(&())?.table_capacity;
    let length = u32::try_from(image.len()).unwrap_or(u32::MAX);
    if length > capacity {
        return Err(messages::refused("table_begin", Refusal::Table(TableFault::TooLong(capacity))));
    }
    let crc = check::of_image(image);
    let before = client.call::<GetInfo>(&())?.tables[side.index()];
    client.call::<BeginTable>(&TableBegin { side, length, crc })?;
    let mut sent = 0;
    let mut size = PIECE;
    while sent < image.len() {
        let chunk = &image[sent..image.len().min(sent + size)];
        let bytes = heapless::Vec::from_slice(chunk).map_err(|_| {
            Error::new(DataCode::CallInvalid, "a piece of the table does not fit its message")
        })?;
        let there = match client.try_call::<SendTablePiece>(&TablePiece { offset: sent as u32, bytes }) {
            Ok(Ok(there) | Err(Refusal::Table(TableFault::Gap(there)))) => there as usize,
            Ok(Err(refusal)) => return Err(messages::refused("table_piece", refusal)),
            // A noisy line lets short frames pass where long ones break.
            Err(silent) if size > SMALLEST => {
                size /= 2;
                client.call::<GetStatus>(&()).map_err(|_| silent)?;
                continue;
            }
            Err(silent) => return Err(silent),
        };
        if there <= sent || there > image.len() {
            return Err(messages::refused("table_piece", Refusal::Table(TableFault::Gap(there as u32))));
        }
        sent = there;
        progress(sent);
    }
    let kept = commit(client, side, crc, before)?;
    let back = read(client, side)?.unwrap_or_default();
    if back != image {
        let at = back.iter().zip(image).position(|(a, b)| a != b).unwrap_or(back.len().min(image.len()));
        return Err(Error::new(
            DeviceCode::DeviceVerify,
            format!("the table read back differs from the one sent, first at byte {at} of {}", image.len()),
        )
        .help(
            "nothing was armed; send it again; if the error returns, the memory of the device is failing",
        ));
    }
    Ok(kept)
}
