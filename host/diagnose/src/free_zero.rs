//! Whether an effect explains what a load cell whose zero drifts freely does not.
//!
//! Beside a residual that lasts for minutes, a slow effect is estimated from few independent rows, and a slowly drifting zero would
//! explain as much. But such a zero adds the same force at all pressures and strokes of its time. Both hypotheses are therefore compared
//! with a zero that is free in each span of time: what the effect explains then is its dependence on pressure and stroke.

use super::baselines::{self, Kind};
use super::criteria::selection::{MOST_ZEROS, ZEROS_PER_MEMORY};
use super::linear::energy;
use super::noise::{self, Noise};
use super::rows::Rows;

/// How much the deviance falls with the last of the traces (N), where the zero of the force is free in each part of the memory of the
/// residual.
pub(crate) fn fall_beside_free_zero(
    rows: &Rows,
    kind: Kind,
    traces: &[Vec<f64>],
    memory: f64,
    step: f64,
) -> f64 {
    let Some((trace, others)) = traces.split_last() else { return 0.0 };
    let mut columns: Vec<Vec<f64>> = zeros(rows, memory / step);
    columns.extend_from_slice(others);
    let without = baselines::fit(rows, kind, &columns);
    columns.push(trace.clone());
    let with = baselines::fit(rows, kind, &columns);
    let Noise { memory, .. } = noise::estimate(rows, &with.residual, step);
    let seen = baselines::projected(std::slice::from_ref(trace), rows.root_weight(), &without.span);
    let independent = noise::independent_beside(rows, &with.residual, memory, &seen[0], step);
    independent * (energy(&without.residual) / energy(&with.residual).max(f64::MIN_POSITIVE)).ln()
}

/// One column for each span of rows that has a zero of its own: `memory` in rows.
fn zeros(rows: &Rows, memory: f64) -> Vec<Vec<f64>> {
    let mut least = (memory / ZEROS_PER_MEMORY).max(1.0) as usize;
    let mut spans = spans(rows, least, true);
    while spans.len() > MOST_ZEROS {
        // Very many recordings share zeros with the next ones.
        spans = self::spans(rows, least, false);
        least *= 2;
    }
    let column = |span: &std::ops::Range<usize>| {
        let mut column = vec![0.0; rows.len()];
        column[span.clone()].fill(1.0);
        column
    };
    spans.iter().map(column).collect()
}

/// Spans of at least this number of rows; a recording begins a new one where they are kept apart.
fn spans(rows: &Rows, least: usize, apart: bool) -> Vec<std::ops::Range<usize>> {
    let mut spans: Vec<std::ops::Range<usize>> = Vec::new();
    for row in 0..rows.len() {
        match spans.last_mut() {
            Some(span)
                if span.len() < least && !(apart && rows.recording[span.start] != rows.recording[row]) =>
            {
                span.end = row + 1;
            }
            _ => spans.push(row..row + 1),
        }
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{prepare, typical_step};
    use crate::tests::{geometry, loops, recorded};

    /// Share of the campaign that is over at each row.
    fn elapsed_share(rows: &Rows) -> Vec<f64> {
        let end = rows.contexts().last().map_or(1.0, |c| c.time);
        rows.contexts().iter().map(|c| c.time / end).collect()
    }

    /// How much the deviance falls for a softening with time, in forces to which this is added at each share of the campaign.
    fn fall(added: impl Fn(f64, f64) -> f64) -> f64 {
        let mut campaign = recorded(loops(&[0.2]), 4, |random, _| 0.05 * random.normal(), |_, _, _| 0.0);
        let end = campaign.recordings.last().and_then(|r| r.time.last()).copied().unwrap_or(1.0);
        for r in &mut campaign.recordings {
            for (f, t) in r.force.iter_mut().flatten().zip(&r.time) {
                *f += added(t / end, *f);
            }
        }
        let (rows, _) = prepare(&campaign, &geometry().build().expect("a braid")).expect("rows");
        let rows = baselines::linearised(&rows, &baselines::fit(&rows, Kind::Stiff, &[]));
        let softening = elapsed_share(&rows).iter().zip(&rows.force).map(|(t, f)| -t * f).collect();
        fall_beside_free_zero(&rows, Kind::Stiff, &[softening], 200.0, typical_step(&rows))
    }

    #[test]
    fn a_softening_shows_beside_a_free_zero_and_a_drifting_zero_is_none() {
        let drift = |t: f64| 1.5 * t + 0.5 * (9.0 * t).sin();
        let softens = fall(|t, f| drift(t) - 0.02 * t * f);
        let drifts = fall(|t, _| drift(t));
        assert!(softens > 100.0 && drifts < 12.0, "{softens} {drifts}");
    }
}
