//! How well force and stroke follow what is setpoint: each muscle on several loads, under several control laws, against what the
//! regulator alone would allow.
//!
//! The controller is the firmware's own library on the bench's plant, a tick after the other and as fast as this machine goes.
//! [`in_qemu`] runs a case through the real image and the real link, to show that it makes no difference.

use firmware::tick::TICK_S;
use model_core::link::messages::{Mode, Reference, SetPoint, Side};
use model_core::link::settings::{FeedForward, Settings};
use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use model_core::units::Length;
use pam_device::regulator::Found;
use virtual_bench::bench::BenchSpec;
use virtual_bench::muscle::MuscleSpec;
use virtual_bench::plant::{Motion, PlantStation};

use crate::closed_loop::{self, Loop, Tick};
use crate::machine::{Folder, Machine, Options, Skipped};
use crate::tracking::{self, Stretch, Wanted};
use crate::{fitting, upload};

/// What the muscle works against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Its length is held.
    AtStroke,
    /// Its free end is moved at 0.3 Hz over a quarter of the free stroke.
    Moved,
    /// It pulls a mass against a spring.
    Spring,
}

/// the setpoint, around a mean by an amplitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// Up and down immediately, a second at each.
    Steps,
    /// Up and down in a second each, half a second at each end.
    Ramps,
    /// A sine of a frequency, Hz.
    Sine(f32),
}

/// Where the pressure comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// The fitted table's inverse alone.
    Table,
    /// The same with a trim on the load cell.
    Trimmed,
    /// The ideal braid's inverse alone.
    Gaylord,
    /// Proportional and integral feedback of the load cell alone, at the trim's phase margin.
    Feedback,
}

/// The laws, in the order of the report's columns.
pub const LAWS: [Law; 4] = [Law::Table, Law::Trimmed, Law::Gaylord, Law::Feedback];
/// The profiles, in the order of the report's rows.
pub const PROFILES: [Profile; 8] = [
    Profile::Steps,
    Profile::Ramps,
    Profile::Sine(0.1),
    Profile::Sine(0.3),
    Profile::Sine(0.5),
    Profile::Sine(1.0),
    Profile::Sine(2.0),
    Profile::Sine(5.0),
];

impl Load {
    /// As text.
    pub fn name(self) -> &'static str {
        match self {
            Self::AtStroke => "held",
            Self::Moved => "moved",
            Self::Spring => "mass and spring",
        }
    }
}

impl Profile {
    /// As text.
    pub fn name(self) -> String {
        match self {
            Self::Steps => "steps".into(),
            Self::Ramps => "ramps".into(),
            Self::Sine(hz) => format!("sine {hz} Hz"),
        }
    }

    fn reference(self, mean: f32, amplitude: f32) -> Reference {
        let (low, high) = (mean - amplitude, mean + amplitude);
        match self {
            // A ramp of one tick.
            Self::Steps => Reference::Trapezoid { low, high, ramp_s: TICK_S, hold_s: 1.0 },
            Self::Ramps => Reference::Trapezoid { low, high, ramp_s: 1.0, hold_s: 0.5 },
            Self::Sine(frequency_hz) => Reference::Sine { mean, amplitude, frequency_hz },
        }
    }

    /// Ticks that are judged: whole periods, four seconds at least.
    fn ticks(self) -> u32 {
        match self {
            Self::Steps => 4_000,
            Self::Ramps => 6_000,
            Self::Sine(hz) => {
                let period = (1_000.0 / hz).round() as u32;
                period * (4_000_u32.div_ceil(period)).max(1)
            }
        }
    }
}

/// How a force is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Still {
    /// Error, rms in % of blocked force.
    pub error: f64,
    /// What of it goes back and forth about its own mean.
    pub swing: f64,
    /// How much the command changes from tick to tick, rms in Pa.
    pub jump: f64,
}

