//! The answer for pressure staircases at held lengths.

use nalgebra::DVector;

use super::answer::{
    ChangeReport, Changed, Considered, Curve, HeldOut, NotComparable, Probability, Reference, Remark,
    Repeatability, Size, Split, Verdict, WhyNot, size,
};
use super::cells::rms_after;
use super::criteria::{
    CELLS, COMBINED_SHAPE_ERROR, FEWEST_CELLS, GATE, NAMED, OWN_SLOPE_ERROR, PRIOR_NONE, SCALE_PRIOR, SIZES,
    SLOPE_ERROR, STANDS_OUT, TABLE_INTERVAL, TABLE_SLOPE_ERROR, TABLE_SLOPE_OVER_LENGTH, UNSEEN_EXPLAINED,
};
use super::detectable;
use super::held_out;
use super::isometric::Analysis;
use super::naming::Accepted;
use super::posterior::Cause;
use super::report::{Options, left, prior, verdict};
use super::shapes::{Change, Class, ForceShape};
use super::weighing::Estimate;
use super::{cells, localise, repeatability};

/// Everything that was found, as the answer.
pub(super) fn staircases(analysis: &Analysis, options: &Options) -> ChangeReport {
    let first = &analysis.first.posterior;
    let difference = held_out::difference(&analysis.cells, &analysis.contrast);
    let shapes: Vec<DVector<f64>> = analysis.accepted.iter().map(|a| a.shape.clone()).collect();
    let (unseen, where_shown) = held_out::unseen(&analysis.cells, &analysis.contrast, &shapes);
    let scale = analysis.contrast.without_shapes(&shapes).scale();
    let noise = repeatability::spread(analysis.surface.largest, scale).hypot(analysis.reference_error);
    let verdict = verdict(
        first.probability(Cause::None),
        analysis.accepted.len(),
        analysis.last.probability(Cause::None) < NAMED || (unseen.held && unseen.share() < UNSEEN_EXPLAINED),
    );
    let mut remarks = remarks(analysis, verdict);
    let not = incomparable(analysis);
    if not.iter().any(|n| matches!(n, NotComparable::OneLength)) && analysis.runs.remounted {
        remarks.push(Remark::OneLengthMountedAnew);
    }
    if verdict == Verdict::Consistent && analysis.runs.remounted && unseen.before > STANDS_OUT * noise {
        remarks.push(Remark::WithinMounting);
    }
    let before: Vec<usize> = analysis.runs.side(false).map(|r| r.mounting).collect();
    let measured = before.iter().any(|m| before.iter().filter(|o| *o == m).count() > 1);
    if !measured && !before.is_empty() {
        remarks.push(Remark::NothingTwice);
    }
    let where_ = if verdict == Verdict::Consistent {
        Vec::new()
    } else {
        localise::places(analysis, &difference, options.rest_length)
    };
    ChangeReport {
        muscle: None,
        samples: 0,
        verdict,
        noise_N: noise,
        misfit_rms_N: unseen.before,
        largest_force_N: analysis.surface.largest,
        unexplained: left(verdict, &unseen, &where_),
        r#where: where_,
        missing: analysis.accepted.iter().map(|a| changed(analysis, a)).collect(),
        held_out: HeldOut {
            split: match (unseen.held, analysis.runs.moving) {
                (false, _) => Split::None,
                (true, false) => Split::OtherRecordings,
                (true, true) => Split::OtherParts,
            },
            rms_before_N: unseen.before,
            rms_after_N: unseen.after,
            share_where_shown: where_shown.share(),
            noise_N: noise,
        },
        considered: considered(analysis, options),
        probabilities: first
            .all
            .iter()
            .map(|(c, p)| Probability { cause: c.name().into(), probability: *p })
            .collect(),
        set: first.set().into_iter().map(|c| c.name().to_owned()).collect(),
        remarks,
        reference: Reference {
            files: Vec::new(),
            table: None,
            samples: 0,
            repeatability_N: noise,
            repeatability_from: if measured { Repeatability::Measured } else { Repeatability::Assumed },
            mounted_anew: analysis.runs.remounted,
            not_comparable: not,
        },
        alone: alone(analysis),
        curves: curves(analysis, &difference),
        abscissa: ("pressure P", "kPa"),
    }
}

