//! The chapter on what the muscle remembers over a campaign of staircases.

use crate::history_text::{assumed, why_not, with_half};
use crate::wording::history as wording;
use crate::{Axis, Colour, Figure, Mark, Panel, Section, Table, fixed, significant};
use pam_diagnose::history::History;

/// The chapter; empty where the campaign has no history.
pub(super) fn section(history: Option<&History>) -> Section {
    let mut section = Section::new("What the muscle remembers").summarised();
    let Some(h) = history else { return section };
    let u = &h.unseen;
    section.text(format!(
        "{} runs in {} mountings. Each run predicted from the other runs: {} % of the largest force (root mean square) by a static curve for \
         each mounting and direction, {} % with a memory of the bladder{}.",
        h.runs.len(),
        h.mountings.len(),
        fixed(u.without_memory.rms_pct, 2),
        fixed(u.with_memory.rms_pct, 2),
        u.with_slips.map_or(String::new(), |e| format!(", {} % beside the slips", fixed(e.rms_pct, 2)))
    ));
    if !h.named {
        section.text(format!("No memory is named: {}.", why_not(h)));
    }
    section.list(
        h.findings
            .iter()
            .map(|f| format!("{}: {}", if f.found { "Found" } else { "Not found" }, wording::finding(f))),
    );
    section.table(parameters(h));
    section.figure(run_in(h));
    if !h.force_over_time.is_empty() {
        section.figure(force_over_time(h));
    }
    section.figure(unseen(h));
    section.table(mountings(h));
    section.table(layers(h));
    section
}

fn parameters(h: &History) -> Table {
    let mut table = Table::new(
        "The law of the memory, with 95 % intervals by delete-one-run jackknife",
        &["parameter", "value", "unit"],
    );
    table.row([
        "relaxed share c of the carried pressure".into(),
        with_half(&h.law.relaxed_share, 1.0, 2),
        "–".to_owned(),
    ]);
    let known = if h.law.balance_identifiable { "" } else { ", assumed: not identifiable here" };
    table.row([
        "pressure P_{b} at which the bladder carries nothing".into(),
        with_half(&h.law.balance_pressure, 1.0, 0) + known,
        "kPa".to_owned(),
    ]);
    let times: Vec<String> = h.law.time_constants_s.iter().map(|t| fixed(*t, 0)).collect();
    table.row(["time constants".into(), times.join(", "), "s".to_owned()]);
    table.row(["times not recorded".into(), assumed(h), String::new()]);
    table
}

/// Mean error over filling by run within mounting, before and after.
fn run_in(h: &History) -> Figure {
    let panel = |title: &str, after: bool| {
        let mut panel = Panel::new(
            Axis::whole("run within the mounting"),
            Axis::new("measured less predicted, filling", "N"),
        )
        .titled(title);
        for m in &h.mountings {
            let own = h.runs.iter().filter(|r| r.mounting == m.number);
            let (x, y): (Vec<f64>, Vec<f64>) =
                own.map(|r| (r.run as f64, if after { r.mean_after_N } else { r.mean_before_N })).unzip();
            let name = format!("{} mm", significant(m.length_mm, 4));
            panel = panel.line(name, Colour::Series(m.number - 1), &x, &y);
        }
        panel.with("", Colour::Muted, Mark::Level(0.0))
    };
    Figure::multiples(
        "history-runs",
        "Error of unseen runs by run within the mounting",
        "Left a static curve for each mounting and direction, right with memory. A run at zero is predicted from the others.",
        vec![panel("static curves", false), panel("with memory", true)],
    )
    .shared(true, true)
}

/// Force over time since mounting at one pressure.
fn force_over_time(h: &History) -> Figure {
    let pressure = h.force_over_time.first().map_or(0.0, |c| c.pressure_kPa);
    let panels = h
        .force_over_time
        .iter()
        .map(|c| {
            // The curve is the same on filling and emptying: only the memory moves it.
            Panel::new(Axis::new("time since the mounting", "s"), Axis::new("force", "N"))
                .titled(format!("{} mm", significant(c.length_mm, 4)))
                .points("measured", Colour::Muted, &c.time_s, &c.force_N)
                .line("law", Colour::Series(1), &c.time_s, &c.law_N)
        })
        .collect();
    Figure::multiples(
        "history-force",
        format!("Force at {} kPa over time since the mounting", fixed(pressure, 0)),
        "One length and one pressure in each panel: without memory the points would lie on a level.",
        panels,
    )
}

/// Error bars of unseen runs.
fn unseen(h: &History) -> Figure {
    let u = &h.unseen;
    let mut names = vec!["static curves", "with memory"];
    let mut values = vec![u.without_memory.rms_pct, u.with_memory.rms_pct];
    if let Some(slips) = u.with_slips {
        names.push("with memory and slips");
        values.push(slips.rms_pct);
    }
    names.extend(["static, supported points", "memory, supported points"]);
    values.extend([u.supported_without.rms_pct, u.supported_with.rms_pct]);
    let places: Vec<f64> = (0..names.len()).map(|i| i as f64).collect();
    let panel = Panel::new(
        Axis::new("rms error, % of the largest force", "%").from_zero(),
        Axis::names("", names.into_iter().map(String::from).collect()),
    )
    .bars("", Colour::Series(0), &values, &places);
    Figure::new(
        "history-unseen",
        "Error of unseen runs",
        "A point is supported when another run of the mounting reaches its pressure.",
        panel,
    )
}

fn mountings(h: &History) -> Table {
    let mut table = Table::new(
        "Mountings",
        &[
            "mounting",
            "length (mm)",
            "contraction (%)",
            "runs",
            "begins to pull at (kPa)",
            "carried by the bladder (kPa)",
        ],
    );
    for m in &h.mountings {
        table.row([
            m.number.to_string(),
            significant(m.length_mm, 4),
            fixed(100.0 * m.contraction, 1),
            m.runs.to_string(),
            fixed(m.threshold_kPa, 0),
            fixed(m.carried_kPa, 0),
        ]);
    }
    table
}

fn layers(h: &History) -> Table {
    let mut table = Table::new(
        "Shares of the squared error of unseen runs",
        &["layer", "entered in this order (%)", "entered last (%)"],
    );
    for l in &h.layers {
        table.row([
            wording::layer(l.layer).to_owned(),
            fixed(100.0 * l.in_order, 0),
            fixed(100.0 * l.last_in, 0),
        ]);
    }
    table
}
