//! The report of a fit: every figure of the thesis for any muscle, and what else one expects of a fit.

mod controller;
mod curves;
mod held_length;
mod loads;
mod models;
mod parameters;
mod residuals;
mod view;

use super::wording::sentence;
use super::{Page, Section, Table, Tone, fixed, significant};
use pam_data::pluralise::pluralise;
use pam_data::recording::Campaign;
use pam_data::statistics::NORMAL_95;
use pam_fit::Fit;
use pam_fit::Options;
use view::View;

/// Error below which a table is called good, percent of blocked force; the thesis reaches a fifth of it.
const GOOD: f64 = 1.0;
/// Error above which a table is called bad.
const BAD: f64 = 5.0;

/// The page of a fit. `campaign` gives the recordings' names; the fit holds everything else.
#[must_use]
pub fn page(fit: &Fit, campaign: &Campaign, options: &Options) -> Page {
    let view = View::new(fit, campaign);
    let s = &fit.summary;
    let mut page = Page::new(
        format!("Fit of {}", s.muscle),
        format!(
            "{} rows of {}, order M = {}{}",
            fixed(s.samples as f64, 0),
            pluralise(campaign.recordings.len(), "recording"),
            options.order,
            if options.tip_correction { ", tip correction" } else { "" }
        ),
    );
    header(&mut page, &view);
    let mut overview = loads::overview(&view);
    overview.text("What to do:");
    overview.list(steps(&view));
    page.push(overview);
    page.push(remarks(&view));
    page.push(loads::section(&view));
    page.push(models::section(&view));
    page.push(curves::section(&view));
    page.push(controller::section(&view));
    page.push(residuals::section(&view));
    page.push(parameters::section(&view));
    page.recordings(campaign);
    page.origin("made by", format!("host {}", env!("CARGO_PKG_VERSION")));
    page
}

fn tone(percent: f64, good: f64, bad: f64) -> Tone {
    if percent <= good {
        Tone::Good
    } else if percent <= bad {
        Tone::Caution
    } else {
        Tone::Bad
    }
}

fn header(page: &mut Page, view: &View<'_>) {
    let s = &view.fit.summary;
    let unseen = s.left_out_pressure_mean_error_pct;
    let mut verdict = format!(
        "The table reproduces the measured force to {} % of the blocked force on average, {} % at most",
        significant(s.mean_error_pct, 2),
        significant(s.max_error_pct, 2)
    );
    let mut worst = tone(s.mean_error_pct, GOOD, BAD);
    match unseen {
        Some(unseen) => {
            verdict += &format!(
                ". At pressures left out of the fit the mean error is {} %.",
                significant(unseen, 2)
            );
            if tone(unseen, 2.0 * GOOD, BAD) == Tone::Bad || worst == Tone::Good && unseen > 2.0 * GOOD {
                worst = tone(unseen, 2.0 * GOOD, BAD);
            }
        }
        None => {
            verdict += ". The recordings have one pressure only: forces at others are not identifiable.";
            if worst == Tone::Good {
                worst = Tone::Caution;
            }
        }
    }
    verdict += match worst {
        Tone::Bad => " Do not use it for control before the warnings below are resolved.",
        Tone::Caution if !s.warnings.is_empty() => " Read the warnings below before you use it.",
        Tone::Caution | Tone::Good | Tone::Plain => "",
    };
    page.verdict(worst, verdict);
    page.fact(
        "mean error",
        format!("{} %", significant(s.mean_error_pct, 2)),
        "of blocked force",
        tone(s.mean_error_pct, GOOD, BAD),
    );
    if let Some(unseen) = unseen {
        page.fact(
            "error at held-out pressures",
            format!("{} %", significant(unseen, 2)),
            "of blocked force, each pressure in turn",
            tone(unseen, 2.0 * GOOD, BAD),
        );
    }
    if unseen.is_none() {
        page.fact(
            "largest error",
            format!("{} %", significant(s.max_error_pct, 2)),
            view.worst_place(),
            tone(s.max_error_pct, 3.0 * GOOD, 3.0 * BAD),
        );
    }
    page.fact(
        "blocked force",
        format!("{} N", significant(s.blocked_force_N, 4)),
        format!("at {} kPa", fixed(view.highest_pressure() / 1e3, 0)),
        Tone::Plain,
    );
}

