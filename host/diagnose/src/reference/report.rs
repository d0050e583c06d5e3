//! From two sides to the answer: which protocol, which reference, and what both kinds of answers share.

use super::answer::{ChangeReport, Left, NotComparable, Place, Remark, Repeatability, Verdict};
use super::closed_valves::Loss;
use super::criteria::{
    COMBINED_UNREST, HELD, NAMED, OTHER_LENGTH, PRIOR_LIMITS, PRIOR_NONE, REGULATED_QUANTILES,
    REPORT_REGULATED, UNSTATED_ERROR,
};
use super::held_out::Unseen;
use super::isometric;
use super::runs::Runs;
use super::shapes::{self, Change};
use super::staircase_answer::staircases;
use super::stroke_answer::strokes;
use super::stroked;
use super::surface::Surface;
use super::withdrawn_findings::withdraw;
use super::{catalogue, closed_valves, combined, input_checks, stages, table_surface, units};
use model_core::braid::Geometry;
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::{self, Campaign, Recording};
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
    /// The muscle's dimensions, where they are described: then strokes are compared with every effect of the catalogue.
    pub geometry: Option<Geometry>,
    /// Whether AFTER was remounted.
    pub mounted: Mounted,
    /// Prior probability that something changed, instead of the usual.
    pub prior_changed: Option<f64>,
    /// Effects beyond the catalogue, which a test brings.
    #[cfg(test)]
    pub(crate) added: Vec<Change>,
}

impl Options {
    /// The changes that readings at held lengths show, in the order in which they are tested.
    fn tested(&self) -> Vec<Change> {
        #[cfg(test)]
        return shapes::tested(self.added.iter().copied());
        #[cfg(not(test))]
        shapes::tested([])
    }
}

/// How the recordings were made.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Protocol {
    Held,
    Stroked,
    /// Length and pressure move together.
    Combined,
}

/// The range of a column without its outermost hundredths, which a noisy sensor makes.
fn usual_range(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = |share: f64| sorted[(share * last as f64).round() as usize];
    at(0.99) - at(0.01)
}

/// Whether a recording was made at a held length: the length varies by no more than a mounting does. A short stroke at a regulated
/// pressure, as at the lowest level of a campaign of loops, is a stroke.
fn is_held(r: &Recording) -> bool {
    let travel = usual_range(&r.stroke);
    let largest = r.pressure.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    let regulated = usual_range(&r.pressure) <= REPORT_REGULATED * largest;
    travel <= HELD && !(regulated && travel > recording::HELD) && !combined::swings(r)
}

fn protocol(campaign: &Campaign, side: &str) -> Result<Protocol> {
    let held = campaign.recordings.iter().filter(|r| is_held(r)).count();
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
        if !sorted.is_empty()
            && at(REGULATED_QUANTILES.1) - at(REGULATED_QUANTILES.0) > REPORT_REGULATED * at(1.0).abs()
        {
            // Several levels in one file are levels still, as long as each stroke has one.
            let levels = super::strokes::levels(&[campaign]);
            if levels.len() < 2 || super::strokes::unrest(r) > COMBINED_UNREST * at(1.0).abs() {
                return Ok(Protocol::Combined);
            }
        }
    }
    Ok(Protocol::Stroked)
}

/// Whether all recordings of a campaign were made at held lengths; strokes otherwise.
///
/// # Errors
/// A mixture of both, or length and pressure that move together.
pub(crate) fn protocol_is_held(campaign: &Campaign) -> Result<bool> {
    match protocol(campaign, "the campaign")? {
        Protocol::Held => Ok(true),
        Protocol::Stroked => Ok(false),
        Protocol::Combined => {
            Err(Error::new(DataCode::RecordingOutOfRange, "length and pressure move together").help(
                "a comparison needs pressure sweeps at held lengths, or strokes at regulated pressures",
            ))
        }
    }
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
    let given = after;
    let after = &stages::parted(given);
    let kind = match (protocol(after, "AFTER"), &options.geometry) {
        // Strokes with readings at rest between them: a described muscle is compared row by row.
        (Err(_), Some(_)) if matches!(against, Against::Recordings(_)) => Protocol::Combined,
        (kind, _) => kind?,
    };
    let mut report = match against {
        Against::Recordings(before) => beside_recordings(before, (given, after), kind, options)?,
        Against::Table(table, path) => beside_table(table, path, after, kind, options)?,
    };
    report.samples = given.samples();
    report.muscle.clone_from(&options.muscle);
    Ok(report)
}

