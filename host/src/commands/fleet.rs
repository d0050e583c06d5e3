//! `host fleet`: the results of a batch as one fleet.

use std::path::{Component, Path, PathBuf};

use clap::Args;
use pam_data::error::Result;
use pam_data::output::{printed, to_standard_output};
use pam_data::pluralise::pluralise;
use pam_fleet::fleet::Fleet;
use pam_fleet::groups::Difference;
use pam_fleet::overview::Overview;
use pam_fleet::{page, robust};

use super::reports::{self, Reports};
use crate::console::{Console, name};
use crate::documents::{fleet as document, text};

/// Lines of each list on the terminal.
const MOST_PRINTED: usize = 10;

/// Arguments of `host fleet`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host fleet results --report fleet.html\n  \
    host fleet results --json\n\n\
    results is the folder that `host batch` wrote. Tags of the manifest (batch, rig, date) are compared as groups. The names of \
    muscles lead to their reports if `host batch --reports` wrote them.")]
pub struct Arguments {
    /// The folder of the results.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reports: Reports,
}

impl Arguments {
    /// Reads, summarises, writes.
    ///
    /// # Errors
    /// A folder without results, damaged results, a report that cannot be written.
    pub fn run(self, console: &Console) -> Result<()> {
        let taken = to_standard_output(&[("--json", printed(self.json)), ("--report", self.reports.file())])?;
        let fleet = Fleet::read(&self.output)?;
        let overview = Overview::of(&fleet);
        let results = relative(&self.output, self.reports.file());
        self.reports.write(console, &reports::provenance(), || page::page(&fleet, &overview, &results))?;
        if self.json {
            console.result(text(&to_document(&fleet, &overview))?);
        } else if taken {
            console.note(summary(&fleet, &overview));
        } else {
            console.result(summary(&fleet, &overview));
        }
        Ok(())
    }
}

/// The address of a folder as a page in another folder names it.
fn relative(folder: &Path, page: Option<&Path>) -> String {
    let base = page.and_then(Path::parent).filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (Ok(folder), Ok(base)) = (folder.canonicalize(), base.canonicalize()) else {
        return folder.display().to_string();
    };
    let (to, from): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (folder.components().collect(), base.components().collect());
    let common = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - common);
    let down = to[common..].iter().map(|c| c.as_os_str().to_string_lossy().into_owned());
    let parts: Vec<String> = up.chain(down).collect();
    if parts.is_empty() { ".".to_owned() } else { parts.join("/") }
}

fn summary(fleet: &Fleet, overview: &Overview) -> String {
    let mut lines = vec![format!(
        "{}: {} fitted, {} diagnosed, {} failed",
        pluralise(fleet.members.len(), "muscle"),
        fleet.fitted(),
        overview.diagnosed,
        fleet.failed()
    )];
    for d in overview.distributions.iter().filter(|d| d.muscles > 0) {
        let q = &fleet.quantities[d.quantity];
        lines.push(format!(
            "{:>16}: median {:.4} {}, 5 to 95 %: {:.4} to {:.4}",
            q.name, d.quantiles[2], q.unit, d.quantiles[0], d.quantiles[4]
        ));
    }
    for o in overview.outlying.iter().take(MOST_PRINTED) {
        let q = &fleet.quantities[o.quantity];
        let muscle = name(&fleet.members[o.member].muscle);
        lines.push(format!("outlying: {muscle}: {} = {:.4} {} (z = {:.1})", q.name, o.value, q.unit, o.z));
    }
    if overview.outlying.len() > MOST_PRINTED {
        lines.push(format!("outlying: {} more", overview.outlying.len() - MOST_PRINTED));
    }
    for e in overview.effects.iter().take(MOST_PRINTED) {
        lines.push(format!(
            "effect: {} in {} ({:.1} %)",
            e.effect,
            pluralise(e.muscles, "muscle"),
            100.0 * e.share
        ));
    }
    for finding in overview.differences.iter().take(MOST_PRINTED) {
        let sentence = pam_report::inline_markup::plain(&page::sentence(finding, fleet));
        lines.push(format!("difference: {sentence} (p = {:.1e})", finding.p));
    }
    lines.join("\n")
}

fn to_document<'a>(fleet: &'a Fleet, overview: &'a Overview) -> document::Fleet<'a> {
    let quantity = |i: usize| fleet.quantities[i].name.as_str();
    document::Fleet {
        schema: "pam-fleet/1",
        muscles: fleet.members.len(),
        fitted: fleet.fitted(),
        diagnosed: overview.diagnosed,
        failed: fleet.failed(),
        pressure_kPa: fleet.pressure_kPa,
        quantities: overview
            .distributions
            .iter()
            .filter(|d| d.muscles > 0)
            .map(|d| document::Quantity {
                name: quantity(d.quantity),
                unit: fleet.quantities[d.quantity].unit,
                muscles: d.muscles,
                quantiles: d.quantiles,
                robust_std: d.centre.map(|c| c.deviation),
            })
            .collect(),
        outlying_z: overview.limit,
        false_alarm_probability: robust::FALSE_ALARMS,
        outlying: overview
            .outlying
            .iter()
            .map(|o| document::Outlying {
                muscle: &fleet.members[o.member].muscle,
                quantity: quantity(o.quantity),
                value: o.value,
                z: o.z,
            })
            .collect(),
        verdicts: &overview.verdicts,
        effects: overview
            .effects
            .iter()
            .map(|e| document::Effect {
                effect: &e.effect,
                bench: e.bench,
                muscles: e.muscles,
                share: e.share,
            })
            .collect(),
        tests: overview.tests,
        differences: overview
            .differences
            .iter()
            .map(|f| document::GroupDifference {
                tag: &f.key,
                value: &f.value,
                muscles: f.muscles,
                subject: match &f.difference {
                    Difference::Effect { effect, .. } => effect,
                    Difference::Quantity { quantity: i, .. } | Difference::Trend { quantity: i, .. } => {
                        quantity(*i)
                    }
                },
                kind: match f.difference {
                    Difference::Effect { .. } => "effect-share",
                    Difference::Quantity { .. } => "median",
                    Difference::Trend { .. } => "rank-correlation-with-date",
                },
                inside: match f.difference {
                    Difference::Effect { inside, .. } | Difference::Quantity { inside, .. } => inside,
                    Difference::Trend { correlation, .. } => correlation,
                },
                outside: match f.difference {
                    Difference::Effect { outside, .. } | Difference::Quantity { outside, .. } => {
                        Some(outside)
                    }
                    Difference::Trend { .. } => None,
                },
                p: f.p,
            })
            .collect(),
        failures: &overview.failures,
    }
}
