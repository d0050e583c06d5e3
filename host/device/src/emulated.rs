//! A controller without hardware: the firmware in QEMU, or the same firmware in this process, on a muscle of the virtual bench.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use firmware::board::{Inputs, Outputs, Readings};
use firmware::native::{Device, Options};
use virtual_bench::bench::BenchSpec;
use virtual_bench::lockstep::{Answer, Station};
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::plant::{Motion, Plant};

use crate::Address;
use crate::error::DeviceCode;
use pam_data::error::{Error, Result};

mod axis;
pub mod axis_server;
mod guard;
pub mod qemu;
pub mod relay;
pub mod wire;

pub use axis::Axis;
use qemu::Qemu;
pub use qemu::image;

/// Where the firmware runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Its image, on an emulated Cortex-M4.
    Qemu,
    /// Its library, in this process.
    Native,
}

/// What goes wrong on the bench, for trying what a controller does then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Mishap {
    /// Nothing goes wrong.
    None = 0,
    /// The load cell's wire breaks: its reading leaves its range.
    LoadCell = 1,
    /// The supply air is closed: no pressure follows.
    Supply = 2,
    /// The pressure sensor reads the same without end.
    StuckGauge = 3,
}

impl Mishap {
    /// The mishap of a number; anything unknown is none.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code {
            1 => Self::LoadCell,
            2 => Self::Supply,
            3 => Self::StuckGauge,
            _ => Self::None,
        }
    }
}

/// A muscle on the virtual bench, what moves it, and what goes wrong there.
#[derive(Debug, Clone)]
pub struct Stand {
    spec: BenchSpec,
    motion: Motion,
    plant: Plant,
    mishap: Arc<AtomicU8>,
    stuck: Option<f32>,
    axis: Option<Axis>,
}

/// One control tick, s.
const TICK: f64 = 1e-3;

impl Stand {
    /// A muscle that is moved as described.
    #[must_use]
    pub fn new(spec: BenchSpec, motion: Motion) -> Self {
        let plant = Plant::new(&spec, &motion);
        Self { spec, motion, plant, mishap: Arc::default(), stuck: None, axis: None }
    }

    /// A muscle whose free end an axis moves as it is commanded.
    #[must_use]
    pub fn commanded(spec: BenchSpec, axis: Axis) -> Self {
        Self { axis: Some(axis), ..Self::new(spec, Motion::Held { stroke_mm: 0.0 }) }
    }

    /// A muscle that swings slowly around a fifth of its free stroke at nine tenths of its largest pressure.
    #[must_use]
    pub fn swinging(muscle: MuscleSpec) -> Self {
        let free_mm = Muscle::new(muscle.clone()).free_stroke(0.9 * muscle.max_pressure) * 1e3;
        let motion = Motion::Sine { mean_mm: 0.2 * free_mm, amplitude_mm: 0.1 * free_mm, frequency_hz: 0.4 };
        Self::new(BenchSpec::laboratory(muscle, 1), motion)
    }

    /// The switch for mishaps; a [`Mishap`] as a number.
    #[must_use]
    pub fn mishap(&self) -> Arc<AtomicU8> {
        Arc::clone(&self.mishap)
    }

    fn answer(&mut self) -> Answer {
        let r = self.plant.readings();
        let (mut pressure, mut force) = (r.pressure as f32, r.force as f32);
        match Mishap::from_code(self.mishap.load(Ordering::Relaxed)) {
            Mishap::LoadCell => force = 1e5,
            Mishap::StuckGauge => pressure = *self.stuck.get_or_insert(pressure),
            Mishap::None | Mishap::Supply => self.stuck = None,
        }
        let status = if self.plant.truth().pressure > 1.25 * self.spec.muscle.max_pressure {
            Answer::BURST
        } else {
            0
        };
        Answer {
            status,
            temperature_centi: (r.temperature * 100.0).round() as i16,
            tick: 0,
            pressure,
            stroke: r.stroke as f32,
            force,
        }
    }
}

impl Station for Stand {
    fn reset(&mut self, _script: u16) -> Answer {
        self.plant = Plant::with_muscle(self.plant.muscle().clone(), &self.spec, &self.motion);
        self.answer()
    }

    fn step(&mut self, pressure_command: f32, _setpoint: f32) -> Answer {
        if let Some(axis) = &self.axis {
            axis.until_due();
            self.plant.drive_to(axis.advance(TICK), TICK);
        }
        let supply = Mishap::from_code(self.mishap.load(Ordering::Relaxed)) != Mishap::Supply;
        self.plant.step(TICK, if supply { f64::from(pressure_command) } else { 0.0 });
        if let Some(axis) = &self.axis {
            axis.notes(self.plant.truth().pressure);
        }
        self.answer()
    }
}