/// AFTER, as it was given and in parts, beside earlier recordings.
fn beside_recordings(
    whole: &Campaign,
    (given, after): (&Campaign, &Campaign),
    kind: Protocol,
    options: &Options,
) -> Result<ChangeReport> {
    for r in &whole.recordings {
        r.require_force()?;
    }
    input_checks::refuse_shared_rows(whole, given)?;
    input_checks::one_actuator(whole, given)?;
    let before = &stages::parted(whole);
    let mut remarks = units::check(before, after)?;
    remarks.extend(input_checks::order_remark(before, after));
    let described = options.geometry.as_ref().filter(|_| kind != Protocol::Held);
    let (mut report, loss) = match described {
        Some(geometry) => (catalogue::compare(whole, given, geometry, options)?, None),
        None => by_protocol(before, after, kind, options)?,
    };
    report.reference.files = files(before);
    report.reference.samples = whole.samples();
    report.remarks.splice(0..0, remarks);
    withdraw(&mut report);
    if let Some(loss) = loss {
        closed_valves::add(&mut report, &loss, options.tested().len(), prior(options, PRIOR_NONE));
    }
    Ok(report)
}

/// Two campaigns of an actuator without a description, by the way in which both were recorded; and what closed valves lose, where that shows.
fn by_protocol(
    before: &Campaign,
    after: &Campaign,
    kind: Protocol,
    options: &Options,
) -> Result<(ChangeReport, Option<Loss>)> {
    match (protocol(before, "the reference")?, kind) {
        (Protocol::Held, Protocol::Held) => held(before, after, options),
        (Protocol::Stroked, Protocol::Stroked) => {
            Ok((strokes(&stroked::compare(before, after, 0.0)?, options)?, None))
        }
        (Protocol::Combined, Protocol::Combined | Protocol::Stroked)
        | (Protocol::Stroked, Protocol::Combined) => {
            let (runs, plane) = combined::of(before, after, options.mounted)?;
            let mut surface = Surface::of(&runs)?;
            plane.into_slopes(&mut surface, &runs.strokes);
            recorded(runs, surface, options)
        }
        _ => {
            let what = "one side holds the length, the other strokes";
            Err(Error::new(DataCode::RecordingOutOfRange, what)
                .help("give recordings of the same protocol on both sides"))
        }
    }
}

/// AFTER beside a table.
fn beside_table(
    table: &TableFile,
    path: &str,
    after: &Campaign,
    kind: Protocol,
    options: &Options,
) -> Result<ChangeReport> {
    let other = same_actuator(table, options)?;
    let mut report = match kind {
        Protocol::Held => against_table(table, after, Runs::alone(after, options.mounted)?, options)?,
        Protocol::Combined => {
            let runs = combined::alone(table, after, options.mounted)?;
            against_table(table, after, runs, options)?
        }
        Protocol::Stroked => stroked_against_table(table, after, options)?,
    };
    report.reference.table = Some(path.to_owned());
    report.remarks.splice(0..0, other);
    report.reference.repeatability_from = Repeatability::Assumed;
    withdraw(&mut report);
    Ok(report)
}

fn files(campaign: &Campaign) -> Vec<String> {
    let mut all: Vec<String> = campaign.recordings.iter().map(|r| r.source.display().to_string()).collect();
    all.dedup();
    all
}

pub(super) fn prior(options: &Options, usual: f64) -> f64 {
    let none = options.prior_changed.map_or(usual, |p| 1.0 - p);
    none.clamp(PRIOR_LIMITS.0, PRIOR_LIMITS.1)
}

fn held(before: &Campaign, after: &Campaign, options: &Options) -> Result<(ChangeReport, Option<Loss>)> {
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
    recorded(runs, surface, options)
}

/// Runs on both sides.
fn recorded(runs: Runs, surface: Surface, options: &Options) -> Result<(ChangeReport, Option<Loss>)> {
    let loss = closed_valves::compare(&runs);
    let reference = isometric::Reference { surface, error: 0.0, recorded: true };
    let analysis = isometric::analyse(runs, reference, options.tested(), prior(options, PRIOR_NONE))?;
    Ok((staircases(&analysis, options), loss))
}

