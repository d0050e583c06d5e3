//! From a campaign to the answer.

use model_core::braid::{Braid, Geometry};
use model_core::effects::Imitates;

use super::baselines::{self, Kind};
use super::candidates::{Candidate, library};
use super::confirm::confirmed;
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::judgement::{
    EXPLAINED, LACK_OF_FIT, LACK_OF_FIT_NOISE, LINE_ALPHA, LINE_SHARE, LINE_UNEXPLAINED, PARTLY_EXPLAINED,
    TRACE_POINTS,
};
use super::criteria::rows::{SLACK_MENTIONED, SLACK_ROUNDS};
use super::frequency::{self, Line};
use super::given;
use super::judgeable::{blocked_force, cannot_be_judged, no_judgement, what_can_be_judged};
use super::known::Known;
use super::linear::energy;
use super::locate::{block_ranges, locate};
use super::named::{considered, missing};
use super::options::Options;
use super::remark::{Remark, Unjudgeable};
use super::rest;
use super::rows::{self, Rows};
use super::select::Found;
use super::tables::{in_the_tables, tables_as_evidence};
use super::verdict::{
    Diagnosis, HeldOut, Missing, Outcome, PathStep, Pattern, Profile, Region, Trace, Unexplained, Verdict,
};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_fit::bench::Candidate as Law;

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
    let answer = ask(&freed, &braid, options, &known)?;
    known.enter(answer, &options.given, &freed, &braid)
}

/// What the recordings themselves say, freed of what checks of the bench have measured; with the kind of the last baseline.
fn ask(
    campaign: &Campaign,
    braid: &Braid<f64>,
    options: &Options,
    known: &Known,
) -> Result<(Diagnosis, Kind)> {
    let (rows, mut remarks) = rows::prepare(campaign, braid)?;
    let rows = rows.watched(options.progress.clone());
    let (blocked, step) = (blocked_force(&rows), rows::typical_step(&rows));
    remarks.extend(what_can_be_judged(&rows));
    let screened = screen(&rows, blocked, &mut remarks);
    let settled = screened.and_then(|screened| settle(&screened, &mut remarks));
    let Settled { rows, misfit } = match settled {
        Ok(settled) => settled,
        Err(reason) => return Ok((no_judgement(&rows, options, remarks, reason, blocked), Kind::Stiff)),
    };
    let selected = select(&rows, options, known, (blocked, step), &mut remarks);
    let excess = Excess::of(&selected, blocked, step, &mut remarks);
    let located = Located::of(&selected, &excess, blocked, step);
    let verdict = judge(&selected, &excess, located.line.as_ref());
    let kind = selected.found.full.kind;
    let measures = Measures { blocked, misfit, excess };
    Ok((answer(options, measures, selected, located, verdict, remarks), kind))
}

/// The rows without those at which the muscle is slack; or why nothing can be judged.
fn screen(rows: &Rows, blocked: f64, remarks: &mut Vec<Remark>) -> Result<Rows, Unjudgeable> {
    if let Some(reason) = cannot_be_judged(rows, blocked) {
        return Err(reason);
    }
    let mut screened = rows.clone();
    let mut slack = 0;
    for _ in 0..SLACK_ROUNDS {
        // Twice: the first fit still saw the slack rows.
        let fitted = baselines::fit(&screened, Kind::Stiff, &[]);
        let (without, masked) = baselines::without_slack(&screened, &fitted);
        screened = without;
        slack += masked;
    }
    if slack * SLACK_MENTIONED > rows.len() {
        remarks.push(Remark::Slack(slack as f64 / rows.len() as f64));
    }
    cannot_be_judged(&screened, blocked).map_or(Ok(screened), Err)
}

/// Rows whose friction at rest is known, and the error of the model as it was, N.
struct Settled {
    rows: Rows,
    misfit: f64,
}

/// Settles what friction does at rest, and fits the model as it was; or says why nothing can be judged.
fn settle(rows: &Rows, remarks: &mut Vec<Remark>) -> Result<Settled, Unjudgeable> {
    let (rows, law) = rest::settle_friction(rows);
    remarks.extend(law.map(|law| Remark::FrictionAtRest(law.into())));
    // The model as it was: four orders, tables free over pressure.
    let production = baselines::fit(&rows, Kind::Flexible(TABLE_ORDER), &[]);
    let misfit = production.rms(&rows);
    let measured = baselines::measured_rms(&rows);
    if !(misfit < measured) {
        return Err(Unjudgeable::WrongModel { misfit, measured });
    }
    remarks.extend(tables_as_evidence(&production, &rows));
    Ok(Settled { rows, misfit })
}

