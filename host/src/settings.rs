//! The settings file: values of options that are not given, so that a bench's port and muscle are written once.
//!
//! ```toml
//! # pam.toml
//! port = "/dev/ttyACM0"          # for every command that has --port
//! muscle = "mini.toml"           # a path is taken from the folder of this file
//!
//! [fit]
//! order = 3                      # for `host fit` only
//! ```
//!
//! An option takes its value from the first of: the command line; the environment (`PAM_PORT`); the nearest `pam.toml`, in the
//! folder where the program runs or one above it; the user's own `pam/pam.toml` in the configuration folder; the built-in
//! default. The environment variable `PAM_SETTINGS` names another file in place of both, and none when it is empty.

use std::any::TypeId;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, Command};
use toml::de::{DeTable, DeValue};

use crate::error::HostCode;
use pam_data::bounds;
use pam_data::error::{DataCode, Error, Result, nearest};
use pam_data::toml_errors::toml_error;

/// The name of the file.
pub const NAME: &str = "pam.toml";

/// Options that must be meant each time they are used.
const NEVER: [&str; 8] = ["force", "pressure", "stroke", "angle", "replace", "clear", "help", "version"];

/// One setting, found and understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The command that it is for, such as `fit` or `device log`; empty: every command that has the option.
    pub command: String,
    /// The option, without dashes.
    pub option: String,
    /// Its values; a path is absolute or from where the program runs.
    pub values: Vec<String>,
    /// The file.
    pub file: PathBuf,
    /// The line, counted from 1.
    pub line: u64,
    /// What the option takes: `--muscle` is a file for `host fit` and a number for `host flash`, and this is for one of them.
    kind: Kind,
}

/// What an option takes, as far as one name may mean different things to different commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Flag,
    Path,
    Other,
}

fn kind(arg: &Arg) -> Kind {
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        Kind::Flag
    } else if arg.get_value_parser().type_id() == TypeId::of::<PathBuf>() {
        Kind::Path
    } else {
        Kind::Other
    }
}

/// Whether an option takes a value, judged by its own parser alone: rules between options are for the command line.
fn probe(arg: &Arg, value: &str) -> std::result::Result<(), String> {
    let alone = Arg::new("value").long("value").num_args(1).value_parser(arg.get_value_parser().clone());
    let probe = Command::new("host").no_binary_name(true).arg(alone);
    let Err(reason) = probe.try_get_matches_from([format!("--value={value}")]) else { return Ok(()) };
    let reason = reason.to_string();
    let mut said = reason.lines().map(str::trim).filter(|l| !l.is_empty());
    let first = said.next().and_then(|l| l.rsplit_once(": ")).map_or("see --help", |(_, why)| why);
    Err(said.find(|l| l.starts_with("[possible")).map_or(first, |l| l.trim_matches(['[', ']'])).to_owned())
}

/// Files that count here, the one that yields first.
///
/// # Errors
/// [`DataCode::FileUnreadable`] when `PAM_SETTINGS` names a file that is not there.
pub fn files() -> Result<Vec<PathBuf>> {
    if let Some(named) = std::env::var_os("PAM_SETTINGS") {
        if named.is_empty() {
            return Ok(Vec::new());
        }
        let named = PathBuf::from(named);
        return match std::fs::metadata(&named) {
            Ok(_) => Ok(vec![named]),
            Err(e) => Err(Error::unreadable(&named, &e)
                .help("the environment variable PAM_SETTINGS names this file; unset it, or make it empty to use none")),
        };
    }
    let folder = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let configuration = folder("XDG_CONFIG_HOME")
        .or_else(|| folder("APPDATA"))
        .or_else(|| folder("HOME").map(|home| home.join(".config")));
    let own = configuration.map(|c| c.join("pam").join(NAME)).filter(|f| f.is_file());
    let here = std::env::current_dir().ok();
    let near = here.as_deref().and_then(|here| here.ancestors().map(|f| f.join(NAME)).find(|f| f.is_file()));
    Ok(own.into_iter().chain(near).collect())
}

