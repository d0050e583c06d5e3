//! Drawing a [`Figure`] as SVG: deterministic text, no fonts, no scripts, no outside resources.
//!
//! Every picture has two layouts, one for a page and one for a phone, since text must not shrink with the screen.
//! The legend is above the panels, where no data can be.

use std::fmt::Write as _;

use super::axis::{Scale, Tick, linear_ticks, log_ticks, whole_ticks};
use super::canvas::{FONT_SIZE, Frame, px, text};
use super::colour::{self, Colour};
use super::figure::{Figure, Panel};
use super::inline_markup;
use super::legend;
use super::marks;

/// The width for which a picture is designed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Layout {
    /// A page: 760 px.
    Wide,
    /// A phone: 360 px.
    Narrow,
}

impl Layout {
    pub(crate) fn width(self) -> f64 {
        match self {
            Self::Wide => 760.0,
            Self::Narrow => 360.0,
        }
    }

    fn columns(self, panels: usize) -> usize {
        match (self, panels) {
            (_, 0 | 1) | (Self::Narrow, _) => 1,
            (Self::Wide, 2 | 4) => 2,
            (Self::Wide, _) => 3,
        }
    }
}

impl Figure {
    /// The picture as a file of its own, wide enough for a page.
    #[must_use]
    pub fn svg(&self) -> String {
        let style = format!("<style>{}{TEXT_STYLE}</style>", colour::style_sheet());
        draw(self, Layout::Wide, Some(&style))
    }
}

/// The picture as part of a page that carries [`page_style`].
pub(crate) fn inline(figure: &Figure, layout: Layout) -> String {
    draw(figure, layout, None)
}

/// What a page needs once for all its pictures.
pub(crate) fn page_style() -> String {
    format!("{}{TEXT_STYLE}", colour::style_sheet())
}

const TEXT_STYLE: &str = "svg.fig text{font-family:system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,\
sans-serif}svg.fig text{font-variant-numeric:tabular-nums}.paper{fill:var(--paper)}.grid{stroke:var(--grid)}\
.axis{stroke:var(--axis)}\n";

fn ends(figure: &Figure, vertical: bool) -> Vec<(f64, f64)> {
    let axis = |p: &Panel| if vertical { p.y.clone() } else { p.x.clone() };
    let shared = if vertical { figure.share_y } else { figure.share_x };
    if shared {
        let all = figure
            .panels
            .iter()
            .filter_map(|p| p.extent(vertical))
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        figure.panels.iter().map(|p| axis(p).ends(all)).collect()
    } else {
        figure.panels.iter().map(|p| axis(p).ends(p.extent(vertical))).collect()
    }
}

fn ticks(axis: &super::axis::Axis, ends: (f64, f64), wanted: usize) -> Vec<Tick> {
    match &axis.scale {
        Scale::Linear => linear_ticks(ends.0, ends.1, wanted),
        Scale::Whole => whole_ticks(ends.0, ends.1, wanted),
        Scale::Log => log_ticks(ends.0, ends.1, wanted),
        Scale::Names(names) => {
            names.iter().enumerate().map(|(i, name)| Tick { at: i as f64, text: name.clone() }).collect()
        }
    }
}

fn draw(figure: &Figure, layout: Layout, style: Option<&str>) -> String {
    let width = layout.width();
    let columns = layout.columns(figure.panels.len());
    let rows = figure.panels.len().div_ceil(columns);
    let gap = 22.0;
    let cell_width = (width - gap * (columns as f64 - 1.0)) / columns as f64;
    // A page's script reads values and hides layers; a file of its own has no script.
    let interactive = style.is_none();
    let (legend, legend_height) = legend::draw(figure, width, interactive);
    let suffix = if layout == Layout::Narrow { "n" } else { "w" };
    let id = format!("{}-{suffix}", figure.id);
    let (x_ends, y_ends) = (ends(figure, false), ends(figure, true));

    let mut body = String::new();
    let mut top = legend_height;
    for row in 0..rows {
        let range = row * columns..((row + 1) * columns).min(figure.panels.len());
        let mut tallest: f64 = 0.0;
        for i in range {
            let left = (i % columns) as f64 * (cell_width + gap);
            let clip = format!("{id}-{i}");
            let place = (left, top, cell_width);
            let ends = (x_ends[i], y_ends[i]);
            let height = panel(&mut body, &figure.panels[i], place, ends, &clip, (columns > 1, interactive));
            tallest = tallest.max(height);
        }
        top += tallest + if row + 1 < rows { 14.0 } else { 0.0 };
    }
    let height = top.ceil();
    // A file of its own has a margin; on a page the page gives it.
    let margin = if style.is_some() { 12.0 } else { 0.0 };
    let mut out = String::with_capacity(body.len() + 2_048);
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"fig\" viewBox=\"{0} {0} {1} {2}\" role=\"img\" \
         aria-labelledby=\"{id}-t {id}-d\" font-family=\"sans-serif\" font-size=\"{FONT_SIZE}\" fill=\"none\"",
        px(-margin),
        px(width + 2.0 * margin),
        px(height + 2.0 * margin)
    );
    if style.is_some() {
        let _ =
            write!(out, " width=\"{}\" height=\"{}\"", px(width + 2.0 * margin), px(height + 2.0 * margin));
    }
    let _ = write!(
        out,
        "><title id=\"{id}-t\">{}</title><desc id=\"{id}-d\">{}</desc>",
        inline_markup::escape(&inline_markup::plain(&figure.title)),
        inline_markup::escape(&figure.description())
    );
    if let Some(style) = style {
        let _ = write!(
            out,
            "{style}<rect class=\"paper\" x=\"{0}\" y=\"{0}\" width=\"{1}\" height=\"{2}\" fill=\"#ffffff\"/>",
            px(-margin),
            px(width + 2.0 * margin),
            px(height + 2.0 * margin)
        );
    }
    out.push_str(&legend);
    out.push_str(&body);
    out.push_str("</svg>");
    out
}

