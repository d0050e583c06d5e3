//! What a user should know about a fit, in words: what was seen, what it means, what to do.

use super::prepared::Prepared;
use super::screen::Use;

use pam_data::pluralise::pluralise;

/// A mean error beyond this, percent, is no misfit of a muscle: something else is wrong.
const NO_MUSCLE: f64 = 10.0;

/// A force that goes so many times further below zero than above has the wrong sign.
const WRONG_SIGN: f64 = 3.0;
/// One standard atmosphere, Pa: a gauge of absolute pressure never reads much less.
const ATMOSPHERE: f64 = 101_325.0;

/// Everything worth saying. `mean_error` is that of all mid-lines by eq. 24, `left_out` the error of each pressure predicted from the
/// others; both in percent.
#[must_use]
pub fn warnings(prepared: &Prepared, mean_error: f64, left_out: &[Option<f64>]) -> Vec<String> {
    let mut out = prepared.warnings.clone();
    agreement(prepared, mean_error, &mut out);
    amount(prepared, &mut out);
    lengths(prepared, &mut out);
    friction(prepared, &mut out);
    deadband(prepared, &mut out);
    set_aside(prepared, &mut out);
    dimensions(prepared, &mut out);
    turns(prepared, &mut out);
    between_pressures(left_out, &mut out);
    out
}

/// Rows that were used so.
fn rows(prepared: &Prepared, wanted: Use) -> usize {
    let used = prepared.points.list.iter().zip(&prepared.used);
    used.filter(|(_, u)| **u == wanted).map(|(p, _)| p.rows as usize).sum()
}

/// Whether this is a muscle at all.
fn agreement(prepared: &Prepared, mean_error: f64, out: &mut Vec<String>) {
    let force = &prepared.points.force;
    if -force.low > WRONG_SIGN * force.high {
        out.push(format!(
            "the force goes down to {:.1} N and up to {:.1} N only: it is positive as the muscle pulls; turn its sign round, with \
             scale = -1 in an import description",
            force.low,
            force.high.max(0.0)
        ));
    }
    if mean_error > NO_MUSCLE {
        out.push(format!(
            "the table does not describe these recordings: it is off by {mean_error:.0} % of the blocked force on average; check the \
             units of force and pressure, the sign of the displacement, and the muscle's dimensions"
        ));
    }
}

/// How many rows and pressures there are.
fn amount(prepared: &Prepared, out: &mut Vec<String>) {
    let fitted = rows(prepared, Use::Fitted);
    let unknowns = prepared.design.layout().len();
    if prepared.points.rows < 200 || fitted < 5 * unknowns {
        out.push(format!(
            "{fitted} rows are fitted for {unknowns} unknowns: the penalty on bending decides much of the table; record more"
        ));
    }
    match prepared.pressures.levels.len() {
        1 => out.push(format!(
            "only one pressure ({:.0} kPa) was tested: how anything changes with pressure is not known, and the table holds \
             at this pressure only",
            prepared.pressures.levels[0] / 1e3
        )),
        2 => out.push("only two pressures were tested: curves over pressure are straight lines between them".into()),
        _ => {}
    }
}

/// Which lengths there are, and what they determine of the elasticity.
fn lengths(prepared: &Prepared, out: &mut Vec<String>) {
    let (design, points) = (&prepared.design, &prepared.points);
    let l0 = prepared.braid.rest_length();
    let (low, high) = (points.stroke.low / l0, points.stroke.high / l0);
    let order = design.orthonormal.order;
    let one_length = design.orthonormal.rank <= 1;
    if design.orthonormal.rank == 0 {
        out.push(
            "every row is at rest length: nothing is known of the bladder's elasticity, the E_k are set to zero and the table holds at \
             this length only; record slow strokes"
                .into(),
        );
    } else if one_length {
        out.push(format!(
            "every row is at one length (contraction {low:.4}): P0 and elasticity cannot be told apart there, neither is determined \
             though an interval is given, and the table holds at this length only; record slow strokes"
        ));
    } else if high - low < 0.01 {
        out.push(format!(
            "contraction covers only {low:.4} to {high:.4}: the elastic coefficients are hardly determined; record a longer stroke"
        ));
    }
    if low > 0.01 && !one_length {
        out.push(format!(
            "the recordings begin at a contraction of {low:.3}: P0 rests on elasticity continued to rest length; record the \
             blocked force too"
        ));
    }
    if (2..order).contains(&design.orthonormal.rank) {
        out.push(format!(
            "the strokes determine only {} of the {order} elastic coefficients (too few different lengths); higher ones are set \
             to zero",
            design.orthonormal.rank
        ));
    } else if design.orthonormal.rank == order && design.orthonormal.condition > 1e5 {
        out.push(format!(
            "the elastic columns have a condition number of {:.0}: single E_k mean little by themselves, only their sum does; a \
             lower order or a longer stroke would help",
            design.orthonormal.condition
        ));
    }
}

