//! Forward selection with exchange: what is taken next, whether it is enough, and what the whole refit makes of it.

use std::ops::ControlFlow;

use model_core::effects::{Link, Start};

use super::baselines::{self, Baseline, Give, Kind};
use super::candidates::Candidate;
use super::criteria::baseline::{FIRST_GIVE, TABLE_ORDER};
use super::criteria::candidates::LEAST_SIGMA;
use super::criteria::selection::{
    ALIKE, ALONE_FLOOR, CONFUSABLE, EXCHANGE_LEAVES, FAMILY_ALPHA, FEWEST_INDEPENDENT, FIRST_STROKES,
    FURTHER_SHARE, KEPT_GAIN, LEAST_EXCESS, LEAST_SCORE, LEAST_SCORE_ALONE, LEAST_SHARE, MAX_NAMED,
    MOST_BARRED, MOST_RIVALS, NARROW_FLOOR, NARROW_PEAK, NARROW_SCORE, SELECTION_FLOOR, SHADOW,
};
use super::evidence::Scale;
use super::ground::Ground;
use super::linear::energy;
use super::noise::{self, Noise};
use super::remark::{Refusal, Remark};
use super::rows::{ORDERS, Rows};
use super::select::{Found, Joint, Taken, best_of_each, look, refit, rivals, worth_naming};
use super::trial::Trial;

/// Searches for what is missing. Candidates in `refused` are looked at and may be rivals, but are not taken.
pub(crate) fn search(
    rows: &Rows,
    library: &[Candidate],
    blocked: f64,
    step: f64,
    refused: &[usize],
) -> Found {
    let mut search = Search::begin(rows, library, blocked, step, refused);
    while search.chosen.len() < MAX_NAMED
        && search.barred.len() < refused.len() + MOST_BARRED
        && search.next().is_continue()
    {}
    search.end()
}

/// A forward selection under way.
struct Search<'a> {
    /// The rows, linearised about the present baseline.
    rows: Rows,
    library: &'a [Candidate],
    blocked: f64,
    /// The middle distance in time between rows, s.
    step: f64,
    noise: Noise,
    /// What evidence is weighed with; fixed at the beginning.
    scale: Scale,
    kind: Kind,
    bare: Baseline,
    full: Baseline,
    /// The effects so far, and how each came to be taken.
    chosen: Vec<Trial>,
    taken: Vec<Taken>,
    traces: Vec<Vec<f64>>,
    /// The energy above noise before anything was taken, N².
    above: f64,
    first_look: Option<(Vec<Trial>, Vec<f64>)>,
    /// Candidates that are not taken (again).
    barred: Vec<usize>,
    remarks: Vec<Remark>,
}

impl<'a> Search<'a> {
    /// The baseline and the noise before any effect.
    fn begin(rows: &Rows, library: &'a [Candidate], blocked: f64, step: f64, refused: &[usize]) -> Self {
        let order = if rows.isometric { TABLE_ORDER } else { ORDERS };
        let flexible = baselines::fit(rows, Kind::Flexible(order), &[]);
        let weight = energy(rows.root_weight()).max(1e-12);
        let noise = noise::estimate(rows, &flexible.residual, step);
        let scale = Scale {
            weight,
            independent: noise.independent.max(rows.blocks as f64),
            sigma: noise.sigma.max(LEAST_SIGMA * blocked),
            blocked,
        };
        let row = scale.sigma * (weight / scale.independent).sqrt();
        let first = Give { elastic: FIRST_GIVE.0 * blocked, friction: FIRST_GIVE.1 * blocked, row };
        let begun = baselines::fit(rows, Kind::Soft(first), &[]);
        let kind = Kind::Soft(Ground::new(&begun, scale).give);
        let rows = baselines::linearised(rows, &begun);
        let full = baselines::fit(&rows, kind, &[]);
        let rows = baselines::linearised(&rows, &full);
        let mut search = Self {
            rows,
            library,
            blocked,
            step,
            noise,
            scale,
            kind,
            bare: full.clone(),
            full,
            chosen: Vec::new(),
            taken: Vec::new(),
            traces: Vec::new(),
            above: 0.0,
            first_look: None,
            barred: refused.to_vec(),
            remarks: Vec::new(),
        };
        search.above = search.above_noise(energy(&search.bare.residual));
        search
    }

