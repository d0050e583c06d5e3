//! The path of a vent from the page to the controller, which shares nothing with the rest of the program that could be busy: a port
//! and a thread of its own, and a second writer on the controller's line.
//!
//! Browsers open few connections to one port at a time, and the page's other requests may hold them all; those to another port are
//! counted apart. The token of this path only vents.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::post;

use super::access::{Access, guard, same, token};
use super::connections::{Beyond, Limits, body, serve};
use super::server::failed;
use pam_data::error::{DataCode, Error, Result};
use pam_device::VentLine;
use pam_device::error::DeviceCode;

/// Vents whatever else is under way.
#[derive(Debug, Default)]
pub struct Vent {
    count: AtomicU64,
    line: Mutex<Option<VentLine>>,
}

impl Vent {
    /// Vents so far; who finds more than before confirms the vent over the conversation.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::SeqCst)
    }

    /// Writes the request to vent to the controller's line.
    ///
    /// # Errors
    /// No controller, or a line that is gone.
    pub fn now(&self) -> Result<()> {
        self.count.fetch_add(1, Ordering::SeqCst);
        let mut line = self.line.lock().unwrap_or_else(PoisonError::into_inner);
        let line = line.as_mut().ok_or_else(|| {
            Error::new(DataCode::CallInvalid, "no controller is connected")
                .help("connect to a port, or start an emulated one")
        })?;
        line.send().map_err(|e| {
            e.concerning("the request to vent cannot be sent")
                .help("shut off the air supply of the muscle by hand")
        })
    }

    pub(super) fn connect(&self, line: VentLine) {
        *self.line.lock().unwrap_or_else(PoisonError::into_inner) = Some(line);
    }

    pub(super) fn disconnect(&self) {
        *self.line.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// Where the page finds the path.
#[derive(Debug, Clone)]
pub struct VentPath {
    /// Origin of its address: `http://127.0.0.1:PORT`.
    pub origin: String,
    /// The token, which only vents.
    pub token: Arc<str>,
}

#[derive(Clone)]
struct Shared {
    vent: Arc<Vent>,
    token: Arc<str>,
}

/// Serves the path on a thread of its own until the program ends. `pages` are the hosts under which the page is served.
pub(super) fn start(vent: Arc<Vent>, pages: Arc<[String]>) -> Result<VentPath> {
    let broken = |e: std::io::Error| {
        Error::new(DeviceCode::DevicePort, format!("the path for venting cannot be served: {e}"))
    };
    let listener = std::net::TcpListener::bind(SocketAddr::from(([127, 0, 0, 1], 0))).map_err(broken)?;
    listener.set_nonblocking(true).map_err(broken)?;
    let port = listener.local_addr().map_err(broken)?.port();
    let token: Arc<str> = token().map_err(broken)?.into();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(broken)?;
    let path = VentPath { origin: format!("http://127.0.0.1:{port}"), token: Arc::clone(&token) };
    let access = Access { hosts: [format!("127.0.0.1:{port}")].into(), origins: pages };
    let app = Router::new()
        .route("/vent", post(press))
        .layer(from_fn_with_state(access, guard))
        .with_state(Shared { vent, token });
    std::thread::Builder::new()
        .name("vent".into())
        .spawn(move || {
            runtime.block_on(async {
                if let Ok(listener) = tokio::net::TcpListener::from_std(listener) {
                    serve(listener, app, Limits { beyond: Beyond::Replaces, ..Limits::default() }).await;
                }
            });
        })
        .map_err(broken)?;
    Ok(path)
}

/// The body is the token, so that a browser sends the request without a preflight.
async fn press(State(shared): State<Shared>, request: Request<Body>) -> Response {
    let origin = request.headers().get(header::ORIGIN).cloned();
    let given = match body(request, 256).await {
        Ok(given) => given,
        Err(refusal) => return refusal,
    };
    let mut response = if !std::str::from_utf8(&given).is_ok_and(|given| same(given.trim(), &shared.token)) {
        (StatusCode::FORBIDDEN, "the token to vent is missing or old").into_response()
    } else {
        // This thread does nothing else, so a line that takes nothing delays only further vents over the same line.
        match shared.vent.now() {
            Ok(()) => StatusCode::NO_CONTENT.into_response(),
            Err(error) => failed(&error),
        }
    };
    // The page's own origin, which was checked, may read the answer.
    if let Some(origin) = origin {
        response.headers_mut().insert(header::ACCESS_CONTROL_ALLOW_ORIGIN, origin);
    }
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("origin"));
    response
}
