//! From the columns of a file to recordings: filters, groups, stroke, and the checks that need whole columns.

mod held_lengths;
mod look_up;

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use self::held_lengths::held_lengths;
use super::blocks::Rows;
use super::cells::Want;
use super::column_plan::{ColumnPlan, Role};
use super::columns::Recording;
use super::decimal;
use super::import::{FoundZero, Import, NewRun, Value, Zero};
use super::plausibility::check;
use super::quantity::Quantity;
use super::read::FilterValues;
use super::stroke_zero::{at_largest, first_level, smallest};
use super::text_column::TextColumn;
use super::time_of_day;
use crate::error::{DataCode, Error, Result};
use crate::pluralise::pluralise;

/// A lookup table as text.
#[derive(Debug, Default)]
pub(super) struct LookupTable {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// Columns of a whole file, by what they are for.
struct Table {
    quantities: HashMap<Quantity, Vec<f64>>,
    /// Whether the times are times of day without a date.
    of_day: bool,
    splits: Vec<TextColumn>,
    filters: Vec<TextColumn>,
}

pub(super) struct Job<'a> {
    pub path: &'a Path,
    /// A recording has at least this many rows.
    pub min_rows: usize,
    /// L0 of the muscle that made it, m, where it is known.
    pub rest_length: Option<f64>,
    pub muscle_name: Option<&'a str>,
    pub import: &'a Import,
    pub filters: &'a [(String, Value)],
    /// Takes what the columns of the filters hold.
    pub filter_values: Option<&'a FilterValues>,
    pub plan: &'a ColumnPlan,
    pub names: &'a [String],
    pub lookup: Option<&'a LookupTable>,
    /// Line of the file that holds line 0 of the rows, counted from 1.
    pub first_line: u64,
    pub labels: Vec<(String, String)>,
}

/// Makes recordings of the rows of a file.
pub(super) fn assemble(job: &Job<'_>, mut rows: Rows) -> Result<Vec<Recording>> {
    if rows.rows < job.min_rows {
        let cause = match rows.rows {
            0 => "the file has no row below the header".to_owned(),
            1 => "there is one row only".to_owned(),
            n => format!("there are {n} rows only"),
        };
        let cause = match rows.skipped.len() {
            0 => cause,
            n => format!("{cause}, and {} without a number", pluralise(n, "row")),
        };
        return Err(Error::new(DataCode::RecordingTooShort, cause)
            .help(format!("a recording has at least {}", pluralise(job.min_rows, "row"))));
    }
    let mut table = sort_columns(job, &mut rows)?;
    let map = |row: usize| job.first_line + rows.map.line(row);
    if let Some(interval) = job.import.sample_interval_s
        && !table.quantities.contains_key(&Quantity::Time)
    {
        table
            .quantities
            .insert(Quantity::Time, (0..rows.rows).map(|i| rows.ordinal(i) as f64 * interval).collect());
    }
    for (quantity, value) in &job.plan.constants {
        table.quantities.insert(*quantity, vec![*value; rows.rows]);
    }
    set_zero(job, &mut table);
    let keep = keep(job, &table, rows.rows)?;
    let mut names = job.import.split_by.clone();
    if job.import.new_run == Some(NewRun::Clock)
        && let Some(time) = table.quantities.get(&Quantity::Time)
    {
        names.push("run".to_owned());
        table.splits.push(runs_of_clock(time));
    }
    if table.splits.is_empty() {
        let own = table.quantities.get(&Quantity::RestLength).and_then(|c| c.first().copied());
        let rest_length = job.rest_length.or(own);
        split_at_held_lengths(&mut table, &mut names, keep.as_deref(), job.plan.stroke, rest_length);
    }
    let groups = groups(&table.splits, keep.as_deref(), rows.rows);
    let mut recordings = Vec::with_capacity(groups.len());
    for (labels, group) in groups {
        let mut recording = take(job, &mut table, group, &names, &labels)?;
        recording.labels.extend(job.labels.iter().cloned());
        check(&recording, &map)?;
        recordings.push(recording);
    }
    if let Some(first) = recordings.first_mut() {
        first.skipped = rows.skipped.len();
    }
    Ok(recordings)
}

