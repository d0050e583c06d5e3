//! A bar that does not give, in the muscle's place: what is read as stroke is what frame and joints give.

use super::table::Table;
use super::{Measured, Uncertainty};
use crate::bench::BenchName;
use crate::numerics::least_squares::by_blocks;
use pam_data::error::Result;
use pam_data::recording::Quantity;

const CHECK: &str = "a rigid bar in the muscle's place";
/// Below this share of the largest force the joint may hang within its play.
const BEARS: f64 = 0.05;
/// Stretches that count as one sample each.
const STRETCHES: usize = 24;

/// What the frame gives, the joint's play, and the stroke's zero.
pub(super) fn measure(table: &Table) -> Result<Vec<Measured>> {
    let (read, known) = (table.need(Quantity::Displacement)?, table.reference(Quantity::Displacement)?);
    let force = table.need(Quantity::Force)?;
    let strongest = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    let bears: Vec<usize> = (0..read.len()).filter(|i| force[*i].abs() > BEARS * strongest).collect();
    let pick = |of: &dyn Fn(usize) -> f64| bears.iter().map(|i| of(*i)).collect::<Vec<f64>>();
    let off = pick(&|i| read[i] - known[i]);
    // Rows left out between them would make unequal stretches of the rest: these go by the row's place in the whole.
    let block: Vec<usize> = bears.iter().map(|i| i * STRETCHES / read.len()).collect();
    let pulled = bears.iter().filter(|i| force[**i] > 0.0).count();
    let both = pulled * 5 > bears.len() && pulled * 5 < 4 * bears.len();
    let mut columns = vec![pick(&|i| -force[i]), vec![-1.0; bears.len()]];
    if both {
        columns.push(pick(&|i| -0.5 * force[i].signum()));
    }
    let time = table.rising_time().map(|t| pick(&|i| t[i]));
    let Some(found) = by_blocks(&columns, &off, &block, time.as_deref()) else {
        return Err(table.poor(
            "the force on the bar changes too little: pull and push it slowly, up to the muscle's force",
        ));
    };
    let uncertain = |at: usize| Uncertainty::of(found.deviations[at], found.freedom);
    let (give, give_known) = (found.values[0].max(0.0), uncertain(0));
    let mut measured = vec![Measured {
        fault: BenchName::RigCompliance,
        // The compliance under load is also the compliance at the reversals.
        parameters: vec![give, give],
        deviations: vec![Some(give_known.deviation), None],
        freedom: give_known.freedom,
        text: format!(
            "the frame gives {:.2} ± {:.2} µm per newton",
            1e6 * found.values[0],
            1e6 * give_known.half_width()
        ),
        check: CHECK,
    }];
    let (zero, zero_known) = (found.values[1], uncertain(1));
    if both {
        let (play, play_known) = (found.values[2].max(0.0), uncertain(2));
        measured.push(Measured {
            fault: BenchName::Backlash,
            // How softly a braid is taken along behind the play a bar does not show.
            parameters: vec![1.0, play, 0.1],
            deviations: vec![None, Some(play_known.deviation), None],
            freedom: play_known.freedom,
            text: format!(
                "the joint has a play of {:.3} ± {:.3} mm",
                1e3 * found.values[2],
                1e3 * play_known.half_width()
            ),
            check: CHECK,
        });
        measured.push(Measured {
            fault: BenchName::DisplacementOffset,
            parameters: vec![zero],
            deviations: vec![Some(zero_known.deviation)],
            freedom: zero_known.freedom,
            text: format!(
                "the stroke reads {:+.3} ± {:.3} mm too little",
                1e3 * zero,
                1e3 * zero_known.half_width()
            ),
            check: CHECK,
        });
    }
    Ok(measured)
}
