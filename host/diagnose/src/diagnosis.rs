//! The diagnosis of a campaign: screen, settle rest friction, select, locate, judge.

use model_core::braid::{Braid, Geometry};
use model_core::effects::{Imitates, Info};

use super::baselines::{self, Kind, PushedRows};
use super::beginnings;
use super::bench_checks::BenchChecks;
use super::candidates::{Candidate, library};
use super::confirmation::select_and_confirm;
use super::criteria::baseline::{TABLE_ORDER, WALL};
use super::criteria::judgement::{
    EXPLAINED, EXPLAINED_REST, EXPLAINED_TURNS, EXPLAINED_UNSEEN, LACK_OF_FIT, LACK_OF_FIT_NOISE, LINE_ALPHA,
    LINE_SHARE, LINE_UNEXPLAINED, PARTLY_EXPLAINED, PLACE_SHARE, TRACE_POINTS,
};
use super::criteria::location::REGION_ALPHA;
use super::criteria::rows::{NO_LOAD, SLACK_MENTIONED, SLACK_ROUNDS};
use super::cross_validation::HeldOutRows;
use super::filtered_channels;
use super::findings::{considered, missing, unconfirmed};
use super::known_effects;
use super::linear::energy;
use super::location::{Location, block_ranges, locate};
use super::noise::Noise;
use super::options::Options;
use super::preconditions::{blocked_force, limitations, not_judged, unmet_precondition};
use super::remark::{Remark, Unjudgeable};
use super::resolution;
use super::rest_friction;
use super::rows::{self, Rows, SingleBladder};
use super::selection_step::Selection;
use super::spectrum::{self, Line};
use super::table_evidence::{absorbed_by_tables, patterns_over_pressure};
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
    with_baseline(campaign, geometry, options).map(|(diagnosis, _)| diagnosis)
}

/// The same, with the kind of the last baseline.
///
/// # Errors
/// As [`diagnose`].
pub(crate) fn with_baseline(
    campaign: &Campaign,
    geometry: &Geometry,
    options: &Options,
) -> Result<(Diagnosis, Kind)> {
    let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
    known_effects::check(&options.given)?;
    if campaign.samples() == 0 {
        return Err(Error::new(DataCode::RecordingEmpty, "the recordings hold no rows"));
    }
    let known = BenchChecks::of(&options.checks, campaign, &braid)?;
    let freed = known.free(campaign);
    let as_read = known.corrects_the_stroke().then_some(campaign);
    let (answer, kind) = ask(&freed, as_read, &braid, options, &known)?;
    let diagnosis = known.enter((answer, kind), &options.given, (&freed, as_read), &braid)?;
    Ok((diagnosis, kind))
}

/// The answer of the recordings, corrected for what checks of the bench measured; with the kind of the last baseline.
fn ask(
    campaign: &Campaign,
    as_read: Option<&Campaign>,
    braid: &Braid<f64>,
    options: &Options,
    known: &BenchChecks,
) -> Result<(Diagnosis, Kind)> {
    let (rows, mut remarks) = rows::prepare_corrected(campaign, as_read, braid)?;
    let rows = rows.watched(options.progress.clone());
    let (blocked, step) = (blocked_force(&rows), rows::typical_step(&rows));
    remarks.extend(limitations(&rows));
    let settled = match settle_at_a_wall(&rows, blocked, &mut remarks) {
        Some(at_a_wall) => Ok(at_a_wall),
        None => settle(&rows, blocked, PushedRows::Excluded, &mut remarks),
    };
    let Settled { rows, misfit } = match settled {
        Ok(settled) => settled,
        Err(reason) => return Ok((not_judged(&rows, options, remarks, reason, blocked), Kind::Stiff)),
    };
    let selected = select(&rows, options, known, (blocked, step), &mut remarks);
    let excess = Excess::of(&selected, blocked, step, &mut remarks);
    let coarse = resolution::of_stroke(&selected.selection.rows);
    if coarse > LACK_OF_FIT * blocked {
        let step = selected.selection.rows.stroke_step;
        remarks.push(Remark::CoarseStroke { step, force: coarse });
    }
    let located = Located::of(&selected, &excess, blocked, step);
    let verdict = judge(&selected, &excess, located.line.as_ref());
    let kind = selected.selection.joint.kind;
    let measures = Measures { blocked, misfit, excess };
    Ok((answer(options, measures, selected, located, verdict, remarks), kind))
}

