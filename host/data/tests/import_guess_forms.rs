//! Import descriptions by guess: the same readings in forms of loggers and test machines, and pressures in names.
#![allow(clippy::unwrap_used)] // what fails here fails the test

mod described_files;

use std::fmt::Write as _;
use std::io::Write as _;

use described_files::{DescribedFiles, describe};
use pam_data::error::Error;
use pam_data::recording::import_guess::{Guess, guess_among};
use pam_data::recording::{Reader, Recording};

/// Reads files by the description that all of them give.
fn read(files: &[(&str, Vec<u8>)]) -> (Guess, Result<Vec<Recording>, Error>) {
    let DescribedFiles { guess, import, paths, .. } = &describe(files);
    let reader = Reader::with_rest_length(0.2).import(Some(import));
    let recordings: Result<Vec<_>, _> = paths.iter().map(|path| reader.file(path)).collect();
    (guess.clone(), recordings.map(|all| all.into_iter().flatten().collect()))
}

/// Rows of a slow stroke: s, kPa, mm, N.
fn stroke(line: impl Fn([f64; 4]) -> String) -> String {
    (0..40).fold(String::new(), |mut text, i| {
        let x = 4.0 * (1.0 - (f64::from(i) / 20.0 - 1.0).abs());
        writeln!(text, "{}", line([0.05 * f64::from(i), 300.0, x, 90.0 - 20.0 * x])).unwrap();
        text
    })
}

fn without_pressure() -> Vec<u8> {
    format!("time_s,displacement_mm,force_N\n{}", stroke(|[t, _, x, f]| format!("{t:.2},{x:.3},{f:.3}")))
        .into()
}

/// The pressures that are taken from names, kPa; an error is what was not understood.
fn pressures(names: &[&str]) -> Result<Vec<f64>, String> {
    let files: Vec<_> = names.iter().map(|name| (*name, without_pressure())).collect();
    let (guess, recordings) = read(&files);
    match recordings {
        Ok(all) => Ok(all.iter().map(|r| (r.pressure[0] * 1e-3).round()).collect()),
        Err(_) => Err(guess.all_unknown()),
    }
}

#[test]
fn a_pressure_in_a_name_is_read_with_every_decimal_sign() {
    let same = [
        ["loop_205kPa.csv", "loop_546kPa.csv"],
        ["loop_205_kPa_2.csv", "loop_546_kPa_2.csv"],
        ["01_205kpa.csv", "02_546kpa.csv"],
        ["P=0.205MPa.csv", "P=0.546MPa.csv"],
        ["2.05bar.csv", "5.46bar.csv"],
        ["a 2,05 Bar.csv", "a 5,46 Bar.csv"],
        ["loop2p05bar.csv", "loop5p46bar.csv"],
        ["a_2_05bar.csv", "a_5_46bar.csv"],
        ["a-2-05bar-1.csv", "a-5-46bar-1.csv"],
        ["loop_2_05bar.csv", "loop_5_46bar.csv"],
        ["supply700kPa_205kPa.csv", "supply700kPa_546kPa.csv"],
    ];
    for names in same {
        assert_eq!(pressures(&names), Ok(vec![205.0, 546.0]), "{names:?}");
    }
    for names in [
        ["run3_2bar.csv", "run4_5bar.csv"],
        ["01_2bar.csv", "02_5bar.csv"],
        ["2023-03-14_2bar.csv", "2023-03-15_5bar.csv"],
    ] {
        assert_eq!(pressures(&names), Ok(vec![200.0, 500.0]), "{names:?}");
    }
}

#[test]
fn a_pressure_in_a_name_that_may_be_two_numbers_is_not_taken() {
    let unclear = pressures(&["a_1_5bar.csv", "a_2_5bar.csv"]).unwrap_err();
    assert!(unclear.contains("may be 5 or 1.5 bar"), "{unclear}");
    let several = pressures(&["a_700kPa_205kPa.csv"]).unwrap_err();
    assert!(several.contains("several pressures (700, 205 kPa)"), "{several}");
    assert!(pressures(&["2050mbar.csv"]).unwrap_err().contains("no column of pressure"));
}

