//! The diagnosis of a campaign: screen, settle rest friction, select, locate, judge.

use model_core::braid::{Braid, Geometry};
use model_core::effects::Imitates;

use super::baselines::{self, Kind};
use super::bench_checks::BenchChecks;
use super::candidates::{Candidate, library};
use super::confirmation::select_and_confirm;
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::judgement::{
    EXPLAINED, LACK_OF_FIT, LACK_OF_FIT_NOISE, LINE_ALPHA, LINE_SHARE, LINE_UNEXPLAINED, PARTLY_EXPLAINED,
    TRACE_POINTS,
};
use super::criteria::rows::{SLACK_MENTIONED, SLACK_ROUNDS};
use super::findings::{considered, missing};
use super::known_effects;
use super::linear::energy;
use super::location::{block_ranges, locate};
use super::options::Options;
use super::preconditions::{blocked_force, limitations, not_judged, unmet_precondition};
use super::rest_friction;
use super::rows::{self, Rows};
use super::selection_step::Selection;
use super::spectrum::{self, Line};
use super::table_evidence::{absorbed_by_tables, patterns_over_pressure};
use super::verdict::{Diagnosis, HeldOut, Missing, PathStep, Profile, Region, Trace, Unexplained, Verdict};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_fit::bench::Candidate as Law;

/// Finds out what the model leaves out of a campaign of recordings.
///
/// # Errors
/// Recordings without force or without rows, or an impossible geometry.
pub fn diagnose(campaign: &Campaign, geometry: &Geometry, options: &Options) -> Result<Diagnosis> {
    let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
    known_effects::check(&options.given)?;
    if campaign.samples() == 0 {
        return Err(Error::new(DataCode::RecordingEmpty, "the recordings hold no rows"));
    }
    let known = BenchChecks::of(&options.checks, campaign, &braid)?;
    let freed = known.free(campaign);
    let answer = ask(&freed, &braid, options, &known)?;
    known.enter(answer, &options.given, &freed, &braid)
}

/// The answer of the recordings, corrected for what checks of the bench measured; with the kind of the last baseline.
fn ask(
    campaign: &Campaign,
    braid: &Braid<f64>,
    options: &Options,
    known: &BenchChecks,
) -> Result<(Diagnosis, Kind)> {
    let (rows, mut remarks) = rows::prepare(campaign, braid)?;
    let rows = rows.watched(options.progress.clone());
    let (blocked, step) = (blocked_force(&rows), rows::typical_step(&rows));
    remarks.extend(limitations(&rows));
    let screened = screen(&rows, blocked, &mut remarks);
    let settled = screened.and_then(|screened| settle(&screened, &mut remarks));
    let Settled { rows, misfit } = match settled {
        Ok(settled) => settled,
        Err(reason) => return Ok((not_judged(&rows, options, remarks, reason, blocked), Kind::Stiff)),
    };
    let selected = select(&rows, options, known, (blocked, step), &mut remarks);
    let excess = Excess::of(&selected, blocked, step, &mut remarks);
    let located = Located::of(&selected, &excess, blocked, step);
    let verdict = judge(&selected, &excess, located.line.as_ref());
    let kind = selected.selection.joint.kind;
    let measures = Measures { blocked, misfit, excess };
    Ok((answer(options, measures, selected, located, verdict, remarks), kind))
}

/// The rows without those at which the muscle is slack; or why nothing can be judged.
fn screen(rows: &Rows, blocked: f64, remarks: &mut Vec<String>) -> Result<Rows, String> {
    if let Some(reason) = unmet_precondition(rows, blocked) {
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
        remarks.push(format!(
            "in {:.0} % of the rows the muscle hangs slack; they say nothing about its force and were left out",
            100.0 * slack as f64 / rows.len() as f64
        ));
    }
    unmet_precondition(&screened, blocked).map_or(Ok(screened), Err)
}