/// The numbers behind the three of the header.
fn further_figures(view: &View<'_>) -> Table {
    let s = &view.fit.summary;
    let mut table = Table::new("Figures of the fit", &["quantity", "value", "remark"]);
    table.row(["largest error", &format!("{} %", significant(s.max_error_pct, 2)), &view.worst_place()]);
    table.row([
        "deadband P_{0}",
        &format!("{} kPa", fixed(s.deadband_kPa, 1)),
        &format!("± {} kPa (95 % confidence interval)", significant(NORMAL_95 * s.deadband_std_kPa, 2)),
    ]);
    table.row(["residual", &format!("{} N", significant(s.rms_N, 2)), "rms of all fitted points"]);
    table
}

/// What to do with the table.
fn steps(view: &View<'_>) -> Vec<String> {
    let s = &view.fit.summary;
    if !s.faults.is_empty() {
        return vec![
            "Do not use the table for control: the warnings below state the reasons.".to_owned(),
            "Check units, signs, and dimensions of the muscle, then fit again.".to_owned(),
        ];
    }
    let mut steps = Vec::new();
    if !s.warnings.is_empty() {
        steps.push("Read the warnings below.".to_owned());
    }
    let unseen = s.left_out_pressure_mean_error_pct.unwrap_or(f64::INFINITY);
    if s.mean_error_pct > GOOD || unseen > 2.0 * GOOD {
        steps.push("Find the cause of the error: `host diagnose` with the same recordings.".to_owned());
    }
    if s.left_out_pressure_mean_error_pct.is_none() {
        steps.push("Record at further pressures: forces at others are not identifiable.".to_owned());
    }
    steps.push(
        "Check the table on recordings that it was not fitted to: `host predict`, or `host evaluate`."
            .to_owned(),
    );
    if s.mean_error_pct <= BAD {
        steps.push("Send it to the controller: `host flash`.".to_owned());
    }
    steps
}

fn remarks(view: &View<'_>) -> Section {
    let s = &view.fit.summary;
    let mut section = Section::new("Warnings and figures").summarised();
    for warning in &s.warnings {
        section.notice(Tone::Caution, as_sentence(warning));
    }
    if let Some(free) = &s.physical {
        section.notice(
            Tone::Plain,
            format!(
                "Stress was constrained to rise with strain (`--physical`). Error: {} % mean, {} % at most; without the constraint {} % and {} %.",
                significant(s.mean_error_pct, 2),
                significant(s.max_error_pct, 2),
                significant(free.free_mean_error_pct, 2),
                significant(free.free_max_error_pct, 2)
            ),
        );
    }
    section.table(further_figures(view));
    let rows = &s.rows;
    let excluded = [
        (rows.near_reversal, "just after a reversal, where friction has not yet reversed"),
        (rows.unknown_direction, "direction of motion unknown"),
        (rows.slack, "muscle slack"),
        (rows.pushed, "muscle pushed by the rig"),
        (rows.clipped, "force sensor at the end of its range"),
        (rows.outliers, "outliers"),
        (rows.dropouts, "sensor failed, or load held by a stop or by friction"),
    ];
    let named: Vec<String> = excluded
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, why)| format!("{} ({why})", fixed(*n as f64, 0)))
        .collect();
    let all = s.samples.max(1) as f64;
    let mut text = format!(
        "{} of {} rows were fitted ({} %).",
        fixed(rows.fitted as f64, 0),
        fixed(all, 0),
        fixed(100.0 * rows.fitted as f64 / all, 0)
    );
    if !named.is_empty() {
        text += &format!(" Excluded: {}.", named.join(", "));
    }
    section.text(text);
    section
}

/// A sentence, wherever its words come from; one that begins with a symbol such as `k_F` stays.
fn as_sentence(text: &str) -> String {
    match text.chars().nth(1) {
        Some(second) if second.is_alphabetic() || second == ' ' => sentence(text),
        _ => text.to_owned(),
    }
}
