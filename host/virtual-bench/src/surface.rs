//! The muscle's quasi-static force by virtual work.
//!
//! The muscle takes the shape that makes `Π = U − P V` least at its length, and pulls with `F = dΠ/dL` (of the work `P dV` that
//! the air does, `dU` is stored and `−F dL` given away). Being at the minimum, the shape's own coordinates do not enter the
//! derivative. Two shape coordinates may be free:
//!
//! - `w`, the part of each half in which the braid tapers from the fitting's radius to the middle's (a parabola in the fibre's
//!   own coordinate, solved with the inextensible fibre slice by slice): [`Shape::ends`];
//! - `e`, the stretch of an elastic fibre: [`Shape::fibre_stiffness`].
//!
//! Without either the muscle is a cylinder, F is linear in P, and the derivative is analytic. Results are tabulated once per
//! muscle over pressure and length; a look-up is two short spline evaluations.

use crate::tube::{Geometry, Stored, Tube};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// How far the muscle departs from a cylinder of inextensible fibres.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Shape {
    /// How firmly the fittings hold the braid's radius, 0 (the ends widen with the middle: a cylinder) to 1 (rigid fittings).
    pub ends: f64,
    /// Stiffness of all fibres together against being stretched, N per unit of stretch; `None` for inextensible fibres.
    pub fibre_stiffness: Option<f64>,
}

/// One value of the two parts of the force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Parts {
    /// Area on which the pressure pulls, m².
    pub area: f64,
    /// What the stored energy pulls with, N; negative in contraction.
    pub elastic: f64,
}

/// Tabulated quasi-static force of one muscle.
#[derive(Debug, Clone)]
pub struct Surface {
    first: f64,
    pitch: f64,
    pressure_pitch: f64,
    /// Per pressure node, area and elastic force along the braid's radius.
    rows: Vec<(Spline, Spline)>,
    contact: Spline,
    push: Spline,
    stretch: Spline,
    geometry: Geometry,
}

/// Nodes along the braid's radius.
const LENGTH_NODES: usize = 97;
/// Nodes along the pressure, where the force is not linear in it.
const PRESSURE_NODES: usize = 9;

impl Surface {
    /// Tabulate a muscle up to `max_pressure` (Pa) and from `extension` times its rest length down to `shortest` times it.
    pub fn new(geometry: Geometry, tube: Tube, shape: Shape, max_pressure: f64, shortest: f64) -> Self {
        let l0 = geometry.rest_length;
        let longest = (l0 * 1.02).min(geometry.fibre() * 0.5 + l0 * 0.5);
        // Nodes are equally spaced in the braid's radius: against the length everything bends sharply near rest.
        // Beyond a slight extension the braid would crush the bladder: the force continues linearly there.
        let first = geometry.braid_radius(longest).max(0.85 * geometry.radius);
        let pitch =
            (geometry.braid_radius(l0 * shortest.clamp(0.5, 0.97)) - first) / (LENGTH_NODES - 1) as f64;
        let at = |i: usize| geometry.length_at(first + pitch * i as f64);
        let cylinder = shape.ends <= 0.0 && shape.fibre_stiffness.is_none();
        let nodes = if shape.fibre_stiffness.is_none() { 1 } else { PRESSURE_NODES };
        let pressure_pitch = 1.1 * max_pressure / (PRESSURE_NODES - 1) as f64;
        let spline = |f: &dyn Fn(f64) -> f64| Spline::new((0..LENGTH_NODES).map(|i| f(at(i))).collect());
        let rows = (0..nodes)
            .map(|j| {
                let parts: Vec<Parts> = (0..LENGTH_NODES)
                    .map(|i| {
                        if cylinder {
                            cylinder_parts(&geometry, &tube, at(i))
                        } else {
                            relaxed_parts(&geometry, &tube, shape, at(i), pressure_pitch * j as f64)
                        }
                    })
                    .collect();
                (
                    Spline::new(parts.iter().map(|p| p.area).collect()),
                    Spline::new(parts.iter().map(|p| p.elastic).collect()),
                )
            })
            .collect();
        let stored = |l: f64| tube.stored(l, geometry.braid_radius(l));
        let contact = |l: f64| {
            let r = geometry.braid_radius(l).max(1e-9);
            (stored(l).by_radius / (2.0 * PI * r * l)).max(0.0)
        };
        Self {
            first,
            pitch,
            pressure_pitch,
            rows,
            contact: spline(&contact),
            push: spline(&|l| stored(l).by_length - contact(l) * PI * geometry.braid_radius(l).powi(2)),
            stretch: spline(&|l| stored(l).stretch),
            geometry,
        }
    }

