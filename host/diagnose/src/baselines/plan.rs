//! Which columns a baseline has.

use model_core::spline;

use super::Kind;
use crate::criteria::baseline::{FRICTION_POWERS, FRICTION_RANGE, STIFFENING_ORDERS, TABLE_ORDER};
use crate::rows::{ORDERS, Rows, SingleBladder, YEOH};

/// The cardinal functions of the natural spline on the levels, at pressure `p` (held at the ends).
fn cardinal(levels: &[f64], cubics: &[[spline::Cubic<f64>; spline::MAX_PIECES]], p: f64, out: &mut [f64]) {
    let places = spline::Nodes::<f64>::new(levels);
    let piece = places.place(p);
    for (o, c) in out.iter_mut().zip(cubics) {
        *o = spline::value(&c[piece], p - places.origin(piece));
    }
}

fn cardinal_cubics(levels: &[f64]) -> Vec<[spline::Cubic<f64>; spline::MAX_PIECES]> {
    (0..levels.len())
        .map(|j| {
            let unit: Vec<f64> = (0..levels.len()).map(|i| f64::from(u8::from(i == j))).collect();
            spline::Nodes::<f64>::pieces(levels, &unit)
        })
        .collect()
}

/// One column of a baseline.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    Deadband,
    /// `E_k` over a function of pressure: order (from 0), function.
    Elastic(usize, usize),
    Yeoh(usize),
    /// `k_F` over a function of pressure.
    Friction(usize),
    /// A scale of the effective area, and of its slope.
    Area,
    AreaSlope,
    /// A settling of friction that is not quite exponential.
    Settling,
    /// How much of friction does not settle at rest: a friction that needs speed leaves a rest's gap half closed for another reason,
    /// and what it leaves must not be taken for settling.
    Unsettled,
    /// Where in the gap between the branches friction rests over these rows, or begins: drift of the pressure moves it, and that is not
    /// measured.
    Rest(usize, usize),
    /// How far friction reverses while the pressure ramps at held length, relative to a reversal of the stroke.
    Ramping,
    /// A part of friction that turns over its own change of the pressure, where the length was held throughout.
    Turning(usize),
}

impl Part {
    /// By how much friction's direction departs at a row from what the model holds, per unit of a part of this kind.
    pub(super) fn departure(self, rows: &Rows, i: usize) -> f64 {
        match self {
            Self::Unsettled => rows.at_rest().unsettled[i],
            Self::Rest(from, to) if (from..to).contains(&i) => rows.at_rest().kept[i],
            Self::Turning(part) => rows.at_rest().turning[part][i],
            Self::Ramping if rows.on_ramp[i] => rows.sign[i],
            _ => 0.0,
        }
    }
}

/// The stretches of rows with the same number other than zero.
fn rests(of: &[u32]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let mut from = 0;
    of.chunk_by(|a, b| a == b).filter_map(move |stretch| {
        let begun = from;
        from += stretch.len();
        (stretch[0] != 0).then_some((begun, from))
    })
}

/// The columns of a baseline: those with free coefficients, those with a prior, and the functions of pressure in them.
pub(super) struct Plan {
    pub(super) hard: Vec<Part>,
    pub(super) soft: Vec<Part>,
    pub(super) functions: Vec<Vec<f64>>,
}

impl Plan {
    pub(super) fn new(rows: &Rows, kind: Kind) -> Self {
        let n = rows.len();
        let mut functions = Vec::new();
        let cardinals = |functions: &mut Vec<Vec<f64>>| {
            let levels = &rows.levels;
            let cubics = cardinal_cubics(levels);
            let first = functions.len();
            functions.extend(vec![vec![0.0; n]; levels.len()]);
            let mut at = vec![0.0; levels.len()];
            for i in 0..n {
                cardinal(levels, &cubics, rows.contexts()[i].pressure, &mut at);
                for (f, a) in functions[first..].iter_mut().zip(&at) {
                    f[i] = *a;
                }
            }
            first..first + levels.len()
        };
        let tables = |order: usize, over: std::ops::Range<usize>| {
            let elastic = over.clone();
            (0..order)
                .flat_map(move |k| elastic.clone().map(move |f| Part::Elastic(k, f)))
                .chain(over.map(Part::Friction))
                .collect::<Vec<Part>>()
        };
        let mut hard: Vec<Part> =
            rests(&rows.at_rest().rest).map(|(from, to)| Part::Rest(from, to)).collect();
        hard.push(Part::Deadband);
        let mut soft = Vec::new();
        if let Kind::Flexible(order) = kind {
            let over = cardinals(&mut functions);
            hard.extend(tables(order.clamp(1, ORDERS), over));
        } else {
            let (lo, hi) =
                (rows.levels.first().copied().unwrap_or(0.0), rows.levels.last().copied().unwrap_or(1.0));
            let u = |p: f64| {
                if hi > lo {
                    (2.0 * (p - lo) / (hi - lo) - 1.0).clamp(-FRICTION_RANGE, FRICTION_RANGE)
                } else {
                    0.0
                }
            };
            for degree in 0..rows.levels.len().clamp(1, FRICTION_POWERS) {
                functions.push(rows.contexts().iter().map(|c| u(c.pressure).powi(degree as i32)).collect());
            }
            match rows.single_bladder() {
                SingleBladder::Stiffens => {
                    hard.extend((0..ORDERS).map(|k| Part::Elastic(k, 0)));
                    hard.extend((0..YEOH).map(Part::Yeoh));
                }
                SingleBladder::AsTable => hard.extend((0..TABLE_ORDER).map(|k| Part::Elastic(k, 0))),
            }
            // The functions are the powers of the pressure, from the constant on.
            let linear = 1;
            if rows.bladder_stiffens() && functions.len() > linear {
                hard.extend((0..STIFFENING_ORDERS).map(|k| Part::Elastic(k, linear)));
            }
            hard.extend((0..functions.len()).map(Part::Friction));
            if matches!(kind, Kind::Soft(_)) && rows.levels.len() > 1 {
                let over = cardinals(&mut functions);
                soft = tables(TABLE_ORDER, over);
            }
        }
        // At a few held lengths a tenth of a degree in the braid's angle, or a millimetre in the mounting, cannot be distinguished from a
        // scale of the effective area; where the muscle moves it shows in the shape, so that the geometry is fitted from it.
        if rows.isometric {
            hard.extend([Part::Area, Part::AreaSlope]);
        }
        if rows.at_rest().settling.iter().any(|s| *s != 0.0) {
            hard.push(Part::Settling);
        }
        if rows.at_rest().unsettled.iter().any(|u| *u != 0.0) {
            hard.push(Part::Unsettled);
        }
        if rows.on_ramp.iter().any(|r| *r) {
            hard.push(Part::Ramping);
        }
        hard.extend((0..rows.at_rest().turning.len()).map(Part::Turning));
        Self { hard, soft, functions }
    }
}
