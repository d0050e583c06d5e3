//! `host update`: another firmware over the link, signed.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, Subcommand};
use model_core::link::endpoints::{ConfirmUpdate, GetUpdate, Restart, RevertUpdate};
use model_core::link::messages::UpdateStatus;

use super::port::PortOption;
use crate::console::Console;
use crate::documents::device::{Firmware, FirmwareFile, FirmwareImage, FirmwareKey, FirmwareSlot};
use crate::documents::text;
use crate::progress::ProgressLine;
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::write_whole;
use pam_data::progress::Progress;
use pam_device::error::DeviceCode;
use pam_device::{Client, Patience, Port, update};

/// How long a device may take to start.
const START: Duration = Duration::from_secs(20);

/// Arguments of `host update`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Examples:\n  \
    host update key -o update.key\n  \
    host update pack a.elf b.elf --key update.key -o firmware.pamfw\n  \
    host update send firmware.pamfw --port /dev/ttyACM0\n  \
    host update status\n  \
    host update revert\n\n\
    The device takes only firmware that is signed with the key that its own firmware was built with: firmware/build --key HEX.")]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Make a key for signing firmware, and print its public part for `firmware/build --key`.
    #[command(after_help = "Example:\n  host update key -o update.key")]
    Key {
        /// The file for the private key; it must not exist.
        #[arg(short, long, value_name = "FILE.key")]
        output: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Sign images for both slots and write them into one file.
    #[command(after_help = "Example:\n  host update pack a.elf b.elf --key update.key -o firmware.pamfw")]
    Pack {
        /// Images of `firmware/build`, one with and one without --slot-b.
        #[arg(value_name = "ELF", required = true)]
        images: Vec<PathBuf>,
        /// The private key.
        #[arg(long, value_name = "FILE.key")]
        key: PathBuf,
        /// The file.
        #[arg(short, long, value_name = "FILE.pamfw")]
        output: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Send firmware into the slot that does not run, restart, and confirm the new one when it answers.
    #[command(after_help = "Example:\n  host update send firmware.pamfw --port /dev/ttyACM0")]
    Send {
        /// A file of `host update pack`.
        #[arg(value_name = "FILE.pamfw")]
        file: PathBuf,
        #[command(flatten)]
        port: PortOption,
        /// Leave the device as it runs; the new firmware starts with the next restart, and nothing is confirmed.
        #[arg(long)]
        no_restart: bool,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Show what is in both slots.
    #[command(after_help = "Example:\n  host update status")]
    Status {
        #[command(flatten)]
        port: PortOption,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Confirm the firmware that runs.
    #[command(after_help = "Example:\n  host update confirm")]
    Confirm {
        #[command(flatten)]
        port: PortOption,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Go back to the firmware in the other slot, and restart.
    #[command(after_help = "Example:\n  host update revert")]
    Revert {
        #[command(flatten)]
        port: PortOption,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
}

impl Arguments {
    /// Does what was requested.
    ///
    /// # Errors
    /// A file that is not firmware, a device that is silent or refuses, firmware that does not start.
    pub fn run(self, console: &Console) -> Result<()> {
        match self.action {
            Action::Key { output, json } => make_key(&output, json, console),
            Action::Pack { images, key, output, json } => pack(&images, &key, &output, json, console),
            Action::Send { file, port, no_restart, json } => send(&file, &port, no_restart, json, console),
            Action::Status { port, json } => {
                let status = greet(&port)?.call::<GetUpdate>(&())?;
                show(&status, json, console)
            }
            Action::Confirm { port, json } => {
                let status = greet(&port)?.call_once::<ConfirmUpdate>(&())?;
                show(&status, json, console)
            }
            Action::Revert { port, json } => {
                let mut client = greet(&port)?;
                client.call_once::<RevertUpdate>(&())?;
                let mut client = restarted(client, &port)?;
                let status = client.call::<GetUpdate>(&())?;
                show(&status, json, console)
            }
        }
    }
}

/// Says hello and leaves the versions alone: the requests of an update are the same in all.
fn greet(port: &PortOption) -> Result<Client> {
    Client::greet(Port::open(&port.address()?)?, Patience::default())
}

/// Restarts a device and waits until it answers again.
fn restarted(mut client: Client, port: &PortOption) -> Result<Client> {
    let starts = client.hello().starts;
    client.call_once::<Restart>(&())?;
    drop(client);
    let end = Instant::now() + START;
    loop {
        std::thread::sleep(Duration::from_millis(200));
        match greet(port) {
            Ok(client) if client.hello().starts != starts => return Ok(client),
            Err(error) if Instant::now() > end => return Err(error),
            _ if Instant::now() > end => {
                return Err(Error::new(DeviceCode::DeviceSilent, "the device has not restarted"));
            }
            _ => {}
        }
    }
}

fn make_key(path: &Path, json: bool, console: &Console) -> Result<()> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes)
        .map_err(|error| Error::new(DataCode::CallInvalid, format!("no random numbers: {error}")))?;
    if path.exists() {
        return Err(Error::new(DataCode::CallInvalid, "this file exists; a key is never replaced").file(path));
    }
    let key = update::key_of(&bytes);
    write_whole(path, (update::hex(&bytes) + "\n").as_bytes())?;
    keep_private(path);
    console.note("keep this file private and safe: who has it can change the firmware of your controllers");
    let public_key = update::hex(&update::public_of(&key));
    console.result(if json {
        text(&FirmwareKey { schema: "pam-firmware-key/1", public_key })?
    } else {
        public_key
    });
    Ok(())
}

/// Only its owner may read the file, where the system knows owners.
fn keep_private(path: &Path) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // A file system without owners keeps the file as it is.
        let _ = std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600));
    }
    #[cfg(not(unix))]
    let _ = path;
}

