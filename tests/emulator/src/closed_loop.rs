//! The controller's own step against the bench's plant, without a link and as fast as this machine goes: for comparisons of
//! many cases, and for long runs.

use firmware::board::{Inputs, Outputs, Readings};
use firmware::control::Controller;
use firmware::outbox::Sample;
use firmware::regulator::SMOOTHING;
use firmware::tick::TICK_S;
use model_core::link::messages::{
    Mode, Reference, ReferenceOrder, Session, SetPoint, SetPointOrder, Side, State,
};
use model_core::link::settings::{FeedForward, Settings};
use model_core::table::MuscleTable;
use model_core::units::Length;
use pam_device::regulator::{self, Found};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, Plant};

use crate::pulses::{Pulses, real_valves};

/// A controller on a plant.
pub struct Loop {
    /// The controller.
    pub controller: Controller,
    plant: Plant,
    outputs: Outputs,
    pulses: Pulses,
}

/// What one tick was like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// the setpoint.
    pub setpoint: f64,
    /// True force, N.
    pub force: f64,
    /// True stroke, m.
    pub stroke: f64,
    /// True pressure, Pa.
    pub pressure: f64,
    /// Command, Pa.
    pub command: f64,
}

impl Loop {
    /// Running in a mode, with a table.
    ///
    /// # Panics
    /// When the controller refuses.
    pub fn start(
        bench: &BenchSpec,
        motion: &Motion,
        table: &MuscleTable,
        mut settings: Settings,
        mode: Mode,
    ) -> Self {
        // No link, and therefore no host to receive from.
        settings.watch.autonomous = true;
        let mut controller = Controller::new(&settings);
        controller.use_table(Side::Agonist, table).expect("a valid table");
        let mut plant = Plant::new(bench, motion);
        if settings.valves.is_fitted() {
            plant.fit_valves(real_valves(&settings.valves));
        }
        let mut this = Self { controller, plant, outputs: Outputs::VENT, pulses: Pulses::default() };
        this.tick();
        this.controller.arm(Session::default()).expect("it arms");
        this.controller.start(mode, Session::default()).expect("it starts");
        this
    }

    /// One millisecond; gives the sample, if one was due.
    pub fn tick(&mut self) -> Option<Sample> {
        let r = if self.plant.valves().is_some() {
            let signals = self.pulses.tick(self.outputs.valves[0], self.outputs.sides[0].vent);
            self.plant.step_valves(f64::from(TICK_S), &signals)
        } else {
            let command = self.outputs.sides[0];
            let pressure = if command.vent { 0.0 } else { f64::from(command.pressure_pa) };
            self.plant.step(f64::from(TICK_S), pressure)
        };
        let readings =
            Readings { pressure_pa: r.pressure as f32, stroke_m: r.stroke as f32, force_n: r.force as f32 };
        let inputs = Inputs { sides: [Some(readings.into()), None], ..Inputs::default() };
        self.outputs = self.controller.step(&inputs);
        self.controller.take_sample()
    }

    /// Continues for some ticks and returns the true values of each.
    ///
    /// # Panics
    /// When a fault stops the controller.
    pub fn run(&mut self, ticks: u32) -> Vec<Tick> {
        self.controller.set_telemetry(1);
        (0..ticks)
            .map(|_| {
                let sample = self.tick();
                let latched = self.controller.faults().latched;
                assert!(self.controller.state() == State::Running, "stopped by {latched:?}");
                let truth = self.plant.truth();
                Tick {
                    setpoint: f64::from(sample.map_or(f32::NAN, |sample| sample.setpoint)),
                    force: truth.force,
                    stroke: truth.stroke,
                    pressure: truth.pressure,
                    command: f64::from(self.outputs.sides[0].pressure_pa),
                }
            })
            .collect()
    }

