//! How well force and stroke follow what is asked: each muscle on several loads, under several control laws, against what the
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
    Held,
    /// Its free end is moved at 0.3 Hz over a quarter of the free stroke.
    Moved,
    /// It pulls a mass against a spring.
    Spring,
}

/// What is asked for, around a mean by an amplitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// Up and down at once, a second at each.
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
/// The courses, in the order of the report's rows.
pub const COURSES: [Course; 8] = [
    Course::Steps,
    Course::Ramps,
    Course::Sine(0.1),
    Course::Sine(0.3),
    Course::Sine(0.5),
    Course::Sine(1.0),
    Course::Sine(2.0),
    Course::Sine(5.0),
];

impl Load {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Moved => "moved",
            Self::Spring => "mass and spring",
        }
    }
}

impl Course {
    /// In words.
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

/// Crossover of the trim behind an inverted lag, rad/s. What is left of delay is the line's 4 ms, one and a half ticks and a
/// tenth of the lag of 30 ms: 8.5 ms leave a phase margin of 60° there, the same as [`closed_loop::pi_alone`] keeps.
const TRIM_CROSSOVER: f32 = 61.0;

/// A muscle with the table fitted to it.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The truth.
    pub spec: MuscleSpec,
    /// What a user would have fitted.
    pub table: MuscleTable,
}

impl Subject {
    /// Fits a muscle of the bench as a user would.
    pub fn of(spec: MuscleSpec) -> Self {
        let table = fitting::fitted(&spec);
        Self { spec, table }
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

    fn motion(&self, load: Load) -> Motion {
        let free_mm = self.free_stroke() * 1e3;
        match load {
            Load::Held => Motion::Held { stroke_mm: 0.2 * free_mm },
            Load::Moved => {
                Motion::Sine { mean_mm: 0.22 * free_mm, amplitude_mm: 0.12 * free_mm, frequency_hz: 0.3 }
            }
            Load::Spring => {
                // Half of blocked force over a quarter of the free stroke, so that no wish is beyond the highest pressure; a
                // natural frequency of 10 Hz and some damping.
                let spring = 2.0 * self.blocked() / free_mm;
                let mass = spring * 1e3 / (2.0 * std::f64::consts::PI * 10.0_f64).powi(2);
                let damper = 0.6 * (spring * 1e3 * mass).sqrt() * 1e-3;
                Motion::Load { mass, spring, preload: 0.05 * self.blocked(), damper }
            }
        }
    }

    /// Newtons for each pascal at rest length, by the ideal braid.
    fn slope(&self) -> f32 {
        Muscle::<f32>::build(&self.table).expect("a valid table").braid().posture(Length::ZERO).area
    }

    fn settings(&self, law: Law, load: Load) -> Settings {
        let mut settings = match law {
            Law::Table | Law::Trimmed => closed_loop::forward(FeedForward::Table),
            Law::Gaylord => closed_loop::forward(FeedForward::Gaylord),
            Law::Feedback => closed_loop::pi_alone(self.slope()),
        };
        if law == Law::Trimmed {
            settings.force_loop.integral_pa_per_n_s = TRIM_CROSSOVER / self.slope();
            settings.force_loop.trim_limit_pa = 150e3;
        }
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

    /// Mean and amplitude of what is asked for, N or m.
    fn wish(&self, mode: Mode) -> (f32, f32) {
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
    pub fn error(&self, mode: Mode, load: Load, course: Course, law: Law) -> f64 {
        100.0 * closed_loop::rms(&self.run(mode, load, course, law), |tick| of(mode, tick)) / self.scale(mode)
    }

    fn run(&self, mode: Mode, load: Load, course: Course, law: Law) -> Vec<Tick> {
        let bench = BenchSpec::laboratory(self.spec.clone(), 11);
        let settings = self.settings(law, load);
        let mut control = Loop::start(&bench, &self.motion(load), &self.table, settings, mode);
        let (mean, amplitude) = self.wish(mode);
        control.point(point(mode, mean));
        control.run(1_500);
        control.wave(course.reference(mean, amplitude));
        // The way into the wave is not judged.
        control.run(1_000);
        control.run(course.ticks())
    }

    /// What the regulator would leave to a controller that knew everything but the future: its dead time of 5.5 ms (the
    /// line's lag of 4 ms and one and a half ticks), and its fastest change of pressure. Rms in %.
    pub fn limit(&self, mode: Mode, load: Load, course: Course) -> f64 {
        let ticks = self.run(mode, load, course, Law::Table);
        let rate = BenchSpec::laboratory(self.spec.clone(), 11).pneumatics.rate;
        // The fastest change of force is the fastest of pressure times the braid's area; of stroke, that against the spring.
        let mut most = rate * f64::from(self.slope()) * f64::from(TICK_S);
        if let (Mode::Stroke, Motion::Load { spring, .. }) = (mode, self.motion(load)) {
            most /= 2.0 * spring * 1e3;
        }
        const DELAY: [usize; 2] = [5, 6];
        let mut reached = ticks[0].asked;
        let (mut sum, mut count) = (0.0, 0);
        for at in DELAY[1]..ticks.len() {
            let late = DELAY.map(|delay| ticks[at - delay].asked).iter().sum::<f64>() / 2.0;
            reached += (late - reached).clamp(-most, most);
            sum += (ticks[at].asked - reached).powi(2);
            count += 1;
        }
        100.0 * (sum / f64::from(count.max(1))).sqrt() / self.scale(mode)
    }
}

fn of(mode: Mode, tick: &Tick) -> f64 {
    if mode == Mode::Stroke { tick.stroke } else { tick.force }
}

fn point(mode: Mode, value: f32) -> SetPoint {
    if mode == Mode::Stroke { SetPoint::Stroke(value) } else { SetPoint::Force(value) }
}

/// The same case of force through QEMU and the link, judged by the load cell; rms in % of blocked force.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When the board refuses.
pub fn in_qemu(subject: &Subject, load: Load, course: Course, law: Law) -> Result<f64, Skipped> {
    let bench = BenchSpec::laboratory(subject.spec.clone(), 11);
    let station = PlantStation::new(bench, vec![subject.motion(load)], 1e-3);
    let folder = Folder::new();
    let machine =
        Machine::start(folder.path(), Options { first: Some(Box::new(station)), ..Options::default() })?;
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &subject.table);
    tracking::set(&mut client, |settings| *settings = subject.settings(law, load));
    let (mean, amplitude) = subject.wish(Mode::Force);
    let ticks = u64::from(course.ticks());
    let stretches = [
        Stretch { wanted: Wanted::Point(point(Mode::Force, mean)), ticks: 1_500, unjudged: 1_500 },
        Stretch {
            wanted: Wanted::Wave(course.reference(mean, amplitude)),
            ticks: 1_000 + ticks,
            unjudged: 1_000,
        },
    ];
    let samples = tracking::run(&mut client, Mode::Force, &stretches);
    Ok(100.0 * tracking::rms(&samples, tracking::force) / subject.blocked())
}
