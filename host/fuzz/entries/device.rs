//! The device: its server and its control step, fed with bytes from the line and with readings.
//!
//! ```text
//! 00nnnnnn                   n bytes of the line follow
//! 01nnnnnn  id  .....mmm     a whole frame: a request to endpoint `id`, whose body of 8 n + m bytes follows
//! 10nnnnnn  p x f            n + 1 ticks with these readings
//! 11nnnnnn                   16 (n + 1) ticks of a muscle that follows its command within 30 ms
//! ```

use firmware::board::{Command, Hardware, Identity, Inputs, Outputs, Readings};
use firmware::control::Controller;
use firmware::native::MemoryFlash;
use firmware::server::{Line, Server};
use firmware::shared::Shared;
use model_core::link::frame::{Accumulator, Header, Kind, MAX_BODY, MAX_TOPIC, MAX_WIRE, encode_bytes};
use model_core::link::hello::Board;
use model_core::link::messages::{StartedBy, State};
use model_core::link::settings::Settings;

struct Device {
    server: Server<MemoryFlash>,
    shared: Shared,
    accumulator: Accumulator,
    outputs: Outputs,
    pressure_pa: f32,
    tick: u32,
    /// Ticks in a row with a pressure above the limit.
    above: u32,
    states: Vec<State>,
}

impl Device {
    fn start() -> Self {
        let shared = Shared::new(Settings::default());
        let identity = Identity {
            board: Board::Native,
            muscles: 2,
            serial: [0; 12],
            started_by: StartedBy::Power,
            fault: None,
        };
        let flash = MemoryFlash::open(None).unwrap();
        let server = Server::start(identity, flash, &shared).unwrap();
        let accumulator = Accumulator::new();
        Self {
            server,
            shared,
            accumulator,
            outputs: Outputs::VENT,
            pressure_pa: 0.0,
            tick: 0,
            above: 0,
            states: Vec::new(),
        }
    }

    fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.server.note_counts(Line::Serial, self.accumulator.counts());
            let Some(Ok(request)) = self.accumulator.push_to_answer(byte) else { continue };
            let answer = self.server.handle(request, &self.shared);
            assert!(answer.is_empty() || is_frame(answer), "an answer is a frame");
        }
        if self.server.wants_restart() {
            self.shared.with(|controller| *controller = Controller::new(&Settings::default()));
            self.server = restarted(&self.shared);
            self.outputs = Outputs::VENT;
        }
    }

    fn step(&mut self, readings: Readings) {
        self.tick = self.tick.wrapping_add(1);
        let inputs = Inputs { sides: [Some(readings.into()), None], ..Inputs::default() };
        self.outputs = self.shared.step(&inputs);
        let (state, settings) = self.shared.with(|controller| (controller.state(), *controller.settings()));
        if !self.states.contains(&state) {
            self.states.push(state);
        }
        for command in self.outputs.sides {
            let Command { pressure_pa, .. } = command;
            assert!((0.0..=Hardware::SIMULATED.command_ceiling_pa).contains(&pressure_pa), "{command:?}");
            assert!(command.vent || state != State::Armed, "an armed device is vented");
            assert!(command.vent || state != State::Fault || settings.hold_on != 0, "a fault vents");
        }
        let high = settings.pressure.fitted && readings.pressure_pa > settings.limits.pressure_pa;
        self.above = if high { self.above + 1 } else { 0 };
        if self.above > u32::from(settings.watch.debounce_ticks) {
            assert!(state != State::Running && self.outputs.sides[0].vent, "too much pressure vents");
        }
        let mut frame = [0; MAX_TOPIC];
        while self.shared.next_outgoing(&mut frame).is_some() {}
        if self.shared.has_changed() {
            self.server.keep(&self.shared);
        }
    }

    fn follow(&mut self, ticks: u32) {
        for _ in 0..ticks {
            let command = self.outputs.sides[0];
            let target = if command.vent { 0.0 } else { command.pressure_pa };
            self.pressure_pa += (target - self.pressure_pa) / 31.0;
            let wiggle = (self.tick % 7) as f32 - 3.0;
            self.step(Readings {
                pressure_pa: self.pressure_pa + wiggle,
                stroke_m: 1e-3 + 1e-7 * wiggle,
                force_n: 1e-3 * wiggle,
            });
        }
    }
}

fn restarted(shared: &Shared) -> Server<MemoryFlash> {
    let identity = Identity {
        board: Board::Native,
        muscles: 2,
        serial: [0; 12],
        started_by: StartedBy::Request,
        fault: None,
    };
    Server::start(identity, MemoryFlash::open(None).unwrap(), shared).unwrap()
}

fn is_frame(bytes: &[u8]) -> bool {
    let mut accumulator = Accumulator::new();
    bytes.iter().filter(|byte| matches!(accumulator.push(**byte), Some(Ok(_)))).count() == 1
}

/// A reading of one byte: within 0 to 800 kPa, 0 to 20 mm, 0 to 400 N, and values outside every range.
fn reading(byte: u8, full: f32) -> f32 {
    match byte {
        255 => f32::NAN,
        254 => f32::INFINITY,
        253 => -f32::MAX,
        252 => 1e-40,
        _ => f32::from(byte) / 200.0 * full,
    }
}

/// The device with what comes over its line and from its sensors.
pub fn device(bytes: &[u8]) {
    states(bytes);
}

/// The states in which the device was after a tick.
pub fn states(bytes: &[u8]) -> Vec<State> {
    let mut device = Device::start();
    let mut rest = bytes;
    let mut ticks = 0;
    let take = |rest: &mut &[u8], count: usize| {
        let (first, after) = rest.split_at(count.min(rest.len()));
        *rest = after;
        first.to_vec()
    };
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        let n = usize::from(first & 63);
        match first >> 6 {
            0 => device.hear(&take(&mut rest, n)),
            1 => {
                let header = take(&mut rest, 2);
                let &[id, more] = &header[..] else { break };
                let body = take(&mut rest, (8 * n + usize::from(more & 7)).min(MAX_BODY));
                let mut wire = [0; MAX_WIRE];
                let header = Header { kind: Kind::Request, id, sequence: 1 };
                let length = encode_bytes(header, &body, &mut wire).unwrap();
                // What was left on the line before ends here.
                device.hear(&[0]);
                device.hear(&wire[..length]);
            }
            2 => {
                let three = take(&mut rest, 3);
                let &[p, x, f] = &three[..] else { break };
                let readings = Readings {
                    pressure_pa: reading(p, 800e3),
                    stroke_m: reading(x, 0.02),
                    force_n: reading(f, 400.0),
                };
                (0..=n).for_each(|_| device.step(readings));
            }
            _ => {
                device.follow(16 * (n as u32 + 1));
                ticks += n;
            }
        }
        // A long run finds no more than a short one.
        if ticks > 256 {
            break;
        }
    }
    device.states
}

/// A request in the form of the target.
pub fn request(id: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![1 << 6 | (body.len() / 8) as u8, id, (body.len() % 8) as u8];
    bytes.extend_from_slice(body);
    bytes
}

/// 16 n ticks of a sound muscle in the form of the target.
pub fn sound(n: u8) -> Vec<u8> {
    vec![3 << 6 | (n - 1)]
}

/// n ticks with readings in the form of the target.
pub fn readings(n: u8, three: [u8; 3]) -> Vec<u8> {
    [&[2 << 6 | (n - 1)], &three[..]].concat()
}
