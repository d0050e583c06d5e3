//! The page of a campaign: its steps, what each showed, the table, the diagnosis, force tracking.

use pam_campaign::campaign::Done;
use pam_campaign::engine::Engine;
use pam_data::statistics::NORMAL_95;
use pam_diagnose::verdict::{Diagnosis, Missing, Verdict};
use pam_report::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, wording};

use crate::documents::campaign as document;

/// Builds the page.
pub(crate) fn page(engine: &Engine, steps: &[Done], result: &document::Campaign) -> Page {
    let mut page = Page::new("A campaign that chose its own steps", result.muscle.clone());
    let tone = if result.complete && settled(engine, result) { Tone::Good } else { Tone::Caution };
    let diagnosis = engine.diagnosis().map_or(String::new(), |d| format!(" {}", wording::verdict(d)));
    page.verdict(tone, format!("{}{diagnosis}", result.ended_by));
    page.fact(
        "bench time",
        format!("{:.1} min", result.bench_s / 60.0),
        format!("of {:.0} min", result.minutes),
        Tone::Plain,
    );
    page.fact("steps", result.steps.len().to_string(), "recorded", Tone::Plain);
    if let Some(t) = &result.table {
        page.fact("P_{0}", format!("{:.1} kPa", t.deadband_kPa), "deadband", Tone::Plain);
        page.fact("fit", format!("{:.2} %", t.mean_error_pct), "mean error, of blocked force", Tone::Plain);
    }
    page.push(steps_section(result));
    page.push(time_section(engine, steps, result));
    if let Some(diagnosis) = engine.diagnosis() {
        page.push(diagnosis_section(diagnosis));
    }
    page.push(table_section(result));
    page.push(tracking_section(result));
    page.origin("controller", result.controller.clone());
    page.origin("program", format!("host {}", env!("CARGO_PKG_VERSION")));
    for step in &result.steps {
        page.origin(step.file.clone(), format!("{} rows", step.rows));
    }
    page
}

/// Whether the table has the target error and the model explains the recordings.
fn settled(engine: &Engine, result: &document::Campaign) -> bool {
    let error = result.table.as_ref().and_then(|t| Some((t.predicted_error_pct?, t.target_error_pct)));
    let known = error.is_none_or(|(predicted, wanted)| predicted <= wanted);
    let explained =
        |d: &Diagnosis| d.judged() && matches!(d.verdict(), Verdict::Consistent | Verdict::Explained);
    known && engine.diagnosis().is_none_or(explained)
}

/// The verdict, what is missing, and what to do next.
fn diagnosis_section(diagnosis: &Diagnosis) -> Section {
    let mut section = Section::new("Diagnosis").summarised();
    section.text(wording::verdict(diagnosis));
    let named =
        |m: &Missing| format!("`{}` (probability {:.0} %): {}", m.effect, 100.0 * m.probability, m.summary);
    if !diagnosis.missing.is_empty() {
        section.list(diagnosis.missing.iter().map(named).collect::<Vec<String>>());
    }
    if let Some(next) = &diagnosis.next_experiment {
        section.text(format!("Next experiment: {}.", wording::proposal(&next.proposal)));
    }
    section.text("`diagnosis.html` in the same folder shows the whole answer with pictures.");
    section
}

fn steps_section(result: &document::Campaign) -> Section {
    let mut section = Section::new("Course");
    section.text(
        "Each step is the one with the most expected information per second: about the table, about which effect is missing, and about effects \
         that nothing had shown yet. The first steps are the same in every campaign.",
    );
    let mut table = Table::new("Steps in order", &["step", "from, s", "what", "why", "what it showed"]);
    for s in &result.steps {
        let repeated = if s.spoiled.is_empty() {
            String::new()
        } else {
            format!(" Repeated: {}.", s.spoiled.join("; "))
        };
        table.row([
            s.number.to_string(),
            format!("{:.0}", s.begin_s),
            s.what.clone(),
            s.why.clone(),
            format!("{}{repeated}", s.finding),
        ]);
    }
    section.table(table);
    section
}

