//! The commands of `host`, as a user types them, on the real image: modes, waves from a file, the trace, the log, the
//! regulator, and what a muscle remembers.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use emulator_tests::joint;
use emulator_tests::line::{self, Line};
use emulator_tests::machine::{self, Folder, PATIENCE};
use emulator_tests::{Machine, Options, Watched, fitting, pair, program, tracking, upload};
use model_core::effects::{EffectName, FittedEffect};
use model_core::link::endpoints::{Disarm, SetTelemetry, Stop};
use model_core::link::messages::{Fault, Mode, SetPoint, Side, TelemetryRate};
use model_core::muscle::Muscle;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};
use pam_device::{Client, Port};
use pam_fit::table_file::{About, TableFile};
use serde_json::Value;
use virtual_bench::bench::BenchSpec;
use virtual_bench::lockstep::{Answer, Station as _};
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::pneumatics::Pneumatics;
use virtual_bench::presets;

fn write(folder: &Folder, name: &str, table: MuscleTable) {
    let about = About { muscle: "mini".into(), ..About::default() };
    TableFile { table, about }.write(folder.path().join(name)).expect("a file");
}

fn json(text: &str) -> Value {
    published_schemas::valid(text)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// A column of a file of comma-separated values.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(path).expect("a file");
    let mut lines = text.lines();
    let at = lines.next().expect("a header").split(',').position(|head| head == name).expect(name);
    lines.map(|line| line.split(',').nth(at).expect("a cell").parse().unwrap_or(f64::NAN)).collect()
}

struct Stand {
    folder: Folder,
    line: Line,
    machine: Machine,
}

impl Stand {
    fn start(
        options: Options,
        image: fn(&Path, Options) -> Result<Machine, emulator_tests::Skipped>,
    ) -> Option<Self> {
        let folder = Folder::new();
        // No faster than a real board: what a program sends at its times comes later by as many ticks as it waits for a busy machine.
        let machine = image(folder.path(), Options { speed: Some(1.0), ..options }).ok()?;
        // A program that has to wait for longer than the watch is not the subject here.
        tracking::set(&mut machine.client(), |settings| settings.watch.autonomous = true);
        let line = Line::tcp(&machine, line::clean(), line::clean());
        Some(Self { folder, line, machine })
    }

    fn with_muscle(motion: Motion) -> Option<Self> {
        let bench = BenchSpec::laboratory(presets::miniature(), 7);
        let station = PlantStation::new(bench, vec![motion], 1e-3);
        Self::start(Options { first: Some(Box::new(station)), ..Options::default() }, Machine::start)
    }

    /// A serial device in place of the port.
    fn over_serial(&mut self) {
        // Two cables in one plug would take each other's bytes.
        self.line.pull();
        self.line = Line::serial(&self.machine, line::clean(), line::clean());
    }

    fn host(&self, arguments: &[&str]) -> String {
        program::done(&self.line, self.folder.path(), arguments)
    }
}

