//! The page of the book: tests, results, and what is not tested.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write;
use std::time::Instant;

use pam_data::recording::Campaign;
use pam_diagnose::reference::{Against, Mounted, Options, compare};

use super::cylinder::Pair;
use super::injection::EFFECTS;
use super::staircases::{Half, Muscle, Run};
use super::{Trial, class};
use crate::binomial_interval::interval;

mod texts;

use texts::{
    BOUNDS, COMPARISON, CYLINDER, INJECTED, INTRODUCTION, TABLE_HEADER, TABLES, UNCHANGED, UNTESTED,
};

/// Rows of either side in the measurement of speed.
const SPEED_ROWS: usize = 30_000;

/// s for this many rows on each side, of the muscle with the most rows; `None` without recordings.
///
/// # Errors
/// A comparison without an answer.
pub fn speed(muscles: &[Muscle]) -> Result<Option<(usize, f64)>, Box<dyn Error>> {
    let rows = |m: &Muscle| m.between(1, m.runs).iter().map(|r| r.time.len()).sum::<usize>();
    let Some(muscle) = muscles.iter().max_by_key(|m| rows(m)) else { return Ok(None) };
    let runs = muscle.between(1, muscle.runs);
    let split = muscle.runs.div_ceil(2);
    // Rows are put between the recorded ones until there are enough.
    let side = |from: usize, to: usize| -> Campaign {
        let own: Vec<&Run> = runs.iter().filter(|r| r.run >= from && r.run <= to).collect();
        let have: usize = own.iter().map(|r| r.time.len()).sum();
        let factor = SPEED_ROWS.div_ceil(have.max(1));
        Campaign::new(own.iter().map(|r| finer(r, factor).recording()).collect())
    };
    let (before, after) = (side(1, split), side(split + 1, muscle.runs));
    let options = Options { mounted: Mounted::Same, ..Options::default() };
    let start = Instant::now();
    compare(&after, Against::Recordings(&before), &options).map_err(|e| e.to_string())?;
    Ok(Some((before.samples() + after.samples(), start.elapsed().as_secs_f64())))
}

fn finer(run: &Run, factor: usize) -> Run {
    let between = |column: &[f64]| -> Vec<f64> {
        let mut out: Vec<f64> = column
            .windows(2)
            .flat_map(|w| {
                (0..factor).map(|k| w[0] + (w[1] - w[0]) * k as f64 / factor as f64).collect::<Vec<_>>()
            })
            .collect();
        out.extend(column.last());
        out
    };
    Run {
        time: between(&run.time),
        pressure: between(&run.pressure),
        force: between(&run.force),
        ..run.clone()
    }
}

fn rate(k: usize, n: usize) -> String {
    let (low, high) = interval(k, n);
    if n == 0 {
        "–".into()
    } else {
        format!("{:.1} % ({:.0} to {:.0})", 100.0 * k as f64 / n as f64, 100.0 * low, 100.0 * high)
    }
}

fn right_class(t: &Trial) -> bool {
    t.effect.is_some_and(|e| class(&t.answer.top) == class(e))
}

fn size_of(t: &Trial) -> Option<(f64, f64)> {
    t.answer.named.iter().find(|n| Some(n.0.as_str()) == t.effect).map(|n| (n.1, n.2))
}

/// One line of the table over a selection of injected trials.
fn line(text: &mut String, label: &str, trials: &[&Trial]) {
    let n = trials.len();
    if n == 0 {
        return;
    }
    let count = |of: &dyn Fn(&&&Trial) -> bool| trials.iter().filter(of).count();
    let exact = count(&|t| t.effect == Some(t.answer.top.as_str()));
    let in_set = count(&|t| t.effect.is_some_and(|e| t.answer.set.iter().any(|s| s == e)));
    let missed = count(&|t| t.answer.top == "none");
    let false_name = count(&|t| t.answer.named.iter().any(|m| class(&m.0) != t.effect.and_then(class)));
    let sized: Vec<(f64, f64, f64)> =
        trials.iter().filter_map(|t| size_of(t).map(|(s, h)| (s, h, t.size))).collect();
    let within = sized.iter().filter(|(s, _, t)| (s.abs() / t.abs() - 1.0).abs() < 0.2).count();
    let covered = sized.iter().filter(|(s, h, t)| (s.abs() - t.abs()).abs() < *h).count();
    let set: usize = trials.iter().map(|t| t.answer.set.len()).sum();
    let _ = writeln!(
        text,
        "| {label} | {n} | {} | {} | {} | {:.2} | {} | {} | {} | {} |",
        rate(count(&|t| right_class(t)), n),
        rate(exact, n),
        rate(in_set, n),
        set as f64 / n as f64,
        rate(within, sized.len()),
        rate(covered, sized.len()),
        rate(missed, n),
        rate(false_name, n)
    );
}