/// The effects that were selected, out of which library, and how they do on held-out rows.
struct Selected {
    library: Vec<Candidate>,
    found: Found,
    held: HeldOut,
    missing: Vec<Missing>,
}

/// Selects the effects that are missing; where the user gives some as known, fits these.
fn select(
    rows: &Rows,
    options: &Options,
    known: &Known,
    (blocked, step): (f64, f64),
    remarks: &mut Vec<Remark>,
) -> Selected {
    let everything = library(rows, &options.added()).into_iter();
    let library: Vec<Candidate> = everything.filter(|c| !known.settles(c, &options.given)).collect();
    let given: Vec<usize> =
        options.given.iter().filter_map(|law| library.iter().position(|c| c.is(*law))).collect();
    let (found, held) = if options.given.is_empty() {
        confirmed(rows, &library, blocked, step)
    } else {
        given::fitted(rows, &library, blocked, step, &given)
    };
    remarks.extend(found.remarks.iter().cloned());
    if !found.noise.from_repeats {
        remarks.push(Remark::NoRepeats);
    }
    let mut missing = missing(&found, &library, &found.rows);
    if !options.given.is_empty() {
        given::judge(&mut missing, &found, &held);
    }
    remarks.extend(missing.iter().filter_map(beyond_instruments));
    Selected { library, found, held, missing }
}

/// The error above the noise, and what became of it.
struct Excess {
    /// Share of it that the selected effects explain.
    explained: f64,
    /// What is left of it, root mean square, N.
    left: f64,
    /// What the model admits of it, root mean square, N.
    admitted: f64,
    /// Whether the force does not repeat, more than instruments scatter, and nothing explains it.
    restless: bool,
}

