//! Natural cubic splines over pressure, several curves on one set of nodes.
//!
//! A curve is given by its values at the nodes (that is what a fit finds and a table stores) and turned once into one
//! cubic per segment. Outside the nodes each curve keeps its value at the nearest one: anyone who wants a trend beyond the
//! tested pressures puts a node there.

use crate::scalar::Scalar;

/// The most nodes a table can have.
pub const MAX_NODES: usize = 16;

/// `a + u (b + u (c + u d))` with `u` the distance from the segment's lower node.
pub type Cubic<T> = [T; 4];

/// The cubics of the natural spline through `values` at increasing `nodes`, one per segment, handed to `segment` with its
/// number.
///
/// One node gives no segment; two give a straight line. The second derivative is continuous, and zero at both ends
/// (C. de Boor, *A Practical Guide to Splines*, chapter IV). `values` and `nodes` are of one length, at most
/// [`MAX_NODES`].
#[inline]
pub fn natural_cubic<T: Scalar>(nodes: &[T], values: &[T], segment: &mut dyn FnMut(usize, Cubic<T>)) {
    let n = nodes.len().min(values.len()).min(MAX_NODES);
    if n < 2 {
        return;
    }
    // Second derivatives m at the nodes, from the tridiagonal system, by elimination without pivoting (it is
    // diagonally dominant).
    let [two, six] = [2.0, 6.0].map(T::from_f32);
    let mut second = [T::ZERO; MAX_NODES];
    let mut upper = [T::ZERO; MAX_NODES];
    for i in 1..n - 1 {
        let before = nodes[i] - nodes[i - 1];
        let after = nodes[i + 1] - nodes[i];
        let bend = six * ((values[i + 1] - values[i]) / after - (values[i] - values[i - 1]) / before);
        let diagonal = two * (before + after) - before * upper[i - 1];
        upper[i] = after / diagonal;
        second[i] = (bend - before * second[i - 1]) / diagonal;
    }
    for i in (1..n - 1).rev() {
        let above = upper[i] * second[i + 1];
        second[i] -= above;
    }
    for i in 0..n - 1 {
        let h = nodes[i + 1] - nodes[i];
        let cubic = [
            values[i],
            (values[i + 1] - values[i]) / h - h * (two * second[i] + second[i + 1]) / six,
            second[i] / two,
            (second[i + 1] - second[i]) / (six * h),
        ];
        segment(i, cubic);
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

/// Where a cubic has no slope: `u = (−c₂ ∓ √(c₂² − 3 c₁ c₃)) / (3 c₃)`, without the difference of two nearly equal numbers. Places that it does
/// not have are not numbers, or not finite.
#[inline]
pub fn turns<T: Scalar>(c: &Cubic<T>) -> [T; 2] {
    let third = c[3] + c[3] + c[3];
    let square = c[2] * c[2] - c[1] * third;
    if !(square >= T::ZERO) {
        return [-(T::ONE / T::ZERO); 2];
    }
    // The compiler must see that it is not negative: only then the floating-point unit takes the root without a call.
    let root = square.at_least(T::ZERO).sqrt();
    let sum = if c[2] < T::ZERO { root - c[2] } else { -root - c[2] };
    [sum / third, c[1] / sum]
}

/// A cubic's value and slope together: Horner's rule and its derivative.
#[inline(always)]
pub fn value_and_slope<T: Scalar>(c: &Cubic<T>, u: T) -> (T, T) {
    let third = c[2] + u * c[3];
    let second = c[1] + u * third;
    let slope = second + u * (third + u * c[3]);
    (c[0] + u * second, slope)
}

/// The pieces that `n` nodes cut the line of pressures into: below the first, between each two, above the last.
pub const MAX_PIECES: usize = MAX_NODES + 1;

/// Search among the edges, with `$found!(piece)` for the result: three comparisons for a table of up to seven nodes, as most are, and up
/// to four more for a longer one. Written out, so that every index is a constant and needs no check.
macro_rules! search {
    ($edges:expr, $p:expr, $found:ident) => {{
        const { assert!(MAX_NODES == 16) };
        let below = |edge: T| !($p >= edge);
        macro_rules! half {
            ($edge:literal, $low:expr, $high:expr) => {
                if below($edges[$edge]) { $low } else { $high }
            };
        }
        macro_rules! last {
            ($edge:literal: $low:literal $high:literal) => {
                half!($edge, $found!($low), $found!($high))
            };
        }
        let long = || {
            half!(
                12,
                half!(10, half!(9, last!(8: 7 8), $found!(9)), last!(11: 10 11)),
                half!(14, last!(13: 12 13), half!(15, $found!(14), last!(16: 15 16)))
            )
        };
        half!(
            4,
            half!(2, last!(1: 0 1), last!(3: 2 3)),
            half!(6, last!(5: 4 5), half!(7, $found!(6), long()))
        )
    }};
}

/// Increasing nodes, and the search for the piece that a pressure lies in.
///
/// Outside the nodes lie two pieces more, in which curves stay what they are at the outer nodes: so evaluation is the same
/// everywhere, and knows no special case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nodes<T> {
    /// The ends of the pieces: `−∞`, the nodes, and infinity in all places behind them.
    edges: [T; MAX_PIECES + 1],
    count: usize,
}

impl<T: Scalar> Nodes<T> {
    /// None, for a place that is not filled yet.
    pub const NONE: Self = Self { edges: [T::ZERO; MAX_PIECES + 1], count: 0 };

    /// From increasing numbers; more than [`MAX_NODES`] are cut off.
    pub fn new(nodes: &[T]) -> Self {
        let count = nodes.len().min(MAX_NODES);
        let mut edges = [T::from_f32(f32::INFINITY); MAX_PIECES + 1];
        edges[0] = T::from_f32(f32::NEG_INFINITY);
        for (to, from) in edges[1..=count].iter_mut().zip(nodes) {
            *to = *from;
        }
        Self { edges, count }
    }

    /// The nodes.
    pub fn as_slice(&self) -> &[T] {
        &self.edges[1..=self.count]
    }

    /// The pressure that a piece's curves count from: its lower node, and the first node for the piece below it.
    pub fn origin(&self, piece: usize) -> T {
        self.edges[piece.max(1)]
    }

    /// The ends of a piece; infinite outside the nodes.
    #[inline(always)]
    pub fn bounds(&self, piece: usize) -> (T, T) {
        (self.edges[piece], self.edges[piece + 1])
    }

    /// The piece that `p` lies in: how many nodes lie at or below it. A pressure that is not a number lies below the first.
    #[inline(always)]
    pub fn place(&self, p: T) -> usize {
        macro_rules! number {
            ($piece:literal) => {
                $piece
            };
        }
        search!(self.edges, p, number)
    }

    /// What belongs to the piece that `p` lies in, of all pieces.
    #[inline(always)]
    pub fn choose<'a, P>(&self, p: T, pieces: &'a [P; MAX_PIECES]) -> &'a P {
        macro_rules! piece {
            ($piece:literal) => {
                &pieces[$piece]
            };
        }
        search!(self.edges, p, piece)
    }

    /// The cubics of all pieces of a curve that [`natural_cubic`] runs through `values` at these nodes.
    pub fn pieces(nodes: &[T], values: &[T]) -> [Cubic<T>; MAX_PIECES] {
        let mut pieces = [[T::ZERO; 4]; MAX_PIECES];
        each_piece(nodes, values, &mut |n, cubic| pieces[n] = cubic);
        pieces
    }
}

