//! Published force formulas of commercial muscles, for comparison.

use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;

/// A published force formula for Festo fluidic muscles (Bolen, Elzein, Pang, Hunt, "Isometric Force Characterization of
/// Braided Pneumatic Actuators", MDPI Actuators, manuscript 4207821):
///
/// ```text
/// F / F620 = c0 (exp(−c1 e*) − 1) + P* exp(−c2 e*²)      e* = e/e620,  P* = P/620 kPa
/// F620     = a atan(b (L0 − l))                          L0 in m
/// ```
///
/// It has no hysteresis. `e620` is the muscle's own largest contraction at 620 kPa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    name: &'static str,
    c: [f64; 3],
    blocked: [f64; 3],
}

/// All formulas.
const ALL: [Published; 2] = [
    Published { name: "bolen-10mm", c: [0.5682, 4.254, 0.5597], blocked: [303.5, 19.03, 0.0075] },
    Published { name: "bolen-20mm", c: [0.2579, 6.477, 1.321], blocked: [922.4, 15.37, 0.013] },
];

impl Published {
    /// The formula of this name.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`], listing the names.
    pub fn by_name(name: &str) -> Result<Self> {
        ALL.into_iter().find(|p| p.name == name).ok_or_else(|| {
            let known: Vec<&str> = ALL.iter().map(|p| p.name).collect();
            Error::new(DataCode::CallInvalid, "unknown published formula")
                .value(name)
                .help(format!("choose one of {}", known.join(", ")))
        })
    }

    /// The force at a pressure (Pa) and a contraction, N; not below zero.
    #[must_use]
    pub fn force(&self, muscle: &MuscleDescription, pressure: f64, contraction: f64) -> f64 {
        let largest = muscle.max_contraction.unwrap_or(0.17);
        let (e, p) = (contraction / largest, pressure / 620e3);
        let [c0, c1, c2] = self.c;
        let [a, b, l] = self.blocked;
        let blocked = a * (b * (muscle.rest_length() - l)).atan();
        (blocked * (c0 * ((-c1 * e).exp() - 1.0) + p * (-c2 * e * e).exp())).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_and_620_kpa_it_is_the_published_blocked_force() {
        let muscle = MuscleDescription::parse(
            "name=\"m\"\nkind=\"contractile\"\nrest_length_mm=281.0\nbraid_angle_deg=61.4\n\
             bladder_outer_diameter_mm=10.0\nbladder_wall_mm=1.8\nmax_contraction=0.174\n",
        )
        .expect("valid");
        let formula = Published::by_name("bolen-10mm").expect("known");
        // 303.5 · atan(19.03 · 0.2735) = 303.5 · 1.38098
        assert!((formula.force(&muscle, 620e3, 0.0) - 419.13).abs() < 0.1);
        assert!(formula.force(&muscle, 620e3, 0.174) < 30.0);
        assert_eq!(Published::by_name("x").expect_err("unknown").exit_status(), 2);
    }
}
