//! The tool on unchanged real recordings: isometric pressure staircases of a commercial 10 mm muscle, two sets, eleven lengths. Its
//! answers are compared with the published description of the recordings, and its predictions with the laboratory's own formula.

use crate::answer::{Answer, run_limited};
use crate::festo_comparison::comparison;
use crate::festo_history;
use crate::festo_tables;
use crate::queue::in_order;
use crate::stock;
use crate::tool;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Import, Reader};
use pam_diagnose::history::table_unseen::{LeftOut, error_of_a_millimetre, unseen_by_table};
use serde_json::Value;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A set of recordings: its folder's year, its recordings, and the descriptions of its muscles.
struct Set {
    year: &'static str,
    muscles: &'static [(&'static str, &'static str)],
}

const SETS: [Set; 2] = [
    Set {
        year: "2022",
        muscles: &[
            ("83mm", "festo10_cut100mm"),
            ("132mm", "festo10_cut150mm"),
            ("182mm", "festo10_cut200mm"),
            ("233mm", "festo10_cut250mm"),
            ("281mm", "festo10_cut300mm"),
            ("382mm", "festo10_cut400mm"),
        ],
    },
    Set {
        year: "2021",
        muscles: &[
            ("13cm", "festo10_rest120mm_13cm"),
            ("23cm", "festo10_rest219mm_23cm"),
            ("27cm", "festo10_rest257mm_27cm"),
            ("29cm", "festo10_rest281mm_29cm"),
            ("30cm", "festo10_rest281mm_30cm"),
        ],
    },
];

/// The two forms of the recordings: as the instruments wrote them, and the mean of each step after the oscillation has decayed.
const FORMS: [(&str, &str); 2] =
    [("staircase", "recordings with valve pulses"), ("settled", "settled points, one per step")];

/// A muscle and its answer.
struct Diagnosed {
    label: String,
    answer: Result<(Answer, Value), String>,
}

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn description(year: &str, muscle: &str) -> PathBuf {
    project().join(format!("examples/muscles/festo10-{year}-{muscle}.toml"))
}

fn import(year: &str, what: &str) -> PathBuf {
    project().join(format!("examples/imports/festo-{year}-{what}.toml"))
}

fn json(path: &Path) -> Result<Value, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_str(&text).map_err(|e| e.to_string())
}

/// A muscle of a set, in one form of its recordings.
type Case = (&'static str, &'static str, &'static str, &'static str);

fn diagnose(data: &Path, output: &Path, host: &Path, (year, muscle, file, form): Case) -> Diagnosed {
    let answer = || {
        let json_file = output.join(format!("{year}-{muscle}-{form}.json"));
        let file = if form == "settled" { "settled_points" } else { file };
        let recording = data.join(format!("aarl-festo-10mm-{year}")).join(format!("{file}.csv"));
        let mut c = tool::diagnose(host, &description(year, muscle), &[recording], &json_file);
        c.arg("--import").arg(import(year, form));
        run_limited(&mut c, Duration::from_secs(300))?;
        let value = json(&json_file)?;
        Ok((serde_json::from_value(value.clone()).map_err(|e| e.to_string())?, value))
    };
    Diagnosed { label: format!("{year}, {muscle}"), answer: answer() }
}

fn evaluate(data: &Path, output: &Path, host: &Path, set: &Set) -> Result<Value, String> {
    let answer = output.join(format!("evaluate-{}.json", set.year));
    let mut c = Command::new(host);
    c.arg("evaluate").arg("--quiet");
    for (muscle, _) in set.muscles {
        c.arg("--muscle").arg(description(set.year, muscle));
    }
    c.arg("--import").arg(import(set.year, "settled")).args(["--fit-geometry", "--fit-lengths"]);
    c.args(["--published", "bolen-10mm", "--json"]).arg(&answer);
    c.arg(data.join(format!("aarl-festo-10mm-{}", set.year)).join("settled_points.csv"));
    run_limited(&mut c, Duration::from_secs(600))?;
    json(&answer)
}

/// Beginning of the page.
const INTRODUCTION: &str = "# Real recordings of a commercial muscle\n\nWritten by `cargo run --release -p trials -- festo -o DIR --page docs/src/festo.md`; \
    nothing here is typed by hand. The recordings are isometric pressure staircases of a commercial 10 mm fluidic muscle: two sets of one \
    laboratory, eleven lengths, `../shared/data` (not part of the project). The program reads the columns only; its answers are compared \
    with the published description of the recordings. The muscle is never moved under pressure, so strokes, speeds and viscous friction \
    cannot be judged.\n";

/// Columns of the diagnoses of one form.
const ANSWERS: &str = "| set, muscle | verdict | named (probability, share explained) | where | held-out rows before → after, N |\n";

