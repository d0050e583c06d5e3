//! Which column is which quantity, in which unit, and what is not known.

use std::path::Path;

use super::lookup;
use super::names::{Family, Name, Score, is_of_matrix};
use super::others::Others;
use super::sample::{Sample, SampleColumn};
use super::text::quoted;
use super::{
    Guess, GuessedColumn, Note, Source, absolute, constant_pressure, file_name_length, problems, runs,
    side_by_side, stroke, time, values,
};
use crate::error::Result;
use crate::pluralise::pluralise;
use crate::recording::Quantity;
use crate::recording::time_of_day::DAY;
use crate::short_number::short;

/// Decides on every column.
///
/// # Errors
/// Other files whose columns are not those of the first.
pub(super) fn assign(path: &Path, sample: &Sample, others: &Others<'_>) -> Result<Guess> {
    let mut guess = Guess {
        file: path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
        rows: sample.rows,
        whole: sample.whole,
        header: sample.has_header,
        sheet: sample.sheet.clone(),
        checks: sample.notes.clone(),
        unknown: sample.unclear.clone(),
        ..Guess::default()
    };
    if let Some(layout) = &sample.layout {
        guess.delimiter = sample.sheet.is_none().then(|| layout.delimiter_name().to_owned());
        guess.decimal_comma = layout.decimal_comma;
        let remarks = layout.remarks || layout.comment == b'#' && others.have_remarks();
        guess.remarks = remarks.then(|| char::from(layout.comment));
        guess.thousands = sample.thousands.map(char::from);
        guess.skip_lines =
            if sample.has_header { layout.names_at.unwrap_or(layout.data_at) } else { layout.data_at };
    }
    let mut used = vec![false; sample.columns.len()];
    for quantity in [
        Quantity::Time,
        Quantity::Pressure,
        Quantity::Displacement,
        Quantity::Length,
        Quantity::Contraction,
        Quantity::RestLength,
        Quantity::Force,
        Quantity::Temperature,
        Quantity::PressureCommand,
        Quantity::Cycle,
    ] {
        let stroke = [Quantity::Displacement, Quantity::Length, Quantity::Contraction];
        if stroke.contains(&quantity) && stroke.iter().any(|q| guess.has(*q)) {
            continue;
        }
        if let Some(n) = best(sample, quantity, &used, others, &mut guess)
            && let Some(column) = described(sample, n, quantity, others, &mut guess)
        {
            used[n] = true;
            guess.columns.push(column);
        }
    }
    time::find(sample, &mut used, &mut guess);
    time::describe_parts(sample, &mut used, &mut guess);
    time::interval(sample, &mut guess);
    problems::texts(sample, &mut guess);
    constant_pressure::find(sample, others, &mut guess);
    find_runs(path, sample, &mut used, &mut guess);
    file_name_length::find(others, &mut guess);
    stroke::judge(sample, others, &mut guess);
    absolute::ask(sample, &mut guess);
    let several = side_by_side::find(sample, &mut used, &mut guess);
    if !several {
        problems::incomplete_rows(sample, &mut guess);
    }
    problems::other_columns(sample, others, &guess)?;
    guess.unused = (0..used.len()).filter(|n| !used[*n]).filter_map(|n| called(sample, n)).collect();
    // Of recordings side by side that are not described nothing is.
    if !several || guess.side_by_side.is_some() {
        what_is_missing(sample, &mut guess);
    }
    Ok(guess)
}

/// What a column is called in messages; `None` for an empty one without a name.
fn called(sample: &Sample, n: usize) -> Option<String> {
    let column = &sample.columns[n];
    let empty = column.missing == column.numbers.len();
    match column.header.as_str() {
        "" if empty => None,
        "" => Some(format!("column {}", n + 1)),
        header => Some(header.to_owned()),
    }
}

/// Where a column is, for the description: by name where the reader finds that name once.
pub(super) fn source(sample: &Sample, n: usize) -> Source {
    let header = &sample.columns[n].header;
    let once = sample.columns.iter().filter(|c| c.header == *header).count() == 1;
    if sample.has_header && once && !header.is_empty() {
        Source::Named(header.clone())
    } else {
        Source::Number(n + 1)
    }
}

