//! The joint fit: Gauss–Newton steps in the shared force, the laws between muscles and the random effects, and the variances of these.
//!
//! ```text
//! minimise  Σ w r² / σ² + |D β|² + Σ u² / τ²        over β (surface), the laws, and the random effects u
//! τ² ← (Σ u² + tr C_uu + ν τ_0²) / (n + ν)           C: inverse of the normal equations
//! ```
//! `w ≤ 1` shares what a half-stroke can determine among its cells. The scales of the muscles sum to zero: their mean is in the surface.

use nalgebra::{Cholesky, DMatrix, DVector};
use pam_data::statistics::extremes;

use super::cells::{Cell, StockCells};
use super::criteria::{
    BENDING, BOUNDS, COMPLIANCE, ENDS, GAP, GAP_BENDING, INTERVALS, LENGTH, MOUNTED, NUMBERS_PER_HALF,
    PRIOR_WEIGHT, RESIDUAL, SCALE, SETTLED, STEPS, TAPER, ZERO,
};
use super::surface::Surface;
use super::{Deviations, Law, Own, StockFit, Value};

/// Which unknown stands where.
#[derive(Debug, Clone)]
struct Places {
    /// Coefficients of one of the two surfaces.
    surface: usize,
    muscles: usize,
    /// Number of the first mounting of each muscle, and of all.
    first: Vec<usize>,
    mountings: usize,
}

impl Places {
    fn of(cells: &StockCells, surface: &Surface) -> Self {
        let mut first = vec![0];
        for own in &cells.mountings {
            first.push(first[first.len() - 1] + own.len());
        }
        let mountings = first.pop().unwrap_or(0);
        Self { surface: surface.len(), muscles: cells.mountings.len(), first, mountings }
    }

    fn scale(&self, muscle: usize) -> usize {
        2 * self.surface + muscle
    }
    fn length(&self, muscle: usize) -> usize {
        self.scale(self.muscles) + muscle
    }
    fn mounted(&self, mounting: usize) -> usize {
        self.length(self.muscles) + mounting
    }
    fn zero(&self, mounting: usize) -> usize {
        self.mounted(self.mountings) + mounting
    }
    fn law(&self, law: usize) -> usize {
        self.zero(self.mountings) + law
    }
    fn len(&self) -> usize {
        self.law(Law::ALL.len())
    }
    fn mounting(&self, cell: &Cell) -> usize {
        self.first[cell.member] + cell.mounting
    }
}

/// A group of random effects with one variance.
struct Group {
    from: usize,
    count: usize,
    start: f64,
    weight: f64,
    deviation: f64,
}

impl Group {
    fn new(from: usize, count: usize, start: f64, weight: f64) -> Self {
        Self { from, count, start, weight, deviation: start }
    }

    /// Expectation and maximisation.
    fn update(&mut self, at: &DVector<f64>, covariance: &DMatrix<f64>) {
        let square: f64 =
            (self.from..self.from + self.count).map(|k| at[k].powi(2) + covariance[(k, k)]).sum();
        let next = ((square + self.weight * self.start.powi(2)) / (self.count as f64 + self.weight)).sqrt();
        if next.is_finite() {
            self.deviation = next.clamp(BOUNDS.0 * self.start, BOUNDS.1 * self.start);
        }
    }
}

/// The fit while it is made.
struct Search<'a> {
    cells: &'a StockCells,
    surface: Surface,
    places: Places,
    groups: [Group; 4],
    /// Precision of the laws; infinite where a law is not fitted.
    laws: [f64; 3],
    penalty: DMatrix<f64>,
    inverse_length: f64,
    at: DVector<f64>,
    sigma: f64,
}

/// Normal equations at the present place.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// `Σ w r²`, `Σ w`, and the mean square of the residuals.
    weighted: f64,
    weights: f64,
    mean_square: f64,
}

/// Fits muscles together; `None` where there are too few, or where the equations cannot be solved. `start`: a fit of the same muscles by the same
/// laws to nearly the same cells.
#[must_use]
pub fn fit(cells: &StockCells, laws: &[Law], start: Option<&StockFit>) -> Option<StockFit> {
    let mut search = Search::new(cells, laws, start)?;
    let mut solved = None;
    // From the beginning, first a surface, then what differs from it.
    let (surface_only, least) = if start.is_some() { (0, 2) } else { (2, 8) };
    for step in 0..STEPS {
        let normal = search.normal();
        let (matrix, right) = search.penalised(&normal);
        let factor = Cholesky::new(matrix)?;
        let moved = search.step(&factor.solve(&right), step < surface_only);
        let covariance = factor.inverse();
        if step >= surface_only {
            search.deviations(&normal, &covariance);
        }
        solved = Some(covariance);
        if step >= least && moved < SETTLED {
            break;
        }
    }
    let rms = search.normal().mean_square.sqrt();
    Some(search.finish(&solved?, rms))
}

