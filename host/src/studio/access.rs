//! Who may use the page: this machine, under the page's own address, and for everything but the page itself, anyone who has the token.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use subtle::ConstantTimeEq;

/// Under which names a server may be addressed, and from pages of which hosts.
#[derive(Debug, Clone)]
pub(super) struct Access {
    pub hosts: Arc<[String]>,
    pub origins: Arc<[String]>,
}

/// 128 random bits from the operating system, in hexadecimal.
pub(super) fn token() -> std::io::Result<String> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

/// Compares in a time that does not depend on where two texts differ.
pub(super) fn same(a: &str, b: &str) -> bool {
    a.as_bytes().ct_eq(b.as_bytes()).into()
}

/// The one value of a header; `Err` where it is given twice or is not text, `Ok(None)` where it is not given.
fn single_value(headers: &HeaderMap, name: HeaderName) -> Result<Option<&str>, ()> {
    let mut all = headers.get_all(name).iter();
    match (all.next(), all.next()) {
        (None, _) => Ok(None),
        (Some(value), None) => value.to_str().map(Some).map_err(|_| ()),
        _ => Err(()),
    }
}

/// Whether a request names this server, and comes from its page where it says from where it comes. Two values of one header are
/// refused: two programs on the way could each read another one of them.
fn allowed(access: &Access, request: &Request) -> Result<(), &'static str> {
    let listed = |hosts: &[String], host: &str| hosts.iter().any(|h| h == host);
    let foreign = "this page is served to this machine only, under its own address";
    match single_value(request.headers(), header::HOST) {
        Ok(Some(host)) if listed(&access.hosts, host) => {}
        Err(()) => return Err("a request names one host"),
        _ => return Err(foreign),
    }
    if request.uri().authority().is_some_and(|named| !listed(&access.hosts, named.as_str())) {
        return Err(foreign);
    }
    match single_value(request.headers(), header::ORIGIN) {
        Ok(None) => Ok(()),
        Ok(Some(origin)) if origin.strip_prefix("http://").is_some_and(|o| listed(&access.origins, o)) => {
            Ok(())
        }
        Err(()) => Err("a request comes from one origin"),
        _ => Err("requests from other pages are refused"),
    }
}

/// Refuses unknown hosts and origins, and forbids the browser to keep or embed anything.
pub(super) async fn guard(State(access): State<Access>, request: Request, next: Next) -> Response {
    if let Err(why) = allowed(&access, &request) {
        return (StatusCode::FORBIDDEN, why).into_response();
    }
    let mut response = next.run(request).await;
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// The token of a request's header.
pub(super) fn has_token(headers: &HeaderMap, token: &str) -> bool {
    matches!(single_value(headers, HeaderName::from_static("x-studio-token")), Ok(Some(given)) if same(given, token))
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;

    fn request(headers: &[(HeaderName, &str)]) -> Request {
        let mut request = Request::new(Body::empty());
        for (name, value) in headers {
            request.headers_mut().append(name, HeaderValue::from_str(value).unwrap());
        }
        request
    }

    #[test]
    fn a_second_host_or_origin_is_refused_also_where_the_first_is_right() {
        let hosts: Arc<[String]> = ["127.0.0.1:1".to_owned()].into();
        let access = Access { hosts: Arc::clone(&hosts), origins: hosts };
        let (own, page) = ((header::HOST, "127.0.0.1:1"), (header::ORIGIN, "http://127.0.0.1:1"));
        assert!(allowed(&access, &request(std::slice::from_ref(&own))).is_ok());
        assert!(allowed(&access, &request(&[own.clone(), page.clone()])).is_ok());
        assert!(allowed(&access, &request(&[])).is_err());
        assert!(allowed(&access, &request(&[(header::HOST, "evil.example")])).is_err());
        assert!(allowed(&access, &request(&[own.clone(), (header::HOST, "evil.example")])).is_err());
        assert!(allowed(&access, &request(&[own.clone(), own.clone()])).is_err());
        let evil = (header::ORIGIN, "http://evil.example");
        assert!(allowed(&access, &request(&[own.clone(), evil.clone()])).is_err());
        assert!(allowed(&access, &request(&[own.clone(), page, evil])).is_err());
        let mut absolute = request(&[own]);
        *absolute.uri_mut() = "http://evil.example/api/order".parse().unwrap();
        assert!(allowed(&access, &absolute).is_err());
    }

    #[test]
    fn tokens_are_long_and_differ() {
        let (a, b) = (token().unwrap(), token().unwrap());
        assert_eq!(a.len(), 32);
        assert_ne!(a, b);
        assert!(same(&a, &a) && !same(&a, &b) && !same(&a, &a[1..]));
    }
}
