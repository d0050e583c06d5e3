//! `host diagnose` with several muscles: a stock. Each `--muscle` is followed by its recordings.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};

use super::super::recordings::Recordings;
use super::super::reports;
use super::Arguments;
use crate::console::Console;
use crate::documents::{stock as document, text};
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_data::recording::{Campaign, Reader};
use pam_diagnose::stock::diagnose_stock;
use pam_fit::stock::Member;
use pam_report::{stock_page, stock_text};

/// Muscles on the command line, with the places of their recordings behind them.
#[derive(Debug, Clone, Default)]
pub struct Muscles {
    /// Descriptions, each with its place on the command line.
    described: Vec<(usize, PathBuf)>,
    /// Places of the recordings.
    files: Vec<usize>,
}

impl FromArgMatches for Muscles {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let places = |name: &str| matches.indices_of(name).map(Iterator::collect).unwrap_or_default();
        let paths = matches.get_many::<PathBuf>("muscle").into_iter().flatten().cloned();
        let at: Vec<usize> = places("muscle");
        Ok(Self { described: at.into_iter().zip(paths).collect(), files: places("files") })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for Muscles {
    fn augment_args(command: Command) -> Command {
        command.arg(
            Arg::new("muscle")
                .long("muscle")
                .value_name("M.toml")
                .action(ArgAction::Append)
                .value_parser(value_parser!(PathBuf))
                .required_unless_present("reference")
                .help(
                    "The muscle's description. With --reference it may be left out: any pneumatic actuator can be compared with itself. \
                     Three and more muscles of one stock, each followed by its recordings, are diagnosed together",
                ),
        )
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl Muscles {
    /// The description of the only muscle, or of the first.
    pub(super) fn first(&self) -> Option<&Path> {
        self.described.first().map(|(_, path)| path.as_path())
    }

    /// Whether a stock is given.
    pub(super) fn several(&self) -> bool {
        self.described.len() > 1
    }

    /// The recordings of each muscle: those between its description and the next one. `shared`: recordings behind the last description hold
    /// all muscles, and the import description selects the rows of each.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] for recordings before the first description, and for a muscle without recordings.
    fn groups(&self, files: &[PathBuf], shared: bool) -> Result<Vec<(&Path, Vec<PathBuf>)>> {
        let mut groups: Vec<(&Path, Vec<PathBuf>)> =
            self.described.iter().map(|(_, path)| (path.as_path(), Vec::new())).collect();
        for (place, file) in self.files.iter().zip(files) {
            let muscle = self.described.iter().rposition(|(at, _)| at < place).ok_or_else(|| {
                Error::new(DataCode::CallInvalid, "a recording stands before the first --muscle")
                    .file(file)
                    .help("put the recordings of each muscle behind its --muscle")
            })?;
            groups[muscle].1.push(file.clone());
        }
        let last = groups.len() - 1;
        if shared && groups[..last].iter().all(|(_, files)| files.is_empty()) {
            let all = groups[last].1.clone();
            groups.iter_mut().for_each(|(_, files)| files.clone_from(&all));
        }
        match groups.iter().find(|(_, files)| files.is_empty()) {
            Some((path, _)) => Err(Error::new(DataCode::CallInvalid, "no recording follows this --muscle")
                .file(path)
                .help("put the recordings of each muscle behind its --muscle")),
            None => Ok(groups),
        }
    }
}

/// Refuses options that belong to a single muscle.
fn check(arguments: &Arguments) -> Result<()> {
    let foreign = [
        ("--reference", !arguments.changed.reference.is_empty()),
        ("--table", arguments.table.is_some()),
        ("--check", !arguments.check.is_empty()),
        ("--with", !arguments.with.is_empty()),
        ("-o", arguments.output.is_some()),
        ("--next", arguments.next.is_some()),
    ];
    match foreign.iter().find(|f| f.1) {
        Some((option, _)) => {
            Err(Error::new(DataCode::CallInvalid, format!("{option} does not go with several muscles"))
                .help("diagnose one muscle at a time with it"))
        }
        None => Ok(()),
    }
}

/// Does what was requested. `taken`: standard output belongs to a file.
///
/// # Errors
/// Files that cannot be read or written, muscles that cannot be fitted together.
pub(super) fn run(arguments: &Arguments, console: &Console, taken: bool) -> Result<()> {
    check(arguments)?;
    let recordings = &arguments.recordings;
    let groups = arguments.muscles.groups(&recordings.files, recordings.import.is_some())?;
    let watched = if arguments.json.is_some() { Console::silent() } else { console.clone() };
    let mut read: Vec<(MuscleDescription, Campaign)> = Vec::new();
    let mut from = reports::provenance();
    for (path, files) in groups {
        let muscle = MuscleDescription::read(path)?;
        let own = Recordings { files, ..recordings.clone() };
        let (campaign, hashes) = own.read_hashed(Reader::of(&muscle), &watched)?;
        for warning in &campaign.warnings {
            console.warning(format!("{}: {warning}", muscle.name));
        }
        from = from.muscle(&muscle).files(&own.files, &hashes);
        read.push((muscle, campaign));
    }
    let members: Vec<Member<'_>> =
        read.iter().map(|(muscle, campaign)| Member { muscle, campaign }).collect();
    let answer = diagnose_stock(&members)?;
    if let Some(path) = &arguments.json {
        write_whole(path, (text(&document::of(&answer))? + "\n").as_bytes())?;
    }
    arguments.reports.write(console, &from, || stock_page::page(&answer))?;
    if arguments.json.as_deref().map(Path::as_os_str) != Some(OsStr::new("-")) {
        let words = stock_text::text(&answer);
        if taken { console.note(words.trim_end()) } else { console.result(words.trim_end()) }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &str) -> Arguments {
        Arguments::of(words.split(' ').map(Into::into).collect()).expect("a valid call")
    }

    fn groups(words: &str, shared: bool) -> Result<Vec<(String, usize)>> {
        let arguments = parsed(words);
        let groups = arguments.muscles.groups(&arguments.recordings.files, shared)?;
        Ok(groups.into_iter().map(|(m, f)| (m.display().to_string(), f.len())).collect())
    }

    #[test]
    fn recordings_belong_to_the_muscle_before_them() {
        let call = "diagnose --muscle a.toml 1.csv 2.csv --json x --muscle b.toml 3.csv --muscle c.toml 4.csv 5.csv 6.csv";
        let expected = [("a.toml", 2), ("b.toml", 1), ("c.toml", 3)].map(|(m, n)| (m.to_owned(), n));
        assert_eq!(groups(call, false).expect("groups"), expected);
    }

    #[test]
    fn a_muscle_without_recordings_is_refused_unless_one_file_holds_all() {
        let call = "diagnose --muscle a.toml --muscle b.toml 1.csv";
        assert!(groups(call, false).is_err());
        assert_eq!(groups(call, true).expect("groups").iter().map(|g| g.1).collect::<Vec<_>>(), [1, 1]);
        assert!(groups("diagnose 1.csv --muscle a.toml --muscle b.toml 2.csv", false).is_err());
    }

    #[test]
    fn one_muscle_stands_anywhere() {
        let arguments = parsed("diagnose 1.csv --muscle a.toml");
        assert!(!arguments.muscles.several());
        assert_eq!(arguments.muscles.first(), Some(Path::new("a.toml")));
    }
}