/// The column that fits a quantity best.
fn best(
    sample: &Sample,
    quantity: Quantity,
    used: &[bool],
    others: &Others<'_>,
    guess: &mut Guess,
) -> Option<usize> {
    let fits = |(n, c): (usize, &SampleColumn)| -> Option<(Score, usize)> {
        let (q, score) = c.name.quantity()?;
        let part = sample.joined.is_some_and(|j| j.fraction.is_some_and(|(part, _)| part == n));
        (q == quantity && c.is_numeric() && !used[n] && !part).then_some((score, n))
    };
    let mut found: Vec<(Score, usize)> = sample.columns.iter().enumerate().filter_map(fits).collect();
    // A load cell that reads one value throughout is not connected.
    let dead = |n: usize| quantity == Quantity::Force && values::is_constant(&sample.columns[n]);
    // A pressure that is the same in all files is that of the supply, where another one differs.
    let steady = |n: usize| quantity == Quantity::Pressure && is_steady(&sample.columns[n], others);
    found.sort_by_cached_key(|(score, n)| (dead(*n), -score, steady(*n), *n));
    let (score, first) = *found.first()?;
    if quantity == Quantity::Time && time::is_unclear(sample, &found, guess) {
        return None;
    }
    let competitors: Vec<usize> = found[1..].iter().filter(|(s, _)| *s == score).map(|(_, n)| *n).collect();
    if !competitors.is_empty() {
        let header = &sample.columns[first].header;
        // Columns of one name differ in their numbers only.
        let twice = competitors.iter().any(|n| sample.columns[*n].header == *header);
        let name = |n: usize| {
            let header = &sample.columns[n].header;
            if twice { format!("column {} ({header})", n + 1) } else { header.clone() }
        };
        let header = name(first);
        let competitors: Vec<String> = competitors.into_iter().map(name).collect();
        if quantity == Quantity::PressureCommand {
            let text = format!(
                "commanded pressures are in {header}, {}: describe that of this muscle as columns.pressure_command",
                competitors.join(", ")
            );
            guess.checks.push(text.into());
            return None;
        }
        guess.checks.push(Note::on_choice(format!(
            "{} is taken from {header}; {} could be meant, too",
            quantity.name().replace('_', " "),
            competitors.join(", ")
        )));
    }
    Some(first)
}

/// Whether all files hold the same value in this column, except for noise.
fn is_steady(column: &SampleColumn, others: &Others<'_>) -> bool {
    /// Share of the largest value: a regulator holds its supply within some per cent, and levels of a campaign differ by more.
    const SAME: f64 = 0.05;
    let own = column.range();
    let (low, high) = others
        .ranges(&column.header)
        .iter()
        .fold(own, |(low, high), other| (low.min(other.low), high.max(other.high)));
    high - low <= SAME * high.abs().max(low.abs())
}

/// A column in its unit; `None` where it cannot be used.
fn described(
    sample: &Sample,
    n: usize,
    quantity: Quantity,
    others: &Others<'_>,
    guess: &mut Guess,
) -> Option<GuessedColumn> {
    let column = &sample.columns[n];
    let header = &column.header;
    let on_column = |text: String| Note::on_column(header, Some(quantity), text);
    let found = match unit_of(column, quantity, others) {
        Ok(found) => found,
        Err(unknown) => {
            guess.unknown.push(on_column(unknown));
            return None;
        }
    };
    guess.checks.extend(found.check.map(&on_column));
    let (unit, mut scale, mut offset) = (found.unit, found.scale, found.offset);
    let (low, high) = column.range();
    if quantity == Quantity::Pressure && column.name.absolute() {
        // Standard atmosphere; the pressure of the day differs by a few per cent of it.
        offset -= quantity.unit(unit).map_or(0.0, |u| absolute::ATMOSPHERE / u.scale);
        guess
            .checks
            .push(on_column(format!("{header} is absolute pressure: one standard atmosphere is subtracted")));
    }
    if quantity == Quantity::Contraction && column.name.is_relative_length() {
        (scale, offset) = (-scale, 1.0);
    } else if quantity == Quantity::Contraction && column.is_mostly_negative() {
        scale = -scale;
        guess.checks.push(on_column(format!(
            "{header} is negative where it is largest: its sign is reversed, so that shortening is positive"
        )));
    }
    let si = |v: f64| quantity.unit(unit).map_or(v, |u| (v * scale + offset) * u.scale);
    if let Some(doubt) = values::doubt(quantity, si(low), si(high)) {
        if quantity == Quantity::Contraction {
            guess.unknown.push(on_column(format!("{header}: {doubt}")));
            return None;
        }
        guess.checks.push(on_column(format!("{header}: {doubt}")));
    }
    if quantity == Quantity::Force && column.is_mostly_negative() && scale > 0.0 {
        scale = -scale;
        guess.checks.push(on_column(format!(
            "{header} is negative where it is largest: its sign is reversed, so that pulling is positive"
        )));
    }
    Some(GuessedColumn {
        quantity,
        source: source(sample, n),
        header: header.clone(),
        unit,
        scale,
        offset,
        extension: quantity == Quantity::Displacement && column.name.lengthens(),
        from_longest: false,
        values: Vec::new(),
        date: None,
        fraction: None,
        range: Some((low, high)),
    })
}

