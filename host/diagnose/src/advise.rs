//! The cheapest next recording that would tell confusable effects apart, and the matrix of what a planned protocol can tell.

use model_core::effects::{Context, Imitates, MEMORY};
use model_core::muscle::Muscle;
use rayon::prelude::*;

use super::baselines::cosine;
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::candidates::INVISIBLE;
use super::criteria::planning::{
    EXPECTED_NOISE, INDISTINGUISHABLE, MENU_PRESSURES, PLAN_POWERS, PROTOCOL_ROWS, RIVAL_GRID,
    RIVAL_GRID_SEVERAL, SLOW_STROKE, WORTHWHILE_DIFFERENCE,
};
use super::criteria::rows::VENTED_SHARE;
use super::experiment::{Motion, Proposal, bench_check};
use super::linear::{Basis, add_scaled, energy};
use super::planned::{Place, Protocol, Step, free_stroke, moments, play};
use super::verdict::{Diagnosis, NextExperiment};
use pam_data::error::Result;
use pam_fit::bench::Candidate;

/// One entry of the menu: what it is, what it costs, its protocol.
struct Item {
    motion: Motion,
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

/// What the protocols of the menu are made of, for one muscle.
struct Bench {
    /// Two pressures, kPa.
    levels: [f64; 2],
    /// A slow speed, mm/s.
    slow: f64,
}

impl Bench {
    fn new(muscle: &Muscle<f64>, low: f64, high: f64) -> Self {
        Self {
            levels: MENU_PRESSURES.map(|part| settable((part * high + (1.0 - part) * low) * 1e-3)),
            slow: settable((free_stroke(muscle, high) * 1e3 / SLOW_STROKE).max(1e-3)),
        }
    }

    /// Loops to a part of the free stroke, at a multiple of the slow speed.
    fn loops(&self, part: f64, times: f64, count: u32) -> Step {
        let to = Place { free: Some(part), ..Place::default() };
        Step::Cycles { to, speed_mm_s: settable(times * self.slow), count }
    }

    /// A way to a part of the free stroke.
    fn go(&self, part: f64, times: f64) -> Step {
        let to = Place { free: Some(part), ..Place::default() };
        Step::Move { to, speed_mm_s: settable(times * self.slow) }
    }

    /// The same steps at both pressures, with tares before and after.
    fn each(&self, name: &str, inner: impl Fn(f64) -> Vec<Step>) -> Protocol {
        let tare =
            |name: &str| [Step::File { name: name.into() }, Step::Tare { seconds: 10.0 }, Step::EndFile];
        let mut step = tare("tare_before").to_vec();
        for p in self.levels {
            step.push(Step::Pressure { to_kpa: p, rate_kpa_s: Some(50.0), settle_s: 2.0 });
            step.push(Step::File { name: format!("{name}_{p:.0}kPa") });
            step.extend(inner(p));
            step.push(Step::EndFile);
        }
        step.extend(tare("tare_after"));
        Protocol { name: name.to_owned(), sample_hz: 20.0, step }
    }

    fn speeds(&self) -> Protocol {
        self.each("speeds", |_| {
            [0.3, 1.0, 4.0, 16.0].map(|v| self.loops(0.9, v, if v < 1.0 { 1 } else { 2 })).to_vec()
        })
    }

    fn dwells(&self) -> Protocol {
        self.each("dwells", |_| {
            let mut steps = vec![self.loops(0.9, 2.0, 1)];
            for seconds in [1.0, 10.0, 100.0] {
                for turn in [0.9, 0.1] {
                    steps.extend([self.go(0.5, 2.0), Step::Hold { seconds }, self.go(turn, 2.0)]);
                }
            }
            steps
        })
    }

    fn nested(&self) -> Protocol {
        let places = [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0];
        self.each("nested", |_| {
            [1.0, 8.0].iter().flat_map(|times| places.map(|p| self.go(p, *times))).collect()
        })
    }

    fn ramps(&self) -> Protocol {
        self.each("ramps", |p| {
            let rate_kpa_s = Some(settable(p / 20.0));
            let to = |to: f64| Step::Pressure { to_kpa: settable(to), rate_kpa_s, settle_s: 2.0 };
            let ramps = || [0.4 * p, p, 0.4 * p, p].map(to);
            [0.0, 0.3, 0.6].iter().flat_map(|x| std::iter::once(self.go(*x, 4.0)).chain(ramps())).collect()
        })
    }

    fn rest(&self) -> Protocol {
        let mut rest = self.each("rest", |_| vec![self.loops(0.9, 1.0, 3)]);
        let again = rest.step.clone();
        rest.step.push(Step::Rest { seconds: 1800.0 });
        rest.step.extend(again.into_iter().map(|s| match s {
            Step::File { name } => Step::File { name: format!("{name}_again") },
            other => other,
        }));
        rest
    }
}

/// Recordings that tell effects apart, cheapest first, for a muscle and its pressures (Pa).
fn menu(muscle: &Muscle<f64>, low: f64, high: f64) -> Vec<Item> {
    let bench = Bench::new(muscle, low, high);
    vec![
        Item { motion: Motion::Speeds, minutes: 8.0, protocol: bench.speeds() },
        Item { motion: Motion::Dwells, minutes: 10.0, protocol: bench.dwells() },
        Item { motion: Motion::NestedLoops, minutes: 6.0, protocol: bench.nested() },
        Item { motion: Motion::PressureRamps, minutes: 9.0, protocol: bench.ramps() },
        Item { motion: Motion::Rest, minutes: 38.0, protocol: bench.rest() },
    ]
}

/// What a flexible table could express at these moments, for taking it out.
fn tables(contexts: &[Context<f64>]) -> Basis {
    let top = contexts.iter().map(|c| c.pressure).fold(1.0, f64::max);
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for degree in 0..PLAN_POWERS {
        let over = |c: &Context<f64>| (c.pressure / top).powi(degree);
        for order in 1..=TABLE_ORDER as i32 {
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
            if c.pressure < VENTED_SHARE * top {
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
    let tried: Vec<Option<(f64, f64, String, Motion)>> = menu(muscle, low, high)
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
            Some((least / item.minutes.sqrt(), least, text, item.motion))
        })
        .collect();
    let best = tried.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
    let mut separates = vec![first.effect.clone()];
    separates.extend(first.confusable_with.iter().cloned());
    Ok(best.map(|(_, difference, protocol, motion)| {
        let floor = WORTHWHILE_DIFFERENCE * diagnosis.noise_N.max(EXPECTED_NOISE * diagnosis.blocked_force_N);
        let check = bench_check(&separates);
        let proposal = Proposal { motion, check, motion_separates: check.is_none() || !(difference < floor) };
        NextExperiment { separates, protocol, expected_difference_N: difference, proposal }
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
    let stride = contexts.len().div_ceil(PROTOCOL_ROWS).max(1);
    let keep: Vec<usize> = (0..contexts.len()).step_by(stride).collect();
    let thin: Vec<Context<f64>> = keep.iter().map(|i| contexts[*i]).collect();
    let basis = tables(&thin);
    let span = pam_fit::bench::Span::of(&contexts);
    let laws: Vec<Candidate> =
        Candidate::all().filter(|l| l.traits().imitates != Some(Imitates::ElasticOrders)).collect();
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
                .filter(|j| *j != i && traces[i].0 > INVISIBLE && traces[*j].0 > INVISIBLE)
                .map(|j| (laws[j].name().to_owned(), cosine(&traces[i].1, &traces[j].1).abs()))
                .filter(|(_, c)| *c > INDISTINGUISHABLE)
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
