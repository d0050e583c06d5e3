//! The library of effects as columns: each candidate evaluated over the rows, per amplitude, on a grid of its shapes.

use model_core::effects::{Axis, Context, Imitates, Info, MEMORY, Parameter, Role, Traits, Vented};

use super::beginnings::preceded;
use super::criteria::candidates::{CHANGE_POINTS, LAW_ERROR, LOGARITHMIC_RANGE, RANGE_OVERSHOOT, SHAPE_GRID};
use super::linear::Sign;
use super::rows::{Rows, typical_step};
use pam_fit::bench::{self, Span, read_when_vented};

/// The equations of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    /// Of the catalogue.
    Catalogue(bench::Candidate),
    /// Of an effect that a test adds.
    #[cfg(test)]
    Added(crate::tests::added::AddedName),
}

impl Law {
    fn info(self) -> &'static Info {
        match self {
            Self::Catalogue(law) => law.info(),
            #[cfg(test)]
            Self::Added(law) => law.info(),
        }
    }

    fn traits(self) -> &'static Traits {
        match self {
            Self::Catalogue(law) => law.traits(),
            #[cfg(test)]
            Self::Added(law) => law.traits(),
        }
    }

    fn is_bench(self) -> bool {
        matches!(self, Self::Catalogue(law) if law.is_bench())
    }

    fn columns(self, contexts: &[Context<f64>], shapes: &[f64], memory: &mut [f64; MEMORY]) -> Vec<Vec<f64>> {
        match self {
            Self::Catalogue(law) => law.columns(contexts, shapes, memory),
            #[cfg(test)]
            Self::Added(law) => {
                let equations = (
                    |p: &[f64], c: &Context<f64>, m: &mut [f64; MEMORY]| law.step(p, c, m),
                    |p: &[f64], c: &Context<f64>, m: &[f64; MEMORY]| law.force(p, c, m),
                );
                bench::columns_of(law.info(), equations, contexts, shapes, memory)
            }
        }
    }
}

/// One member of the library.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Its equations.
    pub law: Law,
    /// What it is.
    pub info: &'static Info,
    /// What is to be known of it beside its equations.
    pub traits: &'static Traits,
    /// Whether a check of the bench shows that it is there.
    pub shown_by_check: bool,
    /// The range of the recordings on the axes of shapes.
    span: Span,
}

impl Candidate {
    /// The same; `shown` says if a check of the bench shows that it is there.
    pub(crate) fn with_check(self, shown: bool) -> Self {
        Self { shown_by_check: shown, ..self }
    }

