//! From a campaign to a solved joint problem: points, screening, weights, smoothing.

use model_core::braid::{Braid, Geometry};
use model_core::table::MAX_ORDER;
use model_core::units::{Angle, Length};

use crate::error::{Code, Error, Result};
use crate::muscle_description::MuscleDescription;
use crate::recording::Campaign;

use super::Options;
use super::basis::{Columns, Orthonormal, PressureBasis, columns};
use super::geometry::{Adjusted, Mounting};
use super::joint::{Bin, Design, Layout, Row};
use super::nodes::{Pressures, pressures};
use super::points::{Points, median, points};
use super::screen::{self, Clip, Outlier, Use};
use super::smoothing::{self, Smoothing};

/// A campaign, solved: everything that results and diagnoses are drawn from.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// The points.
    pub points: Points,
    /// Tested pressures and nodes.
    pub pressures: Pressures,
    /// The muscle at rest, as described.
    pub nominal: Geometry,
    /// The muscle at rest, as fitted: the same, unless dimensions were left open.
    pub geometry: Geometry,
    /// Its kinematics.
    pub braid: Braid<f64>,
    /// The linear problem; one row per point, in the same order.
    pub design: Design,
    /// What became of each point.
    pub used: Vec<Use>,
    /// Weight of each point; zero where it does not take part. About 1/variance, N⁻².
    pub weights: Vec<f64>,
    /// Chunks of stroke, pressure and direction that have points: as many independent witnesses as the weights assume.
    pub cells: f64,
    /// The solution, in the order of [`Layout`].
    pub parameters: Vec<f64>,
    /// The penalty on bending.
    pub smoothing: Smoothing,
    /// How far from a turn points were set aside, in shares of the ranges.
    pub turn_zone: f64,
    /// Whether the recordings show the muscle slack.
    pub goes_slack: bool,
    /// The ends of the force sensor's range, where rows stand at them.
    pub clips: (Option<Clip>, Option<Clip>),
    /// Readings that do not belong.
    pub outliers: Vec<Outlier>,
    /// Standard deviation of a `P0` that is held because a higher order found it, Pa.
    pub deadband_std: Option<f64>,
    /// Dimensions and lengths that were found too.
    pub adjusted: Vec<Adjusted>,
    /// Points of a slack muscle that take part because the model would pull there.
    pub held_down: Vec<bool>,
    /// Corrected mountings.
    pub mountings: Vec<Mounting>,
    /// What was added to each point's stroke, m.
    pub shift: Vec<f64>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Of the blocked force: what the model may miss although it is the right one for the purpose; more rows do not help below it.
const INEXACT: f64 = 0.002;
const BINS: usize = 1024;

impl Prepared {
    /// Prepares and solves.
    ///
    /// # Errors
    /// [`Code::FitUnderdetermined`], [`Code::CallInvalid`], or a recording without force.
    pub fn new(campaign: &Campaign, muscle: &MuscleDescription, options: &Options) -> Result<Self> {
        if !(1..=MAX_ORDER).contains(&options.order) {
            return Err(Error::new(
                Code::CallInvalid,
                format!("an order of {} for the elastic polynomial", options.order),
            )
            .help(format!("choose 1 to {MAX_ORDER}")));
        }
        for recording in &campaign.recordings {
            recording.require_force()?;
        }
        let directions = super::direction::directions(campaign);
        let mut points = points(campaign, &directions);
        let distinct = points.list.len();
        if points.rows < 3 || distinct < 3 {
            return Err(Error::new(
                Code::FitUnderdetermined,
                format!("{} rows cannot determine a muscle's table", points.rows),
            )
            .help("record at least one slow stroke there and back at one pressure"));
        }
        if points.force.span() <= 0.0 {
            return Err(Error::new(Code::FitUnderdetermined, "the force is the same in every row")
                .help("look at the force sensor: it may be disconnected, or at the end of its range"));
        }
        let geometry = Geometry {
            rest_length: Length::from_metres(muscle.rest_length()),
            braid_angle: Angle::from_degrees(muscle.braid_angle_deg),
            outer_diameter: Length::from_millimetres(muscle.bladder_outer_diameter_mm),
            wall: Length::from_millimetres(muscle.bladder_wall_mm),
            tip_correction: options.tip_correction,
        };
        let braid = geometry.build().map_err(|e| Error::new(Code::MuscleInvalid, e.to_string()))?;
        check_strokes(&points, &braid)?;
        let max_pressure = muscle.max_pressure_kPa.map_or(points.pressure.high, |kpa| kpa * 1e3);
        let clips = screen::clip(campaign, &points);
        let outliers = screen::despike(campaign, &mut points);
        let mut prepared = Self {
            pressures: pressures(&points, max_pressure),
            used: vec![Use::Fitted; points.list.len()],
            weights: Vec::new(),
            design: Design {
                basis: PressureBasis::new(&[]),
                orthonormal: Orthonormal::over(&[], options.order),
                rows: Vec::new(),
                bins: Vec::new(),
                groups: 0,
                extra: Vec::new(),
                extras: 0,
                extra_prior: Vec::new(),
                friction: false,
                origin: 0.0,
                hold_deadband: 0.0,
                held: None,
                level: 0.0,
            },
            points,
            nominal: geometry,
            geometry,
            braid,
            cells: 1.0,
            parameters: Vec::new(),
            smoothing: Smoothing::START,
            turn_zone: 0.05,
            goes_slack: false,
            clips,
            outliers,
            held_down: Vec::new(),
            deadband_std: None,
            adjusted: Vec::new(),
            mountings: Vec::new(),
            shift: Vec::new(),
            warnings: campaign.warnings.clone(),
        };
        prepared.screen_by_itself();
        prepared.shift = vec![0.0; prepared.points.list.len()];
        prepared.design = prepared.build_design(options.order);
        prepared.find(options);
        Ok(prepared)
    }

