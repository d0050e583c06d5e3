//! An emulator does not outlive the program that started it, however that ends.

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use emulator_tests::machine;
use emulator_tests::program;

#[cfg(unix)]
#[test]
fn qemu_ends_with_a_host_that_is_killed() {
    let Ok(image) = machine::image() else { return };
    let mut host = Command::new(program::path())
        .args(["emulate", "--on", "qemu"])
        .env("PAM_FIRMWARE", image)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let mut line = String::new();
    BufReader::new(host.stdout.as_mut().expect("its output")).read_line(&mut line).expect("a line");
    let port = line.trim().strip_prefix("tcp:").expect("a port").to_owned();
    assert!(TcpStream::connect(&port).is_ok(), "QEMU listens at {port}");
    // The hard way: nothing of the program runs any more.
    host.kill().expect("it is there");
    host.wait().expect("it ends");
    let deadline = Instant::now() + Duration::from_secs(10);
    while TcpStream::connect(&port).is_ok() {
        assert!(
            Instant::now() < deadline,
            "QEMU still listens at {port}, ten seconds after its host was killed"
        );
        std::thread::sleep(Duration::from_millis(50));
    }
}
