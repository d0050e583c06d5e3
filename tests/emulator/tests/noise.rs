//! A line that is bad, and a line that is full: bits that flip, half frames, more than the board can take, and telemetry at
//! the line's limit; on the real image.

use std::io::Write;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use emulator_tests::joint::{self, Joint};
use emulator_tests::line::{self, Line};
use emulator_tests::machine::{Folder, HOPELESS, PATIENCE};
use emulator_tests::{Machine, Options, Watched, image_of, tracking, upload};
use model_core::link::endpoints::{Endpoint, GetStatus, SetTelemetry, SetTo};
use model_core::link::frame::{Header, Kind, MAX_WIRE, encode};
use model_core::link::messages::{Mode, SetPoint, SetPointOrder, Side, State, TelemetryRate};
use model_core::table::{self, MuscleTable};
use model_core::units::Pressure;
use pam_device::{Client, Patience, Port, Topic, tables};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::presets;

fn station() -> Watched<PlantStation> {
    let bench = BenchSpec::laboratory(presets::miniature(), 3);
    Watched::new(PlantStation::new(bench, vec![Motion::Held { stroke_mm: 0.8 }], 1e-3))
}

/// A client that asks again soon, on a line where much is lost.
fn client(line: &Line) -> Client {
    // Where nothing arrives at all the machine is busy, and the board has yet to answer.
    let patience = Patience { answer: Duration::from_millis(150), tries: 20, ..Patience::default() };
    let mut last = None;
    for _ in 0..20 {
        let port = Port::open(&line.address().parse().expect("an address")).expect("the line is open");
        match Client::connect(port, patience) {
            Ok(client) => return client,
            Err(error) => last = Some(error),
        }
    }
    panic!("no hello in twenty tries: {last:?}");
}

#[test]
fn flipped_bits_cost_repeats_and_nothing_else() {
    let folder = Folder::new();
    let station = station();
    let options = Options { first: Some(Box::new(station.clone())), ..Options::default() };
    let Ok(machine) = Machine::start(folder.path(), options) else { return };
    // Without lead a command is the setpoint.
    tracking::set(&mut machine.client(), |settings| {
        settings.regulator.lead = 0.0;
        settings.watch.autonomous = true;
    });
    let mut sent = Vec::new();
    eprintln!("| bit error rate | upload, s | repeats | bad frames at the host | at the device |");
    for (n, rate) in [1e-6, 1e-5, 1e-4, 1e-3].into_iter().enumerate() {
        let seed = 10 * n as u64;
        let line = Line::tcp(&machine, line::noisy(rate, seed), line::noisy(rate, seed + 1));
        let mut client = client(&line);
        let table = MuscleTable { deadband: Pressure::from_kilopascals(50.0 + n as f32), ..table::example() };
        let image = image_of(&table);
        let began = Instant::now();
        let mut kept = tables::write(&mut client, Side::Agonist, &image, |_| ());
        for _ in 0..5 {
            // A user would say it again.
            kept = kept.or_else(|_| tables::write(&mut client, Side::Agonist, &image, |_| ()));
        }
        kept.unwrap_or_else(|error| panic!("at {rate}: {error}"));
        let took = began.elapsed();
        // Setpoints by the hundred: those that get through are those that were sent.
        let patient = |client: &mut Client, act: &dyn Fn(&mut Client) -> bool| {
            assert!((0..50).any(|_| act(client)), "fifty tries at {rate}");
        };
        patient(&mut client, &|client| {
            let _ = client.try_call::<model_core::link::endpoints::Arm>(&client.session());
            let start = model_core::link::messages::Start { mode: Mode::Pressure, session: client.session() };
            let _ = client.try_call::<model_core::link::endpoints::StartMode>(&start);
            client.try_call::<GetStatus>(&()).is_ok_and(|s| s.is_ok_and(|s| s.state == State::Running))
        });
        for step in 0..40 {
            let pascals = 150e3 + 1e3 * n as f32 + 17.0 * step as f32;
            sent.push(pascals);
            let order = SetPointOrder { set_point: SetPoint::Pressure(pascals), session: client.session() };
            let _ = client.try_once::<SetTo>(&order);
        }
        let mut frames_bad = 0;
        let seen = std::cell::Cell::new(0);
        patient(&mut client, &|client| {
            client
                .try_call::<GetStatus>(&())
                .ok()
                .and_then(Result::ok)
                .map(|s| seen.set(s.frames_bad))
                .is_some()
        });
        frames_bad += seen.get();
        let losses = client.losses();
        eprintln!(
            "| {rate:.0e} | {:.2} | {} | {} | {frames_bad} |",
            took.as_secs_f64(),
            losses.repeats,
            losses.bad_frames
        );
        // Some ten thousand bits go each way: below, a run may well meet none that is flipped.
        if rate >= 1e-3 {
            assert!(losses.bad_frames > 0 && frames_bad > 0, "the line was noisy at {rate}");
        }
        patient(&mut client, &|client| {
            pam_device::run::vent(client).is_ok_and(|status| status.state == State::Disarmed)
        });
        drop(client);
        drop(line);
        // On a clean line: the table is the one that was sent, every byte.
        let mut clean = machine.client();
        assert_eq!(tables::read(&mut clean, Side::Agonist).expect("it reads"), Some(image));
    }
    // No command reached the plant that no one sent; a start begins at what is measured, which lies above the setpoint by ripple,
    // drift and noise: 250 Pa, three times 300 Pa and three times 220 Pa at most, of some 150 kPa.
    let commands: Vec<f32> = station.since(0).iter().map(|exchange| exchange.command).collect();
    let highest = commands.iter().copied().fold(0.0, f32::max);
    let most = sent.iter().copied().fold(0.0, f32::max);
    assert!(highest < 1.015 * most, "{highest} Pa commanded for a setpoint of {most} Pa");
}

