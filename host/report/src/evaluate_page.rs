//! The report of an evaluation: errors on recordings that a fit did not use.

use pam_evaluate::cross_validation::{CrossValidation, Score, Spot};
use pam_evaluate::length_transfer::LengthTransfer;
use pam_evaluate::stock_transfer::StockTransfer;

use super::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, fixed, residual_table, significant};

/// Mean error below which a table is called good, percent of the largest measured force, as in the report of a fit at held-out pressures.
const GOOD: f64 = 2.0;
/// Mean error above which a table is called bad.
const BAD: f64 = 5.0;
/// Held-out contractions cost more than held-out runs where their error is larger by this factor: then lengths are too few.
const FEW_LENGTHS: f64 = 2.0;

/// What was found of one muscle.
#[derive(Debug, Clone, Copy)]
pub struct Evaluated<'a> {
    /// Its name.
    pub muscle: &'a str,
    /// Every run held out in turn.
    pub runs: Option<&'a CrossValidation>,
    /// Every contraction held out in turn.
    pub contractions: Option<&'a CrossValidation>,
    /// Predicted from the tables of the other muscles.
    pub length: Option<&'a LengthTransfer>,
    /// Predicted with all muscles fitted together.
    pub stock: Option<&'a StockTransfer>,
}

impl Evaluated<'_> {
    fn any(&self) -> Option<&CrossValidation> {
        self.runs.or(self.contractions)
    }

    fn percent(&self, score: &Score) -> f64 {
        self.any().map_or(f64::NAN, |any| 100.0 * score.mean() / any.largest)
    }
}

