//! The report of a set as Markdown: the figures by protocol, tables by class and effect, and a list of every failure.

use crate::comparison::{self, Comparison};
use crate::figures::{Figures, Scored, big_and_visible};
use crate::limits::said;
use crate::names::{CLASSES, class};
use crate::rate::{Median, Rate};
use crate::score::{Interval, Outcome};
use crate::selective_risk;
use crate::spec::Stratum;
use std::collections::BTreeMap;
use std::fmt::Write as _;

type Row = (&'static str, &'static str, fn(&Figures) -> String);

const LINES: [Row; 36] = [
    ("False alarms, clean nulls", "0", |f| f.false_alarms_clean.to_string()),
    ("False alarms, nasty nulls", "0", |f| f.false_alarms_nasty.to_string()),
    ("Nulls not called consistent", "", |f| f.nulls_not_consistent.to_string()),
    ("Detected (visible, ≥ 2 %)", "", |f| f.noticed.to_string()),
    ("Exact name first", "≥ 75 % on A, ≥ 80 % on D, ≥ 85 % on C", |f| f.exact.to_string()),
    ("Class right", "≥ 80 % on A, ≥ 92 % on D and C", |f| f.class_right.to_string()),
    ("Class right, of those named", "", |f| f.class_right_when_named.to_string()),
    ("Truth in the reported set", "≥ 95 %", |f| f.in_set.to_string()),
    ("Mean size of the set", "≤ 4 on A, ≤ 2.5 on D, ≤ 2 on C", |f| format!("{:.1}", f.set_size)),
    ("Exact name, all single effects", "", |f| f.exact_all.to_string()),
    ("Invisible effects named wrongly", "", |f| f.invisible_wrong.to_string()),
    ("Pairs, one class right", "", |f| f.pair_one_right.to_string()),
    ("Pairs, both classes right", "≥ 75 %", |f| f.pair_both_right.to_string()),
    ("Triples, two classes right", "", |f| f.triple_two_right.to_string()),
    ("Triples, all three classes right", "≥ 50 %", |f| f.triple_all_right.to_string()),
    ("Outside the library, confident name", "≤ 5 %", |f| f.outside_confident.to_string()),
    ("Outside the library, nothing named", "", |f| f.outside_silent.to_string()),
    ("Concealed effect in the set or admitted as possible", "≥ 90 %", |f| f.concealed_admitted.to_string()),
    ("… with a proposed remedy", "≥ 90 %", |f| f.concealed_advised.to_string()),
    ("Detected in half of the trials from, % of blocked force", "", |f| size(f.detection.map(|l| l.half))),
    ("Detected in nine tenths from, %", "", |f| size(f.detection.map(|l| l.nine_tenths))),
    ("Class right in half of the trials from, %", "", |f| size(f.naming.map(|l| l.half))),
    ("Class right in nine tenths from, %", "", |f| size(f.naming.map(|l| l.nine_tenths))),
    ("Region is on the effect", "", |f| f.located.to_string()),
    ("Region overlaps the true one by more than half", "", |f| f.overlapping.to_string()),
    ("Mean overlap of regions", "", |f| format!("{:.2}", f.overlap)),
    ("Parameter intervals that contain the truth", "90–98 %", |f| f.parameters.to_string()),
    ("Calibration error", "≤ 0.06", |f| {
        f.of_names(format!("{:.3} of {}", f.calibration_error, f.probabilities))
    }),
    ("… by class", "", |f| f.of_names(format!("{:.3}", f.calibration_error_class))),
    ("Brier score", "", |f| f.of_names(format!("{:.3}", f.brier))),
    ("Log score", "", |f| f.of_names(format!("{:.3}", f.log_score))),
    ("Median held-out gain, as a share of the oracle's", "≥ 0.9", |f| f.gain.to_string()),
    ("… effects for which the oracle removes less than a tenth of the held-out error", "", |f| {
        f.oracle_idle.to_string()
    }),
    ("Stricter: median gain against the muscle without the effect", "", |f| f.gain_against_twin.to_string()),
    ("… the oracle's gain by this measure", "", |f| f.oracle_against_twin.to_string()),
    ("Diagnosed table worse than the plain one", "≤ 1 %", |f| f.harmed.to_string()),
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
pub fn markdown(title: &str, all: &[Scored], comparison: &Comparison) -> String {
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
        // A set of one kind of trial has no figures for the others.
        if cells.iter().any(|c| c != "–" && c != "NaN") {
            let _ = writeln!(m, "| {what} | {bound} | {} |", cells.join(" | "));
        }
    }
    let seconds: Vec<f64> = all.iter().map(|s| s.0.seconds).collect();
    let longest = seconds.iter().copied().fold(0.0, f64::max);
    let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
    let _ = writeln!(m, "\nTime of an answer: {mean:.1} s on average, {longest:.1} s at most.\n");
    if all.iter().all(|s| s.0.truth.is_empty()) {
        return m;
    }
    m.push_str(
        "## Detection by size (single effects)\n\n| size, % of blocked force | detected |\n| --- | --- |\n",
    );
    for (a, b, rate) in detection(all) {
        let _ = writeln!(m, "| {a} to {b} | {rate} |");
    }
    comparison::write(&mut m, comparison, &columns[0].1);
    m.push_str("\n## Calibration: stated probability and frequency\n\n| mean stated probability | exact | right class | names |\n| --- | --- | --- | --- |\n");
    for (stated, exact, near, n) in &columns[0].1.reliability {
        let _ = writeln!(m, "| {stated:.2} | {exact:.2} | {near:.2} | {n} |");
    }
    selective_risk::write(&mut m, &all.iter().map(|s| &s.0).collect::<Vec<_>>());
    m.push_str("\n## By class (single and decoy, 2 % and more, visible)\n\n| hidden class | detected | class right | classes named first |\n| --- | --- | --- | --- |\n");
    let judged: Vec<&Outcome> = all.iter().map(|s| &s.0).filter(|o| big_and_visible(o)).collect();
    let mut classes: Vec<&str> = judged.iter().filter_map(|o| o.truth.first()).map(|t| class(&t.0)).collect();
    // The registered classes first, in their order, then the effects without a class.
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
    m.push_str("\n## Every failure\n\n| trial | stratum | protocol | hidden | verdict | named | reason |\n| --- | --- | --- | --- | --- | --- | --- |\n");
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
        "\n## Parameters\n\n| parameter | intervals that contain the truth | median error | median half-width of the interval | errors, in \
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
