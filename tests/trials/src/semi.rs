//! Semi-synthetic trials: effects put into real recordings, whose own physics is not synthetic.
//!
//! The recordings are the isometric pressure staircases of the 10 mm fluidic muscle of November 2022 (six muscles, four
//! mountings, three runs each). Only effects that need no knowledge of the muscle are added: they act on the columns. Each muscle is
//! diagnosed as it is and with each effect; only the change of the answer counts.

use crate::answer::Answer;
use crate::names::class;
use crate::tool;
use rayon::prelude::*;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use virtual_bench::rng::Rng;
use virtual_bench::rubber::{Branches, Relaxation};

/// A row: time (s), pressure (Pa), contraction stroke (m), force (N).
type Row = [f64; 4];

/// One run of the lab.
#[derive(Debug, Clone)]
struct Run {
    name: String,
    rows: Vec<Row>,
}

/// One muscle with all of its runs in the order in which they are taken to have happened.
#[derive(Debug, Clone)]
struct Muscle {
    name: String,
    rest_length_mm: f64,
    runs: Vec<Run>,
}

/// What is put in.
const EFFECTS: [&str; 9] = [
    "force-offset",
    "force-drift",
    "force-gain",
    "cross-talk",
    "gauge-gain",
    "sensor-delay",
    "pressure-sensor-lag",
    "log-creep",
    "coulomb-friction",
];

fn column(header: &str, name: &str) -> Result<usize, String> {
    header.split(',').position(|c| c.trim() == name).ok_or_else(|| format!("no column {name}"))
}

fn read(data: &Path) -> Result<Vec<Muscle>, Box<dyn Error>> {
    let dir = data.join("aarl-festo-10mm-2022");
    let table =
        std::fs::read_to_string(dir.join("runs.csv")).map_err(|e| format!("{}: {e}", dir.display()))?;
    let mut lines = table.lines();
    let header = lines.next().unwrap_or("");
    let at = |name| column(header, name);
    let (file, rest, mounted, percent, run) = (
        at("file")?,
        at("rest_length_mm")?,
        at("mounted_length_mm")?,
        at("nominal_relative_contraction_percent")?,
        at("run")?,
    );
    let mut muscles: Vec<Muscle> = Vec::new();
    let mut clock = 0.0;
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| {
            cells.get(i).and_then(|c| c.parse::<f64>().ok()).ok_or("a number is missing in runs.csv")
        };
        let name = cells.get(file).ok_or("a file name is missing in runs.csv")?.trim_end_matches(".csv");
        if muscles.last().is_none_or(|m| m.name != name) {
            muscles.push(Muscle { name: name.into(), rest_length_mm: number(rest)?, runs: Vec::new() });
            clock = 0.0;
        }
        let stroke = (number(rest)? - number(mounted)?) * 1e-3;
        let text = std::fs::read_to_string(dir.join(format!("{name}.csv")))?;
        let (wanted_percent, wanted_run) = (number(percent)?, number(run)?);
        let mut rows = Vec::new();
        for (i, l) in text.lines().skip(1).enumerate() {
            let c: Vec<&str> = l.split(',').collect();
            let value = |i: usize| c.get(i).and_then(|v| v.parse::<f64>().ok());
            // Every fifth row of 106 Hz: the valve's ringing is not the question here.
            if i % 5 != 0 || value(0) != Some(wanted_percent) || value(1) != Some(wanted_run) {
                continue;
            }
            if let (Some(t), Some(p), Some(f)) = (value(3), value(4), value(5))
                && rows.last().is_none_or(|r: &Row| clock + t > r[0])
            {
                rows.push([clock + t, p * 1e3, stroke, f]);
            }
        }
        if rows.len() > 20 {
            let label = format!(
                "{:02}_{wanted_percent:.0}percent_run{wanted_run:.0}",
                muscles.last().map_or(0, |m| m.runs.len()) + 1
            );
            clock = rows.last().map_or(clock, |r| r[0]) + 60.0;
            if let Some(m) = muscles.last_mut() {
                m.runs.push(Run { name: label, rows });
            }
        }
    }
    Ok(muscles)
}

