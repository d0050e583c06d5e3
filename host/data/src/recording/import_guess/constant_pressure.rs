//! A pressure that is constant in each file and that no column has: in the names of the files, or in the lines above the table.

use regex_lite::{Regex, escape};

use super::names::RUNS;
use super::others::Others;
use super::sample::{Sample, SampleColumn};
use super::values::{PRESSURES, doubt};
use super::{Guess, GuessedPattern, Note};
use crate::recording::quantity::Unit;
use crate::recording::{Quantity, decimal};
use crate::short_number::short;

/// A number, with a decimal comma as well: names of files are written in every language.
pub(super) const NUMBER: &str = "[0-9]+(?:[.,][0-9]+)?";
/// A number whose decimal sign a file's name may not have: `2p05`, `2_05`, `2-05`.
const SPELLED: &str = "(?:0|[1-9][0-9]*)(?:[.,p_-][0-9]+)?";
/// Between a number and its unit.
pub(super) const GAP: &str = "[ _-]?";
/// A nominal pressure and the one that was set differ by less than this share.
const NOMINAL: f64 = 0.05;
/// Words of pressures that are not the muscle's, or that count from elsewhere.
const OTHERS: &str = "supply|source|line|tank|atmosph|ambient|barometric|abs|max|min|limit|burst|versorg|speise|netzdruck|luftdruck|umgebung|alimentation";
/// Words before a number that count recordings, beside those of columns that set runs apart.
const NUMBERING: &[&str] = &["r", "n", "no", "nr", "rep", "loop", "cycle", "zyklus", "m", "v"];

/// What was found in one place.
enum Found {
    /// An expression, what it catches in the first file (Pa), and what to check.
    Pattern { pattern: String, first: f64, check: String },
    /// Why none can be taken.
    Unclear(String),
}

/// Takes the pressure from the lines above the table or from the names of the files.
pub(super) fn find(sample: &Sample, others: &Others<'_>, guess: &mut Guess) {
    let columns = sample.columns.iter().filter(|c| !c.name.is_raw());
    let mut quantities = columns.filter_map(SampleColumn::quantity_by_name);
    // A column of pressure that cannot be read is a mistake in the file, and no reason to look elsewhere.
    if guess.has(Quantity::Pressure) || quantities.any(|quantity| quantity == Quantity::Pressure) {
        return;
    }
    let names: Vec<String> = std::iter::once(guess.file.clone()).chain(others.names()).collect();
    match (in_lines(&sample.preamble), in_names(&names)) {
        (Some(Found::Pattern { first: above, .. }), Some(Found::Pattern { first: name, .. }))
            if (above - name).abs() > NOMINAL * above.abs().max(name.abs()) =>
        {
            let text = format!(
                "the pressure is {} kPa by the lines above the table and {} kPa by the file's name: write the right one under [constants]",
                short(above * 1e-3),
                short(name * 1e-3)
            );
            guess.unknown.push(Note::on_quantity(Quantity::Pressure, text));
        }
        (Some(Found::Pattern { pattern, check, .. }), _) => {
            guess.checks.push(check.into());
            guess.patterns.push(caught_by("preamble", pattern));
        }
        (_, Some(Found::Pattern { pattern, check, .. })) => {
            guess.checks.push(check.into());
            guess.patterns.push(caught_by("file_name", pattern));
        }
        (above, name) => {
            let why = [above, name].into_iter().flatten().filter_map(|found| match found {
                Found::Unclear(why) => Some(Note::on_quantity(Quantity::Pressure, why)),
                Found::Pattern { .. } => None,
            });
            guess.unknown.extend(why);
        }
    }
}

/// A pressure that an expression catches in this text.
fn caught_by(text: &'static str, expression: String) -> GuessedPattern {
    GuessedPattern { quantity: Quantity::Pressure, text, expression }
}

/// The units, the longest first.
fn units() -> impl Iterator<Item = &'static Unit> {
    Quantity::Pressure.units().iter().rev()
}