/// Rows whose friction at rest is known, and the error of the model as it was, N.
struct Settled {
    rows: Rows,
    misfit: f64,
}

/// Settles what friction does at rest, and fits the model as it was; or says why nothing can be judged.
fn settle(rows: &Rows, remarks: &mut Vec<String>) -> Result<Settled, String> {
    let (rows, law) = rest_friction::settle_rest_friction(rows);
    remarks.extend(law.map(rest_friction::RestLaw::words));
    // The model as it was: four orders, tables free over pressure.
    let production = baselines::fit(&rows, Kind::Flexible(TABLE_ORDER), &[]);
    let misfit = production.rms(&rows);
    let measured = baselines::measured_rms(&rows);
    if !(misfit < measured) {
        return Err(format!(
            "the model of this muscle misses the force by {misfit:.3} N, and all that was measured is {measured:.3} N: look at the \
             muscle's description and at the units before anything else"
        ));
    }
    remarks.extend(patterns_over_pressure(&production, &rows));
    Ok(Settled { rows, misfit })
}

/// The effects that were selected, out of which library, and how they do on held-out rows.
struct Outcome {
    library: Vec<Candidate>,
    selection: Selection,
    held: HeldOut,
    missing: Vec<Missing>,
}

/// Selects the effects that are missing; where the user gives some as known, fits these.
fn select(
    rows: &Rows,
    options: &Options,
    known: &BenchChecks,
    (blocked, step): (f64, f64),
    remarks: &mut Vec<String>,
) -> Outcome {
    let everything = library(rows, &options.added()).into_iter();
    let library: Vec<Candidate> = everything.filter(|c| !known.settles(c, &options.given)).collect();
    let given: Vec<usize> =
        options.given.iter().filter_map(|law| library.iter().position(|c| c.is(*law))).collect();
    let (selection, held) = if options.given.is_empty() {
        select_and_confirm(rows, &library, blocked, step)
    } else {
        known_effects::fitted(rows, &library, blocked, step, &given)
    };
    remarks.extend(selection.remarks.iter().cloned());
    if !selection.noise.from_repeats {
        remarks.push("no stroke is repeated under the same conditions: the noise is what the most flexible model leaves".to_owned());
    }
    let mut missing = missing(&selection, &library, &selection.rows);
    if !options.given.is_empty() {
        known_effects::judge(&mut missing, &selection, &held);
    }
    remarks.extend(missing.iter().filter_map(implausible_size));
    Outcome { library, selection, held, missing }
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
    fn of(selected: &Outcome, blocked: f64, step: f64, remarks: &mut Vec<String>) -> Self {
        let Outcome { library, selection, missing, .. } = selected;
        let sigma = selection.noise.sigma;
        let explained: f64 = if selection.excess_energy > 0.0 && !missing.is_empty() {
            ((energy(&selection.base_alone.residual) - energy(&selection.joint.residual))
                / selection.excess_energy)
                .clamp(0.0, 1.0)
        } else {
            0.0
        };
        let weight = energy(selection.rows.root_weight()).max(1e-12);
        let left = (energy(&selection.joint.residual) / weight - sigma * sigma).max(0.0).sqrt();
        let admitted = (LACK_OF_FIT * blocked).max(LACK_OF_FIT_NOISE * sigma);
        // What free tables take up where one bladder should serve all pressures.
        let taken_up = energy(&selection.base_alone.core) - energy(&selection.base_alone.residual);
        let concealed = (taken_up / weight).max(0.0).sqrt();
        if missing.is_empty() && concealed > LACK_OF_FIT * blocked {
            remarks.push(absorbed_by_tables(selection, library, concealed, blocked));
        }
        let restless = missing.is_empty() && selection.noise.exceeds_instruments(step, blocked);
        if restless {
            remarks.push(format!(
                "{}; no instrument scatters like this, and no effect of the library explains it: look at the air supply, at the stroke \
                 sensor's counts and at whatever is loose, then record two strokes under the same conditions again",
                selection.noise.words(blocked)
            ));
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
    pattern: String,
}

impl Located {
    fn of(selected: &Outcome, excess: &Excess, blocked: f64, step: f64) -> Self {
        let selection = &selected.selection;
        let (rows, sigma) = (&selection.rows, selection.noise.sigma);
        let line = spectrum::line(rows, &selection.joint.residual, &block_ranges(rows), step, 9)
            .filter(|l| l.p <= LINE_ALPHA && l.share >= LINE_SHARE);
        let (mut regions, profiles) =
            locate(rows, &selection.base_alone.residual, &selection.joint.residual, sigma, 7);
        let (left_regions, _) = locate(rows, &selection.joint.residual, &selection.joint.residual, sigma, 8);
        let pattern = match (&line, left_regions.first()) {
            (Some(l), _) => format!("periodic in time, {:.2} Hz", l.hertz),
            (None, Some(r)) if excess.left > excess.admitted => r.words.clone(),
            _ if excess.restless => selection.noise.words(blocked),
            _ => "none".to_owned(),
        };
        regions.extend(line.as_ref().map(|l| Region {
            coordinate: "frequency".into(),
            from: l.hertz - l.half,
            to: l.hertz + l.half,
            share: l.share,
            rows: 1.0,
            p: l.p,
            unit: "Hz".into(),
            words: format!("{:.0} % of the misfit repeats in time with {:.2} Hz", 100.0 * l.share, l.hertz),
        }));
        Self { line, regions, profiles, pattern }
    }
}

/// The verdict.
fn judge(selected: &Outcome, excess: &Excess, line: Option<&Line>) -> Verdict {
    let small = excess.left <= excess.admitted;
    if selected.missing.is_empty() {
        // A periodic residual is no noise, even where repeats seem to explain it; nor is a residual larger than any instrument's noise.
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
    selected: Outcome,
    located: Located,
    verdict: Verdict,
    remarks: Vec<String>,
) -> Diagnosis {
    let Measures { blocked, misfit, excess } = measures;
    let Outcome { library, selection, held, missing } = selected;
    let sigma = selection.noise.sigma;
    let consistent = verdict == Verdict::Consistent;
    let considered = considered(&selection, &library, &missing, sigma, blocked);
    let name = |candidate: usize| library[candidate].name().to_owned();
    let path = selection.selected.iter().map(|t| PathStep {
        effect: name(t.fit.candidate),
        rms_N: t.rms,
        p: t.p,
        runners_up: t.rivals.iter().map(|r| (name(r.0), r.1)).collect(),
    });
    Diagnosis {
        schema: "pam-diagnose/1".into(),
        muscle: options.muscle.clone(),
        samples: selection.rows.samples,
        judged: true,
        verdict,
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
        noise_memory_s: selection.noise.memory,
        remarks,
        profiles: located.profiles,
        trace: trace(&selection.rows, &selection),
    }
}

/// The remark on an amplitude beyond its known range, where a wrong description of the muscle imitates the effect.
fn implausible_size(m: &Missing) -> Option<String> {
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

/// The residual over time, on the rows that count.
fn trace(rows: &Rows, selection: &Selection) -> Trace {
    let judged: Vec<usize> = (0..rows.len()).filter(|i| rows.root_weight()[*i] > 0.0).collect();
    let pick: Vec<usize> =
        judged.iter().copied().step_by(judged.len().div_ceil(TRACE_POINTS).max(1)).collect();
    Trace {
        time: pick.iter().map(|i| rows.contexts()[*i].time).collect(),
        before: pick.iter().map(|i| selection.base_alone.residual[*i]).collect(),
        after: pick.iter().map(|i| selection.joint.residual[*i]).collect(),
        effects: pick.iter().map(|i| selection.traces.iter().map(|t| t[*i]).sum()).collect(),
    }
}