#[test]
fn a_joint_takes_angle_and_stiffness_and_reports_the_available_range() {
    let spec = presets::contractile();
    let joint = Arc::new(Mutex::new(pair::elbow(&spec)));
    let [first, second] = joint::Side::both(&joint);
    let options =
        Options { first: Some(Box::new(first)), second: Some(Box::new(second)), ..Options::default() };
    let Some(stand) = Stand::start(options, Machine::start) else { return };
    write(&stand.folder, "muscle.pam", fitting::fitted(&spec));
    for muscle in ["1", "2"] {
        stand.host(&["flash", "muscle.pam", "--muscle", muscle]);
    }
    // Through the line: a second reader of the board's own link would take bytes from it.
    let port = Port::open(&stand.line.address().parse().expect("an address")).expect("the line is open");
    let mut client = Client::connect(port, PATIENCE).expect("it says hello");
    tracking::set(&mut client, pair::adjust);
    drop(client);
    let ask = |profile: &str, stiffness: &str, seconds: &str| {
        let run =
            ["run", "--angle", profile, "--stiffness", stiffness, "--seconds", seconds, "--rate", "250"];
        program::run(
            &stand.line,
            stand.folder.path(),
            &[&run[..], &["-o", "pair.csv", "--replace", "--json"]].concat(),
        )
    };
    let path = stand.folder.path().join("pair.csv");
    for (angle, wanted, seconds) in [("4", "120", "2"), ("-3", "240", "1.5")] {
        let output = ask(angle, wanted, seconds);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        let settled = |name: &str| {
            let all = column(&path, name);
            let last = &all[all.len() - 75..];
            last.iter().sum::<f64>() / last.len() as f64
        };
        let pressures = [settled("pressure_Pa"), settled("second_pressure_Pa")];
        let turn = (settled("displacement_m") - settled("second_displacement_m")) / (2.0 * pair::RADIUS);
        let now = joint.lock().unwrap_or_else(PoisonError::into_inner);
        let found = now.stiffness_at(pressures, turn);
        let degrees = turn.to_degrees();
        eprintln!("{angle}° at {wanted} N·m/rad: {degrees:.2}°, true stiffness {found:.1} N·m/rad");
        let missed = (degrees - angle.parse::<f64>().expect("a number")).abs();
        // Friction lets the last half degree go in small slips.
        assert!(missed < 0.8, "{missed}° off");
        assert!(
            (found / wanted.parse::<f64>().expect("a number") - 1.0).abs() < 0.05,
            "{found} for {wanted}"
        );
    }
    for (angle, wanted, why) in [
        ("0", "20", "the joint stiffness is "),
        ("sine mean=0 amplitude=4 frequency=1", "60", "N·m/rad at this angle"),
        ("60", "120", "both muscles of the joint are taut from -"),
    ] {
        let output = ask(angle, wanted, "1");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(why), "{said}");
        assert_eq!(json(&stand.host(&["vent", "--json"]))["state"], "disarmed");
    }
}

#[test]
fn a_stroke_against_a_spring_and_a_force_from_a_file_are_followed_and_a_table_rolled_back() {
    let load = Motion::Load { mass: 0.5, spring: 10.0, preload: 5.0, damper: 0.05 };
    let Some(stand) = Stand::with_muscle(load) else { return };
    let fitted = fitting::fitted(&presets::miniature());
    write(&stand.folder, "first.pam", table::example());
    write(&stand.folder, "mini.pam", fitted);
    stand.host(&["flash", "first.pam"]);
    let flashed = json(&stand.host(&["flash", "mini.pam", "--restart", "--json"]));
    assert!(flashed["written"] == true && flashed["confirmed_after_restart"] == true, "{flashed}");
    assert!(flashed["difference"].is_object(), "{flashed}");
    let backup = flashed["backup"].as_str().expect("what was there is kept");
    let kept = TableFile::read(stand.folder.path().join(backup)).expect("a table");
    assert_eq!(kept.table, table::example());
    let steps = ["run", "--stroke", "steps 0.8 1.6 hold=2", "--seconds", "4", "-o", "stroke.csv", "--json"];
    stand.host(&steps);
    let path = stand.folder.path().join("stroke.csv");
    let (asked, stroke) = (column(&path, "setpoint"), column(&path, "displacement_m"));
    for end in [1_950, 3_950] {
        let late = &stroke[end - 300..end];
        let error = late.iter().map(|x| (x - asked[end - 1]).powi(2)).sum::<f64>() / late.len() as f64;
        // 3 % of the free stroke: friction lets the last tenths of a millimetre go in small slips.
        assert!(error.sqrt() < 0.1e-3, "{} mm rms before {end} ms", error.sqrt() * 1e3);
    }
    // A profile of 1,200 points is more than the device holds: the program joins it by fewer.
    let profile: String = (0..1_200)
        .map(|n| format!("{},{}\n", 0.0025 * f64::from(n), 20.0 + 10.0 * (0.01 * f64::from(n)).sin()))
        .collect();
    std::fs::write(stand.folder.path().join("profile.csv"), format!("time_s,force_N\n{profile}"))
        .expect("a file");
    let run = ["run", "--force", "@profile.csv", "--seconds", "3", "-o", "force.csv", "--json"];
    let about = json(&stand.host(&run));
    assert_eq!(about["losses"]["samples"], 0);
    let path = stand.folder.path().join("force.csv");
    let (asked, force) = (column(&path, "setpoint"), column(&path, "force_N"));
    let wanted = |n: usize| 20.0 + 10.0 * (0.01 * (n as f64 / 2.5).floor()).sin();
    // The points of the file come out of the device at their times, joined again within a hundredth of a newton.
    let far = |shift: usize| (0..2_000).map(|n| (asked[shift + n] - wanted(n)).abs()).fold(0.0, f64::max);
    let worst = (0..800.min(asked.len() - 2_000)).map(far).fold(f64::INFINITY, f64::min);
    assert!(worst < 0.15, "{worst} N from the file");
    let late = asked.iter().zip(&force).skip(1_000).map(|(asked, force)| (asked - force).powi(2));
    let rms = (late.sum::<f64>() / (asked.len() - 1_000) as f64).sqrt();
    eprintln!("force from a file against a mass and a spring: {rms:.2} N rms after the first second");
    // 5 % of the blocked force.
    assert!(rms < 6.5, "{rms} N rms");
    let info = || json(&stand.host(&["device", "info", "--json"]))["tables"][0]["generation"].clone();
    let second = info();
    let back = json(&stand.host(&["device", "rollback", "--json"]));
    assert_eq!(back["schema"], "pam-rollback/1");
    assert_ne!(info(), second);
    assert_eq!(info(), back["generation"]);
    stand.host(&["device", "rollback"]);
    assert_eq!(info(), second, "going back again returns");
}

