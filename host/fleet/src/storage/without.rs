//! A program that was built without buckets.

use pam_data::error::{DataCode, Error, Result};

fn refused(address: &str) -> Error {
    Error::new(DataCode::CallInvalid, "this program was built without buckets").value(address).help(
        "build it with `cargo build --release --package host --features buckets`, or copy the files to this machine",
    )
}

pub(crate) fn check(address: &str) -> Result<()> {
    Err(refused(address))
}

pub(crate) fn read(address: &str) -> Result<Option<Vec<u8>>> {
    Err(refused(address))
}

pub(crate) fn list(pattern: &str, _most: usize) -> Result<Vec<String>> {
    Err(refused(pattern))
}

pub(crate) fn put(address: &str, _bytes: Vec<u8>) -> Result<()> {
    Err(refused(address))
}
