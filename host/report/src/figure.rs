//! What a picture shows, apart from how it is drawn: panels, axes and marks, with their numbers.

use super::axis::{Axis, Scale};
use super::colour::Colour;
use super::inline_markup;

/// How a mark looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A line through the points in their order; it may turn back on itself.
    Line,
    /// A thin line behind others: measurements.
    Hair,
    /// A dashed line: a model that is compared.
    Dashes,
    /// A line that keeps each value until the next: commands, counts.
    Step,
    /// A dot for each point.
    Points,
    /// An open ring for each point, for nodes on a curve.
    Rings,
    /// A cross for each point: outliers.
    Crosses,
    /// A bar from zero at each point.
    Bars,
}

/// What is drawn in a panel. Numbers are in the units of the panel's axes.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// Points in order.
    Series {
        /// Abscissae, in the unit of the horizontal axis.
        x: Vec<f64>,
        /// Ordinates; a value that is not finite breaks a line.
        y: Vec<f64>,
        /// How they are drawn.
        style: Style,
    },
    /// The area between two curves over one abscissa: an interval.
    Band {
        /// Abscissae, in the unit of the horizontal axis.
        x: Vec<f64>,
        /// Lower curve.
        low: Vec<f64>,
        /// Upper curve.
        high: Vec<f64>,
    },
    /// A vertical bar with ends at each point: an interval of one number.
    Intervals {
        /// Abscissae, in the unit of the horizontal axis.
        x: Vec<f64>,
        /// Lower ends.
        low: Vec<f64>,
        /// Upper ends.
        high: Vec<f64>,
    },
    /// A highlighted part of the panel; an end that is absent is the panel's edge.
    Region {
        /// From and to on the horizontal axis.
        x: (Option<f64>, Option<f64>),
        /// From and to on the vertical axis.
        y: (Option<f64>, Option<f64>),
    },
    /// A horizontal line across the panel.
    Level(f64),
    /// A vertical line across the panel.
    Moment(f64),
    /// A field of numbers on a grid, drawn in one hue (all of one sign) or two (around zero).
    Heat {
        /// Edges of the columns, one more than there are columns.
        x: Vec<f64>,
        /// Edges of the rows, one more than there are rows.
        y: Vec<f64>,
        /// Row after row from the bottom; a value that is not finite leaves its cell empty.
        values: Vec<f64>,
        /// What the numbers are, with unit.
        label: String,
    },
}

/// A mark with its colour and its name in the legend (an empty name is not listed).
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Name in the legend and in the numbers.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
    /// What is drawn.
    pub mark: Mark,
}

/// One pair of axes with what is drawn on them.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Shown above the panel where there are several.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, in this order.
    pub layers: Vec<Layer>,
}

impl Panel {
    /// An empty panel.
    #[must_use]
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { title: String::new(), x, y, layers: Vec::new() }
    }

    /// With a title.
    #[must_use]
    pub fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// With one more mark.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, colour: Colour, mark: Mark) -> Self {
        self.layers.push(Layer { name: name.into(), colour, mark });
        self
    }

    fn series(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64], style: Style) -> Self {
        let n = x.len().min(y.len());
        self.with(name, colour, Mark::Series { x: x[..n].to_vec(), y: y[..n].to_vec(), style })
    }

    /// With a line.
    #[must_use]
    pub fn line(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Line)
    }

    /// With a thin line, for measurements behind a model.
    #[must_use]
    pub fn hair(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Hair)
    }

    /// With a dashed line.
    #[must_use]
    pub fn dashes(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Dashes)
    }

    /// With a line of steps.
    #[must_use]
    pub fn step(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Step)
    }

    /// With dots.
    #[must_use]
    pub fn points(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Points)
    }

    /// With open rings.
    #[must_use]
    pub fn rings(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Rings)
    }

    /// With crosses.
    #[must_use]
    pub fn crosses(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Crosses)
    }

    /// With bars from zero.
    #[must_use]
    pub fn bars(self, name: impl Into<String>, colour: Colour, x: &[f64], y: &[f64]) -> Self {
        self.series(name, colour, x, y, Style::Bars)
    }

    /// With the area between two curves.
    #[must_use]
    pub fn band(self, name: impl Into<String>, colour: Colour, x: &[f64], low: &[f64], high: &[f64]) -> Self {
        let n = x.len().min(low.len()).min(high.len());
        let mark = Mark::Band { x: x[..n].to_vec(), low: low[..n].to_vec(), high: high[..n].to_vec() };
        self.with(name, colour, mark)
    }

    /// With an interval at each point.
    #[must_use]
    pub fn intervals(
        self,
        name: impl Into<String>,
        colour: Colour,
        x: &[f64],
        low: &[f64],
        high: &[f64],
    ) -> Self {
        let n = x.len().min(low.len()).min(high.len());
        let mark = Mark::Intervals { x: x[..n].to_vec(), low: low[..n].to_vec(), high: high[..n].to_vec() };
        self.with(name, colour, mark)
    }

    /// With a highlighted span of the horizontal axis.
    #[must_use]
    pub fn region(self, name: impl Into<String>, from: f64, to: f64) -> Self {
        let mark = Mark::Region { x: (Some(from), Some(to)), y: (None, None) };
        self.with(name, Colour::Alarm, mark)
    }

    /// Lowest and highest number that the marks put on an axis; `None` when there is none.
    pub(crate) fn extent(&self, vertical: bool) -> Option<(f64, f64)> {
        let positive = matches!(if vertical { &self.y.scale } else { &self.x.scale }, Scale::Log);
        let mut ends: Option<(f64, f64)> = None;
        let mut take = |v: f64| {
            if v.is_finite() && (!positive || v > 0.0) {
                ends = Some(ends.map_or((v, v), |(l, h)| (l.min(v), h.max(v))));
            }
        };
        for layer in &self.layers {
            match (&layer.mark, vertical) {
                (Mark::Series { y, style: Style::Bars, .. }, true) => {
                    take(0.0);
                    y.iter().copied().for_each(&mut take);
                }
                (Mark::Series { x, style: Style::Bars, .. }, false) => {
                    let half = bar_half_width(x);
                    x.iter().for_each(|v| {
                        take(v - half);
                        take(v + half);
                    });
                }
                (Mark::Series { x, .. } | Mark::Heat { x, .. }, false)
                | (Mark::Series { y: x, .. } | Mark::Heat { y: x, .. }, true)
                | (Mark::Band { x, .. } | Mark::Intervals { x, .. }, false) => {
                    x.iter().copied().for_each(&mut take);
                }
                (Mark::Band { low, high, .. } | Mark::Intervals { low, high, .. }, true) => {
                    low.iter().chain(high).copied().for_each(&mut take);
                }
                (Mark::Level(at), true) | (Mark::Moment(at), false) => take(*at),
                (Mark::Level(_), false) | (Mark::Moment(_), true) | (Mark::Region { .. }, _) => {}
            }
        }
        ends
    }
}

