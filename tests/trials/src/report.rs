//! The set's figures: rates with exact intervals, calibration, gains, and every failure by itself; Markdown and JSON.

use crate::clopper::interval;
use crate::fitted::HeldOut;
use crate::names::{Owner, class, owner};
use crate::score::Outcome;
use crate::spec::Stratum;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// `k` of `n` with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// How many.
    pub k: usize,
    /// Of how many.
    pub n: usize,
    /// Clopper–Pearson.
    pub interval: (f64, f64),
}

impl Rate {
    /// `k` of `n`.
    pub fn new(k: usize, n: usize) -> Self {
        Self { k, n, interval: interval(k, n) }
    }

    fn of<'a>(items: impl Iterator<Item = &'a Outcome>, right: impl Fn(&Outcome) -> bool) -> Self {
        let (mut k, mut n) = (0, 0);
        for o in items {
            n += 1;
            k += usize::from(right(o));
        }
        Self::new(k, n)
    }

    /// The rate itself; NaN of nothing.
    pub fn value(&self) -> f64 {
        self.k as f64 / self.n as f64
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.n == 0 {
            return write!(f, "–");
        }
        let (a, b) = self.interval;
        write!(
            f,
            "{} of {} = {:.0} % ({:.0}–{:.0})",
            self.k,
            self.n,
            100.0 * self.value(),
            100.0 * a,
            100.0 * b
        )
    }
}

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
    /// Outside the library: named with more than 0.8.
    pub outside_confident: Rate,
    /// Outside the library: nothing named.
    pub outside_silent: Rate,
    /// Regions that sit where the effect is.
    pub located: Rate,
    /// Stated 95 % intervals that hold.
    pub parameters: Rate,
    /// Expected calibration error of the probabilities (ten bins), of exact names.
    pub calibration_error: f64,
    /// Brier score of the same.
    pub brier: f64,
    /// How many probabilities that is.
    pub probabilities: usize,
    /// Median gain on held-out recordings against the twin, effects of the muscle where a gain is possible.
    pub median_gain: f64,
    /// How many gains that is.
    pub gains: usize,
    /// Diagnosed tables that predict worse than plain ones.
    pub harmed: Rate,
}

/// One row per trial: what it showed, and its held-out errors where they could be had.
pub type Scored = (Outcome, Option<HeldOut>);

/// Single effects and decoys of 2 % and more that a stiff base does not swallow: what naming is judged on.
pub fn big_and_visible(o: &Outcome) -> bool {
    matches!(o.stratum, Stratum::Single | Stratum::Decoy) && o.visible && o.amplitude_pct >= 2.0
}

fn null(o: &Outcome) -> bool {
    matches!(o.stratum, Stratum::NullClean | Stratum::NullNasty)
}

