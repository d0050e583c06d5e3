//! Forward selection with exchange: the next effect, whether its evidence is sufficient, and the joint refit.

mod pairs;

use std::ops::ControlFlow;

use model_core::effects::{Experiment, Link, Start};

use super::baselines::{self, Baseline, Kind, PriorDeviations};
use super::beginnings;
use super::candidate_fit::{self, CandidateFit};
use super::candidate_scoring::Scorer;
use super::candidates::Candidate;
use super::criteria::baseline::{FIRST_DEVIATIONS, TABLE_ORDER};
use super::criteria::candidates::LEAST_SIGMA;
use super::criteria::selection::{
    ALIKE, ALONE_FLOOR, CONFUSABLE, EXCHANGE_LEAVES, FAMILY_ALPHA, FEWEST_INDEPENDENT, FIRST_STROKES,
    FURTHER_SHARE, KEPT_GAIN, LEAST_EXCESS, LEAST_SCORE, LEAST_SCORE_ALONE, LEAST_SHARE, MOST_COMPETITORS,
    MOST_EXCLUDED, MOST_SELECTED, NARROW_FLOOR, NARROW_PEAK, NARROW_SCORE, RESOLUTION_FLOOR, SELECTION_FLOOR,
    SHADOW,
};
use super::free_zero::fall_beside_free_zero;
use super::likelihood::Scale;
use super::linear::energy;
use super::noise::{self, Noise};
use super::remark::{Refusal, Remark};
use super::resolution;
use super::rows::{ORDERS, Rows};
use super::selection_step::{
    JointFit, SelectedEffect, Selection, best_of_each, competitors, is_selectable, model_weight, refit,
    scan_step, weight_of_stiffening,
};

/// Selects the effects that are missing. Candidates in `refused` are scored and may compete, but are not selected.
pub(crate) fn forward_selection(
    rows: &Rows,
    library: &[Candidate],
    blocked: f64,
    step: f64,
    refused: &[usize],
) -> Selection {
    let mut search = ForwardSelection::begin(rows, library, blocked, step, refused);
    while search.chosen.len() < MOST_SELECTED
        && search.excluded.len() < refused.len() + MOST_EXCLUDED
        && search.next().is_continue()
    {}
    search.end()
}

/// An effect that is about to be selected.
struct Winner {
    fit: CandidateFit,
    p: f64,
    /// What it takes of the weighted residual, N², less what is counted for another that is selected with it.
    gain: f64,
    /// Its competitors: candidate, weight against it (1), cosine with it.
    competitors: Vec<(usize, f64, f64)>,
    /// The weight against it (1) of a bladder that stiffens with the pressure; zero where the base already allows that.
    stiffening: f64,
    /// The base without effects, in the metric of its prior.
    metric: Baseline,
}

/// A forward selection under way.
#[derive(Clone)]
struct ForwardSelection<'a> {
    /// The rows, linearised about the present baseline.
    rows: Rows,
    library: &'a [Candidate],
    blocked: f64,
    /// The middle distance in time between rows, s.
    step: f64,
    noise: Noise,
    /// What the likelihood is scaled with: the weight of the rows is fixed at the beginning, the noise falls with what is explained.
    scale: Scale,
    kind: Kind,
    base_alone: Baseline,
    joint: Baseline,
    /// The effects so far, and the standing of each when it was selected.
    chosen: Vec<CandidateFit>,
    selected: Vec<SelectedEffect>,
    traces: Vec<Vec<f64>>,
    /// The energy before any effect, N², and what of it is above the noise.
    energy_before: f64,
    excess_energy: f64,
    first_scan: Option<(Vec<CandidateFit>, Vec<f64>)>,
    /// Candidates that are not eligible.
    excluded: Vec<usize>,
    remarks: Vec<Remark>,
}

