//! The demonstration's page: load lines measured and fitted, force tracking law by law.

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};

use super::tracking::{SETTLE, Task, Track};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_fit::Fit;
use pam_report::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, fixed};

/// Contents of the page.
#[derive(Debug)]
pub struct Story<'a> {
    /// The muscle's name.
    pub muscle: &'a str,
    /// What the bench recorded.
    pub campaign: &'a Campaign,
    /// The fit of it.
    pub fit: &'a Fit,
    /// Description of where the firmware ran.
    pub controller: &'a str,
    /// The device's release and check sum of its table.
    pub device: String,
    /// What was tracked, law after law.
    pub tracks: &'a [Track],
    /// Blocked force of the table, N.
    pub blocked_force: f64,
    /// Root mean square of the table's error on the telemetry, N, and its rows.
    pub telemetry: (f64, usize),
    /// Seconds that everything took.
    pub seconds: f64,
}

/// Builds the page.
///
/// # Errors
/// [`DataCode::TableInvalid`] where the fitted table cannot be evaluated.
pub fn page(story: &Story<'_>) -> Result<Page> {
    let summary = &story.fit.summary;
    let percent = |newtons: f64| 100.0 * newtons / story.blocked_force;
    let mut page = Page::new("From recordings to a muscle under control", story.muscle);
    let best = rms(story.tracks, |t| t.law == super::tracking::Law::Table);
    page.verdict(
        if percent(best) < 2.0 { Tone::Good } else { Tone::Caution },
        format!(
            "With the fitted table the force error of the controller is {:.2} % of blocked force (rms) while the muscle moves.",
            percent(best)
        ),
    );
    page.fact("fit", format!("{:.2} %", summary.mean_error_pct), "mean error, of blocked force", Tone::Plain);
    page.fact(
        "P_{0}",
        format!("{:.1} kPa", summary.deadband_kPa),
        "deadband: pressure at which contraction begins",
        Tone::Plain,
    );
    page.fact(
        "blocked force",
        format!("{:.1} N", story.blocked_force),
        "at the highest tested pressure",
        Tone::Plain,
    );
    page.fact("tracking", format!("{:.2} %", percent(best)), "fitted table, sine and steps, rms", Tone::Good);

    page.push(tracking_section(story, &percent));
    page.push(lines_section(story)?);
    page.push(telemetry_section(story, &percent));
    page.origin("controller", story.controller);
    page.origin("device", story.device.clone());
    page.origin("program", format!("host {}", env!("CARGO_PKG_VERSION")));
    page.origin("duration", format!("{:.1} s", story.seconds));
    Ok(page)
}

/// Force errors of every feed-forward as a table and pictures.
fn tracking_section(story: &Story<'_>, percent: &impl Fn(f64) -> f64) -> Section {
    let mut tracking = Section::new("Force tracking").summarised();
    tracking.text(format!(
        "The controller is {}. The virtual bench moves the muscle in lock-step with the control ticks. Each feed-forward runs the \
         same tasks; the first {SETTLE} s, while the muscle fills, are shown but not scored.",
        story.controller
    ));
    let mut table = Table::new(
        "Rms force error: measured minus setpoint",
        &[
            "feed-forward",
            "sine 0.5 Hz, N",
            "sine, % of blocked",
            "steps, N",
            "steps, % of blocked",
            "largest, N",
        ],
    );
    for law in super::tracking::Law::ALL {
        let of = |task: Task| story.tracks.iter().find(|t| t.law == law && t.task == task);
        if let (Some(sine), Some(steps)) = (of(Task::Sine), of(Task::Steps)) {
            table.row([
                law.name().to_owned(),
                format!("{:.2}", sine.rms),
                format!("{:.2}", percent(sine.rms)),
                format!("{:.2}", steps.rms),
                format!("{:.2}", percent(steps.rms)),
                format!("{:.1}", sine.largest.max(steps.largest)),
            ]);
        }
    }
    tracking.table(table);
    for task in Task::ALL {
        tracking.figure(force_figure(story.tracks, task));
    }
    tracking.figure(error_figure(story.tracks, story.blocked_force));
    tracking
}

/// The loops of the bench with the fitted force.
fn lines_section(story: &Story<'_>) -> Result<Section> {
    let mut lines = Section::new("Load lines");
    lines.text(format!(
        "{} rows of the thesis's test protocol: at each pressure three slow loops from blocked to free and back. One fit over \
         all pressures gives E_{{k}}(P), k_{{F}}(P) and P_{{0}} together.",
        fixed(story.fit.summary.samples as f64, 0)
    ));
    lines.figure(load_lines(story.campaign, story.fit)?);
    Ok(lines)
}

