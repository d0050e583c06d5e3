//! Residuals by recording, as a table and as a picture: the same in every report.

use pam_fit::RecordingResidual;

use super::{Axis, Colour, Figure, Panel, Section, Table, fixed};

/// At most this many rows; of more recordings, those farthest from the others of their mounting.
const ROWS: usize = 40;
/// At most this many names fit below an axis.
const NAMES: usize = 8;

/// Adds the residuals of every recording to a section; nothing for a single one.
pub(crate) fn add(section: &mut Section, caption: &str, all: &[RecordingResidual]) {
    if all.len() < 2 {
        return;
    }
    let size = |r: &RecordingResidual| r.against_others_N.unwrap_or(r.mean_N).abs();
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|a, b| size(&all[*b]).total_cmp(&size(&all[*a])));
    order.truncate(ROWS);
    order.sort_unstable();
    let mut table = Table::new(
        caption,
        &["recording", "mounting", "rows", "mean (N)", "rms (N)", "against the others of its mounting (N)"],
    );
    for r in order.iter().map(|i| &all[*i]) {
        table.row([
            r.recording.clone(),
            if r.mounting == r.recording { String::new() } else { r.mounting.clone() },
            fixed(r.rows as f64, 0),
            signed(r.mean_N),
            fixed(r.rms_N, 2),
            r.against_others_N.map_or(String::new(), signed),
        ]);
    }
    section.table(table);
    if all.len() > ROWS {
        section.text(format!(
            "{} recordings that are closer to the others of their mounting are not listed; the JSON has all.",
            all.len() - ROWS
        ));
    }
}

fn signed(value: f64) -> String {
    let text = fixed(value, 2);
    if value > 0.0 { format!("+{text}") } else { text }
}

/// Standard deviation of the residuals of one recording about their mean, N: `rms² = mean² + std²`.
fn scatter(r: &RecordingResidual) -> f64 {
    (r.rms_N * r.rms_N - r.mean_N * r.mean_N).max(0.0).sqrt()
}

/// Whether a recording is off as a whole: its mean residual is larger than the scatter about it.
pub(crate) fn is_off(r: &RecordingResidual) -> bool {
    r.mean_N.abs() > scatter(r)
}

/// The mean residual of every recording with the standard deviation about it.
pub(crate) fn figure(id: &str, title: &str, reading: &str, all: &[RecordingResidual]) -> Figure {
    let x: Vec<f64> = (0..all.len()).map(|i| i as f64).collect();
    let mean: Vec<f64> = all.iter().map(|r| r.mean_N).collect();
    let edge = |sign: f64| -> Vec<f64> { all.iter().map(|r| r.mean_N + sign * scatter(r)).collect() };
    let names: Vec<String> = all.iter().map(|r| r.recording.clone()).collect();
    let (axis, x) = if all.len() <= NAMES && names.iter().all(|n| n.chars().count() <= 12) {
        (Axis::names("recording", names), x)
    } else {
        (Axis::new("recording, in the order of the table", ""), x.iter().map(|x| x + 1.0).collect())
    };
    let panel = Panel::new(axis, Axis::new("measured − predicted force", "N"))
        .intervals("mean ± standard deviation", Colour::Muted, &x, &edge(-1.0), &edge(1.0))
        .points("mean", Colour::Series(0), &x, &mean);
    Figure::new(id, title, reading, panel)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Block;

    fn residual(k: usize) -> RecordingResidual {
        RecordingResidual {
            recording: format!("run {k}"),
            mounting: "long".into(),
            rows: 100,
            mean_N: k as f64 - 30.0,
            rms_N: 1.0,
            against_others_N: Some(k as f64 - 30.0),
        }
    }

    #[test]
    fn many_recordings_are_cut_to_those_that_differ_most() {
        let all: Vec<RecordingResidual> = (0..60).map(residual).collect();
        let mut section = Section::new("x");
        add(&mut section, "c", &all);
        let Block::Table(table) = &section.blocks[0] else { panic!("a table") };
        assert_eq!(table.rows.len(), ROWS);
        assert!(table.rows.iter().all(|r| r[0] != "run 30") && table.rows[0][0] == "run 0");
        assert!(matches!(&section.blocks[1], Block::Text(t) if t.starts_with("20 recordings")));
        let mut one = Section::new("x");
        add(&mut one, "c", &all[..1]);
        assert!(one.blocks.is_empty());
    }

    #[test]
    fn only_a_recording_that_is_off_as_a_whole_has_an_interval_without_zero() {
        let of = |mean: f64, std: f64| RecordingResidual {
            mean_N: mean,
            rms_N: (mean * mean + std * std).sqrt(),
            ..residual(0)
        };
        assert!(is_off(&of(3.0, 1.0)) && is_off(&of(-3.0, 1.0)));
        assert!(!is_off(&of(0.5, 1.0)) && !is_off(&of(0.0, 0.0)));
        let shown = figure("a", "t", "r", &[of(3.0, 1.0), of(0.5, 1.0)]).csv();
        assert!(shown.contains("2") && shown.contains("4"), "{shown}");
    }
}
