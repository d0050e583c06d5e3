//! The terminal output of a running campaign.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pam_campaign::actuation::Reading;
use pam_campaign::campaign::{Done, Observer};
use pam_campaign::journal::Chosen;
use pam_campaign::step::Step;
use pam_campaign::watch::Spoiled;
use pam_data::pluralise::pluralise;
use pam_data::progress::Progress;

use crate::console::Console;
use crate::progress::ProgressLine;

/// Notes, a progress line, and the flag of Ctrl-C.
pub(crate) struct Watching<'a> {
    console: &'a Console,
    interrupted: Arc<AtomicBool>,
    line: Option<ProgressLine>,
    begun: Option<f64>,
    budget_s: f64,
    spent_s: f64,
    /// Forces of the present recording, N.
    forces: Vec<f64>,
}

impl<'a> Watching<'a> {
    pub(crate) fn new(
        console: &'a Console,
        interrupted: Arc<AtomicBool>,
        budget_s: f64,
        spent_s: f64,
    ) -> Self {
        Self { console, interrupted, line: None, begun: None, budget_s, spent_s, forces: Vec::new() }
    }
}

impl Observer for Watching<'_> {
    fn chosen(&mut self, chosen: &Chosen) {
        self.line = None;
        self.console.note(format!(
            "{:2}. {} ({:.0} s). {}",
            chosen.number,
            chosen.step.description(),
            chosen.expected_s,
            chosen.why
        ));
        self.console.detail(format!(
            "    expected: table {:.3}, effect {:.3}, unseen effects {:.3} nats; chosen in {:.2} s",
            chosen.table_nats, chosen.effect_nats, chosen.unseen_nats, chosen.choosing_s
        ));
        let line = ProgressLine::new(self.console, format!("campaign, step {}", chosen.number));
        line.total(self.budget_s as u64);
        self.line = Some(line);
        self.begun = None;
        self.forces.clear();
    }

    fn reading(&mut self, reading: &Reading) {
        if reading.recorded && reading.force.is_finite() {
            self.forces.push(reading.force);
        }
        let begun = *self.begun.get_or_insert(reading.time);
        if let Some(line) = &self.line {
            line.set((self.spent_s + reading.time - begun) as u64);
        }
    }

    fn spoiled(&mut self, step: &Step, reason: Spoiled) {
        self.line = None;
        self.forces.clear();
        self.console.warning(format!("{} is worth nothing: {reason}", step.name()));
    }

    fn done(&mut self, done: &Done) {
        self.line = None;
        self.spent_s += done.clock_s.1 - done.clock_s.0;
        self.console.note(format!("    {}. {}", pluralise(done.rows, "row"), done.finding));
        if let Some(picture) = picture(&self.forces) {
            self.console.note(format!("    {picture}"));
        }
    }

    fn stop(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}

/// Columns of a picture on the terminal.
const COLUMNS: usize = 48;
/// Heights of its columns.
const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The force of a recording over time, as one line of blocks; nothing for too few rows.
fn picture(forces: &[f64]) -> Option<String> {
    let low = forces.iter().copied().fold(f64::INFINITY, f64::min);
    let high = forces.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if forces.len() < COLUMNS || !(high > low) {
        return None;
    }
    let column = |at: usize| {
        let rows = &forces[at * forces.len() / COLUMNS..(at + 1) * forces.len() / COLUMNS];
        let mean = rows.iter().sum::<f64>() / rows.len().max(1) as f64;
        let share = (mean - low) / (high - low);
        BLOCKS[((share * BLOCKS.len() as f64) as usize).min(BLOCKS.len() - 1)]
    };
    let line: String = (0..COLUMNS).map(column).collect();
    Some(format!("force {line} from {low:.1} to {high:.1} N"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_of_a_rise_rises() {
        let rise: Vec<f64> = (0..480).map(f64::from).collect();
        let line = picture(&rise).unwrap();
        assert!(line.starts_with("force ▁") && line.contains("█ from 0.0 to 479.0 N"), "{line}");
        assert_eq!(picture(&[1.0; 480]), None);
        assert_eq!(picture(&rise[..10]), None);
    }
}
