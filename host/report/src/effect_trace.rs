//! What an effect does to one muscle on one demonstration, so that all can be compared by eye.
//!
//! The demonstration is one table and one protocol, while the room warms by 4 K: slow loops to a smaller and then to a larger
//! contraction, loops five times as fast, a hold, a minor loop, and filling and emptying at held length.

use model_core::effects::{Context, MEMORY, Role};
use model_core::motion::{MotionSettings, MotionTracker};
use model_core::muscle::Muscle;
use model_core::table::{self, TableError};
use model_core::units::Pressure;

use super::{Axis, Colour, Figure, Panel};
use pam_fit::bench::{Candidate, Span};

/// Share of the blocked force that every effect is drawn at; larger than most are, so that it can be seen.
pub(crate) const DRAWN_AT: f64 = 0.1;
const STEP: f64 = 0.02;
const LOOPS_PRESSURE: f64 = 345e3;

/// The demonstration: every moment, and the model's force at it.
#[derive(Debug, Clone)]
pub(crate) struct Demonstration {
    /// Every moment, in order.
    pub contexts: Vec<Context<f64>>,
    /// Force of the base model, N.
    pub force: Vec<f64>,
    /// `F_B` at the pressure of the loops, N.
    pub blocked: f64,
    /// The moment when the loops at constant pressure end.
    loops: usize,
    imitations: Vec<Vec<f64>>,
}

/// One effect on the demonstration.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The effect.
    pub candidate: Candidate,
    /// Its parameters in SI units: shapes in the middle of their plausible range, amplitudes as large as drawn.
    pub parameters: Vec<f64>,
    /// The force it adds at every moment, N.
    pub force: Vec<f64>,
    /// What a fit of the base model would leave of it, N.
    pub left: Vec<f64>,
}

/// Targets of contraction (share of `L0`), speeds (m/s) and pressures (Pa): a straight line to each.
enum Leg {
    Stroke { to: f64, speed: f64 },
    Hold { seconds: f64 },
    Fill { to: f64, seconds: f64 },
}

fn protocol() -> (Vec<Leg>, usize) {
    let stroke = |to, speed| Leg::Stroke { to, speed };
    let (slow, fast) = (1.0e-3, 5.0e-3);
    let mut legs = Vec::new();
    for (to, speed) in [(0.04, slow), (0.04, slow), (0.06, slow), (0.06, slow), (0.06, fast), (0.06, fast)] {
        legs.extend([stroke(to, speed), stroke(0.0, speed)]);
    }
    let loops = legs.len();
    legs.extend([stroke(0.03, slow), Leg::Hold { seconds: 15.0 }, stroke(0.06, slow), stroke(0.03, slow)]);
    legs.extend([stroke(0.045, slow), stroke(0.0, slow), stroke(0.03, slow)]);
    for to in [540e3, 210e3, LOOPS_PRESSURE] {
        legs.push(Leg::Fill { to, seconds: 4.0 });
    }
    (legs, loops)
}

impl Demonstration {
    /// Runs the protocol on the model's example table.
    ///
    /// # Errors
    /// None in practice: the example table is valid.
    pub fn new() -> Result<Self, TableError> {
        let muscle = Muscle::<f64>::build(&table::example())?;
        let rest = muscle.braid().rest_length();
        let (legs, loop_legs) = protocol();
        let (mut contraction, mut pressure) = (vec![0.0], vec![LOOPS_PRESSURE]);
        let mut loops = 0;
        for (i, leg) in legs.iter().enumerate() {
            let (c, p) = (contraction[contraction.len() - 1], pressure[pressure.len() - 1]);
            let (seconds, c_end, p_end) = match *leg {
                Leg::Stroke { to, speed } => ((to - c).abs() * rest / speed, to, p),
                Leg::Hold { seconds } => (seconds, c, p),
                Leg::Fill { to, seconds } => (seconds, c, to),
            };
            let steps = (seconds / STEP).round().max(1.0);
            for k in 1..=steps as usize {
                let share = k as f64 / steps;
                contraction.push(c + share * (c_end - c));
                pressure.push(p + share * (p_end - p));
            }
            if i + 1 == loop_legs {
                loops = contraction.len();
            }
        }
        // Nothing turns in no time: the corners are rounded, so that masses are felt and not infinitely.
        let stroke: Vec<f64> = rounded(&rounded(&contraction)).into_iter().map(|c| c * rest).collect();
        let pressure = rounded(&pressure);
        let contexts = contexts(&muscle, &stroke, &pressure);
        let force = contexts.iter().map(Context::force).collect();
        let blocked = muscle.force(Pressure::from_pascals(LOOPS_PRESSURE), Default::default(), 0.0).newtons();
        let imitations = imitations(&contexts);
        Ok(Self { contexts, force, blocked, loops, imitations })
    }

