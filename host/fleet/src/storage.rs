//! Objects in buckets: `s3://BUCKET/KEY`, `gs://BUCKET/KEY` and `az://CONTAINER/KEY`.
//!
//! Credentials and endpoints come from the usual environment variables, which begin with `AWS_`, `GOOGLE_` or `AZURE_`.

#[cfg(feature = "buckets")]
mod bucket;
#[cfg(not(feature = "buckets"))]
#[path = "storage/without.rs"]
mod bucket;

use std::path::Path;

use pam_data::error::{DataCode, Error, Result};

pub(crate) use bucket::{check, list, put, read};

/// Schemes of buckets.
const SCHEMES: [&str; 3] = ["s3", "gs", "az"];

/// Whether a name is the address of an object in a bucket.
pub(crate) fn is_remote(name: &str) -> bool {
    name.split_once("://").is_some_and(|(scheme, _)| SCHEMES.contains(&scheme))
}

/// The bytes of an object that must exist.
pub(crate) fn read_existing(address: &str) -> Result<Vec<u8>> {
    read(address)?.ok_or_else(|| {
        Error::new(DataCode::FileUnreadable, "the bucket has no such object")
            .file(Path::new(address))
            .help("look at the names of the objects in the bucket: an address is s3://BUCKET/KEY")
    })
}

/// Refuses the address of a bucket where only a folder of this machine will do.
pub(crate) fn local_only(path: &Path) -> Result<()> {
    let address = path.to_string_lossy();
    if !is_remote(&address) {
        return Ok(());
    }
    Err(Error::new(DataCode::CallInvalid, "results in a bucket are not read here")
        .value(&address)
        .help("copy the results to this machine first, such as with `aws s3 sync ADDRESS results`"))
}
