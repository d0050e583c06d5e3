//! What the commands print as JSON is valid by the published schemas.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::path::Path;
use std::process::Command;

use pam_device::emulated::{Emulated, Kind, Stand};
use pam_device::recorder::side_file;
use virtual_bench::presets;
use virtual_bench::recording::Columns;

mod bench_campaign;

fn host(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .env_remove("PAM_PORT")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

/// The name of a document's schema, by which it has to be valid.
fn schema_of(text: &str) -> String {
    published_schemas::valid(text)["schema"].as_str().unwrap().replace('/', "-")
}

/// Loops of the miniature muscle at three pressures, with its description.
fn campaign(folder: &Path) -> Vec<String> {
    let spec = presets::miniature();
    std::fs::write(folder.join("m.toml"), spec.description()).unwrap();
    let levels = &presets::miniature_pressures()[1..4];
    let files = bench_campaign::files(&spec, levels, 5, 10.0);
    let write = |file: &virtual_bench::recording::Recording| {
        let name = format!("{}.csv", file.name);
        std::fs::write(folder.join(&name), file.csv(Columns::default())).unwrap();
        name
    };
    files.iter().map(write).collect()
}

#[test]
fn results_of_recordings_and_tables_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let recordings = campaign(folder);
    std::fs::write(
        folder.join("p.toml"),
        "name = \"p\"\nsample_Hz = 10.0\n[[step]]\ndo = \"pressure\"\nto_kPa = 300.0\n[[step]]\ndo = \"file\"\nname = \"a\"\n\
         [[step]]\ndo = \"cycles\"\nto_free = 0.8\nspeed_mm_s = 0.5\ncount = 2\n[[step]]\ndo = \"end-file\"\n",
    )
    .unwrap();
    let own = |call: &str, with: bool| {
        let mut words: Vec<&str> = call.split(' ').collect();
        if with {
            words.extend(recordings.iter().map(String::as_str));
        }
        schema_of(&host(folder, &words))
    };
    let mut seen = vec![
        own("fit --quiet --muscle m.toml -o t.pam --json -", true),
        own("fit --quiet --muscle m.toml --physical --fit-geometry --json -", true),
        own("diagnose --quiet --muscle m.toml --json -", true),
        own("diagnose --quiet --muscle m.toml --with backlash --json -", true),
        own("predict --quiet --table t.pam --json -", true),
        own("evaluate --quiet --muscle m.toml --leave-out runs --json -", true),
        own("plan --quiet --table t.pam p.toml --json -", false),
        own("plan --quiet --muscle m.toml --steps 2 --json -", true),
        own("table show t.pam --json", false),
        own("table check t.pam --json", false),
        own("table export t.pam -o t.h --json", false),
        own("effects --json", false),
        own("effects backlash --json", false),
        own("settings --json", false),
        own("device list --json", false),
    ];
    // Two campaigns are enough for a history: the same levels, once more.
    for (day, seed) in [("2026-01-05", 5), ("2026-02-05", 6)] {
        std::fs::create_dir(folder.join(day)).unwrap();
        let levels = &presets::miniature_pressures()[1..4];
        for file in bench_campaign::files(&presets::miniature(), levels, seed, 10.0) {
            let path = folder.join(day).join(format!("{}.csv", file.name));
            std::fs::write(path, file.csv(Columns::default())).unwrap();
        }
    }
    seen.push(own("history --quiet 2026-01-05 2026-02-05 --muscle m.toml --json -", false));
    // What changed beside another campaign, and beside a table: nothing, and a gain of the load cell.
    let (first, second) = ("2026-01-05", "2026-02-05");
    let of = |day: &str| {
        let mut files: Vec<String> = std::fs::read_dir(folder.join(day))
            .unwrap()
            .map(|f| f.unwrap().path().display().to_string())
            .collect();
        files.sort();
        files.join(" ")
    };
    own(&format!("diagnose --quiet {} --reference {} --json -", of(second), of(first)), false);
    own(&format!("diagnose --quiet {} --reference t.pam --json -", of(second)), false);
    let (a, b) = (&recordings[0], &recordings[1]);
    seen.push(schema_of(&host(folder, &["compare", "--quiet", a, b, "--json"])));
    seen.sort();
    seen.dedup();
    assert_eq!(seen.len(), 15, "{seen:?}");
}

#[test]
fn results_of_a_controller_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let stand = Stand::swinging(presets::miniature());
    let emulated = Emulated::start(stand, Some(Kind::Native), 1.0).unwrap();
    let table =
        pam_fit::table_file::TableFile { table: model_core::table::example(), about: Default::default() };
    table.write(folder.join("t.pam")).unwrap();
    let port = emulated.address().to_string();
    for call in [
        "device info --json",
        "device settings --json",
        "device faults --json",
        "flash t.pam --json --quiet",
        "flash t.pam --json --quiet",
        "record --quiet --seconds 0.3 -o watched.csv --json",
        "run --quiet --pressure 100 --seconds 0.3 -o run.csv --json",
        "run --quiet --force 20 --seconds 0.3 --json",
        "device forget --json",
        "vent --json",
    ] {
        let words: Vec<&str> = call.split(' ').chain(["--port", &port]).collect();
        schema_of(&host(folder, &words));
    }
    for recording in ["watched.csv", "run.csv"] {
        let side = side_file(&folder.join(recording));
        schema_of(&std::fs::read_to_string(side).unwrap());
    }
}
