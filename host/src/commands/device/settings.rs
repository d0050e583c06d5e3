//! `host device settings`: show, change, save or restore the settings.

use std::path::PathBuf;

use clap::Args;
use model_core::link::endpoints::{GetBoardSettings, GetSettings, SetSettings};
use model_core::link::settings::Settings;

use crate::commands::port::PortOption;
use crate::console::Console;
use crate::documents::{device as document, text};
use pam_data::bounds;
use pam_data::error::{DataCode, Error, Result, nearest};
use pam_data::output::json_of;
use pam_device::error::DeviceCode;

/// Arguments of `host device settings`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    port: PortOption,
    /// Change one setting; may be given again.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Take all settings from a file that `host device settings` printed.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "defaults")]
    from: Option<PathBuf>,
    /// Begin with the board's own settings, those of a new device; the calibration of its sensors is lost.
    #[arg(long)]
    defaults: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let mut wanted = match &arguments.from {
        Some(path) => {
            let text = bounds::read_text(path, bounds::WRITTEN)?.map_err(|()| {
                Error::new(DataCode::FileUnreadable, "is binary, not text")
                    .file(path)
                    .help("settings of a device are TOML, as `host device settings` prints them")
            })?;
            Some(toml::from_str::<Settings>(&text).map_err(|e| {
                pam_data::toml_errors::toml_error(DataCode::CallInvalid, &text, &e)
                    .file(path)
                    .help("the file must hold all settings, as `host device settings` prints them")
            })?)
        }
        None => None,
    };
    let mut client = arguments.port.connect(console)?;
    if arguments.defaults {
        wanted = Some(client.call::<GetBoardSettings>(&())?);
    }
    let before = client.call::<GetSettings>(&())?;
    for assignment in &arguments.set {
        wanted = Some(changed(wanted.unwrap_or(before), assignment)?);
    }
    let mut now = before;
    if let Some(wanted) = wanted {
        // The answer says what is in force, and asking again says what is kept: both must be what was sent.
        let answered = client.call_once::<SetSettings>(&wanted)?;
        now = client.call::<GetSettings>(&())?;
        if answered != wanted || now != wanted {
            return Err(Error::new(
                DeviceCode::DeviceVerify,
                "the settings read back from the device differ from those sent",
            )
            .help("look at them with `host device settings`"));
        }
        console.note("written and read back");
    }
    if arguments.json {
        let settings = json_of(&now).as_object().cloned().unwrap_or_default();
        console.result(text(&document::Settings { schema: "pam-device-settings/1", settings })?);
    } else {
        let text = toml::to_string(&now).map_err(|e| {
            Error::new(DeviceCode::DeviceVerify, format!("the settings cannot be printed: {e}"))
        })?;
        console.result(text.trim_end());
    }
    Ok(())
}

/// The settings with one of them changed, by its dotted name.
pub(crate) fn changed(settings: Settings, assignment: &str) -> Result<Settings> {
    let wrong = |cause: String| {
        Error::new(DataCode::CallInvalid, cause)
            .value(assignment)
            .help("write KEY=VALUE with a key as `host device settings` prints it, such as limits.pressure_pa=500e3")
    };
    let (key, value) = assignment.split_once('=').ok_or_else(|| wrong("a setting needs a value".into()))?;
    let mut all =
        toml::Value::try_from(settings).map_err(|e| wrong(format!("the settings cannot be changed: {e}")))?;
    let mut place = &mut all;
    for part in key.trim().split('.') {
        let table = place.as_table_mut().ok_or_else(|| wrong(format!("`{key}` names no setting")))?;
        let names: Vec<String> = table.keys().cloned().collect();
        place = table.get_mut(part).ok_or_else(|| {
            let near = nearest(part, names.iter().map(String::as_str))
                .map(|n| format!("; did you mean `{n}`?"))
                .unwrap_or_default();
            wrong(format!("`{key}` names no setting{near}"))
        })?;
    }
    let value = value.trim();
    *place = match place {
        toml::Value::Float(_) => {
            value.parse().map(toml::Value::Float).map_err(|_| wrong("not a number".into()))?
        }
        toml::Value::Integer(_) => {
            value.parse().map(toml::Value::Integer).map_err(|_| wrong("not a whole number".into()))?
        }
        toml::Value::Boolean(_) => {
            value.parse().map(toml::Value::Boolean).map_err(|_| wrong("neither true nor false".into()))?
        }
        toml::Value::String(_) => toml::Value::String(value.to_owned()),
        _ => return Err(wrong(format!("`{key}` is a group of settings, not one"))),
    };
    all.try_into().map_err(|e: toml::de::Error| wrong(e.message().to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_setting_is_changed_by_its_name_and_wrong_names_are_met_with_the_nearest() {
        let all = Settings::default();
        let now = changed(all, "limits.pressure_pa=500e3").unwrap();
        assert_eq!(now.limits.pressure_pa, 500e3);
        assert_eq!(Settings { limits: all.limits, ..now }, all);
        assert_eq!(changed(all, "watch.silence_ticks = 200").unwrap().watch.silence_ticks, 200);
        assert!(matches!(
            changed(all, "feed_forward=Gaylord").unwrap().feed_forward,
            model_core::link::settings::FeedForward::Gaylord
        ));
        for (wrong, hint) in [
            ("limits.presure_pa=1", "did you mean `pressure_pa`"),
            ("limits=1", "group"),
            ("limits.pressure_pa=much", "not a number"),
            ("watch.silence_ticks=-1", "invalid"),
            ("feed_forward=Best", "unknown variant"),
            ("limits.pressure_pa", "needs a value"),
        ] {
            let error = changed(all, wrong).unwrap_err();
            assert!(error.to_string().contains(hint), "{wrong}: {error}");
            assert_eq!(error.exit_status(), 2);
        }
    }
}
