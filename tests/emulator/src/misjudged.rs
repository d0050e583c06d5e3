//! Tables whose numbers are wrong by a fifth, one number after another and in the worst corner of all of them.
//!
//! The trim observes what the table leaves out: with the slopes `g` of the table and `g*` of the muscle (∂F/∂P) its loop is
//! `K_i (g + (g* − g) H)/s`, where `H` is the response of the pressure to its demand. While `|g* − g| < g` and `|H| ≤ 1` it is stable, by
//! the small-gain theorem. The corner for a case is therefore the one whose slope is furthest from that of the fitted table.

use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use model_core::units::{Length, Pressure};

use crate::sweep::Subject;

/// A number, or a curve of numbers, of the base model that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// `E_k`, from 1.
    Modulus(usize),
    /// `k_F`.
    Friction,
    /// `P0`.
    Deadband,
}

impl Part {
    /// As text.
    pub fn name(self) -> String {
        match self {
            Self::Modulus(k) => format!("`E_{k}`"),
            Self::Friction => "`k_F`".into(),
            Self::Deadband => "`P0`".into(),
        }
    }

    fn scale(self, table: &mut MuscleTable, factor: f32) {
        match self {
            Self::Modulus(k) => table.elastic[k - 1].iter_mut().for_each(|value| *value *= factor),
            Self::Friction => table.friction.iter_mut().for_each(|value| *value *= factor),
            Self::Deadband => table.deadband = Pressure::from_pascals(table.deadband.pascals() * factor),
        }
    }
}

/// The parts of a table.
pub fn parts(table: &MuscleTable) -> Vec<Part> {
    (1..=table.elastic.len()).map(Part::Modulus).chain([Part::Friction, Part::Deadband]).collect()
}

/// A table whose parts are multiplied by factors.
#[derive(Clone, Debug)]
pub struct Corner {
    /// The parts that are wrong, with their factors.
    pub factors: Vec<(Part, f32)>,
    /// Largest `|g* − g|/g` within the range that is worked in.
    pub slope_error: f64,
}

impl Corner {
    fn of(subject: &Subject, factors: Vec<(Part, f32)>) -> Self {
        let table = scaled(&subject.table, &factors);
        Self { slope_error: slope_error(subject, &table), factors }
    }

    /// The muscle with this table.
    pub fn subject(&self, of: &Subject) -> Subject {
        Subject { table: scaled(&of.table, &self.factors), ..of.clone() }
    }

    /// As text.
    pub fn name(&self) -> String {
        let words: Vec<String> =
            self.factors.iter().map(|(part, factor)| format!("{} × {factor}", part.name())).collect();
        words.join(", ")
    }
}

fn scaled(table: &MuscleTable, factors: &[(Part, f32)]) -> MuscleTable {
    let mut table = table.clone();
    factors.iter().for_each(|(part, factor)| part.scale(&mut table, *factor));
    table
}

/// The largest relative difference of the muscle's slope from that of a wrong table, where the setpoints of the sweep are.
fn slope_error(subject: &Subject, table: &MuscleTable) -> f64 {
    let muscles = [&subject.table, table].map(|table| Muscle::<f64>::build(table).expect("a valid table"));
    let high_pa = f64::from(subject.table.max_pressure.pascals());
    let mut worst = 0.0_f64;
    for x in 0..=6 {
        let stroke = Length::from_metres(0.34 * subject.free_stroke() * f64::from(x) / 6.0);
        for p in 3..=10 {
            let pressure_pa = high_pa * f64::from(p) / 10.0;
            for direction in [-1.0, 1.0] {
                let [right, wrong] = muscles.each_ref().map(|muscle| {
                    let force = |pa| muscle.force(Pressure::from_pascals(pa), stroke, direction).newtons();
                    force(pressure_pa + 100.0) - force(pressure_pa - 100.0)
                });
                worst = worst.max((right - wrong).abs() / wrong.abs().max(1e-12));
            }
        }
    }
    worst
}

/// Each part alone, by both factors.
pub fn alone(subject: &Subject, off: f32) -> Vec<Corner> {
    let parts = parts(&subject.table);
    let both = [1.0 - off, 1.0 + off];
    parts.iter().flat_map(|part| both.map(|factor| Corner::of(subject, vec![(*part, factor)]))).collect()
}

/// Of all corners, the one whose slope is furthest from the fitted table's, and its opposite.
pub fn worst(subject: &Subject, off: f32) -> [Corner; 2] {
    let parts = parts(&subject.table);
    let corner = |signs: u32| {
        let factors = parts.iter().enumerate();
        let factors =
            factors.map(|(at, part)| (*part, if signs >> at & 1 == 0 { 1.0 - off } else { 1.0 + off }));
        Corner::of(subject, factors.collect())
    };
    let all = 1_u32 << parts.len();
    let errors: Vec<f64> = (0..all).map(|signs| corner(signs).slope_error).collect();
    let larger = |a: &u32, b: &u32| errors[*a as usize].total_cmp(&errors[*b as usize]);
    let worst = (0..all).max_by(larger).expect("a corner");
    [corner(worst), corner(all - 1 - worst)]
}
