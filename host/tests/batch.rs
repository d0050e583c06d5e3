//! `host batch`: interruptions, shards, and muscles that cannot be computed.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use pam_fleet::columns::Columns;
use serde_json::{Value, json};
use virtual_bench::presets;
use virtual_bench::recording::Columns as BenchColumns;
use virtual_bench::rng::Rng;

mod bench_campaign;

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host"));
    command.args(arguments).current_dir(folder).env("XDG_CONFIG_HOME", folder).env_remove("PAM_SETTINGS");
    command
}

fn host(folder: &Path, arguments: &[&str]) -> Output {
    let output = command(folder, arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn answer(output: &Output) -> Value {
    published_schemas::valid(std::str::from_utf8(&output.stdout).unwrap())
}

/// Loops of the miniature muscle at three pressures, a few hundred rows; each seed is another muscle's recording.
fn record(folder: &Path, seed: u64) {
    let spec = presets::miniature();
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("muscle.toml"), spec.description()).unwrap();
    for file in bench_campaign::files(&spec, &presets::miniature_pressures()[1..4], seed, 2.0) {
        fs::write(folder.join(format!("{}.csv", file.name)), file.csv(BenchColumns::default())).unwrap();
    }
}

/// A fleet of `count` muscles with its manifest.
fn fleet(folder: &Path, count: u64) {
    let mut manifest = String::from("muscle,description,files,tags\n");
    for i in 0..count {
        record(&folder.join(format!("m{i}")), 1 + i);
        manifest += &format!("m {i},m{i}/muscle.toml,m{i}/*.csv,batch=B{}\n", i % 3);
    }
    fs::write(folder.join("fleet.csv"), manifest).unwrap();
}

/// Every file below a folder with its bytes.
fn tree(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn visit(root: &Path, folder: &Path, found: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                visit(root, &path, found);
            } else {
                found.insert(path.strip_prefix(root).unwrap().to_path_buf(), fs::read(&path).unwrap());
            }
        }
    }
    let mut found = BTreeMap::new();
    visit(root, root, &mut found);
    found
}

/// Both folders hold the same files with the same bytes.
fn same(one: &Path, other: &Path, when: &str) {
    same_files(&tree(one), &tree(other), when);
}

fn same_files(one: &BTreeMap<PathBuf, Vec<u8>>, other: &BTreeMap<PathBuf, Vec<u8>>, when: &str) {
    let names: std::collections::BTreeSet<&PathBuf> = one.keys().chain(other.keys()).collect();
    let apart: Vec<_> = names.into_iter().filter(|name| one.get(*name) != other.get(*name)).collect();
    assert!(apart.is_empty(), "{when}: {apart:?}");
}