fn remarks(analysis: &Analysis, verdict: Verdict) -> Vec<Remark> {
    let mut remarks = Vec::new();
    for (m, stroke) in
        analysis.runs.strokes.iter().enumerate().filter(|(m, _)| analysis.runs.is_interpolated(*m))
    {
        let variances =
            analysis.cells.iter().filter(|c| c.interpolated && c.mounting == m).map(|c| c.means.variance);
        let (sum, count) = variances.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        if count > 0.0 {
            remarks.push(Remark::Interpolated { stroke: *stroke, error: f64::sqrt(sum / count) });
        }
    }
    let like = |a: &Accepted| matches!(a.change.class(), Class::Gain | Class::Zero);
    if analysis.runs.moving && analysis.accepted.iter().any(like) {
        remarks.push(Remark::GaugeOfMotion);
    }
    if let Some((mounting, log)) = analysis.first.local.filter(|l| l.1 > GATE.ln()) {
        // With a change that all mountings show, the one that shows it most is not new.
        if !analysis.runs.moving && matches!(verdict, Verdict::Consistent | Verdict::Unexplained) {
            remarks.push(Remark::OneMounting { stroke: analysis.runs.strokes[mounting], log });
        }
    }
    remarks
}

fn incomparable(analysis: &Analysis) -> Vec<NotComparable> {
    let mut not = analysis.runs.not_comparable.clone();
    for run in analysis.runs.side(true) {
        let (out, all) = cells::beyond(run, &analysis.surface);
        // Each part of a motion has pressures of its own; it names none.
        if out > 0 && !analysis.runs.moving {
            let share = out as f64 / all.max(1) as f64;
            not.push(NotComparable::Pressure { recording: run.name.clone(), share });
        }
    }
    let recorded = analysis.runs.side(false).next().is_some();
    if analysis.runs.moving {
        not.push(NotComparable::Moving);
    }
    for (m, stroke) in analysis.runs.strokes.iter().enumerate() {
        let mut kinds: Vec<[bool; 2]> = vec![[false; 2]; 2 * CELLS];
        for c in analysis.cells.iter().filter(|c| c.mounting == m) {
            kinds[c.bin + if c.direction < 0.0 { CELLS } else { 0 }][usize::from(c.after)] = true;
        }
        let after = kinds.iter().any(|k| k[1]);
        if after
            && recorded
            && !analysis.runs.moving
            && kinds.iter().filter(|k| k[0] && k[1]).count() < FEWEST_CELLS
        {
            not.push(NotComparable::FewCells { stroke: *stroke });
        }
    }
    if analysis.surface.curves.iter().all(|c| c.by_stroke.iter().all(|s| *s == 0.0)) {
        not.push(NotComparable::OneLength);
    }
    not
}

fn changed(analysis: &Analysis, accepted: &Accepted) -> Changed {
    let about = accepted.change.about();
    let freedom = SCALE_PRIOR + analysis.contrast.taught.min(analysis.contrast.free);
    let own = std::slice::from_ref(&accepted.shape);
    let (unseen, _) = held_out::unseen(&analysis.cells, &analysis.contrast, own);
    let class = analysis.first.posterior.classes().get(&about.changed.class).copied().unwrap_or(0.0);
    Changed {
        change: accepted.change,
        effect: about.name.into(),
        probability: accepted.probability,
        class_probability: class.max(accepted.probability),
        class: about.changed.class,
        share_explained: unseen.share().max(0.0),
        parameters: vec![size(
            about.changed.size,
            accepted.size,
            accepted.std * widened(analysis),
            freedom,
            slope_error(analysis, accepted.change) * widened(analysis),
        )],
        confusable_with: confusable(analysis, accepted),
        since: localise::since(analysis, accepted),
        owner: about.changed.owner,
        correction: accepted.change.is_bench(),
        rms_N: rms_after(&analysis.cells, &accepted.shape) * accepted.size.abs(),
    }
}

/// Names that these recordings cannot distinguish from a change. In motion the gauge's zero is always one of those of a gain or a zero: on
/// emulated muscles most of these zeros took such a name.
fn confusable(analysis: &Analysis, accepted: &Accepted) -> Vec<String> {
    let mut all: Vec<Change> = accepted.competitors.clone();
    let like = matches!(accepted.change.class(), Class::Gain | Class::Zero);
    let gauge = Change::of_shape(ForceShape::PressureSlope).filter(|_| analysis.runs.moving && like);
    all.extend(gauge.filter(|zero| !accepted.competitors.contains(zero)));
    all.into_iter().map(|c| c.name().to_owned()).collect()
}

/// What intervals are widened by.
fn widened(analysis: &Analysis) -> f64 {
    if analysis.recorded { 1.0 } else { TABLE_INTERVAL }
}

