//! Where the muscle is slack: the force stays at zero, and the model must not pull there.

use super::prepared::Prepared;
use super::screen::Use;
use super::smoothing::Smoothing;

impl Prepared {
    /// Finds where the muscle is slack: the force stands near zero where straight curves, fitted to points that pull,
    /// would push. Flexible curves would bend until they described slackness as elasticity.
    pub(super) fn find_slack(&mut self) {
        let force = self.points.force.high.max(-self.points.force.low);
        let floor = self.clips.0.map_or(0.0, |c| c.force).max(self.points.force.low).min(0.0);
        let near_zero = floor + (0.02 * force).max(4.0 * self.points.row_noise);
        let candidates: Vec<bool> = self.points.list.iter().map(|p| p.force <= near_zero).collect();
        let rows: f64 = self
            .points
            .list
            .iter()
            .zip(&candidates)
            .filter(|(_, c)| **c)
            .map(|(p, _)| f64::from(p.rows))
            .sum();
        if rows < 0.002 * self.points.rows as f64 {
            return;
        }
        let fitted = self.used.clone();
        for (used, candidate) in self.used.iter_mut().zip(&candidates) {
            if *candidate && *used == Use::Fitted {
                *used = Use::Slack;
            }
        }
        self.weigh();
        // No trend with pressure at all: what slack points would say about it must not be said by others' continuation.
        let level = std::mem::replace(&mut self.design.level, 10.0);
        self.solve(Smoothing::STRAIGHT, 10);
        self.design.level = level;
        self.used = fitted;
        let curves = self.design.curves(&self.parameters);
        let mut slack = 0.0;
        for i in 0..self.used.len() {
            let e = self.design.evaluate(i, &self.parameters, &curves);
            if candidates[i] && e.force < floor - 0.03 * force {
                if !matches!(self.used[i], Use::Clipped | Use::Dropout) {
                    self.used[i] = Use::Slack;
                }
                slack += f64::from(self.points.list[i].rows);
            }
        }
        self.goes_slack = slack > 0.005 * self.points.rows as f64;
        if !self.goes_slack {
            self.used = self.used.iter().map(|u| if *u == Use::Slack { Use::Fitted } else { *u }).collect();
        }
    }

    /// A slack muscle says that the model must not pull there: points set aside as slack come back where it would.
    pub(super) fn hold_slack_down(&mut self) {
        let before: Vec<Use> = self.used.clone();
        let set_aside = |u: Use| matches!(u, Use::Slack | Use::Clipped);
        if !before.iter().any(|u| set_aside(*u)) {
            return;
        }
        let tolerance = (0.005 * self.points.force.span()).max(2.0 * self.points.row_noise);
        let upper = self.clips.1.map_or(f64::INFINITY, |c| c.force);
        for round in 0..16 {
            let curves = self.design.curves(&self.parameters);
            let mut changed = 0;
            for i in 0..self.used.len() {
                if !set_aside(before[i]) || self.points.list[i].force >= upper {
                    continue;
                }
                let above = self.design.evaluate(i, &self.parameters, &curves).force
                    > self.points.list[i].force + tolerance;
                // Points let go may rise again, and take turns for ever: after a few rounds none is let go any more.
                let kept = round >= 4 && self.used[i] == Use::Fitted;
                let wanted = if above || kept { Use::Fitted } else { before[i] };
                changed += usize::from(wanted != self.used[i]);
                self.used[i] = wanted;
            }
            if changed == 0 {
                break;
            }
            self.weigh();
            self.solve(self.smoothing, 6);
        }
        self.held_down = self.used.iter().zip(&before).map(|(u, b)| u != b).collect();
        // They count in the fit, not in its errors: what the sensor reads of a slack muscle is not the muscle's force.
    }
}
