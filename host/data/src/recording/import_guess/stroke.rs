//! The sign and the zero of a displacement, by its name, by force and pressure, and by what other files of the bench hold.

use super::others::{Others, Range};
use super::sample::{Sample, SampleColumn};
use super::{Guess, GuessedColumn, Note, roles, values};
use crate::recording::{Quantity, columns};
use crate::short_number::short;
use crate::statistics::extremes;

/// A correlation of force with displacement at equal pressure from which the sign of the displacement is taken as shown. Uncorrelated
/// readings of two independent slow movements rarely reach 0.8, and a force that falls with the stroke exceeds it.
const SHOWN: f64 = 0.8;
/// A displacement that varies by less than this share of itself is held: a frame yields by so much, and no stroke is so short.
const HELD: f64 = 0.01;
/// Lengths that are held in different files lie apart by more than this many times what a sensor's noise makes of one of them; strokes from
/// one zero begin at one place.
const APART: f64 = 3.0;

/// Decides on the displacement.
pub(super) fn judge(sample: &Sample, others: &Others<'_>, guess: &mut Guess) {
    contraction(sample, guess);
    sign(sample, guess);
    let is_stroke = |c: &&mut GuessedColumn| c.quantity == Quantity::Displacement;
    let Some(column) = guess.columns.iter().find(|c| c.quantity == Quantity::Displacement) else { return };
    let Some((low, high)) = column.range else { return };
    let header = column.header.clone();
    let longest = if column.extension { high } else { low };
    // A zero within a third of the stroke may be meant; one farther away is that of the machine.
    if longest.abs() <= (high - low) / 3.0 {
        return;
    }
    let at = (0..sample.columns.len()).find(|n| roles::source(sample, *n) == column.source);
    let Some(own) = at.map(|n| Range::of(&sample.columns[n])) else { return };
    let moved = moves_the_force(sample, guess);
    let si = Quantity::Displacement.unit(column.unit).map_or(1.0, |u| u.scale * column.scale.abs());
    let held = if moved { None } else { held(&header, own, si, others) };
    let Some(column) = guess.columns.iter_mut().find(is_stroke) else { return };
    let text = match held {
        Some(how) => format!(
            "{header} {how}: it is taken to count from the rest length; if it has a zero of its own, write it as zero under \
             [columns.displacement]"
        ),
        None => {
            column.from_longest = true;
            format!(
                "{header} has a zero of its own: the stroke is counted from the greatest length in each file, which must be the rest length"
            )
        }
    };
    guess.checks.push(text.into());
}

/// How a displacement shows that it is held and not moved: counted from the greatest length in each file, nothing would be left of it.
fn held(header: &str, own: Range, si: f64, others: &Others<'_>) -> Option<String> {
    let mut files = others.ranges(header);
    files.push(own);
    // The file that moves most decides: at a low pressure a muscle moves by little.
    let within = files.iter().map(|r| r.width).fold(0.0, f64::max);
    let middles = files.iter().map(|r| 0.5 * (r.low + r.high));
    let (low, high) = extremes(middles);
    let apart = high - low > APART * within;
    if !(within <= HELD * low.abs().max(high.abs()) || within * si <= columns::HELD || apart) {
        return None;
    }
    Some(if apart {
        format!("is held at {} to {} in different files", short(low), short(high))
    } else {
        format!("is held at {}", short(own.low))
    })
}

/// Whether the displacement and not the pressure moves the force: at held length the force changes with the pressure only.
fn moves_the_force(sample: &Sample, guess: &Guess) -> bool {
    /// A force that changes by this share of its largest value is moved on purpose.
    const MOVED: f64 = 0.5;
    let values = |q: Quantity| {
        let column = guess.columns.iter().find(|c| c.quantity == q)?;
        let n = (0..sample.columns.len()).find(|n| roles::source(sample, *n) == column.source)?;
        Some(&sample.columns[n])
    };
    let (Some(stroke), Some(force)) = (values(Quantity::Displacement), values(Quantity::Force)) else {
        return false;
    };
    let pressure = values(Quantity::Pressure);
    let (low, high) = force.range();
    high - low > MOVED * low.abs().max(high.abs())
        && pressure.is_none_or(|p| !values::is_varied(&p.numbers))
        && values::force_against(&stroke.numbers, &force.numbers, None).is_some_and(|r| r.abs() > SHOWN)
}

