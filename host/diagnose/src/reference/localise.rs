//! Where the difference is concentrated, and in which recording a change began.

use nalgebra::DVector;

use super::answer::{Moment, Place, Since};
use super::cells::Cell;
use super::criteria::{CELLS, LOCALISE_STANDS_OUT};
use super::isometric::Analysis;
use super::naming::Accepted;
use super::shapes::Course;

/// Shares of the energy by mounting, pressure, direction and recording, those that stand out.
pub(super) fn places(analysis: &Analysis, difference: &DVector<f64>, rest_length: Option<f64>) -> Vec<Place> {
    let after: Vec<&Cell> = analysis.cells.iter().filter(|c| c.after).collect();
    let total = difference.norm_squared();
    if !(total > 0.0) {
        return Vec::new();
    }
    let share = |of: &dyn Fn(&Cell) -> bool| {
        let mine = after.iter().zip(difference.iter()).filter(|(c, _)| of(c));
        let (energy, count) = mine.fold((0.0, 0.0), |(e, n), (_, d)| (e + d * d, n + 1.0));
        (energy / total, count / after.len() as f64)
    };
    let mut all = Vec::new();
    let mut add = |coordinate: &str, unit: &str, from: f64, to: f64, (share, part): (f64, f64)| {
        if share > LOCALISE_STANDS_OUT * part && part < 1.0 {
            all.push(Place { coordinate: coordinate.into(), from, to, unit: unit.into(), share, rows: part });
        }
    };
    for (direction, _) in [(1.0, 0), (-1.0, 0)] {
        add("direction", "", direction, direction, share(&|c| c.direction == direction));
    }
    let step = (analysis.surface.high - analysis.surface.low) / CELLS as f64;
    for bin in 0..CELLS {
        let from = analysis.surface.low + step * bin as f64;
        add("pressure", "kPa", from / 1e3, (from + step) / 1e3, share(&|c| c.bin == bin));
    }
    for (m, stroke) in analysis.runs.strokes.iter().enumerate() {
        if let Some(rest) = rest_length.filter(|_| analysis.runs.strokes.len() > 1) {
            add("contraction", "", stroke / rest, stroke / rest, share(&|c| c.mounting == m));
        }
    }
    let first = analysis.runs.side(false).count();
    // Parts of one motion are not recordings.
    let last = if analysis.runs.moving { first } else { analysis.runs.runs.len() };
    for index in first..last {
        let number = (index - first + 1) as f64;
        add("recording", "", number, number, share(&|c| c.run == index));
    }
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all.truncate(6);
    all
}

/// Which recording of AFTER a moment on its clock lies in.
fn recording_at(analysis: &Analysis, clock: f64) -> String {
    let at = clock * analysis.runs.duration;
    let mut name = String::new();
    for run in analysis.runs.side(true) {
        // A moment between two recordings belongs to the later one.
        if run.since_after <= at + 1e-6 * analysis.runs.duration || name.is_empty() {
            name.clone_from(&run.name);
        }
    }
    name
}

/// Whether an accepted change was there from the first recording of AFTER, began at a moment, or grew.
pub(super) fn since(analysis: &Analysis, accepted: &Accepted) -> Since {
    let Some(time_course) = accepted.time_course.as_ref().filter(|c| c.sure) else {
        return Since::NotDetermined;
    };
    let seconds = |clock: f64| clock * analysis.runs.duration;
    let moment = Moment {
        recording: recording_at(analysis, time_course.start.at),
        moment: seconds(time_course.start.at),
        low: seconds(time_course.start.low),
        high: seconds(time_course.start.high),
    };
    match time_course.kind {
        Course::Whole => Since::Beginning,
        Course::Step => Since::From(moment),
        Course::Ramp => Since::Gradual(moment),
    }
}
