//! Limits beyond which no pneumatic muscle works. A reading outside them has a wrong unit, sign or zero; the model would still return
//! numbers for it, without meaning.

use model_core::braid::Braid;

use crate::error::{DataCode, Error, Result};

/// Lowest and highest gauge pressure, Pa: vacuum (−101 kPa) with a margin for a sensor's zero, and 1000 bar.
const PRESSURE: (f64, f64) = (-120e3, 1e8);

/// The largest force, N: a thousand times that of the strongest muscles on the market.
const FORCE: f64 = 1e7;

/// A contraction that no braid reaches: its force ends at a contraction of 0.42 at the latest, where the fibres are at 54.7°.
const CONTRACTION: f64 = 0.5;

/// Checks a gauge pressure in Pa.
///
/// # Errors
/// [`DataCode::RecordingOutOfRange`] outside the limits.
#[inline]
pub fn pressure(pascals: f64) -> Result<()> {
    if pascals < PRESSURE.0 || pascals > PRESSURE.1 {
        return Err(Error::new(
            DataCode::RecordingOutOfRange,
            "pressure outside the range of pneumatic muscles",
        )
        .column("pressure")
        .value(format!("{} kPa", pascals / 1e3))
        .help("check the unit in the column's name; gauge pressure is never below -101 kPa"));
    }
    Ok(())
}

/// Checks a force in N.
///
/// # Errors
/// [`DataCode::RecordingOutOfRange`] outside the limits.
#[inline]
pub fn force(newtons: f64) -> Result<()> {
    if newtons.abs() > FORCE {
        return Err(Error::new(DataCode::RecordingOutOfRange, "force outside the range of pneumatic muscles")
            .column("force")
            .value(format!("{newtons:e} N"))
            .help("check the unit in the column's name; convert counts of an analog-to-digital converter with scale in an import description"));
    }
    Ok(())
}

/// The range of contractions of a braid, from straight fibres to beyond what any braid reaches.
///
/// ```
/// use pam_data::physical_limits::Contractions;
/// use model_core::braid::miniature;
///
/// // Fibres of 1.0247 L0: it stretches by 2.5 % at most.
/// let can = Contractions::of(&miniature().build()?);
/// assert!(can.check(0.08).is_ok() && can.check(-0.02).is_ok());
/// let error = can.check(-0.03).unwrap_err();
/// assert!(error.to_string().contains("a contraction of -0.030 is outside the range of this braid"));
/// assert!(can.check(0.9).is_err());
/// # Ok::<(), model_core::braid::GeometryError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contractions {
    taut: f64,
}

impl Contractions {
    /// The range of this braid.
    #[must_use]
    pub fn of(braid: &Braid<f64>) -> Self {
        Self { taut: braid.fibre_length() / braid.rest_length() - 1.0 }
    }

    /// Checks a contraction `(L0 − L)/L0`.
    ///
    /// # Errors
    /// [`DataCode::RecordingOutOfRange`] for one outside the range.
    #[inline]
    pub fn check(&self, contraction: f64) -> Result<()> {
        if contraction > CONTRACTION || contraction < -self.taut {
            return Err(Error::new(
                DataCode::RecordingOutOfRange,
                format!("a contraction of {contraction:.3} is outside the range of this braid"),
            )
            .help(format!(
                "contraction is (L0 − L)/L0, from {:.3} (fibres straight) to about 0.4: check the rest length, the sign of the displacement \
                 (positive = \"extension\" in an import description inverts it) and its zero",
                -self.taut
            )));
        }
        Ok(())
    }
}
