//! Downsampling of long series to what a picture can show.
//!
//! A picture is some hundred pixels wide; a recording may have a million rows. What is drawn keeps every extreme, so a
//! spike of one sample stays visible.

/// Rows to draw of a line whose abscissa never decreases: in each of `columns` equal parts of the abscissa the first,
/// lowest, highest and last (the rule called M4: U. Jugel et al., *M4: a visualization-oriented time series data
/// aggregation*, VLDB 7 (2014), doi:10.14778/2732951.2732953).
///
/// Rows come back in order and without repetition. Rows where either number is not finite are kept, since they break a
/// line.
#[must_use]
pub fn extremes(x: &[f64], y: &[f64], columns: usize) -> Vec<usize> {
    let n = x.len().min(y.len());
    if n <= 4 * columns.max(1) {
        return (0..n).collect();
    }
    let (Some(first), Some(last)) =
        (x.iter().copied().find(|v| v.is_finite()), x[..n].iter().rev().copied().find(|v| v.is_finite()))
    else {
        return Vec::new();
    };
    let span = if last > first { last - first } else { 1.0 };
    let column_of = |v: f64| (((v - first) / span) * columns as f64) as usize;
    let mut kept = Vec::with_capacity(4 * columns);
    let mut start = 0;
    while start < n {
        if !(x[start].is_finite() && y[start].is_finite()) {
            // One break is enough, however many rows are missing.
            kept.push(start);
            while start < n && !(x[start].is_finite() && y[start].is_finite()) {
                start += 1;
            }
            continue;
        }
        let column = column_of(x[start]);
        let (mut low, mut high, mut end) = (start, start, start);
        while end < n && x[end].is_finite() && y[end].is_finite() && column_of(x[end]) == column {
            if y[end] < y[low] {
                low = end;
            }
            if y[end] > y[high] {
                high = end;
            }
            end += 1;
        }
        let mut four = [start, low.min(high), low.max(high), end - 1];
        four.sort_unstable();
        for i in four {
            if kept.last() != Some(&i) {
                kept.push(i);
            }
        }
        start = end;
    }
    kept
}

/// Rows to draw of a curve that turns back on itself, such as a hysteresis loop: at most about `target`, chosen by the
/// largest triangle they span with their neighbours (S. Steinarsson, *Downsampling time series for visual
/// representation*, University of Iceland, 2013). `x` and `y` are in pixels.
#[must_use]
pub(crate) fn triangles(x: &[f64], y: &[f64], target: usize) -> Vec<usize> {
    let n = x.len().min(y.len());
    if n <= target.max(3) {
        return (0..n).collect();
    }
    let buckets = target.max(3) - 2;
    let width = (n - 2) as f64 / buckets as f64;
    let edge = |b: usize| 1 + (b as f64 * width) as usize;
    let mut kept = Vec::with_capacity(target + 1);
    kept.push(0);
    let mut last = 0;
    for bucket in 0..buckets {
        let (from, to) = (edge(bucket), edge(bucket + 1).min(n - 1));
        if from >= to {
            continue;
        }
        let (next_from, next_to) = (to, edge(bucket + 2).min(n).max(to + 1));
        let count = (next_to - next_from) as f64;
        let mean = |v: &[f64]| v[next_from..next_to].iter().sum::<f64>() / count;
        let (mx, my) = (mean(x), mean(y));
        let area = |i: usize| ((x[last] - mx) * (y[i] - y[last]) - (x[last] - x[i]) * (my - y[last])).abs();
        let mut best = from;
        let mut best_area = -1.0;
        for i in from..to {
            // A gap must stay a gap.
            if !(x[i].is_finite() && y[i].is_finite()) {
                best = i;
                break;
            }
            let a = area(i);
            if a > best_area {
                (best, best_area) = (i, a);
            }
        }
        kept.push(best);
        if x[best].is_finite() && y[best].is_finite() {
            last = best;
        }
    }
    kept.push(n - 1);
    kept
}

/// Rows to draw of a cloud of points: one for each cell of `cell` pixels, and coarser cells until at most `target`
/// remain. `x` and `y` are in pixels.
#[must_use]
pub(crate) fn cells(x: &[f64], y: &[f64], cell: f64, target: usize) -> Vec<usize> {
    let n = x.len().min(y.len());
    let mut size = cell.max(1e-3);
    loop {
        let mut seen = std::collections::HashSet::new();
        let kept: Vec<usize> = (0..n)
            .filter(|i| x[*i].is_finite() && y[*i].is_finite())
            .filter(|i| seen.insert(((x[*i] / size).floor() as i64, (y[*i] / size).floor() as i64)))
            .collect();
        if kept.len() <= target.max(1) {
            return kept;
        }
        size *= 1.5;
    }
}

