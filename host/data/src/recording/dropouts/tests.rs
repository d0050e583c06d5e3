use super::*;

/// Rows a second.
const RATE: f64 = 20.0;
const PSI: f64 = 6.894_757;

/// What the muscle of these tests makes at a pressure (Pa) and a contraction: 30 kPa of deadband, slack where it would push.
fn pull(pressure: f64, contraction: f64) -> f64 {
    ((pressure - 30e3) * 8e-4 * (1.0 - 3.0 * contraction).powi(2) - 600.0 * contraction).max(0.0)
}

/// A recording of strokes back and forth over `most` contraction, at pressures of each row's time; the force is what `felt` makes of
/// those.
fn recorded(
    seconds: f64,
    most: f64,
    pressure: impl Fn(f64) -> f64,
    felt: impl Fn(&[f64]) -> Vec<f64>,
) -> Recording {
    let rows = (seconds * RATE) as usize;
    let mut state = 7_u32;
    let mut noise = move |size: f64| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        size * (f64::from(state >> 8) / f64::from(1 << 23) - 1.0)
    };
    let time: Vec<f64> = (0..rows).map(|i| i as f64 / RATE).collect();
    let phase = |t: f64| 1.0 - (1.0 - 2.0 * (t / 20.0).fract()).abs();
    let stroke: Vec<f64> = time.iter().map(|t| 0.1 * most * phase(*t)).collect();
    let real: Vec<f64> = time.iter().map(|t| pressure(*t)).collect();
    let friction = |t: f64| if (t / 20.0).fract() < 0.5 { 0.96 } else { 1.04 };
    let force =
        felt(&real).into_iter().zip(&stroke).zip(&time).map(|((p, x), t)| friction(*t) * pull(p, 10.0 * x));
    Recording {
        name: "a".into(),
        force: Some(force.map(|f| f + noise(0.2)).collect()),
        pressure: real.iter().map(|p| p + noise(100.0)).collect(),
        time,
        stroke,
        ..Recording::default()
    }
}

/// As the gauge reads it.
fn as_read(pressure: &[f64]) -> Vec<f64> {
    pressure.to_vec()
}

/// As a muscle behind a hose has it: delayed by this time, s.
fn behind_a_hose(seconds: f64) -> impl Fn(&[f64]) -> Vec<f64> {
    move |pressure| {
        let share = 1.0 - (-1.0 / (RATE * seconds)).exp();
        let mut inside = pressure[0];
        pressure.iter().map(|p| (inside += share * (p - inside), inside).1).collect()
    }
}

/// 300 kPa, and a minute later 500 kPa.
fn two_levels(t: f64) -> f64 {
    if t < 60.0 { 300e3 } else { 500e3 }
}

fn spoiled(mut recording: Recording, rows: Range<usize>, reading: impl Fn(f64) -> f64) -> Recording {
    recording.pressure[rows].iter_mut().for_each(|p| *p = reading(*p));
    recording
}

fn found(recording: Recording) -> Vec<Range<usize>> {
    let campaign = Campaign::new(vec![recording]);
    Screened::of(&campaign).dropouts.into_iter().map(|d| d.rows).collect()
}

#[test]
fn rows_in_psi_are_found_and_bridged_while_the_muscle_strokes() {
    let clean = recorded(120.0, 0.15, two_levels, as_read);
    let psi = |p: f64| p / PSI;
    // One in a stroke, one across a turn, one across the change of level.
    let places = [80..110, 390..415, 1190..1215];
    let spoiled_there = places.iter().fold(clean.clone(), |r, rows| spoiled(r, rows.clone(), psi));
    let campaign = Campaign::new(vec![spoiled_there]);
    let screened = Screened::of(&campaign);
    let there: Vec<_> = screened.of_recording(0).collect();
    assert_eq!(there, places[..2], "where the pressure itself steps, nothing is sure");
    assert_eq!(screened.rows(), 55);
    for rows in &places[..2] {
        for i in rows.clone() {
            let (bridged, real) = (screened.campaign.recordings[0].pressure[i], clean.pressure[i]);
            assert!((bridged - real).abs() < 0.01 * real, "row {i}: {bridged} Pa for {real} Pa");
        }
    }
    assert_eq!(screened.read(0).iter().filter(|read| !**read).count(), 55);
    let said = screened.remark().expect("a remark");
    for part in
        ["55 rows", "a rows 81 to 110 (4.00 to 5.45 s) from 300.", " to 43.5 kPa (1/6.9", "psi to kPa"]
    {
        assert!(said.contains(part), "{part:?} is not in: {said}");
    }
}

#[test]
fn a_loose_plug_is_found_reading_by_reading() {
    let clean = recorded(120.0, 0.15, two_levels, as_read);
    let places = [81..82, 83..86, 87..88, 1500..1560];
    let zero = places.iter().fold(clean.clone(), |r, rows| spoiled(r, rows.clone(), |_| 0.0));
    assert_eq!(found(zero.clone()), places);
    let campaign = Campaign::new(vec![zero]);
    let said = Screened::of(&campaign).remark().expect("a remark");
    assert!(said.ends_with("check connector and cable of the pressure sensor"), "{said}");
    let full = places.iter().fold(clean, |r, rows| spoiled(r, rows.clone(), |_| 1e6));
    assert_eq!(found(full), places);
}

