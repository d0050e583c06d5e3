//! Two changes that explain the difference together, where one after the other does not: the first name that is found may be one that
//! imitates both.

use super::cells::Cell;
use super::contrast::Contrast;
use super::criteria::{PAIRS_TRIED, SIZES};
use super::shapes::Change;
use super::time_course;
use super::weighing::{Round, Weighing, weigh};

/// Two changes, and the weighing of each where the other one is taken out.
pub(super) struct Pair {
    pub changes: [Change; 2],
    pub rounds: [Round; 2],
    /// Without the other one.
    pub rests: [Contrast; 2],
}

/// Pairs by falling log evidence: of one change alone and of the other beside it.
fn ranked(cells: &[Cell], contrast: &Contrast, by: Weighing<'_>, first: &Round) -> Vec<(f64, usize, Change)> {
    let scale = contrast.scale();
    let sizes = SIZES.map(|s| s * by.surface.largest);
    let mut all = Vec::new();
    for (i, (one, time_course)) in first.time_courses.iter().enumerate() {
        let rest = contrast.without_shapes(std::slice::from_ref(&time_course.shape));
        for (other, _) in first.time_courses.iter().filter(|o| o.0 != *one) {
            let candidate = time_course::candidate(cells, *other);
            let beside = candidate.and_then(|c| time_course::of(cells, &rest, &c, scale, &sizes));
            all.extend(beside.map(|b| (time_course.log + b.log, i, *other)));
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all
}

/// The best pair of which each change leads where the other one is taken out.
pub(super) fn search(cells: &[Cell], contrast: &Contrast, by: Weighing<'_>, first: &Round) -> Option<Pair> {
    let without = |round: &Round, change: Change| {
        let time_course = round.time_courses.iter().find(|c| c.0 == change)?;
        Some(contrast.without_shapes(std::slice::from_ref(&time_course.1.shape)))
    };
    let leads = |round: &Round, like: Change| -> Option<Change> {
        let leader = round.posterior.leader()?.0;
        (!leader.is_lag() && leader.class() == like.class()).then_some(leader)
    };
    let mutual = |(_, i, other): &(f64, usize, Change)| -> Option<Pair> {
        let one = first.time_courses[*i].0;
        let second = weigh(cells, &without(first, one)?, by);
        let other = leads(&second, *other).filter(|other| *other != one)?;
        let without_other = without(&second, other)?;
        let again = weigh(cells, &without_other, by);
        let one = leads(&again, one).filter(|one| *one != other)?;
        let without_one = without(&again, one)?;
        let second = weigh(cells, &without_one, by);
        let other = leads(&second, other).filter(|other| *other != one)?;
        Some(Pair { changes: [one, other], rounds: [again, second], rests: [without_other, without_one] })
    };
    ranked(cells, contrast, by, first).iter().take(PAIRS_TRIED).find_map(mutual)
}