impl<'a> Search<'a> {
    fn new(cells: &'a StockCells, laws: &[Law], start: Option<&StockFit>) -> Option<Self> {
        let mut taken = vec![false; cells.rest_length.len()];
        cells.list.iter().for_each(|c| taken[c.member] = true);
        let lengths: Vec<f64> =
            cells.rest_length.iter().zip(&taken).filter(|(_, t)| **t).map(|(l, _)| *l).collect();
        if lengths.len() < 2 || !(cells.largest > 0.0) {
            return None;
        }
        let range = |of: &dyn Fn(&Cell) -> f64| extremes(cells.list.iter().map(of));
        let contraction = range(&|c| cells.contraction(c));
        // Lengths that are corrected reach a little beyond the measured ones.
        let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let margin = 2.0 * LENGTH / shortest;
        let own = || {
            Surface::new(range(&|c| c.pressure), (contraction.0 - margin, contraction.1 + margin), INTERVALS)
        };
        let surface = start.map_or_else(own, |s| s.surface.clone());
        let places = Places::of(cells, &surface);
        let (muscles, mountings) = (places.muscles, places.mountings);
        let mut groups = [
            Group::new(places.scale(0), muscles, SCALE, PRIOR_WEIGHT),
            Group::new(places.length(0), muscles, LENGTH, PRIOR_WEIGHT),
            Group::new(places.mounted(0), mountings, MOUNTED, 2.0 * PRIOR_WEIGHT),
            Group::new(places.zero(0), mountings, ZERO * cells.largest, 2.0 * PRIOR_WEIGHT),
        ];
        let wide = [ENDS * cells.diameter, TAPER * cells.diameter, COMPLIANCE / cells.largest];
        let mut precision = [f64::INFINITY; 3];
        for (k, law) in Law::ALL.iter().enumerate() {
            if laws.contains(law) {
                precision[k] = wide[k].powi(-2);
            }
        }
        let mut sigma = RESIDUAL * cells.largest;
        let mut at = DVector::zeros(places.len());
        if let Some(start) = start.filter(|s| s.unknowns.len() == places.len()) {
            let d = start.deviations;
            for (group, deviation) in groups.iter_mut().zip([d.scale, d.length, d.mounted, d.zero]) {
                group.deviation = deviation;
            }
            sigma = d.residual;
            at.copy_from_slice(&start.unknowns);
        }
        Some(Self {
            penalty: penalty(&surface, &places, cells.largest),
            at,
            inverse_length: lengths.iter().map(|l| 1.0 / l).sum::<f64>() / lengths.len() as f64,
            sigma,
            cells,
            surface,
            places,
            groups,
            laws: precision,
        })
    }

    /// Force of a cell by the present solution, and its derivatives.
    fn model(&self, cell: &Cell, row: &mut Vec<(usize, f64)>) -> f64 {
        row.clear();
        let (places, at) = (&self.places, &self.at);
        let mounting = places.mounting(cell);
        let rest = self.cells.rest_length[cell.member];
        let [ends, taper, compliance] = [0, 1, 2].map(|k| at[places.law(k)]);
        let own = at[places.length(cell.member)] + at[places.mounted(mounting)];
        let contraction = (cell.stroke + own + compliance * cell.force) / rest;
        let beyond = 1.0 / rest - self.inverse_length;
        let scale = at[places.scale(cell.member)].exp();
        let pull = 1.0 - (ends + taper * contraction) * beyond;
        let factor = scale * pull;
        let (values, slopes) = self.surface.at(cell.pressure, contraction);
        let sum =
            |of: &[(usize, f64); 16], from: usize| of.iter().map(|(k, v)| v * at[from + k]).sum::<f64>();
        let gap = places.surface;
        let force = sum(&values, 0) + cell.direction * sum(&values, gap);
        let slope = sum(&slopes, 0) + cell.direction * sum(&slopes, gap);
        for (k, v) in values {
            row.push((k, factor * v));
            row.push((gap + k, factor * cell.direction * v));
        }
        let by_contraction = factor * slope - scale * taper * beyond * force;
        row.push((places.scale(cell.member), factor * force));
        row.push((places.length(cell.member), by_contraction / rest));
        row.push((places.mounted(mounting), by_contraction / rest));
        row.push((places.zero(mounting), 1.0));
        row.push((places.law(0), -scale * beyond * force));
        row.push((places.law(1), -scale * beyond * contraction * force));
        row.push((places.law(2), by_contraction / rest * cell.force));
        factor * force + at[places.zero(mounting)]
    }

    fn normal(&self) -> Normal {
        let n = self.places.len();
        let mut normal = Normal {
            matrix: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
            weighted: 0.0,
            weights: 0.0,
            mean_square: 0.0,
        };
        let mut row = Vec::new();
        for cell in &self.cells.list {
            let residual = cell.force - self.model(cell, &mut row);
            let share = (NUMBERS_PER_HALF / cell.in_half).min(1.0);
            normal.weighted += share * residual * residual;
            normal.weights += share;
            normal.mean_square += residual * residual / self.cells.list.len() as f64;
            let weight = share / self.sigma.powi(2);
            for (i, a) in &row {
                normal.right[*i] += weight * a * residual;
                for (j, b) in &row {
                    normal.matrix[(*i, *j)] += weight * a * b;
                }
            }
        }
        normal
    }