/// Looks in the lines above the table.
fn in_lines(lines: &[String]) -> Option<Found> {
    let of_others = Regex::new(&format!("(?i){OTHERS}")).ok()?;
    let mut found: Vec<(f64, String, &'static str)> = Vec::new();
    let mut left_out: Option<&String> = None;
    for line in lines {
        let Some((value, pattern, unit)) = units().find_map(|unit| in_line(line, unit)) else { continue };
        if of_others.is_match(line) {
            left_out = left_out.or(Some(line));
        } else {
            found.push((value, pattern, unit));
        }
    }
    let Some((first, pattern, unit)) = found.first().cloned() else {
        return left_out.map(|line| {
            Found::Unclear(format!(
                "the line `{}` above the table may not be the muscle's pressure: if it is, write it under [constants]",
                line.trim()
            ))
        });
    };
    if found.iter().any(|(value, ..)| (value - first).abs() > NOMINAL * first) {
        let all: Vec<String> = found.iter().map(|(value, ..)| short(value * 1e-3)).collect();
        return Some(Found::Unclear(format!(
            "the lines above the table contain several pressures ({} kPa): write that of the muscle under [constants]",
            all.join(", ")
        )));
    }
    let check = format!("the pressure is taken from the lines above the table, in {unit}");
    Some(Found::Pattern { pattern, first, check })
}

/// The pressure of a line such as `Pressure (psi): 30` or `Druck: 2,5 bar`, Pa, with an expression that catches it.
fn in_line(line: &str, unit: &'static Unit) -> Option<(f64, String, &'static str)> {
    const WORD: &str = "pressure|pression|presi[oó]n|druck";
    let name = unit.name;
    let before = Regex::new(&format!(
        "(?i)^(.*?(?:{WORD})(?:[^0-9]*[^0-9a-z])?{name}g?(?:[^0-9a-z][^0-9]*?)?)({NUMBER})"
    ));
    let behind =
        Regex::new(&format!("(?i)^(.*?(?:{WORD})[^0-9]*?)({NUMBER})([\\s,;\"]*){name}g?(?:[^a-z]|$)"));
    // A tab of the first file may be a blank in the next.
    let quoted = |text: &str| escape(text).replace('\t', r"\s");
    let (caught, pattern) = if let Some(found) = before.ok()?.captures(line) {
        (found.get(2)?.as_str(), format!("{}(?<pressure_{name}>{NUMBER})", quoted(found.get(1)?.as_str())))
    } else {
        let found = behind.ok()?.captures(line)?;
        let (start, gap) = (quoted(found.get(1)?.as_str()), quoted(found.get(3)?.as_str()));
        (found.get(2)?.as_str(), format!("{start}(?<pressure_{name}>{NUMBER}){gap}{name}"))
    };
    Some((decimal::caught(caught)? * unit.scale, pattern, name))
}

/// A pressure that a file's name says.
struct Mention {
    /// As it is written.
    plain: f64,
    /// With what stands before it as the whole part.
    spelled: Option<Spelled>,
}

/// 2.05 of `2_05bar`.
struct Spelled {
    value: f64,
    sign: char,
    /// Whether the whole part may count recordings, such as the `3` of `run3_2bar`.
    counts: bool,
}

/// Looks in the names of the files.
fn in_names(names: &[String]) -> Option<Found> {
    let unit = units().find(|unit| !mentions(&names[0], unit.name).is_empty())?;
    let all: Vec<Vec<Mention>> =
        names.iter().map(|name| mentions(name, unit.name)).filter(|m| !m.is_empty()).collect();
    let places = all.iter().map(Vec::len).min().unwrap_or(0);
    let differs = |place: &usize| all.iter().any(|m| m[*place].plain != all[0][*place].plain);
    let varied: Vec<usize> = (0..places).filter(differs).collect();
    let place = match (places, varied.as_slice()) {
        (1, _) => 0,
        (_, [one]) => *one,
        _ => {
            let said: Vec<String> = all[0].iter().map(|m| short(m.plain)).collect();
            return Some(Found::Unclear(format!(
                "the names of the files contain several pressures ({} {}): catch that of the muscle by file_name",
                said.join(", "),
                unit.name
            )));
        }
    };
    let plain: Vec<f64> = all.iter().map(|m| m[place].plain).collect();
    let spelled: Vec<f64> =
        all.iter().map(|m| m[place].spelled.as_ref().map_or(m[place].plain, |s| s.value)).collect();
    let signed: Vec<&Spelled> = all.iter().filter_map(|m| m[place].spelled.as_ref()).collect();
    let plausible = |values: &[f64]| {
        let highest = values.iter().copied().fold(0.0, f64::max) * unit.scale;
        (PRESSURES.0..=PRESSURES.1).contains(&highest)
    };
    let as_spelled = match (signed.first(), plausible(&plain), plausible(&spelled)) {
        (None, ..) | (Some(_), true, false) => false,
        (Some(_), false, true) => true,
        _ if signed.iter().all(|s| s.counts) => false,
        (Some(one), ..) if one.sign == 'p' => true,
        (Some(one), ..) => {
            return Some(Found::Unclear(format!(
                "the pressure in the file's name may be {} or {} {}: write it with a decimal point, or catch it by file_name ({} in what is \
                 caught is read as the decimal sign)",
                short(plain[0]),
                short(spelled[0]),
                unit.name,
                one.sign
            )));
        }
    };
    let (number, values) = if as_spelled { (SPELLED, spelled) } else { (NUMBER, plain) };
    let first = values[0] * unit.scale;
    let (low, high) = values.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    let range = if low == high { short(low) } else { format!("{} to {}", short(low), short(high)) };
    let doubt = doubt(Quantity::Pressure, low * unit.scale, high * unit.scale);
    let doubt = doubt.map_or(String::new(), |d| format!("; {d}"));
    let of = if names.len() == 1 { "the file's name" } else { "the names of the files" };
    Some(Found::Pattern {
        pattern: pattern(unit.name, number, place),
        first,
        check: format!("the pressure is taken from {of}: {range} {}{doubt}", unit.name),
    })
}

/// An expression that catches the number behind `place` others.
fn pattern(unit: &str, number: &str, place: usize) -> String {
    let before = format!("(?:.*?{NUMBER}{GAP}(?i:{unit}))").repeat(place);
    format!("^{before}(?:|.*?[^0-9])(?<pressure_{unit}>{number}){GAP}(?i:{unit})(?:[^A-Za-z]|$)")
}

/// The numbers with this unit in a name.
fn mentions(name: &str, unit: &str) -> Vec<Mention> {
    let Ok(found) = Regex::new(&format!("({NUMBER}){GAP}(?i:{unit})(?:[^A-Za-z]|$)")) else {
        return Vec::new();
    };
    let mention = |captures: regex_lite::Captures<'_>| {
        let number = captures.get(1)?;
        let plain = decimal::caught(number.as_str())?;
        Some(Mention { plain, spelled: spelled(&name[..number.start()], number.as_str()) })
    };
    found.captures_iter(name).filter_map(mention).collect()
}

/// The number if what stands before it is its whole part: digits that are neither a count, such as the `01` of `01_205kPa`, nor part of a
/// date.
fn spelled(before: &str, fraction: &str) -> Option<Spelled> {
    let sign = before.chars().next_back().filter(|c| "p_-".contains(*c))?;
    let rest = &before[..before.len() - 1];
    let prefix = rest.trim_end_matches(|c: char| c.is_ascii_digit());
    let whole = &rest[prefix.len()..];
    let counts = whole.len() > 1 && whole.starts_with('0');
    if whole.is_empty() || counts || !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let bare = prefix.trim_end_matches(['_', '-', '.', ' ']);
    if bare.len() < prefix.len() && bare.ends_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let word = bare[bare.trim_end_matches(char::is_alphabetic).len()..].to_lowercase();
    let is_numbering = RUNS.contains(&word.as_str()) || NUMBERING.contains(&word.as_str());
    // `05bar` is written for no pressure of 5 bar.
    let counts = is_numbering && !(fraction.len() > 1 && fraction.starts_with('0'));
    Some(Spelled { value: format!("{whole}.{fraction}").parse().ok()?, sign, counts })
}
