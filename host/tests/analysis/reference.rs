//! `host diagnose --reference` as it is called: answers in the promised shape, and clear words where nothing can be compared.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Sweeps of pressure at a held length, N, kPa, s; `length` names the column of the length with its value.
fn sweep(file: &Path, seed: u64, length: Option<(&str, f64)>, change: impl Fn(f64, f64) -> (f64, f64)) {
    let mut state = seed | 1;
    let mut noise = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut text = "time_s,pressure_kPa,force_N".to_owned();
    if let Some((name, _)) = length {
        let _ = write!(text, ",{name}");
    }
    text.push('\n');
    for i in 0..600 {
        let (p, d) =
            if i < 300 { (10.0 + 2.0 * f64::from(i), 1.0) } else { (610.0 - 2.0 * f64::from(i - 300), -1.0) };
        let pull = (p - 60.0_f64).max(0.0);
        let f = 0.6 * pull - 2.0 * d * pull / 550.0 + 0.5 * noise();
        let (dp, df) = change(p, f);
        let _ = write!(text, "{:.2},{:.3},{:.4}", 0.1 * f64::from(i), p + dp, f + df);
        if let Some((_, value)) = length {
            let _ = write!(text, ",{value}");
        }
        text.push('\n');
    }
    std::fs::write(file, text).unwrap();
}

struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Three runs under one name.
    fn runs(
        &self,
        name: &str,
        length: Option<(&str, f64)>,
        change: impl Fn(f64, f64) -> (f64, f64) + Copy,
    ) -> Vec<PathBuf> {
        let seed = name.bytes().map(u64::from).sum::<u64>();
        (0..3)
            .map(|i| {
                let file = self.0.path().join(format!("{name}{i}.csv"));
                sweep(&file, 1000 * seed + 17 * i, length, change);
                file
            })
            .collect()
    }

    fn ask(&self, after: &[PathBuf], before: &[PathBuf], more: &[&str]) -> (i32, Value, String) {
        let out = Command::new(env!("CARGO_BIN_EXE_host"))
            .current_dir(self.0.path())
            .env("PAM_SETTINGS", "")
            .arg("diagnose")
            .args(after)
            .arg("--reference")
            .args(before)
            .args(["--same-mounting", "--json", "-"])
            .args(more)
            .output()
            .unwrap();
        let answer = serde_json::from_slice(&out.stdout).unwrap_or(Value::Null);
        (out.status.code().unwrap(), answer, String::from_utf8_lossy(&out.stderr).into_owned())
    }
}

fn same(_: f64, _: f64) -> (f64, f64) {
    (0.0, 0.0)
}

#[test]
fn pressure_and_force_alone_are_enough_and_the_json_has_the_promised_shape() {
    let bench = Bench::new();
    let (before, after) = (bench.runs("before", None, same), bench.runs("after", None, |_, _| (0.0, 12.0)));
    let (status, answer, said) = bench.ask(&after, &before, &["--report", "page.html"]);
    assert_eq!(status, 0, "{said}");
    assert_eq!(answer["schema"], "pam-diagnose/1");
    assert_eq!(answer["missing"][0]["effect"], "force-offset", "{answer:#}");
    for key in [
        "verdict",
        "noise_N",
        "misfit_rms_N",
        "where",
        "unexplained",
        "held_out",
        "next_experiment",
        "considered",
    ] {
        assert!(answer.get(key).is_some(), "{key}");
    }
    let reference = &answer["reference"];
    assert_eq!(reference["files"].as_array().unwrap().len(), 3);
    assert!(reference["table"].is_null() && reference["samples"] == 1800);
    assert!(reference["repeatability_N"].as_f64().unwrap() > 0.0);
    assert!(
        reference["not_comparable"]
            .as_array()
            .unwrap()
            .iter()
            .any(|n| n.as_str().unwrap().contains("end-slip"))
    );
    let page = std::fs::read_to_string(bench.0.path().join("page.html")).unwrap();
    assert!(page.contains("force-offset") && page.contains("<svg"));
}

#[test]
fn untouched_recordings_with_a_length_are_consistent() {
    let bench = Bench::new();
    let length = Some(("length_mm", 120.0));
    let (before, after) = (bench.runs("before", length, same), bench.runs("after", length, same));
    let (status, answer, said) = bench.ask(&after, &before, &[]);
    assert_eq!((status, &answer["verdict"]), (0, &Value::from("consistent")), "{said} {answer:#}");
    assert_eq!(answer["missing"], Value::Array(Vec::new()));
}