fn sort_columns(job: &Job<'_>, rows: &mut Rows) -> Result<Table> {
    let plan = job.plan;
    let mut table = Table {
        quantities: HashMap::new(),
        of_day: false,
        splits: vec![TextColumn::default(); job.import.split_by.len()],
        filters: vec![TextColumn::default(); job.filters.len()],
    };
    let mut keys: HashMap<usize, TextColumn> = HashMap::new();
    let (mut stamp, mut parts) = (None, Vec::new());
    for (i, role) in plan.roles.iter().enumerate() {
        let texts = std::mem::take(&mut rows.texts[i]);
        match role {
            Role::Quantity(q) => {
                table.quantities.insert(*q, std::mem::take(&mut rows.numbers[i]));
                if let Want::Stamp { scale, offset, .. } = plan.wanted[i].want {
                    stamp = Some((scale, offset));
                }
            }
            Role::TimePart => parts.push(i),
            Role::Coded(q, values) => {
                let name = &job.names[plan.wanted[i].index];
                let code = |row: usize| {
                    let word = texts.get(row).trim();
                    values.get(word).copied().ok_or_else(|| {
                        let known: Vec<_> = values.keys().map(|k| format!("`{k}`")).collect();
                        Error::new(
                            DataCode::RecordingNotANumber,
                            format!("a word without a value for {}", q.name()),
                        )
                        .line(job.first_line + rows.map.line(row))
                        .column(name)
                        .value(word)
                        .help(format!("the import description knows {}", known.join(", ")))
                    })
                };
                table.quantities.insert(*q, (0..rows.rows).map(code).collect::<Result<_>>()?);
            }
            Role::Split(n) => table.splits[*n] = texts,
            Role::Filter(n) => table.filters[*n] = texts,
            Role::Key(n) => {
                keys.insert(*n, texts);
            }
        }
    }
    if let Some(times) = table.quantities.get_mut(&Quantity::Time) {
        for part in parts {
            times.iter_mut().zip(&rows.numbers[part]).for_each(|(time, part)| *time += part);
        }
        if let Some((scale, offset)) = stamp {
            table.of_day = time_of_day::are(times, scale, offset);
            time_of_day::past_midnight(times, scale, offset);
        }
    }
    if !plan.looked_up.is_empty()
        && let Some(lookup) = job.lookup
    {
        look_up::look_up(job, rows, &mut table, &keys, lookup)?;
    }
    Ok(table)
}

/// Whether two cells say the same: as numbers when both are, else as text.
pub(super) fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.trim(), b.trim());
    a == b
        || matches!((number(a), number(b)), (Some(x), Some(y)) if (x - y).abs() <= 1e-9 * x.abs().max(y.abs()))
}

/// Whether a muscle's name is this word, or ends in it as a word: `festo10-29cm` is called `29cm`.
fn is_called(name: &str, word: &str) -> bool {
    let before = name.trim().strip_suffix(word);
    !word.is_empty() && before.is_some_and(|b| b.chars().next_back().is_none_or(|c| !c.is_alphanumeric()))
}

fn number(text: &str) -> Option<f64> {
    decimal::prefix(text.as_bytes(), b'.').and_then(|(v, used)| (used == text.len()).then_some(v))
}