/// Section on held-out recordings, and the header of its table.
const HELD_OUT: &str = "## Held-out recordings\n\nMean error of the settled points, in percent of the blocked force at the highest pressure. Each \
    run, each contraction, and each length is predicted from all others (`host evaluate`). The laboratory's published formula is compared \
    on the rows of the held-out runs; its coefficients were fitted to its own recordings, these included.\n\n\
    | set, muscle | held-out runs | the lab's formula | held-out contractions | held-out length | end effect by the other lengths, mm |\n";

/// Diagnoses every muscle, and writes festo.md.
pub fn run(data: &Path, output: &Path, host: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(output)?;
    let cases: Vec<Case> = FORMS
        .iter()
        .flat_map(|f| SETS.iter().flat_map(|s| s.muscles.iter().map(|m| (s.year, m.0, m.1, f.0))))
        .collect();
    let diagnosed = in_order(&cases, |c| Ok(diagnose(data, output, host, *c)))?;
    let stock = stock::answer_of_both_sets(data, output, host)?;
    let mut text = INTRODUCTION.to_owned();
    let _ = writeln!(text, "\n{}", tables_section(data)?.trim_end());
    let per_form = cases.len() / FORMS.len();
    for ((_, words), diagnosed) in FORMS.iter().zip(diagnosed.chunks(per_form)) {
        let _ = writeln!(text, "\n## Diagnosis: {words}\n\n{ANSWERS}| --- | --- | --- | --- | --- |");
        for a in diagnosed {
            line(&mut text, a);
        }
        comparison(&mut text, &answered(diagnosed), &stock);
    }
    let _ = writeln!(text, "\n{}", memory_section(&cases[per_form..], &diagnosed[per_form..]).trim_end());
    let _ = writeln!(text, "\n{HELD_OUT}| --- | --- | --- | --- | --- | --- |");
    for set in &SETS {
        match evaluate(data, output, host, set) {
            Ok(e) => errors(&mut text, set.year, &e),
            Err(e) => {
                let _ = writeln!(text, "| {} | failed: {} | | | | |", set.year, e.replace('|', "/"));
            }
        }
    }
    std::fs::write(output.join("festo.md"), &text)?;
    println!("{text}");
    Ok(())
}

/// The section on the memory of the bladder, from answers to settled points.
fn memory_section(cases: &[Case], diagnosed: &[Diagnosed]) -> String {
    let answers: Vec<festo_history::MuscleAnswer<'_>> = cases
        .iter()
        .zip(diagnosed)
        .map(|(case, a)| festo_history::MuscleAnswer {
            year: case.0,
            label: &a.label,
            answer: a.answer.as_ref().ok().map(|(_, whole)| whole),
        })
        .collect();
    festo_history::section(&answers)
}

/// The recordings of one muscle as recorded and settled, with its description.
fn recordings(
    data: &Path,
    (year, muscle, file, _): Case,
) -> Result<(Campaign, Campaign, MuscleDescription), String> {
    let words = |e: pam_data::error::Error| e.to_string();
    let described = MuscleDescription::read(description(year, muscle)).map_err(words)?;
    let read = |file: &str, what: &str| {
        let import = Import::read(import(year, what)).map_err(words)?;
        let path = data.join(format!("aarl-festo-10mm-{year}")).join(format!("{file}.csv"));
        Reader::of(&described).import(Some(&import)).campaign([path]).map_err(words)
    };
    let (recorded, settled) = (read(file, "staircase")?, read("settled_points", "settled")?);
    Ok((recorded, settled, described))
}

/// Errors of unseen runs and contractions of one muscle through the table.
fn unseen(data: &Path, case: Case) -> Result<festo_tables::Unseen, String> {
    let words = |e: pam_data::error::Error| e.to_string();
    let (recorded, settled, described) = recordings(data, case)?;
    let by_table = |left_out| {
        unseen_by_table(&settled, &recorded, &described, left_out)
            .map_err(words)?
            .ok_or_else(|| "no staircases with repeated runs".to_owned())
    };
    let [contractions, _] = by_table(LeftOut::Mountings)?;
    let millimetre_pct = error_of_a_millimetre(&settled, &described).map_err(words)?.unwrap_or(f64::NAN);
    Ok(festo_tables::Unseen { runs: by_table(LeftOut::Runs)?, contractions, millimetre_pct })
}

/// The section on unseen runs through the table.
fn tables_section(data: &Path) -> Result<String, String> {
    let cases: Vec<Case> =
        SETS.iter().flat_map(|s| s.muscles.iter().map(|m| (s.year, m.0, m.1, ""))).collect();
    let row =
        |c: &Case| Ok(festo_tables::Row { label: format!("{}, {}", c.0, c.1), errors: unseen(data, *c) });
    Ok(festo_tables::section(&in_order(&cases, row)?))
}

/// Writes the section on unseen runs through the table into `page`.
pub fn run_tables(data: &Path, output: &Path, page: Option<&Path>) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(output)?;
    let section = tables_section(data)?;
    std::fs::write(output.join("festo-tables.md"), &section)?;
    if let Some(page) = page {
        let old = std::fs::read_to_string(page)?;
        std::fs::write(page, festo_history::replaced(&old, festo_tables::HEADING, &section))?;
    }
    println!("{section}");
    Ok(())
}

