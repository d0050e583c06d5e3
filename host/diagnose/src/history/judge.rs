//! From the fits to the answer: the rules of the verdict, and each finding.

use super::Fits;
use super::answer::{
    ErrorSize, Estimate, Finding, FindingDetail, ForceOverTime, History, LayerName, LayerShare, MemoryLaw,
    MemoryRefusal, Mounting, RunError, StaticCurve, UnseenRuns,
};
use super::campaign::Points;
use super::criteria::{
    FIRST_RUN_WAYS, JUDGE_LOADED_LONG, JUDGE_PICTURED, LEAST_GAIN, MEMORY_LEAST_SHARE, TIMES,
};
use super::findings::{self, Contrast, Visits};
use super::hysteresis;
use super::law::Law;
use super::shift_fit::knot_step;
use super::slack_reading::SlackReading;
use super::unseen::{Sizes, Unseen};
use model_core::effects::EffectName;
use pam_data::recording::Campaign;
use pam_fit::bench::Candidate;
use pam_fit::numerics::student::half_width_95;

/// Share by which the squared error falls.
fn gain(before: Sizes, after: Sizes) -> f64 {
    if before.rms > 0.0 { 1.0 - (after.rms / before.rms).powi(2) } else { 0.0 }
}

/// The whole answer.
pub(super) fn answer(points: &Points, fits: &Fits<'_>, campaign: &Campaign, rest_length: f64) -> History {
    let (law, unseen) = fits.best();
    let share = unseen.standard_error(|l| l.fit.theta[0]);
    let quantile = half_width_95(unseen.folds.len().saturating_sub(1));
    let unseen_runs = unseen_runs(points, fits);
    let why_not = why_not(points, fits, law, quantile * share);
    let named = why_not.is_empty();
    let visits = Visits::new(points);
    History {
        named,
        why_not,
        points: points.len(),
        averaged: points.averaged,
        largest_force_N: points.largest_force(),
        friction: None,
        mountings: mountings(points, fits, law, rest_length),
        law: memory_law(points, fits, law, unseen, quantile),
        unseen: unseen_runs,
        runs: runs(points, fits, law, unseen, campaign),
        findings: all_findings(points, fits, &visits, named, quantile * share),
        layers: layers(points, fits),
        force_over_time: force_over_time(points, fits, law, rest_length),
        full_length_slope_N_per_kPa: findings::full_length_slope(points),
    }
}

/// The rules of a named memory that do not hold.
fn why_not(points: &Points, fits: &Fits<'_>, law: &Law, half: f64) -> Vec<MemoryRefusal> {
    let share = law.fit.theta[0];
    let supported = points.supported();
    let counts = |i: usize| supported[i] && fits.by_direction.predicted[i].is_finite();
    let (_, unseen) = fits.best();
    // An effect that runs need beside the memory would hide what the memory does for them.
    let needed = fits.needed.as_ref();
    let after = needed.map_or(unseen, |n| &n.with_memory).sizes(points, counts);
    let mut why = Vec::new();
    if !(share >= MEMORY_LEAST_SHARE) {
        why.push(MemoryRefusal::SmallShare { share, least: MEMORY_LEAST_SHARE });
    }
    if !(share > half) {
        why.push(MemoryRefusal::UncertainShare { share, half });
    }
    let statics = [
        (&fits.by_direction, StaticCurve::ByMountingAndDirection),
        (needed.map_or(&fits.plain, |n| &n.alone), StaticCurve::ByMounting),
    ];
    for (one, against) in statics {
        let gain = gain(one.sizes(points, counts), after);
        if !(gain >= LEAST_GAIN) {
            why.push(MemoryRefusal::SmallGain { against, gain, least: LEAST_GAIN });
        }
    }
    why
}

fn mountings(points: &Points, fits: &Fits<'_>, law: &Law, rest_length: f64) -> Vec<Mounting> {
    points
        .mountings
        .iter()
        .enumerate()
        .map(|(m, own)| Mounting {
            number: m + 1,
            length_mm: 1e3 * (rest_length - own.stroke),
            contraction: own.contraction,
            runs: own.runs.len(),
            threshold_kPa: fits.layer.thresholds[m],
            carried_kPa: fits.layer.carried(m, law.balance),
        })
        .collect()
}

