//! The control step interrupts the making of an answer, as it does on a real board: what both touch stays whole.

use std::time::{Duration, Instant};

use emulator_tests::machine::{self, Folder};
use emulator_tests::{Machine, Options, image_of, tracking, upload};
use model_core::link::endpoints::{EvaluateTable, GetInfo, GetSettings, GetStatus};
use model_core::link::messages::{Evaluate, Event, Mode, Point, Reference, Side, State};
use model_core::muscle::{AtStroke, Muscle};
use model_core::single_precision;
use model_core::table;
use model_core::units::{Length, Pressure};
use pam_device::{Topic, tables};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::presets;

/// Control steps that are to begin while the link or the telemetry is at work.
const PREEMPTED: u32 = 500;
/// Answers of a few words that must belong together, in each round.
const STATUSES: u32 = 50;
/// The least number of rounds.
const ROUNDS: u32 = 10;

#[test]
fn answers_are_whole_while_control_steps_interrupt_their_making() {
    let folder = Folder::new();
    let bench = BenchSpec::laboratory(presets::miniature(), 3);
    let station = PlantStation::new(bench, vec![Motion::Held { stroke_mm: 0.8 }], 1e-3);
    // A bench that answers immediately would leave the tasks below the loop no time at all.
    let options =
        Options { first: Some(Box::new(station)), debugged: true, speed: Some(1.0), ..Options::default() };
    let Ok(mut machine) = Machine::start_preempting(folder.path(), options) else { return };
    let image = machine::preempting_image().expect("it has just been started");
    let counter = machine::address_of(&image, "PREEMPTED");
    let preempted = |machine: &Machine| {
        let mut debugger = machine.debugger();
        let count = debugger.word(counter);
        debugger.detach();
        count
    };

    let mut client = machine.client();
    let table = table::example();
    let muscle = Muscle::<f32>::build(&table).expect("a valid table");
    upload(&mut client, Side::Agonist, &table);
    tracking::start(&mut client, Mode::Force);
    let info = client.call::<GetInfo>(&()).expect("its limits");
    let settings = client.call::<GetSettings>(&()).expect("its settings");
    let wave = Reference::Sine { mean: 45.0, amplitude: 20.0, frequency_hz: 2.0 };
    let began = client.reference(wave).expect("a wave");
    let points = (0..16).map(|n| Point { pressure_pa: 30e3 + 35e3 * n as f32, stroke_m: 1e-3 }).collect();
    let request = Evaluate { side: Side::Agonist, direction: 1, points };
    let expected: Vec<[u32; 2]> = request
        .points
        .iter()
        .map(|point| {
            let (pressure, stroke) =
                (Pressure::from_pascals(point.pressure_pa), Length::from_metres(point.stroke_m));
            let mut held = AtStroke::NONE;
            let force = single_precision::pose(&muscle, &mut held, stroke, pressure, 1.0);
            let search = muscle.search();
            let found = single_precision::pressure_for(&muscle, &held, 1.0, force, pressure, &search);
            [force.newtons().to_bits(), found.pressure.pascals().to_bits()]
        })
        .collect();

    let before = preempted(&machine);
    let deadline = Instant::now() + Duration::from_secs(300);
    let (mut last, mut round) = (began.ticks, 0);
    while round < ROUNDS || preempted(&machine).wrapping_sub(before) < PREEMPTED {
        assert!(Instant::now() < deadline, "the control step interrupts next to nothing in {round} rounds");
        assert!(machine.is_running(), "the firmware has ended");
        round += 1;
        for _ in 0..STATUSES {
            let status = client.call::<GetStatus>(&()).expect("a status");
            assert_eq!((status.state, status.mode, status.fault), (State::Running, Mode::Force, None));
            // Two counts of the same loop, each of two words.
            assert_eq!(status.time_us, 1000 * status.ticks, "round {round}");
            assert!(status.ticks >= last, "round {round}: {} after {last}", status.ticks);
            last = status.ticks;
        }
        assert_eq!(client.call::<GetSettings>(&()).expect("its settings"), settings, "round {round}");
        assert_eq!(client.call::<GetInfo>(&()).expect("its limits"), info, "round {round}");
        let answer = client.call::<EvaluateTable>(&request).expect("an evaluation");
        let got = answer.values.iter().map(|value| [value.force_n.to_bits(), value.pressure_pa.to_bits()]);
        assert!(got.eq(expected.iter().copied()), "round {round}: {answer:?}");
        let kept = tables::read(&mut client, Side::Agonist).expect("it reads");
        assert!(kept == Some(image_of(&table)), "round {round}: another table");
        while let Some(topic) = client.topic(Duration::ZERO).expect("the line is there") {
            match topic {
                Topic::Telemetry(sample) => {
                    assert_eq!(sample.time_us, 1000 * sample.tick, "round {round}: {sample:?}");
                    let asked = sample.setpoint;
                    assert!((24.9..65.1).contains(&asked) || sample.tick <= began.ticks + 1, "{sample:?}");
                }
                // That it was armed and started.
                Topic::Event(Event::State(State::Armed | State::Running)) => {}
                other => panic!("round {round}: {other:?}"),
            }
        }
    }
    let status = client.call::<GetStatus>(&()).expect("a status");
    let losses = client.losses();
    // What the loop found no room for was counted by both; nothing else is missing, and no frame was spoilt.
    assert!(losses.samples <= u64::from(status.telemetry_dropped), "{losses:?}, {status:?}");
    assert_eq!((losses.bad_frames, losses.repeats, status.frames_bad), (0, 0, 0), "{losses:?}");
    eprintln!("{round} rounds of answers, {} ticks, {losses:?}", status.ticks - began.ticks);
}