#[test]
fn one_pressure_is_enough_where_the_muscle_strokes() {
    let clean = recorded(60.0, 0.15, |_| 300e3, as_read);
    assert_eq!(found(clean.clone()), []);
    let psi = 300..330;
    assert_eq!(found(spoiled(clean, psi.clone(), |p| p / PSI)), [psi]);
}

#[test]
fn a_real_step_moves_the_force_and_stays() {
    let vented = |t: f64| if (30.0..33.0).contains(&t) { 40e3 } else { two_levels(t) };
    assert_eq!(found(recorded(120.0, 0.15, vented, as_read)), []);
    // The muscle behind its hose follows late.
    let pulse = |t: f64| if (30.0..30.5).contains(&t) { 40e3 } else { two_levels(t) };
    for late in [0.05, 0.2, 1.0] {
        assert_eq!(found(recorded(120.0, 0.15, pulse, behind_a_hose(late))), [], "{late} s late");
    }
    // A square wave, and a staircase logged slowly.
    assert_eq!(
        found(recorded(120.0, 0.1, |t| if (t / 2.0).fract() < 0.5 { 60e3 } else { 400e3 }, as_read)),
        []
    );
    let steps = |t: f64| 100e3 * [1.0, 2.0, 4.0, 5.0, 3.0, 1.0][(t / 2.0) as usize % 6];
    assert_eq!(found(recorded(120.0, 0.1, steps, as_read)), []);
}

#[test]
fn a_slack_muscle_is_not_used() {
    // It pulls up to a sixth of contraction at 300 kPa, at the far end of its strokes it hangs.
    let clean = recorded(120.0, 0.3, two_levels, as_read);
    let force = clean.force.as_ref().expect("a force");
    let slack = 190..210;
    assert!(force[slack.clone()].iter().all(|f| f.abs() < 0.3), "it hangs there");
    assert_eq!(found(spoiled(clean.clone(), slack, |_| 40e3)), []);
    // A force sensor at the end of its range is not used either.
    let mut clipped = clean;
    clipped.force.iter_mut().flatten().for_each(|f| *f = f.min(100.0));
    let top = 1205..1215;
    assert!(clipped.force.as_ref().is_some_and(|f| f[top.clone()].iter().all(|f| *f == 100.0)));
    assert_eq!(found(spoiled(clipped, top, |p| p / PSI)), []);
}

#[test]
fn a_dead_weight_and_a_recording_without_force_show_nothing() {
    let mut hung = recorded(60.0, 0.15, two_levels, as_read);
    hung.force.iter_mut().flatten().for_each(|f| *f = 50.0);
    let hung = spoiled(hung, 300..330, |p| p / PSI);
    assert_eq!(found(hung.clone()), []);
    assert_eq!(found(Recording { force: None, ..hung }), []);
    assert_eq!(found(Recording::default()), []);
}

#[test]
fn ratios_of_units_are_distinguished() {
    for (factor, said) in [
        (6.9, Some("psi to kPa")),
        (1.0 / 14.5, Some("bar to psi")),
        (100.0, Some("bar to kPa")),
        (101.3, Some("atm to kPa")),
        (98.1, Some("kgf/cm² to kPa")),
        (1000.0, Some("MPa to kPa")),
        (2.0, None),
    ] {
        assert_eq!(unit(factor), said, "{factor}");
    }
}

#[test]
fn a_gauge_that_is_dead_at_the_beginning_or_the_end_is_found() {
    let clean = recorded(120.0, 0.15, |_| 300e3, as_read);
    for rows in [0..60, 2340..2400] {
        let dead = spoiled(clean.clone(), rows.clone(), |_| 0.0);
        assert_eq!(found(dead), vec![rows.clone()]);
        let campaign = Campaign::new(vec![spoiled(clean.clone(), rows.clone(), |p| p / PSI)]);
        let screened = Screened::of(&campaign);
        let bridged = &screened.campaign.recordings[0].pressure[rows];
        assert!(bridged.iter().all(|p| (p / 300e3 - 1.0).abs() < 0.01), "bridged by the unit's ratio");
    }
}

#[test]
fn a_muscle_that_is_filled_first_and_vented_last_is_none() {
    let worked = |t: f64| if (5.0..115.0).contains(&t) { 300e3 } else { 0.0 };
    for late in [0.05, 0.2, 0.5] {
        assert_eq!(found(recorded(120.0, 0.15, worked, behind_a_hose(late))), [], "{late} s late");
    }
    // The recording ends before the muscle behind its hose is empty.
    let cut = |t: f64| if t < 119.2 { 300e3 } else { 0.0 };
    assert_eq!(found(recorded(120.0, 0.15, cut, behind_a_hose(1.0))), []);
}
