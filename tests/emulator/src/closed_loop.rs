//! The controller's own step against the bench's plant, without a link and as fast as this machine goes: for comparisons of
//! many cases, and for long runs.

use firmware::board::{Inputs, Outputs, Readings};
use firmware::control::{Controller, Stepped};
use firmware::modes::Model;
use firmware::tick::TICK_S;
use model_core::link::messages::{Mode, Reference, SetPoint, Side, State};
use model_core::link::settings::{FeedForward, Settings};
use model_core::table::MuscleTable;
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, Plant};

/// A controller on a plant.
pub struct Loop {
    /// The controller.
    pub controller: Controller,
    plant: Plant,
    outputs: Outputs,
}

/// What one tick was like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// What was asked for.
    pub asked: f64,
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
        // There is no link here, and so no host to hear from.
        settings.watch.autonomous = true;
        let mut controller = Controller::new(settings);
        controller.use_model(Side::Agonist, Some(Model::build(table).expect("a valid table")));
        let mut this = Self { controller, plant: Plant::new(bench, motion), outputs: Outputs::default() };
        for side in &mut this.outputs.sides {
            side.vent = true;
        }
        this.tick();
        this.controller.arm().expect("it arms");
        this.controller.start(mode).expect("it starts");
        this
    }

    /// One millisecond.
    pub fn tick(&mut self) -> Stepped {
        let command = self.outputs.sides[0];
        let pressure = if command.vent { 0.0 } else { f64::from(command.pressure_pa) };
        let r = self.plant.step(f64::from(TICK_S), pressure);
        let readings =
            Readings { pressure_pa: r.pressure as f32, stroke_m: r.stroke as f32, force_n: r.force as f32 };
        let inputs = Inputs { sides: [Some(readings), None], ..Inputs::default() };
        let stepped = self.controller.step(&inputs);
        self.outputs = stepped.outputs;
        stepped
    }

    /// Goes on for some ticks and tells what was true in each.
    ///
    /// # Panics
    /// When a fault stops the controller.
    pub fn run(&mut self, ticks: u32) -> Vec<Tick> {
        self.controller.set_telemetry(1);
        (0..ticks)
            .map(|_| {
                let stepped = self.tick();
                let latched = self.controller.faults().latched;
                assert!(self.controller.state() == State::Running, "stopped by {latched:?}");
                let truth = self.plant.truth();
                Tick {
                    asked: f64::from(stepped.telemetry.map_or(f32::NAN, |(_, sample)| sample.asked)),
                    force: truth.force,
                    stroke: truth.stroke,
                    pressure: truth.pressure,
                    command: f64::from(self.outputs.sides[0].pressure_pa),
                }
            })
            .collect()
    }

    /// Asks for a wave.
    ///
    /// # Panics
    /// When it is refused.
    pub fn wave(&mut self, reference: Reference) {
        self.controller.reference(reference).expect("a wave");
    }

    /// Asks for a value.
    ///
    /// # Panics
    /// When it is refused.
    pub fn point(&mut self, point: SetPoint) {
        self.controller.set_point(point).expect("a set-point");
    }
}

/// Root mean square of what was asked for less `value`.
pub fn rms(ticks: &[Tick], value: impl Fn(&Tick) -> f64) -> f64 {
    let sum: f64 = ticks.iter().map(|tick| (tick.asked - value(tick)).powi(2)).sum();
    (sum / ticks.len().max(1) as f64).sqrt()
}

/// The feed-forward alone: from the table or from the ideal braid.
pub fn forward(feed_forward: FeedForward) -> Settings {
    Settings { feed_forward, ..Settings::default() }
}

/// PI on the load cell alone, for a muscle whose force rises by `slope` N/Pa: its zero cancels the regulator's lag `T`, and
/// the line's delay of 4 ms and one and a half ticks leave a phase margin of 60° at a crossover of
/// `ω_c = 90 rad/s`: `K_i = ω_c / g`, `K_p = K_i T`.
pub fn pi_alone(slope: f32) -> Settings {
    let mut settings = forward(FeedForward::Off);
    let integral = 90.0 / slope;
    settings.force_loop.integral_pa_per_n_s = integral;
    settings.force_loop.proportional_pa_per_n = integral * settings.regulator.lag_s;
    settings.force_loop.trim_limit_pa = 1e6;
    settings.regulator.lead = 0.0;
    settings
}
