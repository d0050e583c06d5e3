//! The clients in C and Python, which share no code with this program, talk to a controller in this process.

#![allow(clippy::unwrap_used)] // what fails here fails the test
#![cfg(all(feature = "emulated", unix))]

use std::path::PathBuf;
use std::process::Command;

use firmware::board::{Inputs, Readings};
use firmware::native::{Device, Options};

/// A muscle whose pressure is what is commanded.
fn device() -> Device {
    let mut tick = 0_u32;
    let plant = move |outputs: &firmware::board::Outputs| {
        tick += 1;
        // Live sensors never read the same twice.
        let wiggle = (tick % 7) as f32 - 3.0;
        let command = outputs.sides[0];
        let pressure_pa = if command.vent { 0.0 } else { command.pressure_pa } + wiggle;
        let readings = Readings { pressure_pa, stroke_m: 1e-3 + 1e-7 * wiggle, force_n: 1e-3 * wiggle };
        Inputs { sides: [Some(readings.into()), None], ..Inputs::default() }
    };
    Device::start("127.0.0.1:0", Options::default(), plant).unwrap()
}

fn clients() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../clients")
}

/// Whether a program is there; where continuous integration runs, it must be.
fn there(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    assert!(found || std::env::var_os("CI").is_none(), "{program} is not installed");
    if !found {
        eprintln!("skipped: {program} is not installed");
    }
    found
}

fn done(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    said
}

#[test]
fn the_python_client_follows_a_pressure() {
    if !there("python3") {
        return;
    }
    let device = device();
    let said = done(
        Command::new("python3")
            .arg(clients().join("python/example.py"))
            .args([&format!("tcp:{}", device.address()), "150"])
            .env("PYTHONDONTWRITEBYTECODE", "1"),
    );
    assert!(said.contains(" kPa, Running") && said.contains("now Armed"), "{said}");
    // How far the air is after a second depends on when the program was scheduled.
    let last = said.split("the last at ").nth(1).and_then(|rest| rest.split(' ').next());
    let last: f64 = last.and_then(|number| number.parse().ok()).unwrap_or(f64::NAN);
    assert!((last - 150.0).abs() < 15.0, "{said}");
}

#[test]
fn the_header_in_c_is_that_of_the_messages_and_its_example_follows_a_pressure() {
    if !there("cc") || !there("python3") {
        return;
    }
    done(Command::new("python3").arg(clients().join("c/generate.py")).arg("--check"));
    let device = device();
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("example");
    let flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-o"];
    done(Command::new("cc").args(flags).arg(&program).arg(clients().join("c/example.c")));
    let address = device.address();
    let said =
        done(Command::new(&program).args([&address.ip().to_string(), &address.port().to_string(), "150"]));
    assert!(said.contains("state 2,") && said.contains("no fault") && said.contains("now 0"), "{said}");
}