    /// What the controller orders.
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// The muscle, its air and its load, to break them while they run.
    pub fn plant(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// What is true on the bench now.
    pub fn truth(&self) -> virtual_bench::plant::Readings {
        self.plant.truth()
    }

    /// Requests a wave.
    ///
    /// # Panics
    /// When it is refused.
    pub fn wave(&mut self, reference: Reference) {
        self.controller.reference(ReferenceOrder { reference, session: Session::default() }).expect("a wave");
    }

    /// Requests a value.
    ///
    /// # Panics
    /// When it is refused.
    pub fn point(&mut self, point: SetPoint) {
        self.controller
            .set_point(SetPointOrder { set_point: point, session: Session::default() })
            .expect("a setpoint");
    }
}

/// Root mean square of the setpoint less `value`.
pub fn rms(ticks: &[Tick], value: impl Fn(&Tick) -> f64) -> f64 {
    let sum: f64 = ticks.iter().map(|tick| (tick.setpoint - value(tick)).powi(2)).sum();
    (sum / ticks.len().max(1) as f64).sqrt()
}

/// The regulator of a bench as `host device identify` finds it, from steps of pressure on a muscle held at a stroke.
///
/// # Panics
/// When nothing follows its command.
pub fn identified(bench: &BenchSpec, table: &MuscleTable, stroke_mm: f64) -> Found {
    let mut settings = Settings::default();
    settings.regulator.lead = 0.0;
    let mut control = Loop::start(bench, &Motion::Held { stroke_mm }, table, settings, Mode::Pressure);
    control.controller.set_telemetry(1);
    let mut samples = Vec::new();
    for pascals in [100e3, 300e3, 100e3, 300e3] {
        control.point(SetPoint::Pressure(pascals));
        for _ in 0..500 {
            if let Some(sample) = control.tick() {
                let side = sample.sides()[0];
                samples.push((
                    sample.time_us() as f64 * 1e-6,
                    f64::from(side.command_pa),
                    f64::from(side.pressure_pa),
                ));
            }
        }
    }
    // The first step starts from a vented muscle.
    let found = regulator::from_samples(&samples[500..]).expect("a regulator");
    Found { line_s: found.line_s / f64::from(fill(table, stroke_mm * 1e-3)), ..found }
}

/// `V/V₀` of a table's muscle at a stroke, m.
pub fn fill(table: &MuscleTable, stroke_m: f64) -> f32 {
    let braid = table.geometry.cast::<f64>().build().expect("a valid table");
    let volume = |stroke_m: f64| braid.gas_volume(&braid.posture(Length::from_metres(stroke_m)));
    (volume(stroke_m) / volume(0.0)) as f32
}

/// The feed-forward alone: from the table or from the ideal braid.
pub fn forward(base: Settings, feed_forward: FeedForward) -> Settings {
    Settings { feed_forward, ..base }
}

/// What a phase margin of 60° leaves to delay at the crossover of an integrating loop, rad.
const MARGIN: f32 = std::f32::consts::FRAC_PI_6;
/// Delay of the loop itself, s: half a tick until a command acts, half a tick for which it holds.
const LOOP_S: f32 = TICK_S;

/// PI on the load cell alone, for a muscle whose force rises by `slope` N/Pa and whose volume is `fill` of that at rest: its
/// zero cancels the regulator's lag `T`, and crossover leaves a phase margin of 60° to line and loop:
/// `ω_c = 30° / (line V/V₀ + loop)`, `K_i = ω_c / g`, `K_p = K_i T`.
pub fn pi_alone(base: Settings, slope: f32, fill: f32) -> Settings {
    let mut settings = forward(base, FeedForward::Off);
    let crossover = MARGIN / (base.regulator.line_s * fill + LOOP_S);
    let integral = crossover / slope;
    settings.force_loop.integral_pa_per_n_s = integral;
    settings.force_loop.proportional_pa_per_n = integral * settings.regulator.lag_s;
    settings.force_loop.trim_limit_pa = 1e6;
    settings.regulator.lead = 0.0;
    settings
}

/// The table with a trim that has the same phase margin: lag and line are inverted, so that only the smoothing of both and the
/// loop are left.
pub fn trimmed(base: Settings, slope: f32) -> Settings {
    let mut settings = forward(base, FeedForward::Table);
    let crossover = MARGIN / (2.0 * SMOOTHING * base.regulator.lag_s + LOOP_S);
    settings.force_loop.integral_pa_per_n_s = crossover / slope;
    settings.force_loop.trim_limit_pa = 150e3;
    settings
}
