//! Files that appear whole or not at all.

mod folder_lock;

use std::ffi::OsString;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::{DataCode, Error, Result};
use crate::file_kind::FileKind;

pub use self::folder_lock::FolderLock;

/// Writes a file that appears at `path` whole: a reader sees the old file or the new one, and a program that is stopped leaves the old
/// one and nothing else. A new file that takes an old one's place has its permissions. A path of `-` is standard output.
///
/// # Errors
/// [`DataCode::FileUnwritable`], or [`DataCode::CallInvalid`] where the path holds a file of another kind that no command can recreate, such as a
/// recording that was given behind `--json`; what stood at `path` is untouched then.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    if path == Path::new("-") {
        return print(bytes);
    }
    if path.file_name().is_none() {
        return Err(Error::new(DataCode::CallInvalid, "the output's path names no file").file(path));
    }
    let unwritable = |e: io::Error| Error::unwritable(path, &e);
    let old = fs::metadata(path).ok();
    // A device such as /dev/null or a named pipe must be written itself, not replaced by a file.
    if old.as_ref().is_some_and(|m| !m.is_file()) {
        return fs::write(path, bytes).map_err(unwritable);
    }
    keeps_its_kind(path, bytes)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let fill = |file: &mut fs::File| {
        if let Some(old) = &old {
            file.set_permissions(old.permissions())?;
        }
        file.write_all(bytes).and_then(|()| file.sync_all())
    };
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".");
    let mut temporary = tempfile::Builder::new();
    temporary.prefix(&name).suffix(".part");
    if let Some(mut file) = unnamed::create(folder) {
        fill(&mut file).map_err(unwritable)?;
        // Where nothing stands yet, the file is never seen under any other name.
        if old.is_none() && unnamed::link(&file, path).is_ok() {
            return Ok(());
        }
        if let Ok(named) = temporary.make_in(folder, |name| unnamed::link(&file, name)) {
            return named.persist(path).map(drop).map_err(|e| unwritable(e.error));
        }
    }
    #[cfg(unix)]
    temporary.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut named = temporary.tempfile_in(folder).map_err(unwritable)?;
    fill(named.as_file_mut()).map_err(unwritable)?;
    named.persist(path).map(drop).map_err(|e| unwritable(e.error))
}

/// Writes to standard output. A reader that stopped reading (`| head`) is not a failure; a full disk is.
///
/// # Errors
/// [`DataCode::FileUnwritable`].
pub fn print(bytes: &[u8]) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(e) if !reader_left(&e) => {
            Err(Error::new(DataCode::FileUnwritable, format!("standard output cannot be written: {e}")))
        }
        _ => Ok(()),
    }
}

/// Whether a write to standard output failed because its reader stopped reading.
#[must_use]
pub fn reader_left(error: &io::Error) -> bool {
    /// A second code that Windows has for it; the standard library only knows `ERROR_NO_DATA` and `ERROR_BROKEN_PIPE`.
    const ERROR_PIPE_NOT_CONNECTED: i32 = 233;
    error.kind() == io::ErrorKind::BrokenPipe
        || (cfg!(windows) && error.raw_os_error() == Some(ERROR_PIPE_NOT_CONNECTED))
}

/// Files without a name, which vanish with the program that writes them: Linux has them on most of its file systems.
#[cfg(target_os = "linux")]
mod unnamed {
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::Path;

    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, open};

    pub(super) fn create(folder: &Path) -> Option<File> {
        let flags = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
        open(folder, flags, Mode::from_raw_mode(0o666)).ok().map(File::from)
    }

    /// Gives it a name that no other file has.
    pub(super) fn link(file: &File, path: &Path) -> io::Result<()> {
        let open = format!("/proc/self/fd/{}", file.as_raw_fd());
        Ok(linkat(CWD, open, CWD, path, AtFlags::SYMLINK_FOLLOW)?)
    }
}

#[cfg(not(target_os = "linux"))]
mod unnamed {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    pub(super) fn create(_: &Path) -> Option<File> {
        None
    }