impl Excess {
    fn of(selected: &Selected, blocked: f64, step: f64, remarks: &mut Vec<Remark>) -> Self {
        let Selected { library, found, missing, .. } = selected;
        let sigma = found.noise.sigma;
        let explained: f64 = if found.above > 0.0 && !missing.is_empty() {
            ((energy(&found.bare.residual) - energy(&found.full.residual)) / found.above).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let weight = energy(found.rows.root_weight()).max(1e-12);
        let left = (energy(&found.full.residual) / weight - sigma * sigma).max(0.0).sqrt();
        let admitted = (LACK_OF_FIT * blocked).max(LACK_OF_FIT_NOISE * sigma);
        // What free tables take up where one bladder should serve all pressures.
        let taken_up = energy(&found.bare.core) - energy(&found.bare.residual);
        let concealed = (taken_up / weight).max(0.0).sqrt();
        if missing.is_empty() && concealed > LACK_OF_FIT * blocked {
            remarks.push(in_the_tables(found, library, concealed, blocked));
        }
        let restless = missing.is_empty() && found.noise.has_a_reason(step, blocked);
        if restless {
            remarks.push(Remark::NotRepeatable(found.noise.scatter(blocked)));
        }
        Self { explained, left, admitted, restless }
    }
}

/// Where the error sits.
struct Located {
    /// A line in its spectrum.
    line: Option<Line>,
    regions: Vec<Region>,
    profiles: Vec<Profile>,
    /// The pattern of what is left.
    pattern: Pattern,
}

impl Located {
    fn of(selected: &Selected, excess: &Excess, blocked: f64, step: f64) -> Self {
        let found = &selected.found;
        let (rows, sigma) = (&found.rows, found.noise.sigma);
        let line = frequency::line(rows, &found.full.residual, &block_ranges(rows), step, 9)
            .filter(|l| l.p <= LINE_ALPHA && l.share >= LINE_SHARE);
        let (mut regions, profiles) = locate(rows, &found.bare.residual, &found.full.residual, sigma, 7);
        let (left_regions, _) = locate(rows, &found.full.residual, &found.full.residual, sigma, 8);
        let pattern = match (&line, left_regions.first()) {
            (Some(l), _) => Pattern::Periodic(l.hertz),
            (None, Some(r)) if excess.left > excess.admitted => Pattern::Region(Box::new(r.clone())),
            _ if excess.restless => Pattern::NotRepeatable(found.noise.scatter(blocked)),
            _ => Pattern::None,
        };
        regions.extend(line.as_ref().map(|l| Region {
            coordinate: "frequency".into(),
            from: l.hertz - l.half,
            to: l.hertz + l.half,
            share: l.share,
            rows: 1.0,
            p: l.p,
            unit: "Hz".into(),
        }));
        Self { line, regions, profiles, pattern }
    }
}

/// The verdict.
fn judge(selected: &Selected, excess: &Excess, line: Option<&Line>) -> Verdict {
    let small = excess.left <= excess.admitted;
    if selected.missing.is_empty() {
        // What beats in time is no noise, however well repeats seem to explain it; nor is what is larger than any instrument's.
        let steady = line.is_none_or(|l| l.share < LINE_UNEXPLAINED) && !excess.restless;
        if small && steady { Verdict::Consistent } else { Verdict::Unexplained }
    } else if excess.explained >= EXPLAINED || small {
        Verdict::Explained
    } else if excess.explained >= PARTLY_EXPLAINED {
        Verdict::PartlyExplained
    } else {
        Verdict::Unexplained
    }
}

/// Forces that the answer states.
struct Measures {
    blocked: f64,
    /// Error of the model as it was, N.
    misfit: f64,
    excess: Excess,
}

/// The answer as values.
fn answer(
    options: &Options,
    measures: Measures,
    selected: Selected,
    located: Located,
    verdict: Verdict,
    remarks: Vec<Remark>,
) -> Diagnosis {
    let Measures { blocked, misfit, excess } = measures;
    let Selected { library, found, held, missing } = selected;
    let sigma = found.noise.sigma;
    let consistent = verdict == Verdict::Consistent;
    let considered = considered(&found, &library, &missing, sigma, blocked);
    let name = |candidate: usize| library[candidate].name().to_owned();
    let path = found.taken.iter().map(|t| PathStep {
        effect: name(t.trial.candidate),
        rms_N: t.rms,
        p: t.p,
        runners_up: t.rivals.iter().map(|r| (name(r.0), r.1)).collect(),
    });
    Diagnosis {
        muscle: options.muscle.clone(),
        samples: found.rows.samples,
        outcome: Outcome::Judged(verdict),
        noise_N: sigma,
        misfit_rms_N: misfit,
        r#where: if consistent { Vec::new() } else { located.regions },
        missing,
        unexplained: Unexplained {
            share: if consistent { 0.0 } else { 1.0 - excess.explained },
            pattern: located.pattern,
        },
        held_out: held,
        next_experiment: None,
        considered,
        path: path.collect(),
        blocked_force_N: blocked,
        noise_memory_s: found.noise.memory,
        remarks,
        profiles: located.profiles,
        trace: trace(&found.rows, &found),
        history: None,
    }
}

/// What to look at before a fault of that size is believed.
fn beyond_instruments(m: &Missing) -> Option<Remark> {
    let beyond = m.parameters.iter().any(|p| p.outside_known_range && p.value != 0.0);
    let imitates = Law::from_name(&m.effect).and_then(|law| law.traits().imitates);
    (beyond && imitates == Some(Imitates::Description)).then(|| Remark::CheckDescription(m.effect.clone()))
}

/// Of the rows that are judged: elsewhere no residual is a misfit, and what an effect adds there is no one's claim.
fn trace(rows: &Rows, found: &Found) -> Trace {
    let judged: Vec<usize> = (0..rows.len()).filter(|i| rows.root_weight()[*i] > 0.0).collect();
    let pick: Vec<usize> =
        judged.iter().copied().step_by(judged.len().div_ceil(TRACE_POINTS).max(1)).collect();
    Trace {
        time: pick.iter().map(|i| rows.contexts()[*i].time).collect(),
        before: pick.iter().map(|i| found.bare.residual[*i]).collect(),
        after: pick.iter().map(|i| found.full.residual[*i]).collect(),
        effects: pick.iter().map(|i| found.traces.iter().map(|t| t[*i]).sum()).collect(),
    }
}