    /// The braid's columns at every point, strokes moved by `shift` (m).
    #[must_use]
    pub fn columns(&self, shift: &[f64]) -> Vec<Columns> {
        self.points.list.iter().zip(shift).map(|(p, s)| columns(&self.braid, p.stroke + s)).collect()
    }

    /// Builds the linear problem on the present nodes.
    fn build_design(&self, order: usize) -> Design {
        let basis = PressureBasis::new(&self.pressures.nodes);
        let columns = self.columns(&self.shift);
        let orthonormal = Orthonormal::over(&spread(&self.points, &columns, &self.used), order);
        let range = self.points.pressure;
        let per_bin = if range.span() > 0.0 { BINS as f64 / range.span() } else { 0.0 };
        let mut sums = vec![(0.0, 0.0); BINS + 1];
        let raw = |p: f64| (((p - range.low) * per_bin) as usize).min(BINS);
        for p in &self.points.list {
            let s = &mut sums[raw(p.pressure)];
            s.0 += f64::from(p.rows) * p.pressure;
            s.1 += f64::from(p.rows);
        }
        let mut index = vec![0_u32; sums.len()];
        let mut bins = Vec::new();
        for (to, (sum, n)) in index.iter_mut().zip(&sums) {
            if *n > 0.0 {
                *to = bins.len() as u32;
                let mean = sum / n;
                bins.push(Bin { phi: basis.at(mean), group: self.group(mean) });
            }
        }
        let directed = self.both_directions();
        let rows = self
            .points
            .list
            .iter()
            .zip(&columns)
            .map(|(p, c)| Row {
                pressure: p.pressure,
                area: c.area,
                elastic: orthonormal.apply(c),
                direction: if directed { p.direction } else { 0.0 },
                force: p.force,
                bin: index[raw(p.pressure)],
            })
            .collect();
        Design {
            basis,
            orthonormal,
            rows,
            bins,
            groups: self.pressures.levels.len(),
            extra: Vec::new(),
            extras: 0,
            extra_prior: Vec::new(),
            friction: directed,
            origin: 0.0,
            hold_deadband: 0.0,
            held: None,
            level: 0.0,
        }
    }

    /// The tested level, or the interval, that a pressure belongs to.
    #[must_use]
    pub fn group(&self, pressure: f64) -> u32 {
        let levels = &self.pressures.levels;
        let nearest = (0..levels.len())
            .min_by(|a, b| (levels[*a] - pressure).abs().total_cmp(&(levels[*b] - pressure).abs()));
        nearest.unwrap_or(0) as u32
    }

