//! `host flash`: a table to a controller, or the firmware to its chip.

use std::path::{Path, PathBuf};

use clap::Args;
use model_core::check;
use model_core::image;
use model_core::link::endpoints::{GetInfo, Restart};
use model_core::link::messages::Side;

use super::port::{Muscle, PortOption};
use crate::console::Console;
use crate::documents::{device as document, text};
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::{printed, to_standard_output, write_whole};
use pam_data::progress::Progress;
use pam_device::error::DeviceCode;
use pam_device::{Client, recorder, table_diff, tables};

use crate::progress::ProgressLine;
use pam_data::date::now_utc;
use pam_fit::table_file::{About, TableFile};

/// Arguments of `host flash`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Examples:\n  \
    host flash mini.pam --port /dev/ttyACM0\n  \
    host flash mini.pam --port tcp:127.0.0.1:4321 --dry-run\n  \
    host flash --chip STM32F446RETx --firmware target/firmware/nucleo-f446re.elf\n\n\
    The table that the device has is kept in a file beside the new one before anything is written.")]
pub struct Arguments {
    /// The table to send.
    #[arg(value_name = "TABLE.pam", required_unless_present = "firmware", conflicts_with = "firmware")]
    table: Option<PathBuf>,
    #[command(flatten)]
    port: PortOption,
    #[command(flatten)]
    muscle: Muscle,
    /// Show the difference and write nothing.
    #[arg(long, conflicts_with = "firmware")]
    dry_run: bool,
    /// Where to keep the table that the device has [default: beside TABLE.pam, named by its check sum].
    #[arg(long, value_name = "FILE.pam", conflicts_with = "firmware")]
    backup: Option<PathBuf>,
    /// Restart the device at the end and compare once more.
    #[arg(long, conflicts_with_all = ["firmware", "dry_run"])]
    restart: bool,
    /// Print what was done as JSON.
    #[arg(long)]
    json: bool,
    /// Program the microcontroller itself, through a debug probe.
    #[arg(long, value_name = "ELF", requires = "chip")]
    firmware: Option<PathBuf>,
    /// The microcontroller, as the probe's library names it.
    #[arg(long, value_name = "CHIP", requires = "firmware")]
    chip: Option<String>,
}

impl Arguments {
    /// Does what was requested.
    ///
    /// # Errors
    /// A bad file, a device that is silent, of another kind, or refuses, a table that does not come back as it was sent.
    pub fn run(self, console: &Console) -> Result<()> {
        match (&self.firmware, &self.chip, &self.table) {
            (Some(firmware), Some(chip), _) => program(firmware, chip, console),
            (_, _, Some(table)) => self.send(table, console),
            _ => Err(Error::new(DataCode::CallInvalid, "give a table or a firmware image")),
        }
    }