    fn place(&self, length: f64) -> f64 {
        (self.geometry.braid_radius(length) - self.first) / self.pitch
    }

    /// The two parts of the force at pressure `p` (Pa) and length `length` (m), the bladder lying against the braid.
    pub fn parts(&self, p: f64, length: f64) -> Parts {
        let u = self.place(length);
        let row = |j: usize| {
            let (area, elastic) = &self.rows[j];
            (area.at(u), elastic.at(u))
        };
        if self.rows.len() == 1 {
            let (area, elastic) = row(0);
            return Parts { area, elastic };
        }
        // Catmull–Rom over the pressure: smooth, and exact where the force is linear.
        let last = self.rows.len() - 1;
        let s = (p / self.pressure_pitch).clamp(0.0, last as f64);
        let j = (s as usize).min(last - 1);
        let t = s - j as f64;
        let (a, b) = (row(j), row(j + 1));
        let before = if j > 0 { row(j - 1) } else { (2.0 * a.0 - b.0, 2.0 * a.1 - b.1) };
        let after = if j + 2 <= last { row(j + 2) } else { (2.0 * b.0 - a.0, 2.0 * b.1 - a.1) };
        let blend = |m: f64, a: f64, b: f64, n: f64| {
            a + 0.5 * t * (b - m + t * (2.0 * m - 5.0 * a + 4.0 * b - n + t * (3.0 * (a - b) + n - m)))
        };
        Parts { area: blend(before.0, a.0, b.0, after.0), elastic: blend(before.1, a.1, b.1, after.1) }
    }

    /// Pressure at which the bladder touches the braid at this length, Pa.
    pub fn contact_pressure(&self, length: f64) -> f64 {
        self.contact.at(self.place(length))
    }

    /// Force of the bladder alone at the moment it touches, N (its ends are pushed apart: negative).
    pub(crate) fn contact_force(&self, length: f64) -> f64 {
        self.push.at(self.place(length))
    }

    /// Mean of I1 − 3 over the wall: how far the rubber is stretched.
    pub fn stretch(&self, length: f64) -> f64 {
        self.stretch.at(self.place(length))
    }

    /// Inner volume at a length, m³, of the cylinder.
    pub fn volume(&self, tube_volume: f64, length: f64) -> f64 {
        (PI * self.geometry.braid_radius(length).powi(2) * length - tube_volume).max(1e-12)
    }
}

fn cylinder_parts(g: &Geometry, tube: &Tube, l: f64) -> Parts {
    let Stored { by_length, by_radius, .. } = tube.stored(l, g.braid_radius(l));
    Parts { area: g.pulling_area(l), elastic: by_length + by_radius * g.braid_radius_slope(l) }
}

/// Slices of a tapering end, per half.
const END_SLICES: usize = 12;
/// Length of a taper per depth.
pub(crate) const TAPER: f64 = 2.0;

