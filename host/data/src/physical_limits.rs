//! What a pneumatic muscle can do at all: beyond it a reading is a wrong unit, sign or zero, and the model's equations go on giving
//! numbers that mean nothing.

use model_core::braid::Braid;

use crate::error::{DataCode, Error, Result};

/// Gauge pressures, Pa: not below vacuum, with a margin for a sensor's zero.
const PRESSURE: (f64, f64) = (-120e3, 1e8);

/// The largest force, N: a thousand times what the strongest muscles on the market pull.
const FORCE: f64 = 1e7;

/// Contraction that no braid reaches: pressure stops pulling at 0.42 at the latest, where the fibres lie at 54.7°.
const CONTRACTION: f64 = 0.5;

/// A gauge pressure in Pa.
///
/// # Errors
/// [`DataCode::RecordingOutOfRange`] for one that no pneumatic muscle has.
#[inline]
pub fn pressure(pascals: f64) -> Result<()> {
    if pascals < PRESSURE.0 || pascals > PRESSURE.1 {
        return Err(Error::new(DataCode::RecordingOutOfRange, "no pressure of a pneumatic muscle")
            .column("pressure")
            .value(format!("{} kPa", pascals / 1e3))
            .help("check the unit in the column's name; gauge pressure is never below -101 kPa"));
    }
    Ok(())
}

/// A force in N.
///
/// # Errors
/// [`DataCode::RecordingOutOfRange`] for one that no pneumatic muscle has.
#[inline]
pub fn force(newtons: f64) -> Result<()> {
    if newtons.abs() > FORCE {
        return Err(Error::new(DataCode::RecordingOutOfRange, "no force of a pneumatic muscle")
            .column("force")
            .value(format!("{newtons:e} N"))
            .help("check the unit in the column's name; counts of a converter come in by a scale in the import description"));
    }
    Ok(())
}

/// The contractions that a braid can make: from its fibres pulled straight to more than any braid contracts.
///
/// ```
/// use pam_data::physical_limits::Contractions;
/// use model_core::braid::miniature;
///
/// // Fibres of 1.0247 L0: it stretches by 2.5 % at most.
/// let can = Contractions::of(&miniature().build()?);
/// assert!(can.check(0.08).is_ok() && can.check(-0.02).is_ok());
/// let error = can.check(-0.03).unwrap_err();
/// assert!(error.to_string().contains("a contraction of -0.030, which this braid cannot have"));
/// assert!(can.check(0.9).is_err());
/// # Ok::<(), model_core::braid::GeometryError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contractions {
    taut: f64,
}

impl Contractions {
    /// Of a braid.
    #[must_use]
    pub fn of(braid: &Braid<f64>) -> Self {
        Self { taut: braid.fibre_length() / braid.rest_length() - 1.0 }
    }

    /// A contraction `(L0 − L)/L0`.
    ///
    /// # Errors
    /// [`DataCode::RecordingOutOfRange`] for one that this braid cannot have.
    #[inline]
    pub fn check(&self, contraction: f64) -> Result<()> {
        if contraction > CONTRACTION || contraction < -self.taut {
            return Err(Error::new(
                DataCode::RecordingOutOfRange,
                format!("a contraction of {contraction:.3}, which this braid cannot have"),
            )
            .help(format!(
                "contraction is (L0 − L)/L0 and lies between {:.3} (braid pulled straight) and about 0.4: check the rest length, \
                 the sign of the displacement (positive = \"extension\" in an import description turns it round) and its zero",
                -self.taut
            )));
        }
        Ok(())
    }
}
