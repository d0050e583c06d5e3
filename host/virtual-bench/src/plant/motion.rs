//! What moves the muscle's free end, and the file of such scripts.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What moves the muscle's free end during a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Motion {
    /// The length is held.
    Held {
        /// Contraction stroke, mm.
        stroke_mm: f64,
    },
    /// The length swings: `mean + amplitude sin(2π f t)`.
    Sine {
        /// Mean stroke, mm.
        mean_mm: f64,
        /// Amplitude, mm.
        amplitude_mm: f64,
        /// Frequency f, Hz.
        #[serde(rename = "frequency_Hz")]
        frequency_hz: f64,
    },
    /// The length follows straight lines between points (time in s, stroke in mm); it stays at the last.
    Path {
        /// The points, times rising.
        points: Vec<(f64, f64)>,
    },
    /// The muscle moves a mass against a spring: `m a = F − preload − k x − c v`, between stops.
    Load {
        /// Mass, kg.
        #[serde(rename = "mass_kg")]
        mass: f64,
        /// Spring, N/mm.
        #[serde(rename = "spring_N_mm", default)]
        spring: f64,
        /// Constant pull against the muscle, N.
        #[serde(rename = "preload_N", default)]
        preload: f64,
        /// Damper, N s/mm.
        #[serde(rename = "damper_N_s_mm", default)]
        damper: f64,
    },
}

/// The scripts of a plant file: `[[script]]` tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scripts {
    /// In the order in which the board requests them by number.
    pub script: Vec<Motion>,
}

impl Scripts {
    /// Read a TOML file of `[[script]]` tables; the error is the parser's, or says which number cannot be.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        let scripts: Self = toml::from_str(text).map_err(|e| e.to_string())?;
        for (i, s) in scripts.script.iter().enumerate() {
            s.check().map_err(|what| format!("script {i}: {what}"))?;
        }
        Ok(scripts)
    }
}

impl Motion {
    /// Refuse numbers that cannot be.
    pub fn check(&self) -> Result<(), &'static str> {
        let finite = |x: &[f64]| x.iter().all(|v| v.is_finite());
        let good = match self {
            Self::Held { stroke_mm } => finite(&[*stroke_mm]),
            Self::Sine { mean_mm, amplitude_mm, frequency_hz } => {
                finite(&[*mean_mm, *amplitude_mm, *frequency_hz])
            }
            Self::Path { points } => {
                if points.is_empty() || points.windows(2).any(|w| w[1].0 <= w[0].0) {
                    return Err("a path needs points with rising times");
                }
                points.iter().all(|p| finite(&[p.0, p.1]))
            }
            Self::Load { mass, spring, preload, damper } => {
                if *mass <= 0.0 {
                    return Err("a load needs a mass above zero");
                }
                finite(&[*mass, *spring, *preload, *damper])
            }
        };
        if good { Ok(()) } else { Err("numbers must be finite") }
    }

    /// Stroke (m) that is prescribed at a time (s), and whether the script is over.
    pub(super) fn stroke(&self, t: f64) -> (f64, bool) {
        match self {
            Self::Held { stroke_mm } => (stroke_mm * 1e-3, false),
            Self::Sine { mean_mm, amplitude_mm, frequency_hz } => {
                ((mean_mm + amplitude_mm * (TAU * frequency_hz * t).sin()) * 1e-3, false)
            }
            Self::Path { points } => {
                let after = points.iter().position(|p| p.0 > t);
                match after {
                    Some(0) => (points[0].1 * 1e-3, false),
                    Some(i) => {
                        let (a, b) = (points[i - 1], points[i]);
                        ((a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0)) * 1e-3, false)
                    }
                    None => (points.last().map_or(0.0, |p| p.1) * 1e-3, true),
                }
            }
            Self::Load { .. } => (0.0, false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_come_from_a_file_and_bad_ones_are_refused() {
        let good = "[[script]]\nkind = \"path\"\npoints = [[0.0, 0.0], [1.0, 2.0]]\n[[script]]\nkind = \"load\"\nmass_kg = 1.0\n";
        let scripts = Scripts::from_toml(good).expect("good");
        assert_eq!(scripts.script[0].stroke(0.5), (1e-3, false));
        assert!(scripts.script[0].stroke(1.5).1);
        assert!(Scripts::from_toml("[[script]]\nkind = \"path\"\npoints = []\n").is_err());
        assert!(Scripts::from_toml("[[script]]\nkind = \"load\"\nmass_kg = 0.0\n").is_err());
    }
}
