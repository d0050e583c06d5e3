//! Dry friction beside the memory: which laws of the catalogue act at held length, and whether unseen runs need one.
//!
//! At held length the strands' direction `s` follows filling and emptying; or it follows the pressure as it was read, and the
//! overshoot of a pulse reverses it. The unseen runs decide which. Each law is a loss of force, which as a shift of pressure is the
//! force over the slope of the mounting's curve:
//!
//! | law | force, N | over contraction |
//! | --- | --- | --- |
//! | base model | `−s k_F F` | falls as the force does |
//! | constant | `−s F_s` | stays |
//! | constant area | `−s μ_0 P π R0²` | stays |
//! | growing area | `−s μ P π R²` | grows as the cross-section does |
//!
//! All are tested beside the base model's own friction, so that a name is for what that does not take. What the memory does within a run makes a
//! gap between filling and emptying, too: whether friction can take its place is the second question. Unit of all tests: run.

use model_core::braid::Geometry;
use model_core::effects::EffectName;
use model_core::units::Length;
use pam_fit::bench::Candidate;

use super::additional_effect::{Column, Tried, measured, no_worse, tried};
use super::campaign::Run;
use super::criteria::{FOLLOWED_OVER, LEAST_AREA, THRESHOLD_FROM, THRESHOLD_TO, TIMES};
use super::law::{Law, Layer};
use super::unseen::Unseen;

/// The laws that a campaign at held lengths can show, each with one of its effect's amplitudes.
const LAWS: [(EffectName, usize); 3] =
    [(EffectName::CoulombFriction, 1), (EffectName::PressureFriction, 1), (EffectName::PressureFriction, 0)];

/// Friction in place of what the memory does within a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Instead {
    /// Error of unseen runs with the memory, and the least with friction in place of what the memory does within a run, rms, N.
    pub rms: Option<(f64, f64)>,
    /// The effects with which that predicts no worse.
    pub alternatives: Vec<EffectName>,
}

/// Laws as shifts of pressure, kPa, per unit of their amplitudes, with one direction of friction.
pub(super) struct Columns {
    pub base: Vec<f64>,
    pub laws: Vec<Column>,
}

/// The laws with each direction that friction may have: that of the drive first, then those that follow the pressure.
pub(super) fn directions(layer: &Layer<'_>, areas: &[f64], geometry: &Geometry) -> Vec<Columns> {
    let points = layer.points;
    let drive: Vec<f64> = points.direction.iter().map(|d| f64::from(*d)).collect();
    let over = |over: usize| points.followed.iter().map(|f| f[over]).collect();
    let followed = (0..FOLLOWED_OVER.len()).filter(|_| points.averaged).map(over);
    std::iter::once(drive).chain(followed).filter_map(|d| columns(layer, areas, geometry, &d)).collect()
}

fn columns(layer: &Layer<'_>, areas: &[f64], geometry: &Geometry, direction: &[f64]) -> Option<Columns> {
    let points = layer.points;
    let braid = geometry.build().ok()?;
    let section = |radius: f64| std::f64::consts::PI * radius * radius;
    let sections: Vec<f64> = points
        .mountings
        .iter()
        .map(|m| section(braid.posture(Length::from_metres(m.stroke)).radius))
        .collect();
    let at_rest = section(braid.rest_radius());
    let rubs = |force: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let shift = |i: usize| force(i) / areas[points.mounting[i]];
        // A slack muscle has no friction.
        let pulls = |i: usize| points.pressure[i] > layer.thresholds[points.mounting[i]];
        (0..points.len()).map(|i| if pulls(i) { -direction[i] * shift(i) } else { 0.0 }).collect()
    };
    let pressed = |i: usize| 1e3 * points.pressure[i].max(0.0);
    let laws = LAWS
        .iter()
        .map(|(effect, amplitude)| Column {
            effect: Candidate::Muscle(*effect),
            amplitude: *amplitude,
            shape: None,
            shift: match (effect, amplitude) {
                (EffectName::CoulombFriction, _) => rubs(&|_| 1.0),
                (_, 0) => rubs(&|i| pressed(i) * sections[points.mounting[i]]),
                _ => rubs(&|i| pressed(i) * at_rest),
            },
        })
        .collect();
    let base = rubs(&|i| {
        let m = points.mounting[i];
        (points.pressure[i] - layer.thresholds[m]).max(0.0) * areas[m]
    });
    Some(Columns { base, laws })
}

/// Mean slope near the highest pressure. A mounting that hardly pulls gives none: then the least that a muscle has.
pub(super) fn areas(layer: &Layer<'_>, law: &Law) -> Vec<f64> {
    let points = layer.points;
    let slope = |m: usize| {
        let own = (0..points.len()).filter(|i| points.mounting[*i] == m);
        let top = own.map(|i| points.pressure[i]).fold(0.0, f64::max);
        let at = |k: i32| top * (THRESHOLD_FROM + (THRESHOLD_TO - THRESHOLD_FROM) * f64::from(k) / 6.0);
        (0..7).map(|k| layer.spline.at(at(k)).slope(&law.fit.curves[m])).sum::<f64>() / 7.0
    };
    let slopes: Vec<f64> = (0..points.mountings.len()).map(slope).collect();
    let largest = slopes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    slopes.iter().map(|s| s.max(LEAST_AREA * largest)).collect()
}

/// Friction in place of what the memory does within a run: of the spectrum only the times stay that are longer than any run.
pub(super) fn instead(
    layer: &Layer<'_>,
    (law, memory): (&Law, &Unseen),
    steps: &[Vec<f64>],
    columns: &Columns,
) -> Instead {
    let points = layer.points;
    let lasts = |r: &Run| {
        let own = points.time[r.points.0..r.points.1].iter();
        own.copied().fold(0.0, f64::max)
    };
    let longest = points.runs.iter().map(lasts).fold(0.0, f64::max);
    let slow: Vec<f64> = TIMES.iter().copied().filter(|t| *t > longest).collect();
    if slow.is_empty() || slow.len() == TIMES.len() {
        return Instead::default();
    }
    let slow = Layer::new(points, &slow);
    let start = slow.fit(&vec![true; points.len()], Some(law.choice), steps, Some(law));
    let whole = measured(points, law.clone(), memory.clone());
    let with = |law: &Column| tried(&slow, &start, steps, &[&columns.base, &law.shift]);
    let all: Vec<Tried> = columns.laws.iter().map(with).collect();
    let least = all.iter().map(|t| t.rms).fold(f64::INFINITY, f64::min);
    let mut alternatives: Vec<EffectName> =
        (0..all.len()).filter(|j| no_worse(&all[*j].squares, &whole.squares)).map(|j| LAWS[j].0).collect();
    alternatives.dedup();
    Instead { rms: least.is_finite().then_some((whole.rms, least)), alternatives }
}
