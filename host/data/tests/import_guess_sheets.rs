//! Import descriptions by guess, of files that were put together by hand or by a logger: several runs, clocks, signs of thousands, remarks.
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::fmt::Write;

use pam_data::error::Error;
use pam_data::recording::import_guess::{Guess, guess};
use pam_data::recording::{Import, Reader, Recording};

type Read = (Guess, Result<Vec<Recording>, Error>);

/// Reads a file by the description that it gives.
fn read(text: &str) -> Read {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bench.csv");
    std::fs::write(&path, text).unwrap();
    let guess = guess(&path, None).unwrap();
    let import = Import::parse(&guess.description).unwrap_or_else(|e| panic!("{}: {e}", guess.description));
    let recordings = Reader::with_rest_length(0.2).import(Some(&import)).file(&path);
    (guess, recordings)
}

fn recordings(text: &str) -> (Guess, Vec<Recording>) {
    let (guess, recordings) = read(text);
    let recordings = recordings.unwrap_or_else(|e| panic!("{e}\n{}", guess.description));
    (guess, recordings)
}

const ROWS: u32 = 40;
const HEADER: &str = "time_s,pressure_kPa,displacement_mm,force_N\n";

/// Rows of a slow stroke: s, kPa, mm, N. The pressure has noise, so that it is not a label.
fn rows(begin_s: f64, kpa: f64) -> Vec<[f64; 4]> {
    (0..ROWS)
        .map(|i| {
            let x = 4.0 * (1.0 - (f64::from(i) / 20.0 - 1.0).abs());
            [begin_s + 0.05 * f64::from(i), kpa + 0.01 * f64::from(i % 7), x, 0.3 * kpa - 20.0 * x]
        })
        .collect()
}

fn lines(rows: &[[f64; 4]], line: impl Fn([f64; 4]) -> String) -> String {
    rows.iter().fold(String::new(), |mut text, row| {
        writeln!(text, "{}", line(*row)).unwrap();
        text
    })
}

fn plain([t, p, x, f]: [f64; 4]) -> String {
    format!("{t:.2},{p:.3},{x:.3},{f:.3}")
}

fn lengths(recordings: &[Recording]) -> Vec<usize> {
    recordings.iter().map(Recording::len).collect()
}

/// Whether the rows are those of `rows(0.0, kpa)`.
fn same(recording: &Recording, kpa: f64) {
    let expected = rows(0.0, kpa);
    assert_eq!(recording.len(), expected.len());
    let begin = recording.time[0];
    for (i, [t, p, x, f]) in expected.iter().enumerate() {
        assert!((recording.time[i] - begin - t).abs() < 1e-6, "time {i}: {}", recording.time[i]);
        assert!((recording.pressure[i] - 1e3 * p).abs() < 1.0, "pressure {i}: {}", recording.pressure[i]);
        assert!((recording.stroke[i] - 1e-3 * x).abs() < 1e-6, "stroke {i}: {}", recording.stroke[i]);
        assert!((recording.force.as_ref().unwrap()[i] - f).abs() < 1e-2, "force {i}");
    }
}

#[test]
fn a_clock_that_begins_again_begins_a_recording() {
    let run = |kpa| lines(&rows(0.0, kpa), plain);
    let (guess, read) = recordings(&format!("{HEADER}{}{}\n{}", run(300.0), run(300.0), run(500.0)));
    assert_eq!(lengths(&read), [40, 40, 40], "{}", guess.description);
    same(&read[1], 300.0);
    same(&read[2], 500.0);
    assert!(guess.checks.iter().any(|c| c.text().contains("begins again at 2 rows")), "{:?}", guess.checks);
    // Rows that are there twice, or a clock that jumps back a little, are not runs.
    let twice = format!("{HEADER}{}{}", run(300.0), lines(&rows(1.95, 300.0), plain));
    assert!(self::read(&twice).1.is_err());
    let back = format!("{HEADER}{}{}", run(300.0), lines(&rows(1.5, 300.0), plain));
    assert!(self::read(&back).1.is_err());
}

fn time_of_day(seconds: f64) -> String {
    let t = (seconds * 100.0).round() / 100.0 % 86_400.0;
    format!("{:02}:{:02}:{:05.2}", (t / 3600.0) as u32, (t / 60.0) as u32 % 60, t % 60.0)
}

fn with_mark(seconds: f64) -> String {
    let hour = (seconds / 3600.0) as u32 % 24;
    let rest = &time_of_day(seconds)[2..];
    format!("{}{rest} {}", (hour + 11) % 12 + 1, if hour < 12 { "AM" } else { "PM" })
}

