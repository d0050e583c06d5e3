//! The import directions between the crates, as the manifests state them, and the files that the architecture page
//! (`docs/src/design.md`) names.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Every crate of the project: its manifest's folder, and the project's crates that it may use.
const ALLOWED: &[(&str, &str, &[&str])] = &[
    ("model-core", "model-core", &[]),
    ("pam-protocol", "host/protocol", &[]),
    ("virtual-bench", "host/virtual-bench", &["pam-protocol"]),
    ("firmware", "firmware", &["model-core"]),
    ("bootloader", "firmware/bootloader", &["model-core"]),
    ("pam-data", "host/data", &["model-core"]),
    ("pam-fit", "host/fit", &["model-core", "pam-data"]),
    ("pam-evaluate", "host/evaluate", &["model-core", "pam-data", "pam-fit"]),
    ("pam-diagnose", "host/diagnose", &["model-core", "pam-data", "pam-fit", "pam-protocol"]),
    ("pam-report", "host/report", &["model-core", "pam-data", "pam-fit", "pam-diagnose", "pam-evaluate"]),
    ("pam-fleet", "host/fleet", &["model-core", "pam-data", "pam-fit", "pam-diagnose", "pam-report"]),
    ("pam-device", "host/device", &["model-core", "pam-data", "firmware", "virtual-bench"]),
    (
        "pam-campaign",
        "host/campaign",
        &["model-core", "pam-data", "pam-fit", "pam-diagnose", "pam-device", "pam-protocol", "virtual-bench"],
    ),
    (
        "host",
        "host",
        &[
            "model-core",
            "pam-data",
            "pam-fit",
            "pam-evaluate",
            "pam-diagnose",
            "pam-report",
            "pam-fleet",
            "pam-device",
            "pam-campaign",
            "pam-protocol",
            "virtual-bench",
        ],
    ),
    (
        "pamtools",
        "host/python",
        &["model-core", "pam-data", "pam-fit", "pam-evaluate", "pam-diagnose", "pam-report", "pam-device"],
    ),
];

/// Libraries that only the named crates may use: the command line, the web server, the serial port.
const RESTRICTED: &[(&str, &[&str])] = &[
    // The program `virtual-bench` is built with the feature `cli`; its library does not use it.
    ("clap", &["host", "virtual-bench"]),
    ("axum", &["host"]),
    // The client of buckets waits for the network; it is built with the feature `buckets` only.
    ("tokio", &["host", "pam-fleet"]),
    ("serialport", &["pam-device"]),
    ("probe-rs", &["pam-device"]),
    ("maud", &["pam-report"]),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The names under `[dependencies]`, target-specific ones included; those of tests do not count.
fn dependencies(folder: &str) -> BTreeSet<String> {
    let path = root().join(folder).join("Cargo.toml");
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let manifest: toml::Table = text.parse().expect("a manifest");
    let tables = manifest
        .get("target")
        .and_then(toml::Value::as_table)
        .into_iter()
        .flat_map(|t| t.values().filter_map(toml::Value::as_table))
        .chain([&manifest]);
    tables
        .filter_map(|t| t.get("dependencies").and_then(toml::Value::as_table))
        .flat_map(|t| t.keys().cloned())
        .collect()
}

fn internal(folder: &str) -> Vec<String> {
    let ours: BTreeSet<&str> = ALLOWED.iter().map(|(name, ..)| *name).collect();
    dependencies(folder).into_iter().filter(|d| ours.contains(d.as_str())).collect()
}

#[test]
fn imports_run_one_way() {
    for (name, folder, allowed) in ALLOWED {
        for used in internal(folder) {
            assert!(allowed.contains(&used.as_str()), "{name} must not use {used}");
        }
    }
}

#[test]
fn only_the_program_knows_the_command_line_and_the_web() {
    for (name, folder, _) in ALLOWED {
        let used = dependencies(folder);
        for (library, by) in RESTRICTED {
            assert!(!used.contains(*library) || by.contains(name), "{name} must not use {library}");
        }
    }
}

/// The bindings talk to controllers over the serial port, and contain no emulated controller and no probe.
#[test]
fn the_bindings_link_no_server_no_probe_and_no_firmware() {
    let lock = fs::read_to_string(root().join("host/python/Cargo.lock")).expect("the bindings' lock file");
    for library in ["axum", "clap", "tokio", "probe-rs", "firmware", "embassy-executor", "virtual-bench"] {
        assert!(!lock.contains(&format!("name = \"{library}\"\n")), "the bindings link {library}");
    }
}

#[test]
fn every_file_that_the_architecture_page_names_exists() {
    let page = fs::read_to_string(root().join("docs/src/design.md")).expect("the page");
    let named: Vec<&str> = page
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|t| t.contains(".rs") && t.contains('/') && !t.contains('*'))
        .collect();
    assert!(named.len() > 20, "{named:?}");
    for path in named {
        assert!(root().join(path).exists(), "{path} is not there");
    }
}