/// The unit of a column.
struct GuessedUnit {
    unit: &'static str,
    scale: f64,
    offset: f64,
    /// What the user must check.
    check: Option<String>,
}

/// The unit of a column; as an error, why it is not known.
fn unit_of(column: &SampleColumn, quantity: Quantity, others: &Others<'_>) -> Result<GuessedUnit, String> {
    let (header, what) = (&column.header, quantity.name().replace('_', " "));
    let plain = GuessedUnit { unit: "", scale: 1.0, offset: 0.0, check: None };
    if column.name.is_raw() {
        let unit = column.name.unit.map_or("", |u| u.text);
        return Err(format!(
            "{header} looks like {what} in {unit}: describe it with the scale and the offset of the sensor's calibration"
        ));
    }
    if let Some(spelled) = column.name.unit {
        let (unit, scale, offset) = (spelled.unit, spelled.scale, spelled.offset);
        return Ok(GuessedUnit { unit, scale, offset, check: None });
    }
    if let Some(text) = &column.name.unknown_unit {
        return Err(format!("{header} looks like {what}, but its unit `{text}` is not known"));
    }
    if quantity == Quantity::Contraction && largest(column, others) > 1.0 {
        let reached = short(largest(column, others));
        let check = format!("{header} is taken as per cent, since it reaches {reached}");
        return Ok(GuessedUnit { scale: 0.01, check: Some(check), ..plain });
    }
    if quantity.units().len() <= 1 {
        return Ok(plain);
    }
    let Some(suggested) = values::suggested(quantity, column, &others.ranges(header)) else {
        let (low, high) = column.range();
        return Err(format!(
            "{header} looks like {what}, but neither its name nor its values ({} to {}) show the unit",
            short(low),
            short(high)
        ));
    };
    let (unit, scale) = (suggested.unit, suggested.scale);
    let offset = if scale == DAY { values::epoch_of_days(column) } else { 0.0 };
    let others = if suggested.others.is_empty() {
        String::new()
    } else {
        format!(" (or {})", suggested.others.join(", "))
    };
    let check = format!("{header} has no unit; its values look like {}{others}", suggested.spelled());
    Ok(GuessedUnit { unit, scale, offset, check: Some(check) })
}

/// The largest number of a column in all files, of either sign.
fn largest(column: &SampleColumn, others: &Others<'_>) -> f64 {
    let (low, high) = column.range();
    let all = others.ranges(&column.header);
    all.iter().map(|r| r.high.max(-r.low)).fold(high.max(-low), f64::max)
}

/// Labels, directions, the list of runs and the muscles of a file.
fn find_runs(path: &Path, sample: &Sample, used: &mut [bool], guess: &mut Guess) {
    for (n, column) in sample.columns.iter().enumerate() {
        if let Some(values) = runs::directions(column).filter(|_| !guess.has(Quantity::Direction)) {
            used[n] = true;
            guess.columns.push(GuessedColumn {
                quantity: Quantity::Direction,
                source: source(sample, n),
                header: column.header.clone(),
                unit: "",
                scale: 1.0,
                offset: 0.0,
                extension: false,
                from_longest: false,
                values,
                date: None,
                fraction: None,
                range: None,
            });
        }
    }
    let name_of = |n: usize| match source(sample, n) {
        Source::Named(name) | Source::Listed(name) => name,
        Source::Number(n) => n.to_string(),
    };
    let time = guess.columns.iter().find(|c| c.quantity == Quantity::Time);
    let time = time.and_then(|t| (0..sample.columns.len()).find(|n| source(sample, *n) == t.source));
    let (splits, left) = time.map(|t| runs::splits(&sample.columns, t)).unwrap_or_default();
    if left > 0
        && let Some(t) = time
    {
        let clock = &sample.columns[t];
        guess.new_run_by_clock = problems::wraps(clock).is_none() && runs::by_clock(clock);
        if guess.new_run_by_clock {
            let text = format!(
                "{} begins again at {}: a recording begins there",
                clock.header,
                pluralise(left, "row")
            );
            guess.checks.push(text.into());
        } else {
            problems::clock(clock, left, guess);
        }
    }
    for n in splits {
        used[n] = true;
        guess.split_by.push(name_of(n));
    }
    let stroke = [Quantity::Displacement, Quantity::Length, Quantity::Contraction];
    if !stroke.iter().any(|q| guess.has(*q))
        && let Some(listed) = lookup::find(path, &sample.columns)
    {
        guess.unknown.retain(|note| !note.is_on_quantity(Quantity::Contraction));
        for (quantity, header, name) in &listed.quantities {
            guess.columns.push(from_list(*quantity, header, name));
        }
        guess.checks.push(format!("the mounted length of each run is taken from {}", listed.file).into());
        guess.lookup = Some(listed);
    }
    several_muscles(sample, guess);
}

