//! Warnings about a fit: what was seen, what it means, what to do.

use super::problem::Problem;
use super::screen::PointUse;
use super::solution::Solution;
use super::weights::scatter;

use model_core::table::FRICTION_LIMITS;
use pam_data::pluralise::pluralise;
use pam_data::statistics::median;

/// Above this mean error, percent of blocked force, a wrong unit, sign or dimension is more likely than physics that the model lacks.
const NO_MUSCLE: f64 = 10.0;

/// A force whose range below zero is this many times that above has the wrong sign.
const WRONG_SIGN: f64 = 3.0;
/// One standard atmosphere, Pa: an absolute pressure sensor never reads much less, and the deadband of its table is higher by as much.
const ATMOSPHERE: f64 = 101_325.0;
/// What a vented muscle reads on an absolute sensor, Pa: atmospheric pressure from 2,400 m above the sea to a high at sea level.
const VENTED: std::ops::RangeInclusive<f64> = 75e3..=107e3;
/// A reading this much above the force at rest length and the highest tested pressure contradicts the table there: friction and errors of
/// the mounted length are smaller.
const ABOVE_BLOCKED: f64 = 0.1;

/// At a pressure well above the deadband, the force of a muscle reaches zero no earlier than at this share of the contraction at which a
/// braid alone ceases to pull: a quarter of the least of the three muscles in the thesis of E. G. Hocking (the miniature one, 0.0772 of 0.41 at
/// 552 kPa; the others 0.29 and 0.27 of 0.40). Inches under millimetres divide it by 25.4.
const LEAST_FREE: f64 = 0.05;
/// Well above: the miniature muscle reaches 0.066 at this many times its deadband.
const WELL_ABOVE: f64 = 3.5;
/// The force has reached zero below this share of the largest at that pressure; pressures within as much of the highest are taken together.
const ZERO: f64 = 0.05;

/// All warnings. `mean_error` is that of all mid-lines by eq. 24, `left_out` the error of each pressure predicted from the others; both
/// in percent of blocked force.
#[must_use]
pub(super) fn warnings(solution: &Solution, mean_error: f64, left_out: &[Option<f64>]) -> Vec<String> {
    let mut out = solution.warnings.clone();
    agreement(solution, mean_error, &mut out);
    displacement(solution, &mut out);
    amount(solution, &mut out);
    blocked_force(solution, &mut out);
    lengths(solution, &mut out);
    friction(solution, &mut out);
    deadband(solution, &mut out);
    excluded(solution, &mut out);
    dimensions(solution, &mut out);
    reversals(solution, &mut out);
    between_pressures(left_out, &mut out);
    out
}

/// How many rows have this use.
fn rows(solution: &Solution, wanted: PointUse) -> usize {
    let used = solution.problem.points.list.iter().zip(&solution.screen.used);
    used.filter(|(_, u)| **u == wanted).map(|(p, _)| p.rows as usize).sum()
}

/// Whether the lowest force is a code for missing readings, such as −999: a force of the wrong sign is far below zero in most rows. `forces`:
/// means with their numbers of rows.
fn is_code(low: f64, forces: impl Iterator<Item = (f64, u32)>) -> bool {
    /// Of the lowest force, from which a reading is far below zero; and the share of rows that a code has at most.
    const FAR: (f64, f64) = (0.1, 0.2);
    let (far, all) = forces.fold((0.0, 0.0), |(far, all), (force, rows)| {
        let rows = f64::from(rows);
        (far + if force < FAR.0 * low { rows } else { 0.0 }, all + rows)
    });
    far < FAR.1 * all
}

/// Whether sign, units and dimensions can be right.
fn agreement(solution: &Solution, mean_error: f64, out: &mut Vec<String>) {
    let force = &solution.problem.points.force;
    // A code for missing readings, such as −999, is not a force.
    if solution.problem.clips.0.is_none() && -force.low > WRONG_SIGN * force.high {
        let forces = solution.problem.points.list.iter().map(|p| (p.force, p.rows));
        out.push(if is_code(force.low, forces) {
            format!(
                "the force is {:.1} N in a few rows, far from the others: if this is a code for missing readings, leave these rows out, such as \
                 by empty cells and --missing skip",
                force.low
            )
        } else {
            format!(
                "the force ranges from {:.1} N to {:.1} N: force is positive as the muscle pulls; invert its sign with scale = -1 in an \
             import description",
            force.low,
            force.high.max(0.0)
        )
        });
    }
    out.extend(solution.unusual_share_of_braid());
    if mean_error > NO_MUSCLE {
        out.push(format!(
            "the table does not describe these recordings: its mean error is {mean_error:.0} % of the blocked force; check the units of \
             force and pressure, the sign of the displacement, and the muscle's dimensions"
        ));
    }
}

