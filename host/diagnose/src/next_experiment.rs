//! The cheapest next recording that separates effects which the present recordings cannot.

mod menu;

use model_core::effects::{BenchCheck, Context, Experiment, MEMORY};
use model_core::muscle::Muscle;
use rayon::prelude::*;

use self::menu::menu;
use super::criteria::planning::{EXPECTED_NOISE, RIVAL_GRID, RIVAL_GRID_SEVERAL, WORTHWHILE_DIFFERENCE};
use super::isolability::tables;
use super::linear::{add_scaled, energy};
use super::protocol_simulation::{moments, play};
use super::verdict::{Diagnosis, NextExperiment};
use pam_data::error::Result;
use pam_fit::bench::Candidate;

fn trace(law: Candidate, shape: &[f64], amplitudes: &[f64], contexts: &[Context<f64>]) -> Vec<f64> {
    let mut memory = [0.0; MEMORY];
    let columns = law.columns(contexts, shape, &mut memory);
    let mut sum = vec![0.0; contexts.len()];
    for (a, c) in amplitudes.iter().zip(&columns) {
        add_scaled(&mut sum, *a, c);
    }
    for v in &mut sum {
        if !v.is_finite() {
            *v = 0.0;
        }
    }
    sum
}

/// The check of the bench that separates effects which no motion can.
fn bench_block(names: &[String]) -> Option<&'static str> {
    let check = |name: &String| Candidate::from_name(name).and_then(|law| law.traits().check);
    names.iter().filter_map(check).min().map(|check| match check {
        BenchCheck::RigidBar => {
            "put a rigid bar in the muscle's place and load it once: it shows what the frame and its joints give"
        }
        BenchCheck::DeadWeights => {
            "hang dead weights on the load cell, with and without pressure in the line"
        }
        BenchCheck::ReferenceGauge => {
            "compare the gauge with a reference at three pressures, and close the valve for a minute"
        }
        BenchCheck::VentedLength => "measure the vented length with a calliper before and after",
        BenchCheck::Weighing => "weigh the muscle, and record the vented load cell before and after",
        BenchCheck::EndsAndDiameter => "photograph the ends and measure the diameter at three pressures",
    })
}

/// The experiment that would show an effect which these recordings conceal, in words.
pub(crate) fn revealing_experiment(effect: &str) -> &'static str {
    experiment(Candidate::from_name(effect).map_or(Experiment::Varied, |law| law.traits().shown_by))
}

/// An experiment in words.
pub(crate) fn experiment(experiment: Experiment) -> &'static str {
    match experiment {
        Experiment::VentedReadings => "record the vented load cell before, between and after",
        Experiment::Weighing => "weigh the muscle and its fittings, or turn the bench by a right angle",
        Experiment::ReferenceGauge => "compare the gauge with a reference, vented and at three pressures",
        Experiment::DeadWeights => {
            "hang dead weights on the load cell, with and without pressure in the line"
        }
        Experiment::RigidBar => "put a rigid bar in the muscle's place and load it once",
        Experiment::VentedLength => "measure the vented length with a calliper before and after",
        Experiment::EndsAndDiameter => {
            "photograph the ends and measure the diameter at three pressures, or test two lengths of the same stock"
        }
        Experiment::PressureRamps => "record slow ramps of pressure from zero at three held lengths",
        Experiment::Rests => "record rests of 1, 10 and 100 s at one place, sampled at 100 Hz or faster",
        Experiment::NestedLoops => "record nested small loops at two speeds",
        Experiment::Speeds => "record loops at four speeds over two decades",
        Experiment::PressuresAndRamps => {
            "record loops at four pressures and slow ramps of pressure at held lengths"
        }
        Experiment::RestsFromBothSides => {
            "rest at one place reached from both sides: the gap closes to the true middle"
        }
        Experiment::LongHolds => "hold the length for 100 s at two pressures, reached from both sides",
        Experiment::FirstStrokes => "record a new specimen's first strokes, and the same again after a day",
        Experiment::RepeatsAfterRest => {
            "repeat the first loops at the end, and again after half an hour of vented rest"
        }
        Experiment::EndOfStroke => "go to the very end of the free stroke",
        Experiment::Varied => {
            "record at several speeds, with rests, and the first pressure once more at the end"
        }
    }
}

/// The recording of the menu in which the named effect and those it is confused with differ most for its cost.
///
/// # Errors
/// None in practice; a protocol of the menu that cannot be played is passed over.
pub fn next_experiment(
    diagnosis: &Diagnosis,
    muscle: &Muscle<f64>,
    low: f64,
    high: f64,
) -> Result<Option<NextExperiment>> {
    let Some(first) = diagnosis.missing.iter().find(|m| !m.confusable_with.is_empty()) else {
        return Ok(None);
    };
    let Some(law) = Candidate::from_name(&first.effect) else { return Ok(None) };
    let rivals: Vec<Candidate> =
        first.confusable_with.iter().filter_map(|n| Candidate::from_name(n)).collect();
    let values: Vec<f64> = first.parameters.iter().map(|p| p.value).collect();
    let (amplitudes, shape) = values.split_at(law.amplitudes().len().min(values.len()));
    let tried: Vec<Option<(f64, f64, String, &'static str)>> = menu(muscle, low, high)
        .par_iter()
        .map(|item| {
            let campaign = play(&item.protocol, muscle).ok()?;
            let contexts = moments(muscle, &campaign);
            let basis = tables(&contexts);
            let mine = trace(law, shape, amplitudes, &contexts);
            // The rival is free to take its best shape and size: what then still differs is what would be seen.
            let mut least = f64::INFINITY;
            for rival in &rivals {
                let span = pam_fit::bench::Span::of(&contexts)?;
                let mut best = f64::INFINITY;
                for shape in
                    rival.grid(if rival.shapes().len() < 2 { RIVAL_GRID } else { RIVAL_GRID_SEVERAL }, &span)
                {
                    let mut with = basis.clone();
                    for c in rival.columns(&contexts, &shape, &mut [0.0; MEMORY]) {
                        if c.iter().all(|v| v.is_finite()) {
                            with.push(c);
                        }
                    }
                    let mut left = mine.clone();
                    with.project_out(&mut left);
                    best = best.min((energy(&left) / left.len().max(1) as f64).sqrt());
                }
                least = least.min(best);
            }
            let text = item.protocol.to_toml().ok()?;
            Some((least / item.minutes.sqrt(), least, text, item.words))
        })
        .collect();
    let best = tried.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
    let mut separates = vec![first.effect.clone()];
    separates.extend(first.confusable_with.iter().cloned());
    Ok(best.map(|(_, difference, protocol, words)| {
        let floor = WORTHWHILE_DIFFERENCE * diagnosis.noise_N.max(EXPECTED_NOISE * diagnosis.blocked_force_N);
        let words = match bench_block(&separates) {
            Some(block) if difference < floor => format!("no motion tells these apart; {block}"),
            Some(block) => format!("{words}; besides, {block}"),
            None => words.to_owned(),
        };
        NextExperiment { separates, protocol, expected_difference_N: difference, words }
    }))
}
