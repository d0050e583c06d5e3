//! Messages for people about a device: its faults with their remedies, its refusals, its states.

use model_core::link::endpoints::{ClearFault, Endpoint};
use model_core::link::messages::{
    Fault, FaultReport, Field, Mode, Refusal, Sensor, Side, StartedBy, State, StoreFault, TableFault,
};

use crate::error::DeviceCode;
use pam_data::error::Error;
use pam_data::pluralise::pluralise;

/// The message about a fault.
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

/// The message about a fault.
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
            "check for a burst bladder, a leak, or a closed air supply",
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
            "the regulator did not fill the muscle, or the dump valve did not empty it, in the test before arming",
            "look at supply air, regulator and dump valve; the test's pressure is watch.valve_test_pa",
            "Pa",
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
pub fn stopped(fault_report: &FaultReport) -> Error {
    Error::new(DeviceCode::DeviceFault, format!("the controller stopped itself: {}", report(fault_report)))
        .help(format!("{}; then `host device faults --clear`", fault(fault_report.fault).remedy))
}

/// A value in a unit that people use: kPa and mm instead of Pa and m.
#[must_use]
pub fn quantity(value: f32, unit: &str) -> String {
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

/// A state's name.
#[must_use]
pub const fn state(state: State) -> &'static str {
    match state {
        State::Disarmed => "disarmed",
        State::Armed => "armed",
        State::Running => "running",
        State::Fault => "fault",
    }
}

/// A mode's name.
#[must_use]
pub const fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Vent => "vent",
        Mode::Pressure => "pressure",
        Mode::Force => "force",
        Mode::Stroke => "stroke",
        Mode::Pair => "pair",
    }
}

/// A muscle's name.
#[must_use]
pub const fn side(side: Side) -> &'static str {
    match side {
        Side::Agonist => "agonist",
        Side::Antagonist => "antagonist",
    }
}

/// Why a device started.
#[must_use]
pub const fn started_by(started_by: StartedBy) -> &'static str {
    match started_by {
        StartedBy::Power => "power",
        StartedBy::Request => "request",
        StartedBy::Watchdog => "watchdog",
        StartedBy::BrownOut => "brown-out",
    }
}

/// A refusal as an error: what was refused, why, what to do.
#[must_use]
pub fn refused(request: &str, refusal: Refusal) -> Error {
    let (why, help) = match refusal {
        Refusal::UnknownEndpoint => {
            ("it does not support this request".to_owned(), "flash the firmware of this release".to_owned())
        }
        Refusal::Malformed => (
            "it could not decode the request".to_owned(),
            "the device and the program use the same schema, so this is a defect in one of them: report it"
                .to_owned(),
        ),
        Refusal::WrongState(now) => (
            format!("it is {}", state(now)),
            match now {
                State::Disarmed if request == ClearFault::NAME => "there is no fault to clear".to_owned(),
                State::Disarmed => "arm it first".to_owned(),
                State::Armed | State::Running => "stop it first: host vent --port PORT".to_owned(),
                State::Fault => "see `host device faults`, then clear it with --clear".to_owned(),
            },
        ),
        Refusal::Latched(latched) => {
            let message = fault(latched);
            (
                format!("a fault is latched: {}", message.cause),
                format!("{}; then `host device faults --clear`", message.remedy),
            )
        }
        Refusal::StillFaulty(still) => {
            let message = fault(still);
            (format!("the fault is still present: {}", message.cause), message.remedy.to_owned())
        }
        Refusal::NoTable(which) => (
            format!("the {} has no table", side(which)),
            "send one: host flash TABLE.pam --port PORT".to_owned(),
        ),
        Refusal::WrongMode(running) => (
            format!("it is in {} mode", mode(running)),
            "setpoints and references must match the running mode".to_owned(),
        ),
        Refusal::Value(field) => (
            format!("{} is out of range or not a number", field_name(field)),
            "`host device settings` shows the values in force".to_owned(),
        ),
        Refusal::Table(why) => return table_refused(why),
        Refusal::Store(why) => (
            match why {
                StoreFault::Medium => "its memory failed while reading or writing".to_owned(),
                StoreFault::Full => "its memory is full".to_owned(),
                StoreFault::NoPrevious => "it has no previous table".to_owned(),
                StoreFault::Verify => "its memory does not retain what is written".to_owned(),
            },
            match why {
                StoreFault::NoPrevious => "a rollback restores the previous table only".to_owned(),
                _ => "try again; if the refusal returns, the flash memory is worn out".to_owned(),
            },
        ),
        Refusal::Range => ("the request reaches past the end of the data".to_owned(), "request less".to_owned()),
        Refusal::NotSupported => {
            ("this board cannot do that".to_owned(), "`host device info` shows what it can".to_owned())
        }
        Refusal::Stiffness { low_nm_per_rad: low, high_nm_per_rad: high } => (
            format!(
                "with both muscles taut the joint stiffness is {low:.1} to {high:.1} N·m/rad at this angle"
            ),
            "choose a value in this range; another radius or rest stroke of the joint moves them (the settings' `joint`)"
                .to_owned(),
        ),
        Refusal::Angle { low_rad, high_rad } => (
            format!(
                "both muscles of the joint are taut from {:.1}° to {:.1}° only",
                low_rad.to_degrees(),
                high_rad.to_degrees()
            ),
            "choose an angle in this range; a smaller radius or another rest stroke of the joint moves them (the settings' `joint`)"
                .to_owned(),
        ),
        Refusal::OtherSession => return in_use(request),
    };
    Error::new(DeviceCode::DeviceRefused, format!("the device refuses `{request}`: {why}")).help(help)
}