fn memory_law(points: &Points, fits: &Fits<'_>, law: &Law, unseen: &Unseen, quantile: f64) -> MemoryLaw {
    let error = |quantity: &dyn Fn(&Law) -> f64| quantile * unseen.standard_error(quantity);
    let free = fits.layer.balance_is_free;
    MemoryLaw {
        relaxed_share: Estimate::new(law.fit.theta[0], Some(error(&|l| l.fit.theta[0])), "", "run"),
        balance_pressure: Estimate::new(law.balance, free.then(|| error(&|l| l.balance)), "kPa", "run"),
        balance_identifiable: free,
        time_constants_s: TIMES.to_vec(),
        pause_s: (!points.pauses_known()).then(|| fits.layer.clocks[law.choice.pause].0),
        loaded_before_s: law.choice.loaded,
        one_time_constant_ratio: fits.single,
    }
}

fn unseen_runs(points: &Points, fits: &Fits<'_>) -> UnseenRuns {
    let largest = points.largest_force().max(f64::MIN_POSITIVE);
    let size = |s: Sizes| ErrorSize {
        rms_N: s.rms,
        rms_pct: 100.0 * s.rms / largest,
        mean_pct: 100.0 * s.mean / largest,
        points: s.count,
    };
    let supported = points.supported();
    // Both over the same points.
    let all = |i: usize| fits.by_direction.predicted[i].is_finite() && fits.memory.predicted[i].is_finite();
    let near = |i: usize| all(i) && supported[i];
    let (before, after) = (fits.by_direction.sizes(points, near), fits.memory.sizes(points, near));
    UnseenRuns {
        without_memory: size(fits.by_direction.sizes(points, all)),
        with_memory: size(fits.memory.sizes(points, all)),
        supported_without: size(before),
        supported_with: size(after),
        with_slips: fits.with_slips.as_ref().map(|(_, u)| size(u.sizes(points, all))),
        gain: gain(before, after),
    }
}

fn runs(points: &Points, fits: &Fits<'_>, law: &Law, unseen: &Unseen, campaign: &Campaign) -> Vec<RunError> {
    let since = &fits.layer.clocks[law.choice.pause].1.since;
    let mean = |unseen: &Unseen, from: usize, to: usize| {
        let own = (from..to).filter(|i| points.direction[*i] == 1).map(|i| unseen.error(points, i));
        let finite: Vec<f64> = own.filter(|e| e.is_finite()).collect();
        finite.iter().sum::<f64>() / finite.len().max(1) as f64
    };
    points
        .runs
        .iter()
        .enumerate()
        .map(|(r, run)| {
            let (from, to) = run.points;
            let own = |i: usize| (from..to).contains(&i);
            RunError {
                name: campaign.recordings[run.recording].name.clone(),
                mounting: run.mounting + 1,
                run: run.number,
                since_mounting_s: since.get(from).copied().unwrap_or(0.0),
                mean_before_N: mean(&fits.by_direction, from, to),
                mean_after_N: mean(unseen, from, to),
                rms_before_N: fits.by_direction.sizes(points, own).rms,
                rms_after_N: unseen.sizes(points, own).rms,
                offset_kPa: Some(fits.offsets[r]).filter(|o| o.is_finite()),
            }
        })
        .collect()
}

fn all_findings(points: &Points, fits: &Fits<'_>, visits: &Visits, named: bool, half: f64) -> Vec<Finding> {
    let mut found = Vec::new();
    found.extend(first_run(points, fits, visits, named));
    found.push(creep(points, fits, named, half));
    found.extend(hysteresis::finding(points, fits, visits, named));
    found.extend(fits.events.iter().map(|e| {
        let half = if e.lasts {
            half_width_95(fits.memory.folds.len().saturating_sub(1)) * e.error
        } else {
            2.0 * e.error
        };
        Finding {
            found: e.sure,
            size: Estimate::new(e.shift, Some(half), "kPa", "run"),
            units: points.mountings[e.mounting].runs.len(),
            squares: 0.0,
            cause: (e.lasts && e.sure).then_some(Candidate::Muscle(EffectName::EndSlip)),
            alternatives: Vec::new(),
            mounting: Some(e.mounting + 1),
            run: Some(e.run),
            detail: FindingDetail::Shift {
                lasts: e.lasts,
                shortened_mm: 1e3 * points.mountings[e.mounting].stroke,
            },
        }
    }));
    found.extend(fits.slack_reading.as_ref().map(SlackReading::finding));
    let loaded = fits.best().0.choice.loaded;
    if named && loaded >= JUDGE_LOADED_LONG {
        found.push(Finding {
            found: true,
            size: Estimate::new(loaded, None, "s", "run"),
            units: 0,
            squares: 0.0,
            cause: None,
            alternatives: Vec::new(),
            mounting: None,
            run: None,
            detail: FindingDetail::LoadedBefore,
        });
    }
    found
}

fn estimate(contrast: &Contrast, of: &str) -> Estimate {
    Estimate::new(contrast.mean, contrast.half, "N", of)
}