/// Reads the settings of a file for a command line.
///
/// # Errors
/// [`DataCode::FileUnreadable`]; [`HostCode::SettingsInvalid`] with the line for text that is not TOML, an option that no command has, a
/// value that it cannot take.
pub fn read(file: &Path, command: &Command) -> Result<Vec<Setting>> {
    let text = bounds::read_text(file, bounds::WRITTEN)?.map_err(|()| {
        Error::new(DataCode::FileUnreadable, "is binary, not text").file(file).help("settings are TOML")
    })?;
    let parsed = DeTable::parse(&text).map_err(|e| {
        toml_error(HostCode::SettingsInvalid, &text, &e)
            .file(file)
            .help("`host settings --example` prints a file to begin with")
    })?;
    let mut settings = Vec::new();
    let reading = Reading { text: &text, file };
    reading.table(parsed.get_ref(), command, "", &mut settings)?;
    Ok(settings)
}

struct Reading<'a> {
    text: &'a str,
    file: &'a Path,
}

impl Reading<'_> {
    fn line(&self, at: usize) -> u64 {
        self.text.bytes().take(at).filter(|b| *b == b'\n').count() as u64 + 1
    }

    fn wrong(&self, at: usize, key: &str, cause: impl Into<String>) -> Error {
        Error::new(HostCode::SettingsInvalid, cause).file(self.file).line(self.line(at)).column(key)
    }

    /// `path` names the commands from the program down to `command`.
    fn table(
        &self,
        table: &DeTable<'_>,
        command: &Command,
        path: &str,
        out: &mut Vec<Setting>,
    ) -> Result<()> {
        let places = if path.is_empty() { all(command) } else { vec![command] };
        for (key, value) in table.iter() {
            let (at, key) = (key.span().start, key.get_ref().as_ref());
            if let DeValue::Table(inner) = value.get_ref() {
                let sub = command.get_subcommands().find(|c| c.get_name() == key).ok_or_else(|| {
                    let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
                    let near = nearest(key, names.iter().copied()).map(|n| format!("did you mean [{n}]? "));
                    self.wrong(at, key, "no command has this name").help(format!(
                        "{}commands here: {}",
                        near.unwrap_or_default(),
                        names.join(", ")
                    ))
                })?;
                self.table(inner, sub, format!("{path} {key}").trim(), out)?;
                continue;
            }
            let option = key.replace('_', "-");
            if NEVER.contains(&option.as_str()) {
                return Err(self
                    .wrong(at, key, "this option must be meant each time")
                    .help("give it on the command line"));
            }
            let found: Vec<&Arg> = places.iter().filter_map(|c| with(c, &option)).collect();
            if found.is_empty() {
                let mut names: Vec<&str> =
                    places.iter().flat_map(|c| c.get_arguments()).filter_map(Arg::get_long).collect();
                names.sort_unstable();
                names.dedup();
                let near = nearest(&option, names.iter().copied()).map(|n| format!("did you mean {n}? "));
                let whose = if path.is_empty() {
                    "no command has".into()
                } else {
                    format!("`host {path}` does not have")
                };
                return Err(self.wrong(at, key, format!("{whose} this option")).help(format!(
                    "{}options here: {}",
                    near.unwrap_or_default(),
                    names.join(", ")
                )));
            }
            let texts = self.texts(at, key, value.get_ref())?;
            let fits: Vec<Result<Vec<String>>> =
                found.iter().map(|arg| self.values(at, key, arg, &texts)).collect();
            // An option of one name may mean different things to two commands, such as a file, a switch and a number. The kind of the
            // value says which is meant, regardless of the order of the commands; after that, the first that it suits.
            let likely = match value.get_ref() {
                DeValue::Boolean(_) => Kind::Flag,
                DeValue::Integer(_) | DeValue::Float(_) => Kind::Other,
                _ => Kind::Path,
            };
            let mut suited: Vec<(&Vec<String>, Kind)> = fits
                .iter()
                .zip(&found)
                .filter_map(|(fit, arg)| Some((fit.as_ref().ok()?, kind(arg))))
                .collect();
            suited.sort_by_key(|(_, kind)| *kind != likely);
            match suited.first().copied() {
                Some((values, kind)) => out.push(Setting {
                    command: path.to_owned(),
                    option,
                    values: values.clone(),
                    file: self.file.to_owned(),
                    line: self.line(at),
                    kind,
                }),
                None => return fits.into_iter().next().map_or(Ok(()), |first| first.map(|_| ())),
            }
        }
        Ok(())
    }

    fn texts(&self, at: usize, key: &str, value: &DeValue<'_>) -> Result<Vec<String>> {
        Ok(match value {
            DeValue::String(s) => vec![s.to_string()],
            DeValue::Integer(i) => vec![i.to_string()],
            DeValue::Float(f) => vec![f.to_string()],
            DeValue::Boolean(b) => vec![b.to_string()],
            DeValue::Array(list) => {
                let mut out = Vec::new();
                for one in list {
                    out.extend(self.texts(at, key, one.get_ref())?);
                }
                out
            }
            _ => {
                return Err(self
                    .wrong(at, key, "a date or a table is not a value of an option")
                    .help("write a text, a number, true or a list"));
            }
        })
    }

    /// The values as the option takes them, or why it does not.
    fn values(&self, at: usize, key: &str, arg: &Arg, texts: &[String]) -> Result<Vec<String>> {
        if kind(arg) == Kind::Flag {
            return match texts {
                [one] if one == "true" || one == "false" => Ok(texts.to_vec()),
                _ => Err(self
                    .wrong(at, key, "this option takes no value")
                    .value(texts.join(" "))
                    .help("write true or false")),
            };
        }
        if texts.len() != 1 && !matches!(arg.get_action(), ArgAction::Append) {
            return Err(self.wrong(at, key, "this option takes one value").help("write one text or number"));
        }
        let folder = self.file.parent().unwrap_or(Path::new(""));
        let mut out = Vec::new();
        for text in texts {
            let text = if kind(arg) == Kind::Path && text != "-" {
                folder.join(text).to_string_lossy().into_owned()
            } else {
                text.clone()
            };
            probe(arg, &text).map_err(|why| {
                let cause = format!("--{} does not take this value", key.replace('_', "-"));
                self.wrong(at, key, cause).value(&text).help(why)
            })?;
            out.push(text);
        }
        Ok(out)
    }
}

