//! Refused requests as errors: what was refused, why, and the remedy.

use model_core::link::endpoints::{ClearFault, Endpoint, StartMode};
use model_core::link::messages::{Field, Refusal, State, StoreFault, TableFault, UpdateFault};
use pam_data::error::Error;
use pam_data::pluralise::pluralise;

use super::{fault, mode, side, state};
use crate::error::DeviceCode;

/// A refusal as an error: what was refused, why, what to do. Long because it is a table with one row for each refusal.
#[must_use]
pub(crate) fn refused(request: &str, refusal: Refusal) -> Error {
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
                State::Armed => "disarm it first: host vent --port PORT".to_owned(),
                State::Running => "stop it first: host vent --port PORT".to_owned(),
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
        Refusal::Value(Field::SensorWatch) if request == StartMode::NAME => (
            "this mode needs a stroke sensor, and the settings have none".to_owned(),
            "connect one and set it: host device settings --set stroke.fitted=true".to_owned(),
        ),
        Refusal::Value(field) => (
            format!("{} is out of range or not a number", field_name(field)),
            match field {
                Field::Valves => "a pair of valves needs a board with outputs for it, a pressure sensor, `regulator.lag_s` of two \
                                  periods or more, and a supply above `regulator.command_max_pa`; the book lists the ranges"
                    .to_owned(),
                Field::Can => "`can.address` is 0 to 8 and needs a board with a CAN controller; `can.kbit_per_s` is 125, 250, 500 or 1000"
                    .to_owned(),
                _ => "`host device settings` shows the values in force".to_owned(),
            },
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
        Refusal::Update(why) => return update_refused(why),
    };
    Error::new(DeviceCode::DeviceRefused, format!("the device refuses `{request}`: {why}")).help(help)
}

/// The error of a program that requests what belongs to another one.
#[must_use]
pub fn in_use(request: &str) -> Error {
    Error::new(
        DeviceCode::DeviceInUse,
        format!("the device refuses `{request}`: another program has armed it or started its mode"),
    )
    .help("end the other program; `host vent --port PORT` ends its run")
}

fn update_refused(why: UpdateFault) -> Error {
    let again = "send it again; if the refusal returns, the flash memory is failing";
    let (cause, help) = match why {
        UpdateFault::NotBegun => {
            ("a piece arrived before the update was started".to_owned(), "send it again")
        }
        UpdateFault::Malformed => {
            ("its header cannot be decoded".to_owned(), "pack it with `host update pack` of this release")
        }
        UpdateFault::Board => {
            ("it is for another board".to_owned(), "build it for the board that `host device info` shows")
        }
        UpdateFault::Slot => (
            "it is linked for another slot".to_owned(),
            "pack images for both slots: build one of them with --slot-b",
        ),
        UpdateFault::TooLong => ("it is longer than the slot".to_owned(), "build it with --small"),
        UpdateFault::Signature => (
            "its signature is not that of the key in the device".to_owned(),
            "sign it with the key whose public part the running firmware was built with, or program the board with a debug probe",
        ),
        UpdateFault::Gap(there) => (format!("a piece is missing after byte {there}"), "send it again"),
        UpdateFault::Digest => ("what arrived is not what was signed".to_owned(), again),
        UpdateFault::Medium => ("its flash memory failed".to_owned(), again),
        UpdateFault::NoOther => {
            ("the other slot has no whole firmware".to_owned(), "send one with `host update send`")
        }
    };
    Error::new(
        DeviceCode::DeviceRefused,
        format!("the device refuses the firmware: {cause}; the one that runs stays in use"),
    )
    .help(help)
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
        Field::Scale => "the scale or the filter of a sensor",
        Field::Command => "the output to the pressure regulator",
        Field::Valves => "the setting `valves`",
        Field::Can => "the setting `can`",
        Field::Rate => "the rate of telemetry or of a trace",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::messages::Side;

    #[test]
    fn a_refusal_names_request_cause_and_remedy() {
        let error = refused("start", Refusal::NoTable(Side::Agonist));
        assert_eq!(error.to_string(), "the device refuses `start`: the agonist has no table");
        assert_eq!(error.advice(), Some("send one: host flash TABLE.pam --port PORT"));
        assert_eq!(error.exit_status(), 1);
        let error =
            refused("set_point", Refusal::Stiffness { low_nm_per_rad: 25.04, high_nm_per_rad: 29.96 });
        assert!(error.to_string().ends_with("stiffness is 25.0 to 30.0 N·m/rad at this angle"), "{error}");
        let error = refused("set_settings", Refusal::Value(Field::Valves));
        assert!(error.to_string().contains("the setting `valves`"), "{error}");
        assert!(error.advice().is_some_and(|advice| advice.contains("a board with outputs for it")));
        let error = refused("start", Refusal::Value(Field::SensorWatch));
        assert!(error.to_string().contains("needs a stroke sensor"), "{error}");
        let error = refused("set_settings", Refusal::Value(Field::Can));
        assert!(error.advice().is_some_and(|advice| advice.contains("125, 250, 500 or 1000")));
        let error = refused("set_point", Refusal::Angle { low_rad: -0.1, high_rad: 0.1 });
        assert!(error.to_string().ends_with("taut from -5.7° to 5.7° only"), "{error}");
    }
}