impl Figures {
    /// Of some trials.
    pub fn of(all: &[&Scored]) -> Self {
        let it = || all.iter().map(|s| &s.0);
        let named = |o: &&Outcome| !o.named.is_empty();
        let right_classes = |o: &Outcome| {
            let said: Vec<&str> = o.named.iter().map(|n| class(&n.0)).collect();
            o.truth.iter().filter(|t| said.contains(&class(&t.0))).count()
        };
        let (mut bins, mut brier, mut count) = ([(0.0, 0.0, 0usize); 10], 0.0, 0usize);
        for o in it() {
            for (name, p) in &o.named {
                let hit = f64::from(o.truth.iter().any(|t| t.0 == *name));
                let b = &mut bins[((p * 10.0) as usize).min(9)];
                *b = (b.0 + p, b.1 + hit, b.2 + 1);
                brier += (p - hit) * (p - hit);
                count += 1;
            }
        }
        let calibration = bins.iter().map(|b| (b.0 - b.1).abs()).sum::<f64>() / count.max(1) as f64;
        let mut gains: Vec<f64> = all
            .iter()
            .filter(|s| s.0.visible && s.0.truth.iter().all(|t| owner(&t.0) == Some(Owner::Muscle)))
            .filter(|s| s.0.stratum != Stratum::Outside)
            .filter_map(|s| s.1.and_then(|h| h.gain()))
            .collect();
        gains.sort_by(f64::total_cmp);
        let with_tables: Vec<&&Scored> = all.iter().filter(|s| s.1.is_some()).collect();
        let harmed = with_tables.iter().filter(|s| s.1.is_some_and(|h| h.harmed())).count();
        let covered = it().fold((0, 0), |a, o| (a.0 + o.covered.0, a.1 + o.covered.1));
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
            outside_confident: Rate::of(it().filter(|o| o.stratum == Stratum::Outside), |o| {
                o.named.iter().any(|n| n.1 > 0.8)
            }),
            outside_silent: Rate::of(it().filter(|o| o.stratum == Stratum::Outside), |o| o.named.is_empty()),
            located: Rate::of(it().filter(|o| o.located.is_some()), |o| o.located == Some(true)),
            parameters: Rate::new(covered.0, covered.1),
            calibration_error: calibration,
            brier: brier / count.max(1) as f64,
            probabilities: count,
            median_gain: gains.get(gains.len() / 2).copied().unwrap_or(f64::NAN),
            gains: gains.len(),
            harmed: Rate::new(harmed, with_tables.len()),
        }
    }
}

type Line = (&'static str, &'static str, fn(&Figures) -> String);

const LINES: [Line; 22] = [
    ("False alarms, clean nulls", "≤ 3 of 60 together", |f| f.false_alarms_clean.to_string()),
    ("False alarms, nasty nulls", "", |f| f.false_alarms_nasty.to_string()),
    ("Nulls not called consistent", "", |f| f.nulls_not_consistent.to_string()),
    ("Noticed (visible, ≥ 2 %)", "", |f| f.noticed.to_string()),
    ("Exact name first", "", |f| f.exact.to_string()),
    ("Class right", "≥ 80 % on A, ≥ 92 % on D and C", |f| f.class_right.to_string()),
    ("Class right, of those named", "", |f| f.class_right_when_named.to_string()),
    ("Truth in the reported set", "≥ 95 %", |f| f.in_set.to_string()),
    ("Mean size of the set", "≤ 4 on A, ≤ 2.5 on D, ≤ 2 on C", |f| format!("{:.1}", f.set_size)),
    ("Exact name, all single effects", "", |f| f.exact_all.to_string()),
    ("Invisible effects named wrongly", "", |f| f.invisible_wrong.to_string()),
    ("Pairs, one class right", "", |f| f.pair_one_right.to_string()),
    ("Pairs, both classes right", "", |f| f.pair_both_right.to_string()),
    ("Outside the library, confident name", "≤ 5 %", |f| f.outside_confident.to_string()),
    ("Outside the library, nothing named", "", |f| f.outside_silent.to_string()),
    ("Region sits on the effect", "", |f| f.located.to_string()),
    ("Parameter intervals that hold", "90–98 %", |f| f.parameters.to_string()),
    ("Calibration error", "≤ 0.08", |f| format!("{:.3} of {}", f.calibration_error, f.probabilities)),
    ("Brier score", "", |f| format!("{:.3}", f.brier)),
    ("Median held-out gain", "≥ 0.9", |f| format!("{:.2} of {}", f.median_gain, f.gains)),
    ("Harmed", "≤ 3 %", |f| f.harmed.to_string()),
    ("Probabilities given", "", |f| f.probabilities.to_string()),
];

/// Detection against size: (from %, to %, rate of visible and invisible singles that were noticed).
pub fn detection(all: &[Scored]) -> Vec<(f64, f64, Rate)> {
    [(0.0, 0.6), (0.6, 1.2), (1.2, 2.5), (2.5, 5.0), (5.0, 100.0)]
        .iter()
        .map(|&(a, b)| {
            let rate = Rate::of(
                all.iter()
                    .map(|s| &s.0)
                    .filter(|o| o.stratum == Stratum::Single && (a..b).contains(&o.amplitude_pct)),
                |o| o.alarmed,
            );
            (a, b, rate)
        })
        .collect()
}