#[test]
fn a_line_above_the_table_is_taken_only_for_the_muscles_own_pressure() {
    let table = String::from_utf8(without_pressure()).unwrap();
    let with = |above: &str, name: &str| {
        let (guess, recordings) = read(&[(name, format!("{above}\n{table}").into())]);
        (guess.all_unknown(), recordings.ok().map(|r| r[0].pressure[0] * 1e-3))
    };
    assert_eq!(
        with("Supply pressure (bar),7\nAtmospheric pressure: 101.3 kPa\nTest pressure,300,kPa", "a.csv").1,
        Some(300.0)
    );
    assert_eq!(with("Supply pressure (bar),7", "a_300kPa.csv").1, Some(300.0));
    assert_eq!(with("Test pressure: 2.5 bar", "a_2.5bar.csv").1, Some(250.0));
    let (unknown, pressure) = with("Supply pressure: 7 bar", "a.csv");
    assert!(pressure.is_none() && unknown.contains("may not be the muscle's"), "{unknown}");
    let (unknown, pressure) = with("Test pressure: 2.5 bar", "a_300kPa.csv");
    assert!(pressure.is_none() && unknown.contains("250 kPa by the lines"), "{unknown}");
    let (unknown, pressure) = with("Test pressure: 2.5 bar\nPressure at the end: 5 bar", "a.csv");
    assert!(pressure.is_none() && unknown.contains("several pressures"), "{unknown}");
    // In millibar, which is another unit.
    assert_eq!(with("Pressure (mbar): 3000", "a_300kPa.csv").1, Some(300.0));
}

#[test]
fn cells_that_are_no_numbers_are_reported_and_nothing_replaces_their_column() {
    let rows = stroke(|[t, p, x, f]| format!("{t:.2}\t\"{p:.0},000\"\t{x:.3}\t{f:.3}"));
    let (guess, recordings) =
        read(&[("a_200kPa.txt", format!("t (s)\tp (Pa)\tx (mm)\tF (N)\n{rows}").into())]);
    let unknown = guess.all_unknown();
    assert!(
        unknown.contains("p (Pa) holds numbers such as") && unknown.contains("separators of thousands"),
        "{unknown}"
    );
    assert!(recordings.is_err() && guess.patterns.is_empty());
}

#[test]
fn older_programs_of_windows_write_signs_in_latin_1() {
    let rows = stroke(|[t, p, x, f]| format!("{:.0};{p};{:.0};{f:.3}", 1e6 * t, 1e3 * x));
    let text: Vec<u8> =
        format!("Zeit (µs);Überdruck (kPa);Weg (µm);Kraft (N)\n{rows}").chars().map(|c| c as u8).collect();
    let (guess, recordings) = read(&[("a.csv", text)]);
    let recordings = recordings.unwrap_or_else(|e| panic!("{} {e}", guess.description));
    assert!((recordings[0].time[39] - 1.95).abs() < 1e-9 && (recordings[0].stroke[20] - 4e-3).abs() < 1e-9);
    assert!((recordings[0].pressure[0] - 300e3).abs() < 1e-6, "{}", guess.description);
}

/// Without a description, a sign that was lost must not make a metre of a micrometre.
#[test]
fn the_first_sign_of_a_unit_is_never_left_out() {
    let rows = stroke(|[t, p, x, f]| format!("{:.0},{p},{x:.3},{f:.3}", 1e6 * t));
    for sign in [&b"\xb5"[..], "\u{fffd}".as_bytes(), "µ".as_bytes()] {
        let header = [b"Time (", sign, b"s),Pressure (kPa),Displacement (mm),Force (N)\n"].concat();
        let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
        std::fs::write(file.path(), [&header[..], rows.as_bytes()].concat()).unwrap();
        let error = Reader::new().file(file.path()).unwrap_err();
        assert!(error.to_string().contains("unknown unit"), "{error}");
    }
}