/// Stored energy and outer volume of the muscle with tapering ends; the middle radius follows from the fibre's length.
fn tapered(g: &Geometry, tube: &Tube, ends: f64, e: f64, l: f64) -> (f64, f64) {
    let b = g.fibre() * (1.0 + e);
    let depth = (g.braid_radius(l) - g.radius).max(0.0) + 0.1 * g.radius;
    let w = (2.0 * TAPER * depth / g.rest_length).min(0.95);
    let turns = g.turns();
    let slice = |middle: f64, q: f64| {
        let fitting = middle - ends * (middle - g.radius);
        let r = middle - (middle - fitting) * q * q;
        let slope = 2.0 * (middle - fitting) * q / w;
        let z = 0.5 * (b * b - (2.0 * PI * turns * r).powi(2) - 4.0 * slope * slope).max(0.0).sqrt();
        (r, slope, z)
    };
    let node = |i: usize| (i as f64 + 0.5) / END_SLICES as f64;
    let length = |middle: f64| {
        let taper: f64 = (0..END_SLICES).map(|i| slice(middle, node(i)).2).sum::<f64>() / END_SLICES as f64;
        2.0 * (w * taper + (1.0 - w) * slice(middle, 0.0).2)
    };
    // The length falls as the middle widens; the secant stays inside a shrinking bracket.
    let straight = b / (2.0 * PI * turns);
    let (mut low, mut high) = (0.0, straight);
    let mut middle = ((b * b - l * l).max(0.0).sqrt() / (2.0 * PI * turns)).clamp(low, high);
    for _ in 0..60 {
        let excess = length(middle) - l;
        if excess.abs() < 1e-13 {
            break;
        }
        if excess > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
        let h = 1e-6 * straight;
        let fall = (length(middle + h) - length(middle - h)) / (2.0 * h);
        let next = middle - excess / fall;
        middle = if next > low && next < high { next } else { 0.5 * (low + high) };
    }
    let (mut energy, mut volume) = (0.0, 0.0);
    let mut add = |q: f64, part: f64| {
        let (r, slope, z) = slice(middle, q);
        let stretch = 2.0 * (z * z + slope * slope).sqrt() / g.rest_length;
        energy += part * tube.stored(stretch * tube.rest_length, r).energy;
        volume += part * PI * r * r * 2.0 * z;
    };
    for i in 0..END_SLICES {
        add(node(i), w / END_SLICES as f64);
    }
    add(0.0, 1.0 - w);
    (energy, volume)
}

fn relaxed_parts(g: &Geometry, tube: &Tube, shape: Shape, l: f64, p: f64) -> Parts {
    let state = |e: f64, l: f64| {
        if shape.ends > 0.0 {
            tapered(g, tube, shape.ends.min(1.0), e, l)
        } else {
            let b = g.fibre() * (1.0 + e);
            let r = (b * b - l * l).max(0.0).sqrt() / (2.0 * PI * g.turns());
            (tube.stored(l, r).energy, PI * r * r * l)
        }
    };
    let stretch = shape.fibre_stiffness.map_or(0.0, |k| {
        let potential = |e: f64| {
            let (energy, volume) = state(e, l);
            energy + 0.5 * k * g.fibre() * e * e - p * volume
        };
        least(&potential, -0.002, 0.1)
    });
    let h = 2e-5 * g.rest_length;
    let (up, down) = (state(stretch, l + h), state(stretch, l - h));
    Parts { area: -(up.1 - down.1) / (2.0 * h), elastic: (up.0 - down.0) / (2.0 * h) }
}

/// Where a function of one minimum is least (golden section).
fn least(f: &dyn Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    const G: f64 = 0.618_033_988_749_894_9;
    let (mut x, mut y) = (b - G * (b - a), a + G * (b - a));
    let (mut fx, mut fy) = (f(x), f(y));
    for _ in 0..28 {
        if fx < fy {
            (b, y, fy) = (y, x, fx);
            x = b - G * (b - a);
            fx = f(x);
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + G * (b - a);
            fy = f(y);
        }
    }
    0.5 * (a + b)
}

/// A natural cubic spline over equally spaced nodes 0, 1, 2, …; straight beyond them.
#[derive(Debug, Clone)]
struct Spline {
    y: Vec<f64>,
    /// Second derivatives divided by six.
    m: Vec<f64>,
}