/// Put an effect of a size (part of the largest force) into all runs.
fn inject(muscle: &Muscle, effect: &str, size: f64) -> Muscle {
    let mut m = muscle.clone();
    let rows = || muscle.runs.iter().flat_map(|r| &r.rows);
    let top = rows().map(|r| r[3]).fold(0.0, f64::max);
    let pressure = rows().map(|r| r[1]).fold(1.0, f64::max);
    let end = rows().map(|r| r[0]).fold(1.0, f64::max);
    let amount = size * top;
    let mut creep =
        Branches::new(Some(Relaxation { strength: size / 6.0, fastest: 0.3, branches: 8, exponent: 0.0 }));
    let (mut lagged, mut twice, mut slow, mut bristle): (Option<f64>, f64, Option<f64>, f64) =
        (None, 0.0, None, 0.0);
    let (mut last_time, mut last_pressure) = (0.0, 0.0);
    for row in m.runs.iter_mut().flat_map(|r| &mut r.rows) {
        let dt = (row[0] - last_time).clamp(1e-4, 60.0);
        let dp = row[1] - last_pressure;
        (last_time, last_pressure) = (row[0], row[1]);
        match effect {
            "force-offset" => row[3] += amount,
            "force-drift" => row[3] += amount * (1.0 - (-3.0 * row[0] / end).exp()),
            "force-gain" => row[3] *= 1.0 + size,
            "cross-talk" => row[3] += amount * row[1] / pressure,
            "gauge-gain" => row[1] *= 1.0 + size,
            "sensor-delay" => {
                // Two lags of 5 % of the second per percent: a heavy filter.
                let blend = 1.0 - (-dt / (5.0 * size)).exp();
                let first = lagged.unwrap_or(row[3]);
                lagged = Some(first + (row[3] - first) * blend);
                twice += (lagged.unwrap_or(first) - twice) * blend;
                row[3] = twice;
            }
            "pressure-sensor-lag" => {
                let before = slow.unwrap_or(row[1]);
                slow = Some(before + (row[1] - before) * (1.0 - (-dt / (8.0 * size)).exp()));
                row[1] = slow.unwrap_or(before);
            }
            "log-creep" => row[3] -= creep.lose(row[3], dt),
            "coulomb-friction" => {
                let way = if dp > 0.0 { 1.0 } else { -1.0 };
                bristle = way + (bristle - way) * (-dp.abs() / 8e3).exp();
                // A slack muscle's guide does not move.
                row[3] -= amount * bristle * (row[3] / (0.02 * top)).clamp(0.0, 1.0);
            }
            _ => {}
        }
    }
    m
}

fn write(dir: &Path, m: &Muscle) -> Result<Vec<PathBuf>, String> {
    std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let put =
        |path: PathBuf, text: String| std::fs::write(&path, text).map(|()| path).map_err(|e| e.to_string());
    let description = format!(
        "name = \"{}\"\nkind = \"contractile\"\nrest_length_mm = {}\nbraid_angle_deg = 61.4\n\
         bladder_outer_diameter_mm = 10.0\nbladder_wall_mm = 1.8\n",
        m.name, m.rest_length_mm
    );
    put(dir.join("muscle.toml"), description)?;
    m.runs
        .iter()
        .map(|run| {
            let mut text = String::from("time_s,pressure_kPa,displacement_mm,force_N\n");
            for r in &run.rows {
                let _ = writeln!(text, "{:.4},{:.4},{:.4},{:.4}", r[0], r[1] * 1e-3, r[2] * 1e3, r[3]);
            }
            put(dir.join(format!("{}.csv", run.name)), text)
        })
        .collect()
}

fn names(a: &Answer) -> Vec<&str> {
    a.missing.iter().map(|m| m.effect.as_str()).collect()
}

/// Beginning of the page, and the header of its table.
const INTRODUCTION: &str = "# Trials on real recordings\n\nWritten by `cargo run --release -p trials -- semi -o DIR --page \
    docs/src/proof-real.md`; nothing here is typed by hand. Effects are added to the columns of real recordings: isometric pressure \
    staircases of a commercial 10 mm muscle, six lengths, four mountings, three runs each (`../shared/data`). Their own physics is not \
    synthetic. \"New\" marks names that the unchanged recordings did not get. The muscle is never moved under pressure, so speed, viscous \
    friction and strokes cannot be judged. The recordings have a misfit of their own: a gap between filling and emptying that grows with \
    contraction, a low first run, mounting errors. It is larger than most of the added effects.\n\n\
    | muscle | effect | size, % of largest force | verdict | named | new | class right | in the set |\n";

