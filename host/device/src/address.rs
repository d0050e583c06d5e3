//! Where a device is.

use std::fmt;
use std::net::ToSocketAddrs;
use std::path::PathBuf;
use std::str::FromStr;

use pam_data::error::{DataCode, Error, Result};

/// A serial device by its path, or a TCP end point of an emulated one.
///
/// ```
/// use pam_device::Address;
/// let emulated: Address = "tcp:127.0.0.1:4321".parse()?;
/// assert_eq!(emulated, Address::Tcp { host: "127.0.0.1".into(), port: 4321 });
/// let board: Address = "/dev/ttyACM0".parse()?;
/// assert_eq!(board.to_string(), "/dev/ttyACM0");
/// assert_eq!("tcp:localhost".parse::<Address>().unwrap_err().exit_status(), 2);
/// # Ok::<(), pam_data::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Address {
    /// A serial device, such as `/dev/ttyACM0` or `COM3`.
    Serial(PathBuf),
    /// `tcp:HOST:PORT`.
    Tcp {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Port.
        port: u16,
    },
}

impl Address {
    /// Whether both name the same end point, also under different names of one computer or one serial device.
    #[must_use]
    pub fn same_place(&self, other: &Self) -> bool {
        if self == other {
            return true;
        }
        match (self, other) {
            (Self::Serial(a), Self::Serial(b)) => {
                std::fs::canonicalize(a).is_ok_and(|a| std::fs::canonicalize(b).is_ok_and(|b| a == b))
            }
            (Self::Tcp { host: a, port }, Self::Tcp { host: b, port: other }) if port == other => {
                let all = |host: &str| {
                    (host, *port).to_socket_addrs().map(Iterator::collect::<Vec<_>>).unwrap_or_default()
                };
                let there = all(b);
                all(a).iter().any(|address| there.contains(address))
            }
            _ => false,
        }
    }
}

impl FromStr for Address {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |cause: &str| {
            Error::new(DataCode::CallInvalid, cause.to_owned())
                .value(text)
                .help("a port is a serial device such as /dev/ttyACM0 or COM3, or tcp:HOST:PORT for an emulated one")
        };
        if text.is_empty() {
            return Err(wrong("the port is empty"));
        }
        let Some(rest) = text.strip_prefix("tcp:") else {
            return Ok(Self::Serial(text.into()));
        };
        let (host, port) = rest.rsplit_once(':').ok_or_else(|| wrong("the TCP port has no number"))?;
        let host = host.trim_start_matches('[').trim_end_matches(']');
        if host.is_empty() {
            return Err(wrong("the TCP port has no host"));
        }
        match port.parse() {
            Ok(port) if port > 0 => Ok(Self::Tcp { host: host.to_owned(), port }),
            _ => Err(wrong("the TCP port's number is not between 1 and 65535")),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => write!(f, "{}", path.display()),
            Self::Tcp { host, port } if host.contains(':') => write!(f, "tcp:[{host}]:{port}"),
            Self::Tcp { host, port } => write!(f, "tcp:{host}:{port}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_is_read_again() {
        for text in ["/dev/ttyUSB0", "COM3", "tcp:localhost:1", "tcp:[::1]:65535"] {
            let address: Address = text.parse().unwrap();
            assert_eq!(address.to_string(), text);
        }
    }

    #[test]
    fn one_place_under_two_names_is_recognised() {
        let at = |text: &str| text.parse::<Address>().unwrap();
        assert!(at("tcp:localhost:4000").same_place(&at("tcp:127.0.0.1:4000")));
        assert!(!at("tcp:localhost:4000").same_place(&at("tcp:127.0.0.1:4001")));
        assert!(at("/dev/null").same_place(&at("/dev/../dev/null")));
        assert!(!at("/dev/null").same_place(&at("/dev/zero")));
    }

    #[test]
    fn a_wrong_port_is_the_callers_fault() {
        for text in
            ["", "tcp:", "tcp:host", "tcp::80", "tcp:host:", "tcp:host:0", "tcp:host:65536", "tcp:host:x"]
        {
            let error = text.parse::<Address>().unwrap_err();
            assert_eq!(error.exit_status(), 2, "{text}");
            assert!(error.advice().is_some_and(|h| h.contains("tcp:HOST:PORT")));
        }
    }
}