#[test]
fn loggers_of_labview_write_a_name_more_than_cells_and_units_above() {
    let header = "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\n\t\t\t\t\nChannels\t3\t\t\t\nY_Unit_Label\tbar\tmm\tN\t\n\
                X_Dimension\tTime\tTime\tTime\t\nX0\t0.0\t0.0\t0.0\t\n***End_of_Header***\t\t\t\t\nX_Value\tPressure\tStroke\tForce\tComment\n";
    let rows = stroke(|[t, p, x, f]| format!("{t:.2}\t{}\t{x:.3}\t{f:.3}", p / 100.0));
    let (guess, recordings) = read(&[("a_2bar.lvm", format!("{header}{rows}").into())]);
    let recording = &recordings.unwrap_or_else(|e| panic!("{} {e}", guess.description))[0];
    assert_eq!((recording.pressure[0], recording.len()), (300e3, 40), "{}", guess.description);
    assert!((recording.time[39] - 1.95).abs() < 1e-9 && (recording.stroke[20] - 4e-3).abs() < 1e-9);
}

#[test]
fn a_delimiter_behind_every_row_makes_no_column() {
    let rows = stroke(|[t, p, x, f]| format!("{t:.2},{p},{x:.3},{f:.3},"));
    let (guess, recordings) = read(&[("a.csv", format!("time (s),p (kPa),x (mm),F (N)\n{rows}").into())]);
    let recording = &recordings.unwrap_or_else(|e| panic!("{} {e}", guess.description))[0];
    assert!((recording.stroke[20] - 4e-3).abs() < 1e-9 && recording.pressure[0] == 300e3);
}

#[test]
fn a_stroke_that_is_short_beside_its_zero_is_moved_and_not_held() {
    let rows = |from: f64| stroke(|[t, p, x, f]| format!("{t:.2},{p},{:.4},{f:.3}", from + 0.1 * x));
    let file = |from| format!("time_s,pressure_kPa,position_mm,force_N\n{}", rows(from)).into_bytes();
    for files in [vec![("a.csv", file(50.0))], vec![("a.csv", file(50.0)), ("b.csv", file(50.0))]] {
        let (guess, recordings) = read(&files);
        let recording = &recordings.unwrap_or_else(|e| panic!("{} {e}", guess.description))[0];
        assert!(
            recording.stroke[0].abs() < 1e-9 && (recording.stroke[20] - 0.4e-3).abs() < 1e-9,
            "{}",
            guess.description
        );
    }
}

#[test]
fn lengths_that_are_held_with_the_noise_of_a_sensor_count_from_the_rest_length() {
    let file = |mm: f64| {
        let rows = (0..80).fold(String::new(), |mut text, i| {
            let (kpa, noise) =
                (100 + 10 * (40 - (i - 40_i32).abs()), 0.06 * (f64::from(7 * i % 13) / 6.0 - 1.0));
            writeln!(text, "{i},{kpa},{:.3},{}", mm + noise, 0.5 * f64::from(kpa) - 4.0 * mm).unwrap();
            text
        });
        format!("time_s,pressure_kPa,displacement_mm,force_N\n{rows}").into_bytes()
    };
    let (guess, recordings) = read(&[("a.csv", file(5.0)), ("b.csv", file(0.0)), ("c.csv", file(10.0))]);
    let means: Vec<f64> =
        recordings.unwrap().iter().map(|r| (1e3 * r.stroke.iter().sum::<f64>() / 80.0).round()).collect();
    assert_eq!(means, [5.0, 0.0, 10.0], "{}", guess.description);
}

