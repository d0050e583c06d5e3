//! `host import`: an import description, by looking at a file.

use std::path::{Path, PathBuf};

use clap::Args;

use super::recordings::recording;
use crate::console::Console;
use crate::documents::{import as document, text};
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_data::pluralise::pluralise;
use pam_data::recording::import_guess::{Guess, guess_among};
use pam_data::recording::{Import, Quantity, Reader, Recording};
use pam_data::short_number::short;

/// At most this many different held strokes are listed.
const LISTED: usize = 8;
/// The rest length, m, that replaces an unknown one while a file is tried: only the stroke's zero depends on it.
const STAND_IN: f64 = 1.0;

/// Arguments of `host import`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host import --guess bench.csv -o bench.toml\n  \
    host import --guess march/*.txt -o bench.toml --muscle mini.toml\n  \
    host import --guess data.xlsx --sheet Run1 > bench.toml\n\n\
    The description is made from the first file, and all files are read by it. Check the units, signs and the list of open \
    points before you use it. Exit status 1: the files cannot be read by it yet; the open points say what is missing.")]
pub struct Arguments {
    /// The files to look at, of one bench.
    #[arg(long, required = true, num_args = 1.., value_name = "FILE", value_parser = recording, value_hint = clap::ValueHint::FilePath)]
    guess: Vec<PathBuf>,
    /// The description to write; without it, the description is printed, and what was understood goes to standard error.
    #[arg(short, long, value_name = "DESCRIPTION.toml")]
    output: Option<PathBuf>,
    /// The sheet of a workbook.
    #[arg(long, value_name = "SHEET")]
    sheet: Option<String>,
    /// The muscle's description, where files hold several muscles or give lengths.
    #[arg(long, value_name = "MUSCLE.toml")]
    muscle: Option<PathBuf>,
    /// Replace a description that is there.
    #[arg(long, alias = "force")]
    replace: bool,
    /// Print what was understood as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Guesses, writes, tries.
    ///
    /// # Errors
    /// A file that cannot be read or is not a table; one that the description does not suffice for.
    pub fn run(self, console: &Console) -> Result<()> {
        // A pipe gives its rows once, and they are read several times.
        let folder = tempfile::tempdir().map_err(|e| Error::unwritable(std::env::temp_dir(), &e))?;
        let files = self.guess.iter().map(|f| kept(f, folder.path())).collect::<Result<Vec<PathBuf>>>()?;
        let (Some((first, others)), Some(named)) = (files.split_first(), self.guess.first()) else {
            return Ok(());
        };
        if let Some(path) =
            self.output.as_deref().filter(|p| !self.replace && p.as_os_str() != "-" && p.exists())
        {
            return Err(Error::new(DataCode::CallInvalid, "the file already exists")
                .file(path)
                .help("choose another name with -o, or replace it with --replace"));
        }
        let muscle = self.muscle.as_ref().map(MuscleDescription::read).transpose()?;
        let usual = guess_needed(first, muscle.as_ref());
        let guessed = guess_among(first, others, self.sheet.as_deref())?;
        let import = Import::parse(&guessed.description)?;
        let under_its_name = |(file, named): (&PathBuf, &PathBuf)| {
            let read = tried(file, &import, &guessed, muscle.as_ref());
            read.map_err(|e| if file == named { e } else { e.file(named) })
        };
        let tried: Vec<Result<Vec<Recording>>> = files.iter().zip(&self.guess).map(under_its_name).collect();
        if let Some(path) = &self.output {
            write_whole(path, guessed.description.as_bytes())?;
        }
        let recordings: Vec<&Recording> = tried.iter().flatten().flatten().collect();
        if self.json {
            console.result(text(&to_document(&guessed, &recordings, usual))?);
        } else {
            let text = to_text(&guessed, &recordings, usual);
            let alone = self.output.as_deref().is_none_or(|p| p.as_os_str() == "-");
            if alone {
                console.note(text);
                if self.output.is_none() {
                    console.result(guessed.description.trim_end());
                }
            } else {
                console.result(text);
            }
        }
        if let Some(error) = tried.into_iter().find_map(Result::err) {
            return Err(error);
        }
        if let Some(path) = self.output.as_deref().filter(|p| p.as_os_str() != "-") {
            let muscle = self.muscle.as_deref().unwrap_or(Path::new("MUSCLE.toml"));
            let piped = first != named;
            console.note(format!(
                "written to {}; next: host fit --muscle {} --import {} {}",
                path.display(),
                quoted(muscle),
                quoted(path),
                if piped { "-".to_owned() } else { listed(&self.guess) }
            ));
        }
        Ok(())
    }
}

/// A path as a shell takes it: in quotation marks where it holds blanks or signs of the shell.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/\\:._-+=@%~,".contains(c);
    if text.chars().all(plain) {
        text
    } else if cfg!(windows) {
        format!("\"{text}\"")
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// The files for a command line; of many, the first and how many more.
fn listed(files: &[PathBuf]) -> String {
    let shown = if files.len() > LISTED { 1 } else { files.len() };
    let mut names: Vec<String> = files.iter().take(shown).map(|f| quoted(f)).collect();
    if files.len() > shown {
        names.push(format!("… (all {} files)", files.len()));
    }
    names.join(" ")
}

/// The file itself, or what a pipe gave, as a file in `folder`.
fn kept(path: &Path, folder: &Path) -> Result<PathBuf> {
    let piped = std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir());
    let (true, Some(name)) = (piped, path.file_name()) else { return Ok(path.to_owned()) };
    let copy = folder.join(name);
    let mut from = std::fs::File::open(path).map_err(|e| Error::unreadable(path, &e))?;
    let mut to = std::fs::File::create(&copy).map_err(|e| Error::unwritable(&copy, &e))?;
    std::io::copy(&mut from, &mut to).map_err(|e| Error::unreadable(path, &e))?;
    Ok(copy)
}

/// Whether a file is read without any description.
fn guess_needed(path: &Path, muscle: Option<&MuscleDescription>) -> bool {
    let file = std::fs::metadata(path).is_ok_and(|m| m.is_file());
    file && muscle.map_or_else(Reader::new, Reader::of).file(path).is_ok()
}

/// Reads a file by the guess. Where the muscle is not given, its rest length is that of the file's first row, or replaced.
fn tried(
    path: &Path,
    import: &Import,
    guessed: &Guess,
    muscle: Option<&MuscleDescription>,
) -> Result<Vec<Recording>> {
    let rest = guessed.columns.iter().find(|c| c.quantity == Quantity::RestLength);
    let first = rest.and_then(|c| Some((c.range?.0 * c.scale + c.offset) * c.quantity.unit(c.unit)?.scale));
    let longest = guessed.columns.iter().find(|c| c.quantity == Quantity::Length);
    let longest =
        longest.and_then(|c| Some((c.range?.1 * c.scale + c.offset) * c.quantity.unit(c.unit)?.scale));
    let reader = match muscle {
        Some(muscle) => Reader::of(muscle),
        None => match (first, guessed.list_of_runs()) {
            // The list of runs says the rest length of each.
            (None, Some(_)) if rest.is_some() => Reader::new(),
            (None, Some(_)) if guessed.has(Quantity::Displacement) => Reader::new(),
            _ => Reader::with_rest_length(first.or(longest).unwrap_or(STAND_IN)),
        },
    };
    reader.import(Some(import)).file(path)
}

fn to_text(guess: &Guess, recordings: &[&Recording], usual: bool) -> String {
    let mut text = format!("{}: {}", guess.file, pluralise(guess.rows, "row"));
    let delimiter = match guess.delimiter.as_deref() {
        Some("tab") => Some("tabs"),
        Some("comma") => Some("commas"),
        Some("semicolon") => Some("semicolons"),
        Some("space") => Some("blanks"),
        Some(_) => Some("bars"),
        None => None,
    };
    if let Some(sheet) = &guess.sheet {
        text += &format!(", sheet {sheet}");
    } else if let Some(delimiter) = delimiter {
        text += &format!(", cells separated by {delimiter}");
        text += if guess.decimal_comma { ", decimal commas" } else { ", decimal points" };
    }
    if guess.skip_lines > 0 {
        text += &format!(
            ", {} above the {}",
            pluralise(guess.skip_lines, "line"),
            if guess.header { "names" } else { "first row" }
        );
    }
    text.push('\n');
    for column in &guess.columns {
        let range = column.range.map_or(String::new(), |(a, b)| format!("{} to {}", short(a), short(b)));
        let factor = if column.scale == 1.0 { String::new() } else { format!(" × {}", short(column.scale)) };
        let name = column.quantity.name().replace('_', " ");
        text += &format!("  {name:<17} {:<28} {range}{factor} {}\n", column.header, column.unit);
    }
    for pattern in &guess.patterns {
        let place = if pattern.text == "file_name" { "the file's name" } else { "the lines above the table" };
        text += &format!("  {:<17} {place}: {}\n", pattern.quantity.name(), pattern.expression);
    }
    if !guess.unused.is_empty() {
        text += &format!("not used: {}\n", guess.unused.join(", "));
    }
    text += &of_recordings(guess, recordings);
    for (title, lines) in [("not understood", &guess.unknown), ("to check", &guess.checks)] {
        if !lines.is_empty() {
            text += &format!("{title}:\n");
            lines.iter().for_each(|line| text += &format!("  - {line}\n"));
        }
    }
    if usual && !guess.only_names() {
        text += "this file is read without an import description, too, but not with these signs, zeros and runs\n";
    } else if usual {
        text += "this file is read without an import description\n";
    }
    text.trim_end().to_owned()
}

/// How many recordings there are, how fast they were sampled, and which lengths were held.
fn of_recordings(guess: &Guess, recordings: &[&Recording]) -> String {
    let Some(first) = recordings.first() else { return String::new() };
    let mut text = pluralise(recordings.len(), "recording");
    if !guess.split_by.is_empty() {
        text += &format!(", set apart by {}", guess.split_by.join(" and "));
    }
    let rate = sample_rate(first);
    let seconds: f64 = recordings.iter().map(|r| r.duration()).sum();
    text += &format!("; {} rows per second, {} s in all\n", short(rate), short(seconds));
    let held = held_strokes(recordings);
    if !held.is_empty() {
        let count = recordings.iter().filter(|r| r.held_stroke().is_some()).count();
        let list: Vec<String> = held.iter().take(LISTED).map(|s| short(s * 1e3)).collect();
        let more = if held.len() > LISTED { ", …" } else { "" };
        let what = if guess.has(Quantity::Length) { "below the greatest length" } else { "of stroke" };
        text += &format!(
            "held length in {}: {}{more} mm {what}\n",
            pluralise(count, "recording"),
            list.join(", ")
        );
    }
    text
}

fn sample_rate(recording: &Recording) -> f64 {
    let steps = recording.len().saturating_sub(1) as f64;
    if recording.duration() > 0.0 { steps / recording.duration() } else { 0.0 }
}

/// The different strokes, m, that were held through whole recordings.
fn held_strokes(recordings: &[&Recording]) -> Vec<f64> {
    let mut held: Vec<f64> = recordings.iter().filter_map(|r| r.held_stroke()).collect();
    held.sort_by(f64::total_cmp);
    held.dedup_by(|a, b| (*a - *b).abs() <= pam_data::recording::HELD);
    held
}

fn to_document(guess: &Guess, recordings: &[&Recording], usual: bool) -> document::Import {
    let columns = guess.columns.iter().map(|c| document::Column {
        quantity: c.quantity.name(),
        column: c.header.clone(),
        unit: c.unit,
        scale: c.scale,
        offset: c.offset,
        low: c.range.map(|r| r.0),
        high: c.range.map(|r| r.1),
    });
    document::Import {
        schema: "pam-import/1",
        file: guess.file.clone(),
        usual: usual && guess.only_names(),
        rows: guess.rows,
        columns: columns.collect(),
        split_by: guess.split_by.clone(),
        recordings: recordings
            .iter()
            .map(|r| document::Recording {
                name: r.name.clone(),
                rows: r.len(),
                rows_per_s: sample_rate(r),
                held_stroke_mm: r.held_stroke().map(|s| s * 1e3),
            })
            .collect(),
        unused: guess.unused.clone(),
        unknown: guess.unknown.iter().map(ToString::to_string).collect(),
        checks: guess.checks.iter().map(ToString::to_string).collect(),
        description: guess.description.clone(),
    }
}