    /// Where pressure moves, mid-lines are cut into hundredths of its range; levels are not.
    #[must_use]
    pub fn fine_pressure(&self, pressure: f64) -> u32 {
        let range = self.points.pressure;
        if self.pressures.held { 0 } else { ((pressure - range.low) / range.span().max(1.0) * 100.0) as u32 }
    }

    /// Whether a point counts in errors: it took part, and the muscle was not slack.
    #[must_use]
    pub fn counts(&self, i: usize) -> bool {
        self.used[i] == Use::Fitted && !self.held_down.get(i).copied().unwrap_or(false)
    }

    /// Whether enough points move either way for friction to be told from elasticity.
    fn both_directions(&self) -> bool {
        let rows = |s: f64| {
            let take = |(p, u): &(&super::points::Point, &Use)| {
                p.direction == s && matches!(u, Use::Fitted | Use::NearTurn)
            };
            self.points.list.iter().zip(&self.used).filter(take).map(|(p, _)| f64::from(p.rows)).sum::<f64>()
        };
        let (up, down) = (rows(1.0), rows(-1.0));
        up.min(down) > 0.02 * (up + down) && up.min(down) >= 3.0
    }

    /// Screening that needs no model.
    fn screen_by_itself(&mut self) {
        let known: f64 =
            self.points.list.iter().filter(|p| p.direction != 0.0).map(|p| f64::from(p.rows)).sum();
        // Where the direction is hardly ever known there is no friction to find, and every point counts.
        let drop_unknown = known > 0.5 * self.points.rows as f64;
        let tolerance = 1e-9 * self.points.force.span();
        for (p, used) in self.points.list.iter().zip(&mut self.used) {
            let at =
                |clip: &Option<Clip>, value: f64| clip.is_some_and(|c| (value - c.force).abs() <= tolerance);
            if at(&self.clips.0, p.force_range.0) || at(&self.clips.1, p.force_range.1) {
                *used = Use::Clipped;
            } else if p.direction == 0.0 && drop_unknown {
                *used = Use::UnknownDirection;
            }
        }
    }

    /// Weights from scratch: every chunk of stroke at every pressure and direction counts alike, as far as its rows carry it.
    fn weigh(&mut self) {
        let deadband = self.design.origin + self.parameters.first().copied().unwrap_or(0.0);
        let stroke = self.points.stroke;
        let pressure = self.points.pressure;
        let chunk = |x: f64, range: super::points::Range, n: f64| {
            if range.span() > 0.0 { ((x - range.low) / range.span() * n).min(n - 1.0) as usize } else { 0 }
        };
        let (fine_p, fine_x) = (if self.pressures.held { 1.0 } else { 64.0 }, 64.0);
        let cell = |p: &super::points::Point, group: u32| {
            let place =
                if self.pressures.held { group as usize } else { chunk(p.pressure, pressure, fine_p) };
            let branch = (p.direction + 1.0) as usize;
            (place * 64 + chunk(p.stroke, stroke, fine_x)) * 3 + branch
        };
        let groups: Vec<u32> =
            self.design.rows.iter().map(|r| self.design.bins[r.bin as usize].group).collect();
        let mut counts: std::collections::HashMap<usize, f64> = std::collections::HashMap::new();
        for ((p, used), g) in self.points.list.iter().zip(&self.used).zip(&groups) {
            if *used == Use::Fitted {
                *counts.entry(cell(p, *g)).or_default() += f64::from(p.rows);
            }
        }
        self.cells = counts.len().max(1) as f64;
        let force = self.points.force.high.abs().max(self.points.force.low.abs());
        let noise = self.points.row_noise.max(1e-6 * force).powi(2);
        let scale = (pressure.high - deadband).max(0.1 * pressure.high.abs()).max(1.0);
        self.weights = self
            .points
            .list
            .iter()
            .zip(&self.used)
            .zip(&groups)
            .map(|((p, used), g)| {
                if *used != Use::Fitted {
                    return 0.0;
                }
                let n = counts.get(&cell(p, *g)).copied().unwrap_or(1.0).max(1.0);
                // Blocked force is proportional to P − P0: errors are judged against it, pressure by pressure.
                let blocked = force * ((p.pressure - deadband) / scale).clamp(0.1, 1.0);
                f64::from(p.rows) / n / (noise / n + (INEXACT * blocked).powi(2))
            })
            .collect();
    }