/// Pressure and stroke over the campaign, and the predicted error.
fn time_section(engine: &Engine, steps: &[Done], result: &document::Campaign) -> Section {
    let mut section = Section::new("Recordings");
    let (mut time, mut pressure, mut stroke) = (Vec::new(), Vec::new(), Vec::new());
    for r in engine.recordings() {
        let stride = r.len().div_ceil(200).max(1);
        for i in (0..r.len()).step_by(stride) {
            time.push(r.time[i]);
            pressure.push(r.pressure[i] * 1e-3);
            stroke.push(r.stroke[i] * 1e3);
        }
        time.push(f64::NAN);
        pressure.push(f64::NAN);
        stroke.push(f64::NAN);
    }
    let panel = |label: &str, unit: &str, y: &[f64], colour| {
        Panel::new(Axis::new("time", "s"), Axis::new(label, unit)).line(label, colour, &time, y)
    };
    section.figure(Figure::multiples(
        "campaign-course",
        "Course of the campaign",
        "Gaps are pauses, vented rests and motions that were not recorded.",
        vec![
            panel("pressure P", "kPa", &pressure, Colour::Series(0)),
            panel("stroke ΔL", "mm", &stroke, Colour::Series(1)),
        ],
    ));
    let mut known: Vec<(f64, f64)> = steps
        .iter()
        .filter(|d| d.chosen.predicted_error > 0.0)
        .map(|d| (d.clock_s.0, 100.0 * d.chosen.predicted_error / engine.places().blocked.max(1e-9)))
        .collect();
    // Each step begins with the error that was expected before it; the last one is known at the end.
    known.extend(result.table.as_ref().and_then(|t| Some((result.bench_s, t.predicted_error_pct?))));
    if known.len() > 1 {
        let (x, y): (Vec<f64>, Vec<f64>) = known.into_iter().unzip();
        let wanted = result.table.as_ref().map_or(0.0, |t| t.target_error_pct);
        let panel =
            Panel::new(Axis::new("time", "s"), Axis::new("expected error", "% of blocked force").from_zero())
                .line("expected", Colour::Series(0), &x, &y)
                .dashes("wanted", Colour::Ink, &[x[0], x[x.len() - 1]], &[wanted, wanted]);
        section.figure(Figure::new(
            "campaign-error",
            "Expected standard error of the table between the tested pressures and strokes",
            "The campaign ends early where it falls below the dashed line and the diagnosis is settled.",
            panel,
        ));
    }
    section
}

fn table_section(result: &document::Campaign) -> Section {
    let mut section = Section::new("Table");
    let Some(t) = &result.table else {
        section.text("The recordings do not determine a table yet.");
        return section;
    };
    let mut table = Table::new("The fitted table", &["quantity", "value"]);
    table.row([
        "deadband".to_owned(),
        format!("{:.2} ± {:.2} kPa (95 %)", t.deadband_kPa, NORMAL_95 * t.deadband_std_kPa),
    ]);
    table.row(["blocked force".to_owned(), format!("{:.1} N", t.blocked_force_N)]);
    table.row(["mean error".to_owned(), format!("{:.3} % of blocked force", t.mean_error_pct)]);
    if let Some(error) = t.left_out_pressure_mean_error_pct {
        table.row([
            "each pressure predicted from the others, the outer ones by extrapolation".to_owned(),
            format!("{error:.3} % of blocked force"),
        ]);
    }
    if let Some(error) = t.predicted_error_pct {
        let wanted = t.target_error_pct;
        table.row([
            "expected standard error between the tested pressures and strokes, if the model is right"
                .to_owned(),
            format!("{error:.3} % of blocked force; target: {wanted:.2} %"),
        ]);
    }
    section.table(table);
    section.text(
        "`fit.html` in the same folder shows the fit with pictures; `table.pam` goes to the controller with `host flash`.",
    );
    section
}

fn tracking_section(result: &document::Campaign) -> Section {
    let mut section = Section::new("Force tracking before and after");
    if result.tracking.is_empty() {
        return section;
    }
    let mut table = Table::new(
        "A sine of 0.5 Hz, rms error after the first second",
        &["feed-forward", "N", "% of blocked force"],
    );
    for t in &result.tracking {
        table.row([t.feed_forward.clone(), format!("{:.2}", t.rms_N), format!("{:.2}", t.rms_pct)]);
    }
    section.table(table);
    section
}