fn against_table(table: &TableFile, after: &Campaign, runs: Runs, options: &Options) -> Result<ChangeReport> {
    units::check_pressure(after, f64::from(table.table.tested.pressure_high.pascals()))?;
    let mut surface = table_surface::of(table, &runs)?;
    units::check_force(after, surface.largest)?;
    if !runs.moving {
        table_surface::fill_own_slopes(&mut surface, &runs);
    }
    let stated = table.about.fit.rms_newtons;
    let error = if stated > 0.0 { stated } else { UNSTATED_ERROR * surface.largest };
    let reference = isometric::Reference { surface, error, recorded: false };
    let analysis = isometric::analyse(runs, reference, options.tested(), prior(options, PRIOR_NONE))?;
    let mut report = staircases(&analysis, options);
    report.remarks.push(table_remark(table, analysis.reference_error));
    Ok(report)
}

/// The table's own muscle beside the described one.
///
/// # Errors
/// Rest lengths of two actuators.
fn same_actuator(table: &TableFile, options: &Options) -> Result<Option<Remark>> {
    let own = f64::from(table.table.geometry.rest_length.metres());
    let name = &table.about.muscle;
    if let Some(rest) = options.rest_length.filter(|r| !((r / own - 1.0).abs() <= OTHER_LENGTH)) {
        let described = options.muscle.as_deref().unwrap_or("the muscle");
        return Err(Error::new(
            DataCode::CallInvalid,
            format!(
                "the table is that of `{name}` with a rest length of {:.1} mm, `{described}` has {:.1} mm",
                own * 1e3,
                rest * 1e3
            ),
        )
        .help("give the table and the description of one muscle"));
    }
    let other = options.muscle.as_ref().filter(|m| !name.is_empty() && *m != name);
    Ok(other.map(|m| Remark::OtherTable(name.clone(), m.clone())))
}

fn table_remark(table: &TableFile, error: f64) -> Remark {
    let sources = table.about.sources.iter().map(|s| s.path.clone()).collect();
    Remark::Table { error, stated: table.about.fit.rms_newtons.max(0.0), sources }
}

/// Strokes against what the table gives for the same motion.
fn stroked_against_table(table: &TableFile, after: &Campaign, options: &Options) -> Result<ChangeReport> {
    let mut before = after.clone();
    let predicted = predict(table, after)?;
    for (recording, p) in before.recordings.iter_mut().zip(predicted.recordings) {
        recording.force = Some(p.force);
    }
    let error = table.about.fit.rms_newtons.max(0.0);
    let mut report = strokes(&stroked::compare(&before, after, error)?, options)?;
    report.remarks.push(table_remark(table, error));
    Ok(report)
}

/// The verdict from the named changes and the residual.
pub(super) fn verdict(none: f64, named: usize, left: bool) -> Verdict {
    match (named, left) {
        (0, _) if none >= NAMED => Verdict::Consistent,
        (0, _) => Verdict::Unexplained,
        (_, false) => Verdict::Explained,
        (_, true) => Verdict::PartlyExplained,
    }
}
pub(super) fn left(verdict: Verdict, unseen: &Unseen, places: &[Place]) -> Left {
    let share = match verdict {
        Verdict::Consistent => 0.0,
        Verdict::Unexplained => 1.0,
        _ => (1.0 - unseen.share()).clamp(0.0, 1.0),
    };
    let has_misfit = matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained);
    Left { share, place: places.first().filter(|_| has_misfit).cloned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(stroke: impl Fn(f64) -> f64, pressure: impl Fn(f64) -> f64) -> Recording {
        let time: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.1).collect();
        let of = |f: &dyn Fn(f64) -> f64| time.iter().map(|t| f(*t)).collect::<Vec<f64>>();
        Recording { stroke: of(&stroke), pressure: of(&pressure), time, ..Recording::default() }
    }

    #[test]
    fn short_strokes_at_a_regulated_pressure_are_strokes() {
        let wave = |t: f64| 0.25 * (1.0 - t.cos());
        // The lowest level of a campaign of loops, a mounting that gives a little, and a frozen muscle.
        assert!(!is_held(&recording(|t| 1e-3 * wave(t), |_| 205e3)));
        assert!(is_held(&recording(|t| 1e-3 * wave(t), |t| 620e3 * wave(t))));
        assert!(is_held(&recording(|_| 5e-3, |_| 205e3)));
    }
}