    /// Solves in place; returns `Σ w r²`.
    pub(super) fn solve(&mut self, smoothing: Smoothing, steps: usize) -> f64 {
        let data = self.design.normal(&self.parameters, &self.weights);
        let penalty = self.design.penalty(&data, smoothing.elastic, smoothing.friction);
        self.design.solve(&mut self.parameters, &self.weights, &penalty, steps).misfit
    }

    /// The whole search, from a start that knows nothing.
    fn find(&mut self, options: &Options) {
        if options.fit_geometry || options.fit_lengths {
            // With the dimensions open, a few lengths leave P0 open too: a muscle begins to pull at a small share of its
            // working pressure.
            let usual = 0.1 * self.points.pressure.high;
            self.design.origin = usual;
            self.design.hold_deadband = usual.powi(-2);
        }
        self.parameters = self.design.start(0.1 * self.points.pressure.high);
        self.mark_turns(self.turn_zone);
        self.find_slack();
        self.weigh();
        self.solve(Smoothing::START, 12);
        // The zone after a turn, from what friction lacks there; then once more with the better friction.
        for _ in 0..2 {
            self.size_turn_zone();
            self.weigh();
            self.solve(Smoothing::START, 6);
        }
        if options.fit_geometry || options.fit_lengths {
            self.adjust(options);
            // With the right dimensions slackness shows where it is.
            self.find_slack();
            self.mark_turns(self.turn_zone);
            self.weigh();
            self.adjust(options);
        }
        self.find_outliers();
        self.weigh();
        self.solve(Smoothing::START, 4);
        self.settle_deadband(options);
        self.smoothing = match options.smoothing {
            Some(weight) => Smoothing { elastic: weight, friction: weight },
            None => {
                if !self.pressures.held {
                    self.design.level =
                        smoothing::choose_level(&mut self.design.clone(), &self.parameters, &self.weights);
                }
                smoothing::choose(&self.design, &self.parameters, &self.weights).0
            }
        };
        self.solve(self.smoothing, 12);
        self.hold_slack_down();
        if options.physical {
            self.make_physical();
        }
        self.soften();
        self.solve(self.smoothing, 8);
    }

    /// A slack muscle says that the model must not pull there: points set aside as slack come back where it would.
    fn hold_slack_down(&mut self) {
        let before: Vec<Use> = self.used.clone();
        let set_aside = |u: Use| matches!(u, Use::Slack | Use::Clipped);
        if !before.iter().any(|u| set_aside(*u)) {
            return;
        }
        let tolerance = (0.005 * self.points.force.span()).max(2.0 * self.points.row_noise);
        let upper = self.clips.1.map_or(f64::INFINITY, |c| c.force);
        for round in 0..16 {
            let curves = self.design.curves(&self.parameters);
            let mut changed = 0;
            for i in 0..self.used.len() {
                if !set_aside(before[i]) || self.points.list[i].force >= upper {
                    continue;
                }
                let above = self.design.evaluate(i, &self.parameters, &curves).force
                    > self.points.list[i].force + tolerance;
                // Points let go may rise again, and take turns for ever: after a few rounds none is let go any more.
                let kept = round >= 4 && self.used[i] == Use::Fitted;
                let wanted = if above || kept { Use::Fitted } else { before[i] };
                changed += usize::from(wanted != self.used[i]);
                self.used[i] = wanted;
            }
            if changed == 0 {
                break;
            }
            self.weigh();
            self.solve(self.smoothing, 6);
        }
        self.held_down = self.used.iter().zip(&before).map(|(u, b)| u != b).collect();
        // They count in the fit, not in its errors: what the sensor reads of a slack muscle is not the muscle's force.
    }

