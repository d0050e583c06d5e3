//! What a vent, and a live controller, must survive: computations, silent lines, orders that are refused.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::Duration;

use model_core::link::endpoints::{Disarm, Endpoint};
use model_core::link::frame::Accumulator;
use pam_device::emulated::{Emulated, Kind, Stand};
use pam_device::{Address, Client, Patience, Port};
use serde_json::Value;
use tokio::sync::{Semaphore, broadcast, oneshot};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::Motion;

use super::analysis::Analysis;
use super::answers::Answer;
use super::orders::{Compared, Posted};
use super::server::Shared;
use super::session::{self, Connected, Order};
use super::vent::{self, Vent};
use crate::demo::campaign::muscle;

/// A test that waits longer than this waits for something that never happens.
const HOPELESS: Duration = Duration::from_secs(120);

/// A door that is open until it is closed.
#[derive(Default)]
struct Gate(Mutex<bool>, Condvar);

impl Gate {
    fn set(&self, closed: bool) {
        *self.0.lock().unwrap() = closed;
        self.1.notify_all();
    }

    fn pass(&self) {
        let _open = self.1.wait_while(self.0.lock().unwrap(), |closed| *closed).unwrap();
    }
}

/// An emulated controller behind a line that notes the requests which pass, and can hold back the answers.
struct Line {
    address: Address,
    answers: Arc<Gate>,
    requests: Receiver<u8>,
    _device: Emulated,
}

impl Line {
    fn new() -> Self {
        let stand = Stand::swinging(muscle("mini").unwrap());
        let device = Emulated::start(stand, Some(Kind::Native), 1.0).unwrap();
        let Address::Tcp { host, port } = device.address().clone() else { panic!("no TCP") };
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = Address::Tcp { host: "127.0.0.1".into(), port: listener.local_addr().unwrap().port() };
        let answers = Arc::new(Gate::default());
        let (note, requests) = channel();
        let gate = Arc::clone(&answers);
        thread::spawn(move || {
            let (mut host_side, _) = listener.accept().unwrap();
            let mut board_side = TcpStream::connect((host.as_str(), port)).unwrap();
            let (mut from_board, mut to_host) =
                (board_side.try_clone().unwrap(), host_side.try_clone().unwrap());
            thread::spawn(move || {
                let mut bytes = [0; 4096];
                while let Ok(count @ 1..) = from_board.read(&mut bytes) {
                    gate.pass();
                    if to_host.write_all(&bytes[..count]).is_err() {
                        return;
                    }
                }
            });
            let (mut frames, mut bytes) = (Accumulator::new(), [0; 4096]);
            while let Ok(count @ 1..) = host_side.read(&mut bytes) {
                for &byte in &bytes[..count] {
                    if let Some(Ok(frame)) = frames.push(byte) {
                        let _ = note.send(frame.header.id);
                    }
                }
                if board_side.write_all(&bytes[..count]).is_err() {
                    return;
                }
            }
        });
        Self { address, answers, requests, _device: device }
    }

    fn open(&self) -> Connected {
        let patience = Patience { answer: HOPELESS, slow_answer: HOPELESS, ..Patience::default() };
        let client = Client::connect(Port::open(&self.address).unwrap(), patience).unwrap();
        Connected::new(self.address.clone(), client, None).unwrap()
    }

    fn await_request(&self, id: u8) {
        while self.requests.recv_timeout(HOPELESS).expect("the request arrives") != id {}
    }
}

/// The studio without its page; the folder goes with it.
struct Studio {
    shared: Shared,
    says: broadcast::Receiver<String>,
    folder: tempfile::TempDir,
}

