//! The command line: one sub-command per file of [`crate::commands`], options that all share, and the exit status.
//!
//! Exit status 0: done. 1: the input or the device is at fault. 2: the call is at fault.

use std::borrow::Cow;
use std::io::Write;
use std::process::ExitCode;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use crate::commands;
use crate::console::{Colour, Console, printable, unprinted};
use crate::program_name;
use crate::settings::{all_settings, apply};
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::reader_left;

/// Recordings of pneumatic artificial muscles to tables, tables to controllers.
#[derive(Debug, Parser)]
#[command(name = "host", version, about, propagate_version = true, arg_required_else_help = true)]
// Longer lines are hard to read; a narrower terminal sets its own width.
#[command(max_term_width = 100)]
#[command(after_help = "Examples:\n  \
    host demo\n  \
    host new -o mini.toml\n  \
    host fit --muscle mini.toml loops/*.csv -o mini.pam --report mini.html\n  \
    host diagnose --muscle mini.toml loops/*.csv --report why.html\n  \
    host studio --emulate\n\n\
    Results for programs: fit, evaluate, predict, diagnose, history and plan write JSON into the file behind --json (`-` is standard \
    output); with all others --json stands alone, and they print it in place of text.\n\n\
    Exit status: 0 done, 1 the input or the device is at fault, 2 the call is at fault.")]
pub struct Cli {
    #[command(flatten)]
    output: Output,
    #[command(subcommand)]
    command: Command,
}

/// What every sub-command does with its messages.
#[derive(Debug, Clone, Args)]
pub struct Output {
    /// Print only results and errors.
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "Messages")]
    quiet: bool,
    /// Print what is done, and how long it took.
    #[arg(short, long, global = true, help_heading = "Messages")]
    verbose: bool,
    /// Colours in messages: auto (on a terminal, and not where `NO_COLOR` is set), always or never.
    #[arg(
        long,
        global = true,
        value_enum,
        default_value_t = Colours::Auto,
        value_name = "WHEN",
        hide_possible_values = true,
        help_heading = "Messages"
    )]
    color: Colours,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Colours {
    Auto,
    Always,
    Never,
}

/// Every sub-command. A new one is one file in `commands/` and one line here and in [`Command::run`].
#[derive(Debug, Subcommand)]
enum Command {
    /// Demonstrate the whole workflow without hardware: record, fit, flash, track.
    Demo(commands::demo::Arguments),
    /// Describe a muscle by answering what to measure, with drawings.
    New(commands::new::Arguments),
    /// Describe how to read a bench's files, by looking at one.
    Import(commands::import::Arguments),
    /// Fit a muscle's table to recordings.
    Fit(commands::fit::Arguments),
    /// Score a fit on recordings that it did not use.
    Evaluate(commands::evaluate::Arguments),
    /// Compute the force of a table on recordings, and score it.
    Predict(commands::predict::Arguments),
    /// Say what the model leaves out: where, what, with what probability, what to record next.
    Diagnose(commands::diagnose::Arguments),
    /// Follow one actuator over several campaigns: what changed, when, and by how much.
    History(commands::history::Arguments),
    /// Fit and diagnose every muscle of a manifest, in parallel, into Parquet tables.
    Batch(commands::batch::Arguments),
    /// Show the results of a batch as one fleet: distributions, outlying muscles, effects, groups.
    Fleet(commands::fleet::Arguments),
    /// Fit a muscle with few recordings beside others of its type that were fitted before.
    Stock(commands::stock::Arguments),
    /// Explain what the model leaves out, effect by effect.
    Effects(commands::effects::Arguments),
    /// Plan recordings: protocols by their expected information, best first; or what a planned protocol can distinguish.
    Plan(commands::plan::Arguments),
    /// Record, check, fit and diagnose automatically: the program chooses each step of the campaign.
    Campaign(commands::campaign::Arguments),
    /// Two recordings, in numbers and in a picture.
    Compare(commands::compare::Arguments),
    /// Show, check or export a table.
    Table(commands::table::Arguments),
    /// Send a table to a controller, or program its chip.
    Flash(commands::flash::Arguments),
    /// Send signed firmware to a controller over its link, with a way back.
    Update(commands::update::Arguments),
    /// Let a controller follow a setpoint profile of force, pressure or stroke, and record it.
    Run(commands::run::Arguments),
    /// Record what a controller measures, as CSV or MCAP.
    Record(commands::record::Arguments),
    /// Repair an interrupted recording.
    Recover(commands::record::RecoverArguments),
    /// Vent the muscle and disarm the controller.
    Vent(commands::vent::Arguments),
    /// Say whether the table on a controller still describes its muscle, and name what has changed.
    Health(commands::health::Arguments),
    /// The live view in the browser: connect, run, fit, flash, compare.
    Studio(commands::studio::Arguments),
    /// A controller without hardware, for all commands that talk to one.
    Emulate(commands::emulate::Arguments),
    /// Show the identity, state, and faults of a controller; change its settings.
    Device(commands::device::Arguments),
    /// Show which settings files count here, and what they say.
    Settings(commands::settings::Arguments),
    /// Print a completion script for a shell.
    Completions(commands::completions::Arguments),
    /// Write manual pages.
    Man(commands::man::Arguments),
}

impl Command {
    fn run(self, console: &Console) -> Result<()> {
        match self {
            Self::Demo(a) => a.run(console),
            Self::New(a) => a.run(console),
            Self::Import(a) => a.run(console),
            Self::Fit(a) => a.run(console),
            Self::Evaluate(a) => a.run(console),
            Self::Predict(a) => a.run(console),
            Self::Diagnose(a) => a.run(console),
            Self::History(a) => a.run(console),
            Self::Batch(a) => a.run(console),
            Self::Fleet(a) => a.run(console),
            Self::Stock(a) => a.run(console),
            Self::Effects(a) => a.run(console),
            Self::Plan(a) => a.run(console),
            Self::Campaign(a) => a.run(console),
            Self::Compare(a) => a.run(console),
            Self::Table(a) => a.run(console),
            Self::Flash(a) => a.run(console),
            Self::Update(a) => a.run(console),
            Self::Run(a) => a.run(console),
            Self::Record(a) => a.run(console),
            Self::Recover(a) => a.run(console),
            Self::Vent(a) => a.run(console),
            Self::Health(a) => a.run(console),
            Self::Studio(a) => a.run(console),
            Self::Emulate(a) => a.run(console),
            Self::Device(a) => a.run(console),
            Self::Settings(a) => a.run(&Cli::command(), console),
            Self::Completions(a) => a.run(&mut program_name::renamed(Cli::command()), console),
            Self::Man(a) => a.run(built(), console),
        }
    }
}

/// The command line with everything that is found out when it is parsed: shared options in every command.
fn built() -> clap::Command {
    let mut command = program_name::renamed(Cli::command());
    command.build();
    command
}

/// Reads the command line with the settings files behind it.
fn parse() -> Result<Cli> {
    let settings = match all_settings(&Cli::command()) {
        Ok(settings) => settings,
        // To vent must not hang on a file that is not right.
        Err(error) if std::env::args().any(|a| a == "vent") => {
            Console::new(false, false, Colour::OnTerminal).warning(&error);
            Vec::new()
        }
        Err(error) => return Err(error),
    };
    apply(program_name::renamed(Cli::command()), &settings)
        .try_get_matches()
        .and_then(|matches| Cli::from_arg_matches(&matches))
        .map_err(|message| ended(&message))
}

/// Prints help or the version, or what is wrong with a call, and ends: with status 2 for the last.
///
/// A reader that stopped reading (`| head`) is not a failure; a full disk is, and comes back as an error.
fn ended(message: &clap::Error) -> Error {
    // A name that a shell has put in the place of `*` may hold anything.
    let plain = message.render().to_string();
    let printed = match printable(&plain) {
        Cow::Borrowed(_) => message.print().and_then(|()| std::io::stdout().flush()),
        Cow::Owned(text) => std::io::stderr().write_all(text.as_bytes()),
    };
    match printed {
        Err(e) if !message.use_stderr() && !reader_left(&e) => {
            Error::new(DataCode::FileUnwritable, format!("standard output cannot be written: {e}"))
        }
        _ => std::process::exit(message.exit_code()),
    }
}

/// Reads the command line, runs it, prints what went wrong, and gives the exit status.
pub fn main() -> ExitCode {
    let cli = match parse() {
        Ok(cli) => cli,
        Err(error) => {
            Console::new(false, false, Colour::OnTerminal).error(&error);
            return ExitCode::from(error.exit_status());
        }
    };
    let colour = match cli.output.color {
        Colours::Auto => Colour::OnTerminal,
        Colours::Always => Colour::Always,
        Colours::Never => Colour::Never,
    };
    let console = Console::new(cli.output.quiet, cli.output.verbose, colour);
    let outcome = cli.command.run(&console);
    match outcome.and(unprinted().map_or(Ok(()), Err)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.error(&error);
            ExitCode::from(error.exit_status())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
