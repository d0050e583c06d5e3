//! Which columns of a file are read, and as what.

use std::collections::BTreeMap;

use super::cells::{Want, Wanted};
use super::import::{Column, ColumnRef, Import, constant};
use super::quantity::{HeaderName, Quantity, Unit, parse_header, usual_name};
use crate::error::{DataCode, Error, Result, nearest};

/// What a column that is read is for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Role {
    /// A quantity in SI.
    Quantity(Quantity),
    /// A quantity given as words, with the value of each word in SI units.
    Coded(Quantity, BTreeMap<String, f64>),
    /// What is added to the time, s: its date, or its parts of a second.
    TimePart,
    /// The n-th column that sets recordings apart.
    Split(usize),
    /// The n-th row filter.
    Filter(usize),
    /// The n-th key of the lookup table.
    Key(usize),
}

/// A column that is read from the lookup table instead of the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LookedUp {
    pub index: usize,
    pub role: Role,
    pub want: Want,
}

/// What is read of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ColumnPlan {
    /// In ascending order of index.
    pub wanted: Vec<Wanted>,
    /// One per requested column.
    pub roles: Vec<Role>,
    /// From the lookup table.
    pub looked_up: Vec<LookedUp>,
    /// Constants of the whole file, SI.
    pub constants: Vec<(Quantity, f64)>,
    /// Which of displacement, length and contraction gives the stroke.
    pub stroke: Option<Quantity>,
}

/// What is known beside the header.
pub(super) struct Context<'a> {
    pub import: &'a Import,
    /// Whether there is an import description at all.
    pub foreign: bool,
    /// Constants from the file's name and its skipped lines, by header name.
    pub constants: Vec<(String, f64)>,
    /// Row filters: column and what to compare with (only the column matters here).
    pub filters: Vec<String>,
    /// The header of the lookup table.
    pub lookup: Option<&'a [String]>,
}

enum Found {
    Here(usize),
    LookedUp(usize),
}

impl Context<'_> {
    fn find(&self, names: &[String], column: &ColumnRef) -> Result<Found> {
        match column {
            ColumnRef::Number(number) if (1..=names.len()).contains(number) => Ok(Found::Here(number - 1)),
            ColumnRef::Number(number) => Err(Error::new(
                DataCode::ImportInvalid,
                format!("the import description names column {number}, but the file has {}", names.len()),
            )),
            ColumnRef::Name(name) => self.find_name(names, name),
        }
    }

    /// As [`Self::find`], of a column that only the file itself can have.
    fn find_here(&self, names: &[String], column: &ColumnRef) -> Result<Found> {
        match self.find(names, column)? {
            Found::LookedUp(_) => Err(missing(&column.to_string(), std::iter::empty(), names)),
            here => Ok(here),
        }
    }

    fn find_name(&self, names: &[String], name: &str) -> Result<Found> {
        let mut hits = names.iter().enumerate().filter(|(_, n)| *n == name).map(|(i, _)| i);
        match (hits.next(), hits.next()) {
            (Some(_), Some(_)) => Err(duplicate(name, name)),
            (Some(index), None) => Ok(Found::Here(index)),
            (None, _) => {
                if let Some(index) = self.lookup.and_then(|l| l.iter().position(|n| n == name)) {
                    return Ok(Found::LookedUp(index));
                }
                // Without a header the columns are called 1, 2, 3 …
                let help = match nearest(name, names.iter().map(String::as_str)) {
                    Some(near) => format!("did you mean `{near}`? {}", found(names)),
                    None => found(names),
                };
                Err(Error::new(DataCode::RecordingMissingColumn, format!("there is no column `{name}`"))
                    .help(help))
            }
        }
    }
}

