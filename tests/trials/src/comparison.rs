//! The tool beside other methods on the same trials: rates, and McNemar's test of each pair.

use crate::baselines::{LIBRARY, is, is_class, random, regress};
use crate::figures::{Figures, Scored, big_and_visible};
use crate::generate::TrialTruth;
use crate::ledger::name;
use crate::paired_test::mcnemar;
use crate::rate::Rate;
use rayon::prelude::*;
use serde::Deserialize;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

/// One method on the trials that naming is judged on, and beside the tool on the same trials.
#[derive(Debug)]
struct Line {
    /// What the method is called.
    method: String,
    /// Exact names.
    exact: Rate,
    /// Names of the right class.
    class: Rate,
    /// Names for trials without an effect, where the method may give none.
    false_alarms: Option<Rate>,
    /// Trials whose class only the tool has right, and only the method.
    only: [usize; 2],
}

impl Line {
    /// `names`: what the method says of a trial; trials without an entry do not count.
    fn new<'n>(method: &str, judged: &[Judged<'_>], names: impl Fn(&TrialTruth) -> Option<&'n str>) -> Self {
        let said: Vec<(&Judged<'_>, &str)> =
            judged.iter().filter_map(|j| Some((j, names(j.truth)?))).collect();
        let count = |right: &dyn Fn(&Judged<'_>, bool) -> bool| {
            said.iter().filter(|(j, n)| right(j, is_class(j.truth, n))).count()
        };
        Self {
            method: method.into(),
            exact: Rate::new(said.iter().filter(|(j, n)| is(j.truth, n)).count(), said.len()),
            class: Rate::new(count(&|_, theirs| theirs), said.len()),
            false_alarms: None,
            only: [count(&|j, theirs| j.right && !theirs), count(&|j, theirs| !j.right && theirs)],
        }
    }
}

/// The comparison as a table; the tool's own figures are of all protocols.
pub fn write(m: &mut String, comparison: &Comparison, tool: &Figures) {
    let (clean, nasty) = (tool.false_alarms_clean, tool.false_alarms_nasty);
    let _ = write!(
        m,
        "\n## Comparison with other methods (visible effects of 2 % and more)\n\n\
         \"Named without an effect\": trials without an effect that are given a name; a dash where a method names in every trial. The last \
         column counts the trials whose class only one of the two has right, with McNemar's exact test.\n\n\
         | method | exact | class | named without an effect | class right: only this tool : only the method |\n\
         | --- | --- | --- | --- | --- |\n\
         | this tool | {} | {} | {} | – |\n",
        tool.exact,
        tool.class_right,
        Rate::new(clean.k + nasty.k, clean.n + nasty.n),
    );
    for l in &comparison.lines {
        let alarms = l.false_alarms.map_or("–".into(), |r| r.to_string());
        let [tool, method] = l.only;
        let p = mcnemar(tool, method);
        let p = if p < 0.001 { format!("{p:.0e}") } else { format!("{p:.3}") };
        let _ = writeln!(
            m,
            "| {} | {} | {} | {alarms} | {tool} : {method}, p = {p} |",
            l.method, l.exact, l.class
        );
    }
    let _ = writeln!(
        m,
        "\nRegression, knockoffs, and emdcmp choose among {} of the catalogue's equations at fixed shapes; {} of the trials have such an effect.",
        LIBRARY.len(),
        comparison.within_library
    );
    if let Some(o) = &comparison.others {
        let _ = writeln!(
            m,
            "\nThe classifier was trained on {} simulated trials with one effect or none. Settings of other people's methods were chosen on {} \
             trials of an opened development set: \"most right\" by the classes right there, \"few false alarms\" among the settings that name \
             least often where there is no effect (at most 2 %, where a setting does so). `tests/trials/methods` has a file for each method.",
            o.training, o.development
        );
    }
}

/// A trial that naming is judged on, and whether the tool has its class right.
#[derive(Clone, Copy)]
struct Judged<'t> {
    truth: &'t TrialTruth,
    right: bool,
}

/// Every method on the same trials.
#[derive(Debug)]
pub struct Comparison {
    lines: Vec<Line>,
    /// How many of the judged trials have an effect of the regressions' library.
    within_library: usize,
    /// What other people's methods said, where they were run.
    pub others: Option<Others>,
}

/// Every method on the trials that the tool is judged on: visible effects of 2 % and more.
pub fn compare(set: &Path, truths: &[TrialTruth], scored: &[Scored]) -> Comparison {
    let judged: Vec<Judged<'_>> = truths
        .iter()
        .zip(scored)
        .filter(|(_, s)| big_and_visible(&s.0))
        .map(|(truth, s)| Judged { truth, right: s.0.class_right })
        .collect();
    let regressions: HashMap<usize, (&str, &str)> =
        judged.par_iter().map(|j| (j.truth.id, regress(set, j.truth).unwrap_or(("", "")))).collect();
    let mut lines = vec![
        Line::new("random name", &judged, |t| Some(random(t))),
        Line::new("the largest class, always", &judged, |_| Some("force-gain")),
        Line::new("largest ΔBIC", &judged, |t| Some(regressions[&t.id].0)),
        Line::new("sparse regression (STLSQ)", &judged, |t| Some(regressions[&t.id].1)),
    ];
    let others = Others::read(set);
    for other in others.iter().flat_map(|o| &o.methods) {
        let names = |t: &TrialTruth| other.names.get(&name(t.id)).map(String::as_str);
        let nulls: Vec<&str> = truths.iter().filter(|t| t.effects.is_empty()).filter_map(names).collect();
        lines.push(Line {
            false_alarms: Some(Rate::new(nulls.iter().filter(|n| !n.is_empty()).count(), nulls.len())),
            ..Line::new(&other.method, &judged, names)
        });
    }
    let within_library =
        judged.iter().filter(|j| j.truth.effects.iter().any(|e| LIBRARY.contains(&e.name.as_str()))).count();
    Comparison { lines, within_library, others }
}

/// Names by one method, by trial; an empty one for no effect.
#[derive(Debug, Clone, Deserialize)]
struct Other {
    method: String,
    names: HashMap<String, String>,
}

/// What baselines.py wrote.
#[derive(Debug, Clone, Deserialize)]
pub struct Others {
    /// Methods that name.
    methods: Vec<Other>,
    /// How many trials the classifier was trained on.
    training: usize,
    /// How many trials of the development set the settings were chosen on.
    development: usize,
    /// Errors on held-out recordings of a plain table with a Gaussian process on top, N.
    #[serde(rename = "gp_N")]
    gp: HashMap<String, f64>,
}

impl Others {
    /// Of a set, where the script was run.
    fn read(set: &Path) -> Option<Self> {
        serde_json::from_str(&std::fs::read_to_string(set.join("guesses.json")).ok()?).ok()
    }

    /// Median held-out gain of the Gaussian process and of the tool on the same trials, and how many these are.
    pub fn gains(&self, scored: &[Scored]) -> Option<(f64, f64, usize)> {
        let pairs: Vec<(f64, f64)> = scored
            .iter()
            .filter_map(|(o, h)| {
                let (h, error) = ((*h)?, self.gp.get(&name(o.id))?);
                Some(((h.plain - error) / (h.plain - h.twin), h.gain_against_twin()?))
            })
            .collect();
        let median = |mut v: Vec<f64>| {
            v.sort_by(f64::total_cmp);
            v.get(v.len() / 2).copied()
        };
        let process = median(pairs.iter().map(|p| p.0).collect())?;
        Some((process, median(pairs.iter().map(|p| p.1).collect())?, pairs.len()))
    }
}
