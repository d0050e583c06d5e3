//! What changed in an actuator while its controller runs: telemetry beside a reference, compared again and again.
//!
//! The comparison runs on a thread of its own. Who hands over samples never waits for it: what it has no room for is kept, and the oldest
//! rows are forgotten first.

mod reference;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, channel, sync_channel};
use std::thread::JoinHandle;

use model_core::link::messages::{State, Telemetry};

pub use reference::{Reference, ReferenceOptions, finish, tell};

use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::{Campaign, Recording};
use pam_diagnose::reference::{ChangeReport, Mounted, Options, compare};
use pam_report::wording::change as wording;

/// Samples of so long become one row, µs: slower than the noise, faster than any motion.
const ROW: u64 = 10_000;
/// A muscle that is set to work fills for so long, µs; these samples are left out.
const FILLING: u64 = 1_000_000;
/// Rows until the first comparison: 20 s.
const FIRST: usize = 2_000;
/// New rows until the next one: 5 s.
const EVERY: usize = 500;
/// Rows that are compared, at most: the last ten minutes.
const WINDOW: usize = 60_000;
/// Rows handed over together: a quarter of a second.
const TOGETHER: usize = 25;
/// Batches that wait for the comparison, at most.
const WAITING: usize = 64;

/// Time s, pressure Pa, stroke m, force N; and whether the row begins a new run.
#[derive(Debug, Clone, Copy)]
struct Row {
    values: [f64; 4],
    begins: bool,
}

/// What is known while it runs.
#[derive(Debug, Clone)]
pub enum Update {
    /// No comparison yet, and why.
    Waiting(String),
    /// The comparison, twice in a row with these names.
    Answer(Box<ChangeReport>),
}

impl Update {
    /// As one line.
    #[must_use]
    pub fn description(&self) -> String {
        let report = match self {
            Self::Waiting(why) => return format!("no comparison yet: {why}"),
            Self::Answer(report) => report,
        };
        let size = |m: &pam_diagnose::reference::answer::Changed| {
            m.parameters.iter().map(wording::size).collect::<Vec<_>>().join(", ")
        };
        let sizes: Vec<String> = report.missing.iter().map(|m| format!("{} {}", m.effect, size(m))).collect();
        match sizes.is_empty() {
            true => wording::headline(report),
            false => format!("{} {} (95 %)", wording::headline(report), sizes.join("; ")),
        }
    }

    /// Names of what changed; `None` before the first comparison.
    fn names(&self) -> Option<Vec<String>> {
        match self {
            Self::Waiting(_) => None,
            Self::Answer(report) => Some(report.missing.iter().map(|m| m.effect.clone()).collect()),
        }
    }
}

/// Takes samples, gives answers.
#[derive(Debug)]
pub struct ChangeWatch {
    samples: Option<SyncSender<Vec<Row>>>,
    answers: Receiver<Update>,
    worker: Option<JoinHandle<Option<Update>>>,
    pending: VecDeque<Row>,
    sums: [f64; 4],
    count: f64,
    slot: u64,
    started: Option<u64>,
    begins: bool,
}

