//! The muscle as its maker or a calliper describes it, from a small TOML file.
//!
//! ```toml
//! name = "mini-1"
//! kind = "contractile"              # or "push"
//! rest_length_mm = 39.16
//! braid_angle_deg = 77.4            # from the radial plane
//! bladder_outer_diameter_mm = 3.0
//! bladder_wall_mm = 0.5
//! # optional: young_modulus_MPa, max_pressure_kPa, max_contraction
//! ```

use std::path::Path;

use model_core::braid::Geometry;
use model_core::units::{Angle, Length};
use serde::{Deserialize, Serialize};

use crate::error::{DataCode, Error, Result};
use crate::file_kind::FileKind;
use crate::toml_errors::toml_error;

/// Whether the muscle pulls, or pushes by a rod fixed to one end fitting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The muscle pulls: stroke is shortening, force is tension.
    Contractile,
    /// A push-PAM: stroke is the rod's extension, force its compression; both positive.
    Push,
}

/// A valid description: every length positive, the wall thinner than the radius, the angle possible.
///
/// Fields are in the units of their names, as in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)] // The unit is spelled as it is in the file: MPa is not mpa.
pub struct MuscleDescription {
    /// What the muscle is called; goes into tables and reports.
    pub name: String,
    /// Pulling or pushing.
    pub kind: Kind,
    /// L0: active length at rest, mm.
    pub rest_length_mm: f64,
    /// α0: braid angle at rest from the radial plane (nearly 90° when fibres are nearly axial), degrees.
    pub braid_angle_deg: f64,
    /// D0: bladder outer diameter at rest, mm.
    pub bladder_outer_diameter_mm: f64,
    /// t0: bladder wall at rest, mm.
    pub bladder_wall_mm: f64,
    /// Young's modulus of the bladder's material, MPa, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub young_modulus_MPa: Option<f64>,
    /// The pressure that the muscle must never exceed, kPa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_pressure_kPa: Option<f64>,
    /// The contraction ΔL/L0 that the muscle must never exceed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_contraction: Option<f64>,
}