/// Half the width of bars: they touch nearly, whatever their spacing.
pub(crate) fn bar_half_width(x: &[f64]) -> f64 {
    let gap = x.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|g| *g > 0.0).fold(f64::INFINITY, f64::min);
    if gap.is_finite() { 0.4 * gap } else { 0.4 }
}

/// A picture: one panel, or several small ones side by side.
///
/// ```
/// use pam_report::{Axis, Colour, Figure, Panel};
/// let panel = Panel::new(Axis::new("contraction ΔL/L_{0}", "%"), Axis::new("force F", "N"))
///     .line("measured", Colour::Muted, &[0.0, 4.0, 8.0], &[120.0, 50.0, 0.0])
///     .dashes("model", Colour::Series(0), &[0.0, 4.0, 8.0], &[119.0, 51.0, 1.0]);
/// let figure = Figure::new("load-line", "Load line at 500 kPa", "The model should lie on the measured line.", panel);
/// assert!(figure.svg().starts_with("<svg"));
/// assert!(figure.csv().starts_with("layer,contraction ΔL/L0 (%),force F (N)\nmeasured,0,120\n"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its files, unique in a report: lower case, hyphens.
    pub id: String,
    /// What it shows.
    pub title: String,
    /// How to read it, in one sentence.
    pub reading: String,
    /// From left to right, then down.
    pub panels: Vec<Panel>,
    /// Whether all panels have the same ends on their horizontal axes.
    pub share_x: bool,
    /// Whether all panels have the same ends on their vertical axes.
    pub share_y: bool,
}

impl Figure {
    /// A picture of one panel.
    pub fn new(
        id: impl Into<String>,
        title: impl Into<String>,
        reading: impl Into<String>,
        panel: Panel,
    ) -> Self {
        Self::multiples(id, title, reading, vec![panel])
    }

    /// A picture of several panels, each with its own ends unless they are set.
    pub fn multiples(
        id: impl Into<String>,
        title: impl Into<String>,
        reading: impl Into<String>,
        panels: Vec<Panel>,
    ) -> Self {
        Self {
            id: id.into(),
            title: title.into(),
            reading: reading.into(),
            panels,
            share_x: false,
            share_y: false,
        }
    }

    /// With the same ends on all axes of a kind, so that panels can be compared by eye.
    #[must_use]
    pub fn shared(mut self, x: bool, y: bool) -> Self {
        (self.share_x, self.share_y) = (x, y);
        self
    }

    /// All words of the picture without mark-up, for readers that cannot see it.
    pub(crate) fn description(&self) -> String {
        let names: Vec<String> =
            self.legend().iter().map(|l| inline_markup::plain(&l.name)).filter(|n| !n.is_empty()).collect();
        let axes = self.panels.first().map_or(String::new(), |p| {
            format!("{} against {}. ", inline_markup::plain(&p.y.title()), inline_markup::plain(&p.x.title()))
        });
        let shown = if names.is_empty() { String::new() } else { format!(" Shown: {}.", names.join(", ")) };
        format!("{axes}{}{shown}", inline_markup::plain(&self.reading))
    }

    /// Every named layer once, in order of first appearance.
    pub(crate) fn legend(&self) -> Vec<&Layer> {
        let mut seen = std::collections::HashSet::new();
        let layers = self.panels.iter().flat_map(|p| &p.layers);
        layers.filter(|l| !l.name.is_empty() && seen.insert(l.name.as_str())).collect()
    }
}
