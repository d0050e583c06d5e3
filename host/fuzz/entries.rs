//! What bytes from outside reach: one function for each kind of input. `cargo fuzz` calls them without end, the ordinary tests for some
//! seconds. They return for any bytes; a panic, or a value that breaks a promise, is a finding.
#![allow(clippy::unwrap_used, dead_code, reason = "a helper of tests: a failure here is a finding")]

use std::io::Write;

#[path = "entries/device.rs"]
pub mod device;
#[path = "entries/workbook.rs"]
pub mod workbook;

use model_core::image;
use model_core::link::frame::{Accumulator, Header, MAX_BODY, MAX_WIRE, encode_bytes};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::import_guess::guess;
use pam_data::recording::{Import, Reader, Recording};
use pam_device::log_table::LogTable;
use pam_device::recorder::recover;
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use pam_fit::table_file::{TableFile, VERSION};

/// Panics in the libraries that read HDF5, Parquet and workbooks end in an error of the program, which is what is promised; only the others
/// are findings. Called once, after the fuzzer has installed its own handling.
pub fn tolerate_caught_panics() {
    let own = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !info.location().is_some_and(|place| place.file().contains("/registry/")) {
            own(info);
        }
    }));
}

/// Frames on the wire: what is taken for a frame is encoded to the same bytes again.
pub fn frame(bytes: &[u8]) {
    let mut accumulator = Accumulator::new();
    for &byte in bytes {
        let Some(Ok(frame)) = accumulator.push(byte) else { continue };
        assert!(frame.body.len() <= MAX_BODY);
        let (header, body) = (frame.header, frame.body.to_vec());
        let mut wire = [0; MAX_WIRE];
        let length = encode_bytes(header, &body, &mut wire).unwrap();
        let mut again = Accumulator::new();
        let mut found: Option<(Header, Vec<u8>)> = None;
        for &byte in &wire[..length] {
            if let Some(Ok(frame)) = again.push(byte) {
                found = Some((frame.header, frame.body.to_vec()));
            }
        }
        assert_eq!(found, Some((header, body)));
    }
}

/// The image of a table: what is read is written to the same bytes again.
pub fn image(bytes: &[u8]) {
    let _ = image::announced_len(bytes);
    if let Ok(table) = image::read(bytes) {
        let mut buffer = [0; image::MAX_LEN];
        // Bytes behind an image are ignored.
        let length = image::announced_len(bytes).unwrap();
        assert_eq!(image::write(&table, &mut buffer).unwrap(), &bytes[..length]);
    }
}

fn file(bytes: &[u8], suffix: &str) -> tempfile::NamedTempFile {
    let mut file = tempfile::Builder::new().suffix(suffix).tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file
}

fn sound(recordings: &[Recording]) {
    for r in recordings {
        let columns = [Some(&r.pressure), Some(&r.stroke), r.force.as_ref()];
        assert!(columns.into_iter().flatten().all(|c| c.len() == r.time.len()));
        assert!(columns.into_iter().flatten().flatten().all(|v| v.is_finite()));
        assert!(r.time.windows(2).all(|w| w[0] < w[1]));
    }
}

/// Recordings of any form, which is recognised by the first bytes: text, compressed text, MATLAB, HDF5, Parquet, MCAP, TDMS, workbooks. Each form
/// is a target with seeds of its own.
pub fn reader(bytes: &[u8]) {
    if let Ok(recordings) = Reader::new().file(file(bytes, ".csv").path()) {
        sound(&recordings);
    }
}

/// An import description and a muscle's description before a zero byte, a recording behind it.
pub fn import(bytes: &[u8]) {
    let (text, rows) = bytes.split_at(bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len()));
    let Ok(text) = std::str::from_utf8(text) else { return };
    let _ = MuscleDescription::parse(text);
    if let Ok(import) = Import::parse(text)
        && let Ok(recordings) =
            Reader::new().import(Some(&import)).file(file(rows.get(1..).unwrap_or_default(), ".csv").path())
    {
        sound(&recordings);
    }
}

/// A file to be described: the description can be read, and the file with it or not at all.
pub fn import_guess(bytes: &[u8]) {
    let file = file(bytes, ".csv");
    let Ok(guessed) = guess(file.path(), None) else { return };
    // A description says what is missing; what it does say can be read.
    if let Ok(import) = Import::parse(&guessed.description)
        && let Ok(recordings) = Reader::new().import(Some(&import)).file(file.path())
    {
        sound(&recordings);
    }
}

/// A table file: what is read is written to the same bytes again; a file of an older version, to bytes that say the same.
pub fn table_file(bytes: &[u8]) {
    if let Ok(table) = TableFile::from_bytes(bytes) {
        let written = table.to_bytes().unwrap();
        if bytes[4..6] == VERSION.to_le_bytes() {
            assert_eq!(written, bytes);
        } else {
            assert_eq!(TableFile::from_bytes(&written).unwrap(), table);
        }
    }
}

/// An MCAP: read as it is, and after what is whole in it was recovered.
pub fn mcap(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("run.mcap.part");
    std::fs::write(&part, bytes).unwrap();
    let _ = Reader::new().file(&part);
    if let Ok(found) = recover(&part)
        && let Some(recording) = found.recording
    {
        // The bytes are in the recording or in the original.
        assert!(found.original.is_some() || found.tally.bytes_lost == 0);
        let _ = Reader::new().file(&recording);
    }
}

/// Log frames of the firmware, and the image that names their texts.
pub fn log(bytes: &[u8]) {
    let _ = LogTable::parse(bytes);
    let formats = [
        (1, "defmt_info", "plain"),
        (2, "defmt_warn", "{=u8} {=i16} {=u32} {=f32} {=bool}"),
        (3, "defmt_error", "{=str} {=[u8]} {0=u8}"),
        (4, "defmt_info", "{=u64:us} {=istr} {}"),
    ];
    let _ = LogTable::of_formats(&formats, Some("{=u64:us}")).decode(bytes);
}

/// A setpoint profile as a user writes it.
pub fn setpoint_profile(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    // Behind this sign stands the name of a file.
    if text.trim_start().starts_with('@') {
        return;
    }
    for quantity in [Quantity::Force, Quantity::Pressure, Quantity::Angle { stiffness_nm_per_rad: 1.0 }] {
        let _ = SetpointProfile::parse(text, quantity);
    }
}
