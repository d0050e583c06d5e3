//! Import descriptions by guess: times in several columns, dates beside times of day, and clocks that disagree.
#![allow(clippy::unwrap_used)] // what fails here fails the test

mod described_files;

use std::fmt::Write;

use described_files::{DescribedFiles, describe};
use pam_data::recording::import_guess::{Guess, guess_among};
use pam_data::recording::{Campaign, Reader};

/// Rows of a slow stroke; `time` makes the first cells of a row from its time in s.
fn rows(begin_s: f64, time: impl Fn(f64) -> String) -> String {
    (0..40).fold(String::new(), |mut text, i| {
        let x = 4.0 * (1.0 - (f64::from(i) / 20.0 - 1.0).abs());
        let t = begin_s + 0.25 * f64::from(i);
        writeln!(text, "{},300,{x:.3},{:.3}", time(t), 90.0 - 20.0 * x).unwrap();
        text
    })
}

fn read(files: &[(&str, String)]) -> (Guess, Campaign) {
    let DescribedFiles { guess, import, paths, .. } = &describe(files);
    let campaign = Reader::new().import(Some(import)).campaign(paths);
    (guess.clone(), campaign.unwrap_or_else(|e| panic!("{}: {e}", guess.description)))
}

fn unknown(text: String) -> String {
    let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
    std::fs::write(&file, text).unwrap();
    let guessed = guess_among(file.path(), &[], None).unwrap();
    assert!(!guessed.description.contains("\n[columns.time]"), "{}", guessed.description);
    guessed.all_unknown()
}

/// The time of day with whole seconds, of s since midnight.
fn clock(t: f64) -> String {
    let s = t as u32;
    format!("{:02}:{:02}:{:02}", s / 3600 % 24, s / 60 % 60, s % 60)
}

const DAY: f64 = 86_400.0;
const QUANTITIES: &str = "Pressure (kPa),Stroke (mm),Force (N)\n";

#[test]
fn milliseconds_beside_a_time_of_day_belong_to_it() {
    let cells = |t: f64| format!("{},{:.0}", clock(t), 1e3 * t.fract());
    for (above, date) in [("", ""), ("Date,", "2024-03-12,")] {
        let text = format!("{above}Time,Milliseconds,{QUANTITIES}")
            + &rows(86_100.0, |t| format!("{date}{}", cells(t)));
        let (guess, campaign) = read(&[("a.csv", text)]);
        assert_eq!((campaign.recordings.len(), guess.split_by.len()), (1, 0), "{}", guess.description);
        let time = &campaign.recordings[0].time;
        assert!(time.windows(2).all(|t| (t[1] - t[0] - 0.25).abs() < 1e-6), "{time:?}");
        assert!(guess.checks.iter().any(|c| c.text().contains("with")), "{:?}", guess.checks);
    }
}

#[test]
fn milliseconds_beside_whole_seconds_belong_to_them() {
    let text = format!("Time (s),ms,{QUANTITIES}")
        + &rows(3.0, |t| format!("{:.0},{:.0}", t.floor(), 1e3 * t.fract()));
    let (guess, campaign) = read(&[("a.csv", text)]);
    assert_eq!(campaign.recordings[0].time[..3], [3.0, 3.25, 3.5], "{}", guess.description);
}

#[test]
fn a_coarse_time_of_day_sets_no_runs_apart() {
    // A counter that begins again with each second, but in steps of its own.
    let text = format!("Time,Tick (ms),{QUANTITIES}")
        + &rows(36_000.0, |t| format!("{},{:.0}", clock(t), 4e3 * t.fract()));
    let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
    std::fs::write(&file, text).unwrap();
    let guessed = guess_among(file.path(), &[], None).unwrap();
    assert!(guessed.split_by.is_empty() && !guessed.unknown.is_empty(), "{}", guessed.description);
}

#[test]
fn the_date_beside_a_time_of_day_orders_files() {
    let of_day = |date: &'static str, begin: f64| {
        format!("Date,Time,{QUANTITIES}")
            + &rows(begin, |t| format!("{date},{}.{:03.0}", clock(t), 1e3 * t.fract()))
    };
    for dates in [["2024-03-12", "2024-03-13"], ["12.03.2024", "13.03.2024"], ["03/12/2024", "03/13/2024"]] {
        let files = [("a.csv", of_day(dates[0], 50_000.0)), ("b.csv", of_day(dates[1], 40_000.0))];
        let (guess, campaign) = read(&files);
        let names: Vec<&str> = campaign.recordings.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["a", "b"], "{}", guess.description);
        let pause = campaign.pause_before(1).unwrap();
        assert!((pause - (DAY - 10_000.0 - 9.75)).abs() < 1e-3, "{pause} {}", guess.description);
    }
}