fn frame<E: Endpoint>(request: &E::Request, sequence: u16) -> Vec<u8> {
    let mut wire = [0; MAX_WIRE];
    let header = Header { kind: Kind::Request, id: E::ID, sequence };
    let length = encode(header, request, &mut wire).expect("it fits");
    wire[..length].to_vec()
}

#[test]
fn half_frames_and_more_than_the_board_can_take_are_got_over() {
    let folder = Folder::new();
    let Ok(machine) = Machine::start(folder.path(), Options::default()) else { return };
    let status = |machine: &Machine| machine.client().call::<GetStatus>(&()).expect("a status");
    let before = status(&machine);
    // Every beginning of a frame, each followed by a whole one; with numbers that no client below has reached.
    let whole = frame::<GetStatus>(&(), 10_007);
    for cut in 1..whole.len() - 1 {
        machine.link().write_all(&whole[..cut]).expect("the line takes it");
        machine.link().write_all(&[0]).expect("the line takes it");
        machine.link().write_all(&whole).expect("the line takes it");
    }
    let after = status(&machine);
    assert!(after.frames_good >= before.frames_good + whole.len() as u32 - 2, "{before:?} {after:?}");
    // Requests in one go, twenty times what the receiver holds, while no one reads an answer.
    let flood: Vec<u8> = (10_000..13_000).flat_map(|n| frame::<GetStatus>(&(), n)).collect();
    machine.link().write_all(&flood).expect("the line takes it");
    std::thread::sleep(Duration::from_millis(300));
    // What a client asks then comes behind all of it.
    let drained = status(&machine);
    assert_eq!(drained.state, State::Disarmed);
    assert!(drained.frames_good >= after.frames_good + 3_000, "{after:?} {drained:?}");
}

/// What a line of 1 Mbaud would still have to send: 100 bytes pass in each tick of a millisecond.
#[derive(Default)]
struct Backlog {
    bytes: u64,
    waiting: f64,
    worst: f64,
    last: usize,
}

/// Bytes of a line of 1 Mbaud in a tick: ten bits each.
const PER_TICK: f64 = 100.0;