/// Whether the unit of the displacement can be right: where the force reaches zero at the highest pressure.
fn displacement(solution: &Solution, out: &mut Vec<String>) {
    let Problem { points, braid, shift, .. } = &solution.problem;
    let (p0, rest) = (solution.deadband(), braid.rest_length());
    // Fibres that enclose 54.7° with the axis make no force at any pressure: sin² = 2/3, cos = 1/√3.
    let of_braid = 1.0 - braid.fibre_length() / (3.0_f64.sqrt() * rest);
    let read = || points.list.iter().zip(shift).filter(|(p, _)| !p.dropout);
    let highest = read().map(|(p, _)| p.pressure).fold(0.0, f64::max);
    if !(of_braid > 0.0 && highest > WELL_ABOVE * p0.max(0.0)) {
        return;
    }
    let at_highest = || read().filter(|(p, _)| p.pressure > (1.0 - ZERO) * highest);
    let largest = at_highest().map(|(p, _)| p.force).fold(0.0, f64::max);
    let slack = at_highest().filter(|(p, _)| p.force.abs() < ZERO * largest);
    let mut contractions: Vec<f64> = slack.map(|(p, shift)| (p.stroke + shift) / rest).collect();
    if contractions.is_empty() {
        return;
    }
    let free = median(&mut contractions);
    if (0.0..LEAST_FREE * of_braid).contains(&free) {
        out.push(format!(
            "the force reaches zero at {:.0} kPa and a contraction of {free:.4}, {:.1} % of what this braid allows ({of_braid:.2}); more than \
             {:.0} % is usual: check the unit of the displacement (inches?), its zero, and the rest length",
            highest / 1e3,
            100.0 * free / of_braid,
            100.0 * LEAST_FREE
        ));
    }
}

/// Whether there are enough rows and pressures.
fn amount(solution: &Solution, out: &mut Vec<String>) {
    let fitted = rows(solution, PointUse::Fitted);
    let unknowns = solution.problem.design.layout().len();
    if solution.problem.points.rows < 200 || fitted < 5 * unknowns {
        out.push(format!(
            "{fitted} rows for {unknowns} unknowns: smoothing determines much of the table; record more rows"
        ));
    }
    match solution.problem.pressures.levels.len() {
        1 => out.push(format!(
            "only one pressure ({:.0} kPa) was tested: the table holds at this pressure only; test more pressures",
            solution.problem.pressures.levels[0] / 1e3
        )),
        2 => out.push("only two pressures were tested: the curves over pressure are straight lines between them; test more pressures".into()),
        _ => {}
    }
}

/// What the recorded lengths determine of the elasticity.
fn lengths(solution: &Solution, out: &mut Vec<String>) {
    let (design, points) = (&solution.problem.design, &solution.problem.points);
    let l0 = solution.problem.braid.rest_length();
    let (low, high) = (points.stroke.low / l0, points.stroke.high / l0);
    let order = design.orthonormal.order;
    let one_length = design.orthonormal.rank <= 1;
    let held = !points.held_lengths().is_empty();
    let (slowly, more) =
        if held { ("more lengths", "lengths further apart") } else { ("slow strokes", "a longer stroke") };
    if design.orthonormal.rank == 0 {
        out.push(format!(
            "every row is at rest length: the bladder's elasticity is not identifiable, the E_k are set to zero, and the table holds at this \
             length only; record {slowly}"
        ));
    } else if one_length {
        out.push(format!(
            "every row is at one length (contraction {low:.4}): P0 and elasticity cannot be separated, their intervals do not include this, \
             and the table holds at this length only; record {slowly}"
        ));
    } else if high - low < 0.01 {
        out.push(format!(
            "contraction covers only {low:.4} to {high:.4}: the elastic coefficients are poorly determined; record {more}"
        ));
    }
    if low > 0.01 && !one_length {
        out.push(format!(
            "the recordings begin at a contraction of {low:.3}: P0 is an extrapolation to rest length; record the blocked force too"
        ));
    }
    if (2..order).contains(&design.orthonormal.rank) {
        out.push(format!(
            "the recorded lengths determine only {} of the {order} elastic coefficients; higher ones are set to zero; record more lengths",
            design.orthonormal.rank
        ));
    } else if design.orthonormal.rank == order && design.orthonormal.condition > 1e5 {
        out.push(format!(
            "the elastic columns have a condition number of {:.0}: single E_k are poorly determined, only their sum is well determined; \
             use a lower order or record {more}",
            design.orthonormal.condition
        ));
    }
}

