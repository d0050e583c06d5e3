//! The section of festo.md on unseen runs through the table: each run predicted from the others by a table file, without and with the
//! memory of the bladder, at settled points and over the readings as recorded.

use pam_diagnose::history::table_unseen::{UnseenError, UnseenErrors};
use std::fmt::Write as _;

/// Heading of the section.
pub const HEADING: &str = "## Unseen runs through the table";

/// First paragraph of the section, and the header of its table.
pub const INTRODUCTION: &str = "Each run is predicted from the others by a table file (`.pam`) and the prediction of `host predict`, which carries the \
    memory through all runs in order; of the predicted run only pressure and time are used. Of more than twelve runs every twelfth is left out together. \
    \"Base\": the base model of `host fit` with the zero of the load cell. \"Static\": the same, with the contact of the bladder where the other runs follow it more closely. \"Memory\": `bladder-creep` in addition, and a load before the mountings that follow another where the other runs are predicted clearly better with one. Root mean square in percent \
    of the largest force, over readings that pull; readings that ring after a valve's pulse are set aside, and slack readings or those at \
    the converter's end count only by the pull that is predicted too much there. \"Change\" compares memory and the better one of base and static. \
    \"Supported\": the same, static and memory, over readings whose pressure another run of the mounting reaches; beyond, a prediction \
    extrapolates.\n\n\
    | set, muscle | readings | base | static | memory | change | supported | change | ringing | slack |\n";

/// A muscle and what was found.
pub struct Row {
    /// Set and muscle.
    pub label: String,
    /// The errors, or why there are none.
    pub errors: Result<Unseen, String>,
}

/// Errors on recordings that were held out.
pub struct Unseen {
    /// Runs, at settled points and over readings as recorded.
    pub runs: [UnseenErrors; 2],
    /// Whole mountings, at settled points.
    pub contractions: UnseenErrors,
    /// Mean change of the force by a millimetre of length, % of the largest force.
    pub millimetre_pct: f64,
}

/// The whole section.
pub fn section(rows: &[Row]) -> String {
    let mut text =
        format!("{HEADING}\n\n{INTRODUCTION}| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
    let mut counts = [[0_usize; 4]; 2];
    for row in rows {
        let errors = match &row.errors {
            Ok(errors) => errors,
            Err(e) => {
                let _ = writeln!(text, "| {} | failed: {} | | | | | | | | |", row.label, e.replace('|', "/"));
                continue;
            }
        };
        for (k, (name, e)) in ["settled points", "as recorded"].iter().zip(&errors.runs).enumerate() {
            let change = e.with_memory.rms_pct / e.without_memory.rms_pct.min(e.base.rms_pct) - 1.0;
            counts[k][0] += usize::from(change <= -0.35);
            counts[k][1] += usize::from(e.with_memory.rms_pct <= 0.6);
            let supported = e.supported_with_memory.rms_pct / e.supported_without_memory.rms_pct - 1.0;
            counts[k][2] += usize::from(supported <= -0.35);
            counts[k][3] += usize::from(e.supported_with_memory.rms_pct <= 0.6);
            let shown = |u: &UnseenError| format!("{:.2}", u.rms_pct);
            let _ = writeln!(
                text,
                "| {} | {name} | {} | {} | {} | {:.0} % | {} → {} | {:.0} % | {:.0} % | {:.0} % |",
                row.label,
                shown(&e.base),
                shown(&e.without_memory),
                shown(&e.with_memory),
                100.0 * change,
                shown(&e.supported_without_memory),
                shown(&e.supported_with_memory),
                100.0 * supported,
                e.ringing_pct,
                e.slack_pct
            );
        }
    }
    let n = rows.len();
    let [settled, recorded] = counts;
    let _ = writeln!(
        text,
        "\nError lower by 35 % or more: {} of {n} at settled points, {} of {n} as recorded; supported {} and {} of {n}. At most 0.6 %: {} of \
         {n} and {} of {n}; supported {} and {} of {n}.",
        settled[0], recorded[0], settled[2], recorded[2], settled[1], recorded[1], settled[3], recorded[3]
    );
    contractions(&mut text, rows);
    text
}

/// All runs of a mounting predicted from the other mountings.
fn contractions(text: &mut String, rows: &[Row]) {
    let _ = writeln!(
        text,
        "\n### Unseen contractions through the table\n\nAll runs of a mounting that lies between others are predicted from the other mountings. \
         Settled points; mean absolute error and root mean square in percent of the largest force. \"A millimetre\": the mean change of \
         the force when the held length is wrong by a millimetre, which is how exactly the lengths were set. \"Own length\" is not a prediction: \
         memory, with the length, within a millimetre of the one that was set, that suits the readings of the mounting best. What the error \
         is above it comes from the lengths.\n\n\
         | set, muscle | base, mean | static, mean | memory, mean | own length, mean | base, rms | static, rms | memory, rms | \
         own length, rms | a millimetre |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    );
    let mut means = [0.0; 5];
    let mut count = 0.0_f64;
    for row in rows {
        let Ok(unseen) = &row.errors else { continue };
        let e = &unseen.contractions;
        let all = [&e.base, &e.without_memory, &e.with_memory, &e.with_own_length];
        means.iter_mut().zip(all).for_each(|(mean, e)| *mean += e.mean_pct);
        means[4] += unseen.millimetre_pct;
        count += 1.0;
        let cells = all.map(|e| format!("{:.2}", e.mean_pct)).join(" | ");
        let rms = all.map(|e| format!("{:.2}", e.rms_pct)).join(" | ");
        let _ = writeln!(text, "| {} | {cells} | {rms} | {:.2} |", row.label, unseen.millimetre_pct);
    }
    let [base, without, with, own, millimetre] = means.map(|m| format!("{:.2}", m / count.max(1.0)));
    let _ = writeln!(text, "| **mean** | {base} | {without} | {with} | {own} | | | | | {millimetre} |");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn muscles_are_counted_by_both_bounds() {
        let size = |rms_pct: f64| UnseenError { rms_pct, mean_pct: rms_pct, readings: 100 };
        let errors = |memory: f64| UnseenErrors {
            base: size(1.2),
            without_memory: size(1.0),
            with_memory: size(memory),
            with_own_length: size(memory),
            supported_without_memory: size(0.8),
            supported_with_memory: size(0.4),
            ringing_pct: 70.0,
            slack_pct: 40.0,
        };
        let row = |a: f64, b: f64| {
            let unseen =
                Unseen { runs: [errors(a), errors(b)], contractions: errors(a), millimetre_pct: 2.5 };
            Row { label: "x".into(), errors: Ok(unseen) }
        };
        let text = section(&[row(0.5, 0.7), row(0.62, 0.59)]);
        assert!(
            text.contains(
                "| x | settled points | 1.20 | 1.00 | 0.50 | -50 % | 0.80 → 0.40 | -50 % | 70 % | 40 % |"
            ),
            "{text}"
        );
        assert!(
            text.contains("2 of 2 at settled points, 1 of 2 as recorded; supported 2 and 2 of 2. At most 0.6 %: 1 of 2 and 1 of 2; supported 2 and 2 of 2."),
            "{text}"
        );
    }
}
