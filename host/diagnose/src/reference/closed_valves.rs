//! A leak, by the pressure that closed valves lose.
//!
//! Between the pulses of a staircase the valves are closed. There the pressure changes by what the gas does after a step, which cools after
//! filling and warms after venting, and by the leak, in proportion to itself: `dP/dt = … − λ·P`. What the gas does depends on the pressure,
//! the step and its direction; so each rest is compared with rests of BEFORE that are similar in these, and a run's change of rate is
//!
//! ```text
//! λ = −Σ P·(dP/dt − mean of BEFORE) / Σ P²
//! ```
//!
//! Other pulses have no similar rests, and show no change. A regulator that replaces what is lost hides the leak: its rests have no slope on
//! either side.

use super::answer::{ChangeReport, Changed, Considered, Probability, Since, Verdict, WhyNot, size};
use super::contrast::{log_mean, student};
use super::criteria::{
    CATALOGUE_LAW_ERROR, LOSS_AFTER, LOSS_ALIKE_PRESSURE, LOSS_ALIKE_SHARE, LOSS_ALIKE_STEP, LOSS_CLIP,
    LOSS_FLOOR, LOSS_PRESSURE, LOSS_RESTS, LOSS_REWEIGHTED, LOSS_ROWS, LOSS_RUNS, LOSS_SHORTEST, LOSS_SIZES,
    LOSS_SPREAD, NAMED, PRIOR_UNKNOWN, SET,
};
use super::detectable;
use super::runs::{Run, Runs};
use super::shapes::Change;
use pam_data::recording::motion;
use pam_data::statistics::{deviation_from_median, median};
use pam_fit::bench::Candidate;

/// A rest between two steps.
#[derive(Debug, Clone, Copy)]
struct Rest {
    /// Rate of the pressure during the rest, Pa/s; negative where air is lost.
    slope: f64,
    /// Mean gauge pressure, Pa.
    pressure: f64,
    /// From the rest before, Pa.
    step: f64,
}

/// What AFTER loses beside BEFORE.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Loss {
    /// Change of the rate, 1/s.
    change: f64,
    /// Its standard deviation.
    std: f64,
    /// Degrees of freedom of the spread between runs.
    freedom: f64,
    /// Log of the evidence of a change over none.
    log: f64,
    /// Share of the runs' energy of the change that the rate of the other runs explains.
    unseen: f64,
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count().max(1) as f64
}

/// The rests of a run.
fn rests(run: &Run) -> Vec<Rest> {
    let rows = motion::at_rest(&run.time, &run.pressure, LOSS_AFTER);
    let largest = run.pressure.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    let range = pam_data::statistics::range(&run.pressure);
    let mut all = Vec::new();
    let (mut start, mut last_end): (usize, Option<f64>) = (0, None);
    for part in rows.chunk_by(|a, b| a == b) {
        let (first, end) = (start, start + part.len());
        start = end;
        if !part[0] || part.len() < LOSS_ROWS || run.time[end - 1] - run.time[first] < LOSS_SHORTEST {
            continue;
        }
        let (time, pressure) = (&run.time[first..end], &run.pressure[first..end]);
        let before = last_end.replace(pressure[pressure.len() - 1]);
        let (t, p) = (mean(time.iter().copied()), mean(pressure.iter().copied()));
        let of = |f: &dyn Fn(f64, f64) -> f64| time.iter().zip(pressure).map(|(a, b)| f(*a, *b)).sum::<f64>();
        let slope = of(&|a, b| (a - t) * (b - p)) / of(&|a, _| (a - t) * (a - t));
        let Some(before) = before.filter(|_| p > LOSS_PRESSURE * largest && slope.is_finite()) else {
            continue;
        };
        let step = pressure[0] - before;
        // Without a step before it, several pulses are one rest: the supply replaces what is lost.
        if step.abs() > motion::fast_step(range) {
            all.push(Rest { slope, pressure: p, step });
        }
    }
    all
}

