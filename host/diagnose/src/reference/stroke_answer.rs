//! The answer for strokes at regulated pressures.

use super::answer::{
    ChangeReport, Changed, Considered, Curve, HeldOut, Place, Probability, Reference, Remark, Repeatability,
    Since, Split, Verdict, WhyNot, size,
};
use super::criteria::{NAMED, POSSIBLE, STANDS_OUT, STROKE_PRIOR_NONE, STROKE_UNEXPLAINED, UNSEEN_EXPLAINED};
use super::detectable;
use super::held_out::Unseen;
use super::report::{Options, left, prior};
use super::shapes::{self, Change, Class, ForceShape};
use super::stroked::{self, Compared, Weighed};
use crate::criteria::judgement::DETECTION;
use pam_data::error::Result;

/// What was compared and tested, as the answer.
///
/// # Errors
/// Numbers that cannot be used.
pub(super) fn strokes(compared: &Compared, options: &Options) -> Result<ChangeReport> {
    let none = prior(options, STROKE_PRIOR_NONE);
    let weighed = stroked::weigh(compared, none)?;
    let named = stroked::named(&weighed);
    let (before, after) = stroked::unseen(compared, &named);
    let n = compared.keys.len();
    let noise = (compared.covariance.trace() / (2 * n) as f64).sqrt();
    let verdict = if named.is_empty() && weighed.none() < STROKE_UNEXPLAINED {
        Verdict::Unexplained
    } else if named.is_empty() {
        Verdict::Consistent
    } else {
        let larger_part = Unseen { before, after, held: true }.share() >= UNSEEN_EXPLAINED;
        if larger_part && after <= STANDS_OUT * noise { Verdict::Explained } else { Verdict::PartlyExplained }
    };
    let unseen = Unseen { before, after, held: true };
    let places = if verdict == Verdict::Consistent { Vec::new() } else { stroke_places(compared) };
    let mut probabilities: Vec<Probability> = stroked::tested()
        .map(|c| Probability { cause: c.name().into(), probability: weighed.marginal(c) })
        .chain([Probability { cause: "none".into(), probability: weighed.none() }])
        .collect();
    probabilities.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let remarks = remarks(&named, verdict, weighed.none());
    Ok(ChangeReport {
        muscle: None,
        samples: 0,
        verdict,
        noise_N: noise,
        misfit_rms_N: before,
        largest_force_N: compared.largest,
        unexplained: left(verdict, &unseen, &places),
        r#where: places,
        missing: named.iter().map(|c| stroke_change(compared, &weighed, *c)).collect(),
        held_out: HeldOut {
            split: Split::OtherLevels,
            rms_before_N: before,
            rms_after_N: after,
            share_where_shown: unseen.share(),
            noise_N: noise,
        },
        considered: stroked::tested()
            .filter(|c| !named.contains(c))
            .map(|c| Considered {
                effect: c.name().into(),
                gain: weighed.marginal(c),
                why_not: WhyNot::of(true, weighed.marginal(c)),
                detectable: weighed.alone.get(&c).map(|(_, std)| detectable::size(*std, DETECTION)),
                unit: c.about().changed.size.1.into(),
            })
            .collect(),
        set: probabilities.iter().filter(|p| p.probability >= POSSIBLE).map(|p| p.cause.clone()).collect(),
        probabilities,
        remarks,
        reference: Reference {
            files: Vec::new(),
            table: None,
            samples: 0,
            repeatability_N: noise,
            repeatability_from: Repeatability::Assumed,
            mounted_anew: true,
            not_comparable: compared.not_comparable.clone(),
        },
        alone: weighed
            .alone
            .iter()
            .map(|(c, (value, std))| {
                let about = c.about();
                (about.name.to_owned(), size(about.changed.size, *value, *std, 1e6, 0.0))
            })
            .collect(),
        curves: stroke_curves(compared, &weighed, &named),
        abscissa: ("displacement", "mm"),
    })
}