    /// Makes the bladder's stress `Σ E_k ε^k` rise with strain wherever the recordings strained it, in hoop and in axial
    /// direction, at every node: slopes that would fall are held at zero by a penalty that grows until they do.
    fn make_physical(&mut self) {
        let used = |u: &Use| matches!(u, Use::Fitted | Use::NearTurn);
        let strokes = super::points::Range::of(
            self.points
                .list
                .iter()
                .zip(&self.used)
                .zip(&self.shift)
                .filter(|((_, u), _)| used(u))
                .map(|((p, _), s)| p.stroke + s),
        );
        let at = |x: f64| self.braid.posture(Length::from_metres(x));
        let (a, b) = (at(strokes.low), at(strokes.high));
        let layout = self.design.layout();
        let order = layout.order;
        let t = self.design.orthonormal.t.clone();
        let strains: Vec<f64> = (0..=24)
            .flat_map(|i| {
                let part = f64::from(i) / 24.0;
                let between = |x: f64, y: f64| x + (y - x) * part;
                [between(a.radial_strain, b.radial_strain), between(a.axial_strain, b.axial_strain)]
            })
            .collect();
        // dσ/dε = Σ_i i E_i ε^(i−1) with E = T ẽ.
        let slopes: Vec<Vec<f64>> = strains
            .iter()
            .map(|e| {
                (0..order)
                    .map(|k| (0..=k).map(|i| (i + 1) as f64 * e.powi(i as i32) * t[i * order + k]).sum())
                    .collect()
            })
            .collect();
        let mut weight = 10.0;
        for _ in 0..10 {
            let data = self.design.normal(&self.parameters, &self.weights);
            let scale = data.weight / layout.nodes as f64;
            let mut held = super::linear::Symmetric::zeros(layout.len());
            let mut worst = 0.0_f64;
            for j in 0..layout.nodes {
                for a in &slopes {
                    let size = super::linear::dot(a, a).sqrt();
                    let row: Vec<(usize, f64)> =
                        a.iter().enumerate().map(|(k, v)| (layout.elastic(k, j), v / size)).collect();
                    let slope: f64 = row.iter().map(|(i, v)| v * self.parameters[*i]).sum();
                    worst = worst.min(slope);
                    if slope < 0.0 {
                        held.add_row(&row, weight * scale);
                    }
                }
            }
            if worst > -1e-4 * self.points.force.span() {
                break;
            }
            // What was held stays held, or the next step would fall back.
            match &mut self.design.held {
                Some(all) => all.add_scaled(&held, 1.0),
                none => *none = Some(held),
            }
            weight *= 2.0;
            self.solve(self.smoothing, 6);
        }
    }

    /// Finds `P0` by the highest order that the strokes determine, then holds it.
    ///
    /// At rest length no elastic term acts, so `P0` is the blocked force's intercept. Away from it `P0` and the `E_k` trade, and
    /// what a low order cannot describe about the bladder would be put into `P0`: with M = 4 on a hyperelastic wall it
    /// is off by up to 1 kPa, with M = 6 by a fifth of that.
    fn settle_deadband(&mut self, options: &Options) {
        let order = MAX_ORDER;
        if options.order >= order
            || options.fit_geometry
            || options.fit_lengths
            || self.pressures.levels.len() < 2
        {
            return;
        }
        let mut finer = self.clone();
        finer.design = finer.build_design(order);
        let reaches_rest = self.points.stroke.low <= 0.02 * self.points.stroke.high;
        if finer.design.orthonormal.rank < order || !reaches_rest {
            return;
        }
        finer.parameters = finer.design.start(self.deadband());
        finer.solve(Smoothing::START, 8);
        let smoothing = match options.smoothing {
            Some(weight) => Smoothing { elastic: weight, friction: weight },
            None => smoothing::choose(&finer.design, &finer.parameters, &finer.weights).0,
        };
        finer.solve(smoothing, 6);
        let data = finer.design.normal(&finer.parameters, &finer.weights);
        let penalty = finer.design.penalty(&data, smoothing.elastic, smoothing.friction);
        self.deadband_std = Some(super::uncertainty::jackknife(&finer, &penalty).root.std(Layout::DEADBAND));
        let found = finer.deadband();
        self.parameters[Layout::DEADBAND] = 0.0;
        self.design.origin = found;
        // Stiffer than all the points together.
        let own =
            self.design.normal(&self.parameters, &self.weights).matrix.at(Layout::DEADBAND, Layout::DEADBAND);
        self.design.hold_deadband = 1e4 * own;
    }

    fn mark_turns(&mut self, zone: f64) {
        self.turn_zone = zone;
        for (p, used) in self.points.list.iter().zip(&mut self.used) {
            match *used {
                Use::Fitted if p.since_turn < zone => *used = Use::NearTurn,
                Use::NearTurn if p.since_turn >= zone => *used = Use::Fitted,
                _ => {}
            }
        }
    }

