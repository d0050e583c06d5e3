//! The set's figures: rates with exact intervals, calibration, gains, and a list of every failure; Markdown and JSON.

use crate::clopper::interval;
use crate::fitted::HeldOut;
use crate::limits::{Limit, limit, said};
use crate::locate::Located;
use crate::names::{CLASSES, Owner, class, owner};
use crate::score::{Interval, Outcome};
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

/// The middle of some values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Median {
    /// Itself; NaN of nothing.
    pub value: f64,
    /// Of how many.
    pub n: usize,
}

impl Median {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self { value: values.get(values.len() / 2).copied().unwrap_or(f64::NAN), n: values.len() }
    }
}

impl std::fmt::Display for Median {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.n == 0 { write!(f, "–") } else { write!(f, "{:.2} of {}", self.value, self.n) }
    }
}

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
    /// Concealed effects that are in the set, or are said to be possible unseen.
    pub concealed_admitted: Rate,
    /// … and of which it is said what to do.
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
        let told = held.iter().filter(|h| h.oracle.is_some()).count();
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
            oracle_idle: Rate::new(told - held.iter().filter(|h| h.gain().is_some()).count(), told),
            harmed: Rate::new(harmed, with_tables.len()),
        }
    }
}

type Line = (&'static str, &'static str, fn(&Figures) -> String);

const LINES: [Line; 34] = [
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
    ("Concealed effect in the set or admitted as possible", "≥ 90 %", |f| f.concealed_admitted.to_string()),
    ("… and told what to do about it", "≥ 90 %", |f| f.concealed_advised.to_string()),
    ("Noticed in half of the trials from, % of blocked force", "", |f| size(f.detection.map(|l| l.half))),
    ("Noticed in nine tenths from, %", "", |f| size(f.detection.map(|l| l.nine_tenths))),
    ("Class right in half of the trials from, %", "", |f| size(f.naming.map(|l| l.half))),
    ("Class right in nine tenths from, %", "", |f| size(f.naming.map(|l| l.nine_tenths))),
    ("Region is on the effect", "", |f| f.located.to_string()),
    ("Region overlaps the true one by more than half", "", |f| f.overlapping.to_string()),
    ("Mean overlap of regions", "", |f| format!("{:.2}", f.overlap)),
    ("Parameter intervals that hold", "90–98 %", |f| f.parameters.to_string()),
    ("Calibration error", "≤ 0.08", |f| format!("{:.3} of {}", f.calibration_error, f.probabilities)),
    ("… where the class counts", "", |f| format!("{:.3}", f.calibration_error_class)),
    ("Brier score", "", |f| format!("{:.3}", f.brier)),
    ("Log score", "", |f| format!("{:.3}", f.log_score)),
    ("Median held-out gain, of what the true structure refitted gains", "≥ 0.9", |f| f.gain.to_string()),
    (
        "… effects of which the true structure refitted takes less than a tenth of the held-out error",
        "",
        |f| f.oracle_idle.to_string(),
    ),
    ("Stricter: median gain against the muscle without the effect", "", |f| f.gain_against_twin.to_string()),
    ("… what the true structure refitted gains of that", "", |f| f.oracle_against_twin.to_string()),
    ("Harmed", "≤ 3 %", |f| f.harmed.to_string()),
];

fn size(of: Option<(f64, f64, f64)>) -> String {
    of.map_or("–".into(), |(at, low, high)| format!("{} ({}–{})", said(at), said(low), said(high)))
}

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
    m.push_str("\n## Calibration: stated probability against what turned out\n\n| stated, mean | exact | right class | names |\n| --- | --- | --- | --- |\n");
    for (stated, exact, near, n) in &columns[0].1.reliability {
        let _ = writeln!(m, "| {stated:.2} | {exact:.2} | {near:.2} | {n} |");
    }
    m.push_str("\n## Answers in order of their confidence (all trials with a name)\n\n| most confident | right class |\n| --- | --- |\n");
    let mut sure: Vec<&Outcome> = all.iter().map(|s| &s.0).filter(|o| !o.named.is_empty()).collect();
    sure.sort_by(|a, b| b.named[0].1.total_cmp(&a.named[0].1));
    for part in [0.25, 0.5, 0.75, 1.0] {
        let n = (sure.len() as f64 * part).round() as usize;
        let rate = Rate::of(sure.iter().take(n).copied(), |o| o.class_right);
        let _ = writeln!(m, "| {:.0} % | {rate} |", 100.0 * part);
    }
    m.push_str("\n## By class (single and decoy, 2 % and more, visible)\n\n| class hidden | noticed | class right | classes named first |\n| --- | --- | --- | --- |\n");
    let judged: Vec<&Outcome> = all.iter().map(|s| &s.0).filter(|o| big_and_visible(o)).collect();
    let mut classes: Vec<&str> = judged.iter().filter_map(|o| o.truth.first()).map(|t| class(&t.0)).collect();
    // The registered classes first, in their order, then what stands alone.
    classes.sort_by_key(|c| (CLASSES.iter().position(|r| r.0 == *c).unwrap_or(CLASSES.len()), *c));
    classes.dedup();
    for c in classes {
        let mine = || judged.iter().filter(|o| o.truth.first().is_some_and(|t| class(&t.0) == c)).copied();
        let mut said: BTreeMap<&str, usize> = BTreeMap::new();
        for o in mine() {
            *said.entry(o.named.first().map_or("nothing", |n| class(&n.0))).or_default() += 1;
        }
        let said: Vec<String> = said.iter().map(|(c, n)| format!("{c} {n}")).collect();
        let _ = writeln!(
            m,
            "| {c} | {} | {} | {} |",
            Rate::of(mine(), |o| o.alarmed),
            Rate::of(mine(), |o| o.class_right),
            said.join(", ")
        );
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
    parameters(&mut m, all);
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

/// How far stated parameters are off, by parameter.
fn parameters(m: &mut String, all: &[Scored]) {
    m.push_str(
        "\n## Parameters against the truth\n\n| parameter | intervals that hold | off by, median | interval's half, median | off by, in \
         stated standard deviations |\n| --- | --- | --- | --- | --- |\n",
    );
    let mut by: BTreeMap<&str, Vec<&Interval>> = BTreeMap::new();
    for i in all.iter().flat_map(|s| &s.0.intervals) {
        by.entry(&i.of).or_default().push(i);
    }
    for (of, list) in by {
        let middle =
            |value: &dyn Fn(&Interval) -> f64| Median::of(list.iter().map(|i| value(i)).collect()).value;
        let off = middle(&|i| 100.0 * (i.stated / i.truth - 1.0).abs());
        let half = middle(&|i| 196.0 * i.std / i.truth);
        let mut z: Vec<f64> = list.iter().map(|i| i.z()).collect();
        z.sort_by(f64::total_cmp);
        let z: Vec<String> = z.iter().map(|z| format!("{z:+.1}")).collect();
        let held = list.iter().filter(|i| i.holds()).count();
        let _ =
            writeln!(m, "| {of} | {held} of {} | {off:.1} % | ± {half:.1} % | {} |", list.len(), z.join(" "));
    }
}
