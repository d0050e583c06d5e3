//! How soon a vent from the page reaches the muscle while all else is busy: a fit and a diagnosis run, idle connections fill both ports,
//! and a page does not read.
//!
//! ```text
//! cargo test -p emulator-tests --test vent                                      some vents, in the ordinary tests
//! PAM_VENT_PAGE=write cargo test -p emulator-tests --test vent              more; writes docs/figures/vent.md
//! ```
#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use emulator_tests::follower::Follower;
use emulator_tests::machine::Folder;
use emulator_tests::program;
use firmware::board::Outputs;
use firmware::native::{Device, Options};
use serde_json::{Value, json};

/// What has not happened by then never will.
const HOPELESS: Duration = Duration::from_secs(300);
/// Target of a vent, from the request until the command of the valve.
const TARGET: Duration = Duration::from_millis(50);
/// Connections that do nothing, at each of the two ports. The page's port takes as many, so that one more finds no place.
const IDLE: usize = 64;

/// When the valve's command was last changed to vent, and whether it is.
#[derive(Default)]
struct Valve {
    open: AtomicBool,
    vented: Mutex<Option<Instant>>,
}

/// A controller in real time whose muscle follows its command within 30 ms.
fn controller(valve: &Arc<Valve>) -> Device {
    let valve = Arc::clone(valve);
    let mut muscle = Follower::default();
    let exchange = move |outputs: &Outputs| {
        let command = outputs.sides[0];
        if command.vent && valve.open.swap(false, Ordering::SeqCst) {
            *valve.vented.lock().expect("a time") = Some(Instant::now());
        } else if !command.vent {
            valve.open.store(true, Ordering::SeqCst);
        }
        muscle.exchange(outputs)
    };
    Device::start("127.0.0.1:0", Options::default(), exchange).expect("a controller")
}

/// A request and its answer: status and body.
fn request(address: &str, path: &str, heads: &str, body: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).expect("the port");
    stream.set_nodelay(true).expect("a line");
    stream.set_read_timeout(Some(HOPELESS)).expect("a time");
    let text = format!(
        "POST {path} HTTP/1.1\r\nHost: {address}\r\n{heads}Content-Type: application/json\r\nContent-Length: {}\r\n\
         Connection: close\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(text.as_bytes()).expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    let status = answer.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0);
    (status, answer.split_once("\r\n\r\n").map_or(String::new(), |(_, body)| body.to_owned()))
}

/// The program, with what its page knows.
struct Studio {
    program: Child,
    address: String,
    token: String,
    /// Port and token of the path that only vents.
    vent: (String, String),
}

impl Studio {
    fn start(port: &str, folder: &Path) -> Self {
        let mut program = Command::new(program::path())
            .args(["studio", "-o", "page", "--port", port])
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let mut ready = String::new();
        let answers = program.stdout.take().expect("its answers");
        BufReader::new(answers).read_line(&mut ready).expect("its address");
        let (_, rest) = ready.trim().split_once("http://").expect("an address");
        let (address, token) = rest.split_once("/?token=").expect("a token");
        let (address, token) = (address.to_owned(), token.to_owned());
        let mut studio = Self { program, address, token, vent: Default::default() };
        let path = studio.order(&json!({ "do": "vent-path" }));
        let text = |key: &str| path[key].as_str().expect("a path").to_owned();
        let origin = text("address");
        let host = origin.trim_start_matches("http://").trim_end_matches("/vent").to_owned();
        studio.vent = (host, text("token"));
        studio
    }

    fn order(&self, order: &Value) -> Value {
        let heads = format!("X-Studio-Token: {}\r\n", self.token);
        let (status, body) = request(&self.address, "/api/order", &heads, &order.to_string());
        assert_eq!(status, 200, "{order}: {body}");
        serde_json::from_str(&body).expect("JSON")
    }

    /// An order whose answer is not waited for.
    fn begin(&self, order: Value) -> JoinHandle<(u16, String)> {
        let (address, token) = (self.address.clone(), self.token.clone());
        thread::spawn(move || {
            let heads = format!("X-Studio-Token: {token}\r\n");
            request(&address, "/api/order", &heads, &order.to_string())
        })
    }

    /// A page that takes nothing of what it is sent.
    fn deaf_page(&self) -> TcpStream {
        let mut stream = TcpStream::connect(&self.address).expect("the page's port");
        let (host, token) = (&self.address, &self.token);
        write!(stream, "GET /api/stream HTTP/1.1\r\nHost: {host}\r\nX-Studio-Token: {token}\r\n\r\n")
            .expect("sent");
        stream
    }

