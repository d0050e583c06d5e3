//! Natural cubic splines over pressure, several curves on one set of nodes.
//!
//! A curve is given by its values at the nodes (that is what a fit finds and a table stores) and turned once into one
//! cubic per segment. Outside the nodes each curve keeps its value at the nearest one: whoever wants a trend beyond the
//! tested pressures puts a node there.

use crate::scalar::Scalar;

/// The most nodes a table can have.
pub const MAX_NODES: usize = 16;

/// `a + u (b + u (c + u d))` with `u` the distance from the segment's lower node.
pub type Cubic<T> = [T; 4];

/// The cubics of the natural spline through `values` at increasing `nodes`, one per segment, into `segments`.
///
/// One node gives no segment; two give a straight line. The second derivative is continuous, and zero at both ends
/// (C. de Boor, *A Practical Guide to Splines*, chapter IV). `values` and `nodes` are of one length, at most
/// [`MAX_NODES`]; `segments` holds at least one less. Computed in double precision.
pub fn natural_cubic(nodes: &[f64], values: &[f64], segments: &mut [Cubic<f64>]) {
    let n = nodes.len().min(values.len()).min(MAX_NODES);
    if n < 2 {
        return;
    }
    // Second derivatives m at the nodes, from the tridiagonal system, by elimination without pivoting (it is
    // diagonally dominant).
    let mut second = [0.0_f64; MAX_NODES];
    let mut upper = [0.0_f64; MAX_NODES];
    for i in 1..n - 1 {
        let before = nodes[i] - nodes[i - 1];
        let after = nodes[i + 1] - nodes[i];
        let bend = 6.0 * ((values[i + 1] - values[i]) / after - (values[i] - values[i - 1]) / before);
        let diagonal = 2.0 * (before + after) - before * upper[i - 1];
        upper[i] = after / diagonal;
        second[i] = (bend - before * second[i - 1]) / diagonal;
    }
    for i in (1..n - 1).rev() {
        second[i] -= upper[i] * second[i + 1];
    }
    for i in 0..(n - 1).min(segments.len()) {
        let h = nodes[i + 1] - nodes[i];
        segments[i] = [
            values[i],
            (values[i + 1] - values[i]) / h - h * (2.0 * second[i] + second[i + 1]) / 6.0,
            second[i] / 2.0,
            (second[i + 1] - second[i]) / (6.0 * h),
        ];
    }
}

/// The value of a cubic.
#[inline]
pub fn value<T: Scalar>(c: &Cubic<T>, u: T) -> T {
    c[0] + u * (c[1] + u * (c[2] + u * c[3]))
}

/// The slope of a cubic.
#[inline]
pub fn slope<T: Scalar>(c: &Cubic<T>, u: T) -> T {
    let twice = c[2] + c[2];
    let thrice = c[3] + c[3] + c[3];
    c[1] + u * (twice + u * thrice)
}

/// Increasing nodes, and the search for the segment a pressure lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nodes<T> {
    at: [T; MAX_NODES],
    count: usize,
}

/// Where a pressure lies on the nodes: in segment `index`, `offset` above its lower node; clamped to the ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place<T> {
    /// The segment, or 0 where there is but one node.
    pub index: usize,
    /// Distance above the segment's lower node.
    pub offset: T,
    /// Whether the pressure lay outside and was moved to the nearest node.
    pub clamped: bool,
}

impl<T: Scalar> Nodes<T> {
    /// From increasing numbers; more than [`MAX_NODES`] are cut off.
    pub fn new(nodes: &[f64]) -> Self {
        let count = nodes.len().min(MAX_NODES);
        let mut at = [T::ZERO; MAX_NODES];
        for (to, from) in at.iter_mut().zip(nodes) {
            *to = T::from_f64(*from);
        }
        Self { at, count }
    }

    /// The nodes.
    pub fn as_slice(&self) -> &[T] {
        &self.at[..self.count]
    }

    /// The number of segments between them, at least 1 for the purpose of storage.
    pub fn segments(&self) -> usize {
        self.count.saturating_sub(1).max(1)
    }

    /// The segment that `p` lies in.
    #[inline(always)]
    pub fn place(&self, p: T) -> Place<T> {
        let last = self.segments() - 1;
        let mut index = 0;
        while index < last && p >= self.at[index + 1] {
            index += 1;
        }
        let offset = p - self.at[index];
        let width = if self.count > 1 { self.at[index + 1] - self.at[index] } else { T::ZERO };
        if offset < T::ZERO {
            Place { index, offset: T::ZERO, clamped: true }
        } else if offset > width {
            Place { index, offset: width, clamped: true }
        } else {
            Place { index, offset, clamped: false }
        }
    }

    /// The ends of segment `index`.
    #[inline]
    pub fn bounds(&self, index: usize) -> (T, T) {
        let lower = self.at[index];
        (lower, if index + 1 < self.count { self.at[index + 1] } else { lower })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nodes: &[f64], segments: &[Cubic<f64>], p: f64) -> f64 {
        let place = Nodes::<f64>::new(nodes).place(p);
        value(&segments[place.index], place.offset)
    }

    #[test]
    fn it_passes_through_its_nodes_and_is_smooth_there() {
        let nodes = [1.0, 2.5, 3.0, 5.0, 8.0];
        let values = [0.3, -1.0, 2.0, 0.5, 4.0];
        let mut s = [[0.0; 4]; 4];
        natural_cubic(&nodes, &values, &mut s);
        for (n, v) in nodes.iter().zip(values) {
            assert!((at(&nodes, &s, *n) - v).abs() < 1e-12);
        }
        for i in 0..3 {
            let h = nodes[i + 1] - nodes[i];
            assert!((slope(&s[i], h) - s[i + 1][1]).abs() < 1e-12);
            assert!((2.0 * s[i][2] + 6.0 * s[i][3] * h - 2.0 * s[i + 1][2]).abs() < 1e-12);
        }
        assert!(s[0][2].abs() < 1e-12, "no curvature at the lower end");
    }

    #[test]
    fn reference_values_of_an_independent_implementation() {
        // scipy.interpolate.CubicSpline([0,1,2,4], [0,1,0,2], bc_type="natural") at 0.5, 1.5, 3.0
        let nodes = [0.0, 1.0, 2.0, 4.0];
        let mut s = [[0.0; 4]; 3];
        natural_cubic(&nodes, &[0.0, 1.0, 0.0, 2.0], &mut s);
        for (p, expected) in SCIPY {
            assert!(
                (at(&nodes, &s, p) - expected).abs() < 1e-12,
                "{p}: {} not {expected}",
                at(&nodes, &s, p)
            );
        }
    }
    const SCIPY: [(f64, f64); 3] =
        [(0.5, 0.728_260_869_565_217_2), (1.5, 0.565_217_391_304_347_8), (3.0, 0.347_826_086_956_521_7)];

    #[test]
    fn straight_lines_stay_straight_and_ends_are_held() {
        let nodes = [1.0, 2.0, 4.0];
        let mut s = [[0.0; 4]; 2];
        natural_cubic(&nodes, &[3.0, 5.0, 9.0], &mut s);
        assert!((at(&nodes, &s, 3.3) - 7.6).abs() < 1e-12);
        assert!((at(&nodes, &s, 0.0) - 3.0).abs() < 1e-12);
        assert!((at(&nodes, &s, 9.0) - 9.0).abs() < 1e-12);
        assert!(Nodes::<f64>::new(&nodes).place(9.0).clamped);
    }
}
