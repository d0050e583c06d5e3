//! Buckets through `object_store`. Each thread has a runtime and connections of its own, since a connection lives in its runtime.

use std::cell::RefCell;
use std::collections::HashMap;
use std::future::Future;
use std::path::Path;
use std::sync::{Arc, Once};
use std::time::Duration;

use object_store::aws::AmazonS3Builder;
use object_store::azure::MicrosoftAzureBuilder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::path::Path as Key;
use object_store::{ObjectStore, ObjectStoreExt, PutPayload, RetryConfig};
use pam_data::error::{DataCode, Error, Result};
use tokio::runtime::Runtime;
use url::Url;

/// Requests are repeated this often, and for this long, if a server does not answer: it may restart, but a wrong endpoint must be reported
/// soon. The defaults of `object_store` are 10 and 3 minutes.
const RETRIES: usize = 4;
const RETRY_SECONDS: u64 = 20;

/// Connections of one thread.
struct Stores {
    runtime: Runtime,
    open: HashMap<String, Arc<dyn ObjectStore>>,
}

thread_local! {
    static STORES: RefCell<Option<Stores>> = const { RefCell::new(None) };
}

/// The bucket of an address as it is opened: the variables of the environment that begin with `prefix`, the address, and the bounds of
/// repetition.
macro_rules! opened {
    ($builder:ty, $prefix:literal, $address:expr) => {{
        let retry = RetryConfig {
            max_retries: RETRIES,
            retry_timeout: Duration::from_secs(RETRY_SECONDS),
            ..RetryConfig::default()
        };
        let named = std::env::vars_os()
            .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)))
            .filter(|(name, _)| name.starts_with($prefix));
        let with =
            |builder: $builder, (name, value): (String, String)| match name.to_ascii_lowercase().parse() {
                Ok(key) => builder.with_config(key, value),
                // Variables of other programs begin with the same letters.
                Err(_) => builder,
            };
        let builder = named.fold(<$builder>::new(), with).with_url($address).with_retry(retry);
        builder.build().map(|store| Arc::new(store) as Arc<dyn ObjectStore>)
    }};
}

fn open(url: &Url) -> object_store::Result<Arc<dyn ObjectStore>> {
    match url.scheme() {
        "gs" => opened!(GoogleCloudStorageBuilder, "GOOGLE_", url.as_str()),
        "az" => opened!(MicrosoftAzureBuilder, "AZURE_", url.as_str()),
        _ => opened!(AmazonS3Builder, "AWS_", url.as_str()),
    }
}

/// The bucket of an address, without a key.
fn bucket_of(url: &Url) -> String {
    format!("{}://{}", url.scheme(), url.host_str().unwrap_or_default())
}

/// Work with the store of an address and the key of its object.
fn with<T, F: Future<Output = object_store::Result<T>>>(
    address: &str,
    code: DataCode,
    work: impl FnOnce(Arc<dyn ObjectStore>, Key) -> F,
) -> Result<std::result::Result<T, object_store::Error>> {
    let failed = |cause: String| {
        let example = "an address is s3://BUCKET/KEY, gs://BUCKET/KEY or az://CONTAINER/KEY";
        Error::new(code, cause).file(Path::new(address)).help(example)
    };
    let url = Url::parse(address).map_err(|e| failed(format!("the address is not valid: {e}")))?;
    if url.host_str().is_none_or(str::is_empty) {
        return Err(failed("the address names no bucket".into()));
    }
    let key = Key::from_url_path(url.path()).map_err(|e| failed(format!("the key is not valid: {e}")))?;
    STORES.with(|stores| {
        let mut stores = stores.borrow_mut();
        let stores = match &mut *stores {
            Some(stores) => stores,
            none => none.insert(begin().map_err(|e| failed(format!("the network cannot be used: {e}")))?),
        };
        let store = match stores.open.get(&bucket_of(&url)) {
            Some(store) => Arc::clone(store),
            None => {
                let store = open(&url).map_err(|e| explained(address, code, &e))?;
                stores.open.insert(bucket_of(&url), Arc::clone(&store));
                store
            }
        };
        Ok(stores.runtime.block_on(work(store, key)))
    })
}