    fn size_turn_zone(&mut self) {
        if !self.design.friction {
            self.mark_turns(0.0);
            return;
        }
        let curves = self.design.curves(&self.parameters);
        let layout = self.design.layout();
        let noise = self.points.row_noise;
        let force = self.points.force.span();
        let shares = (0..self.points.list.len()).filter_map(|i| {
            let p = &self.points.list[i];
            if !matches!(self.used[i], Use::Fitted | Use::NearTurn) {
                return None;
            }
            let e = self.design.evaluate(i, &self.parameters, &curves);
            let friction = (1.0 - e.grip) * e.quasi * p.direction;
            let residual = p.direction * (p.force - e.force);
            // A friction below the noise tells nothing about where it turned.
            (friction > 2.0 * noise && friction > 1e-3 * force)
                .then(|| (p.since_turn, residual / friction, f64::from(p.rows) * friction * friction))
        });
        let zone = screen::turn_zone(shares.collect::<Vec<_>>());
        debug_assert!(layout.len() == self.parameters.len());
        self.mark_turns(zone);
    }

    /// Finds where the muscle is slack: the force stands near zero where straight curves, fitted to points that pull,
    /// would push. Flexible curves would bend until they described slackness as elasticity.
    fn find_slack(&mut self) {
        let force = self.points.force.high.max(-self.points.force.low);
        let floor = self.clips.0.map_or(0.0, |c| c.force).max(self.points.force.low).min(0.0);
        let near_zero = floor + (0.02 * force).max(4.0 * self.points.row_noise);
        let candidates: Vec<bool> = self.points.list.iter().map(|p| p.force <= near_zero).collect();
        let rows: f64 = self
            .points
            .list
            .iter()
            .zip(&candidates)
            .filter(|(_, c)| **c)
            .map(|(p, _)| f64::from(p.rows))
            .sum();
        if rows < 0.002 * self.points.rows as f64 {
            return;
        }
        let fitted = self.used.clone();
        for (used, candidate) in self.used.iter_mut().zip(&candidates) {
            if *candidate && *used == Use::Fitted {
                *used = Use::Slack;
            }
        }
        self.weigh();
        // No trend with pressure at all: what slack points would say about it must not be said by others' continuation.
        let level = std::mem::replace(&mut self.design.level, 10.0);
        self.solve(Smoothing::STRAIGHT, 10);
        self.design.level = level;
        self.used = fitted;
        let curves = self.design.curves(&self.parameters);
        let mut slack = 0.0;
        for i in 0..self.used.len() {
            let e = self.design.evaluate(i, &self.parameters, &curves);
            if candidates[i] && e.force < floor - 0.03 * force {
                if self.used[i] != Use::Clipped {
                    self.used[i] = Use::Slack;
                }
                slack += f64::from(self.points.list[i].rows);
            }
        }
        self.goes_slack = slack > 0.005 * self.points.rows as f64;
        if !self.goes_slack {
            self.used = self.used.iter().map(|u| if *u == Use::Slack { Use::Fitted } else { *u }).collect();
        }
    }

    /// Scatter of residuals about the model in each group, by the median.
    #[must_use]
    pub fn scatter(&self, residuals: &[f64]) -> Vec<f64> {
        let mut by_group: Vec<Vec<f64>> = vec![Vec::new(); self.design.groups.max(1)];
        for ((row, used), r) in self.design.rows.iter().zip(&self.used).zip(residuals) {
            if *used == Use::Fitted {
                by_group[self.design.bins[row.bin as usize].group as usize].push(r.abs());
            }
        }
        let force = self.points.force.span();
        by_group
            .iter_mut()
            .map(|r| (median(r) / 0.6745).max(self.points.row_noise).max(1e-6 * force))
            .collect()
    }