/// Decides what to read of a file with these column names.
pub(super) fn plan(names: &[String], context: &Context<'_>) -> Result<ColumnPlan> {
    let mut plan = ColumnPlan::default();
    for (name, value) in context.import.constants.iter().map(|(n, v)| (n, *v)).chain(named_constants(context))
    {
        let (quantity, unit) = constant(name)?;
        plan.constants.push((quantity, value * unit.scale + unit.offset));
    }
    let mut columns: Vec<(Found, Role, Want)> = Vec::new();
    let constant = |q: Quantity, plan: &ColumnPlan| plan.constants.iter().any(|(c, _)| *c == q);
    for name in context.import.columns.keys() {
        let Some(quantity) = Quantity::IN_HEADERS
            .into_iter()
            .chain([Quantity::Direction, Quantity::RestLength])
            .find(|q| q.name() == name)
        else {
            continue;
        };
        let Some(column) = context.import.described(quantity) else { continue };
        let at = context.find(names, &column.column)?;
        let (role, want) = described(quantity, column);
        columns.push((at, role, want));
        let date =
            column.date.as_ref().zip(column.stamp(quantity)).map(|(c, order)| (c, Want::Date { order }));
        let fraction = column.fraction.as_ref().and_then(|f| Some((&f.column, f.scale()?)));
        let fraction = fraction.map(|(c, scale)| (c, Want::Number { scale, offset: 0.0 }));
        for (part, want) in date.into_iter().chain(fraction) {
            columns.push((context.find_here(names, part)?, Role::TimePart, want));
        }
    }
    plan.stroke = stroke_source(names, context, &plan)?;
    for quantity in Quantity::IN_HEADERS {
        let stroke = matches!(quantity, Quantity::Displacement | Quantity::Length | Quantity::Contraction);
        let given = context.import.described(quantity).is_some() || constant(quantity, &plan);
        if given || (stroke && plan.stroke != Some(quantity)) {
            continue;
        }
        if quantity == Quantity::Time && context.import.sample_interval_s.is_some() {
            continue;
        }
        let required = matches!(quantity, Quantity::Time | Quantity::Pressure);
        match usual(names, quantity)? {
            Usual::Column(index, unit) => {
                let want = Want::Number { scale: unit.scale, offset: unit.offset };
                columns.push((Found::Here(index), Role::Quantity(quantity), want));
            }
            Usual::UnknownUnit(name) if required || !context.foreign => {
                return Err(unknown_unit(quantity, name));
            }
            Usual::Absent if required => return Err(missing(quantity.name(), quantity.headers(), names)),
            Usual::UnknownUnit(_) | Usual::Absent => {}
        }
    }
    let texts = context.import.split_by.iter().enumerate().map(|(i, n)| (n, Role::Split(i)));
    let filters = context.filters.iter().enumerate().map(|(i, n)| (n, Role::Filter(i)));
    for (name, role) in texts.chain(filters) {
        columns.push((context.find_name(names, name)?, role, Want::Text));
    }
    if let Some(lookup) = &context.import.lookup {
        for (i, name) in lookup.keys.values().enumerate().filter(|(_, n)| *n != "{file}") {
            match context.find_name(names, name)? {
                Found::Here(index) => columns.push((Found::Here(index), Role::Key(i), Want::Text)),
                Found::LookedUp(_) => return Err(missing(name, std::iter::empty(), names)),
            }
        }
    }
    for (found, role, want) in columns {
        match found {
            Found::Here(index) => {
                let at = plan.wanted.partition_point(|w| w.index <= index);
                plan.wanted.insert(at, Wanted { index, want });
                plan.roles.insert(at, role);
            }
            Found::LookedUp(index) => plan.looked_up.push(LookedUp { index, role, want }),
        }
    }
    Ok(plan)
}

fn named_constants<'a>(context: &'a Context<'_>) -> impl Iterator<Item = (&'a String, f64)> {
    context.constants.iter().map(|(n, v)| (n, *v))
}

fn described(quantity: Quantity, column: &Column) -> (Role, Want) {
    let from_name = match &column.column {
        ColumnRef::Name(name) => name.rsplit_once('_').and_then(|(_, unit)| quantity.unit(unit)),
        ColumnRef::Number(_) => None,
    };
    let stated = column.unit.as_deref().and_then(|u| quantity.unit(u));
    let unit = stated.or(from_name).unwrap_or(Unit { name: "", scale: 1.0, offset: 0.0 });
    if let Some(values) = &column.values {
        let convert = |v: f64| (v * column.scale + column.offset) * unit.scale + unit.offset;
        let values = values.iter().map(|(word, value)| (word.clone(), convert(*value))).collect();
        return (Role::Coded(quantity, values), Want::Text);
    }
    if let Some(order) = column.stamp(quantity) {
        let want = Want::Stamp { scale: column.scale, offset: column.offset, order };
        return (Role::Quantity(quantity), want);
    }
    // The sign of a displacement is part of the scale; its zero is found later, in SI.
    let sign = if column.positive == Some(super::import::Positive::Extension) { -1.0 } else { 1.0 };
    let want = Want::Number {
        scale: sign * column.scale * unit.scale,
        offset: sign * column.offset * unit.scale + unit.offset,
    };
    (Role::Quantity(quantity), want)
}

