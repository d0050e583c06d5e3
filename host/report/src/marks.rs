//! Drawing of the marks of a panel.

use std::fmt::Write as _;

use super::canvas::{Frame, px};
use super::downsample;
use super::figure::{Layer, Mark, Style, bar_half_width};

/// Which marks come first: regions and fields, then bands, then everything else.
pub(crate) fn stage(mark: &Mark) -> u8 {
    match mark {
        Mark::Region { .. } | Mark::Heat { .. } => 0,
        Mark::Band { .. } | Mark::Series { style: Style::Hair | Style::Bars, .. } => 1,
        _ => 2,
    }
}

/// Draws one layer.
pub(crate) fn draw(out: &mut String, layer: &Layer, frame: &Frame) {
    let (class, literal) = (layer.colour.class(), layer.colour.literal());
    let stroke = |out: &mut String, d: &str, width: f64, extra: &str| {
        if !d.is_empty() {
            let _ = write!(
                out,
                "<path class=\"S {class}\" stroke=\"{literal}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{extra} d=\"{d}\"/>"
            );
        }
    };
    let fill = |out: &mut String, d: &str, extra: &str| {
        if !d.is_empty() {
            let _ = write!(out, "<path class=\"F {class}\" fill=\"{literal}\"{extra} d=\"{d}\"/>");
        }
    };
    match &layer.mark {
        Mark::Series { x, y, style } => match style {
            Style::Line => stroke(out, &line(frame, x, y), 2.0, ""),
            Style::Hair => stroke(out, &line(frame, x, y), 1.1, " stroke-opacity=\".8\""),
            Style::Dashes => stroke(out, &line(frame, x, y), 1.8, " stroke-dasharray=\"6 4\""),
            Style::Step => stroke(out, &steps(frame, x, y), 1.8, ""),
            Style::Points => {
                let kept = points(frame, x, y);
                let (size, opacity) = match kept.len() {
                    0..=60 => (6.0, "1"),
                    61..=400 => (4.4, ".85"),
                    _ => (2.8, ".6"),
                };
                let d: String = kept.iter().map(|(a, b)| format!("M{} {}h0", px(*a), px(*b))).collect();
                stroke(out, &d, size, &format!(" stroke-linecap=\"round\" stroke-opacity=\"{opacity}\""));
            }
            Style::Rings => {
                for (a, b) in points(frame, x, y) {
                    let _ = write!(
                        out,
                        "<circle class=\"S {class}\" stroke=\"{literal}\" stroke-width=\"1.6\" cx=\"{}\" cy=\"{}\" r=\"3.6\"/>",
                        px(a),
                        px(b)
                    );
                }
            }
            Style::Crosses => {
                let cross = |(a, b): &(f64, f64)| format!("M{} {}l7 7m0 -7l-7 7", px(a - 3.5), px(b - 3.5));
                let d: String = points(frame, x, y).iter().map(cross).collect();
                stroke(out, &d, 1.6, "");
            }
            Style::Bars => fill(out, &bars(frame, x, y), " fill-opacity=\".85\""),
        },
        Mark::Band { x, low, high } => {
            fill(out, &band(frame, x, low, high), " fill-opacity=\".18\"");
        }
        Mark::Intervals { x, low, high } => stroke(out, &intervals(frame, x, low, high), 1.5, ""),
        Mark::Region { x, y } => region(out, frame, *x, *y, &class, &literal),
        Mark::Level(at) => {
            let y = px(frame.y(*at));
            let d = format!("M{} {y}H{}", px(frame.left), px(frame.left + frame.width));
            stroke(out, &d, 1.3, " stroke-dasharray=\"2 3\"");
        }
        Mark::Moment(at) => {
            let d = format!("M{} {}V{}", px(frame.x(*at)), px(frame.top), px(frame.top + frame.height));
            stroke(out, &d, 1.3, " stroke-dasharray=\"2 3\"");
        }
        Mark::Heat { x, y, values, .. } => heat(out, frame, x, y, values),
    }
}

fn rising(x: &[f64]) -> bool {
    x.windows(2).all(|w| !(w[1] < w[0]))
}