/// Whether two rests differ by no more than pulses of one setting do. `range`: of the pressures, Pa.
fn alike(a: &Rest, b: &Rest, range: f64) -> bool {
    let ratio = a.step / b.step;
    (a.pressure - b.pressure).abs() <= LOSS_ALIKE_PRESSURE * range
        && (1.0 - LOSS_ALIKE_STEP..=1.0 / (1.0 - LOSS_ALIKE_STEP)).contains(&ratio)
}

/// By how much the rate of a run differs from similar rests of BEFORE, 1/s: robust.
fn rate(own: &[Rest], before: &[&Rest], range: f64) -> Option<f64> {
    let beside = own.iter().filter_map(|rest| {
        let slopes = before.iter().filter(|b| alike(rest, b, range)).map(|b| b.slope);
        let mean = mean(slopes.clone());
        (slopes.count() > 0).then_some((rest.pressure, rest.slope - mean))
    });
    let beside: Vec<(f64, f64)> = beside.collect();
    if beside.len() < LOSS_RESTS || (beside.len() as f64) < LOSS_ALIKE_SHARE * own.len() as f64 {
        return None;
    }
    let mut weights = vec![1.0; beside.len()];
    let mut rate = 0.0;
    for _ in 0..LOSS_REWEIGHTED {
        let sum =
            |f: &dyn Fn(&(f64, f64)) -> f64| beside.iter().zip(&weights).map(|(r, w)| w * f(r)).sum::<f64>();
        rate = -sum(&|r| r.0 * r.1) / sum(&|r| r.0 * r.0);
        let residuals: Vec<f64> = beside.iter().map(|(p, e)| (e + rate * p).abs()).collect();
        let limit = LOSS_CLIP * deviation_from_median(median(&mut residuals.clone()));
        weights = residuals.iter().map(|r| if *r > limit { limit / r } else { 1.0 }).collect();
    }
    rate.is_finite().then_some(rate)
}

/// AFTER's rates against BEFORE's in the mountings that both have; `None` where no mounting has similar rests on both sides.
pub(super) fn compare(runs: &Runs) -> Option<Loss> {
    if runs.moving {
        return None;
    }
    let all: Vec<(&Run, Vec<Rest>)> = runs.runs.iter().map(|r| (r, rests(r))).collect();
    let pressures = || runs.side(false).flat_map(|r| r.pressure.iter().copied());
    let range = pressures().fold(f64::NEG_INFINITY, f64::max) - pressures().fold(f64::INFINITY, f64::min);
    let mut rates: Vec<(usize, bool, f64)> = Vec::new();
    for mounting in 0..runs.strokes.len() {
        let own = || all.iter().filter(|(r, _)| r.mounting == mounting);
        let before: Vec<&Rest> = own().filter(|(r, _)| !r.after).flat_map(|(_, rests)| rests).collect();
        let one =
            |(run, rests): &(&Run, Vec<Rest>)| Some((mounting, run.after, rate(rests, &before, range)?));
        rates.extend(own().filter_map(one));
    }
    let side = |mounting: usize, after: bool| -> Vec<f64> {
        rates.iter().filter(|r| r.0 == mounting && r.1 == after).map(|r| r.2).collect()
    };
    let (mut contrasts, mut squares, mut freedom) = (Vec::new(), 0.0, 0.0);
    for mounting in 0..runs.strokes.len() {
        let (before, after) = (side(mounting, false), side(mounting, true));
        if before.is_empty() || after.is_empty() {
            continue;
        }
        for own in [&before, &after] {
            let middle = mean(own.iter().copied());
            squares += own.iter().map(|r| (r - middle).powi(2)).sum::<f64>();
            freedom += own.len() as f64 - 1.0;
        }
        // Variance of the contrast in units of a run's.
        let share = 1.0 / before.len() as f64 + 1.0 / after.len() as f64;
        contrasts.push((mean(after.iter().copied()) - mean(before.iter().copied()), 1.0 / share));
    }
    let weight: f64 = contrasts.iter().map(|c| c.1).sum();
    if contrasts.is_empty() {
        return None;
    }
    let change = contrasts.iter().map(|c| c.0 * c.1).sum::<f64>() / weight;
    let spread = (LOSS_RUNS * LOSS_SPREAD * LOSS_SPREAD + squares) / (LOSS_RUNS + freedom);
    let variance = spread / weight + LOSS_FLOOR * LOSS_FLOOR;
    let degrees = LOSS_RUNS + freedom;
    let density = |v: f64| student(change, v, degrees);
    let sizes: Vec<f64> = LOSS_SIZES.iter().map(|s| density(variance + s * s)).collect();
    Some(Loss {
        change,
        std: variance.sqrt(),
        freedom: degrees,
        log: log_mean(&sizes) - density(variance),
        unseen: unseen(&contrasts),
    })
}