fn stroke_source(names: &[String], context: &Context<'_>, plan: &ColumnPlan) -> Result<Option<Quantity>> {
    let sources = [Quantity::Displacement, Quantity::Length, Quantity::Contraction];
    let described: Vec<_> = sources
        .into_iter()
        .filter(|q| context.import.described(*q).is_some() || plan.constants.iter().any(|(c, _)| c == q))
        .collect();
    match described.as_slice() {
        [one] => return Ok(Some(*one)),
        [] => {}
        [first, second, ..] => {
            return Err(Error::new(
                DataCode::ImportInvalid,
                format!("{} and {} both give the stroke", first.name(), second.name()),
            )
            .help("describe one of displacement, length and contraction"));
        }
    }
    let mut unknown = None;
    for quantity in sources {
        match usual(names, quantity)? {
            Usual::Column(..) => return Ok(Some(quantity)),
            Usual::UnknownUnit(name) => unknown = unknown.or(Some((quantity, name))),
            Usual::Absent => {}
        }
    }
    match unknown {
        Some((quantity, name)) => Err(unknown_unit(quantity, name)),
        None => Err(missing(
            "displacement, length or contraction",
            sources.into_iter().flat_map(Quantity::headers),
            names,
        )),
    }
}

enum Usual<'a> {
    Column(usize, Unit),
    UnknownUnit(&'a str),
    Absent,
}

/// Looks for a quantity under its usual header name.
fn usual(names: &[String], quantity: Quantity) -> Result<Usual<'_>> {
    let mut found: Option<(usize, Unit)> = None;
    let mut unknown = None;
    for (index, name) in names.iter().enumerate() {
        match parse_header(name) {
            HeaderName::Known(q, unit) if q == quantity => {
                if let Some((first, _)) = found {
                    return Err(duplicate(&names[first], name));
                }
                found = Some((index, unit));
            }
            // `cycle_count` and the like are other columns: these quantities have no unit to be unknown.
            HeaderName::UnknownUnit(q) if q == quantity && q.units().len() > 1 => {
                unknown = unknown.or(Some(name.as_str()))
            }
            _ => {}
        }
    }
    Ok(match (found, unknown) {
        (Some((index, unit)), _) => Usual::Column(index, unit),
        (None, Some(name)) => Usual::UnknownUnit(name),
        (None, None) => Usual::Absent,
    })
}

fn unknown_unit(quantity: Quantity, name: &str) -> Error {
    let usual = usual_name(name);
    let cause = match usual.strip_prefix(quantity.name()) {
        Some("") => format!("the column `{name}` has no unit"),
        Some(unit) => format!("unknown unit `{}` of {}", unit.trim_start_matches('_'), quantity.name()),
        None => format!("unknown unit of {}", quantity.name()),
    };
    let headers: Vec<_> = quantity.headers().collect();
    // The correction covers the spelling of a unit, not another unit.
    let near = headers.iter().find(|h| h.eq_ignore_ascii_case(&usual));
    let mut help = format!("the unit follows the last underscore: {}", quantity.unit_list());
    match near {
        Some(near) => help = format!("did you mean `{near}`? {help}"),
        None => help += "; any other is a factor in an import description (--import)",
    }
    Error::new(DataCode::RecordingUnknownUnit, cause).column(name).help(help)
}

fn duplicate(first: &str, second: &str) -> Error {
    let cause = if first == second {
        format!("two columns are called `{first}`")
    } else {
        format!("`{first}` and `{second}` both give the same quantity")
    };
    Error::new(DataCode::RecordingDuplicateColumn, cause)
        .column(second)
        .help("keep one of them, or name one otherwise")
}

fn missing(what: &str, headers: impl Iterator<Item = String>, names: &[String]) -> Error {
    let headers: Vec<_> = headers.collect();
    let near = names.iter().find_map(|n| Some((n, nearest(n, headers.iter().map(String::as_str))?)));
    let mut help = found(names);
    if let [only] = names
        && let Some(delimiter) =
            [(';', "semicolons"), ('|', "bars"), (' ', "blanks")].iter().find(|d| only.contains(d.0))
    {
        help = format!(
            "the cells seem to be separated by {}; use commas or tabs, or state it in an import description (--import)",
            delimiter.1
        );
    } else if let Some((name, near)) = near {
        help = format!("did you mean `{near}` by `{name}`? {help}");
    } else if !headers.is_empty() {
        help = format!(
            "{help}; one of these columns is required: {}, or an import description (--import) that says which column it is",
            headers.join(", ")
        );
    }
    Error::new(DataCode::RecordingMissingColumn, format!("no column of {what}")).help(help)
}

fn found(names: &[String]) -> String {
    let mut list: Vec<String> =
        names.iter().take(12).map(|n| n.chars().take(40).flat_map(char::escape_debug).collect()).collect();
    if names.len() > 12 {
        list.push(format!("and {} more", names.len() - 12));
    }
    format!("the file has the columns {}", list.join(", "))
}
