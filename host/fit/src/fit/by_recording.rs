//! Residuals by recording and mounting: which run is low, and whether all of its mounting are.

use std::fmt::Write;

use pam_data::recording::{Campaign, Recording};
use serde::Serialize;

use super::solution::Solution;

/// The residuals `F − F_model` of one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)] // Units are spelled as units are.
pub struct RecordingResidual {
    /// Mounting and run where the file has labels, else the name of the recording.
    pub recording: String,
    /// The mounting; empty where the file does not name it and the length was not held.
    pub mounting: String,
    /// Rows that count.
    pub rows: usize,
    /// Mean residual, N.
    pub mean_N: f64,
    /// Root mean square, N.
    pub rms_N: f64,
    /// Mean residual minus the mean of the other recordings of this mounting, N; absent for the only one.
    pub against_others_N: Option<f64>,
}

/// Sums of the residuals of one recording.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ResidualSums {
    /// The number of rows.
    pub rows: f64,
    /// `Σ (F − F_model)`, N.
    pub sum: f64,
    /// `Σ (F − F_model)²`, N².
    pub square: f64,
}

impl ResidualSums {
    /// Adds the mean residual of some rows.
    pub fn add(&mut self, rows: f64, residual: f64) {
        self.rows += rows;
        self.sum += rows * residual;
        self.square += rows * residual * residual;
    }

    fn mean(&self) -> f64 {
        self.sum / self.rows.max(1.0)
    }
}

/// The table of residuals by recording from the sums of each recording of a campaign. Recordings without rows are left out.
#[must_use]
pub fn by_recording(campaign: &Campaign, sums: &[ResidualSums]) -> Vec<RecordingResidual> {
    let mounting = |r: &Recording| match (r.mounting(), r.held_stroke()) {
        (label, _) if !label.is_empty() => label,
        (_, Some(stroke)) => format!("{:.2} mm", stroke * 1e3),
        (_, None) => String::new(),
    };
    let mountings: Vec<String> = campaign.recordings.iter().map(mounting).collect();
    let of = |i: usize| {
        let own = sums[i];
        let others: Vec<f64> = (0..sums.len())
            .filter(|k| *k != i && mountings[*k] == mountings[i] && sums[*k].rows > 0.0)
            .map(|k| sums[k].mean())
            .collect();
        RecordingResidual {
            recording: campaign.recordings[i].title(),
            mounting: mountings[i].clone(),
            rows: own.rows as usize,
            mean_N: own.mean(),
            rms_N: (own.square / own.rows.max(1.0)).sqrt(),
            against_others_N: (!others.is_empty())
                .then(|| own.mean() - others.iter().sum::<f64>() / others.len() as f64),
        }
    };
    let count = sums.len().min(campaign.recordings.len());
    (0..count).filter(|i| sums[*i].rows > 0.0).map(of).collect()
}

/// The residuals of the points of a fit that count.
pub(super) fn of_fit(solution: &Solution, campaign: &Campaign, residuals: &[f64]) -> Vec<RecordingResidual> {
    let mut sums = vec![ResidualSums::default(); campaign.recordings.len()];
    for (i, p) in solution.problem.points.list.iter().enumerate().filter(|(i, _)| solution.counts(*i)) {
        if let Some(own) = sums.get_mut(p.recording as usize) {
            own.add(f64::from(p.rows), residuals[i]);
        }
    }
    by_recording(campaign, &sums)
}

/// At most this many recordings are printed; of more, those farthest from the others.
const PRINTED: usize = 40;

/// The table as text, empty for fewer than two recordings.
#[must_use]
pub fn recording_table(all: &[RecordingResidual]) -> String {
    if all.len() < 2 {
        return String::new();
    }
    let size = |r: &RecordingResidual| r.against_others_N.unwrap_or(r.mean_N).abs();
    let mut listed: Vec<&RecordingResidual> = all.iter().collect();
    let dropped = all.len().saturating_sub(PRINTED);
    if dropped > 0 {
        let mut sizes: Vec<f64> = all.iter().map(size).collect();
        sizes.sort_by(|a, b| b.total_cmp(a));
        let least = sizes[PRINTED - 1];
        listed.retain(|r| size(r) >= least);
        listed.truncate(PRINTED);
    }
    let width = listed.iter().map(|r| r.recording.chars().count()).max().unwrap_or(0).clamp(9, 40);
    let mut text = format!(
        "residuals by recording (F − F_model)\n{:<width$} {:>8} {:>8} {:>8}  against the others of its mounting",
        "recording", "rows", "mean N", "rms N"
    );
    for r in listed {
        let against = r.against_others_N.map_or("–".to_owned(), |d| format!("{d:+.2} N"));
        let _ = write!(
            text,
            "\n{:<width$} {:8} {:+8.2} {:8.2}  {against}",
            r.recording, r.rows, r.mean_N, r.rms_N
        );
    }
    if dropped > 0 {
        let _ = write!(text, "\n{dropped} more recordings, nearer to the others");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_compared_with_its_own_mounting_only() {
        let run = |mounting: &str, number: &str| Recording {
            labels: vec![("condition".into(), mounting.into()), ("run".into(), number.into())],
            time: vec![0.0],
            stroke: vec![0.0],
            ..Recording::default()
        };
        let campaign =
            Campaign::new(vec![run("Kinked69mm", "1"), run("Kinked69mm", "2"), run("Unkinked", "1")]);
        let sums: Vec<ResidualSums> = [-10.0, 16.0, 3.0]
            .into_iter()
            .map(|mean| {
                let mut s = ResidualSums::default();
                s.add(4.0, mean);
                s
            })
            .collect();
        let table = by_recording(&campaign, &sums);
        assert_eq!(table[1].recording, "Kinked69mm, run 2");
        assert_eq!(table[1].against_others_N, Some(26.0));
        assert_eq!(table[2].against_others_N, None);
        let text = recording_table(&table);
        assert!(text.contains("Kinked69mm, run 2") && text.contains("+26.00 N"), "{text}");
    }
}