/// Whether the force at rest length is at least what was measured at shorter lengths.
fn blocked_force(solution: &Solution, out: &mut Vec<String>) {
    let points = &solution.problem.points;
    let highest = points.pressure.high;
    let (blocked, largest) = (solution.blocked(highest), points.force.high);
    if points.stroke.low > 0.0 && largest > (1.0 + ABOVE_BLOCKED) * blocked {
        out.push(format!(
            "the table pulls {blocked:.0} N at rest length and {:.0} kPa, but {largest:.0} N was measured on the shortened muscle: do not use \
             the table outside the recorded lengths; record the force at rest length too",
            highest / 1e3
        ));
    }
}

/// Whether friction is identifiable and has a possible sign.
fn friction(solution: &Solution, out: &mut Vec<String>) {
    let (design, points) = (&solution.problem.design, &solution.problem.points);
    if !design.friction {
        let known = points.list.iter().any(|p| p.direction != 0.0);
        out.push(if known {
            "motion in one direction only: friction and elasticity cannot be separated, k_F is set to zero, P0 and the E_k include friction, \
             and the table holds for that direction; record both directions"
                .into()
        } else {
            "no motion was found: friction is not identifiable and k_F is set to zero".into()
        });
    } else {
        let levels = &solution.problem.pressures.levels;
        let factors: Vec<f64> = levels.iter().map(|p| solution.curves_at(*p).1).collect();
        let scatter = scatter(&solution.problem, &solution.screen, &design.residuals(&solution.parameters));
        let noise = scatter.iter().copied().fold(0.0, f64::max);
        let largest =
            levels.iter().zip(&factors).map(|(p, k)| (k * solution.blocked(*p)).abs()).fold(0.0, f64::max);
        if largest < 0.5 * noise {
            out.push("no hysteresis above the noise: k_F is zero within its uncertainty".into());
        }
        if let Some((p, k)) = levels.iter().zip(&factors).find(|(_, k)| **k > f64::from(FRICTION_LIMITS.1)) {
            out.push(format!(
                "k_F is {k:.2} at {:.0} kPa: no friction is as large as the force, and the table holds {:.2} at most. Something else resists the \
                 motion: `host diagnose` looks for it",
                p / 1e3,
                FRICTION_LIMITS.1
            ));
        }
        if let Some((p, k)) = levels.iter().zip(&factors).find(|(_, k)| **k < -0.01) {
            let check = if points.held_lengths().is_empty() {
                "check the sign of the displacement, and whether force and displacement are synchronous"
            } else {
                "creep of the bladder looks like this, and `host diagnose -o` writes a table that carries it; otherwise check the lengths, and \
                 whether force and pressure are synchronous"
            };
            out.push(format!(
                "k_F is {k:.3} at {:.0} kPa, below zero, which no friction is; {check}",
                p / 1e3
            ));
        }
    }
}

/// Whether the deadband pressure is possible.
fn deadband(solution: &Solution, out: &mut Vec<String>) {
    let points = &solution.problem.points;
    let p0 = solution.deadband();
    if p0 < 0.0 {
        let cause = if solution.problem.adjusted.is_empty() {
            "the nominal geometry (braid angle, diameter, rest length) does not match the blocked force; try --fit-geometry"
        } else {
            "the fitted dimensions do not explain it; check the zeros of pressure and force"
        };
        out.push(format!("the deadband P0 is {:.0} kPa, below zero: {cause}", p0 / 1e3));
    } else if solution.problem.pressures.levels.iter().all(|p| *p < p0) {
        out.push(format!(
            "the deadband P0 is {:.0} kPa, above every tested pressure: the muscle would never pull; check the unit and the sign of the \
             force",
            p0 / 1e3
        ));
    } else if p0 > ATMOSPHERE && points.pressure.low > 0.9 * ATMOSPHERE
        || p0 > *VENTED.start() && VENTED.contains(&points.pressure.low)
    {
        out.push(format!(
            "the deadband P0 is {:.0} kPa and the lowest pressure is {:.0} kPa: if the sensor reads absolute pressure, subtract one atmosphere \
             (101.3 kPa) with an offset in an import description",
            p0 / 1e3,
            points.pressure.low / 1e3
        ));
    }
}