impl ChangeWatch {
    /// Begins to watch.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(reference: Arc<Reference>, mounted: Mounted) -> Result<Self> {
        let (samples, rows) = sync_channel(WAITING);
        let (say, answers) = channel();
        let worker = std::thread::Builder::new()
            .name("compare".into())
            .spawn(move || {
                Comparison::new(reference, mounted).serve(&rows, |update| say.send(update).is_ok())
            })
            .map_err(|e| Error::new(DataCode::CallInvalid, format!("no thread for the comparison: {e}")))?;
        Ok(Self {
            samples: Some(samples),
            answers,
            worker: Some(worker),
            pending: VecDeque::new(),
            sums: [0.0; 4],
            count: 0.0,
            slot: 0,
            started: None,
            begins: true,
        })
    }

    /// Takes a sample; never waits. Samples of a controller that does not run are left out.
    pub fn push(&mut self, sample: &Telemetry) {
        let Some(side) = sample.sides.first().filter(|_| sample.state == State::Running) else {
            self.started = None;
            return;
        };
        let start = *self.started.get_or_insert(sample.time_us);
        // Device time that goes back is another run.
        let Some(since) = sample.time_us.checked_sub(start) else {
            self.started = None;
            return;
        };
        if since < FILLING {
            (self.begins, self.count, self.sums) = (true, 0.0, [0.0; 4]);
            return;
        }
        let slot = sample.time_us / ROW;
        if slot != self.slot && self.count > 0.0 {
            let values = self.sums.map(|s| s / self.count);
            if values.iter().all(|v| v.is_finite()) {
                self.pending.push_back(Row { values, begins: std::mem::take(&mut self.begins) });
            }
            (self.count, self.sums) = (0.0, [0.0; 4]);
            self.hand_over();
        }
        self.slot = slot;
        let read = [
            sample.time_us as f64 * 1e-6,
            f64::from(side.pressure_pa),
            f64::from(side.stroke_m),
            f64::from(side.force_n),
        ];
        self.sums.iter_mut().zip(read).for_each(|(s, v)| *s += v);
        self.count += 1.0;
    }

    fn hand_over(&mut self) {
        if self.pending.len() < TOGETHER {
            return;
        }
        let Some(samples) = &self.samples else { return };
        if let Err(TrySendError::Full(back)) = samples.try_send(self.pending.drain(..).collect()) {
            self.pending = back.into();
            while self.pending.len() > WINDOW {
                self.pending.pop_front();
                if let Some(first) = self.pending.front_mut() {
                    first.begins = true;
                }
            }
        }
    }

    /// What is new since the last call; never waits.
    pub fn news(&self) -> Option<Update> {
        self.answers.try_iter().last()
    }

    /// Compares everything once more, and gives the last answer. Waits for it.
    #[must_use]
    pub fn finish(mut self) -> Option<Update> {
        if let Some(samples) = self.samples.take() {
            // The comparison may have ended with a panic; then no thread takes them.
            let _ = samples.send(self.pending.drain(..).collect());
        }
        self.worker.take().and_then(|w| w.join().ok()).flatten()
    }
}

/// The thread's own side.
struct Comparison {
    reference: Arc<Reference>,
    options: Options,
    rows: VecDeque<Row>,
    fresh: usize,
    before_last: Option<Vec<String>>,
    reported: bool,
}

impl Comparison {
    fn new(reference: Arc<Reference>, mounted: Mounted) -> Self {
        let options = Options { mounted, ..Options::default() };
        Self { reference, options, rows: VecDeque::new(), fresh: 0, before_last: None, reported: false }
    }

    fn serve(mut self, batches: &Receiver<Vec<Row>>, mut say: impl FnMut(Update) -> bool) -> Option<Update> {
        while let Ok(batch) = batches.recv() {
            self.take(batch);
            // What waits already belongs to the next comparison.
            let ended = loop {
                match batches.try_recv() {
                    Ok(batch) => self.take(batch),
                    Err(TryRecvError::Empty) => break false,
                    Err(TryRecvError::Disconnected) => break true,
                }
            };
            if ended {
                break;
            }
            let due = self.rows.len() >= FIRST && self.fresh >= EVERY;
            if due
                && let Some(update) = self.steady()
                && !say(update)
            {
                break;
            }
        }
        (!self.rows.is_empty()).then(|| self.compare())
    }

    fn take(&mut self, batch: Vec<Row>) {
        self.fresh += batch.len();
        self.rows.extend(batch);
        while self.rows.len() > WINDOW {
            self.rows.pop_front();
        }
    }

    fn compare(&mut self) -> Update {
        self.fresh = 0;
        if self.rows.len() < FIRST {
            return Update::Waiting(format!(
                "{} s of motion under pressure, {} s needed",
                self.rows.len() / 100,
                FIRST / 100
            ));
        }
        match compare(&campaign(&self.rows), self.reference.against(), &self.options) {
            Ok(report) => Update::Answer(Box::new(report)),
            Err(error) => Update::Waiting(error.cause().to_owned()),
        }
    }

    /// A comparison whose names are those of the one before: over a growing recording each is another chance for a false name.
    fn steady(&mut self) -> Option<Update> {
        let update = self.compare();
        let names = update.names();
        let same = names == self.before_last;
        self.before_last = names;
        if self.before_last.is_none() {
            // Said once: why does not change from one comparison to the next.
            return (!std::mem::replace(&mut self.reported, true)).then_some(update);
        }
        same.then_some(update)
    }
}

