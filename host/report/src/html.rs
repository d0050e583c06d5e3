//! A report as one HTML file: no other file, no network, readable without scripts.
//!
//! The script saves a picture or its numbers to a file, shows the values under the pointer, and hides layers whose name in the legend is
//! clicked. It needs nothing that is not in the page already.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::figure::Figure;
use super::inline_markup;
use super::page::{Block, Page, Section, Table, Tone};
use super::svg::{self, Layout};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = concat!(include_str!("page.js"), include_str!("reading.js"));

impl Page {
    /// The report as one HTML file that needs no other.
    #[must_use]
    pub fn html(&self) -> String {
        file(self)
    }
}

fn file(page: &Page) -> String {
    let contents = page.sections.len() > 3;
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (inline_markup::plain(&page.title)) " · " (inline_markup::plain(&page.subtitle)) }
                style id="figure-style" { (PreEscaped(svg::page_style())) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (inline_markup::html(&page.title)) }
                    @if !page.subtitle.is_empty() { p.subtitle { (inline_markup::html(&page.subtitle)) } }
                    @if let Some((tone, verdict)) = &page.verdict {
                        p class={ "verdict " (class(*tone)) } { (inline_markup::html(verdict)) }
                    }
                    @if !page.facts.is_empty() {
                        dl.facts {
                            @for fact in &page.facts {
                                div class=(class(fact.tone)) {
                                    dt { (inline_markup::html(&fact.label)) }
                                    dd.value { (inline_markup::html(&fact.value)) }
                                    @if !fact.note.is_empty() { dd.note { (inline_markup::html(&fact.note)) } }
                                }
                            }
                        }
                    }
                    @if contents {
                        nav aria-label="Contents" {
                            @for (i, section) in page.sections.iter().enumerate() {
                                a href={ "#part-" (i + 1) } { (inline_markup::html(&section.title)) }
                            }
                        }
                    }
                }
                main {
                    @for (i, one) in page.sections.iter().enumerate() { (section(i + 1, one)) }
                }
                @if !page.origin.is_empty() {
                    footer {
                        h2 { "Provenance" }
                        dl {
                            @for (what, value) in &page.origin {
                                dt { (inline_markup::html(what)) }
                                dd { (inline_markup::html(value)) }
                            }
                        }
                    }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    markup.into_string()
}

fn class(tone: Tone) -> &'static str {
    match tone {
        Tone::Plain => "plain",
        Tone::Good => "good",
        Tone::Caution => "caution",
        Tone::Bad => "bad",
    }
}

fn section(number: usize, section: &Section) -> Markup {
    html! {
        section id={ "part-" (number) } {
            h2 { (inline_markup::html(&section.title)) }
            @for block in &section.blocks {
                @match block {
                    Block::Text(text) => p { (inline_markup::html(text)) },
                    Block::Notice(tone, text) => p class={ "notice " (class(*tone)) } { (inline_markup::html(text)) },
                    Block::List(points) => ul { @for point in points { li { (inline_markup::html(point)) } } },
                    Block::Figure(one) => (figure(one)),
                    Block::Table(one) => (table(one)),
                    // By keyboard, too, what is longer than its window can be scrolled.
                    Block::Listing(text) => pre tabindex="0" { code { (text) } },
                }
            }
        }
    }
}

fn figure(figure: &Figure) -> Markup {
    let numbers = in_script(&figure.csv());
    html! {
        figure id=(figure.id) {
            h3 { (inline_markup::html(&figure.title)) }
            div.wide { (PreEscaped(svg::inline(figure, Layout::Wide))) }
            div.narrow { (PreEscaped(svg::inline(figure, Layout::Narrow))) }
            figcaption {
                (inline_markup::html(&figure.reading))
                span.save hidden {
                    button type="button" data-save="svg" aria-label={ "Save the picture " (figure.id) " as SVG" } { "SVG" }
                    button type="button" data-save="csv" aria-label={ "Save the numbers of " (figure.id) " as CSV" } { "CSV" }
                }
            }
            script type="text/csv" { (PreEscaped(numbers)) }
        }
    }
}

/// Text for a script element, in which a browser looks for `</script`, `<script` and `<!--` wherever they stand, and replaces no
/// entities: the page's script does that when it saves the text.
fn in_script(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// Whether a cell is a number, which is set to the right.
fn numeric(cell: &str) -> bool {
    cell.chars().next().is_some_and(|c| c.is_ascii_digit() || matches!(c, '−' | '-' | '+' | '±' | '–' | '<'))
}

fn table(table: &Table) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label=(inline_markup::plain(&table.caption)) {
            table class=[has_text(table).then_some("text")] {
                @if !table.caption.is_empty() { caption { (inline_markup::html(&table.caption)) } }
                thead {
                    tr {
                        @for (i, header) in table.header.iter().enumerate() {
                            th scope="col" class=[right(table, i)] { (inline_markup::html(header)) }
                        }
                    }
                }
                tbody {
                    @for (line, row) in table.rows.iter().enumerate() {
                        tr {
                            @for (i, cell) in row.iter().enumerate() {
                                @if i == 0 {
                                    th scope="row" class=[right(table, i)] {
                                        @match table.links.get(line).filter(|l| !l.is_empty()) {
                                            Some(address) => a href=(address) { (inline_markup::html(cell)) },
                                            None => (inline_markup::html(cell)),
                                        }
                                    }
                                } @else {
                                    td class=[right(table, i)] data-label=(inline_markup::plain(label(table, i))) {
                                        (inline_markup::html(cell))
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// From this length on a cell is text, in characters.
const TEXT: usize = 40;

/// Whether a table has cells of text. On a narrow screen its rows stand as blocks: beside other columns text would be a word wide.
fn has_text(table: &Table) -> bool {
    table.rows.iter().flatten().any(|cell| cell.chars().count() >= TEXT)
}

fn label(table: &Table, column: usize) -> &str {
    table.header.get(column).map_or("", String::as_str)
}

/// Columns of numbers are set to the right, heads included.
fn right(table: &Table, column: usize) -> Option<&'static str> {
    let mut cells = table.rows.iter().filter_map(|r| r.get(column)).filter(|c| !c.is_empty()).peekable();
    (cells.peek().is_some() && cells.all(|c| numeric(c))).then_some("number")
}

#[cfg(test)]
mod tests {
    use super::in_script;

    #[test]
    fn no_name_in_the_numbers_reaches_the_browser_as_markup() {
        let name = "a<!--<script>.csv,</SCRIPT >,&lt;,1<2\n";
        let text = in_script(name);
        assert!(!text.contains('<'), "{text}");
        // As the page's script takes it back.
        assert_eq!(text.replace("&lt;", "<").replace("&amp;", "&"), name);
    }
}
