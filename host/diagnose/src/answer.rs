//! From a campaign to the answer.

use model_core::braid::{Braid, Geometry};

use super::baselines::{self, Kind};
use super::candidates::library;
use super::confirm::confirmed;
use super::frequency;
use super::given;
use super::judgeable::{blocked_force, cannot_be_judged, no_judgement, what_can_be_judged};
use super::known::Known;
use super::linear::energy;
use super::locate::{block_ranges, locate};
use super::named::{considered, missing};
use super::remark::{Remark, Unjudgeable};
use super::rest;
use super::rows::{self, Rows};
use super::select::Found;
use super::tables::{in_the_tables, tables_as_evidence};
use super::verdict::{Diagnosis, Missing, Outcome, PathStep, Pattern, Region, Trace, Unexplained, Verdict};
use pam_data::error::{DataCode, Error, Result};
use pam_data::progress::SharedProgress;
use pam_data::recording::Campaign;
use pam_fit::bench::Candidate as Law;
use pam_fit::checks::Checks;

/// What the caller may choose.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The muscle's name, for the answer.
    pub muscle: String,
    /// Checks of the bench on which the recordings were made.
    pub checks: Checks,
    /// Effects that are known to be there: fitted whatever the evidence, and nothing else is searched for.
    pub given: Vec<Law>,
    /// Who watches how far it has come; nobody by default.
    pub progress: SharedProgress,
}

/// An answer, and the baseline that it was given with.
pub(super) struct Asked {
    pub diagnosis: Diagnosis,
    pub kind: Kind,
}

/// Lack of fit that the model admits beside the pure error of repeats, rms as a share of the blocked force: friction by its sign
/// alone where contacts give a little before they slide, and what a bladder of four orders leaves.
const INEXACTNESS: f64 = 1.5e-3;

/// Finds out what the model leaves out of a campaign of recordings.
///
/// # Errors
/// Recordings without force or without rows, or an impossible geometry.
pub fn diagnose(campaign: &Campaign, geometry: &Geometry, options: &Options) -> Result<Diagnosis> {
    let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
    given::check(&options.given)?;
    if campaign.samples() == 0 {
        return Err(Error::new(DataCode::RecordingEmpty, "the recordings hold no rows"));
    }
    let known = Known::of(&options.checks, campaign, &braid)?;
    let freed = known.free(campaign);
    let asked = ask(&freed, &braid, options, &known)?;
    known.enter(asked, &options.given, &freed, &braid)
}

