//! From a campaign to the answer.

use model_core::braid::{Braid, Geometry};
use model_core::effects::Imitates;

use super::baselines::{self, Kind};
use super::candidates::library;
use super::confirm::confirmed;
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::judgement::{
    EXPLAINED, LACK_OF_FIT, LACK_OF_FIT_NOISE, LINE_ALPHA, LINE_SHARE, LINE_UNEXPLAINED, PARTLY_EXPLAINED,
    TRACE_POINTS,
};
use super::criteria::rows::{SLACK_MENTIONED, SLACK_ROUNDS};
use super::frequency;
use super::given;
use super::judgeable::{blocked_force, cannot_be_judged, no_judgement, what_can_be_judged};
use super::known::Known;
use super::linear::energy;
use super::locate::{block_ranges, locate};
use super::named::{considered, missing};
use super::rest;
use super::rows::{self, Rows};
use super::select::Found;
use super::tables::{in_the_tables, tables_as_evidence};
use super::verdict::{Diagnosis, Missing, PathStep, Region, Trace, Unexplained, Verdict};
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
    /// Effects beyond the catalogue, whose equations a test brings.
    #[cfg(test)]
    pub(crate) added: Vec<super::candidates::Law>,
}

impl Options {
    /// Laws beyond the catalogue.
    pub(super) fn added(&self) -> Vec<super::candidates::Law> {
        #[cfg(test)]
        return self.added.clone();
        #[cfg(not(test))]
        Vec::new()
    }
}

/// An answer, and the baseline that it was given with.
pub(super) struct Asked {
    pub diagnosis: Diagnosis,
    pub kind: Kind,
}

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
    for _ in 0..SLACK_ROUNDS {
        // Twice: the first fit still saw the slack rows.
        let fitted = baselines::fit(&rows, Kind::Stiff, &[]);
        slack += baselines::mask_slack(&mut rows, &fitted);
    }
    if slack * SLACK_MENTIONED > rows.len() {
        remarks.push(format!(
            "in {:.0} % of the rows the muscle hangs slack; they say nothing about its force and were left out",
            100.0 * slack as f64 / rows.len() as f64
        ));
    }
    if let Some(reason) = cannot_be_judged(&rows, blocked) {
        return unjudged(no_judgement(&rows, options, remarks, reason, blocked));
    }
    if let Some(law) = rest::settle_friction(&mut rows) {
        remarks.push(law.words());
    }
    // The model as it was: four orders, tables free over pressure.
    let production = baselines::fit(&rows, Kind::Flexible(TABLE_ORDER), &[]);
    let misfit = production.rms(&rows);
    let measured = baselines::measured_rms(&rows);
    if !(misfit < measured) {
        let reason = format!(
            "the model of this muscle misses the force by {misfit:.3} N, and all that was measured is {measured:.3} N: look at the \
             muscle's description and at the units before anything else"
        );
        return unjudged(no_judgement(&rows, options, remarks, reason, blocked));
    }
    remarks.extend(tables_as_evidence(&production, &rows));
    let library: Vec<_> =
        library(&rows, &options.added()).into_iter().filter(|c| !known.settles(c, &options.given)).collect();
    let asked: Vec<usize> =
        options.given.iter().filter_map(|law| library.iter().position(|c| c.is(*law))).collect();
    let (found, held) = if options.given.is_empty() {
        confirmed(&mut rows, &library, blocked, step)
    } else {
        given::fitted(&mut rows, &library, blocked, step, &asked)
    };
    remarks.extend(found.remarks.iter().cloned());
    let sigma = found.noise.sigma;
    if !found.noise.from_repeats {
        remarks.push("no stroke is repeated under the same conditions: the noise is what the most flexible model leaves".to_owned());
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
    let own = (LACK_OF_FIT * blocked).max(LACK_OF_FIT_NOISE * sigma);
    let beat = frequency::line(&rows, &found.full.residual, &block_ranges(&rows), step, 9)
        .filter(|l| l.p <= LINE_ALPHA && l.share >= LINE_SHARE);
    // What free tables take up where one bladder should serve all pressures.
    let taken_up = energy(&found.bare.core) - energy(&found.bare.residual);
    let concealed = (taken_up / weight).max(0.0).sqrt();
    if missing.is_empty() && concealed > LACK_OF_FIT * blocked {
        remarks.push(in_the_tables(&found, &library, concealed, blocked));
    }
    let restless = missing.is_empty() && found.noise.has_a_reason(step, blocked);
    if restless {
        remarks.push(format!(
            "{}; no instrument scatters like this, and no effect of the library explains it: look at the air supply, at the stroke \
             sensor's counts and at whatever is loose, then record two strokes under the same conditions again",
            found.noise.words(blocked)
        ));
    }
    let verdict = if missing.is_empty() {
        // What beats in time is no noise, however well repeats seem to explain it; nor is what is larger than any instrument's.
        let steady = beat.is_none_or(|l| l.share < LINE_UNEXPLAINED) && !restless;
        if left <= own && steady { Verdict::Consistent } else { Verdict::Unexplained }
    } else if explained >= EXPLAINED || left <= own {
        Verdict::Explained
    } else if explained >= PARTLY_EXPLAINED {
        Verdict::PartlyExplained
    } else {
        Verdict::Unexplained
    };
    let (mut regions, profiles) = locate(&rows, &found.bare.residual, &found.full.residual, sigma, 7);
    let (left_regions, _) = locate(&rows, &found.full.residual, &found.full.residual, sigma, 8);
    let share = if verdict == Verdict::Consistent { 0.0 } else { 1.0 - explained };
    let pattern = match (&beat, left_regions.first()) {
        (Some(l), _) => format!("periodic in time, {:.2} Hz", l.hertz),
        (None, Some(r)) if left > own => r.words.clone(),
        _ if restless => found.noise.words(blocked),
        _ => "none".to_owned(),
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
            words: format!("{:.0} % of the misfit repeats in time with {:.2} Hz", 100.0 * l.share, l.hertz),
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
        schema: "pam-diagnose/1".into(),
        muscle: options.muscle.clone(),
        samples: rows.samples,
        judged: true,
        verdict,
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
        history: None,
    };
    Ok(Asked { diagnosis, kind: found.full.kind })
}

/// What to look at before a fault of that size is believed.
fn beyond_instruments(m: &Missing) -> Option<String> {
    let beyond = m.parameters.iter().any(|p| p.outside_known_range && p.value != 0.0);
    let imitates = Law::from_name(&m.effect).and_then(|law| law.traits().imitates);
    (beyond && imitates == Some(Imitates::Description)).then(|| {
        format!(
            "{} of this size is more than anybody has met: look first at the muscle's description (diameter, braid angle, rest length, \
             wall) and at the units; a wrong one looks like this",
            m.effect
        )
    })
}

/// Of the rows that are judged: elsewhere no residual is a misfit, and what an effect adds there is no one's claim.
fn trace(rows: &Rows, found: &Found) -> Trace {
    let judged: Vec<usize> = (0..rows.len()).filter(|i| rows.root_weight[*i] > 0.0).collect();
    let pick: Vec<usize> =
        judged.iter().copied().step_by(judged.len().div_ceil(TRACE_POINTS).max(1)).collect();
    Trace {
        time: pick.iter().map(|i| rows.contexts[*i].time).collect(),
        before: pick.iter().map(|i| found.bare.residual[*i]).collect(),
        after: pick.iter().map(|i| found.full.residual[*i]).collect(),
        effects: pick.iter().map(|i| found.traces.iter().map(|t| t[*i]).sum()).collect(),
    }
}
