//! The page's server: this machine only, and orders only from who holds the token.
//!
//! Every request must name this server as its host and, where a browser says from where it comes, as its origin; whatever reads or
//! orders anything also needs the token, which is made again at each start. Another page in the same browser can therefore neither
//! read nor order anything, regardless of what it resolves its name to.
//!
//! Nothing on the server's thread waits for a computation, a file or a controller.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::mpsc::channel;
use std::sync::{Arc, mpsc::Sender};

use axum::body::Body;
use axum::extract::{Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde::Deserialize;
use tokio::sync::{Semaphore, broadcast};
use tokio_stream::StreamExt;
use tokio_stream::wrappers::BroadcastStream;

use super::access::{Access, guard, has_token, same, token};
use super::analysis::Analysis;
use super::answers::{Answer, Failure};
use super::connections::{Limits, body, serve as serve_connections};
use super::events::Message;
use super::orders::Posted;
use super::session;
use super::vent::{self, Vent, VentPath};
use pam_data::error::{DataCode, Error, Result};
use pam_device::error::DeviceCode;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("studio.css");
/// The parts of the page's program, each by its path.
const SCRIPTS: [(&str, &str); 9] = [
    ("/signals.js", include_str!("signals.js")),
    ("/plot.js", include_str!("plot.js")),
    ("/history.js", include_str!("history.js")),
    ("/view.js", include_str!("view.js")),
    ("/panels.js", include_str!("panels.js")),
    ("/studio.js", include_str!("studio.js")),
    ("/setpoint.js", include_str!("setpoint.js")),
    ("/settings.js", include_str!("settings.js")),
    ("/guide.js", include_str!("guide.js")),
];

/// Batches that a page may lag behind before it loses some: half a minute.
const BACKLOG: usize = 2048;
/// Largest recording that the page may send; it goes to the disk piece by piece.
const UPLOAD: u64 = 256 << 20;
/// Largest order: the longest is a muscle's description.
const ORDER: usize = 64 << 10;
/// Pieces of an upload that may wait for the disk.
const PIECES: usize = 4;

/// What the parts of the server share.
#[derive(Clone)]
pub(super) struct Shared {
    pub token: Arc<str>,
    pub orders: Sender<session::Request>,
    pub say: broadcast::Sender<String>,
    pub analysis: Arc<Analysis>,
    pub vent: Arc<Vent>,
    pub vent_path: VentPath,
    /// Computations that use the whole machine run one after the other.
    pub computing: Arc<Semaphore>,
}

/// What the studio connects to at its start.
#[derive(Debug)]
pub enum First {
    /// A port.
    Connect(String),
    /// An emulated controller with this muscle.
    Emulate(String),
}

/// Serves until `stop` completes; `ready` receives the address with the token. At the end the controller is vented.
///
/// # Errors
/// [`DeviceCode::DevicePort`] when the port cannot be listened on, [`DataCode::FileUnwritable`] for the folder.
pub fn serve(
    port: u16,
    folder: PathBuf,
    first: Option<First>,
    ready: impl FnOnce(&str),
    stop: impl Future<Output = ()> + Send + 'static,
) -> Result<()> {
    let broken =
        |e: std::io::Error| Error::new(DeviceCode::DevicePort, format!("the page cannot be served: {e}"));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(broken)?;
    let analysis = Arc::new(Analysis::new(folder)?);
    let (orders, requests) = channel();
    let (say, _) = broadcast::channel(BACKLOG);
    let vent = Arc::new(Vent::default());
    let owner = {
        let (say, vent) = (say.clone(), Arc::clone(&vent));
        std::thread::Builder::new()
            .name("session".into())
            .spawn(move || session::serve(&requests, &say, &vent))
            .map_err(broken)?
    };
    let outcome = runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind(SocketAddr::from(([127, 0, 0, 1], port)))
            .await
            .map_err(|e| broken(e).help("choose another one with --web-port"))?;
        let port = listener.local_addr().map_err(broken)?.port();
        let hosts: Arc<[String]> = [format!("127.0.0.1:{port}"), format!("localhost:{port}")].into();
        let vent_path = vent::start(Arc::clone(&vent), Arc::clone(&hosts))?;
        let token: Arc<str> = token().map_err(broken)?.into();
        let shared = Shared {
            token: Arc::clone(&token),
            orders: orders.clone(),
            say,
            analysis,
            vent,
            vent_path,
            computing: Arc::new(Semaphore::new(1)),
        };
        match first {
            Some(First::Connect(port)) => shared.connect(port).await?,
            Some(First::Emulate(muscle)) => shared.emulate(muscle).await?,
            None => Answer::Done,
        };
        ready(&format!("http://127.0.0.1:{port}/?token={token}"));
        let app = router(shared, hosts);
        // Streams never end by themselves, so nothing is waited for: the session vents after this.
        tokio::select! {
            () = serve_connections(listener, app, Limits::default()) => {}
            () = stop => {}
        }
        Ok(())
    });
    // A computation that still runs must not delay the vent.
    runtime.shutdown_background();
    drop(orders);
    let vented = owner
        .join()
        .map_err(|_| Error::new(DeviceCode::DeviceSilent, "the thread of the controller ended in a fault"))?;
    outcome.and(vented)
}

