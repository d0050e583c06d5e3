//! Each held mounting predicted without its own recordings, and which number of its own it needs then.
//!
//! The joint fit is made without the mounting; muscle, surface and laws come from all others. One number is fitted to the filling half of the mounting
//! and tried on the emptying half, and conversely, so that a number without meaning gains nothing. Unit of uncertainty: mounting.

use rayon::prelude::*;

use super::between::Stock;
use super::cells::Cell;
use super::criteria::{NUMBER_STEPS, SLOPE_STEP};
use super::mixed_model::fit;
use super::{Place, StockFit};
use crate::bench::BenchName;

/// What a mounting may have of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MountingCause {
    /// By how much the muscle is shorter than was read: m.
    Length,
    /// The load cell's zero: N.
    ForceZero,
    /// The pressure sensor's zero: Pa.
    GaugeZero,
    /// The load cell's scale: a share.
    ForceScale,
}

impl MountingCause {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Length, Self::ForceZero, Self::GaugeZero, Self::ForceScale];

    /// The effect of the catalogue.
    #[must_use]
    pub fn effect(self) -> BenchName {
        match self {
            Self::Length => BenchName::DisplacementOffset,
            Self::ForceZero => BenchName::ForceOffset,
            Self::GaugeZero => BenchName::GaugeOffset,
            Self::ForceScale => BenchName::ForceGain,
        }
    }

    /// Step for the slope of the force by the number.
    fn step(self) -> f64 {
        match self {
            Self::Length => SLOPE_STEP,
            Self::ForceZero => 1.0,
            Self::GaugeZero => 1e3,
            Self::ForceScale => 1e-2,
        }
    }

    /// Force at a place where the mounting has this number of its own, N.
    fn force(self, fit: &StockFit, at: &Place, number: f64) -> f64 {
        match self {
            Self::Length => fit.force(&Place { stroke: at.stroke + number, ..*at }),
            Self::ForceZero => fit.force(at) + number,
            Self::GaugeZero => fit.force(&Place { pressure: at.pressure + number, ..*at }),
            Self::ForceScale => fit.force(at) * (1.0 + number),
        }
    }
}

/// A mounting that was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct UnseenMounting {
    /// Number of the muscle.
    pub member: usize,
    /// Number of the mounting.
    pub mounting: usize,
    /// Mean square of the errors, N².
    pub square: f64,
    /// The same with each number of [`MountingCause::ALL`], fitted to the other direction.
    pub with: [f64; 4],
    /// Each number fitted to both directions.
    pub number: [f64; 4],
}

/// Every held mounting of a muscle with several, left out in turn. Those recorded in one direction only are not predicted.
#[must_use]
pub fn unseen_mountings(stock: &Stock) -> Vec<UnseenMounting> {
    let muscles = 0..stock.cells.mountings.len();
    let held = |m: usize| stock.cells.held_mountings(m).into_iter().map(move |k| (m, k));
    let all: Vec<(usize, usize)> = muscles.flat_map(held).collect();
    all.into_par_iter().filter_map(|(m, k)| unseen(stock, m, k)).collect()
}

fn unseen(stock: &Stock, member: usize, mounting: usize) -> Option<UnseenMounting> {
    let cells = &stock.cells;
    let is_it = |c: &Cell| c.member == member && c.mounting == mounting;
    let halves = [1.0, -1.0].map(|direction| {
        let own = cells.list.iter().filter(|c| is_it(c) && c.direction == direction);
        own.map(|c| (Place { member: Some(member), ..Place::of(cells, c) }, c.force)).collect::<Vec<_>>()
    });
    if halves.iter().any(Vec::is_empty) {
        return None;
    }
    let fit = fit(&cells.only(|c| !is_it(c)), &stock.laws, Some(&stock.fit))?;
    let square = |half: &[(Place, f64)], cause: MountingCause, number: f64| {
        half.iter().map(|(at, force)| (force - cause.force(&fit, at, number)).powi(2)).sum::<f64>()
            / half.len() as f64
    };
    let both: Vec<(Place, f64)> = halves.iter().flatten().copied().collect();
    let crossed = |cause: MountingCause| {
        let from =
            |one: usize, other: usize| square(&halves[other], cause, number(&fit, cause, &halves[one]));
        0.5 * (from(0, 1) + from(1, 0))
    };
    Some(UnseenMounting {
        member,
        mounting,
        square: 0.5 * halves.iter().map(|half| square(half, MountingCause::ForceZero, 0.0)).sum::<f64>(),
        with: MountingCause::ALL.map(crossed),
        number: MountingCause::ALL.map(|cause| number(&fit, cause, &both)),
    })
}

/// The number by least squares.
fn number(fit: &StockFit, cause: MountingCause, half: &[(Place, f64)]) -> f64 {
    let mut number = 0.0;
    for _ in 0..NUMBER_STEPS {
        let (mut along, mut square) = (0.0, 0.0);
        for (at, force) in half {
            let here = |by: f64| cause.force(fit, at, number + by);
            let slope = (here(cause.step()) - here(-cause.step())) / (2.0 * cause.step());
            along += slope * (force - here(0.0));
            square += slope * slope;
        }
        if !(square > 0.0) {
            return 0.0;
        }
        number += along / square;
    }
    number
}