/// Moves the zero of a displacement to where the muscle has its rest length.
fn set_zero(job: &Job<'_>, table: &mut Table) {
    let Some(zero) = job.import.described(Quantity::Displacement).and_then(|c| c.zero) else { return };
    let force = table.quantities.get(&Quantity::Force);
    let Some(stroke) = table.quantities.get(&Quantity::Displacement) else { return };
    let at = match zero {
        Zero::At(reading) => {
            // The reading is in the column's unit, before the sign; both are in the plan's scale.
            let scale = job.plan.roles.iter().zip(&job.plan.wanted).find_map(|(role, wanted)| {
                match (role, wanted.want) {
                    (Role::Quantity(Quantity::Displacement), Want::Number { scale, .. }) => Some(scale),
                    _ => None,
                }
            });
            let own = job.import.described(Quantity::Displacement).map_or(1.0, |c| c.scale);
            scale.map_or(0.0, |s| reading * s / own)
        }
        Zero::Found(FoundZero::First) => first_level(stroke),
        Zero::Found(FoundZero::Longest) => smallest(stroke),
        Zero::Found(FoundZero::LargestForce) => {
            force.map_or_else(|| first_level(stroke), |f| at_largest(stroke, f))
        }
    };
    if at.is_finite()
        && let Some(stroke) = table.quantities.get_mut(&Quantity::Displacement)
    {
        stroke.iter_mut().for_each(|s| *s -= at);
    }
}

/// At most this many values of a column are listed in an error.
const LISTED_VALUES: usize = 20;

/// Which rows the filters keep; `None` when all.
fn keep(job: &Job<'_>, table: &Table, rows: usize) -> Result<Option<Vec<bool>>> {
    if job.filters.is_empty() {
        return Ok(None);
    }
    let mut keep = vec![true; rows];
    let mut rest_length = false;
    for ((name, value), texts) in job.filters.iter().zip(&table.filters) {
        rest_length |= value.is_of_length();
        if let Some(values) = job.filter_values {
            values.note(name, &texts.dictionary);
        }
        let fits = |word: &String| passes(job, name, value, word);
        let verdicts: Vec<bool> = texts.dictionary.iter().map(fits).collect::<Result<_>>()?;
        for (kept, code) in keep.iter_mut().zip(&texts.codes) {
            *kept &= verdicts[*code as usize];
        }
    }
    if keep.iter().any(|k| *k) {
        return Ok(Some(keep));
    }
    let list = |(texts, (name, _)): (&TextColumn, &(String, Value))| {
        let mut values: Vec<String> = texts.dictionary.iter().take(LISTED_VALUES).cloned().collect();
        if texts.dictionary.len() > LISTED_VALUES {
            values.push(format!("and {} more", texts.dictionary.len() - LISTED_VALUES));
        }
        format!("{name} is one of {}", values.join(", "))
    };
    let has: Vec<String> = table.filters.iter().zip(job.filters).map(list).collect();
    let muscle = match (rest_length, job.rest_length) {
        (true, Some(rest)) => format!(" for a muscle of {} mm", (rest * 1e6).round() / 1e3),
        _ => String::new(),
    };
    Err(Error::new(DataCode::RecordingTooShort, format!("no row passes the filters{muscle}"))
        .help(format!("in the file, {}", has.join("; "))))
}

/// Whether a cell passes a filter.
///
/// # Errors
/// A filter for the muscle's rest length without one.
fn passes(job: &Job<'_>, name: &str, value: &Value, word: &str) -> Result<bool> {
    Ok(match value {
        Value::Number(n) => number(word.trim()).is_some_and(|w| (w - n).abs() <= 1e-9 * n.abs().max(1e-3)),
        Value::Text(t) if t == "{rest_length_mm}" => {
            let rest = job.rest_length.ok_or_else(|| needs_rest_length(name))? * 1e3;
            // A tape measure is good to half a per cent at best; muscles of one shelf differ by more.
            number(word.trim()).is_some_and(|w| (w - rest).abs() <= 5e-3 * rest)
        }
        Value::Text(t) if t == "{name}" => job.muscle_name.is_some_and(|n| is_called(n, word.trim())),
        Value::Text(t) => same(t, word),
        Value::AnyOf(values) => {
            for value in values {
                if passes(job, name, value, word)? {
                    return Ok(true);
                }
            }
            false
        }
        Value::Not { not } => !passes(job, name, not, word)?,
    })
}

