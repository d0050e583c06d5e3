//! `host device sensors`: signals and readings of every sensor, and their calibration with known values.

use std::io::BufRead;
use std::time::Duration;

use clap::{Args, ValueEnum};
use model_core::link::endpoints::{GetSettings, ReadSignals, SetSettings};
use model_core::link::messages::{MeanSignals, SignalsRead};
use model_core::link::settings::Settings;

use crate::commands::port::{Muscle, PortOption};
use crate::console::Console;
use crate::documents::device::{Sensor as Row, SensorPair, Sensors};
use crate::documents::text;
use pam_data::error::{DataCode, Error, Result};
use pam_device::Client;
use pam_device::calibration::{Calibration, Pair, Sensor, scale_through};
use pam_device::error::DeviceCode;

/// Time of a mean.
const SECOND: Duration = Duration::from_millis(1_000);
/// Time of the means that are only shown.
const GLANCE: Duration = Duration::from_millis(200);

/// Arguments of `host device sensors`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    port: PortOption,
    #[command(flatten)]
    muscle: Muscle,
    /// Calibrate this sensor with the known values or points that are given.
    #[arg(long, value_enum, value_name = "SENSOR")]
    calibrate: Option<Name>,
    /// A known value at the sensor, in kPa, mm, or N. One alone moves the zero; with several, the command prompts for one after the
    /// other, and waits for Enter before it measures.
    #[arg(
        long,
        value_name = "VALUE",
        requires = "calibrate",
        allow_negative_numbers = true,
        conflicts_with = "point"
    )]
    known: Vec<f64>,
    /// A signal and the known value at it, from a data sheet or an earlier measurement.
    #[arg(long, value_name = "SIGNAL=VALUE", requires = "calibrate", allow_hyphen_values = true, value_parser = point)]
    point: Vec<(f64, f64)>,
    /// Show what was found and leave the settings as they are.
    #[arg(long, requires = "calibrate")]
    dry_run: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// A sensor by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Name {
    /// Pressure at the muscle.
    Pressure,
    /// Stroke.
    Stroke,
    /// Load cell.
    Force,
    /// Second pressure sensor at the muscle.
    SecondPressure,
    /// Pressure of the supply air.
    Supply,
}

impl Name {
    const fn sensor(self) -> Sensor {
        match self {
            Self::Pressure => Sensor::Pressure,
            Self::Stroke => Sensor::Stroke,
            Self::Force => Sensor::Force,
            Self::SecondPressure => Sensor::SecondPressure,
            Self::Supply => Sensor::Supply,
        }
    }
}

/// A setting in the unit of its sensor, with as many digits as it has.
fn shown(value: f32, si: f64) -> f32 {
    (f64::from(value) / si) as f32
}

fn point(text: &str) -> Result<(f64, f64), String> {
    let wrong = || format!("write SIGNAL=VALUE, such as 0.333=0, not `{text}`");
    let (signal, value) = text.split_once('=').ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    number(signal).zip(number(value)).ok_or_else(wrong)
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let mut client = arguments.port.connect(console)?;
    let settings = client.call::<GetSettings>(&())?;
    match arguments.calibrate {
        None => show(arguments, &mut client, &settings, console),
        Some(name) => calibrate(arguments, name.sensor(), &mut client, settings, console),
    }
}

/// Means of the signals over a time from now on.
fn measured(client: &mut Client, muscle: Muscle, time: Duration) -> Result<MeanSignals> {
    let request = SignalsRead { side: muscle.side() };
    client.call::<ReadSignals>(&request)?;
    std::thread::sleep(time);
    // Sent once: a repeated request would give the mean of the time since the first.
    client.call_once::<ReadSignals>(&request)
}

fn show(arguments: &Arguments, client: &mut Client, settings: &Settings, console: &Console) -> Result<()> {
    let means = measured(client, arguments.muscle, GLANCE)?;
    let rows: Vec<Row> = Sensor::ALL
        .into_iter()
        .filter_map(|sensor| {
            let scale = sensor.scale(&settings.scales);
            let signal = sensor.signal(&means)?;
            Some(Row {
                sensor: sensor.name(),
                signal,
                reading: f64::from(scale.reading(signal)) / sensor.unit().1,
                unit: sensor.unit().0,
                at_zero: shown(scale.at_zero, sensor.unit().1),
                per_unit: shown(scale.per_unit, sensor.unit().1),
                filter_s: scale.filter_s,
            })
        })
        .collect();
    if arguments.json {
        console.result(text(&Sensors {
            schema: "pam-sensors/1",
            sensors: rows,
            enable_closed: Some(means.enabled),
            calibrated: None,
            pairs: Vec::new(),
            kept: false,
        })?);
        return Ok(());
    }
    if rows.is_empty() {
        console.result("the device has no readings: its sensors are silent");
        return Ok(());
    }
    console.result(format!("{:<16} {:>10} {:>14}   scale", "sensor", "signal", "reading"));
    for row in rows {
        let filter =
            if row.filter_s > 0.0 { format!(", filter {} ms", row.filter_s * 1e3) } else { String::new() };
        console.result(format!(
            "{:<16} {:>10.4} {:>10.3} {:<3}   {} + {} × signal{filter}",
            row.sensor, row.signal, row.reading, row.unit, row.at_zero, row.per_unit
        ));
    }
    console.result(format!("enable input {}", if means.enabled { "closed" } else { "open" }));
    Ok(())
}