    fn above_noise(&self, energy: f64) -> f64 {
        (energy - self.noise.sigma.powi(2) * self.scale.weight).max(LEAST_EXCESS * energy).max(1e-12)
    }

    /// Looks for one more effect: whether another look may be worth it.
    fn next(&mut self) -> ControlFlow<()> {
        let ground = Ground::new(&self.full, self.scale);
        let (best, p) = look(self.library, &self.rows, &ground, self.blocked);
        if self.first_look.is_none() {
            self.first_look = Some((best.clone(), p.clone()));
        }
        let Some(at) = self.winner(&best, &ground) else { return ControlFlow::Break(()) };
        if self.chosen.is_empty() {
            self.above = self.above_noise(best[at].before);
        }
        if !self.is_enough(&best[at], p[at]) {
            return ControlFlow::Break(());
        }
        let winner = self.within_the_known(&best[at], &best, &ground);
        if let Some(memory) = self.found_itself_beside(&winner) {
            self.remarks.push(Remark::Refused {
                effect: self.library[winner.candidate].name().to_owned(),
                why: Refusal::UnknownMemory(memory.to_owned()),
            });
            self.barred.push(winner.candidate);
            return ControlFlow::Continue(());
        }
        let beside = Kind::Soft(winner.give);
        let metric = baselines::fit(&self.rows, beside, &[]);
        let rivals = rivals(&winner, &best, self.library, &self.rows, &ground, &metric.span);
        let open: Vec<String> =
            rivals.iter().filter(|r| r.1 > CONFUSABLE).map(|r| self.library[r.0].name().to_owned()).collect();
        if open.len() > MOST_RIVALS {
            self.remarks.push(Remark::Refused {
                effect: self.library[winner.candidate].name().to_owned(),
                why: Refusal::Rivals { share: self.of_rest(&winner), others: open },
            });
            return ControlFlow::Break(());
        }
        self.take(winner, p[at], rivals, metric);
        ControlFlow::Continue(())
    }

    /// Whether a candidate may be judged at all.
    fn is_open(&self, t: &Trial, ground: &Ground<'_>) -> bool {
        let rival = |k: &Taken| k.rivals.iter().any(|r| r.0 == t.candidate && r.1 > CONFUSABLE);
        t.gain > 0.0
            && !self.chosen.iter().any(|c| c.candidate == t.candidate)
            && !self.barred.contains(&t.candidate)
            && !self.taken.iter().any(rival)
            && worth_naming(t, self.library, &self.rows, ground)
    }

    /// Which of the best of each candidate is to be judged.
    fn winner(&self, best: &[Trial], ground: &Ground<'_>) -> Option<usize> {
        let open = best.iter().enumerate().filter(|(_, t)| self.is_open(t, ground));
        let (at, winner) = open.max_by(|a, b| a.1.score.total_cmp(&b.1.score))?;
        // Where something that tables imitate explains far more, naming the next best would be naming a shadow of it.
        let best_of_all = best.iter().map(|t| t.score).fold(0.0, f64::max);
        let shadow = best_of_all > (winner.score + LEAST_SCORE_ALONE).max(SHADOW * winner.score);
        (!self.chosen.is_empty() || !shadow).then_some(at)
    }

