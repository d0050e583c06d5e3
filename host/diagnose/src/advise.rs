//! The cheapest next recording that would tell confusable effects apart, and the matrix of what a planned protocol can tell.

use model_core::effects::{Context, MEMORY};
use model_core::muscle::Muscle;
use rayon::prelude::*;

use super::baselines::cosine;
use super::history::is_from_history;
use super::linear::{Basis, add_scaled, energy};
use super::planned::{Place, Protocol, Step, free_stroke, moments, play};
use super::verdict::{Diagnosis, Missing, NextExperiment};
use pam_data::error::Result;
use pam_fit::bench::Candidate;

/// One entry of the menu: what it is, what it costs, its protocol.
struct Item {
    words: &'static str,
    minutes: f64,
    protocol: Protocol,
}

/// With three figures: what a person sets on a bench.
fn settable(value: f64) -> f64 {
    if !(value.abs() > 0.0 && value.is_finite()) {
        return value;
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    // By division where the number is large: a power of ten below one is not exact.
    if digits < 0 {
        let step = 10_f64.powi(-digits);
        (value / step).round() * step
    } else {
        let parts = 10_f64.powi(digits);
        (value * parts).round() / parts
    }
}

/// Recordings that tell effects apart, cheapest first, for a muscle and its pressures (Pa).
fn menu(muscle: &Muscle<f64>, low: f64, high: f64) -> Vec<Item> {
    let levels = [0.35 * high + 0.65 * low, 0.9 * high + 0.1 * low].map(|p| settable(p * 1e-3));
    let slow = settable((free_stroke(muscle, high) * 1e3 / 27.0).max(1e-3));
    let set = |p: f64| Step::Pressure { to_kpa: p, rate_kpa_s: Some(50.0), settle_s: 2.0 };
    let loops = |part: f64, speed: f64, count: u32| Step::Cycles {
        to: Place { free: Some(part), ..Place::default() },
        speed_mm_s: settable(speed),
        count,
    };
    let go = |part: f64, speed: f64| Step::Move {
        to: Place { free: Some(part), ..Place::default() },
        speed_mm_s: settable(speed),
    };
    let each = |name: &str, inner: &dyn Fn(f64) -> Vec<Step>| {
        let mut step =
            vec![Step::File { name: "tare_before".into() }, Step::Tare { seconds: 10.0 }, Step::EndFile];
        for p in levels {
            step.extend([set(p), Step::File { name: format!("{name}_{p:.0}kPa") }]);
            step.extend(inner(p));
            step.push(Step::EndFile);
        }
        step.extend([Step::File { name: "tare_after".into() }, Step::Tare { seconds: 10.0 }, Step::EndFile]);
        Protocol { name: name.to_owned(), sample_hz: 20.0, step }
    };
    let speeds = each("speeds", &|_| {
        [0.3, 1.0, 4.0, 16.0].map(|v| loops(0.9, v * slow, if v < 1.0 { 1 } else { 2 })).to_vec()
    });
    let dwells = each("dwells", &|_| {
        let mut s = vec![loops(0.9, 2.0 * slow, 1)];
        for hold in [1.0, 10.0, 100.0] {
            s.extend([
                go(0.5, 2.0 * slow),
                Step::Hold { seconds: hold },
                go(0.9, 2.0 * slow),
                go(0.5, 2.0 * slow),
                Step::Hold { seconds: hold },
                go(0.1, 2.0 * slow),
            ]);
        }
        s
    });
    let nested = each("nested", &|_| {
        [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0, 0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0]
            .iter()
            .enumerate()
            .map(|(i, p)| go(*p, if i < 8 { slow } else { 8.0 * slow }))
            .collect()
    });
    let ramps = each("ramps", &|p| {
        let mut s = Vec::new();
        for part in [0.0, 0.3, 0.6] {
            s.push(go(part, 4.0 * slow));
            for to in [0.4 * p, p, 0.4 * p, p] {
                let rate = settable(p / 20.0);
                s.push(Step::Pressure { to_kpa: settable(to), rate_kpa_s: Some(rate), settle_s: 2.0 });
            }
        }
        s
    });
    let mut rest = each("rest", &|_| vec![loops(0.9, slow, 3)]);
    let again = rest.step.clone();
    rest.step.push(Step::Rest { seconds: 1800.0 });
    rest.step.extend(again.into_iter().map(|s| match s {
        Step::File { name } => Step::File { name: format!("{name}_again") },
        other => other,
    }));
    vec![
        Item {
            words: "loops at speeds 0.3, 1, 4 and 16 times the slow one, at two pressures",
            minutes: 8.0,
            protocol: speeds,
        },
        Item {
            words: "rests of 1, 10 and 100 s at one place, reached from both sides, at two pressures",
            minutes: 10.0,
            protocol: dwells,
        },
        Item { words: "nested small loops at two speeds, at two pressures", minutes: 6.0, protocol: nested },
        Item { words: "slow ramps of pressure at three held lengths", minutes: 9.0, protocol: ramps },
        Item {
            words: "the same loops before and after half an hour of vented rest, with the load cell's zero before and after",
            minutes: 38.0,
            protocol: rest,
        },
    ]
}

/// What a flexible table could express at these moments, for taking it out.
fn tables(contexts: &[Context<f64>]) -> Basis {
    let top = contexts.iter().map(|c| c.pressure).fold(1.0, f64::max);
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for degree in 0..3 {
        let over = |c: &Context<f64>| (c.pressure / top).powi(degree);
        for order in 1..=4 {
            columns.push(
                contexts
                    .iter()
                    .map(|c| {
                        over(c)
                            * (c.axial_area * c.axial_strain.powi(order)
                                - c.hoop_area * c.radial_strain.powi(order))
                    })
                    .collect(),
            );
        }
        columns.push(contexts.iter().map(|c| over(c) * c.direction * c.quasi).collect());
    }
    columns.push(contexts.iter().map(|c| c.area).collect());
    for column in &mut columns {
        for (v, c) in column.iter_mut().zip(contexts) {
            if c.pressure < 0.02 * top {
                *v = 0.0;
            }
        }
    }
    Basis::new(&columns, &vec![1.0; contexts.len()])
}

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

/// Blocks of the menu that need the bench, not the muscle: they split what no motion can.
fn bench_block(names: &[String]) -> Option<&'static str> {
    let has = |n: &str| names.iter().any(|x| x == n);
    if has("rig-compliance") || has("backlash") {
        Some(
            "put a rigid bar in the muscle's place and load it once: it shows what the frame and its joints give",
        )
    } else if has("force-gain") || has("cross-talk") || has("misalignment") {
        Some("hang dead weights on the load cell, with and without pressure in the line")
    } else if has("gauge-gain") || has("leak") {
        Some("compare the gauge with a reference at three pressures, and close the valve for a minute")
    } else if has("displacement-offset") || has("permanent-set") || has("end-slip") {
        Some("measure the vented length with a calliper before and after")
    } else if has("gravity") || has("force-offset") {
        Some("weigh the muscle, and record the vented load cell before and after")
    } else if has("tip-effect") || has("braid-elasticity") {
        Some("photograph the ends and measure the diameter at three pressures")
    } else {
        None
    }
}

