//! What a closed valve says of a leak.

use super::super::criteria::judgement::CHECKED_PROBABILITY;
use super::super::rows::Rows;
use super::super::verdict::{Diagnosis, Missing, Remark, Why};
use super::{Finding, excluded, name_without_evidence};
use pam_fit::bench::Candidate as Law;
use pam_fit::checks::Loss;

/// A loss of air behind a closed valve, and how large it is in these recordings.
pub(super) struct Leak {
    loss: Loss,
    /// The largest force that the leak takes at any row, N: at the least, and at the most.
    at_least: f64,
    at_most: f64,
    /// It is present where it matters with any line.
    pub(super) finding: Finding,
}

impl Leak {
    /// Compares the loss with the recordings.
    pub(super) fn of(loss: &Loss, rows: &Rows, material: impl Fn(f64) -> bool) -> Self {
        let (least, most) = loss.lost_part();
        let pull =
            rows.contexts().iter().map(|c| (c.pull_per_pressure() * c.pressure).abs()).fold(0.0, f64::max);
        let finding = if !material(most * pull) {
            Finding::Absent
        } else if material(least * pull) {
            Finding::Present
        } else {
            Finding::Possible
        };
        Self { loss: loss.clone(), at_least: least * pull, at_most: most * pull, finding }
    }

    /// Enters what the closed valve showed into an answer of the recordings. A leak that matters is named also where the recordings do not
    /// determine its size: then it has no parameters, and stays out of the table.
    pub(super) fn enter(&self, diagnosis: &mut Diagnosis, given: &[Law]) {
        let Some(leak) = Law::all().find(|c| c.traits().loses_air) else { return };
        let (check, value) = (Loss::CHECK.to_string(), self.loss.description());
        let info = leak.info();
        let named = diagnosis.missing.iter().any(|m| m.effect == info.name);
        match self.finding {
            Finding::Absent if !given.contains(&leak) => {
                diagnosis.considered.push(excluded(info, (check, value), self.at_most));
            }
            Finding::Present if diagnosis.judged() && !named => {
                let leak = Missing {
                    checked: true,
                    peak_N: self.at_least,
                    p: (self.loss.half_width / self.loss.rate).powi(2).min(1.0),
                    ..Missing::of(info, CHECKED_PROBABILITY, Why::Measured { check, value })
                };
                name_without_evidence(diagnosis, leak);
            }
            _ => diagnosis.remarks.push(Remark::Measured { check, value }),
        }
    }
}
