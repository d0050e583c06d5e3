//! What is known of the muscle's range: pressures, free strokes, speeds. Estimates at first, the table's own as soon as there is one.

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Recording;

use crate::criteria::{
    BOTTOM_DEADBANDS, BOTTOM_SHARE, BOTTOM_STROKE, FORCE_SHARE, FREE_FORCE, LARGEST_CONTRACTION, LEVELS,
    SLOW_STROKE, TOP_SHARE,
};
use crate::rig::{Axis, Rig};

/// The muscle's range on this rig.
#[derive(Debug, Clone)]
pub struct Places {
    /// Highest level, Pa.
    pub top: f64,
    /// The largest force that is allowed, N, where it is what determines the highest level.
    pub limited_by_force: Option<f64>,
    /// Largest stroke that is allowed, m.
    pub stroke_max: f64,
    /// Largest speed that is allowed, m/s.
    pub speed_max: f64,
    /// Whether the operator sets strokes by hand.
    pub by_hand: bool,
    /// Blocked force at the highest level, N; zero until it is measured.
    pub blocked: f64,
    /// Pressure at which the muscle begins to pull at rest length, Pa; zero until it is measured.
    pub deadband: f64,
    /// Free stroke at the highest level, m; zero until it is measured.
    pub free: f64,
    /// The fitted model.
    pub model: Option<Box<Muscle<f64>>>,
    /// Held strokes at which the muscle pulled at the highest level, m, rising.
    pulled_at: Vec<f64>,
    /// Shortest held stroke at which it hung slack there, m; infinite while none is known.
    slack_from: f64,
    /// Levels that were decided on: they stay, so that recordings at one level can be compared.
    decided: Option<Vec<f64>>,
}

/// Force per pressure of the ideal braid at rest length, m². A real muscle pulls less: its bladder takes a part of the pressure.
fn braid_area(muscle: &MuscleDescription) -> f64 {
    let braid = muscle.geometry().build();
    braid.map_or(0.0, |braid| braid.posture(Length::from_metres(0.0)).area)
}

impl Places {
    /// Before anything is recorded.
    ///
    /// # Errors
    /// [`DataCode::MuscleInvalid`] where neither the muscle's description nor the rig's says how much pressure is allowed.
    pub fn new(muscle: &MuscleDescription, rig: &Rig) -> Result<Self> {
        let rated = [muscle.max_pressure(), rig.pressure_max_kpa.map(|kpa| kpa * 1e3 / TOP_SHARE)];
        let highest = rated.into_iter().flatten().fold(f64::INFINITY, f64::min);
        if !(highest > 0.0 && highest.is_finite()) {
            return Err(Error::new(
                DataCode::MuscleInvalid,
                "neither the muscle's description nor the rig's says how much pressure is allowed",
            )
            .help("add max_pressure_kPa to the muscle's description, or pressure_max_kPa to rig.toml"));
        }
        let stroke_max = (LARGEST_CONTRACTION * muscle.rest_length())
            .min(rig.stroke_max_mm.map_or(f64::INFINITY, |mm| mm * 1e-3));
        let rated = TOP_SHARE * highest;
        let bearable = rig.force_max.map_or(f64::INFINITY, |force| FORCE_SHARE * force / braid_area(muscle));
        Ok(Self {
            // Whole kilopascals, as an operator would set them.
            top: (rated.min(bearable) * 1e-3).floor() * 1e3,
            limited_by_force: rig.force_max.filter(|_| bearable < rated),
            stroke_max,
            speed_max: rig.speed_max_mm_s.map_or(f64::INFINITY, |v| v * 1e-3),
            by_hand: rig.axis == Axis::Prompt,
            blocked: 0.0,
            deadband: 0.0,
            free: 0.0,
            model: None,
            pulled_at: Vec::new(),
            slack_from: f64::INFINITY,
            decided: None,
        })
    }

    /// Why the highest level is below what the pressures allow; `None` where it is not.
    #[must_use]
    pub fn limitation(&self) -> Option<String> {
        self.limited_by_force.map(|force| {
            format!(
                "the highest level is {:.0} kPa: at more, the muscle could pull more than the {force:.0} N that the rig and the controller allow",
                self.top * 1e-3
            )
        })
    }

