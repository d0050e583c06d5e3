//! Lengths that are held one after another in one recording: each hold is a recording at a held length.

use pam_data::recording::motion::{Hold, Motion};
use pam_data::recording::{Campaign, Recording};
use pam_data::statistics::range;

use super::criteria::{HELD, REPORT_REGULATED, STAGES_FEWEST_ROWS, STAGES_SHARE};

/// The campaign with each recording of held stages replaced by its stages.
pub(super) fn parted(campaign: &Campaign) -> Campaign {
    let parts = |r: &Recording| stages(r).unwrap_or_else(|| vec![r.clone()]);
    Campaign {
        recordings: campaign.recordings.iter().flat_map(parts).collect(),
        clock: campaign.clock,
        warnings: campaign.warnings.clone(),
    }
}

/// The stages of a recording; `None` where the pressure does not sweep at held lengths for most of the time.
fn stages(recording: &Recording) -> Option<Vec<Recording>> {
    let motion = Motion::of(recording);
    let largest = recording.pressure.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    let sweeps = |hold: &&Hold| {
        let rows = hold.start..hold.end + 1;
        rows.len() >= STAGES_FEWEST_ROWS
            && range(&recording.stroke[rows.clone()]) <= HELD
            && range(&recording.pressure[rows]) > REPORT_REGULATED * largest
    };
    let holds: Vec<&Hold> = motion.holds.iter().filter(sweeps).collect();
    let lasts = |hold: &&Hold| recording.time[hold.end] - recording.time[hold.start];
    let held: f64 = holds.iter().map(lasts).sum();
    let staged = holds.len() > 1 && held > STAGES_SHARE * recording.duration();
    staged.then(|| holds.iter().enumerate().map(|(i, hold)| stage(recording, i + 1, hold)).collect())
}

/// The rows of one hold.
fn stage(recording: &Recording, number: usize, hold: &Hold) -> Recording {
    let rows = hold.start..hold.end + 1;
    let part = |column: &Option<Vec<f64>>| column.as_ref().map(|c| c[rows.clone()].to_vec());
    let name = format!("{}, stage {number} at {:.1} mm", recording.name, hold.stroke * 1e3);
    let first = u32::try_from(rows.start).unwrap_or(u32::MAX);
    Recording {
        name,
        source: recording.source.clone(),
        labels: recording.labels.clone(),
        rows: Some(match &recording.rows {
            Some(kept) => kept[rows.clone()].to_vec(),
            None => (first..).take(rows.len()).collect(),
        }),
        skipped: 0,
        rest_length: recording.rest_length,
        time_of_day: recording.time_of_day,
        time: recording.time[rows.clone()].to_vec(),
        pressure: recording.pressure[rows.clone()].to_vec(),
        stroke: recording.stroke[rows.clone()].to_vec(),
        force: part(&recording.force),
        temperature: part(&recording.temperature),
        pressure_command: part(&recording.pressure_command),
        cycle: recording.cycle.as_ref().map(|c| c[rows.clone()].to_vec()),
        direction: recording.direction.as_ref().map(|c| c[rows.clone()].to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty rows a second; the stroke is `stroke(t)`, the pressure `pressure(t)`.
    fn recording(seconds: usize, stroke: impl Fn(f64) -> f64, pressure: impl Fn(f64) -> f64) -> Recording {
        let time: Vec<f64> = (0..20 * seconds).map(|i| i as f64 * 0.05).collect();
        let of = |f: &dyn Fn(f64) -> f64| time.iter().map(|t| f(*t)).collect::<Vec<f64>>();
        Recording {
            name: "stages".into(),
            stroke: of(&stroke),
            pressure: of(&pressure),
            force: Some(of(&pressure)),
            time,
            ..Recording::default()
        }
    }

    /// Three lengths, held for 40 s each, with 2 s of motion between them.
    fn staircase(t: f64) -> f64 {
        let stage = (t / 42.0).floor();
        let moving = ((t - 42.0 * stage - 40.0) / 2.0).max(0.0);
        5e-3 * (stage + moving).min(2.0)
    }

    fn sweep(t: f64) -> f64 {
        300e3 * (1.0 - (t / 42.0 * 2.0 * std::f64::consts::TAU).cos())
    }

    #[test]
    fn held_lengths_in_one_file_are_recordings_of_their_own() {
        let campaign = Campaign::new(vec![recording(124, staircase, sweep)]);
        let parts = parted(&campaign).recordings;
        let strokes: Vec<f64> = parts.iter().map(|r| (r.stroke[0] * 1e3).round()).collect();
        assert_eq!(strokes, [0.0, 5.0, 10.0]);
        for part in &parts {
            assert!(part.check().is_ok() && part.duration() > 30.0, "{}: {} s", part.name, part.duration());
            assert_eq!(part.rows.as_ref().map(Vec::len), Some(part.len()));
        }
    }

    #[test]
    fn strokes_and_one_held_length_stay_whole() {
        let triangle = |t: f64| 5e-3 * (1.0 - (t / 10.0).cos());
        let strokes = Campaign::new(vec![recording(124, triangle, |_| 300e3)]);
        assert_eq!(parted(&strokes).recordings.len(), 1);
        let held = Campaign::new(vec![recording(124, |_| 5e-3, sweep)]);
        assert_eq!(parted(&held).recordings.len(), 1);
        // Lengths held at a regulated pressure are strokes with dwells.
        let dwells = Campaign::new(vec![recording(124, staircase, |_| 300e3)]);
        assert_eq!(parted(&dwells).recordings.len(), 1);
    }
}