fn pack(images: &[PathBuf], key: &Path, output: &Path, json: bool, console: &Console) -> Result<()> {
    let unreadable = |path: &Path, error: std::io::Error| {
        Error::new(DataCode::FileUnreadable, error.to_string()).file(path)
    };
    let digits = std::fs::read_to_string(key).map_err(|error| unreadable(key, error))?;
    let key = update::key_from_hex(digits.trim()).ok_or_else(|| {
        Error::new(DataCode::CallInvalid, "this is not a key of `host update key`").file(key)
    })?;
    let number = |text: &str| text.parse::<u16>().unwrap_or(0);
    let release = (
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    );
    let mut packed = Vec::new();
    for path in images {
        let elf = std::fs::read(path).map_err(|error| unreadable(path, error))?;
        packed.push(update::signed_elf(&elf, release, &key).map_err(|error| error.file(path))?);
    }
    write_whole(output, &update::to_bytes(&packed))?;
    let images: Vec<FirmwareImage> = packed
        .iter()
        .map(|image| FirmwareImage { slot: image.header.slot, bytes: image.header.length })
        .collect();
    if json {
        console.result(text(&FirmwareFile { schema: "pam-firmware-file/1", images })?);
    } else {
        for image in &images {
            console.result(format!("slot {}: {} bytes", image.slot, image.bytes));
        }
    }
    Ok(())
}

fn send(file: &Path, port: &PortOption, no_restart: bool, json: bool, console: &Console) -> Result<()> {
    let images = update::read(file)?;
    let mut client = greet(port)?;
    let progress = ProgressLine::new(console, "update");
    progress.total(images.iter().map(|image| image.program.len()).max().unwrap_or(0) as u64);
    let mut status = update::send(&mut client, &images, |sent| progress.set(sent as u64))?;
    drop(progress);
    if no_restart {
        console.note("it starts with the next restart; confirm it then with `host update confirm`");
        return show(&status, json, console);
    }
    let before = status.running;
    let mut client = restarted(client, port)?;
    status = client.call::<GetUpdate>(&())?;
    if status.running == before {
        return Err(Error::new(
            DeviceCode::DeviceVerify,
            "the device runs the firmware of before: the new one did not start",
        )
        .help("build it for this board, and look at `host update status`"));
    }
    status = client.call_once::<ConfirmUpdate>(&())?;
    show(&status, json, console)
}

fn show(status: &UpdateStatus, json: bool, console: &Console) -> Result<()> {
    let slots: Vec<Option<FirmwareSlot>> = status
        .slots
        .iter()
        .map(|slot| {
            slot.map(|slot| {
                let [major, minor, patch] = slot.release;
                FirmwareSlot {
                    release: format!("{major}.{minor}.{patch}"),
                    bytes: slot.length,
                    crc: format!("{:08x}", slot.crc),
                    confirmed: slot.confirmed,
                }
            })
        })
        .collect();
    if json {
        console.result(text(&Firmware { schema: "pam-firmware/1", running: status.running, slots })?);
        return Ok(());
    }
    for (number, slot) in slots.iter().enumerate() {
        let runs = if number == usize::from(status.running) { ", runs" } else { "" };
        console.result(match slot {
            None => format!("slot {number}: nothing{runs}"),
            Some(slot) => {
                let confirmed = if slot.confirmed { "confirmed" } else { "not confirmed" };
                format!("slot {number}: release {}, {} bytes, {confirmed}{runs}", slot.release, slot.bytes)
            }
        });
    }
    Ok(())
}
