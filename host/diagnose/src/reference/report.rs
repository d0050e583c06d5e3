//! From two sides to the answer.

use nalgebra::DVector;

use super::answer::{
    ChangeReport, Changed, Considered, Curve, HeldOut, Left, NotComparable, Place, Probability, Reference,
    Repeatability, Since, Verdict, not_comparable, size,
};
use super::criteria::{
    CELLS, FEWEST_CELLS, HELD, NAMED, OTHER_ACTUATOR, PRIOR_NONE, SCALE_PRIOR, SIZES, SLOPE_ERROR,
    STROKE_PRIOR_NONE,
};
use super::held_out::{self, Unseen};
use super::isometric::{self, Accepted, Analysis};
use super::posterior::Cause;
use super::runs::Runs;
use super::shapes::{CHANGES, Change, Class};
use super::stroked::{self, Compared, Weighed};
use super::surface::Surface;
use super::{cells, localise, repeatability, table_surface, units, words};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_fit::predict::predict;
use pam_fit::table_file::TableFile;

pub use super::runs::Mounted;

/// What AFTER is compared with.
#[derive(Clone, Copy)]
pub enum Against<'a> {
    /// Earlier recordings.
    Recordings(&'a Campaign),
    /// A table, with its path.
    Table(&'a TableFile, &'a str),
}

/// What the caller may choose.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The actuator's name, for the answer.
    pub muscle: Option<String>,
    /// L0, m, where it is known.
    pub rest_length: Option<f64>,
    /// Whether AFTER was mounted anew.
    pub mounted: Mounted,
    /// Prior probability that something changed, instead of the usual.
    pub prior_changed: Option<f64>,
}

/// How the recordings were made.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Protocol {
    Held,
    Stroked,
}

/// Share of the largest pressure within which a regulated one stays.
const REGULATED: f64 = 0.3;

/// The range of a column without its outermost hundredths, which a noisy sensor makes.
fn usual_range(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = |share: f64| sorted[(share * last as f64).round() as usize];
    at(0.99) - at(0.01)
}

fn protocol(campaign: &Campaign, side: &str) -> Result<Protocol> {
    let held = campaign.recordings.iter().filter(|r| usual_range(&r.stroke) <= HELD).count();
    if held == campaign.recordings.len() {
        return Ok(Protocol::Held);
    }
    if held > 0 {
        return Err(Error::new(
            DataCode::RecordingOutOfRange,
            format!(
                "{side} mixes {held} recordings at a held length with {} strokes",
                campaign.recordings.len() - held
            ),
        )
        .help("give one kind at a time"));
    }
    for r in &campaign.recordings {
        let mut sorted = r.pressure.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted[(share * (sorted.len() - 1) as f64) as usize];
        if !sorted.is_empty() && at(0.9) - at(0.1) > REGULATED * at(1.0).abs() {
            // Several levels in one file are levels still, as long as each stroke has one.
            let levels = super::strokes::levels(&[campaign]);
            if levels.len() < 2 {
                return Err(Error::new(
                    DataCode::RecordingOutOfRange,
                    format!("in `{}` length and pressure move together", r.name),
                )
                .file(&r.source)
                .help(
                    "a comparison needs pressure sweeps at held lengths, or strokes at regulated pressures",
                ));
            }
        }
    }
    Ok(Protocol::Stroked)
}

/// What has changed in AFTER.
///
/// # Errors
/// Recordings without force, sides that have nothing in common, or columns in other units.
pub fn compare(after: &Campaign, against: Against<'_>, options: &Options) -> Result<ChangeReport> {
    if after.samples() == 0 {
        return Err(Error::new(DataCode::RecordingEmpty, "the recordings hold no rows"));
    }
    for r in &after.recordings {
        r.require_force()?;
    }
    let kind = protocol(after, "AFTER")?;
    let mut report = match (against, kind) {
        (Against::Recordings(before), _) => {
            for r in &before.recordings {
                r.require_force()?;
            }
            let remarks = units::check(before, after)?;
            let mut report = match (protocol(before, "the reference")?, kind) {
                (Protocol::Held, Protocol::Held) => held(before, after, options)?,
                (Protocol::Stroked, Protocol::Stroked) => {
                    let compared = stroked::compare(before, after, 0.0)?;
                    strokes(&compared, options)?
                }
                _ => {
                    return Err(Error::new(
                        DataCode::RecordingOutOfRange,
                        "one side holds the length, the other strokes",
                    )
                    .help("give recordings of the same protocol on both sides"));
                }
            };
            report.reference.files = files(before);
            report.reference.samples = before.samples();
            report.remarks.splice(0..0, remarks);
            report
        }
        (Against::Table(table, path), kind) => {
            let mut report = match kind {
                Protocol::Held => held_against_table(table, after, options)?,
                Protocol::Stroked => stroked_against_table(table, after, options)?,
            };
            report.reference.table = Some(path.to_owned());
            report.reference.repeatability_from = Repeatability::Assumed;
            report.remarks.push(words::TABLE_REFERENCE.to_owned());
            report
        }
    };
    report.samples = after.samples();
    report.muscle.clone_from(&options.muscle);
    if report.misfit_rms_N > OTHER_ACTUATOR * report.largest_force_N {
        report.remarks.push(words::OTHER_ACTUATOR.to_owned());
    }
    Ok(report)
}

