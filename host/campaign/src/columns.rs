//! The columns of the design: what the table's coefficients and each effect do to the force, row by row.

use model_core::effects::{Context, MEMORY};
use model_core::muscle::Muscle;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use pam_data::recording::{Campaign, Recording};
use pam_diagnose::protocol_simulation::moments;
use pam_fit::bench::{Candidate, Span};
use pam_fit::numerics::spline_basis::SplineBasis;

use crate::criteria::{PRIOR_BEND, PRIOR_COLUMN};
use crate::hypothesis::{Hypothesis, NO_PAST, candidates};
use crate::places::Places;

/// Elastic orders of the table.
const ORDERS: i32 = 4;
/// Share of the highest pressure below which the muscle counts as vented.
const VENTED: f64 = 0.05;
/// Sets larger than this are judged by their most probable members (cost).
const LARGEST_SET: usize = 10;

/// The table's coefficients over a spline of the pressure, and the places where its force must be known.
#[derive(Debug)]
pub(crate) struct Table {
    basis: SplineBasis,
    top: f64,
    /// Scale of each order's column, of friction's and of the area's.
    scale: Vec<f64>,
    prior: DMatrix<f64>,
    /// Columns at unseen pressures and strokes.
    targets: Vec<DVector<f64>>,
}

impl Table {
    pub(crate) fn new(model: &Muscle<f64>, levels: &[f64], blocked: f64, places: &Places) -> Self {
        let basis = SplineBasis::new(levels);
        let mut table = Self {
            top: levels.last().copied().unwrap_or(1.0),
            scale: vec![1.0; ORDERS as usize + 2],
            prior: DMatrix::zeros(0, 0),
            targets: Vec::new(),
            basis,
        };
        let contexts = unseen(model, levels, places);
        for c in &contexts {
            for (s, v) in table.scale.iter_mut().zip(table_parts(c)) {
                *s = s.max(v.abs());
            }
        }
        // Begins at 1: what is smaller there is smaller everywhere.
        table.targets = contexts.iter().map(|c| table.row(c)).collect();
        table.prior = table.prior_precision(blocked.max(1e-9));
        table
    }

    /// How many coefficients.
    pub(crate) fn len(&self) -> usize {
        (ORDERS as usize + 1) * self.basis.nodes().len() + 1
    }

    /// The columns at one row; zeros where the muscle is vented.
    pub(crate) fn row(&self, c: &Context<f64>) -> DVector<f64> {
        let mut row = DVector::zeros(self.len());
        if c.pressure < VENTED * self.top {
            return row;
        }
        let phi = self.basis.at(c.pressure);
        let n = phi.len();
        let parts = table_parts(c);
        for (k, part) in parts[..=ORDERS as usize].iter().enumerate() {
            for (j, f) in phi.iter().enumerate() {
                row[k * n + j] = part / self.scale[k] * f;
            }
        }
        row[(ORDERS as usize + 1) * n] = parts[ORDERS as usize + 1] / self.scale[ORDERS as usize + 1];
        row
    }

    fn prior_precision(&self, blocked: f64) -> DMatrix<f64> {
        let (n, m) = (self.basis.nodes().len(), self.len());
        let mut prior = DMatrix::zeros(m, m);
        let own = 1.0 / (PRIOR_COLUMN * blocked).powi(2);
        for i in 0..m {
            prior[(i, i)] = own;
        }
        let bend = 1.0 / (PRIOR_BEND * blocked).powi(2);
        for k in 0..=ORDERS as usize {
            for j in 1..n.saturating_sub(1) {
                let places = [(k * n + j - 1, 1.0), (k * n + j, -2.0), (k * n + j + 1, 1.0)];
                for (a, u) in places {
                    for (b, v) in places {
                        prior[(a, b)] += bend * u * v;
                    }
                }
            }
        }
        prior
    }

