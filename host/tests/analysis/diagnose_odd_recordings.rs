//! `host diagnose` on recordings that are odd or damaged: it answers in the shape that is promised, or says where and what to do.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use pam_data::statistics::extremes;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use proptest::prelude::*;
use serde_json::Value;

/// A few hundred rows take a second; a search that never ends takes longer than this.
const LONGEST: Duration = Duration::from_secs(300);

/// Names of a recording's columns; what the loops below fill.
const NAMES: [&str; 4] = ["time_s", "pressure_kPa", "displacement_mm", "force_N"];

/// A muscle's description, its numbers as text.
#[derive(Debug, Clone)]
struct Description {
    kind: &'static str,
    rest_length: f64,
    angle: f64,
    diameter: f64,
    wall: f64,
}

impl Description {
    fn mini() -> Self {
        Self { kind: "contractile", rest_length: 39.16, angle: 77.4, diameter: 3.0, wall: 0.5 }
    }

    fn text(&self) -> String {
        format!(
            "name = \"odd\"\nkind = \"{}\"\nrest_length_mm = {}\nbraid_angle_deg = {}\nbladder_outer_diameter_mm = {}\n\
             bladder_wall_mm = {}\n",
            self.kind, self.rest_length, self.angle, self.diameter, self.wall
        )
    }
}

/// A recording as columns of cells.
#[derive(Debug, Clone)]
struct Sheet {
    names: Vec<String>,
    columns: Vec<Vec<String>>,
}

/// Three loops at a pressure (kPa), of a force that is much like a muscle's; `noise` N of a repeatable kind.
fn loops(level: f64, rows: usize, noise: f64) -> Sheet {
    let mut columns = vec![Vec::new(); NAMES.len()];
    let mut state = level.to_bits() | 1;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for i in 0..rows {
        let phase = (i as f64 / rows as f64 * 3.0).fract();
        let stroke = 2.5 * (1.0 - (1.0 - 2.0 * phase).abs());
        let way = if phase < 0.5 { 1.0 } else { -1.0 };
        let force = (0.27 * (level - 76.5) - 14.0 * stroke + 1.1 * stroke * stroke) * (1.0 - 0.1 * way);
        let row = [i as f64 * 0.05, level + 0.3 * uniform(), stroke, force + noise * uniform()];
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(format!("{value:.5}"));
        }
    }
    Sheet { names: NAMES.map(String::from).to_vec(), columns }
}