#[test]
fn a_trace_is_armed_filled_inside_the_loop_and_read_out_over_a_serial_device() {
    let Some(mut stand) = Stand::with_muscle(Motion::Held { stroke_mm: 0.5 }) else { return };
    stand.over_serial();
    assert!(stand.line.address().starts_with("/dev/"));
    write(&stand.folder, "mini.pam", table::example());
    stand.host(&["flash", "mini.pam"]);
    stand.host(&[
        "device",
        "trace",
        "--trigger",
        "until-fault",
        "--variables",
        "pressure,command,setpoint,force",
    ]);
    // A limit that the run must cross: the trace shows what led to the fault.
    stand.host(&["device", "settings", "--set", "limits.force_n=20"]);
    let wave = ["run", "--pressure", "sine mean=350 amplitude=60 frequency=1", "--seconds", "3"];
    let output = program::run(&stand.line, stand.folder.path(), &wave);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("the force exceeds its limit"), "{said}");
    let trace = json(&stand.host(&["device", "trace", "--read", "--json"]));
    // 256 records fit; a machine that is busy may have had time for fewer ticks.
    let records = trace["records"].as_u64().unwrap_or(0) as usize;
    assert!(trace["schema"] == "pam-trace/1" && (50..=256).contains(&records), "{records} records");
    let last =
        |name: &str| trace["columns"][name].as_array().and_then(|all| all.last()).map_or(f64::NAN, number);
    assert!(last("force_N") > 20.0, "{}", last("force_N"));
    let csv = stand.host(&["device", "trace", "--read"]);
    assert_eq!(csv.lines().count(), records + 1);
    assert_eq!(csv.lines().next(), Some("time_s,pressure_Pa,command_Pa,setpoint,force_N"));
    let vented = json(&stand.host(&["vent", "--json"]));
    assert_eq!(vented["state"], "fault");
}