/// A strain that grows as the muscle gets longer, from a zero of its own, is not a contraction, whatever its name says.
fn contraction(sample: &Sample, guess: &mut Guess) {
    let is_one = |c: &&GuessedColumn| c.quantity == Quantity::Contraction;
    let Some(header) = guess.columns.iter().find(is_one).map(|c| c.header.clone()) else { return };
    let values = |q: Quantity| -> Option<Vec<f64>> {
        let column = guess.columns.iter().find(|c| c.quantity == q)?;
        let n = (0..sample.columns.len()).find(|n| roles::source(sample, *n) == column.source)?;
        Some(sample.columns[n].numbers.iter().map(|v| v * column.scale.signum()).collect())
    };
    let (Some(contraction), Some(force)) = (values(Quantity::Contraction), values(Quantity::Force)) else {
        return;
    };
    let pressure = values(Quantity::Pressure);
    if values::force_against(&contraction, &force, pressure.as_deref()).is_some_and(|r| r > SHOWN) {
        guess.columns.retain(|c| c.quantity != Quantity::Contraction);
        let text = format!(
            "{header} looks like a contraction, but the force rises with it: it seems to grow as the muscle gets longer, from a zero of its \
             own; write (L0 − L)/L0, or describe a displacement"
        );
        guess.unknown.push(Note::on_column(&header, Some(Quantity::Contraction), text));
    }
}

/// The sign, which the force shows, or the pressure where the force shows nothing.
fn sign(sample: &Sample, guess: &mut Guess) {
    let values = |q: Quantity| {
        let column = guess.columns.iter().find(|c| c.quantity == q)?;
        let n = (0..sample.columns.len()).find(|n| roles::source(sample, *n) == column.source)?;
        Some((column.scale.signum(), &sample.columns[n].numbers))
    };
    let Some((_, stroke)) = values(Quantity::Displacement) else { return };
    let force: Option<Vec<f64>> =
        values(Quantity::Force).map(|(sign, force)| force.iter().map(|f| sign * f).collect());
    // An uncalibrated reading shows the sign as well, where nothing better is there.
    let raw = || {
        let is_force = |c: &&SampleColumn| c.is_numeric() && c.quantity_by_name() == Some(Quantity::Force);
        sample.columns.iter().find(is_force).map(|c| c.numbers.clone())
    };
    let force = force.or_else(raw);
    let pressure = values(Quantity::Pressure).map(|(_, p)| p.as_slice());
    let by_force =
        force.and_then(|f| values::force_against(stroke, &f, pressure)).filter(|r| r.abs() > SHOWN);
    // A muscle that moves freely shortens as its pressure rises.
    let by_pressure =
        || pressure.and_then(|p| values::pressure_against(stroke, p)).filter(|r| r.abs() > SHOWN);
    let (lengthens, how) = match by_force {
        Some(r) => (r > 0.0, ["rises", "falls"].map(|way| format!("the force {way} with"))),
        None => match by_pressure() {
            Some(r) => (r < 0.0, ["falls", "rises"].map(|way| format!("the pressure {way} with"))),
            None => return,
        },
    };
    let Some(column) = guess.columns.iter_mut().find(|c| c.quantity == Quantity::Displacement) else {
        return;
    };
    if column.extension == lengthens {
        return;
    }
    column.extension = lengthens;
    let at = if by_force.is_some() { " at equal pressure" } else { "" };
    let [longer, shorter] = how;
    let text = if lengthens {
        format!("{longer} {}{at}: it is taken to grow as the muscle gets longer", column.header)
    } else {
        format!(
            "{shorter} {}{at}: it is taken to grow as the muscle shortens, despite its name",
            column.header
        )
    };
    guess.checks.push(text.into());
}
