//! Whether the mounted lengths differ from those that were read.
//!
//! Each held mounting is predicted without its own recordings ([`unseen_mountings`]). The lengths are named where one length for each mounting
//! removes most of the squared error, beyond the scatter between mountings, and no other number does so better. Unit of uncertainty: mounting.

use pam_data::statistics::slope;
use pam_fit::numerics::student::{half_width, half_width_95};
use pam_fit::stock::{MountingCause, Stock, UnseenMounting, Value, unseen_mountings};

use super::Interval;
use crate::criteria::judgement::RELEVANT_SIZE;
use crate::criteria::stock::{FEWEST_MOUNTINGS, GAUGE_ZERO, LENGTH_ALPHA, LENGTH_GAIN, LENGTH_TREND};
use crate::paired::errors_below;

/// Errors of left-out mountings where each has one number of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CauseError {
    /// What the number is.
    pub cause: MountingCause,
    /// Root mean square error, N.
    pub error: f64,
    /// Root mean square of the numbers: m, N, Pa, or a share.
    pub size: f64,
    /// Whether instruments may have numbers of this size.
    pub plausible: bool,
}

/// Why errors of the mounted lengths are not named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LengthsRefusal {
    /// Too few mountings can be predicted from others.
    FewMountings {
        /// How many are needed.
        needed: usize,
    },
    /// Mountings are predicted to within a share of the largest force that does not matter.
    SmallErrors {
        /// The share.
        within: f64,
    },
    /// A length for each mounting explains too little.
    SmallGain {
        /// The share of the squared error that it leaves.
        left: f64,
        /// Standard errors over the mountings by which the error falls.
        t: f64,
        /// How many are needed.
        needed: f64,
    },
    /// Another number predicts the mountings better.
    OtherCause(MountingCause),
    /// The lengths follow the contraction: the muscles differ, in their braid angle for example, and not their mountings.
    FollowContraction,
}

/// Errors of the left-out mountings of one muscle, rms, N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MuscleMountings {
    /// As predicted from all others.
    pub before: f64,
    /// With one length for each mounting.
    pub with_length: f64,
}

/// The held mountings of a stock, each predicted without its own recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct MountedLengths {
    /// How many mountings.
    pub mountings: usize,
    /// Root mean square error, N.
    pub before: f64,
    /// The same with one number for each mounting, by cause.
    pub causes: Vec<CauseError>,
    /// Root mean square of the errors of the lengths, m.
    pub size: Interval,
    /// By how much the lengths lower the error of a mounting, over its standard error.
    pub t: f64,
    /// Effects that predict the mountings as well.
    pub confusable_with: Vec<&'static str>,
    /// Why the lengths are not named; `None` where they are.
    pub why_not: Option<LengthsRefusal>,
    /// By muscle; `None` for one without a mounting that was predicted.
    pub muscles: Vec<Option<MuscleMountings>>,
}

impl MountedLengths {
    /// Whether the lengths are named.
    #[must_use]
    pub fn named(&self) -> bool {
        self.why_not.is_none()
    }

    /// The errors with one number for each mounting.
    #[must_use]
    pub fn with(&self, cause: MountingCause) -> Option<&CauseError> {
        self.causes.iter().find(|c| c.cause == cause)
    }
}

