//! The trials that a study answers again and again. Each kind reaches stages that the others do not.

use std::error::Error;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use super::{Measurements, Row};
use crate::answer::{self, Asking};
use crate::figures::big_and_visible;
use crate::ledger::{self, Ledger};
use crate::score::{self, Outcome};
use crate::spec::Stratum;
use crate::{held_length, reference_bench};

/// A kind of trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Subject {
    /// Force-stroke loops of the virtual bench: the development set that the study was given.
    Loops,
    /// Pairs of campaigns of the virtual bench, of which the later one has an effect that the earlier one had not.
    Changes,
    /// Muscles of the virtual bench whose length was held.
    HeldLengths,
}

/// Stages that only comparisons with a reference reach.
const CHANGES: [&str; 1] = ["Comparison with a reference"];
/// Stages that only isometric campaigns reach.
const HELD_LENGTHS: [&str; 1] = ["History of a campaign"];
/// Stages that none of these trials reaches: valve pulses, campaigns over months, proposals of recordings, the health of a table on
/// a controller, stocks of muscles.
pub(super) const UNREACHED: [&str; 5] = [
    "Valve pulses",
    "Next experiment, protocol simulation",
    "Timeline of campaigns",
    "Stock of muscles",
    "Health of a table",
];

/// Pairs of campaigns, the first ones of protocol A of the development set: each costs about two seconds of a processor.
const PAIRS: [&str; 8] = ["--set", "dev", "--n", "345", "--protocol", "A", "--take", "24"];
/// Muscles at held length: a clean one in each campaign, and effects of which each has another course in time and pressure.
const MUSCLES: [&str; 6] =
    ["--clean", "1", "--each", "1", "--effects", "log-creep,coulomb-friction,force-offset"];

impl Subject {
    pub(super) const ALL: [Self; 3] = [Self::Loops, Self::Changes, Self::HeldLengths];