#[test]
fn channels_are_distinguished_by_what_they_record() {
    // A second load cell that is not connected, a strain of the machine, channels that are numbered.
    let rows = stroke(|[t, p, x, f]| format!("{t:.2},{p},{x:.3},0,{f:.3}"));
    let (guess, recordings) =
        read(&[("a.csv", format!("time_s,pressure_kPa,stroke_mm,Force (N),Force 2 (N)\n{rows}").into())]);
    assert!(recordings.unwrap()[0].require_force().unwrap()[0] > 80.0, "{}", guess.description);
    let numbered = stroke(|[t, p, x, f]| format!("{t:.2},{x:.3},{f:.3},{p},0"));
    let (guess, _) =
        read(&[("a.csv", format!("t_s,Stroke_1,Load_1,Pressure_1,Pressure_2\n{numbered}").into())]);
    assert!(guess.columns.iter().any(|c| c.header == "Pressure_1"), "{}", guess.description);
    let lengthening = stroke(|[t, p, x, f]| format!("{t:.2},{p},{:.3},{f:.3}", 4.0 - x));
    let (guess, _) = read(&[("a.csv", format!("t_s,p_kPa,Strain (%),F_N\n{lengthening}").into())]);
    assert!(
        guess.unknown.iter().any(|u| u.text().contains("the force rises with it")),
        "{:?}",
        guess.unknown
    );
}

#[test]
fn of_two_pressures_the_one_that_differs_between_files_is_the_muscles() {
    let file = |kpa: f64| -> Vec<u8> {
        let rows =
            stroke(|[t, _, x, f]| format!("{t:.2},{:.1},{:.1},{x:.3},{f:.3}", 700.0 + 2.0 * t, kpa + t));
        format!("time_s,p1 (kPa),p2 (kPa),displacement_mm,force_N\n{rows}").into()
    };
    let (guess, recordings) = read(&[("a.csv", file(200.0)), ("b.csv", file(400.0))]);
    let pressures: Vec<f64> = recordings.unwrap().iter().map(|r| (r.pressure[0] * 1e-3).round()).collect();
    assert_eq!(pressures, [200.0, 400.0]);
    assert!(
        guess.checks.iter().any(|c| c.text().contains("p2 (kPa); p1 (kPa) could be meant")),
        "{:?}",
        guess.checks
    );
    // One file at one pressure shows neither.
    let (_, recordings) = read(&[("a.csv", file(200.0))]);
    assert_eq!((recordings.unwrap()[0].pressure[0] * 1e-3).round(), 700.0);
}

#[test]
fn missing_data_are_reported_with_the_right_remedy() {
    let unknown = |text: String| read(&[("a_300kPa.csv", text.into())]).0.all_unknown();
    let header = "time_s,pressure_kPa,displacement_mm,force_N\n";
    // Two sensors in rows of their own: leaving out incomplete rows leaves none.
    let rows = stroke(|[t, p, x, f]| format!("{t:.2},{p},,\n{:.2},,{x:.3},{f:.3}", t + 0.02));
    assert!(unknown(format!("{header}{rows}")).contains("no row has a number in every column"));
    let rows = stroke(|[t, p, x, f]| format!("{:.0},{p},{x:.3},{f:.3}", t.floor()));
    assert!(unknown(format!("{header}{rows}")).contains("coarser than the rows"));
    let rows = stroke(|[t, p, x, f]| {
        format!("{},{p},{x:.3},{f:.3}", (4_294_000_000 + (t * 1e6) as u64) % (1 << 32))
    });
    let wraps = unknown(format!("micros,pressure_kPa,displacement_mm,force_N\n{rows}"));
    assert!(wraps.contains("a counter of 32 bits overflowed after row 20"), "{wraps}");
    let rows = stroke(|[t, p, x, f]| format!("{t:.2},{p},{x:.3},{f:.3},{:.2},{p},{x:.3},{f:.3}", t + 0.3));
    let two = format!("Time_1,Press_1,Ext_1,Load_1,Time_2,Press_2,Ext_2,Load_2\n{rows}");
    assert_eq!(read(&[("a.csv", two.into())]).0.side_by_side, Some((2, 4)));
}

