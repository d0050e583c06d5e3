//! Test protocols: what a bench does to a muscle, step by step, as plain data in a small TOML file.
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
//! A position is one of `to_mm` (stroke), `to_contraction` (share of the rest length) and `to_free` (share of the free stroke at the
//! present pressure: 0 blocked, 1 unloaded).

use serde::{Deserialize, Serialize};

/// A list of steps and a sampling rate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// The name of the protocol.
    pub name: String,
    /// Samples per second.
    #[serde(rename = "sample_Hz")]
    pub sample_hz: f64,
    /// The steps, in order.
    pub step: Vec<Step>,
}

/// A stroke, in one of three forms.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Place {
    /// Stroke, mm.
    #[serde(rename = "to_mm", skip_serializing_if = "Option::is_none")]
    pub mm: Option<f64>,
    /// Share of the rest length.
    #[serde(rename = "to_contraction", skip_serializing_if = "Option::is_none")]
    pub contraction: Option<f64>,
    /// Share of the free stroke at the present pressure.
    #[serde(rename = "to_free", skip_serializing_if = "Option::is_none")]
    pub free: Option<f64>,
}

impl Place {
    /// A share of the free stroke.
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
        /// Name of the file, without extension.
        name: String,
    },
    /// Stop recording: what follows is not written until the next `file`.
    EndFile,
    /// Vented at rest length: the instruments' zeros.
    Tare {
        /// Duration, s.
        seconds: f64,
    },
    /// Change the pressure at held length, then wait.
    Pressure {
        /// Target pressure, kPa.
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
        /// Target stroke.
        #[serde(flatten)]
        to: Place,
        /// Speed, mm/s.
        speed_mm_s: f64,
    },
    /// Triangular loops from the present position to another and back.
    Cycles {
        /// Target stroke.
        #[serde(flatten)]
        to: Place,
        /// Speed, mm/s.
        speed_mm_s: f64,
        /// Number of cycles.
        count: u32,
    },
    /// Keep everything as it is.
    Hold {
        /// Duration, s.
        seconds: f64,
    },
    /// Vented and let alone, not recorded.
    Rest {
        /// Duration, s.
        seconds: f64,
    },
    /// Sinusoidal motion about the present position.
    Sine {
        /// Amplitude, mm.
        amplitude_mm: f64,
        /// Frequency, Hz.
        #[serde(rename = "frequency_Hz")]
        frequency_hz: f64,
        /// Duration, s.
        seconds: f64,
    },
}

/// Why a protocol is invalid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProtocolError {
    /// Not a TOML file of this form, with the message of the parser.
    Text(String),
    /// A number out of range: the step (from 1; 0 for the header) and the reason.
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
    /// Parses a protocol file and checks its numbers.
    ///
    /// # Errors
    /// Text that is not a protocol, or a number out of range.
    pub fn from_toml(text: &str) -> Result<Self, ProtocolError> {
        let p: Self = toml::from_str(text).map_err(|e| ProtocolError::Text(e.to_string()))?;
        p.check()?;
        Ok(p)
    }

    /// The protocol as TOML text.
    ///
    /// # Errors
    /// Numbers that TOML cannot represent.
    pub fn to_toml(&self) -> Result<String, ProtocolError> {
        toml::to_string(self).map_err(|e| ProtocolError::Text(e.to_string()))
    }

    /// Checks that all numbers are in range.
    ///
    /// # Errors
    /// The first step with a number out of range.
    pub fn check(&self) -> Result<(), ProtocolError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let not_negative = |x: f64| x.is_finite() && x >= 0.0;
        if !positive(self.sample_hz) || self.sample_hz > 20_000.0 {
            return Err(ProtocolError::Number(0, "the sampling rate must be above 0 and at most 20 000 Hz"));
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
                        return bad(
                            "pressure and settling time must not be negative, and the rate must be above zero",
                        );
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
