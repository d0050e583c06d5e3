//! The host's end of the link against peers that keep to it and peers that do not, over TCP and a pseudo-terminal.

mod common;

use std::net::TcpListener;
use std::time::{Duration, Instant};

use common::{SIDE, Vice};
use model_core::link::endpoints::{GetStatus, Restart};
use pam_data::error::Error;
use pam_device::error::DeviceCode;
use pam_device::run::{Plan, run};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use pam_device::{Address, Client, Patience, Port, Topic, tables};

fn connect(address: &Address) -> Result<Client, Error> {
    let patience = Patience {
        // A peer that answers does so within a second of a busy machine, too: repeats are counted below.
        answer: Duration::from_secs(1),
        slow_answer: Duration::from_secs(10),
        tries: 3,
        noisy_tries: 6,
    };
    Client::connect(Port::open(address)?, patience)
}

fn image() -> Vec<u8> {
    (0..900u32).map(|i| ((i * i) >> 3) as u8).collect()
}

#[test]
fn a_port_without_a_server_is_distinguished_from_a_silent_one() {
    // The port multiplexer's, which no one has served for decades and no test can be given.
    let error = connect(&Address::Tcp { host: "127.0.0.1".into(), port: 1 }).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DevicePort);
    let error = connect(&Address::Serial("/dev/no-such-device".into())).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DevicePort);
    assert!(error.to_string().contains("/dev/no-such-device"), "{error}");
    let error = connect(&common::tcp(Vice::Silent)).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DeviceSilent);
    assert!(error.advice().is_some_and(|h| h.contains("powered")));
}

#[test]
fn a_peer_that_is_not_our_firmware_is_named() {
    let error = connect(&common::tcp(Vice::Chatter)).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DeviceForeign);
    assert!(error.cause().contains("not a controller of this project"), "{error}");
    assert!(error.cause().contains("`login:"), "{error}");
    let error = connect(&common::tcp(Vice::Echo)).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DeviceForeign);
    assert!(error.cause().contains("echoes"), "{error}");
}

#[test]
fn another_schema_is_refused_with_both_versions_but_the_device_can_be_identified() {
    let address = common::tcp(Vice::OtherSchema);
    let error = connect(&address).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DeviceVersion);
    let ours = format!("{:016x}", model_core::link::SCHEMA_HASH);
    assert!(error.cause().contains("0000000000001234") && error.cause().contains(&ours), "{error}");
    assert!(error.advice().is_some_and(|h| h.contains("update this program")));
    let met = Client::greet(Port::open(&address).unwrap(), Patience::default()).unwrap();
    assert_eq!(met.hello().schema_hash, 0x1234);
}

fn upload(address: &Address) -> Result<Client, Error> {
    let mut client = connect(address)?;
    assert_eq!(tables::read(&mut client, SIDE)?, None);
    let mut steps = Vec::new();
    let kept = tables::write(&mut client, SIDE, &image(), |sent| steps.push(sent))?;
    assert_eq!(kept.length as usize, image().len());
    assert_eq!(steps, [256, 512, 768, 900]);
    assert_eq!(tables::read(&mut client, SIDE)?, Some(image()));
    Ok(client)
}

#[test]
fn a_table_is_sent_in_pieces_and_read_back() {
    let client = upload(&common::tcp(Vice::None)).unwrap();
    assert_eq!(client.losses().repeats, 0);
    assert_eq!(client.hello().serial, *b"test peer 01");
}

#[cfg(unix)]
#[test]
fn a_table_is_sent_over_a_serial_device() {
    let (address, _far_end) = common::pty(Vice::None);
    let client = upload(&address).unwrap();
    assert_eq!(client.losses().bad_frames, 0);
}

#[test]
fn lost_answers_cost_repeats_and_nothing_else() {
    let client = upload(&common::tcp(Vice::LosesAnswers)).unwrap();
    assert_eq!(client.losses().repeats, 4);
}

#[test]
fn a_bit_that_flips_on_the_device_is_found_by_reading_back() {
    let error = upload(&common::tcp(Vice::ForgetsABit)).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DeviceVerify);
}

#[test]
fn refusals_have_messages_and_too_long_a_table_is_not_sent() {
    let error = upload(&common::tcp(Vice::RefusesTables)).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DeviceRefused);
    assert!(error.cause().contains("not in rising order"), "{error}");
    let mut client = connect(&common::tcp(Vice::None)).unwrap();
    let error = tables::write(&mut client, SIDE, &[0; 2000], |_| ()).unwrap_err();
    assert!(error.cause().contains("longer than the 1024 bytes"), "{error}");
    let error = client.call_once::<Restart>(&()).unwrap_err();
    assert!(error.cause().contains("`restart`: this board cannot do that"), "{error}");
}

#[test]
fn missing_samples_are_counted_across_the_wrap_and_commands_go_between() {
    let mut client = connect(&common::tcp(Vice::SkipsSamples)).unwrap();
    let status = client.call::<GetStatus>(&()).unwrap();
    assert_eq!(status.ticks, 1);
    let mut ticks = Vec::new();
    while let Some(topic) = client.topic(Duration::from_millis(20)).unwrap() {
        if let Topic::Telemetry(sample) = topic {
            ticks.push(sample.tick);
        }
    }
    assert_eq!(ticks, [65_534, 65_535, 0, 1, 2, 4, 5]);
    let losses = client.losses();
    assert_eq!((losses.samples, losses.gaps, losses.bad_frames), (1, 1, 1));
}

#[test]
fn a_run_that_another_program_ends_before_its_first_sample_does_not_wait() {
    for restarts in [false, true] {
        let mut client = connect(&common::tcp(Vice::Vented { restarts })).unwrap();
        let plan = Plan {
            quantity: Quantity::Pressure,
            profile: SetpointProfile::Constant(100e3),
            seconds: Some(1.0),
            every_ticks: 1,
        };
        let begun = Instant::now();
        let stop = || begun.elapsed() > Duration::from_secs(20);
        let error = run(&mut client, &plan, |_| Ok(()), stop).unwrap_err();
        assert_eq!(error.code(), DeviceCode::DeviceRefused, "{error}");
        assert!(error.to_string().contains("another program has vented"), "{error}");
    }
}

#[test]
fn a_device_that_disconnects_is_reported() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let (give, take) = std::sync::mpsc::channel();
    let server = std::thread::spawn(move || {
        let (stream, _) = listener.accept().unwrap();
        give.send(stream.try_clone().unwrap()).unwrap();
        common::Peer::new(Vice::None).serve(stream);
    });
    let mut client = connect(&Address::Tcp { host: "127.0.0.1".into(), port }).unwrap();
    take.recv().unwrap().shutdown(std::net::Shutdown::Both).unwrap();
    server.join().unwrap();
    let error = client.call::<GetStatus>(&()).unwrap_err();
    assert_eq!(error.code(), DeviceCode::DeviceSilent);
    assert!(error.cause().contains("lost"), "{error}");
}