#[test]
fn a_time_of_day_continues_past_midnight() {
    let header = "time,pressure_kPa,displacement_mm,force_N\n";
    for stamp in [time_of_day, with_mark] {
        let text = lines(&rows(86_399.0, 300.0), |[t, p, x, f]| format!("{},{p},{x},{f}", stamp(t)));
        let (guess, read) = recordings(&format!("{header}{text}"));
        same(&read[0], 300.0);
        assert!(guess.checks.iter().any(|c| c.text().contains("passes midnight")), "{:?}", guess.checks);
    }
    // Beside a column of the date.
    let text = lines(&rows(86_399.0, 300.0), |[t, p, x, f]| {
        format!("2026-11-{},{},{p},{x},{f}", if t < 86_400.0 { 21 } else { 22 }, time_of_day(t))
    });
    let (_, read) = recordings(&format!("date,{header}{text}"));
    assert_eq!(lengths(&read), [40]);
    same(&read[0], 300.0);
    // From the evening back to noon is no midnight.
    let evening = lines(&rows(80_000.0, 300.0), |[t, p, x, f]| format!("{},{p},{x},{f}", time_of_day(t)));
    let noon = lines(&rows(43_200.0, 300.0), |[t, p, x, f]| format!("{},{p},{x},{f}", time_of_day(t)));
    assert!(self::read(&format!("{header}{evening}{noon}")).1.is_err());
}

#[test]
fn dates_with_slashes_are_read_where_their_order_is_known() {
    let file = |date: &dyn Fn(f64) -> String| {
        let text = lines(&rows(86_399.0, 300.0), |[t, p, x, f]| format!("{},{p},{x},{f}", date(t)));
        format!("timestamp,pressure_kPa,displacement_mm,force_N\n{text}")
    };
    let day = |t: f64| u32::from(t >= 86_400.0);
    /// s since 1970, `date -u -d 2026-11-21T23:59:59Z +%s`, and of 2026-03-04.
    const NOVEMBER: f64 = 1_795_305_599.0;
    const MARCH: f64 = 1_772_668_799.0;
    let clear: [(&dyn Fn(f64) -> String, f64); 6] = [
        (&|t| format!("11/{}/2026 {}", 21 + day(t), with_mark(t)), NOVEMBER),
        (&|t| format!("11/{}/26 {}", 21 + day(t), with_mark(t)), NOVEMBER),
        (&|t| format!("11/{}/2026 {}", 21 + day(t), time_of_day(t)), NOVEMBER),
        (&|t| format!("{}/11/2026 {}", 21 + day(t), time_of_day(t)), NOVEMBER),
        // Only the day changes at midnight.
        (&|t| format!("3/{}/2026 {}", 4 + day(t), time_of_day(t)), MARCH),
        (&|t| format!("{}/03/2026 {}", 4 + day(t), time_of_day(t)), MARCH),
    ];
    for (n, (date, begin)) in clear.iter().enumerate() {
        let (guess, read) = recordings(&file(date));
        same(&read[0], 300.0);
        assert_eq!(read[0].time[0], *begin, "{n} {}", guess.description);
        assert!(guess.checks.iter().any(|c| c.text().contains("first")), "{n} {:?}", guess.checks);
    }
    // One day, which may be in March or in April.
    let (guess, read) = self::read(&file(&|t| format!("3/4/2026 {}", time_of_day(t - 40_000.0))));
    assert!(read.is_err());
    let unknown = guess.all_unknown();
    assert!(unknown.contains("timestamp-month-first") && unknown.contains("3/4/2026"), "{unknown}");
}

/// A number with separators of thousands: `sign` between groups, then `point`.
fn grouped(value: f64, decimals: usize, sign: &str, point: &str) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let mut out = String::new();
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            out += sign;
        }
        out.push(digit);
    }
    let minus = if value < 0.0 { "-" } else { "" };
    if decimals == 0 { format!("{minus}{out}") } else { format!("{minus}{out}{point}{fraction}") }
}

