//! Files that appear whole or not at all.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::error::{Code, Error, Result};

/// Writes a file under a temporary name beside `path`, then renames it: a reader sees the old file or the new one.
/// A path of `-` is standard output.
///
/// # Errors
/// [`Code::FileUnwritable`]; what stood at `path` is untouched then.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    if path == Path::new("-") {
        let mut out = std::io::stdout().lock();
        // A reader that stopped reading is no failure.
        let _ = out.write_all(bytes).and_then(|()| out.flush());
        return Ok(());
    }
    let name = path
        .file_name()
        .ok_or_else(|| Error::new(Code::CallInvalid, "the output's path names no file").file(path))?;
    // A device such as /dev/null or a named pipe must be written itself, not replaced by a file.
    if fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return fs::write(path, bytes).map_err(|e| Error::unwritable(path, &e));
    }
    let mut temporary = PathBuf::from(path);
    temporary.set_file_name(format!(".{}.{}.part", name.to_string_lossy(), std::process::id()));
    let written = fs::File::create(&temporary)
        .and_then(|mut f| f.write_all(bytes).and_then(|()| f.sync_all()))
        .and_then(|()| fs::rename(&temporary, path));
    written.map_err(|e| {
        let _ = fs::remove_file(&temporary);
        Error::unwritable(path, &e).help("check that the folder exists and may be written to")
    })
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
}
