//! Does a diagnosis matter to the controller? A muscle with physics that the model leaves out is recorded on the bench, fitted
//! plainly and diagnosed; the controller then follows a force on that muscle with either table.

use model_core::link::messages::{Mode, Reference, SetPoint, Side};
use model_core::link::settings::{FeedForward, Settings};
use model_core::table::MuscleTable;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Reader};
use pam_diagnose::refitted_table;
use pam_fit::{Options, fit};
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::physics::{Ageing, Relaxation, Seal, Viscous};
use virtual_bench::plant::{Motion, Plant, PlantStation};
use virtual_bench::presets;
use virtual_bench::recording::Columns;

use crate::closed_loop::{self, Loop};
use crate::machine::{Folder, Machine, Skipped};
use crate::tracking::{self, Stretch, Wanted};
use crate::{Watched, upload};

/// A muscle, what is concealed in it, and how it is moved under control.
#[derive(Clone, Debug)]
pub struct Case {
    /// What is concealed, by its name in the catalogue.
    pub effect: &'static str,
    /// What it is as text, with its size.
    pub description: String,
    /// The muscle without it.
    pub plain: MuscleSpec,
    /// The muscle with it.
    pub spec: MuscleSpec,
    /// How its free end is moved while the controller works.
    pub motion: Motion,
    /// The setpoint of the force meanwhile.
    pub setpoint: Vec<Stretch>,
    /// Blocked force at the highest level, N.
    pub blocked: f64,
}

/// Blocked force (N), free stroke (m) and slow speed (m/s) of a muscle at its levels.
fn sizes(spec: &MuscleSpec) -> (f64, f64, f64) {
    let muscle = Muscle::new(spec.clone());
    let levels = campaigns::levels(&muscle);
    let top = levels.iter().copied().fold(0.0, f64::max);
    (muscle.quasi_static(top, 0.0), muscle.free_stroke(top), campaigns::slow(&muscle, &levels) * 1e-3)
}

/// Swings about 20 % of the free stroke `x` (m).
fn swing(x: f64, frequency_hz: f64) -> Motion {
    Motion::Sine { mean_mm: 0.2e3 * x, amplitude_mm: 0.1e3 * x, frequency_hz }
}

/// Eight small moves back and forth, as of a gripper: a rest of 1.5 s, then a move by two hundredths of the free stroke `x` (m) within a
/// second. An effect that grows during a rest and fades over the first part of a motion acts in each move.
fn inching(x: f64) -> Motion {
    const MOVES: [f64; 8] = [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0];
    let mut points = vec![(0.0, 0.2e3 * x)];
    for (n, way) in MOVES.iter().cycle().take(40).enumerate() {
        let (began, at) = (2.5 * n as f64, points.last().map_or(0.0, |last| last.1));
        points.push((began + 1.5, at));
        points.push((began + 2.5, at + way * 0.02e3 * x));
    }
    Motion::Path { points }
}

/// A muscle that no one has seen, whose braid gives too little before it slides for any sample to see: its plain law of friction is
/// the model's own, and nothing else is left out.
fn simple(seed: u64) -> MuscleSpec {
    let mut spec = presets::random(seed);
    let travel = 5e-5 * spec.geometry.rest_length;
    spec.friction.bristles = vec![(1.0, travel)];
    spec.friction.slip = travel / 800.0;
    spec
}

/// Puts physics into a muscle of this blocked force (N), free stroke (m) and slow speed (m/s); gives it as text.
type Conceal = fn(&mut MuscleSpec, f64, f64, f64) -> String;