impl Studio {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (orders, requests) = channel();
        let (say, says) = broadcast::channel(65_536);
        let vent = Arc::new(Vent::default());
        let vent_path = vent::start(Arc::clone(&vent), ["127.0.0.1:1".to_owned()].into()).unwrap();
        {
            let (say, vent) = (say.clone(), Arc::clone(&vent));
            thread::spawn(move || session::serve(&requests, &say, &vent));
        }
        let shared = Shared {
            token: "0".into(),
            orders,
            say,
            analysis: Arc::new(Analysis::new(folder.path().to_owned()).unwrap()),
            vent,
            vent_path,
            computing: Arc::new(Semaphore::new(1)),
        };
        Self { shared, says, folder }
    }

    /// Sends a vent as the page does, and waits for the answer.
    fn press_vent(&self) -> String {
        let path = &self.shared.vent_path;
        let host = path.origin.strip_prefix("http://").unwrap();
        let mut stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(HOPELESS)).unwrap();
        write!(
            stream,
            "POST /vent HTTP/1.1\r\nHost: {host}\r\nOrigin: http://127.0.0.1:1\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}",
            path.token.len(),
            path.token
        )
        .unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    /// The next report of the state that `wanted` accepts.
    async fn state(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        self.next(|m| m["k"] == "s" && wanted(m)).await
    }

    /// The next message that `wanted` accepts.
    async fn next(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let text = tokio::time::timeout(HOPELESS, self.says.recv()).await.unwrap();
            // A batch that was missed is not a state that is waited for: one comes each 0.4 s.
            let Ok(text) = text else { continue };
            let value: Value = serde_json::from_str(&text).unwrap();
            if wanted(&value) {
                return value;
            }
        }
    }
}

fn run(test: impl Future<Output = ()>) {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(test);
}

#[test]
fn a_vent_passes_a_computation_that_is_under_way() {
    run(async {
        let mut studio = Studio::new();
        let line = Line::new();
        studio.shared.order(Order::Replace(Box::new(line.open()))).await.unwrap();
        let gate = Arc::new(Gate::default());
        gate.set(true);
        let (begun, begins) = oneshot::channel();
        let computation = {
            let (shared, gate) = (studio.shared.clone(), Arc::clone(&gate));
            tokio::spawn(async move {
                let held = move |_: &Analysis| {
                    begun.send(()).unwrap();
                    gate.pass();
                    Ok(Answer::Truth(true))
                };
                shared.compute(held).await
            })
        };
        begins.await.unwrap();
        // A second one waits for its turn, and the page's other requests are answered.
        let second = tokio::spawn({
            let shared = studio.shared.clone();
            async move { shared.post(Posted::Fit { muscle: String::new() }).await }
        });
        studio.shared.post(Posted::Recordings).await.unwrap();
        studio.shared.post(Posted::Arm).await.unwrap();
        studio.state(|s| s["state"] == "armed").await;
        assert!(studio.press_vent().starts_with("HTTP/1.1 204"));
        studio.state(|s| s["state"] == "disarmed").await;
        studio.shared.post(Posted::Arm).await.unwrap();
        studio.state(|s| s["state"] == "armed").await;
        studio.shared.post(Posted::Vent).await.unwrap();
        studio.state(|s| s["state"] == "disarmed").await;
        assert!(!computation.is_finished() && !second.is_finished());
        gate.set(false);
        assert!(matches!(computation.await.unwrap().unwrap(), Answer::Truth(true)));
        assert!(second.await.unwrap().is_err());
    });
}

#[test]
fn a_vent_passes_a_conversation_that_waits_for_an_answer() {
    run(async {
        let mut studio = Studio::new();
        let line = Line::new();
        studio.shared.order(Order::Replace(Box::new(line.open()))).await.unwrap();
        studio.shared.post(Posted::Arm).await.unwrap();
        line.answers.set(true);
        let faults = tokio::spawn({
            let shared = studio.shared.clone();
            async move { shared.post(Posted::Faults).await }
        });
        tokio::task::yield_now().await;
        assert!(studio.press_vent().starts_with("HTTP/1.1 204"));
        // The conversation cannot have sent this: before it disarms it waits for the answer to `stop`.
        line.await_request(Disarm::ID);
        assert!(!faults.is_finished(), "the conversation still waits");
        // What was requested before the vent no longer moves the muscle.
        let late = studio.shared.order_since(Order::Arm, studio.shared.vent.count() - 1);
        line.answers.set(false);
        assert!(late.await.unwrap_err().cause().contains("vented after"), "an order outlives a vent");
        faults.await.unwrap().unwrap();
        studio.state(|s| s["state"] == "disarmed").await;
    });
}