/// A muscle with the table fitted to it.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The truth.
    pub spec: MuscleSpec,
    /// What a user would have fitted.
    pub table: MuscleTable,
    /// The regulator as a user would have identified it.
    pub regulator: Found,
}

impl Subject {
    /// Fits a muscle of the bench as a user would.
    pub fn of(spec: MuscleSpec) -> Self {
        let table = fitting::fitted(&spec);
        let bench = BenchSpec::laboratory(spec.clone(), 12);
        let stroke_mm =
            0.1 * f64::from(table.tested.contraction_high * table.geometry.rest_length.si()) * 1e3;
        let regulator = closed_loop::identified(&bench, &table, stroke_mm);
        Self { spec, table, regulator }
    }

    /// The same with a table whose bladder is stiffer or softer by a factor than the muscle's.
    pub fn misjudged(&self, factor: f32) -> Self {
        let mut other = self.clone();
        for curve in &mut other.table.elastic {
            curve.iter_mut().for_each(|modulus| *modulus *= factor);
        }
        other
    }

    /// Blocked force, N.
    pub fn blocked(&self) -> f64 {
        f64::from(self.table.blocked_force.newtons())
    }

    /// Free stroke at the highest pressure tested, m.
    pub fn free_stroke(&self) -> f64 {
        f64::from(self.table.tested.contraction_high) * f64::from(self.table.geometry.rest_length.si())
    }

    pub(crate) fn motion(&self, load: Load) -> Motion {
        let free_mm = self.free_stroke() * 1e3;
        match load {
            Load::AtStroke => Motion::Held { stroke_mm: 0.2 * free_mm },
            Load::Moved => {
                Motion::Sine { mean_mm: 0.22 * free_mm, amplitude_mm: 0.12 * free_mm, frequency_hz: 0.3 }
            }
            Load::Spring => {
                // Half of blocked force at three tenths of the free stroke, which is the most that is demanded for and within reach of
                // the highest pressure; a natural frequency of 10 Hz and some damping.
                let spring = 1.5 * self.blocked() / free_mm;
                let mass = spring * 1e3 / (2.0 * std::f64::consts::PI * 10.0_f64).powi(2);
                let damper = 0.6 * (spring * 1e3 * mass).sqrt() * 1e-3;
                Motion::Load { mass, spring, preload: 0.05 * self.blocked(), damper }
            }
        }
    }

    /// Stroke about which a load is worked, m.
    fn middle(&self, load: Load) -> f64 {
        self.free_stroke() * if load == Load::Moved { 0.22 } else { 0.2 }
    }

    /// Newtons for each pascal there, by the ideal braid.
    fn slope(&self, load: Load) -> f32 {
        let muscle = Muscle::<f32>::build(&self.table).expect("a valid table");
        muscle.braid().posture(Length::from_metres(self.middle(load) as f32)).area
    }

    pub(crate) fn settings(&self, law: Law, load: Load) -> Settings {
        let base = self.regulator.settings(Settings::default());
        let fill = closed_loop::fill(&self.table, self.middle(load));
        let mut settings = match law {
            Law::Table => closed_loop::forward(base, FeedForward::Table),
            Law::Trimmed => closed_loop::trimmed(base, self.slope(load)),
            Law::Gaylord => closed_loop::forward(base, FeedForward::Gaylord),
            Law::Feedback => closed_loop::pi_alone(base, self.slope(load), fill),
        };
        settings.limits.force_n = 3.0 * self.table.blocked_force.newtons();
        settings.limits.stroke_max_m = 0.5;
        settings.stroke.high = 0.6;
        settings.force.high = 4.0 * self.table.blocked_force.newtons();
        settings.force.jump = self.table.blocked_force.newtons();
        settings.watch.follow_pa = 1e6;
        if let Motion::Load { spring, preload, .. } = self.motion(load) {
            let stroke = &mut settings.stroke_loop;
            stroke.load_n = preload as f32;
            stroke.load_stiffness_n_per_m = (spring * 1e3) as f32;
            stroke.force_limit_n = self.table.blocked_force.newtons();
            // An integral of a third of a second, and no proportional part: friction would ring.
            stroke.proportional_n_per_m = 0.0;
            stroke.integral_n_per_m_s = (3.0 * spring * 1e3) as f32;
            stroke.damping_n_s_per_m = 0.0;
        }
        settings
    }

