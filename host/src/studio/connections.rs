//! Connections of browsers, with bounds on their number, on the time that a request takes to arrive, and on its size.

use std::collections::VecDeque;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::Request;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

/// Time for the header of a request, and for its body.
pub(super) const ARRIVAL: Duration = Duration::from_secs(10);
/// Pause after the system refused a connection, for instance for lack of file handles.
const REFUSED: Duration = Duration::from_millis(50);

/// What is bounded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Connections at a time. A browser opens six to one origin; this is enough for ten.
    pub connections: usize,
    /// Time for the header of a request.
    pub header: Duration,
    /// What happens at the limit.
    pub beyond: Beyond,
}

/// What happens to a connection beyond the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Beyond {
    /// It is closed immediately.
    Refused,
    /// It takes the place of the oldest one: no number of idle connections keeps a new one out.
    Replaces,
}

impl Default for Limits {
    fn default() -> Self {
        Self { connections: 64, header: ARRIVAL, beyond: Beyond::Refused }
    }
}

/// Serves until the future is dropped.
pub(super) async fn serve(listener: TcpListener, app: Router, limits: Limits) {
    // In the order of their beginning.
    let mut open: VecDeque<JoinHandle<()>> = VecDeque::new();
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(REFUSED).await;
            continue;
        };
        open.retain(|connection| !connection.is_finished());
        if open.len() >= limits.connections {
            match limits.beyond {
                Beyond::Refused => continue,
                Beyond::Replaces => {
                    if let Some(oldest) = open.pop_front() {
                        oldest.abort();
                    }
                }
            }
        }
        // Answers are short, and a vent's must not wait for more to send.
        let _ = stream.set_nodelay(true);
        let service = TowerToHyperService::new(app.clone());
        open.push_back(tokio::spawn(async move {
            // A connection that breaks concerns its browser only.
            let _ = hyper::server::conn::http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(limits.header)
                .serve_connection(TokioIo::new(stream), service)
                .await;
        }));
    }
}

/// The body of a request, at most `limit` bytes of it.
pub(super) async fn body(request: Request<Body>, limit: usize) -> Result<Bytes, Response> {
    match tokio::time::timeout(ARRIVAL, to_bytes(request.into_body(), limit)).await {
        Ok(Ok(bytes)) => Ok(bytes),
        Ok(Err(_)) => {
            let why = format!("the request is longer than {limit} bytes, or broke off");
            Err((StatusCode::PAYLOAD_TOO_LARGE, why).into_response())
        }
        Err(_) => Err((StatusCode::REQUEST_TIMEOUT, "the request did not arrive in time").into_response()),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpStream;

    use axum::routing::get;

    use super::*;

    fn start(limits: Limits) -> std::net::SocketAddr {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let app = Router::new().route("/", get(|| async { "here" }));
        std::thread::spawn(move || {
            runtime.block_on(async { serve(TcpListener::from_std(listener).unwrap(), app, limits).await });
        });
        address
    }

    fn connect(address: std::net::SocketAddr) -> TcpStream {
        let stream = TcpStream::connect(address).unwrap();
        // A server that keeps the connection fails the test instead of holding it up permanently.
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    #[test]
    fn a_request_whose_head_does_not_end_is_given_up() {
        let limits = Limits { header: Duration::from_millis(50), ..Limits::default() };
        let mut stream = connect(start(limits));
        stream.write_all(b"GET / HTTP/1.1\r\nHost: x\r\nSlow: ").unwrap();
        let mut rest = Vec::new();
        stream.read_to_end(&mut rest).unwrap();
    }

    #[test]
    fn a_connection_beyond_the_limit_is_closed_and_the_others_continue() {
        let address = start(Limits { connections: 1, ..Limits::default() });
        let mut first = connect(address);
        let ask = |stream: &mut TcpStream| {
            stream.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n").unwrap();
            let mut bytes = [0; 1024];
            let count = stream.read(&mut bytes).unwrap();
            assert!(String::from_utf8_lossy(&bytes[..count]).starts_with("HTTP/1.1 200"));
        };
        ask(&mut first);
        assert_eq!(connect(address).read(&mut [0; 16]).unwrap(), 0);
        ask(&mut first);
    }

    #[test]
    fn where_vents_arrive_idle_connections_keep_no_new_one_out() {
        let limits = Limits { connections: 4, header: Duration::from_secs(3_600), beyond: Beyond::Replaces };
        let address = start(limits);
        let mut idle: Vec<TcpStream> = (0..12).map(|_| connect(address)).collect();
        // Half a header, a body that does not come, and nothing at all.
        idle[10].write_all(b"GET / HTTP/1.1\r\nHo").unwrap();
        idle[11].write_all(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n").unwrap();
        let mut fresh = connect(address);
        fresh.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n").unwrap();
        let mut bytes = [0; 1024];
        let count = fresh.read(&mut bytes).unwrap();
        assert!(String::from_utf8_lossy(&bytes[..count]).starts_with("HTTP/1.1 200"));
        assert_eq!(idle[0].read(&mut bytes).unwrap(), 0, "the oldest one is closed");
    }

    #[test]
    fn a_body_is_taken_up_to_its_limit() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let taken = |length: usize| {
            let request = Request::new(Body::from(vec![b'x'; length]));
            runtime
                .block_on(body(request, 64 << 10))
                .map(|body| body.len())
                .map_err(|refusal| refusal.status())
        };
        assert_eq!(taken(64 << 10), Ok(64 << 10));
        assert_eq!(taken((64 << 10) + 1), Err(StatusCode::PAYLOAD_TOO_LARGE));
    }
}