impl<'a> ForwardSelection<'a> {
    /// The baseline and the noise before any effect.
    fn begin(rows: &Rows, library: &'a [Candidate], blocked: f64, step: f64, refused: &[usize]) -> Self {
        let order = if rows.isometric { TABLE_ORDER } else { ORDERS };
        let flexible = baselines::fit(rows, Kind::Flexible(order), &[]);
        let weight = energy(rows.root_weight()).max(1e-12);
        // Coarse steps of the displacement are worth what the slope of the model makes of them.
        let coarse = (rows.stroke_step > 0.0).then(|| baselines::linearised(rows, &flexible));
        let noise = noise::estimate(coarse.as_ref().unwrap_or(rows), &flexible.residual, step);
        let scale = Scale {
            weight,
            independent: noise.independent.max(rows.blocks as f64),
            sigma: noise.sigma.max(LEAST_SIGMA * blocked),
            blocked,
        };
        let row = scale.sigma * (weight / scale.independent).sqrt();
        let first = PriorDeviations {
            elastic: FIRST_DEVIATIONS.0 * blocked,
            friction: FIRST_DEVIATIONS.1 * blocked,
            row,
        };
        let begun = baselines::fit(rows, Kind::Soft(first), &[]);
        let kind = Kind::Soft(Scorer::new(&begun, scale).prior);
        let rows = baselines::linearised(rows, &begun);
        let joint = baselines::fit(&rows, kind, &[]);
        let rows = baselines::linearised(&rows, &joint);
        let mut search = Self {
            rows,
            library,
            blocked,
            step,
            noise,
            scale,
            kind,
            base_alone: joint.clone(),
            joint,
            chosen: Vec::new(),
            selected: Vec::new(),
            traces: Vec::new(),
            energy_before: 0.0,
            excess_energy: 0.0,
            first_scan: None,
            excluded: refused.to_vec(),
            remarks: Vec::new(),
        };
        let scorer = Scorer::new(&search.joint, search.scale);
        search.rows = beginnings::settle(&search.rows, library, &scorer);
        search.energy_before = energy(&search.base_alone.residual);
        search.excess_energy = search.excess_of(search.energy_before);
        search
    }

    fn excess_of(&self, energy: f64) -> f64 {
        (energy - self.noise.sigma.powi(2) * self.scale.weight).max(LEAST_EXCESS * energy).max(1e-12)
    }

    /// One step: selects or excludes a candidate, or ends the selection.
    fn next(&mut self) -> ControlFlow<()> {
        let scorer = Scorer::new(&self.joint, self.scale);
        let (best, p) = scan_step(self.library, &self.rows, &scorer, self.blocked, &self.chosen);
        if self.first_scan.is_none() {
            self.first_scan = Some((best.clone(), p.clone()));
        }
        let Some(at) = self.strongest(&best, &p, &scorer) else { return ControlFlow::Break(()) };
        if self.chosen.is_empty() {
            self.energy_before = best[at].before;
            self.excess_energy = self.excess_of(self.energy_before);
        }
        if !self.is_sufficient(&best[at], p[at]) {
            let pair = self.pair(&best, &p, &scorer);
            return pair.map_or(ControlFlow::Break(()), |pair| self.select_pair(pair));
        }
        let winner = self.best_supported(&best[at], &best, &scorer);
        if let Some(memory) = self.memory_of_unknown_start(&winner) {
            self.refuse(winner.candidate, Refusal::UnknownMemory(memory.to_owned()));
            self.excluded.push(winner.candidate);
            return ControlFlow::Continue(());
        }
        let winner = self.with_competitors(winner, p[at], &best, &scorer);
        if winner.stiffening >= ALIKE {
            self.let_bladder_stiffen(&winner.fit);
            return ControlFlow::Continue(());
        }
        if let Some(why) = self.too_many_competitors(&winner) {
            self.refuse(winner.fit.candidate, why);
            return ControlFlow::Break(());
        }
        self.take(vec![winner]);
        ControlFlow::Continue(())
    }