/// The error of the table on the telemetry of the controller.
fn telemetry_section(story: &Story<'_>, percent: &impl Fn(f64) -> f64) -> Section {
    let mut telemetry = Section::new("Telemetry as a recording");
    telemetry.text(format!(
        "The controller's telemetry is a recording like any other. On its {} rows inside the tested range, which were not fitted, the \
         table's error is {:.2} N rms ({:.2} % of blocked force).",
        fixed(story.telemetry.1 as f64, 0),
        story.telemetry.0,
        percent(story.telemetry.0),
    ));
    telemetry
}

/// Root mean square over the chosen tracks, N.
#[must_use]
pub fn rms(tracks: &[Track], take: impl Fn(&Track) -> bool) -> f64 {
    let chosen: Vec<f64> = tracks.iter().filter(|t| take(t)).map(|t| t.rms * t.rms).collect();
    (chosen.iter().sum::<f64>() / chosen.len().max(1) as f64).sqrt()
}

fn curves(track: &Track) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let start = track.samples.first().map_or(0, |s| s.time_us);
    let mut out = (Vec::new(), Vec::new(), Vec::new());
    for sample in &track.samples {
        let Some(side) = sample.sides.first() else { continue };
        out.0.push(sample.time_us.saturating_sub(start) as f64 * 1e-6);
        out.1.push(f64::from(sample.setpoint));
        out.2.push(f64::from(side.force_n));
    }
    out
}

fn force_figure(tracks: &[Track], task: Task) -> Figure {
    let panels = tracks
        .iter()
        .filter(|t| t.task == task)
        .map(|track| {
            let (time, setpoint, measured) = curves(track);
            Panel::new(Axis::new("time", "s"), Axis::new("force F", "N"))
                .titled(track.law.name())
                .line("measured", Colour::Series(0), &time, &measured)
                .dashes("setpoint", Colour::Ink, &time, &setpoint)
        })
        .collect();
    let title = match task {
        Task::Sine => "A sine of 0.5 Hz",
        Task::Steps => "Steps",
    };
    Figure::multiples(
        format!("tracking-{}", task.name()),
        title,
        "With a perfect law, the measured force lies on the dashed line; the deviation is the law's error.",
        panels,
    )
    .shared(true, true)
}

fn error_figure(tracks: &[Track], blocked: f64) -> Figure {
    let mut panel = Panel::new(Axis::new("time", "s"), Axis::new("error of force", "% of blocked force"));
    for (i, track) in tracks.iter().filter(|t| t.task == Task::Sine).enumerate() {
        let (time, setpoint, measured) = curves(track);
        let judged = time.iter().position(|t| *t >= SETTLE).unwrap_or(0);
        let error: Vec<f64> =
            measured.iter().zip(&setpoint).map(|(m, a)| 100.0 * (m - a) / blocked).collect();
        panel = panel.line(track.law.name(), Colour::Series(i), &time[judged..], &error[judged..]);
    }
    Figure::new(
        "tracking-error",
        "Error of force on the sine",
        "Flat and near zero is good; a wave at the muscle's own motion is what the law does not know of the muscle.",
        panel,
    )
}

/// Measured loops as points, the fitted force on the way out and back as lines.
fn load_lines(campaign: &Campaign, fit: &Fit) -> Result<Figure> {
    let muscle =
        Muscle::<f64>::build(&fit.table).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
    let l0 = f64::from(fit.table.geometry.rest_length.metres());
    let mut panel = Panel::new(Axis::new("contraction ΔL/L_{0}", "%"), Axis::new("force F", "N"));
    let count = campaign.recordings.len();
    for (i, recording) in campaign.recordings.iter().enumerate() {
        let Ok(force) = recording.require_force() else { continue };
        let contraction: Vec<f64> = recording.stroke.iter().map(|x| 100.0 * x / l0).collect();
        let colour = Colour::ordered(i, count);
        panel = panel.hair(if i == 0 { "measured" } else { "" }, Colour::Muted, &contraction, force);
        let pressure = recording.pressure.iter().sum::<f64>() / recording.pressure.len().max(1) as f64;
        let longest = recording.stroke.iter().copied().fold(0.0_f64, f64::max);
        let strokes: Vec<f64> = (0..=60).map(|j| longest * f64::from(j) / 60.0).collect();
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for direction in [1.0, -1.0] {
            for stroke in &strokes {
                x.push(100.0 * stroke / l0);
                y.push(
                    muscle
                        .force(Pressure::from_pascals(pressure), Length::from_metres(*stroke), direction)
                        .newtons(),
                );
            }
            x.push(f64::NAN);
            y.push(f64::NAN);
        }
        panel = panel.line(format!("{:.0} kPa, fitted", pressure / 1e3), colour, &x, &y);
    }
    Ok(Figure::new(
        "load-lines",
        "Load lines, measured and fitted",
        "At each pressure the measured loop (grey) lies between and on the two fitted lines if the fit is good: the lower one shortening, the \
         upper one lengthening.",
        panel,
    ))
}