/// The muscles of the comparison.
pub fn cases() -> Vec<Case> {
    let seal: Conceal = |m, f, x, _| {
        let dry = 0.04 * f;
        m.physics.seal = Some(Seal { dry, per_pressure: 0.0, travel: 2e-4 * x, slow: 0.0, slow_speed: 0.0 });
        format!("a seal with a constant friction of {dry:.1} N, 4 % of blocked force")
    };
    let viscous: Conceal = |m, f, _, v| {
        let drag = 0.006 * f / v;
        m.physics.viscous = Some(Viscous { drag, per_pressure: 0.0 });
        format!("a drag of {:.2} N s/mm", 1e-3 * drag)
    };
    let relaxation: Conceal = |m, _, _, _| {
        m.physics.relaxation = Some(Relaxation { strength: 0.12, fastest: 6.0, branches: 2, exponent: 0.2 });
        "a rubber that relaxes by a fifth of its elastic force, most of it within twenty seconds".into()
    };
    let breakaway: Conceal = |m, _, x, _| {
        m.physics.ageing = Some(Ageing { strength: 0.15, time: 0.5, travel: 0.008 * x });
        "strands that stick more the longer they rest".into()
    };
    let swing = |hz: f64| move |x: f64| swing(x, hz);
    let path = |x: f64| Motion::Path {
        points: [(0.0, 0.0), (1.5, 0.3), (3.0, 0.3), (4.0, 0.1), (60.0, 0.1)]
            .map(|(t, part)| (t, 1e3 * part * x))
            .to_vec(),
    };
    type Displacement<'a> = &'a dyn Fn(f64) -> Motion;
    type Setpoint = fn(f64) -> Vec<Stretch>;
    let all: [(&'static str, u64, Conceal, Displacement<'_>, Setpoint); 4] = [
        ("coulomb-friction", 101, seal, &swing(0.2), sine_and_steps),
        ("viscous-damping", 102, viscous, &swing(0.5), sine_and_steps),
        ("stress-relaxation", 103, relaxation, &path, sine_and_steps),
        ("breakaway-friction", 104, breakaway, &inching, steady),
    ];
    all.map(|(effect, seed, conceal, motion, setpoint)| {
        let plain = simple(seed);
        let (blocked, x, v) = sizes(&plain);
        let mut spec = plain.clone();
        let description = conceal(&mut spec, blocked, x, v);
        Case { effect, description, plain, spec, motion: motion(x), setpoint: setpoint(blocked), blocked }
    })
    .to_vec()
}

/// What the host made of a muscle's recordings.
#[derive(Clone, Debug)]
pub struct Tables {
    /// A plain fit.
    pub plain: MuscleTable,
    /// `host diagnose -o`.
    pub diagnosed: MuscleTable,
    /// What was named, with probabilities.
    pub named: Vec<(String, f64)>,
    /// Error of either table on the recordings, N.
    pub rms: (f64, f64),
    /// What else the diagnosis remarked.
    pub remarks: Vec<String>,
}

fn record(spec: &MuscleSpec) -> (MuscleDescription, Campaign) {
    let mut bench = Bench::new(&BenchSpec::laboratory(spec.clone(), 4_711));
    let levels = campaigns::levels(bench.muscle());
    let protocol = campaigns::upgraded(bench.muscle(), &levels, 4_711);
    let recordings = bench.run(&protocol).expect("the bench records");
    let folder = Folder::new();
    let files: Vec<_> = recordings
        .iter()
        .map(|recording| {
            let path = folder.path().join(format!("{}.csv", recording.name));
            std::fs::write(&path, recording.csv(Columns::default())).expect("a file");
            path
        })
        .collect();
    let muscle = MuscleDescription::parse(&spec.description()).expect("a description");
    let campaign = Reader::of(&muscle).campaign(&files).expect("recordings");
    (muscle, campaign)
}

/// Records a case by the catalogue's protocol D, fits it and diagnoses it.
///
/// # Panics
/// When a step of the way fails.
pub fn tables(case: &Case) -> Tables {
    let (muscle, campaign) = record(&case.spec);
    let plain = fit(&campaign, &muscle, &Options::default()).expect("a fit").table;
    let geometry = muscle.geometry();
    let options = pam_diagnose::Options { muscle: muscle.name.clone(), ..Default::default() };
    let answer = pam_diagnose::diagnose(&campaign, &geometry, &options).expect("a diagnosis");
    let refitted = refitted_table::refit(&campaign, &muscle, &answer).expect("a table");
    Tables {
        plain,
        diagnosed: refitted.file.table.clone(),
        named: answer.missing.iter().map(|m| (m.effect.clone(), m.probability)).collect(),
        rms: (refitted.rms_before, refitted.rms_after),
        remarks: answer.remarks.iter().map(pam_report::wording::remark).collect(),
    }
}

