//! The page's server: this machine only, and only for who holds the token.
//!
//! Every request must name this server as its host and, where a browser says from where it comes, as its origin; everything but
//! the page's scripts and style also needs the token, which is made anew at each start. A foreign page in the same browser can
//! therefore neither read nor order anything, whatever it resolves its name to.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, Path, Query, Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::{broadcast, oneshot};
use tokio_stream::StreamExt;
use tokio_stream::wrappers::BroadcastStream;

use super::keeper::{Asked, Order, keep};
use super::workshop::Workshop;
use pam_data::error::{DataCode, Error, Result};
use pam_device::available;
use pam_device::course::Quantity;
use pam_device::error::DeviceCode;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("studio.css");
const SCRIPT: &str = include_str!("studio.js");
const PLOT: &str = include_str!("plot.js");

/// Batches that a page may lag behind before it loses some: half a minute.
const BACKLOG: usize = 2048;
/// Largest recording that the page may send.
const UPLOAD: usize = 256 << 20;

#[derive(Clone)]
struct Shared {
    token: Arc<str>,
    hosts: Arc<[String]>,
    orders: Sender<Asked>,
    say: broadcast::Sender<String>,
    workshop: Arc<Mutex<Workshop>>,
}

/// Serves until `stop` completes; `ready` is told the address with the token. At the end the controller is vented.
///
/// # Errors
/// [`DeviceCode::DevicePort`] when the port cannot be listened on, [`DataCode::FileUnwritable`] for the folder.
pub fn serve(
    port: u16,
    folder: PathBuf,
    first: Option<Order>,
    ready: impl FnOnce(&str),
    stop: impl Future<Output = ()> + Send + 'static,
) -> Result<()> {
    let broken =
        |e: std::io::Error| Error::new(DeviceCode::DevicePort, format!("the page cannot be served: {e}"));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(broken)?;
    let workshop = Workshop::new(folder)?;
    let (orders, taken) = channel();
    let (say, _) = broadcast::channel(BACKLOG);
    let keeper = {
        let say = say.clone();
        std::thread::Builder::new().name("keeper".into()).spawn(move || keep(&taken, &say)).map_err(broken)?
    };
    let outcome = runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind(SocketAddr::from(([127, 0, 0, 1], port)))
            .await
            .map_err(|e| broken(e).help("choose another one with --web-port"))?;
        let port = listener.local_addr().map_err(broken)?.port();
        let token: Arc<str> = token().map_err(broken)?.into();
        let shared = Shared {
            token: Arc::clone(&token),
            hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")].into(),
            orders: orders.clone(),
            say,
            workshop: Arc::new(Mutex::new(workshop)),
        };
        if let Some(order) = first {
            shared.order(order).await?;
        }
        ready(&format!("http://127.0.0.1:{port}/?token={token}"));
        let app = router(shared);
        // Streams never end by themselves, so nothing is waited for: the keeper vents after this.
        tokio::select! {
            served = axum::serve(listener, app) => served.map_err(broken),
            () = stop => Ok(()),
        }
    });
    drop(runtime);
    drop(orders);
    keeper
        .join()
        .map_err(|_| Error::new(DeviceCode::DeviceSilent, "the thread of the controller ended in a fault"))?;
    outcome
}

fn router(shared: Shared) -> Router {
    let text = |kind: &'static str, body: &'static str| {
        move || async move { ([(header::CONTENT_TYPE, kind)], body) }
    };
    Router::new()
        .route("/", get(page))
        .route("/studio.css", get(text("text/css; charset=utf-8", STYLE)))
        .route("/studio.js", get(text("text/javascript; charset=utf-8", SCRIPT)))
        .route("/plot.js", get(text("text/javascript; charset=utf-8", PLOT)))
        .route("/report/{name}", get(report))
        .route("/api/stream", get(stream))
        .route("/api/order", post(order))
        .route("/api/recording", post(upload))
        .layer(DefaultBodyLimit::max(UPLOAD))
        .layer(from_fn_with_state(shared.clone(), guard))
        .with_state(shared)
}

