//! A record of loop variables, sampled inside the loop and read out afterwards.

use heapless::Vec;
use model_core::link::messages::{
    Field, Refusal, TRACE_PIECE, TRACE_VARIABLES, TraceArm, TraceInfo, TracePiece, Trigger, Variable,
};

use crate::compact_float::CompactFloat;
use crate::shared_buffer::{SharedBuffer, TRACE_CAPACITY};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Off,
    Waiting,
    Recording,
    /// A fault has stopped the device: the tick that it is found in is the last.
    Ending,
    Complete,
}

/// One trace.
#[derive(Debug)]
pub struct Trace {
    phase: Phase,
    variables: Vec<Variable, TRACE_VARIABLES>,
    every_ticks: u16,
    trigger: Trigger,
    countdown: u16,
    /// None while a table has it.
    values: Option<SharedBuffer>,
    /// Records that fit.
    room: usize,
    records: usize,
    /// Where the next record goes; with `UntilFault` the oldest is there once it went round.
    next: usize,
    first_tick: u64,
}

impl Default for Trace {
    fn default() -> Self {
        Self {
            phase: Phase::Off,
            variables: Vec::new(),
            every_ticks: 1,
            trigger: Trigger::Now,
            countdown: 0,
            values: Some(SharedBuffer::new()),
            room: 0,
            records: 0,
            next: 0,
            first_tick: 0,
        }
    }
}

impl Trace {
    /// Arms it.
    ///
    /// # Errors
    /// [`Refusal::Value`] without variables or with a rate of 0.
    pub fn arm(&mut self, request: &TraceArm) -> Result<(), Refusal> {
        if request.variables.is_empty() || request.every_ticks == 0 {
            return Err(Refusal::Value(Field::Rate));
        }
        self.variables = request.variables.clone();
        self.every_ticks = request.every_ticks;
        self.trigger = request.trigger;
        self.room = TRACE_CAPACITY / self.variables.len();
        self.records = 0;
        self.next = 0;
        self.countdown = 0;
        if let Some(room) = &mut self.values {
            room.clear_for_trace();
        }
        self.phase = match request.trigger {
            Trigger::Start => Phase::Waiting,
            Trigger::Now | Trigger::UntilFault => Phase::Recording,
        };
        Ok(())
    }

    /// Gives its room away, if it has it; what was recorded is lost, and nothing is recorded until it is armed again.
    pub fn lend(&mut self) -> Option<SharedBuffer> {
        self.phase = Phase::Off;
        self.records = 0;
        self.values.take()
    }

    /// Takes the room back.
    pub fn take_back(&mut self, room: SharedBuffer) {
        self.values = Some(room);
    }

    /// A mode or reference starts.
    pub fn on_start(&mut self) {
        if self.phase == Phase::Waiting {
            self.phase = Phase::Recording;
        }
    }

    /// A fault stops the device in this tick.
    pub fn on_fault(&mut self) {
        if self.phase == Phase::Recording && self.trigger == Trigger::UntilFault {
            self.phase = Phase::Ending;
        }
    }

    /// Takes one tick's variables; returns whether it just became full.
    pub fn sample(&mut self, tick: u64, value: impl Fn(Variable) -> f32) -> bool {
        match self.phase {
            Phase::Recording => (),
            Phase::Ending => self.phase = Phase::Complete,
            Phase::Off | Phase::Waiting | Phase::Complete => return false,
        }
        if self.countdown > 0 {
            self.countdown -= 1;
            return false;
        }
        self.countdown = self.every_ticks - 1;
        let Some(values) = self.values.as_mut().and_then(SharedBuffer::trace) else { return false };
        let first = self.next * self.variables.len();
        for (place, variable) in (first..).zip(&self.variables) {
            let now = CompactFloat::of(value(*variable));
            match values.get_mut(place) {
                Some(old) => *old = now,
                // As many records are made as the room has places for.
                None => drop(values.push(now)),
            }
        }
        if self.records == 0 {
            self.first_tick = tick;
        }
        if self.records < self.room {
            self.records += 1;
        } else {
            self.first_tick += u64::from(self.every_ticks);
        }
        self.next += 1;
        if self.next == self.room {
            self.next = 0;
            if self.trigger != Trigger::UntilFault {
                self.phase = Phase::Complete;
                return true;
            }
        }
        false
    }

    /// Fills in the progress and the variables of the trace.
    pub fn describe(&self, info: &mut TraceInfo) {
        info.complete = self.phase == Phase::Complete;
        info.records = self.records as u32;
        info.first_tick = self.first_tick;
        info.every_ticks = self.every_ticks;
        info.variables.clone_from(&self.variables);
    }