/// The points of a series on the paper, downsampled; a break is a pair that is not finite.
fn on_canvas(frame: &Frame, x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    let xs: Vec<f64> = x.iter().map(|v| frame.x(*v)).collect();
    let ys: Vec<f64> = y.iter().map(|v| frame.y(*v)).collect();
    let kept = if rising(x) {
        downsample::extremes(&xs, &ys, frame.width as usize)
    } else {
        downsample::triangles(&xs, &ys, (3.0 * frame.width) as usize)
    };
    // Far beyond the paper coordinates are cut, or a wild value makes the file useless to other programs.
    let near = |v: f64| if v.is_finite() { v.clamp(-1e5, 1e5) } else { f64::NAN };
    kept.into_iter().map(|i| (near(xs[i]), near(ys[i]))).collect()
}

fn line(frame: &Frame, x: &[f64], y: &[f64]) -> String {
    let mut d = String::new();
    let points = on_canvas(frame, x, y);
    let finite = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    for part in points.chunk_by(|a, b| finite(a) == finite(b)).filter(|p| finite(&p[0])) {
        path(&mut d, &downsample::needed(part, 0.12));
    }
    d
}

/// A path through points.
fn path(d: &mut String, points: &[(f64, f64)]) {
    let mut last = String::new();
    for (i, (a, b)) in points.iter().enumerate() {
        let here = format!("{} {}", px(*a), px(*b));
        if i == 0 {
            d.push('M');
        } else if here == last {
            continue;
        } else {
            d.push('L');
        }
        d.push_str(&here);
        last = here;
    }
}

fn steps(frame: &Frame, x: &[f64], y: &[f64]) -> String {
    let mut d = String::new();
    let mut before: Option<f64> = None;
    for (a, b) in on_canvas(frame, x, y) {
        if !(a.is_finite() && b.is_finite()) {
            before = None;
            continue;
        }
        match before {
            None => d.push_str(&format!("M{} {}", px(a), px(b))),
            Some(y) if (y - b).abs() < 0.05 => d.push_str(&format!("H{}", px(a))),
            Some(_) => d.push_str(&format!("H{}V{}", px(a), px(b))),
        }
        before = Some(b);
    }
    d
}

fn points(frame: &Frame, x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    let xs: Vec<f64> = x.iter().map(|v| frame.x(*v)).collect();
    let ys: Vec<f64> = y.iter().map(|v| frame.y(*v)).collect();
    // More dots than that make a cloud, not a picture.
    let most = ((frame.width * frame.height / 70.0) as usize).clamp(300, 1_800);
    let kept = downsample::cells(&xs, &ys, 1.0, most);
    kept.into_iter().map(|i| (xs[i], ys[i])).filter(|(a, b)| a.abs() < 1e5 && b.abs() < 1e5).collect()
}

fn bars(frame: &Frame, x: &[f64], y: &[f64]) -> String {
    let mut d = String::new();
    let (places, _) = if frame.y_down { (y, x) } else { (x, y) };
    let half = if frame.y_down { 0.3 } else { bar_half_width(places) };
    for (a, b) in x.iter().zip(y).filter(|(a, b)| a.is_finite() && b.is_finite()) {
        if frame.y_down {
            let zero = if frame.x_log { frame.left } else { frame.x(0.0_f64.max(frame.x_ends.0)) };
            let end = frame.x(*a);
            if end.is_finite() {
                let (top, bottom) = (frame.y(b - half), frame.y(b + half));
                let _ = write!(d, "M{} {}H{}V{}H{}Z", px(zero), px(top), px(end), px(bottom), px(zero));
            }
        } else {
            let (left, right, top) = (frame.x(a - half), frame.x(a + half), frame.y(*b));
            if left.is_finite() && top.is_finite() {
                let base = px(frame.base());
                let _ = write!(d, "M{} {base}V{}H{}V{base}Z", px(left), px(top), px(right));
            }
        }
    }
    d
}

fn band(frame: &Frame, x: &[f64], low: &[f64], high: &[f64]) -> String {
    let mut d = String::new();
    let finite = |i: &usize| {
        frame.x(x[*i]).is_finite() && frame.y(low[*i]).is_finite() && frame.y(high[*i]).is_finite()
    };
    let rows: Vec<usize> = (0..x.len()).collect();
    for part in rows.chunk_by(|a, b| finite(a) == finite(b)).filter(|p| finite(&p[0])) {
        let of = |v: &[f64]| part.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let (xs, lows, highs) = (of(x), of(low), of(high));
        let mut edge = downsample::needed(&on_canvas(frame, &xs, &highs), 0.12);
        edge.extend(downsample::needed(&on_canvas(frame, &xs, &lows), 0.12).into_iter().rev());
        path(&mut d, &edge);
        d.push('Z');
    }
    d
}

