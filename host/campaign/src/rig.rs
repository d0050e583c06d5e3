//! What the rig can do, described once (`rig.toml`).
//!
//! ```
//! use pam_campaign::rig::{Axis, Rig};
//! let rig = Rig::parse("axis = 'prompt'\nstroke_max_mm = 12.0\nforce_max_N = 400.0\n").expect("as documented");
//! assert_eq!(rig.axis, Axis::Prompt);
//! assert!(Rig::parse("axis = 'pulley'").is_err());
//! ```

use std::path::Path;

use pam_data::error::{DataCode, Error, Result};
use pam_data::toml_errors::toml_error;
use serde::{Deserialize, Serialize};

/// What moves the free end of the muscle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// Nothing: the length is held at rest length.
    #[default]
    Held,
    /// A hanging weight: the muscle moves it, the program commands the pressure only.
    Weight,
    /// A second muscle at constant pressure pulls back; the program commands the pressure of the first one only.
    Pair,
    /// The operator sets the stroke when prompted; it is held during the recording.
    Prompt,
    /// A machine that takes commands line by line.
    Line,
    /// An axis that the program moves itself: the virtual bench.
    Commanded,
}

impl Axis {
    /// Whether the program may move the free end at a speed of its choice.
    #[must_use]
    pub const fn moves(self) -> bool {
        matches!(self, Self::Line | Self::Commanded)
    }

    /// Whether other held lengths than the present one are possible.
    #[must_use]
    pub(crate) const fn positions(self) -> bool {
        matches!(self, Self::Prompt | Self::Line | Self::Commanded)
    }
}

/// The rig.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// What moves the free end.
    #[serde(default)]
    pub axis: Axis,
    /// Where a machine listens (a serial device, or `tcp:HOST:PORT`), for the axis `line`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis_address: Option<String>,
    /// Speed of its serial line, baud.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis_baud: Option<u32>,
    /// Largest stroke that the rig allows, mm.
    #[serde(rename = "stroke_max_mm", skip_serializing_if = "Option::is_none")]
    pub stroke_max_mm: Option<f64>,
    /// Largest speed of the axis, mm/s.
    #[serde(rename = "speed_max_mm_s", skip_serializing_if = "Option::is_none")]
    pub speed_max_mm_s: Option<f64>,
    /// Largest force that the rig bears, N.
    #[serde(rename = "force_max_N", skip_serializing_if = "Option::is_none")]
    pub force_max: Option<f64>,
    /// Highest pressure that the supply gives, kPa.
    #[serde(rename = "pressure_max_kPa", skip_serializing_if = "Option::is_none")]
    pub pressure_max_kpa: Option<f64>,
    /// The hanging weight, N.
    #[serde(rename = "weight_N", skip_serializing_if = "Option::is_none")]
    pub weight: Option<f64>,
    /// Whether checks of the bench (dead weights, rigid bar, reference gauge, weighing, closed valve) can be made on request.
    #[serde(default)]
    pub checks: bool,
}

impl Rig {
    /// A rig whose axis the program moves, without limits of its own.
    #[must_use]
    pub fn commanded() -> Self {
        Self { axis: Axis::Commanded, ..Self::default() }
    }

    /// Reads a rig file.
    ///
    /// # Errors
    /// A file that cannot be read, or that is not a description of a rig.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::unreadable(path, &e))?;
        Self::parse(&text).map_err(|e| e.file(path))
    }

    /// Parses the text of a rig file and checks its numbers.
    ///
    /// # Errors
    /// [`DataCode::ProtocolInvalid`] with the line or the number at fault.
    pub fn parse(text: &str) -> Result<Self> {
        let rig: Self = toml::from_str(text).map_err(|e| toml_error(DataCode::ProtocolInvalid, text, &e))?;
        let numbers = [
            ("stroke_max_mm", rig.stroke_max_mm),
            ("speed_max_mm_s", rig.speed_max_mm_s),
            ("force_max_N", rig.force_max),
            ("pressure_max_kPa", rig.pressure_max_kpa),
            ("weight_N", rig.weight),
        ];
        for (name, value) in numbers {
            if let Some(value) = value
                && !(value > 0.0 && value.is_finite())
            {
                return Err(Error::new(DataCode::ProtocolInvalid, format!("{name} must be above zero"))
                    .value(value.to_string()));
            }
        }
        if rig.axis_baud == Some(0) {
            return Err(Error::new(DataCode::ProtocolInvalid, "axis_baud must be above zero").value("0"));
        }
        match rig.axis {
            Axis::Weight if rig.weight.is_none() => {
                Err(Error::new(DataCode::ProtocolInvalid, "a rig with a hanging weight needs weight_N"))
            }
            Axis::Line if rig.axis_address.is_none() => {
                Err(Error::new(DataCode::ProtocolInvalid, "an axis that takes lines needs axis_address")
                    .help("write axis_address = \"/dev/ttyUSB0\" or \"tcp:HOST:PORT\""))
            }
            _ => Ok(rig),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rig_is_read_and_impossible_ones_are_refused() {
        let rig = Rig::parse("axis = 'weight'\nweight_N = 19.6\n").unwrap();
        assert_eq!((rig.axis, rig.weight), (Axis::Weight, Some(19.6)));
        assert_eq!(Rig::parse("").unwrap().axis, Axis::Held);
        for bad in [
            "axis = 'weight'",
            "axis = 'line'",
            "axis_baud = 0",
            "stroke_max_mm = -1.0",
            "force_max_N = nan",
            "speed = 1.0",
        ] {
            assert!(Rig::parse(bad).is_err(), "{bad}");
        }
    }
}