fn injected(text: &mut String, trials: &[Trial]) {
    let _ = write!(text, "{INJECTED}");
    for half in [Half::Final, Half::Development] {
        let title = match half {
            Half::Final => "Muscles that were not used to choose constants",
            Half::Development => "Muscles that were used to choose constants",
        };
        let _ = write!(text, "\n### {title}\n\n{TABLE_HEADER}");
        for year in ["2021", "2022"] {
            for percent in [1.0, 2.0, 3.0, 5.0] {
                let some: Vec<&Trial> = trials
                    .iter()
                    .filter(|t| {
                        t.effect.is_some()
                            && t.half == half
                            && t.percent == percent
                            && t.muscle.starts_with(year)
                    })
                    .collect();
                line(text, &format!("{year}, {percent} %"), &some);
            }
        }
    }
    let _ = write!(text, "\n### By effect, final half, 3 %\n\n{TABLE_HEADER}");
    for effect in EFFECTS {
        let own = |t: &&Trial| t.effect == Some(effect) && t.half == Half::Final && t.percent == 3.0;
        line(text, effect, &trials.iter().filter(own).collect::<Vec<_>>());
    }
}

/// Bounds that were set in advance, and what was measured on all eleven muscles.
fn bounds(text: &mut String, trials: &[Trial], pairs: &[Pair], speed: Option<(usize, f64)>) {
    let at_three: Vec<&Trial> = trials.iter().filter(|t| t.effect.is_some() && t.percent == 3.0).collect();
    let n = at_three.len();
    let count = |of: &dyn Fn(&&&Trial) -> bool| at_three.iter().filter(of).count();
    let sized: Vec<f64> = at_three
        .iter()
        .filter_map(|t| size_of(t).map(|(s, _)| (s.abs() / t.size.abs() - 1.0).abs()))
        .collect();
    let same: Vec<&Trial> = trials.iter().filter(|t| t.effect.is_none()).collect();
    let named = same.iter().filter(|t| !t.answer.named.is_empty()).count();
    let (changed, reruns): (Vec<&Pair>, Vec<&Pair>) = pairs.iter().partition(|p| !p.known.is_empty());
    text.push_str("## Bounds and measurements\n\n| at 3 %, all muscles | bound | measured | |\n| --- | --- | --- | --- |\n");
    let mut row = |what: &str, bound: &str, (k, n): (usize, usize), met: bool| {
        let judged = if n == 0 {
            "not tested"
        } else if met {
            "met"
        } else {
            "**missed**"
        };
        let _ = writeln!(text, "| {what} | {bound} | {} | {judged} |", rate(k, n));
    };
    let share = |k: usize, n: usize| k as f64 / n.max(1) as f64;
    let class_right = count(&|t| right_class(t));
    row("class right", "≥ 85 %", (class_right, n), share(class_right, n) >= 0.85);
    let exact = count(&|t| t.effect == Some(t.answer.top.as_str()));
    row("exact", "≥ 75 %", (exact, n), share(exact, n) >= 0.75);
    let in_set = count(&|t| t.effect.is_some_and(|e| t.answer.set.iter().any(|s| s == e)));
    row("truth in the set", "≥ 95 %", (in_set, n), share(in_set, n) >= 0.95);
    let near = sized.iter().filter(|e| **e < 0.2).count();
    row("size within 20 %", "≥ 90 %", (near, sized.len()), share(near, sized.len()) >= 0.9);
    row("unchanged pairs named", "≤ 2 %", (named, same.len()), share(named, same.len()) <= 0.02);
    let right = changed.iter().filter(|p| p.right()).count();
    row(
        "seals: main class right, nothing false",
        "≥ 80 %",
        (right, changed.len()),
        share(right, changed.len()) >= 0.8,
    );
    let false_names = reruns.iter().filter(|p| !p.named.is_empty()).count();
    row("seals: reruns named", "0", (false_names, reruns.len()), false_names == 0);
    if let Some((rows, seconds)) = speed {
        let judged = if seconds <= 5.0 { "met" } else { "**missed**" };
        let _ = writeln!(text, "| speed, {rows} rows | ≤ 5 s | {seconds:.2} s | {judged} |");
    }
    below(text, &at_three);
}

