//! Programming a microcontroller through a debug probe.

use std::path::Path;

use probe_rs::flashing::{DownloadOptions, ElfLoader, download_file_with_options};
use probe_rs::probe::list::Lister;
use probe_rs::{Permissions, Session};

use crate::console::Console;
use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

/// Writes an ELF file to a chip, compares what was written, and starts it.
///
/// # Errors
/// A file that cannot be read, no probe or more than one, a chip that the probe's library does not know, a failed write.
pub fn program(firmware: &Path, chip: &str, console: &Console) -> Result<()> {
    let image = pam_data::bounds::read(firmware, pam_data::bounds::WHOLE)?;
    if !image.starts_with(b"\x7fELF") {
        return Err(Error::new(DataCode::FileUnreadable, "this is not an ELF file")
            .file(firmware)
            .help("build one with firmware/build BOARD; it lies in target/firmware/BOARD.elf"));
    }
    let lister = Lister::new();
    let probes = lister.list_all();
    let probe = match &probes[..] {
        [only] => only,
        [] => {
            return Err(Error::new(DeviceCode::DevicePort, "no debug probe is plugged in")
                .help("plug the board's ST-Link port in; on Linux the user needs the rules for probes from probe.rs"));
        }
        several => {
            let names: Vec<String> = several.iter().map(ToString::to_string).collect();
            return Err(Error::new(
                DeviceCode::DevicePort,
                format!("there are {} debug probes", several.len()),
            )
            .help(format!("unplug all but one: {}", names.join("; "))));
        }
    };
    let failed = |what: &str, e: &dyn std::error::Error| {
        let mut cause = format!("{what}: {e}");
        let mut source = e.source();
        while let Some(inner) = source {
            cause += &format!(": {inner}");
            source = inner.source();
        }
        Error::new(DeviceCode::DeviceRefused, cause)
    };
    let opened = probe.open().map_err(|e| {
        failed("the probe cannot be opened", &e)
            .help("close any other program that uses it, and check that this user may open USB devices")
    })?;
    let mut session: Session = opened.attach(chip, Permissions::default()).map_err(|e| {
        failed("the chip cannot be reached", &e)
            .value(chip)
            .help("check that the board is powered and that this is its chip; the chip of an F446RE Nucleo is STM32F446RETx")
    })?;
    console.note(format!("writing {} to {chip}", firmware.display()));
    let mut options = DownloadOptions::default();
    options.verify = true;
    download_file_with_options(&mut session, firmware, ElfLoader(Default::default()), options).map_err(
        |e| {
            failed("the firmware was not written", &e)
                .help("try again; nothing runs on the chip until it is whole")
        },
    )?;
    session
        .core(0)
        .and_then(|mut core| core.reset())
        .map_err(|e| failed("the chip does not start", &e).help("press its reset button"))?;
    console.result(format!("{} runs on {chip}", firmware.display()));
    Ok(())
}
