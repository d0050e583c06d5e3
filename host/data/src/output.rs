//! Files that appear whole or not at all.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::error::{DataCode, Error, Result};
use crate::file_kind::FileKind;

/// Writes a file under a temporary name beside `path`, then renames it: a reader sees the old file or the new one.
/// A path of `-` is standard output.
///
/// # Errors
/// [`DataCode::FileUnwritable`], or [`DataCode::CallInvalid`] where the path holds a file of another kind that no command can recreate, such as a
/// recording that was given behind `--json`; what stood at `path` is untouched then.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    if path == Path::new("-") {
        let mut out = std::io::stdout().lock();
        // A reader that stopped reading is no failure.
        let _ = out.write_all(bytes).and_then(|()| out.flush());
        return Ok(());
    }
    let name = path
        .file_name()
        .ok_or_else(|| Error::new(DataCode::CallInvalid, "the output path names no file").file(path))?;
    // A device such as /dev/null or a named pipe must be written itself, not replaced by a file.
    if fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return fs::write(path, bytes).map_err(|e| Error::unwritable(path, &e));
    }
    keeps_its_kind(path, bytes)?;
    let mut temporary = PathBuf::from(path);
    temporary.set_file_name(format!(".{}.{}.part", name.to_string_lossy(), std::process::id()));
    let written = fs::File::create(&temporary)
        .and_then(|mut f| f.write_all(bytes).and_then(|()| f.sync_all()))
        .and_then(|()| fs::rename(&temporary, path));
    written.map_err(|e| {
        let _ = fs::remove_file(&temporary);
        Error::unwritable(path, &e)
    })
}

/// Whether one of a call's results, each with the option that names its destination, goes to standard output: text for people must not
/// then.
///
/// ```
/// use pam_data::output::to_standard_output;
/// use std::path::Path;
/// let to = |path| Some(Path::new(path));
/// assert!(to_standard_output(&[("-o", to("-")), ("--json", to("a.json"))])?);
/// assert!(!to_standard_output(&[("-o", to("a.pam")), ("--json", None)])?);
/// let refused = to_standard_output(&[("-o", to("-")), ("--json", to("-"))]).unwrap_err();
/// assert_eq!(refused.exit_status(), 2);
/// # Ok::<(), pam_data::error::Error>(())
/// ```
///
/// # Errors
/// [`DataCode::CallInvalid`] for more than one: they could not be separated.
pub fn to_standard_output(results: &[(&str, Option<&Path>)]) -> Result<bool> {
    let there: Vec<&str> =
        results.iter().filter(|(_, path)| *path == Some(Path::new("-"))).map(|(option, _)| *option).collect();
    if there.len() > 1 {
        return Err(Error::new(
            DataCode::CallInvalid,
            format!("the results of {} would all go to standard output", there.join(" and ")),
        )
        .help("use `-` for one of them, and files for the others"));
    }
    Ok(!there.is_empty())
}

/// Where `--json` without a file puts its result, for [`to_standard_output`].
#[must_use]
pub fn printed(json: bool) -> Option<&'static Path> {
    json.then_some(Path::new("-"))
}

/// A value as JSON whose numbers of single precision have the digits that they were given: 0.03, not 0.029999999329447746.
///
/// ```
/// assert_eq!(pam_data::output::json_of(&[0.03_f32]).to_string(), "[0.03]");
/// ```
#[must_use]
pub fn json_of(value: &impl serde::Serialize) -> serde_json::Value {
    // Text is the one form in which a single-precision number is written by itself; as a `Value` it is widened first.
    serde_json::to_string(value).ok().and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
}

/// Refuses to overwrite a recording, a table or a description: the path was probably meant for another option.
fn keeps_its_kind(path: &Path, bytes: &[u8]) -> Result<()> {
    let (Some(there), fresh) = (FileKind::of_file(path), FileKind::of_bytes(bytes)) else { return Ok(()) };
    if matches!(there, FileKind::Json | FileKind::Report) || fresh == Some(there) {
        return Ok(());
    }
    let fresh = fresh.map_or("a result of another kind", FileKind::words);
    Err(Error::new(
        DataCode::CallInvalid,
        format!("{} stands here, and {fresh} would take its place", there.words()),
    )
    .file(path)
    .help("name another output file; `host COMMAND --help` lists the options that write files"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = std::env::temp_dir().join(format!("pam-output-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let file = folder.join("a.txt");
        write_whole(&file, b"one").expect("written");
        write_whole(&file, b"two").expect("replaced");
        assert_eq!(fs::read(&file).expect("readable"), b"two");
        let missing = folder.join("no/such/folder/b.txt");
        assert_eq!(write_whole(&missing, b"x").expect_err("no folder").exit_status(), 1);
        assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 1, "no temporary file stays");
        fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn nothing_of_another_kind_takes_the_place_of_a_recording() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.csv");
        let recording = "time_s,pressure_kPa,displacement_mm,force_N\n0,300,0,50\n";
        fs::write(&file, recording).expect("written");
        let refused =
            write_whole(&file, b"{ \"schema\": \"pam-fit/1\" }\n").expect_err("a recording stands there");
        assert_eq!(refused.exit_status(), 2);
        assert!(
            refused.to_string().contains("a recording stands here, and the JSON of a result"),
            "{refused}"
        );
        assert_eq!(fs::read_to_string(&file).expect("readable"), recording);
        write_whole(&file, recording.replace("50", "51").as_bytes()).expect("a recording for a recording");
    }
}
