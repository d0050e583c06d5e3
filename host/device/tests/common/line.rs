//! A serial line of the system's own.
#![allow(clippy::unwrap_used, reason = "a helper of tests: a failure here is a failure of the test")]

/// A pseudo-terminal without echo or line editing: its near end, and the path of its far end.
pub fn open_pty() -> (std::fs::File, std::path::PathBuf) {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&near).unwrap();
    unlockpt(&near).unwrap();
    let path = ptsname(&near, Vec::new()).unwrap().into_string().unwrap();
    let mut raw = rustix::termios::tcgetattr(&near).unwrap();
    raw.make_raw();
    rustix::termios::tcsetattr(&near, rustix::termios::OptionalActions::Now, &raw).unwrap();
    (std::fs::File::from(near), path.into())
}
