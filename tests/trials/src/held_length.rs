//! Muscles whose length was held: what most laboratories record. Clean muscles and muscles with one effect are diagnosed; counted are
//! names of clean muscles, and for each effect whether it is named, or whether the answer says that it could be there unseen.
//!
//! Friction of the muscles has several sets of bristles, so that it turns over a wide range of pressure after a reversal.

use crate::answer::{Answer, Missing};
use crate::generate;
use crate::names::{SINGLES, class};
use crate::progress::Progress;
use crate::queue::in_order;
use crate::rate::Rate;
use crate::residuals::Residuals;
use crate::spec::{self, Operator, Size, Spec};
use crate::tool;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use virtual_bench::presets;

/// How many muscles, and where the page goes.
#[derive(clap::Args)]
pub struct Held {
    /// Clean muscles for each campaign.
    #[arg(long, default_value_t = 30)]
    clean: u64,
    /// Muscles with each effect for each campaign.
    #[arg(long, default_value_t = 1)]
    each: u64,
    /// The seed of the first muscle.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Peak of each effect, percent of the blocked force.
    #[arg(long, default_value_t = 3.0)]
    peak: f64,
    /// Only these effects.
    #[arg(long, value_delimiter = ',')]
    effects: Vec<String>,
    /// Real recordings whose residuals half of the muscles get as noise, where they are.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// The tool.
    #[arg(long, default_value = "target/release/host")]
    host: PathBuf,
    /// Directory of the recordings and answers.
    #[arg(short, long)]
    output: PathBuf,
    /// Write the tables as this page of the book.
    #[arg(long)]
    page: Option<PathBuf>,
    /// Fail where a clean muscle gets a name.
    #[arg(long)]
    check: bool,
}

/// The campaigns, and what they are on the page.
const CAMPAIGNS: [(&str, &str); 4] = [
    ("one-ramps", "ramps, one length"),
    ("one-staircase", "staircases, one length"),
    ("ramps", "ramps, three lengths"),
    ("staircase", "staircases, three lengths"),
];

/// One muscle in one campaign.
struct Case {
    campaign: usize,
    effect: Option<&'static str>,
    spec: Spec,
}

impl Case {
    fn new(campaign: usize, effect: Option<&'static str>, seed: u64, peak: f64) -> Option<Self> {
        let family = format!("held {}", effect.unwrap_or("clean"));
        let mut spec = spec::draw_of(seed, &family, 1, &[effect.into_iter().collect()]).pop()?;
        spec.protocol = CAMPAIGNS[campaign].0;
        // The bristles as they are drawn: trials of other sets have one set of short ones.
        spec.bench.muscle.friction = presets::random(spec.seed).friction;
        spec.operator = Operator::default();
        for (_, size) in &mut spec.effects {
            *size = Size::Peak(0.01 * peak);
        }
        Some(Self { campaign, effect, spec })
    }

    fn name(&self) -> String {
        format!("{}_{}_{}", CAMPAIGNS[self.campaign].0, self.effect.unwrap_or("clean"), self.spec.seed)
    }
}

/// What an answer says about the effect that is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Said {
    /// Named.
    Named,
    /// Another effect of its class is named, or it is in the reported set.
    InClassOrSet,
    /// Nothing is named, and the effect could be there unseen with this size.
    CouldHide,
    /// Something is unexplained, and nothing is named.
    Unexplained,
    /// Nothing is named, and the effect is reported as smaller than it is.
    Denied,
    /// Another effect is named.
    Wrong,
}

impl Said {
    const ALL: [(Self, &str); 6] = [
        (Self::Named, "named"),
        (Self::InClassOrSet, "class or set"),
        (Self::CouldHide, "could hide"),
        (Self::Unexplained, "unexplained"),
        (Self::Denied, "denied"),
        (Self::Wrong, "wrong name"),
    ];

    fn of(answer: &Answer, effect: &str, peak: f64) -> Self {
        let in_set = |m: &Missing| m.confusable_with.iter().any(|c| c == effect);
        if answer.missing.iter().any(|m| m.effect == effect) {
            Self::Named
        } else if answer.missing.iter().any(|m| class(&m.effect) == class(effect) || in_set(m)) {
            Self::InClassOrSet
        } else if !answer.missing.is_empty() {
            Self::Wrong
        } else if answer.verdict == "unexplained" {
            Self::Unexplained
        } else {
            let considered = answer.considered.iter().find(|c| c.effect == effect);
            match considered.and_then(|c| c.hidden_up_to) {
                Some(up_to) if up_to < peak => Self::Denied,
                _ => Self::CouldHide,
            }
        }
    }
}

