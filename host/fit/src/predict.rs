//! Force predicted by a table on recordings: the base model, the table's effects, and corrections of the bench.
//!
//! Effects have a memory, which runs through the recordings in their order: earlier files are the muscle's history. Over a pause
//! of known length the memories fade as they do in time; an unknown pause counts as a minute. Between recordings at held lengths the
//! muscle is vented ([`crate::vented_rest`]), and for longer where it is remounted. Where a table states how recordings begin
//! ([`crate::beginning`]), memories begin so.

mod model;

use std::borrow::Cow;
use std::fmt::Write;
use std::fs;

use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use rayon::prelude::*;

use crate::confidence_band::ConfidenceBand;
use crate::fit::points::HeldMounting;
use crate::fit::screen::clip;
use crate::table_file::{StoredMounting, TableFile};
use crate::vented_rest;
use model::Model;
use pam_data::error::Result;
use pam_data::physical_limits::Contractions;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, Follower, HELD, Recording, has_decimal_commas};
use pam_data::statistics::NORMAL_95;

/// The predicted force of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The recordings in the campaign's order.
    pub recordings: Vec<Predicted>,
    /// Root mean square of `F − F_model` over all scored rows, N; `None` where there is none.
    pub rms: Option<f64>,
    /// Warnings: excluded readings, extrapolation.
    pub warnings: Vec<String>,
}

/// The predicted force of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// The force that the load cell would read, N, per row.
    pub force: Vec<f64>,
    /// Root mean square of `F − F_model` over the scored rows, N; `None` where none is scored. Not scored are rows without a force, rows
    /// with a failed sensor ([`pam_data::recording::dropouts`]), and readings at an end of the force sensor's range that the model
    /// agrees with: beyond the upper end, or below the lower one or slack.
    pub rms: Option<f64>,
    /// The number of scored rows.
    pub scored: usize,
    /// The number of readings at an end of the force sensor's range that are not scored.
    pub at_limit: usize,
    /// The uncertainty, where it was requested and the table holds it.
    pub bands: Option<Bands>,
}

/// The uncertainty of a predicted recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Bands {
    /// Half the width of the 95 % interval of the base model's force, N, per row: from the uncertainty of the table's parameters.
    pub half: Vec<f64>,
    /// Its mean, N.
    pub mean: f64,
    /// The share of scored forces within the 95 % interval of single readings, which include the residuals of the fit;
    /// `None` without a force column.
    pub inside: Option<f64>,
}

/// Predicts the force of a campaign. Readings of a failed sensor are interpolated ([`pam_data::recording::dropouts`]).
///
/// # Errors
/// [`TableInvalid`](pam_data::error::DataCode::TableInvalid) where the table cannot be evaluated, or names a correction that this program does not know;
/// [`RecordingOutOfRange`](pam_data::error::DataCode::RecordingOutOfRange) where a recording has a length that the table's braid cannot have.
pub fn predict(file: &TableFile, campaign: &Campaign) -> Result<Prediction> {
    run(file, campaign, None)
}

/// [`predict`] with confidence bands.
///
/// # Errors
/// As [`predict`].
pub fn predict_with_bands(file: &TableFile, campaign: &Campaign) -> Result<Prediction> {
    run(file, campaign, ConfidenceBand::of(file).as_ref())
}

/// The ends of the force sensor's range that the readings show, N.
struct Limits {
    low: Option<f64>,
    high: Option<f64>,
}

/// The errors of a prediction in one recording.
struct Errors {
    /// Sum of the squared errors of the scored rows, N².
    square: f64,
    scored: usize,
    at_limit: usize,
    /// Whether a row is scored.
    counts: Vec<bool>,
}

impl Limits {
    fn of(campaign: &Campaign) -> Self {
        let (low, high) = clip(campaign);
        Self { low: low.map(|c| c.force), high: high.map(|c| c.force) }
    }