#[test]
fn a_live_controller_stays_until_its_successor_is_there_and_is_then_vented() {
    run(async {
        let mut studio = Studio::new();
        let (line, next) = (Line::new(), Line::new());
        studio.shared.order(Order::Replace(Box::new(line.open()))).await.unwrap();
        studio.shared.post(Posted::Record).await.unwrap();
        studio.shared.post(Posted::Arm).await.unwrap();
        // Nothing listens there, there is no such muscle, no such port, and the last one is the present connection.
        for refused in [
            Posted::Connect { port: "tcp:127.0.0.1:1".into() },
            Posted::Connect { port: "tcp:nonsense".into() },
            Posted::Emulate { muscle: "no such muscle".into() },
        ] {
            assert!(studio.shared.post(refused).await.is_err());
        }
        studio.shared.post(Posted::Connect { port: line.address.to_string() }).await.unwrap();
        let state = studio.state(|s| s["state"] == "armed").await;
        assert_eq!(state["port"], line.address.to_string());
        studio.state(|s| s["recording"].as_u64() > Some(3)).await;
        while line.requests.try_recv().is_ok() {}
        studio.shared.order(Order::Replace(Box::new(next.open()))).await.unwrap();
        line.await_request(Disarm::ID);
        studio.state(|s| s["port"] == next.address.to_string()).await;
        let run = std::fs::read_to_string(studio.folder.path().join("run-1.csv")).unwrap();
        assert!(run.lines().count() > 3, "the recording ended whole");
    });
}

#[test]
fn the_path_of_a_vent_only_vents_and_only_for_the_page() {
    let studio = Studio::new();
    assert!(studio.press_vent().contains("no controller is connected"));
    let host = studio.shared.vent_path.origin.strip_prefix("http://").unwrap();
    let right = &studio.shared.vent_path.token;
    for (header, body, status) in [
        (format!("POST /vent HTTP/1.1\r\nHost: {host}\r\nOrigin: http://evil.example"), &**right, "403"),
        (format!("POST /vent HTTP/1.1\r\nHost: evil.example\r\nX: {host}"), right, "403"),
        (format!("POST /vent HTTP/1.1\r\nHost: {host}"), "0000", "403"),
        (format!("POST /api/order HTTP/1.1\r\nHost: {host}"), right, "404"),
        (format!("POST /vent HTTP/1.1\r\nHost: {host}"), &"x".repeat(300), "413"),
    ] {
        let mut stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(HOPELESS)).unwrap();
        let count = studio.shared.vent.count();
        write!(stream, "{header}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}", body.len())
            .unwrap();
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{header}: {answer}");
        assert_eq!(studio.shared.vent.count(), count);
    }
}

#[test]
fn a_run_is_compared_with_an_earlier_recording_and_can_be_vented_meanwhile() {
    run(async {
        // Three times as fast as the clock, a busy machine would soon be called silent.
        let (mut studio, _device) = with_a_bench(0.4, 3.0).await;
        let watch = |reference| studio.shared.post(Posted::Watch { reference });
        assert!(watch(Compared::Recordings).await.unwrap_err().cause().contains("no recordings"));
        studio.shared.post(Posted::Arm).await.unwrap();
        let profile = "sine mean=300 amplitude=150 frequency=0.11".to_owned();
        studio.shared.post(Posted::Follow { quantity: "pressure".into(), profile }).await.unwrap();
        studio.shared.post(Posted::Record).await.unwrap();
        studio.state(|s| s["recording"].as_u64() > Some(40_000)).await;
        studio.shared.post(Posted::EndRecord).await.unwrap();
        studio.shared.post(Posted::Watch { reference: Compared::Recordings }).await.unwrap();
        let said = studio.next(|m| m["k"] == "c").await;
        assert_eq!(said["changed"], false, "{said}");
        assert!(said["text"].as_str().unwrap().starts_with("No change"), "{said}");
        assert!(studio.press_vent().starts_with("HTTP/1.1 204"));
        studio.state(|s| s["state"] == "disarmed").await;
    });
}

/// A studio with an emulated controller that runs without its host. Its bench moves with this amplitude, in a clock that is faster than the
/// wall clock by `speed`.
async fn with_a_bench(amplitude_mm: f64, speed: f64) -> (Studio, Emulated) {
    let studio = Studio::new();
    let spec = BenchSpec::laboratory(muscle("mini").unwrap(), 2);
    let motion = Motion::Sine { mean_mm: 0.6, amplitude_mm, frequency_hz: 0.5 };
    let device = Emulated::start(Stand::new(spec, motion), Some(Kind::Native), speed).unwrap();
    let patience = Patience { answer: HOPELESS, slow_answer: HOPELESS, ..Patience::default() };
    let client = Client::connect(Port::open(device.address()).unwrap(), patience).unwrap();
    let connected = Connected::new(device.address().clone(), client, None).unwrap();
    studio.shared.order(Order::Replace(Box::new(connected))).await.unwrap();
    let set = vec!["watch.autonomous=true".to_owned()];
    studio.shared.post(Posted::Settings { set }).await.unwrap();
    (studio, device)
}

