//! Where the difference is concentrated, and since when.

use nalgebra::DVector;

use super::answer::{Place, Since};
use super::cells::Cell;
use super::contrast::{Contrast, evidence};
use super::criteria::{CELLS, COURSE_LEAD, LOCALISE_STANDS_OUT, SIZES};
use super::isometric::{Accepted, Analysis};
use super::shapes::Change;
use super::slip::rms_after;

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
    // Parts of one motion are no recordings.
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

/// Whether an accepted change was there from the first recording of AFTER, began at one, or grew.
pub(super) fn since(analysis: &Analysis, accepted: &Accepted) -> Since {
    match accepted.change {
        Change::ForceDrift => return Since::Gradual,
        Change::EndSlip => {
            let start = analysis.first.slip.as_ref().map_or(0.0, |s| s.start);
            return Since::From {
                recording: recording_at(analysis, start),
                moment: start * analysis.runs.duration,
            };
        }
        Change::SensorDelay | Change::PressureSensorLag => return Since::NotDetermined,
        _ => {}
    }
    let cells = &analysis.cells;
    let others: Vec<DVector<f64>> =
        analysis.accepted.iter().filter(|a| a.change != accepted.change).map(|a| a.shape.clone()).collect();
    let contrast: Contrast = analysis.contrast.without_shapes(&others);
    let scale = contrast.without_shapes(std::slice::from_ref(&accepted.shape)).scale();
    let sizes = SIZES.map(|s| s * analysis.surface.largest);
    let weigh = |factor: &dyn Fn(&Cell) -> f64| {
        let shape = DVector::from_iterator(
            cells.len(),
            cells.iter().zip(accepted.shape.iter()).map(|(c, s)| s * factor(c)),
        );
        let rms = rms_after(cells, &shape);
        if !(rms > 0.0) {
            return f64::NEG_INFINITY;
        }
        let (a, b) = contrast.products(&(shape / rms));
        evidence(a, b, scale, &sizes)
    };
    let whole = weigh(&|_| 1.0);
    let ramp = weigh(&|c| c.means.clock);
    let starts = analysis.runs.side(true).skip(1).map(|r| r.since_after / analysis.runs.duration.max(1e-9));
    let step = starts
        .map(|start| (start, weigh(&|c| f64::from(u8::from(c.means.clock >= start)))))
        .fold((0.0, f64::NEG_INFINITY), |best, one| if one.1 > best.1 { one } else { best });
    if whole > step.1.max(ramp) + COURSE_LEAD {
        Since::Beginning
    } else if step.1 > whole.max(ramp) + COURSE_LEAD {
        Since::From { recording: recording_at(analysis, step.0), moment: step.0 * analysis.runs.duration }
    } else if ramp > whole.max(step.1) + COURSE_LEAD {
        Since::Gradual
    } else {
        Since::NotDetermined
    }
}
