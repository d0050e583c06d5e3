//! Dry friction beside the memory: which laws of the catalogue act at held length, and whether unseen runs need one.
//!
//! At held length the strands' direction `s` follows filling and emptying. Each law is a loss of force, which as a shift of pressure is the
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
use pam_fit::numerics::student::{chance_beyond, half_width_95};

use super::campaign::Points;
use super::criteria::{KEPT_ERRORS, LEAST_AREA, THRESHOLD_FROM, THRESHOLD_TO, TIMES};
use super::held_table::{gain_by_runs, predicts_better};
use super::law::{Law, Layer};
use super::run_offset;
use super::unseen::{self, Unseen, jackknife};

/// A law of the catalogue: its effect, and which of the effect's amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Name {
    pub effect: EffectName,
    pub amplitude: usize,
}

/// The laws that a campaign at held lengths can show.
pub(super) const LAWS: [Name; 3] = [
    Name { effect: EffectName::CoulombFriction, amplitude: 1 },
    Name { effect: EffectName::PressureFriction, amplitude: 1 },
    Name { effect: EffectName::PressureFriction, amplitude: 0 },
];

/// Friction that unseen runs need beside the memory and the base model's own.
#[derive(Clone, Debug)]
pub(super) struct Needed {
    pub name: Name,
    /// Its amplitude, SI, and standard error (jackknife over runs).
    pub value: f64,
    pub error: f64,
    /// Largest force, N.
    pub peak: f64,
    /// Share of the squared error of supported points that it removes beside the memory.
    pub gain: f64,
    /// Errors of unseen runs with the base model's friction alone, and with the law, rms, N.
    pub rms: (f64, f64),
    /// Probability of such a gain by chance among all laws.
    pub chance: f64,
    /// Other effects that predict the runs as well.
    pub confusable: Vec<EffectName>,
}

/// What is known of friction.
#[derive(Clone, Debug, Default)]
pub(super) struct Friction {
    pub needed: Option<Needed>,
    /// Error of unseen runs with the memory, and the least with friction in place of what the memory does within a run, rms, N.
    pub instead: Option<(f64, f64)>,
    /// The effects with which that predicts no worse.
    pub alternatives: Vec<EffectName>,
}

/// Laws as shifts of pressure, kPa, per unit of their amplitudes.
struct Columns {
    base: Vec<f64>,
    laws: Vec<Vec<f64>>,
    /// Slope of each mounting's curve where it pulls, N/kPa.
    areas: Vec<f64>,
}

/// Tests the laws beside the memory, and in place of its fast part.
pub(super) fn of(
    layer: &Layer<'_>,
    law: &Law,
    memory: &Unseen,
    steps: &[Vec<f64>],
    geometry: &Geometry,
) -> Friction {
    let Some(columns) = columns(layer, law, geometry) else { return Friction::default() };
    let needed = needed(layer, law, steps, &columns);
    let (instead, alternatives) = instead(layer, law, memory, steps, &columns);
    Friction { needed, instead, alternatives }
}

fn columns(layer: &Layer<'_>, law: &Law, geometry: &Geometry) -> Option<Columns> {
    let points = layer.points;
    let braid = geometry.build().ok()?;
    let areas = areas(layer, law);
    let section = |radius: f64| std::f64::consts::PI * radius * radius;
    let sections: Vec<f64> = points
        .mountings
        .iter()
        .map(|m| section(braid.posture(Length::from_metres(m.stroke)).radius))
        .collect();
    let at_rest = section(braid.rest_radius());
    let rubs = |force: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let shift = |i: usize| force(i) / areas[points.mounting[i]];
        (0..points.len()).map(|i| -f64::from(points.direction[i]) * shift(i)).collect()
    };
    let pressed = |i: usize| 1e3 * points.pressure[i].max(0.0);
    let laws = LAWS
        .iter()
        .map(|name| match (name.effect, name.amplitude) {
            (EffectName::CoulombFriction, _) => rubs(&|_| 1.0),
            (_, 0) => rubs(&|i| pressed(i) * sections[points.mounting[i]]),
            _ => rubs(&|i| pressed(i) * at_rest),
        })
        .collect();
    let base = rubs(&|i| {
        let m = points.mounting[i];
        (points.pressure[i] - layer.thresholds[m]).max(0.0) * areas[m]
    });
    Some(Columns { base, laws, areas })
}