fn needs_rest_length(what: &str) -> Error {
    Error::new(DataCode::RecordingRestLength, format!("`{what}` needs the muscle's rest length"))
        .help("give the muscle's description (--muscle) or its table (--table)")
}

/// The run of each row, counted from 1: one begins where the clock goes back.
fn runs_of_clock(time: &[f64]) -> TextColumn {
    let mut runs = TextColumn::default();
    let mut run = 1_usize;
    let mut word = run.to_string();
    for (row, now) in time.iter().enumerate() {
        if row > 0 && *now < time[row - 1] {
            run += 1;
            word = run.to_string();
        }
        runs.push(&word);
    }
    runs
}

/// Splits a file that holds several lengths, one after another, where nothing else splits it. `rest_length` in m, where it is known.
fn split_at_held_lengths(
    table: &mut Table,
    names: &mut Vec<String>,
    keep: Option<&[bool]>,
    stroke: Option<Quantity>,
    rest_length: Option<f64>,
) {
    let stroke = stroke.unwrap_or(Quantity::Displacement);
    // A contraction is a share of the rest length.
    let metres = if stroke == Quantity::Contraction { rest_length } else { Some(1.0) };
    let (Some(column), Some(pressure), Some(metres)) =
        (table.quantities.get(&stroke), table.quantities.get(&Quantity::Pressure), metres)
    else {
        return;
    };
    // Hundredths of a millimetre or of a percent; without the sign of a zero.
    let hundredths = |value: f64| (1e2 * value).round() / 1e2 + 0.0;
    let label = |length: f64| match stroke {
        Quantity::Contraction => format!("{} %", hundredths(1e2 * length / metres)),
        _ => format!("{} mm", hundredths(1e3 * length)),
    };
    let kept = |column: &[f64], factor: f64| -> Vec<f64> {
        let all = column.iter().enumerate().filter(|(row, _)| keep.is_none_or(|k| k[*row]));
        all.map(|(_, value)| factor * value).collect()
    };
    let columns = if keep.is_none() && metres == 1.0 {
        held_lengths(column, pressure, label)
    } else {
        held_lengths(&kept(column, metres), &kept(pressure, 1.0), label)
    };
    if let Some(columns) = columns {
        names.extend([stroke.name().to_owned(), "run".to_owned()]);
        table.splits.extend(columns.map(|column| match keep {
            Some(keep) => spread(&column, keep),
            None => column,
        }));
    }
}

/// A column of the kept rows as one of all rows.
fn spread(kept: &TextColumn, keep: &[bool]) -> TextColumn {
    let mut all = TextColumn::default();
    let mut next = 0;
    for k in keep {
        all.push(if *k { kept.get(next) } else { "" });
        next += usize::from(*k);
    }
    all
}

type Group = (Vec<String>, Option<Vec<u32>>);

/// The rows of each recording, in the order of first appearance; `None` when a recording is the whole file.
fn groups(splits: &[TextColumn], keep: Option<&[bool]>, rows: usize) -> Vec<Group> {
    if splits.is_empty() {
        let all = keep.map(|k| (0..rows as u32).filter(|r| k[*r as usize]).collect());
        return vec![(Vec::new(), all)];
    }
    let mut index: HashMap<Vec<u32>, usize> = HashMap::new();
    let mut groups: Vec<(Vec<String>, Vec<u32>)> = Vec::new();
    let mut last: Option<(Vec<u32>, usize)> = None;
    for row in (0..rows).filter(|r| keep.is_none_or(|k| k[*r])) {
        let code: Vec<u32> = splits.iter().map(|w| w.codes.get(row).copied().unwrap_or(0)).collect();
        let at = match &last {
            Some((previous, at)) if *previous == code => *at,
            _ => *index.entry(code.clone()).or_insert_with(|| {
                groups.push((splits.iter().map(|w| w.get(row).trim().to_owned()).collect(), Vec::new()));
                groups.len() - 1
            }),
        };
        groups[at].1.push(row as u32);
        last = Some((code, at));
    }
    groups.into_iter().map(|(labels, rows)| (labels, Some(rows))).collect()
}