#[test]
fn the_regulator_is_identified_kept_and_shown_over_a_serial_device() {
    let mut bench = BenchSpec::laboratory(presets::miniature(), 7);
    let true_to = Pneumatics { lag: 0.045, rate: 1.5e6, deadband: 450.0, line: 0.005, ..bench.pneumatics };
    bench.pneumatics = true_to;
    let station = PlantStation::new(bench, vec![Motion::Held { stroke_mm: 0.3 }], 1e-3);
    let options = Options { first: Some(Box::new(station)), ..Options::default() };
    let Some(mut stand) = Stand::start(options, Machine::start) else { return };
    stand.over_serial();
    // The table says how wide the muscle is at its stroke.
    write(&stand.folder, "mini.pam", fitting::fitted(&presets::miniature()));
    stand.host(&["flash", "mini.pam"]);
    let settings = || json(&stand.host(&["device", "settings", "--json"]))["regulator"].clone();
    let before = settings();
    let identify = ["device", "identify", "--low", "100", "--high", "300", "--json"];
    let shown = json(&stand.host(&[&identify[..], &["--dry-run"]].concat()));
    assert_eq!(shown["kept"], false);
    assert_eq!(settings(), before, "a dry run leaves the settings as they are");
    let found = json(&stand.host(&identify));
    eprintln!("{found}");
    assert_eq!(found["kept"], true);
    let [first, second] = [&shown, &found].map(|one| number(&one["lag_s"]));
    assert!((first / second - 1.0).abs() < 0.05, "{shown} {found}");
    let of = |name: &str| number(&found[name]);
    assert!((of("gain") - 1.0).abs() < 0.01 && of("offset_Pa").abs() < 1.5e3, "{found}");
    assert!((of("lag_s") / true_to.lag - 1.0).abs() < 0.1, "{found}");
    assert!((of("line_s") / true_to.line - 1.0).abs() < 0.5, "{found}");
    assert_eq!(found["rate_limited"], true);
    assert!((of("rate_Pa_per_s") / true_to.rate - 1.0).abs() < 0.1, "{found}");
    assert!((of("deadband_Pa") / true_to.deadband - 1.0).abs() < 0.25, "{found}");
    let now = settings();
    assert_ne!(now, before);
    for (kept, name) in
        [("lag_s", "lag_s"), ("line_s", "line_s"), ("deadband_pa", "deadband_Pa"), ("gain", "gain")]
    {
        assert!((number(&now[kept]) / of(name) - 1.0).abs() < 1e-3, "{kept}: {now}");
    }
    assert_eq!(now["lead"], 1.0);
}

#[test]
fn the_log_of_the_image_is_decoded_beside_events() {
    let bench = BenchSpec::laboratory(presets::miniature(), 7);
    let station = Watched::new(PlantStation::new(bench, vec![Motion::Held { stroke_mm: 0.5 }], 1e-3));
    let options = Options { first: Some(Box::new(station.clone())), ..Options::default() };
    let Some(stand) = Stand::start(options, Machine::start_with_log) else { return };
    let Ok(elf) = machine::log_image() else { return };
    let elf = elf.to_string_lossy().into_owned();
    let mut client =
        pam_device::Client::open(&stand.line.address().parse().expect("an address")).expect("hello");
    tracking::start(&mut client, Mode::Pressure);
    client.call::<Stop>(&()).expect("it stops, and stays armed");
    client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 0 }).expect("quiet");
    drop(client);
    let arguments = ["device", "log", "--seconds", "120", "--json", "--elf", &elf];
    let mut log = program::start_piped(&stand.line, stand.folder.path(), &arguments);
    let mut lines = BufReader::new(log.stdout.take().expect("its output")).lines();
    let mut events = Vec::new();
    // Everything up to a line that is waited for; the program ends after its two minutes where that never comes.
    let mut until = |so: &dyn Fn(&Value) -> bool| {
        while !events.iter().any(so) {
            let line = lines.next().unwrap_or_else(|| panic!("it ends before that, after {events:?}"));
            events.push(json(&line.expect("a line")));
        }
    };
    until(&|line| line["event"] == "state" && line["state"] == "armed");
    station.disturb(|_, answer| answer.status |= Answer::SUPPLY_LOW);
    until(&|line| line["event"] == "fault" && line["fault"] == "brown-out");
    let fault = format!("fault {}", Fault::BrownOut.code());
    until(&|line| {
        line["event"] == "log"
            && line["level"] == "warn"
            && line["text"].as_str().is_some_and(|words| words.contains(&fault))
    });
    // Events and log lines are of one clock.
    let time =
        |kind: &str| events.iter().find(|line| line["event"] == kind).map(|line| number(&line["time_s"]));
    let apart = time("log").zip(time("fault")).map(|(log, fault)| (log - fault).abs());
    assert!(time("fault").is_some_and(|at| at > 0.0) && apart.is_some_and(|s| s < 1e-6), "{events:?}");
    program::interrupt(&log);
    let status = log.wait().expect("it ends");
    assert!(status.success(), "ended by the key for it: {status:?}");
    // An image without log lines is refused as text.
    let Ok(silent) = machine::image() else { return };
    let silent = silent.to_string_lossy().into_owned();
    let refused = program::run(&stand.line, stand.folder.path(), &["device", "log", "--elf", &silent]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(1) && said.contains("built without logs"), "{said}");
}

