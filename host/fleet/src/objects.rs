//! Results in a bucket: the files of a muscle under `OUT/muscle=NAME/`.
//!
//! A bucket cannot rename a folder, so the files of a muscle appear one by one, each whole, and `fits.parquet` last. A muscle counts as
//! complete when all four tables hold the key of its inputs; an interrupted one is computed again.

use pam_data::error::Result;

use crate::columns::{footer, rows};
use crate::partition::{KEY, TABLES, folder_name};
use crate::storage;

/// The output of a batch in a bucket.
#[derive(Debug)]
pub(crate) struct Objects {
    root: String,
}

impl Objects {
    /// An output at an address such as `s3://bucket/results`.
    ///
    /// # Errors
    /// A bucket that does not exist, or refuses the credentials.
    pub(crate) fn open(root: &str) -> Result<Self> {
        let root = root.trim_end_matches('/').to_owned();
        storage::check(&root)?;
        Ok(Self { root })
    }

    /// The address of a file. The percent signs of the folder's name belong to the key, so they are encoded once more in an address.
    fn address(&self, muscle: &str, file: &str) -> String {
        format!("{}/{}/{file}", self.root, folder_name(muscle).replace('%', "%25"))
    }

    fn table(&self, muscle: &str, table: &str) -> Option<bytes::Bytes> {
        // What cannot be read counts as absent: it is computed again, and writing it reports what is wrong.
        storage::read(&self.address(muscle, &format!("{table}.parquet")))
            .ok()
            .flatten()
            .map(bytes::Bytes::from)
    }

    /// Whether results for this key are there, complete.
    pub(crate) fn has(&self, muscle: &str, key: &str) -> bool {
        TABLES
            .iter()
            .all(|table| self.table(muscle, table).is_some_and(|b| footer(b, KEY).as_deref() == Some(key)))
    }

    /// Whether the stored results of a muscle list a failure.
    pub(crate) fn has_failures(&self, muscle: &str) -> bool {
        self.table(muscle, "failures").is_some_and(|b| rows(b) > 0)
    }

    /// Writes the results of a muscle, those that make it complete last.
    pub(crate) fn publish(&self, muscle: &str, files: &[(String, Vec<u8>)]) -> Result<()> {
        let last = |name: &str| name == "fits.parquet";
        let order = files.iter().filter(|f| !last(&f.0)).chain(files.iter().filter(|f| last(&f.0)));
        for (name, bytes) in order {
            storage::put(&self.address(muscle, name), bytes.clone())?;
        }
        Ok(())
    }
}