/// How inexact the shape of a change is, share of its size.
fn slope_error(analysis: &Analysis, change: Change) -> f64 {
    match change.shape() {
        Some(ForceShape::Constant | ForceShape::Time | ForceShape::Direction) => SLOPE_ERROR,
        _ if analysis.recorded && analysis.runs.moving => COMBINED_SHAPE_ERROR,
        _ if analysis.recorded => SLOPE_ERROR,
        Some(ForceShape::StrokeStep)
            if analysis.surface.curves.iter().any(|c| !c.own_by_stroke.is_empty()) =>
        {
            OWN_SLOPE_ERROR
        }
        Some(ForceShape::StrokeSlope | ForceShape::ForceTimesStrokeSlope | ForceShape::StrokeStep) => {
            TABLE_SLOPE_OVER_LENGTH
        }
        _ => TABLE_SLOPE_ERROR,
    }
}

/// The size of each change as the only one.
fn alone(analysis: &Analysis) -> Vec<(String, Size)> {
    let freedom = SCALE_PRIOR + analysis.contrast.taught.min(analysis.contrast.free);
    let one = |e: &Estimate| {
        let about = e.change.about();
        (
            about.name.to_owned(),
            size(
                about.changed.size,
                e.size,
                e.std * widened(analysis),
                freedom,
                slope_error(analysis, e.change) * widened(analysis),
            ),
        )
    };
    analysis.first.estimates.iter().map(one).collect()
}

fn considered(analysis: &Analysis, options: &Options) -> Vec<Considered> {
    let none = prior(options, PRIOR_NONE);
    let round = &analysis.first;
    let names = round.posterior.all.iter().filter(|(c, _)| matches!(c, Cause::Named(_))).count();
    let odds = detectable::odds(none, names);
    let middle = SIZES[1] * analysis.surface.largest;
    let open = |change: Change| !analysis.accepted.iter().any(|a| a.change == change);
    analysis
        .tested
        .iter()
        .copied()
        .filter(|change| open(*change))
        .map(|change| {
            let about = change.about();
            let p = round.posterior.probability(Cause::Named(change));
            let estimate = round.estimates.iter().find(|e| e.change == change);
            let detectable = estimate.map(|e| {
                let price = (middle / e.rms / e.std).powi(2).ln_1p();
                detectable::size(e.std, detectable::required(odds, price))
            });
            Considered {
                effect: about.name.into(),
                gain: p,
                why_not: WhyNot::of(detectable.is_some(), p),
                detectable: detectable.filter(|d| d.is_finite()),
                unit: about.changed.size.1.into(),
            }
        })
        .collect()
}

/// Force before and after, the difference and what is explained, over pressure, by mounting.
fn curves(analysis: &Analysis, difference: &DVector<f64>) -> Vec<Curve> {
    let mut all = Vec::new();
    for (m, stroke) in analysis.runs.strokes.iter().enumerate() {
        let mut curve = Curve { title: format!("{:.1} mm", stroke * 1e3), ..Curve::default() };
        let mut sums = [[[0.0; 4]; CELLS]; 2];
        let after = analysis.cells.iter().enumerate().filter(|(_, c)| c.after);
        for ((i, c), d) in after.zip(difference.iter()).filter(|((_, c), _)| c.mounting == m) {
            let explained: f64 = analysis.accepted.iter().map(|a| a.size * a.shape[i]).sum();
            let sum = &mut sums[usize::from(c.direction < 0.0)][c.bin];
            let force = analysis.surface.force(m, c.means.pressure, c.direction) + c.means.residual;
            *sum = [sum[0] + 1.0, sum[1] + d, sum[2] + explained, sum[3] + force];
        }
        let step = (analysis.surface.high - analysis.surface.low) / CELLS as f64;
        for bin in 0..CELLS {
            let p = analysis.surface.low + step * (bin as f64 + 0.5);
            curve.at.push(p / 1e3);
            for side in 0..2 {
                let [n, d, e, f] = sums[side][bin];
                let mean = |v: f64| if n > 0.0 { v / n } else { f64::NAN };
                let direction = if side == 0 { 1.0 } else { -1.0 };
                curve.before[side].push(analysis.surface.force(m, p, direction));
                curve.after[side].push(mean(f));
                curve.difference[side].push(mean(d));
                curve.explained[side].push(mean(e));
            }
        }
        if curve.after.iter().flatten().any(|v| v.is_finite()) {
            all.push(curve);
        }
    }
    all
}
