//! `host completions`: a completion script for a shell.

use clap::{Args, ValueHint};
use clap_complete::Shell;

use crate::console::Console;
use crate::program_name;
use pam_data::error::Result;
use pam_data::output::write_whole;

/// Arguments of `host completions`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  host completions bash > ~/.local/share/bash-completion/completions/host")]
pub struct Arguments {
    /// The shell.
    shell: Shell,
}

impl Arguments {
    /// Prints the script.
    ///
    /// # Errors
    /// None so far.
    pub fn run(self, command: &mut clap::Command, _console: &Console) -> Result<()> {
        let mut script = Vec::new();
        files_for_paths_only(command);
        clap_complete::generate(self.shell, command, program_name::called(), &mut script);
        write_whole(std::path::Path::new("-"), &script)
    }
}

/// Shells offer files after an option of which nothing is known; here that is everything that is not a path.
fn files_for_paths_only(command: &mut clap::Command) {
    let taken = std::mem::take(command);
    let hinted = taken.mut_args(|arg| {
        let unknown = arg.get_action().takes_values() && arg.get_value_hint() == ValueHint::Unknown;
        if unknown { arg.value_hint(ValueHint::Other) } else { arg }
    });
    *command = hinted;
    for sub in command.get_subcommands_mut() {
        files_for_paths_only(sub);
    }
}
