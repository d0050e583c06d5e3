//! Faults: cause, remedy, and the values at the moment of the fault.

use model_core::link::messages::{Fault, FaultReport, Sensor, Side};
use pam_data::error::Error;

use super::{mode, state};
use crate::error::DeviceCode;

/// The message about a fault. Long because it is a table with one row for each fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultMessage {
    /// The stable name, for logs and scripts.
    pub name: &'static str,
    /// What happened.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
    /// Unit of the judged value and its limit.
    pub unit: &'static str,
}

/// The message about a fault. Long because it is a table with one row for each fault.
#[must_use]
pub fn fault(fault: Fault) -> FaultMessage {
    let (name, cause, remedy, unit) = match fault {
        Fault::SensorRange => (
            "sensor-range",
            "a sensor reading is out of range",
            "check the sensor for a broken wire or a short circuit; its range is in the settings",
            "",
        ),
        Fault::SensorStuck => (
            "sensor-stuck",
            "a sensor reading does not change while the command changes",
            "check the supply and the plug of the sensor; for a muscle held still, set a longer time in the settings",
            "ticks",
        ),
        Fault::SensorNoisy => (
            "sensor-noisy",
            "a sensor reading jumps",
            "check for a loose contact or a missing cable shield",
            "jumps",
        ),
        Fault::SensorsDisagree => (
            "sensors-disagree",
            "the load cell and the table disagree",
            "check that the table belongs to this muscle and that the load cell is zeroed",
            "N",
        ),
        Fault::SensorsSilent => (
            "sensors-silent",
            "no sensor readings arrive",
            "check the supply and the bus of the converter; with the virtual bench, check that it is running",
            "ticks",
        ),
        Fault::PressureNotRising => (
            "pressure-not-rising",
            "the pressure stays below the command",
            "check for a burst bladder, a leak, or a closed air supply; with a pair of valves also for a blocked pressure sensor",
            "Pa",
        ),
        Fault::PressureNotFalling => (
            "pressure-not-falling",
            "the pressure stays above the command",
            "shut off the air supply before you touch the muscle, then check for a jammed valve or a blocked exhaust",
            "Pa",
        ),
        Fault::OverPressure => (
            "over-pressure",
            "the pressure exceeds its limit",
            "reduce the range of the regulator, or the requested force",
            "Pa",
        ),
        Fault::OverStroke => (
            "over-stroke",
            "the stroke is outside its limits",
            "check the load and the end stops; the limits are in the settings",
            "m",
        ),
        Fault::OverSpeed => (
            "over-speed",
            "the speed of the muscle exceeds its limit",
            "check that the load is still attached",
            "m/s",
        ),
        Fault::OverForce => {
            ("over-force", "the force exceeds its limit", "check that the muscle can move freely", "N")
        }
        Fault::SetPointSilence => (
            "set-point-silence",
            "no new setpoint arrived in time",
            "check that the sending program is running and sends often enough",
            "ticks",
        ),
        Fault::LoopOverrun => (
            "loop-overrun",
            "the control loop missed ticks",
            "reduce the load on the device; an emulated device needs a faster computer",
            "ticks",
        ),
        Fault::TableMissing => (
            "table-missing",
            "this mode needs a table, and the device has none",
            "send one: host flash TABLE.pam --port PORT",
            "",
        ),
        Fault::TableInvalid => (
            "table-invalid",
            "the table in use has changed since it was checked",
            "send it again: host flash TABLE.pam --port PORT; if the fault returns, the memory is failing",
            "",
        ),
        Fault::BrownOut => {
            ("brown-out", "the supply voltage dropped", "check the power supply and its cable", "V")
        }
        Fault::Watchdog => (
            "watchdog",
            "the watchdog restarted the device",
            "this is a firmware fault: report it with the log",
            "",
        ),
        Fault::NotANumber => (
            "not-a-number",
            "a calculation gave a value that is not finite",
            "check the settings and the table with `host device settings` and `host table check`, and report the fault",
            "",
        ),
        Fault::HostSilence => (
            "host-silence",
            "the host was silent while the controller was running",
            "check that the program is running and the cable is connected, then start again; watch.host_silence_ticks sets the \
             time-out, and watch.autonomous=true lets a run continue without a host",
            "ticks",
        ),
        Fault::SettingsInvalid => (
            "settings-invalid",
            "the kept settings are damaged, or another firmware wrote them",
            "look at `host device settings` and send them again, with --from FILE.toml, --set or --defaults",
            "",
        ),
        Fault::NotVented => (
            "not-vented",
            "a vented muscle is still under pressure",
            "wait until the pressure has fallen; if it does not, shut off the supply air and check the dump valve and the sensor's zero",
            "Pa",
        ),
        Fault::HoldEnded => (
            "hold-ended",
            "a held command was vented after its time",
            "how long a fault may hold a command is watch.hold_ticks",
            "ticks",
        ),
        Fault::ClockFailed => (
            "clock-failed",
            "the board's crystal clock failed",
            "look at the debug probe's clock and its solder bridges; the board runs on its own oscillator until it restarts",
            "",
        ),
        Fault::ValveTest => (
            "valve-test",
            "the regulator did not fill the muscle, filled it too far, or the dump valve did not empty it, in the test before arming",
            "look at supply air, regulator and dump valve, and at the scales of the pressure sensor (scales.pressure) and the command \
             (command.full_pa); the test's pressure is watch.valve_test_pa",
            "Pa",
        ),
        Fault::PressureSensorsDisagree => (
            "pressure-sensors-disagree",
            "the two pressure sensors of a muscle disagree",
            "compare both with a gauge (`host device sensors`), and calibrate or replace the wrong one; the largest difference is \
             watch.second_pressure_pa",
            "Pa",
        ),
        Fault::SupplyPressureLow => (
            "supply-pressure-low",
            "the supply air is below its least pressure",
            "check compressor, valve and filter; the least pressure is watch.supply_low_pa",
            "Pa",
        ),
        Fault::EnableOpen => (
            "enable-open",
            "the enable input is open: an emergency stop was pressed, or its wire is broken",
            "release the emergency stop and check its circuit, then clear the fault",
            "",
        ),
    };
    FaultMessage { name, cause, remedy, unit }
}

