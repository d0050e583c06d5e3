//! The friction curve of a table, within the limits that a controller accepts.

use model_core::table::{FRICTION_LIMITS, MuscleTable, TableError};

/// By how much the limits are drawn in at a time, until the curve between the nodes stays within them, and how often at most.
const DRAWN_IN: f64 = 0.02;
const MOST_TIMES: u32 = 20;

/// The table with these values of `k_F` at its nodes, of which those that no muscle has are set to the limits of a table. A cubic through such
/// values goes beyond them; then they are limited further, so that a table with an absurd friction is a table still, and its faults are
/// reported as such.
///
/// # Errors
/// What is wrong with the table.
pub fn with_friction(mut table: MuscleTable, friction: &[f64]) -> Result<MuscleTable, TableError> {
    let (least, most) = (f64::from(FRICTION_LIMITS.0), f64::from(FRICTION_LIMITS.1));
    let mut checked = Ok(());
    for times in 0..=MOST_TIMES {
        let inside = DRAWN_IN * f64::from(times);
        let limited = |k: &f64| k.clamp(least + inside, most - inside) as f32;
        table.friction = friction.iter().map(limited).collect();
        checked = table.check();
        if checked != Err(TableError::Friction) {
            break;
        }
    }
    checked.map(|()| table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::table::example;

    #[test]
    fn friction_that_no_muscle_has_is_limited_so_that_the_table_is_valid() {
        for absurd in [
            [1.55, 1.08, 0.99, 0.65, 0.48, 0.31],
            [-0.9, -0.8, -0.6, 0.1, 0.1, 0.1],
            [0.1, 3.0, 0.1, 3.0, 0.1, 3.0],
        ] {
            let table = with_friction(example(), &absurd).expect("a table");
            assert_eq!(table.check(), Ok(()), "{absurd:?}");
            assert!(
                table
                    .friction
                    .iter()
                    .zip(absurd)
                    .all(|(k, value)| (f64::from(*k) - 0.2) * (value - 0.2) > 0.0),
                "{:?}",
                table.friction
            );
        }
        let usual = example().friction.iter().map(|k| f64::from(*k)).collect::<Vec<_>>();
        assert_eq!(with_friction(example(), &usual), Ok(example()));
        assert_eq!(with_friction(example(), &[f64::NAN; 6]), Err(TableError::Friction));
    }
}
