//! What a campaign leaves behind: the table, the pages, the document.

use std::path::{Path, PathBuf};

use pam_campaign::analysis::names;
use pam_campaign::campaign::Done;
use pam_campaign::engine::Engine;
use pam_campaign::target_error;
use pam_data::date;
use pam_data::error::Result;
use pam_data::output::write_whole;
use pam_data::recording::Campaign;
use pam_diagnose::refitted_table;
use pam_fit::table_file::{self, About, TableFile};
use pam_report::{diagnose_page, fit_page};

use crate::documents::campaign as document;
use crate::program_name::in_page;

/// The table of everything recorded, with the effects that the diagnosis named where they help; written into the folder.
pub(crate) fn table(engine: &Engine, folder: &Path) -> Result<Option<TableFile>> {
    let Some(findings) = engine.findings() else { return Ok(None) };
    let campaign = Campaign::new(engine.recordings().to_vec());
    let files: Vec<PathBuf> = campaign.recordings.iter().map(|r| r.source.clone()).collect();
    let hashes = files.iter().map(table_file::sha256).collect::<Result<Vec<_>>>()?;
    let sources = table_file::sources(&campaign, &files, hashes);
    let plain = || TableFile {
        table: findings.fit.table.clone(),
        about: About {
            muscle: engine.muscle().name.clone(),
            tool: format!("host {} campaign", env!("CARGO_PKG_VERSION")),
            fit: findings.fit.summary.quality(),
            uncertainty: Some(findings.fit.stored_uncertainty()),
            ..About::default()
        },
    };
    let mut file = match engine.diagnosis() {
        // Without a refit the plain table is still good.
        Some(d) => refitted_table::refit(&campaign, engine.muscle(), d).map_or_else(|_| plain(), |r| r.file),
        None => plain(),
    };
    file.about.date = date::now_utc();
    file.about.sources = sources;
    file.write(folder.join("table.pam"))?;
    Ok(Some(file))
}

/// The pages of fit and diagnosis beside the campaign's own.
pub(crate) fn pages(engine: &Engine, folder: &Path) -> Result<()> {
    let campaign = Campaign::new(engine.recordings().to_vec());
    if let Some(findings) = engine.findings() {
        let page = fit_page::page(&findings.fit, &campaign, &pam_fit::Options::default());
        write_whole(&folder.join("fit.html"), in_page(page.html()).as_bytes())?;
    }
    if let Some(diagnosis) = engine.diagnosis() {
        let page = diagnose_page::page(diagnosis, &engine.muscle().geometry(), &campaign);
        write_whole(&folder.join("diagnosis.html"), in_page(page.html()).as_bytes())?;
    }
    Ok(())
}

/// What the call was, and how it ended.
pub(crate) struct RunFacts<'a> {
    pub(crate) controller: &'a str,
    pub(crate) purpose: &'a str,
    pub(crate) minutes: f64,
    pub(crate) complete: bool,
    pub(crate) ended_by: &'a str,
    pub(crate) tracking: Vec<(&'static str, f64)>,
}

fn step(done: &Done) -> document::Step {
    let c = &done.chosen;
    document::Step {
        number: c.number,
        name: c.step.name(),
        what: c.step.description(),
        why: c.why.clone(),
        finding: done.finding.clone(),
        file: done.file.clone(),
        rows: done.rows,
        begin_s: done.clock_s.0,
        end_s: done.clock_s.1,
        expected: document::Expected {
            table_nats: c.table_nats,
            effect_nats: c.effect_nats,
            unseen_nats: c.unseen_nats,
            seconds: c.expected_s,
            predicted_error_N: (c.predicted_error > 0.0).then_some(c.predicted_error),
        },
        choosing_s: c.choosing_s,
        spoiled: done.spoiled.iter().map(ToString::to_string).collect(),
    }
}

/// The document.
pub(crate) fn document(engine: &Engine, steps: &[Done], facts: &RunFacts<'_>) -> document::Campaign {
    let blocked = engine.places().blocked.max(1e-9);
    let percent = |newtons: f64| 100.0 * newtons / blocked;
    let table = engine.findings().map(|f| {
        let s = &f.fit.summary;
        document::Table {
            file: "table.pam".into(),
            deadband_kPa: s.deadband_kPa,
            deadband_std_kPa: s.deadband_std_kPa,
            blocked_force_N: s.blocked_force_N,
            mean_error_pct: s.mean_error_pct,
            left_out_pressure_mean_error_pct: s.left_out_pressure_mean_error_pct,
            predicted_error_pct: engine.predicted_error().filter(|e| e.is_finite()).map(percent),
            target_error_pct: 100.0 * target_error(),
        }
    });
    let diagnosis = engine.diagnosis().map(|d| document::Diagnosis {
        verdict: verdict(d).into(),
        possible: names(d),
        missing: d
            .missing
            .iter()
            .map(|m| document::Missing {
                effect: m.effect.clone(),
                probability: m.probability,
                confusable_with: m.confusable_with.clone(),
            })
            .collect(),
    });
    document::Campaign {
        schema: "pam-campaign/1",
        muscle: engine.muscle().name.clone(),
        controller: facts.controller.to_owned(),
        purpose: facts.purpose.to_owned(),
        minutes: facts.minutes,
        bench_s: steps.iter().map(|d| d.clock_s.1 - d.clock_s.0).sum(),
        complete: facts.complete,
        ended_by: facts.ended_by.to_owned(),
        steps: steps.iter().map(step).collect(),
        table,
        diagnosis,
        tracking: facts
            .tracking
            .iter()
            .map(|(name, rms)| document::Tracking {
                feed_forward: (*name).to_owned(),
                rms_N: *rms,
                rms_pct: percent(*rms),
            })
            .collect(),
    }
}

/// The verdict as `host diagnose --json` writes it.
fn verdict(d: &pam_diagnose::Diagnosis) -> &'static str {
    use pam_diagnose::outcome::Verdict;
    match d.verdict() {
        Verdict::Consistent => "consistent",
        Verdict::Explained => "explained",
        Verdict::PartlyExplained => "partly-explained",
        Verdict::Unexplained => "unexplained",
    }
}