/// The rows without those at which the muscle is slack; or why nothing can be judged.
fn screen(
    rows: &Rows,
    blocked: f64,
    pushed: PushedRows,
    remarks: &mut Vec<Remark>,
) -> Result<Rows, Unjudgeable> {
    if let Some(reason) = unmet_precondition(rows, blocked) {
        return Err(reason);
    }
    let mut screened = rows.clone();
    let mut slack = 0;
    for _ in 0..SLACK_ROUNDS {
        // Twice: the first fit still saw the slack rows.
        let fitted = baselines::fit(&screened, Kind::Stiff, &[]);
        let (without, masked) = baselines::without_load(&screened, &fitted, pushed);
        screened = without;
        slack += masked;
    }
    if slack * SLACK_MENTIONED > rows.len() {
        remarks.push(Remark::Slack(slack as f64 / rows.len() as f64));
    }
    unmet_precondition(&screened, blocked).map_or(Ok(screened), Err)
}

/// Rows whose friction at rest is known, and the error of the model as it was, N.
struct Settled {
    rows: Rows,
    misfit: f64,
}

/// Excludes slack rows, settles what friction does at rest, and fits the model as it was, or returns why nothing can be judged.
fn settle(
    rows: &Rows,
    blocked: f64,
    pushed: PushedRows,
    remarks: &mut Vec<Remark>,
) -> Result<Settled, Unjudgeable> {
    let screened = screen(rows, blocked, pushed, remarks)?;
    let (unmixed, filter) = filtered_channels::settle(&screened);
    let (ramps, turning) = rest_friction::settle_ramps(&unmixed);
    remarks.extend(filter.map(|over| Remark::FilteredChannels { over }));
    remarks.extend(turning.map(|law| Remark::FrictionTurns { over: law.most_done() }));
    let (rows, law) = rest_friction::settle_rest_friction(&ramps);
    remarks.extend(law.map(|law| Remark::FrictionAtRest(law.into())));
    // The model as it was: four orders, tables free over pressure.
    let production = baselines::fit(&rows, Kind::Flexible(TABLE_ORDER), &[]);
    let misfit = production.rms(&rows);
    let measured = baselines::measured_rms(&rows);
    if !(misfit < measured) {
        return Err(Unjudgeable::WrongModel { misfit, measured });
    }
    remarks.extend(patterns_over_pressure(&production, &rows));
    Ok(Settled { rows, misfit })
}

/// The rows with those at which the rig pushes the muscle, where these show a wall near full contraction: a force over the stroke alone,
/// which one bladder of many orders follows and the tables, which have few, do not. What the tables leave there is not noise, and a bladder
/// of many orders must not hide it.
fn settle_at_a_wall(rows: &Rows, blocked: f64, remarks: &mut Vec<Remark>) -> Option<Settled> {
    if rows.isometric || !rows.force.iter().any(|f| *f < -NO_LOAD * blocked) {
        return None;
    }
    let mut found = Vec::new();
    let Settled { rows, misfit } = settle(rows, blocked, PushedRows::Count, &mut found).ok()?;
    let stiffening = baselines::fit(&rows, Kind::Stiff, &[]).rms(&rows);
    if misfit * misfit - stiffening * stiffening <= (WALL * blocked).powi(2) {
        return None;
    }
    remarks.append(&mut found);
    remarks.push(Remark::Wall);
    Some(Settled { rows: rows.with_single_bladder(SingleBladder::AsTable), misfit })
}

/// The effects that were selected, out of which library, and how they do on held-out rows.
struct SelectionResult {
    library: Vec<Candidate>,
    selection: Selection,
    held_out: HeldOut,
    /// The error on held-out rows with the effects up to each of them, in the order of selection, N.
    steps: Vec<f64>,
    missing: Vec<Missing>,
}

