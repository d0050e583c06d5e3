//! The page of the book about interrupted campaigns.

use std::fmt::Write as _;

/// What is interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Process,
    Cable,
    Controller,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Process, Self::Cable, Self::Controller];

    const fn description(self) -> &'static str {
        match self {
            Self::Process => "SIGKILL to the program",
            Self::Cable => "serial cable pulled",
            Self::Controller => "SIGKILL to the emulated controller",
        }
    }
}

#[derive(Debug)]
struct Interruption {
    kind: Kind,
    under_pressure: bool,
    lost: usize,
    rows: usize,
    vented_s: f64,
}

/// What was seen.
#[derive(Debug, Default)]
pub struct Figures {
    all: Vec<Interruption>,
    pub campaigns: usize,
}

impl Figures {
    pub fn add(&mut self, kind: Kind, under_pressure: bool, lost: usize, rows: usize, vented_s: f64) {
        self.all.push(Interruption { kind, under_pressure, lost, rows, vented_s });
    }

    pub fn under_pressure(&self) -> usize {
        self.all.iter().filter(|i| i.under_pressure).count()
    }

    /// Writes the figures into the page, between its two marks.
    pub fn write(&self) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/interruptions.md");
        let text = std::fs::read_to_string(path).expect("the page");
        let (before, rest) = text.split_once("<!-- figures -->\n").expect("its first mark");
        let (_, after) = rest.split_once("<!-- end -->").expect("its second mark");
        let mut body = String::from(
            "| interruption | number | muscle under pressure then | rows recorded before it | rows lost | longest time until vented, device s |\n\
             | --- | --- | --- | --- | --- | --- |\n",
        );
        for kind in Kind::ALL {
            let of: Vec<&Interruption> = self.all.iter().filter(|i| i.kind == kind).collect();
            let longest = of.iter().map(|i| i.vented_s).fold(0.0, f64::max);
            let vented = match kind {
                Kind::Controller => "vented at its start".to_owned(),
                _ => format!("{longest:.1}"),
            };
            let _ = writeln!(
                body,
                "| {} | {} | {} | {} | {} | {vented} |",
                kind.description(),
                of.len(),
                of.iter().filter(|i| i.under_pressure).count(),
                of.iter().map(|i| i.rows).sum::<usize>(),
                of.iter().map(|i| i.lost).sum::<usize>(),
            );
        }
        let _ = writeln!(
            body,
            "\n{} interruptions; {} campaigns were completed in spite of them.",
            self.all.len(),
            self.campaigns
        );
        std::fs::write(path, format!("{before}<!-- figures -->\n{body}<!-- end -->{after}"))
            .expect("written");
    }
}
