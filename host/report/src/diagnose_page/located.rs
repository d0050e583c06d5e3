//! Where the model is wrong: along each coordinate, and over time.

use crate::{Axis, Colour, Figure, Mark, Panel, Section, residual_table, significant, wording};
use pam_data::statistics::median;
use pam_diagnose::history::is_from_history;
use pam_diagnose::verdict::{Diagnosis, Profile};
use pam_fit::RecordingResidual;

/// A coordinate's name and numbers as an engineer reads them.
fn shown(profile: &Profile) -> (String, &'static str, f64, f64) {
    let name = profile.coordinate.replace('-', " ");
    match profile.coordinate.as_str() {
        "pressure" => (name, "kPa", 1e-3, 0.0),
        "pressure-rate" => (name, "kPa/s", 1e-3, 0.0),
        "contraction" => (name, "%", 100.0, 0.0),
        // Both are distances from it.
        "largest-contraction-so-far" => ("contraction less the largest so far".into(), "%", 100.0, 0.0),
        "speed" => (name, "mm/s", 1e3, 0.0),
        "acceleration" => (name, "mm/s²", 1e3, 0.0),
        "temperature" => (name, "°C", 1.0, -273.15),
        "force" => (name, "N", 1.0, 0.0),
        "time" | "since-reversal" | "hold-time" => (name, "s", 1.0, 0.0),
        "frequency" => (name, "Hz", 1.0, 0.0),
        _ => (name, "", 1.0, 0.0),
    }
}

/// The directions of motion, in the order of their sign.
const DIRECTIONS: [&str; 2] = ["lengthening", "shortening"];

/// The residual along one coordinate.
fn along(d: &Diagnosis, p: &Profile) -> Panel {
    let (name, unit, scale, offset) = shown(p);
    let region = d.r#where.iter().find(|r| r.coordinate == p.coordinate);
    let (axis, x, region): (Axis, Vec<f64>, _) = if p.coordinate == "direction"
        && p.at.len() == DIRECTIONS.len()
    {
        // A sign is not a number to read off: two places with names.
        let half = |sign: f64| if sign < 0.0 { 0.0 } else { 1.0 };
        let places = (0..DIRECTIONS.len()).map(|i| i as f64).collect();
        let region = region.map(|r| (half(r.from) - 0.5, half(r.to) + 0.5));
        (Axis::names("", DIRECTIONS.map(String::from).to_vec()), places, region)
    } else {
        let region = region.map(|r| (scale * r.from + offset, scale * r.to + offset));
        // What has no unit is counted: recordings, runs, levels.
        let axis = if unit.is_empty() { Axis::whole(name.clone()) } else { Axis::new(name.clone(), unit) };
        (axis, p.at.iter().map(|v| scale * v + offset).collect(), region)
    };
    let mut panel = Panel::new(axis, Axis::new("residual", "N").from_zero())
        .titled(name)
        .line("rms", Colour::Series(1), &x, &p.rms_before)
        .dashes("mean", Colour::Series(0), &x, &p.mean_before);
    if effects_beyond_history(d) {
        panel = panel.line("rms, with the named effects", Colour::Series(2), &x, &p.rms_after);
    }
    if let Some((from, to)) = region {
        panel = panel.region("concentrated here", from, to);
    }
    panel.with("noise", Colour::Muted, Mark::Level(d.noise_N))
}

/// Whether effects are named beside the memory: that one is taken out of the recordings before anything is drawn.
fn effects_beyond_history(d: &Diagnosis) -> bool {
    d.missing.iter().any(|m| !is_from_history(m))
}

/// The chapter: a summary, along each coordinate, over time.
pub(super) fn section(d: &Diagnosis, residuals: &[RecordingResidual]) -> Section {
    let mut section = Section::new("Where the model is wrong").summarised();
    if !d.judged() {
        return section;
    }
    section.text("The excess error is the squared residual above the noise.");
    if d.r#where.is_empty() {
        section.text("The error is spread evenly: no region of any coordinate holds more than its share.");
    } else {
        section.list(
            d.r#where.iter().take(5).map(|r| format!("{} (p = {})", wording::region(r), significant(r.p, 2))),
        );
    }
    let remembers = d.missing.iter().any(is_from_history);
    if remembers {
        section.text(
            "Shares of runs and mountings refer to the recordings as they are. All other shares and all pictures below refer to the recordings \
             after the memory of the bladder is removed.",
        );
    }
    // The coordinates where the misfit is concentrated come first, then the others that were examined.
    let rank =
        |p: &Profile| d.r#where.iter().position(|r| r.coordinate == p.coordinate).unwrap_or(usize::MAX);
    let mut profiles: Vec<&Profile> = d.profiles.iter().filter(|p| p.at.len() > 1).collect();
    profiles.sort_by_key(|p| rank(p));
    let panels: Vec<Panel> = profiles.into_iter().take(6).map(|p| along(d, p)).collect();
    if !panels.is_empty() {
        section.figure(Figure::multiples(
            "where",
            "Residual along each coordinate",
            "Where the orange line is far above the noise, the model is wrong. The shaded region holds more than its share of the \
             excess error (the squared residual above the noise).",
            panels,
        ));
    }
    residual_table::add(
        &mut section,
        "Residuals by recording of the table without effects (F − F_model)",
        residuals,
    );
    let t = &d.trace;
    if t.time.len() > 1 {
        let [time, before, after, effects] = with_pauses(&t.time, [&t.time, &t.before, &t.after, &t.effects]);
        let mut panel = Panel::new(Axis::new("time", "s"), Axis::new("residual", "N"));
        let found = effects_beyond_history(d);
        if found {
            // Beneath, for it may be larger than what it explains.
            panel = panel.hair("force of the named effects", Colour::Muted, &time, &effects);
        }
        let plain = if remembers { "without the memory" } else { "plain model" };
        panel = panel.hair(plain, Colour::Series(1), &time, &before);
        if found {
            panel = panel.hair("with the named effects", Colour::Series(2), &time, &after);
        }
        if let Some(r) = d.r#where.iter().find(|r| r.coordinate == "time") {
            panel = panel.region("concentrated here", r.from, r.to);
        }
        section.figure(Figure::new(
            "misfit-time",
            "Residual over time: measured minus computed force",
            if remembers {
                "Residual after the memory of the bladder is removed, without and with the effects named beside it. A band of even width around \
                 zero is noise."
            } else if d.missing.is_empty() {
                "Residual of the plain model. A band of even width around zero is noise."
            } else {
                "Residual of the plain model, and with the named effects: of a complete model, only noise remains. The grey line is the force of the \
                 named effects; where it is larger than the residual, the tables had absorbed the rest."
            },
            panel,
        ));
    }
    section
}

/// Columns with an empty row in each pause, where nothing was recorded: a line would claim that something was.
fn with_pauses<const N: usize>(time: &[f64], columns: [&[f64]; N]) -> [Vec<f64>; N] {
    let steps: Vec<f64> = time.windows(2).map(|t| t[1] - t[0]).collect();
    let usual = median(&mut steps.clone());
    columns.map(|column| {
        let mut broken = Vec::with_capacity(column.len());
        for (i, value) in column.iter().enumerate() {
            if i > 0 && !(steps[i - 1] < 20.0 * usual) {
                broken.push(f64::NAN);
            }
            broken.push(*value);
        }
        broken
    })
}
