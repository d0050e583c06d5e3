//! Whether the table still describes the muscle: the load cell against the table, in fixed memory.
//!
//! ```text
//! sample, every 16 ticks ─► means of a block of 16 samples ─► sums with forgetting ─► one test for each shape ─► state
//! ```
//! A change of muscle, rig or sensor adds a force of known shape (`Shape`). For each shape on its own, the residual `r` is regressed
//! on it: `β = Σsr/Σs²`. The shape is a finding if what it explains, `|β|·rms(s)`, exceeds [`TOLERANCE`] by [`ALARM`] standard errors.
//!
//! The unit of information is the block, not the sample, and neighbouring blocks are correlated, too. The variance of `β` is therefore
//! multiplied by `(1 + ρ)/(1 − ρ)`, where `ρ` is the correlation of what the shape leaves over in neighbouring blocks. Nothing is
//! reported before [`ENOUGH`] independent blocks. A residual that no shape explains is correlated, which widens the interval: it does
//! not raise an alarm.
//!
//! The work is divided over ticks, so that no tick does much of it: a sample and the table's slopes there; its sum; of a whole block the
//! means, what ages with them, and one row of the sums in each of the next ticks. All of it is done before the next sample.

use model_core::link::messages::{COLUMNS, HealthSums, LAGGED, SHAPES, SUMS, Shape, TableHealth, WATCHED};
use model_core::scalar::Scalar;
use model_core::table::MuscleTable;

/// Ticks between samples.
pub const SAMPLE_TICKS: u16 = 16;
/// Samples of a block.
pub const BLOCK_SAMPLES: u16 = 16;
/// Ticks of a block.
pub const BLOCK_TICKS: u16 = SAMPLE_TICKS * BLOCK_SAMPLES;
/// Blocks after which a weight has fallen to 1/e: 4.4 minutes of running.
pub const WINDOW: u16 = 1024;
/// Part of the blocked force that a shape may explain, rms: the mean error that a good table has on recordings that it was not fitted to
/// is below that, so that a smaller difference is not a change.
pub const TOLERANCE: f32 = 0.01;
/// Standard errors above the tolerance at which the state becomes `Changed`. Nine shapes, each tested over about one independent
/// window in four minutes, and a variance estimated from [`ENOUGH`] blocks.
pub const ALARM: f32 = 6.0;
/// Standard errors above the tolerance below which the state is `Describes` again.
pub const CLEAR: f32 = 3.0;
/// Independent blocks before anything is reported.
pub const ENOUGH: f32 = 30.0;
/// The highest correlation of neighbouring blocks that is believed; above it there are never enough.
const CORRELATION: f32 = 0.99;

const DECAY: f32 = 1.0 - 1.0 / WINDOW as f32;
const DRIFT: usize = SHAPES - 1;
const RESIDUAL: usize = SHAPES;
/// Place of the weight of the pairs.
const PAIRS: usize = LAGGED - 1;
/// Part of the blocks that must follow another one.
const PAIRED: f32 = 0.25;

/// One sample: the load cell, and what the table says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Load cell, N.
    pub measured_n: f32,
    /// Table, N.
    pub model_n: f32,
    /// Pressure, Pa.
    pub pressure_pa: f32,
    /// `∂F/∂P`, N/Pa.
    pub by_pressure: f32,
    /// `∂F/∂x`, N/m.
    pub by_stroke: f32,
    /// Direction of friction.
    pub direction: f32,
}

/// The scales that make the sums numbers of order one, and the range that the table was tested in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Blocked force, N.
    pub force_n: f32,
    /// Highest tested pressure, Pa.
    pub pressure_pa: f32,
    /// Longest tested stroke, m.
    pub stroke_m: f32,
    /// Shortest tested stroke, m.
    pub stroke_low_m: f32,
}

impl Scales {
    /// Those of a table.
    pub fn of(table: &MuscleTable) -> Self {
        let length_m = table.geometry.rest_length.metres();
        Self {
            force_n: table.blocked_force.newtons().abs().at_least(1e-3),
            pressure_pa: table.tested.pressure_high.pascals().at_least(1e3),
            stroke_m: (table.tested.contraction_high * length_m).at_least(1e-5),
            stroke_low_m: table.tested.contraction_low * length_m,
        }
    }

    /// Whether the table was tested there, and the muscle surely pulls.
    pub fn covers(&self, pressure_pa: f32, stroke_m: f32, model_n: f32) -> bool {
        let margin_m = 0.05 * self.stroke_m;
        pressure_pa > 0.0
            && pressure_pa <= 1.02 * self.pressure_pa
            && stroke_m >= self.stroke_low_m - margin_m
            && stroke_m <= self.stroke_m + margin_m
            && model_n > 0.02 * self.force_n
    }
}

