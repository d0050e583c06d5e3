//! First runs of the mountings where they alone differ, and no memory explains it: the search runs on the other runs.
//!
//! A muscle that runs in after each mounting differs in its first run. A static model cannot follow this, and an effect that is fitted to
//! all runs would be bent towards it.

use std::borrow::Cow;

use model_core::braid::Geometry;
use model_core::effects::{EffectName, Info, Link};
use pam_data::error::Result;
use pam_data::recording::Campaign;
use pam_fit::bench::Candidate;

use super::campaign::Points;
use super::criteria::{FIRST_RUN_APART, FIRST_RUN_WAYS};
use super::findings::{self, Contrast, Visits};
use super::places::RUN_IN_MOUNTING;
use crate::criteria::judgement::PARTLY_EXPLAINED;
use crate::diagnosis::diagnose as statically;
use crate::options::Options;
use crate::remark::Remark;
use crate::verdict::{Diagnosis, Missing, Outcome, Pattern, Region, Verdict};

/// First runs that differ from those that follow.
#[derive(Clone, Debug)]
pub(super) struct FirstRuns {
    /// Probability of such differences by chance.
    chance: f64,
    /// Whether later runs exclude a change that continues.
    once: bool,
}

impl FirstRuns {
    /// The first runs of a campaign where their filling differs from the second by more than later ones differ from each other. Chance must
    /// be improbable by rank, or because the difference is the same at all lengths; with two runs at each length, the last alone counts.
    pub(super) fn of(points: &Points, visits: &Visits) -> Option<Self> {
        let several = || points.mountings.iter().map(|m| &m.runs[..]).filter(|runs| runs.len() > 1);
        let between = |run: &[usize]| Some(visits.filled(run[1], run[0])).filter(|d| d.is_finite());
        let first: Vec<f64> = several().filter_map(|runs| between(&runs[..2])).collect();
        let later: Vec<f64> = several().flat_map(|runs| runs[1..].windows(2).filter_map(between)).collect();
        let once = !later.is_empty();
        let constant = Contrast::of(&first).filter(|c| c.half.is_some_and(|half| c.mean.abs() > half));
        let constant = constant.map(|c| c.chance());
        let chance = if once {
            let least = first.iter().map(|d| d.abs()).fold(f64::INFINITY, f64::min);
            let above = later.iter().all(|d| d.abs() < least);
            let apart = root_mean_square(&first) >= FIRST_RUN_APART * root_mean_square(&later);
            let ways = findings::ways(first.len(), later.len());
            let by_rank = (ways >= FIRST_RUN_WAYS).then(|| 1.0 / ways);
            constant.into_iter().chain(by_rank).reduce(f64::min).filter(|_| above && apart)?
        } else {
            constant?
        };
        Some(Self { chance, once })
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The answer of all runs but the first of each mounting, as one about all of them; `None` where they do not differ, where an effect may
/// be the cause, or where leaving them out removes less than a part of the error. `all` is the answer of all runs.
///
/// # Errors
/// A recording without force.
pub(super) fn answer_without(
    all: &Diagnosis,
    campaign: &Campaign,
    first_runs: Option<&FirstRuns>,
    geometry: &Geometry,
    options: &Options,
) -> Result<Option<Diagnosis>> {
    let Some(FirstRuns { chance, once }) = first_runs else { return Ok(None) };
    let settled = !all.judged() || all.verdict() == Verdict::Consistent;
    let is_cause = |m: &Missing| !once || may_differ_in_first_runs(&m.effect);
    if settled || all.missing.iter().any(is_cause) {
        return Ok(None);
    }
    let others = others(campaign);
    let mut answer = statically(&others, geometry, options)?;
    if !answer.judged() {
        return Ok(None);
    }
    let rows = 1.0 - answer.samples as f64 / all.samples.max(1) as f64;
    let removed = removed(all, &answer);
    if removed < PARTLY_EXPLAINED {
        return Ok(None);
    }
    let region = Region {
        coordinate: RUN_IN_MOUNTING.into(),
        from: 1.0,
        to: 1.0,
        share: 1.0 - (1.0 - rows) * (1.0 - removed),
        rows,
        p: *chance,
        unit: String::new(),
        recordings: Vec::new(),
    };
    let remark = Remark::FirstRuns {
        left_out: campaign.recordings.len() - others.recordings.len(),
        of: campaign.recordings.len(),
        others_agree: answer.verdict() == Verdict::Consistent,
    };
    enter(&mut answer, all, region);
    answer.remarks.insert(0, remark);
    Ok(Some(answer))
}

/// The share of the mean squared error above the noise that other runs do not have.
fn removed(all: &Diagnosis, others: &Diagnosis) -> f64 {
    let excess = |d: &Diagnosis| (d.misfit_rms_N.powi(2) - others.noise_N.powi(2)).max(0.0);
    1.0 - excess(others) / excess(all).max(f64::MIN_POSITIVE)
}

/// Whether an effect can make the first run of a mounting differ from those that follow.
fn may_differ_in_first_runs(effect: &str) -> bool {
    Candidate::from_name(effect).is_some_and(|c| {
        let Info { link, persistent, .. } = c.info();
        *link == Link::Memory || *persistent || c == Candidate::Muscle(EffectName::BreakawayFriction)
    })
}

/// Makes the answer of the other runs one about all of them. The error in the first runs has a place and no name.
fn enter(answer: &mut Diagnosis, all: &Diagnosis, region: Region) {
    let others = 1.0 - region.share;
    for m in &mut answer.missing {
        m.share_explained *= others;
    }
    for u in &mut answer.unexplained.unconfirmed {
        u.share *= others;
    }
    let rest = others * answer.unexplained.share;
    answer.unexplained.share = region.share + rest;
    if region.share >= rest {
        answer.unexplained.pattern = Pattern::Region(Box::new(region.clone()));
    }
    answer.outcome = Outcome::Judged(match answer.verdict() {
        Verdict::Consistent | Verdict::Unexplained => Verdict::Unexplained,
        Verdict::Explained | Verdict::PartlyExplained => Verdict::PartlyExplained,
    });
    answer.r#where.insert(0, region);
    (answer.misfit_rms_N, answer.samples) = (all.misfit_rms_N, all.samples);
}

/// The recordings without the first of each mounting that has several.
fn others(campaign: &Campaign) -> Campaign {
    let mountings = campaign.mountings().unwrap_or_default();
    let begins = |i: usize| i == 0 || mountings[i] != mountings[i - 1];
    let continues = |i: usize| mountings.get(i + 1) == Some(&mountings[i]);
    let kept = |i: usize| mountings.is_empty() || !(begins(i) && continues(i));
    let recordings = campaign.recordings.iter().enumerate().filter(|(i, _)| kept(*i));
    Campaign { recordings: recordings.map(|(_, r)| r.clone()).collect(), ..campaign.clone() }
}

/// The recordings that an answer is about, without first runs that it leaves out.
pub(crate) fn without_first_runs<'a>(campaign: &'a Campaign, answer: &Diagnosis) -> Cow<'a, Campaign> {
    if answer.remarks.iter().any(|r| matches!(r, Remark::FirstRuns { .. })) {
        Cow::Owned(others(&super::reliable_recordings(campaign)))
    } else {
        Cow::Borrowed(campaign)
    }
}
