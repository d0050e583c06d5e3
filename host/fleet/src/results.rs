//! The four tables of a muscle: their columns, and the rows that a fit and a diagnosis give.

// Columns carry their unit as units are spelled: N is not n.
#![allow(non_snake_case)]

use pam_diagnose::reference::ChangeReport;
use pam_diagnose::verdict::Diagnosis;
use pam_fit::Fit;
use pam_report::wording;
use parquet::errors::Result;

use crate::columns::{Columns, Values};
use crate::failures::Failure;
use crate::partition::KEY;

/// The highest order `M` of the elastic polynomial, and so the number of columns for `E_k`.
const ORDERS: usize = 6;

/// What every row of every table says about where it comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Provenance {
    /// The muscle.
    pub muscle: String,
    /// The key of inputs and settings; rows with the same key are the same.
    pub key: String,
    /// The program and its version.
    pub tool: String,
    /// Role, path and SHA-256 of every input, as JSON.
    pub inputs: String,
    /// The tags, as JSON.
    pub tags: String,
}

/// A table under construction: each call of a method adds one column.
struct Builder {
    rows: usize,
    columns: Columns,
}

impl Builder {
    fn new(from: &Provenance, rows: usize) -> Self {
        let mut table = Self { rows, columns: Columns::default() };
        table.same("muscle", &from.muscle);
        table
    }

    fn same(&mut self, name: &str, text: &str) {
        self.columns.0.push((name.to_owned(), Values::Text(vec![Some(text.to_owned()); self.rows])));
    }

    fn texts(&mut self, name: &str, values: impl Iterator<Item = Option<String>>) {
        self.columns.0.push((name.to_owned(), Values::Text(values.collect())));
    }

    fn numbers(&mut self, name: &str, values: impl Iterator<Item = Option<f64>>) {
        self.columns.0.push((name.to_owned(), Values::Number(values.collect())));
    }

    fn counts(&mut self, name: &str, values: impl Iterator<Item = Option<usize>>) {
        let whole = values.map(|v| v.and_then(|n| i64::try_from(n).ok())).collect();
        self.columns.0.push((name.to_owned(), Values::Count(whole)));
    }

    fn flags(&mut self, name: &str, values: impl Iterator<Item = Option<bool>>) {
        self.columns.0.push((name.to_owned(), Values::Flag(values.collect())));
    }

    fn finish(mut self, from: &Provenance) -> Result<Vec<u8>> {
        self.same("tags", &from.tags);
        self.same("inputs", &from.inputs);
        self.same("tool", &from.tool);
        self.same("key", &from.key);
        self.columns.to_parquet(&[("pam-batch", "1"), (KEY, &from.key)])
    }
}

/// One row per fitted muscle.
pub(crate) fn fits(from: &Provenance, fit: Option<&Fit>) -> Result<Vec<u8>> {
    let all: Vec<_> = fit.into_iter().map(|f| &f.summary).collect();
    let mut t = Builder::new(from, all.len());
    t.counts("samples", all.iter().map(|s| Some(s.samples)));
    t.counts("samples_fitted", all.iter().map(|s| Some(s.rows.fitted)));
    t.counts("pressures", all.iter().map(|s| Some(s.pressures.len())));
    t.numbers("deadband_kPa", all.iter().map(|s| Some(s.deadband_kPa)));
    t.numbers("deadband_std_kPa", all.iter().map(|s| Some(s.deadband_std_kPa)));
    t.numbers("blocked_force_N", all.iter().map(|s| Some(s.blocked_force_N)));
    t.numbers("rms_N", all.iter().map(|s| Some(s.rms_N)));
    t.numbers("mean_error_pct", all.iter().map(|s| Some(s.mean_error_pct)));
    t.numbers("max_error_pct", all.iter().map(|s| Some(s.max_error_pct)));
    t.numbers("left_out_pressure_mean_error_pct", all.iter().map(|s| s.left_out_pressure_mean_error_pct));
    t.texts("warnings", all.iter().map(|s| Some(s.warnings.join("\n"))));
    t.finish(from)
}

/// One row per node of a muscle's table.
pub(crate) fn tables(from: &Provenance, fit: Option<&Fit>) -> Result<Vec<u8>> {
    let nodes = fit.map_or(0, |f| f.table.nodes.len());
    let at = || (0..nodes).filter_map(|i| Some((i, fit?)));
    let mut t = Builder::new(from, nodes);
    t.counts("node", at().map(|(i, _)| Some(i)));
    t.numbers("pressure_kPa", at().map(|(i, f)| Some(f64::from(f.table.nodes[i]) / 1e3)));
    for k in 0..ORDERS {
        let modulus = |(i, f): (usize, &Fit)| Some(f64::from(*f.table.elastic.get(k)?.get(i)?) / 1e6);
        let deviation = |(i, f): (usize, &Fit)| {
            f.table.elastic.get(k)?;
            Some(f.table_root.std(1 + k * f.table.nodes.len() + i) / 1e6)
        };
        t.numbers(&format!("E_{}_MPa", k + 1), at().map(modulus));
        t.numbers(&format!("E_{}_std_MPa", k + 1), at().map(deviation));
    }
    t.numbers("k_F", at().map(|(i, f)| f.table.friction.get(i).map(|k| f64::from(*k))));
    t.numbers(
        "k_F_std",
        at().map(|(i, f)| Some(f.table_root.std(1 + f.table.order() * f.table.nodes.len() + i))),
    );
    t.numbers("blocked_force_N", at().map(|(i, f)| Some(f.solution.blocked(f64::from(f.table.nodes[i])))));
    t.finish(from)
}

