//! Where the rows and events of a campaign go: to the disk, or to memory in simulations.

use std::path::{Path, PathBuf};

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_data::recording::Recording;

use super::{read, recording};
use crate::actuation::Reading;
use crate::journal::{Completion, Event, Journal};

/// Where rows and events go.
pub(super) trait Sink {
    fn begin(&mut self, number: u32, name: &str) -> Result<()>;
    fn row(&mut self, reading: &Reading) -> Result<()>;
    fn finish(&mut self, completion: Completion, rows: &[Reading]) -> Result<(String, u64)>;
    fn event(&mut self, event: Event) -> Result<()>;
    fn recording(&self, file: &str, rows: &[Reading]) -> Result<Recording>;
    fn table(&mut self, name: &str, csv: &str) -> Result<Option<PathBuf>>;
}

/// Rows and events on the disk.
pub(super) struct OnDisk<'a> {
    pub journal: &'a mut Journal,
    pub muscle: MuscleDescription,
}

impl Sink for OnDisk<'_> {
    fn begin(&mut self, number: u32, name: &str) -> Result<()> {
        self.journal.begin(number, name)
    }

    fn row(&mut self, reading: &Reading) -> Result<()> {
        self.journal.row(reading)
    }

    fn finish(&mut self, completion: Completion, _rows: &[Reading]) -> Result<(String, u64)> {
        self.journal.finish(completion)
    }

    fn event(&mut self, event: Event) -> Result<()> {
        self.journal.write(event)
    }

    fn recording(&self, file: &str, _rows: &[Reading]) -> Result<Recording> {
        read(&self.journal.folder().join(file), &self.muscle)
    }

    fn table(&mut self, name: &str, csv: &str) -> Result<Option<PathBuf>> {
        let path = self.journal.folder().join(name);
        write_whole(&path, csv.as_bytes())?;
        Ok(Some(path))
    }
}

/// Rows in memory, checks in a folder where there is one.
pub(super) struct InMemory<'a> {
    pub checks: Option<&'a Path>,
}

impl Sink for InMemory<'_> {
    fn begin(&mut self, _number: u32, _name: &str) -> Result<()> {
        Ok(())
    }

    fn row(&mut self, _reading: &Reading) -> Result<()> {
        Ok(())
    }

    fn finish(&mut self, _completion: Completion, rows: &[Reading]) -> Result<(String, u64)> {
        Ok((String::new(), rows.len() as u64))
    }

    fn event(&mut self, _event: Event) -> Result<()> {
        Ok(())
    }

    fn recording(&self, file: &str, rows: &[Reading]) -> Result<Recording> {
        Ok(recording(file, rows))
    }

    fn table(&mut self, name: &str, csv: &str) -> Result<Option<PathBuf>> {
        let Some(folder) = self.checks else { return Ok(None) };
        let path = folder.join(name);
        write_whole(&path, csv.as_bytes())?;
        Ok(Some(path))
    }
}