/// The lengths of a stock; `None` where no held mounting can be predicted from others.
pub(super) fn mounted_lengths(fitted: &Stock) -> Option<MountedLengths> {
    let all = unseen_mountings(fitted);
    let count = all.len();
    if count == 0 {
        return None;
    }
    let mean = |of: &dyn Fn(&UnseenMounting) -> f64| all.iter().map(of).sum::<f64>() / count as f64;
    let highest = fitted.cells.list.iter().map(|c| c.pressure).fold(0.0, f64::max);
    let largest: Vec<f64> = (0..fitted.cells.mountings.len()).map(|m| fitted.cells.largest_of(m)).collect();
    let causes: Vec<CauseError> = MountingCause::ALL
        .iter()
        .enumerate()
        .map(|(k, cause)| {
            let size = mean(&|u| u.number[k].powi(2)).sqrt();
            let plausible = *cause != MountingCause::GaugeZero || size <= GAUGE_ZERO * highest;
            CauseError { cause: *cause, error: mean(&|u| u.with[k]).sqrt(), size, plausible }
        })
        .collect();
    let relative = |of: &dyn Fn(&UnseenMounting) -> f64| {
        all.iter().map(|u| of(u).sqrt() / largest[u.member]).collect::<Vec<f64>>()
    };
    let before = relative(&|u| u.square);
    let with: Vec<Vec<f64>> = (0..causes.len()).map(|k| relative(&|u| u.with[k])).collect();
    let with_length = &with[MountingCause::Length as usize];
    let left = sum_of_squares(with_length) / sum_of_squares(&before);
    // In squares one large error would outweigh all others.
    let t = errors_below(with_length, &before);
    let enough = half_width(LENGTH_ALPHA, count as f64 - 1.0);
    let quantile = half_width_95(count.saturating_sub(1));
    let better = |k: usize| errors_below(&with[k], with_length) > quantile;
    let worse = |k: usize| errors_below(with_length, &with[k]) > quantile;
    let others = || (1..causes.len()).filter(|k| causes[*k].plausible);
    let size = causes[MountingCause::Length as usize].size;
    let std = size / (2.0 * count as f64).sqrt();
    let why_not = if count < FEWEST_MOUNTINGS {
        Some(LengthsRefusal::FewMountings { needed: FEWEST_MOUNTINGS })
    } else if !(sum_of_squares(&before) >= count as f64 * RELEVANT_SIZE.powi(2)) {
        Some(LengthsRefusal::SmallErrors { within: RELEVANT_SIZE })
    } else if let Some(k) = others().find(|k| better(*k)) {
        Some(LengthsRefusal::OtherCause(causes[k].cause))
    } else if !(left <= 1.0 - LENGTH_GAIN && t > enough) {
        Some(LengthsRefusal::SmallGain { left, t, needed: enough })
    } else {
        follow_contraction(&all, fitted).then_some(LengthsRefusal::FollowContraction)
    };
    let confusable = others().filter(|k| !worse(*k));
    Some(MountedLengths {
        mountings: count,
        before: mean(&|u| u.square).sqrt(),
        size: Interval::new(Value { value: size, std }, quantile),
        t,
        confusable_with: confusable.map(|k| causes[k].cause.effect().info().name).collect(),
        why_not,
        muscles: (0..fitted.cells.mountings.len()).map(|m| of_muscle(&all, m)).collect(),
        causes,
    })
}

fn sum_of_squares(of: &[f64]) -> f64 {
    of.iter().map(|v| v * v).sum()
}

fn of_muscle(all: &[UnseenMounting], m: usize) -> Option<MuscleMountings> {
    let own: Vec<&UnseenMounting> = all.iter().filter(|u| u.member == m).collect();
    let rms = |of: &dyn Fn(&UnseenMounting) -> f64| {
        (own.iter().map(|u| of(u)).sum::<f64>() / own.len() as f64).sqrt()
    };
    (!own.is_empty()).then(|| MuscleMountings {
        before: rms(&|u| u.square),
        with_length: rms(&|u| u.with[MountingCause::Length as usize]),
    })
}

/// Whether a straight line over the strokes of a muscle's other mountings predicts the lengths better than their mean does.
fn follow_contraction(all: &[UnseenMounting], fitted: &Stock) -> bool {
    let (mut by_mean, mut by_line) = (0.0, 0.0);
    for m in 0..fitted.cells.mountings.len() {
        let own: Vec<(f64, f64)> = all
            .iter()
            .filter(|u| u.member == m)
            .filter_map(|u| {
                Some((
                    fitted.cells.mountings[m][u.mounting].stroke?,
                    u.number[MountingCause::Length as usize],
                ))
            })
            .collect();
        // A line through two others is not a test.
        if own.len() < 4 {
            continue;
        }
        for (k, (stroke, length)) in own.iter().enumerate() {
            let others: Vec<(f64, f64)> =
                own.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, o)| *o).collect();
            let mean = |of: fn(&(f64, f64)) -> f64| others.iter().map(of).sum::<f64>() / others.len() as f64;
            let (x, y) = (mean(|o| o.0), mean(|o| o.1));
            by_mean += (length - y).powi(2);
            by_line += (length - y - slope(&others) * (stroke - x)).powi(2);
        }
    }
    by_line < (1.0 - LENGTH_TREND) * by_mean
}
