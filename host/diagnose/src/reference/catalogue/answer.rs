//! The answer for strokes of a described muscle.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::super::answer::{
    ChangeReport, Changed, Considered, Curve, HeldOut, Moment, NotComparable, Place, Probability, Reference,
    Remark, Repeatability, Since, Size, Split, Verdict, WhyNot, size,
};
use super::super::criteria::{
    CATALOGUE_BINS, CATALOGUE_LAW_ERROR, CATALOGUE_USUAL, COURSE_LEAD, LOCALISE_STANDS_OUT, NAMED, SET, SIZES,
};
use super::super::detectable;
use super::super::held_out::{Unseen, parts, shown};
use super::super::report::left;
use super::super::shapes::Course;
use super::cells::{Cell, Cells, VENTED};
use super::weigh::{Accepted, Fit, Weighed};

fn rms(values: &DVector<f64>) -> f64 {
    (values.norm_squared() / values.len().max(1) as f64).sqrt()
}

/// Root mean square over some cells, by their certainty: cells of fast motion and of rests that slipped are known less well, N.
fn weighted(cells: &Cells, values: &DVector<f64>, of: &[usize]) -> f64 {
    let sum = |value: &dyn Fn(usize) -> f64| of.iter().map(|i| value(*i) / cells.variance[*i]).sum::<f64>();
    (sum(&|i| values[i] * values[i]) / sum(&|_| 1.0).max(f64::MIN_POSITIVE)).sqrt()
}

/// Which recordings of AFTER are held out together: each in which the muscle worked, with the tares after it. Tares alone determine no size.
fn together(cells: &[Cell]) -> Vec<usize> {
    let recordings = cells.iter().map(|c| c.recording + 1).max().unwrap_or(0);
    let works = |r: usize| cells.iter().any(|c| c.recording == r && c.key.3 != VENTED);
    let mut count = 0_usize;
    let one = |r: usize| {
        count += usize::from(works(r));
        count.saturating_sub(1)
    };
    (0..recordings).map(one).collect()
}

/// rms of the difference without and with the changes, their sizes fitted to one part of the recordings and judged on the other, N: over
/// all of AFTER, and over the held-out recordings in which the changes show.
fn unseen(cells: &Cells, accepted: &[&Accepted]) -> (Unseen, Unseen) {
    let n = cells.cells.len();
    let all: Vec<usize> = (0..n).collect();
    let before = weighted(cells, &cells.difference, &all);
    let columns: Vec<DVector<f64>> = accepted.iter().map(|a| a.fit.trace.clone()).collect();
    let groups = together(&cells.cells);
    let group = |i: usize| groups[cells.cells[i].recording];
    let count = groups.last().map_or(0, |g| g + 1);
    if columns.is_empty() {
        let none = Unseen { before, after: before, held: count > 1 };
        return (none, none);
    }
    let of_group = |g: usize| -> Vec<f64> {
        let own: Vec<usize> = all.iter().copied().filter(|i| group(*i) == g).collect();
        columns.iter().map(|c| weighted(cells, c, &own)).collect()
    };
    let shown = shown(&(0..count).map(of_group).collect::<Vec<_>>());
    let parts = parts(&shown);
    let judged: Vec<usize> = all
        .iter()
        .copied()
        .filter(|i| parts[group(*i)].is_some() && shown[group(*i)].contains(&true))
        .collect();
    let held = !judged.is_empty();
    let part = |i: usize| if held { parts[group(i)] } else { None };
    let x = DMatrix::from_columns(&columns);
    let mut remaining = cells.difference.clone();
    for side in [Some(0), Some(1), None] {
        // What cannot be held out is in every fit.
        let own: Vec<usize> = all.iter().copied().filter(|i| part(*i) == side).collect();
        if own.is_empty() {
            continue;
        }
        let (mut g, mut b) = (DMatrix::zeros(x.ncols(), x.ncols()), DVector::zeros(x.ncols()));
        for i in all.iter().copied().filter(|i| side.is_none() || part(*i) != side) {
            let row = x.row(i).transpose();
            let weight = 1.0 / cells.variance[i];
            g += &row * row.transpose() * weight;
            b += &row * (cells.difference[i] * weight);
        }
        let Some(sizes) = g.cholesky().map(|f| f.solve(&b)) else { continue };
        for i in own {
            remaining[i] -= (x.row(i) * &sizes)[0];
        }
    }
    let over = |values: &DVector<f64>| weighted(cells, values, &judged);
    let whole = Unseen { before, after: weighted(cells, &remaining, &all), held };
    let where_shown = Unseen { before: over(&cells.difference), after: over(&remaining), held };
    (whole, if held { where_shown } else { whole })
}

