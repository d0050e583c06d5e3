//! The campaigns of the virtual bench that `benches/libraries.rs` times the libraries with.

use std::io;
use std::path::Path;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Reader};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::muscle::Muscle;
use virtual_bench::recording::Columns;
use virtual_bench::{campaigns, presets};

/// The thesis's test of the miniature muscle, with its description: three loops at each of six pressures, one file a pressure.
pub struct Recorded {
    /// The muscle's description.
    pub muscle: MuscleDescription,
    /// The recordings.
    pub campaign: Campaign,
}

impl Recorded {
    /// Records with this sampling rate, Hz, writes the files into a folder, and reads them.
    ///
    /// # Errors
    /// A folder that cannot be written or read, or a recording that is refused.
    pub fn new(sample_hz: f64, folder: &Path) -> io::Result<Self> {
        let spec = presets::miniature();
        let mut protocol = campaigns::thesis(&Muscle::new(spec.clone()), &presets::miniature_pressures());
        protocol.sample_hz = sample_hz;
        let files =
            Bench::new(&BenchSpec::laboratory(spec.clone(), 1)).run(&protocol).map_err(io::Error::other)?;
        let mut paths = Vec::new();
        for file in &files {
            let path = folder.join(format!("{}.csv", file.name));
            std::fs::write(&path, file.csv(Columns::default()))?;
            paths.push(path);
        }
        Ok(Self {
            muscle: MuscleDescription::parse(&spec.description()).map_err(io::Error::other)?,
            campaign: Reader::new().campaign(&paths).map_err(io::Error::other)?,
        })
    }
}
