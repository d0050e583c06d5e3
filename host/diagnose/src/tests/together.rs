//! Effects that act together.

use super::*;
use crate::baselines;
use crate::candidates::library;
use crate::forward_selection::forward_selection;
use crate::linear::energy;
use crate::rows::{prepare, typical_step};

/// What is wrong on a bench, in addition to friction of 8 %.
#[derive(Default)]
pub(super) struct Wrong {
    /// Length that an end loses in the middle of the third file, as a share of the largest stroke.
    pub slip: f64,
    /// Friction for each pascal, N.
    pub friction_per_pascal: f64,
    /// Further friction, N.
    pub friction: f64,
    /// How fast the load cell's zero drifts, N/h.
    pub drift_per_hour: f64,
}

pub(super) fn on_a_bench_with(wrong: &Wrong) -> Campaign {
    let mut campaign = loops(&[0.2]);
    let largest = campaign.recordings.iter().flat_map(|r| r.stroke.iter().copied()).fold(0.0, f64::max);
    let muscle = muscle();
    let noise = coloured(0.05, 2.0);
    let mut random = Random(5);
    for (file, r) in campaign.recordings.iter_mut().enumerate() {
        let Recording { time, stroke, pressure, force: Some(force), .. } = r else { continue };
        let (mut sign, mut state) = (1.0, [0.0; 2]);
        for i in 0..force.len() {
            if i > 0 && stroke[i] != stroke[i - 1] {
                sign = (stroke[i] - stroke[i - 1]).signum();
            }
            let slipped =
                if file > 2 || file == 2 && 2 * i > pressure.len() { wrong.slip * largest } else { 0.0 };
            let (p, x) = (Pressure::from_pascals(pressure[i]), Length::from_metres(stroke[i] + slipped));
            let quasi = muscle.force(p, x, 0.0).newtons();
            let rubbing = 0.08 * quasi + wrong.friction_per_pascal * pressure[i] + wrong.friction;
            let zero = wrong.drift_per_hour * time[i] / 3600.0;
            force[i] = quasi - rubbing * sign + zero + noise(&mut random, &mut state);
        }
        for x in stroke.iter_mut() {
            *x += 1e-6 * random.normal();
        }
    }
    campaign
}

fn named(d: &Diagnosis) -> Vec<&str> {
    let mut found = names(d);
    found.sort_unstable();
    found
}

#[test]
fn effects_are_found_of_which_none_explains_most_alone() {
    let wrong = Wrong { slip: 0.008, friction: 0.5, drift_per_hour: 3.5, ..Wrong::default() };
    let d = ask(&on_a_bench_with(&wrong));
    assert_eq!(named(&d), ["coulomb-friction", "end-slip", "force-drift"], "{:?}", d.remarks);
    assert_eq!(d.verdict(), Verdict::Explained);
}

/// The law of a slip is of first order: what it is linearised about changes it. The next effect is judged, and fitted, beside the law that
/// the last fit was made with; else it seems to lose in the fit what it had gained before.
#[test]
fn the_next_fit_begins_where_the_last_one_ended() {
    let campaign = on_a_bench_with(&Wrong { slip: 0.02, friction_per_pascal: 8.0e-6, ..Wrong::default() });
    assert_eq!(named(&ask(&campaign)), ["end-slip", "pressure-friction"]);
    let braid = geometry().build().expect("a braid");
    let (rows, _) = prepare(&campaign, &braid).expect("rows");
    let library = library(&rows, &[]);
    let blocked = rows.force.iter().copied().fold(0.0, f64::max);
    let selection = forward_selection(&rows, &library, blocked, typical_step(&rows), &[]);
    let mut columns = Vec::new();
    for fit in selection.selected.iter().map(|t| &t.fit) {
        let used = fit.columns(&library, &selection.rows).into_iter().zip(&fit.amplitudes);
        columns.extend(used.filter(|(_, a)| **a != 0.0).map(|(c, _)| c));
    }
    let again = baselines::fit(&selection.rows, selection.joint.kind, &columns);
    let (before, after) = (energy(&selection.joint.residual), energy(&again.residual));
    assert!((after / before - 1.0).abs() < 1e-3, "{before} N² before, {after} N² again");
}
