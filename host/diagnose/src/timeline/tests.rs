//! Change points of simulated series, and timelines of simulated actuators.

use super::change_points::{How, find};
use super::series::{Kind, Point, Quantity, Series};
use super::{Options, Visit, timeline};
use pam_data::date::DateSource;
use pam_data::recording::{Campaign, Recording};

/// A small generator of normal numbers: sums of twelve uniform ones.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn series(values: &[f64], error: f64) -> Series {
    let points = values.iter().map(|v| Some(Point::new(*v, Some(error)))).collect();
    Series::of(Quantity::LargestForce, Kind::Measured, "N", points)
}

fn dates(n: usize) -> Vec<f64> {
    (0..n).map(|i| 1e9 + 2.6e6 * i as f64).collect()
}

#[test]
fn series_without_change_are_rarely_named_at_any_scatter_between_campaigns() {
    let mut noise = Noise(7);
    let (mut named, mut all) = (0, 0);
    for n in [4, 6, 10, 20] {
        for scatter in [0.5, 1.0, 5.0, 30.0] {
            for _ in 0..100 {
                let values: Vec<f64> = (0..n).map(|_| 100.0 + scatter * noise.normal()).collect();
                named += usize::from(!find(&dates(n), &series(&values, 1.0)).changes.is_empty());
                all += 1;
            }
        }
    }
    // Asked: five per cent at most. Measured when this was written: see the message.
    assert!(named * 20 <= all, "{named} of {all} series without change are named");
}

#[test]
fn a_step_is_found_where_it_is_and_a_slope_is_called_gradual() {
    let mut noise = Noise(3);
    for n in [6, 10, 20] {
        let at = n / 2;
        let stepped: Vec<f64> =
            (0..n).map(|i| 100.0 + noise.normal() + if i >= at { 12.0 } else { 0.0 }).collect();
        let change_points = find(&dates(n), &series(&stepped, 1.0));
        let change = change_points.changes.first().unwrap();
        assert_eq!((change.how, change.from, change.to), (How::AtOnce, at - 1, at), "{n}: {change_points:?}");
        assert!((change.size - 12.0).abs() < 3.0 * change.std, "{change:?}");
        let sloped: Vec<f64> =
            (0..n).map(|i| 100.0 + noise.normal() + 24.0 * i as f64 / (n - 1) as f64).collect();
        let change_points = find(&dates(n), &series(&sloped, 1.0));
        let change = change_points.changes.first().unwrap();
        assert_eq!(
            (change_points.changes.len(), change.how, change.from, change.to),
            (1, How::Gradual, 0, n - 1),
            "{change_points:?}"
        );
        assert!((change.size - 24.0).abs() < 4.0 * change.std, "{change:?}");
    }
}

#[test]
fn two_steps_are_two_changes_and_a_return_is_found() {
    let values = [100.0, 100.4, 99.7, 100.1, 115.0, 114.6, 115.3, 115.1, 99.8, 100.2, 100.0, 99.9];
    let change_points = find(&dates(12), &series(&values, 0.4));
    let steps: Vec<(usize, usize)> = change_points.changes.iter().map(|c| (c.from, c.to)).collect();
    assert_eq!(steps, [(3, 4), (7, 8)], "{change_points:?}");
    assert!(
        (change_points.changes[0].size - 15.0).abs() < 0.5
            && (change_points.changes[1].size + 15.0).abs() < 0.5,
        "{change_points:?}"
    );
}

#[test]
fn few_equal_or_missing_values_are_no_change_and_do_not_fail() {
    assert!(find(&dates(3), &series(&[1.0, 2.0, 30.0], 1.0)).too_few);
    assert!(find(&dates(8), &series(&[5.0; 8], 0.0)).changes.is_empty());
    assert!(find(&dates(8), &series(&[f64::NAN; 8], 1.0)).too_few);
    // All dates the same: the order counts.
    let rising: Vec<f64> = (0..8).map(|i| 10.0 * f64::from(i)).collect();
    let change_points = find(&[0.0; 8], &series(&rising, 1.0));
    assert_eq!(change_points.changes.first().map(|c| c.how), Some(How::Gradual), "{change_points:?}");
}