    /// One effect on it; its force is all zeros where the protocol does not excite it.
    #[must_use]
    pub fn run(&self, candidate: Candidate) -> Trace {
        let info = candidate.info();
        let shape = Span::of(&self.contexts)
            .and_then(|span| candidate.grid(1, &span).into_iter().next())
            .unwrap_or_default();
        let mut parameters: Vec<f64> = info
            .parameters
            .iter()
            .filter(|p| p.role == Role::Amplitude)
            .enumerate()
            .map(|(i, p)| if info.alternatives && i > 0 { 0.0 } else { middle(p.low, p.high) })
            .collect();
        let amplitudes = parameters.len();
        parameters.extend(shape);
        let mut force = candidate.trace(&self.contexts, &parameters, &mut [0.0; MEMORY]);
        let peak = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        if peak > 1e-9 {
            let scale = DRAWN_AT * self.blocked / peak;
            parameters[..amplitudes].iter_mut().for_each(|p| *p *= scale);
            force.iter_mut().for_each(|f| *f *= scale);
        }
        let left = without(force.clone(), &self.imitations);
        Trace { candidate, parameters, force, left }
    }

    /// The picture of one effect: what is done, what is added, how the loops change.
    #[must_use]
    pub fn figure(&self, trace: &Trace) -> Figure {
        let time: Vec<f64> = self.contexts.iter().map(|c| c.time).collect();
        let contraction: Vec<f64> = self.contexts.iter().map(|c| 100.0 * c.contraction).collect();
        let pressure: Vec<f64> = self.contexts.iter().map(|c| c.pressure / 1e3).collect();
        let with: Vec<f64> = self.force.iter().zip(&trace.force).map(|(f, d)| f + d).collect();
        let n = self.loops;
        let done = Panel::new(Axis::new("time", "s"), Axis::new("contraction ΔL/L_{0}", "%"))
            .titled("Stroke")
            .line("", Colour::Muted, &time, &contraction);
        let filled = Panel::new(Axis::new("time", "s"), Axis::new("pressure P", "kPa").from_zero())
            .titled("Pressure")
            .line("", Colour::Series(2), &time, &pressure);
        let added = Panel::new(Axis::new("time", "s"), Axis::new("added force", "N").from_zero())
            .titled("Force of the effect")
            .line("the effect alone", Colour::Series(1), &time, &trace.force);
        let loops = Panel::new(Axis::new("contraction ΔL/L_{0}", "%"), Axis::new("force F", "N"))
            .titled("Loops at 345 kPa")
            .line("with the effect", Colour::Series(0), &contraction[..n], &with[..n])
            .dashes("without", Colour::Muted, &contraction[..n], &self.force[..n]);
        Figure::multiples(
            trace.candidate.name(),
            format!("Trace of {}", trace.candidate.name()),
            format!(
                "Stroke and pressure of the demonstration, the force of the effect alone, and the loops with and without it. The \
                 effect is scaled to {} % of the blocked force, more than is usual.",
                100.0 * DRAWN_AT
            ),
            vec![done, filled, added, loops],
        )
    }
}

