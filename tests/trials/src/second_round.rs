//! The second round: what the tool proposes to record is recorded on the same muscle, and the tool answers again; beside it, an
//! item of the catalogue's menu drawn at random.

use crate::answer::{Answer, frozen, recordings, run_limited};
use crate::generate::{TrialTruth, after};
use crate::ledger::{Ledger, begun, name, open, read_ledger};
use crate::progress::Progress;
use crate::queue::in_order;
use crate::rate::Rate;
use crate::residuals::Residuals;
use crate::spec::{Spec, Stratum};
use crate::tool;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};
use virtual_bench::campaigns;
use virtual_bench::muscle::Muscle;
use virtual_bench::protocol::{Place, Protocol, Step};
use virtual_bench::recording::Columns;
use virtual_bench::rng::Rng;

/// One ambiguous trial.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Second {
    /// Number in the set.
    pub id: usize,
    /// Its protocol.
    pub protocol: String,
    /// What was hidden.
    pub truth: Vec<String>,
    /// The set that the tool gave at first.
    pub first: Vec<String>,
    /// After the proposed recording; empty where nothing is named any more.
    pub proposed: Vec<String>,
    /// After a random item of the menu.
    pub random: Vec<String>,
}

impl Second {
    /// One name is left, and it was hidden.
    fn resolved(&self, set: &[String]) -> bool {
        matches!(set, [only] if self.truth.contains(only))
    }

    /// The set has become smaller and still holds what was hidden.
    fn narrowed(&self, set: &[String]) -> bool {
        set.len() < self.first.len() && !set.is_empty() && self.truth.iter().any(|t| set.contains(t))
    }
}

/// The second round as Markdown.
pub fn markdown(all: &[Second]) -> String {
    let rate =
        |right: &dyn Fn(&Second) -> bool| Rate::new(all.iter().filter(|s| right(s)).count(), all.len());
    let mut m = String::from(
        "\n## Second round: with the proposed recording\n\nTrials in which more than one name was possible, the truth among them, \
         and a recording was proposed.\n\n| additional recording | only the right name remains | smaller set with the truth \
         |\n| --- | --- | --- |\n",
    );
    m += &format!(
        "| the proposed one | {} | {} |\n",
        rate(&|s| s.resolved(&s.proposed)),
        rate(&|s| s.narrowed(&s.proposed))
    );
    m += &format!(
        "| one drawn from the menu | {} | {} |\n",
        rate(&|s| s.resolved(&s.random)),
        rate(&|s| s.narrowed(&s.random))
    );
    m
}

fn set_of(a: &Answer) -> Vec<String> {
    let mut set: Vec<String> = Vec::new();
    for name in a.missing.iter().flat_map(|m| std::iter::once(&m.effect).chain(&m.confusable_with)) {
        if !set.contains(name) {
            set.push(name.clone());
        }
    }
    set
}

/// An item of the catalogue's menu at a level in the middle.
fn menu(muscle: &Muscle, r: &mut Rng) -> Protocol {
    let levels = campaigns::levels(muscle);
    let v = campaigns::slow(muscle, &levels);
    let level = levels[levels.len() / 2] * 1e-3;
    let set = |kpa: f64| Step::Pressure { to_kpa: kpa, rate_kpa_s: Some(50.0), settle_s: 2.0 };
    let go = |part: f64, speed_mm_s: f64| Step::Move { to: Place::free(part), speed_mm_s };
    let loops = |count: u32, speed_mm_s: f64| Step::Cycles { to: Place::free(1.0), speed_mm_s, count };
    let file = |name: &str| Step::File { name: name.into() };
    let body = match r.index(5) {
        0 => vec![loops(1, 0.3 * v), loops(2, v), loops(3, 4.0 * v), loops(4, 16.0 * v)],
        1 => [1.0, 10.0, 100.0]
            .into_iter()
            .flat_map(|seconds| {
                let hold = || Step::Hold { seconds };
                vec![go(0.5, 4.0 * v), hold(), go(0.9, 4.0 * v), go(0.5, 4.0 * v), hold(), go(0.0, 4.0 * v)]
            })
            .collect(),
        2 => [v, 8.0 * v]
            .into_iter()
            .flat_map(|speed| [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0].map(|part| go(part, speed)))
            .collect(),
        3 => [0.0, 0.3, 0.6]
            .into_iter()
            .flat_map(|part| {
                let ramp =
                    |kpa: f64| Step::Pressure { to_kpa: kpa, rate_kpa_s: Some(level / 25.0), settle_s: 2.0 };
                vec![set(level), go(part, 4.0 * v), ramp(0.0), ramp(level), ramp(0.0), ramp(level)]
            })
            .chain([go(0.0, 4.0 * v)])
            .collect(),
        _ => vec![
            loops(3, v),
            Step::EndFile,
            Step::Rest { seconds: 1800.0 },
            set(level),
            file("again"),
            loops(3, v),
        ],
    };
    let mut step = vec![set(level), file("menu")];
    step.extend(body);
    step.push(Step::EndFile);
    Protocol { name: "menu".into(), sample_hz: 10.0, step }
}