/// Effects whose own rate lies below the bound of all of them.
fn below(text: &mut String, at_three: &[&Trial]) {
    let mut weak = Vec::new();
    for effect in EFFECTS {
        let own: Vec<&&Trial> = at_three.iter().filter(|t| t.effect == Some(effect)).collect();
        let right = own.iter().filter(|t| right_class(t)).count();
        if (right as f64) < 0.85 * own.len() as f64 {
            weak.push(format!("{effect} ({})", rate(right, own.len())));
        }
    }
    if !weak.is_empty() {
        let _ = writeln!(
            text,
            "\nBelow 85 % on their own: {}. Compliance of the rig shows where the force and its slope over the length are largest, in one or two \
             mountings. A name must hold when any single mounting is left out, so that a slipped mounting is not reported as a change of the \
             actuator. Compliance is then in the set, and not named.",
            weak.join(", ")
        );
    }
    text.push('\n');
}

/// The diagnosis compared with a simpler method on the same pairs.
fn comparison(text: &mut String, trials: &[Trial]) {
    let simple =
        |t: &Trial| t.effect.is_some_and(|e| class(&t.simple).is_some() && class(&t.simple) == class(e));
    let _ = writeln!(text, "\n{COMPARISON}| --- | --- | --- | --- | --- | --- |");
    for percent in [1.0, 2.0, 3.0, 5.0] {
        let own: Vec<&Trial> = trials.iter().filter(|t| t.effect.is_some() && t.percent == percent).collect();
        if own.is_empty() {
            continue;
        }
        let count = |of: &dyn Fn(&Trial) -> bool| own.iter().filter(|t| of(t)).count();
        let n = own.len();
        let _ = writeln!(
            text,
            "| {percent} % | {n} | {} | {} | {} | {} |",
            rate(count(&right_class), n),
            rate(count(&simple), n),
            count(&|t| right_class(t) && !simple(t)),
            count(&|t| !right_class(t) && simple(t))
        );
    }
    let same: Vec<&Trial> = trials.iter().filter(|t| t.effect.is_none()).collect();
    let named = same.iter().filter(|t| !t.answer.named.is_empty()).count();
    let by_bic = same.iter().filter(|t| t.simple != "none").count();
    let _ = writeln!(
        text,
        "\nUnchanged pairs named: {} by the diagnosis, {} by ΔBIC.",
        rate(named, same.len()),
        rate(by_bic, same.len())
    );
}

/// A table as the reference.
#[must_use]
pub fn tables(trials: &[Trial]) -> String {
    let mut text = String::new();
    if trials.is_empty() {
        return text;
    }
    let _ = write!(text, "\n{TABLES}{TABLE_HEADER}");
    for percent in [3.0, 5.0, 10.0] {
        let own: Vec<&Trial> = trials.iter().filter(|t| t.effect.is_some() && t.percent == percent).collect();
        line(&mut text, &format!("{percent} %"), &own);
    }
    let _ = write!(text, "\n### By effect, 5 and 10 %\n\n{TABLE_HEADER}");
    for effect in EFFECTS {
        let own = |t: &&Trial| t.effect == Some(effect) && t.percent >= 5.0;
        line(&mut text, effect, &trials.iter().filter(own).collect::<Vec<_>>());
    }
    let same: Vec<&Trial> = trials.iter().filter(|t| t.effect.is_none()).collect();
    let named = same.iter().filter(|t| !t.answer.named.is_empty()).count();
    let alarmed = same.iter().filter(|t| t.answer.none < 0.5).count();
    let _ = writeln!(
        text,
        "\nUnchanged windows of the later runs: named {}, probability of no change below one half {}.",
        rate(named, same.len()),
        rate(alarmed, same.len())
    );
    text
}