    /// Takes blocked force and deadband from a recorded pressure ramp at rest length.
    pub fn learn_ramp(&mut self, recording: &Recording) {
        let Some(force) = &recording.force else { return };
        let highest = force.iter().copied().fold(0.0, f64::max);
        if !(highest > 0.0) {
            return;
        }
        self.blocked = self.blocked.max(highest);
        // A straight line through the upper half of the force: it meets zero at the deadband.
        let upper: Vec<(f64, f64)> = recording
            .pressure
            .iter()
            .zip(force)
            .filter(|(_, f)| **f > 0.4 * highest)
            .map(|(p, f)| (*p, *f))
            .collect();
        let n = upper.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| upper.iter().map(of).sum::<f64>() / n;
        let (p, f) = (mean(|u| u.0), mean(|u| u.1));
        let slope = upper.iter().map(|u| (u.0 - p) * (u.1 - f)).sum::<f64>()
            / upper.iter().map(|u| (u.0 - p).powi(2)).sum::<f64>();
        let zero = p - f / slope;
        if slope > 0.0 && zero.is_finite() {
            self.deadband = zero.clamp(0.0, 0.5 * self.top);
        }
    }

    /// Takes the free stroke from recorded strokes at the highest level.
    pub fn learn_strokes(&mut self, recording: &Recording) {
        let at_top = recording.pressure.iter().zip(&recording.stroke).filter(|(p, _)| **p > 0.95 * self.top);
        let longest = at_top.map(|(_, x)| *x).fold(0.0, f64::max);
        if longest > 0.0 {
            self.free = self.free.max(longest.min(self.stroke_max));
        }
        let highest = recording.force.iter().flatten().copied().fold(0.0, f64::max);
        self.blocked = self.blocked.max(highest);
    }

    /// Takes what a recording at a held stroke shows: the line from the blocked force through its force at the highest level meets zero
    /// near the free stroke, and before it, because the force falls more slowly the shorter the muscle is.
    pub(crate) fn learn_held(&mut self, recording: &Recording) {
        let Some(force) = &recording.force else { return };
        let stroke = recording.stroke.iter().copied().fold(0.0, f64::max);
        let rows = recording.pressure.iter().zip(&recording.stroke).zip(force);
        let at_top: Vec<f64> = rows
            .filter(|((p, x), _)| **p > 0.95 * self.top && **x > 0.95 * stroke)
            .map(|(_, f)| *f)
            .collect();
        let pull = at_top.iter().sum::<f64>() / at_top.len() as f64;
        if !(stroke > 0.0 && pull >= self.free_force() && self.blocked > 0.0) {
            return;
        }
        let before = self.pulled_at.last().copied().unwrap_or(0.0);
        self.pulled_at.push(stroke);
        self.pulled_at.sort_by(f64::total_cmp);
        if stroke > before && pull < self.blocked {
            let meets_zero = stroke / (1.0 - pull / self.blocked);
            self.free = meets_zero.clamp(stroke, self.longest().max(stroke));
        }
    }

    /// Takes that the muscle hung slack at this held stroke, m, even at the highest level.
    pub(crate) fn learn_slack(&mut self, stroke: f64) {
        if stroke > 0.0 {
            self.slack_from = self.slack_from.min(stroke);
            self.free = self.free.min(self.longest());
        }
    }

    /// Longest stroke that the rig allows and at which the muscle may still pull, m.
    fn longest(&self) -> f64 {
        self.stroke_max.min(self.slack_from)
    }

    /// Whether the model knows the stroke: it saw strokes, or three held lengths.
    fn model_knows_strokes(&self) -> bool {
        const SAME: f64 = 1e-4;
        let lengths = self.pulled_at.windows(2).filter(|w| w[1] - w[0] > SAME).count() + 1;
        self.free > 0.0 && (!self.by_hand || self.pulled_at.is_empty() || lengths >= 2)
    }

    /// Takes the free stroke from a model where no stroke at the highest level was recorded.
    pub(crate) fn learn_stroke_of(&mut self, model: &Muscle<f64>) {
        if !(self.free > 0.0) {
            self.free = pam_diagnose::protocol_simulation::free_stroke(model, self.top).min(self.stroke_max);
        }
    }

    /// Takes free stroke and levels from the survey of all levels. The levels stay where the muscle moves at the lowest of them.
    pub fn learn_survey(&mut self, recording: &Recording) {
        let levels = self.levels();
        self.learn_strokes(recording);
        let (lowest, next) = (levels[0], levels[1]);
        let lowest_rows =
            recording.pressure.iter().zip(&recording.stroke).filter(|(p, _)| **p < 0.5 * (lowest + next));
        let moved = lowest_rows.map(|(_, x)| *x).fold(0.0, f64::max);
        if self.free > 0.0 && moved >= BOTTOM_STROKE * self.free {
            self.decided = Some(levels);
        }
    }