#[test]
fn telemetry_of_two_muscles_at_1_khz_and_commands_beside_it_fit_a_line_of_1_mbaud() {
    let bench = BenchSpec::laboratory(presets::miniature(), 5);
    let joint = Arc::new(Mutex::new(Joint::new(&bench, 0.02, 0.002)));
    let [first, second] = joint::Side::both(&joint);
    let clock = Watched::new(first);
    let options = Options {
        first: Some(Box::new(clock.clone())),
        second: Some(Box::new(second)),
        // No faster than a real board, whose line this is.
        speed: Some(1.0),
        ..Options::default()
    };
    let folder = Folder::new();
    let Ok(machine) = Machine::start(folder.path(), options) else { return };
    let mut direct = machine.client();
    for side in Side::ALL {
        upload(&mut direct, side, &table::example());
    }
    drop(direct);
    let backlog = Arc::new(Mutex::new(Backlog::default()));
    let (counted, ticks) = (backlog.clone(), clock.clone());
    let count = Box::new(move |bytes: &mut Vec<u8>| {
        let mut line = counted.lock().unwrap_or_else(PoisonError::into_inner);
        let now = ticks.periods();
        let passed = now.saturating_sub(line.last) as f64;
        line.last = now;
        line.waiting = (line.waiting - PER_TICK * passed).max(0.0) + bytes.len() as f64;
        line.worst = line.worst.max(line.waiting);
        line.bytes += bytes.len() as u64;
    });
    let line = Line::tcp(&machine, line::clean(), count);
    let port = Port::open(&line.address().parse().expect("an address")).expect("the line is open");
    let mut client = Client::connect(port, PATIENCE).expect("it says hello");
    tracking::start(&mut client, Mode::Pair);
    let reset = |line: &mut Backlog| *line = Backlog { last: clock.periods(), ..Backlog::default() };
    reset(&mut backlog.lock().unwrap_or_else(PoisonError::into_inner));
    let (mut samples, mut commands) = (0_u64, 0_u64);
    // Samples taken before the mode began may still be on their way, and carry one muscle.
    let first_tick = loop {
        let sample = tracking::sample(&mut client).expect("no fault");
        if sample.mode == Mode::Pair && sample.state == State::Running {
            break sample.tick;
        }
    };
    let mut last_tick = first_tick;
    while samples < 3_000 {
        match client.topic(HOPELESS).expect("the line is there") {
            Some(Topic::Telemetry(sample)) => {
                assert_eq!(sample.sides.len(), 2);
                samples += 1;
                last_tick = sample.tick;
                // A setpoint fifty times a second, as a program that controls the joint would send.
                if sample.tick % 20 == 0 {
                    let angle_rad = 0.03 * (samples as f32 * 1e-3).sin();
                    client.set_point(SetPoint::Pair { angle_rad, stiffness_nm_per_rad: 4.0 }).expect("set");
                    commands += 1;
                }
            }
            Some(other) => assert!(!format!("{other:?}").contains("Fault"), "{other:?}"),
            None => panic!("no telemetry"),
        }
    }
    let (bytes, worst) = {
        let line = backlog.lock().unwrap_or_else(PoisonError::into_inner);
        (line.bytes, line.worst)
    };
    let ticks = last_tick - first_tick;
    let losses = client.losses();
    let rate = bytes as f64 / ticks as f64 * 1e3;
    eprintln!(
        "{samples} samples in {ticks} ticks with {commands} commands: {rate:.0} of 100,000 bytes/s, at most {worst:.0} bytes waiting, {losses:?}"
    );
    assert_eq!((losses.samples, losses.gaps, losses.bad_frames), (0, 0, 0));
    assert_eq!(ticks, samples, "one sample each tick");
    assert!(rate < 0.95e5, "{rate} bytes/s");
    let status = client.call::<GetStatus>(&()).expect("a status");
    assert_eq!(status.telemetry_dropped, 0);
    client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 0 }).expect("quiet");
    pam_device::run::vent(&mut client).expect("it vents");
}
