//! A muscle of the thesis on the virtual bench, under the thesis's test protocol.

use std::path::{Path, PathBuf};

use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::presets;
use virtual_bench::recording::Columns;

use pam_data::error::{DataCode, Error, Result};
use pam_data::output::write_whole;

/// What the bench recorded.
#[derive(Debug, Clone)]
pub struct Made {
    /// The bench with its muscle, for the plant of the controller.
    pub bench: BenchSpec,
    /// The muscle's description.
    pub muscle: PathBuf,
    /// One file for each pressure.
    pub recordings: Vec<PathBuf>,
    /// Rows in all files.
    pub rows: usize,
    /// Blocked force at the highest pressure, N, by the bench's own physics.
    pub blocked_force: f64,
    /// Free stroke at the highest pressure, m, by the bench's own physics.
    pub free_stroke: f64,
}

/// Records a muscle and writes its files into a folder.
///
/// # Errors
/// [`DataCode::CallInvalid`] for a muscle that the bench does not know, [`DataCode::FileUnwritable`].
pub fn record(name: &str, seed: u64, folder: &Path) -> Result<Made> {
    let spec = muscle(name)?;
    let bench = BenchSpec::laboratory(spec.clone(), seed);
    let built = Muscle::new(spec);
    let levels = match name {
        "mini" => presets::miniature_pressures(),
        "contractile" | "push" => presets::large_pressures(),
        _ => campaigns::levels(&built),
    };
    let protocol = campaigns::thesis(&built, &levels);
    let files = Bench::new(&bench).run(&protocol).map_err(|e| {
        Error::new(DataCode::CallInvalid, format!("the bench cannot carry out its protocol: {e}"))
    })?;
    std::fs::create_dir_all(folder).map_err(|e| Error::unwritable(folder, &e))?;
    let description = folder.join("muscle.toml");
    write_whole(&description, built.spec().description().as_bytes())?;
    let mut recordings = Vec::with_capacity(files.len());
    let mut rows = 0;
    for file in &files {
        let path = folder.join(format!("{}.csv", file.name));
        write_whole(&path, file.csv(Columns::default()).as_bytes())?;
        rows += file.rows.len();
        recordings.push(path);
    }
    let top = levels.iter().copied().fold(0.0, f64::max);
    Ok(Made {
        muscle: description,
        recordings,
        rows,
        blocked_force: built.quasi_static(top, 0.0),
        free_stroke: built.free_stroke(top),
        bench,
    })
}

/// A muscle of the bench by its name.
///
/// # Errors
/// [`DataCode::CallInvalid`] naming those that there are.
pub fn muscle(name: &str) -> Result<MuscleSpec> {
    presets::by_name(name).ok_or_else(|| {
        Error::new(DataCode::CallInvalid, "the bench has no such muscle")
            .value(name)
            .help("take mini, contractile, push or random:SEED")
    })
}