/// Hands each piece of a curve to `piece` with its number, as [`Nodes::pieces`] gives them; pieces behind the last node's are
/// left out.
#[inline]
pub fn each_piece<T: Scalar>(nodes: &[T], values: &[T], piece: &mut dyn FnMut(usize, Cubic<T>)) {
    let count = nodes.len().min(values.len()).min(MAX_NODES);
    if count == 0 {
        return;
    }
    piece(0, [values[0], T::ZERO, T::ZERO, T::ZERO]);
    natural_cubic(nodes, values, &mut |n, cubic| piece(n + 1, cubic));
    piece(count, [values[count - 1], T::ZERO, T::ZERO, T::ZERO]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nodes: &[f64], values: &[f64], p: f64) -> f64 {
        let places = Nodes::<f64>::new(nodes);
        let piece = places.place(p);
        value(&Nodes::<f64>::pieces(nodes, values)[piece], p - places.origin(piece))
    }

    #[test]
    fn it_passes_through_its_nodes_and_is_smooth_there() {
        let nodes = [1.0, 2.5, 3.0, 5.0, 8.0];
        let values = [0.3, -1.0, 2.0, 0.5, 4.0];
        let mut s = [[0.0; 4]; 4];
        natural_cubic(&nodes, &values, &mut |n, cubic| s[n] = cubic);
        for (n, v) in nodes.iter().zip(values) {
            assert!((at(&nodes, &values, *n) - v).abs() < 1e-12);
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
        for (p, expected) in SCIPY {
            let found = at(&nodes, &[0.0, 1.0, 0.0, 2.0], p);
            assert!((found - expected).abs() < 1e-12, "{p}: {found} not {expected}");
        }
    }
    const SCIPY: [(f64, f64); 3] =
        [(0.5, 0.728_260_869_565_217_2), (1.5, 0.565_217_391_304_347_8), (3.0, 0.347_826_086_956_521_7)];

    #[test]
    fn straight_lines_stay_straight_and_ends_are_held() {
        let (nodes, values) = ([1.0, 2.0, 4.0], [3.0, 5.0, 9.0]);
        for (p, expected) in [(3.3, 7.6), (0.0, 3.0), (9.0, 9.0), (1.0, 3.0), (4.0, 9.0)] {
            assert!((at(&nodes, &values, p) - expected).abs() < 1e-12, "at {p}");
        }
    }

    #[test]
    fn a_cubic_turns_where_its_slope_is_nothing() {
        let cubics = [
            [1.0, -3.0, 0.0, 1.0],
            [0.0, 2.0, -3.0, 0.5],
            [0.0, 2.0, 3.0, 0.5],
            [0.0, -2.0, 0.5, 0.0],
            [4.0, 1e-6, -1.0, 1e-9],
        ];
        for c in cubics {
            let mut found = 0;
            for u in turns(&c).into_iter().filter(|u| u.is_finite()) {
                let size = c[1].abs() + (2.0 * c[2] * u).abs() + (3.0 * c[3] * u * u).abs();
                assert!(slope(&c, u).abs() < 1e-12 * size, "{c:?} at {u}");
                found += 1;
            }
            let expected = if c[3] == 0.0 { 1 } else { 2 };
            assert_eq!(found, expected, "{c:?}");
        }
        assert!(turns(&[0.0, 1.0, 0.0, 1.0]).iter().all(|u| !(*u > 0.0)), "a cubic that only rises");
    }

    #[test]
    fn one_node_is_a_constant_and_sixteen_find_every_piece() {
        for p in [-1.0, 5.0, 7.0] {
            assert_eq!(at(&[5.0], &[2.5], p), 2.5);
        }
        let nodes: Vec<f64> = (0..MAX_NODES).map(|n| n as f64).collect();
        let places = Nodes::<f64>::new(&nodes);
        for n in 0..MAX_NODES {
            assert_eq!((places.place(n as f64 + 0.5), places.origin(n + 1)), (n + 1, n as f64));
            assert_eq!(places.bounds(n + 1).0, n as f64);
        }
        assert_eq!((places.place(-0.5), places.origin(0)), (0, 0.0));
        assert_eq!(places.place(f64::NAN), 0);
        assert_eq!(places.place(f64::INFINITY), MAX_NODES);
        assert_eq!(places.bounds(0), (f64::NEG_INFINITY, 0.0));
        assert_eq!(places.bounds(MAX_NODES), (15.0, f64::INFINITY));
    }

    #[test]
    fn value_and_slope_are_those_of_each_alone() {
        let c = [0.3, -1.7, 0.9, 2.2];
        for u in [-1.3, 0.0, 0.4, 2.0] {
            let (v, d) = value_and_slope(&c, u);
            assert!((v - value(&c, u)).abs() < 1e-12 && (d - slope(&c, u)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_piece_of_a_pressure_is_the_number_of_nodes_at_or_below_it() {
        for count in 1..=MAX_NODES {
            let values: [f64; MAX_NODES] = core::array::from_fn(|n| 10.0 * n as f64);
            let nodes = Nodes::new(&values[..count]);
            let numbers: [usize; MAX_PIECES] = core::array::from_fn(|n| n);
            for step in -3..400_i32 {
                let p = 0.5 * f64::from(step);
                let below = values[..count].iter().filter(|node| **node <= p).count();
                assert_eq!((nodes.place(p), *nodes.choose(p, &numbers)), (below, below), "{p} of {count}");
            }
            assert_eq!(nodes.place(f64::NAN), 0);
            assert_eq!(nodes.place(f64::INFINITY), MAX_NODES, "behind the last node all pieces are the same");
        }
    }
}
