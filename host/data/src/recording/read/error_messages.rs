//! Errors of reading as messages: cause, place, and remedy.

use crate::error::{DataCode, Error};
use crate::pluralise::pluralise;
use crate::recording::blocks::{BlockError, RowsError};
use crate::recording::cells::{Fault, LineError, only_signs};
use crate::recording::header::Header;
use crate::recording::import::{Decimal, Import};

/// The error of a file whose lines cannot be read.
pub(super) fn block_error(error: BlockError) -> Error {
    match error {
        BlockError::LongLine => {
            Error::new(DataCode::RecordingNotText, "the file has a line of more than 4 MiB")
                .help("this is not a table of text: give a CSV or tab-separated file with one header line")
        }
        BlockError::Io(e) => unpacked(e),
    }
}

/// The error of a file that is open and cannot be read, or unpacked, to its end.
pub(in crate::recording) fn unpacked(error: std::io::Error) -> Error {
    match error.kind() {
        std::io::ErrorKind::NotFound => Error::unreadable("", &error),
        std::io::ErrorKind::PermissionDenied => {
            Error::new(DataCode::FileUnreadable, format!("cannot be read: {error}"))
        }
        _ => {
            // What follows a colon is the unpacker's own, written for its authors.
            let reason = error.to_string();
            let reason = reason.split(':').next().unwrap_or_default();
            Error::new(DataCode::RecordingContainer, format!("cannot be read to its end: {reason}"))
                .help("the file may be damaged or incomplete: copy it again")
        }
    }
}

/// The error of a row: line, column, value, and remedy.
pub(super) fn rows_error(error: RowsError, header: &Header, import: &Import) -> Error {
    let LineError { line, cell, value, fault } = match error {
        RowsError::Block(e) => return block_error(e),
        RowsError::TooMany(e) => return e,
        RowsError::Line(e) => *e,
    };
    let separator = match header.dialect.delimiter {
        b'\t' => "tabs",
        b';' => "semicolons",
        b' ' => "blanks",
        _ => "commas",
    };
    let error = match &fault {
        Fault::Empty => Error::new(DataCode::RecordingNotANumber, "empty cell")
            .help("every row needs a number in every column that is used; --missing skip leaves incomplete rows out"),
        Fault::NotFinite => Error::new(DataCode::RecordingNotFinite, "not a finite number")
            .help("--missing skip leaves such rows out; missing values are never filled in"),
        Fault::NotANumber => {
            let comma =
                value.contains(',') && value.chars().all(|c| c.is_ascii_digit() || ",.-+ ".contains(c));
            let of_a_clock = value.contains(':') || value.matches(['-', '/']).count() == 2;
            let help = if header.names.contains(&value) {
                "the names of the columns stand here again, in another order or with other columns: make one file of each part"
            } else if of_a_clock && value.starts_with(|c: char| c.is_ascii_digit()) {
                "dates and times of day need unit = \"timestamp\" in an import description, which `host import --guess` writes; or write \
                 seconds from some beginning (in a spreadsheet =(A2-A$2)*86400)"
            } else if value.contains(',') && value.contains('.') {
                "write numbers without thousands separators, or give thousands = \",\" or \".\" in an import description"
            } else if comma && !header.dialect.decimal_comma {
                "use a decimal point, or an import description with decimal = \"comma\""
            } else if header.dialect.decimal_comma && value.contains('.') && import.decimal == Decimal::Comma
            {
                "the import description specifies decimal commas"
            } else if header.dialect.decimal_comma && value.contains('.') {
                "this file's first row has decimal commas: write numbers without thousands separators"
            } else if only_signs(&value) {
                "signs without digits usually mark a missing value: --missing skip leaves such rows out"
            } else {
                "every cell of a column that is used must be a number"
            };
            Error::new(DataCode::RecordingNotANumber, "not a number").help(help)
        }
        Fault::NotAStamp => Error::new(DataCode::RecordingNotANumber, "not a time stamp").help(
            "time stamps are like 2026-11-21T13:30:00.25, 21.11.2026 13:30:00, or 13:30:00.25; a month before the day is ambiguous",
        ),
        Fault::NotADate => Error::new(DataCode::RecordingNotANumber, "not a date")
            .help("dates are like 2026-11-21 or 21.11.2026; a month before the day needs unit = \"timestamp-month-first\""),
        Fault::Width { found, expected } => {
            let cells = pluralise(found, "cell");
            let help = if *found == 2 * expected && separator == "commas" {
                "these look like decimal commas: use a decimal point, or an import description with decimal = \"comma\""
                    .to_owned()
            } else if let Some(sign) = value.chars().next().filter(|c| "%;!/'*".contains(*c)) {
                format!(
                    "cells are separated by {separator}; if lines that begin with {sign} are remarks, write comment = \"{sign}\" in an import \
                     description"
                )
            } else {
                format!("cells are separated by {separator}; the line may be incomplete or damaged")
            };
            Error::new(DataCode::RecordingWrongWidth, format!("{cells} where {expected} are expected"))
                .help(help)
        }
        Fault::OpenQuote => {
            Error::new(DataCode::RecordingWrongWidth, "a quotation mark is not closed on its line")
                .help("cells that hold line breaks are not supported")
        }
    };
    let error = error.line(header.lines + line + 1).value(value);
    match cell.and_then(|c| header.names.get(c)) {
        Some(name) => error.column(name.clone()),
        None => error,
    }
}