#[test]
fn separators_of_thousands_are_read_where_they_are_known() {
    let file = |delimiter: &str, sign: &str, point: &str, quote: &str| {
        let names = ["time_s", "pressure_Pa", "displacement_mm", "force_N"].join(delimiter);
        let text = lines(&rows(0.0, 300.0), |[t, p, x, f]| {
            let pressure = format!("{quote}{}{quote}", grouped(1e3 * p, 1, sign, point));
            let number = |v: f64| format!("{v:.4}").replace('.', point);
            [number(t), pressure, number(x), number(f)].join(delimiter)
        });
        format!("{names}\n{text}")
    };
    let known = [
        (",", ",", ".", "\""),
        (";", ",", ".", ""),
        ("\t", ",", ".", ""),
        (";", ".", ",", ""),
        ("\t", ".", ",", ""),
        (";", " ", ",", ""),
        (";", "\u{a0}", ",", ""),
        (";", "\u{202f}", ",", ""),
        (";", "'", ".", ""),
        (";", "\u{2019}", ".", ""),
    ];
    for form in known {
        let (delimiter, sign, point, quote) = form;
        let (guess, read) = recordings(&file(delimiter, sign, point, quote));
        same(&read[0], 300.0);
        assert!(guess.description.contains("thousands = "), "{form:?} {}", guess.description);
    }
    // `300.000` beside decimal commas is 300000 or, from another program, 300: neither is taken.
    for (delimiter, sign, point) in [(";", ".", ","), ("\t", ",", ".")] {
        let names = ["time_s", "pressure_Pa", "displacement_mm", "force_N"].join(delimiter);
        let text = lines(&rows(0.0, 300.0), |[t, p, x, f]| {
            let number = |v: f64| format!("{v:.4}").replace('.', point);
            [number(t), grouped(1e3 * p, 0, sign, point), number(x), number(f)].join(delimiter)
        });
        let (guess, read) = self::read(&format!("{names}\n{text}"));
        assert!(read.is_err());
        let unknown = guess.all_unknown();
        assert!(unknown.contains("pressure_Pa") && unknown.contains("thousands = "), "{unknown}");
        // With the separator given, they are.
        let import = format!("delimiter = \"{delimiter}\"\nthousands = \"{sign}\"\n");
        let decimal = if point == "," { "decimal = \"comma\"\n" } else { "" };
        let import = Import::parse(&(import + decimal).replace('\t', "\\t")).unwrap();
        let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
        std::fs::write(file.path(), format!("{names}\n{text}")).unwrap();
        same(&Reader::new().import(Some(&import)).file(file.path()).unwrap()[0], 300.0);
    }
    // Groups of two digits are not thousands.
    let import = Import::parse("delimiter = \"semicolon\"\nthousands = \",\"\n").unwrap();
    let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
    let text = lines(&rows(0.0, 300.0), |[t, _, x, f]| format!("{t:.2};3,00;{x:.3};{f:.3}"));
    std::fs::write(file.path(), format!("time_s;pressure_bar;displacement_mm;force_N\n{text}")).unwrap();
    let error = Reader::new().import(Some(&import)).file(file.path()).unwrap_err();
    assert!(error.to_string().contains("not a number"), "{error}");
}

#[test]
fn recordings_side_by_side_are_read_each() {
    let table = |begin: f64, n: f64| {
        let mut all = rows(begin, 100.0 * n);
        all.truncate(ROWS as usize);
        all
    };
    let beside = |gap: &str, left: &str, right: &str, short: usize| {
        let mut text = format!("{left}{gap},{right}\n");
        for (i, (a, b)) in table(0.0, 3.0).into_iter().zip(table(0.0, 5.0)).enumerate() {
            let b = if i + short < ROWS as usize { plain(b) } else { ",,,".to_owned() };
            writeln!(text, "{}{gap},{b}", plain(a)).unwrap();
        }
        text
    };
    let names = HEADER.trim_end();
    for (gap, above) in [("", ""), (",", ""), (",", "Run 1,,,,,Run 2,,,\n")] {
        let (guess, read) = recordings(&format!("{above}{}", beside(gap, names, names, 0)));
        assert_eq!(lengths(&read), [40, 40], "{}", guess.description);
        same(&read[0], 300.0);
        same(&read[1], 500.0);
        assert_ne!(read[0].name, read[1].name);
    }
    let numbered = |n: &str| names.split(',').map(|c| format!("{c}_{n}")).collect::<Vec<_>>().join(",");
    let (_, read) = recordings(&beside("", &numbered("1"), &numbered("2"), 0));
    same(&read[1], 500.0);
    // The second is shorter.
    let (guess, read) = recordings(&beside(",", names, names, 5));
    assert_eq!(lengths(&read), [40, 35], "{}", guess.description);
    // One time for both, or columns in another order: only the first is described, and the guess says so.
    let one_time = beside("", names, "pressure_kPa,displacement_mm,force_N,remark", 0);
    let other = beside("", names, "time_s,pressure_kPa,force_N,displacement_mm", 0);
    for text in [one_time, other] {
        let (guess, _) = self::read(&text);
        assert!(guess.unknown.iter().any(|u| u.text().contains("side by side")), "{:?}", guess.unknown);
    }
}

