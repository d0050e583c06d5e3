//! What a device means, in words: its faults with their remedy, its refusals, its states.

use model_core::link::endpoints::{ClearFault, Endpoint};
use model_core::link::messages::{
    Fault, FaultReport, Field, Mode, Refusal, Sensor, Side, StartedBy, State, StoreFault, TableFault,
};

use crate::error::DeviceCode;
use pam_data::error::Error;
use pam_data::pluralise::pluralise;

/// A fault as a person reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultWords {
    /// The stable name, for logs and scripts.
    pub name: &'static str,
    /// What happened.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
    /// Unit of the judged value and its limit.
    pub unit: &'static str,
}

/// The words for a fault.
#[must_use]
pub fn fault(fault: Fault) -> FaultWords {
    let (name, cause, remedy, unit) = match fault {
        Fault::SensorRange => (
            "sensor-range",
            "a sensor reads what it cannot read",
            "look for a broken wire or a short at the sensor; its limits are in the settings",
            "",
        ),
        Fault::SensorStuck => (
            "sensor-stuck",
            "a sensor's reading does not change although the command moves",
            "look at the sensor's supply and plug; a held muscle needs a longer watch in the settings",
            "ticks",
        ),
        Fault::SensorNoisy => (
            "sensor-noisy",
            "a sensor's reading jumps about",
            "look for a loose contact or missing shield",
            "jumps",
        ),
        Fault::SensorsDisagree => (
            "sensors-disagree",
            "load cell and table contradict each other",
            "is this the table of this muscle, and is the load cell zeroed?",
            "N",
        ),
        Fault::SensorsSilent => (
            "sensors-silent",
            "no readings arrive at all",
            "look at the converter's supply and bus; on the virtual bench, is it still running?",
            "ticks",
        ),
        Fault::PressureNotRising => (
            "pressure-not-rising",
            "pressure stays below what is commanded",
            "look for a burst bladder, a leak, or closed supply air",
            "Pa",
        ),
        Fault::PressureNotFalling => (
            "pressure-not-falling",
            "pressure stays above what is commanded",
            "look for a jammed valve or a blocked exhaust; take the supply air away before touching the muscle",
            "Pa",
        ),
        Fault::OverPressure => (
            "over-pressure",
            "more pressure than allowed",
            "lower the regulator's range, or ask for less force",
            "Pa",
        ),
        Fault::OverStroke => (
            "over-stroke",
            "the stroke has left its limits",
            "look at load and end stops; the limits are in the settings",
            "m",
        ),
        Fault::OverSpeed => {
            ("over-speed", "the muscle moves faster than allowed", "has the load come off?", "m/s")
        }
        Fault::OverForce => {
            ("over-force", "more force than allowed", "is the muscle caught on something?", "N")
        }
        Fault::SetPointSilence => (
            "set-point-silence",
            "no new set-point came in time",
            "is the sending program still running, and quick enough?",
            "ticks",
        ),
        Fault::LoopOverrun => (
            "loop-overrun",
            "the control loop missed ticks",
            "stop other load on the device; an emulated one needs a faster computer",
            "ticks",
        ),
        Fault::TableMissing => (
            "table-missing",
            "this mode needs a table and there is none",
            "send one: host flash TABLE.pam --port PORT",
            "",
        ),
        Fault::TableInvalid => (
            "table-invalid",
            "the table in use is no longer what was checked",
            "send it again: host flash TABLE.pam --port PORT; if it comes back, the memory is failing",
            "",
        ),
        Fault::BrownOut => ("brown-out", "the supply sagged", "look at the supply and its cable", "V"),
        Fault::Watchdog => (
            "watchdog",
            "the watchdog restarted the device",
            "a fault of the firmware: please report it with the log",
            "",
        ),
        Fault::NotANumber => (
            "not-a-number",
            "a calculation gave something that is no number",
            "look at settings and table with `host device settings` and `host table check`; please report it",
            "",
        ),
        Fault::HostSilence => (
            "host-silence",
            "nothing was heard from the host while running",
            "was the program ended, or the cable pulled? start it again; how long silence may last is watch.host_silence_ticks, \
             and watch.autonomous=true lets a run go on without a host",
            "ticks",
        ),
    };
    FaultWords { name, cause, remedy, unit }
}

