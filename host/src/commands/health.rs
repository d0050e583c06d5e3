//! `host health`: whether the table on a controller still describes its muscle, and what has changed.

use clap::Args;
use model_core::link::endpoints::ReadHealth;
use model_core::link::messages::{HealthRead, Side};

use super::port::PortOption;
use crate::console::Console;
use crate::documents::health::{Change, Health};
use crate::documents::text;
use pam_data::error::Result;
use pam_diagnose::health::{Assessment, Verdict, assess, unit};
use pam_report::wording::change as wording;

/// Say whether the table on a controller still describes its muscle, and name what has changed.
///
/// The controller compares its load cell with its table while it runs. This command reads the sums; it needs no recording.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Examples:\n  \
    host health --port /dev/ttyACM0\n  \
    host health --json")]
pub struct Arguments {
    #[command(flatten)]
    port: PortOption,
    /// The second muscle of a joint.
    #[arg(long)]
    second: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Reads the sums and prints what they say.
    ///
    /// # Errors
    /// A device that does not answer, or an output that cannot be written.
    pub fn run(self, console: &Console) -> Result<()> {
        let side = if self.second { Side::Antagonist } else { Side::Agonist };
        let sums = self.port.connect(console)?.call::<ReadHealth>(&HealthRead { side })?;
        let assessment = assess(&sums);
        console.result(if self.json { text(&document(&assessment))? } else { summary(&assessment) });
        Ok(())
    }
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Unknown => "unknown",
        Verdict::Describes => "describes",
        Verdict::Changed => "changed",
    }
}

fn document(assessment: &Assessment) -> Health {
    let change = |finding: &pam_diagnose::health::Finding| Change {
        effect: finding.change.name(),
        parameter: finding.change.about().changed.size.0,
        value: finding.size,
        interval: [finding.interval.0, finding.interval.1],
        unit: unit(finding.change),
        share_explained: finding.share,
        confusable_with: finding.confusable_with.iter().map(|c| c.name()).collect(),
        remedy: wording::remedy(finding.change),
    };
    Health {
        schema: "pam-health/1",
        verdict: verdict(assessment.verdict),
        blocks: assessment.blocks,
        independent_blocks: assessment.independent,
        residual_rms_N: assessment.residual_n,
        tolerance_N: assessment.tolerance_n,
        changed: assessment.findings.iter().map(change).collect(),
    }
}

fn summary(assessment: &Assessment) -> String {
    let Assessment { blocks, independent, residual_n, tolerance_n, .. } = assessment;
    let basis = format!("{blocks} blocks, about {independent:.0} of the recent ones independent");
    match assessment.verdict {
        Verdict::Unknown => format!(
            "not known yet ({basis}): the comparison needs a table, a load cell, and some minutes of running"
        ),
        Verdict::Describes => format!(
            "the table describes this muscle: residual {residual_n:.2} N rms, no change above {tolerance_n:.2} N ({basis})"
        ),
        Verdict::Changed => {
            let mut lines = vec![format!(
                "the table no longer describes this muscle: residual {residual_n:.2} N rms ({basis})"
            )];
            for finding in &assessment.findings {
                let about = finding.change.about();
                let unit = unit(finding.change);
                let separator = if unit.is_empty() { "" } else { " " };
                lines.push(format!(
                    "  {}: {} {}{separator}{unit} (95 %: {} to {}), {:.0} % of the residual",
                    about.name,
                    about.changed.size.0,
                    number(finding.size),
                    number(finding.interval.0),
                    number(finding.interval.1),
                    100.0 * finding.share
                ));
                lines.push(format!("    what to do: {}", wording::remedy(finding.change)));
                if !finding.confusable_with.is_empty() {
                    let names: Vec<_> = finding.confusable_with.iter().map(|c| c.name()).collect();
                    lines.push(format!("    not distinguished from: {}", names.join(", ")));
                }
            }
            lines.join("\n")
        }
    }
}

/// Three significant digits.
fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e5).contains(&size) => {
            let digits = (2.0 - size.log10().floor()).max(0.0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.2e}"),
    }
}
