//! The guess as an import description.

use std::fmt::Write;

use super::{Guess, GuessedColumn, GuessedPattern, Source};

/// Quotes a text for TOML.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A regular expression between the quotes that need no escapes, where it has none of its own.
fn literal(text: &str) -> String {
    if text.contains('\'') || text.chars().any(char::is_control) { quoted(text) } else { format!("'{text}'") }
}

/// A key of a table, bare where TOML allows that.
fn key(text: &str) -> String {
    let bare = !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { text.to_owned() } else { quoted(text) }
}

/// A number that TOML reads as a float.
fn number(value: f64) -> String {
    let text = format!("{value}");
    if text.contains('.') { text } else { format!("{text}.0") }
}

/// The text of the description, with the open points as remarks.
pub(super) fn description(guess: &Guess) -> String {
    let mut out = format!(
        "# Import description of {}, written from its contents. Check the units and signs.\n",
        guess.file
    );
    for line in guess.unknown.iter().chain(&guess.checks) {
        let _ = writeln!(out, "# - {line}");
    }
    out += &file_form(guess);
    for column in &guess.columns {
        out += &column_table(column);
    }
    for (column, value) in &guess.filters {
        let _ = writeln!(
            out,
            "\n# Takes the rows of the muscle whose description is given.\n[where]\n{} = {}",
            key(column),
            quoted(value)
        );
    }
    if let Some((recordings, columns)) = guess.side_by_side {
        let _ = writeln!(out, "\n[side_by_side]\nrecordings = {recordings}\ncolumns = {columns}");
    }
    if let Some(lookup) = &guess.lookup {
        let keys: Vec<String> =
            lookup.keys.iter().map(|(theirs, own)| format!("{} = {}", key(theirs), quoted(own))).collect();
        let _ =
            writeln!(out, "\n[lookup]\nfile = {}\nmatch = {{ {} }}", quoted(&lookup.file), keys.join(", "));
    }
    out
}

/// How to read the file: sheet, header, delimiter, parts.
fn file_form(guess: &Guess) -> String {
    let mut out = format!("description = {}\n", quoted(&format!("files such as {}", guess.file)));
    if let Some(sheet) = &guess.sheet {
        let _ = writeln!(out, "sheet = {}", quoted(sheet));
    }
    if guess.skip_lines > 0 {
        let _ = writeln!(out, "skip_lines = {}", guess.skip_lines);
    }
    if !guess.header {
        out += "header = false\n";
    }
    if let Some(delimiter) = &guess.delimiter {
        let _ = writeln!(out, "delimiter = {}", quoted(delimiter));
    }
    if guess.decimal_comma {
        out += "decimal = \"comma\"\n";
    }
    if let Some(separator) = guess.thousands {
        let _ = writeln!(out, "thousands = {}", quoted(&separator.to_string()));
    }
    if let Some(sign) = guess.remarks {
        let _ = writeln!(out, "comment = {}", quoted(&sign.to_string()));
    }
    if guess.skip_missing {
        out += "missing = \"skip\"\n";
    }
    if let Some(interval) = guess.sample_interval_s {
        let _ = writeln!(out, "sample_interval_s = {}", number(interval));
    }
    for GuessedPattern { text, expression, .. } in &guess.patterns {
        let _ = writeln!(out, "{text} = {}", literal(expression));
    }
    if !guess.split_by.is_empty() {
        let list: Vec<String> = guess.split_by.iter().map(|n| quoted(n)).collect();
        let _ = writeln!(out, "split_by = [{}]", list.join(", "));
    }
    if guess.new_run_by_clock {
        out += "new_run = \"clock\"\n";
    }
    out
}

/// The table of one quantity.
fn column_table(column: &GuessedColumn) -> String {
    let of = |source: &Source| match source {
        Source::Number(n) => n.to_string(),
        Source::Named(name) | Source::Listed(name) => quoted(name),
    };
    let reference = of(&column.source);
    let note = if matches!(column.source, Source::Number(_)) && column.header.parse::<usize>().is_err() {
        format!("          # {}", column.header)
    } else {
        String::new()
    };
    let mut out = format!("\n[columns.{}]\ncolumn = {reference}{note}\n", column.quantity.name());
    if !column.unit.is_empty() {
        let _ = writeln!(out, "unit = {}", quoted(column.unit));
    }
    if let Some(date) = &column.date {
        let _ = writeln!(out, "date = {}", of(date));
    }
    if let Some((fraction, unit)) = &column.fraction {
        let _ = writeln!(out, "fraction = {{ column = {}, unit = {} }}", of(fraction), quoted(unit));
    }
    if column.scale != 1.0 {
        let _ = writeln!(out, "scale = {}", number(column.scale));
    }
    if column.offset != 0.0 {
        let _ = writeln!(out, "offset = {}", number(column.offset));
    }
    if column.extension {
        out += "positive = \"extension\"\n";
    }
    if column.from_longest {
        out += "zero = \"longest\"\n";
    }
    if !column.values.is_empty() {
        let list: Vec<String> = column.values.iter().map(|(w, v)| format!("{} = {v}", key(w))).collect();
        let _ = writeln!(out, "values = {{ {} }}", list.join(", "));
    }
    out
}
