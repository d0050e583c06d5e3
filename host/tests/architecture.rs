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

/// The sources of the host's crates without their tests, by path.
fn production_sources() -> Vec<(PathBuf, String)> {
    let host = root().join("host");
    let crates = fs::read_dir(&host).expect("the crates").flatten().map(|e| e.path().join("src"));
    let mut folders: Vec<PathBuf> = crates.chain([host.join("src")]).filter(|p| p.is_dir()).collect();
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(folder).expect("a folder").flatten().map(|e| e.path()) {
            if path.is_dir() && !path.ends_with("tests") {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
                let text = fs::read_to_string(&path).expect("a source file");
                let production = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("").to_owned();
                sources.push((path, production));
            }
        }
    }
    sources
}

/// Medians, deviations from a median, and the normal distribution's quantiles have one home. The criteria state their own values.
#[test]
fn order_statistics_and_quantiles_are_computed_in_one_place() {
    let sources = production_sources();
    assert!(sources.len() > 300, "{}", sources.len());
    let home = |path: &Path| {
        path.ends_with("data/src/statistics.rs")
            || path.components().any(|c| ["numerics", "criteria"].iter().any(|home| c.as_os_str() == *home))
    };
    let number = |code: &str, digits: &str| {
        code.match_indices(digits).any(|(at, _)| {
            let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
            !digit(code[..at].chars().next_back()) && !digit(code[at + digits.len()..].chars().next())
        })
    };
    let mut found = Vec::new();
    for (path, text) in sources.iter().filter(|(path, _)| !home(path)) {
        for line in text.lines() {
            let code = line.split("//").next().unwrap_or("").split('"').next().unwrap_or("");
            let median = code.contains("len() / 2]") || code.contains("len() / 2;");
            let literal =
                ["1.4826", "0.6745", "0.674_489", "1.96", "1.959_964"].iter().any(|d| number(code, d));
            if median || literal {
                found.push(format!("{}: {}", path.display(), line.trim()));
            }
        }
    }
    assert_eq!(found, [""; 0], "use pam_data::statistics");
}