fn calibrate(
    arguments: &Arguments,
    sensor: Sensor,
    client: &mut Client,
    mut settings: Settings,
    console: &Console,
) -> Result<()> {
    let (unit, si) = sensor.unit();
    let pairs = if arguments.point.is_empty() {
        measure_pairs(arguments, sensor, client, console)?
    } else {
        arguments.point.iter().map(|&(signal, value)| Pair { value: value * si, signal }).collect()
    };
    let before = sensor.scale(&settings.scales);
    let Calibration { scale, errors } = scale_through(&pairs, &before)?;
    *sensor.scale_mut(&mut settings) = scale;
    if !arguments.dry_run {
        let answered = client.call_once::<SetSettings>(&settings)?;
        if answered != settings || client.call::<GetSettings>(&())? != settings {
            return Err(Error::new(
                DeviceCode::DeviceVerify,
                "the settings read back from the device differ from those sent",
            ));
        }
        console.note("saved in the settings");
    }
    let rows: Vec<SensorPair> = pairs
        .iter()
        .zip(&errors)
        .map(|(pair, error)| SensorPair { signal: pair.signal, value: pair.value / si, error: error / si })
        .collect();
    if arguments.json {
        let row = Row {
            sensor: sensor.name(),
            signal: pairs.last().map_or(0.0, |pair| pair.signal as f32),
            reading: pairs.last().map_or(0.0, |pair| f64::from(scale.reading(pair.signal as f32)) / si),
            unit,
            at_zero: shown(scale.at_zero, si),
            per_unit: shown(scale.per_unit, si),
            filter_s: scale.filter_s,
        };
        console.result(text(&Sensors {
            schema: "pam-sensors/1",
            sensors: vec![row],
            enable_closed: None,
            calibrated: Some(sensor.name()),
            pairs: rows,
            kept: !arguments.dry_run,
        })?);
        return Ok(());
    }
    for row in &rows {
        console.result(format!(
            "signal {:.4} at {} {unit}: error {:+.3} {unit}",
            row.signal, row.value, row.error
        ));
    }
    for (when, scale) in [("before", before), ("now", scale)] {
        console.result(format!(
            "{when:<7} {} = {} + {} × signal",
            sensor.name(),
            shown(scale.at_zero, si),
            shown(scale.per_unit, si)
        ));
    }
    Ok(())
}

/// Measures the signal at each known value; prompts for one after the other where there are several.
fn measure_pairs(
    arguments: &Arguments,
    sensor: Sensor,
    client: &mut Client,
    console: &Console,
) -> Result<Vec<Pair>> {
    let (unit, si) = sensor.unit();
    let mut lines = std::io::stdin().lock().lines();
    let mut pairs = Vec::new();
    for &value in &arguments.known {
        if arguments.known.len() > 1 {
            console.note(format!("apply {value} {unit} to the {} sensor, then press Enter", sensor.name()));
            if !matches!(lines.next(), Some(Ok(_))) {
                return Err(Error::new(DataCode::CallInvalid, "the input ended before the last known value")
                    .help(
                        "press Enter after each value is applied, or give signals with --point SIGNAL=VALUE",
                    ));
            }
        }
        let means = measured(client, arguments.muscle, SECOND)?;
        let signal = sensor.signal(&means).ok_or_else(|| {
            Error::new(
                DeviceCode::DeviceRefused,
                format!("the board has no signal of the {} sensor", sensor.name()),
            )
            .help("`host device sensors` shows the sensors that the board measures")
        })?;
        pairs.push(Pair { value: value * si, signal: f64::from(signal) });
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_a_signal_and_a_value() {
        assert_eq!(point("0.333=0"), Ok((0.333, 0.0)));
        assert_eq!(point("-1.5 = -20"), Ok((-1.5, -20.0)));
        for wrong in ["1", "1=", "=2", "a=1", "1=nan", "1=2=3"] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
    }
}