    /// The winner; or, where it explains the misfit only at the edge of what is known of it, the best that explains the same within what
    /// is known. That there is something to explain has been shown by the winner: its score stands.
    fn within_the_known(&self, winner: &Trial, best: &[Trial], ground: &Ground<'_>) -> Trial {
        let known = |t: &Trial| t.keeps_within_the_known(&self.library[t.candidate]);
        if known(winner) {
            return winner.clone();
        }
        let metric = baselines::fit(&self.rows, Kind::Soft(winner.give), &[]);
        let rivals = rivals(winner, best, self.library, &self.rows, ground, &metric.span);
        let alike = |t: &Trial| rivals.iter().any(|r| r.0 == t.candidate && r.1 >= ALIKE);
        best.iter()
            .filter(|t| known(t) && alike(t) && self.is_open(t, ground))
            .max_by(|a, b| a.score.total_cmp(&b.score))
            .map_or_else(|| winner.clone(), |t| Trial { score: winner.score.max(t.score), ..t.clone() })
    }

    /// The effect chosen whose memory has to find itself in the very strokes by which a law of friction would be named.
    fn found_itself_beside(&self, winner: &Trial) -> Option<&'static str> {
        let info = self.library[winner.candidate].info;
        let of_friction = info.link == Link::Friction && !info.persistent;
        let branch = |t: &&Trial| self.library[t.candidate].info.start == Start::Branch;
        let memory = self.chosen.iter().find(branch).filter(|_| of_friction)?;
        let first = self.rows.first_strokes();
        let within: f64 = winner.scores.iter().zip(&first).filter(|(_, first)| **first).map(|(s, _)| s).sum();
        (within > FIRST_STROKES * winner.scores.iter().sum::<f64>())
            .then(|| self.library[memory.candidate].name())
    }

    /// The share it takes of what the bladder's own differences leave; or, for an effect that spares the bladder these
    /// differences, of what one bladder leaves.
    fn of_rest(&self, winner: &Trial) -> f64 {
        let spared = winner.relief / self.above_noise(winner.unrelieved);
        (winner.gain / self.above_noise(winner.before)).max(spared)
    }

    /// Whether it is beyond chance, explains enough, and is large enough to matter.
    fn is_enough(&self, winner: &Trial, p: f64) -> bool {
        // What lives in a few strokes can never give a large sum over blocks in units of its scatter: six strokes that all agree
        // happen by chance once in 64. There the likelihood counts, whose independent rows are those that the residual's own
        // correlation leaves.
        let by_blocks = p <= FAMILY_ALPHA;
        let significant = winner.score >= if by_blocks { LEAST_SCORE } else { LEAST_SCORE_ALONE };
        let of_rest = self.of_rest(winner);
        let worth = if self.chosen.is_empty() {
            of_rest >= LEAST_SHARE
        } else {
            winner.gain / self.above >= FURTHER_SHARE && of_rest >= LEAST_SHARE
        };
        // A wall at the end of the stroke is high and narrow.
        let narrow =
            winner.peak >= NARROW_PEAK * self.blocked && winner.score >= NARROW_SCORE * LEAST_SCORE_ALONE;
        // A few readings that come a sample late at a turn make a likelihood of any size, and move little.
        let relief = if by_blocks { winner.relief } else { 0.0 };
        let moved = (winner.gain.max(relief) / self.scale.weight).sqrt();
        let shown = self.library[winner.candidate].shown_vented(&self.rows);
        let least = match (by_blocks || shown, narrow) {
            (true, true) => NARROW_FLOOR,
            (true, false) => 1.0,
            (false, _) => ALONE_FLOOR,
        };
        significant && worth && moved >= least * SELECTION_FLOOR * self.blocked
    }

    /// Fits everything together with it, and keeps it if it then still does what it promised; else it is barred.
    fn take(&mut self, winner: Trial, p: f64, rivals: Vec<(usize, f64, f64)>, metric: Baseline) {
        let name = self.library[winner.candidate].name();
        let beside = Kind::Soft(winner.give);
        let chosen = self.chosen.iter().chain([&winner]).cloned().collect();
        let joint = refit(&self.rows, beside, chosen, self.library);
        // One step of a linear problem promised this; the whole refit has to keep a good part of it.
        let kept = energy(&joint.base.residual) <= winner.before - KEPT_GAIN * winner.gain;
        // What the effect leaves tells anew how many rows are independent: a wandering zero that flexible tables had followed from
        // pressure to pressure shows itself only now.
        let left = noise::estimate(&joint.rows, &joint.base.residual, self.step);
        let independent = left.independent.max(FEWEST_INDEPENDENT);
        let score = winner.score * (independent / self.scale.independent).min(1.0);
        let slow = self.library[winner.candidate].traits.slow;
        let least = if slow { LEAST_SCORE_ALONE } else { LEAST_SCORE };
        if !kept || score < least {
            // The effects before it keep the amplitudes of this joint fit, until the next one.
            self.chosen = joint.trials;
            self.chosen.pop();
            self.barred.push(winner.candidate);
            self.remarks.push(Remark::Refused {
                effect: name.to_owned(),
                why: if kept { Refusal::SlowDrift } else { Refusal::LostInRefit },
            });
            return;
        }
        self.kind = beside;
        self.bare = metric;
        self.joined(joint);
        self.noise = Noise { sigma: self.noise.sigma, ..left };
        let share = winner.gain / self.above;
        self.taken.push(Taken { trial: winner, p, share, rivals, rms: self.full.rms(&self.rows) });
        if self.chosen.len() > 1 {
            self.exchange();
        }
    }

    /// What a joint fit makes of the effects.
    fn joined(&mut self, joint: Joint) {
        (self.rows, self.full, self.chosen, self.traces) =
            (joint.rows, joint.base, joint.trials, joint.traces);
    }

    /// Tries to replace each effect taken by another beside the rest; a better one takes its place.
    fn exchange(&mut self) {
        for position in 0..self.chosen.len().saturating_sub(1) {
            let mut others: Vec<Trial> = self.chosen.clone();
            others.remove(position);
            let without = refit(&self.rows, self.kind, others, self.library);
            let rows = &without.rows;
            let ground = Ground::new(&without.base, self.scale);
            let best = best_of_each(&ground.scan(self.library, rows), self.library);
            let present = self.chosen[position].candidate;
            let own = best.iter().find(|t| t.candidate == present).map_or(0.0, |t| t.score);
            let challenger = best
                .iter()
                .filter(|t| !self.chosen.iter().any(|c| c.candidate == t.candidate))
                .max_by(|a, b| a.score.total_cmp(&b.score));
            if let Some(c) = challenger {
                let refined = ground.refine(c, self.library, rows);
                let (mine, _) = ground.left_under(&self.chosen[position], self.library, rows, refined.give);
                // It must leave clearly less than the present one does.
                if refined.score > own + LEAST_SCORE && refined.before - refined.gain < EXCHANGE_LEAVES * mine
                {
                    let taken = &mut self.taken[position];
                    taken.rivals.retain(|r| r.0 != refined.candidate);
                    taken.rivals.insert(0, (present, CONFUSABLE, 0.0));
                    taken.trial = refined.clone();
                    self.chosen[position] = refined;
                }
            }
            self.joined(refit(&without.rows, self.kind, self.chosen.clone(), self.library));
        }
        let rms = self.full.rms(&self.rows);
        for t in &mut self.taken {
            t.rms = rms;
        }
    }

    /// What was found, without what the joint fit brought to nothing: that was not there.
    fn end(mut self) -> Found {
        let all = self.chosen.len();
        (self.chosen, self.taken) = std::mem::take(&mut self.chosen)
            .into_iter()
            .zip(std::mem::take(&mut self.taken))
            .filter(|(c, _)| c.amplitudes.iter().any(|a| *a != 0.0))
            .unzip();
        if self.chosen.len() < all {
            self.joined(refit(&self.rows, self.kind, self.chosen.clone(), self.library));
        }
        for (t, c) in self.taken.iter_mut().zip(&self.chosen) {
            t.trial.amplitudes.clone_from(&c.amplitudes);
            t.trial.shapes.clone_from(&c.shapes);
        }
        let (first_look, first_p) = self.first_look.unwrap_or_default();
        let Self { rows, bare, full, taken, above, traces, noise, remarks, .. } = self;
        Found { rows, bare, full, taken, first_look, first_p, above, traces, noise, remarks }
    }
}
