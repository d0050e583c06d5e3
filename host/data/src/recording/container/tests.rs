use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::recording::import_guess::guess;
use crate::recording::{Import, Quantity, Reader, Recording};

/// The fixtures are made by `fixtures/make.py` with SciPy, h5py, pandas, pyarrow and polars; all hold the same 40 rows.
fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// Whether this build reads a file of that name.
fn is_read(name: &str) -> bool {
    let hdf5 = name.ends_with(".h5") || name.contains("_v73");
    (cfg!(feature = "hdf5") || !hdf5) && (cfg!(feature = "parquet") || !name.ends_with(".parquet"))
}

fn read(name: &str) -> Result<Vec<Recording>, Error> {
    Reader::new().file(&fixture(name))
}

fn assert_the_rows_of_the_text(name: &str, read: &[Recording]) {
    let text = Reader::new().file(&fixture("recording.csv")).unwrap();
    let close = |a: &[f64], b: &[f64]| {
        a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() <= 1e-12 * x.abs().max(1e-6))
    };
    assert_eq!(read.len(), 1, "{name}");
    assert!(close(&read[0].time, &text[0].time), "{name}: time");
    assert!(close(&read[0].pressure, &text[0].pressure), "{name}: pressure");
    assert!(close(&read[0].stroke, &text[0].stroke), "{name}: stroke");
    assert!(close(read[0].require_force().unwrap(), text[0].require_force().unwrap()), "{name}: force");
}

const READ: [&str; 18] = [
    "recording_v5.mat",
    "recording_v5_packed.mat",
    "recording_struct.mat",
    "recording.csv.gz",
    "recording.csv.zst",
    "recording.tsv",
    "recording_v73.mat",
    "recording_v73_struct.mat",
    "recording_h5py.h5",
    "recording_latest.h5",
    "recording_compound.h5",
    "recording_pandas_fixed.h5",
    "recording_pandas_table.h5",
    "recording_zstd.parquet",
    "recording_snappy.parquet",
    "recording_pandas.parquet",
    "recording_pandas_index.parquet",
    "recording_types.parquet",
];

#[test]
fn every_container_gives_the_rows_of_the_text() {
    for name in READ.into_iter().filter(|n| is_read(n)) {
        assert_the_rows_of_the_text(name, &read(name).unwrap_or_else(|e| panic!("{name}: {e}")));
    }
}

#[test]
fn columns_of_a_matrix_are_taken_by_their_numbers() {
    let description = "header = false\n[columns.time]\ncolumn = \"data(:,1)\"\nunit = \"s\"\n\
                       [columns.pressure]\ncolumn = \"data(:,2)\"\nunit = \"kPa\"\n\
                       [columns.displacement]\ncolumn = \"data(:,3)\"\nunit = \"mm\"\n\
                       [columns.force]\ncolumn = \"data(:,4)\"\nunit = \"N\"\n";
    let import = Import::parse(description).unwrap();
    for name in ["matrix.h5", "matrix_v73.mat"].into_iter().filter(|n| is_read(n)) {
        let read = Reader::new().import(Some(&import)).file(&fixture(name));
        assert_the_rows_of_the_text(name, &read.unwrap_or_else(|e| panic!("{name}: {e}")));
    }
}

#[test]
fn columns_of_a_matrix_have_no_names_to_guess_from() {
    if !is_read("matrix.h5") {
        return;
    }
    let guessed = guess(&fixture("matrix.h5"), None).unwrap();
    assert!(guessed.columns.iter().all(|c| c.quantity == Quantity::Time), "{}", guessed.description);
    let unknown = guessed.all_unknown();
    assert!(unknown.starts_with("the columns of a matrix have no names"), "{unknown}");
}

#[test]
fn files_that_are_not_recordings_are_reported_with_the_column_and_the_remedy() {
    let cases = [
        ("dates.parquet", "time_s", "a column of dates where numbers are needed"),
        ("durations.parquet", "time_s", "a column of durations where numbers are needed"),
        ("text.parquet", "force_N", "a column of text where numbers are needed"),
        ("text.h5", "force_N", "a column of text where numbers are needed"),
        ("missing_value.parquet", "force_N", "not a finite number"),
        ("missing_column.parquet", "pressure", "no column"),
        ("brotli.parquet", "Parquet", "brotli"),
        ("table_v73.mat", "`T`", "MATLAB's type `table`"),
    ];
    for (name, place, cause) in cases.into_iter().filter(|(n, ..)| is_read(n)) {
        let error = read(name).expect_err(name);
        let message = error.to_string().to_lowercase();
        let (place, cause) = (place.to_lowercase(), cause.to_lowercase());
        assert!(message.contains(&cause) && message.contains(&place), "{name}: {message}");
        assert!(error.advised(), "{name}: {message}");
        assert_eq!(error.exit_status(), 1, "{name}: {message}");
    }
}

#[test]
fn damaged_containers_are_errors_or_their_own_rows() {
    let folder = tempfile::tempdir().unwrap();
    let reads = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Reader::new().file(&path)
    };
    for name in READ.into_iter().filter(|n| is_read(n) && !n.contains(".csv") && !n.ends_with(".tsv")) {
        let whole = std::fs::read(fixture(name)).unwrap();
        for k in 1..16 {
            let cut = whole.len() * k / 16;
            // A cut may leave whole columns; then a required one is missing, or shorter than the others. What is behind the
            // last column may be missing without harm.
            match reads(name, &whole[..cut]) {
                Err(error) => assert_eq!(error.exit_status(), 1, "{name} cut at {cut}: {error}"),
                Ok(read) => assert_the_rows_of_the_text(name, &read),
            }
        }
        // A wrong byte in the numbers themselves gives other numbers; anywhere else it must end in an error, not in a panic.
        for k in 0..200 {
            let at = whole.len() * k / 200;
            let mut bytes = whole.clone();
            bytes[at] ^= 0x5a;
            if let Err(error) = reads(name, &bytes) {
                assert_eq!(error.exit_status(), 1, "{name} with a wrong byte at {at}: {error}");
            }
        }
    }
}