/// 128 random bits from the system.
fn token() -> std::io::Result<String> {
    use std::io::Read;
    let mut bytes = [0_u8; 16];
    if let Ok(mut source) = std::fs::File::open("/dev/urandom") {
        source.read_exact(&mut bytes)?;
    } else {
        // Elsewhere the standard library's own seeds, which the system makes random, stand in.
        use std::hash::{BuildHasher, Hasher};
        for half in bytes.chunks_mut(8) {
            let seed = std::collections::hash_map::RandomState::new().build_hasher().finish();
            half.copy_from_slice(&seed.to_le_bytes());
        }
    }
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

fn same(a: &str, b: &str) -> bool {
    // As long whatever differs, so that time tells nothing of the token.
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

async fn guard(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    let refuse = |why: &'static str| (StatusCode::FORBIDDEN, why).into_response();
    let headers = request.headers();
    let text = |name| headers.get(name).and_then(|v: &axum::http::HeaderValue| v.to_str().ok());
    if !text(header::HOST).is_some_and(|host| shared.hosts.iter().any(|h| h == host)) {
        return refuse("this page is served to this machine only, under its own address");
    }
    if headers.contains_key(header::ORIGIN)
        && !text(header::ORIGIN)
            .is_some_and(|o| o.strip_prefix("http://").is_some_and(|o| shared.hosts.iter().any(|h| h == o)))
    {
        return refuse("other pages may not ask");
    }
    let path = request.uri().path();
    if path.starts_with("/api/")
        && !text(header::HeaderName::from_static("x-studio-token")).is_some_and(|t| same(t, &shared.token))
    {
        return refuse("the token is missing or old: open the address that `host studio` printed");
    }
    let mut response = next.run(request).await;
    let policy = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                  base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    // A report carries its style and script in itself, and says so.
    response
        .headers_mut()
        .entry(header::CONTENT_SECURITY_POLICY)
        .or_insert(axum::http::HeaderValue::from_static(policy));
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ] {
        response.headers_mut().insert(name, axum::http::HeaderValue::from_static(value));
    }
    response
}

#[derive(Deserialize)]
struct Token {
    #[serde(default)]
    token: String,
}

async fn page(State(shared): State<Shared>, Query(given): Query<Token>) -> Response {
    if !same(&given.token, &shared.token) {
        let why = "The token is missing or old: open the address that `host studio` printed when it started.";
        return (StatusCode::FORBIDDEN, why).into_response();
    }
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE).into_response()
}

/// The report of the last fit or diagnosis: one of two names, never a path.
async fn report(
    State(shared): State<Shared>,
    Path(name): Path<String>,
    Query(given): Query<Token>,
) -> Response {
    if !same(&given.token, &shared.token) {
        return (StatusCode::FORBIDDEN, "the token is missing or old").into_response();
    }
    let Some(text) = shared.lock().report(&name) else {
        return (StatusCode::NOT_FOUND, "there is no such report yet: fit or diagnose first").into_response();
    };
    let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; \
                  base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8"), (header::CONTENT_SECURITY_POLICY, policy)], text)
        .into_response()
}

/// Lines of JSON for as long as the page is open; when it closes, the keeper notices that nobody looks.
async fn stream(State(shared): State<Shared>) -> Response {
    let lines = BroadcastStream::new(shared.say.subscribe()).map(|message| {
        Ok::<_, Infallible>(match message {
            Ok(text) => text + "\n",
            Err(_) => json!({ "k": "e", "level": "bad", "text": "this page is too slow: some telemetry was not shown" }).to_string() + "\n",
        })
    });
    ([(header::CONTENT_TYPE, "application/x-ndjson")], Body::from_stream(lines)).into_response()
}

fn failed(error: &Error) -> Response {
    let place = error.place().to_string();
    let value =
        json!({ "error": error.cause(), "at": place, "help": error.advice(), "code": error.code().name() });
    (StatusCode::BAD_REQUEST, Json(value)).into_response()
}

fn answered(outcome: Result<Value>) -> Response {
    match outcome {
        Ok(value) => Json(value).into_response(),
        Err(error) => failed(&error),
    }
}

/// What the page may post.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
enum Posted {
    Ports,
    Connect { port: String },
    Emulate { muscle: String },
    Disconnect,
    Arm,
    Vent,
    Follow { quantity: String, course: String },
    Faults,
    Clear,
    Settings { set: Vec<String> },
    Mishap { code: u8 },
    Record,
    EndRecord,
    Recordings,
    Curves { number: usize },
    Example { muscle: String },
    Fit { muscle: String },
    Diagnose { muscle: String },
    Compare { a: usize, b: usize },
    Difference,
    Flash,
}