    /// The directory of its answers.
    pub(super) const fn folder(self) -> &'static str {
        match self {
            Self::Loops => "loops",
            Self::Changes => "changes",
            Self::HeldLengths => "held-lengths",
        }
    }

    /// Its section of the page.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Loops => "Loops of the virtual bench",
            Self::Changes => "Changes between two campaigns",
            Self::HeldLengths => "Held lengths",
        }
    }

    /// What is counted there.
    pub(super) fn counted(self) -> String {
        match self {
            Self::Loops => "The trials of SET. \"Class right\" counts visible effects of 2 % of the blocked force and \
                more whose first name is of the right class. \"Answers changed\" counts trials that name something else than with the criteria as \
                they are."
                .into(),
            Self::Changes => format!(
                "Pairs of campaigns of one simulated muscle, as `reference-bench {}` draws them. The later campaign has one effect or several that \
                 the earlier one had not. \"False alarms\" counts unchanged pairs with a name, \"class right\" single effects of 2 % of the blocked \
                 force and more.",
                PAIRS.join(" ")
            ),
            Self::HeldLengths => format!(
                "Muscles whose length was held, as `held {}` draws them. \"Class right\" counts effects that are named, by a name of their class or \
                 in its set. \"Answers changed\" also counts trials with no name whose verdict changes.",
                MUSCLES.join(" ")
            ),
        }
    }

    /// Whether these trials show the effect of a stage's criteria.
    pub(super) fn reaches(self, stage: &str) -> bool {
        match self {
            Self::Loops => !CHANGES.iter().chain(&HELD_LENGTHS).chain(&UNREACHED).any(|s| *s == stage),
            Self::Changes => CHANGES.contains(&stage),
            Self::HeldLengths => HELD_LENGTHS.contains(&stage),
        }
    }

    /// Answers the trials in a directory, with criteria scaled by the environment.
    pub(super) fn answer(
        self,
        of: &Measurements<'_>,
        dir: &Path,
        environment: &[(&'static str, String)],
    ) -> Result<Row, Box<dyn Error>> {
        match self {
            Self::Loops => {
                share(&of.answering.set, dir)?;
                if ledger::read_ledger(dir)?.answers.is_empty() {
                    let limit = Duration::from_secs(of.answering.limit);
                    let host = of.programs.join("host");
                    let environment = environment.to_vec();
                    answer::ask(dir, &Asking { host, limit, until: None, tables: false, environment })?;
                }
                Ok(loops(&outcomes(dir)?))
            }
            Self::Changes => {
                trials(of, environment, "reference-bench", &PAIRS, dir)?;
                Ok(changes(&reference_bench::outcomes(dir)?))
            }
            Self::HeldLengths => {
                trials(of, environment, "held", &MUSCLES, dir)?;
                Ok(held_lengths(&held_length::outcomes(dir)?))
            }
        }
    }
}

/// Runs a command of the study's `trials`, which asks the study's `host`.
fn trials(
    of: &Measurements<'_>,
    environment: &[(&'static str, String)],
    command: &str,
    options: &[&str],
    output: &Path,
) -> Result<(), Box<dyn Error>> {
    let mut process = Command::new(of.programs.join("trials"));
    process.arg(command).args(options).arg("-o").arg(output).envs(environment.iter().cloned());
    if command == "held" {
        process.arg("--host").arg(of.programs.join("host"));
    }
    let done = process.output()?;
    if done.status.success() {
        return Ok(());
    }
    Err(format!("trials {command} -o {}: {}", output.display(), String::from_utf8_lossy(&done.stderr)).into())
}

/// A folder that shares the set's trials and truths and has answers of its own.
fn share(set: &Path, to: &Path) -> Result<(), Box<dyn Error>> {
    if to.join("ledger.json").exists() {
        return Ok(());
    }
    std::fs::create_dir_all(to)?;
    let set = set.canonicalize()?;
    for part in ["trials", "sealed"] {
        let link = to.join(part);
        if !link.exists() {
            std::os::unix::fs::symlink(set.join(part), link)?;
        }
    }
    let ledger = Ledger {
        answers: Vec::new(),
        tool: String::new(),
        seconds: Vec::new(),
        ..ledger::read_ledger(&set)?
    };
    ledger::write_ledger(to, &ledger)
}

fn outcomes(dir: &Path) -> Result<Vec<Outcome>, Box<dyn Error>> {
    let ledger = ledger::read_ledger(dir)?;
    (0..ledger.answers.len())
        .map(|id| {
            let answer = answer::frozen(dir, &ledger, id)?;
            Ok(score::judge(&ledger::open(dir, &ledger, id)?, &answer, 0.0, None))
        })
        .collect()
}

/// What a trial adds to the counts.
struct Trial {
    /// Whether there is nothing to find.
    null: bool,
    /// Whether it is among those whose class is counted.
    judged: bool,
    class_right: bool,
    exact: bool,
    wrong_class: bool,
    unanswered: bool,
    named: Vec<String>,
    /// What must stay the same for an answer that does not change.
    answer: Vec<String>,
}

fn row(trials: &[Trial]) -> Row {
    let count = |of: &dyn Fn(&Trial) -> bool| trials.iter().filter(|t| of(t)).count();
    Row {
        false_alarms: count(&|t| t.null && !t.named.is_empty()),
        nulls: count(&|t| t.null),
        class_right: count(&|t| t.judged && t.class_right),
        exact: count(&|t| t.judged && t.exact),
        judged: count(&|t| t.judged),
        wrong_class: count(&|t| t.judged && t.wrong_class),
        unanswered: count(&|t| t.unanswered),
        named: trials.iter().map(|t| t.answer.clone()).collect(),
        ..Row::default()
    }
}

fn loops(outcomes: &[Outcome]) -> Row {
    let trial = |o: &Outcome| {
        let named: Vec<String> = o.named.iter().map(|n| n.0.clone()).collect();
        Trial {
            null: matches!(o.stratum, Stratum::NullClean | Stratum::NullNasty),
            judged: big_and_visible(o),
            class_right: o.class_right,
            exact: o.exact,
            wrong_class: !named.is_empty() && !o.class_right,
            unanswered: o.verdict.starts_with("failed"),
            answer: named.clone(),
            named,
        }
    };
    row(&outcomes.iter().map(trial).collect::<Vec<_>>())
}

fn changes(outcomes: &[reference_bench::Outcome]) -> Row {
    let trial = |o: &reference_bench::Outcome| {
        let named: Vec<String> = o.named.iter().map(|n| n.0.clone()).collect();
        Trial {
            null: o.is_null(),
            judged: o.counts(),
            class_right: o.class_right(),
            exact: o.exact(),
            wrong_class: !named.is_empty() && !o.class_right(),
            unanswered: o.refused.is_some(),
            answer: named.clone(),
            named,
        }
    };
    row(&outcomes.iter().map(trial).collect::<Vec<_>>())
}

fn held_lengths(outcomes: &[held_length::Outcome]) -> Row {
    use held_length::Said;
    let trial = |o: &held_length::Outcome| Trial {
        null: o.said.is_none(),
        judged: o.said.is_some(),
        class_right: matches!(o.said, Some(Said::Named | Said::InClassOrSet)),
        exact: o.said == Some(Said::Named),
        wrong_class: o.said == Some(Said::Wrong),
        unanswered: false,
        named: o.named.clone(),
        // Without a name the verdict is the answer.
        answer: if o.named.is_empty() { vec![o.verdict.clone()] } else { o.named.clone() },
    };
    row(&outcomes.iter().map(trial).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use pam_diagnose::criteria::PAGE;

    #[test]
    fn each_stage_is_reached_by_one_kind_of_trials_or_by_none() {
        for stage in PAGE {
            let reached = Subject::ALL.iter().filter(|s| s.reaches(stage.title)).count();
            assert_eq!(reached, usize::from(!UNREACHED.contains(&stage.title)), "{}", stage.title);
        }
        for named in CHANGES.iter().chain(&HELD_LENGTHS).chain(&UNREACHED) {
            assert!(PAGE.iter().any(|s| s.title == *named), "no stage {named}");
        }
    }

    #[test]
    fn a_muscle_without_a_name_answers_by_its_verdict() {
        let outcome = |said, named: &[&str], verdict: &str| held_length::Outcome {
            said,
            named: named.iter().map(|n| (*n).to_owned()).collect(),
            verdict: verdict.into(),
            ..held_length::Outcome::default()
        };
        let row = held_lengths(&[
            outcome(None, &[], "consistent"),
            outcome(None, &["leak"], "explained"),
            outcome(Some(held_length::Said::Named), &["log-creep"], "explained"),
            outcome(Some(held_length::Said::Wrong), &["leak"], "explained"),
        ]);
        assert_eq!(
            (row.false_alarms, row.nulls, row.class_right, row.exact, row.judged, row.wrong_class),
            (1, 2, 1, 1, 2, 1)
        );
        assert_eq!(row.named, [["consistent"], ["leak"], ["log-creep"], ["leak"]]);
    }
}