/// The rows of one table of one muscle.
fn table(output: &Path, muscle: &str, name: &str) -> Columns {
    let path = output.join(pam_fleet::partition::folder_name(muscle)).join(format!("{name}.parquet"));
    Columns::from_parquet(fs::File::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
        .unwrap()
}

/// The complete muscles in an output, and when each was written.
fn complete(output: &Path) -> BTreeMap<PathBuf, std::time::SystemTime> {
    let entries = fs::read_dir(output).into_iter().flatten().flatten().map(|e| e.path());
    let muscles = entries.filter(|p| p.file_name().unwrap().to_string_lossy().starts_with("muscle="));
    muscles
        .map(|path| {
            for table in pam_fleet::partition::TABLES {
                let file = path.join(format!("{table}.parquet"));
                Columns::from_parquet(fs::File::open(&file).unwrap()).unwrap();
            }
            let written = fs::metadata(path.join("fits.parquet")).unwrap().modified().unwrap();
            (path, written)
        })
        .collect()
}

/// With a SIGKILL at random moments, and run again: the output is that of an uninterrupted run, byte for byte, no reader ever sees a part of a
/// muscle, and none is computed twice.
#[test]
fn a_killed_batch_continues_and_ends_with_the_same_bytes() {
    let kills = if std::env::var_os("PAM_LONG").is_some() { 50 } else { 6 };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let muscles = 12;
    fleet(folder, muscles);
    let start = std::time::Instant::now();
    host(folder, &["batch", "fleet.csv", "-o", "whole", "--only", "fit", "--jobs", "1"]);
    let whole = start.elapsed();
    let mut rng = Rng::new(7);
    let (mut killed, mut batches, mut kept) = (0, 1, 0);
    for round in 0..10 * kills {
        if killed == kills {
            break;
        }
        // As soon as a batch is complete the next begins with an empty folder.
        if complete(&folder.join("killed")).len() as u64 == muscles {
            // A run that was stopped after its last muscle leaves its place of unfinished results, which the next run removes.
            let mut found = tree(&folder.join("killed"));
            found.retain(|path, _| !path.starts_with(".partial"));
            same_files(&tree(&folder.join("whole")), &found, &format!("round {round}"));
            fs::remove_dir_all(folder.join("killed")).unwrap();
            batches += 1;
        }
        let before = complete(&folder.join("killed"));
        let mut child =
            command(folder, &["batch", "fleet.csv", "-o", "killed", "--only", "fit", "--jobs", "2"])
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
        std::thread::sleep(whole.mul_f64(rng.unit()).min(Duration::from_secs(20)));
        let ended = child.try_wait().unwrap().is_some();
        child.kill().unwrap();
        child.wait().unwrap();
        killed += u64::from(!ended);
        let after = complete(&folder.join("killed"));
        assert!(before.iter().all(|(path, written)| after.get(path) == Some(written)), "computed twice");
        kept += before.len();
    }
    assert!(killed >= kills.min(3), "only {killed} runs were interrupted");
    let before = complete(&folder.join("killed")).len() as u64;
    let last = answer(&host(folder, &["batch", "fleet.csv", "-o", "killed", "--only", "fit", "--json"]));
    assert_eq!(last["reused"].as_u64().unwrap(), before);
    assert_eq!(last["computed"].as_u64().unwrap(), muscles - before);
    same(&folder.join("whole"), &folder.join("killed"), "the last batch");
    let files = tree(&folder.join("whole")).len();
    println!(
        "figures: {}",
        json!({"kills": killed, "batches": batches, "muscles": muscles, "kept": kept, "files": files})
    );
}

/// The shards of a batch, computed one by one into one folder or several, are the whole batch.
#[test]
fn shards_together_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fleet(folder, 5);
    host(folder, &["batch", "fleet.csv", "-o", "whole"]);
    let mut apart = BTreeMap::new();
    let mut sum = 0;
    for shard in ["1/3", "2/3", "3/3"] {
        let own = format!("s{}", &shard[..1]);
        let said = answer(&host(folder, &["batch", "fleet.csv", "-o", &own, "--shard", shard, "--json"]));
        sum += said["muscles"].as_u64().unwrap();
        apart.extend(tree(&folder.join(&own)));
        host(folder, &["batch", "fleet.csv", "-o", "together", "--shard", shard, "--jobs", "3"]);
    }
    let whole = tree(&folder.join("whole"));
    assert_eq!(sum, 5);
    assert_eq!(whole, apart);
    assert_eq!(whole, tree(&folder.join("together")));
    assert_eq!(table(&folder.join("whole"), "m 3", "fits").rows(), 1);
    assert!(table(&folder.join("whole"), "m 3", "diagnoses").text("verdict", 0).is_some());
    let refused = command(folder, &["batch", "fleet.csv", "-o", "x", "--shard", "0/3"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
}

/// What is done to one muscle of a fleet, and the code and a word of the failure that must come of it.
type Spoil = (&'static str, &'static str, fn(&Path) -> String);

/// Every way leaves the muscle's row of the manifest as text, below the columns muscle, description, files.
const WAYS: &[Spoil] = &[
    ("missing recording", "file::unreadable", |_| "w,w/muscle.toml,w/none.csv".into()),
    ("missing description", "file::unreadable", |_| "w,w/none.toml,w/*.csv".into()),
    ("pattern without a file", "file::unreadable", |_| "w,w/muscle.toml,w/*.parquet".into()),
    ("folder as recording", "file::unreadable", |_| "w,w/muscle.toml,w".into()),
    ("description that is not TOML", "muscle::invalid", |w| {
        spoil_description(w, "rest_length_mm", "rest length mm")
    }),
    ("description with an impossible value", "muscle::invalid", |w| spoil_description(w, "39.16", "-39.16")),
    ("description with an unknown key", "muscle::invalid", |w| {
        spoil_description(w, "bladder_wall_mm", "wall_mm")
    }),
    ("recording as description", "muscle::invalid", |w| format!("w,{},w/*.csv", first(w))),
    ("empty recording", "recording::empty", |w| spoil(w, |_| Vec::new())),
    ("header alone", "recording::too-short", |w| {
        spoil_text(w, |t| t.lines().next().unwrap().to_owned() + "\n")
    }),
    ("NaN", "recording::not-finite", |w| spoil_cell(w, "NaN")),
    ("no number", "recording::not-a-number", |w| spoil_cell(w, "abc")),
    ("wrong unit in the header", "recording::unknown-unit", |w| {
        spoil_text(w, |t| t.replacen("force_N", "force_kPa", 1))
    }),
    ("column missing", "recording::missing-column", |w| {
        spoil_text(w, |t| t.replacen("pressure_kPa", "p", 1))
    }),
    ("row cut off", "recording::wrong-width", |w| {
        spoil_text(w, |t| t.trim_end().rsplit_once(',').unwrap().0.to_owned() + "\n")
    }),
    ("time runs back", "recording::time-order", |w| {
        spoil_text(w, |t| {
            let mut lines: Vec<&str> = t.lines().collect();
            lines.swap(20, 21);
            lines.join("\n") + "\n"
        })
    }),
    ("gzip file cut off", "recording::container", |w| spoil(w, |bytes| gzip(&bytes)[..300].to_vec())),
    ("binary file", "recording::not-text", |w| spoil(w, |_| (0..=255).cycle().take(4000).collect())),
    ("no recording in the row", "manifest::invalid", |_| "w,w/muscle.toml,".into()),
    ("cell missing in the row", "manifest::invalid", |_| "w,w/muscle.toml".into()),
    ("muscle listed twice", "manifest::invalid", |_| "m 1,w/muscle.toml,w/*.csv".into()),
    ("no name", "manifest::invalid", |_| ",w/muscle.toml,w/*.csv".into()),
    ("remote address", "manifest::invalid", |_| "w,w/muscle.toml,ftp://bench/w.csv".into()),
    ("import description that is none", "import::invalid", |w| {
        fs::write(w.join("import.toml"), "skip_line = 5\n").unwrap();
        "w,w/muscle.toml,w/*.csv,w/import.toml".into()
    }),
    ("force that never changes", "fit::underdetermined", |w| {
        for path in fs::read_dir(w).unwrap().flatten().map(|e| e.path()) {
            if path.extension().unwrap() == "csv" {
                let text = fs::read_to_string(&path).unwrap();
                let dead = |(i, l): (usize, &str)| match i {
                    0 => format!("{l}\n"),
                    _ => format!("{},0\n", l.rsplit_once(',').unwrap().0),
                };
                fs::write(&path, text.lines().enumerate().map(dead).collect::<String>()).unwrap();
            }
        }
        "w,w/muscle.toml,w/*.csv".into()
    }),
];

fn first(_: &Path) -> String {
    "w/a.csv".into()
}

fn spoil_description(w: &Path, from: &str, to: &str) -> String {
    let text = fs::read_to_string(w.join("muscle.toml")).unwrap();
    assert!(text.contains(from), "{from}: {text}");
    fs::write(w.join("muscle.toml"), text.replacen(from, to, 1)).unwrap();
    "w,w/muscle.toml,w/*.csv".into()
}

fn spoil(w: &Path, change: impl Fn(Vec<u8>) -> Vec<u8>) -> String {
    let bytes = fs::read(w.join("a.csv")).unwrap();
    fs::write(w.join("a.csv"), change(bytes)).unwrap();
    "w,w/muscle.toml,w/*.csv".into()
}

fn spoil_text(w: &Path, change: impl Fn(&str) -> String) -> String {
    spoil(w, |bytes| change(std::str::from_utf8(&bytes).unwrap()).into_bytes())
}

/// Another text in the last cell of the tenth row.
fn spoil_cell(w: &Path, cell: &str) -> String {
    spoil_text(w, |text| {
        let with = |(i, line): (usize, &str)| match i {
            10 => format!("{},{cell}\n", line.rsplit_once(',').unwrap().0),
            _ => format!("{line}\n"),
        };
        text.lines().enumerate().map(with).collect()
    })
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

/// Each way to spoil a muscle gives its failure with place and remedy, and nothing else changes.
#[test]
fn a_spoiled_muscle_is_a_failure_and_the_others_are_untouched() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fleet(folder, 2);
    let mut manifest = String::from(
        "muscle,description,files,import\nm 0,m0/muscle.toml,m0/*.csv,\nm 1,m1/muscle.toml,m1/*.csv,\n",
    );
    fs::write(folder.join("fleet.csv"), &manifest).unwrap();
    host(folder, &["batch", "fleet.csv", "-o", "clean", "--only", "fit"]);
    record(&folder.join("good"), 9);
    let mut names = Vec::new();
    for (i, (_, _, way)) in WAYS.iter().enumerate() {
        let own = format!("w{i:02}");
        let w = folder.join(&own);
        fs::create_dir(&w).unwrap();
        for (file, name) in fs::read_dir(folder.join("good")).unwrap().flatten().map(|e| e.path()).zip(1..) {
            let target = if file.extension().unwrap() == "toml" {
                "muscle.toml".into()
            } else {
                format!("b{name}.csv")
            };
            fs::copy(&file, w.join(target)).unwrap();
        }
        let one = fs::read_dir(&w)
            .unwrap()
            .flatten()
            .map(|e| e.path())
            .find(|p| p.extension().unwrap() == "csv")
            .unwrap();
        fs::rename(one, w.join("a.csv")).unwrap();
        let row = way(&w);
        let row = row.replace("w/", &format!("{own}/"));
        let (muscle, rest) = row.split_once(',').unwrap();
        // The folder itself as recording.
        let rest =
            if rest.ends_with(",w") { format!("{}{own}", &rest[..rest.len() - 1]) } else { rest.to_owned() };
        let line = manifest.lines().count() + 1;
        let cells = rest.split(',').count();
        let short = WAYS[i].0 == "cell missing in the row";
        let rest = rest + &",".repeat(if short { 0 } else { 3 - cells });
        names.push(match muscle {
            "" => format!("row {line}"),
            "w" if short => format!("row {line}"),
            "w" => format!("x{i}"),
            other => format!("{other} (row {line})"),
        });
        manifest += &format!("{},{rest}\n", if muscle == "w" { format!("x{i}") } else { muscle.to_owned() });
    }
    fs::write(folder.join("fleet.csv"), &manifest).unwrap();
    let said = answer(&host(folder, &["batch", "fleet.csv", "-o", "spoiled", "--only", "fit", "--json"]));
    assert_eq!(said["failed"].as_u64().unwrap(), WAYS.len() as u64, "{said:#}");
    let spoiled = folder.join("spoiled");
    for ((what, code, _), name) in WAYS.iter().zip(&names) {
        let failures = table(&spoiled, name, "failures");
        let cell = |column: &str| failures.text(column, 0).unwrap_or_default().to_owned();
        assert_eq!(
            (failures.rows(), cell("code").as_str()),
            (1, *code),
            "{what} ({name}): {}",
            cell("cause")
        );
        assert!(!cell("cause").is_empty() && cell("remedy").len() > 10, "{what}: {failures:?}");
        if *code != "fit::underdetermined" {
            assert!(
                !cell("place").is_empty() && !cell("place").contains(&folder.display().to_string()),
                "{what}: {}",
                cell("place")
            );
        }
        assert_eq!(table(&spoiled, name, "fits").rows(), 0, "{what}");
    }
    let ways: Vec<[&str; 2]> = WAYS.iter().map(|(what, code, _)| [*what, *code]).collect();
    let (clean, all) = (tree(&folder.join("clean")), tree(&spoiled));
    assert!(
        clean.iter().all(|(path, bytes)| all.get(path) == Some(bytes)),
        "a muscle beside spoiled ones changed"
    );
    // With its file in place the muscle is computed, and only this one.
    fs::rename(folder.join("w00"), folder.join("elsewhere")).unwrap();
    fs::create_dir(folder.join("w00")).unwrap();
    for file in fs::read_dir(folder.join("elsewhere")).unwrap().flatten() {
        fs::copy(file.path(), folder.join("w00").join(file.file_name())).unwrap();
    }
    fs::copy(folder.join("m1").join("muscle.toml"), folder.join("w00/muscle.toml")).unwrap();
    fs::copy(folder.join("w00/a.csv"), folder.join("w00/none.csv")).unwrap();
    let again = answer(&host(folder, &["batch", "fleet.csv", "-o", "spoiled", "--only", "fit", "--json"]));
    assert_eq!(again["computed"], 1, "{again:#}");
    let strict = command(folder, &["batch", "fleet.csv", "-o", "spoiled", "--only", "fit", "--strict"])
        .output()
        .unwrap();
    assert_eq!(strict.status.code(), Some(1));
    println!("figures: {}", json!({"ways": ways, "untouched_files": clean.len()}));
}

/// Who may not read a file gets a failure that says so. Root may read every file.
#[cfg(unix)]
#[test]
fn a_file_without_permission_and_a_name_that_is_no_text_do_not_stop_the_others() {
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fleet(folder, 2);
    let one = fs::read_dir(folder.join("m0"))
        .unwrap()
        .flatten()
        .find(|e| e.path().extension().unwrap() == "csv")
        .unwrap();
    fs::set_permissions(one.path(), fs::Permissions::from_mode(0o0)).unwrap();
    let readable = fs::File::open(one.path()).is_ok();
    let odd = std::ffi::OsStr::from_bytes(b"odd\xff.csv");
    let other = fs::read_dir(folder.join("m1"))
        .unwrap()
        .flatten()
        .find(|e| e.path().extension().unwrap() == "csv")
        .unwrap();
    fs::rename(other.path(), folder.join("m1").join(odd)).unwrap();
    let said = answer(&host(folder, &["batch", "fleet.csv", "-o", "out", "--only", "fit", "--json"]));
    assert_eq!(said["failed"], u64::from(!readable), "{said:#}");
    assert_eq!(table(&folder.join("out"), "m 1", "fits").rows(), 1);
    if !readable {
        assert_eq!(table(&folder.join("out"), "m 0", "failures").text("code", 0), Some("file::unreadable"));
    }
}
