use std::io::Write;
use std::path::{Path, PathBuf};

use super::grid::Grid;
use crate::error::Error;
use crate::recording::import_guess::guess;
use crate::recording::{Import, Missing, Reader, Recording};

/// The workbooks are made by `fixtures/make_workbooks.py` with openpyxl and odfpy; they hold the 40 rows of `recording.csv`.
fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn assert_the_rows_of_the_text(name: &str, read: Result<Vec<Recording>, Error>) {
    let text = Reader::new().file(&fixture("recording.csv")).unwrap().remove(0);
    let mut read = read.unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(read.len(), 1, "{name}");
    assert!(read.remove(0).same_rows(&text), "{name}");
}

#[test]
fn a_workbook_gives_the_rows_of_the_text() {
    for name in ["recording.xlsx", "recording.ods"] {
        assert_the_rows_of_the_text(name, Reader::new().file(&fixture(name)));
    }
    for name in ["two_sheets.xlsx", "two_sheets.ods"] {
        let reader = Reader { sheet: Some("Run 1".into()), ..Reader::new() };
        assert_the_rows_of_the_text(name, reader.file(&fixture(name)));
        let import = Import::parse("sheet = \"Run 1\"\ndelimiter = \"semicolon\"\n").unwrap();
        assert_the_rows_of_the_text(name, Reader::new().import(Some(&import)).file(&fixture(name)));
    }
}

#[test]
fn lines_above_the_table_and_other_names_are_guessed() {
    let guessed = guess(&fixture("titled.xlsx"), None).unwrap();
    assert_eq!((guessed.sheet.as_deref(), guessed.skip_lines), (Some("Data"), 3));
    let import = Import::parse(&guessed.description).unwrap();
    assert_the_rows_of_the_text("titled", Reader::new().import(Some(&import)).file(&fixture("titled.xlsx")));
}

#[test]
fn numbers_that_a_sheet_holds_as_text_and_notes_beside_its_table_are_described() {
    let guessed = guess(&fixture("text_numbers.xlsx"), None).unwrap();
    assert!(
        guessed.split_by.is_empty() && guessed.description.contains("decimal = \"comma\""),
        "{guessed:?}"
    );
    assert_eq!(guessed.unused, ["column 6", "column 8"]);
    let import = Import::parse(&guessed.description).unwrap();
    assert_the_rows_of_the_text(
        "text",
        Reader::new().import(Some(&import)).file(&fixture("text_numbers.xlsx")),
    );
    // A description of text files with decimal commas reads the numbers of a sheet.
    let import = Import::parse("decimal = \"comma\"\n").unwrap();
    assert_the_rows_of_the_text(
        "numbers",
        Reader::new().import(Some(&import)).file(&fixture("recording.xlsx")),
    );
}

#[test]
fn workbooks_that_are_not_recordings_are_reported_with_the_remedy() {
    let message = |name: &str, reader: &Reader<'_>| {
        let error = reader.file(&fixture(name)).expect_err(name);
        format!("{error} | {}", error.advice().unwrap_or_default())
    };
    let plain = Reader::new();
    let several = message("two_sheets.xlsx", &plain);
    assert!(
        several.contains("2 sheets with contents: notes, Run 1") && several.contains("--sheet"),
        "{several}"
    );
    assert!(message("two_sheets.ods", &plain).contains("notes & more, Run 1"));
    let wrong = Reader { sheet: Some("Run 2".into()), ..Reader::new() };
    assert!(message("two_sheets.xlsx", &wrong).contains("its sheets are notes, Run 1"));
    assert!(message("dates.xlsx", &plain).contains("dates and times of day need unit = \"timestamp\""));
    // The row of a spreadsheet is the line of the message.
    let missing = message("missing_value.xlsx", &plain);
    assert!(
        missing.contains("missing_value.xlsx:5, column force_N") && missing.contains("--missing skip"),
        "{missing}"
    );
}