/// What the bench does with the muscle: it holds it, and, when requested the second, stretches it, which its bladder remembers.
fn held_and_stretched() -> Vec<Motion> {
    let stretched = Motion::Path { points: vec![(0.0, 0.4), (2.0, 0.4), (2.5, 3.0), (3.0, 0.4)] };
    vec![Motion::Held { stroke_mm: 0.4 }, stretched]
}

/// How much stronger the device thinks the muscle than its table without memory, N, in the last of n samples.
fn softening(client: &mut pam_device::Client, muscle: &Muscle<f32>, samples: usize) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for n in 0..samples {
        let sample = tracking::sample(client).expect("no fault");
        if n + 200 < samples {
            continue;
        }
        let side = sample.sides[0];
        let force =
            muscle.force(Pressure::from_pascals(side.pressure_pa), Length::from_metres(side.stroke_m), 0.0);
        sum += side.model_n - force.newtons();
        count += 1;
    }
    sum / count.max(1) as f32
}

#[test]
fn the_memory_of_a_muscle_survives_a_power_cut_and_can_be_cleared() {
    let station = || {
        let bench = BenchSpec::laboratory(presets::miniature(), 7);
        Watched::new(PlantStation::new(bench, held_and_stretched(), 1e-3))
    };
    let options = |station: &Watched<PlantStation>| Options {
        first: Some(Box::new(station.clone())),
        ..Options::default()
    };
    let folder = Folder::new();
    let bench = station();
    let Ok(machine) = Machine::start(folder.path(), options(&bench)) else { return };
    let mut table = table::example();
    table.effects.clear();
    table.friction.iter_mut().for_each(|share| *share = 0.0);
    let plain = table.clone();
    let mullins = FittedEffect::new(EffectName::MullinsSoftening, &[0.4, 0.02, 0.1]);
    table.effects.push(mullins).expect("room for one");
    let muscle = Muscle::<f32>::build(&plain).expect("a valid table");
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &table);
    let run = |client: &mut Client, samples: usize, meanwhile: &dyn Fn()| {
        tracking::start(client, Mode::Pressure);
        client.set_point(SetPoint::Pressure(300e3)).expect("a set-point");
        meanwhile();
        let soft = softening(client, &muscle, samples);
        client.call::<Stop>(&()).expect("it stops");
        client.call::<Disarm>(&()).expect("it disarms");
        // What is to be kept is written some ticks after the run ended.
        for _ in 0..100 {
            tracking::sample(client).expect("no fault");
        }
        soft
    };
    let nothing = || ();
    let stretch = || {
        bench.with(|station| station.reset(1));
    };
    let new = run(&mut client, 1_000, &nothing);
    let worked = run(&mut client, 5_000, &stretch);
    eprintln!("stronger than without memory by {new:.3} N as new, by {worked:.3} N after the stretch");
    // A softer bladder resists the braid less, so the muscle pulls harder.
    assert!(worked > 1.0 && new.abs() < 0.05 * worked, "{new} N, {worked} N");
    drop(client);
    machine.kill();
    let Ok(machine) = Machine::start(folder.path(), options(&station())) else { return };
    let mut client = machine.client();
    let again = run(&mut client, 1_000, &nothing);
    eprintln!("by {again:.3} N after the power cut");
    assert!((again - worked).abs() < 0.1 * worked.abs(), "{worked} N, after the power cut {again} N");
    drop(client);
    let line = Line::tcp(&machine, line::clean(), line::clean());
    program::done(&line, folder.path(), &["device", "forget", "--json"]);
    drop(line);
    let mut client = machine.client();
    let forgotten = run(&mut client, 400, &nothing);
    assert!(forgotten.abs() < 0.05 * worked, "{forgotten} N after it was forgotten");
}
