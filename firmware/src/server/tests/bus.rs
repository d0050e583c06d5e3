//! Eight devices on one CAN bus of either format: each answers for itself, and one message vents all.

use std::vec::Vec;

use model_core::link::Endpoint;
use model_core::link::can::{Address, Format, Receiver, Route, Sender, VENT};
use model_core::link::endpoints::{Arm, Disarm, GetSettings, GetStatus, SetTo, StartMode, Stop};
use model_core::link::frame::{Accumulator, MAX_WIRE, encode};
use model_core::link::messages::Start;

use super::*;

/// An identifier and a payload.
type Message = (u16, Vec<u8>);

struct Device {
    address: Address,
    shared: Shared,
    server: Server<MockFlash>,
    own: (Receiver, Accumulator),
    all: (Receiver, Accumulator),
    sender: Sender,
    format: Format,
    pressure_pa: f32,
}

impl Device {
    fn new(address: Address, format: Format) -> Self {
        let shared = Shared::new(Settings::default());
        let server = started(MockFlash::erased(), &shared);
        let [own, all] = [(); 2].map(|()| (Receiver::new(format), Accumulator::new()));
        Self { address, shared, server, own, all, sender: Sender::new(format), format, pressure_pa: 0.0 }
    }

    fn take(&mut self, (identifier, payload): &Message, bus: &mut Vec<Message>) {
        let Self { address, shared, server, own, all, sender, format, .. } = self;
        let (receiver, accumulator) = match Route::of(*identifier) {
            Some(Route::ToAll) if *format == Format::Classic => {
                if payload[..] == VENT {
                    shared.vent();
                }
                return;
            }
            Some(Route::ToAll) => all,
            Some(Route::To(to)) if to == *address => own,
            _ => return,
        };
        let back = Route::From(*address).identifier();
        for byte in receiver.take(payload) {
            if let Some(Ok(exchange)) = accumulator.push_to_answer(byte) {
                let answer = server.handle(exchange, shared);
                sender.send(answer, |message| bus.push((back, message.to_vec())));
            }
        }
    }

    fn state(&self) -> State {
        self.shared.with(|controller| controller.state())
    }
}

/// The host, and what is on the bus.
struct Bus {
    devices: Vec<Device>,
    to: Vec<Sender>,
    to_all: Sender,
    from: Vec<(Receiver, Accumulator)>,
    sequence: u16,
}

impl Bus {
    fn new(format: Format) -> Self {
        let devices: Vec<Device> = Address::all().map(|address| Device::new(address, format)).collect();
        let line = || (Receiver::new(format), Accumulator::new());
        Self {
            to: devices.iter().map(|_| Sender::new(format)).collect(),
            from: devices.iter().map(|_| line()).collect(),
            devices,
            to_all: Sender::new(format),
            sequence: 0,
        }
    }

    /// Every device sees every message; gives what they send, except the message of this number.
    fn carry(&mut self, sent: &[Message], lost: Option<usize>) -> Vec<Message> {
        let mut answers = Vec::new();
        for message in sent {
            self.devices.iter_mut().for_each(|device| device.take(message, &mut answers));
        }
        let kept = answers.into_iter().enumerate().filter(|(at, _)| Some(*at) != lost);
        kept.map(|(_, message)| message).collect()
    }

    /// The answer of one device; none if a message of it is lost.
    fn ask<E: Endpoint>(
        &mut self,
        at: usize,
        request: &E::Request,
        lost: Option<usize>,
    ) -> Option<E::Response> {
        self.sequence += 1;
        let header = Header { kind: Kind::Request, id: E::ID, sequence: self.sequence };
        let mut wire = [0; MAX_WIRE];
        let length = encode(header, request, &mut wire).expect("a frame");
        let address = self.devices[at].address;
        let mut sent = Vec::new();
        self.to[at].send(&wire[..length], |message| {
            sent.push((Route::To(address).identifier(), message.to_vec()));
        });
        let mut found = None;
        for (identifier, payload) in self.carry(&sent, lost) {
            assert_eq!(
                Route::of(identifier),
                Some(Route::From(address)),
                "only the one with the address answers"
            );
            let (receiver, accumulator) = &mut self.from[at];
            for byte in receiver.take(&payload) {
                if let Some(Ok(frame)) = accumulator.push(byte) {
                    assert_eq!((frame.header.kind, frame.header.sequence), (Kind::Response, self.sequence));
                    found = postcard::from_bytes(frame.body).ok();
                }
            }
        }
        found
    }

    fn pass(&mut self, ticks: u32) {
        for device in &mut self.devices {
            pass(&device.shared, ticks, &mut device.pressure_pa);
        }
    }
}

/// Both requests in one message, which nothing can interrupt; on classic CAN the one in their place.
fn vent_message(bus: &mut Bus, format: Format) -> Message {
    let mut wire = [0; MAX_WIRE];
    let mut length = 0;
    for id in [Stop::ID, Disarm::ID] {
        let header = Header { kind: Kind::Request, id, sequence: 1 };
        length += encode(header, &(), &mut wire[length..]).expect("a frame");
    }
    let identifier = Route::ToAll.identifier();
    if format == Format::Classic {
        return (identifier, VENT.to_vec());
    }
    assert!(length <= Format::Fd.data(), "{length} bytes");
    let mut sent = Vec::new();
    bus.to_all.send(&wire[..length], |message| sent.push((identifier, message.to_vec())));
    assert_eq!(sent.len(), 1);
    sent.remove(0)
}

#[test]
fn each_device_answers_for_itself_and_one_message_vents_all() {
    [Format::Fd, Format::Classic].into_iter().for_each(one_message_vents_all);
}

fn one_message_vents_all(format: Format) {
    let mut bus = Bus::new(format);
    bus.pass(5);
    for at in 0..bus.devices.len() {
        bus.ask::<Arm>(at, &OWNER, None).expect("an answer");
        let armed = bus.devices.iter().filter(|device| device.state() == State::Armed).count();
        assert_eq!(armed, 1, "device {at} alone");
        bus.ask::<StartMode>(at, &Start { mode: Mode::Pressure, session: OWNER }, None).expect("an answer");
        bus.ask::<SetTo>(at, &to_pressure(100e3 + 10e3 * at as f32), None).expect("an answer");
    }
    bus.pass(500);
    for (at, device) in bus.devices.iter().enumerate() {
        let wanted = 100e3 + 10e3 * at as f32;
        assert!((device.pressure_pa - wanted).abs() < 2e3, "{at}: {}", device.pressure_pa);
    }
    let vent = vent_message(&mut bus, format);
    let answers = bus.carry(&[vent], None);
    for device in &bus.devices {
        assert!(device.state() == State::Disarmed && device.shared.with(|controller| controller.is_vented()));
        let back = Route::From(device.address).identifier();
        let answered = answers.iter().any(|(identifier, _)| *identifier == back);
        assert_eq!(answered, format == Format::Fd);
    }
}

#[test]
fn an_answer_that_lost_a_message_is_requested_again() {
    [Format::Fd, Format::Classic].into_iter().for_each(each_is_asked_for_again);
}

fn each_is_asked_for_again(format: Format) {
    let mut bus = Bus::new(format);
    for lost in 0..3 {
        assert!(bus.ask::<GetSettings>(4, &(), Some(lost)).is_none(), "message {lost}");
        assert_eq!(bus.ask::<GetSettings>(4, &(), None), Some(Settings::default()));
    }
    assert!(bus.ask::<GetStatus>(5, &(), None).is_some());
    let (receiver, _) = &bus.from[4];
    assert_eq!((receiver.counts().lost, receiver.counts().repeated), (2, 0));
}