    /// Precision of the unknowns beside the surface, by the variances.
    fn precisions(&self) -> Vec<(usize, f64)> {
        let random =
            self.groups.iter().flat_map(|g| (g.from..g.from + g.count).map(|k| (k, g.deviation.powi(-2))));
        let laws = self.laws.iter().enumerate().map(|(k, p)| (self.places.law(k), *p));
        random.chain(laws).collect()
    }

    /// The equations with penalty and priors. A law that is not fitted has the equation `1 · x = 0`.
    fn penalised(&self, normal: &Normal) -> (DMatrix<f64>, DVector<f64>) {
        let mut matrix = &normal.matrix + &self.penalty;
        let mut right = &normal.right - &self.penalty * &self.at;
        for (k, precision) in self.precisions() {
            if precision.is_finite() {
                matrix[(k, k)] += precision;
                right[k] -= precision * self.at[k];
            } else {
                matrix.row_mut(k).fill(0.0);
                matrix.column_mut(k).fill(0.0);
                matrix[(k, k)] = 1.0;
                right[k] = 0.0;
            }
        }
        (matrix, right)
    }

    /// Takes a step, shortened so that no random effect moves by more than its deviation. The largest move, in deviations.
    fn step(&mut self, by: &DVector<f64>, surface_only: bool) -> f64 {
        let random = self.places.scale(0)..self.places.law(0);
        let mut by = by.clone();
        if surface_only {
            by.rows_mut(random.start, self.places.len() - random.start).fill(0.0);
        }
        let moves = |by: &DVector<f64>| {
            self.groups
                .iter()
                .flat_map(|g| (g.from..g.from + g.count).map(|k| (by[k] / g.start).abs()))
                .fold(0.0, f64::max)
        };
        let largest = moves(&by);
        let share = if largest > 1.5 { 1.5 / largest } else { 1.0 };
        self.at += share * by;
        largest
    }

    fn deviations(&mut self, normal: &Normal, covariance: &DMatrix<f64>) {
        for group in &mut self.groups {
            group.update(&self.at, covariance);
        }
        // Numbers that the solution spends: tr(H⁻¹ N).
        let spent = covariance.component_mul(&normal.matrix).sum();
        let free = (normal.weights - spent).max(0.2 * normal.weights);
        let next = (normal.weighted / free).sqrt();
        if next.is_finite() && next > 1e-6 * self.cells.largest {
            self.sigma = next;
        }
    }

    fn finish(self, covariance: &DMatrix<f64>, rms: f64) -> StockFit {
        let value = |k: usize| Value { value: self.at[k], std: covariance[(k, k)].max(0.0).sqrt() };
        let places = &self.places;
        let own = |m: usize| {
            let from = places.first[m];
            let mountings = from..from + self.cells.mountings[m].len();
            Own {
                scale: value(places.scale(m)),
                length: value(places.length(m)),
                mounted: mountings.clone().map(|k| value(places.mounted(k))).collect(),
                zero: mountings.map(|k| value(places.zero(k))).collect(),
            }
        };
        let mut shared = [Value::default(); 3];
        for (k, v) in shared.iter_mut().enumerate().filter(|(k, _)| self.laws[*k].is_finite()) {
            *v = value(places.law(k));
        }
        let [scale, length, mounted, zero] = [0, 1, 2, 3].map(|k: usize| self.groups[k].deviation);
        StockFit {
            coefficients: self.at.rows(0, 2 * places.surface).iter().copied().collect(),
            shared,
            own: (0..places.muscles).map(own).collect(),
            deviations: Deviations { scale, length, mounted, zero, residual: self.sigma },
            inverse_length: self.inverse_length,
            unknowns: self.at.iter().copied().collect(),
            rms,
            surface: self.surface,
        }
    }
}

/// The penalty on bending, that on the gap, and the sum of the scales.
fn penalty(surface: &Surface, places: &Places, largest: f64) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(places.len(), places.len());
    for (over_pressure, row) in surface.bending() {
        let share = if over_pressure { BENDING.0 } else { BENDING.1 };
        for (from, factor) in [(0, 1.0), (places.surface, GAP_BENDING)] {
            let weight = (share * factor * largest).powi(-2);
            for (i, a) in row {
                for (j, b) in row {
                    matrix[(from + i, from + j)] += weight * a * b;
                }
            }
        }
    }
    for k in 0..places.surface {
        // Where no cell is, a force of many times the largest is as far as it may go.
        matrix[(k, k)] += (20.0 * largest).powi(-2);
        matrix[(places.surface + k, places.surface + k)] += (GAP * largest).powi(-2);
    }
    let exact = (1e-3 * SCALE).powi(-2);
    for i in 0..places.muscles {
        for j in 0..places.muscles {
            matrix[(places.scale(i), places.scale(j))] += exact;
        }
    }
    matrix
}