    /// A fit with the others that may be the cause in its place.
    fn with_competitors(
        &self,
        fit: CandidateFit,
        p: f64,
        best: &[CandidateFit],
        scorer: &Scorer<'_>,
    ) -> Winner {
        let metric = baselines::fit(&self.rows, Kind::Soft(fit.prior), &[]);
        let shown = self.library[fit.candidate].shown_by_check;
        let competitors = if shown {
            Vec::new()
        } else {
            competitors(&fit, best, self.library, &self.rows, scorer, &metric.span)
        };
        let stiffening = if shown || self.rows.bladder_stiffens() {
            0.0
        } else {
            weight_of_stiffening(&fit, self.library, &self.rows, scorer)
        };
        Winner { gain: fit.gain, fit, p, competitors, stiffening, metric }
    }

    /// Why an effect cannot be distinguished from the others.
    fn too_many_competitors(&self, winner: &Winner) -> Option<Refusal> {
        let open: Vec<String> = winner
            .competitors
            .iter()
            .filter(|r| r.1 > CONFUSABLE)
            .map(|r| self.library[r.0].name().to_owned())
            .collect();
        (open.len() > MOST_COMPETITORS || model_weight(&winner.competitors) < CONFUSABLE)
            .then(|| Refusal::Competitors { share: self.of_rest(&winner.fit).min(1.0), others: open })
    }

    /// Lets the stiffness of the one bladder change with the pressure from now on.
    ///
    /// The base has one bladder for all pressures, and tables differ from it where the recordings require it. An effect is credited with the
    /// differences that it explains. Where the simplest difference of all explains as much, the effect has to show what it adds to that.
    fn let_bladder_stiffen(&mut self, effect: &CandidateFit) {
        self.remarks.push(Remark::BladderStiffens(self.library[effect.candidate].name().to_owned()));
        let rows = self.rows.with_stiffening_bladder();
        let joint = refit(&rows, self.kind, self.chosen.clone(), self.library);
        self.joined(joint);
        self.base_alone = baselines::fit(&self.rows, self.kind, &[]);
        self.first_scan = None;
    }

    fn refuse(&mut self, candidate: usize, why: Refusal) {
        self.remarks.push(Remark::Refused { effect: self.library[candidate].name().to_owned(), why });
    }

    /// Whether a candidate may be judged at all.
    fn is_eligible(&self, t: &CandidateFit, scorer: &Scorer<'_>) -> bool {
        // What explains the same as a selected effect is named beside it, not selected.
        let competitor =
            |k: &SelectedEffect| k.competitors.iter().any(|r| r.0 == t.candidate && r.1 >= ALIKE);
        t.gain > 0.0
            && !self.chosen.iter().any(|c| c.candidate == t.candidate)
            && !self.excluded.contains(&t.candidate)
            && !self.selected.iter().any(competitor)
            && is_selectable(t, self.library, &self.rows, scorer)
    }

    /// Which of the best of each candidate is to be judged.
    fn strongest(&self, best: &[CandidateFit], p: &[f64], scorer: &Scorer<'_>) -> Option<usize> {
        let open = || best.iter().enumerate().filter(|(_, t)| self.is_eligible(t, scorer));
        // What a check of the bench shows is there, whether or not something else explains more.
        let shown = |t: &CandidateFit| self.library[t.candidate].shown_by_check;
        if let Some((at, _)) = open().find(|(at, t)| shown(t) && self.is_sufficient(t, p[*at])) {
            return Some(at);
        }
        let (at, winner) = open().max_by(|a, b| a.1.score.total_cmp(&b.1.score))?;
        // Where an effect that the tables conceal explains far more, the next best is only correlated with it.
        let best_of_all = best.iter().map(|t| t.score).fold(0.0, f64::max);
        let shadow = best_of_all > (winner.score + LEAST_SCORE_ALONE).max(SHADOW * winner.score);
        (!self.chosen.is_empty() || !shadow).then_some(at)
    }