fn remarks(named: &[Change], verdict: Verdict, none: f64) -> Vec<Remark> {
    let mut remarks = vec![Remark::StrokesAssumed, Remark::StrokesMarginal];
    if named.is_empty() && verdict == Verdict::Consistent && none < NAMED {
        remarks.push(Remark::NotAcquitted(none));
    }
    if named.iter().any(|c| c.class() == Class::Gain) {
        remarks.push(Remark::GainOfStrokes);
    }
    remarks
}

fn stroke_change(compared: &Compared, weighed: &Weighed, change: Change) -> Changed {
    let about = change.about();
    let (value, std) = weighed.sizes.get(&change).copied().unwrap_or_default();
    let (before, after) = stroked::unseen(compared, &[change]);
    let rms = compared.shape(change).map_or(0.0, |s| (s.norm_squared() / s.len().max(1) as f64).sqrt());
    let possible =
        |c: &Change| *c != change && c.class() == about.changed.class && weighed.marginal(*c) >= POSSIBLE;
    let competitors = stroked::tested().filter(possible).chain(of_one_shape(change));
    Changed {
        change,
        effect: about.name.into(),
        probability: weighed.marginal(change),
        class_probability: weighed.class(about.changed.class),
        class: about.changed.class,
        share_explained: (1.0 - (after / before.max(f64::MIN_POSITIVE)).powi(2)).clamp(0.0, 1.0),
        parameters: vec![size(about.changed.size, value, std, 1e6, 0.0)],
        confusable_with: competitors.map(|c| c.name().to_owned()).collect(),
        since: Since::NotDetermined,
        owner: about.changed.owner,
        correction: change.is_bench(),
        rms_N: rms * value.abs(),
    }
}

/// What strokes at regulated pressures do not distinguish from a change of the force in proportion: there the force grows with pressure.
fn of_one_shape(change: Change) -> Vec<Change> {
    let grows = [ForceShape::PressureTimesSlope, ForceShape::Pressure];
    let same = |c: &Change| {
        change.shape() == Some(ForceShape::Force) && c.shape().is_some_and(|s| grows.contains(&s))
    };
    shapes::tested([]).into_iter().filter(same).collect()
}

fn stroke_places(c: &Compared) -> Vec<Place> {
    let total = c.y.norm_squared();
    let n = c.keys.len();
    let mut all: Vec<Place> = c
        .levels
        .iter()
        .enumerate()
        .filter_map(|(l, pressure)| {
            let own = stroked::of_level(c, l);
            let energy: f64 = own.iter().map(|i| c.y[*i].powi(2) + c.y[n + i].powi(2)).sum();
            let (share, rows) = (energy / total, own.len() as f64 / n as f64);
            (share > rows && rows < 1.0).then(|| Place {
                coordinate: "pressure".into(),
                from: pressure / 1e3,
                to: pressure / 1e3,
                share,
                rows,
                unit: "kPa".into(),
            })
        })
        .collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

fn stroke_curves(c: &Compared, weighed: &Weighed, named: &[Change]) -> Vec<Curve> {
    let n = c.keys.len();
    let explained = |i: usize| -> f64 {
        named.iter().filter_map(|change| Some(weighed.sizes.get(change)?.0 * c.shape(*change)?[i])).sum()
    };
    let mut all = Vec::new();
    for (l, pressure) in c.levels.iter().enumerate() {
        let own = stroked::of_level(c, l);
        if own.is_empty() {
            continue;
        }
        let mut curve = Curve { title: format!("{:.0} kPa", pressure / 1e3), ..Curve::default() };
        for i in own {
            curve.at.push(c.before[i].stroke * 1e3);
            for (side, sign) in [(0, -1.0), (1, 1.0)] {
                curve.before[side].push(c.before[i].force[side]);
                curve.after[side].push(c.after[i].force[side]);
                curve.difference[side].push(c.y[i] + sign * c.y[n + i]);
                curve.explained[side].push(explained(i) + sign * explained(n + i));
            }
        }
        all.push(curve);
    }
    all
}