/// Pressure sweeps of an actuator without equations of the model, held at two lengths, two runs each.
fn visit(index: usize, offset: f64, friction: f64, threshold: f64) -> Visit {
    let mut noise = Noise(100 + index as u64);
    let mut recordings = Vec::new();
    for (number, stroke) in [0.0, 6e-3, 0.0, 6e-3].into_iter().enumerate() {
        let zero = 0.05 * noise.normal();
        let mut r = Recording {
            name: format!("{index}-{number}"),
            source: format!("{index}-{number}.csv").into(),
            ..Recording::default()
        };
        let mut force = Vec::new();
        for i in 0..600 {
            let (p, d) = if i < 300 {
                (10e3 + 2e3 * f64::from(i), 1.0)
            } else {
                (610e3 - 2e3 * f64::from(i - 300), -1.0)
            };
            let pull = (p - threshold).max(0.0) * (1.0 - stroke / 30e-3);
            r.time.push(0.1 * f64::from(i));
            r.pressure.push(p);
            r.stroke.push(stroke);
            force.push(6e-4 * pull * (1.0 - friction * d) + offset + zero + 0.3 * noise.normal());
        }
        r.force = Some(force);
        recordings.push(r);
    }
    let campaign = Campaign::new(recordings);
    Visit { name: format!("campaign {index}"), date: dates(40)[index], dated_by: DateSource::Name, campaign }
}

fn change_points_of(t: &super::Timeline, quantity: Quantity) -> &super::change_points::ChangePoints {
    let of = |s: &Series| s.what == super::series::What::Quantity(quantity);
    &t.series.iter().find(|(s, _)| of(s)).unwrap().1
}

#[test]
fn an_actuator_that_stays_has_no_changes() {
    let visits: Vec<Visit> = (0..6).map(|i| visit(i, 0.0, 0.02, 60e3)).collect();
    let t = timeline(&visits, &Options::default()).unwrap();
    let named: Vec<_> = t.comparisons.iter().flatten().flat_map(|r| &r.missing).collect();
    assert!(named.is_empty(), "{named:#?}");
    let changed: Vec<_> = t.changed().map(|(s, _)| s.what.clone()).collect();
    assert_eq!(changed, [], "{:#?}", t.series);
    let largest = &t.of_kind(Kind::Measured).next().unwrap().0;
    assert_eq!(largest.points.len(), 6);
    let (low, high) = largest.points[0].unwrap().interval().unwrap();
    assert!(low < 310.5 && high > 308.0 && high - low < 20.0, "{low} to {high}");
}

#[test]
fn an_offset_that_comes_with_one_campaign_is_dated_and_named() {
    let visits: Vec<Visit> = (0..6).map(|i| visit(i, if i >= 4 { 15.0 } else { 0.0 }, 0.02, 60e3)).collect();
    let t = timeline(&visits, &Options::default()).unwrap();
    let (series, change_points) = t.of_kind(Kind::Effect).next().unwrap();
    assert_eq!(
        series.what,
        super::series::What::Effect { name: "force-offset".into(), parameter: "offset".into() }
    );
    let change = change_points.changes.first().unwrap();
    assert_eq!((change.how, change.from, change.to), (How::AtOnce, 3, 4), "{change_points:?}");
    assert!((change.size - 15.0).abs() < 1.5, "{change:?}");
}

#[test]
fn friction_that_grows_is_gradual() {
    let visits: Vec<Visit> = (0..8).map(|i| visit(i, 0.0, 0.02 + 0.01 * i as f64, 60e3)).collect();
    let t = timeline(&visits, &Options::default()).unwrap();
    let change_points = change_points_of(&t, Quantity::Hysteresis);
    assert_eq!(
        change_points.changes.first().map(|c| (c.how, c.from, c.to)),
        Some((How::Gradual, 0, 7)),
        "{change_points:?}"
    );
    let largest = change_points_of(&t, Quantity::LargestForce);
    assert!(largest.changes.is_empty(), "{:#?}", t.of_kind(Kind::Measured).next());
}

#[test]
fn one_campaign_another_actuator_and_other_lengths_are_refused_by_name() {
    let one = timeline(&[visit(0, 0.0, 0.02, 60e3)], &Options::default()).unwrap_err();
    assert!(one.cause().contains("two campaigns"), "{one}");
    let mut other = visit(1, 0.0, 0.02, 60e3);
    for r in &mut other.campaign.recordings {
        r.force.iter_mut().flatten().for_each(|f| *f *= 2.2);
    }
    let other = timeline(&[visit(0, 0.0, 0.02, 60e3), other], &Options::default()).unwrap_err();
    assert!(other.cause().contains("campaign 1") && other.cause().contains("another actuator"), "{other}");
    let mut elsewhere = visit(2, 0.0, 0.02, 60e3);
    elsewhere.campaign.recordings.iter_mut().for_each(|r| r.stroke.fill(0.1));
    let error = timeline(&[visit(0, 0.0, 0.02, 60e3), elsewhere], &Options::default()).unwrap_err();
    assert!(error.cause().contains("campaign 2") && error.cause().contains("lengths"), "{error}");
}
