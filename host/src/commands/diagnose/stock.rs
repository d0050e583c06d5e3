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
    /// Import descriptions, each with its place.
    imports: Vec<(usize, PathBuf)>,
    /// Places of the recordings.
    files: Vec<usize>,
}

/// A muscle with its recordings.
struct Group<'a> {
    muscle: &'a Path,
    import: Option<&'a Path>,
    files: Vec<PathBuf>,
}

impl FromArgMatches for Muscles {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let places = |name: &str| -> Vec<usize> {
            matches.indices_of(name).map(Iterator::collect).unwrap_or_default()
        };
        let placed = |name: &str| {
            let paths = matches.get_many::<PathBuf>(name).into_iter().flatten().cloned();
            places(name).into_iter().zip(paths).collect()
        };
        Ok(Self { described: placed("muscle"), imports: placed("import"), files: places("files") })
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

/// The option `--import`, which may be given for each muscle.
pub(super) fn several_imports(import: Arg) -> Arg {
    import.action(ArgAction::Append).help(
        "How to read files that are not in the usual form: an import description. With several muscles, one import description is for all \
         of them; of several, each is for the muscle that it follows, and one before the first muscle for the others",
    )
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

    /// The recordings of each muscle: those between its description and the next one. Where recordings are behind the last description only,
    /// they hold all muscles, and an import description selects the rows of each.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] for recordings before the first description, for a muscle without recordings, and for one with two import
    /// descriptions.
    fn groups(&self, files: &[PathBuf]) -> Result<Vec<Group<'_>>> {
        let mut groups = Vec::new();
        for (m, (_, muscle)) in self.described.iter().enumerate() {
            groups.push(Group { muscle, import: self.import(m)?, files: Vec::new() });
        }
        for (place, file) in self.files.iter().zip(files) {
            let muscle = self.before(*place).ok_or_else(|| {
                Error::new(DataCode::CallInvalid, "a recording stands before the first --muscle")
                    .file(file)
                    .help("put the recordings of each muscle behind its --muscle")
            })?;
            groups[muscle].files.push(file.clone());
        }
        let last = groups.len() - 1;
        if !self.imports.is_empty() && groups[..last].iter().all(|g| g.files.is_empty()) {
            let all = groups[last].files.clone();
            groups.iter_mut().for_each(|g| g.files.clone_from(&all));
        }
        match groups.iter().find(|g| g.files.is_empty()) {
            Some(g) => Err(Error::new(DataCode::CallInvalid, "no recording follows this --muscle")
                .file(g.muscle)
                .help("put the recordings of each muscle behind its --muscle")),
            None => Ok(groups),
        }
    }

    /// The muscle whose description is the last before a place on the command line.
    fn before(&self, place: usize) -> Option<usize> {
        self.described.iter().rposition(|(at, _)| *at < place)
    }

    /// The import description of a muscle: the only one of the call, that behind its description, or that before all descriptions.
    fn import(&self, muscle: usize) -> Result<Option<&Path>> {
        let of = |owner: Option<usize>| -> Result<Option<&Path>> {
            let mut own = self.imports.iter().filter(|(place, _)| self.before(*place) == owner);
            match (own.next(), own.next()) {
                (_, Some((_, second))) => Err(two_imports(second)),
                (first, None) => Ok(first.map(|(_, path)| path.as_path())),
            }
        };
        match self.imports.as_slice() {
            [(_, only)] => Ok(Some(only)),
            _ => Ok(of(Some(muscle))?.or(of(None)?)),
        }
    }

    /// Refuses several import descriptions for a single muscle.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`].
    pub(super) fn one_import(&self) -> Result<()> {
        self.imports.get(1).map_or(Ok(()), |(_, second)| Err(two_imports(second)))
    }
}

fn two_imports(second: &Path) -> Error {
    Error::new(DataCode::CallInvalid, "a second import description for the recordings of one muscle")
        .file(second)
        .help("give one --import for each --muscle, or one for all")
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
    let groups = arguments.muscles.groups(&recordings.files)?;
    let watched = if arguments.json.is_some() { Console::silent() } else { console.clone() };
    let mut read: Vec<(MuscleDescription, Campaign)> = Vec::new();
    let mut from = reports::provenance();
    for Group { muscle, import, files } in groups {
        let muscle = MuscleDescription::read(muscle)?;
        let own = Recordings { files, import: import.map(Path::to_path_buf), ..recordings.clone() };
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
        let text = stock_text::text(&answer);
        if taken { console.note(text.trim_end()) } else { console.result(text.trim_end()) }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Arguments {
        Arguments::of(line.split(' ').map(Into::into).collect()).expect("a valid call")
    }

    type Grouped = Vec<(String, Option<String>, usize)>;

    fn groups(line: &str) -> Result<Grouped> {
        let arguments = parsed(line);
        let groups = arguments.muscles.groups(&arguments.recordings.files)?;
        let text = |path: &Path| path.display().to_string();
        Ok(groups.into_iter().map(|g| (text(g.muscle), g.import.map(text), g.files.len())).collect())
    }

    fn expected<const N: usize>(groups: [(&str, Option<&str>, usize); N]) -> Grouped {
        groups.map(|(m, i, f)| (m.to_owned(), i.map(str::to_owned), f)).to_vec()
    }

    #[test]
    fn recordings_belong_to_the_muscle_before_them() {
        let call = "diagnose --muscle a.toml 1.csv 2.csv --json x --muscle b.toml 3.csv --muscle c.toml 4.csv 5.csv 6.csv";
        let all = [("a.toml", None, 2), ("b.toml", None, 1), ("c.toml", None, 3)];
        assert_eq!(groups(call).expect("groups"), expected(all));
    }

    #[test]
    fn one_import_is_for_all_muscles_and_several_are_for_those_that_they_follow() {
        let only = groups("diagnose --muscle a 1.csv --import x --muscle b 2.csv").expect("groups");
        assert_eq!(only, expected([("a", Some("x"), 1), ("b", Some("x"), 1)]));
        let call = "diagnose --import x --muscle a 1.csv --muscle b --import y 2.csv 3.csv --muscle c 4.csv";
        let of_each = [("a", Some("x"), 1), ("b", Some("y"), 2), ("c", Some("x"), 1)];
        assert_eq!(groups(call).expect("groups"), expected(of_each));
        let two = groups("diagnose --muscle a 1.csv --muscle b --import x --import y 2.csv");
        assert!(two.is_err_and(|e| e.to_string().contains("second import description")));
        assert!(parsed("diagnose --muscle a 1.csv --import x --import y").muscles.one_import().is_err());
    }

    #[test]
    fn a_muscle_without_recordings_is_refused_unless_one_file_holds_all() {
        let call = "diagnose --muscle a.toml --muscle b.toml 1.csv";
        assert!(groups(call).is_err());
        let all = groups(&format!("{call} --import x")).expect("groups");
        assert_eq!(all, expected([("a.toml", Some("x"), 1), ("b.toml", Some("x"), 1)]));
        assert!(groups("diagnose 1.csv --muscle a.toml --muscle b.toml 2.csv").is_err());
    }

    #[test]
    fn one_muscle_is_accepted_at_any_position() {
        let arguments = parsed("diagnose 1.csv --muscle a.toml");
        assert!(!arguments.muscles.several());
        assert_eq!(arguments.muscles.first(), Some(Path::new("a.toml")));
    }
}