#[test]
fn remarks_among_the_rows_are_left_out() {
    let run = |begin| lines(&rows(begin, 300.0), plain);
    for remark in [
        "# valve closed",
        "  # valve, closed, here, again",
        "% valve closed",
        "; valve",
        "! a, b, c, d",
        "// valve",
    ] {
        let (guess, read) = recordings(&format!("{HEADER}{}{remark}\n{}", run(0.0), run(2.0)));
        assert_eq!(lengths(&read), [80], "{remark} {}", guess.description);
    }
    let (_, read) = recordings(&format!("% bench\n% no remark below\n{HEADER}{}% x\n{}", run(0.0), run(2.0)));
    assert_eq!(lengths(&read), [80]);
    // Without a sign, a remark may as well be a damaged row.
    let (_, read) = self::read(&format!("{HEADER}{}valve closed\n{}", run(0.0), run(2.0)));
    let error = read.unwrap_err();
    assert_eq!(error.place().line, Some(42), "{error}");
}

#[test]
fn names_that_stand_again_in_the_middle_are_left_out() {
    let run = |begin, kpa| lines(&rows(begin, kpa), plain);
    let units = "time,pressure,displacement,force\ns,kPa,mm,N\n";
    for header in [HEADER, units, "Bench 3\ntime_s,pressure_kPa,displacement_mm,force_N\n"] {
        let (guess, read) = recordings(&format!("{header}{}{header}{}", run(0.0, 300.0), run(2.0, 300.0)));
        assert_eq!(lengths(&read), [80], "{header} {}", guess.description);
        assert!(guess.checks.iter().any(|c| c.text().contains("repeated")), "{:?}", guess.checks);
        let (guess, read) = recordings(&format!("{header}{}\n{header}{}", run(0.0, 300.0), run(0.0, 500.0)));
        assert_eq!(lengths(&read), [40, 40], "{header} {}", guess.description);
        same(&read[1], 500.0);
    }
    let other = "time_s,pressure_kPa,force_N,displacement_mm\n";
    let (guess, read) = self::read(&format!("{HEADER}{}{other}{}", run(0.0, 300.0), run(2.0, 300.0)));
    let error = read.unwrap_err();
    assert_eq!(error.place().line, Some(42), "{error}");
    assert!(error.advice().is_some_and(|a| a.contains("another order")), "{error}");
    assert!(guess.unknown.iter().any(|u| u.text().contains("line 42")), "{:?}", guess.unknown);
}

#[test]
fn units_below_and_above_the_names_are_read() {
    let text = lines(&rows(0.0, 300.0), |[t, p, x, f]| format!("{},{},{},{f}", 1e3 * t, p / 100.0, x / 10.0));
    let names = "time,pressure,displacement,force\n";
    for header in [
        format!("{names}ms,bar,cm,N\n"),
        format!("{names}(ms),(bar),(cm),(N)\n"),
        format!("{names}[ms],[bar],[cm],[N]\n\n"),
        format!("{names}ai0,ai1,ai2,ai3\nms,bar,cm,N\n"),
        format!("ms,bar,cm,N\n{names}"),
    ] {
        let (_, read) = recordings(&format!("{header}{text}"));
        same(&read[0], 300.0);
    }
}

#[test]
fn marks_and_utf_16_and_decimal_commas_are_read() {
    let text = format!("{HEADER}{}", lines(&rows(0.0, 300.0), plain));
    let german = text.replace(',', ";").replace('.', ",");
    let utf_16 = |text: &str, big: bool| -> Vec<u8> {
        let bytes = |u: u16| if big { u.to_be_bytes() } else { u.to_le_bytes() };
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(bytes).collect()
    };
    let windows = text.replace('\n', "\r\n");
    let files: [Vec<u8>; 8] = [
        format!("\u{feff}{text}").into(),
        format!("\u{feff}sep=;\r\n{}", german.replace('\n', "\r\n")).into(),
        format!("\u{feff}# logger\n{text}").into(),
        utf_16(&text, false),
        utf_16(&german.replace(';', "\t"), true),
        utf_16(&windows, true),
        german.clone().into(),
        windows.into(),
    ];
    for (n, bytes) in files.iter().enumerate() {
        let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let guess = guess(file.path(), None).unwrap();
        let import = Import::parse(&guess.description).unwrap();
        same(&Reader::new().import(Some(&import)).file(file.path()).unwrap()[0], 300.0);
        assert!(guess.unknown.is_empty(), "{n} {:?}", guess.unknown);
    }
    let unmarked: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, cause) in [(unmarked, "UTF-16"), (text.replace('\n', "\r").into(), "carriage returns")] {
        let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let error = guess(file.path(), None).unwrap_err();
        assert!(error.to_string().contains(cause), "{error}");
    }
}
