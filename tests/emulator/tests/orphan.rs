//! An emulator does not outlive the program that started it, however that ends.

#![cfg(unix)]

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use emulator_tests::machine::{self, Folder, HOPELESS};
use emulator_tests::program;

/// Whether QEMU still has the link's line open: without waiting, a named pipe that no one reads cannot be opened for writing.
fn is_read(pipe: &Path) -> bool {
    let nonblocking = rustix::fs::OFlags::NONBLOCK.bits() as i32;
    OpenOptions::new().write(true).custom_flags(nonblocking).open(pipe).is_ok()
}

#[test]
fn qemu_ends_with_a_host_that_is_killed() {
    let Ok(image) = machine::image() else { return };
    let folder = Folder::new();
    let mut host = Command::new(program::path())
        .args(["emulate", "--on", "qemu"])
        .env("PAM_FIRMWARE", image)
        .env("TMPDIR", folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let mut line = String::new();
    BufReader::new(host.stdout.as_mut().expect("its output")).read_line(&mut line).expect("a line");
    let port = line.trim().strip_prefix("tcp:").expect("a port").to_owned();
    assert!(TcpStream::connect(&port).is_ok(), "it listens at {port}");
    let of_the_board =
        std::fs::read_dir(folder.path()).expect("a folder").next().expect("the board's folder");
    let pipe = of_the_board.expect("it reads").path().join("link.in");
    assert!(is_read(&pipe), "QEMU reads {}", pipe.display());
    // The hard way: nothing of the program runs any more.
    host.kill().expect("it is there");
    host.wait().expect("it ends");
    let deadline = Instant::now() + HOPELESS;
    while is_read(&pipe) {
        assert!(Instant::now() < deadline, "QEMU still runs, long after the end of its host");
        std::thread::sleep(Duration::from_millis(50));
    }
}
