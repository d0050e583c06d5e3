//! From a campaign to the answer.

use std::sync::Arc;

use model_core::braid::{Braid, Geometry};

use super::baselines::{self, Kind};
use super::candidates::{self, library};
use super::frequency;
use super::given;
use super::held_out::{HELPS, Unseen};
use super::known::Known;
use super::linear::energy;
use super::locate::{block_ranges, locate};
use super::named::{considered, missing};
use super::rest;
use super::rows::{self, Rows};
use super::search::search;
use super::select::{self, Found};
use super::verdict::{
    Considered, Diagnosis, HeldOut, Missing, PathStep, Region, Trace, Unexplained, Verdict,
};
use crate::bench::Candidate as Law;
use crate::checks::Checks;
use crate::counted::counted;
use crate::error::{Code, Error, Result};
use crate::progress::Progress;
use crate::recording::Campaign;

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
    pub progress: Arc<Progress>,
}

/// An answer, and the baseline that it was given with.
pub(super) struct Asked {
    pub diagnosis: Diagnosis,
    pub kind: Kind,
}

/// Lack of fit that the model admits beside the pure error of repeats, rms as a share of the blocked force: friction by its sign
/// alone where contacts give a little before they slide, and what a bladder of four orders leaves.
const INEXACTNESS: f64 = 1.5e-3;

/// Fewest rows and half-strokes from which anything is judged.
const FEWEST_ROWS: usize = 60;
const FEWEST_BLOCKS: usize = 6;

/// A gauge that never reads more than this, Pa, is dead or was never connected: vented, a muscle does not pull.
const VENTED: f64 = 1e3;

