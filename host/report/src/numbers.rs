//! The numbers behind a picture, as CSV.

use std::fmt::Write as _;

use super::axis::{Axis, Scale};
use super::figure::{Figure, Mark, Panel};
use super::{downsample, inline_markup};

/// The most rows of one layer that are written; longer series are downsampled as they are for drawing.
const MOST_ROWS: usize = 1_500;

impl Figure {
    /// The numbers behind the picture as CSV: one row a point, with the panel and the layer it belongs to. Columns are
    /// named by the axes; an interval has two ordinates, `low` and `high`.
    #[must_use]
    pub fn csv(&self) -> String {
        csv(self)
    }
}

/// One row a point: panel (where there are several), layer, abscissa, ordinate.
fn csv(figure: &Figure) -> String {
    let mut out = String::new();
    let several = figure.panels.len() > 1;
    let mut header = None;
    for panel in &figure.panels {
        // Panels with other axes start a table of their own, after an empty line.
        let (x, y) =
            (cell(&inline_markup::plain(&panel.x.title())), cell(&inline_markup::plain(&panel.y.title())));
        let wide = panel.layers.iter().any(|l| !matches!(l.mark, Mark::Series { .. } | Mark::Level(_)));
        let this = format!(
            "{}layer,{x},{y}{}\n",
            if several { "panel," } else { "" },
            if wide { ",low,high" } else { "" }
        );
        if header.as_ref() != Some(&this) {
            if header.is_some() {
                out.push('\n');
            }
            out.push_str(&this);
            header = Some(this);
        }
        rows(&mut out, panel, several, wide);
    }
    out
}

fn rows(out: &mut String, panel: &Panel, several: bool, wide: bool) {
    let title =
        if several { format!("{},", cell(&inline_markup::plain(&panel.title))) } else { String::new() };
    for layer in &panel.layers {
        let front = format!("{title}{}", cell(&inline_markup::plain(&layer.name)));
        let mut row = |x: &str, y: Option<f64>, ends: Option<(f64, f64)>| {
            let _ = write!(out, "{front},{x},{}", y.map_or(String::new(), number));
            if wide {
                match ends {
                    Some((low, high)) => {
                        let _ = write!(out, ",{},{}", number(low), number(high));
                    }
                    None => out.push_str(",,"),
                }
            }
            out.push('\n');
        };
        match &layer.mark {
            Mark::Series { x, y, .. } => {
                let kept = if x.windows(2).all(|w| w[0] <= w[1]) {
                    downsample::extremes(x, y, MOST_ROWS / 4)
                } else {
                    downsample::triangles(x, y, MOST_ROWS)
                };
                kept.into_iter().for_each(|i| row(&abscissa(&panel.x, x[i]), Some(y[i]), None));
            }
            Mark::Band { x, low, high } | Mark::Intervals { x, low, high } => {
                for i in downsample::extremes(x, high, MOST_ROWS / 4) {
                    row(&abscissa(&panel.x, x[i]), None, Some((low[i], high[i])));
                }
            }
            Mark::Region { x, y } => {
                let part = |v: Option<f64>| v.map_or(String::new(), number);
                let (from, to) = (part(x.0), part(x.1));
                let ends = y.0.zip(y.1);
                row(&cell(&format!("{from} to {to}")), None, ends);
            }
            Mark::Level(at) => row("", Some(*at), None),
            Mark::Moment(at) => row(&abscissa(&panel.x, *at), None, None),
            Mark::Heat { x, y, values, .. } => {
                let columns = x.len().saturating_sub(1).max(1);
                for (i, value) in values.iter().enumerate() {
                    let (column, line) = (i % columns, i / columns);
                    if let (Some(xs), Some(ys)) = (x.get(column..column + 2), y.get(line..line + 2)) {
                        let middle = abscissa(&panel.x, (xs[0] + xs[1]) / 2.0);
                        row(&middle, Some(*value), Some((ys[0], ys[1])));
                    }
                }
            }
        }
    }
}

fn abscissa(axis: &Axis, value: f64) -> String {
    if let Scale::Names(names) = &axis.scale
        && let Some(name) = names.get(value.round().max(0.0) as usize)
    {
        return cell(&inline_markup::plain(name));
    }
    number(value)
}

fn number(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    // Seven figures are more than any load cell has; they keep the file small.
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    format!("{rounded}")
}

/// A cell of CSV, quoted where it must be.
pub(crate) fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::super::colour::Colour;
    use super::*;

    #[test]
    fn panels_with_the_same_axes_are_one_table_and_others_follow() {
        let axes = || (Axis::new("P", "kPa"), Axis::new("E_{1}", "MPa"));
        let (x, y) = axes();
        let first =
            Panel::new(x, y).titled("a").line("fit, joint", Colour::Ink, &[1.0, 2.0], &[3.0, f64::NAN]);
        let (x, y) = axes();
        let second = Panel::new(x, y).titled("b").line("fit", Colour::Ink, &[1.0], &[1.0 / 3.0]);
        let third = Panel::new(Axis::names("effect", vec!["mullins".into()]), Axis::new("gain", ""))
            .titled("c")
            .intervals("95 %", Colour::Ink, &[0.0], &[1.0], &[2.0]);
        let figure = Figure::multiples("f", "t", "r", vec![first, second, third]);
        insta::assert_snapshot!(figure.csv(), @r#"
        panel,layer,P (kPa),E1 (MPa)
        a,"fit, joint",1,3
        a,"fit, joint",2,
        b,fit,1,0.3333333

        panel,layer,effect,gain,low,high
        c,95 %,mullins,,1,2
        "#);
    }
}
