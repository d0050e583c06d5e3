//! Simulation of a protocol: its motion with our own model, and the contexts in which effects act.
//!
//! The file is the virtual bench's, read by its own types: `name`, `sample_Hz` and `[[step]]` tables with `do = "pressure" | "move" | "cycles" | "hold" |
//! "tare" | "rest" | "sine" | "file" | "end-file"`; a place is `to_mm`, `to_contraction` or `to_free` (part of the free stroke).

use std::path::Path;

use model_core::effects::Context;
use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};
pub use pam_protocol::{Place, Protocol, Step};

use super::criteria::planning::{FREE_STROKE, PROTOCOL_PRESSURE_RATE, PROTOCOL_RATE, PROTOCOL_SAMPLES};
use pam_data::error::{DataCode, Error, Result};
use pam_data::file_kind::FileKind;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, Follower, Recording};
use pam_data::toml_errors::toml_error;

/// Reads a protocol file.
///
/// # Errors
/// [`DataCode::FileUnreadable`], or [`DataCode::ProtocolInvalid`] with the line or the step, or with what the file is instead.
pub fn read(path: &Path) -> Result<Protocol> {
    let text = FileKind::Protocol.read_text(path)?;
    parse(&text).map_err(|e| FileKind::Protocol.wanted(path, e))
}

/// From the text of a protocol file.
///
/// # Errors
/// [`DataCode::ProtocolInvalid`] with the line, or with the step whose numbers cannot be.
pub fn parse(text: &str) -> Result<Protocol> {
    let protocol: Protocol =
        toml::from_str(text).map_err(|e| toml_error(DataCode::ProtocolInvalid, text, &e))?;
    protocol.check().map_err(|e| Error::new(DataCode::ProtocolInvalid, e.to_string()))?;
    Ok(protocol)
}

/// The recordings that a protocol would make of a muscle, without noise and with the model's force.
///
/// # Errors
/// [`DataCode::ProtocolInvalid`] for one that takes too long, or that records nothing.
pub(crate) fn play(protocol: &Protocol, muscle: &Muscle<f64>) -> Result<Campaign> {
    let dt = 1.0 / protocol.sample_hz.min(PROTOCOL_RATE);
    let mut player = Player {
        muscle,
        dt,
        time: 0.0,
        pressure: 0.0,
        stroke: 0.0,
        open: None,
        done: Vec::new(),
        samples: 0,
    };
    let any_file = protocol.step.iter().any(|s| matches!(s, Step::File { .. }));
    if !any_file {
        player.begin(&protocol.name);
    }
    for (i, step) in protocol.step.iter().enumerate() {
        player.step(step).map_err(|what| {
            Error::new(DataCode::ProtocolInvalid, format!("step {} of the protocol: {what}", i + 1))
        })?;
    }
    player.end();
    let mut recordings = player.done;
    recordings.retain(|r| r.len() >= 3);
    if recordings.is_empty() {
        return Err(Error::new(DataCode::ProtocolInvalid, "the protocol records nothing"));
    }
    for r in &mut recordings {
        let force = (0..r.len())
            .map(|i| {
                muscle
                    .force(Pressure::from_pascals(r.pressure[i]), Length::from_metres(r.stroke[i]), 0.0)
                    .newtons()
            })
            .collect();
        r.force = Some(force);
    }
    Ok(Campaign::new(recordings))
}

struct Player<'a> {
    muscle: &'a Muscle<f64>,
    dt: f64,
    time: f64,
    pressure: f64,
    stroke: f64,
    open: Option<Recording>,
    done: Vec<Recording>,
    samples: usize,
}