/// Which rows are excluded: saturated force readings, a slack muscle, outliers.
fn excluded(solution: &Solution, out: &mut Vec<String>) {
    let side = |name: &str, clip: &super::screen::Clip| {
        format!(
            "excluded: {} of exactly {:.2} N, where the force sensor is at the {name} end of its range",
            pluralise(clip.rows, "row"),
            clip.force
        )
    };
    out.extend(solution.problem.clips.0.iter().map(|c| side("lower", c)));
    out.extend(solution.problem.clips.1.iter().map(|c| side("upper", c)));
    let slack = rows(solution, PointUse::Slack);
    if slack > 0 {
        out.push(format!(
            "excluded: {} where the muscle is slack (force near zero where the model would push); the table's force ends at zero there",
            pluralise(slack, "row")
        ));
    }
    let pushed = rows(solution, PointUse::Pushed);
    if pushed > 0 {
        out.push(format!(
            "excluded: {} where the rig pushes the muscle (force below zero by more than 3 %): the table describes its pull. Stop the stroke \
             at zero force; `host diagnose` looks for the cause, for example a contraction stop or friction of a guide",
            pluralise(pushed, "row")
        ));
    }
    if !solution.screen.outliers.is_empty() {
        out.push(format!(
            "excluded: {} of the force outside the scatter of the others, listed under `outliers`",
            pluralise(solution.screen.outliers.len(), "reading")
        ));
    }
}

/// Effective dimensions at their bounds, or poorly determined.
fn dimensions(solution: &Solution, out: &mut Vec<String>) {
    for a in solution.problem.adjusted.iter().filter(|a| a.at_bound) {
        out.push(format!(
            "{} is at its bound of {:.2} {}: either its measurement is wrong by more than is plausible, or it compensates for physics that \
             the model lacks",
            a.name, a.value, a.unit
        ));
    }
    let undetermined: Vec<&str> = solution
        .problem
        .adjusted
        .iter()
        .filter(|a| a.determined < 0.5 && !a.at_bound)
        .map(|a| a.name.as_str())
        .collect();
    if !undetermined.is_empty() {
        out.push(format!(
            "the recordings poorly determine {}: the value is mostly that of the muscle description",
            undetermined.join(", ")
        ));
    }
}

/// Whether many rows are near reversals.
fn reversals(solution: &Solution, out: &mut Vec<String>) {
    let points = &solution.problem.points;
    let aside = rows(solution, PointUse::NearReversal) as f64;
    if aside > 0.3 * points.rows as f64 {
        let (short, longer) = if points.held_lengths().is_empty() {
            ("strokes are", "longer strokes")
        } else {
            ("the changes of pressure are", "a larger range of pressure")
        };
        out.push(format!(
            "excluded: {:.0} % of the rows, just after reversals: {short} short against the distance over which friction changes sign; \
             record {longer}",
            100.0 * aside / points.rows as f64
        ));
    }
}

/// How well the table interpolates between the tested pressures.
fn between_pressures(left_out: &[Option<f64>], out: &mut Vec<String>) {
    let errors: Vec<f64> = left_out.iter().copied().flatten().collect();
    if let Some(worst) = errors.iter().copied().reduce(f64::max)
        && worst > 5.0
    {
        out.push(format!(
            "the worst left-out pressure has a mean error of {worst:.1} % of the blocked force: test more pressures"
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::is_code;

    #[test]
    fn a_code_for_missing_readings_is_no_wrong_sign() {
        let forces = |coded: u32, sign: f64| {
            (0..100).map(move |n| (if n < coded { -999.0 } else { sign * f64::from(n) }, 3))
        };
        assert!(is_code(-999.0, forces(2, 1.0)));
        assert!(!is_code(-99.0, forces(0, -1.0)));
    }
}
