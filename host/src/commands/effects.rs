//! `host effects`: the library of effects.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::console::Console;
use crate::documents::{effects as document, text};
use crate::program_name::in_page;
use clap::Args;
use pam_data::error::{DataCode, Error, Result, nearest};
use pam_data::output::{printed, to_standard_output, write_whole};
use pam_fit::bench::Candidate;
use pam_report::symbols::symbols;
use pam_report::{effect_page, inline_markup};

/// Arguments of `host effects`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host effects\n  host effects mullins-softening\n  host effects mullins-softening --report mullins.html"
)]
pub struct Arguments {
    /// The effect to explain; without it all are listed.
    #[arg(value_name = "EFFECT")]
    effect: Option<String>,
    /// Write a page with a plot of the effect's trace.
    #[arg(long, value_name = "F.html", requires = "effect")]
    report: Option<PathBuf>,
    /// Write the book's chapters on all effects into a folder.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["effect", "json"])]
    book: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Runs the command.
    ///
    /// # Errors
    /// An effect that does not exist, or a file that cannot be written.
    pub fn run(self, console: &Console) -> Result<()> {
        if let Some(folder) = &self.book {
            return book(folder, console);
        }
        let Some(name) = &self.effect else {
            let mut all: Vec<Candidate> = Candidate::all().collect();
            all.sort_by_key(|c| (c.info().link, c.is_bench()));
            if self.json {
                let effects = all.iter().map(|c| to_document(*c)).collect();
                console.result(text(&document::Effects { schema: "pam-effects/1", effects })?);
            } else {
                console.result(list(&all));
            }
            return Ok(());
        };
        let candidate = by_name(name)?;
        let taken =
            to_standard_output(&[("--json", printed(self.json)), ("--report", self.report.as_deref())])?;
        if self.json {
            console.result(text(&to_document(candidate))?);
        } else if taken {
            console.note(explain(candidate));
        } else {
            console.result(explain(candidate));
        }
        if let Some(path) = &self.report {
            let all = catalogue()?;
            if let Some((trace, figure)) = all.iter().find(|(t, _)| t.candidate == candidate) {
                write_whole(path, in_page(effect_page::page(trace, figure, &all).html()).as_bytes())?;
                console.note(format!("wrote {}", path.display()));
            }
        }
        Ok(())
    }
}

fn catalogue() -> Result<Vec<(pam_report::effect_trace::Trace, pam_report::Figure)>> {
    effect_page::catalogue().map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))
}

/// The effect of this name.
///
/// # Errors
/// An unknown name; the nearest is suggested.
pub(super) fn by_name(name: &str) -> Result<Candidate> {
    Candidate::from_name(name).ok_or_else(|| unknown(name))
}

fn unknown(name: &str) -> Error {
    let near = nearest(name, Candidate::all().map(Candidate::name));
    let help = near.map_or(String::new(), |n| format!("did you mean `{n}`? "));
    Error::new(DataCode::CallInvalid, "unknown effect")
        .value(name)
        .help(format!("{help}`host effects` lists all"))
}

fn list(all: &[Candidate]) -> String {
    let mut text = String::new();
    let mut link = None;
    for candidate in all {
        let info = candidate.info();
        if link != Some(info.link) {
            text += &format!("{}{}\n", if link.is_some() { "\n" } else { "" }, effect_page::place(info.link));
            link = Some(info.link);
        }
        let bench = if candidate.is_bench() { " (bench)" } else { "" };
        text += &format!("  {}{bench}\n      {}\n", info.name, info.summary);
    }
    text.trim_end().to_owned()
}

fn explain(candidate: Candidate) -> String {
    let info = candidate.info();
    let whose = if candidate.is_bench() {
        "error of the bench: corrects the recording, never sent to a controller"
    } else {
        "effect of the muscle: stored in the table and sent to the controller"
    };
    let mut text = format!(
        "{}\n  {}\n\n  acts on {}\n  {whose}\n\n  {}\n\n",
        info.name,
        info.summary,
        effect_page::place(info.link),
        inline_markup::plain(info.equation)
    );
    for p in info.parameters {
        let _ = writeln!(
            text,
            "{}",
            format!("  {:8} {:24} {} to {} {}", p.symbol, p.name, p.low, p.high, p.unit).trim_end()
        );
    }
    text.push('\n');
    for symbol in &symbols(info).rows {
        let _ = writeln!(text, "  {:8} {}", symbol[0], symbol[1]);
    }
    text + &format!("\n  source: {}", info.source)
}

fn to_document(candidate: Candidate) -> document::Effect {
    let info = candidate.info();
    document::Effect {
        schema: "pam-effect/1",
        effect: info.name,
        place: effect_page::place(info.link),
        bench: candidate.is_bench(),
        summary: info.summary,
        equation: info.equation,
        parameters: info
            .parameters
            .iter()
            .map(|p| document::Parameter {
                name: p.name,
                symbol: p.symbol,
                unit: p.unit,
                low: p.low,
                high: p.high,
                amplitude: p.role == model_core::effects::Role::Amplitude,
            })
            .collect(),
        symbols: symbols(info).rows.into_iter().map(|r| (r[0].clone(), r[1].clone())).collect(),
        source: info.source,
    }
}

fn book(folder: &std::path::Path, console: &Console) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::unwritable(folder, &e))?;
    let all = catalogue()?;
    write_whole(&folder.join("README.md"), effect_page::contents(&all).as_bytes())?;
    for (trace, figure) in &all {
        let name = trace.candidate.name();
        let chapter = effect_page::chapter(trace, figure, &all);
        write_whole(&folder.join(format!("{name}.md")), chapter.as_bytes())?;
        if trace.force.iter().any(|f| *f != 0.0) {
            write_whole(&folder.join(format!("{name}.svg")), figure.svg().as_bytes())?;
        }
    }
    console.note(format!("wrote {} chapters to {}", all.len(), folder.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_name_is_answered_with_the_one_that_was_meant() {
        let error = unknown("mulins-softning");
        assert_eq!(error.exit_status(), 2);
        assert!(error.advice().unwrap_or_default().contains("`mullins-softening`"));
    }
}
