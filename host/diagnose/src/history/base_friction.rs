//! The friction of the base model, taken out of a campaign before its memory is fitted.
//!
//! The memory is fitted to one curve for each mounting, which filling and emptying share. Friction `−s k_F F` is a part of the base model and
//! no missing effect; where it is large, it would hide the memory. It is a shift of pressure in proportion to the pressure above the one from
//! which the muscle pulls. Where unseen runs are predicted better with it beside the memory, the points are moved by it.

use model_core::braid::Geometry;

use super::Fits;
use super::additional_effect::{measured, tried};
use super::campaign::Points;
use super::friction;
use super::held_table::predicts_better;

/// The points on the pressures that the muscle would need without the base model's friction, and the coefficient of this friction; `None`
/// where unseen runs do not need it, or need another effect in its place.
pub(super) fn removed(fits: &Fits<'_>, geometry: &Geometry) -> Option<(Points, f64)> {
    if fits.needed.is_some() {
        return None;
    }
    let Fits { layer, law, memory, .. } = fits;
    let points = layer.points;
    let areas = friction::areas(layer, law);
    let with = friction::directions(layer, &areas, geometry).into_iter().map(|direction| {
        let tried = tried(layer, law, &[], &[&direction.base]);
        (direction.base, tried)
    });
    let (shifts, best) = with.min_by(|a, b| a.1.sum().total_cmp(&b.1.sum()))?;
    let coefficient = best.amplitude().0;
    let without = measured(points, law.clone(), memory.clone());
    (coefficient > 0.0 && predicts_better(&best.squares, &without.squares)).then(|| {
        let moved = points.pressure.iter().zip(&shifts).map(|(p, s)| p + coefficient * s);
        (Points { pressure: moved.collect(), ..points.clone() }, coefficient)
    })
}