/// What may happen to one column of a recording.
#[derive(Debug, Clone)]
enum Damage {
    /// The sensor is frozen.
    Constant,
    /// Another unit, another sign.
    Scaled(f64),
    /// A zero that is off by a multiple of the range.
    Shifted(f64),
    /// One cell.
    Cell(usize, &'static str),
    /// A converter with few steps.
    Coarse(u8),
    /// The end of its range.
    Clipped(f64),
    /// The rows of this column the other way round.
    Reversed,
    /// A range's worth of noise.
    Noisy(f64),
    /// The column is gone.
    Missing,
    /// Its numbers once more under another name.
    Also(&'static str),
    /// Another name for it.
    Renamed(&'static str),
    /// Rows from this one on are gone, and the last is cut in the middle.
    Cut(usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let cells = ["", "nan", "inf", "-1e400", "x", "1e9", "-1e9", "1e-300", "\"2\"", "1;2", "\u{663}"];
    let others = ["temperature_C", "temperature_K", "cycle", "pressure_command_kPa", "note", "length_mm"];
    let renames =
        ["force_lbf", "force_kN", "pressure_Pa", "pressure_MPa", "time_ms", "contraction", "length_in"];
    prop_oneof![
        Just(Damage::Constant),
        prop::sample::select(vec![-1.0, 0.0, 1e-9, 1e-3, 2.0, 10.0, 1e3, 1e9, 1e300])
            .prop_map(Damage::Scaled),
        prop::sample::select(vec![-100.0, -1.0, -0.1, 0.1, 1.0, 1e9]).prop_map(Damage::Shifted),
        (0..200_usize, prop::sample::select(cells.to_vec())).prop_map(|(i, c)| Damage::Cell(i, c)),
        (0..20_u8).prop_map(Damage::Coarse),
        (0.0..1.0).prop_map(Damage::Clipped),
        Just(Damage::Reversed),
        (0.01..2.0).prop_map(Damage::Noisy),
        Just(Damage::Missing),
        prop::sample::select(others.to_vec()).prop_map(Damage::Also),
        prop::sample::select(renames.to_vec()).prop_map(Damage::Renamed),
        (0..200_usize).prop_map(Damage::Cut),
    ]
}

impl Sheet {
    fn suffer(&mut self, column: usize, damage: &Damage) {
        let column = column % self.columns.len().max(1);
        if self.columns.get(column).is_none_or(Vec::is_empty) {
            return;
        }
        let numbers: Vec<f64> = self.columns[column].iter().map(|c| c.parse().unwrap_or(0.0)).collect();
        let (low, high) = extremes(&numbers);
        let range = if high > low { high - low } else { 1.0 };
        let mut set = |of: &dyn Fn(usize, f64) -> f64| {
            for (i, (cell, v)) in self.columns[column].iter_mut().zip(&numbers).enumerate() {
                *cell = of(i, *v).to_string();
            }
        };
        match damage {
            Damage::Constant => set(&|_, _| numbers[numbers.len() / 2]),
            Damage::Scaled(factor) => set(&|_, v| v * factor),
            Damage::Shifted(ranges) => set(&|_, v| v + ranges * range),
            Damage::Coarse(steps) => {
                let step = range / f64::from(steps + 1);
                set(&|_, v| (v / step).round() * step);
            }
            Damage::Clipped(part) => set(&|_, v| v.min(low + part * range)),
            Damage::Reversed => self.columns[column].reverse(),
            Damage::Noisy(ranges) => {
                set(&|i, v| v + ranges * range * ((i * 7919 % 1009) as f64 / 1009.0 - 0.5))
            }
            Damage::Cell(row, cell) => {
                let row = row % numbers.len();
                (*cell).clone_into(&mut self.columns[column][row]);
            }
            Damage::Missing => {
                self.columns.remove(column);
                self.names.remove(column);
            }
            Damage::Also(name) => {
                let again = self.columns[column].clone();
                self.columns.push(again);
                self.names.push((*name).to_owned());
            }
            Damage::Renamed(name) => (*name).clone_into(&mut self.names[column]),
            Damage::Cut(row) => {
                let row = row % numbers.len();
                for c in &mut self.columns {
                    c.truncate(row + 1);
                }
                if let Some(last) = self.columns[column].last_mut() {
                    *last = last.chars().take(1).collect();
                }
            }
        }
    }

    fn text(&self) -> String {
        let mut text = self.names.join(",") + "\n";
        for i in 0..self.columns.first().map_or(0, Vec::len) {
            let row: Vec<&str> = self.columns.iter().map(|c| c[i].as_str()).collect();
            writeln!(text, "{}", row.join(",")).unwrap();
        }
        text
    }
}

/// A check with dead weights: known forces and what the cell reads, a gain apart.
fn dead_weights(gain: f64) -> String {
    let mut text = "time_s,pressure_kPa,force_N,reference_force_N\n".to_owned();
    for i in 0..60 {
        let known = f64::from(i / 10) * 20.0;
        writeln!(text, "{i},{},{},{known}", if i % 20 < 10 { 0.0 } else { 300.0 }, known * gain).unwrap();
    }
    text
}

/// The program's answer; that it takes too long is a failure.
fn host(folder: &Path, arguments: &[String]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .stdout(std::fs::File::create(folder.join("said.json")).unwrap())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let began = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if began.elapsed() > LONGEST {
            child.kill().unwrap();
            panic!("no answer within {LONGEST:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn number(of: &Value, key: &str) -> f64 {
    let value = of[key].as_f64();
    value.unwrap_or_else(|| panic!("`{key}` is not a number in {of}"))
}

/// The shape that scripts rely on.
fn assert_shape(answer: &Value) {
    assert_eq!(answer["schema"], "pam-diagnose/1");
    let verdict = answer["verdict"].as_str().unwrap();
    assert!(["consistent", "explained", "partly-explained", "unexplained"].contains(&verdict), "{verdict}");
    assert!(number(answer, "noise_N") >= 0.0 && number(answer, "misfit_rms_N") >= 0.0);
    let list = |key: &str| answer[key].as_array().unwrap_or_else(|| panic!("`{key}` is no list"));
    for region in list("where") {
        assert!(region["coordinate"].is_string(), "{region}");
        assert!(number(region, "from") <= number(region, "to"), "{region}");
        assert!((0.0..=1.0 + 1e-9).contains(&number(region, "share")), "{region}");
    }
    for missing in list("missing") {
        assert!((0.0..=1.0).contains(&number(missing, "probability")), "{missing}");
        assert!(number(missing, "share_explained").is_finite());
        assert!(missing["confusable_with"].as_array().unwrap().iter().all(Value::is_string));
        for p in missing["parameters"].as_array().unwrap() {
            assert!(p["name"].is_string() && p["unit"].is_string() && number(p, "value").is_finite(), "{p}");
            assert!(p["std"].is_null() || number(p, "std") >= 0.0, "{p}");
        }
    }
    for considered in list("considered") {
        assert!(considered["effect"].is_string() && considered["why_not"].is_string(), "{considered}");
        assert!(number(considered, "gain").is_finite());
    }
    for key in ["rms_before_N", "rms_after_N", "noise_N"] {
        assert!(number(&answer["held_out"], key) >= 0.0);
    }
    assert!(number(&answer["unexplained"], "share").is_finite());
    assert!(answer["unexplained"]["pattern"].is_string());
    let next = &answer["next_experiment"];
    assert!(next.is_null() || number(next, "expected_difference_N").is_finite(), "{next}");
    // Where nothing was judged nothing is claimed, and the reason stands first.
    if !answer["judged"].as_bool().unwrap() {
        assert!(verdict == "consistent" && list("missing").is_empty());
        let first = answer["remarks"][0].as_str().unwrap_or_default();
        assert!(first.starts_with("not judged: "), "{first}");
    }
}

/// Everything that a call of `host diagnose` can be given, apart from the files' content.
#[derive(Debug, Clone, Default)]
struct Call {
    check: bool,
    with: Option<&'static str>,
    output: bool,
    pages: bool,
}

fn diagnose(muscle: &Description, sheets: &[Sheet], call: &Call) -> (i32, String) {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    put("muscle.toml", &muscle.text());
    put("weights.csv", &dead_weights(1.02));
    let mut arguments: Vec<String> =
        ["diagnose", "--muscle", "muscle.toml", "--json", "-"].map(String::from).to_vec();
    for (i, sheet) in sheets.iter().enumerate() {
        put(&format!("{i}.csv"), &sheet.text());
        arguments.push(format!("{i}.csv"));
    }
    let mut add = |words: &[&str]| arguments.extend(words.iter().map(|w| (*w).to_owned()));
    if call.check {
        add(&["--check", "weights.csv"]);
    }
    if let Some(effects) = call.with {
        add(&["--with", effects]);
    }
    if call.output {
        add(&["-o", "out.pam"]);
    }
    if call.pages {
        add(&["--report", "out.html", "--figures", "out", "--next", "next.toml"]);
    }
    let output = host(folder.path(), &arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let status = output.status.code().unwrap_or(-1);
    let written = |name: &str| folder.path().join(name).exists();
    match status {
        0 => {
            let json = std::fs::read_to_string(folder.path().join("said.json")).unwrap();
            assert_shape(&serde_json::from_str(&json).unwrap_or_else(|e| panic!("{e}: {json}")));
            assert!(!call.output || written("out.pam"), "{said}");
            assert!(!call.pages || (written("out.html") && written("out")), "{said}");
        }
        // What is wrong, and what to do; where, if it is a matter of one file.
        1 => {
            assert!(said.contains("error[") && said.contains(" help: "), "{said}");
            assert!(!written("out.pam"), "a table in spite of an error: {said}");
        }
        _ => panic!("status {status}: {said}"),
    }
    assert!(!said.contains("panicked"), "{said}");
    (status, said)
}

fn description() -> impl Strategy<Value = Description> {
    let odd = (prop::bool::ANY, 0.0_f64..4.0, 30.0..89.9, 0.0_f64..3.0, 0.001..0.6).prop_map(
        |(push, rest, angle, diameter, wall)| {
            let diameter = 10_f64.powf(diameter);
            Description {
                kind: if push { "push" } else { "contractile" },
                rest_length: 10_f64.powf(rest),
                angle,
                diameter,
                wall: wall * diameter,
            }
        },
    );
    prop_oneof![3 => Just(Description::mini()), 1 => odd]
}

fn call() -> impl Strategy<Value = Call> {
    let effects = prop::option::weighted(
        0.25,
        prop::sample::select(vec![
            "backlash",
            "viscous-damping,force-offset",
            "mullins-softening,leak",
            "gravity",
        ]),
    );
    (prop::bool::ANY, effects, prop::bool::ANY, prop::bool::weighted(0.3))
        .prop_map(|(check, with, output, pages)| Call { check, with, output, pages })
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 32,
        max_shrink_iters: 24,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// For any files and options: an answer of the promised shape or a clear error, in a short time.
    #[test]
    fn any_recording_gives_an_answer_or_a_reason(
        muscle in description(),
        levels in prop::collection::vec((60.0..700.0, 1..160_usize, prop::sample::select(vec![0.0, 0.1, 3.0])), 1..6),
        damages in prop::collection::vec((0..6_usize, 0..8_usize, damage()), 0..4),
        twice in prop::bool::weighted(0.2),
        call in call(),
    ) {
        let mut sheets: Vec<Sheet> = levels.iter().map(|(p, rows, noise)| loops(*p, *rows, *noise)).collect();
        let count = sheets.len();
        for (file, column, damage) in &damages {
            sheets[file % count].suffer(*column, damage);
        }
        if twice {
            sheets.extend(sheets.clone());
        }
        diagnose(&muscle, &sheets, &call);
    }
}

const LEVELS: [f64; 5] = [150.0, 250.0, 350.0, 450.0, 550.0];

/// The same damage in every file of a campaign.
fn all(rows: usize, column: usize, damage: &Damage) -> Vec<Sheet> {
    LEVELS
        .map(|p| {
            let mut sheet = loops(p, rows, 0.1);
            sheet.suffer(column, damage);
            sheet
        })
        .to_vec()
}

/// A sensor that is dead in every file is never "the model agrees".
#[test]
fn dead_sensors_are_reported() {
    for (what, column) in [("pressure", 1), ("stroke", 2), ("force", 3)] {
        let folder: PathBuf = tempfile::tempdir().unwrap().keep();
        let sheets = all(150, column, &Damage::Scaled(0.0));
        std::fs::write(folder.join("m.toml"), Description::mini().text()).unwrap();
        let mut arguments = ["diagnose", "--muscle", "m.toml", "--json", "-", "--report", "r.html"]
            .map(String::from)
            .to_vec();
        for (i, sheet) in sheets.iter().enumerate() {
            std::fs::write(folder.join(format!("{i}.csv")), sheet.text()).unwrap();
            arguments.push(format!("{i}.csv"));
        }
        let output = host(&folder, &arguments);
        if output.status.success() {
            let json = std::fs::read_to_string(folder.join("said.json")).unwrap();
            let answer: Value = serde_json::from_str(&json).unwrap();
            assert_eq!(answer["judged"], false, "{what}: {}", answer["remarks"]);
            let page = std::fs::read_to_string(folder.join("r.html")).unwrap();
            assert!(
                page.contains("do not allow a judgement") && !page.contains("recordings agree"),
                "{what}"
            );
            // What it was made from.
            assert!(
                sheets.iter().enumerate().all(|(i, _)| page.contains(&format!("<dt>{i}</dt>"))),
                "{what}"
            );
        } else {
            assert!(String::from_utf8_lossy(&output.stderr).contains(" help: "), "{what}");
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}

/// Every way to ask, of a campaign that has nothing odd about it.
#[test]
fn every_way_to_ask_is_answered() {
    let sheets = LEVELS.map(|p| loops(p, 150, 0.1));
    for choice in 0..16 {
        let call = Call {
            check: choice & 1 != 0,
            with: (choice & 2 != 0).then_some("backlash"),
            output: choice & 4 != 0,
            pages: choice & 8 != 0,
        };
        let (status, said) = diagnose(&Description::mini(), &sheets, &call);
        assert_eq!(status, 0, "{call:?}: {said}");
    }
}
