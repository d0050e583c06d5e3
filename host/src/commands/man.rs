//! `host man`: manual pages.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::console::Console;
use crate::program_name;
use pam_data::error::{Error, Result};
use pam_data::output::write_whole;

/// Arguments of `host man`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host man | man -l -\n  host man -o ~/.local/share/man/man1   # then: man host-fit"
)]
pub struct Arguments {
    /// Write a page for every command into this folder, which is made where it is missing [default: the first page, to
    /// standard output].
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

impl Arguments {
    /// Writes the pages.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn run(self, command: clap::Command, console: &Console) -> Result<()> {
        match &self.output {
            None => write_whole(Path::new("-"), &page(command)?),
            Some(folder) => {
                std::fs::create_dir_all(folder).map_err(|e| Error::unwritable(folder, &e))?;
                let count = write_all(command, program_name::called(), folder)?;
                console.note(format!("{count} pages in {}", folder.display()));
                Ok(())
            }
        }
    }
}

fn page(command: clap::Command) -> Result<Vec<u8>> {
    let below = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let mut text = Vec::new();
    let man = clap_mangen::Man::new(command.after_help(None::<&str>)).manual("Pneumatic artificial muscles");
    man.render(&mut text).map_err(|e| Error::unwritable("-", &e))?;
    text.extend(closing(&below).into_bytes());
    Ok(text)
}

/// The text below the help: examples as lines to be copied, which a paragraph would join and hyphenate, and notes.
fn closing(below: &str) -> String {
    let (mut page, mut notes) = (String::new(), false);
    for line in below.lines().filter(|l| !l.is_empty()) {
        let escaped = line.replace('\\', "\\e").replace('-', "\\-");
        if line.starts_with("Example") {
            page += ".SH EXAMPLES\n";
        } else if line.starts_with(' ') {
            page += &format!(".nf\n{escaped}\n.fi\n");
        } else {
            page += if notes { ".PP\n" } else { ".SH NOTES\n" };
            notes = true;
            // A line that begins with a dot or an apostrophe would be an order to the formatter.
            page += &format!("\\&{escaped}\n");
        }
    }
    page
}

/// One page a command, named by the way to it: `host-device-log.1`.
fn write_all(command: clap::Command, name: &str, folder: &Path) -> Result<usize> {
    let mut count = 1;
    // `help` repeats every other command.
    for sub in command.get_subcommands().filter(|c| c.get_name() != "help") {
        count += write_all(sub.clone(), &format!("{name}-{}", sub.get_name()), folder)?;
    }
    // The parser knows names of commands only for as long as the program runs.
    let leaked: &'static str = Box::leak(name.to_owned().into_boxed_str());
    let text = page(command.name(leaked).display_name(leaked))?;
    write_whole(&folder.join(format!("{name}.1")), &text)?;
    Ok(count)
}
