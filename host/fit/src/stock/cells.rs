//! Mean forces by muscle, mounting, direction, interval of pressure and interval of stroke.

use std::collections::BTreeMap;

use pam_data::error::Result;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::largest_force;
use pam_data::recording::motion::Motion;

use super::Member;
use super::criteria::{AFTER_REVERSAL, PRESSURE_CELLS, STROKE_CELLS};
use crate::{HeldMounting, clip, points};

/// A mean force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// The muscle.
    pub member: usize,
    /// Its mounting.
    pub mounting: usize,
    /// Gauge pressure, Pa.
    pub pressure: f64,
    /// Stroke, m.
    pub stroke: f64,
    /// +1 shortening or filling, −1 lengthening or emptying.
    pub direction: f64,
    /// Mean force, N.
    pub force: f64,
    /// How many readings.
    pub rows: f64,
    /// Number of cells of its half: muscle, mounting and direction.
    pub in_half: f64,
}

/// A mounting of a muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct Mounted {
    /// Its label in the file; empty where there is none.
    pub label: String,
    /// The stroke at which the muscle was held, m; `None` where it moved.
    pub stroke: Option<f64>,
}

/// All cells of a stock.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StockCells {
    /// The cells, by muscle.
    pub list: Vec<Cell>,
    /// Rest length of each muscle, m.
    pub rest_length: Vec<f64>,
    /// Mountings of each muscle.
    pub mountings: Vec<Vec<Mounted>>,
    /// The largest force, N.
    pub largest: f64,
    /// Mean outer diameter of the bladders, m.
    pub diameter: f64,
}

/// The cells of a stock.
///
/// # Errors
/// Recordings without a force.
pub fn stock_cells(members: &[Member<'_>]) -> Result<StockCells> {
    let mut all = StockCells::default();
    for (member, of) in members.iter().enumerate() {
        for recording in &of.campaign.recordings {
            recording.require_force()?;
        }
        all.diameter += of.muscle.geometry().outer_diameter.metres() / members.len() as f64;
        all.rest_length.push(of.muscle.rest_length());
        all.largest = all.largest.max(largest_force(of.campaign));
        let (cells, mountings) = of_muscle(member, of);
        all.list.extend(cells);
        all.mountings.push(mountings);
    }
    Ok(all)
}

/// The mountings of a muscle, and the number of each recording's own. Recordings that move count as one mounting.
fn mountings(of: &[Option<HeldMounting>]) -> (Vec<Mounted>, Vec<usize>) {
    let mut distinct: Vec<Option<HeldMounting>> = Vec::new();
    let same = |a: &Option<HeldMounting>, b: &Option<HeldMounting>| match (a, b) {
        (Some(a), Some(b)) => a.is(b),
        (None, None) => true,
        _ => false,
    };
    let mut numbers = Vec::new();
    for mounting in of {
        let known = distinct.iter().position(|d| same(d, mounting));
        numbers.push(known.unwrap_or(distinct.len()));
        if known.is_none() {
            distinct.push(mounting.clone());
        }
    }
    let described = distinct.into_iter().map(|held| match held {
        Some(held) => Mounted { label: held.label, stroke: Some(held.stroke) },
        None => Mounted { label: String::new(), stroke: None },
    });
    (described.collect(), numbers)
}

/// Sums of pressure, stroke, force and rows.
type Sums = [f64; 4];

fn of_muscle(member: usize, of: &Member<'_>) -> (Vec<Cell>, Vec<Mounted>) {
    let screened = Screened::of(of.campaign);
    let campaign = screened.campaign.as_ref();
    let points = points(&screened, &Motion::of_campaign(campaign));
    let clipped = clip(campaign).0.map(|c| c.force);
    let (mountings, mounting_of) = mountings(&points.mountings);
    let pressure_step = points.pressure.span().max(1.0) / PRESSURE_CELLS;
    let stroke_step = points.stroke.span().max(1e-6) / STROKE_CELLS;
    let mut sums: BTreeMap<(usize, bool, i64, i64), Sums> = BTreeMap::new();
    for p in &points.list {
        let mounting = mounting_of[p.recording as usize];
        let moves = mountings[mounting].stroke.is_none();
        let near = moves && p.since_reversal < AFTER_REVERSAL;
        if p.direction == 0.0 || p.dropout || near || clipped.is_some_and(|c| p.force <= c) {
            continue;
        }
        let rows = f64::from(p.rows);
        let place = |v: f64, step: f64| (v / step).round() as i64;
        let key = (
            mounting,
            p.direction > 0.0,
            place(p.pressure, pressure_step),
            if moves { place(p.stroke, stroke_step) } else { 0 },
        );
        for (sum, v) in sums.entry(key).or_default().iter_mut().zip([p.pressure, p.stroke, p.force, 1.0]) {
            *sum += rows * v;
        }
    }
    let mut halves: BTreeMap<(usize, bool), f64> = BTreeMap::new();
    for key in sums.keys() {
        *halves.entry((key.0, key.1)).or_default() += 1.0;
    }
    let cells = sums
        .iter()
        .map(|((mounting, shortening, _, _), [pressure, stroke, force, rows])| Cell {
            member,
            mounting: *mounting,
            pressure: pressure / rows,
            stroke: stroke / rows,
            direction: if *shortening { 1.0 } else { -1.0 },
            force: force / rows,
            rows: *rows,
            in_half: halves[&(*mounting, *shortening)],
        })
        .collect();
    (cells, mountings)
}

impl StockCells {
    /// The cells for which a test holds; muscles and mountings keep their numbers.
    #[must_use]
    pub fn only(&self, test: impl Fn(&Cell) -> bool) -> Self {
        Self { list: self.list.iter().filter(|c| test(c)).copied().collect(), ..self.clone() }
    }

    /// The held mountings of a muscle that may be left out: none of a muscle with a single one.
    #[must_use]
    pub fn held_mountings(&self, member: usize) -> Vec<usize> {
        let own = &self.mountings[member];
        let held: Vec<usize> = (0..own.len()).filter(|k| own[*k].stroke.is_some()).collect();
        if held.len() > 1 { held } else { Vec::new() }
    }

    /// The largest force of a muscle, N; never zero.
    #[must_use]
    pub fn largest_of(&self, member: usize) -> f64 {
        let own = self.list.iter().filter(|c| c.member == member);
        own.map(|c| c.force).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// The contraction of a cell by the tape measure.
    #[must_use]
    pub fn contraction(&self, cell: &Cell) -> f64 {
        cell.stroke / self.rest_length[cell.member]
    }
}