/// Make the recordings, ask, and write semi.md.
pub fn run(data: &Path, output: &Path, host: &Path) -> Result<(), Box<dyn Error>> {
    let muscles = read(data)?;
    let mut r = Rng::new(2022);
    let mut cases: Vec<(usize, Option<(&str, f64)>)> = Vec::new();
    for i in 0..muscles.len() {
        cases.push((i, None));
        cases.extend(EFFECTS.iter().map(|e| (i, Some((*e, r.log_range(0.02, 0.06))))));
    }
    let answers: Result<Vec<Result<Answer, String>>, String> = cases
        .par_iter()
        .with_max_len(1)
        .map(|&(i, effect)| {
            let m = effect.map_or_else(|| muscles[i].clone(), |(e, size)| inject(&muscles[i], e, size));
            let dir = output.join(&muscles[i].name).join(effect.map_or("as-it-is", |e| e.0));
            let files = write(&dir, &m)?;
            Ok(tool::answer(host, &dir, &files))
        })
        .collect();
    let answers = answers?;
    let mut text = format!("{INTRODUCTION}| --- | --- | --- | --- | --- | --- | --- | --- |\n");
    let (mut right, mut in_set, mut asked) = (0, 0, 0);
    let mut plain: Vec<String> = Vec::new();
    for ((i, effect), answer) in cases.iter().zip(&answers) {
        let label = effect.map_or("(unchanged)".to_string(), |e| e.0.to_string());
        let a = match answer {
            Ok(a) => a,
            Err(e) => {
                let _ = writeln!(
                    text,
                    "| {} | {label} | | failed: {} | | | | |",
                    muscles[*i].name,
                    e.replace('|', "/")
                );
                asked += usize::from(effect.is_some());
                continue;
            }
        };
        let said: Vec<String> = names(a).iter().map(|n| (*n).to_string()).collect();
        let Some((name, size)) = effect else {
            let _ = writeln!(
                text,
                "| {} | {label} | | {} | {} | | | |",
                muscles[*i].name,
                a.verdict,
                said.join(", ")
            );
            plain = said;
            continue;
        };
        asked += 1;
        let new: Vec<&String> = said.iter().filter(|n| !plain.contains(n)).collect();
        let hit = new.iter().any(|n| class(n) == class(name));
        let listed =
            a.missing.iter().any(|m| m.effect == *name || m.confusable_with.iter().any(|c| c == name));
        right += usize::from(hit);
        in_set += usize::from(listed);
        let new = new.iter().map(|n| n.as_str()).collect::<Vec<_>>().join(", ");
        let yes = |b: bool| if b { "yes" } else { "no" };
        let _ = writeln!(
            text,
            "| {} | {label} | {:.1} | {} | {} | {new} | {} | {} |",
            muscles[*i].name,
            100.0 * size,
            a.verdict,
            said.join(", "),
            yes(hit),
            yes(listed)
        );
    }
    let _ = writeln!(
        text,
        "\nClass right and new: {right} of {asked}. Effect in the reported set: {in_set} of {asked}."
    );
    std::fs::write(output.join("semi.md"), &text)?;
    println!("{text}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_in_the_book_has_this_introduction() {
        crate::book::contains("proof-real.md", &[INTRODUCTION]);
    }

    fn muscle() -> Muscle {
        let rows = (0..400)
            .map(|i| {
                let p = 6e5 * (f64::from(i) * 0.016).sin().abs();
                [f64::from(i) * 0.05, p, 0.0, p * 5e-4]
            })
            .collect();
        Muscle { name: "m".into(), rest_length_mm: 100.0, runs: vec![Run { name: "r".into(), rows }] }
    }

    #[test]
    fn every_effect_changes_the_columns_by_about_its_size_and_nothing_else() {
        let plain = muscle();
        for effect in EFFECTS {
            let with = inject(&plain, effect, 0.04);
            let pairs: Vec<(&Row, &Row)> = plain.runs[0].rows.iter().zip(&with.runs[0].rows).collect();
            let force = pairs.iter().map(|(a, b)| (a[3] - b[3]).abs()).fold(0.0, f64::max) / 300.0;
            let pressure = pairs.iter().map(|(a, b)| (a[1] - b[1]).abs()).fold(0.0, f64::max) / 6e5;
            assert!((0.005..0.6).contains(&force.max(pressure)), "{effect}: {force} {pressure}");
            assert!(force == 0.0 || pressure == 0.0, "{effect} acts on one column");
            assert!(pairs.iter().all(|(a, b)| a[0] == b[0] && a[2] == b[2]));
        }
    }
}
