//! The controller notices that its table no longer describes the muscle, and `host health` names what has changed: a muscle that is
//! exactly its table, behind sensors that are not.

use std::process::Command;
use std::time::{Duration, Instant};

use emulator_tests::machine::Folder;
use emulator_tests::{program, upload};
use firmware::board::{Inputs, Outputs, Readings};
use firmware::native::{Device, Options};
use model_core::link::endpoints::{GetSettings, GetStatus, ReadHealth, SetSettings, StartMode};
use model_core::link::messages::{HealthRead, Mode, Reference, Side, Start, TableHealth};
use model_core::muscle::Muscle;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};
use pam_device::run::arm;
use pam_device::{Address, Client};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// What the sensors read.
#[derive(Clone, Copy)]
struct Sensors {
    force_gain: f32,
    pressure_offset_pa: f32,
}

const EXACT: Sensors = Sensors { force_gain: 1.0, pressure_offset_pa: 0.0 };

fn device(table: &MuscleTable, sensors: Sensors) -> Device {
    let muscle = Muscle::<f32>::build(table).expect("a table");
    let reach_m = table.tested.contraction_high * table.geometry.rest_length.metres();
    let (mut pressure_pa, mut tick) = (0.0_f32, 0_u32);
    let mut random = StdRng::seed_from_u64(5);
    let plant = move |outputs: &Outputs| {
        let command = outputs.sides[0];
        let target = if command.vent { 0.0 } else { command.pressure_pa };
        pressure_pa += (target - pressure_pa) / 31.0;
        tick = tick.wrapping_add(1);
        // The bench moves the free end, 0.13 times a second over most of the tested range.
        let (sine, cosine) = (std::f64::consts::TAU * 0.13e-3 * f64::from(tick)).sin_cos();
        let stroke_m = reach_m * (0.45 + 0.35 * sine as f32);
        let direction = cosine.signum() as f32;
        let force =
            muscle.force(Pressure::from_pascals(pressure_pa), Length::from_metres(stroke_m), direction);
        let mut noise = |size: f32| size * (2.0 * random.random::<f32>() - 1.0);
        let now = Readings {
            pressure_pa: pressure_pa + sensors.pressure_offset_pa + noise(300.0),
            stroke_m: stroke_m + noise(2e-6),
            force_n: sensors.force_gain * force.newtons() + noise(0.5),
        };
        Inputs { sides: [Some(now.into()), None], ..Inputs::default() }
    };
    Device::start("127.0.0.1:0", Options { speed: f64::INFINITY, ..Options::default() }, plant)
        .expect("a controller")
}

/// Runs the muscle until enough blocks are kept; gives what the device says and what `host health --json` prints.
fn after_a_run(sensors: Sensors) -> (TableHealth, serde_json::Value, String) {
    let table = table::example();
    let device = device(&table, sensors);
    let address = Address::Tcp { host: "127.0.0.1".into(), port: device.address().port() };
    let mut client = Client::open(&address).expect("a controller answers");
    let mut settings = client.call::<GetSettings>(&()).expect("settings");
    // Its time passes as fast as this machine can: no keep-alive request comes in time.
    settings.watch.autonomous = true;
    settings.watch.armed_silence_ticks = 3_600_000;
    client.call_once::<SetSettings>(&settings).expect("settings");
    upload(&mut client, Side::Agonist, &table);
    arm(&mut client).expect("it arms");
    let start = Start { mode: Mode::Pressure, session: client.session() };
    client.call::<StartMode>(&start).expect("it starts");
    let wave = Reference::Sine { mean: 350e3, amplitude: 120e3, frequency_hz: 0.31 };
    client.reference(wave).expect("a wave");
    let deadline = Instant::now() + Duration::from_secs(120);
    loop {
        let sums = client.call::<ReadHealth>(&HealthRead { side: Side::Agonist }).expect("sums");
        if sums.blocks > 2_000 {
            break;
        }
        assert!(Instant::now() < deadline, "{} blocks in two minutes", sums.blocks);
        std::thread::sleep(Duration::from_millis(20));
    }
    let state = client.call::<GetStatus>(&()).expect("a status").tables[0];
    drop(client);
    let folder = Folder::new();
    let asked = |arguments: &[&str]| {
        let port = address.to_string();
        let mut command = Command::new(program::path());
        let output = command.args(arguments).args(["--port", &port]).current_dir(folder.path()).output();
        let output = output.expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let document = published_schemas::valid(&asked(&["health", "--json"]));
    (state, document, asked(&["health"]))
}

#[test]
fn a_table_that_is_right_raises_no_alarm() {
    let (state, document, words) = after_a_run(EXACT);
    assert_eq!(state, TableHealth::Describes, "{document:#}");
    assert_eq!(document["verdict"], "describes", "{document:#}");
    assert!(document["changed"].as_array().is_some_and(Vec::is_empty), "{document:#}");
    assert!(words.contains("the table describes this muscle"), "{words}");
}

#[test]
fn a_load_cell_gain_of_five_percent_is_named_with_its_size() {
    let (state, document, words) = after_a_run(Sensors { force_gain: 1.05, ..EXACT });
    assert_eq!(state, TableHealth::Changed, "{document:#}");
    let first = &document["changed"][0];
    assert_eq!(first["effect"], "force-gain", "{document:#}");
    let value = first["value"].as_f64().expect("a number");
    assert!((value - 0.05).abs() < 0.005, "{document:#}");
    assert!(words.contains("the table no longer describes this muscle"), "{words}");
    assert!(words.contains("check the load cell's calibration"), "{words}");
}

#[test]
fn a_pressure_offset_is_named_with_its_size() {
    let (state, document, _) = after_a_run(Sensors { pressure_offset_pa: 15e3, ..EXACT });
    assert_eq!(state, TableHealth::Changed, "{document:#}");
    let first = &document["changed"][0];
    assert_eq!(first["effect"], "gauge-offset", "{document:#}");
    let value = first["value"].as_f64().expect("a number");
    assert!((value - 15e3).abs() < 2e3, "{document:#}");
}
