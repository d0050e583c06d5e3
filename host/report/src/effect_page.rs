//! One effect explained: for the terminal, as a page, and as a chapter of the book.

use std::fmt::Write as _;

use model_core::effects::{Info, Link, Role, Start};
use model_core::table::TableError;

use super::effect_trace::{Demonstration, Trace, likeness};
use super::symbols::symbols;
use super::{Page, Section, Table, significant};
use pam_fit::bench::Candidate;

/// Description of where an effect acts in the chain from the air to the reading.
#[must_use]
pub fn place(link: Link) -> &'static str {
    match link {
        Link::Air => "the air: the pressure at the muscle",
        Link::Braid => "the braid and the muscle's shape",
        Link::Bladder => "the bladder's elastic stress",
        Link::Memory => "the bladder's memory of the past",
        Link::Friction => "friction",
        Link::LoadPath => "the load path between muscle and load cell",
        Link::Reading => "the reading of the sensors",
    }
}

/// Every effect with its trace, in the order of the chain.
///
/// # Errors
/// None in practice: the example table is valid.
pub fn catalogue() -> Result<Vec<(Trace, super::Figure)>, TableError> {
    let demonstration = Demonstration::new()?;
    let mut all: Vec<Candidate> = Candidate::all().collect();
    all.sort_by_key(|c| (c.info().link, c.is_bench()));
    Ok(all
        .into_iter()
        .map(|c| {
            let trace = demonstration.run(c);
            let figure = demonstration.figure(&trace);
            (trace, figure)
        })
        .collect())
}

/// The three traces that look most like this one, with their likeness.
#[must_use]
pub(crate) fn lookalikes<'a>(trace: &Trace, all: &'a [(Trace, super::Figure)]) -> Vec<(&'a Trace, f64)> {
    let mut others: Vec<(&Trace, f64)> = all
        .iter()
        .map(|(other, _)| other)
        .filter(|other| other.candidate != trace.candidate)
        .map(|other| (other, likeness(trace, other)))
        .collect();
    others.sort_by(|a, b| b.1.total_cmp(&a.1));
    others.truncate(3);
    others
}

fn whose(candidate: Candidate) -> &'static str {
    if candidate.is_bench() {
        "It is an error of the bench: it corrects the recording and is never sent to a controller."
    } else {
        "It belongs to the muscle: it is stored in the table and sent to the controller."
    }
}

fn memory(info: &Info) -> &'static str {
    match info.start {
        Start::Known => "Its state at the beginning of a recording is known.",
        Start::Settled => {
            "It has a memory that decays. A recording that begins soon after other motion starts in an unknown state."
        }
        Start::Branch => "It remembers the last reversal; after one full stroke its state is known.",
        Start::Virgin => {
            "It has a permanent memory: the state of a muscle that was used before the recording is unknown."
        }
    }
}

fn parameters(trace: &Trace) -> Table {
    let mut table = Table::new(
        "Parameters in SI units, their published range, and the value in the picture",
        &["symbol", "parameter", "unit", "from", "to", "in the picture", "role"],
    );
    for (p, value) in trace.candidate.info().parameters.iter().zip(&trace.parameters) {
        let role = match p.role {
            Role::Amplitude => "scales the force",
            Role::Shape => "shapes the force",
        };
        let unit = if p.unit.is_empty() { "–" } else { p.unit };
        let numbers = [p.low, p.high, *value].map(|v| significant(v, 2));
        table.row([p.symbol, p.name, unit, &numbers[0], &numbers[1], &numbers[2], role]);
    }
    table
}

/// One effect as a page, from the [`catalogue`].
#[must_use]
pub fn page(trace: &Trace, figure: &super::Figure, all: &[(Trace, super::Figure)]) -> Page {
    let info = trace.candidate.info();
    let mut page = Page::new(info.name, info.summary);
    let mut what = Section::new("Definition").summarised();
    what.text(format!("It acts on {}. {}", place(info.link), whose(trace.candidate)));
    what.listing(info.equation);
    what.table(symbols(info));
    what.table(parameters(trace));
    what.text(memory(info));
    page.push(what);
    let mut trace_section = Section::new("Trace").summarised();
    if trace.force.iter().all(|f| *f == 0.0) {
        trace_section.text("The demonstration does not excite it: its force is zero here.");
    } else {
        trace_section.figure(figure.clone());
        trace_section.text(alike(trace, all));
    }
    page.push(trace_section);
    page.origin("source of the equation", info.source);
    page
}

fn alike(trace: &Trace, all: &[(Trace, super::Figure)]) -> String {
    let names: Vec<String> = lookalikes(trace, all)
        .iter()
        .map(|(other, likeness)| format!("`{}` ({likeness:.2})", other.candidate.name()))
        .collect();
    format!(
        "After a refit of the base model its trace is most similar to {} on this demonstration. At 1 the two are not distinguishable from \
         this recording.",
        names.join(", ")
    )
}

/// One effect as a chapter of the book, beside its picture `NAME.svg`.
#[must_use]
pub fn chapter(trace: &Trace, figure: &super::Figure, all: &[(Trace, super::Figure)]) -> String {
    let info = trace.candidate.info();
    let mut text = format!(
        "# {}\n\n{}\n\nIt acts on {}. {}\n\n```text,equation\n{}\n```\n\n",
        info.name,
        info.summary,
        place(info.link),
        whose(trace.candidate),
        info.equation
    );
    for table in [symbols(info), parameters(trace)] {
        let _ = writeln!(text, "{}:\n", table.caption);
        let _ = writeln!(text, "| {} |", table.header.join(" | "));
        let _ = writeln!(text, "|{}", " --- |".repeat(table.header.len()));
        for row in &table.rows {
            let cells: Vec<String> = row.iter().map(|c| super::inline_markup::markdown(c)).collect();
            let _ = writeln!(text, "| {} |", cells.join(" | "));
        }
        text.push('\n');
    }
    let _ = write!(text, "{}\n\n", memory(info));
    if trace.force.iter().all(|f| *f == 0.0) {
        text.push_str("The demonstration does not excite it: its force is zero there.\n");
    } else {
        let _ = write!(text, "![{}]({}.svg)\n\n", figure.title, info.name);
        let _ = write!(text, "{}\n\n{}\n", figure.reading, alike(trace, all));
    }
    let _ = write!(text, "\nSource: {}\n", super::inline_markup::markdown(info.source));
    text
}

/// The book's table of all effects.
#[must_use]
pub fn contents(all: &[(Trace, super::Figure)]) -> String {
    let mut text = String::from(
        "# Library of effects\n\n\
         Every effect that `host diagnose` can identify, in the order of the chain from the air to the reading. Each has a page with its \
         equation, its parameters and a picture of its trace. These pages are written by `host effects --book`.\n",
    );
    let mut link = None;
    for (trace, _) in all {
        let info = trace.candidate.info();
        if link != Some(info.link) {
            link = Some(info.link);
            let mut title = place(info.link).to_owned();
            title[..1].make_ascii_uppercase();
            let _ = write!(text, "\n## {title}\n\n| effect | of | in one sentence |\n| --- | --- | --- |\n");
        }
        let whose = if trace.candidate.is_bench() { "bench" } else { "muscle" };
        let _ = writeln!(
            text,
            "| [{0}]({0}.md) | {whose} | {1} |",
            info.name,
            super::inline_markup::markdown(info.summary)
        );
    }
    text
}
