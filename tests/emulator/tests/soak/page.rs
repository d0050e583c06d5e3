//! The page of the book about the soak.

use std::fmt::Write;
use std::path::Path;

use super::recording::Recorded;
use super::rig::Needs;

/// What happened with one kind of fault.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    times: u32,
    longest: u64,
    samples: u64,
    missing: u64,
}

impl Row {
    pub fn add(&mut self, ticks: u64, samples: u64, missing: u64) {
        self.times += 1;
        self.longest = self.longest.max(ticks);
        self.samples += samples;
        self.missing += missing;
    }
}

/// Everything that was measured.
#[derive(Debug)]
pub struct Figures {
    pub seconds: u64,
    pub seed: u64,
    pub ticks: u64,
    /// Programs that the line dropped because they did not read.
    pub dropped: u64,
    /// Of the program that records all the time.
    pub recordings: Recorded,
    /// Of the studio: early and at the end.
    pub needs: [Needs; 2],
    pub rows: Vec<(&'static str, u64, Row)>,
}

impl Figures {
    pub fn table(&self) -> String {
        let mut text = String::from(
            "| fault | times | longest time until vented, ms | bound, ms | samples recorded | missing and not reported |\n\
             | --- | ---: | ---: | ---: | ---: | ---: |\n",
        );
        for (words, within, row) in &self.rows {
            let Row { times, longest, samples, missing } = row;
            // A recording that misses more than it reports ends the test.
            let _ = writeln!(
                text,
                "| {words} | {times} | {longest} | {within} | {samples} | 0 (missing: {missing}) |"
            );
        }
        text
    }

    /// Writes the figures into the page, between its two marks.
    pub fn write(&self) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/soak.md");
        let text = std::fs::read_to_string(&path).expect("the page");
        let (begin, end) = ("<!-- figures -->", "<!-- end -->");
        let (before, rest) = text.split_once(begin).expect("a mark");
        let (_, after) = rest.split_once(end).expect("a mark");
        let [first, last] = self.needs;
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let Recorded { samples, missing, reported } = self.recordings;
        let body = format!(
            "{begin}\n\n{} s, {} ticks of the controller, seed {}.\n\n{}\n\
             - The program that recorded all the time: {samples} samples, {missing} missing, {reported} of them reported.\n\
             - Programs that did not read and were dropped by the line: {}.\n\
             - The studio, after five faults and at the end: {:.1} and {:.1} MiB, {} and {} open files, {} and {} threads.\n\n{end}",
            self.seconds,
            self.ticks,
            self.seed,
            self.table(),
            self.dropped,
            mib(first.memory),
            mib(last.memory),
            first.files,
            last.files,
            first.threads,
            last.threads,
        );
        std::fs::write(&path, format!("{before}{body}{after}")).expect("the page is written");
    }
}