/// One line about a fault as it happened: cause, sensor, value against limit.
#[must_use]
pub fn report(report: &FaultReport) -> String {
    let message = fault(report.fault);
    let unit = match (report.sensor, message.unit) {
        (Some(sensor), "") => sensor_unit(sensor),
        (_, unit) => unit,
    };
    let sensor = report.sensor.map(|s| format!(" ({})", sensor_name(s))).unwrap_or_default();
    let side = if report.side == Side::Antagonist { " on the second muscle" } else { "" };
    // A brown-out, or a table that is missing, has no value and no limit.
    let judged = if (report.value, report.limit) == (0.0, 0.0) {
        String::new()
    } else {
        format!(": {} against {}", quantity(report.value, unit), quantity(report.limit, unit))
    };
    let last = &report.last;
    format!(
        "{}{sensor}{side}{judged}, {:.3} s after the start, while {} in {} mode; last readings {}, {}, {}",
        message.cause,
        report.time_us as f64 * 1e-6,
        state(report.from),
        mode(report.mode),
        quantity(last.pressure_pa, "Pa"),
        quantity(last.stroke_m, "m"),
        quantity(last.force_n, "N"),
    )
}

/// The error that ends a command because of a fault.
#[must_use]
pub(crate) fn stopped(fault_report: &FaultReport) -> Error {
    Error::new(DeviceCode::DeviceFault, format!("the controller stopped itself: {}", report(fault_report)))
        .help(format!("{}; then `host device faults --clear`", fault(fault_report.fault).remedy))
}

/// A value in a unit that people use: kPa and mm instead of Pa and m.
#[must_use]
fn quantity(value: f32, unit: &str) -> String {
    match unit {
        "Pa" => format!("{:.1} kPa", value / 1e3),
        "m" => format!("{:.2} mm", value * 1e3),
        "m/s" => format!("{:.1} mm/s", value * 1e3),
        "N" => format!("{value:.2} N"),
        "" => format!("{value}"),
        other => format!("{value} {other}"),
    }
}

fn sensor_name(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Pressure => "pressure",
        Sensor::Stroke => "stroke",
        Sensor::Force => "load cell",
    }
}

fn sensor_unit(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Pressure => "Pa",
        Sensor::Stroke => "m",
        Sensor::Force => "N",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_its_own_name_cause_and_remedy() {
        let all: Vec<_> = Fault::ALL.iter().map(|f| fault(*f)).collect();
        for (at, message) in all.iter().enumerate() {
            assert!(!message.remedy.is_empty());
            assert!(all[..at].iter().all(|other| other.name != message.name && other.cause != message.cause));
        }
    }
}
