//! Two sets of a commercial muscle, each as one stock: the end effect, what the muscles share, and predictions of unseen contractions and
//! lengths with the stock beside those of single tables.

use crate::answer::run_limited;
use serde_json::Value;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// The sets: year, muscles.
const SETS: [(&str, &[&str]); 2] = [
    ("2022", &["83mm", "132mm", "182mm", "233mm", "281mm", "382mm"]),
    ("2021", &["13cm", "23cm", "27cm", "29cm", "30cm"]),
];

/// Beginning of the page.
const HEAD: &str = "# Muscles of one stock\n\nWritten by `cargo run --release -p trials -- stock -o DIR --page docs/src/stock.md`; nothing here is \
    typed by hand. Two sets of a commercial 10 mm fluidic muscle in eleven lengths, settled points of isometric pressure staircases \
    (`../shared/data`, not part of the project), are each diagnosed as one stock ([Fleets of muscles](fleets.md)).\n";

/// Head of the table of laws.
const LAWS: &str = "## End effect\n\nParameters with 95 % intervals (Student's t, unit of uncertainty: muscle). The error is that on muscles that \
    were left out, rms in percent of the largest force of each.\n\n\
    | set | law | parameter | jackknife, standard error | error | answer |\n| --- | --- | --- | --- | --- | --- |\n";

/// Head of the table of what is shared.
const SHARED: &str = "## What the muscles share\n\n\
    | set | contraction | force at the highest common pressure, N | emptying less filling, N | begins to pull at, kPa |\n| --- | --- | --- | --- | --- |\n";

/// Head of the table of predictions.
const UNSEEN: &str = "## Unseen contractions and unseen lengths\n\nMean error of the settled points in percent of the muscle's largest force (`host \
    evaluate --fit-geometry --fit-lengths --leave-out contractions`). \"Alone\": a table of the muscle without that contraction; the mean of the \
    other muscles' tables. \"Stock\": all muscles fitted together without what is predicted. \"Expected\": what the unknown length and zero of a mounting \
    (for a length, also the muscle's scale and rest length) alone would give, by the variances of the joint fit; no model can do better without \
    measuring them.\n\n\
    | set, muscle | contraction, alone | stock | expected | length, alone | stock | expected |\n| --- | --- | --- | --- | --- | --- | --- |\n";

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A command of the tool on all muscles of a set.
fn answer(
    host: &Path,
    data: &Path,
    set: (&str, &[&str]),
    command: &[&str],
    json: &Path,
) -> Result<Value, String> {
    let (year, muscles) = set;
    let mut c = Command::new(host);
    c.args(command);
    for muscle in muscles {
        c.arg("--muscle").arg(project().join(format!("examples/muscles/festo10-{year}-{muscle}.toml")));
    }
    c.arg(data.join(format!("aarl-festo-10mm-{year}/settled_points.csv")));
    c.arg("--quiet").arg("--json").arg(json);
    c.arg("--import").arg(project().join(format!("examples/imports/festo-{year}-settled.toml")));
    run_limited(&mut c, Duration::from_secs(1800))?;
    let text = std::fs::read_to_string(json).map_err(|e| e.to_string())?;
    serde_json::from_str(&text).map_err(|e| e.to_string())
}

fn number(v: &Value, path: &[&str]) -> Option<f64> {
    path.iter().try_fold(v, |v, k| v.get(k)).and_then(Value::as_f64)
}

fn shown(v: Option<f64>, decimals: usize) -> String {
    v.map_or("–".into(), |v| format!("{v:.decimals$}"))
}

