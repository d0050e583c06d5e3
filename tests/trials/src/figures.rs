//! The figures of a set: rates, detection limits, calibration, and gains.

use crate::fitted::HeldOut;
use crate::limits::{Limit, limit};
use crate::locate::Located;
use crate::names::{Owner, class, owner};
use crate::rate::{Median, Rate};
use crate::score::{Interval, Outcome};
use crate::spec::Stratum;
use serde::Serialize;

/// A tenth of stated probability: stated, exact, right class, how many.
pub type Bin = (f64, f64, f64, usize);

/// Figures of one protocol, or of all.
#[derive(Debug, Clone, Serialize)]
pub struct Figures {
    /// Names given to clean nulls.
    pub false_alarms_clean: Rate,
    /// Names given to nasty nulls.
    pub false_alarms_nasty: Rate,
    /// Nulls that were not called consistent, named or not.
    pub nulls_not_consistent: Rate,
    /// Visible effects of 2 % and more (single and decoy) that were noticed at all.
    pub noticed: Rate,
    /// … whose first name is exact.
    pub exact: Rate,
    /// … whose first name is of the right class.
    pub class_right: Rate,
    /// … among those that were named: right class.
    pub class_right_when_named: Rate,
    /// … the truth in the set, when something was named.
    pub in_set: Rate,
    /// Mean size of the set, when something was named.
    pub set_size: f64,
    /// The same, all sizes and all single effects, visible or not: exact names.
    pub exact_all: Rate,
    /// Invisible effects: wrong names given.
    pub invisible_wrong: Rate,
    /// Pairs: at least one class right among the names.
    pub pair_one_right: Rate,
    /// Pairs: both classes right.
    pub pair_both_right: Rate,
    /// Triples: at least two classes right.
    pub triple_two_right: Rate,
    /// Triples: all three classes right.
    pub triple_all_right: Rate,
    /// Outside the library: named with more than 0.8.
    pub outside_confident: Rate,
    /// Outside the library: nothing named.
    pub outside_silent: Rate,
    /// Regions that agree with the effect's.
    pub located: Rate,
    /// Regions whose overlap with the true one is more than half.
    pub overlapping: Rate,
    /// Mean overlap of regions, rows in both over rows in either.
    pub overlap: f64,
    /// Sizes noticed in half and in nine tenths of the single effects.
    pub detection: Option<Limit>,
    /// Sizes named by the right class in half and in nine tenths.
    pub naming: Option<Limit>,
    /// Concealed effects that are in the set, or are reported as possible unseen.
    pub concealed_admitted: Rate,
    /// … and for which the answer states what to do.
    pub concealed_advised: Rate,
    /// Stated 95 % intervals that hold.
    pub parameters: Rate,
    /// Expected calibration error of the probabilities (ten bins), of exact names.
    pub calibration_error: f64,
    /// Calibration error where a name counts as right when its class is.
    pub calibration_error_class: f64,
    /// Brier score of exact names.
    pub brier: f64,
    /// Mean of −ln of the probability given to what turned out, exact names.
    pub log_score: f64,
    /// Per tenth of stated probability: mean stated, share that was exact, share of the right class, how many.
    pub reliability: Vec<Bin>,
    /// How many probabilities that is.
    pub probabilities: usize,
    /// Median gain on held-out recordings against the true structure refitted, visible effects of the muscle.
    pub gain: Median,
    /// The same against the muscle without the effect.
    pub gain_against_twin: Median,
    /// What the true structure refitted gains of that.
    pub oracle_against_twin: Median,
    /// Visible effects of the muscle of which the true structure, refitted, takes less than a tenth of the held-out error.
    pub oracle_idle: Rate,
    /// Diagnosed tables that predict worse than plain ones.
    pub harmed: Rate,
}

/// One row per trial: what it showed, and its held-out errors where they could be had.
pub type Scored = (Outcome, Option<HeldOut>);

/// Single effects and decoys of 2 % and more that a stiff base does not absorb: what naming is judged on.
pub fn big_and_visible(o: &Outcome) -> bool {
    matches!(o.stratum, Stratum::Single | Stratum::Decoy) && o.visible && o.amplitude_pct >= 2.0
}

fn null(o: &Outcome) -> bool {
    matches!(o.stratum, Stratum::NullClean | Stratum::NullNasty)
}

impl Figures {
    /// A figure that only names have; a dash where nothing was named.
    pub fn of_names(&self, figure: String) -> String {
        if self.probabilities > 0 { figure } else { "–".into() }
    }

