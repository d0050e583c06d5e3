//! Two sets of a commercial muscle, each as one stock: the end effect, what the muscles share, and predictions of unseen contractions and
//! lengths with the stock beside those of single tables.

use crate::answer::run_limited;
use serde_json::Value;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Muscles that are diagnosed together.
struct Stock {
    label: &'static str,
    /// Year and name of each.
    muscles: Vec<(&'static str, &'static str)>,
    file: PathBuf,
    import: PathBuf,
}

/// The sets: year, muscles.
const SETS: [(&str, &[&str]); 2] = [
    ("2022", &["83mm", "132mm", "182mm", "233mm", "281mm", "382mm"]),
    ("2021", &["13cm", "23cm", "27cm", "29cm", "30cm"]),
];

/// Label of the stock of both sets.
const BOTH: &str = "both";

/// Columns of the file of both sets.
const COLUMNS: [&str; 8] =
    ["muscle", "rest_length_mm", "mounted_length_mm", "run", "direction", "t_s", "pressure_kPa", "force_N"];

/// Beginning of the page.
const INTRODUCTION: &str = "# Muscles of one stock\n\nWritten by `cargo run --release -p trials -- stock -o DIR --page docs/src/stock.md`; nothing here is \
    typed by hand. The data are two sets of a commercial 10 mm fluidic muscle in eleven lengths: settled points of isometric pressure staircases \
    (`../shared/data`, not part of the project). Each set is diagnosed as one stock, then both together ([Fleets of muscles](fleets.md)).\n";

/// Header of the table of laws.
const LAWS: &str = "## End effect\n\nParameters with 95 % intervals (Student's t, unit of uncertainty: muscle). The error is that on muscles that \
    were left out, rms in percent of the largest force of each.\n\n\
    | set | law | parameter | jackknife, standard error | error | answer |\n| --- | --- | --- | --- | --- | --- |\n";

/// Header of the tables of mountings.
const MOUNTINGS: &str = "## Mounted lengths\n\nEach mounting is predicted without its own recordings; its muscle's other mountings are fitted. One number of its own \
    is fitted to the recordings of one direction and tried on those of the other. Root mean square over the mountings, N; in parentheses the root mean square of \
    the number. The published description states the mounted lengths to within a millimetre, by tape measure. A zero of the pressure sensor moves the curves as a \
    length does; it counts as a cause up to 2.5 % of the highest pressure, which is the accuracy of such sensors.\n\n\
    | set | mountings | nothing of its own | length | zero of the load cell | zero of the pressure sensor | scale of the load cell | answer |\n\
    | --- | --- | --- | --- | --- | --- | --- | --- |\n";

/// Header of the table of mountings by muscle.
const BY_MUSCLE: &str = "| set, muscle | nothing of its own | length | change |\n| --- | --- | --- | --- |\n";

/// Header of the table of what is shared.
const SHARED: &str = "## What the muscles share\n\n\
    | set | contraction | force at the highest common pressure, N | emptying less filling, N | begins to pull at, kPa |\n| --- | --- | --- | --- | --- |\n";