    /// Crossover of PI alone on a load, rad/s.
    pub fn crossover(&self, load: Load) -> f32 {
        self.settings(Law::Feedback, load).force_loop.integral_pa_per_n_s * self.slope(load)
    }

    /// Mean and amplitude of the setpoint, N or m.
    pub(crate) fn setpoint_range(&self, mode: Mode) -> (f32, f32) {
        match mode {
            Mode::Stroke => (0.2 * self.free_stroke() as f32, 0.1 * self.free_stroke() as f32),
            _ => (0.4 * self.blocked() as f32, 0.1 * self.blocked() as f32),
        }
    }

    /// What an error is compared with: blocked force (N) or free stroke (m).
    fn scale(&self, mode: Mode) -> f64 {
        if mode == Mode::Stroke { self.free_stroke() } else { self.blocked() }
    }

    /// True error of a case, rms in % of blocked force or of free stroke.
    pub fn error(&self, mode: Mode, load: Load, profile: Profile, law: Law) -> f64 {
        100.0 * closed_loop::rms(&self.run(mode, load, profile, law), |tick| of(mode, tick))
            / self.scale(mode)
    }

    fn run(&self, mode: Mode, load: Load, profile: Profile, law: Law) -> Vec<Tick> {
        let bench = BenchSpec::laboratory(self.spec.clone(), 11);
        let settings = self.settings(law, load);
        let mut control = Loop::start(&bench, &self.motion(load), &self.table, settings, mode);
        let (mean, amplitude) = self.setpoint_range(mode);
        control.point(point(mode, mean));
        control.run(1_500);
        control.wave(profile.reference(mean, amplitude));
        // The way into the wave is not judged.
        control.run(1_000);
        control.run(profile.ticks())
    }

    /// How a force is held that stays the same, after a step.
    pub fn still(&self, load: Load, law: Law) -> Still {
        let bench = BenchSpec::laboratory(self.spec.clone(), 11);
        let mut control =
            Loop::start(&bench, &self.motion(load), &self.table, self.settings(law, load), Mode::Force);
        let (mean, amplitude) = self.setpoint_range(Mode::Force);
        control.point(SetPoint::Force(mean + amplitude));
        control.run(1_000);
        control.point(SetPoint::Force(mean));
        control.run(1_500);
        let ticks = control.run(5_000);
        let percent = 100.0 / self.blocked();
        let n = ticks.len() as f64;
        let middle = ticks.iter().map(|tick| tick.force).sum::<f64>() / n;
        let swing = ticks.iter().map(|tick| (tick.force - middle).powi(2)).sum::<f64>() / n;
        let jumps = ticks.windows(2).map(|pair| (pair[1].command - pair[0].command).powi(2)).sum::<f64>() / n;
        Still {
            error: percent * closed_loop::rms(&ticks, |tick| tick.force),
            swing: percent * swing.sqrt(),
            jump: jumps.sqrt(),
        }
    }

    /// The error of a sine where a host sends each tick's setpoint and the device knows nothing of the next.
    pub fn streamed_error(&self, load: Load, hz: f32, law: Law) -> f64 {
        let bench = BenchSpec::laboratory(self.spec.clone(), 11);
        let settings = self.settings(law, load);
        let mut control = Loop::start(&bench, &self.motion(load), &self.table, settings, Mode::Force);
        let (mean, amplitude) = self.setpoint_range(Mode::Force);
        control.point(SetPoint::Force(mean));
        control.run(1_500);
        let mut ticks = Vec::new();
        for tick in 0..5_000_u32 {
            let phase = std::f32::consts::TAU * hz * tick as f32 * TICK_S;
            control.point(SetPoint::Force(mean + amplitude * phase.sin()));
            ticks.extend(control.run(1));
        }
        100.0 * closed_loop::rms(&ticks[1_000..], |tick| tick.force) / self.blocked()
    }