/// A moment of AFTER, s, with its recording.
fn moment(cells: &Cells, [at, low, high]: [f64; 3]) -> Moment {
    let from = cells.cells.iter().filter(|c| c.time >= at).map(|c| c.recording).min();
    let recording = from.and_then(|r| cells.names.get(r)).cloned().unwrap_or_default();
    Moment { recording, moment: at, low, high }
}

/// Since when: the change as it is, from one recording on, or growing over AFTER.
fn since(cells: &Cells, fit: &Fit) -> Since {
    let changed = fit.change.about().changed;
    match changed.courses {
        [Course::Ramp] => return Since::Gradual(moment(cells, [0.0; 3])),
        [Course::Step] => {
            // Its law has the moment as a parameter, found to about a half-stroke.
            let begin = cells.rows.contexts().first().map_or(0.0, |c| c.time);
            let time = fit.parameters.iter().find(|p| p.1 == "s").map(|p| p.2 - begin);
            let near = |at: f64| {
                let before = cells.cells.iter().map(|c| c.time).filter(|t| *t <= at).fold(0.0, f64::max);
                let after = cells.cells.iter().map(|c| c.time).filter(|t| *t > at);
                [at, before, after.fold(cells.duration, f64::min)]
            };
            return time.map_or(Since::NotDetermined, |at| Since::From(moment(cells, near(at))));
        }
        _ if changed.remembers => return Since::NotDetermined,
        _ => {}
    }
    let weigh = |factor: &dyn Fn(usize) -> f64| {
        let column = DVector::from_fn(cells.cells.len(), |i, _| fit.trace[i] * factor(i));
        let (mut a, mut b) = (0.0, 0.0);
        for i in 0..column.len() {
            a += column[i] * column[i] / cells.variance[i];
            b += column[i] * cells.difference[i] / cells.variance[i];
        }
        super::super::contrast::evidence(a, b, 1.0, &SIZES.map(|s| s * 100.0))
    };
    let recordings = cells.cells.iter().map(|c| c.recording).max().unwrap_or(0) + 1;
    let whole = weigh(&|_| 1.0);
    let ramp = weigh(&|i| cells.cells[i].time / cells.duration);
    let step = (1..recordings)
        .map(|r| (r, weigh(&|i| f64::from(u8::from(cells.cells[i].recording >= r)))))
        .fold((0, f64::NEG_INFINITY), |best, one| if one.1 > best.1 { one } else { best });
    if whole > step.1.max(ramp) + COURSE_LEAD {
        Since::Beginning
    } else if step.1 > whole.max(ramp) + COURSE_LEAD {
        let times = |of: &dyn Fn(usize) -> bool| {
            cells.cells.iter().filter(|c| of(c.recording)).map(|c| c.time).collect::<Vec<f64>>()
        };
        let first = times(&|r| r == step.0).into_iter().fold(f64::INFINITY, f64::min).min(cells.duration);
        let last = times(&|r| r < step.0).into_iter().fold(0.0, f64::max);
        Since::From(moment(cells, [first, last, first]))
    } else if ramp > whole.max(step.1) + COURSE_LEAD {
        Since::Gradual(moment(cells, [0.0; 3]))
    } else {
        Since::NotDetermined
    }
}