fn first_run(points: &Points, fits: &Fits<'_>, visits: &Visits, named: bool) -> Option<Finding> {
    let deficit = findings::first_run_deficit(points, visits)?;
    let later = findings::later_differences(points, visits);
    let firsts = findings::first_differences(points, visits);
    // Every first difference above every later one: by chance once in the number of ways to choose them.
    let least = firsts.iter().copied().fold(f64::INFINITY, f64::min);
    let above =
        later.iter().all(|l| *l < least) && findings::ways(firsts.len(), later.len()) >= FIRST_RUN_WAYS;
    let found = deficit.mean > 0.0 && (deficit.is_positive() || above);
    let (_, unseen) = fits.best();
    let left = findings::first_run_left(points, &unseen.predicted);
    Some(Finding {
        found,
        size: estimate(&deficit, "mounting"),
        units: deficit.units,
        squares: deficit.squares,
        cause: (found && named).then_some(Candidate::Muscle(EffectName::LogCreep)),
        alternatives: Vec::new(),
        mounting: None,
        run: Some(1),
        detail: FindingDetail::FirstRun { left: left.filter(|_| found && named) },
    })
}

fn creep(points: &Points, fits: &Fits<'_>, named: bool, half: f64) -> Finding {
    let (law, _) = fits.best();
    let share = law.fit.theta[0];
    let plateau = findings::plateau_creep(points).filter(|p| p.units > 2);
    Finding {
        found: named,
        size: Estimate::new(share, Some(half), "", "run"),
        units: points.runs.len(),
        squares: 0.0,
        cause: named.then_some(Candidate::Muscle(EffectName::LogCreep)),
        alternatives: Vec::new(),
        mounting: None,
        run: None,
        detail: FindingDetail::Creep { decades: TIMES.len(), plateau: plateau.map(|p| estimate(&p, "run")) },
    }
}

/// What each layer takes of the squared error of supported points of unseen runs.
fn layers(points: &Points, fits: &Fits<'_>) -> Vec<LayerShare> {
    let supported = points.supported();
    let square = |unseen: &Unseen| {
        let counts = |i: usize| supported[i] && fits.memory.predicted[i].is_finite();
        unseen.sizes(points, counts).rms.powi(2)
    };
    let none = square(&fits.plain);
    if !(none > 0.0) {
        return Vec::new();
    }
    let share = |part: f64, of: f64| if of > 0.0 { part / of } else { 0.0 };
    let memory = square(&fits.memory);
    let mut layers = Vec::new();
    let mut left = memory;
    match (&fits.with_slips, &fits.slips_alone) {
        (Some((_, both)), Some(slips)) => {
            let (both, slips) = (square(both), square(slips));
            layers.push((LayerName::Memory, share(none - memory, none), share(slips - both, slips)));
            layers.push((LayerName::Slips, share(memory - both, none), share(memory - both, memory)));
            left = both;
        }
        _ => layers.push((LayerName::Memory, share(none - memory, none), share(none - memory, none))),
    }
    layers.push((LayerName::NotExplained, share(left, none), share(left, none)));
    let entry = |(layer, in_order, last_in): (LayerName, f64, f64)| LayerShare { layer, in_order, last_in };
    layers.into_iter().map(entry).collect()
}

/// Force over time at one pressure, of each mounting that pulls there.
fn force_over_time(points: &Points, fits: &Fits<'_>, law: &Law, rest_length: f64) -> Vec<ForceOverTime> {
    let step = knot_step(points.highest());
    let pressure = (JUDGE_PICTURED * points.highest() / step).round() * step;
    let since = &fits.layer.clocks[law.choice.pause].1.since;
    let shift = |i: usize| -> f64 { law.columns.iter().zip(&law.fit.theta).map(|(q, t)| q[i] * t).sum() };
    (0..points.mountings.len())
        .map(|m| {
            let near = (0..points.len())
                .filter(|i| points.mounting[*i] == m && (points.pressure[*i] - pressure).abs() <= 0.5 * step);
            let mut curve = ForceOverTime {
                mounting: m + 1,
                length_mm: 1e3 * (rest_length - points.mountings[m].stroke),
                pressure_kPa: pressure,
                time_s: Vec::new(),
                force_N: Vec::new(),
                law_N: Vec::new(),
            };
            for i in near {
                let at_pressure = fits.layer.spline.at(pressure + shift(i)).value(&law.fit.curves[m]);
                let moved = at_pressure - fits.layer.predict(law, i);
                curve.time_s.push(since[i]);
                curve.force_N.push(points.force[i] + moved);
                curve.law_N.push(at_pressure);
            }
            curve
        })
        .filter(|c| c.time_s.len() > 3)
        .collect()
}