#[test]
fn dates_of_a_sheet_are_read_as_time_stamps() {
    let import = Import::parse("[columns.time]\ncolumn = 1\nunit = \"timestamp\"\n").unwrap();
    let dated = Reader::new().import(Some(&import)).file(&fixture("dates.xlsx")).unwrap().remove(0);
    let plain = Reader::new().file(&fixture("recording.xlsx")).unwrap().remove(0);
    // 2024-05-01 10:00 UTC.
    assert!((dated.time[0] - 1_714_557_600.0).abs() < 1e-3, "{}", dated.time[0]);
    for (dated, plain) in dated.time.iter().zip(&plain.time) {
        assert!((dated - 1_714_557_600.0 - plain).abs() < 1e-3, "{dated} {plain}");
    }
}

#[test]
fn rows_with_an_empty_cell_are_left_out_by_choice() {
    let reader = Reader { missing: Some(Missing::Skip), ..Reader::new() };
    let read = reader.file(&fixture("missing_value.xlsx")).unwrap().remove(0);
    assert_eq!((read.len(), read.skipped), (38, 2));
    assert!((read.time[3] - 0.4).abs() < 1e-12);
}

#[test]
fn damaged_workbooks_are_errors_or_their_own_rows() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["recording.xlsx", "recording.ods"] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let path = folder.path().join(name);
        for k in 1..16 {
            std::fs::write(&path, &whole[..whole.len() * k / 16]).unwrap();
            let error = Reader::new().file(&path).expect_err("the directory of the archive is at its end");
            assert_eq!(error.exit_status(), 1, "{name} cut at {k}/16: {error}");
        }
        for k in 0..300 {
            let mut bytes = whole.clone();
            let at = whole.len() * k / 300;
            bytes[at] ^= 0x5a;
            std::fs::write(&path, bytes).unwrap();
            if let Err(error) = Reader::new().file(&path) {
                assert!(error.advised(), "{name} with a wrong byte at {at}: {error}");
            }
        }
    }
}

#[test]
fn cells_that_would_take_memory_without_bound_are_refused() {
    let mut grid = Grid::default();
    assert!(grid.put(0, 1000, "x").is_err() && grid.put(1 << 20, 0, "x").is_err());
    let mut wide = Grid::default();
    wide.put(0, 999, "x").unwrap();
    for row in 1..200_000 {
        wide.put(row, 0, "1").unwrap();
    }
    // 200,000 rows of 1000 cells would be 200 MB of delimiters.
    assert!(wide.into_text().is_err());
    let mut back = Grid::default();
    back.put(3, 1, "x").unwrap();
    assert!(back.put(2, 0, "x").is_err() && back.put(3, 0, "x").is_err());
}

#[test]
fn an_archive_that_unpacks_to_more_than_the_bound_is_refused() {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    zip.start_file("xl/workbook.xml", zip::write::SimpleFileOptions::default().compression_level(Some(1)))
        .unwrap();
    for _ in 0..=128 {
        zip.write_all(&vec![b' '; 1 << 20]).unwrap();
    }
    let archive = zip.finish().unwrap().into_inner();
    assert!(archive.len() < 4 << 20, "{}", archive.len());
    let file = tempfile::NamedTempFile::with_suffix(".xlsx").unwrap();
    std::fs::write(&file, archive).unwrap();
    let error = Reader::new().file(file.path()).unwrap_err();
    assert!(error.to_string().contains("unpacks to more than 128 MiB"), "{error}");
}

#[test]
fn other_archives_are_distinguished() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Reader::new().file(&path).unwrap_err().to_string()
    };
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    zip.start_file("a.csv", zip::write::SimpleFileOptions::default()).unwrap();
    let archive = zip.finish().unwrap().into_inner();
    assert!(message("a.zip", &archive).contains("not an Excel or OpenDocument workbook"));
    let mut old = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1".to_vec();
    old.resize(2048, 0);
    assert!(message("a.xls", &old).contains(".xls"));
}
