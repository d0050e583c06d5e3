//! Sensors that read one value through a whole recording, which the other readings exclude.

use super::{Campaign, Channel, Kind, Recording, SensorFault, Usual, downsampled, stride};
use crate::statistics::{extremes, quantile};

/// A dead sensor's readings stay within this share of the campaign's range of the column: its noise, or the drift of an amplifier.
const DEAD: f64 = 0.02;
/// A muscle that pulls with this share of the range of forces has pressure inside.
const PULLS: f64 = 0.2;
/// In at least this share of the rows.
const ROWS: f64 = 0.3;
/// The same where no reading scatters.
const ROWS_UNUSUALLY: f64 = 0.15;
/// A force that changes by this share of the range, beyond what pressure and stroke explain.
const UNEXPLAINED: f64 = 0.25;

/// The dead sensors of a campaign. One recording has nothing to compare with.
pub(super) fn find(campaign: &Campaign, skipped: &[bool], usual: &Usual) -> Vec<SensorFault> {
    if campaign.recordings.len() < 2 {
        return Vec::new();
    }
    // Where lengths are held, a constant stroke is the bench's way of working.
    let moving = |r: &&Recording| {
        let mut readings: Vec<f64> = downsampled(&r.stroke).collect();
        quantile(&mut readings, 0.98) - quantile(&mut readings, 0.02)
            > DEAD * usual.spans[Channel::Stroke as usize]
    };
    let strokes = 2 * campaign.recordings.iter().filter(moving).count() > campaign.recordings.len();
    // The expected force is that of the other strokes: beyond them a force near zero may be that of a slack muscle.
    let pulling = |(recording, r): &(usize, &Recording)| {
        !skipped[*recording] && r.force.is_some() && !r.is_empty() && !is_dead(r, Channel::Force, usual)
    };
    let (low, high) = extremes(
        campaign.recordings.iter().enumerate().filter(pulling).flat_map(|(_, r)| downsampled(&r.stroke)),
    );
    let compared = |r: &Recording| {
        let mut strokes: Vec<f64> = downsampled(&r.stroke).collect();
        (low..=high).contains(&quantile(&mut strokes, 0.5))
    };
    let judge = |(recording, r): (usize, &Recording)| {
        if skipped[recording] || r.force.is_none() || r.is_empty() {
            return None;
        }
        let judged = Channel::ALL.into_iter().filter(|c| *c != Channel::Stroke || strokes);
        let dead = |c: &Channel| is_dead(r, *c, usual) && (*c != Channel::Force || compared(r));
        let channel = judged.into_iter().find(dead)?;
        let mut readings: Vec<f64> = downsampled(channel.of(r)).collect();
        let value = quantile(&mut readings, 0.5);
        Some(SensorFault { recording, rows: 0..r.len(), channel, kind: Kind::Dead, value })
    };
    campaign.recordings.iter().enumerate().filter_map(judge).collect()
}

fn is_dead(r: &Recording, channel: Channel, usual: &Usual) -> bool {
    let span = usual.spans[channel as usize];
    let mut readings: Vec<f64> = downsampled(channel.of(r)).collect();
    let spread = quantile(&mut readings, 0.98) - quantile(&mut readings, 0.02);
    if !(span > 0.0 && spread <= DEAD * span) {
        return false;
    }
    let middle = quantile(&mut readings, 0.5);
    let rows = || (0..r.len()).step_by(stride(r.len()));
    let share = |holds: &dyn Fn(usize) -> bool| {
        rows().filter(|i| holds(*i)).count() as f64 / rows().count().max(1) as f64
    };
    let force = r.force.as_deref().unwrap_or(&[]);
    let spread_of = |of: &dyn Fn(usize) -> f64| {
        let mut values: Vec<f64> = rows().map(of).collect();
        quantile(&mut values, 0.95) - quantile(&mut values, 0.05)
    };
    match channel {
        // Without pressure a muscle does not pull. A pressure without any scatter is not a measurement: less force is enough, if no other
        // recording shows it.
        Channel::Pressure => {
            let pull = |i: usize| force[i] - usual.expected.floor().max(0.0);
            let least = usual.noticeable_unusually();
            middle.abs() < DEAD * usual.top_pressure
                && (share(&|i| pull(i) > PULLS * usual.spans[2]) > ROWS
                    || spread <= 0.0
                        && share(&|i| pull(i) > least && usual.expected.residual(r, i) > 0.5 * least)
                            > ROWS_UNUSUALLY)
        }
        Channel::Force => {
            let expected = |i: usize| usual.expected.at(r, i) - middle;
            // A force without any scatter is not a measurement; one that scatters may be that of a slack muscle.
            let least = if spread > 0.0 { usual.noticeable(PULLS) } else { usual.noticeable_unusually() };
            share(&|i| expected(i) > least) > ROWS
        }
        Channel::Stroke => spread_of(&|i| usual.expected.residual(r, i)) > usual.noticeable(UNEXPLAINED),
    }
}