/// Draws one panel at `place` (left, top, width) and returns its height.
fn panel(
    out: &mut String,
    panel: &Panel,
    place: (f64, f64, f64),
    (x_ends, y_ends): ((f64, f64), (f64, f64)),
    clip: &str,
    (small, interactive): (bool, bool),
) -> f64 {
    let (left, top, cell_width) = place;
    let named_rows = if let Scale::Names(names) = &panel.y.scale { names.len() } else { 0 };
    let height = match (named_rows, small, cell_width < 500.0) {
        (1.., _, _) => 24.0 * named_rows as f64 + 8.0,
        (_, true, _) => (cell_width * 0.68).max(150.0),
        (_, _, true) => cell_width * 0.72,
        _ => 330.0,
    };
    let y_ticks = ticks(&panel.y, y_ends, (height / 48.0) as usize);
    let widest = y_ticks.iter().map(|t| inline_markup::width(&t.text)).fold(0.0, f64::max) * FONT_SIZE;
    let margin = (widest + 9.0).clamp(26.0, cell_width * 0.5);
    let mut header_height = 0.0;
    if !panel.title.is_empty() {
        text(out, left, top + 14.0, "start", Colour::Ink, " font-weight=\"600\"", &panel.title);
        header_height += 20.0;
    }
    if named_rows == 0 {
        text(out, left, top + header_height + 13.0, "start", Colour::Ink, "", &panel.y.title());
        header_height += 20.0;
    }
    let frame = Frame {
        left: left + margin,
        top: top + header_height + 2.0,
        width: (cell_width - margin - 8.0).max(20.0),
        height,
        x_ends,
        y_ends,
        x_log: panel.x.scale == Scale::Log,
        y_log: panel.y.scale == Scale::Log,
        y_down: named_rows > 0,
    };
    let below = axes(out, panel, &frame, &y_ticks);
    let _ = write!(
        out,
        "<clipPath id=\"{clip}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath><g clip-path=\"url(#{clip})\">",
        px(frame.left - 1.0),
        px(frame.top - 4.0),
        px(frame.width + 5.0),
        px(frame.height + 5.0)
    );
    for stage in 0..3 {
        for layer in panel.layers.iter().filter(|l| marks::stage(&l.mark) == stage) {
            let group = interactive && !layer.name.is_empty();
            if group {
                let _ = write!(out, "<g class=\"layer\" data-layer=\"{}\">", attribute(&layer.name));
            }
            marks::draw(out, layer, &frame);
            if group {
                out.push_str("</g>");
            }
        }
    }
    out.push_str("</g>");
    if interactive {
        sensitive(out, panel, &frame);
    }
    frame.top + frame.height + below - top
}

/// Mark-up as the value of an attribute, without formatting.
pub(crate) fn attribute(text: &str) -> String {
    inline_markup::escape(&inline_markup::plain(text)).replace('"', "&quot;")
}

/// The part of a panel where a page's script reads values, with what it needs to turn pixels into numbers. Panels whose axes have names
/// instead of numbers have their values written beside them.
fn sensitive(out: &mut String, panel: &Panel, frame: &Frame) {
    if frame.y_down || matches!(panel.x.scale, Scale::Names(_)) {
        return;
    }
    let _ = write!(
        out,
        "<rect class=\"read\" fill=\"none\" pointer-events=\"all\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" data-x=\"{} {}\" data-y=\"{} {}\" \
         data-log=\"{}{}\" data-panel=\"{}\" data-x-title=\"{}\" data-y-title=\"{}\"/>",
        px(frame.left),
        px(frame.top),
        px(frame.width),
        px(frame.height),
        frame.x_ends.0,
        frame.x_ends.1,
        frame.y_ends.0,
        frame.y_ends.1,
        if frame.x_log { "x" } else { "" },
        if frame.y_log { "y" } else { "" },
        attribute(&panel.title),
        attribute(&panel.x.title()),
        attribute(&panel.y.title()),
    );
}