impl Shared {
    async fn order(&self, order: Order) -> Result<Value> {
        let gone = || {
            Error::new(DeviceCode::DeviceSilent, "the thread of the controller has ended")
                .help("start `host studio` again")
        };
        let (answer, answered) = oneshot::channel();
        self.orders.send((order, answer)).map_err(|_| gone())?;
        answered.await.map_err(|_| gone())?
    }

    /// Work that takes its time, beside the page's own traffic.
    async fn work(
        &self,
        work: impl FnOnce(&mut Workshop) -> Result<Value> + Send + 'static,
    ) -> Result<Value> {
        let workshop = Arc::clone(&self.workshop);
        let done = tokio::task::spawn_blocking(move || {
            work(&mut workshop.lock().unwrap_or_else(PoisonError::into_inner))
        });
        done.await
            .map_err(|e| Error::new(DataCode::CallInvalid, format!("the work ended in a fault: {e}")))?
    }

    async fn post(&self, posted: Posted) -> Result<Value> {
        match posted {
            Posted::Ports => Ok(json!(available())),
            Posted::Connect { port } => self.order(Order::Connect(port)).await,
            Posted::Emulate { muscle } => self.order(Order::Emulate(muscle)).await,
            Posted::Disconnect => self.order(Order::Disconnect).await,
            Posted::Arm => self.order(Order::Arm).await,
            Posted::Vent => self.order(Order::Vent).await,
            Posted::Follow { quantity, course } => {
                let quantity = match quantity.as_str() {
                    "force" => Quantity::Force,
                    "pressure" => Quantity::Pressure,
                    "stroke" => Quantity::Stroke,
                    _ => {
                        return Err(Error::new(
                            DataCode::CallInvalid,
                            "a course is of force, pressure or stroke",
                        ));
                    }
                };
                // A page may not read files of this machine by naming them as a course.
                if course.trim_start().starts_with('@') {
                    return Err(Error::new(DataCode::CallInvalid, "the page takes no course from a file")
                        .help("use host run"));
                }
                self.order(Order::Follow(quantity, course)).await
            }
            Posted::Faults => self.order(Order::Faults).await,
            Posted::Clear => self.order(Order::Clear).await,
            Posted::Settings { set } => self.order(Order::Settings(set)).await,
            Posted::Mishap { code } => self.order(Order::Mishap(code)).await,
            Posted::Record => {
                let path = self.lock().next_run();
                self.order(Order::Record(path)).await
            }
            Posted::EndRecord => {
                let ended = self.order(Order::EndRecord).await?;
                let mut workshop = self.lock();
                if let Some(path) = ended["path"].as_str() {
                    workshop.add(PathBuf::from(path));
                }
                Ok(workshop.list())
            }
            Posted::Recordings => Ok(self.lock().list()),
            Posted::Curves { number } => self.work(move |w| w.curves(number)).await,
            Posted::Example { muscle } => self.work(move |w| w.example(&muscle)).await,
            Posted::Fit { muscle } => self.work(move |w| w.fit(&muscle)).await,
            Posted::Diagnose { muscle } => self.work(move |w| w.diagnose(&muscle)).await,
            Posted::Compare { a, b } => self.work(move |w| w.compare(a, b)).await,
            Posted::Difference => {
                let table = self.lock().table()?;
                self.order(Order::Difference(table)).await
            }
            Posted::Flash => {
                let table = self.lock().table()?;
                self.order(Order::Flash(table)).await
            }
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Workshop> {
        self.workshop.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

async fn order(State(shared): State<Shared>, body: Bytes) -> Response {
    match serde_json::from_slice::<Posted>(&body) {
        Ok(posted) => answered(shared.post(posted).await),
        Err(e) => {
            failed(&Error::new(DataCode::CallInvalid, format!("the page asked for something unknown: {e}")))
        }
    }
}

#[derive(Deserialize)]
struct Named {
    name: String,
}

async fn upload(
    State(shared): State<Shared>,
    Query(named): Query<Named>,
    _headers: HeaderMap,
    body: Bytes,
) -> Response {
    answered(shared.work(move |w| w.upload(&named.name, &body)).await)
}