fn files(campaign: &Campaign) -> Vec<String> {
    let mut all: Vec<String> = campaign.recordings.iter().map(|r| r.source.display().to_string()).collect();
    all.dedup();
    all
}

fn prior(options: &Options, usual: f64) -> f64 {
    let none = options.prior_changed.map_or(usual, |p| 1.0 - p);
    if none > 0.01 && none < 0.99 { none } else { none.clamp(0.01, 0.99) }
}

fn held(before: &Campaign, after: &Campaign, options: &Options) -> Result<ChangeReport> {
    let runs = Runs::of(before, after, options.mounted)?;
    if runs.side(true).next().is_none() {
        let list = |of: &mut dyn Iterator<Item = f64>| {
            of.map(|s| format!("{:.1}", s * 1e3)).collect::<Vec<_>>().join(", ")
        };
        return Err(Error::new(
            DataCode::RecordingOutOfRange,
            "AFTER was held at none of the reference's lengths",
        )
        .help(format!(
            "strokes in mm: the reference has {}; AFTER has {}",
            list(&mut runs.strokes.iter().copied()),
            list(&mut runs.not_comparable.iter().filter_map(|n| match n {
                NotComparable::Stroke { stroke, .. } => Some(*stroke),
                _ => None,
            }))
        )));
    }
    let surface = Surface::of(&runs)?;
    let reference = isometric::Reference { surface, error: 0.0, recorded: true };
    let analysis = isometric::analyse(runs, reference, prior(options, PRIOR_NONE))?;
    Ok(isometric_report(&analysis, options))
}

fn held_against_table(table: &TableFile, after: &Campaign, options: &Options) -> Result<ChangeReport> {
    let runs = Runs::alone(after)?;
    let surface = table_surface::of(table, &runs)?;
    let error = table.about.fit.rms_newtons;
    let error = if error > 0.0 { error } else { 0.01 * surface.largest };
    let reference = isometric::Reference { surface, error, recorded: false };
    let analysis = isometric::analyse(runs, reference, prior(options, PRIOR_NONE))?;
    Ok(isometric_report(&analysis, options))
}

/// Strokes against what the table gives for the same motion.
fn stroked_against_table(table: &TableFile, after: &Campaign, options: &Options) -> Result<ChangeReport> {
    let mut before = after.clone();
    let predicted = predict(table, after)?;
    for (recording, p) in before.recordings.iter_mut().zip(predicted.recordings) {
        recording.force = Some(p.force);
    }
    let compared = stroked::compare(&before, after, table.about.fit.rms_newtons.max(0.0))?;
    strokes(&compared, options)
}

/// The verdict from what is named and what is left.
fn verdict(none: f64, named: usize, left: bool) -> Verdict {
    match (named, left) {
        (0, _) if none >= NAMED => Verdict::Consistent,
        (0, _) => Verdict::Unexplained,
        (_, false) => Verdict::Explained,
        (_, true) => Verdict::PartlyExplained,
    }
}

fn isometric_report(analysis: &Analysis, options: &Options) -> ChangeReport {
    let first = &analysis.first.posterior;
    let difference = held_out::difference(&analysis.cells, &analysis.contrast);
    let shapes: Vec<DVector<f64>> = analysis.accepted.iter().map(|a| a.shape.clone()).collect();
    let unseen = held_out::unseen(&analysis.cells, &analysis.contrast, &shapes);
    let scale = analysis.contrast.without_shapes(&shapes).scale();
    let noise = repeatability::spread(analysis.surface.largest, scale);
    let verdict = verdict(
        first.probability(Cause::None),
        analysis.accepted.len(),
        analysis.last.probability(Cause::None) < NAMED,
    );
    let mut remarks = remarks(analysis, verdict);
    let not = incomparable(analysis);
    if not.iter().any(|n| matches!(n, NotComparable::OneLength)) && analysis.runs.remounted {
        remarks.push(words::ONE_LENGTH_REMOUNTED.to_owned());
    }
    let before: Vec<usize> = analysis.runs.side(false).map(|r| r.mounting).collect();
    let measured = before.iter().any(|m| before.iter().filter(|o| *o == m).count() > 1);
    if !measured && !before.is_empty() {
        remarks.push(words::ASSUMED.to_owned());
    }
    let where_ = if verdict == Verdict::Consistent {
        Vec::new()
    } else {
        localise::places(analysis, &difference, options.rest_length)
    };
    ChangeReport {
        schema: "pam-diagnose/1",
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
            split: words::split(unseen.held).to_owned(),
            rms_before_N: unseen.before,
            rms_after_N: unseen.after,
            noise_N: noise,
        },
        next_experiment: None,
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
            not_comparable: not_comparable(&not),
        },
        curves: curves(analysis, &difference),
        abscissa: ("pressure P", "kPa"),
    }
}

