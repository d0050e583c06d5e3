//! What the recordings determine, and what they do not: correlations, and words with the reason.

use std::fmt;

use serde::Serialize;

use super::prepared::Prepared;
use super::uncertainty::{self, Root};

/// How the numbers of a table at one pressure depend on each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)] // Units are spelled as units are.
pub struct Correlations {
    /// The pressure.
    pub pressure_kPa: f64,
    /// `P0`, `E_1` … `E_M`, and `k_F` where friction was fitted.
    pub names: Vec<String>,
    /// Row after row; empty in a number whose deviation is zero, which depends on nothing.
    pub matrix: Vec<Vec<Option<f64>>>,
}

impl Correlations {
    /// At a pressure in Pa. `root` is that of the fit's parameters.
    #[must_use]
    pub fn at(prepared: &Prepared, root: &Root, pressure: f64) -> Self {
        let root = uncertainty::of_table(prepared, root, &[pressure]);
        let order = prepared.design.layout().order;
        let mut names = vec!["P0".to_owned()];
        names.extend((1..=order).map(|k| format!("E_{k}")));
        if prepared.design.friction {
            names.push("k_F".to_owned());
        }
        let n = names.len();
        let matrix = (0..n).map(|i| (0..n).map(|j| root.correlation(i, j)).collect()).collect();
        Self { pressure_kPa: pressure / 1e3, names, matrix }
    }

    /// The number that number `i` depends on most, and how.
    fn partner(&self, i: usize) -> Option<(&str, f64)> {
        let others = self.matrix[i].iter().enumerate().filter(|(j, _)| *j != i);
        others
            .filter_map(|(j, c)| Some((self.names[j].as_str(), (*c)?)))
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }
}

/// A number that the recordings leave open: its 95 % interval holds zero.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct NotDetermined {
    /// `E_3`, `k_F`, …
    pub parameter: String,
    /// Where.
    pub pressures_kPa: Vec<f64>,
    /// Whether that is every tested pressure.
    pub everywhere: bool,
    /// Why.
    pub reason: String,
}

impl fmt::Display for NotDetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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

/// Two numbers correlated beyond this are told apart by a fifth of their deviations only.
const TRADED: f64 = 0.9;

/// Every `E_k` and `k_F` whose 95 % interval holds zero, with the reason.
#[must_use]
pub fn not_determined(prepared: &Prepared, root: &Root) -> Vec<NotDetermined> {
    let levels = &prepared.pressures.levels;
    let table = uncertainty::of_table(prepared, root, levels);
    let at: Vec<Correlations> = levels.iter().map(|p| Correlations::at(prepared, root, *p)).collect();
    let order = prepared.design.layout().order;
    let values: Vec<Vec<f64>> = levels
        .iter()
        .map(|p| {
            let (mut moduli, friction) = prepared.curves_at(*p);
            moduli.push(friction);
            moduli
        })
        .collect();
    let contraction = 100.0 * prepared.points.stroke.span() / prepared.braid.rest_length();
    let kinds = order + usize::from(prepared.design.friction);
    let mut all = Vec::new();
    for k in 0..kinds {
        let loose: Vec<usize> = (0..levels.len())
            .filter(|i| !(values[*i][k].abs() > 1.96 * table.std(1 + k * levels.len() + i)))
            .collect();
        let Some(first) = loose.first() else { continue };
        // The partner is told for the pressure at which it is closest.
        let partner =
            loose.iter().filter_map(|i| at[*i].partner(1 + k)).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let dropped = k < order && k >= prepared.design.orthonormal.rank;
        let reason = match partner {
            _ if dropped => "too few different strokes; it is set to zero".to_owned(),
            Some((name, c)) if c.abs() > TRADED && k < order => format!(
                "over a contraction of {contraction:.1} % an error in it is made good by {name} (correlation {c:.3}); a longer \
                 stroke or a lower order would determine it"
            ),
            _ if k == order => "the loop is no wider than the noise".to_owned(),
            _ => format!(
                "over a contraction of {contraction:.1} % it moves the force by less than its uncertainty"
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