    /// Adds the prior distribution to the block of the table's coefficients, which comes first.
    pub(crate) fn add_prior(&self, inner: &mut DMatrix<f64>) {
        let m = self.len();
        for i in 0..m {
            for j in 0..m {
                inner[(i, j)] += self.prior[(i, j)];
            }
        }
    }

    /// The coefficients' precision, from products of columns.
    pub(crate) fn precision(&self, gram: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
        #[cfg(test)]
        work::FACTORIZED.set(work::FACTORIZED.get() + 1);
        let m = self.len();
        let mut inner = gram.view((0, 0), (m, m)).into_owned();
        self.add_prior(&mut inner);
        Cholesky::new(inner)
    }

    /// Variances of the force at unseen places, N².
    pub(crate) fn errors(&self, precision: &Cholesky<f64, Dyn>) -> Vec<f64> {
        self.targets.iter().map(|g| g.dot(&precision.solve(g)).max(0.0)).collect()
    }
}

/// What each order, friction and area do to the force at one row.
fn table_parts(c: &Context<f64>) -> [f64; ORDERS as usize + 2] {
    let mut parts = [0.0; ORDERS as usize + 2];
    for order in 1..=ORDERS {
        parts[order as usize - 1] =
            c.axial_area * c.axial_strain.powi(order) - c.hoop_area * c.radial_strain.powi(order);
    }
    parts[ORDERS as usize] = c.direction * c.quasi;
    parts[ORDERS as usize + 1] = c.area;
    parts
}

/// Slow strokes at the pressures of the table and between them.
fn unseen(model: &Muscle<f64>, levels: &[f64], places: &Places) -> Vec<Context<f64>> {
    let between = levels.windows(2).map(|w| 0.5 * (w[0] + w[1]));
    let mut time = 0.0;
    let mut contexts = Vec::new();
    for p in between.chain(levels.iter().copied()) {
        let free = 0.95 * places.free_stroke(p);
        let mut r = Recording { name: "unseen".into(), ..Recording::default() };
        for i in 0..24 {
            let part = f64::from(i) / 12.0;
            time += 1.0;
            r.time.push(time);
            r.pressure.push(p);
            r.stroke.push(free * (1.0 - (1.0 - part).abs()));
        }
        time += 10.0;
        contexts.extend(moments(model, &Campaign::new(vec![r])));
    }
    contexts
}

/// What a design costs, counted in tests: these depend on no clock.
#[cfg(test)]
pub(crate) mod work {
    use std::cell::Cell;

    thread_local! {
        /// How often the table was factorized.
        pub(crate) static FACTORIZED: Cell<usize> = const { Cell::new(0) };
        /// For how many rows the columns were computed.
        pub(crate) static ROWS: Cell<usize> = const { Cell::new(0) };
    }
}

/// One effect of the design, and the shapes that it is judged at.
#[derive(Debug)]
pub(crate) struct Law {
    pub(crate) law: Candidate,
    /// Values of each shape.
    count: usize,
}

/// All effects of the design.
#[derive(Debug)]
pub(crate) struct Library {
    pub(crate) laws: Vec<Law>,
}

impl Library {
    /// All effects that a campaign checks for; those of the sets with more shapes.
    pub(crate) fn new(sets: &[Vec<Hypothesis>]) -> Self {
        let open = |law: Candidate| sets.iter().any(|s| s.iter().take(LARGEST_SET).any(|h| h.law == law));
        let mut named = candidates();
        for h in sets.iter().flatten() {
            if !named.contains(&h.law) {
                named.push(h.law);
            }
        }
        let laws = named.into_iter().map(|law| {
            let count = match (open(law), law.shapes().len()) {
                (true, 1) => 3,
                (_, 1 | 2) => 2,
                _ => 1,
            };
            Law { law, count }
        });
        Self { laws: laws.collect() }
    }

    /// Which one an effect is.
    pub(crate) fn index(&self, law: Candidate) -> Option<usize> {
        self.laws.iter().position(|l| l.law == law)
    }
}