fn left(verdict: Verdict, unseen: &Unseen, places: &[Place]) -> Left {
    let share = match verdict {
        Verdict::Consistent => 0.0,
        Verdict::Unexplained => 1.0,
        _ => (1.0 - unseen.share()).clamp(0.0, 1.0),
    };
    let pattern = match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => {
            places.first().map_or_else(|| "none".to_owned(), words::place)
        }
        _ => "none".to_owned(),
    };
    Left { share, pattern }
}

fn remarks(analysis: &Analysis, verdict: Verdict) -> Vec<String> {
    let mut remarks = Vec::new();
    if let Some((mounting, log)) = analysis.first.local.filter(|l| l.1 > super::criteria::GATE.ln()) {
        // With a change that all mountings show, the one that shows it most is no news.
        if verdict == Verdict::Consistent || verdict == Verdict::Unexplained {
            remarks.push(words::one_mounting(analysis.runs.strokes[mounting], log));
        }
    }
    remarks
}

fn incomparable(analysis: &Analysis) -> Vec<NotComparable> {
    let mut not = analysis.runs.not_comparable.clone();
    for run in analysis.runs.side(true) {
        let (out, all) = cells::beyond(run, &analysis.surface);
        if out > 0 {
            let share = out as f64 / all.max(1) as f64;
            not.push(NotComparable::Pressure { recording: run.name.clone(), share });
        }
    }
    let recorded = analysis.runs.side(false).next().is_some();
    for (m, stroke) in analysis.runs.strokes.iter().enumerate() {
        let mut kinds: Vec<[bool; 2]> = vec![[false; 2]; 2 * CELLS];
        for c in analysis.cells.iter().filter(|c| c.mounting == m) {
            kinds[c.bin + if c.direction < 0.0 { CELLS } else { 0 }][usize::from(c.after)] = true;
        }
        let after = kinds.iter().any(|k| k[1]);
        if after && recorded && kinds.iter().filter(|k| k[0] && k[1]).count() < FEWEST_CELLS {
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
    let unseen = held_out::unseen(&analysis.cells, &analysis.contrast, std::slice::from_ref(&accepted.shape));
    let class = analysis.first.posterior.classes().get(&about.class).copied().unwrap_or(0.0);
    Changed {
        effect: about.name.into(),
        probability: accepted.probability,
        class_probability: class.max(accepted.probability),
        class: about.class,
        share_explained: unseen.share().max(0.0),
        parameters: vec![size(about.parameter, accepted.size, accepted.std, freedom, SLOPE_ERROR)],
        confusable_with: accepted.rivals.iter().map(|c| c.name().to_owned()).collect(),
        since: localise::since(analysis, accepted),
        owner: about.owner,
        correction: accepted.change.is_bench(),
        law: about.law.into(),
        remedy: about.remedy.into(),
        rms_N: super::slip::rms_after(&analysis.cells, &accepted.shape) * accepted.size.abs(),
    }
}

fn considered(analysis: &Analysis, options: &Options) -> Vec<Considered> {
    let none = prior(options, PRIOR_NONE);
    let round = &analysis.first;
    let names =
        round.posterior.all.iter().filter(|(c, _)| matches!(c, Cause::Named(_))).count().max(1) as f64;
    let prior_name = ((1.0 - none) / names).max(1e-6);
    let middle = SIZES[1] * analysis.surface.largest;
    let open = |change: Change| !analysis.accepted.iter().any(|a| a.change == change);
    CHANGES
        .iter()
        .filter(|about| open(about.change))
        .map(|about| {
            let p = round.posterior.probability(Cause::Named(about.change));
            let estimate = round.estimates.iter().find(|e| e.change == about.change);
            let detectable = estimate.map(|e| {
                // What the prior, a lead of e³ and the price of the size ask of the evidence; 1.28: with 90 %.
                let price = (middle / e.rms / e.std).powi(2).ln_1p();
                let z = (2.0 * (none / prior_name).ln() + 6.0 + price).max(0.0).sqrt();
                e.std * (z + 1.28)
            });
            Considered {
                effect: about.name.into(),
                gain: p,
                why_not: words::why_not(detectable.is_some(), p).into(),
                detectable: detectable.filter(|d| d.is_finite()),
                unit: about.parameter.1.into(),
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

fn strokes(compared: &Compared, options: &Options) -> Result<ChangeReport> {
    let none = prior(options, STROKE_PRIOR_NONE);
    let weighed = stroked::weigh(compared, none)?;
    let named = stroked::named(&weighed);
    let (before, after) = stroked::unseen(compared, &named);
    let verdict = if named.is_empty() && weighed.none() < 0.1 {
        Verdict::Unexplained
    } else if named.is_empty() {
        Verdict::Consistent
    } else {
        let share = 1.0 - (after / before.max(f64::MIN_POSITIVE)).powi(2);
        if share >= 0.5 { Verdict::Explained } else { Verdict::PartlyExplained }
    };
    let n = compared.keys.len();
    let noise = (compared.covariance.trace() / (2 * n) as f64).sqrt();
    let unseen = Unseen { before, after, held: true };
    let places = if verdict == Verdict::Consistent { Vec::new() } else { stroke_places(compared) };
    let mut probabilities: Vec<Probability> = stroked::ASKED
        .iter()
        .map(|c| Probability { cause: c.name().into(), probability: weighed.marginal(*c) })
        .chain([Probability { cause: "none".into(), probability: weighed.none() }])
        .collect();
    probabilities.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let mut remarks = vec![words::STROKES_ASSUMED.to_owned(), words::STROKES_MARGINAL.to_owned()];
    if named.is_empty() && verdict == Verdict::Consistent && weighed.none() < NAMED {
        remarks.push(words::not_acquitted(weighed.none()));
    }
    if named.iter().any(|c| c.class() == Class::Gain) {
        remarks.push(words::GAIN_OF_STROKES.to_owned());
    }
    Ok(ChangeReport {
        schema: "pam-diagnose/1",
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
            split: words::STROKE_SPLIT.to_owned(),
            rms_before_N: before,
            rms_after_N: after,
            noise_N: noise,
        },
        next_experiment: None,
        considered: stroked::ASKED
            .iter()
            .filter(|c| !named.contains(c))
            .map(|c| Considered {
                effect: c.name().into(),
                gain: weighed.marginal(*c),
                why_not: words::why_not(true, weighed.marginal(*c)).into(),
                detectable: weighed.alone.get(c).map(|(_, std)| std * (3.5 + 1.28)),
                unit: c.about().parameter.1.into(),
            })
            .collect(),
        set: probabilities.iter().filter(|p| p.probability >= 0.05).map(|p| p.cause.clone()).collect(),
        probabilities,
        remarks,
        reference: Reference {
            files: Vec::new(),
            table: None,
            samples: 0,
            repeatability_N: noise,
            repeatability_from: Repeatability::Assumed,
            mounted_anew: true,
            not_comparable: not_comparable(&compared.not_comparable),
        },
        curves: stroke_curves(compared, &weighed, &named),
        abscissa: ("displacement", "mm"),
    })
}

fn stroke_change(compared: &Compared, weighed: &Weighed, change: Change) -> Changed {
    let about = change.about();
    let (value, std) = weighed.sizes.get(&change).copied().unwrap_or_default();
    let (before, after) = stroked::unseen(compared, &[change]);
    let index = stroked::ASKED.iter().position(|c| *c == change).unwrap_or(0);
    let shape = &compared.shapes[index];
    let mut rivals: Vec<String> = stroked::ASKED
        .iter()
        .filter(|c| **c != change && c.class() == about.class && weighed.marginal(**c) >= 0.05)
        .map(|c| c.name().to_owned())
        .collect();
    if change == Change::ForceGain {
        // At regulated pressures the force grows with pressure: these three have one shape.
        rivals.extend([Change::GaugeGain, Change::CrossTalk].map(|c| c.name().to_owned()));
    }
    Changed {
        effect: about.name.into(),
        probability: weighed.marginal(change),
        class_probability: weighed.class(about.class),
        class: about.class,
        share_explained: (1.0 - (after / before.max(f64::MIN_POSITIVE)).powi(2)).clamp(0.0, 1.0),
        parameters: vec![size(about.parameter, value, std, 1e6, 0.0)],
        confusable_with: rivals,
        since: Since::NotDetermined,
        owner: about.owner,
        correction: change.is_bench(),
        law: about.law.into(),
        remedy: about.remedy.into(),
        rms_N: (shape.norm_squared() / shape.len().max(1) as f64).sqrt() * value.abs(),
    }
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
        named
            .iter()
            .filter_map(|change| {
                let index = stroked::ASKED.iter().position(|a| a == change)?;
                Some(weighed.sizes.get(change)?.0 * c.shapes[index][i])
            })
            .sum()
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