    /// Time from the request to vent until the command of the valve.
    fn vents(&self, valve: &Valve) -> Duration {
        assert!(valve.open.load(Ordering::SeqCst), "the muscle is under pressure");
        *valve.vented.lock().expect("a time") = None;
        let begun = Instant::now();
        let (status, body) = request(&self.vent.0, "/vent", "", &self.vent.1);
        assert_eq!(status, 204, "{body}");
        loop {
            if let Some(vented) = *valve.vented.lock().expect("a time") {
                return vented.duration_since(begun);
            }
            assert!(begun.elapsed() < HOPELESS, "the valve does not open");
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// Puts the muscle under pressure.
    fn runs(&self, valve: &Valve) {
        // The vent before is confirmed by the time that another order is answered: an order to arm before that would be vented.
        self.order(&json!({ "do": "faults" }));
        self.order(&json!({ "do": "arm" }));
        self.order(&json!({ "do": "follow", "quantity": "pressure", "profile": "200" }));
        let deadline = Instant::now() + HOPELESS;
        while !valve.open.load(Ordering::SeqCst) {
            assert!(Instant::now() < deadline, "the muscle is not put under pressure");
            thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Median and worst.
fn summary(times: &mut [Duration]) -> [f64; 2] {
    times.sort_unstable();
    [times[times.len() / 2], times[times.len() - 1]].map(|time| time.as_secs_f64() * 1e3)
}

fn write_page(rows: &[(&str, usize, [f64; 2])]) {
    let mut text = format!(
        "# Time of a vent from the page\n\n\
         Written by `PAM_VENT_PAGE=write cargo test -p emulator-tests --test vent`. From the request, sent on a new connection, to the tick in \
         which the controller commands the valve to vent. The controller is the firmware as a library, in real time; the line is TCP. \
         Target: at most {} ms, whatever else runs.\n\n\
         | what else runs | vents | median, ms | worst, ms |\n| --- | ---: | ---: | ---: |\n",
        TARGET.as_millis()
    );
    for (what, count, [median, worst]) in rows {
        let _ = writeln!(text, "| {what} | {count} | {median:.1} | {worst:.1} |");
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/figures/vent.md");
    std::fs::write(path, text).expect("the page is written");
}

#[test]
fn a_vent_passes_computations_idle_connections_and_pages_that_do_not_read() {
    let writes = std::env::var("PAM_VENT_PAGE").is_ok_and(|value| value == "write");
    let count = if writes { 20 } else { 4 };
    let valve = Arc::new(Valve::default());
    let device = controller(&valve);
    let folder = Folder::new();
    let studio = Studio::start(&format!("tcp:{}", device.address()), folder.path());
    let muscle = studio.order(&json!({ "do": "example", "muscle": "mini" }))["muscle"].clone();
    let _deaf = [studio.deaf_page(), studio.deaf_page()];
    let mut quiet = Vec::new();
    for _ in 0..count {
        studio.runs(&valve);
        quiet.push(studio.vents(&valve));
    }
    // Idle connections: bare, with half a head, and with a body that does not come. Those at the page's port leave it a few places.
    let connect = |address: &str, at: usize| {
        let mut stream = TcpStream::connect(address).expect("the port");
        match at % 3 {
            0 => {}
            1 => write!(stream, "POST /vent HTTP/1.1\r\nHo").expect("sent"),
            _ => write!(stream, "POST /vent HTTP/1.1\r\nHost: {address}\r\nContent-Length: 40\r\n\r\n")
                .expect("sent"),
        }
        stream
    };
    let mut busy = Vec::new();
    while busy.len() < count {
        let work = [
            studio.begin(json!({ "do": "fit", "muscle": muscle })),
            studio.begin(json!({ "do": "diagnose", "muscle": muscle })),
        ];
        studio.runs(&valve);
        let _page: Vec<TcpStream> = (0..IDLE - 8).map(|at| connect(&studio.address, at)).collect();
        let _vent: Vec<TcpStream> = (0..IDLE).map(|at| connect(&studio.vent.0, at)).collect();
        let time = studio.vents(&valve);
        // Only where a computation was under way all the time.
        if !work.iter().all(JoinHandle::is_finished) {
            busy.push(time);
        }
        for work in work {
            let (status, body) = work.join().expect("an answer");
            assert_eq!(status, 200, "{body}");
        }
    }
    let (quiet, busy) = (summary(&mut quiet), summary(&mut busy));
    eprintln!("vents, median and worst: {quiet:.1?} ms without load, {busy:.1?} ms under load");
    // A vent that waits for what is under way takes seconds. A machine with many other tasks may take a while for anything.
    assert!(busy[1] < 1_000.0 + 20.0 * quiet[1], "{busy:?} ms under load, {quiet:?} ms without");
    if writes {
        write_page(&[
            ("nothing", count, quiet),
            (
                "a fit and a diagnosis; 64 idle connections at the port for vents, 56 at the page's; two pages that do not read",
                count,
                busy,
            ),
        ]);
    }
}
