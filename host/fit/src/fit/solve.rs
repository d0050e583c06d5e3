//! From a campaign to a solution, in the order in which the steps need each other.
//!
//! ```text
//! campaign → points → screened points → problem → solution
//! ```
//! Every step takes the values of earlier steps and returns new ones.

use model_core::braid::{Braid, Geometry};
use model_core::table::MAX_ORDER;

use crate::error::FitCode;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::physical_limits::Contractions;
use pam_data::pluralise::pluralise;
use pam_data::progress::Progress;
use pam_data::recording::Campaign;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::motion::Motion;

use super::Options;
use super::nodes::pressures;
use super::outliers::despike;
use super::points::{Points, points};
use super::problem::{Ingredients, Problem};
use super::screen::{self, Clip, Outlier, Screen};
use super::smoothing::{self, Smoothing};
use super::solution::Solution;
use super::weights::{Weights, robust};
use super::{deadband, dimension_search, held_lengths, monotonic_stress, outliers, reversals, slack};

/// Screens a campaign, builds its problem and solves it.
///
/// # Errors
/// [`FitCode::FitUnderdetermined`], [`DataCode::CallInvalid`], or a recording without force.
pub(super) fn solve(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Solution> {
    if !(1..=MAX_ORDER).contains(&options.order) {
        return Err(Error::new(
            DataCode::CallInvalid,
            format!("elastic polynomial of order {}", options.order),
        )
        .help(format!("choose an order from 1 to {MAX_ORDER}")));
    }
    for recording in &campaign.recordings {
        recording.require_force()?;
    }
    progress.stage("finding strokes and reversals", 0);
    let Selected { points, clips, outliers, braid, geometry, mut warnings } =
        select_points(campaign, muscle, options)?;
    let max_pressure = muscle.max_pressure_kPa.map_or(points.pressure.high, |kpa| kpa * 1e3);
    let screen = Screen::without_model(&points, clips, outliers);
    let ingredients =
        Ingredients { pressures: pressures(&points, max_pressure), points, geometry, braid, clips };
    let problem = Problem::new(ingredients, &screen, options.order);
    if dimension_search::lacks_mountings(&problem, options) {
        warnings.push(
            "no recording was held at one length: there is no mounting whose length could be corrected"
                .into(),
        );
    }
    let Some(open) = held_lengths::open(&problem.points, options) else {
        return Ok(Solution { warnings, ..search(problem, screen, options, progress) });
    };
    let described = search(problem.clone(), screen.clone(), options, progress);
    let choice = held_lengths::choose(described, search(problem, screen, &open, progress), muscle);
    warnings.push(choice.reason);
    Ok(Solution { warnings, ..choice.solution })
}

/// What the search needs of a campaign.
struct Selected {
    points: Points,
    clips: (Option<Clip>, Option<Clip>),
    outliers: Vec<Outlier>,
    geometry: Geometry,
    braid: Braid<f64>,
    warnings: Vec<String>,
}

/// Cuts a campaign into points. The copy in which failed readings are bridged, as large as the campaign, ends here: the search needs as
/// much memory again.
///
/// # Errors
/// Recordings that cannot be those of this muscle.
fn select_points(campaign: &Campaign, muscle: &MuscleDescription, options: &Options) -> Result<Selected> {
    let screened = Screened::of(campaign);
    let campaign = screened.campaign.as_ref();
    let mut points = points(&screened, &Motion::of_campaign(campaign));
    check_amount(&points)?;
    let geometry = Geometry { tip_correction: options.tip_correction, ..muscle.geometry() };
    let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
    check_contractions(&points, campaign, &braid)?;
    let outliers = despike(campaign, &mut points);
    let warnings = campaign.warnings.iter().cloned().chain(screened.remark()).collect();
    Ok(Selected { points, clips: screen::clip(campaign), outliers, geometry, braid, warnings })
}

/// # Errors
/// Too few rows or points for any table, or a force that does not change.
fn check_amount(points: &Points) -> Result<()> {
    if points.rows < 3 || points.list.len() < 3 {
        return Err(Error::new(
            FitCode::FitUnderdetermined,
            format!("{} cannot determine a muscle's table", pluralise(points.rows, "row")),
        )
        .help("record at least one slow stroke in both directions at one pressure"));
    }
    if points.force.span() <= 0.0 {
        return Err(Error::new(FitCode::FitUnderdetermined, "the force is the same in every row")
            .help("check the force sensor: it may be disconnected, or at the end of its range"));
    }
    Ok(())
}

/// # Errors
/// A stroke that this braid cannot make.
fn check_contractions(points: &Points, campaign: &Campaign, braid: &Braid<f64>) -> Result<()> {
    let contractions = Contractions::of(braid);
    let ends = [f64::total_cmp, |a: &f64, b: &f64| b.total_cmp(a)];
    for point in ends.iter().filter_map(|order| points.list.iter().min_by(|a, b| order(&a.stroke, &b.stroke)))
    {
        contractions.check(point.stroke / braid.rest_length()).map_err(|e| {
            let recording = &campaign.recordings[point.recording as usize];
            let place = format!("{:.2} mm at {:.2} s", point.stroke * 1e3, point.time);
            e.file(&recording.source).value(place)
        })?;
    }
    Ok(())
}

/// A problem on its way to the solution: the latest of each of its parts.
struct Stage {
    problem: Problem,
    screen: Screen,
    weights: Weights,
    parameters: Vec<f64>,
}

impl Stage {
    /// Weighs the points and solves from the present parameters.
    fn weighed(problem: Problem, screen: Screen, parameters: &[f64], steps: usize) -> Self {
        let weights = Weights::of(&problem, &screen, parameters);
        let parameters = problem.solve(parameters, &weights.values, Smoothing::START, steps);
        Self { problem, screen, weights, parameters }
    }
}

/// The whole search, from a start without elasticity and friction. The warnings of the solution are empty.
fn search(problem: Problem, screen: Screen, options: &Options, progress: &dyn Progress) -> Solution {
    progress.stage("solving for all pressures", 0);
    let mut stage = first(problem, screen, options);
    if options.fit_geometry || options.fit_lengths {
        progress.stage("searching for the dimensions", 0);
        stage = with_dimensions(stage, options);
    }
    progress.stage("choosing the smoothing of the curves", 0);
    let Stage { problem, screen, parameters, .. } = stage;
    let screen = outliers::find(&problem, &screen, &parameters);
    let Stage { mut problem, screen, weights, mut parameters } =
        Stage::weighed(problem, screen, &parameters, 4);
    let held = deadband::find(&problem, &screen, &weights.values, &parameters, options);
    if let Some(held) = held {
        (problem, parameters) = deadband::hold(problem, &weights.values, parameters, held.value);
    }
    let sums = problem.design.bin_sums(&parameters, &weights.values);
    let smoothing = match options.smoothing {
        Some(weight) => Smoothing { elastic: weight, friction: weight },
        None => {
            let groups = problem.design.normal_by_group(&sums);
            if !problem.pressures.held {
                let level = smoothing::choose_level(&problem.design, &parameters, &groups);
                problem.design.level = level;
            }
            smoothing::choose(
                &problem.design,
                &parameters,
                &groups,
                smoothing::points_with_weight(&weights.values),
            )
            .0
        }
    };
    let data = problem.design.normal_of_groups(&sums, |_| true);
    let parameters = problem.solve_from(data, &parameters, &weights.values, smoothing, 12);
    let slack::HeldDown { screen, weights, mut parameters } =
        slack::hold_down(&problem, &screen, weights.values, parameters, smoothing);
    if options.physical {
        (problem, parameters) =
            monotonic_stress::constrain(&problem, &screen, &weights, parameters, smoothing);
    }
    let (weights, parameters) = robust(&problem, &screen, &weights, parameters, smoothing);
    let deadband_std = held.map(|h| h.std);
    Solution { problem, screen, weights, parameters, smoothing, deadband_std, warnings: Vec::new() }
}

/// A first solution: slack points and points near reversals are excluded.
fn first(mut problem: Problem, screen: Screen, options: &Options) -> Stage {
    // A muscle begins to pull at a small share of its working pressure.
    let usual = 0.1 * problem.points.pressure.high;
    if options.fit_geometry || options.fit_lengths {
        // With the dimensions open, a few lengths leave P0 open too.
        problem.design.origin = usual;
        problem.design.hold_deadband = usual.powi(-2);
    }
    let start = problem.design.start(usual);
    let screen = reversals::with_zone(&problem, &screen, screen.reversal_zone);
    let (screen, parameters) = slack::find(&problem, &screen, start);
    let mut stage = Stage::weighed(problem, screen, &parameters, 12);
    // The zone after a reversal, from the friction that the residuals lack there; then once more with the better friction.
    for _ in 0..2 {
        let Stage { problem, screen, parameters, .. } = stage;
        let zone = reversals::zone(&problem, &screen, &parameters);
        let screen = reversals::with_zone(&problem, &screen, zone);
        stage = Stage::weighed(problem, screen, &parameters, 6);
    }
    stage
}

/// The solution with the dimensions that `options` leaves free. With the right dimensions it shows better where the muscle is slack, so
/// they are found twice.
fn with_dimensions(stage: Stage, options: &Options) -> Stage {
    let Stage { problem, screen, weights, parameters } = stage;
    let (problem, parameters) = dimension_search::adjust(&problem, &screen, &weights, parameters, options);
    let (screen, parameters) = slack::find(&problem, &screen, parameters);
    let screen = reversals::with_zone(&problem, &screen, screen.reversal_zone);
    let weights = Weights::of(&problem, &screen, &parameters);
    let (problem, parameters) = dimension_search::adjust(&problem, &screen, &weights, parameters, options);
    Stage { problem, screen, weights, parameters }
}
