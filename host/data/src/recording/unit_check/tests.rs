use super::mistake::{ATMOSPHERE, Column, MistakeKind};
use super::*;

const PSI: f64 = 6.894_757;

/// A loop at a pressure (Pa), of a muscle with a deadband of 60 kPa, a tenth of friction, and 0.1 m of rest length.
fn loops(name: &str, pressure: f64) -> Recording {
    loops_to(name, pressure, 0.02)
}

/// The same to a stroke, m.
fn loops_to(name: &str, pressure: f64, furthest: f64) -> Recording {
    let rows = 240;
    let phase = |i: usize| (i as f64 / rows as f64 * 3.0).fract();
    let stroke: Vec<f64> = (0..rows).map(|i| furthest * (1.0 - (1.0 - 2.0 * phase(i)).abs())).collect();
    let way = |i: usize| if phase(i) < 0.5 { 0.95 } else { 1.05 };
    let pull = |x: f64| ((pressure - 60e3) * 5e-4 * (1.0 - 20.0 * x).powi(2) - 400.0 * x).max(0.0);
    Recording {
        name: name.into(),
        time: (0..rows).map(|i| i as f64 * 0.05).collect(),
        pressure: vec![pressure; rows],
        force: Some(stroke.iter().enumerate().map(|(i, x)| way(i) * pull(*x)).collect()),
        stroke,
        ..Recording::default()
    }
}

fn campaign() -> Vec<Recording> {
    [150e3, 250e3, 350e3, 450e3, 550e3]
        .iter()
        .zip(["a", "b", "c", "d", "e"])
        .map(|(p, n)| loops(n, *p))
        .collect()
}

fn found(recordings: &[Recording]) -> Vec<(usize, Mistake)> {
    inconsistent_recordings(&Campaign::new(recordings.to_vec()))
        .into_iter()
        .map(|a| (a.recording, a.mistake))
        .collect()
}

/// The same with a mistake in one column of one recording.
fn spoiled(which: usize, column: Column, wrong: impl Fn(f64) -> f64) -> Vec<Recording> {
    let mut recordings = campaign();
    let r = &mut recordings[which];
    let values = match column {
        Column::Pressure => &mut r.pressure,
        Column::Stroke => &mut r.stroke,
        Column::Force => r.force.as_mut().expect("a force"),
    };
    values.iter_mut().for_each(|v| *v = wrong(*v));
    recordings
}

#[test]
fn every_unit_in_every_recording_of_some_force_is_found_and_nothing_else() {
    assert_eq!(found(&campaign()), []);
    for which in 1..5 {
        for (column, factor) in [
            (Column::Pressure, PSI),
            (Column::Pressure, 100.0),
            (Column::Pressure, 0.1),
            (Column::Stroke, 25.4),
            (Column::Stroke, 1000.0),
            (Column::Force, 4.448_222),
            (Column::Force, 1000.0),
            (Column::Force, 0.001),
            (Column::Force, 0.009_806_65),
        ] {
            let there = found(&spoiled(which, column, |v| v / factor));
            let [(at, Mistake { column: in_column, wrong: MistakeKind::Unit(found, _) })] = there[..] else {
                panic!("{column:?} / {factor} in {which}: {there:?}");
            };
            assert_eq!((at, in_column), (which, column));
            assert!((found / factor - 1.0).abs() < 1e-3, "{column:?} / {factor} in {which}: {found}");
        }
    }
}

#[test]
fn signs_and_zeros_are_found() {
    let other = |column, wrong| Mistake { column, wrong };
    assert_eq!(found(&spoiled(2, Column::Force, |f| -f)), [(2, other(Column::Force, MistakeKind::Sign))]);
    let from_the_end = found(&spoiled(3, Column::Stroke, |x| 0.02 - x));
    assert!(
        matches!(from_the_end[..], [(3, Mistake { column: Column::Stroke, wrong: MistakeKind::OtherEnd(sum) })] if (sum - 0.02).abs() < 1e-9),
        "{from_the_end:?}"
    );
    let absolute = spoiled(1, Column::Pressure, |p| p + ATMOSPHERE);
    assert_eq!(found(&absolute), [(1, other(Column::Pressure, MistakeKind::Absolute(ATMOSPHERE)))]);
}