    /// Of some trials.
    pub fn of(all: &[&Scored]) -> Self {
        let it = || all.iter().map(|s| &s.0);
        let named = |o: &&Outcome| !o.named.is_empty();
        let right_classes = |o: &Outcome| {
            let said: Vec<&str> = o.named.iter().map(|n| class(&n.0)).collect();
            o.truth.iter().filter(|t| said.contains(&class(&t.0))).count()
        };
        let (mut bins, mut brier, mut log_score, mut count) =
            ([(0.0, 0.0, 0.0, 0usize); 10], 0.0, 0.0, 0usize);
        for o in it() {
            for (name, p) in &o.named {
                let hit = f64::from(o.truth.iter().any(|t| t.0 == *name));
                let near = f64::from(o.truth.iter().any(|t| class(&t.0) == class(name)));
                let b = &mut bins[((p * 10.0) as usize).min(9)];
                *b = (b.0 + p, b.1 + hit, b.2 + near, b.3 + 1);
                brier += (p - hit) * (p - hit);
                log_score -= (if hit > 0.5 { *p } else { 1.0 - p }).max(1e-3).ln();
                count += 1;
            }
        }
        let error = |of: &dyn Fn(&Bin) -> f64| {
            bins.iter().map(|b| (b.0 - of(b)).abs()).sum::<f64>() / count.max(1) as f64
        };
        let per = |v: f64, n: usize| v / n.max(1) as f64;
        let reliability: Vec<Bin> = bins
            .iter()
            .filter(|b| b.3 > 0)
            .map(|b| (per(b.0, b.3), per(b.1, b.3), per(b.2, b.3), b.3))
            .collect();
        let sizes = |right: &dyn Fn(&Outcome) -> bool| {
            let singles = it().filter(|o| o.stratum == Stratum::Single);
            limit(&singles.map(|o| (o.amplitude_pct, right(o))).collect::<Vec<_>>())
        };
        let regions: Vec<Located> = it().filter_map(|o| o.located).collect();
        let held: Vec<HeldOut> = all
            .iter()
            .filter(|s| s.0.visible && s.0.truth.iter().all(|t| owner(&t.0) == Some(Owner::Muscle)))
            .filter(|s| s.0.stratum != Stratum::Outside)
            .filter_map(|s| s.1)
            .collect();
        let median = |of: &dyn Fn(&HeldOut) -> Option<f64>| Median::of(held.iter().filter_map(of).collect());
        let with_oracle = held.iter().filter(|h| h.oracle.is_some()).count();
        let with_tables: Vec<&&Scored> = all.iter().filter(|s| s.1.is_some()).collect();
        let harmed = with_tables.iter().filter(|s| s.1.is_some_and(|h| h.harmed())).count();
        let intervals: Vec<&Interval> = it().flat_map(|o| &o.intervals).collect();
        let sets: Vec<usize> = it().filter(|o| big_and_visible(o) && named(o)).map(|o| o.set.len()).collect();
        Self {
            false_alarms_clean: Rate::of(it().filter(|o| o.stratum == Stratum::NullClean), |o| {
                !o.named.is_empty()
            }),
            false_alarms_nasty: Rate::of(it().filter(|o| o.stratum == Stratum::NullNasty), |o| {
                !o.named.is_empty()
            }),
            nulls_not_consistent: Rate::of(it().filter(|o| null(o)), |o| o.verdict != "consistent"),
            noticed: Rate::of(it().filter(|o| big_and_visible(o)), |o| o.alarmed),
            exact: Rate::of(it().filter(|o| big_and_visible(o)), |o| o.exact),
            class_right: Rate::of(it().filter(|o| big_and_visible(o)), |o| o.class_right),
            class_right_when_named: Rate::of(it().filter(|o| big_and_visible(o) && named(o)), |o| {
                o.class_right
            }),
            in_set: Rate::of(it().filter(|o| big_and_visible(o) && named(o)), |o| o.in_set),
            set_size: sets.iter().sum::<usize>() as f64 / sets.len() as f64,
            exact_all: Rate::of(it().filter(|o| o.stratum == Stratum::Single), |o| o.exact),
            invisible_wrong: Rate::of(it().filter(|o| o.stratum == Stratum::Single && !o.visible), |o| {
                !o.named.is_empty() && !o.class_right
            }),
            pair_one_right: Rate::of(it().filter(|o| o.stratum == Stratum::Pair), |o| right_classes(o) >= 1),
            pair_both_right: Rate::of(it().filter(|o| o.stratum == Stratum::Pair), |o| {
                right_classes(o) == o.truth.len()
            }),
            triple_two_right: Rate::of(it().filter(|o| o.stratum == Stratum::Triple), |o| {
                right_classes(o) >= 2
            }),
            triple_all_right: Rate::of(it().filter(|o| o.stratum == Stratum::Triple), |o| {
                right_classes(o) == o.truth.len()
            }),
            outside_confident: Rate::of(it().filter(|o| o.stratum == Stratum::Outside), |o| {
                o.named.iter().any(|n| n.1 > 0.8)
            }),
            outside_silent: Rate::of(it().filter(|o| o.stratum == Stratum::Outside), |o| o.named.is_empty()),
            located: Rate::new(regions.iter().filter(|l| l.dense).count(), regions.len()),
            overlapping: Rate::new(regions.iter().filter(|l| l.overlap > 0.5).count(), regions.len()),
            overlap: regions.iter().map(|l| l.overlap).sum::<f64>() / regions.len() as f64,
            detection: sizes(&|o| o.alarmed),
            naming: sizes(&|o| o.class_right),
            concealed_admitted: Rate::of(it().filter(|o| o.concealed.is_some()), |o| {
                o.concealed.is_some_and(|c| c.admitted)
            }),
            concealed_advised: Rate::of(it().filter(|o| o.concealed.is_some()), |o| {
                o.concealed.is_some_and(|c| c.advised)
            }),
            parameters: Rate::new(intervals.iter().filter(|i| i.holds()).count(), intervals.len()),
            calibration_error: error(&|b| b.1),
            calibration_error_class: error(&|b| b.2),
            brier: per(brier, count),
            log_score: per(log_score, count),
            reliability,
            probabilities: count,
            gain: median(&|h| h.gain()),
            gain_against_twin: median(&|h| h.gain_against_twin()),
            oracle_against_twin: median(&|h| h.oracle_against_twin()),
            oracle_idle: Rate::new(
                with_oracle - held.iter().filter(|h| h.gain().is_some()).count(),
                with_oracle,
            ),
            harmed: Rate::new(harmed, with_tables.len()),
        }
    }
}