/// The report as Markdown.
pub fn markdown(title: &str, all: &[Scored], baselines: &[(String, Rate, Rate)]) -> String {
    let mut m = format!("# {title}\n\nWritten by `trials score`; nothing here is typed by hand.\n\n");
    let every: Vec<&Scored> = all.iter().collect();
    let mut columns = vec![("all", Figures::of(&every))];
    for p in ["A", "D", "C"] {
        let some: Vec<&Scored> = all.iter().filter(|s| s.0.protocol == p).collect();
        columns.push((p, Figures::of(&some)));
    }
    let _ = writeln!(m, "| | bound | {} |", columns.iter().map(|c| c.0).collect::<Vec<_>>().join(" | "));
    let _ = writeln!(m, "| --- | --- |{}", " --- |".repeat(columns.len()));
    for (what, bound, show) in LINES {
        let cells: Vec<String> = columns.iter().map(|c| show(&c.1)).collect();
        let _ = writeln!(m, "| {what} | {bound} | {} |", cells.join(" | "));
    }
    let seconds: Vec<f64> = all.iter().map(|s| s.0.seconds).collect();
    let longest = seconds.iter().copied().fold(0.0, f64::max);
    let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
    let _ = writeln!(m, "\nTime of an answer: {mean:.1} s on average, {longest:.1} s at most.\n");
    m.push_str(
        "## Noticed against size (single effects)\n\n| size, % of blocked force | noticed |\n| --- | --- |\n",
    );
    for (a, b, rate) in detection(all) {
        let _ = writeln!(m, "| {a} to {b} | {rate} |");
    }
    m.push_str("\n## Beside simpler methods (visible effects of 2 % and more)\n\n| method | exact | class |\n| --- | --- | --- |\n");
    let _ = writeln!(m, "| this tool | {} | {} |", columns[0].1.exact, columns[0].1.class_right);
    for (name, exact, class) in baselines {
        let _ = writeln!(m, "| {name} | {exact} | {class} |");
    }
    m.push_str("\n## By effect (single, visible, any size)\n\n| effect | trials | exact | class | named instead |\n| --- | --- | --- | --- | --- |\n");
    let mut by: BTreeMap<&str, Vec<&Outcome>> = BTreeMap::new();
    for o in all.iter().map(|s| &s.0).filter(|o| o.stratum == Stratum::Single && o.visible) {
        by.entry(o.truth.first().map_or("", |t| t.0.as_str())).or_default().push(o);
    }
    for (name, list) in by {
        let exact = list.iter().filter(|o| o.exact).count();
        let right = list.iter().filter(|o| o.class_right).count();
        let mut instead: Vec<&str> = list
            .iter()
            .filter(|o| !o.exact)
            .map(|o| o.named.first().map_or("nothing", |n| n.0.as_str()))
            .collect();
        instead.sort_unstable();
        let _ = writeln!(m, "| {name} | {} | {exact} | {right} | {} |", list.len(), instead.join(", "));
    }
    m.push_str("\n## Every failure\n\n| trial | stratum | protocol | hidden | verdict | named | why it is listed |\n| --- | --- | --- | --- | --- | --- | --- |\n");
    for o in all.iter().map(|s| &s.0) {
        if let Some(why) = o.failure() {
            let list = |l: &[(String, f64)], unit: &str| {
                l.iter().map(|x| format!("{} {:.2}{unit}", x.0, x.1)).collect::<Vec<_>>().join(", ")
            };
            let stratum = serde_json::to_string(&o.stratum).unwrap_or_default();
            let _ = writeln!(
                m,
                "| {} | {} | {} | {} | {} | {} | {why} |",
                o.id,
                stratum.trim_matches('"'),
                o.protocol,
                list(&o.truth, " %"),
                o.verdict.replace('|', "/"),
                list(&o.named, ""),
            );
        }
    }
    m
}