/// Share of the contrasts' energy that the mean of the other mountings explains; with one mounting nothing is held out.
fn unseen(contrasts: &[(f64, f64)]) -> f64 {
    let energy: f64 = contrasts.iter().map(|c| c.1 * c.0 * c.0).sum();
    let total = |f: &dyn Fn(&(f64, f64)) -> f64| contrasts.iter().map(f).sum::<f64>();
    let left = contrasts.iter().map(|c| {
        let others = total(&|o| o.1) - c.1;
        let expected = if others > 0.0 { (total(&|o| o.0 * o.1) - c.0 * c.1) / others } else { 0.0 };
        c.1 * (c.0 - expected).powi(2)
    });
    (1.0 - left.sum::<f64>() / energy.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

/// Adds to the answer what closed valves lose. `names`: how many other changes are tested; `none`: prior probability of no change.
pub(super) fn add(report: &mut ChangeReport, loss: &Loss, names: usize, none: f64) {
    let Some(change) = Candidate::all().find(|c| c.traits().loses_air).map(Change::Effect) else { return };
    // A leak has the prior probability of any other name, and is independent of what the forces show.
    let prior = (1.0 - none - PRIOR_UNKNOWN.min(1.0 - none)) / (names + 1) as f64;
    let odds = prior / (1.0 - prior) * loss.log.exp();
    let probability = if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 };
    let unchanged = report.probability("none");
    for p in report.probabilities.iter_mut().filter(|p| p.cause == "none") {
        p.probability *= 1.0 - probability;
    }
    let about = change.about();
    report.probabilities.push(Probability { cause: about.name.into(), probability: probability * unchanged });
    report.probabilities.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let named = probability >= NAMED;
    if !named {
        report.considered.push(Considered {
            effect: about.name.into(),
            gain: probability,
            why_not: WhyNot::of(true, probability),
            detectable: Some(detectable::size(loss.std, detectable::required(1.0 / prior, 0.0))),
            unit: "1/s".into(),
        });
        return;
    }
    report.missing.push(Changed {
        change,
        effect: about.name.into(),
        probability,
        class_probability: probability,
        class: about.changed.class,
        share_explained: loss.unseen,
        parameters: vec![size(
            ("loss_rate", "1/s"),
            loss.change,
            loss.std,
            loss.freedom,
            CATALOGUE_LAW_ERROR,
        )],
        confusable_with: Vec::new(),
        since: Since::NotDetermined,
        owner: about.changed.owner,
        correction: false,
        rms_N: 0.0,
    });
    report.verdict = match report.verdict {
        Verdict::Consistent => Verdict::Explained,
        Verdict::Unexplained => Verdict::PartlyExplained,
        other => other,
    };
    let mut held = 0.0;
    let within = report.probabilities.iter().take_while(|p| {
        let more = held < SET;
        held += p.probability;
        more
    });
    report.set = within.map(|p| p.cause.clone()).collect();
    if !report.set.iter().any(|c| c == about.name) {
        report.set.push(about.name.into());
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Against, ChangeReport, Options, Verdict, compare as ask};
    use pam_data::recording::{Campaign, Recording};

    /// s between pulses.
    const PERIOD: f64 = 0.5;

    /// A staircase by pulses: the valves are closed between them, where the gas settles and a leak takes `rate` of the pressure per second.
    /// A regulator replaces the loss where `held`. `stroke` in m, `number` is that of the run.
    fn staircase(stroke: f64, number: usize, rate: f64, held: bool) -> Recording {
        let mut state = (7 + 131 * number + (stroke * 1e4) as usize) as u64;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let rate = rate * (1.0 + 0.1 * uniform()) + 4e-4 * uniform();
        let mut r = Recording {
            name: format!("{stroke} m, run {number}"),
            source: format!("{number}.csv").into(),
            ..Recording::default()
        };
        let mut forces = Vec::new();
        for i in 0..1_200 {
            let t = 0.05 * f64::from(i);
            let pulse = (t / PERIOD + 1e-9).floor();
            let (since, level) = (t - PERIOD * pulse, (1.0 - (pulse / 60.0 - 1.0).abs()) * 600e3);
            let gas = 2e3 * (if pulse < 60.0 { 1.0 } else { -1.0 }) * (-since / 0.3).exp();
            let lost = if held { 0.0 } else { level * (1.0 - (-rate * since).exp()) };
            let p = level + gas - lost + 300.0 * uniform();
            r.time.push(t);
            r.pressure.push(p);
            r.stroke.push(stroke);
            forces.push((p - 50e3).max(0.0) * (7e-4 - 0.02 * stroke) + 0.3 * uniform());
        }
        r.force = Some(forces);
        r
    }

    fn campaign(runs: std::ops::Range<usize>, rate: f64, held: bool) -> Campaign {
        let of = |n: usize| [0.0, 0.008, 0.016].map(|x| staircase(x, n, rate, held));
        Campaign::new(runs.flat_map(of).collect())
    }

    fn changed(before: f64, after: f64, held: bool) -> ChangeReport {
        let (before, after) = (campaign(0..3, before, held), campaign(3..6, after, held));
        ask(&after, Against::Recordings(&before), &Options::default()).expect("an answer")
    }

    #[test]
    fn a_muscle_that_leaks_between_pulses_is_named_with_its_rate() {
        let report = changed(0.001, 0.013, false);
        assert_eq!(report.verdict, Verdict::Explained, "{report:?}");
        let leak = &report.missing[0];
        assert_eq!((leak.effect.as_str(), report.missing.len()), ("leak", 1), "{:?}", report.missing);
        let size = &leak.parameters[0];
        assert!(size.low < 0.012 && 0.012 < size.high && size.low > 0.006, "{size:?}");
        assert!(leak.share_explained > 0.8 && leak.probability > 0.9, "{leak:?}");
        assert_eq!(report.top(), "leak");
        assert!(!report.shows_in_force(), "a leak shows in the pressure");
        let total: f64 = report.probabilities.iter().map(|p| p.probability).sum();
        assert!((total - 1.0).abs() < 1e-9, "{total}");
    }

    #[test]
    fn a_leak_that_was_there_before_or_that_a_regulator_replaces_is_no_change() {
        for (before, after, held) in [(0.006, 0.006, false), (0.001, 0.02, true)] {
            let report = changed(before, after, held);
            assert_eq!(report.verdict, Verdict::Consistent, "{:?}", report.missing);
            let leak = report.considered.iter().find(|c| c.effect == "leak").expect("weighed");
            assert!(leak.gain < 0.05 && leak.detectable.is_some_and(|d| d > 5e-4 && d < 0.02), "{leak:?}");
        }
    }
}