fn places(cells: &Cells) -> Vec<Place> {
    // Energy by certainty, as everywhere.
    let energy = |i: usize| cells.difference[i].powi(2) / cells.variance[i];
    let total: f64 = (0..cells.cells.len()).map(energy).sum();
    let count = cells.cells.len() as f64;
    let mut all = Vec::new();
    let mut add = |coordinate: &str, unit: &str, at: f64, own: &dyn Fn(usize) -> bool| {
        let members: Vec<usize> = (0..cells.cells.len()).filter(|i| own(*i)).collect();
        let share = members.iter().map(|i| energy(*i)).sum::<f64>() / total;
        let rows = members.len() as f64 / count;
        if share > LOCALISE_STANDS_OUT * rows && rows < 1.0 {
            all.push(Place {
                coordinate: coordinate.into(),
                from: at,
                to: at,
                share,
                rows,
                unit: unit.into(),
            });
        }
    };
    for (level, pressure) in cells.levels.iter().enumerate() {
        add("pressure", "kPa", pressure / 1e3, &|i| cells.cells[i].key.0 as usize == level);
    }
    for direction in [1.0, -1.0] {
        add("direction", "", direction, &|i| cells.cells[i].direction * direction > 0.0);
    }
    for recording in 0..cells.names.len() {
        add("recording", "", (recording + 1) as f64, &|i| cells.cells[i].recording == recording);
    }
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all.truncate(6);
    all
}

fn changed(cells: &Cells, accepted: &Accepted) -> Changed {
    let about = accepted.fit.change.about();
    let (alone, _) = unseen(cells, &[accepted]);
    // The catalogue counts the pressure that a gauge lacks, a change what it reads too much.
    let sign = if about.changed.correctable { accepted.fit.change.sign() } else { 1.0 };
    let parameters = accepted.fit.parameters.iter();
    Changed {
        change: accepted.fit.change,
        effect: about.name.into(),
        probability: accepted.probability,
        class_probability: accepted.class_probability,
        class: about.changed.class_in_strokes,
        share_explained: alone.share().clamp(0.0, 1.0),
        parameters: parameters
            .map(|(name, unit, value, std)| size((name, unit), sign * *value, *std, 1e6, CATALOGUE_LAW_ERROR))
            .collect(),
        confusable_with: accepted.competitors.iter().map(|c| c.name().to_owned()).collect(),
        since: since(cells, &accepted.fit),
        owner: about.changed.owner,
        correction: accepted.fit.change.is_bench(),
        rms_N: rms(&accepted.fit.trace),
    }
}

fn curves(cells: &Cells, accepted: &[Accepted]) -> Vec<Curve> {
    let mut all = Vec::new();
    for (level, pressure) in cells.levels.iter().enumerate() {
        let mut sums: BTreeMap<usize, [[f64; 5]; 2]> = BTreeMap::new();
        for (i, c) in cells.cells.iter().enumerate().filter(|(_, c)| c.key.0 as usize == level) {
            let explained: f64 = accepted.iter().map(|a| a.fit.trace[i]).sum();
            let s = &mut sums.entry(c.key.2.min(CATALOGUE_BINS)).or_default()[usize::from(!c.key.1)];
            let row = [1.0, c.stroke, c.force, cells.difference[i], explained];
            s.iter_mut().zip(row).for_each(|(to, v)| *to += v);
        }
        let mut curve = Curve { title: format!("{:.0} kPa", pressure / 1e3), ..Curve::default() };
        for sides in sums.values() {
            let n = sides[0][0] + sides[1][0];
            curve.at.push((sides[0][1] + sides[1][1]) / n * 1e3);
            for (side, s) in sides.iter().enumerate() {
                let mean = |v: f64| if s[0] > 0.0 { v / s[0] } else { f64::NAN };
                curve.after[side].push(mean(s[2]));
                curve.before[side].push(mean(s[2]) - mean(s[3]));
                curve.difference[side].push(mean(s[3]));
                curve.explained[side].push(mean(s[4]));
            }
        }
        if !curve.at.is_empty() {
            all.push(curve);
        }
    }
    all
}

fn remarks(cells: &Cells) -> Vec<Remark> {
    let mut all = vec![Remark::CatalogueAssumed(CATALOGUE_USUAL)];
    if cells.slipped > 0 {
        all.push(Remark::SlippedRests(cells.slipped));
    }
    all
}

/// What was not compared.
fn not_comparable(cells: &Cells) -> Vec<NotComparable> {
    let mut all = vec![];
    if cells.ramps > 0.0 {
        all.push(NotComparable::Ramps { share: cells.ramps });
    }
    if cells.unmatched > 0 {
        all.push(NotComparable::States {
            share: cells.unmatched as f64 / (cells.unmatched + cells.cells.len()) as f64,
        });
    }
    all
}