impl MuscleDescription {
    /// Reads and checks a description.
    ///
    /// # Errors
    /// [`DataCode::FileUnreadable`], or [`DataCode::MuscleInvalid`] with line, key and what is expected.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = FileKind::Muscle.read_text(path)?;
        Self::parse(&text).map_err(|e| FileKind::Muscle.wanted(path, e))
    }

    /// Parses and checks the text of a description.
    ///
    /// # Errors
    /// [`DataCode::MuscleInvalid`] with line, key and what is expected.
    pub fn parse(text: &str) -> Result<Self> {
        let description: Self =
            toml::from_str(text).map_err(|e| toml_error(DataCode::MuscleInvalid, text, &e))?;
        description.check(text)?;
        Ok(description)
    }

    fn check(&self, text: &str) -> Result<()> {
        let wrong = |key: &str, value: f64, cause: &str, help: String| {
            let mut error =
                Error::new(DataCode::MuscleInvalid, cause).column(key).value(format!("{value}")).help(help);
            if let Some(at) = text.lines().position(|l| l.trim_start().starts_with(key)) {
                error = error.line(at as u64 + 1);
            }
            Err(error)
        };
        if self.name.trim().is_empty() {
            return Err(Error::new(DataCode::MuscleInvalid, "the muscle has no name").column("name"));
        }
        // The bounds are those of things that could be on a bench at all; they catch metres written as millimetres.
        let ranged = [
            ("rest_length_mm", Some(self.rest_length_mm), 1.0, 20_000.0),
            ("bladder_outer_diameter_mm", Some(self.bladder_outer_diameter_mm), 0.1, 1_000.0),
            ("bladder_wall_mm", Some(self.bladder_wall_mm), 0.001, 500.0),
            ("young_modulus_MPa", self.young_modulus_MPa, 0.001, 100_000.0),
            ("max_pressure_kPa", self.max_pressure_kPa, 1.0, 100_000.0),
            ("max_contraction", self.max_contraction, 0.001, 0.999),
        ];
        for (key, value, low, high) in ranged {
            if let Some(value) = value
                && !(low..=high).contains(&value)
            {
                return wrong(key, value, "out of range", format!("expected a number from {low} to {high}"));
            }
        }
        if !(self.braid_angle_deg > 0.0 && self.braid_angle_deg < 90.0) {
            let help = "the angle is measured from the radial plane and lies between 0 and 90 degrees";
            return wrong("braid_angle_deg", self.braid_angle_deg, "impossible braid angle", help.into());
        }
        // Below atan(1/√2) = 35.3° a braid lengthens under pressure instead of contracting.
        if self.braid_angle_deg < 35.3 {
            let help = format!(
                "a braid below 35.3° from the radial plane lengthens under pressure; if the angle was measured from \
                 the muscle's axis, write {:.1}",
                90.0 - self.braid_angle_deg
            );
            return wrong("braid_angle_deg", self.braid_angle_deg, "this braid would not contract", help);
        }
        if self.bladder_wall_mm >= self.bladder_outer_diameter_mm / 2.0 {
            let help = format!(
                "the wall must be thinner than the radius, {} mm",
                self.bladder_outer_diameter_mm / 2.0
            );
            return wrong("bladder_wall_mm", self.bladder_wall_mm, "the wall fills the whole bladder", help);
        }
        Ok(())
    }

    /// The geometry as described, without tip correction.
    #[must_use]
    pub fn geometry(&self) -> Geometry {
        Geometry {
            rest_length: Length::from_metres(self.rest_length()),
            braid_angle: Angle::from_degrees(self.braid_angle_deg),
            outer_diameter: Length::from_millimetres(self.bladder_outer_diameter_mm),
            wall: Length::from_millimetres(self.bladder_wall_mm),
            tip_correction: false,
        }
    }

    /// L0 in metres.
    #[must_use]
    pub fn rest_length(&self) -> f64 {
        self.rest_length_mm * 1e-3
    }

    /// α0 in radians.
    #[must_use]
    pub fn braid_angle(&self) -> f64 {
        self.braid_angle_deg.to_radians()
    }

    /// D0 in metres.
    #[must_use]
    pub fn bladder_outer_diameter(&self) -> f64 {
        self.bladder_outer_diameter_mm * 1e-3
    }

    /// t0 in metres.
    #[must_use]
    pub fn bladder_wall(&self) -> f64 {
        self.bladder_wall_mm * 1e-3
    }

    /// Young's modulus in pascals, where it is known.
    #[must_use]
    pub fn young_modulus(&self) -> Option<f64> {
        self.young_modulus_MPa.map(|e| e * 1e6)
    }

    /// Largest allowed pressure in pascals, where it is known.
    #[must_use]
    pub fn max_pressure(&self) -> Option<f64> {
        self.max_pressure_kPa.map(|p| p * 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINI: &str = "name = \"mini-1\"\nkind = \"contractile\"\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
                        bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n";

    #[test]
    fn the_documented_example_is_read() {
        let muscle = MuscleDescription::parse(MINI).unwrap();
        assert_eq!(muscle.kind, Kind::Contractile);
        assert!((muscle.rest_length() - 0.03916).abs() < 1e-15);
        assert_eq!(muscle.max_pressure(), None);
    }

    fn refused(from: &str, to: &str) -> String {
        let error = MuscleDescription::parse(&MINI.replace(from, to)).unwrap_err();
        format!("{error} | {}", error.advice().unwrap_or_default())
    }

    #[test]
    fn each_wrong_value_is_named_with_its_line_and_a_remedy() {
        let cases = [
            ("39.16", "-39.16"),
            ("39.16", "0.03916"),
            ("39.16", "nan"),
            ("77.4", "91"),
            ("77.4", "28.6"),
            ("0.5", "1.5"),
            ("\"contractile\"", "\"pull\""),
            ("rest_length_mm", "rest_lenght_mm"),
            ("name = \"mini-1\"\n", ""),
            ("name = \"mini-1\"", "name = \"\""),
            ("3.0", "\"3.0\""),
        ];
        let messages: Vec<_> = cases.iter().map(|(a, b)| refused(a, b)).collect();
        insta::assert_snapshot!(messages.join("\n"));
    }
}