fn list<'a>(v: &'a Value, path: &[&str]) -> &'a [Value] {
    path.iter().try_fold(v, |v, k| v.get(k)).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn laws(text: &mut String, year: &str, stock: &Value) {
    for c in list(stock, &["considered"]) {
        let word = |key: &str| c.get(key).and_then(Value::as_str).unwrap_or("");
        let unit = c.get("parameter").and_then(|p| p.get("unit")).and_then(Value::as_str).unwrap_or("");
        let decimals = if unit == "mm" { 1 } else { 4 };
        let interval = |key: &str| number(c, &["parameter", key]);
        let parameter = interval("value").map_or("–".to_owned(), |v| {
            format!(
                "{v:.decimals$} ({} to {}) {unit}",
                shown(interval("low"), decimals),
                shown(interval("high"), decimals)
            )
        });
        let answer = match (word("effect"), word("why_not")) {
            ("", _) => "–".to_owned(),
            (effect, "") => format!("**{effect}**"),
            (effect, why) => format!("{effect}: not named, {why}"),
        };
        let _ = writeln!(
            text,
            "| {year} | {} | {parameter} | {} | {} % | {answer} |",
            word("law"),
            shown(number(c, &["jackknife_std"]), decimals),
            shown(number(c, &["left_out_error_pct"]), 2)
        );
    }
}

fn shared(text: &mut String, year: &str, stock: &Value) {
    for p in list(stock, &["shared", "places"]) {
        let _ = writeln!(
            text,
            "| {year} | {} | {} | {} | {} |",
            shown(number(p, &["contraction"]), 3),
            shown(number(p, &["force_N"]), 1),
            shown(number(p, &["emptying_less_filling_N"]), 1),
            shown(number(p, &["onset_kPa"]), 0)
        );
    }
}

fn unseen(text: &mut String, year: &str, evaluated: &Value) {
    let mut sums = [(0.0, 0.0); 6];
    for m in list(evaluated, &["muscles"]) {
        let cells = [
            number(m, &["unseen_contractions", "table", "mean_pct"]),
            number(m, &["with_stock", "unseen_contractions", "mean_pct"]),
            number(m, &["with_stock", "contractions_expected_pct"]),
            number(m, &["unseen_length", "table", "mean_pct"]),
            number(m, &["with_stock", "unseen_length", "mean_pct"]),
            number(m, &["with_stock", "length_expected_pct"]),
        ];
        for (sum, cell) in sums.iter_mut().zip(cells) {
            if let Some(c) = cell {
                *sum = (sum.0 + c, sum.1 + 1.0);
            }
        }
        let name = m.get("muscle").and_then(Value::as_str).unwrap_or("");
        let cells = cells.map(|c| c.map_or("–".into(), |c| format!("{c:.2} %"))).join(" | ");
        let _ = writeln!(text, "| {year}, {name} | {cells} |");
    }
    let means = sums.map(|(s, n)| if n > 0.0 { format!("{:.2} %", s / n) } else { "–".into() });
    let _ = writeln!(text, "| **{year}, mean** | {} |", means.join(" | "));
}

/// Writes stock.md.
pub fn run(data: &Path, output: &Path, host: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(output)?;
    let mut parts = [LAWS.to_owned(), SHARED.to_owned(), UNSEEN.to_owned()];
    let mut run_in = String::new();
    for set in SETS {
        let stock = answer(host, data, set, &["diagnose"], &output.join(format!("stock-{}.json", set.0)))?;
        laws(&mut parts[0], set.0, &stock);
        shared(&mut parts[1], set.0, &stock);
        let low = |key: &str| shown(number(&stock, &["shared", "first_run_low", key]), 1);
        let _ = writeln!(
            run_in,
            "- {}: the first filling of a mounting pulls {} N less than the second (95 %: {} to {} N).",
            set.0,
            low("value"),
            low("low"),
            low("high")
        );
        let call = ["evaluate", "--fit-geometry", "--fit-lengths", "--leave-out", "contractions"];
        let evaluated = answer(host, data, set, &call, &output.join(format!("unseen-{}.json", set.0)))?;
        unseen(&mut parts[2], set.0, &evaluated);
    }
    let text = format!("{HEAD}\n{}\n{}\n{run_in}\n{}", parts[0], parts[1], parts[2]);
    std::fs::write(output.join("stock.md"), &text)?;
    println!("{text}");
    Ok(())
}