/// Selects the effects that are missing; where the user gives some as known, fits these.
fn select(
    rows: &Rows,
    options: &Options,
    known: &BenchChecks,
    (blocked, step): (f64, f64),
    remarks: &mut Vec<Remark>,
) -> SelectionResult {
    let everything = library(rows, &options.added()).into_iter();
    let open = everything.filter(|c| !known.settles(c, &options.given));
    let library: Vec<Candidate> = open.map(|c| c.with_check(known.shows(&c))).collect();
    let given: Vec<usize> =
        options.given.iter().filter_map(|law| library.iter().position(|c| c.is(*law))).collect();
    let (selection, held_out) = if options.given.is_empty() {
        select_and_confirm(rows, &library, blocked, step)
    } else {
        known_effects::fitted(rows, &library, blocked, step, &given)
    };
    remarks.extend(selection.remarks.iter().cloned());
    let selected: Vec<&Info> = selection.selected.iter().map(|s| library[s.fit.candidate].info).collect();
    remarks.extend(beginnings::remarks(&selection.rows, &selected));
    if !selection.noise.from_repeats {
        remarks.push(Remark::NoRepeats);
    }
    let mut missing = missing(&selection, &library, &selection.rows);
    if !options.given.is_empty() {
        known_effects::judge(&mut missing, &selection, &held_out);
    }
    remarks.extend(missing.iter().filter_map(implausible_size));
    let steps = steps_on_held_out(&selection, &held_out);
    SelectionResult { library, selection, held_out, steps, missing }
}

/// The error on held-out rows with the effects up to each of them, in the order of selection, beside the base refitted, N.
fn steps_on_held_out(selection: &Selection, held_out: &HeldOut) -> Vec<f64> {
    let Selection { rows, joint, traces, .. } = selection;
    if traces.len() < 2 {
        return vec![held_out.rms_after_N; traces.len()];
    }
    let unseen = HeldOutRows::new(rows, joint.kind, traces);
    let before_last = (1..traces.len()).map(|n| unseen.error(&traces[..n]));
    before_last.chain([held_out.rms_after_N]).collect()
}

/// The error above the noise, and what became of it.
struct Excess {
    /// Share of it that the selected effects explain.
    explained: f64,
    /// Root mean square of the residual, N.
    left: f64,
    /// What the model admits of it, root mean square, N.
    admitted: f64,
    /// Whether the force does not repeat, more than instruments scatter, and nothing explains it.
    restless: bool,
    /// Whether more is left than the model admits, without a name, and remembers longer than the noise of an instrument.
    lasts: bool,
}

impl Excess {
    fn of(selected: &SelectionResult, blocked: f64, step: f64, remarks: &mut Vec<Remark>) -> Self {
        let SelectionResult { library, selection, missing, .. } = selected;
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
        // What free tables absorb where one bladder has to serve all pressures.
        let taken_up = energy(&selection.base_alone.core) - energy(&selection.base_alone.residual);
        let concealed = (taken_up / weight).max(0.0).sqrt();
        if missing.is_empty() && concealed > LACK_OF_FIT * blocked {
            remarks.push(absorbed_by_tables(selection, library, concealed, blocked));
        }
        let restless = missing.is_empty() && selection.noise.exceeds_instruments(step, blocked);
        if restless {
            remarks.push(Remark::NotRepeatable(selection.noise.scatter(blocked)));
        }
        let lasts = missing.is_empty() && left > admitted && selection.noise.remembers(step);
        Self { explained, left, admitted, restless, lasts }
    }
}

/// Where the error is concentrated.
struct Located {
    /// A line in its spectrum.
    line: Option<Line>,
    regions: Vec<Region>,
    profiles: Vec<Profile>,
    /// The pattern of the residual.
    pattern: Pattern,
}

impl Located {
    fn of(selected: &SelectionResult, excess: &Excess, blocked: f64, step: f64) -> Self {
        let selection = &selected.selection;
        let (rows, sigma) = (&selection.rows, selection.noise.sigma);
        let line = spectrum::line(rows, &selection.joint.residual, &block_ranges(rows), step, 9)
            .filter(|l| l.p <= LINE_ALPHA && l.share >= LINE_SHARE);
        let Location { mut regions, profiles, .. } =
            locate(rows, &selection.base_alone.residual, &selection.joint.residual, sigma, 7);
        let left = locate(rows, &selection.joint.residual, &selection.joint.residual, sigma, 8);
        // Noise that lasts is larger in one place than in another by chance.
        let is_place = |r: &Region| !excess.lasts || r.share >= PLACE_SHARE && left.p <= REGION_ALPHA;
        let pattern = match (&line, left.regions.first()) {
            (Some(l), _) => Pattern::Periodic(l.hertz),
            (None, Some(r)) if excess.left > excess.admitted && is_place(r) => {
                Pattern::Region(Box::new(r.clone()))
            }
            _ if excess.restless => Pattern::NotRepeatable(selection.noise.scatter(blocked)),
            // It exceeds the noise of repeats, has no place and no period, and no effect fits: noise that lasts.
            _ if excess.lasts => {
                let sigma = excess.left.hypot(sigma);
                Pattern::NotRepeatable(Noise { sigma, ..selection.noise }.scatter(blocked))
            }
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
            recordings: Vec::new(),
        }));
        Self { line, regions, profiles, pattern }
    }
}

