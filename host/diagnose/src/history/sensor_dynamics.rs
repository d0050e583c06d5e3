//! Sensors with dynamics, at settled points: readings that come late.
//!
//! | effect | shift of pressure |
//! | --- | --- |
//! | a pressure sensor of first order, time constant `τ` | `τ dP/dt` |
//! | a force that is read late by `δ` | `−δ dP/dt` |
//! | a filter in the force channel, part `κ`, time constant `τ` | `κ (LP_τ(P) − P)` |

use pam_fit::bench::{BenchName, Candidate};

use super::additional_effect::Column;
use super::campaign::Points;
use super::criteria::FILTER_TIMES;

/// All of them; none of points that were recorded as such, which do not show a rate.
pub(super) fn columns(points: &Points) -> Vec<Column> {
    if !points.averaged {
        return Vec::new();
    }
    let ramp = |effect: BenchName, sign: f64| Column {
        effect: Candidate::Bench(effect),
        amplitude: 0,
        shape: None,
        shift: points.rate.iter().map(|rate| sign * rate).collect(),
    };
    let filter = |(f, time): (usize, &f64)| Column {
        effect: Candidate::Bench(BenchName::SensorDelay),
        amplitude: 1,
        shape: Some(*time),
        shift: points.filtered.iter().map(|filtered| filtered[f]).collect(),
    };
    let ramps = [ramp(BenchName::PressureSensorLag, 1.0), ramp(BenchName::SensorDelay, -1.0)];
    ramps.into_iter().chain(FILTER_TIMES.iter().enumerate().map(filter)).collect()
}
