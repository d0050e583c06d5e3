//! The canvas that pictures are drawn on: coordinates and text.

use std::fmt::Write as _;

use super::colour::Colour;
use super::inline_markup;

/// Size of the text on ticks and in legends, px.
pub(crate) const FONT_SIZE: f64 = 12.0;

/// A coordinate, to a tenth of a pixel.
pub(crate) fn px(value: f64) -> String {
    let tenths = (value * 10.0).round() as i64;
    if tenths % 10 == 0 { format!("{}", tenths / 10) } else { format!("{:.1}", tenths as f64 / 10.0) }
}

/// Where a panel's numbers lie on the paper.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub x_ends: (f64, f64),
    pub y_ends: (f64, f64),
    pub x_log: bool,
    pub y_log: bool,
    /// Names run from the top down, numbers from the bottom up.
    pub y_down: bool,
}

fn fraction(value: f64, ends: (f64, f64), log: bool) -> f64 {
    if log {
        if value > 0.0 { (value / ends.0).ln() / (ends.1 / ends.0).ln() } else { f64::NAN }
    } else {
        (value - ends.0) / (ends.1 - ends.0)
    }
}

impl Frame {
    pub(crate) fn x(&self, value: f64) -> f64 {
        self.left + self.width * fraction(value, self.x_ends, self.x_log)
    }

    pub(crate) fn y(&self, value: f64) -> f64 {
        let up = fraction(value, self.y_ends, self.y_log);
        self.top + self.height * if self.y_down { up } else { 1.0 - up }
    }

    /// The height of zero, or of the bottom where zero is not shown.
    pub(crate) fn base(&self) -> f64 {
        if self.y_log { self.top + self.height } else { self.y(0.0_f64.clamp(self.y_ends.0, self.y_ends.1)) }
    }
}

/// A text element. `anchor` is `start`, `middle` or `end`.
pub(crate) fn text(
    out: &mut String,
    x: f64,
    y: f64,
    anchor: &str,
    colour: Colour,
    extra: &str,
    content: &str,
) {
    let _ = write!(
        out,
        "<text x=\"{}\" y=\"{}\"{} class=\"F {}\" fill=\"{}\"{extra}>{}</text>",
        px(x),
        px(y),
        if anchor == "start" { String::new() } else { format!(" text-anchor=\"{anchor}\"") },
        colour.class(),
        colour.literal(),
        inline_markup::svg(content)
    );
}
