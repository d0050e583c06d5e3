//! `host man`: manual pages.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::console::Console;
use crate::error::{Error, Result};
use crate::output::write_whole;

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
                let count = write_all(command, "host", folder)?;
                console.note(format!("{count} pages in {}", folder.display()));
                Ok(())
            }
        }
    }
}

fn page(command: clap::Command) -> Result<Vec<u8>> {
    let mut text = Vec::new();
    let man = clap_mangen::Man::new(command).manual("Pneumatic artificial muscles");
    man.render(&mut text).map_err(|e| Error::unwritable("-", &e))?;
    Ok(text)
}

/// One page a command, named by the way to it: `host-device-log.1`.
fn write_all(command: clap::Command, name: &str, folder: &Path) -> Result<usize> {
    let mut count = 1;
    for sub in command.get_subcommands() {
        count += write_all(sub.clone(), &format!("{name}-{}", sub.get_name()), folder)?;
    }
    // The parser knows names of commands only for as long as the program runs.
    let leaked: &'static str = Box::leak(name.to_owned().into_boxed_str());
    let text = page(command.name(leaked).display_name(leaked))?;
    write_whole(&folder.join(format!("{name}.1")), &text)?;
    Ok(count)
}
