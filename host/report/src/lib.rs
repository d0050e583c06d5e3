//! Reports: pictures, one HTML file each, a Markdown summary.
//!
//! This room only draws what others computed. A picture is a value ([`Figure`]: panels, axes, marks); a report is a value
//! ([`Page`]: verdict, facts, sections). Both turn into text in one place, so that every report of this program looks
//! equally, in light and dark, on a page, on a phone and in print.
//!
//! ```
//! use pam_report::{Axis, Colour, Figure, Panel};
//!
//! let pressure = [200.0, 300.0, 400.0, 500.0];
//! let panel = Panel::new(Axis::new("pressure P", "kPa"), Axis::new("friction factor k_{F}", "").from_zero())
//!     .band("95 %", Colour::Series(0), &pressure, &[0.13, 0.10, 0.08, 0.05], &[0.15, 0.12, 0.10, 0.07])
//!     .line("fit", Colour::Series(0), &pressure, &[0.14, 0.11, 0.09, 0.06])
//!     .rings("nodes", Colour::Series(0), &pressure, &[0.14, 0.11, 0.09, 0.06]);
//! let figure = Figure::new("friction", "Friction factor", "The band is narrow where the data determine it.", panel);
//! assert!(figure.svg().contains("friction factor k"));
//! ```

pub mod change_page;
pub mod compare_page;
pub mod diagnose_page;
pub mod effect_page;
pub mod effect_trace;
pub mod evaluate_page;
pub mod fit_page;
pub mod history_text;
pub mod inline_markup;
pub mod stock_mountings;
pub mod stock_page;
pub mod stock_text;
pub mod timeline_page;

pub mod document;
pub mod wording;

mod axis;
mod canvas;
mod colour;
mod downsample;
mod export;
mod figure;
mod html;
mod legend;
mod markdown;
mod marks;
mod numbers;
mod page;
mod provenance;
mod residual_table;
mod svg;
pub mod symbols;

pub use axis::{Axis, Scale, fixed, significant};
pub use colour::Colour;
pub use figure::{Figure, Layer, Mark, Panel, Style};
pub use page::{Block, Fact, Page, Section, Table, Tone};
pub use provenance::Provenance;