/// Where the columns of an effect are.
#[derive(Debug, Clone, Default)]
pub(crate) struct Where {
    /// For each shape, the columns of its amplitudes.
    pub(crate) shapes: Vec<Vec<usize>>,
    grid: Vec<Vec<f64>>,
}

impl Where {
    /// The columns of the shape in the middle.
    pub(crate) fn first_shape(&self) -> impl Iterator<Item = &usize> {
        self.shapes.get(self.shapes.len() / 2).into_iter().flatten()
    }

    /// The columns of the shape nearest to given values.
    pub(crate) fn nearest(&self, law: Candidate, values: &[f64], span: &Span) -> &[usize] {
        let distance = |shape: &[f64]| {
            law.shapes()
                .iter()
                .zip(shape.iter().zip(values))
                .map(|(parameter, (a, b))| {
                    let (low, high) = span.range(parameter);
                    let unit = |v: f64| {
                        if low > 0.0 {
                            (v.max(low) / low).ln() / (high / low).ln()
                        } else {
                            (v - low) / (high - low)
                        }
                    };
                    (unit(*a) - unit(*b)).powi(2)
                })
                .sum::<f64>()
        };
        let best = self.grid.iter().enumerate().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
        best.and_then(|(i, _)| self.shapes.get(i)).map_or(&[], Vec::as_slice)
    }
}

/// What each effect of the library remembers, for each of its shapes.
pub(crate) type Memories = Vec<Vec<[f64; MEMORY]>>;

/// Where the columns of each effect are when its shapes are judged within a span, and memories without a past.
pub(crate) fn layout(table: &Table, library: &Library, span: &Span) -> (Vec<Where>, Memories) {
    let mut next = table.len();
    let places: Vec<Where> = library
        .laws
        .iter()
        .map(|law| {
            let grid = law.law.grid(law.count, span);
            let amplitudes = law.law.amplitudes().len();
            let shapes = grid.iter().map(|_| {
                next += amplitudes;
                (next - amplitudes..next).collect()
            });
            Where { shapes: shapes.collect(), grid: grid.clone() }
        })
        .collect();
    let memories = places.iter().map(|p| vec![NO_PAST; p.grid.len()]).collect();
    (places, memories)
}

/// The rows of a design.
pub(crate) struct RowsOf {
    /// One row per moment, one column per coefficient of the table (scaled) and per amplitude of an effect (N per unit).
    pub(crate) matrix: DMatrix<f64>,
    /// Largest value of each column; 1 for those of the table.
    pub(crate) peak: Vec<f64>,
}

/// All columns at moments that follow those that left the memories.
pub(crate) fn columns_of_rows(
    table: &Table,
    library: &Library,
    contexts: &[Context<f64>],
    places: &[Where],
    memories: &mut Memories,
) -> RowsOf {
    #[cfg(test)]
    work::ROWS.set(work::ROWS.get() + contexts.len());
    let m = table.len();
    let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(contexts.len()); m];
    for c in contexts {
        for (column, v) in columns.iter_mut().zip(table.row(c).iter()) {
            column.push(*v);
        }
    }
    let mut peak = vec![1.0; m];
    let vented = |c: &Context<f64>| c.pressure < VENTED * table.top;
    for ((law, place), memories) in library.laws.iter().zip(places).zip(memories) {
        for (shape, memory) in place.grid.iter().zip(memories) {
            for (a, mut column) in law.law.columns(contexts, shape, memory).into_iter().enumerate() {
                let stays = law.law.acts_on_a_slack_muscle(a);
                for (v, c) in column.iter_mut().zip(contexts) {
                    if !v.is_finite() || (!stays && vented(c)) {
                        *v = 0.0;
                    }
                }
                peak.push(column.iter().map(|v| v.abs()).fold(0.0, f64::max));
                columns.push(column);
            }
        }
    }
    let matrix = DMatrix::from_fn(contexts.len(), columns.len(), |i, j| columns[j][i]);
    RowsOf { matrix, peak }
}