    /// What the regulator itself leaves, rms in %: its fastest change of pressure, for a controller that begins when it is queried and
    /// inverts lag and line, and its ripple and drift at a command that does not move.
    pub fn limit(&self, mode: Mode, load: Load, profile: Profile) -> f64 {
        let ticks = self.run(mode, load, profile, Law::Table);
        let bench = BenchSpec::laboratory(self.spec.clone(), 11);
        let slope = f64::from(self.slope(load));
        // The fastest change of force is the fastest of pressure times the braid's area; of stroke, that against the spring.
        let mut per_pascal = slope;
        if let (Mode::Stroke, Motion::Load { spring, .. }) = (mode, self.motion(load)) {
            per_pascal /= 2.0 * spring * 1e3;
        }
        let most = bench.pneumatics.rate * per_pascal * f64::from(TICK_S);
        let mut reached = ticks[0].setpoint;
        let mut squares = 0.0;
        for tick in &ticks {
            reached += (tick.setpoint - reached).clamp(-most, most);
            squares += (tick.setpoint - reached).powi(2);
        }
        let late = squares / ticks.len() as f64;
        let held = Motion::Held { stroke_mm: self.middle(load) * 1e3 };
        let mut settings = self.settings(Law::Table, load);
        settings.regulator.lead = 0.0;
        let mut control = Loop::start(&bench, &held, &self.table, settings, Mode::Pressure);
        control.point(SetPoint::Pressure(0.5 * self.table.max_pressure.pascals()));
        control.run(1_000);
        let still = control.run(4_000);
        let mean = still.iter().map(|tick| tick.pressure).sum::<f64>() / still.len() as f64;
        let ripple =
            still.iter().map(|tick| (tick.pressure - mean).powi(2)).sum::<f64>() / still.len() as f64;
        100.0 * (late + ripple * per_pascal.powi(2)).sqrt() / self.scale(mode)
    }
}

fn of(mode: Mode, tick: &Tick) -> f64 {
    if mode == Mode::Stroke { tick.stroke } else { tick.force }
}

fn point(mode: Mode, value: f32) -> SetPoint {
    if mode == Mode::Stroke { SetPoint::Stroke(value) } else { SetPoint::Force(value) }
}

/// The same case through QEMU and the link, judged by the device's own sensors over two periods at most; rms in % of blocked force
/// or of free stroke.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When the board refuses.
pub fn in_qemu(
    subject: &Subject,
    mode: Mode,
    load: Load,
    profile: Profile,
    law: Law,
) -> Result<f64, Skipped> {
    let bench = BenchSpec::laboratory(subject.spec.clone(), 11);
    let station = PlantStation::new(bench, vec![subject.motion(load)], 1e-3);
    let folder = Folder::new();
    let machine =
        Machine::start(folder.path(), Options { first: Some(Box::new(station)), ..Options::default() })?;
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &subject.table);
    tracking::set(&mut client, |settings| *settings = subject.settings(law, load));
    let (mean, amplitude) = subject.setpoint_range(mode);
    let ticks = u64::from(profile.ticks()) / 2;
    let stretches = [
        Stretch { wanted: Wanted::Point(point(mode, mean)), ticks: 1_000, unjudged: 1_000 },
        Stretch {
            wanted: Wanted::Wave(profile.reference(mean, amplitude)),
            ticks: 500 + ticks,
            unjudged: 500,
        },
    ];
    let samples = tracking::run(&mut client, mode, &stretches);
    let value = if mode == Mode::Stroke { tracking::stroke } else { tracking::force };
    Ok(100.0 * tracking::rms(&samples, value) / subject.scale(mode))
}