/// Header of the table of predictions.
const UNSEEN: &str = "## Unseen contractions and unseen lengths\n\nMean error of the settled points in percent of the muscle's largest force (`host \
    evaluate --fit-geometry --fit-lengths --leave-out contractions`). \"Alone\": a table of the muscle without that contraction; the mean of the \
    other muscles' tables. \"Stock\": all muscles fitted together without what is predicted. \"Expected\": what the unknown length and zero of a mounting \
    (for a length, also the muscle's scale and rest length) alone would give, by the variances of the joint fit; no model can do better without \
    measuring them.\n\n\
    | set, muscle | contraction, alone | stock | expected | length, alone | stock | expected |\n| --- | --- | --- | --- | --- | --- | --- |\n";

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The sets, and both together in one file of `output`.
fn stocks(data: &Path, output: &Path) -> Result<Vec<Stock>, String> {
    let settled = |year: &str| data.join(format!("aarl-festo-10mm-{year}/settled_points.csv"));
    let import = |year: &str| project().join(format!("examples/imports/festo-{year}-settled.toml"));
    let named = |(year, muscles): &(&'static str, &'static [&'static str])| {
        muscles.iter().map(|m| (*year, *m)).collect::<Vec<_>>()
    };
    let mut stocks: Vec<Stock> = SETS
        .iter()
        .map(|set| Stock { label: set.0, muscles: named(set), file: settled(set.0), import: import(set.0) })
        .collect();
    let file = output.join("both-sets.csv");
    let mut text = COLUMNS.join(",") + "\n";
    for (year, _) in SETS {
        append(&mut text, year, &settled(year))?;
    }
    std::fs::write(&file, text).map_err(|e| e.to_string())?;
    // The description of the set that names its muscles reads this file, too.
    stocks.push(Stock {
        label: BOTH,
        muscles: SETS.iter().flat_map(named).collect(),
        file,
        import: import("2021"),
    });
    Ok(stocks)
}

/// Appends the rows of a set. Where it has no names, a muscle is named by its rest length.
fn append(text: &mut String, year: &str, file: &Path) -> Result<(), String> {
    let rows = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut rows = rows.lines();
    let header: Vec<&str> = rows.next().unwrap_or("").split(',').collect();
    let places = COLUMNS.map(|column| header.iter().position(|h| *h == column));
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        let cell = |k: usize| places[k].and_then(|p| cells.get(p)).copied();
        let name = cell(0).map_or_else(|| format!("{}mm", cell(1).unwrap_or("")), str::to_owned);
        let _ = write!(text, "festo10-{year}-{name}");
        for (k, column) in COLUMNS.iter().enumerate().skip(1) {
            let value = cell(k).ok_or_else(|| format!("{}: no {column}", file.display()))?;
            let _ = write!(text, ",{value}");
        }
        text.push('\n');
    }
    Ok(())
}

/// A command of the tool on all muscles of a stock.
fn answer(host: &Path, stock: &Stock, command: &[&str], json: &Path) -> Result<Value, String> {
    let mut c = Command::new(host);
    c.args(command);
    for (year, muscle) in &stock.muscles {
        c.arg("--muscle").arg(project().join(format!("examples/muscles/festo10-{year}-{muscle}.toml")));
    }
    c.arg(&stock.file).arg("--quiet").arg("--json").arg(json);
    c.arg("--import").arg(&stock.import);
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

/// The causes of the errors of left-out mountings, in the order of the table.
const CAUSES: [&str; 4] = ["displacement-offset", "force-offset", "gauge-offset", "force-gain"];

fn mountings(text: &mut String, label: &str, stock: &Value) {
    let unseen = stock.get("unseen_mountings");
    let Some(unseen) = unseen.filter(|u| u.is_object()) else { return };
    let causes = list(unseen, &["causes"]);
    let of = |effect: &str| {
        let is_it = |c: &&Value| c.get("effect").and_then(Value::as_str) == Some(effect);
        let Some(cause) = causes.iter().find(is_it) else { return "–".to_owned() };
        let unit = cause.get("unit").and_then(Value::as_str).unwrap_or("");
        let size = number(cause, &["size"]);
        let size = match unit {
            "" => format!("{} %", shown(size.map(|s| 100.0 * s), 1)),
            "kPa" => format!("{} kPa", shown(size, 0)),
            _ => format!("{} {unit}", shown(size, 1)),
        };
        format!("{} ({size})", shown(number(cause, &["error_N"]), 2))
    };
    let is_named = |m: &&Value| m.get("effect").and_then(Value::as_str) == Some(CAUSES[0]);
    let answer = match list(stock, &["missing"]).iter().find(is_named) {
        Some(named) => {
            let others: Vec<&str> =
                list(named, &["confusable_with"]).iter().filter_map(Value::as_str).collect();
            let others =
                if others.is_empty() { String::new() } else { format!(", or {}", others.join(", ")) };
            format!("**{}**{others}", CAUSES[0])
        }
        None => format!("not named: {}", unseen.get("why_not").and_then(Value::as_str).unwrap_or("")),
    };
    let causes = CAUSES.map(of).join(" | ");
    let _ = writeln!(
        text,
        "| {label} | {} | {} | {causes} | {answer} |",
        shown(number(unseen, &["mountings"]), 0),
        shown(number(unseen, &["error_N"]), 2)
    );
}

/// Errors on the mountings of a muscle that were left out, N.
struct OwnMountings<'a> {
    muscle: &'a str,
    before: f64,
    with_length: f64,
}

