//! Settings, and what the guide of the first set-up orders: signals and calibration of the sensors, identification of the pressure regulator.

use model_core::link::endpoints::{GetSettings, GetStatus, ReadSignals, SetSettings};
use model_core::link::messages::{Side, SignalsRead};
use model_core::link::settings::Settings;
use pam_device::calibration::{Pair, Sensor, scale_through};
use pam_device::error::DeviceCode;
use pam_device::{Subscription, regulator};

use super::Connected;
use crate::commands::device::regulator_text;
use crate::studio::answers::{Answer, Calibrated, Identified, SensorSignal, Signals, StoredSettings};
use pam_data::error::{DataCode, Error, Result};

impl Connected {
    /// Changes settings, each `KEY=VALUE`; the answer is all of them.
    pub(super) fn settings(&mut self, changes: &[String]) -> Result<Answer> {
        let mut settings = self.client.call::<GetSettings>(&())?;
        for change in changes {
            settings = crate::commands::device::changed(settings, change)?;
        }
        if !changes.is_empty() {
            self.write(settings)?;
        }
        self.settings = settings;
        Ok(Answer::Settings(Box::new(StoredSettings { stored: settings, defaults: Settings::default() })))
    }

    /// Writes settings and reads them back.
    fn write(&mut self, settings: Settings) -> Result<()> {
        let kept = self.client.call_once::<SetSettings>(&settings)?;
        if kept != settings || self.client.call::<GetSettings>(&())? != settings {
            return Err(Error::new(
                DeviceCode::DeviceVerify,
                "the settings read back from the device differ from those sent",
            ));
        }
        self.settings = settings;
        Ok(())
    }

    /// Means of the signals since this was ordered before: the page orders twice, so that no order waits.
    pub(super) fn signals(&mut self) -> Result<Answer> {
        let means = self.client.call_once::<ReadSignals>(&SignalsRead { side: Side::Agonist })?;
        let one = |sensor: Sensor| {
            let (unit, si) = sensor.unit();
            let signal = sensor.signal(&means)?;
            let reading = f64::from(sensor.scale(&self.settings.scales).reading(signal)) / si;
            Some(SensorSignal { sensor: sensor.name(), unit, signal, reading })
        };
        Ok(Answer::Signals(Signals { sensors: Sensor::ALL.into_iter().filter_map(one).collect() }))
    }

    /// The scale through known values and the signals at them; kept in the settings if `keep`.
    pub(super) fn calibrate(&mut self, sensor: Sensor, pairs: &[Pair], keep: bool) -> Result<Answer> {
        let mut settings = self.client.call::<GetSettings>(&())?;
        let before = sensor.scale(&settings.scales);
        let found = scale_through(pairs, &before)?;
        if keep {
            *sensor.scale_mut(&mut settings) = found.scale;
            self.write(settings)?;
        }
        let (unit, si) = sensor.unit();
        let shown = |value: f32| f64::from(value) / si;
        Ok(Answer::Calibrated(Calibrated {
            unit,
            before: [shown(before.at_zero), shown(before.per_unit)],
            now: [shown(found.scale.at_zero), shown(found.scale.per_unit)],
            errors: found.errors.iter().map(|error| error / si).collect(),
            kept: keep,
        }))
    }

    /// Steps the pressure, and finds the regulator. The telemetry stops meanwhile: the steps need all samples.
    pub(in crate::studio::session) fn identify(
        &mut self,
        low_pa: f64,
        high_pa: f64,
        stop: &dyn Fn() -> bool,
    ) -> Result<Answer> {
        if self.recorder.is_some() {
            return Err(Error::new(DataCode::CallInvalid, "a recording is under way")
                .help("end it first: the steps take the telemetry for themselves"));
        }
        self.vent()?;
        self.end_telemetry()?;
        let found = regulator::identify_whole(&mut self.client, low_pa, high_pa, stop);
        self.stream = Some(Subscription::begin(&mut self.client, 1)?);
        self.status = self.client.call::<GetStatus>(&())?;
        let found = found?;
        self.identified = Some(found);
        Ok(Answer::Identified(Identified { text: regulator_text(&found), kept: false }))
    }

    /// Keeps the regulator that was found last in the settings.
    pub(super) fn keep_regulator(&mut self) -> Result<Answer> {
        let found = self.identified.ok_or_else(|| {
            Error::new(DataCode::CallInvalid, "no regulator was identified").help("step the pressure first")
        })?;
        found.keep(&mut self.client)?;
        self.settings = self.client.call::<GetSettings>(&())?;
        Ok(Answer::Identified(Identified { text: regulator_text(&found), kept: true }))
    }
}