fn intervals(frame: &Frame, x: &[f64], low: &[f64], high: &[f64]) -> String {
    let mut d = String::new();
    for ((at, low), high) in x.iter().zip(low).zip(high) {
        if frame.y_down {
            let (y, from, to) = (frame.y(*at), frame.x(*low), frame.x(*high));
            if y.is_finite() && from.is_finite() && to.is_finite() {
                let _ = write!(d, "M{} {}v8m0 -4H{}m0 -4v8", px(from), px(y - 4.0), px(to));
            }
        } else {
            let (a, from, to) = (frame.x(*at), frame.y(*low), frame.y(*high));
            if a.is_finite() && from.is_finite() && to.is_finite() {
                let (from, to) = (from.clamp(-1e4, 1e4), to.clamp(-1e4, 1e4));
                let _ = write!(d, "M{} {}h8m-4 0V{}m-4 0h8", px(a - 4.0), px(from), px(to));
            }
        }
    }
    d
}

fn region(
    out: &mut String,
    frame: &Frame,
    x: (Option<f64>, Option<f64>),
    y: (Option<f64>, Option<f64>),
    class: &str,
    literal: &str,
) {
    let along = |v: Option<f64>, edge: f64| {
        let a = v.map_or(edge, |v| frame.x(v));
        if a.is_finite() { a.clamp(frame.left, frame.left + frame.width) } else { edge }
    };
    let up = |v: Option<f64>, edge: f64| {
        let b = v.map_or(edge, |v| frame.y(v));
        if b.is_finite() { b.clamp(frame.top, frame.top + frame.height) } else { edge }
    };
    let (x0, x1) = (along(x.0, frame.left), along(x.1, frame.left + frame.width));
    let (y0, y1) = (up(y.0, frame.top + frame.height), up(y.1, frame.top));
    // A region of no width (one moment, one pressure) must still be seen.
    let width = (x1 - x0).abs().max(3.0);
    let height = (y1 - y0).abs().max(3.0);
    let _ = write!(
        out,
        "<rect class=\"F {class}\" fill=\"{literal}\" fill-opacity=\".14\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
        px(x0.min(x1)),
        px(y0.min(y1)),
        px(width),
        px(height)
    );
    let mut edges = String::new();
    for (given, at) in [(x.0, x0), (x.1, x1)] {
        if given.is_some() {
            let _ = write!(edges, "M{} {}V{}", px(at), px(y0), px(y1));
        }
    }
    for (given, at) in [(y.0, y0), (y.1, y1)] {
        if given.is_some() {
            let _ = write!(edges, "M{} {}H{}", px(x0), px(at), px(x1));
        }
    }
    let _ = write!(
        out,
        "<path class=\"S {class}\" stroke=\"{literal}\" stroke-width=\"1.4\" stroke-dasharray=\"5 3\" d=\"{edges}\"/>"
    );
}

/// The largest size among the numbers of a field, and whether they have both signs.
pub(crate) fn heat_range(values: &[f64]) -> (f64, bool) {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    (high.max(-low), low < 0.0 && high > 0.0)
}

fn heat(out: &mut String, frame: &Frame, x: &[f64], y: &[f64], values: &[f64]) {
    let (largest, _) = heat_range(values);
    let columns = x.len().saturating_sub(1);
    if columns == 0 || largest <= 0.0 {
        return;
    }
    for (i, value) in values.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        let (column, row) = (i % columns, i / columns);
        let (Some(xs), Some(ys)) = (x.get(column..column + 2), y.get(row..row + 2)) else { continue };
        let (a, b) = (frame.x(xs[0]), frame.x(xs[1]));
        let (c, d) = (frame.y(ys[0]), frame.y(ys[1]));
        if ![a, b, c, d].iter().all(|v| v.is_finite()) {
            continue;
        }
        let colour = heat_colour(*value);
        let _ = write!(
            out,
            "<rect class=\"F {}\" fill=\"{}\" fill-opacity=\"{:.2}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            colour.class(),
            colour.literal(),
            0.06 + 0.9 * (value.abs() / largest),
            px(a.min(b) + 0.5),
            px(c.min(d) + 0.5),
            px(((b - a).abs() - 1.0).max(0.5)),
            px(((d - c).abs() - 1.0).max(0.5))
        );
    }
}

/// The hue of a number in a field: positive warm, negative blue.
pub(crate) fn heat_colour(value: f64) -> super::Colour {
    if value < 0.0 { super::Colour::Series(0) } else { super::Colour::Series(1) }
}
