//! Where a device is.

use std::fmt;
use std::net::ToSocketAddrs;
use std::path::PathBuf;
use std::str::FromStr;

use model_core::link::can;
use model_core::link::settings::CanLine;
use pam_data::error::{DataCode, Error, Result};

/// A serial device by its path, a TCP end point of an emulated one, or a device on a CAN bus behind a serial adapter.
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
    /// A TCP connection, written as `tcp:HOST:PORT`.
    Tcp {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Number of the TCP port.
        port: u16,
    },
    /// A device behind a CAN adapter, written as `slcan:ADAPTER,address=N[,kbit=500][,baud=115200]`.
    Can {
        /// Where the adapter is: a serial device, or TCP.
        adapter: Box<Address>,
        /// Address of the device on the bus; none for `all`, which only a vent is sent to.
        device: Option<can::Address>,
        /// Bit rate of the bus, kbit/s.
        kbit_per_s: u16,
        /// Speed of the adapter's serial line, baud. Adapters on USB ignore it.
        baud: u32,
    },
}

/// The default: the bit rate of a new device, and a speed that most adapters have that are not on USB.
const KBIT_PER_S: u16 = CanLine::OFF.kbit_per_s;
const BAUD: u32 = 115_200;

/// How a place on a bus is written.
const SLCAN: &str = "slcan:ADAPTER,address=N[,kbit=500][,baud=115200]";

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
            (Self::Can { adapter: a, device, .. }, Self::Can { adapter: b, device: other, .. }) => {
                device == other && a.same_place(b)
            }
            _ => false,
        }
    }

    /// Whether it names all devices on a bus.
    #[must_use]
    pub fn is_whole_bus(&self) -> bool {
        matches!(self, Self::Can { device: None, .. })
    }
}

/// The device that the text after `slcan:` names.
fn on_bus(text: &str, rest: &str) -> Result<Address> {
    let wrong = |cause: String| {
        Error::new(DataCode::CallInvalid, cause)
            .value(text)
            .help(format!("a device on a CAN bus is {SLCAN}, such as slcan:/dev/ttyACM0,address=2"))
    };
    let mut parts = rest.split(',');
    let adapter: Address = parts
        .next()
        .unwrap_or_default()
        .parse()
        .map_err(|_| wrong("the port names no CAN adapter".to_owned()))?;
    if matches!(adapter, Address::Can { .. }) {
        return Err(wrong("the port names an adapter behind an adapter".to_owned()));
    }
    let (mut device, mut kbit_per_s, mut baud) = (None, KBIT_PER_S, BAUD);
    for part in parts {
        let (key, value) = part.split_once('=').unwrap_or((part, ""));
        match key {
            "address" if value == "all" => device = Some(None),
            "address" => {
                let found = value.parse().ok().and_then(can::Address::new);
                device = Some(Some(
                    found.ok_or_else(|| wrong("the address on the bus is not 1 to 8, or all".to_owned()))?,
                ));
            }
            "kbit" => {
                let rate = value.parse().ok().filter(|rate| CanLine::RATES.contains(rate));
                kbit_per_s = rate.ok_or_else(|| {
                    wrong("the bit rate of the bus is not 125, 250, 500 or 1000".to_owned())
                })?;
            }
            "baud" => {
                let speed = value.parse().ok().filter(|speed| (300..=12_000_000).contains(speed));
                baud = speed.ok_or_else(|| {
                    wrong("the speed of the adapter is not 300 to 12000000 baud".to_owned())
                })?;
            }
            _ => return Err(wrong(format!("`{part}` is not part of a port"))),
        }
    }
    let device = device.ok_or_else(|| wrong("the port names no address on the bus".to_owned()))?;
    Ok(Address::Can { adapter: Box::new(adapter), device, kbit_per_s, baud })
}

impl FromStr for Address {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |cause: &str| {
            Error::new(DataCode::CallInvalid, cause.to_owned())
                .value(text)
                .help("a port is a serial device such as /dev/ttyACM0 or COM3, tcp:HOST:PORT for an emulated one, or slcan:ADAPTER,address=N for one on a CAN bus")
        };
        if text.is_empty() {
            return Err(wrong("the port is empty"));
        }
        if let Some(rest) = text.strip_prefix("slcan:") {
            return on_bus(text, rest);
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
            Self::Can { adapter, device, kbit_per_s, baud } => {
                write!(f, "slcan:{adapter},address=")?;
                match device {
                    Some(device) => write!(f, "{}", device.number())?,
                    None => f.write_str("all")?,
                }
                if *kbit_per_s != KBIT_PER_S {
                    write!(f, ",kbit={kbit_per_s}")?;
                }
                if *baud != BAUD {
                    write!(f, ",baud={baud}")?;
                }
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_addresses_are_read_again() {
        for text in [
            "/dev/ttyUSB0",
            "COM3",
            "tcp:localhost:1",
            "tcp:[::1]:65535",
            "slcan:/dev/ttyACM0,address=2",
            "slcan:COM3,address=all,kbit=1000,baud=3000000",
            "slcan:tcp:localhost:1,address=8",
        ] {
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
    fn a_wrong_place_on_a_bus_is_the_callers_fault() {
        for (rest, cause) in [
            ("", "no CAN adapter"),
            ("/dev/ttyACM0", "no address"),
            ("/dev/ttyACM0,address=0", "1 to 8"),
            ("/dev/ttyACM0,address=9", "1 to 8"),
            ("/dev/ttyACM0,address=", "1 to 8"),
            ("/dev/ttyACM0,address=2,kbit=333", "125, 250, 500 or 1000"),
            ("/dev/ttyACM0,address=2,baud=0", "baud"),
            ("/dev/ttyACM0,adress=2", "`adress=2`"),
            ("slcan:/dev/ttyACM0", "behind an adapter"),
            ("tcp:host,address=2", "no CAN adapter"),
        ] {
            let error = format!("slcan:{rest}").parse::<Address>().unwrap_err();
            assert_eq!(error.exit_status(), 2, "{rest}");
            assert!(error.cause().contains(cause) || rest.starts_with("slcan"), "{rest}: {error}");
            assert!(error.advice().is_some_and(|h| h.contains("slcan:/dev/ttyACM0,address=2")));
        }
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