/// Mean slope near the highest pressure. A mounting that hardly pulls tells none: then the least that a muscle has.
fn areas(layer: &Layer<'_>, law: &Law) -> Vec<f64> {
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

/// A law with further columns, its unseen runs, and the folds' values of the last coefficient.
struct Tried {
    law: Law,
    unseen: Unseen,
    squares: Vec<f64>,
    rms: f64,
}

fn tried(layer: &Layer<'_>, start: &Law, steps: &[Vec<f64>], more: &[&Vec<f64>]) -> Tried {
    let mut columns = steps.to_vec();
    columns.extend(more.iter().map(|c| (*c).clone()));
    let mut room = start.clone();
    more.iter().for_each(|_| room.fit = run_offset::with_room(&room));
    let law = layer.fit(&vec![true; layer.points.len()], Some(start.choice), &columns, Some(&room));
    let unseen = unseen::with_memory(layer, &law, &columns, true);
    measured(layer.points, law, unseen)
}

fn measured(points: &Points, law: Law, unseen: Unseen) -> Tried {
    let supported = points.supported();
    let square = |r: &super::campaign::Run| -> f64 {
        let own = (r.points.0..r.points.1).filter(|i| supported[*i]);
        own.map(|i| unseen.error(points, i).powi(2)).filter(|e| e.is_finite()).sum()
    };
    let squares = points.runs.iter().map(square).collect();
    let rms = unseen.sizes(points, |i| supported[i]).rms;
    Tried { law, unseen, squares, rms }
}

/// How many standard errors by runs one sum of squares lies below another.
fn errors_below(with: &[f64], without: &[f64]) -> f64 {
    let (gain, error) = gain_by_runs(with, without);
    gain / error.max(f64::MIN_POSITIVE)
}

/// Whether one predicts no worse than another, by the 95 % interval over runs.
fn no_worse(one: &[f64], other: &[f64]) -> bool {
    errors_below(other, one) <= half_width_95(one.len().saturating_sub(1))
}

fn needed(layer: &Layer<'_>, law: &Law, steps: &[Vec<f64>], columns: &Columns) -> Option<Needed> {
    let points = layer.points;
    let base = tried(layer, law, steps, &[&columns.base]);
    let all: Vec<Tried> =
        columns.laws.iter().map(|column| tried(layer, law, steps, &[&columns.base, column])).collect();
    let sum = |t: &Tried| t.squares.iter().sum::<f64>();
    let best = (0..all.len()).min_by(|a, b| sum(&all[*a]).total_cmp(&sum(&all[*b])))?;
    let (found, name) = (&all[best], LAWS[best]);
    let value = found.law.fit.theta.last().copied()?;
    let last = |l: &Law| l.fit.theta.last().copied().unwrap_or(0.0);
    let error = jackknife(&found.unseen.folds.iter().map(last).collect::<Vec<_>>());
    if !(predicts_better(&found.squares, &base.squares) && value > KEPT_ERRORS * error) {
        return None;
    }
    let runs = points.runs.len();
    let chance = 0.5 * chance_beyond(errors_below(&found.squares, &base.squares), runs as f64 - 1.0);
    let mut confusable: Vec<EffectName> = (0..all.len())
        .filter(|j| no_worse(&all[*j].squares, &found.squares))
        .map(|j| LAWS[j].effect)
        .filter(|effect| *effect != name.effect)
        .collect();
    confusable.dedup();
    let force = |i: usize| (columns.laws[best][i] * columns.areas[points.mounting[i]] * value).abs();
    Some(Needed {
        name,
        value,
        error,
        peak: (0..points.len()).map(force).fold(0.0, f64::max),
        gain: 1.0 - sum(found) / sum(&base).max(f64::MIN_POSITIVE),
        rms: (base.rms, found.rms),
        chance: (chance * LAWS.len() as f64).min(1.0),
        confusable,
    })
}

/// Friction in place of what the memory does within a run: of the spectrum only the times stay that are longer than any run.
fn instead(
    layer: &Layer<'_>,
    law: &Law,
    memory: &Unseen,
    steps: &[Vec<f64>],
    columns: &Columns,
) -> (Option<(f64, f64)>, Vec<EffectName>) {
    let points = layer.points;
    let lasts = |r: &super::campaign::Run| {
        let own = points.time[r.points.0..r.points.1].iter();
        own.copied().fold(0.0, f64::max)
    };
    let longest = points.runs.iter().map(lasts).fold(0.0, f64::max);
    let slow: Vec<f64> = TIMES.iter().copied().filter(|t| *t > longest).collect();
    if slow.is_empty() || slow.len() == TIMES.len() {
        return (None, Vec::new());
    }
    let slow = Layer::new(points, &slow);
    let start = slow.fit(&vec![true; points.len()], Some(law.choice), steps, Some(law));
    let whole = measured(points, law.clone(), memory.clone());
    let all: Vec<Tried> =
        columns.laws.iter().map(|column| tried(&slow, &start, steps, &[&columns.base, column])).collect();
    let least = all.iter().map(|t| t.rms).fold(f64::INFINITY, f64::min);
    let mut alternatives: Vec<EffectName> = (0..all.len())
        .filter(|j| no_worse(&all[*j].squares, &whole.squares))
        .map(|j| LAWS[j].effect)
        .collect();
    alternatives.dedup();
    (least.is_finite().then_some((whole.rms, least)), alternatives)
}
