//! The legend: rows above the panels, as many as it takes.

use std::fmt::Write as _;

use super::axis::significant;
use super::canvas::{FONT_SIZE, px, text};
use super::colour::Colour;
use super::figure::{Figure, Layer, Mark, Style};
use super::inline_markup;
use super::marks;
use super::svg::attribute;

const ROW: f64 = 20.0;
const SWATCH: f64 = 22.0;

/// The legend and the height it takes; empty where there is nothing to distinguish.
///
/// Where the picture is interactive, each entry is a group that a page's script makes a button of.
pub(crate) fn draw(figure: &Figure, width: f64, interactive: bool) -> (String, f64) {
    let mut out = String::new();
    let (mut x, mut y) = (0.0, 0.0);
    let layers = figure.legend();
    let heats = figure.panels.iter().flat_map(|p| &p.layers).filter_map(|l| match &l.mark {
        Mark::Heat { values, label, .. } => Some((values, label)),
        _ => None,
    });
    let heats: Vec<_> = heats.collect();
    let shown: Vec<&&Layer> = layers.iter().filter(|l| !matches!(l.mark, Mark::Heat { .. })).collect();
    let mut room = |needed: f64| {
        if x > 0.0 && x + needed > width {
            (x, y) = (0.0, y + ROW);
        }
        let at = (x, y);
        x += needed + 16.0;
        at
    };
    for layer in shown {
        let name = shortened(&layer.name, width - SWATCH - 6.0);
        let (a, b) = room(SWATCH + 6.0 + inline_markup::width(&name) * FONT_SIZE);
        if interactive {
            let _ = write!(out, "<g class=\"entry\" data-layer=\"{}\">", attribute(&layer.name));
        }
        swatch(&mut out, layer, a, b + 10.0);
        text(&mut out, a + SWATCH + 6.0, b + 14.0, "start", Colour::Ink, "", &name);
        if interactive {
            out.push_str("</g>");
        }
    }
    let mut named: Vec<&String> = Vec::new();
    for (values, label) in heats {
        if named.contains(&label) {
            continue;
        }
        named.push(label);
        let (largest, both) = marks::heat_range(values);
        let low = if both { significant(-largest, 2) } else { "0".into() };
        let high = significant(largest, 2);
        let bar = 90.0;
        let widths = [label.as_str(), &low, &high].map(|t| inline_markup::width(t) * FONT_SIZE);
        let (a, b) = room(widths[0] + 10.0 + widths[1] + 6.0 + bar + 6.0 + widths[2]);
        text(&mut out, a, b + 14.0, "start", Colour::Ink, "", label);
        let start = a + widths[0] + 10.0;
        text(&mut out, start, b + 14.0, "start", Colour::Ink, "", &low);
        let left = start + widths[1] + 6.0;
        let cells = 9;
        for i in 0..cells {
            let place = f64::from(i) / f64::from(cells - 1);
            let value = if both { 2.0 * place - 1.0 } else { place };
            let colour = marks::heat_colour(value);
            let _ = write!(
                out,
                "<rect class=\"F {}\" fill=\"{}\" fill-opacity=\"{:.2}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"11\"/>",
                colour.class(),
                colour.literal(),
                0.06 + 0.9 * value.abs(),
                px(left + bar * f64::from(i) / f64::from(cells)),
                px(b + 4.5),
                px(bar / f64::from(cells))
            );
        }
        text(&mut out, left + bar + 6.0, b + 14.0, "start", Colour::Ink, "", &high);
    }
    if out.is_empty() { (out, 0.0) } else { (out, y + ROW + 8.0) }
}

/// `name` without characters in its middle, so that it is no wider than `width`: names of recordings differ at both ends.
fn shortened(name: &str, width: f64) -> String {
    let characters: Vec<char> = name.chars().collect();
    let without = |gone: usize| {
        let kept = characters.len() - gone;
        let (start, end) = (&characters[..kept.div_ceil(2)], &characters[characters.len() - kept / 2..]);
        start.iter().chain(&['…']).chain(end).collect::<String>()
    };
    if inline_markup::width(name) * FONT_SIZE <= width {
        return name.to_owned();
    }
    (1..characters.len())
        .map(without)
        .find(|short| inline_markup::width(short) * FONT_SIZE <= width)
        .unwrap_or_else(|| name.to_owned())
}

fn swatch(out: &mut String, layer: &Layer, x: f64, y: f64) {
    let (class, literal) = (layer.colour.class(), layer.colour.literal());
    let middle = x + SWATCH / 2.0;
    let stroke = |width: &str, extra: &str, d: String| {
        format!("<path class=\"S {class}\" stroke=\"{literal}\" stroke-width=\"{width}\"{extra} d=\"{d}\"/>")
    };
    let across = format!("M{} {}h{SWATCH}", px(x), px(y));
    let drawn = match &layer.mark {
        Mark::Series { style, .. } => match style {
            Style::Line | Style::Step => stroke("2.4", "", across),
            Style::Hair => stroke("1.4", " stroke-opacity=\".8\"", across),
            Style::Dashes => stroke("1.8", " stroke-dasharray=\"6 4\"", across),
            Style::Points => stroke("6", " stroke-linecap=\"round\"", format!("M{} {}h0", px(middle), px(y))),
            Style::Rings => format!(
                "<circle class=\"S {class}\" stroke=\"{literal}\" stroke-width=\"1.6\" cx=\"{}\" cy=\"{}\" r=\"3.6\"/>",
                px(middle),
                px(y)
            ),
            Style::Crosses => {
                stroke("1.6", "", format!("M{} {}l7 7m0 -7l-7 7", px(middle - 3.5), px(y - 3.5)))
            }
            Style::Bars => block(x, y, &class, &literal, ".85"),
        },
        Mark::Band { .. } => block(x, y, &class, &literal, ".22"),
        Mark::Region { .. } => block(x, y, &class, &literal, ".22"),
        Mark::Intervals { .. } => {
            stroke("1.5", "", format!("M{} {}h8m-4 0v12m-4 0h8", px(middle - 4.0), px(y - 6.0)))
        }
        Mark::Level(_) => stroke("1.3", " stroke-dasharray=\"2 3\"", across),
        Mark::Moment(_) => {
            stroke("1.3", " stroke-dasharray=\"2 3\"", format!("M{} {}v14", px(middle), px(y - 7.0)))
        }
        Mark::Heat { .. } => String::new(),
    };
    out.push_str(&drawn);
}

fn block(x: f64, y: f64, class: &str, literal: &str, opacity: &str) -> String {
    format!(
        "<rect class=\"F {class}\" fill=\"{literal}\" fill-opacity=\"{opacity}\" x=\"{}\" y=\"{}\" width=\"{SWATCH}\" height=\"11\" rx=\"2\"/>",
        px(x),
        px(y - 5.5)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_wider_than_the_picture_loses_its_middle() {
        let name = "A: festo10_cut200mm [relative_contraction_percent=25, run=8]";
        let short = shortened(name, 300.0);
        assert!(
            short.starts_with("A: festo10") && short.ends_with("run=8]") && short.contains('…'),
            "{short}"
        );
        assert!(inline_markup::width(&short) * FONT_SIZE <= 300.0);
        assert_eq!(shortened(name, 1000.0), name);
    }
}
