//! Rows that both sides have, and sides in the wrong order.

use pam_data::statistics::median;
use std::collections::BTreeSet;

use super::answer::Remark;
use super::criteria::{OTHER_LENGTH, SHARED_ROWS};
use pam_data::date::{self, DateSource};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::{Campaign, Recording};

/// Rows in which pressure and force moved: at rest two recordings may have the same numbers by chance.
fn moving(r: &Recording) -> BTreeSet<[u64; 3]> {
    let Some(force) = &r.force else { return BTreeSet::new() };
    let n = r.time.len().min(r.pressure.len()).min(force.len());
    (1..n)
        .filter(|i| r.pressure[*i] != r.pressure[i - 1] && force[*i] != force[i - 1])
        .map(|i| [r.time[i].to_bits(), r.pressure[i].to_bits(), force[i].to_bits()])
        .collect()
}

/// Refuses recordings that are on both sides, whole or in part.
///
/// # Errors
/// [`DataCode::CallInvalid`] with both names.
pub(super) fn refuse_shared_rows(before: &Campaign, after: &Campaign) -> Result<()> {
    let known: Vec<(&Recording, BTreeSet<[u64; 3]>)> =
        before.recordings.iter().map(|b| (b, moving(b))).collect();
    for a in &after.recordings {
        let rows = moving(a);
        for (b, others) in &known {
            let shared = rows.intersection(others).count();
            let least = rows.len().min(others.len());
            let part = least > 0 && shared as f64 >= SHARED_ROWS * least as f64;
            if !(part || a.same_rows(b)) {
                continue;
            }
            let cause = match (a.same_rows(b), a.name == b.name) {
                (true, true) => format!("`{}` is on both sides of the comparison", a.name),
                (true, false) => {
                    format!(
                        "`{}` and `{}` hold the same rows: on both sides of the comparison",
                        a.name, b.name
                    )
                }
                (false, _) => format!(
                    "`{}` and `{}` overlap: {shared} rows are on both sides of the comparison",
                    a.name, b.name
                ),
            };
            return Err(Error::new(DataCode::CallInvalid, cause)
                .file(&a.source)
                .help("give each recording once, before or after --reference; --where and --reference-where pick rows of one file"));
        }
    }
    Ok(())
}

/// Refuses recordings of two actuators, by the rest lengths that they state.
///
/// # Errors
/// [`DataCode::CallInvalid`] with both lengths.
pub(super) fn one_actuator(before: &Campaign, after: &Campaign) -> Result<()> {
    let stated = |campaign: &Campaign| {
        let mut all: Vec<f64> = campaign.recordings.iter().filter_map(|r| r.rest_length).collect();
        (!all.is_empty()).then(|| median(&mut all))
    };
    match (stated(before), stated(after)) {
        (Some(old), Some(new)) if !((new / old - 1.0).abs() <= OTHER_LENGTH) => Err(Error::new(
            DataCode::CallInvalid,
            format!(
                "the reference is of an actuator with a rest length of {:.1} mm, AFTER of one with {:.1} mm",
                old * 1e3,
                new * 1e3
            ),
        )
        .help("give recordings of one actuator")),
        _ => Ok(()),
    }
}

/// Dates of a campaign's recordings by their names, columns or clocks, s since 1970. A file's time of modification is not a date: copies
/// change it.
fn dates(campaign: &Campaign) -> impl Iterator<Item = f64> + Clone {
    let all: Vec<f64> = campaign
        .recordings
        .iter()
        .filter_map(|r| date::of_recording(&r.source, r.time.first().copied()))
        .filter(|(_, by)| *by != DateSource::Modified)
        .map(|d| d.0)
        .collect();
    all.into_iter()
}

/// Says so where every dated recording of the reference is later than every one of AFTER.
pub(super) fn order_remark(before: &Campaign, after: &Campaign) -> Option<Remark> {
    let first = dates(before).fold(f64::INFINITY, f64::min);
    let last = dates(after).fold(f64::NEG_INFINITY, f64::max);
    (first.is_finite() && last.is_finite() && first > last)
        .then_some(Remark::ReferenceLater { reference: first, after: last })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(name: &str, from: usize, to: usize) -> Campaign {
        let of = |f: &dyn Fn(f64) -> f64| (from..to).map(|i| f(i as f64)).collect::<Vec<f64>>();
        let one = Recording {
            name: name.into(),
            source: name.into(),
            time: of(&|i| 0.1 * i),
            pressure: of(&|i| 1e3 * (0.1 * i).sin()),
            stroke: of(&|_| 0.0),
            force: Some(of(&|i| 10.0 * (0.1 * i).cos())),
            ..Recording::default()
        };
        Campaign::new(vec![one])
    }

    #[test]
    fn parts_of_one_recording_may_not_overlap() {
        let (first, second) = (recording("a.csv", 0, 100), recording("b.csv", 100, 200));
        assert!(refuse_shared_rows(&first, &second).is_ok());
        let error = refuse_shared_rows(&first, &recording("b.csv", 60, 160)).expect_err("rows are in both");
        // Of 40 common rows the first has none before it to have moved from.
        assert!(error.cause().contains("overlap: 39 rows"), "{error}");
    }

    #[test]
    fn rest_lengths_of_two_actuators_are_refused() {
        let of = |rest: Option<f64>| {
            let mut campaign = recording("a.csv", 0, 9);
            campaign.recordings[0].rest_length = rest;
            campaign
        };
        let error = one_actuator(&of(Some(0.166)), &of(Some(0.25))).expect_err("two actuators");
        assert!(error.cause().contains("166.0 mm") && error.cause().contains("250.0 mm"), "{error}");
        assert!(one_actuator(&of(Some(0.25)), &of(Some(0.252))).is_ok());
        assert!(one_actuator(&of(None), &of(Some(0.252))).is_ok());
    }

    #[test]
    fn a_reference_of_a_later_day_is_reported() {
        let (march, may) = (recording("2026-03-01.csv", 0, 9), recording("2026-05-01.csv", 9, 18));
        assert!(matches!(order_remark(&may, &march), Some(Remark::ReferenceLater { .. })));
        assert_eq!(order_remark(&march, &may), None);
        assert_eq!(order_remark(&recording("x.csv", 0, 9), &march), None);
    }
}
