//! Orders of the page: to the controller, and about recordings.

use std::sync::Arc;

use serde::Deserialize;
use tokio::sync::oneshot;

use super::analysis::Analysis;
use super::answers::{Answer, Emulated, Ended, VentPath};
use super::server::{Shared, ended_in_fault};
use super::session::{Connected, Order, Request};
use crate::commands::device::regulator_steps;
use pam_data::error::{DataCode, Error, Result};
use pam_device::calibration::{Pair, Sensor};
use pam_device::error::DeviceCode;
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use pam_device::{Address, available};

/// What the page may post.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Posted {
    Ports,
    VentPath,
    Connect {
        port: String,
    },
    Emulate {
        muscle: String,
    },
    Disconnect,
    Arm,
    Vent,
    Follow {
        quantity: String,
        profile: String,
    },
    Faults,
    Clear,
    Settings {
        set: Vec<String>,
    },
    Signals,
    /// Known values in the sensor's unit, each with its signal.
    Calibrate {
        sensor: String,
        pairs: Vec<[f64; 2]>,
        keep: bool,
    },
    /// Pressures in kPa.
    Identify {
        low: f64,
        high: f64,
    },
    KeepRegulator,
    Mishap {
        code: u8,
    },
    Record,
    EndRecord,
    Watch {
        reference: Compared,
    },
    Recordings,
    Curves {
        number: usize,
    },
    Example {
        muscle: String,
    },
    Fit {
        muscle: String,
    },
    Diagnose {
        muscle: String,
    },
    Compare {
        a: usize,
        b: usize,
    },
    Difference,
    Flash {
        table: String,
    },
}

/// What a running controller is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Compared {
    Nothing,
    Recordings,
    Table,
}

fn sensor_named(name: &str) -> Result<Sensor> {
    Sensor::ALL
        .into_iter()
        .find(|sensor| sensor.name() == name)
        .ok_or_else(|| Error::new(DataCode::CallInvalid, "there is no such sensor").value(name))
}

impl Shared {
    pub(super) async fn order(&self, order: Order) -> Result<Answer> {
        self.order_since(order, self.vent.count()).await
    }

    /// An order, with the number of vents before it was sent.
    pub(super) async fn order_since(&self, order: Order, vents: u64) -> Result<Answer> {
        let gone = || {
            Error::new(DeviceCode::DeviceSilent, "the thread of the controller has ended")
                .help("start `host studio` again")
        };
        let (answer, answered) = oneshot::channel();
        self.orders.send(Request { order, vents, answer }).map_err(|_| gone())?;
        answered.await.map_err(|_| gone())?
    }