/// The points of a line that are needed so that none is farther than `tolerance` from it (D. H. Douglas and T. K. Peucker,
/// Cartographica 10 (1973) 112, doi:10.3138/FM57-6770-U75U-7727). All must be finite.
#[must_use]
pub(crate) fn needed(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    let n = points.len();
    if n < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; n];
    (keep[0], keep[n - 1]) = (true, true);
    let mut open = vec![(0, n - 1)];
    while let Some((from, to)) = open.pop() {
        let ((ax, ay), (bx, by)) = (points[from], points[to]);
        let (dx, dy) = (bx - ax, by - ay);
        let length = dx.hypot(dy);
        let mut far = (tolerance, 0);
        for (i, (x, y)) in points.iter().enumerate().take(to).skip(from + 1) {
            // Where both ends are one point (a closed loop), the distance from that point.
            let distance = if length > 1e-9 {
                ((x - ax) * dy - (y - ay) * dx).abs() / length
            } else {
                (x - ax).hypot(y - ay)
            };
            if distance > far.0 {
                far = (distance, i);
            }
        }
        if far.1 > 0 {
            keep[far.1] = true;
            open.extend([(from, far.1), (far.1, to)]);
        }
    }
    points.iter().zip(keep).filter_map(|(p, k)| k.then_some(*p)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_sample_among_a_million_survives() {
        let n = 1_000_000;
        let x: Vec<f64> = (0..n).map(|i| i as f64 * 1e-3).collect();
        let mut y: Vec<f64> = x.iter().map(|t| (t * 0.05).sin()).collect();
        y[654_321] = 9.0;
        let kept = extremes(&x, &y, 600);
        assert!(kept.len() <= 4 * 601, "{}", kept.len());
        assert!(kept.contains(&654_321));
        assert!(kept.windows(2).all(|w| w[0] < w[1]));
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, n - 1));
    }

    #[test]
    fn gaps_stay_gaps() {
        let x: Vec<f64> = (0..10_000).map(f64::from).collect();
        let mut y = vec![1.0; 10_000];
        y[5_000..6_000].fill(f64::NAN);
        let kept = extremes(&x, &y, 50);
        assert_eq!(kept.iter().filter(|i| y[**i].is_nan()).count(), 1);
        assert!(triangles(&x, &y, 100).iter().any(|i| y[*i].is_nan()));
    }

    #[test]
    fn a_loop_keeps_its_extent() {
        let n = 50_000;
        let angle = |i: usize| i as f64 * 6.0 * std::f64::consts::PI / n as f64;
        let x: Vec<f64> = (0..n).map(|i| 300.0 * angle(i).cos()).collect();
        let y: Vec<f64> = (0..n).map(|i| 200.0 * angle(i).sin()).collect();
        let kept = triangles(&x, &y, 400);
        assert!(kept.len() <= 400);
        let top = kept.iter().map(|i| y[*i]).fold(f64::MIN, f64::max);
        assert!(top > 199.5, "{top}");
    }

    #[test]
    fn a_cloud_is_cut_to_size_and_loses_no_outlier() {
        let mut x: Vec<f64> = (0..200_000).map(|i| f64::from(i % 500)).collect();
        let mut y: Vec<f64> = (0..200_000).map(|i| f64::from(i / 500)).collect();
        x.push(9_999.0);
        y.push(9_999.0);
        let kept = cells(&x, &y, 1.0, 3_000);
        assert!(kept.len() <= 3_000);
        assert!(kept.contains(&200_000));
    }

    #[test]
    fn straight_parts_need_only_their_ends() {
        let mut points: Vec<(f64, f64)> = (0..=100).map(|i| (f64::from(i), 3.0 * f64::from(i))).collect();
        points.extend((1..=100).map(|i| (100.0 + f64::from(i), 300.0)));
        assert_eq!(needed(&points, 0.1), [(0.0, 0.0), (100.0, 300.0), (200.0, 300.0)]);
        // Back and forth along one line: the far end must stay.
        let back: Vec<(f64, f64)> = (0..=20).map(|i| (10.0 - f64::from((i - 10_i32).abs()), 0.0)).collect();
        assert_eq!(needed(&back, 0.1), [(0.0, 0.0), (10.0, 0.0), (0.0, 0.0)]);
    }

    #[test]
    fn short_and_odd_input_is_left_alone() {
        assert!(extremes(&[], &[], 10).is_empty());
        assert_eq!(extremes(&[1.0], &[f64::NAN], 10), [0]);
        assert_eq!(triangles(&[1.0, 2.0], &[1.0, 2.0], 0), [0, 1]);
        assert!(cells(&[f64::NAN], &[1.0], 0.0, 0).is_empty());
    }
}
