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
}

impl<'a> Watching<'a> {
    pub(crate) fn new(
        console: &'a Console,
        interrupted: Arc<AtomicBool>,
        budget_s: f64,
        spent_s: f64,
    ) -> Self {
        Self { console, interrupted, line: None, begun: None, budget_s, spent_s }
    }
}

impl Observer for Watching<'_> {
    fn chosen(&mut self, chosen: &Chosen) {
        self.line = None;
        self.console.note(format!(
            "{:2}. {} ({:.0} s). {}",
            chosen.number,
            chosen.step.words(),
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
    }

    fn reading(&mut self, reading: &Reading) {
        let begun = *self.begun.get_or_insert(reading.time);
        if let Some(line) = &self.line {
            line.set((self.spent_s + reading.time - begun) as u64);
        }
    }

    fn spoiled(&mut self, step: &Step, reason: Spoiled) {
        self.line = None;
        self.console.warning(format!("{} is worth nothing: {reason}", step.name()));
    }

    fn done(&mut self, done: &Done) {
        self.line = None;
        self.spent_s += done.clock_s.1 - done.clock_s.0;
        self.console.note(format!("    {}. {}", pluralise(done.rows, "row"), done.told));
    }

    fn stop(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}