/// What to do so that an effect would show which recordings like these conceal.
pub(crate) fn what_would_show(effect: &str) -> &'static str {
    match effect {
        "force-offset" | "force-drift" => "record the vented load cell before, between and after",
        "gravity" => "weigh the muscle and its fittings, or turn the bench by a right angle",
        "gauge-offset" | "gauge-gain" | "leak" => {
            "compare the gauge with a reference, vented and at three pressures"
        }
        "force-gain" | "cross-talk" | "misalignment" => {
            "hang dead weights on the load cell, with and without pressure in the line"
        }
        "rig-compliance" | "backlash" => "put a rigid bar in the muscle's place and load it once",
        "displacement-offset" | "permanent-set" | "end-slip" => {
            "measure the vented length with a calliper before and after"
        }
        "tip-effect" | "braid-elasticity" => {
            "photograph the ends and measure the diameter at three pressures, or test two lengths of the same stock"
        }
        "contact-loss" | "pressure-sensor-lag" => {
            "record slow ramps of pressure from zero at three held lengths"
        }
        "breakaway-friction" => "record rests of 1, 10 and 100 s at one place, sampled at 100 Hz or faster",
        "presliding-hysteresis" | "minor-loop-memory" => "record nested small loops at two speeds",
        "viscous-damping" | "rate-power" | "stribeck-friction" | "sensor-delay" | "pressure-lag"
        | "inertia" => "record loops at four speeds over two decades",
        "coulomb-friction" | "pressure-friction" | "seal-friction" => {
            "record loops at four pressures and slow ramps of pressure at held lengths"
        }
        "friction-asymmetry" => {
            "rest at one place reached from both sides: the gap closes to the true middle"
        }
        "stress-relaxation" | "log-creep" => {
            "hold the length for 100 s at two pressures, reached from both sides"
        }
        "mullins-softening" => "record a new specimen's first strokes, and the same again after a day",
        "cyclic-softening" | "thermal-softening" => {
            "repeat the first loops at the end, and again after half an hour of vented rest"
        }
        "strand-jamming" => "go to the very end of the free stroke",
        _ => "record at several speeds, with rests, and the first pressure once more at the end",
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
    let open = |m: &&Missing| !m.confusable_with.is_empty() && !is_from_history(m);
    let Some(first) = diagnosis.missing.iter().find(open) else {
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
                for shape in rival.grid(if rival.shapes().len() < 2 { 5 } else { 3 }, &span) {
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
        let floor = 0.3 * diagnosis.noise_N.max(1e-3 * diagnosis.blocked_force_N);
        let words = match bench_block(&separates) {
            Some(block) if difference < floor => format!("no motion tells these apart; {block}"),
            Some(block) => format!("{words}; besides, {block}"),
            None => words.to_owned(),
        };
        NextExperiment { separates, protocol, expected_difference_N: difference, words }
    }))
}