/// What is kept of one muscle.
#[derive(Clone, Debug)]
pub struct Health {
    scales: Scales,
    countdown: u16,
    /// Samples of the present block, the sums of their columns, and the first force.
    samples: u16,
    block: [f32; COLUMNS],
    first_n: f32,
    /// A sample that waits for the next tick.
    staged: Option<Sample>,
    /// What must be done before the rows of a whole block are added.
    due: Due,
    /// The last whole block, while it is being added row by row, and the one before.
    now: [f32; COLUMNS],
    before: [f32; COLUMNS],
    follows: bool,
    row: usize,
    weight: f32,
    blocks: u32,
    sums: [f32; SUMS],
    lagged: [f32; LAGGED],
    state: TableHealth,
    /// The best shape of this round of tests and its excess, and that of the last whole round.
    best: (Shape, f32),
    enough: bool,
    suspect: (Shape, f32),
}

/// Work on a whole block, in the order of the ticks that do it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Due {
    /// No work is due.
    Nothing,
    /// Its means.
    Means,
    /// Sums of the residual, and what has become older.
    Ages,
}

/// Place of a sum in the upper triangle.
const fn place(row: usize, column: usize) -> usize {
    row * COLUMNS - row * (row + 1) / 2 + column
}

/// No row is due.
const IDLE: usize = COLUMNS;

impl Default for Health {
    fn default() -> Self {
        Self::new(Scales { force_n: 1.0, pressure_pa: 1.0, stroke_m: 1.0, stroke_low_m: 0.0 })
    }
}

impl Health {
    /// No samples and no blocks yet.
    pub const fn new(scales: Scales) -> Self {
        Self {
            scales,
            countdown: 0,
            samples: 0,
            block: [0.0; COLUMNS],
            first_n: 0.0,
            staged: None,
            due: Due::Nothing,
            now: [0.0; COLUMNS],
            before: [0.0; COLUMNS],
            follows: false,
            row: IDLE,
            weight: 0.0,
            blocks: 0,
            sums: [0.0; SUMS],
            lagged: [0.0; LAGGED],
            state: TableHealth::Unknown,
            best: (Shape::ForceOffset, f32::NEG_INFINITY),
            enough: false,
            suspect: (Shape::ForceOffset, 0.0),
        }
    }

    /// The scales.
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// What is known of the table.
    pub fn state(&self) -> TableHealth {
        self.state
    }

    /// Lets a tick pass: does the next part of the work, and says whether a sample is due.
    #[inline]
    pub fn tick(&mut self) -> bool {
        if self.staged.is_some() || self.due != Due::Nothing || self.row < IDLE {
            self.work();
        }
        self.countdown = if self.countdown == 0 { SAMPLE_TICKS - 1 } else { self.countdown - 1 };
        self.countdown == 0
    }

    #[inline(never)]
    fn work(&mut self) {
        match (self.staged.take(), self.due) {
            (Some(sample), _) => self.add(&sample),
            (None, Due::Means) => self.take_means(),
            (None, Due::Ages) => self.age(),
            (None, Due::Nothing) => self.add_row(),
        }
    }

    /// What is not comparable ends a block: its samples are dropped.
    pub fn interrupt(&mut self) {
        self.samples = 0;
        self.staged = None;
        self.follows = false;
    }

    /// A sample of a muscle that pulls, within the range that the table was tested in. The next tick adds it.
    pub fn sample(&mut self, sample: &Sample) {
        self.staged = Some(*sample);
    }

    fn add(&mut self, sample: &Sample) {
        let Scales { force_n, pressure_pa, stroke_m, .. } = self.scales;
        let per_n = 1.0 / force_n;
        let force = sample.model_n * per_n;
        let pressure = sample.pressure_pa / pressure_pa;
        let by_pressure = sample.by_pressure * pressure_pa * per_n;
        let by_stroke = sample.by_stroke * stroke_m * per_n;
        let residual = (sample.measured_n - sample.model_n) * per_n;
        // Lag and drift are those of the whole block.
        let columns = [
            1.0,
            force,
            pressure * by_pressure,
            pressure,
            by_pressure,
            by_stroke,
            force * by_stroke,
            sample.direction,
            0.0,
            0.0,
            residual,
        ];
        if !columns.iter().all(|value| value.is_finite()) {
            return self.interrupt();
        }
        if self.samples == 0 {
            self.block = [0.0; COLUMNS];
            self.first_n = force;
        }
        for (sum, value) in self.block.iter_mut().zip(columns) {
            *sum += value;
        }
        self.samples += 1;
        if self.samples == BLOCK_SAMPLES {
            self.samples = 0;
            const SPAN: f32 = BLOCK_SAMPLES as f32
                / ((BLOCK_SAMPLES - 1) as f32 * SAMPLE_TICKS as f32 * crate::tick::TICK_S);
            self.block[Shape::Lag as usize] = (force - self.first_n) * SPAN;
            self.due = Due::Means;
        }
    }

    /// The means of a whole block.
    fn take_means(&mut self) {
        const PART: f32 = 1.0 / BLOCK_SAMPLES as f32;
        for (mean, sum) in self.now.iter_mut().zip(&self.block) {
            *mean = sum * PART;
        }
        self.due = Due::Ages;
    }