impl Player<'_> {
    fn begin(&mut self, name: &str) {
        self.end();
        self.open = Some(Recording { name: name.to_owned(), ..Recording::default() });
    }

    fn end(&mut self) {
        if let Some(r) = self.open.take() {
            self.done.push(r);
        }
    }

    fn tick(&mut self) -> Result<(), &'static str> {
        self.time += self.dt;
        self.samples += 1;
        if self.samples > PROTOCOL_SAMPLES {
            return Err("the protocol is too long");
        }
        if let Some(r) = &mut self.open {
            r.time.push(self.time);
            r.pressure.push(self.pressure);
            r.stroke.push(self.stroke);
        }
        Ok(())
    }

    fn wait(&mut self, seconds: f64) -> Result<(), &'static str> {
        if !(0.0..=1e6).contains(&seconds) {
            return Err("a time must be from 0 to 1e6 s");
        }
        // Only what is recorded is simulated.
        if self.open.is_none() {
            self.time += seconds;
            return Ok(());
        }
        for _ in 0..(seconds / self.dt).round() as usize {
            self.tick()?;
        }
        Ok(())
    }

    fn place(&self, to: &Place) -> Result<f64, &'static str> {
        let l0 = self.muscle.braid().rest_length();
        match (to.mm, to.contraction, to.free) {
            (Some(mm), None, None) => Ok(mm * 1e-3),
            (None, Some(c), None) => Ok(c * l0),
            (None, None, Some(part)) => Ok(part * free_stroke(self.muscle, self.pressure)),
            _ => Err("a place is one of to_mm, to_contraction, to_free"),
        }
    }

    fn go(&mut self, to: f64, speed: f64) -> Result<(), &'static str> {
        if !(speed > 0.0 && to.is_finite()) {
            return Err("a speed must be positive, a place finite");
        }
        let from = self.stroke;
        let steps = ((to - from).abs() / (speed * self.dt)).ceil().max(1.0) as usize;
        for i in 1..=steps.min(PROTOCOL_SAMPLES) {
            self.stroke = from + (to - from) * i as f64 / steps as f64;
            self.tick()?;
        }
        Ok(())
    }

    fn step(&mut self, step: &Step) -> Result<(), &'static str> {
        match step {
            Step::File { name } => self.begin(name),
            Step::EndFile => self.end(),
            Step::Tare { seconds } => {
                let (p, x) = (self.pressure, self.stroke);
                (self.pressure, self.stroke) = (0.0, 0.0);
                self.wait(*seconds)?;
                (self.pressure, self.stroke) = (p, x);
            }
            Step::Pressure { to_kpa, rate_kpa_s, settle_s } => {
                let (from, to) = (self.pressure, to_kpa * 1e3);
                let rate = rate_kpa_s.unwrap_or(PROTOCOL_PRESSURE_RATE).max(1e-3) * 1e3;
                let steps = ((to - from).abs() / (rate * self.dt)).ceil().max(1.0) as usize;
                for i in 1..=steps.min(PROTOCOL_SAMPLES) {
                    self.pressure = from + (to - from) * i as f64 / steps as f64;
                    self.tick()?;
                }
                self.wait(*settle_s)?;
            }
            Step::Move { to, speed_mm_s } => {
                let to = self.place(to)?;
                self.go(to, speed_mm_s * 1e-3)?;
            }
            Step::Cycles { to, speed_mm_s, count } => {
                let (from, to) = (self.stroke, self.place(to)?);
                for _ in 0..*count {
                    self.go(to, speed_mm_s * 1e-3)?;
                    self.go(from, speed_mm_s * 1e-3)?;
                }
            }
            Step::Hold { seconds } => self.wait(*seconds)?,
            Step::Rest { seconds } => self.time += seconds,
            Step::Sine { amplitude_mm, frequency_hz, seconds } => {
                let from = self.stroke;
                for i in 0..((seconds / self.dt).max(0.0) as usize).min(PROTOCOL_SAMPLES) {
                    let phase = std::f64::consts::TAU * frequency_hz * i as f64 * self.dt;
                    self.stroke = from + amplitude_mm * 1e-3 * phase.sin();
                    self.tick()?;
                }
                self.stroke = from;
            }
        }
        Ok(())
    }
}

/// The stroke at which the model no longer pulls, m.
pub fn free_stroke(muscle: &Muscle<f64>, pressure: f64) -> f64 {
    let braid = muscle.braid();
    let force =
        |x: f64| muscle.force(Pressure::from_pascals(pressure), Length::from_metres(x), 0.0).newtons();
    let (mut low, mut high) =
        (0.0, braid.neutral_contraction().clamp(FREE_STROKE.0, FREE_STROKE.1) * braid.rest_length());
    // The first place where it stops pulling, also where the polynomial comes back beyond.
    let steps = 60;
    for i in 1..=steps {
        let x = high * f64::from(i) / f64::from(steps);
        if force(x) <= 0.0 {
            high = x;
            low = high * f64::from(i - 1) / f64::from(i);
            break;
        }
    }
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if force(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

/// All moments of a campaign as effects see them on a muscle.
pub fn moments(muscle: &Muscle<f64>, campaign: &Campaign) -> Vec<Context<f64>> {
    let mut follower = Follower::of(campaign);
    let mut all = Vec::with_capacity(campaign.samples());
    for (index, (recording, motion)) in
        campaign.recordings.iter().zip(Motion::of_campaign(campaign)).enumerate()
    {
        let motions = follower.follow(recording, &motion, campaign.pause_before(index));
        for (m, p) in motions.iter().zip(&recording.pressure) {
            all.push(muscle.context(m, Pressure::from_pascals(*p)));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_cannot_be_are_refused_with_their_step() {
        let with = |step: &str| {
            format!("name = \"p\"\nsample_Hz = 10.0\n[[step]]\ndo = \"hold\"\nseconds = 1.0\n{step}")
        };
        assert!(parse(&with("")).is_ok());
        for step in [
            "[[step]]\ndo = \"sine\"\namplitude_mm = nan\nfrequency_Hz = 1.0\nseconds = 1.0\n",
            "[[step]]\ndo = \"sine\"\namplitude_mm = 1.0\nfrequency_Hz = inf\nseconds = 1.0\n",
            "[[step]]\ndo = \"pressure\"\nto_kPa = -inf\n",
            "[[step]]\ndo = \"move\"\nto_free = 1.0\nspeed_mm_s = 0.0\n",
            "[[step]]\ndo = \"move\"\nspeed_mm_s = 1.0\n",
        ] {
            let error = parse(&with(step)).expect_err(step).to_string();
            assert!(error.contains("step 2 of the protocol"), "{error}");
        }
        let error = parse("name = \"p\"\nsample_Hz = -1.0\nstep = []\n").expect_err("no rate").to_string();
        assert!(error.contains("the sampling rate") && !error.contains("step 0"), "{error}");
    }
}