/// The error of a program that asks for what belongs to another one.
#[must_use]
pub fn in_use(request: &str) -> Error {
    Error::new(
        DeviceCode::DeviceInUse,
        format!("the device refuses `{request}`: another program has armed it or started its mode"),
    )
    .help("end the other program; `host vent --port PORT` ends its run")
}

fn table_refused(why: TableFault) -> Error {
    let cause = match why {
        TableFault::NotBegun => "a piece arrived before the upload was started".to_owned(),
        TableFault::Gap(there) => format!("a piece is missing after byte {there}"),
        TableFault::TooLong(fits) => format!("it is longer than the {fits} bytes that the device keeps"),
        TableFault::Incomplete(there) => format!("only {} arrived", pluralise(there, "byte")),
        TableFault::Check => "its checksum is wrong".to_owned(),
        TableFault::Version { found, known } => {
            format!("it has format version {found}, the device reads version {known}")
        }
        TableFault::Malformed => "it cannot be decoded".to_owned(),
        TableFault::NotFinite => "a number in it is not finite".to_owned(),
        TableFault::NotOrdered => "its pressures are not in rising order".to_owned(),
        TableFault::OutOfRange => "a number in it is out of range".to_owned(),
        TableFault::UnknownEffect => "it contains an effect that this firmware does not support".to_owned(),
    };
    let help = match why {
        TableFault::NotBegun | TableFault::Gap(_) | TableFault::Incomplete(_) | TableFault::Check => {
            "bytes were lost on the line: try again, and check the cable"
        }
        TableFault::Version { .. } | TableFault::UnknownEffect => {
            "flash the firmware of this release: host flash --firmware ELF --chip CHIP"
        }
        _ => "check it with `host table check`, and fit again",
    };
    Error::new(
        DeviceCode::DeviceRefused,
        format!("the device refuses the table: {cause}; the previous table stays in use"),
    )
    .help(help)
}

const fn field_name(field: Field) -> &'static str {
    match field {
        Field::SetPoint => "a setpoint",
        Field::Reference => "a parameter of the reference",
        Field::ForceLoop => "the setting `force_loop`",
        Field::StrokeLoop => "the setting `stroke_loop`",
        Field::Joint => "the setting `joint`",
        Field::Regulator => "the setting `regulator`",
        Field::Limits => "the setting `limits`",
        Field::SensorWatch => "a sensor monitor in the settings",
        Field::Watch => "the setting `watch`",
        Field::Bands => "a band of motion in the settings",
        Field::Rate => "the rate of telemetry or of a trace",
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

    #[test]
    fn a_refusal_names_request_cause_and_remedy() {
        let error = refused("start", Refusal::NoTable(Side::Agonist));
        assert_eq!(error.to_string(), "the device refuses `start`: the agonist has no table");
        assert_eq!(error.advice(), Some("send one: host flash TABLE.pam --port PORT"));
        assert_eq!(error.exit_status(), 1);
        let error =
            refused("set_point", Refusal::Stiffness { low_nm_per_rad: 25.04, high_nm_per_rad: 29.96 });
        assert!(error.to_string().ends_with("stiffness is 25.0 to 30.0 N·m/rad at this angle"), "{error}");
        let error = refused("set_point", Refusal::Angle { low_rad: -0.1, high_rad: 0.1 });
        assert!(error.to_string().ends_with("taut from -5.7° to 5.7° only"), "{error}");
    }
}
