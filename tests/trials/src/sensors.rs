//! Spoiled files: sensors that freeze, saturate, die or drop out, wrong units, signs and zeros, put into one recording of a clean
//! campaign of the virtual bench. Asked: is the recording found, and only that one?

use crate::binomial_interval::interval;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::sensor_faults::Channel;
use pam_data::recording::{Campaign, Recording};
use rayon::prelude::*;
use std::error::Error;
use std::fmt::Write;
use std::ops::Range;
use std::path::PathBuf;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::Muscle;
use virtual_bench::presets;
use virtual_bench::rng::Rng;

/// How many campaigns, and where the page goes.
#[derive(clap::Args)]
pub struct Sensors {
    /// Clean campaigns; each is spoiled once in every way.
    #[arg(long, default_value_t = 30)]
    n: u64,
    /// The seed of the first campaign.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the table as this page of the book.
    #[arg(long)]
    page: Option<PathBuf>,
    /// Fail where a bound is missed.
    #[arg(long)]
    check: bool,
    /// Print the seeds of missed and falsely accused files.
    #[arg(long)]
    seeds: bool,
}

/// Spoiled files of a kind that must be found.
const FOUND: f64 = 0.95;

/// A way to spoil a file.
struct Way {
    name: &'static str,
    channel: Channel,
    /// The protocol: loops at constant pressures, or pressure staircases at held lengths.
    protocol: &'static str,
    /// Spoils the readings; `rows` are those of the failure.
    spoil: fn(&mut [f64], Range<usize>),
    /// Whether the bound holds for it. Wrong units, signs and zeros are found from the agreement with the other files alone, which a file
    /// at the edge of the tested pressures does not determine.
    bounded: bool,
}

fn freeze(column: &mut [f64], rows: Range<usize>) {
    let value = column[rows.start];
    column[rows].fill(value);
}

fn lose(column: &mut [f64], rows: Range<usize>) {
    column[rows.start..rows.start + 20].fill(0.0);
}

/// Single readings that are too high by half to twice the column's largest.
fn spikes(column: &mut [f64], rows: Range<usize>) {
    let largest = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for (k, row) in rows.step_by(100).enumerate() {
        column[row] += largest * [0.5, 1.0, 2.0][k % 3];
    }
}

fn cut(column: &mut [f64], _: Range<usize>) {
    let largest = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    column.iter_mut().for_each(|v| *v = v.min(0.6 * largest));
}

fn kill(column: &mut [f64], _: Range<usize>) {
    column.fill(0.0);
}

fn unit(column: &mut [f64], factor: f64) {
    column.iter_mut().for_each(|v| *v *= factor);
}

const WAYS: [Way; 21] = [
    Way { name: "frozen for 500 rows", channel: Channel::Force, protocol: "A", spoil: freeze, bounded: true },
    Way {
        name: "frozen for 500 rows",
        channel: Channel::Stroke,
        protocol: "A",
        spoil: freeze,
        bounded: true,
    },
    Way {
        name: "frozen for 500 rows",
        channel: Channel::Pressure,
        protocol: "staircase",
        spoil: freeze,
        bounded: true,
    },
    Way { name: "saturated at 60 %", channel: Channel::Force, protocol: "A", spoil: cut, bounded: true },
    Way { name: "saturated at 60 %", channel: Channel::Stroke, protocol: "A", spoil: cut, bounded: true },
    Way {
        name: "saturated at 60 %",
        channel: Channel::Pressure,
        protocol: "staircase",
        spoil: cut,
        bounded: true,
    },
    Way { name: "zero in one file", channel: Channel::Force, protocol: "A", spoil: kill, bounded: true },
    Way { name: "zero in one file", channel: Channel::Stroke, protocol: "A", spoil: kill, bounded: true },
    Way { name: "zero in one file", channel: Channel::Pressure, protocol: "A", spoil: kill, bounded: true },
    Way { name: "drop-out of 20 rows", channel: Channel::Force, protocol: "A", spoil: lose, bounded: true },
    Way { name: "drop-out of 20 rows", channel: Channel::Stroke, protocol: "A", spoil: lose, bounded: true },
    Way {
        name: "drop-out of 20 rows",
        channel: Channel::Pressure,
        protocol: "A",
        spoil: lose,
        bounded: true,
    },
    Way { name: "five spikes", channel: Channel::Pressure, protocol: "A", spoil: spikes, bounded: true },
    Way {
        name: "five spikes",
        channel: Channel::Pressure,
        protocol: "staircase",
        spoil: spikes,
        bounded: true,
    },
    Way { name: "five spikes", channel: Channel::Stroke, protocol: "A", spoil: spikes, bounded: true },
    Way {
        name: "lbf for N",
        channel: Channel::Force,
        protocol: "A",
        spoil: |c, _| unit(c, 1.0 / 4.448_222),
        bounded: false,
    },
    Way {
        name: "inches for mm",
        channel: Channel::Stroke,
        protocol: "A",
        spoil: |c, _| unit(c, 1.0 / 25.4),
        bounded: false,
    },
    Way {
        name: "psi for kPa",
        channel: Channel::Pressure,
        protocol: "A",
        spoil: |c, _| unit(c, 1.0 / 6.894_757),
        bounded: false,
    },
    Way {
        name: "opposite sign",
        channel: Channel::Force,
        protocol: "A",
        spoil: |c, _| unit(c, -1.0),
        bounded: false,
    },
    Way {
        name: "opposite sign",
        channel: Channel::Stroke,
        protocol: "A",
        spoil: |c, _| unit(c, -1.0),
        bounded: false,
    },
    Way {
        name: "absolute for gauge",
        channel: Channel::Pressure,
        protocol: "A",
        spoil: |c, _| c.iter_mut().for_each(|p| *p += 101_325.0),
        bounded: false,
    },
];

