//! `host device identify`: the pressure regulator, found by steps and kept in the settings.

use std::sync::atomic::Ordering;

use clap::Args;

use crate::commands::interrupt::interrupts;
use crate::commands::port::PortOption;
use crate::console::Console;
use crate::documents::{device::Regulator, text};
use pam_data::error::{DataCode, Error, Result};
use pam_device::regulator::{self, Found};

/// Arguments of `host device identify`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    port: PortOption,
    /// The lower pressure of the steps, kPa.
    #[arg(long, value_name = "KPA", default_value_t = 100.0)]
    low: f64,
    /// The upper pressure of the steps, kPa.
    #[arg(long, value_name = "KPA", default_value_t = 250.0)]
    high: f64,
    /// Show what was found and leave the settings as they are.
    #[arg(long)]
    dry_run: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let [low_pa, high_pa] = regulator_steps(arguments.low, arguments.high)?;
    let interrupted = interrupts()?;
    let mut client = arguments.port.connect(console)?;
    console.note("the muscle is pressurised for some ten seconds of the device's time, then vented");
    let stop = || interrupted.load(Ordering::Relaxed);
    let found = regulator::identify_whole(&mut client, low_pa, high_pa, &stop)?;
    if !arguments.dry_run {
        found.keep(&mut client)?;
        console.note("saved in the settings; from now on, lag and line are compensated");
    }
    if arguments.json {
        console.result(text(&Regulator {
            schema: "pam-regulator/1",
            gain: found.gain,
            offset_Pa: found.offset_pa,
            lag_s: found.lag_s,
            line_s: found.line_s,
            rate_Pa_per_s: found.rate_pa_per_s,
            rate_limited: found.rate_limited,
            deadband_Pa: found.deadband_pa,
            misfit_rms_Pa: found.misfit_pa,
            kept: !arguments.dry_run,
        })?);
        return Ok(());
    }
    console.result(regulator_text(&found));
    Ok(())
}

/// The pressures of the steps in Pa, from kPa.
///
/// # Errors
/// Pressures at which a regulator does not show itself.
pub(crate) fn regulator_steps(low: f64, high: f64) -> Result<[f64; 2]> {
    if !(low >= 20.0 && high - low >= 30.0 && high.is_finite()) {
        return Err(Error::new(DataCode::CallInvalid, "these pressures cannot identify a regulator")
            .value(format!("--low {low} --high {high}"))
            .help("the lower must be at least 20 kPa, and the upper at least 30 kPa above it"));
    }
    Ok([low * 1e3, high * 1e3])
}

/// A regulator as text, a line for each number.
pub(crate) fn regulator_text(found: &Found) -> String {
    let line = if found.line_s > 0.0 {
        format!("line      {:8.1} ms to fill the muscle at rest length", found.line_s * 1e3)
    } else {
        "line      none seen beside the lag".to_owned()
    };
    let limit = if found.rate_limited { ", the regulator's limit" } else { " seen; the limit lies above" };
    let deadband = match found.deadband_pa {
        Some(half) => format!("deadband  {half:8.0} Pa to either side"),
        None => "deadband  not seen: not even the largest square of pressure was answered".to_owned(),
    };
    [
        format!("gain      {:8.4}", found.gain),
        format!("offset    {:8.2} kPa", found.offset_pa * 1e-3),
        format!("lag       {:8.1} ms", found.lag_s * 1e3),
        line,
        format!("rate      {:8.2} MPa/s{limit}", found.rate_pa_per_s * 1e-6),
        deadband,
        format!("misfit    {:8.0} Pa rms between the steps and this model", found.misfit_pa),
    ]
    .join("\n")
}
