//! `host settings`: which settings files count here, and what they say.

use clap::Args;

use crate::console::Console;
use crate::documents::{bench, text};
use crate::settings::{NAME, all_settings, files};
use pam_data::error::Result;

/// Arguments of `host settings`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  host settings\n  host settings --example > pam.toml\n\n\
    An option takes its value from the first of: the command line; the environment (PAM_PORT); the nearest pam.toml, here or in \
    a folder above; pam/pam.toml in the user's configuration folder; the built-in default. PAM_SETTINGS names another file in \
    place of both. Paths are taken from the folder of their file.")]
pub struct Arguments {
    /// Print a file to begin with.
    #[arg(long, conflicts_with = "json")]
    example: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// A file to begin with: everything in it is commented out.
const EXAMPLE: &str = r#"# Settings of the program `host`. Every option of every command can stand here by its long name.

# port = "/dev/ttyACM0"       # for all commands that talk to a controller
# muscle = "mini.toml"        # for fit and diagnose; a path is taken from the folder of this file
# import = "bench.toml"       # how this bench's files are read
# color = "never"

# [fit]                       # for one command only
# order = 4

# [record]
# folder = "recordings"
"#;

impl Arguments {
    /// Prints them.
    ///
    /// # Errors
    /// A settings file that is not right.
    pub fn run(self, command: &clap::Command, console: &Console) -> Result<()> {
        if self.example {
            console.result(EXAMPLE.trim_end());
            return Ok(());
        }
        let files = files()?;
        let settings = all_settings(command)?;
        if self.json {
            let all = settings.iter().map(|s| bench::Setting {
                command: &s.command,
                option: &s.option,
                values: &s.values,
                file: s.file.display().to_string(),
                line: s.line,
            });
            let files = files.iter().map(|f| f.display().to_string()).collect();
            let document = bench::SettingsFiles { schema: "pam-settings/1", files, settings: all.collect() };
            console.result(text(&document)?);
            return Ok(());
        }
        if files.is_empty() {
            console
                .result(format!("no {NAME} here, in a folder above, or in the user's configuration folder"));
        }
        for s in &settings {
            let whose = if s.command.is_empty() { String::new() } else { format!("{}: ", s.command) };
            console.result(format!(
                "{whose}--{} {}   ({}:{})",
                s.option,
                s.values.join(" "),
                s.file.display(),
                s.line
            ));
        }
        Ok(())
    }
}