/// A clean campaign of a random muscle.
fn clean(seed: u64, protocol: &str) -> Result<Campaign, String> {
    let spec = presets::random(seed);
    let muscle = Muscle::new(spec.clone());
    let levels = campaigns::levels(&muscle);
    let protocol = campaigns::by_name(protocol, &muscle, &levels, seed).ok_or("no such protocol")?;
    let files = Bench::new(&BenchSpec::laboratory(spec, seed)).run(&protocol).map_err(|e| e.to_string())?;
    let of = |f: &virtual_bench::recording::Recording| Recording {
        name: f.name.clone(),
        time: f.rows.iter().map(|r| r.time).collect(),
        pressure: f.rows.iter().map(|r| r.pressure).collect(),
        stroke: f.rows.iter().map(|r| r.stroke).collect(),
        force: Some(f.rows.iter().map(|r| r.force).collect()),
        ..Recording::default()
    };
    Ok(Campaign::new(files.iter().map(of).filter(|r| r.len() > 600).collect()))
}

/// The recordings in which something was found.
fn found(campaign: &Campaign) -> Vec<usize> {
    let screened = Screened::of(campaign);
    (0..campaign.recordings.len()).filter(|i| screened.read(*i).contains(&false)).collect()
}

/// What came of one spoiled campaign.
#[derive(Clone, Copy, Default)]
struct Outcome {
    found: bool,
    elsewhere: bool,
}

fn column(recording: &mut Recording, channel: Channel) -> &mut [f64] {
    match channel {
        Channel::Pressure => &mut recording.pressure,
        Channel::Stroke => &mut recording.stroke,
        Channel::Force => recording.force.as_deref_mut().unwrap_or(&mut []),
    }
}

/// Where a failure begins: the muscle pulls with a fifth of the largest force at least, and so that a drop-out to zero is none, the reading
/// is a tenth of the column's largest at least. What reads the same with and without a failure cannot be found.
fn place(campaign: &Campaign, file: usize, channel: Channel, rng: &mut Rng) -> usize {
    let largest = |c: Channel| {
        let all = campaign.recordings.iter().flat_map(|r| c.of(r).iter().copied());
        all.fold(0.0_f64, |m, v| m.max(v.abs()))
    };
    let (force, column) = (largest(Channel::Force), largest(channel));
    let r = &campaign.recordings[file];
    let plain = |i: &usize| Channel::Force.of(r)[*i] > 0.2 * force && channel.of(r)[*i].abs() > 0.1 * column;
    let room = 5..r.len().saturating_sub(505);
    let places: Vec<usize> = room.clone().filter(plain).collect();
    if places.is_empty() { room.start } else { places[rng.index(places.len())] }
}