fn untouched(text: &mut String, trials: &[Trial]) {
    let _ = write!(text, "\n{UNCHANGED}| --- | --- | --- | --- |\n");
    let mut groups: BTreeMap<(Half, &str), Vec<&Trial>> = BTreeMap::new();
    for t in trials.iter().filter(|t| t.effect.is_none()) {
        groups.entry((t.half, &t.muscle[..4])).or_default().push(t);
    }
    let mut row = |label: &str, own: &[&Trial]| {
        let named = own.iter().filter(|t| !t.answer.named.is_empty()).count();
        let alarmed = own.iter().filter(|t| t.answer.none < 0.5).count();
        let n = own.len();
        let _ = writeln!(
            text,
            "| {label} | {n} | {named}: {} | {alarmed}: {} |",
            rate(named, n),
            rate(alarmed, n)
        );
    };
    let mut all = Vec::new();
    for ((half, year), own) in &groups {
        row(&format!("{year}, {half:?}").to_lowercase(), own);
        all.extend(own.iter().copied());
    }
    row("**all**", &all);
    for t in all.iter().filter(|t| t.answer.none < 0.5) {
        let _ = writeln!(
            text,
            "\n{}, runs {:?}: {} with {:.2}.",
            t.muscle, t.runs, t.answer.top, t.answer.probability
        );
    }
}

fn cylinder(text: &mut String, pairs: &[Pair]) {
    if pairs.is_empty() {
        return;
    }
    let (changed, same): (Vec<&Pair>, Vec<&Pair>) = pairs.iter().partition(|p| !p.known.is_empty());
    let right = changed.iter().filter(|p| p.right()).count();
    let all = changed.iter().filter(|p| p.named == p.known).count();
    let named = same.iter().filter(|p| !p.named.is_empty()).count();
    let (nc, ns) = (changed.len(), same.len());
    let _ = write!(
        text,
        "\n{CYLINDER}| --- | --- | --- |\n\
         | main class named, nothing false | {nc} | {right}: {} |\n| all known classes named | {nc} | {all}: {} |\n\
         | reruns in which nothing changed, named | {ns} | {named}: {} |\n\n\
         | before | after | known | named | p(none) |\n| --- | --- | --- | --- | --- |\n",
        rate(right, nc),
        rate(all, nc),
        rate(named, ns)
    );
    for p in pairs {
        let list = |s: &std::collections::BTreeSet<_>| {
            let names: Vec<String> = s.iter().map(|c| format!("{c:?}").to_lowercase()).collect();
            if names.is_empty() { "–".to_owned() } else { names.join(", ") }
        };
        let mark = if p.right() { "" } else { " **wrong**" };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {}{mark} | {:.2} |",
            p.before,
            p.after,
            list(&p.known),
            list(&p.named),
            p.none
        );
    }
}

/// The page with its sections on tables and on the cylinder rewritten, and the lines on seals in the table of bounds.
pub fn replaced(page: &str, against_tables: &[Trial], pairs: &[Pair]) -> String {
    let mut of_pairs = String::new();
    cylinder(&mut of_pairs, pairs);
    let mut rows = String::new();
    bounds(&mut rows, &[], pairs, None);
    let mut text = page.to_owned();
    for section in [tables(against_tables), of_pairs] {
        let section = section.trim_start_matches('\n');
        let Some(heading) = section.lines().next().filter(|h| h.starts_with("## ")) else { continue };
        let Some(begin) = text.find(heading) else { continue };
        let end = text[begin + 1..].find("\n## ").map_or(text.len(), |e| begin + 1 + e);
        text.replace_range(begin..end, section);
    }
    let lines = text.lines().map(|line| {
        let label = |l: &str| l.split('|').nth(1).map(str::to_owned);
        let new = rows.lines().find(|r| r.starts_with("| seals:") && label(r) == label(line));
        new.unwrap_or(line)
    });
    lines.collect::<Vec<_>>().join("\n") + "\n"
}

/// The page as Markdown; `further` holds the sections of leaks and of tables.
pub fn page(
    trials: &[Trial],
    further: &str,
    pairs: &[Pair],
    speed: Option<(usize, f64)>,
    short: bool,
) -> String {
    let mut text = INTRODUCTION.to_owned();
    if short {
        text.push_str("**This is the short version: a stratified share of the trials.**\n\n");
    }
    text.push_str(BOUNDS);
    if trials.is_empty() {
        text.push_str("The recordings of the staircases are not available.\n");
    } else {
        bounds(&mut text, trials, pairs, speed);
        injected(&mut text, trials);
        untouched(&mut text, trials);
        comparison(&mut text, trials);
        text.push_str(further);
    }
    cylinder(&mut text, pairs);
    if let Some((rows, seconds)) = speed {
        let _ = writeln!(
            text,
            "\n## Speed\n\n{rows} rows together: {seconds:.2} s, reading not included, on the machine that wrote this page."
        );
    }
    text.push_str(UNTESTED);
    text
}
