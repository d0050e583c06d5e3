//! Which parameters the recordings determine: correlations, and the reason why a parameter is not identifiable.

use pam_data::statistics::NORMAL_95;
use std::fmt;

use serde::Serialize;

use super::solution::Solution;
use super::uncertainty::table_root;
use crate::numerics::covariance_root::CovarianceRoot;

/// Correlations of the parameters of a table at one pressure.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)] // Units are spelled as units are.
pub struct Correlations {
    /// The pressure, kPa.
    pub pressure_kPa: f64,
    /// `P0`, `E_1` … `E_M`, and `k_F` where friction was fitted.
    pub names: Vec<String>,
    /// Row after row; `None` for a parameter whose standard deviation is zero.
    pub matrix: Vec<Vec<Option<f64>>>,
}

impl Correlations {
    /// At a pressure in Pa. `root` is that of the fit's parameters.
    #[must_use]
    pub fn at(solution: &Solution, root: &CovarianceRoot, pressure: f64) -> Self {
        let root = table_root(solution, root, &[pressure]);
        let order = solution.problem.design.layout().order;
        let mut names = vec![DEADBAND.to_owned()];
        names.extend((1..=order).map(|k| format!("E_{k}")));
        if solution.problem.design.friction {
            names.push("k_F".to_owned());
        }
        let n = names.len();
        let matrix = (0..n).map(|i| (0..n).map(|j| root.correlation(i, j)).collect()).collect();
        Self { pressure_kPa: pressure / 1e3, names, matrix }
    }

    /// The parameter with the largest correlation with parameter `i`, and that correlation.
    fn partner(&self, i: usize) -> Option<(&str, f64)> {
        let others = self.matrix[i].iter().enumerate().filter(|(j, _)| *j != i);
        others
            .filter_map(|(j, c)| Some((self.names[j].as_str(), (*c)?)))
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }
}

/// A parameter that is not identifiable: its 95 % confidence interval contains zero, or another parameter takes its place.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct NotDetermined {
    /// The name of the parameter: `P0`, `E_3`, `k_F`, …
    pub parameter: String,
    /// The pressures at which it is not identifiable, kPa.
    pub pressures_kPa: Vec<f64>,
    /// Whether that is every tested pressure.
    pub everywhere: bool,
    /// Description of the reason.
    pub reason: String,
}

impl fmt::Display for NotDetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // One deadband holds for all pressures.
        if self.parameter == DEADBAND {
            return write!(f, "{}: {}", self.parameter, self.reason);
        }
        write!(f, "{} at ", self.parameter)?;
        if self.everywhere {
            f.write_str("every pressure")?;
        } else {
            let list: Vec<String> = self.pressures_kPa.iter().map(|p| format!("{p:.0}")).collect();
            write!(f, "{} kPa", list.join(", "))?;
        }
        write!(f, ": {}", self.reason)
    }
}

/// Of two parameters correlated beyond this, less than a fifth of the variance is their own (1 − 0.9² = 0.19).
const CORRELATED: f64 = 0.9;

/// The deadband, where one pressure or one length was recorded: a stress of the bladder in place of it gives the same force there, and
/// its interval would hold for the form of the elasticity alone.
fn deadband(solution: &Solution) -> Option<NotDetermined> {
    let levels = &solution.problem.pressures.levels;
    let (one, more) = if levels.len() == 1 {
        ("pressure", "more pressures")
    } else if solution.problem.design.orthonormal.rank <= 1 {
        ("length", "slow strokes or more lengths")
    } else {
        return None;
    };
    Some(NotDetermined {
        parameter: DEADBAND.to_owned(),
        pressures_kPa: levels.iter().map(|p| p / 1e3).collect(),
        everywhere: true,
        reason: format!("with one {one} it cannot be separated from the elasticity; record {more}"),
    })
}

/// The name of the deadband pressure among the parameters.
pub(crate) const DEADBAND: &str = "P0";

/// `P0` without a second pressure or length, and every `E_k` and `k_F` whose 95 % interval contains zero, with the reason.
#[must_use]
pub(crate) fn not_determined(solution: &Solution, root: &CovarianceRoot) -> Vec<NotDetermined> {
    let levels = &solution.problem.pressures.levels;
    let table = table_root(solution, root, levels);
    let at: Vec<Correlations> = levels.iter().map(|p| Correlations::at(solution, root, *p)).collect();
    let order = solution.problem.design.layout().order;
    let values: Vec<Vec<f64>> = levels
        .iter()
        .map(|p| {
            let (mut moduli, friction) = solution.curves_at(*p);
            moduli.push(friction);
            moduli
        })
        .collect();
    // Only who moves the muscle can record a longer stroke.
    let held = !solution.problem.points.held_lengths().is_empty();
    let more = if held { "more lengths" } else { "a longer stroke" };
    let contraction = 100.0 * solution.problem.points.stroke.span() / solution.problem.braid.rest_length();
    let kinds = order + usize::from(solution.problem.design.friction);
    let mut all: Vec<NotDetermined> = deadband(solution).into_iter().collect();
    for k in 0..kinds {
        let loose: Vec<usize> = (0..levels.len())
            .filter(|i| !(values[*i][k].abs() > NORMAL_95 * table.std(1 + k * levels.len() + i)))
            .collect();
        let Some(first) = loose.first() else { continue };
        // Of the pressures the one with the largest correlation is reported.
        let partner =
            loose.iter().filter_map(|i| at[*i].partner(1 + k)).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let dropped = k < order && k >= solution.problem.design.orthonormal.rank;
        let reason = match partner {
            _ if dropped => "too few different lengths; it is set to zero".to_owned(),
            Some((name, c)) if c.abs() > CORRELATED && k < order => format!(
                "over a contraction of {contraction:.1} % it is correlated with {name} ({c:.3}); record {more} or use a lower order"
            ),
            _ if k == order => "the hysteresis loop is no wider than the noise".to_owned(),
            _ => format!(
                "over a contraction of {contraction:.1} % its effect on the force is below the uncertainty"
            ),
        };
        all.push(NotDetermined {
            parameter: at[*first].names[1 + k].clone(),
            pressures_kPa: loose.iter().map(|i| levels[*i] / 1e3).collect(),
            everywhere: loose.len() == levels.len(),
            reason,
        });
    }
    all
}