fn from_list(quantity: Quantity, header: &str, name: &Name) -> GuessedColumn {
    let unit = name.unit.filter(|u| u.family != Family::Raw);
    GuessedColumn {
        quantity,
        source: Source::Listed(header.to_owned()),
        header: header.to_owned(),
        unit: unit.map_or("", |u| u.unit),
        scale: unit.map_or(1.0, |u| u.scale),
        offset: 0.0,
        extension: quantity == Quantity::Displacement && name.lengthens(),
        from_longest: false,
        values: Vec::new(),
        date: None,
        fraction: None,
        range: None,
    }
}

/// A file of several muscles needs a filter for the one that is described.
fn several_muscles(sample: &Sample, guess: &mut Guess) {
    let lengths = guess.columns.iter().find(|c| c.quantity == Quantity::RestLength).cloned();
    let Some(lengths) = lengths else { return };
    let column = sample.columns.iter().find(|c| c.header == lengths.header);
    let Some(levels) = column.and_then(|c| c.levels.as_ref()).filter(|l| l.words.len() > 1) else { return };
    let text = format!(
        "the file holds muscles of {} rest lengths ({}): the description takes the rows of the muscle that is fitted",
        levels.words.len(),
        list(&levels.words)
    );
    guess.checks.push(text.into());
    if lengths.unit == "mm" && lengths.scale == 1.0 {
        guess.filters.push((lengths.header, "{rest_length_mm}".to_owned()));
    }
    let named = sample.columns.iter().find(|c| {
        let more = c.levels.as_ref().is_some_and(|l| l.words.len() > levels.words.len());
        more && c.texts > 0
            && c.name.words.iter().any(|w| ["muscle", "muskel", "specimen", "sample"].contains(&w.as_str()))
    });
    if let Some(name) = named {
        let words = name.levels.as_ref().map(|l| l.words.clone()).unwrap_or_default();
        let text = format!(
            "some of them share a rest length: choose one by --where {}=NAME ({})",
            name.header,
            list(&words)
        );
        guess.checks.push(text.into());
    }
}

fn list(words: &[String]) -> String {
    const SHOWN: usize = 8;
    let more = if words.len() > SHOWN { ", …" } else { "" };
    format!("{}{more}", words.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", "))
}

/// What a recording needs and the file does not say.
fn what_is_missing(sample: &Sample, guess: &mut Guess) {
    if !guess.has(Quantity::Force)
        && let Some(column) = sample.columns.iter().find(|c| is_of_matrix(&c.header))
    {
        let text = format!(
            "the columns of a matrix have no names: write which is what, such as column = {} and unit = \"s\" under [columns.time]",
            quoted(&column.header)
        );
        guess.unknown.push(text.into());
        return;
    }
    let is_noted =
        |guess: &Guess, quantity: Quantity| guess.unknown.iter().any(|note| note.is_on_quantity(quantity));
    if !guess.has(Quantity::Time) && guess.sample_interval_s.is_none() && !is_noted(guess, Quantity::Time) {
        let text = "no column of time: where the rows are equally spaced, write sample_interval_s = SECONDS";
        guess.unknown.insert(0, text.into());
    }
    let caught = |guess: &Guess, quantity: Quantity| guess.patterns.iter().any(|p| p.quantity == quantity);
    let pressure = Quantity::Pressure;
    if !guess.has(pressure) && !caught(guess, pressure) && !is_noted(guess, pressure) {
        let text = "no column of pressure: where it is constant, write it as pressure_kPa under [constants], or catch it from the \
                    names of the files by file_name = '(?<pressure_kPa>[0-9.]+)'";
        guess.unknown.push(text.into());
    }
    let stroke = [Quantity::Displacement, Quantity::Length, Quantity::Contraction];
    let stroke_is_noted = stroke.iter().any(|q| is_noted(guess, *q));
    if !stroke.iter().any(|q| guess.has(*q) || caught(guess, *q)) && !stroke_is_noted {
        let text = "no column of displacement, length or contraction: where the length is held, write it as length_mm \
                    under [constants], or give the files of all lengths, whose names say it; if several columns of force each belong to a \
                    length, use [grid] (book, File formats)";
        guess.unknown.push(text.into());
    }
    if !guess.has(Quantity::Force) && !is_noted(guess, Quantity::Force) {
        guess.unknown.push("no column of force: a fit and a diagnosis need it".into());
    }
    if !sample.whole {
        guess.checks.push(format!("the first {} rows were read", sample.rows).into());
    }
}
