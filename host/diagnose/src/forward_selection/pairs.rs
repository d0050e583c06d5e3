//! Two effects of which neither explains enough alone: each is judged beside the other, as it would be after it.
//!
//! Where two effects explain a third of the excess error each, the first cannot be selected, and the second is never judged. Forward selection
//! misses such pairs, which a step of two finds (A. J. Miller, Subset Selection in Regression, 2nd ed., Chapman & Hall 2002, section 3.3).

use std::ops::ControlFlow;

use super::super::baselines::Kind;
use super::super::candidate_fit::CandidateFit;
use super::super::candidate_scoring::Scorer;
use super::super::criteria::selection::{ALIKE, FIRSTS_OF_PAIRS, FURTHER_SHARE, MOST_SELECTED};
use super::super::linear::energy;
use super::super::selection_step::{refit, scan_step};
use super::{ForwardSelection, Winner};

/// Two effects, each as it is beside the other, and what both leave, N².
pub(super) struct Pair {
    winners: [Winner; 2],
    left: f64,
}

impl ForwardSelection<'_> {
    /// The two effects that leave least, out of those of which each is sufficient beside the other.
    pub(super) fn pair(&self, best: &[CandidateFit], p: &[f64], scorer: &Scorer<'_>) -> Option<Pair> {
        let rest = self.excess_of(energy(&self.joint.residual));
        let too_little = !self.chosen.is_empty() && rest < FURTHER_SHARE * self.excess_energy;
        if too_little || self.chosen.len() + 2 > MOST_SELECTED {
            return None;
        }
        let evident = |(at, t): &(usize, &CandidateFit)| {
            self.is_eligible(t, scorer) && self.is_within_range(t) && self.is_evident(t, p[*at])
        };
        let mut firsts: Vec<&CandidateFit> =
            best.iter().enumerate().filter(evident).map(|(_, t)| t).collect();
        firsts.sort_by(|a, b| b.score.total_cmp(&a.score));
        firsts.truncate(FIRSTS_OF_PAIRS);
        let pairs = firsts.into_iter().filter_map(|first| self.pair_with(first));
        pairs.min_by(|a, b| a.left.total_cmp(&b.left))
    }

    /// Selects a pair, unless another explanation is as likely as one of its effects; ends the selection where it cannot.
    pub(super) fn select_pair(&mut self, pair: Pair) -> ControlFlow<()> {
        for winner in &pair.winners {
            if winner.stiffening >= ALIKE {
                self.let_bladder_stiffen(&winner.fit);
                return ControlFlow::Continue(());
            }
            if let Some(why) = self.too_many_competitors(winner) {
                self.refuse(winner.fit.candidate, why);
                return ControlFlow::Break(());
            }
        }
        let before = self.chosen.len();
        self.take(pair.winners.into());
        if self.chosen.len() > before { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    fn is_within_range(&self, t: &CandidateFit) -> bool {
        t.is_within_known_range(&self.library[t.candidate])
    }

    /// An effect with its best partner, where each is sufficient beside the other.
    fn pair_with(&self, first: &CandidateFit) -> Option<Pair> {
        let (second, _) = self.beside(first).strongest_sufficient(|_| true)?;
        let beside = self.beside(&second.fit);
        // Before all others are tested there, which takes time.
        let alone = Scorer::new(&beside.joint, self.scale).refine(first, self.library, &beside.rows);
        if !beside.is_sufficient(&alone, 0.0) {
            return None;
        }
        let (first_beside, left) = beside.strongest_sufficient(|t| t.candidate == first.candidate)?;
        // What the pair explains is what the first does alone and the second beside it.
        let first = Winner { gain: first.gain, ..first_beside };
        Some(Pair { winners: [first, second], left })
    }

    /// The same with one effect more, whatever its evidence.
    fn beside(&self, other: &CandidateFit) -> Self {
        let chosen = self.chosen.iter().chain([other]).cloned().collect();
        let joint = refit(&self.rows, Kind::Soft(other.prior), chosen, self.library);
        let mut beside = self.clone();
        beside.joined(joint);
        beside
    }

    /// The strongest of the effects among which to look, if it is sufficient; and what it leaves, N².
    fn strongest_sufficient(&self, among: impl Fn(&CandidateFit) -> bool) -> Option<(Winner, f64)> {
        let scorer = Scorer::new(&self.joint, self.scale);
        let (best, p) = scan_step(self.library, &self.rows, &scorer, self.blocked, &self.chosen);
        let open = best
            .iter()
            .enumerate()
            .filter(|(_, t)| among(t) && self.is_eligible(t, &scorer) && self.is_within_range(t));
        let (at, winner) = open.max_by(|a, b| a.1.score.total_cmp(&b.1.score))?;
        let sufficient = self.is_sufficient(winner, p[at]) && self.memory_of_unknown_start(winner).is_none();
        sufficient.then(|| {
            let left = (winner.before - winner.gain).max(0.0);
            (self.with_competitors(winner.clone(), p[at], &best, &scorer), left)
        })
    }
}