/// Similarity of the residuals of two traces after a fit: the size of the cosine of the angle between them, 1 where one is a multiple
/// of the other.
#[must_use]
pub(crate) fn likeness(a: &Trace, b: &Trace) -> f64 {
    let size = (dot(&a.left, &a.left) * dot(&b.left, &b.left)).sqrt();
    if size > 0.0 { dot(&a.left, &b.left).abs() / size } else { 0.0 }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// What the base model can imitate: `P0`, one bladder's elasticity up to the third order, friction. Orthonormal.
fn imitations(contexts: &[Context<f64>]) -> Vec<Vec<f64>> {
    type Column<'a> = &'a dyn Fn(&Context<f64>) -> f64;
    let columns: [Column<'_>; 5] = [
        &|c| c.area,
        &Context::unit_elastic,
        &|c| c.unit_elastic() * c.contraction,
        &|c| c.unit_elastic() * c.contraction * c.contraction,
        &|c| c.direction * c.quasi,
    ];
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let column = without(contexts.iter().map(column).collect(), &basis);
        let size = dot(&column, &column).sqrt();
        if size > 0.0 {
            basis.push(column.into_iter().map(|v| v / size).collect());
        }
    }
    basis
}

fn without(mut trace: Vec<f64>, basis: &[Vec<f64>]) -> Vec<f64> {
    // Twice, since the columns of higher order are nearly the same.
    for column in basis.iter().chain(basis) {
        let share = dot(&trace, column);
        trace.iter_mut().zip(column).for_each(|(t, c)| *t -= share * c);
    }
    trace
}

/// A value of the middling kind: of a range with both signs its upper half's.
fn middle(low: f64, high: f64) -> f64 {
    match (low > 0.0, high > 0.0) {
        (true, _) => (low * high).sqrt(),
        (false, true) => 0.5 * high,
        (false, false) => 0.5 * low,
    }
}

/// A moving mean over a tenth of a second.
fn rounded(values: &[f64]) -> Vec<f64> {
    let half = 2;
    (0..values.len())
        .map(|i| {
            // The window shrinks towards the ends, which stay where they are.
            let h = half.min(i).min(values.len() - 1 - i);
            values[i - h..=i + h].iter().sum::<f64>() / (2 * h + 1) as f64
        })
        .collect()
}

fn contexts(muscle: &Muscle<f64>, stroke: &[f64], pressure: &[f64]) -> Vec<Context<f64>> {
    let slope = |v: &[f64], i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(v.len() - 1));
        (v[b] - v[a]) / ((b - a).max(1) as f64 * STEP)
    };
    let speed: Vec<f64> = (0..stroke.len()).map(|i| slope(stroke, i)).collect();
    let settings =
        MotionSettings { stroke_threshold: 2e-5, pressure_threshold: 2e3, ..MotionSettings::default() };
    let mut tracker = MotionTracker::new(settings);
    (0..stroke.len())
        .map(|i| {
            let mut motion = *tracker.step(if i == 0 { 0.0 } else { STEP }, stroke[i], pressure[i]);
            // The tracker is causal and so a little late; here the whole course is known.
            motion.speed = speed[i];
            motion.acceleration = slope(&speed, i);
            motion.pressure_rate = slope(pressure, i);
            motion.temperature = 293.0 + 4.0 * i as f64 / stroke.len() as f64;
            // Before the first turn the motion is a shortening.
            if motion.direction == 0.0 {
                motion.direction = 1.0;
            }
            muscle.context(&motion, Pressure::from_pascals(pressure[i]))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearly_every_effect_shows_and_at_the_stated_size() {
        let demonstration = Demonstration::new().unwrap();
        let mut silent = Vec::new();
        for candidate in Candidate::all() {
            let trace = demonstration.run(candidate);
            let peak = trace.force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            assert!(peak.is_finite());
            if peak == 0.0 {
                silent.push(candidate.name());
            } else {
                assert!(
                    (peak - DRAWN_AT * demonstration.blocked).abs() < 1e-6 * peak,
                    "{}",
                    candidate.name()
                );
            }
        }
        assert!(silent.is_empty(), "{silent:?}");
    }

    #[test]
    fn opposite_traces_are_alike_and_others_are_not() {
        let demonstration = Demonstration::new().unwrap();
        let of = |name| demonstration.run(Candidate::from_name(name).unwrap());
        let (friction, damping) = (of("coulomb-friction"), of("viscous-damping"));
        let mut turned = friction.clone();
        turned.left.iter_mut().for_each(|f| *f *= -2.0);
        assert!((likeness(&friction, &turned) - 1.0).abs() < 1e-9);
        let between = likeness(&friction, &damping);
        assert!(between > 0.2 && between < 0.95, "{between}");
    }
}