/// The verdict.
fn judge(selected: &SelectionResult, excess: &Excess, line: Option<&Line>) -> Verdict {
    let small = excess.left <= excess.admitted;
    if selected.missing.is_empty() {
        // A periodic residual is not noise, even where repeats seem to explain it; nor is a residual larger than any instrument's noise.
        let steady = line.is_none_or(|l| l.share < LINE_UNEXPLAINED) && !excess.restless;
        if small && steady { Verdict::Consistent } else { Verdict::Unexplained }
    } else if (excess.explained >= EXPLAINED || small)
        && removes_on_unseen(&selected.held_out, excess.admitted)
    {
        Verdict::Explained
    } else if excess.explained >= PARTLY_EXPLAINED || small {
        Verdict::PartlyExplained
    } else {
        Verdict::Unexplained
    }
}

/// Whether the effects remove most of the excess error on held-out rows, or leave no more than the model admits (N), and do no harm
/// about the reversals.
fn removes_on_unseen(held_out: &HeldOut, admitted: f64) -> bool {
    let excess = |rms: f64| (rms.powi(2) - held_out.noise_N.powi(2)).max(0.0);
    let (before, after) = (excess(held_out.rms_before_N), excess(held_out.rms_after_N));
    let near_noise = held_out.rms_after_N <= EXPLAINED_REST * held_out.noise_N;
    let harmless = held_out.with_turns_after_N <= EXPLAINED_TURNS * held_out.with_turns_before_N;
    harmless && (after <= admitted.powi(2) || near_noise && after <= (1.0 - EXPLAINED_UNSEEN) * before)
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
    selected: SelectionResult,
    located: Located,
    verdict: Verdict,
    remarks: Vec<Remark>,
) -> Diagnosis {
    let Measures { blocked, misfit, excess } = measures;
    let SelectionResult { library, selection, held_out, steps, missing } = selected;
    let sigma = selection.noise.sigma;
    let consistent = verdict == Verdict::Consistent;
    let considered = considered(&selection, &library, &missing, sigma, blocked);
    let unconfirmed = unconfirmed(&selection, &library);
    let name = |candidate: usize| library[candidate].name().to_owned();
    let path = selection.selected.iter().zip(steps).map(|(t, step)| PathStep {
        effect: name(t.fit.candidate),
        rms_N: t.rms,
        held_out_rms_N: Some(step),
        p: t.p,
        runners_up: t.competitors.iter().map(|r| (name(r.0), r.1)).collect(),
    });
    Diagnosis {
        muscle: options.muscle.clone(),
        samples: selection.rows.samples,
        outcome: Outcome::Judged(verdict),
        noise_N: sigma,
        misfit_rms_N: misfit,
        r#where: if consistent { Vec::new() } else { located.regions },
        missing,
        unexplained: Unexplained {
            share: if consistent { 0.0 } else { 1.0 - excess.explained },
            pattern: located.pattern,
            unconfirmed,
        },
        held_out,
        next_experiment: None,
        considered,
        path: path.collect(),
        blocked_force_N: blocked,
        noise_memory_s: selection.noise.memory,
        remarks,
        profiles: located.profiles,
        trace: trace(&selection.rows, &selection),
        beginning: selection.rows.beginning(),
        history: None,
    }
}

/// The remark on an amplitude beyond its known range, where a wrong description of the muscle imitates the effect.
fn implausible_size(m: &Missing) -> Option<Remark> {
    let beyond = m.parameters.iter().any(|p| p.outside_known_range && p.value != 0.0);
    let imitates = Law::from_name(&m.effect).and_then(|law| law.traits().imitates);
    (beyond && imitates == Some(Imitates::Description)).then(|| Remark::CheckDescription(m.effect.clone()))
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
