//! The likelihood of an effect beside a baseline whose bladder may differ a little between pressures.
//!
//! ```text
//! y = hard·b + Σ_j u_j q_j + effects·a + noise        u_j ~ N(0, V_j),  noise of n independent rows ~ N(0, σ²)
//! D = n ln σ² + n S/(W σ²) + Σ_j ln(1 + V_j/σ_e²) + prior(V)        σ_e² = σ² W/n
//! ```
//! `q_j` are the directions of the flexible tables beyond one bladder for all pressures; `S` the residual sum of squares in the metric
//! in which `u` is integrated out, `W` the rows' weight and `n` how many independent rows they amount to. `D` is twice the negative
//! logarithm of the likelihood. For every hypothesis the size of `V` (how much bladder and friction may differ between pressures) and
//! `σ²` (not below the pure error of repeats) take their best values: an effect that lets one bladder serve all pressures gains
//! what the tables need not explain any more, and an effect that the tables imitate gains nothing.
//! The integral is the usual one of mixed models (D. A. Harville, J. American Statistical Association 72 (1977) 320–338).

use super::baselines::{PriorDeviations, keeps};
use super::criteria::baseline::{ELASTIC_DEVIATIONS, EXPECTED_DEVIATIONS, FRICTION_DEVIATIONS};
use super::linear::{Sign, amplitudes, solve_symmetric};

/// What the evaluation of evidence needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// Sum of the rows' weights.
    pub weight: f64,
    /// How many independent rows they are worth.
    pub independent: f64,
    /// Pure error of a row, N.
    pub sigma: f64,
    /// Blocked force, N.
    pub blocked: f64,
}

/// Inner products of columns and of what is to be explained, freed of the hard columns, with their soft components.
#[derive(Clone, Debug, Default)]
pub(crate) struct Products {
    /// Column by column.
    pub gram: Vec<Vec<f64>>,
    /// Columns with what is to be explained.
    pub moment: Vec<f64>,
    /// Components of the columns along the soft directions.
    pub components: Vec<Vec<f64>>,
    /// Of the columns, how many are there in any case (effects chosen before, nuisances behind them).
    pub given: usize,
}

/// What is to be explained.
#[derive(Clone, Debug)]
pub(crate) struct Target<'a> {
    /// Its energy, N².
    pub energy: f64,
    /// Its soft components.
    pub components: Vec<f64>,
    /// Which soft directions are friction's.
    pub of_friction: &'a [bool],
}

/// A hypothesis at its best.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    /// Twice the negative log-likelihood.
    pub deviance: f64,
    /// How much the bladder differs between pressures under it.
    pub prior: PriorDeviations,
    /// Amplitudes of the columns in question.
    pub amplitudes: Vec<f64>,
    /// Energy left without them, N².
    pub before: f64,
    /// Energy that they take, N².
    pub gain: f64,
    /// Amplitudes of the given columns.
    pub given: Vec<f64>,
}

/// Weighs columns against what is to be explained; at most `most` of them together.
pub(crate) fn likelihood(
    scale: &Scale,
    target: &Target<'_>,
    products: &Products,
    signs: &[Sign],
    most: u32,
) -> Hypothesis {
    let gives = ELASTIC_DEVIATIONS.iter().flat_map(|e| FRICTION_DEVIATIONS.iter().map(move |f| (*e, *f)));
    let mut best: Option<Hypothesis> = None;
    for (elastic, friction) in gives {
        let prior =
            (elastic / EXPECTED_DEVIATIONS.0).ln().powi(2) + (friction / EXPECTED_DEVIATIONS.1).ln().powi(2);
        let mut w = Hypothesis {
            deviance: f64::INFINITY,
            prior: PriorDeviations {
                elastic: elastic * scale.blocked,
                friction: friction * scale.blocked,
                row: 0.0,
            },
            amplitudes: vec![0.0; signs.len()],
            before: target.energy,
            gain: 0.0,
            given: vec![0.0; products.given],
        };
        let mut variance = scale.sigma * scale.sigma;
        for _ in 0..2 {
            w.prior.row = (variance * scale.weight / scale.independent).sqrt();
            let keep = keeps(w.prior, target.of_friction, scale.weight);
            solve_at(&keep, target, products, signs, most, &mut w);
            let left = (w.before - w.gain).max(0.0);
            variance = (left / scale.weight).max(scale.sigma * scale.sigma).max(1e-300);
            let determinant: f64 = keep.iter().map(|k| -2.0 * k.ln()).sum();
            w.deviance =
                scale.independent * (variance.ln() + left / (scale.weight * variance)) + determinant + prior;
        }
        if best.as_ref().is_none_or(|b| w.deviance < b.deviance) {
            best = Some(w);
        }
        if target.of_friction.is_empty() {
            break;
        }
    }
    best.unwrap_or_else(|| unreachable!("there are sizes to try"))
}

/// The same where the bladder differs as much as another hypothesis has it.
pub(crate) fn likelihood_at(
    scale: &Scale,
    target: &Target<'_>,
    products: &Products,
    signs: &[Sign],
    most: u32,
    prior: PriorDeviations,
) -> Hypothesis {
    let mut w = Hypothesis {
        deviance: f64::INFINITY,
        prior,
        amplitudes: vec![0.0; signs.len()],
        before: target.energy,
        gain: 0.0,
        given: vec![0.0; products.given],
    };
    let keep = keeps(prior, target.of_friction, scale.weight);
    solve_at(&keep, target, products, signs, most, &mut w);
    w
}