    /// The winner; or, where it explains the misfit only at the edge of what is known of it, or is a law of speed and there is one speed, the
    /// best that explains the same without this. The winner has shown that there is something to explain: its score stays.
    ///
    /// At one speed a drag and a constant friction are the same. A constant friction that is called a drag is predicted to grow with the
    /// speed, to many times its size; a drag that is called a constant friction is predicted as it was recorded.
    fn best_supported(
        &self,
        winner: &CandidateFit,
        best: &[CandidateFit],
        scorer: &Scorer<'_>,
    ) -> CandidateFit {
        let known = |t: &CandidateFit| t.is_within_known_range(&self.library[t.candidate]);
        let of_speed = |t: &CandidateFit| self.library[t.candidate].traits.shown_by == Experiment::Speeds;
        // Beside another effect the rest is partly the inexactness of that one's law, which a constant friction may fit by chance.
        let one_speed = self.chosen.is_empty() && self.rows.have_one_speed();
        let supported = |t: &CandidateFit| known(t) && !(one_speed && of_speed(t));
        if supported(winner) {
            return winner.clone();
        }
        let metric = baselines::fit(&self.rows, Kind::Soft(winner.prior), &[]);
        let competitors = competitors(winner, best, self.library, &self.rows, scorer, &metric.span);
        let alike = |t: &CandidateFit| competitors.iter().any(|r| r.0 == t.candidate && r.1 >= ALIKE);
        let strongest = |accepted: &dyn Fn(&CandidateFit) -> bool| {
            let open = best.iter().filter(|t| accepted(t) && alike(t) && self.is_eligible(t, scorer));
            open.max_by(|a, b| a.score.total_cmp(&b.score))
        };
        let other = strongest(&supported).or_else(|| strongest(&known).filter(|_| !known(winner)));
        other.map_or_else(
            || winner.clone(),
            |t| CandidateFit { score: winner.score.max(t.score), ..t.clone() },
        )
    }