impl OwnMountings<'_> {
    /// Percent.
    fn change(&self) -> f64 {
        100.0 * (self.with_length / self.before - 1.0)
    }

    /// Whether a length lowers the error by 35 % or more.
    fn is_lower(&self) -> bool {
        self.change() <= -35.0
    }
}

/// The mountings of each muscle.
fn by_muscle(stock: &Value) -> Vec<OwnMountings<'_>> {
    let of = |m: &'_ Value, key: &str| number(m, &["unseen_mountings", key]);
    let muscles = list(stock, &["muscles"]).iter();
    let own = muscles.filter_map(|m| {
        let muscle = m.get("muscle").and_then(Value::as_str).unwrap_or("");
        Some(OwnMountings { muscle, before: of(m, "error_N")?, with_length: of(m, "with_length_N")? })
    });
    own.collect()
}

/// What a stock answers to its muscles.
pub struct StockAnswer {
    pub muscles: usize,
    /// Effects that are named, and for how many muscles: one between muscles for all, the mounted lengths where they lower the error by 35 % or
    /// more.
    named: Vec<(String, usize)>,
}

impl StockAnswer {
    /// For how many muscles one of some effects is named.
    pub fn muscles_of(&self, effects: &[&str]) -> usize {
        self.named.iter().filter(|n| effects.contains(&n.0.as_str())).map(|n| n.1).max().unwrap_or(0)
    }
}

/// The answer to the muscles of both sets together.
pub fn answer_of_both_sets(data: &Path, output: &Path, host: &Path) -> Result<StockAnswer, String> {
    let stock = stocks(data, output)?.pop().ok_or("no stock")?;
    let diagnosed = answer(host, &stock, &["diagnose"], &output.join("stock-both.json"))?;
    let lower = by_muscle(&diagnosed).iter().filter(|m| m.is_lower()).count();
    let muscles = stock.muscles.len();
    let effects = list(&diagnosed, &["missing"]).iter().filter_map(|m| m.get("effect")?.as_str());
    let named = effects.map(|e| (e.to_owned(), if e == CAUSES[0] { lower } else { muscles })).collect();
    Ok(StockAnswer { muscles, named })
}

/// Writes stock.md.
pub fn run(data: &Path, output: &Path, host: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(output)?;
    let mut parts = [LAWS.to_owned(), MOUNTINGS.to_owned(), SHARED.to_owned(), UNSEEN.to_owned()];
    let mut muscles = BY_MUSCLE.to_owned();
    let (mut counts, mut run_in) = (String::new(), String::new());
    for stock in stocks(data, output)? {
        let label = stock.label;
        let diagnosed = answer(host, &stock, &["diagnose"], &output.join(format!("stock-{label}.json")))?;
        laws(&mut parts[0], label, &diagnosed);
        mountings(&mut parts[1], label, &diagnosed);
        let own = by_muscle(&diagnosed);
        for m in &own {
            let _ = writeln!(
                muscles,
                "| {label}, {} | {:.2} | {:.2} | {:.0} % |",
                m.muscle,
                m.before,
                m.with_length,
                m.change()
            );
        }
        let _ = writeln!(
            counts,
            "- {label}: a length for each mounting lowers the error by 35 % or more on {} of {} muscles.",
            own.iter().filter(|m| m.is_lower()).count(),
            own.len()
        );
        shared(&mut parts[2], label, &diagnosed);
        let low = |key: &str| shown(number(&diagnosed, &["shared", "first_run_low", key]), 1);
        let _ = writeln!(
            run_in,
            "- {label}: the first filling of a mounting pulls {} N less than the second (95 %: {} to {} N).",
            low("value"),
            low("low"),
            low("high")
        );
        // Unseen contractions are compared with single tables of the same set.
        if label != BOTH {
            let call = ["evaluate", "--fit-geometry", "--fit-lengths", "--leave-out", "contractions"];
            let evaluated = answer(host, &stock, &call, &output.join(format!("unseen-{label}.json")))?;
            unseen(&mut parts[3], label, &evaluated);
        }
    }
    let [laws, mountings, shared, unseen] = parts;
    let text =
        format!("{INTRODUCTION}\n{laws}\n{mountings}\n{muscles}\n{counts}\n{shared}\n{run_in}\n{unseen}");
    std::fs::write(output.join("stock.md"), &text)?;
    println!("{text}");
    Ok(())
}