#[test]
fn a_rest_length_that_is_held_within_the_noise_of_a_sensor_is_no_stroke() {
    let rows = (0..40).fold(String::new(), |mut text, i| {
        let kpa = 100 + 10 * (20 - (i - 20_i32).abs());
        writeln!(text, "{i},{kpa},{:.4},{}", 0.001 * f64::from(i % 3 - 1), kpa / 2).unwrap();
        text
    });
    let file = format!("time_s,pressure_kPa,displacement_mm,force_N\n{rows}").into_bytes();
    let (guess, _) = read(&[("a.csv", file)]);
    assert!(!guess.description.contains("longest"), "{}", guess.description);
}

#[test]
fn units_without_a_name_are_taken_from_all_files() {
    let file = |bar: f64, mm: f64| {
        let rows = stroke(|[t, _, x, f]| format!("{t:.2},{bar},{:.4},{f:.3}", 0.25 * x * mm));
        format!("time,pressure,stroke,force\n{rows}").into_bytes()
    };
    let (guess, recordings) = read(&[("a.csv", file(0.5, 0.4)), ("b.csv", file(3.0, 6.0))]);
    let recordings = recordings.unwrap_or_else(|e| panic!("{} {e}", guess.description));
    assert_eq!(
        (recordings[0].pressure[0], recordings[1].pressure[0]),
        (50e3, 300e3),
        "{}",
        guess.description
    );
    assert!((recordings[1].stroke[20] - 6e-3).abs() < 1e-9, "{}", guess.description);
}

#[test]
fn files_with_other_places_or_units_are_refused_where_columns_are_counted() {
    let machine = |names: &str, row: fn([f64; 4]) -> String| format!("{names}\n{}", stroke(row)).into_bytes();
    let usual = |[t, p, x, f]: [f64; 4]| format!("{t:.2}\t{p}\t{x:.3}\t{f:.3}");
    let first = machine("Time\tPressure\tStroke\tForce\ns\tkPa\tmm\tN", usual);
    let order = machine("Time\tForce\tStroke\tPressure\ns\tN\tmm\tkPa", |[t, p, x, f]| {
        format!("{t:.2}\t{f:.3}\t{x:.3}\t{p}")
    });
    let unit = machine("Time\tPressure\tStroke\tForce\ns\tbar\tmm\tN", |[t, p, x, f]| {
        format!("{t:.2}\t{}\t{x:.3}\t{f:.3}", p / 100.0)
    });
    let folder = tempfile::tempdir().unwrap();
    let guessed = |others: &[&Vec<u8>]| {
        let paths: Vec<_> = (0..=others.len()).map(|n| folder.path().join(format!("{n}.txt"))).collect();
        for (path, bytes) in paths.iter().zip(std::iter::once(&&first).chain(others)) {
            std::fs::write(path, bytes).unwrap();
        }
        guess_among(&paths[0], &paths[1..], None)
    };
    let refused = |others: &[&Vec<u8>]| guessed(others).unwrap_err().cause().to_owned();
    let cause = "the columns have other names, units, or places than in 0.txt: ";
    assert_eq!(refused(&[&order]), format!("{cause}1.txt"));
    assert_eq!(refused(&[&unit, &first, &order]), format!("{cause}1.txt, 3.txt"));
    assert!(guessed(&[&first]).unwrap().unknown.is_empty());
}

#[test]
fn a_remark_below_the_table_is_left_out_as_without_a_description() {
    let rows = |many: usize| {
        (0..many).fold(String::new(), |mut text, i| {
            writeln!(text, "{},300,{},{}", 0.1 * i as f64, 0.01 * i as f64, 90 - i % 7).unwrap();
            text
        })
    };
    let head = "time_s,pressure_kPa,displacement_mm,force_N\n";
    let file = |end: &str| format!("{head}{}{end}", rows(500)).into_bytes();
    for files in [["# end\n", ""], ["", "# end\n"]] {
        let (guess, recordings) = read(&[("a.csv", file(files[0])), ("b.csv", file(files[1]))]);
        assert_eq!(recordings.unwrap_or_else(|e| panic!("{e} {}", guess.description))[0].len(), 500);
    }
}