    /// The effect chosen whose memory has to find itself in the very strokes by which a law of friction would be named.
    fn memory_of_unknown_start(&self, winner: &CandidateFit) -> Option<&'static str> {
        let info = self.library[winner.candidate].info;
        let of_friction = info.link == Link::Friction && !info.persistent;
        let branch = |t: &&CandidateFit| self.library[t.candidate].info.start == Start::Branch;
        let memory = self.chosen.iter().find(branch).filter(|_| of_friction)?;
        let first = self.rows.first_strokes();
        let within: f64 = winner.scores.iter().zip(&first).filter(|(_, first)| **first).map(|(s, _)| s).sum();
        (within > FIRST_STROKES * winner.scores.iter().sum::<f64>())
            .then(|| self.library[memory.candidate].name())
    }

    /// The share it takes of what the bladder's own differences leave; or, for an effect that spares the bladder these
    /// differences, of what one bladder leaves.
    fn of_rest(&self, winner: &CandidateFit) -> f64 {
        let spared = winner.relief / self.excess_of(winner.unrelieved);
        (winner.gain / self.excess_of(winner.before)).max(spared)
    }

    /// Whether it is beyond chance, explains enough, and is large enough to matter.
    fn is_sufficient(&self, winner: &CandidateFit, p: f64) -> bool {
        let of_rest = self.of_rest(winner);
        let least = if self.library[winner.candidate].shown_by_check { FURTHER_SHARE } else { LEAST_SHARE };
        let of_all = winner.gain / self.excess_energy;
        let worth = of_rest >= least && (self.chosen.is_empty() || of_all >= FURTHER_SHARE);
        worth && self.is_evident(winner, p)
    }

    /// Whether it is beyond chance and large enough to matter, however much else there is.
    fn is_evident(&self, winner: &CandidateFit, p: f64) -> bool {
        // What lives in a few strokes can never give a large sum over blocks in units of its scatter: six strokes that all agree
        // happen by chance once in 64. There the likelihood counts, whose independent rows are those that the residual's own
        // correlation leaves.
        let by_blocks = p <= FAMILY_ALPHA;
        let significant = winner.score >= if by_blocks { LEAST_SCORE } else { LEAST_SCORE_ALONE };
        // A wall at the end of the stroke is high and narrow.
        let narrow =
            winner.peak >= NARROW_PEAK * self.blocked && winner.score >= NARROW_SCORE * LEAST_SCORE_ALONE;
        // A few readings that are one sample late at a reversal give an arbitrarily large likelihood, and move little.
        let relief = if by_blocks { winner.relief } else { 0.0 };
        let moved = (winner.gain.max(relief) / self.scale.weight).sqrt();
        let shown = self.library[winner.candidate].shown_vented(&self.rows);
        let least = match (by_blocks || shown, narrow) {
            (true, true) => NARROW_FLOOR,
            (true, false) => 1.0,
            (false, _) => ALONE_FLOOR,
        };
        // What moves the force by less than coarse steps of the displacement do may be their pattern.
        significant
            && moved
                >= (least * SELECTION_FLOOR * self.blocked)
                    .max(RESOLUTION_FLOOR * resolution::of_stroke(&self.rows))
    }

    /// Refits all effects jointly with these. They are selected if each keeps most of its gain; else the first that does not is excluded.
    fn take(&mut self, winners: Vec<Winner>) {
        let Some(last) = winners.last() else { return };
        let beside = Kind::Soft(last.fit.prior);
        let chosen = self.chosen.iter().chain(winners.iter().map(|w| &w.fit)).cloned().collect();
        let joint = refit(&self.rows, beside, chosen, self.library);
        // The new residual determines how many rows are independent: a drifting zero that flexible tables had followed from
        // pressure to pressure shows itself only now.
        let left = noise::estimate(&joint.rows, &joint.base.residual, self.step);
        for winner in &winners {
            if let Some(why) = self.refusal(&winner.fit, &winner.metric, &joint, left.memory) {
                // The effects before it stay as they were fitted without it.
                self.excluded.push(winner.fit.candidate);
                self.refuse(winner.fit.candidate, why);
                return;
            }
        }
        self.kind = beside;
        self.joined(joint);
        // What changed from cycle to cycle was not noise where the effect explains it.
        let sigma = if left.from_repeats { left.sigma.min(self.noise.sigma) } else { self.noise.sigma };
        self.noise = Noise { sigma, from_repeats: self.noise.from_repeats, ..left };
        self.scale.sigma = sigma.max(LEAST_SIGMA * self.blocked);
        self.excess_energy = self.excess_of(self.energy_before);
        let first = self.chosen.len() - winners.len();
        for (at, Winner { fit, p, gain, competitors, metric, .. }) in winners.into_iter().enumerate() {
            let about = self.chosen[first + at].about.clone();
            self.base_alone = metric;
            // What is selected is not in its place.
            for t in &mut self.selected {
                t.competitors.retain(|r| r.0 != fit.candidate);
            }
            self.selected.push(SelectedEffect {
                fit: CandidateFit { about, ..fit },
                p,
                share: gain / self.excess_energy,
                competitors,
                rms: self.joint.rms(&self.rows),
            });
        }
        if self.chosen.len() > 1 {
            self.exchange();
        }
    }

    /// Why an effect cannot stay, after the joint refit that leaves a residual of this memory, s.
    fn refusal(
        &self,
        winner: &CandidateFit,
        metric: &Baseline,
        joint: &JointFit,
        memory: f64,
    ) -> Option<Refusal> {
        let residual = &joint.base.residual;
        // The gain is that of a linear step; the joint refit has to keep a good part of it.
        if energy(residual) > winner.before - KEPT_GAIN * winner.gain {
            return Some(Refusal::LostInRefit);
        }
        let trace = candidate_fit::projected_trace(winner, self.library, &joint.rows, &metric.span);
        let independent = noise::independent_beside(&joint.rows, residual, memory, &trace, self.step)
            .max(FEWEST_INDEPENDENT);
        let score = winner.score * (independent / self.scale.independent).min(1.0);
        let slow = self.library[winner.candidate].traits.slow;
        let least = if slow { LEAST_SCORE_ALONE } else { LEAST_SCORE };
        let beside_zero =
            || fall_beside_free_zero(&joint.rows, joint.base.kind, &joint.traces, memory, self.step);
        if !(score >= least || winner.score >= least && beside_zero() >= least) {
            return Some(Refusal::SlowDrift);
        }
        // What is impossible may have become so only beside the refitted model.
        let possible = |f: &CandidateFit| self.library[f.candidate].is_consistent(&f.amplitudes, &f.shapes);
        (!joint.fits.iter().all(possible)).then_some(Refusal::ImpossibleInRefit)
    }

    /// What a joint fit makes of the effects.
    fn joined(&mut self, joint: JointFit) {
        (self.rows, self.joint, self.chosen, self.traces) =
            (joint.rows, joint.base, joint.fits, joint.traces);
    }

    /// Tries to exchange each selected effect for a better one beside the rest.
    fn exchange(&mut self) {
        for position in 0..self.chosen.len().saturating_sub(1) {
            let mut others: Vec<CandidateFit> = self.chosen.clone();
            others.remove(position);
            let without = refit(&self.rows, self.kind, others, self.library);
            let rows = &without.rows;
            let scorer = Scorer::new(&without.base, self.scale);
            let best = best_of_each(&scorer.scan(self.library, rows), self.library);
            let present = self.chosen[position].candidate;
            let own = best.iter().find(|t| t.candidate == present).map_or(0.0, |t| t.score);
            let challenger = best
                .iter()
                .filter(|t| !self.chosen.iter().any(|c| c.candidate == t.candidate))
                .max_by(|a, b| a.score.total_cmp(&b.score));
            if let Some(c) = challenger {
                let refined = scorer.refine(c, self.library, rows);
                // The present one is seen from the base beside all of them.
                let seen = self.chosen[position].clone().seen_from(self.rows.clone());
                let (mine, _) = scorer.left_under(&seen, self.library, rows, refined.prior);
                // It must leave clearly less than the present one does.
                if refined.score > own + LEAST_SCORE && refined.before - refined.gain < EXCHANGE_LEAVES * mine
                {
                    let selected = &mut self.selected[position];
                    selected.competitors.retain(|r| r.0 != refined.candidate);
                    selected.competitors.insert(0, (present, CONFUSABLE, 0.0));
                    selected.fit = refined.clone();
                    self.chosen[position] = refined;
                }
            }
            self.joined(refit(&without.rows, self.kind, self.chosen.clone(), self.library));
        }
        let rms = self.joint.rms(&self.rows);
        for t in &mut self.selected {
            t.rms = rms;
        }
    }

    /// The selection, without effects whose amplitudes the joint fit set to zero.
    fn end(mut self) -> Selection {
        let all = self.chosen.len();
        (self.chosen, self.selected) = std::mem::take(&mut self.chosen)
            .into_iter()
            .zip(std::mem::take(&mut self.selected))
            .filter(|(c, _)| c.amplitudes.iter().any(|a| *a != 0.0))
            .unzip();
        if self.chosen.len() < all {
            self.joined(refit(&self.rows, self.kind, self.chosen.clone(), self.library));
        }
        for (t, c) in self.selected.iter_mut().zip(&self.chosen) {
            t.fit.amplitudes.clone_from(&c.amplitudes);
            t.fit.shapes.clone_from(&c.shapes);
            t.fit.about.clone_from(&c.about);
        }
        let (first_scan, first_p) = self.first_scan.unwrap_or_default();
        let Self { rows, base_alone, joint, selected, excess_energy, traces, noise, remarks, .. } = self;
        Selection {
            rows,
            base_alone,
            joint,
            selected,
            first_scan,
            first_p,
            excess_energy,
            traces,
            noise,
            remarks,
        }
    }
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::candidates::library;
    use crate::rows::{prepare, typical_step};
    use crate::tests::{coloured, geometry, held_length, loops, recorded};
    use pam_data::recording::Campaign;

    /// Shows a selection before its first effect, with the best fit of each candidate.
    fn first_step(campaign: &Campaign, shown: impl Fn(&ForwardSelection<'_>, &[CandidateFit], &Scorer<'_>)) {
        let (rows, _) = prepare(campaign, &geometry().build().expect("a braid")).expect("rows");
        let library = library(&rows, &[]);
        let blocked = rows.force.iter().copied().fold(0.0, f64::max);
        let search = ForwardSelection::begin(&rows, &library, blocked, typical_step(&rows), &[]);
        let scorer = Scorer::new(&search.joint, search.scale);
        let (best, _) = scan_step(&library, &search.rows, &scorer, blocked, &[]);
        shown(&search, &best, &scorer);
    }

    fn named<'a>(search: &ForwardSelection<'_>, best: &'a [CandidateFit], name: &str) -> &'a CandidateFit {
        best.iter().find(|t| search.library[t.candidate].name() == name).expect("a fit")
    }

    #[test]
    fn a_refused_candidate_leaves_the_effects_before_it_as_they_were() {
        let campaign = recorded(loops(&[0.05, 0.2, 0.8]), 4, coloured(0.1, 2.0), |v, _, _| -5.0e3 * v);
        let braid = geometry().build().expect("a braid");
        let (rows, _) = prepare(&campaign, &braid).expect("rows");
        let library = library(&rows, &[]);
        let blocked = rows.force.iter().copied().fold(0.0, f64::max);
        let mut search = ForwardSelection::begin(&rows, &library, blocked, typical_step(&rows), &[]);
        while search.chosen.is_empty() && search.next().is_continue() {}
        let fitted = |search: &ForwardSelection<'_>| -> Vec<Vec<f64>> {
            search.chosen.iter().map(|c| c.amplitudes.clone()).collect()
        };
        let before = fitted(&search);
        assert_eq!(before.len(), 1);
        // Whatever takes most of the rest, without evidence.
        let scorer = Scorer::new(&search.joint, search.scale);
        let (best, _) = scan_step(&library, &search.rows, &scorer, blocked, &search.chosen);
        let others = best.iter().filter(|t| t.candidate != search.chosen[0].candidate);
        let most = others.max_by(|a, b| a.gain.total_cmp(&b.gain)).expect("another candidate");
        let weak = CandidateFit { score: 0.0, ..most.clone() };
        let refused = weak.candidate;
        let weak = search.with_competitors(weak, 1.0, &[], &scorer);
        search.take(vec![weak]);
        assert!(search.excluded.contains(&refused));
        assert_eq!(fitted(&search), before);
    }

    #[test]
    fn at_one_held_length_no_effect_that_a_wrong_description_imitates_is_selectable() {
        let campaigns = [
            (held_length::recorded_with_strands(30e3, 0.0, 6), false),
            (held_length::at_three_lengths(0.0, 6), true),
        ];
        for (campaign, selectable) in campaigns {
            first_step(&campaign, |search, best, scorer| {
                for name in ["force-gain", "gauge-gain"] {
                    let beyond = CandidateFit { beyond_tables: 1.0, ..named(search, best, name).clone() };
                    let is = is_selectable(&beyond, search.library, &search.rows, scorer);
                    assert_eq!(is, selectable, "{name}");
                }
            });
        }
    }

    #[test]
    fn a_drag_gives_way_to_a_constant_friction_that_explains_the_same_at_one_speed_only() {
        for (speeds, drag_stays) in [(&[0.2][..], false), (&[0.05, 0.2, 0.8], true)] {
            let campaign = recorded(loops(speeds), 4, coloured(0.1, 2.0), |v, _, _| -8.0e3 * v);
            first_step(&campaign, |search, best, scorer| {
                let drag = named(search, best, "viscous-damping");
                let supported = search.best_supported(drag, best, scorer);
                let is_drag = supported.candidate == drag.candidate;
                assert_eq!(is_drag, drag_stays, "{}", search.library[supported.candidate].name());
            });
        }
    }
}