    /// Points far off the model for a moment only: spikes. A long stretch off the model is a misfit, and stays.
    fn find_outliers(&mut self) {
        let residuals = self.design.residuals(&self.parameters);
        let scatter = self.scatter(&residuals);
        let group = |i: usize| self.design.bins[self.design.rows[i].bin as usize].group as usize;
        let force = self.points.force.span();
        let far = |i: usize| {
            residuals[i].abs() > (8.0 * scatter[group(i)]).max(0.01 * force) && self.used[i] == Use::Fitted
        };
        let n = self.used.len();
        let mut i = 0;
        let mut marked = Vec::new();
        while i < n {
            if !far(i) {
                i += 1;
                continue;
            }
            let start = i;
            while i < n && far(i) {
                i += 1;
            }
            // The neighbours on both sides must be well: then it is a spike of the reading.
            let calm = |k: usize| residuals[k].abs() < 4.0 * scatter[group(k)];
            if i - start <= 3 && start > 0 && i < n && calm(start - 1) && calm(i) {
                marked.extend(start..i);
            }
        }
        for i in marked {
            self.used[i] = Use::Outlier;
            let p = &self.points.list[i];
            self.outliers.push(Outlier {
                recording: p.recording,
                row: p.first_row,
                time: p.time,
                force: p.force,
                off: residuals[i],
            });
        }
    }

    /// Huber's weights: what lies beyond four times the scatter counts in proportion to its distance, not its square.
    fn soften(&mut self) {
        let residuals = self.design.residuals(&self.parameters);
        let scatter = self.scatter(&residuals);
        for (i, w) in self.weights.iter_mut().enumerate() {
            let limit = 4.0 * scatter[self.design.bins[self.design.rows[i].bin as usize].group as usize];
            let r = residuals[i].abs();
            if r > limit {
                *w *= limit / r;
            }
        }
    }

    /// `P0`, Pa.
    #[must_use]
    pub fn deadband(&self) -> f64 {
        self.design.origin + self.parameters[Layout::DEADBAND]
    }

    /// `F_B` at a pressure: the friction-free force at rest length, N.
    #[must_use]
    pub fn blocked(&self, pressure: f64) -> f64 {
        // Every elastic column vanishes at rest length (without the tip correction exactly, with it to first order).
        (pressure - self.deadband()) * columns(&self.braid, 0.0).area
    }

    /// `E_1 … E_M` in pascals and `k_F` at a pressure.
    #[must_use]
    pub fn curves_at(&self, pressure: f64) -> (Vec<f64>, f64) {
        let layout = self.design.layout();
        let phi = self.design.basis.at(pressure);
        let curve = |from: usize| super::linear::dot(&phi, &self.parameters[from..from + layout.nodes]);
        let reduced: Vec<f64> = (0..layout.order).map(|k| curve(layout.elastic(k, 0))).collect();
        (self.design.orthonormal.to_moduli(&reduced), curve(layout.friction(0)))
    }

    /// The friction-free force at a pressure and a stroke, N.
    #[must_use]
    pub fn quasi(&self, pressure: f64, stroke: f64) -> f64 {
        let c = columns(&self.braid, stroke);
        let (moduli, _) = self.curves_at(pressure);
        (pressure - self.deadband()) * c.area + moduli.iter().zip(c.elastic).map(|(e, c)| e * c).sum::<f64>()
    }
}

/// Columns at strokes spread evenly over the tested range: how long a recording dwelled somewhere does not matter.
fn spread(points: &Points, columns: &[Columns], used: &[Use]) -> Vec<Columns> {
    const PLACES: usize = 400;
    let range = points.stroke;
    let per_place = if range.span() > 0.0 { PLACES as f64 / range.span() } else { 0.0 };
    let mut taken = vec![None; PLACES + 1];
    for ((p, c), u) in points.list.iter().zip(columns).zip(used) {
        if matches!(u, Use::Fitted | Use::NearTurn) {
            taken[((p.stroke - range.low) * per_place) as usize] = Some(*c);
        }
    }
    taken.into_iter().flatten().collect()
}

fn check_strokes(points: &Points, braid: &Braid<f64>) -> Result<()> {
    let l0 = braid.rest_length();
    let (low, high) = (points.stroke.low / l0, points.stroke.high / l0);
    // Half the length is more than any braid contracts; beyond its fibres' length none stretches.
    let taut = braid.fibre_length() / l0 - 1.0;
    if high > 0.5 || low < -taut {
        return Err(Error::new(
            Code::FitUnderdetermined,
            format!("the recordings' contraction runs from {low:.3} to {high:.3}, which this braid cannot do"),
        )
        .help(format!(
            "contraction is (L0 − L)/L0 and lies between {:.3} (braid pulled straight) and about 0.4: check the rest length, \
             the sign of the displacement and its zero",
            -taut
        )));
    }
    Ok(())
}
