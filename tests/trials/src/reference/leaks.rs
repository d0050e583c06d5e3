//! Leaks put into later runs: closed valves lose pressure at a rate, and the force follows by its slope over the pressure.

use std::collections::BTreeMap;
use std::fmt::Write;

use rayon::prelude::*;
use serde::Serialize;

use super::injection::Slopes;
use super::staircases::{Half, Muscle, Run};
use super::{Answer, compared};
use crate::rate::Rate;

/// Rates put in, 1/s: recorded leak-downs of fluidic muscles have 3e-4 to 1.5e-2.
const RATES: [f64; 4] = [2e-3, 5e-3, 1e-2, 2e-2];
/// A pulse moves the pressure by more than this share of its range between two rows, or within this time, s.
const PULSE: (f64, f64) = (0.015, 0.1);
/// Time from one pulse to the next, s: the supply replaces what is lost.
const PERIOD: f64 = 0.5;

/// One trial.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    muscle: String,
    half: Half,
    rate: f64,
    /// Whether both sides have similar rests.
    compared: bool,
    answer: Answer,
}

/// A run whose muscle leaks.
fn leaking(run: &Run, rate: f64, slopes: &Slopes) -> Run {
    let range = run.pressure.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - run.pressure.iter().copied().fold(f64::INFINITY, f64::min);
    let mut changed = run.clone();
    let mut pulse = 0.0;
    for i in 1..run.time.len() {
        let near = (0..i).rev().take_while(|j| run.time[i] - run.time[*j] <= PULSE.1 || j + 1 == i);
        let moved = near.map(|j| (run.pressure[i] - run.pressure[j]).abs()).fold(0.0, f64::max);
        if moved > PULSE.0 * range {
            pulse = run.time[i];
        }
        let lost = run.pressure[i] * (1.0 - (-rate * (run.time[i] - pulse).min(PERIOD)).exp());
        changed.pressure[i] -= lost;
        changed.force[i] -= lost * slopes.by_pressure(run.mounting, run.pressure[i]);
    }
    changed
}

fn one(muscle: &Muscle, split: usize, rate: f64, slopes: &Slopes) -> Result<Trial, String> {
    let mut after: Vec<Run> =
        muscle.between(split + 1, muscle.runs).iter().map(|r| leaking(r, rate, slopes)).collect();
    after.sort_by_key(|r| (r.run, r.mounting));
    let report = compared(&muscle.between(1, split), &after)
        .map_err(|e| format!("{}, split {split}, leak {rate}: {e}", muscle.name))?;
    let named = report.missing.iter().map(|m| &m.effect);
    let compared = report.considered.iter().map(|c| &c.effect).chain(named).any(|e| e == "leak");
    let answer = Answer::of(&report, 0.0);
    Ok(Trial { muscle: muscle.name.clone(), half: muscle.half, rate, compared, answer })
}

/// All muscles, splits and rates; the short version has one split a muscle and one rate.
pub fn run(muscles: &[Muscle], slopes: &BTreeMap<&str, Slopes>, short: bool) -> Result<Vec<Trial>, String> {
    let mut jobs = Vec::new();
    for muscle in muscles {
        let side = muscle.least_runs();
        let splits: Vec<usize> = (side..=muscle.runs - side).collect();
        for (number, split) in splits.iter().enumerate() {
            let wanted = |r: &f64| !short || (number == splits.len() / 2 && *r == 1e-2);
            jobs.extend(RATES.into_iter().filter(wanted).map(|rate| (muscle, *split, rate)));
        }
    }
    jobs.par_iter().map(|(m, split, rate)| one(m, *split, *rate, &slopes[m.name.as_str()])).collect()
}

/// The section of the page.
pub fn section(trials: &[Trial]) -> String {
    let mut text = String::new();
    if trials.is_empty() {
        return text;
    }
    text.push_str(
        "\n## Leaks that closed valves show\n\nThe later runs lose pressure between the pulses of the valves, at a rate in proportion to it; the \
         force follows by its slope over the pressure. All splits; in those between runs with other pulses few rests are similar, and the leak is \
         not looked for. A rate of 0.005 1/s leaves 55 % after two minutes. \"Another name\": any \
         beside the leak. The constants were chosen with the muscles of both halves known.\n\n\
         | rate, 1/s | n | compared | named of these | another name | rate within 20 % | in the stated 95 % |\n| --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for rate in RATES {
        let own: Vec<&Trial> = trials.iter().filter(|t| t.rate == rate).collect();
        if own.is_empty() {
            continue;
        }
        let sizes: Vec<(f64, f64)> = own
            .iter()
            .filter_map(|t| t.answer.named.iter().find(|n| n.0 == "leak").map(|n| (n.1, n.2)))
            .collect();
        let compared = own.iter().filter(|t| t.compared).count();
        let other = own.iter().filter(|t| t.answer.named.iter().any(|n| n.0 != "leak")).count();
        let near = sizes.iter().filter(|(s, _)| (s / rate - 1.0).abs() < 0.2).count();
        let within = sizes.iter().filter(|(s, half)| (s - rate).abs() < *half).count();
        let _ = writeln!(
            text,
            "| {rate} | {} | {compared} | {} | {} | {} | {} |",
            own.len(),
            Rate::new(sizes.len(), compared),
            Rate::new(other, own.len()),
            Rate::new(near, sizes.len()),
            Rate::new(within, sizes.len())
        );
    }
    text
}