fn trial(way: &Way, campaign: &Campaign, seed: u64) -> Outcome {
    let mut spoiled = campaign.clone();
    let mut rng = Rng::stream(seed, way.name);
    let file = rng.index(spoiled.recordings.len());
    let start = place(&spoiled, file, way.channel, &mut rng);
    let recording = &mut spoiled.recordings[file];
    (way.spoil)(column(recording, way.channel), start..start + 500);
    let found = found(&spoiled);
    Outcome { found: found.contains(&file), elsewhere: found.iter().any(|i| *i != file) }
}

/// Runs all trials, prints their table, and writes the page.
///
/// # Errors
/// A bench that cannot run, a page that cannot be written, or with `--check` a missed bound.
pub fn run(what: &Sensors) -> Result<(), Box<dyn Error>> {
    let cases: Vec<(Vec<Outcome>, [bool; 2])> = (what.seed..what.seed + what.n)
        .into_par_iter()
        .map(|seed| {
            let loops = clean(seed, "A")?;
            let stairs = clean(seed, "staircase")?;
            let of = |way: &Way| trial(way, if way.protocol == "A" { &loops } else { &stairs }, seed);
            Ok((WAYS.iter().map(of).collect(), [!found(&loops).is_empty(), !found(&stairs).is_empty()]))
        })
        .collect::<Result<_, String>>()?;
    let n = cases.len();
    let percent = |k: usize, n: usize| {
        let (low, high) = interval(k, n);
        format!("{:.0} % ({:.0} to {:.0})", 100.0 * k as f64 / n.max(1) as f64, 100.0 * low, 100.0 * high)
    };
    let mut table = "| failure | column | campaign | n | found | another file accused | bound |\n| --- | --- | --- | --- | --- | --- | --- |\n".to_owned();
    let mut missed = Vec::new();
    for (k, way) in WAYS.iter().enumerate() {
        let hits = cases.iter().filter(|c| c.0[k].found).count();
        let others = cases.iter().filter(|c| c.0[k].elsewhere).count();
        let held = hits as f64 >= FOUND * n as f64;
        let campaign = if way.protocol == "A" { "loops" } else { "staircases" };
        writeln!(
            table,
            "| {} | {} | {campaign} | {n} | {} | {} | {} |",
            way.name,
            way.channel.name(),
            percent(hits, n),
            percent(others, n),
            if held { "held" } else { "not held" }
        )?;
        if way.bounded && !held {
            missed.push(format!("{} {}: {hits} of {n}", way.channel.name(), way.name));
        }
    }
    if what.seeds {
        for (seed, case) in (what.seed..).zip(&cases) {
            let of = |(way, o): (&Way, &Outcome)| {
                (!o.found || o.elsewhere).then(|| format!("{} {}", way.channel.name(), way.name))
            };
            let bad: Vec<String> = WAYS.iter().zip(&case.0).filter_map(of).collect();
            println!("{seed}: {} clean {:?}", bad.join(", "), case.1);
        }
    }
    let false_alarms = cases.iter().flat_map(|c| c.1).filter(|found| *found).count();
    writeln!(
        table,
        "\nClean campaigns with a finding: {false_alarms} of {} ({}).",
        2 * n,
        percent(false_alarms, 2 * n)
    )?;
    println!("{table}");
    if let Some(page) = &what.page {
        std::fs::write(page, page_text(what, &table))?;
    }
    if what.check && !(missed.is_empty() && false_alarms == 0) {
        return Err(
            format!("missed bounds: {}; {false_alarms} clean campaigns accused", missed.join("; ")).into()
        );
    }
    Ok(())
}

fn page_text(what: &Sensors, table: &str) -> String {
    format!(
        "# Trials of failing sensors\n\nWritten by `cargo run --release -p trials -- sensors --n {} --seed {} --page \
         docs/src/proof-sensors.md`. Each row is one way to spoil one recording of a clean campaign of the virtual bench (random \
         muscles; six files of loops, or three staircases at held lengths). \"Found\": rows of that recording are excluded before \
         anything is fitted or diagnosed, and the message names file and rows. \"Another file accused\": rows of a clean recording are \
         excluded. Rates with exact 95 % intervals. Bound set in advance: 95 % found, no clean campaign accused.\n\n{table}",
        what.n, what.seed
    )
}
