//! The history beside the static search: the search runs on recordings from which the memory was subtracted.

use std::borrow::Cow;

use model_core::braid::Geometry;

use super::additional_effect::AdditionalEffect;
use super::criteria::{ENTER_EXPLAINED, ENTER_RESOLVED, MOST_LOST};
use super::entries::is_from_history;
use super::slack_reading::SlackReading;
use super::{Found, entries, first_runs, found, slack_reading};
use crate::as_read::{self, AsRead};
use crate::criteria::judgement::PARTLY_EXPLAINED;
use crate::diagnosis::{diagnose as statically, with_baseline};
use crate::options::Options;
use crate::remark::Remark;
use crate::verdict::{Considered, Diagnosis, HeldOut, Missing, Outcome, Split, Verdict, WhyNot};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_data::recording::dropouts::Screened;

/// Finds out what the model leaves out of a campaign: its history first, where it is one of isometric staircases, then the rest.
///
/// # Errors
/// Recordings without force or without rows, or an impossible geometry.
pub fn diagnose(campaign: &Campaign, geometry: &Geometry, options: &Options) -> Result<Diagnosis> {
    options.progress.stage("what the muscle remembers", 0);
    // Most campaigns move: they are not copied.
    if campaign.mountings().is_none() {
        return statically(campaign, geometry, options);
    }
    let screened = Screened::of(campaign);
    let reliable = reliable(&screened);
    let found = found(&reliable, geometry);
    // What the user gives as known is fitted as it is, to the recordings as they are.
    if !options.given.is_empty() {
        let mut diagnosis = statically(campaign, geometry, options)?;
        diagnosis.history = found.map(|f| f.answer);
        return Ok(diagnosis);
    }
    let Some(found) = found else {
        let reading = slack_reading(&reliable, geometry);
        return beside_slack_reading(campaign, geometry, options, reading.as_ref());
    };
    if !found.answer.named {
        return without_named_memory((campaign, &screened, &reliable), geometry, options, found);
    }
    let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
    let slack_reading = found.slack_reading.clone();
    let slack_reading = slack_reading.as_ref();
    let freed = corrected(Cow::Owned(without_memory(&reliable, &found)), slack_reading);
    let mut diagnosis = statically(&freed, geometry, options)?;
    enter(&mut diagnosis, found);
    enter_slack_reading(&mut diagnosis, slack_reading, 0.0);
    report_failures(&mut diagnosis, &screened);
    let misfit = as_read::misfit(&as_read::under_load(&reliable, None, &braid)?);
    if misfit.is_finite() && misfit > 0.0 {
        diagnosis.misfit_rms_N = misfit;
    }
    Ok(diagnosis)
}

/// The answer where the history names no memory.
fn without_named_memory(
    (campaign, screened, reliable): (&Campaign, &Screened<'_>, &Campaign),
    geometry: &Geometry,
    options: &Options,
    found: Found,
) -> Result<Diagnosis> {
    let reading = found.slack_reading.as_ref();
    let mut diagnosis = statically(&corrected(Cow::Borrowed(campaign), reading), geometry, options)?;
    let others = first_runs::answer_without(
        &diagnosis,
        &corrected(Cow::Borrowed(reliable), reading),
        found.first_runs.as_ref(),
        geometry,
        options,
    )?;
    if let Some(others) = others {
        diagnosis = others;
        report_failures(&mut diagnosis, screened);
    }
    enter_needed(&mut diagnosis, found.needed.as_ref(), 1.0);
    enter_slack_reading(&mut diagnosis, reading, 0.0);
    diagnosis.history = Some(found.answer);
    Ok(diagnosis)
}

/// Failures of sensors in recordings that were freed of them before.
fn report_failures(diagnosis: &mut Diagnosis, screened: &Screened<'_>) {
    if let Some(failures) = screened.remark() {
        diagnosis.remarks.retain(|remark| !matches!(remark, Remark::Screening(_)));
        diagnosis.remarks.push(Remark::Screening(failures));
    }
}

/// The answer of recordings without what the load cell reads of a slack muscle, with that reading.
fn beside_slack_reading(
    campaign: &Campaign,
    geometry: &Geometry,
    options: &Options,
    reading: Option<&SlackReading>,
) -> Result<Diagnosis> {
    let freed = corrected(Cow::Borrowed(campaign), reading);
    let (mut diagnosis, kind) = with_baseline(&freed, geometry, options)?;
    let mut explained = 0.0;
    if reading.is_some_and(|r| r.found) && diagnosis.judged() {
        let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
        let (before, after) = (AsRead::of(campaign, None, &braid)?, AsRead::of(&freed, None, &braid)?);
        explained = before.enter(&mut diagnosis, kind, &after).share;
    }
    enter_slack_reading(&mut diagnosis, reading, explained);
    Ok(diagnosis)
}

/// The recordings that may show a memory.
#[must_use]
pub(crate) fn reliable_recordings(campaign: &Campaign) -> Campaign {
    reliable(&Screened::of(campaign))
}

/// Those of which nearly all readings are free of sensor failures, with the others bridged. A failing sensor changes one run against the
/// others, as a memory does.
fn reliable(screened: &Screened<'_>) -> Campaign {
    let campaign = screened.campaign.as_ref();
    let lost = |index: usize| {
        let read = screened.read(index);
        read.iter().filter(|read| !**read).count() as f64 / read.len().max(1) as f64
    };
    let recordings = campaign.recordings.iter().enumerate().filter(|(index, _)| lost(*index) <= MOST_LOST);
    Campaign {
        recordings: recordings.map(|(_, recording)| recording.clone()).collect(),
        clock: campaign.clock,
        warnings: campaign.warnings.clone(),
    }
}

/// The recordings with the pressure that the muscle would need without its memory and slips.
fn without_memory(campaign: &Campaign, found: &Found) -> Campaign {
    let mut freed = campaign.clone();
    for (recording, (times, shifts)) in freed.recordings.iter_mut().zip(&found.shifts) {
        let mut at = 0;
        for (time, pressure) in recording.time.iter().zip(&mut recording.pressure) {
            while at + 2 < times.len() && times[at + 1] < *time {
                at += 1;
            }
            let (Some(t0), Some(s0)) = (times.get(at), shifts.get(at)) else { continue };
            let next = times.get(at + 1).zip(shifts.get(at + 1));
            *pressure += next.map_or(*s0, |(t1, s1)| {
                s0 + (s1 - s0) * ((time - t0) / (t1 - t0).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
            });
        }
    }
    freed
}

/// The recordings without what the load cell reads of a slack muscle; as they are where that is nothing.
fn corrected<'a>(mut campaign: Cow<'a, Campaign>, reading: Option<&SlackReading>) -> Cow<'a, Campaign> {
    let Some(reading) = reading.filter(|r| r.found) else { return campaign };
    let (zero, per_pressure) = (reading.zero(), reading.per_pressure());
    for recording in &mut campaign.to_mut().recordings {
        for (force, pressure) in recording.force.iter_mut().flatten().zip(&recording.pressure) {
            *force -= zero + per_pressure * pressure;
        }
    }
    campaign
}

