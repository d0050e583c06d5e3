//! What is done to a muscle: a protocol is plain data, readable from a small TOML file.
//!
//! ```
//! let text = r#"
//!     name = "two loops and a hold"
//!     sample_Hz = 50.0
//!     [[step]]
//!     do = "pressure"
//!     to_kPa = 300.0
//!     [[step]]
//!     do = "cycles"
//!     count = 2
//!     speed_mm_s = 1.0
//!     to_free = 1.0
//!     [[step]]
//!     do = "hold"
//!     seconds = 10.0
//! "#;
//! let protocol = pam_protocol::Protocol::from_toml(text).expect("as documented");
//! assert_eq!(protocol.step.len(), 3);
//! ```
//!
//! A position is given as `to_mm` (contraction stroke), `to_contraction` (of rest length) or `to_free` (part of the free
//! stroke at the pressure of that moment: 0 blocked, 1 unloaded); one of the three.

use serde::{Deserialize, Serialize};

/// A list of steps at a sampling rate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// What it is called.
    pub name: String,
    /// Samples per second.
    #[serde(rename = "sample_Hz")]
    pub sample_hz: f64,
    /// What is done, in order.
    pub step: Vec<Step>,
}

/// A contraction stroke, said in one of three ways.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Place {
    /// In mm.
    #[serde(rename = "to_mm", skip_serializing_if = "Option::is_none")]
    pub mm: Option<f64>,
    /// Of the rest length.
    #[serde(rename = "to_contraction", skip_serializing_if = "Option::is_none")]
    pub contraction: Option<f64>,
    /// Of the free stroke at the present pressure.
    #[serde(rename = "to_free", skip_serializing_if = "Option::is_none")]
    pub free: Option<f64>,
}

impl Place {
    /// Part of the free stroke.
    pub fn free(part: f64) -> Self {
        Self { free: Some(part), ..Self::default() }
    }
}

/// One step of a protocol.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum Step {
    /// Start a new recording file. Without any such step everything is recorded into one file named as the protocol.
    File {
        /// Its name, without extension.
        name: String,
    },
    /// Stop recording: what follows is not written until the next `file`.
    EndFile,
    /// Vented at rest length: the instruments' zeros.
    Tare {
        /// For how long, s.
        seconds: f64,
    },
    /// Change the pressure at held length, then wait.
    Pressure {
        /// Where to, kPa.
        #[serde(rename = "to_kPa")]
        to_kpa: f64,
        /// How fast, kPa/s; a step when absent.
        #[serde(rename = "rate_kPa_s", skip_serializing_if = "Option::is_none")]
        rate_kpa_s: Option<f64>,
        /// How long to wait there, s.
        #[serde(default)]
        settle_s: f64,
    },
    /// Move at the present pressure.
    Move {
        /// Where to.
        #[serde(flatten)]
        to: Place,
        /// How fast, mm/s.
        speed_mm_s: f64,
    },
    /// Triangular loops from the present position to another and back.
    Cycles {
        /// Where to.
        #[serde(flatten)]
        to: Place,
        /// How fast, mm/s.
        speed_mm_s: f64,
        /// How often.
        count: u32,
    },
    /// Keep everything as it is.
    Hold {
        /// For how long, s.
        seconds: f64,
    },
    /// Vented and let alone, not recorded.
    Rest {
        /// For how long, s.
        seconds: f64,
    },
    /// Sinusoidal motion about the present position.
    Sine {
        /// Amplitude, mm.
        amplitude_mm: f64,
        /// Frequency, Hz.
        #[serde(rename = "frequency_Hz")]
        frequency_hz: f64,
        /// For how long, s.
        seconds: f64,
    },
}

/// Why a protocol cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProtocolError {
    /// Not a TOML file of this form; the parser's words.
    Text(String),
    /// A number that cannot be: which step (from 1; 0 for the head) and what is wrong.
    Number(usize, &'static str),
}

impl std::fmt::Display for ProtocolError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(t) => write!(f, "not a protocol file: {t}"),
            Self::Number(0, what) => write!(f, "{what}"),
            Self::Number(step, what) => write!(f, "step {step} of the protocol: {what}"),
        }
    }
}

impl std::error::Error for ProtocolError {}

impl Protocol {
    /// Read a protocol file and check its numbers.
    pub fn from_toml(text: &str) -> Result<Self, ProtocolError> {
        let p: Self = toml::from_str(text).map_err(|e| ProtocolError::Text(e.to_string()))?;
        p.check()?;
        Ok(p)
    }

    /// The protocol as a file.
    pub fn to_toml(&self) -> Result<String, ProtocolError> {
        toml::to_string(self).map_err(|e| ProtocolError::Text(e.to_string()))
    }

    /// Refuse numbers that cannot be.
    pub fn check(&self) -> Result<(), ProtocolError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let not_negative = |x: f64| x.is_finite() && x >= 0.0;
        if !positive(self.sample_hz) || self.sample_hz > 20_000.0 {
            return Err(ProtocolError::Number(0, "the sampling rate must lie between 0 and 20 000 Hz"));
        }
        for (i, step) in self.step.iter().enumerate() {
            let bad = |what| Err(ProtocolError::Number(i + 1, what));
            let place = |p: &Place| {
                let given = [p.mm, p.contraction, p.free];
                given.iter().flatten().count() == 1 && given.iter().flatten().all(|x| x.is_finite())
            };
            match step {
                Step::File { .. } | Step::EndFile => {}
                Step::Tare { seconds } | Step::Hold { seconds } | Step::Rest { seconds } => {
                    if !not_negative(*seconds) {
                        return bad("the time must not be negative");
                    }
                }
                Step::Pressure { to_kpa, rate_kpa_s, settle_s } => {
                    if !not_negative(*to_kpa)
                        || !not_negative(*settle_s)
                        || rate_kpa_s.is_some_and(|r| !positive(r))
                    {
                        return bad("pressure and waiting time must not be negative, the rate above zero");
                    }
                }
                Step::Move { to, speed_mm_s } | Step::Cycles { to, speed_mm_s, .. } => {
                    if !place(to) {
                        return bad("give one of to_mm, to_contraction, to_free");
                    }
                    if !positive(*speed_mm_s) {
                        return bad("the speed must be above zero");
                    }
                }
                Step::Sine { amplitude_mm, frequency_hz, seconds } => {
                    if !amplitude_mm.is_finite() || !positive(*frequency_hz) || !not_negative(*seconds) {
                        return bad("a sine needs a finite amplitude, a frequency above zero and a time");
                    }
                }
            }
        }
        Ok(())
    }
}