    /// Sums of the residual, and what a whole block makes older; its rows are added in the ticks that follow.
    fn age(&mut self) {
        self.due = Due::Nothing;
        self.weight = DECAY * self.weight + 1.0;
        self.blocks = self.blocks.saturating_add(1);
        self.best = (Shape::ForceOffset, f32::NEG_INFINITY);
        self.enough = false;
        // Time counts back from now: all earlier blocks have become older by one.
        const AGE: f32 = 1.0 / WINDOW as f32;
        let residual = self.now[RESIDUAL];
        let square = &mut self.sums[place(RESIDUAL, RESIDUAL)];
        *square = DECAY * *square + residual * residual;
        let fresh = if self.follows { 1.0 } else { 0.0 };
        for (at, pair) in [(PAIRS - 1, residual * self.before[RESIDUAL]), (PAIRS, 1.0)] {
            self.lagged[at] = DECAY * self.lagged[at] + fresh * pair;
        }
        let drift = place(DRIFT, DRIFT);
        self.sums[drift] += AGE * (AGE * self.sums[0] - 2.0 * self.sums[place(0, DRIFT)]);
        for column in 0..COLUMNS {
            let (at, one) = match column {
                DRIFT => continue,
                RESIDUAL => (place(DRIFT, RESIDUAL), place(0, RESIDUAL)),
                _ => (place(column, DRIFT), place(0, column)),
            };
            self.sums[at] -= AGE * self.sums[one];
        }
        self.row = 0;
    }

    /// One row of the block, and the test of its shape.
    fn add_row(&mut self) {
        let row = self.row;
        let value = self.now[row];
        if row == RESIDUAL {
            self.before = self.now;
            self.follows = true;
            self.row = IDLE;
            return self.judge();
        }
        let first = place(row, row);
        for (sum, column) in self.sums[first..first + COLUMNS - row].iter_mut().zip(&self.now[row..]) {
            *sum = DECAY * *sum + value * *column;
        }
        let fresh = if self.follows { 1.0 } else { 0.0 };
        if row < WATCHED {
            let (last, residual) = (self.before[row], self.now[RESIDUAL]);
            let pairs = [value * last, value * self.before[RESIDUAL], residual * last];
            for (sum, pair) in self.lagged[3 * row..3 * row + 3].iter_mut().zip(pairs) {
                *sum = DECAY * *sum + fresh * pair;
            }
        }
        if row < WATCHED {
            self.test(row);
        }
        self.row += 1;
    }

    /// The regression on one shape alone.
    fn test(&mut self, row: usize) {
        let [shape, both, residual] =
            [place(row, row), place(row, RESIDUAL), place(RESIDUAL, RESIDUAL)].map(|at| self.sums[at]);
        if !(shape > 1e-9 * self.weight) {
            return;
        }
        let beta = both / shape;
        let variance = (residual - beta * both) / self.weight;
        let [own, cross, back] = [0, 1, 2].map(|at| self.lagged[3 * row + at]);
        let (pairs, neighbours) = (self.lagged[PAIRS], self.lagged[PAIRS - 1]);
        // Where blocks rarely follow each other, nothing is known of their correlation.
        if !(pairs >= PAIRED * self.weight) {
            return;
        }
        let covariance = (neighbours - beta * (cross + back) + beta * beta * own) / pairs;
        // Noise of single precision, of a residual that is explained to the last digit.
        let floor = 1e-9 + 1e-6 * residual / self.weight;
        let variance = variance.at_least(floor);
        let rho = (covariance / variance).within(0.0, CORRELATION);
        let inflation = (1.0 + rho) / (1.0 - rho);
        let independent = self.weight / inflation;
        if !(independent >= ENOUGH) {
            return;
        }
        self.enough = true;
        let explained = beta.abs() * (shape / self.weight).at_least(0.0).sqrt();
        let excess = (explained - TOLERANCE) / (variance / independent).at_least(0.0).sqrt();
        if excess > self.best.1 {
            self.best = (Shape::ALL[row], excess);
        }
    }

    fn judge(&mut self) {
        if !self.enough {
            return;
        }
        self.suspect = self.best;
        self.state = match self.state {
            _ if self.best.1 > ALARM => TableHealth::Changed,
            TableHealth::Changed if self.best.1 > CLEAR => TableHealth::Changed,
            _ => TableHealth::Describes,
        };
    }

    /// The sums for the host.
    pub fn describe(&self, answer: &mut HealthSums) {
        let Scales { force_n, pressure_pa, stroke_m, .. } = self.scales;
        answer.table = self.state;
        (answer.suspect, answer.excess) = self.suspect;
        answer.tolerance = TOLERANCE;
        answer.blocks = self.blocks;
        answer.weight = self.weight;
        answer.block_ticks = BLOCK_TICKS;
        answer.window_blocks = WINDOW;
        (answer.force_n, answer.pressure_pa, answer.stroke_m) = (force_n, pressure_pa, stroke_m);
        answer.sums.clear();
        answer.lagged.clear();
        // The places have room for all of them.
        let _ = answer.sums.extend_from_slice(&self.sums);
        let _ = answer.lagged.extend_from_slice(&self.lagged);
    }
}

#[cfg(test)]
mod tests;
