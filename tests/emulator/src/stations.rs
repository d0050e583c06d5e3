//! Benches that a test can look into and disturb while the board runs on them.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use virtual_bench::lockstep::{Answer, Station};

use crate::machine::HOPELESS;

/// What a test does to the readings of a bench: called with the period's number and the answer, which it may change.
pub type Disturbance = Box<dyn FnMut(u64, &mut Answer) + Send>;

/// A line of what passed over the wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exchange {
    /// Pressure command, Pa; zero where the dump valve was open.
    pub command: f32,
    /// What the board was reported.
    pub answer: Answer,
}

struct Inner<S> {
    station: S,
    disturbance: Option<Disturbance>,
    exchanges: Vec<Exchange>,
}

/// A bench with a window.
pub struct Watched<S>(Arc<Mutex<Inner<S>>>);

impl<S> Clone for Watched<S> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<S> Watched<S> {
    /// A window on a bench.
    pub fn new(station: S) -> Self {
        Self(Arc::new(Mutex::new(Inner { station, disturbance: None, exchanges: Vec::new() })))
    }

    fn inner(&self) -> std::sync::MutexGuard<'_, Inner<S>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From now on, this happens to the readings.
    pub fn disturb(&self, disturbance: impl FnMut(u64, &mut Answer) + Send + 'static) {
        self.inner().disturbance = Some(Box::new(disturbance));
    }

    /// From now on the readings are true again.
    pub fn heal(&self) {
        self.inner().disturbance = None;
    }

    /// Periods so far.
    pub fn periods(&self) -> usize {
        self.inner().exchanges.len()
    }

    /// What passed since a period.
    pub fn since(&self, period: usize) -> Vec<Exchange> {
        self.inner().exchanges.get(period..).unwrap_or_default().to_vec()
    }

    /// Lets the bench continue until something is so of its periods, however long the machine takes for them.
    ///
    /// # Panics
    /// When the bench does not move: then it never will be.
    pub fn until(&self, what: &str, so: impl Fn(usize) -> bool) {
        let mut last = (self.periods(), Instant::now());
        loop {
            let now = self.periods();
            if so(now) {
                return;
            }
            if now != last.0 {
                last = (now, Instant::now());
            }
            assert!(last.1.elapsed() < HOPELESS, "{what}: the time of the bench does not advance");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Lets the bench continue for some periods.
    ///
    /// # Panics
    /// When it does not move.
    pub fn pass(&self, periods: usize) {
        let until = self.periods() + periods;
        self.until("some periods", |now| now >= until);
    }

    /// Looks at the bench itself.
    pub fn with<R>(&self, read: impl FnOnce(&mut S) -> R) -> R {
        read(&mut self.inner().station)
    }
}

impl<S: Station> Station for Watched<S> {
    fn reset(&mut self, script: u16) -> Answer {
        let mut inner = self.inner();
        inner.exchanges.clear();
        inner.station.reset(script)
    }

    fn step(&mut self, pressure_command: f32, setpoint: f32) -> Answer {
        let mut inner = self.inner();
        let mut answer = inner.station.step(pressure_command, setpoint);
        let period = inner.exchanges.len() as u64;
        if let Some(disturbance) = &mut inner.disturbance {
            disturbance(period, &mut answer);
        }
        inner.exchanges.push(Exchange { command: pressure_command, answer });
        answer
    }
}
