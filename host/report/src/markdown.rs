//! A report's summary as Markdown.

use std::fmt::Write as _;

use super::inline_markup;
use super::page::{Block, Page, Table, Tone};

impl Page {
    /// The summary as Markdown, for pasting.
    #[must_use]
    pub fn markdown(&self) -> String {
        summary(self)
    }
}

/// Title, verdict, facts, and the sections marked for the summary; pictures become one line.
fn summary(page: &Page) -> String {
    let mut out = format!("# {}\n", inline_markup::markdown(&page.title));
    if !page.subtitle.is_empty() {
        let _ = write!(out, "\n{}\n", inline_markup::markdown(&page.subtitle));
    }
    if let Some((_, verdict)) = &page.verdict {
        let _ = write!(out, "\n**{}**\n", inline_markup::markdown(verdict));
    }
    if !page.facts.is_empty() {
        out.push_str("\n| | | |\n| --- | --- | --- |\n");
        for fact in &page.facts {
            let cells = [&fact.label, &fact.value, &fact.note].map(|t| inline_markup::markdown(t));
            let _ = writeln!(out, "| {} | {} | {} |", cells[0], cells[1], cells[2]);
        }
    }
    for section in page.sections.iter().filter(|s| s.in_summary) {
        let _ = write!(out, "\n## {}\n", inline_markup::markdown(&section.title));
        for block in &section.blocks {
            out.push('\n');
            match block {
                Block::Text(text) => {
                    let _ = writeln!(out, "{}", inline_markup::markdown(text));
                }
                Block::Notice(tone, text) => {
                    let word = match tone {
                        Tone::Plain | Tone::Good => "Note",
                        Tone::Caution => "Caution",
                        Tone::Bad => "Wrong",
                    };
                    let _ = writeln!(out, "> **{word}:** {}", inline_markup::markdown(text));
                }
                Block::List(points) => {
                    for point in points {
                        let _ = writeln!(out, "- {}", inline_markup::markdown(point));
                    }
                }
                Block::Figure(figure) => {
                    let _ = writeln!(
                        out,
                        "*Picture:* {} (`{}.svg`)",
                        inline_markup::markdown(&figure.title),
                        figure.id
                    );
                }
                Block::Table(one) => table(&mut out, one),
                Block::Listing(text) => {
                    let _ = writeln!(out, "```text\n{}\n```", text.trim_end().replace("```", "'''"));
                }
            }
        }
    }
    out
}

fn table(out: &mut String, table: &Table) {
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|c| inline_markup::markdown(c)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    out.push_str(&line(&table.header));
    out.push('|');
    for i in 0..table.header.len() {
        out.push_str(if i == 0 { " --- |" } else { " ---: |" });
    }
    out.push('\n');
    for row in &table.rows {
        out.push_str(&line(row));
    }
}

#[cfg(test)]
mod tests {
    use super::super::page::{Page, Section};
    use super::*;

    #[test]
    fn the_summary_holds_what_is_marked_for_it() {
        let mut report = Page::new("Fit of a|b", "two recordings");
        report.verdict(Tone::Good, "The table describes the recordings.");
        report.fact("mean error", "0.18 %", "of blocked force", Tone::Good);
        let mut section = Section::new("Pressures").summarised();
        let mut rows = Table::new("", &["P (kPa)", "E_{1} (MPa)"]);
        rows.row(["207", "2.1"]);
        section.table(rows);
        section.notice(Tone::Caution, "few samples");
        report.push(section);
        let mut hidden = Section::new("Residuals");
        hidden.text("not in the summary");
        report.push(hidden);
        insta::assert_snapshot!(report.markdown());
    }
}
