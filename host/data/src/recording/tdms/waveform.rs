//! The times of channels, from the properties of their waveforms.

use super::channel::{Channel, Data, Waveform};
use crate::bounds::Budget;
use crate::error::{DataCode, Error, Result};
use crate::recording::import_guess::is_reading_of;
use crate::recording::quantity::Quantity;

/// The column of the time.
pub(super) const TIME: &str = "time_s";

/// Times as the properties give them: the first, and the step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Times {
    first: f64,
    step: f64,
}

/// Time, remarks, and the channels with one value for each time.
type Timed = (Option<Vec<f64>>, Vec<String>, Vec<Channel>);

/// Adds the time of channels with waveforms. Those at other times than the pressure are interpolated linearly to its times; integers,
/// which move in steps, hold their last value.
pub(super) fn timed(mut channels: Vec<Channel>, budget: &mut Budget) -> Result<Timed> {
    let numbers = |c: &Channel| matches!(c.data, Data::Numbers(_)) && !c.unscaled;
    let with_start = channels.iter().filter(|c| numbers(c)).all(|c| c.waveform.start.is_some());
    let of = |c: &Channel| if numbers(c) { times(c.waveform, with_start) } else { None };
    let waves: Vec<usize> = (0..channels.len()).filter(|c| of(&channels[*c]).is_some()).collect();
    let is_pressure = |c: &&usize| is_reading_of(&channels[**c].column_name(true), Quantity::Pressure);
    let longest = waves.iter().max_by_key(|c| length(&channels[**c]));
    let Some(&clock) = waves.iter().find(is_pressure).or(longest) else {
        return Ok((None, Vec::new(), channels));
    };
    // A channel of times, as some programs write beside the waveform's properties, says more than they do.
    if channels.iter().any(|c| is_reading_of(&c.column_name(true), Quantity::Time)) {
        return Ok((None, Vec::new(), channels));
    }
    let (Some(own), rows) = (of(&channels[clock]), length(&channels[clock])) else {
        return Ok((None, Vec::new(), channels));
    };
    let others: Vec<usize> = waves
        .iter()
        .copied()
        .filter(|c| of(&channels[*c]) != Some(own) || length(&channels[*c]) != rows)
        .collect();
    let time = |row: usize| own.first + row as f64 * own.step;
    // A tenth of a step: the products differ in their last digits.
    let slack = 0.1 * own.step;
    let spans = waves.iter().filter_map(|c| Some((of(&channels[*c])?, length(&channels[*c]))));
    let (mut begin, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
    for (times, length) in spans {
        begin = begin.max(times.first - slack);
        end = end.min(times.first + (length.max(1) - 1) as f64 * times.step + slack);
    }
    let kept: Vec<usize> = (0..rows).filter(|row| (begin..=end).contains(&time(*row))).collect();
    if kept.is_empty() {
        return Err(Error::new(DataCode::RecordingEmpty, "the waveforms of the channels have no time in common")
            .help("record the channels together; their properties wf_start_time, wf_start_offset and wf_increment say when"));
    }
    budget.take(kept.len().saturating_mul(others.len() + 1))?;
    let seconds: Vec<f64> = kept.iter().map(|row| time(*row)).collect();
    for c in &waves {
        let Some(at) = of(&channels[*c]) else { continue };
        let (steps, other) = (channels[*c].steps, others.contains(c));
        if let Data::Numbers(values) = &mut channels[*c].data {
            *values = if other {
                seconds.iter().map(|t| interpolated(values, (t - at.first) / at.step, steps)).collect()
            } else {
                kept.iter().filter_map(|row| values.get(*row).copied()).collect()
            };
        }
    }
    let start = if with_start { "wf_start_time, wf_start_offset" } else { "wf_start_offset" };
    let mut notes =
        vec![format!("{TIME} is from the properties {start} and wf_increment of {}", channels[clock].name)];
    if !others.is_empty() {
        let names: Vec<&str> = others.iter().map(|c| channels[*c].name.as_str()).collect();
        notes.push(format!(
            "interpolated linearly to these rows (integers hold their last value): {}",
            names.join(", ")
        ));
    }
    Ok((Some(seconds), notes, channels))
}

fn times(waveform: Waveform, with_start: bool) -> Option<Times> {
    let step = waveform.increment.filter(|step| *step > 0.0 && step.is_finite())?;
    let start = if with_start { waveform.start? } else { 0.0 };
    let first = start + waveform.offset;
    first.is_finite().then_some(Times { first, step })
}

fn length(channel: &Channel) -> usize {
    if let Data::Numbers(values) = &channel.data { values.len() } else { 0 }
}

/// The value at a place between two values.
fn interpolated(values: &[f64], place: f64, steps: bool) -> f64 {
    let place = place.max(0.0);
    let before = place.floor().min((values.len().max(1) - 1) as f64) as usize;
    match (values.get(before), values.get(before + 1)) {
        (Some(value), Some(next)) if !steps => {
            value + (next - value) * (place - before as f64).clamp(0.0, 1.0)
        }
        (Some(value), _) => *value,
        (None, _) => f64::NAN,
    }
}