#[test]
fn a_date_that_changes_at_midnight_is_read_with_its_time_of_day() {
    let date = |t: f64| if t < DAY { "2024-03-12" } else { "2024-03-13" };
    let text = format!("Date,Time,{QUANTITIES}")
        + &rows(DAY - 5.0, |t| format!("{},{}.{:03.0}", date(t), clock(t), 1e3 * t.fract()));
    let (guess, campaign) = read(&[("a.csv", text)]);
    let time = &campaign.recordings[0].time;
    assert!((time[39] - time[0] - 9.75).abs() < 1e-3 && time[0] > 1e9, "{}", guess.description);
}

#[test]
fn times_of_day_without_a_date_keep_the_given_order() {
    let file = |begin: f64| {
        format!("Time,{QUANTITIES}") + &rows(begin, |t| format!("{}.{:03.0}", clock(t), 1e3 * t.fract()))
    };
    let (_, campaign) =
        read(&[("a.csv", file(50_000.0)), ("b.csv", file(40_000.0)), ("c.csv", file(41_000.0))]);
    let names: Vec<&str> = campaign.recordings.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["a", "b", "c"]);
    assert!((campaign.pause_before(1).unwrap() - (DAY - 10_000.0 - 9.75)).abs() < 1e-6);
    assert!((campaign.pause_before(2).unwrap() - (1000.0 - 9.75)).abs() < 1e-6);
    assert!(campaign.warnings.iter().any(|w| w.contains("earlier in `b`")), "{:?}", campaign.warnings);
    // The same rows twice are not those of two days.
    let (_, campaign) = read(&[("a.csv", file(50_000.0)), ("b.csv", file(50_000.0))]);
    assert!(campaign.warnings.iter().any(|w| w.contains("hold the same rows")), "{:?}", campaign.warnings);
}

#[test]
fn columns_of_time_that_disagree_are_not_chosen_from() {
    let text = |shift: f64| {
        let cells = rows(0.0, |t| format!("{t},{}", t + shift));
        let swapped = cells.lines().map(|row| {
            let c: Vec<&str> = row.split(',').collect();
            format!("{},{},{},{},{},{}\n", c[0], c[2], c[1], c[3], c[0], c[4])
        });
        "Time_p (s),Pressure (kPa),Time_x (s),Stroke (mm),Time_F (s),Force (N)\n".to_owned()
            + &swapped.collect::<String>()
    };
    let found = unknown(text(1.25));
    assert!(found.contains("Time_p (s), Time_x (s), Time_F (s) hold different times"), "{found}");
    // The same times, and the seconds since 1970 of another clock, are no doubt.
    for shift in [0.0, 1.7e9] {
        assert_eq!(read(&[("a.csv", text(shift))]).1.recordings[0].time[1], 0.25);
    }
}

#[test]
fn days_of_spreadsheets_and_of_matlab_count_from_1970() {
    // 2024-03-12 10:00, by `date -u -d 2024-03-12T10:00 +%s`.
    let start = 1_710_237_600.0;
    for days in [25_569.0, 719_529.0] {
        let text = format!("Date,{QUANTITIES}") + &rows(0.0, |t| format!("{:.10}", days + (start + t) / DAY));
        let (guess, campaign) = read(&[("a.csv", text)]);
        let time = &campaign.recordings[0].time;
        assert!(
            (time[0] - start).abs() < 1e-4 && (time[3] - time[0] - 0.75).abs() < 1e-4,
            "{}",
            guess.description
        );
    }
}

#[test]
fn a_sampling_rate_above_a_table_without_times_is_taken() {
    for (line, interval) in [("Sampling rate [Hz]: 40", 0.025), ("Abtastrate;2,5;kHz", 0.0004)] {
        let text = format!("{line}\n{QUANTITIES}") + &rows(0.0, |_| "x".into()).replace("x,", "");
        let (guess, campaign) = read(&[("a.csv", text)]);
        assert!((campaign.recordings[0].time[1] - interval).abs() < 1e-12, "{}", guess.description);
        assert!(guess.unknown.is_empty() && !guess.checks.is_empty(), "{:?}", guess.unknown);
    }
}