struct Case {
    spec: Spec,
    truth: TrialTruth,
    first: Vec<String>,
    proposed: Protocol,
}

/// Trials of a set in which a further recording is requested.
fn ambiguous(set: &Path, ledger: &Ledger, specs: Vec<Spec>) -> Result<Vec<Case>, Box<dyn Error>> {
    let mut cases = Vec::new();
    for spec in specs.into_iter().take(ledger.answers.len()) {
        let Ok(answer) = frozen(set, ledger, spec.id)? else { continue };
        let truth = open(set, ledger, spec.id)?;
        let first = set_of(&answer);
        let inside = matches!(spec.stratum, Stratum::Single | Stratum::Decoy)
            && truth.effects.iter().all(|e| first.contains(&e.name));
        let text = answer.next_experiment.as_ref().and_then(|n| n.get("protocol")).and_then(|p| p.as_str());
        let Some(Ok(proposed)) = text.map(Protocol::from_toml) else { continue };
        if inside && first.len() > 1 {
            cases.push(Case { spec, truth, first, proposed });
        }
    }
    Ok(cases)
}

fn ask(
    set: &Path,
    host: &Path,
    case: &Case,
    what: &str,
    next: &Protocol,
    residuals: &Residuals,
) -> Vec<String> {
    let id = name(case.spec.id);
    let dir = set.join("again").join(&id).join(what);
    let trial = set.join("trials").join(&id);
    let json = dir.join("answer.json");
    if json.exists() {
        return said(&json);
    }
    let mut files = recordings(&trial);
    files.extend(after(&case.spec, &case.truth.bench, residuals, next).iter().enumerate().filter_map(
        |(n, f)| {
            std::fs::create_dir_all(&dir).ok()?;
            let path = dir.join(format!("{:02}_{}.csv", n + 1, f.name));
            std::fs::write(&path, f.csv(Columns::default())).ok().map(|()| path)
        },
    ));
    let mut c = tool::diagnose(host, &trial.join("muscle.toml"), &files, &json);
    // No answer names nothing: the trial counts as not resolved.
    if run_limited(&mut c, Duration::from_secs(120)).is_err() {
        return Vec::new();
    }
    said(&json)
}

fn said(json: &Path) -> Vec<String> {
    let answer = std::fs::read(json).ok().and_then(|b| serde_json::from_slice::<Answer>(&b).ok());
    answer.map_or(Vec::new(), |a| set_of(&a))
}

/// Run the second round of an answered set and write again.json. The answers of an earlier run are kept; trials that are not begun
/// `until` then are left out.
pub fn run(
    set: &Path,
    host: &Path,
    residuals: &Residuals,
    until: Option<Instant>,
    draw: impl Fn(u64, &str, usize) -> Vec<Spec>,
) -> Result<(), Box<dyn Error>> {
    let ledger = read_ledger(set)?;
    if ledger.answers.is_empty() {
        return Err("the first round has not been answered".into());
    }
    let seed = begun(set).ok_or("the set's seed is missing")?;
    let cases = ambiguous(set, &ledger, draw(seed, &ledger.set, ledger.drawn.max(ledger.truths.len())))?;
    let progress = Progress::new("asked again", cases.len());
    let done = in_order(&cases, |case| {
        let dir = set.join("again").join(name(case.spec.id));
        let known = ["proposed", "random"].iter().all(|w| dir.join(w).join("answer.json").exists());
        if !known && until.is_some_and(|t| Instant::now() > t) {
            return Ok(None);
        }
        let mut r = Rng::stream(case.spec.seed, "menu");
        let muscle = Muscle::new(case.truth.bench.muscle.clone());
        let item = menu(&muscle, &mut r);
        let second = Second {
            id: case.spec.id,
            protocol: case.spec.protocol.into(),
            truth: case.truth.effects.iter().map(|e| e.name.clone()).collect(),
            first: case.first.clone(),
            proposed: ask(set, host, case, "proposed", &case.proposed, residuals),
            random: ask(set, host, case, "random", &item, residuals),
        };
        progress.one();
        Ok(Some(second))
    })?;
    let all: Vec<Second> = done.into_iter().flatten().collect();
    if all.len() < cases.len() {
        println!(
            "{} of {} ambiguous trials were diagnosed again; the same command continues",
            all.len(),
            cases.len()
        );
    }
    std::fs::write(set.join("again.json"), serde_json::to_string_pretty(&all)?)?;
    println!("{}", markdown(&all));
    Ok(())
}

/// The second round of a set, where it was run.
pub fn read(set: &Path) -> Option<Vec<Second>> {
    serde_json::from_str(&std::fs::read_to_string(set.join("again.json")).ok()?).ok()
}