fn begin() -> std::io::Result<Stores> {
    static PROVIDER: Once = Once::new();
    PROVIDER.call_once(|| {
        // Another part of the program may have chosen one already.
        let _ = rustls::crypto::ring::default_provider().install_default();
    });
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    Ok(Stores { runtime, open: HashMap::new() })
}

/// What a provider of buckets calls its settings.
struct Provider {
    /// Variables of the credentials.
    credentials: &'static str,
    /// Variable of the endpoint, for a server of one's own.
    endpoint: &'static str,
    /// Variable that allows an endpoint that is not encrypted.
    allow_http: &'static str,
    /// Whose servers are used without an endpoint.
    owner: &'static str,
}

/// The provider of an address, by its scheme.
fn provider(address: &str) -> Provider {
    match address.split("://").next() {
        Some("gs") => Provider {
            credentials: "GOOGLE_APPLICATION_CREDENTIALS (a file) or GOOGLE_SERVICE_ACCOUNT_KEY",
            endpoint: "GOOGLE_BASE_URL",
            allow_http: "GOOGLE_ALLOW_HTTP",
            owner: "Google",
        },
        Some("az") => Provider {
            credentials: "AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY",
            endpoint: "AZURE_STORAGE_ENDPOINT",
            allow_http: "AZURE_ALLOW_HTTP",
            owner: "Microsoft",
        },
        _ => Provider {
            credentials: "AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_REGION",
            endpoint: "AWS_ENDPOINT",
            allow_http: "AWS_ALLOW_HTTP",
            owner: "Amazon",
        },
    }
}

/// A failure of a bucket: whether the bucket, the credentials, or the connection is at fault, and what to do.
fn explained(address: &str, code: DataCode, error: &object_store::Error) -> Error {
    let Provider { credentials, endpoint, allow_http, owner } = provider(address);
    let bucket = Url::parse(address).map_or(address.to_owned(), |url| bucket_of(&url));
    let whole = error.to_string();
    let (cause, help) = match error {
        _ if no_bucket(error) => (
            format!("there is no bucket {bucket}"),
            format!("create it, or correct the address; a server of your own is named by {endpoint}"),
        ),
        _ if refuses(error) => (
            format!("{bucket} refuses the credentials"),
            format!("set {credentials} to those of an account that may list, read and write this bucket"),
        ),
        // The client builds no request to such an address.
        _ if whole.contains("http://") && whole.contains("builder error") => (
            "the endpoint is not encrypted".to_owned(),
            format!("give an https:// endpoint, or set {allow_http}=true for a server in your own network"),
        ),
        _ => (
            format!("{bucket} cannot be used: {}", first_line(&whole)),
            format!(
                "check the network and the endpoint ({endpoint}, if it is not {owner}'s), and set {credentials}"
            ),
        ),
    };
    Error::new(code, cause).file(Path::new(address)).help(help)
}

/// Whether listing a bucket failed because there is none: a list that is not found is one of a bucket. Not every request keeps the kind of its error, but
/// the answer of the server names it: `NoSuchBucket` of S3 and Google, `ContainerNotFound` of Azure.
fn no_bucket(error: &object_store::Error) -> bool {
    let answer = error.to_string();
    matches!(error, object_store::Error::NotFound { .. })
        || ["NoSuchBucket", "ContainerNotFound", "404 Not Found"].iter().any(|code| answer.contains(code))
}

/// Whether the credentials are at fault; as in [`no_bucket`], the kind of the error is lost when a bucket is listed.
fn refuses(error: &object_store::Error) -> bool {
    use object_store::Error::{PermissionDenied, Unauthenticated};
    let answer = error.to_string();
    matches!(error, Unauthenticated { .. } | PermissionDenied { .. })
        || ["401 Unauthorized", "403 Forbidden"].iter().any(|status| answer.contains(status))
}