impl Spline {
    fn new(y: Vec<f64>) -> Self {
        let n = y.len();
        let mut m = vec![0.0; n];
        let mut ratio = vec![0.0; n];
        for i in 1..n.saturating_sub(1) {
            let pivot = 4.0 - ratio[i - 1];
            ratio[i] = 1.0 / pivot;
            m[i] = (y[i - 1] - 2.0 * y[i] + y[i + 1] - m[i - 1]) / pivot;
        }
        for i in (1..n.saturating_sub(1)).rev() {
            m[i] -= ratio[i] * m[i + 1];
        }
        Self { y, m }
    }

    fn at(&self, u: f64) -> f64 {
        let last = self.y.len() - 1;
        let i = (u.max(0.0) as usize).min(last - 1);
        let (y0, y1, m0, m1) = (self.y[i], self.y[i + 1], self.m[i], self.m[i + 1]);
        let t = u - i as f64;
        if t < 0.0 {
            return y0 + t * (y1 - y0 - 2.0 * m0 - m1);
        }
        if t > 1.0 {
            return y1 + (t - 1.0) * (y1 - y0 + m0 + 2.0 * m1);
        }
        let s = 1.0 - t;
        s * y0 + t * y1 + (s * s * s - s) * m0 + (t * t * t - t) * m1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Hyperelastic;

    fn mini() -> (Geometry, Tube) {
        let g = Geometry::from_mm_deg(39.16, 77.4, 3.0, 0.5);
        let material = Hyperelastic::Yeoh { c10: 0.15e6, c20: 0.02e6, c30: 0.0 };
        (g, Tube { rest_length: g.rest_length, outer: 1.45e-3, wall: 0.5e-3, material })
    }

    #[test]
    fn rigid_ends_pull_less_and_vanish_as_they_soften() {
        let (g, tube) = mini();
        let (l, p) = (g.rest_length * 0.95, 400e3);
        let force = |ends: f64| {
            let a = relaxed_parts(&g, &tube, Shape { ends, ..Shape::default() }, l, p);
            p * a.area + a.elastic
        };
        let c = cylinder_parts(&g, &tube, l);
        let cylinder = p * c.area + c.elastic;
        assert!((force(1e-6) / cylinder - 1.0).abs() < 1e-4, "{} {cylinder}", force(1e-6));
        assert!(force(1.0) < 0.99 * cylinder, "{} {cylinder}", force(1.0));
    }

    #[test]
    fn fibres_that_hardly_stretch_change_hardly_anything() {
        let (g, tube) = mini();
        let (l, p) = (g.rest_length * 0.97, 400e3);
        let c = cylinder_parts(&g, &tube, l);
        let force = |k: f64| {
            let shape = Shape { fibre_stiffness: Some(k), ..Shape::default() };
            let a = relaxed_parts(&g, &tube, shape, l, p);
            p * a.area + a.elastic
        };
        let cylinder = p * c.area + c.elastic;
        assert!((force(1e8) / cylinder - 1.0).abs() < 1e-3);
        assert!(force(2e4) < 0.995 * cylinder, "soft fibres yield: {} {cylinder}", force(2e4));
    }

    #[test]
    fn the_table_reproduces_what_it_tabulates() {
        let (g, tube) = mini();
        let shape = Shape { ends: 0.5, fibre_stiffness: Some(2e4) };
        let table = Surface::new(g, tube, shape, 552e3, 0.85);
        for (l, p) in [(0.9731, 333e3), (0.991, 151e3), (0.921, 537e3)] {
            let l = l * g.rest_length;
            let (a, b) = (table.parts(p, l), relaxed_parts(&g, &tube, shape, l, p));
            let (a, b) = (p * a.area + a.elastic, p * b.area + b.elastic);
            assert!((a - b).abs() < 0.1, "{a} {b} N");
        }
    }
}
