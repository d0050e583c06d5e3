//! A report as plain values: what it says, in which order. [`Page::html`] and [`Page::markdown`] give it a form.

use super::figure::Figure;
use pam_data::pluralise::pluralise;
use pam_data::recording::Campaign;

/// How a fact or a notice is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Neither good nor bad.
    Plain,
    /// As required.
    Good,
    /// To be checked.
    Caution,
    /// Not as required.
    Bad,
}

/// One number of the summary header.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// What it is.
    pub label: String,
    /// The number with its unit, or a word.
    pub value: String,
    /// One short line on what it means; may be empty.
    pub note: String,
    /// How it is meant.
    pub tone: Tone,
}

/// A table of text; the first column names the row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Heads of the columns, with units.
    pub header: Vec<String>,
    /// Rows of cells.
    pub rows: Vec<Vec<String>>,
    /// Where the name of each row leads, as a relative address; rows beyond the end, or with an empty one, have no link.
    pub links: Vec<String>,
}

impl Table {
    /// An empty table.
    pub fn new(caption: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(|h| (*h).to_owned()).collect();
        Self { caption: caption.into(), header, rows: Vec::new(), links: Vec::new() }
    }

    /// With one more row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// With one more row, whose name leads to another file; an empty address is not a link.
    pub fn linked_row(
        &mut self,
        address: impl Into<String>,
        cells: impl IntoIterator<Item = impl Into<String>>,
    ) {
        self.links.resize(self.rows.len(), String::new());
        self.links.push(address.into());
        self.row(cells);
    }

    fn drop_empty_columns(&mut self) {
        for column in (1..self.header.len()).rev() {
            if self.rows.iter().all(|r| r.get(column).is_none_or(String::is_empty)) {
                self.header.remove(column);
                self.rows.iter_mut().filter(|r| column < r.len()).for_each(|r| drop(r.remove(column)));
            }
        }
    }
}

/// A part of a section. Texts may carry the mark-up of [`super::inline_markup`].
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A paragraph that stands out.
    Notice(Tone, String),
    /// A list with one bullet for each text.
    List(Vec<String>),
    /// A picture.
    Figure(Box<Figure>),
    /// A table.
    Table(Table),
    /// Something to copy: a command, a protocol file.
    Listing(String),
}

/// A chapter of a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// Whether the Markdown summary holds it, too.
    pub in_summary: bool,
    /// What it says.
    pub blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), in_summary: false, blocks: Vec::new() }
    }

    /// Also part of the Markdown summary.
    #[must_use]
    pub fn summarised(mut self) -> Self {
        self.in_summary = true;
        self
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// Adds a paragraph that stands out.
    pub fn notice(&mut self, tone: Tone, text: impl Into<String>) {
        self.blocks.push(Block::Notice(tone, text.into()));
    }

    /// Adds points; nothing where there are none.
    pub fn list(&mut self, points: impl IntoIterator<Item = impl Into<String>>) {
        let points: Vec<String> = points.into_iter().map(Into::into).collect();
        if !points.is_empty() {
            self.blocks.push(Block::List(points));
        }
    }

    /// Adds a picture.
    pub fn figure(&mut self, figure: Figure) {
        self.blocks.push(Block::Figure(Box::new(figure)));
    }

    /// Adds a table; nothing where it has no row. Columns in which no row says anything are left out.
    pub fn table(&mut self, mut table: Table) {
        if !table.rows.is_empty() {
            table.drop_empty_columns();
            self.blocks.push(Block::Table(table));
        }
    }

    /// Adds something to copy.
    pub fn listing(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Listing(text.into()));
    }
}

/// A whole report.
///
/// ```
/// use pam_report::{Axis, Colour, Figure, Page, Panel, Section, Tone};
///
/// let mut page = Page::new("Force tracking", "mini-1, sine of 0.5 Hz");
/// page.verdict(Tone::Good, "The fitted table tracks the force.");
/// page.fact("error", "0.8 %", "of blocked force, root mean square", Tone::Good);
/// let mut section = Section::new("Tracking");
/// let panel = Panel::new(Axis::new("time", "s"), Axis::new("force", "N"))
///     .line("wanted", Colour::Ink, &[0.0, 1.0], &[10.0, 20.0]);
/// section.figure(Figure::new("tracking", "Force over time", "The curves should coincide.", panel));
/// page.push(section);
///
/// let html = page.html();
/// assert!(html.starts_with("<!DOCTYPE html>"));
/// assert!(!html.contains("http://") || !html.contains("<link"), "nothing is loaded from elsewhere");
/// assert!(page.markdown().starts_with("# Force tracking\n"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// What it is about: the muscle, the recordings.
    pub subtitle: String,
    /// The one sentence that matters.
    pub verdict: Option<(Tone, String)>,
    /// The numbers that matter.
    pub facts: Vec<Fact>,
    /// Its chapters, in order.
    pub sections: Vec<Section>,
    /// Where it comes from: files, versions, hashes.
    pub origin: Vec<(String, String)>,
}

impl Page {
    /// An empty report.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            subtitle: subtitle.into(),
            verdict: None,
            facts: Vec::new(),
            sections: Vec::new(),
            origin: Vec::new(),
        }
    }

    /// Sets the sentence that stands first.
    pub fn verdict(&mut self, tone: Tone, text: impl Into<String>) {
        self.verdict = Some((tone, text.into()));
    }

    /// Adds a number to the summary header.
    pub fn fact(
        &mut self,
        label: impl Into<String>,
        value: impl Into<String>,
        note: impl Into<String>,
        tone: Tone,
    ) {
        self.facts.push(Fact { label: label.into(), value: value.into(), note: note.into(), tone });
    }

    /// Adds a chapter; nothing where it is empty.
    pub fn push(&mut self, section: Section) {
        if !section.blocks.is_empty() {
            self.sections.push(section);
        }
    }

    /// Adds a line on where the report comes from.
    pub fn origin(&mut self, what: impl Into<String>, value: impl Into<String>) {
        self.origin.push((what.into(), value.into()));
    }

    /// Adds a line for every recording that the report is made from.
    pub fn recordings(&mut self, campaign: &Campaign) {
        for recording in &campaign.recordings {
            self.origin(&recording.name, pluralise(recording.len(), "row"));
        }
    }

    /// All pictures, in order.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.sections.iter().flat_map(|s| &s.blocks).filter_map(|b| match b {
            Block::Figure(figure) => Some(figure.as_ref()),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_row_can_be_a_link() {
        let mut table = Table::new("", &["muscle", "P0"]);
        table.row(["a", "1"]);
        table.linked_row("results/muscle=b/fit.html?\"x", ["b", "2"]);
        let mut section = Section::new("x");
        section.table(table);
        let mut page = Page::new("t", "");
        page.push(section);
        let html = page.html();
        assert!(html.contains("<a href=\"results/muscle=b/fit.html?&quot;x\">b</a>"), "{html}");
        assert_eq!(html.matches("<a href=\"results").count(), 1);
    }

    #[test]
    fn an_empty_column_is_not_shown() {
        let mut table = Table::new("", &["name", "remark", "value", "more"]);
        table.row(["a", "", "1", ""]);
        table.row(["b", "", "", ""]);
        let mut section = Section::new("x");
        section.table(table);
        let Block::Table(kept) = &section.blocks[0] else { panic!("a table") };
        assert_eq!(kept.header, ["name", "value"]);
        assert_eq!(kept.rows, [["a", "1"], ["b", ""]]);
    }
}