fn enter(diagnosis: &mut Diagnosis, found: Found) {
    let Found { answer, regions, peak, needed, .. } = found;
    let unseen = &answer.unseen;
    let left = (1.0 - unseen.gain).clamp(0.0, 1.0);
    let resolved = unseen.supported_with.rms_N <= ENTER_RESOLVED * answer.largest_force_N;
    // What the search calls a memory in recordings freed of it is the rest of the same.
    diagnosis.missing.retain(|m| !entries::NAMES.contains(&m.effect.as_str()));
    diagnosis.missing.insert(0, entries::memory(&answer, peak));
    enter_needed(diagnosis, needed.as_ref(), left);
    let freed_misfit = diagnosis.misfit_rms_N;
    let rest_agrees =
        !diagnosis.judged() || matches!(diagnosis.verdict(), Verdict::Consistent | Verdict::Explained);
    let well = unseen.gain >= ENTER_EXPLAINED || resolved;
    if !rest_agrees {
        diagnosis.remarks.insert(0, Remark::StaticMisfit(freed_misfit));
    }
    diagnosis.remarks.push(Remark::MemoryInTable);
    let verdict = if well && rest_agrees { Verdict::Explained } else { Verdict::PartlyExplained };
    diagnosis.outcome = Outcome::Judged(verdict);
    diagnosis.unexplained.share = left;
    diagnosis.r#where.splice(0..0, regions);
    diagnosis.held_out = HeldOut {
        split: Split::Runs(answer.runs.len()),
        rms_before_N: unseen.without_memory.rms_N,
        rms_after_N: unseen.with_memory.rms_N,
        noise_N: diagnosis.noise_N,
        with_turns_before_N: unseen.without_memory.rms_N,
        with_turns_after_N: unseen.with_memory.rms_N,
    };
    diagnosis.history = Some(answer);
}

/// An effect that unseen runs need, where the search has not named it or one that it is not distinguished from. `left` is the share of the
/// squared error that the memory leaves.
fn enter_needed(diagnosis: &mut Diagnosis, needed: Option<&AdditionalEffect>, left: f64) {
    let known = |n: &AdditionalEffect| {
        let is_it = |effect: &str| effect == n.effect.info().name;
        diagnosis.missing.iter().any(|m| is_it(&m.effect) || m.confusable_with.iter().any(|c| is_it(c)))
    };
    let Some(needed) = needed.filter(|n| diagnosis.judged() && !known(n)) else { return };
    let from = diagnosis.missing.iter().take_while(|m| is_from_history(m)).count();
    diagnosis.missing.insert(from, entries::beside_memory(needed, left));
    let verdict = match diagnosis.verdict() {
        Verdict::Consistent => Verdict::Explained,
        Verdict::Unexplained if needed.gain >= PARTLY_EXPLAINED => Verdict::PartlyExplained,
        other => other,
    };
    diagnosis.outcome = Outcome::Judged(verdict);
}

/// What a slack muscle shows: an error of the load cell, with the share of the error that it explains, and limits of others. What is named
/// now is not among the effects that were considered.
fn enter_slack_reading(diagnosis: &mut Diagnosis, reading: Option<&SlackReading>, explained: f64) {
    if let Some(reading) = reading.filter(|r| r.found && diagnosis.judged()) {
        diagnosis.missing.retain(|m| m.effect != reading.effect.info().name);
        diagnosis.missing.push(Missing { share_explained: explained, ..entries::slack_reading(reading) });
        if diagnosis.verdict() == Verdict::Consistent {
            diagnosis.outcome = Outcome::Judged(Verdict::Explained);
        }
    }
    let missing = &diagnosis.missing;
    diagnosis.considered.retain(|c| missing.iter().all(|m| m.effect != c.effect));
    for (effect, limit) in reading.iter().flat_map(|r| &r.limits) {
        let is_it = |c: &&mut Considered| c.effect == effect.info().name && !c.checked;
        let Some(considered) = diagnosis.considered.iter_mut().find(is_it) else { continue };
        if considered.hidden_up_to_N.is_none_or(|hidden| hidden > *limit) {
            considered.hidden_up_to_N = Some(*limit);
            if considered.why_not != WhyNot::Confusable {
                considered.why_not = WhyNot::SlackReading;
            }
        }
    }
}