/// A command and all below it.
fn all(command: &Command) -> Vec<&Command> {
    let mut out = vec![command];
    for sub in command.get_subcommands() {
        out.extend(all(sub));
    }
    out
}

fn with<'a>(command: &'a Command, option: &str) -> Option<&'a Arg> {
    command.get_arguments().find(|a| a.get_long() == Some(option))
}

/// Makes settings the defaults of a command line. Later ones go before earlier ones.
#[must_use]
pub fn apply(mut command: Command, settings: &[Setting]) -> Command {
    for setting in settings {
        let path: Vec<&str> = setting.command.split_whitespace().collect();
        command = apply_one(command, &path, setting, setting.command.is_empty());
    }
    command
}

fn apply_one(mut command: Command, path: &[&str], setting: &Setting, everywhere: bool) -> Command {
    if everywhere || path.is_empty() {
        let suits = |arg: &&Arg| {
            arg.get_long() == Some(&setting.option)
                && kind(arg) == setting.kind
                && (setting.kind == Kind::Flag || setting.values.iter().all(|v| probe(arg, v).is_ok()))
        };
        let id = command.get_arguments().find(suits).map(|a| a.get_id().clone());
        if let Some(id) = id {
            // The parser keeps defaults for the life of the program, and there are few.
            let values: Vec<&'static str> =
                setting.values.iter().map(|v| &*Box::leak(v.clone().into_boxed_str())).collect();
            command = command.mut_arg(id, |arg| arg.required(false).default_values(values));
        }
    }
    let names: Vec<String> = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    for name in names {
        if everywhere {
            command = command.mut_subcommand(name, |sub| apply_one(sub, &[], setting, true));
        } else if path.first() == Some(&name.as_str()) {
            command = command.mut_subcommand(name, |sub| apply_one(sub, &path[1..], setting, false));
        }
    }
    command
}