    fn send(&self, path: &Path, console: &Console) -> Result<()> {
        to_standard_output(&[("--backup", self.backup.as_deref()), ("--json", printed(self.json))])?;
        let file = TableFile::read(path)?;
        let mut buffer = [0; image::MAX_LEN];
        let image = image::write(&file.table, &mut buffer)
            .map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()).file(path))?;
        if !file.about.corrections.is_empty() {
            console
                .note("the corrections of the bench are not sent; the controller receives the muscle only");
        }
        let side = self.muscle.side();
        let mut client = self.port.connect(console)?;
        let before = tables::read(&mut client, side)?;
        let mut done = document::Flash {
            schema: "pam-flash/1",
            port: client.port().to_string(),
            crc: format!("{:08x}", check::of_image(image)),
            difference: self.compare(before.as_deref(), &file, console),
            written: false,
            backup: None,
            generation: None,
            confirmed_after_restart: None,
        };
        if before.as_deref() == Some(image) {
            console.note("the device already has this table");
        } else if self.dry_run {
            console.note("nothing was written");
        } else {
            if let Some(before) = &before {
                done.backup = Some(self.keep(path, before, &client, console)?);
            }
            let progress = ProgressLine::new(console, "flash");
            progress.total(image.len() as u64);
            let kept = tables::write(&mut client, side, image, |sent| progress.set(sent as u64))?;
            drop(progress);
            console.note(format!(
                "written and read back: {} bytes, check sum {:08x}, generation {}",
                kept.length, kept.crc, kept.generation
            ));
            done.written = true;
            done.generation = Some(kept.generation);
            if self.restart {
                client = self.after_restart(client, side, image, console)?;
                done.confirmed_after_restart = Some(true);
            }
        }
        drop(client);
        if self.json {
            console.result(text(&done)?);
        } else if done.written {
            console.result(format!("{} is in use on {}", path.display(), done.port));
        }
        Ok(())
    }

    fn compare(
        &self,
        before: Option<&[u8]>,
        file: &TableFile,
        console: &Console,
    ) -> Option<document::Difference> {
        let Some(before) = before else {
            console.note("the device has no table yet");
            return None;
        };
        match image::read(before) {
            Ok(table) => {
                let difference = table_diff::between(&table, &file.table);
                console.note(format!("device → {}:\n{}", file.about.muscle, difference.to_text()));
                Some(document::Difference::of(difference))
            }
            Err(e) => {
                console.warning(format!("the device's table cannot be read by this version: {e}"));
                None
            }
        }
    }

    /// Writes the device's table to a file; its name holds its check sum, so that it never replaces another.
    fn keep(&self, path: &Path, before: &[u8], client: &Client, console: &Console) -> Result<String> {
        let table = match image::read(before) {
            Ok(table) => table,
            // What this version cannot read cannot become a table file; the bytes themselves are kept.
            Err(_) => {
                let to = self
                    .backup
                    .clone()
                    .unwrap_or_else(|| path.with_extension(format!("{:08x}.image", check::of_image(before))));
                write_whole(&to, before)?;
                return Ok(to.display().to_string());
            }
        };
        let about = About {
            muscle: "read from a device".to_owned(),
            date: now_utc(),
            tool: format!("host {}, from {}", env!("CARGO_PKG_VERSION"), recorder::serial(client.hello())),
            ..About::default()
        };
        let to = self
            .backup
            .clone()
            .unwrap_or_else(|| path.with_extension(format!("{:08x}.pam", check::of_image(before))));
        TableFile { table, about }.write(&to)?;
        console.note(format!("the previous table of the device is saved in {}", to.display()));
        Ok(to.display().to_string())
    }

    fn after_restart(
        &self,
        mut client: Client,
        side: Side,
        image: &[u8],
        console: &Console,
    ) -> Result<Client> {
        let starts = client.hello().starts;
        client.call_once::<Restart>(&())?;
        drop(client);
        let mut last = None;
        for _ in 0..20 {
            std::thread::sleep(std::time::Duration::from_millis(250));
            match self.port.connect(&Console::silent()) {
                Ok(mut again) if again.hello().starts != starts => {
                    let info = again.call::<GetInfo>(&())?;
                    let crc = info.tables[side.index()].map(|t| t.crc);
                    if crc != Some(check::of_image(image)) {
                        return Err(Error::new(
                            DeviceCode::DeviceVerify,
                            "the device has another table after its restart",
                        )
                        .help("send it again; if the error returns, the memory of the device is failing"));
                    }
                    console.note("confirmed after a restart");
                    return Ok(again);
                }
                Ok(_) => {}
                Err(e) => last = Some(e),
            }
        }
        Err(last.unwrap_or_else(|| Error::new(DeviceCode::DeviceSilent, "the device did not restart")))
    }
}

#[cfg(not(feature = "probe"))]
fn program(firmware: &Path, _chip: &str, _console: &Console) -> Result<()> {
    std::fs::metadata(firmware).map_err(|e| {
        Error::unreadable(firmware, &e)
            .help("`firmware/build BOARD` makes the image, in target/firmware of the checkout")
    })?;
    Err(Error::new(DataCode::CallInvalid, "this program was built without debug probes").help(
        "build it with them: cargo build --release --package host --features probe; it takes a minute longer",
    ))
}

#[cfg(feature = "probe")]
fn program(firmware: &Path, chip: &str, console: &Console) -> Result<()> {
    pam_device::probe::program(firmware, chip, console)
}