/// A plain fit of the muscle without the effect: what the controller reaches when nothing is left out.
///
/// # Panics
/// When a step of the way fails.
pub fn table_without(case: &Case) -> MuscleTable {
    let (muscle, campaign) = record(&case.plain);
    fit(&campaign, &muscle, &Options::default()).expect("a fit").table
}

/// A slow sine of force about a third of blocked force `b`, N, then two steps; the first part of the sine fills the muscle.
fn sine_and_steps(blocked: f64) -> Vec<Stretch> {
    let b = blocked as f32;
    let sine = Reference::Sine { mean: 0.35 * b, amplitude: 0.12 * b, frequency_hz: 0.5 };
    let step =
        |newtons| Stretch { wanted: Wanted::Point(SetPoint::Force(newtons)), ticks: 1_000, unjudged: 300 };
    vec![Stretch { wanted: Wanted::Wave(sine), ticks: 2_600, unjudged: 300 }, step(0.45 * b), step(0.28 * b)]
}

/// One force for a whole motion by [`inching`], to and back, after a second in which it fills the muscle.
fn steady(blocked: f64) -> Vec<Stretch> {
    let point = SetPoint::Force(0.35 * blocked as f32);
    vec![Stretch { wanted: Wanted::Point(point), ticks: 21_000, unjudged: 1_000 }]
}

/// What a user would have set: the regulator as it is identified on this bench.
fn settings(bench: &BenchSpec, table: &MuscleTable, blocked: f64) -> Settings {
    let reach_mm = f64::from(table.tested.contraction_high) * bench.muscle.geometry.rest_length * 1e3;
    let mut settings = closed_loop::identified(bench, table, 0.1 * reach_mm).settings(Settings::default());
    settings.limits.force_n = 2.0 * blocked as f32;
    settings
}

/// Force tracking error, rms in % of blocked force, of the controller's step in this process.
pub fn here(spec: &MuscleSpec, case: &Case, table: &MuscleTable) -> f64 {
    let bench = BenchSpec::laboratory(spec.clone(), 11);
    let with = closed_loop::forward(settings(&bench, table, case.blocked), FeedForward::Table);
    let mut control = Loop::start(&bench, &case.motion, table, with, Mode::Force);
    let mut judged = Vec::new();
    for stretch in &case.setpoint {
        match stretch.wanted {
            Wanted::Wave(wave) => control.wave(wave),
            Wanted::Point(point) => control.point(point),
        };
        control.run(stretch.unjudged as u32);
        judged.extend(control.run((stretch.ticks - stretch.unjudged) as u32));
    }
    100.0 * closed_loop::rms(&judged, |tick| tick.force) / case.blocked
}

/// The same of the real image in QEMU, by the force that the load cell reads: one figure for each table.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// When the board refuses or stops.
pub fn in_emulator(spec: &MuscleSpec, case: &Case, tables: &[&MuscleTable]) -> Result<Vec<f64>, Skipped> {
    tables
        .iter()
        .map(|table| {
            // A board and a bench of its own: the muscle must not remember the run before.
            let folder = Folder::new();
            let bench = BenchSpec::laboratory(spec.clone(), 11);
            let with = settings(&bench, table, case.blocked);
            let start = Plant::new(&bench, &case.motion);
            let waiting = Motion::Held { stroke_mm: 1e3 * start.truth().stroke };
            let station = Watched::new(PlantStation::new(bench, vec![waiting], 1e-3));
            let options =
                crate::Options { first: Some(Box::new(station.clone())), ..crate::Options::default() };
            let machine = Machine::start(folder.path(), options)?;
            let mut client = machine.client();
            upload(&mut client, Side::Agonist, table);
            tracking::set(&mut client, |s| {
                tracking::compare(FeedForward::Table, 0.0, 0.0)(s);
                (s.regulator, s.limits) = (with.regulator, with.limits);
            });
            // Motion and setpoint begin together, on a muscle that has not waited, however long all this took.
            station.with(|bench| *bench.plant() = start);
            let samples = tracking::run(&mut client, Mode::Force, &case.setpoint);
            Ok(100.0 * tracking::rms(&samples, tracking::force) / case.blocked)
        })
        .collect()
}