    /// Whatever may wait for a file or a line, off the server's thread.
    async fn apart<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Analysis) -> Result<T> + Send + 'static,
    ) -> Result<T> {
        let analysis = Arc::clone(&self.analysis);
        let done = tokio::task::spawn_blocking(move || work(&analysis));
        done.await.map_err(|e| ended_in_fault(&e))?
    }

    /// A computation that uses the whole machine, after those that were ordered before.
    pub(super) async fn compute(
        &self,
        work: impl FnOnce(&Analysis) -> Result<Answer> + Send + 'static,
    ) -> Result<Answer> {
        let _guard = self.computing.acquire().await;
        self.apart(work).await
    }

    /// The new connection is opened and checked before the present one is given up.
    pub(super) async fn connect(&self, port: String) -> Result<Answer> {
        let address: Address = port.parse()?;
        if let Answer::Truth(true) = self.order(Order::IsConnected(address.clone())).await? {
            return Ok(Answer::Done);
        }
        let fresh = self.apart(|_| Connected::open(address)).await?;
        self.order(Order::Replace(Box::new(fresh))).await
    }

    pub(super) async fn emulate(&self, muscle: String) -> Result<Answer> {
        let (fresh, description) = self.apart(move |_| Connected::emulate(&muscle)).await?;
        self.order(Order::Replace(Box::new(fresh))).await?;
        Ok(Answer::Emulated(Emulated { controller: description }))
    }

    /// Carries out what the page posted.
    pub(super) async fn post(&self, posted: Posted) -> Result<Answer> {
        match posted {
            Posted::Ports => self.apart(|_| Ok(Answer::Ports(available()))).await,
            Posted::VentPath => Ok(Answer::VentPath(VentPath {
                address: format!("{}/vent", self.vent_path.origin),
                token: self.vent_path.token.to_string(),
            })),
            Posted::Connect { port } => self.connect(port).await,
            Posted::Emulate { muscle } => self.emulate(muscle).await,
            Posted::Disconnect => self.order(Order::Disconnect).await,
            Posted::Arm => self.order(Order::Arm).await,
            // The page uses the path of its own; this one serves where that cannot be reached, as through a tunnel.
            Posted::Vent => {
                let vent = Arc::clone(&self.vent);
                self.apart(move |_| vent.now().map(|()| Answer::Done)).await
            }
            Posted::Follow { quantity, profile } => self.follow(&quantity, profile).await,
            Posted::Faults => self.order(Order::Faults).await,
            Posted::Clear => self.order(Order::Clear).await,
            Posted::Settings { set } => self.order(Order::Settings(set)).await,
            Posted::Signals => self.order(Order::Signals).await,
            Posted::Calibrate { sensor, pairs, keep } => {
                let sensor = sensor_named(&sensor)?;
                let pair = |[value, signal]: [f64; 2]| Pair { value: value * sensor.unit().1, signal };
                let pairs = pairs.into_iter().map(pair).collect();
                self.order(Order::Calibrate(sensor, pairs, keep)).await
            }
            Posted::Identify { low, high } => {
                let [low, high] = regulator_steps(low, high)?;
                self.order(Order::Identify(low, high)).await
            }
            Posted::KeepRegulator => self.order(Order::KeepRegulator).await,
            Posted::Mishap { code } => self.order(Order::Mishap(code)).await,
            Posted::Record => {
                let path = self.apart(|a| Ok(a.next_run())).await?;
                self.order(Order::Record(path)).await
            }
            Posted::EndRecord => {
                if let Answer::Ended(Ended { path: Some(path) }) = self.order(Order::EndRecord).await? {
                    self.analysis.add(path);
                }
                Ok(Answer::Recordings(self.analysis.list()))
            }
            Posted::Watch { reference: Compared::Nothing } => self.order(Order::Watch(None)).await,
            Posted::Watch { reference } => {
                let read = self.apart(move |a| a.reference(reference == Compared::Table)).await?;
                self.order(Order::Watch(Some(Arc::new(read)))).await
            }
            Posted::Recordings => Ok(Answer::Recordings(self.analysis.list())),
            Posted::Curves { number } => self.apart(move |a| a.curves(number).map(Answer::Curves)).await,
            Posted::Compare { a, b } => self.apart(move |w| w.compare(a, b).map(Answer::Compared)).await,
            Posted::Example { muscle } => {
                self.compute(move |a| a.example(&muscle).map(Answer::Recordings)).await
            }
            Posted::Fit { muscle } => {
                self.compute(move |a| a.fit(&muscle).map(|f| Answer::Fitted(Box::new(f)))).await
            }
            Posted::Diagnose { muscle } => {
                self.compute(move |a| a.diagnose(&muscle).map(Answer::Diagnosed)).await
            }
            Posted::Difference => {
                let table = self.analysis.table()?;
                self.order(Order::Difference(table)).await
            }
            Posted::Flash { table } => {
                let table = self.analysis.table_named(&table)?;
                self.order(Order::Flash(table)).await
            }
        }
    }

    async fn follow(&self, quantity: &str, profile: String) -> Result<Answer> {
        let quantity = match quantity {
            "force" => Quantity::Force,
            "pressure" => Quantity::Pressure,
            "stroke" => Quantity::Stroke,
            _ => {
                return Err(Error::new(
                    DataCode::CallInvalid,
                    "a setpoint profile is of force, pressure or stroke",
                ));
            }
        };
        // A page may not read files of this machine by naming them as a profile.
        if profile.trim_start().starts_with('@') {
            return Err(Error::new(DataCode::CallInvalid, "the page takes no setpoint profile from a file")
                .help("use host run"));
        }
        let profile = SetpointProfile::parse(&profile, quantity)?;
        self.order(Order::Follow(quantity, profile)).await
    }
}
