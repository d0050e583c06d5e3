//! What a planned protocol can show: which effects are visible in it, and which of them it cannot distinguish.

use model_core::effects::{Context, Imitates, MEMORY};
use model_core::muscle::Muscle;
use rayon::prelude::*;

use super::baselines::cosine;
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::candidates::{INVISIBLE, TYPICAL_LEAST};
use super::criteria::planning::{INDISTINGUISHABLE, PLAN_POWERS, PROTOCOL_ROWS};
use super::criteria::rows::VENTED_SHARE;
use super::linear::{Basis, energy};
use super::protocol_simulation::{Protocol, moments, play};
use pam_data::error::Result;
use pam_fit::bench::Candidate;

/// What a flexible table could express at these moments, for taking it out.
pub(super) fn tables(contexts: &[Context<f64>]) -> Basis {
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

/// What a protocol can show of one effect.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Isolability {
    /// The effect.
    pub effect: String,
    /// Share of its trace's energy that flexible tables cannot imitate.
    pub visible: f64,
    /// Effects whose trace has a cosine above 0.9 with this one's, after the tables are refitted; with that cosine.
    pub confounded_with: Vec<(String, f64)>,
}

/// For a planned protocol: which effects of the library it shows, and which of them it cannot distinguish.
///
/// # Errors
/// A protocol that cannot be played.
pub fn isolability(protocol: &Protocol, muscle: &Muscle<f64>) -> Result<Vec<Isolability>> {
    let campaign = play(protocol, muscle)?;
    let contexts = moments(muscle, &campaign);
    let stride = contexts.len().div_ceil(PROTOCOL_ROWS).max(1);
    let keep: Vec<usize> = (0..contexts.len()).step_by(stride).collect();
    let kept: Vec<Context<f64>> = keep.iter().map(|i| contexts[*i]).collect();
    let basis = tables(&kept);
    let span = pam_fit::bench::Span::of(&contexts);
    let laws: Vec<Candidate> = Candidate::all()
        .filter(|l| l.traits().imitates != Some(Imitates::ElasticOrders) && !l.traits().between_recordings)
        .collect();
    let traces: Vec<(f64, Vec<f64>)> = laws
        .par_iter()
        .map(|law| {
            let shape = span.and_then(|s| law.grid(1, &s).into_iter().next()).unwrap_or_default();
            let columns = law.columns(&contexts, &shape, &mut [0.0; MEMORY]);
            // The first law of several alternatives represents the effect, all parts of one law together.
            let mut sum = vec![0.0; keep.len()];
            let parts = if law.info().alternatives { 1 } else { columns.len() };
            for (p, c) in law.amplitudes().iter().zip(&columns).take(parts) {
                let (least, most) = if p.high > 0.0 { (p.low, p.high) } else { (p.high, p.low) };
                let typical = (least.abs().max(most.abs() * TYPICAL_LEAST) * most.abs()).sqrt();
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
            let mut confounded_with: Vec<(String, f64)> = (0..laws.len())
                .filter(|j| *j != i && traces[i].0 > INVISIBLE && traces[*j].0 > INVISIBLE)
                .map(|j| (laws[j].name().to_owned(), cosine(&traces[i].1, &traces[j].1).abs()))
                .filter(|(_, c)| *c > INDISTINGUISHABLE)
                .collect();
            confounded_with.sort_by(|a, b| b.1.total_cmp(&a.1));
            Isolability { effect: law.name().to_owned(), visible: traces[i].0, confounded_with }
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol_simulation::{Place, Step};
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
            row.confounded_with.iter().any(|(n, _)| n == "coulomb-friction")
        };
        assert!(confused(&[0.2]));
        assert!(!confused(&[0.1, 0.4, 1.6]));
    }
}