/// What is kept of an answer, for studies that read it.
#[derive(Debug, Default, Clone, Serialize, Deserialize)]
pub struct Outcome {
    /// Campaign, effect and seed.
    pub case: String,
    /// The statement about the effect that is there; none for a clean muscle.
    pub said: Option<Said>,
    /// Names in the order in which they were found.
    pub named: Vec<String>,
    /// Verdict, as in the JSON.
    pub verdict: String,
}

/// The answers of a run, a JSON array.
const ANSWERS: &str = "answers.json";

/// The answers in a directory, in the order of the cases.
///
/// # Errors
/// No readable answers there.
pub fn outcomes(dir: &Path) -> Result<Vec<Outcome>, Box<dyn Error>> {
    Ok(serde_json::from_str(&std::fs::read_to_string(dir.join(ANSWERS))?)?)
}

/// A case with its answer.
struct Answered<'a> {
    case: &'a Case,
    answer: Answer,
    /// Peak of the effect, N.
    peak: f64,
}

impl Answered<'_> {
    fn outcome(&self) -> Outcome {
        Outcome {
            case: self.case.name(),
            said: self.case.effect.map(|effect| Said::of(&self.answer, effect, self.peak)),
            named: self.answer.missing.iter().map(|m| m.effect.clone()).collect(),
            verdict: self.answer.verdict.clone(),
        }
    }
}

/// Makes the recordings and has them diagnosed: the answer, and the peak of the effect, N.
fn ask(what: &Held, residuals: &Residuals, case: &Case) -> Result<(Answer, f64), String> {
    let dir = what.output.join(case.name());
    let trial = generate::make(&case.spec, residuals);
    let answer = tool::answer_to(&what.host, &dir, &trial)?;
    let effect = trial.truth.effects.first();
    let peak = effect.map_or(0.0, |e| 0.01 * e.amplitude_pct * trial.truth.blocked_force);
    Ok((answer, peak))
}