    /// Its name in the catalogue.
    pub(crate) fn name(&self) -> &'static str {
        self.info.name
    }

    /// Whether it is this effect of the catalogue.
    pub(crate) fn is(&self, effect: bench::Candidate) -> bool {
        self.law == Law::Catalogue(effect)
    }

    /// Whether it belongs to the bench and corrects the data.
    pub(crate) fn of_the_bench(&self) -> bool {
        self.law.is_bench()
    }

    /// Its shape parameters, with ranges that the recordings reach.
    pub(super) fn shapes(&self) -> impl Iterator<Item = Parameter> + '_ {
        self.info.parameters.iter().filter(|p| p.role == Role::Shape).map(|p| {
            let (low, high) = self.span.range(p);
            Parameter { low, high, ..*p }
        })
    }

    /// Which sign each amplitude may have, by its plausible range.
    pub(crate) fn signs(&self) -> Vec<Sign> {
        self.info
            .parameters
            .iter()
            .filter(|p| p.role == Role::Amplitude)
            .map(|p| {
                if p.low >= 0.0 {
                    Sign::Positive
                } else if p.high <= 0.0 {
                    Sign::Negative
                } else {
                    Sign::Free
                }
            })
            .collect()
    }

    /// Whether a tare alone shows it: a weight, or an offset.
    pub(crate) fn shown_vented(&self, rows: &Rows) -> bool {
        self.traits.vented == Vented::Constant && rows.vented.contains(&true)
    }

    /// How inexact its law is, as a share of its trace. A constant that a vented muscle shows is exact; elsewhere it is identified by how
    /// friction scales with the pull, and that law is no more exact than others.
    pub(super) fn law_error(&self, rows: &Rows) -> f64 {
        if self.shown_vented(rows) { 0.0 } else { LAW_ERROR }
    }

    /// The grid of shapes that is scanned first.
    pub(crate) fn grid(&self) -> Vec<Vec<f64>> {
        let shapes: Vec<Parameter> = self.shapes().collect();
        let points = match shapes.len() {
            0 | 1 => SHAPE_GRID[0],
            2 => SHAPE_GRID[1],
            3 => SHAPE_GRID[2],
            _ => SHAPE_GRID[3],
        };
        let mut grid = vec![Vec::new()];
        for p in shapes {
            // A change point cannot be refined from far away: the trace moves with it instead of growing.
            let points = if p.axis == Axis::Time { CHANGE_POINTS } else { points };
            let axis: Vec<f64> = (0..points).map(|i| place(&p, (i as f64 + 0.5) / points as f64)).collect();
            grid = grid
                .into_iter()
                .flat_map(|g: Vec<f64>| {
                    axis.iter().map(move |a| {
                        let mut with = g.clone();
                        with.push(*a);
                        with
                    })
                })
                .collect();
        }
        grid
    }

    /// Shapes near `center`: each parameter moved by `step` of its range (its logarithm where it spans decades).
    pub(crate) fn neighbours(&self, center: &[f64], step: f64) -> Vec<Vec<f64>> {
        let mut near = Vec::new();
        for (i, p) in self.shapes().enumerate() {
            for sign in [-1.0, 1.0] {
                let u = unplace(&p, center[i]) + sign * step;
                if (-RANGE_OVERSHOOT..=1.0 + RANGE_OVERSHOOT).contains(&u) {
                    let mut moved = center.to_vec();
                    moved[i] = place(&p, u.clamp(0.0, 1.0));
                    near.push(moved);
                }
            }
        }
        near
    }

    /// The smallest step of its shapes, as a share of their range, that the recordings distinguish: a change point stands between two rows.
    pub(super) fn finest_step(&self, rows: &Rows) -> f64 {
        let points = self.shapes().filter(|p| p.axis == Axis::Time);
        points.map(|p| typical_step(rows) / (p.high - p.low)).fold(f64::INFINITY, f64::min)
    }

    /// Whether parameters that were fitted freely can belong to one cause.
    pub(super) fn is_consistent(&self, amplitudes: &[f64], shapes: &[f64]) -> bool {
        (self.traits.consistent)(amplitudes, shapes)
    }

    /// Its force per unit of each amplitude, N, over the rows in order.
    pub(crate) fn columns(&self, shapes: &[f64], rows: &Rows) -> Vec<Vec<f64>> {
        let mut memory = [0.0; MEMORY];
        let mut columns = if rows.beginning().concerns(self.info) {
            let (contexts, is_row) = preceded(rows, self.info);
            let mut columns = self.law.columns(&contexts, shapes, &mut memory);
            for column in &mut columns {
                let mut kept = is_row.iter();
                column.retain(|_| kept.next() == Some(&true));
            }
            columns
        } else {
            self.law.columns(rows.contexts(), shapes, &mut memory)
        };
        for (amplitude, column) in columns.iter_mut().enumerate() {
            let vented_too = read_when_vented(self.traits, amplitude);
            for (value, vented) in column.iter_mut().zip(&rows.vented) {
                if (*vented && !vented_too) || !value.is_finite() {
                    *value = 0.0;
                }
            }
        }
        columns
    }
}

/// The value at a share of a parameter's range; by its logarithm where it spans decades.
fn place(p: &Parameter, u: f64) -> f64 {
    if p.low > 0.0 && p.high > LOGARITHMIC_RANGE * p.low {
        (p.low.ln() + u * (p.high / p.low).ln()).exp()
    } else {
        p.low + u * (p.high - p.low)
    }
}

/// The share of a parameter's range at which a value stands.
pub(super) fn unplace(p: &Parameter, value: f64) -> f64 {
    if p.low > 0.0 && p.high > LOGARITHMIC_RANGE * p.low {
        (value / p.low).ln() / (p.high / p.low).ln()
    } else {
        (value - p.low) / (p.high - p.low).max(1e-300)
    }
}

/// All candidate effects, in the order of the library. What is part of the base model is not a candidate: the gauge's offset is the
/// deadband, and the baselines offer a higher elastic order. What only differences between recordings show is found before the search.
///
/// `added` are laws beyond the catalogue.
pub(crate) fn library(rows: &Rows, added: &[Law]) -> Vec<Candidate> {
    let span = Span::of(rows.contexts()).unwrap_or(Span {
        time: (0.0, 1.0),
        contraction: (0.0, 1.0),
        stroke: (0.0, 1.0),
    });
    let catalogue = bench::Candidate::all().map(Law::Catalogue);
    catalogue
        .chain(added.iter().copied())
        .map(|law| Candidate { law, info: law.info(), traits: law.traits(), shown_by_check: false, span })
        .filter(|c| !matches!(c.traits.imitates, Some(Imitates::Deadband | Imitates::ElasticOrders)))
        .filter(|c| !c.traits.between_recordings)
        .collect()
}