/// The rows as a range, where they follow one another.
fn contiguous(rows: &[u32]) -> Option<Range<usize>> {
    let first = *rows.first()? as usize;
    let follow = rows.windows(2).all(|pair| pair[1] == pair[0] + 1);
    follow.then_some(first..first + rows.len())
}

fn take(
    job: &Job<'_>,
    table: &mut Table,
    rows: Option<Vec<u32>>,
    names: &[String],
    labels: &[String],
) -> Result<Recording> {
    let stretch = rows.as_deref().and_then(contiguous);
    let time_of_day = table.of_day;
    let mut column = |quantity: Quantity| match (&rows, &stretch) {
        // The whole file: its columns move over without a copy.
        (None, _) => table.quantities.remove(&quantity),
        (_, Some(stretch)) => {
            table.quantities.get(&quantity).and_then(|c| c.get(stretch.clone())).map(<[f64]>::to_vec)
        }
        (Some(rows), None) => table
            .quantities
            .get(&quantity)
            .map(|c| rows.iter().filter_map(|r| c.get(*r as usize).copied()).collect()),
    };
    let stroke_source = job.plan.stroke.unwrap_or(Quantity::Displacement);
    let mut stroke: Vec<f64> = column(stroke_source).unwrap_or_default();
    let own_rest: Option<Vec<f64>> = column(Quantity::RestLength);
    let own_rest = own_rest.as_ref().and_then(|c| c.first().copied());
    if let (Some(own), Some(muscle)) = (own_rest, job.rest_length)
        && (own - muscle).abs() > 0.02 * muscle
    {
        let cause = format!(
            "the rest length is {} mm in the file and {} mm for the muscle",
            (own * 1e6).round() / 1e3,
            (muscle * 1e6).round() / 1e3
        );
        return Err(Error::new(DataCode::RecordingOutOfRange, cause)
            .help("keep the rows of this muscle by [where] in the import description"));
    }
    let rest_length = job.rest_length.or(own_rest);
    let needed = || rest_length.ok_or_else(|| needs_rest_length(stroke_source.name()));
    match stroke_source {
        Quantity::Length => {
            let rest = needed()?;
            stroke.iter_mut().for_each(|l| *l = rest - *l);
        }
        Quantity::Contraction => {
            let rest = needed()?;
            stroke.iter_mut().for_each(|c| *c *= rest);
        }
        _ => {}
    }
    let stem = job.path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let labels: Vec<_> = names.iter().cloned().zip(labels.iter().cloned()).collect();
    let name = if labels.is_empty() {
        stem
    } else {
        let list: Vec<_> = labels.iter().map(|(k, v)| format!("{k}={v}")).collect();
        format!("{stem} [{}]", list.join(", "))
    };
    let cycle = column(Quantity::Cycle).map(|c| c.iter().map(|v| v.round().clamp(0.0, 4e9) as u32).collect());
    let direction = column(Quantity::Direction)
        .map(|d: Vec<f64>| d.iter().map(|v| if *v > 0.0 { 1 } else { -i8::from(*v < 0.0) }).collect());
    Ok(Recording {
        name,
        source: job.path.to_path_buf(),
        labels,
        rest_length,
        time: column(Quantity::Time).unwrap_or_default(),
        time_of_day,
        pressure: column(Quantity::Pressure).unwrap_or_default(),
        stroke,
        force: column(Quantity::Force),
        temperature: column(Quantity::Temperature),
        pressure_command: column(Quantity::PressureCommand),
        cycle,
        direction,
        rows,
        skipped: 0,
    })
}
