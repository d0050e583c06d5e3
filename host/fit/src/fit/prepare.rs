//! From a campaign to a solved joint problem: points, screening, weights, smoothing, in the order in which they need each other.

use model_core::braid::Geometry;
use model_core::table::MAX_ORDER;

use crate::error::FitCode;
use pam_data::pluralise::pluralise;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::physical_limits::Contractions;
use pam_data::progress::Progress;
use pam_data::recording::Campaign;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::segment::Motion;

use super::Options;
use super::basis::{Orthonormal, PressureBasis};
use super::design::Design;
use super::nodes::pressures;
use super::outliers::despike;
use super::points::points;
use super::prepared::Prepared;
use super::screen::{self, Clip, Use};
use super::smoothing::{self, Smoothing};

impl Prepared {
    /// Prepares and solves.
    ///
    /// # Errors
    /// [`FitCode::FitUnderdetermined`], [`DataCode::CallInvalid`], or a recording without force.
    pub fn new(
        campaign: &Campaign,
        muscle: &MuscleDescription,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Self> {
        if !(1..=MAX_ORDER).contains(&options.order) {
            return Err(Error::new(
                DataCode::CallInvalid,
                format!("an order of {} for the elastic polynomial", options.order),
            )
            .help(format!("choose 1 to {MAX_ORDER}")));
        }
        for recording in &campaign.recordings {
            recording.require_force()?;
        }
        progress.stage("finding strokes and turns", 0);
        let screened = Screened::of(campaign);
        let campaign = screened.campaign.as_ref();
        let mut points = points(&screened, &Motion::of_campaign(campaign));
        let distinct = points.list.len();
        if points.rows < 3 || distinct < 3 {
            return Err(Error::new(
                FitCode::FitUnderdetermined,
                format!("{} cannot determine a muscle's table", pluralise(points.rows, "row")),
            )
            .help("record at least one slow stroke there and back at one pressure"));
        }
        if points.force.span() <= 0.0 {
            return Err(Error::new(FitCode::FitUnderdetermined, "the force is the same in every row")
                .help("look at the force sensor: it may be disconnected, or at the end of its range"));
        }
        let geometry = Geometry { tip_correction: options.tip_correction, ..muscle.geometry() };
        let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
        let contractions = Contractions::of(&braid);
        let ends = [f64::total_cmp, |a: &f64, b: &f64| b.total_cmp(a)];
        for point in
            ends.iter().filter_map(|order| points.list.iter().min_by(|a, b| order(&a.stroke, &b.stroke)))
        {
            contractions.check(point.stroke / braid.rest_length()).map_err(|e| {
                let recording = &campaign.recordings[point.recording as usize];
                e.file(&recording.source).value(format!(
                    "{:.2} mm at {:.2} s",
                    point.stroke * 1e3,
                    point.time
                ))
            })?;
        }
        let max_pressure = muscle.max_pressure_kPa.map_or(points.pressure.high, |kpa| kpa * 1e3);
        let clips = screen::clip(campaign);
        let outliers = despike(campaign, &mut points);
        let mut prepared = Self {
            pressures: pressures(&points, max_pressure),
            used: vec![Use::Fitted; points.list.len()],
            weights: Vec::new(),
            design: Design::new(
                PressureBasis::new(&[]),
                Orthonormal::over(&[], options.order),
                Vec::new(),
                Vec::new(),
                0,
                false,
            ),
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
            warnings: campaign.warnings.iter().cloned().chain(screened.remark()).collect(),
        };
        prepared.screen_by_itself();
        prepared.shift = vec![0.0; prepared.points.list.len()];
        prepared.design = prepared.build_design(options.order);
        prepared.find(options, progress);
        Ok(prepared)
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
            if p.dropout {
                *used = Use::Dropout;
            } else if at(&self.clips.0, p.force_range.0) || at(&self.clips.1, p.force_range.1) {
                *used = Use::Clipped;
            } else if p.direction == 0.0 && drop_unknown {
                *used = Use::UnknownDirection;
            }
        }
    }

    /// The whole search, from a start that knows nothing.
    fn find(&mut self, options: &Options, progress: &dyn Progress) {
        progress.stage("solving for all pressures", 0);
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
            progress.stage("searching for the dimensions", 0);
            self.adjust(options);
            // With the right dimensions slackness shows where it is.
            self.find_slack();
            self.mark_turns(self.turn_zone);
            self.weigh();
            self.adjust(options);
        }
        progress.stage("choosing how much curves bend", 0);
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
        self.solve_softened();
    }
}
