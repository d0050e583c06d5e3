//! Files that were made to do harm: they end in an error with its cause, within 1.5 GiB of address space, and nothing in them acts on a
//! terminal.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the program with bounded memory.
fn host(folder: &Path, arguments: &[&str]) -> Output {
    let bounded = "ulimit -v 1572864; exec \"$0\" \"$@\"";
    Command::new("bash")
        .args(["-c", bounded, env!("CARGO_BIN_EXE_host")])
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "2")
        .output()
        .unwrap()
}

fn said(output: &Output) -> String {
    [&output.stdout[..], &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

/// An error with its cause: no panic, no crash, no signal.
fn is_refused(output: &Output, what: &str) {
    let said = said(output);
    assert_eq!(output.status.code(), Some(1), "{what}: {:?} {said}", output.status);
    assert!(said.contains("error["), "{what}: {said}");
    assert!(!said.contains("panicked"), "{what}: {said}");
}

fn varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// A Parquet file whose one column is in groups within groups.
fn nested_parquet(depth: u64) -> Vec<u8> {
    let mut meta = vec![0x15, 0x02, 0x19, 0xfc];
    varint(depth + 2, &mut meta);
    meta.extend([0x48, 1, b'r', 0x15, 2, 0]);
    for _ in 0..depth {
        meta.extend([0x35, 0, 0x18, 1, b'g', 0x15, 2, 0]);
    }
    meta.extend([0x15, 0x0a, 0x25, 0, 0x18, 1, b'x', 0]);
    meta.extend([0x16, 0, 0x19, 0x0c, 0]);
    [b"PAR1", &meta[..], &(meta.len() as u32).to_le_bytes(), b"PAR1"].concat()
}

/// A MATLAB file of version 5 with a cell in a cell in a cell.
fn nested_matlab(depth: usize) -> Vec<u8> {
    let element = |kind: u32, data: &[u8]| {
        let mut padded = data.to_vec();
        padded.resize(data.len().next_multiple_of(8), 0);
        [&kind.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), &padded].concat()
    };
    let header = |class: u32| {
        [
            element(6, &[class.to_le_bytes(), [0; 4]].concat()),
            element(5, &[1_u32.to_le_bytes(), 1_u32.to_le_bytes()].concat()),
            element(1, b"c"),
        ]
        .concat()
    };
    let cell = header(1);
    // Each header states the length of all that it contains.
    let innermost = [header(6), element(9, &1.0_f64.to_le_bytes())].concat();
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(126, b' ');
    file.extend(b"IM");
    for level in 0..depth {
        let length = innermost.len() + (depth - level) * (cell.len() + 8);
        file.extend(14_u32.to_le_bytes());
        file.extend((length as u32).to_le_bytes());
        file.extend_from_slice(&cell);
    }
    file.extend(14_u32.to_le_bytes());
    file.extend((innermost.len() as u32).to_le_bytes());
    file.extend(innermost);
    file
}

/// 4 GiB of one digit: a member of a gzip file again and again.
fn one_endless_line() -> Vec<u8> {
    let mut member = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    member.write_all(&vec![b'1'; 16 << 20]).unwrap();
    member.finish().unwrap().repeat(256)
}

#[test]
fn nesting_without_end_and_lines_without_end_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let deep = "a = ".to_owned() + &"[".repeat(200_000);
    let deep_names = "[".to_owned() + &"a.".repeat(100_000) + "a]\n";
    let muscle = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/muscles/mini.toml");
    std::fs::copy(muscle, folder.path().join("mini.toml")).unwrap();
    let cases: [(&str, Vec<u8>); 4] = [
        ("line.csv.gz", one_endless_line()),
        ("line.csv", vec![b'1'; 300 << 20]),
        ("groups.parquet", nested_parquet(200_000)),
        ("cells.mat", nested_matlab(40_000)),
    ];
    for (name, bytes) in cases {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        is_refused(&host(folder.path(), &["import", "--guess", name]), name);
        is_refused(&host(folder.path(), &["fit", "--muscle", "mini.toml", name, "-o", "mini.pam"]), name);
    }
    for (name, text) in [("deep.toml", deep), ("names.toml", deep_names)] {
        std::fs::write(folder.path().join(name), text).unwrap();
        std::fs::write(folder.path().join("a.csv"), "time_s\n1\n").unwrap();
        is_refused(
            &host(folder.path(), &["fit", "--muscle", "mini.toml", "--import", name, "a.csv", "-o", "m.pam"]),
            name,
        );
        is_refused(&host(folder.path(), &["fit", "--muscle", name, "a.csv", "-o", "m.pam"]), name);
    }
}

#[test]
fn names_from_files_do_not_act_on_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let escape = "\u{1b}]0;owned\u{7}\u{1b}[2J\u{202e}";
    let file = format!("{escape}.csv");
    let rows = "0,1,2,3\n1,2,3,4\n";
    std::fs::write(
        folder.path().join(&file),
        format!("{escape},pressure_kPa,displacement_mm,{escape}_N\n{rows}"),
    )
    .unwrap();
    let muscle = format!("name = \"{escape}\"\nkind = \"{escape}\"\n");
    std::fs::write(
        folder.path().join("m.toml"),
        muscle.replace('\u{1b}', "\\u001b").replace('\u{7}', "\\u0007"),
    )
    .unwrap();
    for arguments in [
        &["import", "--guess", &file][..],
        &["fit", "--muscle", "m.toml", &file],
        &["fit", "--muscle", &file, &file],
        &["diagnose", "--muscle", "m.toml", &file],
        &["table", "show", &file],
        &["recover", &file],
        &["predict", "--table", &file, &file],
        &["compare", &file, &file],
        &["run", "--port", escape, "--force", escape],
        &[escape],
    ] {
        let output = host(folder.path(), arguments);
        let said = said(&output);
        let acts = |c: char| matches!(c, '\u{1b}' | '\u{7}' | '\u{202e}');
        assert!(!said.contains(acts), "{arguments:?}: {said:?}");
        assert!(output.status.code().is_some_and(|code| code < 3), "{arguments:?}: {said}");
    }
}

#[test]
fn a_full_disk_behind_standard_output_is_a_failure_of_every_command_that_prints() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("a.csv"),
        "time_s,pressure_kPa,displacement_mm,force_N\n0,1,2,3\n1,2,3,4\n",
    )
    .unwrap();
    for arguments in [
        &["--help"][..],
        &["--version"],
        &["help", "fit"],
        &["completions", "bash"],
        &["import", "--guess", "a.csv", "-o", "-"],
        &["effects"],
        &["device", "list"],
    ] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_host"))
            .args(arguments)
            .current_dir(&folder)
            .stdout(full)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", said(&output));
    }
}