    /// The error of a reading, N. A reading at an end of the sensor's range only bounds the force: `None` where the model agrees with the
    /// bound. At the lower end a slack muscle agrees, regardless of the reading.
    fn error(&self, reading: f64, model: f64) -> Option<f64> {
        let over = if self.low == Some(reading) {
            model - reading.max(0.0)
        } else if self.high == Some(reading) {
            reading - model
        } else {
            return Some(reading - model);
        };
        (over > 0.0).then_some(over)
    }

    fn errors(&self, recording: &Recording, model: &[f64], read: &[bool]) -> Errors {
        let mut errors = Errors { square: 0.0, scored: 0, at_limit: 0, counts: vec![false; model.len()] };
        for (i, reading) in recording.force.iter().flatten().enumerate().filter(|(i, _)| read[*i]) {
            match self.error(*reading, model[i]) {
                Some(error) => {
                    errors.square += error.powi(2);
                    errors.scored += 1;
                    errors.counts[i] = true;
                }
                None => errors.at_limit += 1,
            }
        }
        errors
    }
}

fn bands(
    band: &ConfidenceBand,
    recording: &Recording,
    motion: &Motion,
    force: &[f64],
    scored: &[bool],
) -> Bands {
    let at = |i: usize| (recording.pressure[i], recording.stroke[i], f64::from(motion.direction[i]));
    let stds = (0..recording.len()).into_par_iter().map(|i| {
        let (pressure, stroke, direction) = at(i);
        band.std(pressure, stroke, direction)
    });
    let stds: Vec<f64> = stds.collect();
    let inside = recording.force.as_ref().map(|measured| {
        let near = |i: &usize| (measured[*i] - force[*i]).abs() <= NORMAL_95 * band.with_scatter(stds[*i]);
        let rows = || (0..measured.len()).filter(|i| scored[*i]);
        rows().filter(near).count() as f64 / rows().count().max(1) as f64
    });
    let half: Vec<f64> = stds.iter().map(|s| NORMAL_95 * s).collect();
    let mean = half.iter().sum::<f64>() / half.len().max(1) as f64;
    Bands { half, mean, inside }
}

fn run(file: &TableFile, campaign: &Campaign, band: Option<&ConfidenceBand>) -> Result<Prediction> {
    let screened = Screened::of(campaign);
    let campaign = screened.campaign.as_ref();
    let mut model = Model::of(file)?;
    let corrected: Vec<Cow<'_, Recording>> =
        campaign.recordings.iter().map(|r| with_true_length(file, r)).collect();
    check_contractions(&model.muscle, &corrected)?;
    let mut follower = Follower::of(campaign);
    let rests = if vented_rest::matters(&file.table.effects) { campaign.rests() } else { None };
    let limits = Limits::of(campaign);
    let mut recordings = Vec::with_capacity(campaign.recordings.len());
    let (mut square, mut rows) = (0.0, 0.0);
    for (index, (recording, motion)) in
        corrected.iter().map(Cow::as_ref).zip(Motion::of_campaign(campaign)).enumerate()
    {
        let force = if model.is_plain() {
            model.plain(recording, &motion)
        } else {
            let mut motions = follower.follow(recording, &motion, campaign.pause_before(index));
            if let Some(rest) = rests.as_ref().and_then(|rests| rests.get(index)) {
                let earlier = file.about.earlier_load.as_ref();
                for context in vented_rest::contexts(&model.muscle, &mut motions, rest, earlier) {
                    model.chain.step(&context);
                }
            }
            model.with_effects(recording, &motions, file.about.beginning)
        };
        let errors = limits.errors(recording, &force, &screened.read(index));
        square += errors.square;
        rows += errors.scored as f64;
        let bands = band.map(|band| bands(band, recording, &motion, &force, &errors.counts));
        let rms = (errors.scored > 0).then(|| (errors.square / errors.scored as f64).sqrt());
        let Errors { scored, at_limit, .. } = errors;
        recordings.push(Predicted { force, rms, scored, at_limit, bands });
    }
    let rms = (rows > 0.0).then(|| (square / rows).sqrt());
    let places: Vec<(f64, f64)> = campaign
        .recordings
        .iter()
        .flat_map(|r| r.pressure.iter().copied().zip(r.stroke.iter().copied()))
        .collect();
    let assumed = rests.as_deref().and_then(vented_rest::remark);
    let warnings = screened.remark().into_iter().chain(assumed).chain(beyond(&file.table, &places)).collect();
    Ok(Prediction { recordings, rms, warnings })
}