/// What a protocol can show of one effect.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Isolability {
    /// The effect.
    pub effect: String,
    /// Share of its trace's energy that flexible tables cannot imitate.
    pub visible: f64,
    /// Effects whose trace has a cosine above 0.9 with this one's, after the tables are refitted; with that cosine.
    pub not_told_from: Vec<(String, f64)>,
}

/// For a planned protocol: which effects of the library it shows, and which of them it cannot tell apart.
///
/// # Errors
/// A protocol that cannot be played.
pub fn isolability(protocol: &Protocol, muscle: &Muscle<f64>) -> Result<Vec<Isolability>> {
    let campaign = play(protocol, muscle)?;
    let contexts = moments(muscle, &campaign);
    let stride = contexts.len().div_ceil(12_000).max(1);
    let keep: Vec<usize> = (0..contexts.len()).step_by(stride).collect();
    let thin: Vec<Context<f64>> = keep.iter().map(|i| contexts[*i]).collect();
    let basis = tables(&thin);
    let span = pam_fit::bench::Span::of(&contexts);
    let laws: Vec<Candidate> = Candidate::all().filter(|l| l.name() != "higher-order-elasticity").collect();
    let traces: Vec<(f64, Vec<f64>)> = laws
        .par_iter()
        .map(|law| {
            let shape = span.and_then(|s| law.grid(1, &s).into_iter().next()).unwrap_or_default();
            let columns = law.columns(&contexts, &shape, &mut [0.0; MEMORY]);
            // The first law of several alternatives stands for the effect, all parts of one law together.
            let mut sum = vec![0.0; keep.len()];
            let parts = if law.info().alternatives { 1 } else { columns.len() };
            for (p, c) in law.amplitudes().iter().zip(&columns).take(parts) {
                let typical = (p.low.abs().max(p.high.abs() * 1e-3) * p.high.abs()).sqrt();
                for (s, i) in sum.iter_mut().zip(&keep) {
                    *s += typical * if c[*i].is_finite() { c[*i] } else { 0.0 };
                }
            }
            let before = energy(&sum);
            basis.project_out(&mut sum);
            let visible = if before > 0.0 { energy(&sum) / before } else { 0.0 };
            (visible, sum)
        })
        .collect();
    Ok(laws
        .iter()
        .enumerate()
        .map(|(i, law)| {
            let mut not_told_from: Vec<(String, f64)> = (0..laws.len())
                .filter(|j| *j != i && traces[i].0 > 1e-5 && traces[*j].0 > 1e-5)
                .map(|j| (laws[j].name().to_owned(), cosine(&traces[i].1, &traces[j].1).abs()))
                .filter(|(_, c)| *c > 0.9)
                .collect();
            not_told_from.sort_by(|a, b| b.1.total_cmp(&a.1));
            Isolability { effect: law.name().to_owned(), visible: traces[i].0, not_told_from }
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::table;

    #[test]
    fn a_protocol_of_one_speed_does_not_tell_viscous_from_constant_friction_and_several_speeds_do() {
        let muscle = Muscle::<f64>::build(&table::example()).expect("the example table");
        let protocol = |speeds: &[f64]| {
            let mut step = Vec::new();
            for p in [250.0, 400.0, 550.0] {
                step.push(Step::Pressure { to_kpa: p, rate_kpa_s: Some(50.0), settle_s: 1.0 });
                step.push(Step::File { name: format!("{p}") });
                for v in speeds {
                    let to = Place { free: Some(0.9), ..Place::default() };
                    step.push(Step::Cycles { to, speed_mm_s: *v, count: 2 });
                }
                step.push(Step::EndFile);
            }
            Protocol { name: "test".into(), sample_hz: 10.0, step }
        };
        let confused = |speeds: &[f64]| {
            let rows = isolability(&protocol(speeds), &muscle).expect("playable");
            let row = rows.iter().find(|r| r.effect == "viscous-damping").expect("in the library");
            row.not_told_from.iter().any(|(n, _)| n == "coulomb-friction")
        };
        assert!(confused(&[0.2]));
        assert!(!confused(&[0.1, 0.4, 1.6]));
    }

    #[test]
    fn protocols_survive_their_own_text() {
        let muscle = Muscle::<f64>::build(&table::example()).expect("the example table");
        for item in menu(&muscle, 207e3, 552e3) {
            let text = item.protocol.to_toml().expect("writable");
            assert_eq!(crate::planned::parse(&text).expect("readable"), item.protocol);
            let longest = text.split([' ', '\n']).filter(|w| w.parse::<f64>().is_ok()).map(str::len).max();
            assert!(longest.is_some_and(|l| l <= 7), "{text}");
            assert!(play(&item.protocol, &muscle).expect("playable").samples() > 100);
        }
    }
}