/// The more pressure, the further a muscle contracts: beyond the strokes of the others, their surface says nothing.
#[test]
fn absolute_pressure_is_found_at_every_level() {
    let campaign: Vec<Recording> = (0..6)
        .map(|k| 150e3 + 80e3 * f64::from(k))
        .map(|p| loops_to("loop", p, 0.008 + 0.012 * p / 550e3))
        .collect();
    assert_eq!(found(&campaign), []);
    // The force at the lowest pressure hardly changes with the stroke.
    for which in 1..campaign.len() {
        let mut spoiled = campaign.clone();
        spoiled[which].pressure.iter_mut().for_each(|p| *p += ATMOSPHERE);
        let absolute = Mistake { column: Column::Pressure, wrong: MistakeKind::Absolute(ATMOSPHERE) };
        assert_eq!(found(&spoiled), [(which, absolute)], "in {which}");
    }
}

#[test]
fn two_mistakes_in_five_recordings_are_both_found() {
    let mut recordings = spoiled(1, Column::Pressure, |p| p / PSI);
    recordings[4].pressure.iter_mut().for_each(|p| *p /= PSI);
    let there: Vec<usize> = found(&recordings).iter().map(|(i, _)| *i).collect();
    assert_eq!(there, [1, 4]);
}

/// What differs for a reason is not a mistake: a vented bench, a dead cell, a gauge at another level, two recordings alone.
#[test]
fn differences_with_a_reason_are_not_reported_as_mistakes() {
    let vented = |offset: f64| Recording { force: Some(vec![offset; 240]), ..loops("tare", 0.0) };
    for offset in [0.0, 5.0, -5.0, 40.0] {
        let mut with_tares = campaign();
        with_tares.extend([vented(offset), vented(1.01 * offset)]);
        assert_eq!(found(&with_tares), [], "a zero of {offset} N");
    }
    assert_eq!(found(&spoiled(2, Column::Force, |_| 0.0)), []);
    assert_eq!(found(&spoiled(2, Column::Pressure, |_| 0.0)), []);
    assert_eq!(found(&spoiled(2, Column::Force, |f| 2.0 * f)), []);
    assert_eq!(found(&spoiled(0, Column::Pressure, |p| p / PSI)[..2]), []);
    assert_eq!(found(&[]), []);
}

#[test]
fn an_inconsistent_recording_is_reported_with_the_remedy() {
    let campaign = Campaign::new(spoiled(3, Column::Pressure, |p| p / PSI));
    let screened = crate::recording::dropouts::Screened::of(&campaign);
    let said = screened.remark().expect("a remark");
    for part in [
        "`d` is inconsistent",
        "its 240 rows are excluded",
        "6.89 times the reading",
        "psi to kPa",
        "column's name",
    ] {
        assert!(said.contains(part), "{part:?} is not in: {said}");
    }
    assert!(screened.read(3).iter().all(|read| !read) && screened.read(2).iter().all(|read| *read));
    assert!((screened.campaign.recordings[3].pressure[0] - 450e3).abs() < 1.0, "good enough to follow");
}

/// The force of many muscles falls steeply at the beginning of the stroke, which a smooth surface does not follow. A pressure ramp at
/// rest length lies wholly there.
#[test]
fn a_ramp_at_rest_length_where_the_force_falls_steeply_has_no_wrong_unit() {
    // About the force that one more atmosphere makes.
    let steep = |x: f64| 45.0 * (-x / 0.3e-3).exp();
    let mut recordings = campaign();
    for r in &mut recordings {
        let force = r.force.as_mut().expect("a force");
        force.iter_mut().zip(&r.stroke).for_each(|(f, x)| *f += steep(*x));
    }
    let pressure: Vec<f64> = (0..400).map(|i| 550e3 * (1.0 - (f64::from(i) / 200.0 - 1.0).abs())).collect();
    let ramp = Recording {
        name: "ramp".into(),
        time: (0..400).map(|i| f64::from(i) * 0.1).collect(),
        stroke: vec![0.0; 400],
        force: Some(pressure.iter().map(|p| ((p - 60e3) * 5e-4 + steep(0.0)).max(0.0)).collect()),
        pressure,
        ..Recording::default()
    };
    recordings.push(ramp);
    assert_eq!(found(&recordings), []);
}