    /// Fills an empty piece with as many whole records as fit it, from one on.
    ///
    /// # Errors
    /// [`Refusal::Range`] behind the last record, and while it still records.
    pub fn read(&self, record: u32, piece: &mut TracePiece) -> Result<(), Refusal> {
        let from = record as usize;
        if self.phase != Phase::Complete || from >= self.records {
            return Err(Refusal::Range);
        }
        let values = self.values.as_ref().map_or(&[][..], SharedBuffer::values);
        let width = self.variables.len();
        let oldest = if self.records == self.room { self.next } else { 0 };
        for at in from..self.records.min(from + TRACE_PIECE / width) {
            let place = (oldest + at) % self.room * width;
            let record = values.get(place..place + width).ok_or(Refusal::Range)?;
            for value in record {
                piece.values.push(value.value()).map_err(|_| Refusal::Range)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arm(trigger: Trigger, every_ticks: u16) -> Trace {
        let mut trace = Trace::default();
        let variables = [Variable::Pressure, Variable::Force, Variable::Stroke].into_iter().collect();
        assert_eq!(trace.arm(&TraceArm { variables, every_ticks, trigger }), Ok(()));
        trace
    }

    fn info(trace: &Trace) -> TraceInfo {
        let mut info = TraceInfo::default();
        trace.describe(&mut info);
        info
    }

    fn value(tick: u64) -> impl Fn(Variable) -> f32 {
        move |variable| tick as f32 + if variable == Variable::Force { 0.5 } else { 0.0 }
    }

    fn read_all(trace: &Trace) -> std::vec::Vec<f32> {
        let mut all = std::vec::Vec::new();
        let mut piece = TracePiece::default();
        while trace.read(all.len() as u32 / 3, &mut piece).is_ok() {
            all.extend_from_slice(&piece.values);
            piece.values.clear();
        }
        all
    }

    #[test]
    fn it_fills_and_is_read_back_whole() {
        let mut trace = arm(Trigger::Now, 2);
        let full = (0..5000).filter(|tick| trace.sample(*tick, value(*tick))).count();
        assert_eq!(full, 1);
        let stands = info(&trace);
        assert!(stands.complete);
        assert_eq!(stands.records as usize, TRACE_CAPACITY / 3);
        let all = read_all(&trace);
        assert_eq!(all.len(), TRACE_CAPACITY / 3 * 3);
        assert_eq!(all[..6], [0.0, 0.5, 0.0, 2.0, 2.5, 2.0]);
    }

    #[test]
    fn until_a_fault_it_keeps_the_last_records_in_order() {
        let mut trace = arm(Trigger::UntilFault, 1);
        for tick in 0..1000 {
            trace.sample(tick, value(tick));
        }
        trace.on_fault();
        assert!(!info(&trace).complete, "the tick of the fault is still to come");
        trace.sample(1000, value(1000));
        trace.sample(1001, value(1001));
        let all = read_all(&trace);
        let room = TRACE_CAPACITY / 3;
        assert_eq!(all.len(), room * 3);
        assert_eq!(all[0], (1001 - room) as f32);
        assert_eq!(info(&trace).first_tick, (1001 - room) as u64);
        assert_eq!(all[all.len() - 3], 1000.0);
    }

    #[test]
    fn a_table_that_takes_its_room_ends_and_forgets_it() {
        let mut trace = arm(Trigger::UntilFault, 1);
        trace.sample(0, value(0));
        let mut room = trace.lend().expect("there");
        room.clear_for_table();
        room.table().expect("a table's").image.push(7).expect("room");
        assert!(trace.lend().is_none());
        assert!(!trace.sample(1, value(1)));
        trace.on_fault();
        assert_eq!((info(&trace).complete, info(&trace).records), (false, 0));
        trace.take_back(room);
        assert!(!trace.sample(2, value(2)), "not before it is armed again");
        let variables = [Variable::Force].into_iter().collect();
        assert_eq!(trace.arm(&TraceArm { variables, every_ticks: 1, trigger: Trigger::Now }), Ok(()));
        assert_eq!((3..5000).filter(|tick| trace.sample(*tick, value(*tick))).count(), 1);
        let mut piece = TracePiece::default();
        assert_eq!(trace.read(0, &mut piece), Ok(()));
        assert_eq!(piece.values[..2], [3.5, 4.5]);
    }

    #[test]
    fn it_waits_for_a_start() {
        let mut trace = arm(Trigger::Start, 1);
        trace.sample(0, value(0));
        assert_eq!(info(&trace).records, 0);
        trace.on_start();
        trace.sample(1, value(1));
        assert_eq!((info(&trace).records, info(&trace).first_tick), (1, 1));
        assert_eq!(trace.read(0, &mut TracePiece::default()), Err(Refusal::Range), "still recording");
    }
}