/// The effects that were not accepted, with what could have been seen of them.
fn considered(weighed: &Weighed, prior: f64) -> Vec<Considered> {
    let open = |f: &&Fit| !weighed.accepted.iter().any(|a| a.fit.change == f.change);
    let p_of = |name: &str| weighed.probabilities.iter().find(|(n, _)| n == name).map_or(0.0, |(_, p)| *p);
    let required = detectable::required(detectable::odds(prior, weighed.alone.len()), 0.0);
    let one = |f: &Fit| {
        let p = p_of(f.change.name());
        let (_, unit, _, std) = f.parameters.first().copied().unwrap_or(("", "", 0.0, 0.0));
        Considered {
            effect: f.change.name().into(),
            gain: p,
            why_not: WhyNot::of(true, p),
            detectable: Some(detectable::size(std, required)).filter(|d| *d > 0.0 && d.is_finite()),
            unit: unit.into(),
        }
    };
    weighed.alone.iter().filter(open).map(one).collect()
}

/// The most probable causes that together have the probability of a set.
fn set(weighed: &Weighed) -> Vec<String> {
    let mut sum = 0.0;
    let set = weighed.probabilities.iter().take_while(|(_, p)| {
        let begun = sum < SET;
        sum += p;
        begun
    });
    set.map(|(n, _)| n.clone()).collect()
}

/// The size of each effect as the only one.
fn alone(weighed: &Weighed) -> Vec<(String, Size)> {
    let one = |f: &Fit| {
        let (name, unit, value, std) = f.parameters.first()?;
        Some((f.change.name().to_owned(), size((name, unit), *value, *std, 1e6, CATALOGUE_LAW_ERROR)))
    };
    weighed.alone.iter().filter_map(one).collect()
}

/// Everything that was found, as the answer.
pub(super) fn answer(cells: &Cells, weighed: &Weighed, prior: f64) -> ChangeReport {
    let accepted: Vec<&Accepted> = weighed.accepted.iter().collect();
    let (unseen, where_shown) = unseen(cells, &accepted);
    let verdict = super::super::report::verdict(weighed.none, accepted.len(), weighed.last_none < NAMED);
    let places = if verdict == Verdict::Consistent { Vec::new() } else { places(cells) };
    let noise = cells.spread;
    let probability = |(cause, p): &(String, f64)| Probability { cause: cause.clone(), probability: *p };
    ChangeReport {
        muscle: None,
        samples: 0,
        verdict,
        noise_N: noise,
        misfit_rms_N: unseen.before,
        largest_force_N: cells.largest,
        unexplained: left(verdict, &unseen, &places),
        r#where: places,
        missing: accepted.iter().map(|a| changed(cells, a)).collect(),
        held_out: HeldOut {
            split: if unseen.held { Split::OtherRecordings } else { Split::None },
            rms_before_N: unseen.before,
            rms_after_N: unseen.after,
            share_where_shown: where_shown.share(),
            noise_N: noise,
        },
        considered: considered(weighed, prior),
        set: set(weighed),
        probabilities: weighed.probabilities.iter().map(probability).collect(),
        remarks: remarks(cells),
        reference: Reference {
            files: Vec::new(),
            table: None,
            samples: 0,
            repeatability_N: noise,
            repeatability_from: Repeatability::Measured,
            mounted_anew: true,
            not_comparable: not_comparable(cells),
        },
        alone: alone(weighed),
        curves: curves(cells, &weighed.accepted),
        abscissa: ("displacement", "mm"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tare_after_each_level_does_not_part_tares_from_levels() {
        let cell = |recording: usize, kind: i32| Cell {
            key: (0, true, 0, kind),
            recording,
            rows: vec![0],
            rest: 0,
            time: 0.0,
            force: 0.0,
            stroke: 0.0,
            direction: 1.0,
        };
        // Tare, level, tare, level, tare, level, tare.
        let cells: Vec<Cell> = (0..7).map(|r| cell(r, if r % 2 == 0 { VENTED } else { 0 })).collect();
        assert_eq!(together(&cells), [0, 0, 0, 1, 1, 2, 2]);
    }
}