/// The page of an evaluation. `published` is the name of the formula that was compared with.
#[must_use]
pub fn page(all: &[Evaluated<'_>], published: Option<&str>) -> Page {
    let names: Vec<&str> = all.iter().map(|e| e.muscle).collect();
    let mut page = Page::new(
        format!("Evaluation of {}", names.join(", ")),
        "errors on recordings that the fit did not use",
    );
    let means = Means::of(all);
    header(&mut page, all, &means);
    page.push(first(all, &means));
    page.push(scores(all, published));
    for one in all {
        page.push(details(one, all.len() > 1));
    }
    page
}

/// Mean errors over all muscles, percent of the largest measured force of each.
struct Means {
    runs: Option<f64>,
    /// At contractions between others.
    contractions: Option<f64>,
    /// At the smallest and the largest contraction.
    ends: Option<f64>,
    lengths: Option<f64>,
    published: Option<f64>,
}

impl Means {
    fn of(all: &[Evaluated<'_>]) -> Self {
        let mean = |score: &dyn Fn(&Evaluated<'_>) -> Option<f64>| {
            let values: Vec<f64> = all.iter().filter_map(score).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        Self {
            runs: mean(&|e| e.runs.map(|r| e.percent(&r.table))),
            contractions: mean(&|e| e.contractions.and_then(|c| c.between).map(|c| e.percent(&c))),
            ends: mean(&|e| e.contractions.and_then(|c| c.ends).map(|c| e.percent(&c))),
            lengths: mean(&|e| e.length.map(|l| e.percent(&l.score))),
            published: mean(&|e| e.any().and_then(|a| a.published).map(|p| e.percent(&p))),
        }
    }

    /// The error that decides, with what was held out: a table is used at contractions between those that were recorded.
    fn worst(&self) -> (f64, &'static str) {
        let held = [(self.runs, "runs"), (self.contractions, "contractions between others")];
        let known = held.into_iter().filter_map(|(v, what)| Some((v?, what)));
        known.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, "runs"))
    }
}

fn tone(percent: f64) -> Tone {
    if percent <= GOOD {
        Tone::Good
    } else if percent <= BAD {
        Tone::Caution
    } else {
        Tone::Bad
    }
}

fn header(page: &mut Page, all: &[Evaluated<'_>], means: &Means) {
    let (worst, what) = means.worst();
    let mut verdict = format!(
        "On held-out {what}, the mean error is {} % of the largest measured force.",
        significant(worst, 2)
    );
    if let Some(published) = means.published {
        verdict += &format!(" The published formula has {} %.", significant(published, 2));
    }
    page.verdict(tone(worst), verdict);
    let shown = [
        ("held-out runs", means.runs, "mean error, of the largest force"),
        ("held-out contractions", means.contractions, "between others: mean error, of the largest force"),
        ("end contractions", means.ends, "extrapolation: mean error, of the largest force"),
        ("other lengths", means.lengths, "mean error, of the largest force"),
    ];
    for (label, value, meaning) in shown {
        if let Some(value) = value {
            page.fact(label, format!("{} %", significant(value, 2)), meaning, tone(value));
        }
    }
    if let ([one], true) = (all, page.facts.len() < 3)
        && let Some(any) = one.any()
    {
        page.fact(
            "largest measured force",
            format!("{} N", significant(any.largest, 4)),
            "the errors refer to it",
            Tone::Plain,
        );
    }
}

/// The picture that stands first, and what to do.
fn first(all: &[Evaluated<'_>], means: &Means) -> Section {
    let mut section = Section::new("Error where it was held out").summarised();
    match all {
        [one] => {
            if let Some(any) = one.any() {
                section.figure(residual_table::figure(
                    "held-out",
                    "Error of every recording when it was held out",
                    "A recording whose interval does not reach zero is off as a whole: in its mounting, its zero or its history.",
                    &any.recordings,
                ));
            }
        }
        _ => section.figure(by_muscle(all)),
    }
    let (worst, _) = means.worst();
    let mut steps = Vec::new();
    if worst <= GOOD {
        steps.push("Use the table of `host fit` within the tested pressures and contractions.".to_owned());
    } else {
        steps.push("Find the cause of the error: `host diagnose` with the same recordings.".to_owned());
    }
    if let (Some(runs), Some(contractions)) = (means.runs, means.contractions)
        && contractions > FEW_LENGTHS * runs.max(0.1)
    {
        steps.push(
            "Record more lengths: the error between them is larger than that from run to run.".to_owned(),
        );
    }
    let lowest = all
        .iter()
        .filter_map(Evaluated::any)
        .flat_map(|a| &a.recordings)
        .filter(|r| residual_table::is_off(r));
    let odd: Vec<String> = lowest.take(3).map(|r| r.recording.clone()).collect();
    if !odd.is_empty() && worst > GOOD {
        steps.push(format!(
            "Compare first: {}. Their mean error is larger than the scatter about it.",
            odd.join("; ")
        ));
    }
    section.text("What to do:");
    section.list(steps);
    section
}

fn by_muscle(all: &[Evaluated<'_>]) -> Figure {
    let names: Vec<String> = all.iter().map(|e| e.muscle.to_owned()).collect();
    let x: Vec<f64> = (0..all.len()).map(|i| i as f64).collect();
    let of = |score: &dyn Fn(&Evaluated<'_>) -> Option<f64>| -> Vec<f64> {
        all.iter().map(|e| score(e).unwrap_or(f64::NAN)).collect()
    };
    let panel = Panel::new(
        Axis::names("muscle", names),
        Axis::new("mean error, of the largest force", "%").from_zero(),
    )
    .points("held-out runs", Colour::Series(0), &x, &of(&|e| e.runs.map(|r| e.percent(&r.table))))
    .rings(
        "contractions between others",
        Colour::Series(1),
        &x,
        &of(&|e| e.contractions.and_then(|c| c.between).map(|c| e.percent(&c))),
    )
    .crosses("other lengths", Colour::Series(2), &x, &of(&|e| e.length.map(|l| e.percent(&l.score))))
    .points(
        "published formula",
        Colour::Muted,
        &x,
        &of(&|e| e.any().and_then(|a| a.published).map(|p| e.percent(&p))),
    );
    Figure::new(
        "muscles",
        "Mean error of each muscle",
        "Runs show the repeatability, contractions the interpolation between lengths, and other lengths the step to a muscle that was not recorded.",
        panel,
    )
}

fn scores(all: &[Evaluated<'_>], published: Option<&str>) -> Section {
    let mut section = Section::new("Errors").summarised();
    let mut table = Table::new(
        "Mean |F − F_model| in N, and in percent of the largest measured force",
        &[
            "muscle",
            "largest force (N)",
            "blocked force (N)",
            "held-out runs",
            "published formula",
            "contractions between others",
            "end contractions",
            "other lengths",
            "held-out contractions, with the stock",
            "other lengths, with the stock",
        ],
    );
    for one in all {
        let Some(any) = one.any() else { continue };
        let cell = |score: Option<&Score>| {
            score.map_or(String::new(), |s| {
                format!("{} N, {} %", fixed(s.mean(), 2), fixed(one.percent(s), 2))
            })
        };
        table.row([
            one.muscle.to_owned(),
            fixed(any.largest, 1),
            fixed(any.blocked, 1),
            cell(one.runs.map(|r| &r.table)),
            cell(any.published.as_ref()),
            cell(one.contractions.and_then(|c| c.between.as_ref())),
            cell(one.contractions.and_then(|c| c.ends.as_ref())),
            cell(one.length.map(|l| &l.score)),
            cell(one.stock.map(|s| &s.contractions).filter(|s| s.rows > 0.0)),
            cell(one.stock.map(|s| &s.length)),
        ]);
    }
    section.table(table);
    section.text(
        "The blocked force is friction-free, at rest length and the highest tested pressure, by the fit to all rows. The largest \
         measured force does not depend on a fit.",
    );
    if all.iter().any(|one| one.stock.is_some()) {
        section.text(
            "With the stock: all muscles are fitted together without what is predicted; ends that do not pull, and errors of lengths and \
             zeros, are estimated beside the shared force.",
        );
    }
    if let Some(name) = published {
        section.text(format!("The published formula is {name}, on the same rows as the held-out runs."));
    }
    section
}

/// One muscle: errors by recording and by place.
fn details(one: &Evaluated<'_>, several: bool) -> Section {
    let title =
        if several { format!("Where the error is: {}", one.muscle) } else { "Where the error is".to_owned() };
    let mut section = Section::new(title);
    if let Some(held) = one.any() {
        if several {
            section.figure(residual_table::figure(
                &format!("held-out-{}", one.muscle.replace(|c: char| !c.is_alphanumeric(), "-")),
                "Error of every recording when it was held out",
                "",
                &held.recordings,
            ));
        }
        residual_table::add(
            &mut section,
            "Residuals by recording, each when it was held out (F − F_model)",
            &held.recordings,
        );
    }
    let places = [
        ("run", one.runs.map(|r| r.spots.as_slice())),
        ("contraction", one.contractions.map(|c| c.spots.as_slice())),
        ("muscle", one.length.map(|l| l.spots.as_slice())),
    ];
    for (what, spots) in places {
        section.table(by_place(what, spots.unwrap_or_default()));
    }
    section
}

/// The mean error at each held contraction; empty for a muscle that moves.
fn by_place(what: &str, spots: &[Spot]) -> Table {
    /// More contractions than this are those of a moving muscle.
    const MOST: usize = 8;
    let mut contractions: Vec<i64> = spots.iter().map(|s| s.contraction).collect();
    contractions.sort_unstable();
    contractions.dedup();
    let mut table = Table::new(
        format!("Mean error by held-out {what} and contraction (N)"),
        &[&format!("held-out {what}"), "contraction", "filling or shortening", "emptying or lengthening"],
    );
    if contractions.len() > MOST {
        return table;
    }
    let mut left_out: Vec<&str> = spots.iter().map(|s| s.left_out.as_str()).collect();
    left_out.sort_by_key(|name| (name.len(), *name));
    left_out.dedup();
    for name in left_out {
        for c in &contractions {
            let at = |direction: i8| {
                let spot = spots
                    .iter()
                    .find(|s| s.left_out == name && s.contraction == *c && s.direction == direction);
                spot.map_or(String::new(), |s| fixed(s.score.bias(), 2))
            };
            let (up, down) = (at(1), at(-1));
            if !(up.is_empty() && down.is_empty()) {
                table.row([name.to_owned(), fixed(*c as f64 * 1e-3, 3), up, down]);
            }
        }
    }
    table
}