/// Finds out what the model leaves out of a campaign of recordings.
///
/// # Errors
/// Recordings without force or without rows, or an impossible geometry.
pub fn diagnose(campaign: &Campaign, geometry: &Geometry, options: &Options) -> Result<Diagnosis> {
    let braid = geometry.build().map_err(|e| Error::new(Code::MuscleInvalid, e.to_string()))?;
    given::check(&options.given)?;
    if campaign.samples() == 0 {
        return Err(Error::new(Code::RecordingEmpty, "the recordings hold no rows"));
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
    rows.progress = Arc::clone(&options.progress);
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
    let production = baselines::fit(&rows, Kind::Flexible(4), &[]);
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
    let own = (INEXACTNESS * blocked).max(0.6 * sigma);
    let beat = frequency::line(&rows, &found.full.residual, &block_ranges(&rows), step, 9)
        .filter(|l| l.p <= 0.02 && l.share >= 0.15);
    // What free tables take up where one bladder should serve all pressures.
    let taken_up = energy(&found.bare.core) - energy(&found.bare.residual);
    let concealed = (taken_up / weight).max(0.0).sqrt();
    if missing.is_empty() && concealed > INEXACTNESS * blocked {
        remarks.push(in_the_tables(&found, &library, concealed, blocked));
    }
    let verdict = if missing.is_empty() {
        // What beats in time is no noise, however well repeats seem to explain it.
        let steady = beat.is_none_or(|l| l.share < 0.3);
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
        (Some(l), _) => format!("periodic in time, {:.2} Hz", l.hertz),
        (None, Some(r)) if left > own => r.words.clone(),
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
    };
    Ok(Asked { diagnosis, kind: found.full.kind })
}

/// Gains and offsets that a wrong description of the muscle imitates.
const LIKE_A_DESCRIPTION: [&str; 5] =
    ["force-gain", "gauge-gain", "displacement-offset", "braid-elasticity", "tip-effect"];

/// What to look at before a fault of that size is believed.
fn beyond_instruments(m: &Missing) -> Option<String> {
    let beyond = m.parameters.iter().any(|p| p.outside_known_range && p.value != 0.0);
    (beyond && LIKE_A_DESCRIPTION.contains(&m.effect.as_str())).then(|| {
        format!(
            "{} of this size is more than anybody has met: look first at the muscle's description (diameter, braid angle, rest length, \
             wall) and at the units; a wrong one looks like this",
            m.effect
        )
    })
}

/// What to say where the tables differ between pressures more than a bladder does, and nothing can be named for it.
fn in_the_tables(found: &Found, library: &[candidates::Candidate], concealed: f64, blocked: f64) -> String {
    let mut able: Vec<&candidates::Trial> =
        found.first_look.iter().filter(|t| t.score >= select::LEAST_SCORE).collect();
    able.sort_by(|a, b| b.score.total_cmp(&a.score));
    let names: Vec<&str> = able.iter().take(6).map(|t| library[t.candidate].name()).collect();
    let which = if names.is_empty() {
        "no effect of the library makes such a surface".to_owned()
    } else {
        format!(
            "each of these would make such a surface: {}; none of them stands out enough to be named",
            names.join(", ")
        )
    };
    format!(
        "one bladder does not serve all pressures: the tables take up {concealed:.2} N rms ({:.2} % of blocked force) that changes \
         from pressure to pressure; {which}. Tested pressures are described well; between them and beyond, trust the tables less",
        100.0 * concealed / blocked
    )
}

/// What the fitted tables themselves betray: flexible tables swallow physics, and keep its pattern over pressure.
fn tables_as_evidence(production: &baselines::Baseline, rows: &Rows) -> Vec<String> {
    let mut remarks = Vec::new();
    let levels = &rows.levels;
    if !rows.steady || levels.len() < 4 {
        return remarks;
    }
    let fit_to = |values: &[f64], of: &dyn Fn(f64) -> f64| -> Option<(f64, f64, f64)> {
        let n = values.len() as f64;
        let x: Vec<f64> = levels.iter().map(|p| of(*p)).collect();
        let (mx, my) = (x.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
        let sxx: f64 = x.iter().map(|v| (v - mx).powi(2)).sum();
        let sxy: f64 = x.iter().zip(values).map(|(a, b)| (a - mx) * (b - my)).sum();
        let syy: f64 = values.iter().map(|v| (v - my).powi(2)).sum();
        (sxx > 0.0 && syy > 0.0).then(|| (my - sxy / sxx * mx, sxy / sxx, sxy * sxy / (sxx * syy)))
    };
    let k_f = &production.friction_nodes;
    if let (Some((a, b, by_inverse)), Some((_, _, straight))) =
        (fit_to(k_f, &|p| 1.0 / p), fit_to(k_f, &|p| p))
    {
        let lowest = b / levels[0];
        if by_inverse > 0.97 && by_inverse > straight + 0.02 && b > 0.0 && lowest > 0.5 * a.abs() {
            remarks.push(format!(
                "k_F(P) follows {a:.3} + {:.1} kPa/P: what a friction that does not scale with the force (dry, seal, viscous at one \
                 speed) leaves in the tables",
                b * 1e-3
            ));
        }
    }
    if let Some(e_1) = production.elastic_nodes.first()
        && let Some((a, b, share)) = fit_to(e_1, &|p| p)
    {
        let change = b * (levels[levels.len() - 1] - levels[0]);
        if share > 0.9 && change.abs() > 0.3 * a.abs() {
            remarks.push(format!(
                "E_1 {} in a straight line with pressure, by {:.0} % over the range: one bladder should not; ends that are not \
                 cylinders, a braid that stretches, a gain or a slow change in the order of testing leave this",
                if change > 0.0 { "rises" } else { "falls" },
                100.0 * change.abs() / a.abs().max(1e-9)
            ));
        }
    }
    remarks
}

/// The scale of forces: what the highest pressure would give at rest length, or the largest force seen.
fn blocked_force(rows: &Rows) -> f64 {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let by_pressure = rows.contexts.iter().map(|c| c.pressure * c.area).fold(0.0, f64::max);
    // An outlier must not set the scale.
    if by_pressure > 0.0 { strongest.min(1.3 * by_pressure) } else { strongest }
}

fn cannot_be_judged(rows: &Rows, blocked: f64) -> Option<String> {
    let effective = rows.effective();
    if effective < FEWEST_ROWS {
        let usable =
            if effective == 0 { "no row".to_owned() } else { format!("only {}", counted(effective, "row")) };
        return Some(format!(
            "{usable} can be used (direction known, muscle not slack); {FEWEST_ROWS} is the least"
        ));
    }
    if rows.blocks < FEWEST_BLOCKS {
        return Some(format!(
            "only {}: with fewer than {FEWEST_BLOCKS} chance and physics cannot be told apart",
            counted(rows.blocks, "half-stroke")
        ));
    }
    let judged = || rows.root_weight.iter().zip(&rows.contexts).filter(|(w, _)| **w > 0.0);
    let highest = judged().map(|(_, c)| c.pressure).fold(f64::NEG_INFINITY, f64::max);
    if highest <= VENTED {
        return Some(format!(
            "the pressure never rises above {:.1} kPa, where no muscle pulls: look at the gauge and at the unit",
            highest * 1e-3
        ));
    }
    let (lo, hi) = rows
        .force
        .iter()
        .zip(&rows.root_weight)
        .filter(|(_, w)| **w > 0.0)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (f, _)| (l.min(*f), h.max(*f)));
    if !(hi - lo > 1e-6 * blocked.abs().max(1e-9)) || !(blocked > 0.0) {
        return Some("the force is constant or never pulls: there is nothing to explain".to_owned());
    }
    None
}

fn what_can_be_judged(rows: &Rows) -> Vec<String> {
    let mut remarks = Vec::new();
    if rows.isometric {
        remarks.push(
            "the length was held throughout: speed, viscous friction, inertia and first strokes cannot be judged".to_owned(),
        );
    }
    if rows.levels.len() < 2 {
        remarks.push(
            "one pressure only: what scales with pressure cannot be told from what does not".to_owned(),
        );
    }
    if !rows.has_temperature {
        remarks.push("no temperature was recorded: warming shows only as a slow change".to_owned());
    }
    let moving = rows.sign.iter().filter(|s| **s > 0.0).count();
    let back = rows.sign.iter().filter(|s| **s < 0.0).count();
    if moving + back > 0 && moving.min(back) * 50 < rows.len() {
        remarks.push("the muscle moves one way only: friction cannot be judged".to_owned());
    }
    if !rows.vented.iter().any(|v| *v) {
        remarks.push(
            "no vented stretch: an offset of the load cell cannot be told from the model's own surface"
                .to_owned(),
        );
    }
    remarks
}

fn no_judgement(
    rows: &Rows,
    options: &Options,
    mut remarks: Vec<String>,
    reason: String,
    blocked: f64,
) -> Diagnosis {
    remarks.insert(0, format!("nothing can be judged: {reason}"));
    let considered = library(rows)
        .iter()
        .map(|c| Considered {
            effect: c.name().into(),
            gain: 0.0,
            why_not: "these recordings cannot show it".into(),
            hidden_up_to_N: None,
            checked: false,
            visible: 0.0,
        })
        .collect();
    Diagnosis {
        schema: "pam-diagnose/1".into(),
        muscle: options.muscle.clone(),
        samples: rows.samples,
        judged: false,
        verdict: Verdict::Consistent,
        noise_N: 0.0,
        misfit_rms_N: 0.0,
        r#where: Vec::new(),
        missing: Vec::new(),
        unexplained: Unexplained { share: 0.0, pattern: "none".into() },
        held_out: HeldOut {
            split: "none: nothing was fitted".into(),
            rms_before_N: 0.0,
            rms_after_N: 0.0,
            noise_N: 0.0,
            with_turns_before_N: 0.0,
            with_turns_after_N: 0.0,
        },
        next_experiment: None,
        considered,
        path: Vec::new(),
        blocked_force_N: if blocked.is_finite() { blocked } else { 0.0 },
        noise_memory_s: 0.0,
        remarks,
        profiles: Vec::new(),
        trace: Trace { time: Vec::new(), before: Vec::new(), after: Vec::new(), effects: Vec::new() },
    }
}

/// So many first names may fail on unseen rows before none is named: where several laws fit the rows at hand alike, the one that
/// fits them best need not be the one that holds on others.
const MOST_REFUSED: usize = 3;

/// What the search finds and unseen rows confirm, with the error on these rows.
fn confirmed(
    rows: &mut Rows,
    library: &[candidates::Candidate],
    blocked: f64,
    step: f64,
) -> (Found, HeldOut) {
    let mut refused = Vec::new();
    let mut remarks = Vec::new();
    loop {
        let mut found = search(rows, library, blocked, step, &refused);
        let first = found.taken.first().map(|t| t.trial.candidate);
        let held = keep_what_helps(&mut found, rows, library);
        match first {
            Some(candidate) if found.taken.is_empty() && refused.len() < MOST_REFUSED => {
                refused.push(candidate);
                remarks.append(&mut found.remarks);
            }
            _ => {
                remarks.append(&mut found.remarks);
                found.remarks = remarks;
                return (found, held);
            }
        }
    }
}

/// Drops effects, the last taken first, that do not improve rows which the fit had not seen; gives the error on these rows.
fn keep_what_helps(found: &mut Found, rows: &mut Rows, library: &[candidates::Candidate]) -> HeldOut {
    let sigma = found.noise.sigma;
    loop {
        let unseen = Unseen::new(rows, found.full.kind, &found.traces);
        let with = unseen.held_out(&found.traces, sigma);
        let Some(fewer) = found.traces.len().checked_sub(1) else { return with };
        let before = if fewer == 0 { with.rms_before_N } else { unseen.error(&found.traces[..fewer]) };
        // An effect that takes a third of what is above the noise lowers the whole by more than this.
        if with.rms_after_N < HELPS * before {
            return with;
        }
        let name = found.taken.last().map_or("", |t| library[t.trial.candidate].name());
        found.remarks.push(format!(
            "{name} fits these recordings but does not improve rows that the fit had not seen ({before:.3} N without it, {:.3} N with \
             it): it is not named",
            with.rms_after_N
        ));
        found.drop_last(rows, library);
    }
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