fn router(shared: Shared, hosts: Arc<[String]>) -> Router {
    let text = |kind: &'static str, body: &'static str| {
        move || async move { ([(header::CONTENT_TYPE, kind)], body) }
    };
    let access = Access { hosts: Arc::clone(&hosts), origins: hosts };
    let mut scripts = Router::new();
    for (path, script) in SCRIPTS {
        scripts = scripts.route(path, get(text("text/javascript; charset=utf-8", script)));
    }
    scripts
        .route("/", get(page))
        .route("/studio.css", get(text("text/css; charset=utf-8", STYLE)))
        .route("/report/{name}", get(report))
        .route("/api/stream", get(stream))
        .route("/api/order", post(order))
        .route("/api/recording", post(upload))
        .layer(from_fn_with_state(access, guard))
        .with_state(shared)
}

#[derive(Deserialize)]
struct Token {
    #[serde(default)]
    token: Option<String>,
}

/// The page itself is the same for everybody and holds no secret: a reload finds it without the token, which is in no address
/// after the first visit. A wrong token is refused, so that an old address is noticed immediately.
async fn page(State(shared): State<Shared>, Query(given): Query<Token>) -> Response {
    if given.token.is_some_and(|given| !same(&given, &shared.token)) {
        let why = "The token is old: open the address that `host studio` printed when it started.";
        return (StatusCode::FORBIDDEN, why).into_response();
    }
    let policy = format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self' {}; img-src 'self' data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        shared.vent_path.origin
    );
    let mut response = ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE).into_response();
    if let Ok(policy) = HeaderValue::from_str(&policy) {
        response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, policy);
    }
    response
}

/// A report, by a random name that opens this report and nothing else: its address may be in a history.
async fn report(State(shared): State<Shared>, Path(name): Path<String>) -> Response {
    let Some(text) = shared.analysis.report(&name) else {
        return (StatusCode::NOT_FOUND, "there is no such report any more: fit or diagnose again")
            .into_response();
    };
    let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; \
                  base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    let headers =
        [(header::CONTENT_TYPE, "text/html; charset=utf-8"), (header::CONTENT_SECURITY_POLICY, policy)];
    (headers, text.to_string()).into_response()
}

fn without_token() -> Response {
    let why = "the token is missing or old: open the address that `host studio` printed";
    (StatusCode::FORBIDDEN, why).into_response()
}

/// Lines of JSON for as long as the page is open; when it closes, the session notices that no page is open.
async fn stream(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    if !has_token(&headers, &shared.token) {
        return without_token();
    }
    let lines = BroadcastStream::new(shared.say.subscribe()).map(|message| {
        Ok::<_, Infallible>(match message {
            Ok(text) => text + "\n",
            Err(_) => {
                let text = "this page is too slow: some telemetry was not shown";
                Message::Error { level: "bad", text, help: None }.line() + "\n"
            }
        })
    });
    ([(header::CONTENT_TYPE, "application/x-ndjson")], Body::from_stream(lines)).into_response()
}

pub(super) fn failed(error: &Error) -> Response {
    let place = error.place().to_string();
    let failure =
        Failure { error: error.cause(), at: place, help: error.advice(), code: error.code().name() };
    (StatusCode::BAD_REQUEST, Json(failure)).into_response()
}

fn answered(outcome: Result<Answer>) -> Response {
    match outcome {
        Ok(value) => Json(value).into_response(),
        Err(error) => failed(&error),
    }
}

async fn order(State(shared): State<Shared>, request: Request) -> Response {
    if !has_token(request.headers(), &shared.token) {
        return without_token();
    }
    let body = match body(request, ORDER).await {
        Ok(body) => body,
        Err(refusal) => return refusal,
    };
    match serde_json::from_slice::<Posted>(&body) {
        Ok(posted) => answered(shared.post(posted).await),
        Err(e) => failed(&Error::new(DataCode::CallInvalid, format!("the page sent an unknown order: {e}"))),
    }
}

#[derive(Deserialize)]
struct UploadQuery {
    name: String,
}

async fn upload(
    State(shared): State<Shared>,
    Query(query): Query<UploadQuery>,
    request: Request,
) -> Response {
    if !has_token(request.headers(), &shared.token) {
        return without_token();
    }
    let (send, mut pieces) = tokio::sync::mpsc::channel(PIECES);
    let analysis = Arc::clone(&shared.analysis);
    let stored = tokio::task::spawn_blocking(move || {
        analysis.upload(&query.name, std::iter::from_fn(|| pieces.blocking_recv()))
    });
    let mut body = request.into_body().into_data_stream();
    let mut sent = 0_u64;
    let refused = |cause: &str| Err(Error::new(DataCode::CallInvalid, cause.to_owned()));
    loop {
        let piece = match tokio::time::timeout(super::connections::ARRIVAL, body.next()).await {
            Ok(None) => break,
            Ok(Some(Ok(piece))) => {
                sent += piece.len() as u64;
                if sent > UPLOAD { refused("the file is larger than 256 MiB") } else { Ok(piece) }
            }
            Ok(Some(Err(_))) => refused("the file did not arrive whole"),
            Err(_) => refused("the file stopped arriving"),
        };
        let ends = piece.is_err();
        // The receiver is gone when the disk refused a piece; its reason comes below.
        if send.send(piece).await.is_err() || ends {
            break;
        }
    }
    drop(send);
    let stored = stored.await.unwrap_or_else(|e| Err(ended_in_fault(&e)));
    answered(stored.map(Answer::Recordings))
}

pub(super) fn ended_in_fault(reason: &tokio::task::JoinError) -> Error {
    Error::new(DataCode::CallInvalid, format!("the computation ended in a fault: {reason}"))
}