async fn answer(studio: &Studio, posted: Posted) -> Value {
    serde_json::to_value(studio.shared.post(posted).await.unwrap()).unwrap()
}

async fn stored(studio: &Studio, place: &str) -> f64 {
    answer(studio, Posted::Settings { set: Vec::new() }).await["stored"]
        .pointer(place)
        .unwrap()
        .as_f64()
        .unwrap()
}

#[test]
fn the_guide_calibrates_a_sensor_with_known_values() {
    run(async {
        let (studio, _device) = with_a_bench(0.0, 1.0).await;
        answer(&studio, Posted::Signals).await;
        tokio::time::sleep(Duration::from_millis(300)).await;
        let seen = answer(&studio, Posted::Signals).await;
        let stroke = seen["sensors"].as_array().unwrap().iter().find(|s| s["sensor"] == "stroke").unwrap();
        let signal = stroke["signal"].as_f64().unwrap();
        assert!((stroke["reading"].as_f64().unwrap() - 0.6).abs() < 0.05, "{stroke}");
        let calibrate = |pairs: &[[f64; 2]], keep| Posted::Calibrate {
            sensor: "stroke".into(),
            pairs: pairs.to_vec(),
            keep,
        };
        // One value moves the zero: the sensor reads 2 mm where it read 0.6 mm.
        let found = answer(&studio, calibrate(&[[2.0, signal]], false)).await;
        assert!((found["now"][0].as_f64().unwrap() - 1.4).abs() < 0.05 && found["kept"] == false, "{found}");
        assert_eq!(stored(&studio, "/scales/stroke/at_zero").await, 0.0);
        answer(&studio, calibrate(&[[2.0, signal]], true)).await;
        assert!((stored(&studio, "/scales/stroke/at_zero").await - 1.4e-3).abs() < 5e-5);
        // Two values give the slope: 10 mm for a change of the signal by 5 mm.
        let pairs = [[0.0, signal], [10.0, signal + 5e-3]];
        let found = answer(&studio, calibrate(&pairs, true)).await;
        assert!(
            found["errors"].as_array().unwrap().iter().all(|e| e.as_f64().unwrap().abs() < 1e-9),
            "{found}"
        );
        assert!((stored(&studio, "/scales/stroke/per_unit").await - 2.0).abs() < 1e-5);
        let refused = studio.shared.post(calibrate(&[[0.0, signal], [5.0, signal]], true)).await.unwrap_err();
        assert!(refused.cause().contains("hardly differ"), "{refused}");
        let unknown = Posted::Calibrate { sensor: "nose".into(), pairs: Vec::new(), keep: false };
        assert!(studio.shared.post(unknown).await.is_err());
    });
}

#[test]
fn the_guide_identifies_the_regulator_and_a_vent_ends_it() {
    run(async {
        let (mut studio, _device) = with_a_bench(0.0, 1.0).await;
        assert!(
            studio.shared.post(Posted::KeepRegulator).await.unwrap_err().cause().contains("no regulator")
        );
        let steps = || Posted::Identify { low: 100.0, high: 250.0 };
        assert!(studio.shared.post(Posted::Identify { low: 100.0, high: 110.0 }).await.is_err());
        let before = stored(&studio, "/regulator/lag_s").await;
        let found = answer(&studio, steps()).await;
        assert!(found["text"].as_str().unwrap().contains("gain"), "{found}");
        assert_eq!(stored(&studio, "/regulator/lag_s").await, before);
        assert_eq!(answer(&studio, Posted::KeepRegulator).await["kept"], true);
        assert_ne!(stored(&studio, "/regulator/lag_s").await, before);
        // The curves go on, and the muscle is vented.
        studio.next(|m| m["k"] == "t").await;
        studio.state(|s| s["state"] == "disarmed").await;
        let press = async {
            tokio::time::sleep(Duration::from_millis(1_500)).await;
            studio.press_vent()
        };
        let (ended, pressed) = tokio::join!(studio.shared.post(steps()), press);
        assert!(pressed.starts_with("HTTP/1.1 204"), "{pressed}");
        assert!(ended.is_err(), "the steps continued after the vent");
        studio.state(|s| s["state"] == "disarmed").await;
    });
}