/// What the recordings themselves say, freed of what checks of the bench have measured.
fn ask(campaign: &Campaign, braid: &Braid<f64>, options: &Options, known: &Known) -> Result<Asked> {
    let unjudged = |diagnosis| Ok(Asked { diagnosis, kind: Kind::Stiff });
    let mut rows = rows::prepare(campaign, braid)?;
    rows.progress = options.progress.clone();
    let mut remarks = std::mem::take(&mut rows.remarks);
    let blocked = blocked_force(&rows);
    remarks.extend(what_can_be_judged(&rows));
    if let Some(reason) = cannot_be_judged(&rows, blocked) {
        return unjudged(no_judgement(&rows, options, remarks, reason, blocked));
    }
    let step = rows::typical_step(&rows);
    let mut slack = 0;
    for _ in 0..2 {
        // Twice: the first fit still saw the slack rows.
        let fitted = baselines::fit(&rows, Kind::Stiff, &[]);
        slack += baselines::mask_slack(&mut rows, &fitted);
    }
    if slack * 100 > rows.len() {
        remarks.push(Remark::Slack(slack as f64 / rows.len() as f64));
    }
    if let Some(reason) = cannot_be_judged(&rows, blocked) {
        return unjudged(no_judgement(&rows, options, remarks, reason, blocked));
    }
    if let Some(law) = rest::settle_friction(&mut rows) {
        remarks.push(Remark::FrictionAtRest(law.into()));
    }
    // The model as it was: four orders, tables free over pressure.
    let production = baselines::fit(&rows, Kind::Flexible(4), &[]);
    let misfit = production.rms(&rows);
    let measured = baselines::measured_rms(&rows);
    if !(misfit < measured) {
        let reason = Unjudgeable::WrongModel { misfit, measured };
        return unjudged(no_judgement(&rows, options, remarks, reason, blocked));
    }
    remarks.extend(tables_as_evidence(&production, &rows));
    let library: Vec<_> = library(&rows).into_iter().filter(|c| !known.settles(c, &options.given)).collect();
    let asked: Vec<usize> =
        options.given.iter().filter_map(|law| library.iter().position(|c| c.law == *law)).collect();
    let (found, held) = if options.given.is_empty() {
        confirmed(&mut rows, &library, blocked, step)
    } else {
        given::fitted(&mut rows, &library, blocked, step, &asked)
    };
    remarks.extend(found.remarks.iter().cloned());
    let sigma = found.noise.sigma;
    if !found.noise.from_repeats {
        remarks.push(Remark::NoRepeats);
    }

    let mut missing = missing(&found, &library, &rows);
    if !options.given.is_empty() {
        given::judge(&mut missing, &found, &rows, &held);
    }
    remarks.extend(missing.iter().filter_map(beyond_instruments));
    let explained: f64 = if found.above > 0.0 && !missing.is_empty() {
        ((energy(&found.bare.residual) - energy(&found.full.residual)) / found.above).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let weight = energy(&rows.root_weight).max(1e-12);
    let left = (energy(&found.full.residual) / weight - sigma * sigma).max(0.0).sqrt();
    let own = (INEXACTNESS * blocked).max(0.6 * sigma);
    let beat = frequency::line(&rows, &found.full.residual, &block_ranges(&rows), step, 9)
        .filter(|l| l.p <= 0.02 && l.share >= 0.15);
    // What free tables take up where one bladder should serve all pressures.
    let taken_up = energy(&found.bare.core) - energy(&found.bare.residual);
    let concealed = (taken_up / weight).max(0.0).sqrt();
    if missing.is_empty() && concealed > INEXACTNESS * blocked {
        remarks.push(in_the_tables(&found, &library, concealed, blocked));
    }
    let restless = missing.is_empty() && found.noise.has_a_reason(step, blocked);
    if restless {
        remarks.push(Remark::NotRepeatable(found.noise.scatter(blocked)));
    }
    let verdict = if missing.is_empty() {
        // What beats in time is no noise, however well repeats seem to explain it; nor is what is larger than any instrument's.
        let steady = beat.is_none_or(|l| l.share < 0.3) && !restless;
        if left <= own && steady { Verdict::Consistent } else { Verdict::Unexplained }
    } else if explained >= 0.8 || left <= own {
        Verdict::Explained
    } else if explained >= 0.25 {
        Verdict::PartlyExplained
    } else {
        Verdict::Unexplained
    };
    let (mut regions, profiles) = locate(&rows, &found.bare.residual, &found.full.residual, sigma, 7);
    let (left_regions, _) = locate(&rows, &found.full.residual, &found.full.residual, sigma, 8);
    let share = if verdict == Verdict::Consistent { 0.0 } else { 1.0 - explained };
    let pattern = match (&beat, left_regions.first()) {
        (Some(l), _) => Pattern::Periodic(l.hertz),
        (None, Some(r)) if left > own => Pattern::Region(Box::new(r.clone())),
        _ if restless => Pattern::NotRepeatable(found.noise.scatter(blocked)),
        _ => Pattern::None,
    };
    if let Some(l) = beat {
        regions.push(Region {
            coordinate: "frequency".into(),
            from: l.hertz - l.half,
            to: l.hertz + l.half,
            share: l.share,
            rows: 1.0,
            p: l.p,
            unit: "Hz".into(),
        });
    }
    let considered = considered(&found, &library, &missing, sigma, blocked);
    let path = found
        .taken
        .iter()
        .map(|t| PathStep {
            effect: library[t.trial.candidate].name().into(),
            rms_N: t.rms,
            p: t.p,
            runners_up: t.rivals.iter().map(|r| (library[r.0].name().to_owned(), r.1)).collect(),
        })
        .collect();
    let diagnosis = Diagnosis {
        muscle: options.muscle.clone(),
        samples: rows.samples,
        outcome: Outcome::Judged(verdict),
        noise_N: sigma,
        misfit_rms_N: misfit,
        r#where: if verdict == Verdict::Consistent { Vec::new() } else { regions },
        missing,
        unexplained: Unexplained { share, pattern },
        held_out: held,
        next_experiment: None,
        considered,
        path,
        blocked_force_N: blocked,
        noise_memory_s: found.noise.memory,
        remarks,
        profiles,
        trace: trace(&rows, &found),
    };
    Ok(Asked { diagnosis, kind: found.full.kind })
}

/// Gains and offsets that a wrong description of the muscle imitates.
const LIKE_A_DESCRIPTION: [&str; 5] =
    ["force-gain", "gauge-gain", "displacement-offset", "braid-elasticity", "tip-effect"];

/// What to look at before a fault of that size is believed.
fn beyond_instruments(m: &Missing) -> Option<Remark> {
    let beyond = m.parameters.iter().any(|p| p.outside_known_range && p.value != 0.0);
    (beyond && LIKE_A_DESCRIPTION.contains(&m.effect.as_str()))
        .then(|| Remark::CheckDescription(m.effect.clone()))
}

/// Of the rows that are judged: elsewhere no residual is a misfit, and what an effect adds there is no one's claim.
fn trace(rows: &Rows, found: &Found) -> Trace {
    let judged: Vec<usize> = (0..rows.len()).filter(|i| rows.root_weight[*i] > 0.0).collect();
    let pick: Vec<usize> = judged.iter().copied().step_by(judged.len().div_ceil(1_500).max(1)).collect();
    Trace {
        time: pick.iter().map(|i| rows.contexts[*i].time).collect(),
        before: pick.iter().map(|i| found.bare.residual[*i]).collect(),
        after: pick.iter().map(|i| found.full.residual[*i]).collect(),
        effects: pick.iter().map(|i| found.traces.iter().map(|t| t[*i]).sum()).collect(),
    }
}