#[test]
fn sides_that_cannot_be_compared_are_refused_with_a_remedy() {
    let bench = Bench::new();
    let before = bench.runs("before", Some(("displacement_mm", 0.0)), same);
    let elsewhere = bench.runs("elsewhere", Some(("displacement_mm", 9.0)), same);
    let (status, _, said) = bench.ask(&elsewhere, &before, &[]);
    assert!(
        status == 1 && said.contains("none of the reference's lengths") && said.contains("9.0"),
        "{said}"
    );
    let (status, _, said) = bench.ask(&before, &before, &[]);
    assert!(status == 2 && said.contains("both sides"), "{said}");
    let psi = bench.runs("psi", Some(("displacement_mm", 0.0)), |p, _| (p / 6.894_757 - p, 0.0));
    let (status, _, said) = bench.ask(&psi, &before, &[]);
    assert!(status == 1 && said.contains("psi"), "{said}");
    let after = bench.runs("after", Some(("displacement_mm", 0.0)), same);
    let (status, _, said) = bench.ask(&after, &before, &["-o", "t.pam"]);
    assert!(status == 2 && said.contains("--muscle"), "{said}");
    std::fs::write(bench.0.path().join("short.csv"), "time_s,pressure_kPa\n0,1\n1,2\n").unwrap();
    let (status, _, said) = bench.ask(&[bench.0.path().join("short.csv")], &before, &[]);
    assert!(status == 1 && said.contains("help"), "{said}");
    // Without a length the actuator counts as held: what is missing then is the pressure.
    std::fs::write(bench.0.path().join("joint.csv"), "time_s,angle_rad,force_N\n0,1,1\n1,2,1\n").unwrap();
    let (status, _, said) = bench.ask(&[bench.0.path().join("joint.csv")], &before, &[]);
    assert!(status == 1 && said.contains("no column of pressure"), "{said}");
}

#[test]
fn bad_references_are_refused_with_the_cause() {
    let bench = Bench::new();
    let after = bench.runs("after", None, same);
    let file = |name: &str, text: &str| {
        let path = bench.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let (status, _, said) = bench.ask(&after, &[bench.0.path().join("absent.csv")], &[]);
    assert!(status == 1 && said.contains("absent.csv") && said.contains("help"), "{said}");
    let (status, _, said) = bench.ask(&after, &[file("empty.csv", "")], &[]);
    assert!(status == 1 && said.contains("empty.csv"), "{said}");
    let (status, _, said) = bench.ask(&after, &[file("head.csv", "time_s,pressure_kPa,force_N\n")], &[]);
    assert!(status == 1 && said.contains("head.csv"), "{said}");
    let (status, _, said) = bench.ask(&after, &[file("broken.pam", "no table")], &[]);
    assert!(status == 1 && said.contains("broken.pam") && said.contains("table"), "{said}");
    let (status, _, said) = bench.ask(&after, &[file("a.pam", "x"), file("b.pam", "x")], &[]);
    assert!(status == 2 && said.contains("one table"), "{said}");
}

#[test]
fn overlapping_parts_of_one_recording_are_refused_and_the_wrong_order_is_reported() {
    let bench = Bench::new();
    let whole = bench.runs("whole", None, same);
    let text = std::fs::read_to_string(&whole[0]).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let part = |name: &str, from: usize, to: usize| {
        let path = bench.0.path().join(name);
        std::fs::write(&path, format!("{}\n{}\n", lines[0], lines[from..to].join("\n"))).unwrap();
        path
    };
    let (first, second) = (part("first.csv", 1, 400), part("second.csv", 200, 600));
    let (status, _, said) = bench.ask(&[second], &[first], &[]);
    assert!(status == 2 && said.contains("overlap"), "{said}");
    let dated = |name: &str, from: &Path| {
        let path = bench.0.path().join(name);
        std::fs::copy(from, &path).unwrap();
        path
    };
    let march: Vec<PathBuf> =
        whole.iter().enumerate().map(|(i, f)| dated(&format!("2026-03-0{}.csv", i + 1), f)).collect();
    let other = bench.runs("other", None, same);
    let may: Vec<PathBuf> =
        other.iter().enumerate().map(|(i, f)| dated(&format!("2026-05-0{}.csv", i + 1), f)).collect();
    let remarks = |after: &[PathBuf], before: &[PathBuf]| {
        let (status, answer, said) = bench.ask(after, before, &[]);
        assert_eq!(status, 0, "{said}");
        answer["remarks"].to_string()
    };
    assert!(remarks(&march, &may).contains("2026-05-01"), "the reference is later");
    assert!(!remarks(&may, &march).contains("wrong way round"));
}

#[test]
fn another_actuator_gets_no_names() {
    let bench = Bench::new();
    let before = bench.runs("before", None, same);
    // Three times as stiff above another threshold.
    let after =
        bench.runs("after", None, |p, f| (0.0, 1.8 * (p - 250.0).max(0.0) - f + 0.3 * (f - 100.0).max(0.0)));
    let (status, answer, said) = bench.ask(&after, &before, &[]);
    assert_eq!(status, 0, "{said}");
    assert_eq!(answer["verdict"], "unexplained", "{answer:#}");
    assert_eq!(answer["missing"], Value::Array(Vec::new()));
    assert!(answer["remarks"].to_string().contains("same actuator"), "{answer:#}");
}

#[test]
fn recordings_without_a_reference_need_a_muscle() {
    let out = Command::new(env!("CARGO_BIN_EXE_host")).args(["diagnose", "a.csv"]).output().unwrap();
    assert_eq!(out.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&out.stderr).contains("--muscle"));
}