    /// Takes a fitted model.
    pub fn learn_model(&mut self, model: Muscle<f64>) {
        let deadband = model.deadband().pascals();
        if deadband > 0.0 {
            self.deadband = deadband.min(0.5 * self.top);
        }
        self.model = Some(Box::new(model));
        if self.decided.is_none() && self.free > 0.0 {
            self.decided = Some(self.levels());
        }
    }

    /// The pressures of the campaign, Pa, rising.
    #[must_use]
    pub fn levels(&self) -> Vec<f64> {
        if let Some(levels) = &self.decided {
            return levels.clone();
        }
        let moves = match &self.model {
            Some(_) => self.pressure_that_reaches(BOTTOM_STROKE * self.free_stroke(self.top)),
            None => 0.0,
        };
        let bottom =
            (BOTTOM_SHARE * self.top).max(BOTTOM_DEADBANDS * self.deadband).max(moves).min(0.7 * self.top);
        let last = (LEVELS - 1) as f64;
        (0..LEVELS).map(|i| ((bottom + (self.top - bottom) * i as f64 / last) * 1e-3).round() * 1e3).collect()
    }

    /// The slow speed, m/s.
    #[must_use]
    pub fn slow_speed(&self) -> f64 {
        // A quarter of the longest stroke before it is known: a tenth of the rest length.
        let free = if self.free > 0.0 { self.free } else { 0.25 * self.stroke_max };
        (free / SLOW_STROKE).max(1e-6)
    }

    /// Force at which a stroke turns, N.
    #[must_use]
    pub(crate) fn free_force(&self) -> f64 {
        FREE_FORCE * self.blocked
    }

    /// Stroke at which the muscle is free at a pressure, m; a little more where it is not known yet, as the force ends a stroke.
    #[must_use]
    pub fn free_stroke(&self, pressure: f64) -> f64 {
        let limit = self.longest();
        if self.model_knows_strokes()
            && let Some(model) = &self.model
        {
            return (1.02 * pam_diagnose::protocol_simulation::free_stroke(model, pressure)).min(limit);
        }
        if self.free > 0.0 {
            let share = (pressure - self.deadband) / (self.top - self.deadband).max(1.0);
            // A stroke that is moved ends where the force does; a held one must not lie beyond it.
            let beyond = if self.by_hand { 1.0 } else { 1.2 };
            return (beyond * self.free * share.clamp(0.05, 1.0)).min(limit);
        }
        limit
    }

    /// Least pressure at which the free stroke is at least this, Pa; zero for none.
    #[must_use]
    pub(crate) fn pressure_that_reaches(&self, stroke: f64) -> f64 {
        if stroke <= 0.0 {
            return 0.0;
        }
        let (mut low, mut high) = (0.0, self.top);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if self.free_stroke(middle) < stroke { low = middle } else { high = middle }
        }
        // A ramp without width shows nothing.
        high.min(0.8 * self.top)
    }

    /// Force by the model, N; by the blocked force alone before there is one.
    #[must_use]
    pub fn force(&self, pressure: f64, stroke: f64) -> f64 {
        match &self.model {
            Some(m) => m.force(Pressure::from_pascals(pressure), Length::from_metres(stroke), 0.0).newtons(),
            None => {
                let share = (pressure - self.deadband) / (self.top - self.deadband).max(1.0);
                self.blocked * share.max(0.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use virtual_bench::presets;

    #[test]
    fn a_weak_load_cell_limits_the_highest_level() {
        let muscle = MuscleDescription::parse(&presets::miniature().description()).unwrap();
        let free = Places::new(&muscle, &Rig::commanded()).unwrap();
        assert_eq!(free.limitation(), None);
        let weak = Places::new(&muscle, &Rig { force_max: Some(50.0), ..Rig::commanded() }).unwrap();
        let pull = weak.top * braid_area(&muscle);
        assert!(weak.top < free.top && (44.0..=45.0).contains(&pull), "{pull} N at {} Pa", weak.top);
        assert!(weak.limitation().is_some_and(|l| l.contains("50 N")));
    }
}
