//! The program against the controller's own library on the virtual bench: flash, run, record, fault, vent, settings.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use model_core::units::Pressure;
use pam_data::recording::Reader;
use pam_device::emulated::{Emulated, Kind, Mishap, Stand};
use pam_device::recorder::side_file;
use pam_fit::table_file::{About, TableFile};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::Motion;
use virtual_bench::presets;

/// How long to wait for what must happen: what has not by then never will.
const HOPELESS: Duration = Duration::from_secs(120);
/// Rows of a run after which its load cell breaks: the muscle is filled by then.
const BREAKS_AFTER: usize = 2_000;

/// Rows of a recording, finished or not.
fn rows(file: &Path) -> usize {
    std::fs::read(file).map_or(0, |text| text.iter().filter(|byte| **byte == b'\n').count().saturating_sub(1))
}

struct Bench {
    emulated: Emulated,
    mishap: std::sync::Arc<std::sync::atomic::AtomicU8>,
    folder: PathBuf,
}

impl Bench {
    fn start(name: &str) -> Self {
        let spec = BenchSpec::laboratory(presets::miniature(), 3);
        let motion = Motion::Sine { mean_mm: 0.6, amplitude_mm: 0.2, frequency_hz: 0.5 };
        let stand = Stand::new(spec, motion);
        let mishap = stand.mishap();
        let emulated = Emulated::start(stand, Some(Kind::Native), 3.0).unwrap();
        let folder = std::env::temp_dir().join(format!("pam-controller-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let bench = Self { emulated, mishap, folder };
        // Three times as fast as the clock, a program that waits for a busy machine is soon called silent; that is tried elsewhere.
        bench.done(&["device", "settings", "--set", "watch.autonomous=true"]);
        bench
    }

    fn host(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_host"))
            .args(arguments)
            .args(["--port", &self.emulated.address().to_string()])
            .current_dir(&self.folder)
            .output()
            .unwrap()
    }

    fn done(&self, arguments: &[&str]) -> String {
        let output = self.host(arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "host {arguments:?}: {said}");
        String::from_utf8_lossy(&output.stdout).into_owned() + &said
    }

    fn refused(&self, arguments: &[&str]) -> (i32, String) {
        let output = self.host(arguments);
        (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
    }

    /// Follows a force until the load cell's wire breaks, and records it.
    fn broken(&self, name: &str) -> (i32, String) {
        let (part, mishap) = (self.folder.join(format!("{name}.part")), std::sync::Arc::clone(&self.mishap));
        let breaks = std::thread::spawn(move || {
            let end = Instant::now() + HOPELESS;
            while rows(&part) < BREAKS_AFTER && Instant::now() < end {
                std::thread::sleep(Duration::from_millis(5));
            }
            mishap.store(Mishap::LoadCell as u8, Ordering::Relaxed);
        });
        let ended = self.refused(&["run", "--force", "40", "--seconds", "1000", "-o", name, "--replace"]);
        breaks.join().unwrap();
        ended
    }

    /// Repairs the broken part, and clears the fault once the device has detected the repair.
    fn mend(&self) {
        self.mishap.store(0, Ordering::Relaxed);
        let end = Instant::now() + HOPELESS;
        while let (1.., said) = self.refused(&["device", "faults", "--clear"]) {
            assert!(said.contains("still present") && Instant::now() < end, "{said}");
        }
    }

    fn table(&self, name: &str, deadband_kpa: f32) -> &Path {
        let mut table = model_core::table::example();
        table.deadband = Pressure::from_kilopascals(deadband_kpa);
        TableFile { table, about: About { muscle: "mini".into(), ..About::default() } }
            .write(self.folder.join(name))
            .unwrap();
        &self.folder
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn a_table_is_flashed_backed_up_compared_and_rolled_back() {
    let bench = Bench::start("flash");
    bench.table("one.pam", 76.5);
    bench.table("two.pam", 80.0);
    let said = bench.done(&["flash", "one.pam"]);
    assert!(said.contains("no table yet") && said.contains("written and read back"), "{said}");
    let said = bench.done(&["flash", "one.pam"]);
    assert!(said.contains("already has this table"), "{said}");
    let said = bench.done(&["flash", "two.pam", "--dry-run"]);
    assert!(said.contains("P0, kPa") && said.contains("76.50") && said.contains("80.00"), "{said}");
    assert!(said.contains("nothing was written"), "{said}");
    let said = bench.done(&["flash", "two.pam", "--json"]);
    assert!(said.contains("\"written\": true"), "{said}");
    let kept: Vec<_> = std::fs::read_dir(&bench.folder)
        .unwrap()
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| n.starts_with("two.") && n != "two.pam")
        .collect();
    assert_eq!(kept.len(), 1, "{kept:?}");
    let backup = TableFile::read(bench.folder.join(&kept[0])).unwrap();
    assert_eq!(backup.table, model_core::table::example());
    bench.done(&["device", "rollback"]);
    let said = bench.done(&["flash", "one.pam"]);
    assert!(said.contains("already has this table"), "{said}");
}

#[test]
fn a_run_is_a_recording_that_the_readers_of_recordings_read() {
    let bench = Bench::start("run");
    bench.table("mini.pam", 76.5);
    bench.done(&["flash", "mini.pam"]);
    let run = [
        "run",
        "--force",
        "sine mean=45 amplitude=15 frequency=1",
        "--seconds",
        "2",
        "-o",
        "run.csv",
        "--json",
    ];
    let said = bench.done(&run);
    assert!(said.contains("\"samples\": 2000") || said.contains("\"samples\": 1999"), "{said}");
    let path = bench.folder.join("run.csv");
    let recording = Reader::new().file(&path).unwrap().remove(0);
    assert!((1990..=2001).contains(&recording.len()), "{}", recording.len());
    let force = recording.force.as_ref().unwrap();
    let mean = force.iter().skip(500).sum::<f64>() / (force.len() - 500) as f64;
    // The table is an example of this kind of muscle, not a fit of this one: the force is near, not at, what was requested.
    assert!((20.0..70.0).contains(&mean), "{mean} N");
    assert!(recording.pressure_command.is_some());
    let side: serde_json::Value = serde_json::from_slice(&std::fs::read(side_file(&path)).unwrap()).unwrap();
    assert_eq!(side["schema"], "pam-run/1");
    assert_eq!(side["device"]["board"], "native");
    assert!(side["device"]["tables"][0]["crc"].is_string() && side["device"]["settings"].is_object());
    let predicted = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(["predict", "--table", "mini.pam", "run.csv", "--json", "-"])
        .current_dir(&bench.folder)
        .output()
        .unwrap();
    assert!(
        predicted.status.success() && String::from_utf8_lossy(&predicted.stdout).contains("pam-predict/1")
    );
    assert!(side["saturated_ticks"].is_u64(), "{side}");
    // The first second, in which the vented muscle fills, is reported separately.
    let rms = |key: &str| side[key].as_f64().unwrap();
    assert!(rms("tracking_rms_after_1_s") < rms("tracking_rms"), "{side}");
    // Numbers of single precision are written as such.
    assert_eq!(side["device"]["settings"]["regulator"]["lag_s"].to_string(), "0.03");
    // A second one of the same name is refused unless it is meant, and the first stays.
    let again = ["run", "--pressure", "100", "--seconds", "0.2", "-o", "run.csv"];
    let (status, said) = bench.refused(&again);
    assert!(status == 2 && said.contains("--replace"), "{said}");
    assert_eq!(Reader::new().file(&path).unwrap()[0].len(), recording.len());
    bench.done(&[&again[..], &["--replace"]].concat());
    assert!(Reader::new().file(&path).unwrap()[0].len() < recording.len());
    // Seven times what this muscle can do.
    let said = bench.done(&["run", "--force", "1000", "--seconds", "0.5"]);
    assert!(
        said.contains("of 0.50 s the setpoint could not be reached: more than the muscle can pull"),
        "{said}"
    );
    let said = bench.done(&["run", "--force=-200", "--seconds", "0.5"]);
    assert!(said.contains("could not be reached: less than it pulls there without pressure"), "{said}");
    // A muscle that is tested at less than it is used at.
    let mut table = model_core::table::example();
    table.tested.pressure_high = Pressure::from_kilopascals(220.0);
    TableFile { table, about: About::default() }.write(bench.folder.join("narrow.pam")).unwrap();
    bench.done(&["flash", "narrow.pam"]);
    let said = bench.done(&["run", "--force", "50", "--seconds", "0.5", "--json"]);
    assert!(said.contains("outside the tested range of its table (up to 220 kPa"), "{said}");
    let answer = serde_json::Deserializer::from_str(&said).into_iter::<serde_json::Value>().next();
    let reach = answer.unwrap().unwrap()["reach"].clone();
    let seconds = |name: &str| reach[name].as_f64().unwrap();
    assert!(seconds("outside_tested_s") > 0.3 && seconds("beyond_blocked_force_s") == 0.0, "{said}");
}

#[test]
fn a_broken_load_cell_stops_a_run_with_a_message_and_the_rows_until_then_are_kept() {
    let bench = Bench::start("fault");
    bench.table("mini.pam", 76.5);
    bench.done(&["flash", "mini.pam"]);
    let (status, said) = bench.broken("broken.csv");
    assert_eq!(status, 1);
    assert!(
        said.contains("error[device::fault]")
            && said.contains("a sensor reading is out of range (load cell)"),
        "{said}"
    );
    assert!(said.contains("broken wire"), "the remedy is reported: {said}");
    assert!(rows(&bench.folder.join("broken.csv")) >= BREAKS_AFTER);
    let (status, said) = bench.refused(&["run", "--force", "40", "--seconds", "1"]);
    assert!(status == 1 && said.contains("load cell"), "a latched fault stays: {said}");
    let (status, said) = bench.refused(&["device", "faults", "--clear"]);
    assert!(status == 1 && said.contains("still present"), "{said}");
    bench.mend();
    bench.done(&["run", "--force", "40", "--seconds", "0.5"]);
    let said = bench.done(&["device", "faults", "--json"]);
    assert!(said.contains("sensor-range"), "{said}");
}

/// What a trace of a loop that a broken wire stopped shows, by the headings of its columns.
fn traced(bench: &Bench, variables: &str) -> serde_json::Value {
    bench.done(&["device", "trace", "--trigger", "until-fault", "--variables", variables]);
    bench.broken("traced.csv");
    let said = bench.done(&["device", "trace", "--read", "--json"]);
    bench.mend();
    let first: serde_json::Value =
        serde_json::Deserializer::from_str(&said).into_iter().next().unwrap().unwrap();
    published_schemas::valid(&first.to_string())
}

#[test]
fn every_variable_of_the_loop_is_traced_and_they_fit_together() {
    let bench = Bench::start("trace");
    bench.table("mini.pam", 76.5);
    bench.done(&["flash", "mini.pam"]);
    let own = "pressure,stroke,force,speed,direction,setpoint,force-demand,feed-forward,trim,pressure-demand,command,model-pressure,\
               model-force,state,step-time";
    let trace = traced(&bench, own);
    let columns = trace["columns"].as_object().unwrap();
    let records = trace["records"].as_u64().unwrap() as usize;
    assert!(columns.len() == 16 && records >= 30, "{trace}");
    let column = |name: &str| -> Vec<f64> {
        let list = columns.get(name).unwrap_or_else(|| panic!("no {name} in {trace}"));
        list.as_array().unwrap().iter().map(|cell| cell.as_f64().unwrap_or(f64::NAN)).collect()
    };
    let (time, state) = (column("time_s"), column("state"));
    assert!(
        time.windows(2).all(|pair| (pair[1] - pair[0] - 1e-3).abs() < 1e-6),
        "one record a tick: {time:?}"
    );
    // The tick in which the fault is found is the last.
    assert!(
        state
            .split_last()
            .is_some_and(|(end, before)| *end == 3.0 && before.iter().all(|state| *state == 2.0)),
        "{state:?}"
    );
    // The fault is noticed at the second bad reading of the load cell.
    assert!(!(0.0..1e3).contains(column("force_N").last().unwrap()), "{:?}", column("force_N"));
    let last = records - 4;
    let at = |name: &str| column(name)[last];
    assert_eq!((at("setpoint"), at("force_demand_N")), (40.0, 40.0));
    let near = |a: &str, b: f64, within: f64| assert!((at(a) - b).abs() < within, "{a}: {} and {b}", at(a));
    near("pressure_demand_Pa", at("feed_forward_Pa") + at("trim_Pa"), 5.0);
    near("model_pressure_Pa", at("pressure_Pa"), 20e3);
    near("command_Pa", at("pressure_Pa"), 60e3);
    // The table is an example of this kind of muscle, not a fit of this one.
    near("model_force_N", at("force_N"), 25.0);
    // Moved at 0.5 Hz by 0.2 mm about 0.6 mm: at most 0.63 mm/s.
    near("stroke_m", 0.6e-3, 0.25e-3);
    near("speed_m_per_s", 0.0, 1.5e-3);
    assert!(at("direction").abs() <= 1.0 && at("step_time_us") >= 0.0);
    let second = traced(&bench, "second-pressure,second-stroke,second-force,second-command");
    assert_eq!(second["columns"].as_object().unwrap().len(), 5, "{second}");
}

#[test]
fn settings_are_read_back_and_wrong_ones_refused_by_name() {
    let bench = Bench::start("settings");
    let said = bench.done(&["device", "settings", "--set", "limits.pressure_pa=500e3"]);
    assert!(said.contains("pressure_pa = 500000.0") && said.contains("written and read back"), "{said}");
    let (status, said) = bench.refused(&["device", "settings", "--set", "limits.pressure_pa=-1"]);
    assert!(status == 1 && said.contains("`limits`"), "{said}");
    let (status, said) = bench.refused(&["device", "settings", "--set", "limits.presure_pa=1"]);
    assert!(status == 2 && said.contains("did you mean `pressure_pa`"), "{said}");
    let (status, said) = bench.refused(&["run", "--force", "40", "--seconds", "1"]);
    assert!(status == 1 && said.contains("no table"), "{said}");
    bench.done(&["device", "faults", "--clear"]);
    let said = bench.done(&["vent"]);
    assert!(said.contains("disarmed"), "{said}");
    let said = bench.done(&["device", "info", "--json"]);
    assert!(said.contains("pam-device/1"), "{said}");
    let said = bench.done(&["device", "trace", "--variables", "pressure,command", "-o", "trace.csv"]);
    assert!(said.contains("records of 2 variables"), "{said}");
    let trace = std::fs::read_to_string(bench.folder.join("trace.csv")).unwrap();
    assert!(trace.starts_with("time_s,pressure_Pa,command_Pa\n") && trace.lines().count() > 100);
}

/// A load cell whose zero is 12 N off, in a muscle without pressure: calibrated, it reads what it did before, and the recording says
/// with which scale.
#[test]
fn a_sensor_is_calibrated_with_known_values_and_a_recording_holds_its_scale() {
    let bench = Bench::start("sensors");
    let force = |said: &str| {
        let said = published_schemas::valid(said);
        let row = said["sensors"].as_array().unwrap().iter().find(|row| row["sensor"] == "force").unwrap();
        row["reading"].as_f64().unwrap()
    };
    let json = |arguments: &[&str]| {
        let output = bench.host(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let before = force(&json(&["device", "sensors", "--json"]));
    bench.done(&[
        "device",
        "settings",
        "--set",
        "scales.force.at_zero=12",
        "--set",
        "scales.force.filter_s=0.002",
    ]);
    assert!((force(&json(&["device", "sensors", "--json"])) - before - 12.0).abs() < 0.5);
    let known = format!("{before}");
    let dry = json(&["device", "sensors", "--calibrate", "force", "--known", &known, "--dry-run", "--json"]);
    assert!(dry.contains("\"kept\": false"), "{dry}");
    assert!((force(&json(&["device", "sensors", "--json"])) - before - 12.0).abs() < 0.5, "left as it was");
    bench.done(&["device", "sensors", "--calibrate", "force", "--known", &known]);
    assert!((force(&json(&["device", "sensors", "--json"])) - before).abs() < 0.5);
    bench.done(&["record", "--seconds", "0.5", "-o", "scaled.csv"]);
    let side = std::fs::read(side_file(&bench.folder.join("scaled.csv"))).unwrap();
    let side: serde_json::Value = serde_json::from_slice(&side).unwrap();
    let scale = &side["device"]["settings"]["scales"]["force"];
    assert!(scale["at_zero"].as_f64().unwrap().abs() < 0.5 && scale["per_unit"] == 1.0, "{scale}");
    assert!((scale["filter_s"].as_f64().unwrap() - 0.002).abs() < 1e-9);
    // From a data sheet: the slope changes, and the device takes it.
    let said = bench.done(&[
        "device",
        "sensors",
        "--calibrate",
        "pressure",
        "--point",
        "0=0",
        "--point",
        "1e6=1100",
    ]);
    assert!(said.contains("0.0011 × signal"), "{said}");
    // A sensor that could never read the limit is refused, by its name.
    let (status, said) = bench.refused(&[
        "device",
        "sensors",
        "--calibrate",
        "pressure",
        "--point",
        "0=0",
        "--point",
        "10e6=100",
    ]);
    assert!(status == 1 && (said.contains("limits") || said.contains("scale")), "{said}");
    let (status, said) = bench.refused(&["device", "sensors", "--calibrate", "supply", "--known", "0"]);
    assert!(status == 1 && said.contains("no signal of the supply sensor"), "{said}");
    bench.done(&["device", "settings", "--defaults"]);
    assert!((force(&json(&["device", "sensors", "--json"])) - before).abs() < 0.5);
}

/// `host demo` is the first thing a new user runs: every run of it must be there from its first second to its last.
#[test]
fn the_demo_shows_the_whole_workflow() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(["demo", "--on", "native", "--json", "-o"])
        .arg(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answer = published_schemas::valid(std::str::from_utf8(&output.stdout).unwrap());
    let share = |law: usize| answer["tracking"][law]["sine_rms_pct"].as_f64().unwrap();
    assert_eq!(answer["tracking"][0]["feed_forward"], "table");
    assert!(share(0) < 2.0 && share(1) > 10.0, "{answer}");
    for (name, seconds) in [("sine", 5), ("steps", 4)] {
        let text = std::fs::read_to_string(folder.path().join(format!("run-table-{name}.csv"))).unwrap();
        let rows = text.lines().count() - 1;
        assert!(rows.abs_diff(1000 * seconds) < 50, "{rows} rows of {name}");
    }
    assert!(folder.path().join("demo.html").exists());
}