/// # Errors
/// A row whose length the table's braid cannot have.
fn check_contractions(muscle: &Muscle<f64>, recordings: &[Cow<'_, Recording>]) -> Result<()> {
    let rest_length = muscle.braid().rest_length();
    let contractions = Contractions::of(muscle.braid());
    for recording in recordings {
        for (i, stroke) in recording.stroke.iter().enumerate() {
            contractions
                .check(stroke / rest_length)
                .map_err(|e| e.file(&recording.source).value(format!("row {}", i + 1)))?;
        }
    }
    Ok(())
}

/// The recording with the correction of its mounting, where the table knows the stroke that it was held at.
pub(crate) fn with_true_length<'a>(file: &TableFile, recording: &'a Recording) -> Cow<'a, Recording> {
    match offset_of(&file.about.mountings, recording) {
        None => Cow::Borrowed(recording),
        Some(offset) => {
            let stroke = recording.stroke.iter().map(|x| x + offset).collect();
            Cow::Owned(Recording { stroke, ..recording.clone() })
        }
    }
}

/// The correction of a recording's stroke, m: that of its own mounting, or where no mounting has its label, the mean of those of its
/// stroke.
fn offset_of(mountings: &[StoredMounting], recording: &Recording) -> Option<f64> {
    let held = HeldMounting::of(recording).filter(|_| !mountings.is_empty())?;
    let same = |m: &&StoredMounting| (m.stroke - held.stroke).abs() <= HELD;
    if let Some(own) = mountings.iter().filter(same).find(|m| m.label == held.label) {
        return Some(own.offset);
    }
    let (sum, count) = mountings.iter().filter(same).fold((0.0, 0.0), |(s, n), m| (s + m.offset, n + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// Says where pressures (Pa) and strokes (m), pair by pair, leave the range that a table was fitted to: there its force is an
/// extrapolation. Up to a hundredth of them may, and a fiftieth of the range counts as within.
#[must_use]
pub fn beyond(table: &MuscleTable, places: &[(f64, f64)]) -> Vec<String> {
    let t = &table.tested;
    let l0 = f64::from(table.geometry.rest_length.metres());
    let mut warnings = Vec::new();
    let mut say = |what: &str, unit: f64, name: &str, range: (f32, f32), of: &dyn Fn(&(f64, f64)) -> f64| {
        let (low, high) = (f64::from(range.0), f64::from(range.1));
        let slack = 0.02 * (high - low).abs() + 1e-9;
        let out = places.iter().map(of).filter(|v| *v < low - slack || *v > high + slack).count();
        if out * 100 > places.len() {
            warnings.push(format!(
                "{} % of the rows are outside the {what} of the fit ({:.4} to {:.4}{name}): the force there is an extrapolation",
                out * 100 / places.len(),
                low / unit,
                high / unit
            ));
        }
    };
    say("pressures", 1e3, " kPa", (t.pressure_low.pascals(), t.pressure_high.pascals()), &|(p, _)| *p);
    say("contractions", 1.0, "", (t.contraction_low, t.contraction_high), &|(_, x)| x / l0);
    warnings
}

/// The recordings with a column `force_model_N` added, as one CSV table; with several recordings the first column is
/// `file`. Where the prediction has bands, a last column `force_model_band_N` is half the width of the force's 95 % interval.
///
/// Where all files are plain text with one header their cells are kept as they are, other columns included. Recordings
/// that came in by an import description, with decimal commas, or from other containers, are written in the usual columns instead; `false`
/// then. Columns of an earlier prediction are replaced, and a column `file` of the recordings is called `file_in_recording` where there
/// is one before it.
#[must_use]
pub fn to_csv(campaign: &Campaign, prediction: &Prediction, imported: bool) -> (Vec<u8>, bool) {
    let verbatim = if imported { None } else { verbatim(campaign, prediction) };
    let whole = verbatim.is_some();
    (verbatim.unwrap_or_else(|| standard(campaign, prediction)).into_bytes(), whole)
}

/// The columns that a prediction adds behind those of the recordings.
const PREDICTED: [&str; 2] = ["force_model_N", "force_model_band_N"];

/// The cells of a line as they are written, with their quotation marks.
fn cells(line: &str, delimiter: char) -> Vec<&str> {
    let mut quoted = false;
    let ends = |c: char| {
        quoted ^= c == '"';
        c == delimiter && !quoted
    };
    line.split(ends).collect()
}

/// A header without the columns of an earlier prediction, and the places of the columns that remain; `None` where all do.
fn own_columns(header: &str, delimiter: char, several: bool) -> (String, Option<Vec<usize>>) {
    let all = cells(header, delimiter);
    let bare = |n: usize| all[n].trim().trim_matches('"');
    let kept: Vec<usize> = (0..all.len()).filter(|n| !PREDICTED.contains(&bare(*n))).collect();
    let name = |n: &usize| if several && bare(*n) == "file" { "file_in_recording" } else { all[*n] };
    let names: Vec<&str> = kept.iter().map(name).collect();
    (names.join(&delimiter.to_string()), (kept.len() < all.len()).then_some(kept))
}

fn verbatim(campaign: &Campaign, prediction: &Prediction) -> Option<String> {
    let several = campaign.recordings.len() > 1;
    let banded = prediction.recordings.iter().all(|p| p.bands.is_some());
    let mut out = String::new();
    let mut header: Option<(String, char)> = None;
    let mut kept = None;
    for (recording, predicted) in campaign.recordings.iter().zip(&prediction.recordings) {
        if recording.rows.is_some() {
            return None;
        }
        // A pipe was read already, and would hold this program up permanently.
        fs::metadata(&recording.source).ok().filter(fs::Metadata::is_file)?;
        let text = fs::read(&recording.source).ok().and_then(|b| String::from_utf8(b).ok())?;
        let mut lines = text.trim_start_matches('\u{feff}').lines().filter(|l| !l.trim().is_empty());
        let first = lines.next()?;
        let delimiter = ['\t', ';', ','].into_iter().find(|d| first.contains(*d))?;
        match &header {
            None => {
                let file = if several { format!("file{delimiter}") } else { String::new() };
                let band = if banded { format!("{delimiter}force_model_band_N") } else { String::new() };
                let own;
                (own, kept) = own_columns(first, delimiter, several);
                let _ = writeln!(out, "{file}{own}{delimiter}force_model_N{band}");
                header = Some((first.to_owned(), delimiter));
            }
            Some((known, _)) if known != first => return None,
            Some(_) => {}
        }
        let rows: Vec<&str> = lines.collect();
        // Points among decimal commas do not make a table.
        let commas = rows
            .first()
            .is_some_and(|r| delimiter != ',' && has_decimal_commas(r.as_bytes(), delimiter as u8));
        if commas || rows.len() != predicted.force.len() {
            return None;
        }
        for (i, (row, force)) in rows.iter().zip(&predicted.force).enumerate() {
            if several {
                let _ = write!(out, "{}{delimiter}", cell(&recording.name, delimiter));
            }
            match &kept {
                None => out += row,
                Some(kept) => {
                    let cells = cells(row, delimiter);
                    let own = kept.iter().map(|n| cells.get(*n).copied()).collect::<Option<Vec<&str>>>()?;
                    out += &own.join(&delimiter.to_string());
                }
            }
            let _ = write!(out, "{delimiter}{force:.6}");
            end_line(&mut out, predicted, i, delimiter);
        }
    }
    Some(out)
}

fn standard(campaign: &Campaign, prediction: &Prediction) -> String {
    let several = campaign.recordings.len() > 1;
    let all = |has: &dyn Fn(&Recording) -> bool| campaign.recordings.iter().all(has);
    let force = all(&|r| r.force.is_some());
    let temperature = all(&|r| r.temperature.is_some());
    let command = all(&|r| r.pressure_command.is_some());
    let cycle = all(&|r| r.cycle.is_some());
    let mut out = String::new();
    if several {
        out += "file,";
    }
    out += "time_s,pressure_kPa,displacement_mm";
    for (there, name) in [
        (force, ",force_N"),
        (temperature, ",temperature_K"),
        (command, ",pressure_command_kPa"),
        (cycle, ",cycle"),
    ] {
        if there {
            out += name;
        }
    }
    out += ",force_model_N";
    if prediction.recordings.iter().all(|p| p.bands.is_some()) {
        out += ",force_model_band_N";
    }
    out.push('\n');
    for (r, predicted) in campaign.recordings.iter().zip(&prediction.recordings) {
        let name = cell(&r.name, ',');
        for i in 0..r.len() {
            if several {
                let _ = write!(out, "{name},");
            }
            let _ = write!(out, "{},{},{}", r.time[i], r.pressure[i] / 1e3, r.stroke[i] * 1e3);
            for (there, column, scale) in [
                (force, &r.force, 1.0),
                (temperature, &r.temperature, 1.0),
                (command, &r.pressure_command, 1e-3),
            ] {
                if let (true, Some(column)) = (there, column) {
                    let _ = write!(out, ",{}", column[i] * scale);
                }
            }
            if let (true, Some(cycles)) = (cycle, &r.cycle) {
                let _ = write!(out, ",{}", cycles[i]);
            }
            let _ = write!(out, ",{:.6}", predicted.force[i]);
            end_line(&mut out, predicted, i, ',');
        }
    }
    out
}

fn end_line(out: &mut String, predicted: &Predicted, row: usize, delimiter: char) {
    if let Some(bands) = &predicted.bands {
        let _ = write!(out, "{delimiter}{:.6}", bands.half[row]);
    }
    out.push('\n');
}

/// A name as one cell: quoted where it holds the delimiter or a quote.
fn cell(name: &str, delimiter: char) -> String {
    if name.contains([delimiter, '"', '\n']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_at_an_end_of_the_range_count_only_where_the_model_disagrees() {
        let limits = Limits { low: Some(-8.0), high: Some(100.0) };
        // A slack muscle pulls nothing, regardless of the offset of the load cell.
        assert_eq!(limits.error(-8.0, 0.0), None);
        assert_eq!(limits.error(-8.0, -20.0), None);
        assert_eq!(limits.error(-8.0, 3.0), Some(3.0));
        assert_eq!(limits.error(100.0, 130.0), None);
        assert_eq!(limits.error(100.0, 90.0), Some(10.0));
        assert_eq!(limits.error(50.0, 52.0), Some(-2.0));
        let recording =
            Recording { force: Some(vec![-8.0, -8.0, 50.0, 100.0, 60.0]), ..Recording::default() };
        let errors =
            limits.errors(&recording, &[0.0, 3.0, 46.0, 130.0, 0.0], &[true, true, true, true, false]);
        assert_eq!((errors.scored, errors.at_limit, errors.square), (2, 2, 25.0));
        assert_eq!(errors.counts, [false, true, true, false, false]);
    }

    #[test]
    fn an_earlier_prediction_is_replaced_and_no_name_occurs_twice() {
        let header = "file,time_s,\"note, x\",force_model_N,force_N,\"force_model_band_N\"";
        let (names, kept) = own_columns(header, ',', true);
        assert_eq!(names, "file_in_recording,time_s,\"note, x\",force_N");
        assert_eq!(kept, Some(vec![0, 1, 2, 4]));
        assert_eq!(cells("a,1,\"b, \"\"c\"\"\",2", ','), ["a", "1", "\"b, \"\"c\"\"\"", "2"]);
        assert_eq!(own_columns("file;time_s", ';', false), ("file;time_s".to_owned(), None));
    }
}
