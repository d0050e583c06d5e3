//! Quantities of strokes at regulated pressures, read from the recordings without any model.

use std::collections::BTreeMap;

use pam_data::error::Result;

use super::series::{Kind, Point, Quantity, Series};
use super::{Visit, of_campaign};
use crate::reference::strokes::{Band, Key, bands, ends, levels};

/// All quantities.
///
/// # Errors
/// A recording without force.
pub(super) fn series(visits: &[Visit], reference: usize) -> Result<Vec<Series>> {
    let campaigns: Vec<_> = visits.iter().map(|v| &v.campaign).collect();
    let levels = levels(&campaigns);
    let ends = ends(&visits[reference].campaign);
    let all = visits
        .iter()
        .map(|v| bands(&v.campaign, &levels, ends).map_err(|e| of_campaign(v, e)))
        .collect::<Result<Vec<_>>>()?;
    let common: Vec<Key> =
        all[reference].keys().filter(|k| all.iter().all(|b| b.contains_key(k))).copied().collect();
    let Some(top) = common.iter().map(|k| k.0).max() else { return Ok(Vec::new()) };
    let each = |of: &dyn Fn(&BTreeMap<Key, Band>) -> Option<Point>| all.iter().map(of).collect::<Vec<_>>();
    let mean = |keys: &[Key], bands: &BTreeMap<Key, Band>, of: &dyn Fn(&Band) -> f64| {
        let own: Vec<&Band> = keys.iter().filter_map(|k| bands.get(k)).collect();
        let n = own.len() as f64;
        let error = own.iter().map(|b| b.error * b.error).sum::<f64>().sqrt() / n;
        (n > 0.0).then(|| Point::new(own.iter().map(|b| of(b)).sum::<f64>() / n, Some(error)))
    };
    let at_top: Vec<Key> = common.iter().filter(|k| k.0 == top).copied().collect();
    let mut series = vec![
        Series::of(Quantity::LargestForce, Kind::Measured, "N", each(&|b| mean(&at_top, b, &|x| x.middle))),
        Series::of(Quantity::Hysteresis, Kind::Measured, "N", each(&|b| mean(&common, b, &|x| x.half))),
    ];
    if common.iter().any(|k| k.0 != top) {
        let line = |b: &BTreeMap<Key, Band>| Line::through(&common, b);
        let area = each(&|b| line(b).map(|l| Point::new(l.slope, Some(l.slope_error))));
        let zero = each(&|b| line(b).map(|l| Point::new(l.zero, Some(l.zero_error))));
        series.push(Series::of(Quantity::Area, Kind::Measured, "m²", area));
        series.push(Series::of(Quantity::Threshold, Kind::Measured, "Pa", zero));
    }
    Ok(series)
}

/// Force over pressure, a line through the means of the levels.
struct Line {
    slope: f64,
    slope_error: f64,
    /// Pressure without force.
    zero: f64,
    zero_error: f64,
}

impl Line {
    fn through(keys: &[Key], bands: &BTreeMap<Key, Band>) -> Option<Self> {
        let own: Vec<&Band> = keys.iter().filter_map(|k| bands.get(k)).collect();
        let n = own.len() as f64;
        let (mp, mf) = own.iter().fold((0.0, 0.0), |(p, f), b| (p + b.pressure / n, f + b.middle / n));
        let pp: f64 = own.iter().map(|b| (b.pressure - mp).powi(2)).sum();
        let pf: f64 = own.iter().map(|b| (b.pressure - mp) * b.middle).sum();
        let slope = pf / pp;
        if !(pp > 0.0 && slope.is_finite() && slope != 0.0) {
            return None;
        }
        let slope_error = own.iter().map(|b| ((b.pressure - mp) * b.error / pp).powi(2)).sum::<f64>().sqrt();
        let weight = |b: &Band| (1.0 / n - mf * (b.pressure - mp) / pp / slope) / slope;
        let zero_error = own.iter().map(|b| (weight(b) * b.error).powi(2)).sum::<f64>().sqrt();
        Some(Self { slope, slope_error, zero: mp - mf / slope, zero_error })
    }
}
