//! Quantities of a table fitted to each campaign.

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};
use pam_data::muscle_description::MuscleDescription;
use pam_fit::confidence_band::ConfidenceBand;
use pam_fit::table_file::{About, TableFile};
use pam_fit::{Fit, Options, fit};

use super::Visit;
use super::series::{Kind, Point, Quantity, Series};

/// All quantities; campaigns that cannot be fitted are entered into `left_out`.
pub(super) fn series(
    visits: &[Visit],
    muscle: &MuscleDescription,
    left_out: &mut Vec<(usize, String)>,
) -> Vec<Series> {
    let mut fits = Vec::new();
    for (i, visit) in visits.iter().enumerate() {
        match fit(&visit.campaign, muscle, &Options::default()) {
            Ok(fitted) => fits.push(Some(fitted)),
            Err(e) => {
                left_out.push((i, e.cause().to_owned()));
                fits.push(None);
            }
        }
    }
    let some = || fits.iter().flatten();
    let pressure = some().map(|f| f.table.tested.pressure_high.pascals()).fold(f32::INFINITY, f32::min);
    let stroke = some()
        .map(|f| f.table.tested.contraction_high * f.table.geometry.rest_length.metres())
        .fold(f32::INFINITY, f32::min);
    let (pressure, stroke) = (f64::from(pressure), f64::from(stroke));
    let each =
        |of: &dyn Fn(&Fit) -> Option<Point>| fits.iter().map(|f| f.as_ref().and_then(of)).collect::<Vec<_>>();
    let fitted = |quantity, unit, points| Series::of(quantity, Kind::Fitted, unit, points);
    vec![
        fitted(
            Quantity::Deadband,
            "Pa",
            each(&|f| Some(Point::new(1e3 * f.summary.deadband_kPa, Some(1e3 * f.summary.deadband_std_kPa)))),
        ),
        fitted(Quantity::FrictionFactor, "", each(&friction)),
        fitted(Quantity::BlockedForce, "N", each(&|f| force(f, pressure, 0.0))),
        fitted(Quantity::MiddleForce, "N", each(&|f| force(f, pressure, stroke / 2.0))),
    ]
}

/// Mean of `k_F` over the tested pressures. Its errors at different pressures have much in common: its error is estimated by their mean.
fn friction(fit: &Fit) -> Option<Point> {
    let all = &fit.summary.pressures;
    let n = all.len() as f64;
    let mean = |of: &dyn Fn(&pam_fit::AtPressure) -> f64| all.iter().map(of).sum::<f64>() / n;
    (n > 0.0).then(|| Point::new(mean(&|p| p.k_F), Some(mean(&|p| p.k_F_std))))
}

/// Friction-free force of the table.
fn force(fit: &Fit, pressure: f64, stroke: f64) -> Option<Point> {
    let muscle = Muscle::<f64>::build(&fit.table).ok()?;
    let value = muscle.force(Pressure::from_pascals(pressure), Length::from_metres(stroke), 0.0).newtons();
    let about = About { uncertainty: Some(fit.stored_uncertainty()), ..About::default() };
    let band = ConfidenceBand::of(&TableFile { table: fit.table.clone(), about });
    Some(Point::new(value, band.map(|b| b.std(pressure, stroke, 0.0))))
}