/// Rows as recordings, one for each run.
fn campaign(rows: &VecDeque<Row>) -> Campaign {
    let mut recordings: Vec<Recording> = Vec::new();
    for row in rows {
        if row.begins || recordings.is_empty() {
            let name = format!("run {}", recordings.len() + 1);
            recordings.push(Recording {
                source: PathBuf::from(&name),
                name,
                force: Some(Vec::new()),
                ..Recording::default()
            });
        }
        if let Some(last) = recordings.last_mut() {
            let [time, pressure, stroke, force] = row.values;
            // Lost samples may leave two means at one time.
            if last.time.last().is_none_or(|t| time > *t) {
                last.time.push(time);
                last.pressure.push(pressure);
                last.stroke.push(stroke);
                last.force.get_or_insert_default().push(force);
            }
        }
    }
    // A run of a moment has no motion to compare.
    recordings.retain(|r| r.len() >= EVERY);
    Campaign::new(recordings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::messages::SideSample;

    /// A muscle whose length and pressure move together; `gain` is that of its load cell.
    fn sample(tick: u64, gain: f64, noise: &mut u64) -> Telemetry {
        *noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let random = (*noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        let t = tick as f64 * 1e-3;
        let (p, x) = (3e5 + 1.5e5 * (0.7 * t).sin(), 5e-3 + 4e-3 * (2.5 * t).sin());
        let way = (2.5 * t).cos().signum();
        let f = 4e-4 * (p - 4e4) * (1.0 - 60.0 * x) * (1.0 - 0.02 * way);
        let side = SideSample {
            pressure_pa: p as f32,
            stroke_m: x as f32,
            force_n: (gain * f + 0.3 * random) as f32,
            ..SideSample::default()
        };
        let mut sides = heapless::Vec::new();
        let _ = sides.push(side);
        Telemetry { time_us: tick * 1000, tick, state: State::Running, sides, ..Telemetry::default() }
    }

    fn before() -> Arc<Reference> {
        let mut noise = 5;
        let mut rows = VecDeque::new();
        for tick in (0..60_000).step_by(10) {
            let side = sample(tick, 1.0, &mut noise).sides[0];
            let read = [side.pressure_pa, side.stroke_m, side.force_n].map(f64::from);
            rows.push_back(Row { values: [tick as f64 * 1e-3, read[0], read[1], read[2]], begins: false });
        }
        Arc::new(Reference::Recordings(campaign(&rows)))
    }

    fn watched(gain: f64) -> Update {
        let mut watch = ChangeWatch::start(before(), Mounted::Same).expect("a thread");
        let mut noise = 77;
        for tick in 0..45_000 {
            watch.push(&sample(tick, gain, &mut noise));
        }
        watch.finish().expect("rows")
    }

    #[test]
    fn a_gain_of_the_load_cell_is_named_with_its_size() {
        let Update::Answer(report) = watched(1.05) else { panic!("no answer") };
        assert_eq!(report.missing.first().map(|m| m.effect.as_str()), Some("force-gain"), "{report:?}");
        let gain = &report.missing[0].parameters[0];
        assert!(gain.low < 0.05 && gain.high > 0.05 && (gain.value - 0.05).abs() < 0.01, "{gain:?}");
    }

    #[test]
    fn nothing_is_named_where_nothing_changed() {
        let update = watched(1.0);
        assert_eq!(update.names(), Some(Vec::new()), "{}", update.description());
        assert!(update.description().starts_with("No change"), "{}", update.description());
    }

    #[test]
    fn a_muscle_at_rest_is_waited_for() {
        let mut watch = ChangeWatch::start(before(), Mounted::Same).expect("a thread");
        let mut noise = 3;
        for tick in 0..5_000 {
            watch.push(&sample(tick, 1.0, &mut noise));
        }
        watch.push(&Telemetry { time_us: 5_000_000, state: State::Disarmed, ..Telemetry::default() });
        let words = watch.finish().expect("rows").description();
        assert!(words.contains("20 s needed"), "{words}");
    }
}