/// All settings that count here; those that go before others come later.
///
/// # Errors
/// As [`files`] and [`read`].
pub fn all_settings(command: &Command) -> Result<Vec<Setting>> {
    let mut out = Vec::new();
    for file in files()? {
        let mut settings = read(&file, command)?;
        // A command's own section goes before the general section, regardless of the order in the file.
        settings.sort_by_key(|s| s.command.split_whitespace().count());
        out.extend(settings);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command() -> Command {
        Command::new("host")
            .arg(Arg::new("quiet").long("quiet").action(ArgAction::SetTrue))
            // Any text suits this one, and it comes first: a file is meant all the same.
            .subcommand(Command::new("demo").arg(Arg::new("muscle").long("muscle").default_value("mini")))
            .subcommand(
                Command::new("fit")
                    .arg(
                        Arg::new("muscle")
                            .long("muscle")
                            .required(true)
                            .value_parser(clap::value_parser!(PathBuf)),
                    )
                    .arg(
                        Arg::new("order")
                            .long("order")
                            .default_value("4")
                            .value_parser(clap::value_parser!(u8).range(1..=6)),
                    ),
            )
            .subcommand(
                Command::new("flash")
                    .arg(Arg::new("muscle").long("muscle").value_parser(clap::value_parser!(u8))),
            )
            .subcommand(
                Command::new("run").arg(Arg::new("force").long("force")).arg(Arg::new("port").long("port")),
            )
    }

    fn of(text: &str) -> Result<Vec<Setting>> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(NAME);
        std::fs::write(&file, text).unwrap();
        read(&file, &command())
    }

    #[test]
    fn the_command_line_has_priority_over_the_file_and_that_over_the_default() {
        let settings = of("port = \"COM3\"\nmuscle = \"m.toml\"\n[fit]\norder = 3\n").unwrap();
        let order = |line: &[&str]| {
            let matches = apply(command(), &settings).try_get_matches_from(line).unwrap();
            let fit = matches.subcommand_matches("fit").unwrap();
            (fit.get_one::<u8>("order").copied().unwrap(), fit.get_one::<PathBuf>("muscle").unwrap().clone())
        };
        let (three, muscle) = order(&["host", "fit"]);
        assert!(three == 3 && muscle.is_absolute() && muscle.ends_with("m.toml"), "{muscle:?}");
        assert_eq!(order(&["host", "fit", "--order", "2", "--muscle", "x"]), (2, "x".into()));
        // `--muscle` of another command is another thing.
        let matches = apply(command(), &settings).try_get_matches_from(["host", "flash"]).unwrap();
        assert_eq!(matches.subcommand_matches("flash").unwrap().get_one::<u8>("muscle"), None);
        let matches = apply(command(), &settings).try_get_matches_from(["host", "run"]).unwrap();
        assert_eq!(matches.subcommand_matches("run").unwrap().get_one::<String>("port").unwrap(), "COM3");
    }

    #[test]
    fn faults_are_reported_with_their_line_and_a_remedy() {
        for (text, line, said) in [
            ("\nprot = 1\n", 2, "did you mean port"),
            ("[fit]\norder = 9\n", 2, "9 is not in 1..=6"),
            ("[fitt]\n", 1, "did you mean [fit]"),
            ("[run]\norder = 3\n", 2, "options here"),
            ("force = \"40\"\n", 1, "on the command line"),
            ("quiet = \"yes\"\n", 1, "true or false"),
            ("a = = b\n", 1, ""),
        ] {
            let error = of(text).unwrap_err();
            assert_eq!(
                (error.code(), error.place().line),
                (HostCode::SettingsInvalid.into(), Some(line)),
                "{text}: {error}"
            );
            assert!(error.advice().unwrap_or_default().contains(said), "{text}: {:?}", error.advice());
        }
    }
}
