//! How a campaign was made: mountings, the runs of each, and the clock that starts with a mounting.

use super::criteria::{FILTER_TIMES, FOLLOWED_OVER, LEAST_POINTS, LEAST_RUNS, LEAST_SPAN};
use super::staircase::{self, Point};
use pam_data::recording::{Campaign, Clock};
use pam_data::statistics::range;

/// One recording at held length.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Which mounting it belongs to.
    pub mounting: usize,
    /// Its number within the mounting, from 1.
    pub number: usize,
    /// Which recording it is.
    pub recording: usize,
    /// Its first and one after its last settled point.
    pub points: (usize, usize),
    /// The bench's clock at the run's zero, s; only where all recordings share it.
    pub start: Option<f64>,
    /// The recording's clock at the run's zero, s.
    pub zero: f64,
}

/// The muscle between two changes of its held length.
#[derive(Clone, Debug)]
pub(super) struct Mounting {
    /// `ΔL`, m.
    pub stroke: f64,
    /// Contraction `ΔL/L0`, a fraction; 0 at rest length.
    pub contraction: f64,
    /// Its runs, in order.
    pub runs: Vec<usize>,
}

/// Settled points of a campaign of isometric staircases with their structure.
#[derive(Clone, Debug, Default)]
pub(super) struct Points {
    pub mountings: Vec<Mounting>,
    pub runs: Vec<Run>,
    /// Seconds since the run's zero.
    pub time: Vec<f64>,
    /// Gauge pressure of each point, kPa.
    pub pressure: Vec<f64>,
    /// Measured force of each point, N.
    pub force: Vec<f64>,
    /// 1 filling, −1 emptying.
    pub direction: Vec<i8>,
    /// The same as friction that follows the pressure has it.
    pub followed: Vec<[f64; FOLLOWED_OVER.len()]>,
    /// The pressure behind a filter, less the pressure, kPa.
    pub filtered: Vec<[f64; FILTER_TIMES.len()]>,
    /// Rate of the pressure, kPa/s; zero where a row is a point.
    pub rate: Vec<f64>,
    pub mounting: Vec<usize>,
    pub run: Vec<usize>,
    /// Whether rows were averaged into settled points.
    pub averaged: bool,
}

impl Points {
    pub(super) fn len(&self) -> usize {
        self.force.len()
    }

    /// The highest pressure of all points, kPa.
    pub(super) fn highest(&self) -> f64 {
        self.pressure.iter().copied().fold(0.0, f64::max)
    }

    /// The largest force, N: the scale of errors.
    pub(super) fn largest_force(&self) -> f64 {
        self.force.iter().copied().fold(0.0, f64::max)
    }

    /// Whether they are of isometric staircases with repeated runs, and enough of both.
    fn have_repeated_runs(&self) -> bool {
        let whole = range(&self.pressure);
        let covers = |r: &Run| range(&self.pressure[r.points.0..r.points.1]) >= LEAST_SPAN * whole;
        let repeated = self.mountings.iter().any(|m| m.runs.len() >= 2);
        let enough = self.len() as f64 >= LEAST_POINTS && self.runs.len() as f64 >= LEAST_RUNS;
        let staircase = whole > 0.0 && self.runs.iter().all(covers) && self.largest_force() > 0.0;
        repeated && enough && staircase
    }

    /// The mounting with the largest length.
    pub(super) fn longest(&self) -> usize {
        (0..self.mountings.len())
            .min_by(|a, b| self.mountings[*a].stroke.total_cmp(&self.mountings[*b].stroke))
            .unwrap_or(0)
    }

    /// Whether pauses between runs are known from the bench's clock.
    pub(super) fn pauses_known(&self) -> bool {
        self.runs.iter().all(|r| r.start.is_some())
    }

    /// Which points have a pressure that another run of the mounting reaches.
    pub(super) fn supported(&self) -> Vec<bool> {
        let tops: Vec<f64> = self
            .runs
            .iter()
            .map(|r| self.pressure[r.points.0..r.points.1].iter().copied().fold(f64::NEG_INFINITY, f64::max))
            .collect();
        (0..self.len())
            .map(|i| {
                let others = self.mountings[self.mounting[i]].runs.iter().filter(|r| **r != self.run[i]);
                let reached = others.map(|r| tops[*r]).fold(f64::NEG_INFINITY, f64::max);
                self.pressure[i] <= reached + super::criteria::SUPPORT
            })
            .collect()
    }
}

/// Reads the structure of a campaign; `None` where it is not a campaign of isometric staircases with repeated runs.
pub(super) fn points(campaign: &Campaign, rest_length: f64) -> Option<Points> {
    held_points(campaign, rest_length).filter(Points::have_repeated_runs)
}

/// Reads the structure of a campaign; `None` where the length was not held throughout.
///
/// A run is one recording; for mountings see [`Campaign::mountings`].
pub(super) fn held_points(campaign: &Campaign, rest_length: f64) -> Option<Points> {
    let mut points = Points::default();
    let mountings = campaign.mountings()?;
    for (index, recording) in campaign.recordings.iter().enumerate() {
        let force = recording.force.as_deref()?;
        if points.mountings.len() <= mountings[index] {
            let middle =
                recording.stroke.first().zip(recording.stroke.last()).map_or(0.0, |(a, b)| 0.5 * (a + b));
            let length = recording.rest_length.unwrap_or(rest_length);
            points.mountings.push(Mounting {
                stroke: middle,
                contraction: middle / length,
                runs: Vec::new(),
            });
        }
        let (settled, averaged) = staircase::settled(recording, force);
        points.averaged |= averaged;
        add(&mut points, campaign, index, &settled);
    }
    Some(points)
}

fn add(points: &mut Points, campaign: &Campaign, index: usize, settled: &[Point]) {
    let recording = &campaign.recordings[index];
    let mounting = points.mountings.len() - 1;
    let first = recording.time.first().copied().unwrap_or(0.0);
    let interval = recording.duration() / recording.len().saturating_sub(1).max(1) as f64;
    // A run's clock that starts near zero was started with the run.
    let zero = if (0.0..=2.0 * interval).contains(&first) { 0.0 } else { first - interval };
    let from = points.len();
    for p in settled {
        points.time.push(p.time - zero);
        points.pressure.push(p.pressure * 1e-3);
        points.force.push(p.force);
        points.direction.push(p.direction);
        points.followed.push(p.followed);
        points.filtered.push(p.filtered.map(|f| f * 1e-3));
        points.rate.push(p.rate * 1e-3);
        points.mounting.push(mounting);
        points.run.push(points.runs.len());
    }
    let number = points.mountings[mounting].runs.len() + 1;
    points.mountings[mounting].runs.push(points.runs.len());
    let start = (campaign.clock == Clock::Shared).then_some(zero);
    points.runs.push(Run { mounting, number, recording: index, points: (from, points.len()), start, zero });
}