fn clean_table(all: &[Answered<'_>]) -> Result<(String, usize), std::fmt::Error> {
    let mut text = "| campaign | named | unexplained | names |\n| --- | --- | --- | --- |\n".to_owned();
    let mut false_alarms = 0;
    for (k, (_, campaign)) in CAMPAIGNS.iter().enumerate() {
        let these = || all.iter().filter(move |a| a.case.effect.is_none() && a.case.campaign == k);
        let named = these().filter(|a| !a.answer.missing.is_empty()).count();
        let unexplained = these().filter(|a| a.answer.verdict == "unexplained").count();
        let mut names: Vec<&str> =
            these().flat_map(|a| a.answer.missing.iter().map(|m| m.effect.as_str())).collect();
        names.sort_unstable();
        names.dedup();
        false_alarms += named;
        let n = these().count();
        writeln!(
            text,
            "| {campaign} | {} | {} | {} |",
            Rate::new(named, n),
            Rate::new(unexplained, n),
            names.join(", ")
        )?;
    }
    Ok((text, false_alarms))
}

fn effect_table(all: &[Answered<'_>]) -> Result<String, std::fmt::Error> {
    let mut text = "| effect |".to_owned();
    for (_, said) in Said::ALL {
        write!(text, " {said} |")?;
    }
    write!(text, " wrong names |\n| --- |{} --- |\n", " --- |".repeat(Said::ALL.len()))?;
    let mut rows: BTreeMap<&str, Vec<&Answered<'_>>> = BTreeMap::new();
    for a in all {
        rows.entry(a.case.effect.unwrap_or_default()).or_default().push(a);
    }
    rows.remove("");
    let cells = |these: &[(&Answered<'_>, Said)]| -> String {
        Said::ALL.iter().map(|(s, _)| format!(" {} |", these.iter().filter(|t| t.1 == *s).count())).collect()
    };
    let mut whole = Vec::new();
    for (effect, these) in rows {
        let said: Vec<(&Answered<'_>, Said)> =
            these.iter().map(|a| (*a, Said::of(&a.answer, effect, a.peak))).collect();
        let mut wrong: Vec<&str> = said
            .iter()
            .filter(|s| s.1 == Said::Wrong)
            .flat_map(|s| s.0.answer.missing.iter().map(|m| m.effect.as_str()))
            .collect();
        wrong.sort_unstable();
        wrong.dedup();
        writeln!(text, "| {effect} |{} {} |", cells(&said), wrong.join(", "))?;
        whole.extend(said);
    }
    writeln!(text, "| all |{} |", cells(&whole))?;
    Ok(text)
}

/// Runs all cases, prints their tables, and writes the page.
///
/// # Errors
/// Recordings or a page that cannot be written, a tool that gives no answer, or with `--check` a name for a clean muscle.
pub fn run(what: &Held) -> Result<(), Box<dyn Error>> {
    let residuals = Residuals::read(&what.data);
    let asked = |name: &str| what.effects.is_empty() || what.effects.iter().any(|e| e == name);
    let mut cases = Vec::new();
    for campaign in 0..CAMPAIGNS.len() {
        let clean = (0..what.clean).map(|k| (None, k));
        let effects =
            SINGLES.iter().filter(|s| asked(s.0)).flat_map(|s| (0..what.each).map(|k| (Some(s.0), k)));
        cases.extend(
            clean.chain(effects).filter_map(|(e, k)| Case::new(campaign, e, what.seed + k, what.peak)),
        );
    }
    let progress = Progress::new("diagnosed", cases.len());
    let answers = in_order(&cases, |case| {
        let answer = ask(what, &residuals, case);
        progress.one();
        answer
    })?;
    let all: Vec<Answered<'_>> =
        cases.iter().zip(answers).map(|(case, (answer, peak))| Answered { case, answer, peak }).collect();
    let outcomes: Vec<Outcome> = all.iter().map(Answered::outcome).collect();
    std::fs::write(what.output.join(ANSWERS), serde_json::to_string_pretty(&outcomes)?)?;
    let (clean, false_alarms) = clean_table(&all)?;
    let tables = format!("## Clean muscles\n\n{clean}\n## One effect\n\n{}", effect_table(&all)?);
    println!("{tables}");
    if let Some(page) = &what.page {
        let made = format!(
            "{INTRODUCTION}This page: `--clean {} --each {} --seed {} --peak {}`.\n\n{tables}",
            what.clean, what.each, what.seed, what.peak
        );
        std::fs::write(page, made)?;
    }
    if what.check && false_alarms > 0 {
        return Err(format!("{false_alarms} clean muscles got a name").into());
    }
    Ok(())
}

/// Beginning of the page.
const INTRODUCTION: &str = "# Trials at held length\n\nWritten by `cargo run --release -p trials -- held -o DIR --page \
    docs/src/proof-held.md`; nothing here is typed by hand. Muscles of the virtual bench were recorded with their length held: pressure \
    ramps or staircases, at one length or at three. Each muscle is drawn separately, with several sets of bristles, so that its friction turns \
    over a wide range of pressure after a reversal. Rates have exact 95 % intervals in brackets.\n\n\
    - **Clean muscles**: nothing is left out. Every name is a false alarm.\n\
    - **One effect**: counted is what the answer says about it. \"Class or set\": another effect of the same class is named, or the effect is \
    in the reported set. \"Could hide\": nothing is named, and the answer says that the effect could be there unseen with this size. \
    \"Denied\": nothing is named, and the answer says that the effect is smaller than it is.\n\n";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Considered;

    #[test]
    fn the_page_in_the_book_has_this_introduction() {
        crate::book::contains("proof-held.md", &[INTRODUCTION]);
    }

    fn answer(named: &[&str], set: &[&str], hidden: Option<f64>) -> Answer {
        let missing = named.iter().map(|n| Missing {
            effect: (*n).into(),
            confusable_with: set.iter().map(|s| (*s).into()).collect(),
            ..Missing::default()
        });
        let considered =
            vec![Considered { effect: "log-creep".into(), hidden_up_to: hidden, ..Considered::default() }];
        Answer { missing: missing.collect(), considered, ..Answer::default() }
    }

    #[test]
    fn an_answer_is_counted_by_its_statement_about_the_effect() {
        let said = |answer: &Answer| Said::of(answer, "log-creep", 5.0);
        assert!(said(&answer(&["log-creep"], &[], None)) == Said::Named);
        assert!(said(&answer(&["stress-relaxation"], &[], None)) == Said::InClassOrSet);
        assert!(said(&answer(&["inertia"], &["log-creep"], None)) == Said::InClassOrSet);
        assert!(said(&answer(&["inertia"], &[], None)) == Said::Wrong);
        assert!(said(&answer(&[], &[], None)) == Said::CouldHide);
        assert!(said(&answer(&[], &[], Some(6.0))) == Said::CouldHide);
        assert!(said(&answer(&[], &[], Some(4.0))) == Said::Denied);
        let unexplained = Answer { verdict: "unexplained".into(), ..Answer::default() };
        assert!(said(&unexplained) == Said::Unexplained);
    }

    #[test]
    fn a_case_keeps_the_bristles_that_were_drawn_and_has_the_effect() {
        let case = Case::new(0, Some("log-creep"), 3, 2.0).expect("a case");
        assert!(case.spec.bench.muscle.friction.bristles.len() > 1);
        assert_eq!(case.spec.effects.len(), 1);
        assert_eq!(case.spec.effects[0].1, Size::Peak(0.02));
    }
}