/// Answers of servers span lines, and may be XML; what stands before says what is wrong.
fn first_line(text: &str) -> &str {
    let line = text.lines().next().unwrap_or(text);
    line.split_once(": <?xml").map_or(line, |(before, _)| before)
}

/// Lists at most one object, which reports a missing bucket and wrong credentials before anything is computed.
pub(crate) fn check(address: &str) -> Result<()> {
    let code = DataCode::FileUnwritable;
    let done = with(address, code, |store, key| async move {
        let mut objects = store.list(Some(&key));
        std::future::poll_fn(|c| objects.as_mut().poll_next(c)).await.transpose().map(drop)
    })?;
    done.map_err(|e| explained(address, code, &e))
}

/// The bytes of an object; nothing where there is none.
pub(crate) fn read(address: &str) -> Result<Option<Vec<u8>>> {
    let code = DataCode::FileUnreadable;
    let done = with(address, code, |store, key| async move { store.get(&key).await?.bytes().await })?;
    match done {
        Ok(bytes) => Ok(Some(bytes.to_vec())),
        // A missing bucket looks like a missing object.
        Err(object_store::Error::NotFound { .. }) => {
            let url = Url::parse(address).map_or(address.to_owned(), |url| bucket_of(&url));
            let listed = with(&url, code, |store, key| async move {
                let mut objects = store.list(Some(&key));
                std::future::poll_fn(|c| objects.as_mut().poll_next(c)).await.transpose().map(drop)
            })?;
            match listed {
                Err(e) if no_bucket(&e) => Err(explained(address, code, &e)),
                // Who may read objects need not be allowed to list them.
                _ => Ok(None),
            }
        }
        Err(e) => Err(explained(address, code, &e)),
    }
}

/// Addresses of the objects that match a pattern, sorted; one more than `most` at most.
pub(crate) fn list(pattern: &str, most: usize) -> Result<Vec<String>> {
    let code = DataCode::FileUnreadable;
    let bad = |e: glob::PatternError| {
        Error::new(code, format!("the pattern is not valid: {}", e.msg)).file(Path::new(pattern))
    };
    // The objects of the folder before the first wildcard.
    let begin = pattern.find(['*', '?', '[']).unwrap_or(pattern.len());
    let folder = pattern[..begin].rfind('/').map_or(pattern, |end| &pattern[..end]);
    let wanted = glob::Pattern::new(pattern.split_once("://").map_or(pattern, |p| p.1)).map_err(bad)?;
    let (scheme, rest) = folder.split_once("://").unwrap_or(("", folder));
    let bucket = rest.split('/').next().unwrap_or_default();
    let options = glob::MatchOptions { require_literal_separator: true, ..glob::MatchOptions::default() };
    let found = with(folder, code, |store, key| async move {
        let mut found = Vec::new();
        let mut objects = store.list(Some(&key));
        while let Some(object) = std::future::poll_fn(|c| objects.as_mut().poll_next(c)).await {
            let name = format!("{bucket}/{}", object?.location);
            if wanted.matches_with(&name, options) {
                found.push(format!("{scheme}://{name}"));
            }
            if found.len() > most {
                break;
            }
        }
        Ok(found)
    })?;
    let mut found = found.map_err(|e| explained(pattern, code, &e))?;
    found.sort();
    Ok(found)
}

/// Writes an object, in one step.
pub(crate) fn put(address: &str, bytes: Vec<u8>) -> Result<()> {
    let code = DataCode::FileUnwritable;
    let done =
        with(
            address,
            code,
            |store, key| async move { store.put(&key, PutPayload::from(bytes)).await.map(drop) },
        )?;
    done.map_err(|e| explained(address, code, &e))
}