/// One line about a fault as it happened: cause, sensor, value against limit.
#[must_use]
pub fn report(report: &FaultReport) -> String {
    let words = fault(report.fault);
    let unit = match (report.sensor, words.unit) {
        (Some(sensor), "") => sensor_unit(sensor),
        (_, unit) => unit,
    };
    let sensor = report.sensor.map(|s| format!(" ({})", sensor_name(s))).unwrap_or_default();
    let side = if report.side == Side::Antagonist { " on the second muscle" } else { "" };
    // A brown-out, or a table that is missing, is a matter of yes or no.
    let judged = if (report.value, report.limit) == (0.0, 0.0) {
        String::new()
    } else {
        format!(": {} against {}", quantity(report.value, unit), quantity(report.limit, unit))
    };
    let last = &report.last;
    format!(
        "{}{sensor}{side}{judged}, {:.3} s after the start, while {} in {} mode; last readings {}, {}, {}",
        words.cause,
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
            ("it does not know this request".to_owned(), "flash the firmware of this release".to_owned())
        }
        Refusal::Malformed => (
            "it could not read the request".to_owned(),
            "device and program agree on the schema, so this is a fault in one of them: please report it"
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
            let words = fault(latched);
            (
                format!("a fault is latched: {}", words.cause),
                format!("{}; then `host device faults --clear`", words.remedy),
            )
        }
        Refusal::StillFaulty(still) => {
            let words = fault(still);
            (format!("the fault is still there: {}", words.cause), words.remedy.to_owned())
        }
        Refusal::NoTable(which) => (
            format!("the {} has no table", side(which)),
            "send one: host flash TABLE.pam --port PORT".to_owned(),
        ),
        Refusal::WrongMode(running) => (
            format!("it is in {} mode", mode(running)),
            "set-points and references belong to the running mode".to_owned(),
        ),
        Refusal::Value(field) => (
            format!("{} is out of range or no number", field_name(field)),
            "`host device settings` shows the values in force".to_owned(),
        ),
        Refusal::Table(why) => return table_refused(why),
        Refusal::Store(why) => (
            match why {
                StoreFault::Medium => "its memory failed while reading or writing".to_owned(),
                StoreFault::Full => "its memory is full".to_owned(),
                StoreFault::NoPrevious => "there is no older table to go back to".to_owned(),
                StoreFault::Verify => "its memory does not keep what is written".to_owned(),
            },
            match why {
                StoreFault::NoPrevious => "a roll-back goes back one table at most".to_owned(),
                _ => "try again; if it comes back, the flash is worn out".to_owned(),
            },
        ),
        Refusal::Range => ("the request goes beyond the end".to_owned(), "ask for less".to_owned()),
        Refusal::NotSupported => {
            ("this board cannot do that".to_owned(), "`host device info` shows what it can".to_owned())
        }
        Refusal::Stiffness { low_nm_per_rad: low, high_nm_per_rad: high } => (
            format!(
                "with both muscles taut the joint has a stiffness of {low:.1} to {high:.1} N·m/rad at this angle"
            ),
            "ask for one of these; another radius or rest stroke of the joint moves them (the settings' `joint`)"
                .to_owned(),
        ),
        Refusal::Angle { low_rad, high_rad } => (
            format!(
                "both muscles of the joint are taut from {:.1}° to {:.1}° only",
                low_rad.to_degrees(),
                high_rad.to_degrees()
            ),
            "ask for one of these; a smaller radius or another rest stroke of the joint moves them (the settings' `joint`)"
                .to_owned(),
        ),
    };
    Error::new(DeviceCode::DeviceRefused, format!("the device refuses `{request}`: {why}")).help(help)
}

fn table_refused(why: TableFault) -> Error {
    let cause = match why {
        TableFault::NotBegun => "pieces came without a beginning".to_owned(),
        TableFault::Gap(there) => format!("a piece is missing behind byte {there}"),
        TableFault::TooLong(fits) => format!("it is longer than the {fits} bytes that the device keeps"),
        TableFault::Incomplete(there) => format!("only {} arrived", pluralise(there, "byte")),
        TableFault::Check => "its check sum is wrong".to_owned(),
        TableFault::Version { found, known } => {
            format!("it has format version {found}, the device reads version {known}")
        }
        TableFault::Malformed => "its bytes are no table".to_owned(),
        TableFault::NotFinite => "a number in it is not finite".to_owned(),
        TableFault::NotOrdered => "its pressures are not in rising order".to_owned(),
        TableFault::OutOfRange => "a number in it is out of range".to_owned(),
        TableFault::UnknownEffect => "it carries an effect that this firmware does not know".to_owned(),
    };
    let help = match why {
        TableFault::NotBegun | TableFault::Gap(_) | TableFault::Incomplete(_) | TableFault::Check => {
            "the line lost bytes: try again, look at the cable"
        }
        TableFault::Version { .. } | TableFault::UnknownEffect => {
            "flash the firmware of this release: host flash --firmware ELF --chip CHIP"
        }
        _ => "judge it with `host table check`, and fit again",
    };
    Error::new(
        DeviceCode::DeviceRefused,
        format!("the device refuses the table: {cause}; the one before stays in use"),
    )
    .help(help)
}

const fn field_name(field: Field) -> &'static str {
    match field {
        Field::SetPoint => "a set-point",
        Field::Reference => "a parameter of the reference",
        Field::ForceLoop => "the setting `force_loop`",
        Field::StrokeLoop => "the setting `stroke_loop`",
        Field::Joint => "the setting `joint`",
        Field::Regulator => "the setting `regulator`",
        Field::Limits => "the setting `limits`",
        Field::SensorWatch => "a sensor's watch in the settings",
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
        for (at, words) in all.iter().enumerate() {
            assert!(!words.remedy.is_empty());
            assert!(all[..at].iter().all(|other| other.name != words.name && other.cause != words.cause));
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
        assert!(error.to_string().ends_with("a stiffness of 25.0 to 30.0 N·m/rad at this angle"), "{error}");
        let error = refused("set_point", Refusal::Angle { low_rad: -0.1, high_rad: 0.1 });
        assert!(error.to_string().ends_with("taut from -5.7° to 5.7° only"), "{error}");
    }
}