    pub(super) fn link(_: &File, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// Whether one of a call's results, each with the option that names its destination, goes to standard output: text for people must not
/// then. Two results must not have one destination; this is checked before anything is written.
///
/// ```
/// use pam_data::output::to_standard_output;
/// use std::path::Path;
/// let to = |path| Some(Path::new(path));
/// assert!(to_standard_output(&[("-o", to("-")), ("--json", to("a.json"))])?);
/// assert!(!to_standard_output(&[("-o", to("a.pam")), ("--json", None)])?);
/// let refused = to_standard_output(&[("-o", to("-")), ("--json", to("-"))]).unwrap_err();
/// assert_eq!(refused.exit_status(), 2);
/// let refused = to_standard_output(&[("-o", to("a.pam")), ("--json", to("./a.pam"))]).unwrap_err();
/// assert_eq!(refused.cause(), "-o and --json name the same file");
/// # Ok::<(), pam_data::error::Error>(())
/// ```
///
/// # Errors
/// [`DataCode::CallInvalid`] for more than one there, which could not be separated, or in one file, which the last would replace.
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
    let mut files: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in results.iter().filter_map(|(o, p)| Some((*o, p.and_then(place)?))) {
        if let Some((first, _)) = files.iter().find(|(_, other)| *other == path) {
            return Err(Error::new(
                DataCode::CallInvalid,
                format!("{first} and {option} name the same file"),
            )
            .file(path)
            .help("name another file for one of them"));
        }
        files.push((option, path));
    }
    Ok(!there.is_empty())
}

/// Where a file is, or will be, however its path is written; `None` of what takes several results, such as standard output or a device.
fn place(path: &Path) -> Option<PathBuf> {
    match fs::metadata(path) {
        _ if path == Path::new("-") => None,
        Ok(there) if !there.is_file() => None,
        Ok(_) => Some(path.canonicalize().unwrap_or_else(|_| path.to_owned())),
        Err(_) => {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
            Some(path.file_name().map_or_else(|| path.to_owned(), |name| folder.join(name)))
        }
    }
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
    // Text is the one form in which a single-precision number is written exactly; as a `Value` it is widened first.
    serde_json::to_string(value).ok().and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
}

/// Refuses to overwrite a recording, a table or a description: the path was probably meant for another option.
fn keeps_its_kind(path: &Path, bytes: &[u8]) -> Result<()> {
    let (Some(there), fresh) = (FileKind::of_file(path), FileKind::of_bytes(bytes)) else { return Ok(()) };
    if matches!(there, FileKind::Json | FileKind::Report) || fresh == Some(there) {
        return Ok(());
    }
    let fresh = fresh.map_or("a result of another kind", FileKind::description);
    Err(Error::new(
        DataCode::CallInvalid,
        format!("{} stands here, and {fresh} would take its place", there.description()),
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

    #[cfg(unix)]
    #[test]
    fn a_new_file_has_the_old_ones_permissions_and_follows_no_prepared_name() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.txt");
        let other = folder.path().join("other");
        fs::write(&other, b"untouched").expect("written");
        // What another user could guess: the name that a program with this number would take.
        let guessed = folder.path().join(format!(".a.txt.{}.part", std::process::id()));
        std::os::unix::fs::symlink(&other, &guessed).expect("linked");
        let mode = || fs::metadata(&file).expect("there").permissions().mode() & 0o7777;
        write_whole(&file, b"one").expect("written");
        let usual = fs::metadata(&other).expect("there").permissions().mode() & 0o7777;
        assert_eq!(mode(), usual, "as any other new file");
        for wanted in [0o600, 0o640, 0o444] {
            fs::set_permissions(&file, fs::Permissions::from_mode(wanted)).expect("set");
            write_whole(&file, b"two").expect("replaced");
            assert_eq!(mode(), wanted);
        }
        assert_eq!(fs::read(&other).expect("readable"), b"untouched");
        assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 3);
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