/// Diagnoses settled points only, and writes the section on the memory of the bladder into `page`.
pub fn run_history(
    data: &Path,
    output: &Path,
    host: &Path,
    page: Option<&Path>,
) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(output)?;
    let cases: Vec<Case> =
        SETS.iter().flat_map(|s| s.muscles.iter().map(|m| (s.year, m.0, m.1, "settled"))).collect();
    let diagnosed = in_order(&cases, |c| Ok(diagnose(data, output, host, *c)))?;
    let section = memory_section(&cases, &diagnosed);
    if let Some(page) = page {
        let old = std::fs::read_to_string(page)?;
        std::fs::write(page, festo_history::replaced(&old, festo_history::HEADING, &section))?;
    }
    println!("{section}");
    Ok(())
}

fn line(text: &mut String, diagnosed: &Diagnosed) {
    let (a, whole) = match &diagnosed.answer {
        Ok(a) => a,
        Err(e) => {
            let _ = writeln!(text, "| {} | failed: {} | | | |", diagnosed.label, e.replace('|', "/"));
            return;
        }
    };
    let of = |v: &Value, key: &str| v.get(key).and_then(Value::as_f64).unwrap_or(f64::NAN);
    let entries = whole.get("missing").and_then(Value::as_array).cloned().unwrap_or_default();
    let named: Vec<String> = a
        .missing
        .iter()
        .zip(&entries)
        .map(|(m, v)| {
            let share = 100.0 * of(v, "share_explained");
            format!("{} ({:.2}, {share:.0} %)", m.effect, m.probability.unwrap_or(0.0))
        })
        .collect();
    let places: Vec<&str> = whole
        .get("where")
        .and_then(Value::as_array)
        .map(|w| w.iter().take(2).filter_map(|r| r.get("words").and_then(Value::as_str)).collect())
        .unwrap_or_default();
    let held = whole.get("held_out").cloned().unwrap_or_default();
    let _ = writeln!(
        text,
        "| {} | {} | {} | {} | {:.2} → {:.2} |",
        diagnosed.label,
        a.verdict,
        named.join(", "),
        places.join("; "),
        of(&held, "rms_before_N"),
        of(&held, "rms_after_N")
    );
}

/// The answers that there are, with label and whole JSON.
fn answered(diagnosed: &[Diagnosed]) -> Vec<(&str, &Answer, &Value)> {
    diagnosed.iter().filter_map(|a| a.answer.as_ref().ok().map(|(x, v)| (a.label.as_str(), x, v))).collect()
}

fn errors(text: &mut String, year: &str, evaluated: &Value) {
    let none = Vec::new();
    let muscles = evaluated.get("muscles").and_then(Value::as_array).unwrap_or(&none);
    let mut sums = [(0.0, 0); 4];
    for m in muscles {
        let percent = |path: &[&str]| path.iter().try_fold(m, |v, k| v.get(k)).and_then(Value::as_f64);
        let cells = [
            percent(&["unseen_runs", "table", "mean_pct"]),
            percent(&["unseen_runs", "published", "mean_pct"]),
            percent(&["unseen_contractions", "table", "mean_pct"]),
            percent(&["unseen_length", "table", "mean_pct"]),
        ];
        for (sum, c) in sums.iter_mut().zip(cells) {
            if let Some(c) = c {
                *sum = (sum.0 + c, sum.1 + 1);
            }
        }
        let name = m.get("muscle").and_then(Value::as_str).unwrap_or("");
        let shown = cells.map(|c| c.map_or("–".into(), |c| format!("{c:.2} %"))).join(" | ");
        let end = percent(&["unseen_length", "end_effect_mm"]).map_or("–".into(), |e| format!("{e:.1}"));
        let _ = writeln!(text, "| {year}, {name} | {shown} | {end} |");
    }
    let means = sums.map(|(s, n)| if n > 0 { format!("{:.2} %", s / f64::from(n)) } else { "–".into() });
    let _ = writeln!(text, "| **{year}, mean** | {} | |", means.join(" | "));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::festo_comparison::COMPARISON;

    #[test]
    fn the_page_in_the_book_has_these_texts() {
        use festo_history::{DOCUMENTED, END_EFFECT, HEADING, INTRODUCTION as MEMORY};
        let texts = [INTRODUCTION, ANSWERS, COMPARISON, HEADING, MEMORY, DOCUMENTED, END_EFFECT, HELD_OUT];
        crate::book::contains("festo.md", &texts);
    }

    #[test]
    fn every_muscle_and_import_is_among_the_examples() {
        for set in &SETS {
            assert!(import(set.year, "staircase").exists() && import(set.year, "settled").exists());
            assert!(set.muscles.iter().all(|m| description(set.year, m.0).exists()), "{}", set.year);
        }
    }
}