/// A running controller; it ends when this is dropped.
#[derive(Debug)]
pub struct Emulated {
    kind: Kind,
    address: Address,
    why_native: Option<String>,
    _running: Running,
}

#[derive(Debug)]
enum Running {
    Qemu(Qemu),
    Native { _device: Device },
}

impl Emulated {
    /// Starts the firmware on a stand: in QEMU where emulator and image are there, else in this process.
    ///
    /// `only` insists on one of them. `speed` is device seconds in a second: what this machine can do is at most that, infinite without a bound.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`] when what was insisted on cannot be started.
    pub fn start(stand: Stand, only: Option<Kind>, speed: f64) -> Result<Self> {
        if only != Some(Kind::Native) {
            match Qemu::start(stand.clone(), speed) {
                Ok((qemu, address)) => {
                    return Ok(Self {
                        kind: Kind::Qemu,
                        address,
                        why_native: None,
                        _running: Running::Qemu(qemu),
                    });
                }
                Err(why) if only == Some(Kind::Qemu) => {
                    return Err(Error::new(
                        DeviceCode::DevicePort,
                        format!("the emulator cannot be started: {why}"),
                    )
                    .help("install what is missing with: firmware/build --install"));
                }
                Err(why) => return Self::native(stand, speed, Some(why)),
            }
        }
        Self::native(stand, speed, None)
    }

    fn native(mut stand: Stand, speed: f64, why_native: Option<String>) -> Result<Self> {
        stand.reset(0);
        let plant = move |outputs: &Outputs| {
            let side = &outputs.sides[0];
            let readings = stand.step(if side.vent { 0.0 } else { side.pressure_pa }, outputs.setpoint);
            let now = Readings {
                pressure_pa: readings.pressure,
                stroke_m: readings.stroke,
                force_n: readings.force,
            };
            Inputs { sides: [Some(now.into()), None], ..Inputs::default() }
        };
        let options = Options { speed, ..Options::default() };
        let device = Device::start("127.0.0.1:0", options, plant).map_err(|e| {
            Error::new(
                DeviceCode::DevicePort,
                format!("the controller cannot be started in this process: {e}"),
            )
        })?;
        let at = device.address();
        let address = Address::Tcp { host: at.ip().to_string(), port: at.port() };
        Ok(Self { kind: Kind::Native, address, why_native, _running: Running::Native { _device: device } })
    }

    /// Where the firmware runs.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Its link; any program may connect, one at a time.
    #[must_use]
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// As text, for people.
    #[must_use]
    pub fn description(&self) -> String {
        match (self.kind, &self.why_native) {
            (Kind::Qemu, _) => "the firmware's image on an emulated Cortex-M4 (QEMU, mps2-an386)".to_owned(),
            (Kind::Native, Some(why)) => format!("the firmware's library in this process, as {why}"),
            (Kind::Native, None) => "the firmware's library in this process".to_owned(),
        }
    }

    /// What QEMU said, for when something went wrong.
    #[must_use]
    pub fn log(&self) -> String {
        match &self._running {
            Running::Qemu(qemu) => qemu.log(),
            Running::Native { .. } => String::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use virtual_bench::presets;

    #[test]
    fn a_mishap_is_seen_in_the_readings_and_ends_with_it() {
        let spec = BenchSpec::laboratory(presets::miniature(), 1);
        let mut stand = Stand::new(spec, Motion::Held { stroke_mm: 0.5 });
        let mishap = stand.mishap();
        let settled = |stand: &mut Stand| (0..600).map(|_| stand.step(300e3, 0.0)).last().unwrap();
        let well = settled(&mut stand);
        assert!((well.pressure - 300e3).abs() < 5e3 && well.force > 20.0 && well.force < 200.0);
        mishap.store(Mishap::LoadCell as u8, Ordering::Relaxed);
        assert_eq!(stand.step(300e3, 0.0).force, 1e5);
        mishap.store(Mishap::StuckGauge as u8, Ordering::Relaxed);
        let stuck = stand.step(300e3, 0.0).pressure;
        assert!((0..50).all(|_| stand.step(100e3, 0.0).pressure == stuck));
        mishap.store(Mishap::Supply as u8, Ordering::Relaxed);
        assert!(settled(&mut stand).pressure < 2e3);
        mishap.store(Mishap::None as u8, Ordering::Relaxed);
        assert!((settled(&mut stand).pressure - 300e3).abs() < 5e3);
    }
}