/// What was found in a muscle's recordings.
pub(crate) enum Answer {
    /// Against the model.
    Diagnosis(Box<Diagnosis>),
    /// Against earlier recordings.
    Change(Box<ChangeReport>),
}

/// One effect of an answer, or the answer itself where it names none.
#[derive(Default)]
struct Finding {
    effect: Option<String>,
    probability: Option<f64>,
    share_explained: Option<f64>,
    bench: Option<bool>,
    supported: Option<bool>,
    peak_N: Option<f64>,
    p: Option<f64>,
    parameters: Option<String>,
    confusable_with: Option<String>,
}

impl Answer {
    fn findings(&self) -> Vec<Finding> {
        let mut list: Vec<Finding> = match self {
            Self::Diagnosis(d) => d
                .missing
                .iter()
                .map(|m| Finding {
                    effect: Some(m.effect.clone()),
                    probability: Some(m.probability),
                    share_explained: Some(m.share_explained),
                    bench: Some(m.correction),
                    supported: Some(m.supported),
                    peak_N: Some(m.peak_N),
                    p: Some(m.p),
                    parameters: serde_json::to_string(&m.parameters).ok(),
                    confusable_with: Some(m.confusable_with.join(", ")),
                })
                .collect(),
            Self::Change(r) => r
                .missing
                .iter()
                .map(|m| Finding {
                    effect: Some(m.effect.clone()),
                    probability: Some(m.probability),
                    share_explained: Some(m.share_explained),
                    bench: Some(m.correction),
                    supported: Some(true),
                    peak_N: Some(m.rms_N),
                    p: None,
                    parameters: serde_json::to_string(&m.parameters).ok(),
                    confusable_with: Some(m.confusable_with.join(", ")),
                })
                .collect(),
        };
        if list.is_empty() {
            list.push(Finding::default());
        }
        list
    }

    /// Verdict, noise, residual, share and pattern that no effect explains.
    fn figures(&self) -> (String, f64, f64, f64, String) {
        let word = |v: serde_json::Result<serde_json::Value>| {
            v.ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
        };
        match self {
            Self::Diagnosis(d) => {
                let verdict = match d.judged() {
                    true => word(serde_json::to_value(d.verdict())),
                    false => "not-judged".to_owned(),
                };
                (
                    verdict,
                    d.noise_N,
                    d.misfit_rms_N,
                    d.unexplained.share,
                    wording::pattern(&d.unexplained.pattern),
                )
            }
            Self::Change(r) => (
                word(serde_json::to_value(r.verdict)),
                r.noise_N,
                r.misfit_rms_N,
                r.unexplained.share,
                wording::change::pattern(&r.unexplained),
            ),
        }
    }
}

/// One row per muscle and effect; a muscle without a named effect has one row without an effect, which holds its verdict.
pub(crate) fn diagnoses(from: &Provenance, answer: Option<&Answer>) -> Result<Vec<u8>> {
    let list = answer.map(Answer::findings).unwrap_or_default();
    let figures = answer.map(Answer::figures);
    let every = |of: fn(&(String, f64, f64, f64, String)) -> f64| {
        let value = figures.as_ref().map(of);
        list.iter().map(move |_| value)
    };
    let mut t = Builder::new(from, list.len());
    t.same(
        "against",
        match answer {
            Some(Answer::Change(_)) => "reference",
            _ => "model",
        },
    );
    t.same("verdict", figures.as_ref().map_or("", |f| f.0.as_str()));
    t.texts("effect", list.iter().map(|f| f.effect.clone()));
    t.numbers("probability", list.iter().map(|f| f.probability));
    t.numbers("share_explained", list.iter().map(|f| f.share_explained));
    t.flags("bench", list.iter().map(|f| f.bench));
    t.flags("supported", list.iter().map(|f| f.supported));
    t.numbers("peak_N", list.iter().map(|f| f.peak_N));
    t.numbers("p", list.iter().map(|f| f.p));
    t.texts("parameters", list.iter().map(|f| f.parameters.clone()));
    t.texts("confusable_with", list.iter().map(|f| f.confusable_with.clone()));
    t.numbers("noise_N", every(|f| f.1));
    t.numbers("misfit_rms_N", every(|f| f.2));
    t.numbers("unexplained_share", every(|f| f.3));
    t.same("unexplained_pattern", figures.as_ref().map_or("", |f| f.4.as_str()));
    t.finish(from)
}

/// One row per failure.
pub(crate) fn failures(from: &Provenance, list: &[Failure]) -> Result<Vec<u8>> {
    let mut t = Builder::new(from, list.len());
    t.texts("stage", list.iter().map(|f| Some(f.stage.name().to_owned())));
    t.texts("code", list.iter().map(|f| Some(f.code.clone())));
    t.texts("cause", list.iter().map(|f| Some(f.cause.clone())));
    t.texts("place", list.iter().map(|f| Some(f.place.clone())));
    t.texts("remedy", list.iter().map(|f| Some(f.remedy.clone())));
    t.finish(from)
}
