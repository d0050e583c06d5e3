//! What the resolution of the displacement is worth in force.

use crate::rows::Rows;

/// Root mean square error of the model's force by the steps in which the displacement is read, N: the slope of the force over stroke
/// times q/√12. Repeats of a stroke do not show it, as they are read in the same steps.
pub(crate) fn of_stroke(rows: &Rows) -> f64 {
    if rows.stroke_step <= 0.0 {
        return 0.0;
    }
    let used = rows.contexts().iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0);
    let (squares, count) =
        used.fold((0.0, 0_usize), |(sum, n), (context, _)| (sum + context.slope().powi(2), n + 1));
    (squares / count.max(1) as f64 / 12.0).sqrt() * rows.stroke_step
}
