//! Between muscles: each predicted from the others by several laws, the law that is taken, and the interval of its parameter over muscles.

use rayon::prelude::*;

use super::cells::{StockCells, stock_cells};
use super::criteria::FEWEST_MUSCLES;
use super::mixed_model::fit;
use super::{Law, Member, Place, StockFit, Value};
use crate::error::FitCode;
use crate::numerics::jackknife::variances;
use pam_data::error::{Error, Result};
use pam_data::pluralise::pluralise;

/// A set of laws, with the error on muscles that were left out.
#[derive(Debug, Clone)]
pub struct LawError {
    /// The laws; none for muscles that differ by chance only.
    pub laws: Vec<Law>,
    /// Root mean square error on the cells of left-out muscles, as a share of the largest force of each.
    pub error: f64,
    /// Estimates, one for each of the laws, with the standard errors of the joint fit.
    pub values: Vec<Value>,
    /// Standard errors by the jackknife over muscles, for comparison: with few muscles, one of which is much shorter than the others, they
    /// overstate the scatter, since the estimate rests on that muscle.
    pub jackknife: Vec<f64>,
}

/// A stock: the joint fit, and what was compared.
#[derive(Debug, Clone)]
pub struct Stock {
    /// The cells.
    pub cells: StockCells,
    /// The joint fit with the laws that were taken.
    pub fit: StockFit,
    /// The laws that were taken; empty where muscles differ by chance only.
    pub laws: Vec<Law>,
    /// All that were tried, without any first.
    pub tried: Vec<LawError>,
}

/// The sets of laws that are compared.
const SETS: [&[Law]; 4] = [&[], &[Law::Ends], &[Law::Taper], &[Law::Compliance]];

/// Fits muscles together.
///
/// # Errors
/// [`FitCode::FitUnderdetermined`] with fewer than three muscles, or recordings that cannot be fitted together; recordings without a force.
pub fn stock(members: &[Member<'_>]) -> Result<Stock> {
    if members.len() < FEWEST_MUSCLES {
        return Err(Error::new(
            FitCode::FitUnderdetermined,
            format!("{} cannot show what a stock has in common", pluralise(members.len(), "muscle")),
        )
        .help("give at least three muscles of one type, better of different lengths"));
    }
    let cells = stock_cells(members)?;
    let unusable = || {
        Error::new(FitCode::FitUnderdetermined, "these muscles cannot be fitted together")
            .help("their pressures and contractions must overlap; check units and rest lengths")
    };
    let tried: Vec<Option<(LawError, StockFit)>> = SETS.par_iter().map(|laws| tried(&cells, laws)).collect();
    let tried: Vec<(LawError, StockFit)> = tried.into_iter().collect::<Option<_>>().ok_or_else(unusable)?;
    let chosen = tried
        .iter()
        .filter(|(t, _)| t.plausible())
        .min_by(|a, b| a.0.error.total_cmp(&b.0.error))
        .or(tried.first())
        .ok_or_else(unusable)?;
    Ok(Stock {
        laws: chosen.0.laws.clone(),
        fit: chosen.1.clone(),
        tried: tried.iter().map(|(t, _)| t.clone()).collect(),
        cells,
    })
}

impl LawError {
    /// Whether the estimates have the sign that the physics allows: ends do not pull more than the middle, and a frame does not push back.
    #[must_use]
    pub fn plausible(&self) -> bool {
        self.values.iter().all(|v| v.value > 0.0)
    }
}

/// One set of laws: the joint fit, and each muscle left out.
fn tried(cells: &StockCells, laws: &[Law]) -> Option<(LawError, StockFit)> {
    let whole = fit(cells, laws, None)?;
    let muscles = cells.rest_length.len();
    let without: Vec<StockFit> = (0..muscles)
        .into_par_iter()
        .map(|m| fit(&cells.only(|c| c.member != m), laws, Some(&whole)))
        .collect::<Option<_>>()?;
    let mut sum = (0.0, 0.0);
    for (m, fit) in without.iter().enumerate() {
        let largest = cells.largest_of(m);
        for cell in cells.list.iter().filter(|c| c.member == m) {
            let model = fit.force(&Place::of(cells, cell));
            sum.0 += ((cell.force - model) / largest).powi(2) / cell.in_half;
            sum.1 += 1.0 / cell.in_half;
        }
    }
    let numbers: Vec<usize> = laws.iter().filter_map(|law| Law::ALL.iter().position(|l| l == law)).collect();
    let values = numbers.iter().map(|k| whole.shared[*k]).collect();
    let left_out: Vec<Vec<f64>> =
        without.iter().map(|f| numbers.iter().map(|k| f.shared[*k].value).collect()).collect();
    let jackknife = variances(&left_out).iter().map(|v| v.sqrt()).collect();
    let error = (sum.0 / f64::max(sum.1, 1.0)).sqrt();
    Some((LawError { laws: laws.to_vec(), error, values, jackknife }, whole))
}

impl Place {
    /// The place of a cell in a muscle that was not fitted.
    pub(super) fn of(cells: &StockCells, cell: &super::Cell) -> Self {
        Self {
            pressure: cell.pressure,
            stroke: cell.stroke,
            rest_length: cells.rest_length[cell.member],
            direction: cell.direction,
            member: None,
            mounting: None,
        }
    }
}