#[test]
fn one_cell_with_both_signs_proves_the_separator_of_thousands() {
    let grouped = |value: f64, decimals: usize| {
        let plain = format!("{value:.decimals$}");
        let (whole, rest) = plain.split_at(plain.find('.').unwrap_or(plain.len()));
        if whole.len() < 4 {
            plain
        } else {
            format!("{},{}{rest}", &whole[..whole.len() - 3], &whole[whole.len() - 3..])
        }
    };
    // Milliseconds, pascals and millinewtons; only the last column proves the form.
    let row = |[t, p, x, f]: [f64; 4]| {
        [grouped(1e3 * t, 0), grouped(1e3 * p, 0), format!("{x:.4}"), grouped(1e3 * f, 1)]
    };
    let us = stroke(|r| row(r).map(|cell| format!("\"{cell}\"")).join(","));
    let de = stroke(|r| row(r).map(|c| c.replace('.', "_").replace(',', ".").replace('_', ",")).join(";"));
    for (name, text) in [
        ("us.csv", format!("Time (ms),Pressure (Pa),Stroke (mm),Force (mN)\n{us}")),
        ("de.csv", format!("Zeit [ms];Druck [Pa];Weg [mm];Kraft [mN]\n{de}")),
    ] {
        let (guess, recordings) = read(&[(name, text.into())]);
        let read = &recordings.unwrap_or_else(|e| panic!("{name}: {e} {}", guess.description))[0];
        let (force, stroke) = (read.require_force().unwrap()[20], read.stroke[20]);
        assert!((force - 10.0).abs() < 1e-6 && (stroke - 4e-3).abs() < 1e-9, "{name}: {force} {stroke}");
        assert!((read.pressure[0] - 300e3).abs() < 1e-6 && (read.time[39] - 1.95).abs() < 1e-9, "{name}");
    }
}

#[test]
fn files_that_are_incomplete_or_no_tables_are_reported_with_what_helps() {
    let refused = |name: &str, bytes: &[u8]| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let guessed = guess_among(&path, &[], None).unwrap_err();
        let read = Reader::new().file(&path).unwrap_err();
        assert_eq!((guessed.code(), guessed.cause()), (read.code(), read.cause()), "{name}");
        format!("{} | {}", guessed.cause(), guessed.advice().unwrap())
    };
    let table = String::from_utf8(without_pressure()).unwrap().replace("force_N\n", "force_N\n\n");
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(table.repeat(50).as_bytes()).unwrap();
    let gzip = gzip.finish().unwrap();
    assert!(refused("a.csv.gz", &gzip[..gzip.len() / 2]).contains("copy it again"));
    let objects = "{\"time_s\": 0.5, \"force_N\": 3}\n".repeat(20);
    let list = format!(" [\n{}]", objects.trim_end().replace('\n', ",\n"));
    for text in [&objects, &list] {
        assert!(
            refused("a.json", text.as_bytes())
                .starts_with("the file is JSON, which is not read | write it as CSV")
        );
    }
    let zeros = [table.as_bytes(), &[0; 900]].concat();
    assert!(refused("a.csv", &zeros).starts_with("the file ends in zero bytes"));
}

#[test]
fn decimal_commas_in_quotation_marks_may_stand_between_commas() {
    let rows = stroke(|row| row.map(|v| format!("\"{v:.3}\"").replace('.', ",")).join(","));
    let (guess, recordings) = read(&[("a.csv", format!("t (s),p (kPa),x (mm),F (N)\n{rows}").into())]);
    let recording = &recordings.unwrap_or_else(|e| panic!("{} {e}", guess.description))[0];
    assert!((recording.stroke[19] - 3.8e-3).abs() < 1e-9 && recording.pressure[0] == 300e3);
}