/// Whether there is friction, and whether it may be what it is.
fn friction(prepared: &Prepared, out: &mut Vec<String>) {
    let (design, points) = (&prepared.design, &prepared.points);
    if !design.friction {
        let known = points.list.iter().any(|p| p.direction != 0.0);
        out.push(if known {
            "motion in one direction only: friction cannot be told from elasticity, k_F is set to zero, P0 and the E_k hold friction \
             too, and the table holds for that direction"
                .into()
        } else {
            "no direction of motion was found: k_F is set to zero".into()
        });
    } else {
        let levels = &prepared.pressures.levels;
        let factors: Vec<f64> = levels.iter().map(|p| prepared.curves_at(*p).1).collect();
        let scatter = prepared.scatter(&design.residuals(&prepared.parameters));
        let noise = scatter.iter().copied().fold(0.0, f64::max);
        let largest =
            levels.iter().zip(&factors).map(|(p, k)| (k * prepared.blocked(*p)).abs()).fold(0.0, f64::max);
        if largest < 0.5 * noise {
            out.push("there is no hysteresis above the noise: k_F is zero within its error".into());
        }
        if let Some((p, k)) = levels.iter().zip(&factors).find(|(_, k)| **k < -0.01) {
            out.push(format!(
                "k_F is {k:.3} at {:.0} kPa: friction that drives is impossible; check the sign of the displacement, and \
                 whether force and displacement are in step",
                p / 1e3
            ));
        }
    }
}

/// Where the deadband cannot be what it is.
fn deadband(prepared: &Prepared, out: &mut Vec<String>) {
    let points = &prepared.points;
    let p0 = prepared.deadband();
    if p0 < 0.0 {
        out.push(format!(
            "the deadband comes out at {:.0} kPa, below zero: the nominal geometry (braid angle, diameter, rest length) does not \
             fit the blocked force; try --fit-geometry",
            p0 / 1e3
        ));
    } else if prepared.pressures.levels.iter().all(|p| *p < p0) {
        out.push(format!(
            "the deadband comes out at {:.0} kPa, above every tested pressure: the muscle would never pull; check the unit and the \
             sign of the force",
            p0 / 1e3
        ));
    } else if p0 > ATMOSPHERE && points.pressure.low > 0.9 * ATMOSPHERE {
        out.push(format!(
            "the deadband comes out at {:.0} kPa and no pressure below {:.0} kPa was read: if the gauge reads absolute pressure, take \
             one atmosphere off (101.3 kPa), with an offset in an import description",
            p0 / 1e3,
            points.pressure.low / 1e3
        ));
    }
}

/// What was not fitted: the ends of the force sensor, a slack muscle, odd readings.
fn set_aside(prepared: &Prepared, out: &mut Vec<String>) {
    let side = |name: &str, clip: &super::screen::Clip| {
        format!(
            "left out of the fit: {} of exactly {:.2} N, where the force sensor stands at the {name} end of its range",
            pluralise(clip.rows, "row"),
            clip.force
        )
    };
    out.extend(prepared.clips.0.iter().map(|c| side("lower", c)));
    out.extend(prepared.clips.1.iter().map(|c| side("upper", c)));
    let slack = rows(prepared, Use::Slack);
    if slack > 0 {
        out.push(format!(
            "the muscle is slack in {}: the force stays near zero where the model would push; this is not fitted, and the \
             table stops at zero force",
            pluralise(slack, "row")
        ));
    }
    if !prepared.outliers.is_empty() {
        out.push(format!(
            "{} of the force out of line with the rest and not fitted, listed under `outliers`",
            pluralise(prepared.outliers.len(), "reading")
        ));
    }
}

/// Effective dimensions that were found at their bounds, or hardly.
fn dimensions(prepared: &Prepared, out: &mut Vec<String>) {
    for a in prepared.adjusted.iter().filter(|a| a.at_bound) {
        out.push(format!(
            "{} stopped at its bound of {:.2} {}: either it was measured wrongly by more than is plausible, or it stands in for \
             something else that the model lacks",
            a.name, a.value, a.unit
        ));
    }
    let undetermined: Vec<&str> =
        prepared.adjusted.iter().filter(|a| a.determined < 0.5).map(|a| a.name.as_str()).collect();
    if !undetermined.is_empty() {
        out.push(format!(
            "the recordings hardly determine {}: the value is mostly the described one",
            undetermined.join(", ")
        ));
    }
}

/// How much lies just after turns.
fn turns(prepared: &Prepared, out: &mut Vec<String>) {
    let points = &prepared.points;
    let aside = rows(prepared, Use::NearTurn) as f64;
    if aside > 0.3 * points.rows as f64 {
        out.push(format!(
            "{:.0} % of the rows lie just after a turn of motion and are not fitted: strokes are short against the way that \
             friction needs to turn round",
            100.0 * aside / points.rows as f64
        ));
    }
}

/// How well pressures between those that were tested are known.
fn between_pressures(left_out: &[Option<f64>], out: &mut Vec<String>) {
    let errors: Vec<f64> = left_out.iter().copied().flatten().collect();
    if let Some(worst) = errors.iter().copied().reduce(f64::max)
        && worst > 5.0
    {
        out.push(format!(
            "a pressure predicted from the others is off by {worst:.1} % of blocked force: test more pressures between"
        ));
    }
}