/// Least squares at one size of the soft directions.
fn solve_at(
    keep: &[f64],
    target: &Target<'_>,
    products: &Products,
    signs: &[Sign],
    most: u32,
    into: &mut Hypothesis,
) {
    let total = products.moment.len();
    let taken: Vec<f64> = keep.iter().map(|k| 1.0 - k * k).collect();
    let less =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).zip(&taken).map(|((a, b), s)| a * b * s).sum() };
    let mut energy = target.energy - less(&target.components, &target.components);
    let c = &products.components;
    let mut gram: Vec<Vec<f64>> =
        (0..total).map(|i| (0..total).map(|j| products.gram[i][j] - less(&c[i], &c[j])).collect()).collect();
    let mut moment: Vec<f64> =
        (0..total).map(|i| products.moment[i] - less(&c[i], &target.components)).collect();
    // The given columns are taken out one by one.
    for g in 0..products.given {
        let pivot = gram[g][g];
        if !(pivot > 1e-12 * products.gram[g][g]) || !(pivot > 0.0) {
            continue;
        }
        energy -= moment[g] * moment[g] / pivot;
        let row = gram[g].clone();
        let with = moment[g];
        for i in g + 1..total {
            let factor = row[i] / pivot;
            moment[i] -= factor * with;
            for j in g + 1..total {
                gram[i][j] -= factor * row[j];
            }
        }
    }
    into.before = energy.max(0.0);
    let first = products.given;
    let rest: Vec<Vec<f64>> = gram[first..].iter().map(|r| r[first..].to_vec()).collect();
    (into.amplitudes, into.gain) = amplitudes(&rest, &moment[first..], signs, most);
    into.gain = into.gain.min(into.before);
    if first > 0 {
        // What the given ones become beside them.
        let full: Vec<Vec<f64>> = (0..first)
            .map(|i| (0..first).map(|j| products.gram[i][j] - less(&c[i], &c[j])).collect())
            .collect();
        let freed: Vec<f64> = (0..first)
            .map(|i| {
                let own = products.moment[i] - less(&c[i], &target.components);
                let beside: f64 = into
                    .amplitudes
                    .iter()
                    .enumerate()
                    .map(|(j, a)| a * (products.gram[i][first + j] - less(&c[i], &c[first + j])))
                    .sum();
                own - beside
            })
            .collect();
        let all: Vec<usize> = (0..first).collect();
        if let Some(solution) = solve_symmetric(&full, &freed, &all) {
            into.given = solution;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three unit directions: one soft, one that only an effect reaches, one of noise.
    fn target(soft: f64, beyond: f64, noise: f64) -> Target<'static> {
        Target {
            energy: soft * soft + beyond * beyond + noise * noise,
            components: vec![soft],
            of_friction: &[false],
        }
    }

    fn effect(soft: f64, beyond: f64, target: &Target<'_>, along: f64) -> Products {
        Products {
            gram: vec![vec![soft * soft + beyond * beyond]],
            moment: vec![soft * target.components[0] + beyond * along],
            components: vec![vec![soft]],
            given: 0,
        }
    }

    #[test]
    fn effects_that_tables_imitate_gain_nothing_and_effects_that_make_tables_equal_gain_much() {
        let scale = Scale { weight: 100.0, independent: 100.0, sigma: 0.1, blocked: 100.0 };
        let nothing = Products::default();
        // A surface of 5 N rms that differs between pressures.
        let t = target(50.0, 5.0, 1.0);
        let null = likelihood(&scale, &t, &nothing, &[], 0);
        // An effect with the same proportion of soft to beyond explains both parts together.
        let fits = likelihood(&scale, &t, &effect(10.0, 1.0, &t, 5.0), &[Sign::Free], 1);
        assert!((fits.amplitudes[0] - 5.0).abs() < 0.05, "{:?}", fits.amplitudes);
        assert!(null.deviance - fits.deviance > 50.0, "{} {}", null.deviance, fits.deviance);
        assert!(fits.prior.elastic < 0.1 * null.prior.elastic);
        // One that lies in the tables wholly saves them a little, and is far less believed.
        let lies = likelihood(&scale, &t, &effect(10.0, 0.0, &t, 5.0), &[Sign::Free], 1);
        assert!(fits.deviance < lies.deviance - 20.0);
    }

    #[test]
    fn a_given_column_is_fitted_in_any_case() {
        let scale = Scale { weight: 10.0, independent: 10.0, sigma: 1e-3, blocked: 1.0 };
        let t = Target { energy: 13.0, components: vec![], of_friction: &[] };
        // y = 2 a + 3 b with orthonormal a, b; a is given.
        let p = Products {
            gram: vec![vec![1.0, 0.0], vec![0.0, 1.0]],
            moment: vec![2.0, 3.0],
            components: vec![vec![], vec![]],
            given: 1,
        };
        let w = likelihood(&scale, &t, &p, &[Sign::Free], 1);
        assert!((w.before - 9.0).abs() < 1e-12 && (w.gain - 9.0).abs() < 1e-12);
        assert!((w.given[0] - 2.0).abs() < 1e-12);
    }
}