/// Draws grid, ticks and axis titles; returns how much room they take below the frame.
fn axes(out: &mut String, panel: &Panel, frame: &Frame, y_ticks: &[Tick]) -> f64 {
    let (right, bottom) = (frame.left + frame.width, frame.top + frame.height);
    let named = matches!(panel.x.scale, Scale::Names(_));
    let mut wanted = ((frame.width / 64.0) as usize).max(2);
    let mut x_ticks = ticks(&panel.x, frame.x_ends, wanted);
    let crowded = |ticks: &[Tick]| {
        let written = || ticks.iter().filter(|t| !t.text.is_empty());
        written().zip(written().skip(1)).any(|(a, b)| {
            let room = frame.x(b.at) - frame.x(a.at);
            0.5 * (inline_markup::width(&a.text) + inline_markup::width(&b.text)) * FONT_SIZE + 8.0 > room
        })
    };
    while !named && wanted > 2 && crowded(&x_ticks) {
        wanted -= 1;
        x_ticks = ticks(&panel.x, frame.x_ends, wanted);
    }
    let mut grid = String::new();
    for tick in y_ticks.iter().filter(|t| !t.text.is_empty() && !frame.y_down) {
        let y = px(frame.y(tick.at));
        let _ = write!(grid, "M{} {y}H{}", px(frame.left), px(right));
    }
    for tick in x_ticks.iter().filter(|t| !t.text.is_empty() && !named) {
        let _ = write!(grid, "M{} {}V{}", px(frame.x(tick.at)), px(frame.top), px(bottom));
    }
    let _ = write!(out, "<path class=\"grid\" stroke=\"#e6e9ee\" d=\"{grid}\"/>");
    let base = if frame.y_down { bottom } else { frame.base() };
    let mut lines = format!("M{} {}H{}", px(frame.left), px(bottom), px(right));
    if base < bottom - 0.5 {
        let _ = write!(lines, "M{} {}H{}", px(frame.left), px(base), px(right));
    }
    if frame.y_down && frame.x_ends.0 <= 0.0 && !frame.x_log && !named {
        let zero = px(frame.x(0.0));
        let _ = write!(lines, "M{zero} {}V{}", px(frame.top), px(bottom));
    }
    for tick in x_ticks.iter().filter(|_| !named) {
        let length = if tick.text.is_empty() { 3.0 } else { 5.0 };
        let _ = write!(lines, "M{} {}v{}", px(frame.x(tick.at)), px(bottom), px(length));
    }
    for tick in y_ticks.iter().filter(|t| t.text.is_empty()) {
        let _ = write!(lines, "M{} {}h-3", px(frame.left), px(frame.y(tick.at)));
    }
    let _ = write!(out, "<path class=\"axis\" stroke=\"#9aa2b1\" d=\"{lines}\"/>");
    for tick in y_ticks.iter().filter(|t| !t.text.is_empty()) {
        let y = frame.y(tick.at) + 4.0;
        text(out, frame.left - 7.0, y, "end", Colour::Ink, " opacity=\".82\"", &shortened(tick, frame.left));
    }
    let room = frame.width / x_ticks.len().max(1) as f64;
    let widest = x_ticks.iter().map(|t| inline_markup::width(&t.text)).fold(0.0, f64::max) * FONT_SIZE;
    let slanted = named && widest > room - 6.0;
    for tick in x_ticks.iter().filter(|t| !t.text.is_empty()) {
        let x = frame.x(tick.at);
        if slanted {
            let y = bottom + 13.0;
            let turn = format!(" transform=\"rotate(-35 {} {})\" opacity=\".82\"", px(x + 3.0), px(y));
            text(out, x + 3.0, y, "end", Colour::Ink, &turn, &tick.text);
        } else {
            text(out, x, bottom + 18.0, "middle", Colour::Ink, " opacity=\".82\"", &tick.text);
        }
    }
    let mut below = if slanted { 20.0 + 0.58 * widest } else { 24.0 };
    let title = panel.x.title();
    if !title.is_empty() {
        // A title that is wider than its frame grows to the left: on the right the paper ends.
        let half = 0.5 * inline_markup::width(&title) * FONT_SIZE;
        let middle = (frame.left + frame.width / 2.0).min(right + 8.0 - half).max(half);
        text(out, middle, bottom + below + 13.0, "middle", Colour::Ink, "", &title);
        below += 20.0;
    }
    below
}

/// A name that would run off the paper is cut; its whole form is in the numbers.
fn shortened(tick: &Tick, room: f64) -> String {
    let fits = |text: &str| inline_markup::width(text) * FONT_SIZE <= room.max(40.0) - 6.0;
    if fits(&tick.text) {
        return tick.text.clone();
    }
    let mut text = inline_markup::plain(&tick.text);
    while !text.is_empty() && !fits(&format!("{text}…")) {
        text.pop();
    }
    format!("{text}…")
}
