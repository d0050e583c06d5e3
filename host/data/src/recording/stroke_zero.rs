//! Where a stroke of arbitrary zero begins, found in a column of readings.

use crate::statistics::median;

/// The level that a column begins at: the median of the samples that stay within the noise of the first.
pub(super) fn first_level(column: &[f64]) -> f64 {
    let noise = super::noise::white_noise(&column[..column.len().min(4096)]);
    let mut start: Vec<f64> = match column.first() {
        Some(first) => {
            column.iter().take(50).take_while(|x| (*x - first).abs() <= 4.0 * noise).copied().collect()
        }
        None => return 0.0,
    };
    median(&mut start)
}

/// The smallest reading that a neighbour supports: a single wild one must not become the zero.
pub(super) fn smallest(column: &[f64]) -> f64 {
    let some = &column[..column.len().min(1 << 16)];
    let mut steps: Vec<f64> = some.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    if steps.is_empty() {
        return column.first().copied().unwrap_or(0.0);
    }
    let near = 3.0 * median(&mut steps) + 6.0 * super::noise::white_noise(some);
    let pairs = column.windows(2).filter(|w| (w[1] - w[0]).abs() <= near);
    pairs.map(|w| w[0].min(w[1])).fold(f64::INFINITY, f64::min)
}

/// The median stroke where the force is among its largest thousandth.
pub(super) fn at_largest(stroke: &[f64], force: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..force.len()).collect();
    let count = (force.len() / 1000).max(3).min(force.len());
    if count == 0 {
        return 0.0;
    }
    if count < order.len() {
        order.select_nth_unstable_by(count - 1, |a, b| force[*b].total_cmp(&force[*a]));
    }
    let mut top: Vec<f64> = order[..count].iter().map(|i| stroke[*i]).collect();
    median(&mut top)
}
