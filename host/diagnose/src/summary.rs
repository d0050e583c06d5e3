//! The answer for a person at a terminal who has never heard of the effect.

use std::fmt::Write;

use super::next_experiment::revealing_experiment;
use super::verdict::{Diagnosis, Verdict};

/// The diagnosis in words.
#[must_use]
pub fn summary(d: &Diagnosis) -> String {
    let mut s = String::new();
    let _ = if d.judged {
        writeln!(
            s,
            "{}: {} rows, blocked force {:.1} N, noise {:.3} N, misfit of the plain model {:.3} N rms ({:.2} % of blocked force)",
            d.muscle,
            d.samples,
            d.blocked_force_N,
            d.noise_N,
            d.misfit_rms_N,
            100.0 * d.misfit_rms_N / d.blocked_force_N.max(1e-12)
        )
    } else {
        writeln!(s, "{}: {} rows", d.muscle, d.samples)
    };
    let _ = writeln!(
        s,
        "\n{}",
        match d.verdict {
            Verdict::Consistent if !d.judged =>
                "NOT JUDGED: these recordings say nothing about the model; why is said below.",
            Verdict::Consistent =>
                "CONSISTENT: nothing stands above the noise and the model's own inexactness.",
            Verdict::Explained if d.missing.iter().any(|m| !m.supported) =>
                "AS GIVEN: beside what was given nothing stands above the noise; what the recordings say of that is below.",
            Verdict::Explained => "EXPLAINED: what the model leaves out has a name.",
            Verdict::PartlyExplained => "PARTLY EXPLAINED: a part of what the model leaves out has a name.",
            Verdict::Unexplained =>
                "UNEXPLAINED: the model leaves something out that no effect of the library describes well enough to be named.",
        }
    );
    if !d.r#where.is_empty() {
        let _ = writeln!(s, "\nWhere the misfit sits");
        for r in d.r#where.iter().take(4) {
            let _ = writeln!(s, "  {} (p = {:.3})", r.words, r.p);
        }
    }
    for m in &d.missing {
        let _ = writeln!(
            s,
            "\n{}, acts on {}",
            if m.given {
                format!("Given: {}", m.effect)
            } else {
                format!("Missing: {} (probability {:.0} %)", m.effect, 100.0 * m.probability)
            },
            m.place
        );
        let _ = writeln!(s, "  {}", m.summary);
        let _ = writeln!(s, "  why: {}; up to {:.2} N", m.why, m.peak_N);
        // Of laws to choose from, those that were not chosen are zero.
        for p in m.parameters.iter().filter(|p| p.value != 0.0) {
            let odd =
                if p.outside_known_range { "   outside the range known from the literature" } else { "" };
            let _ = writeln!(s, "  {} = {}{odd}", p.name, with_interval(p.value, p.std, &p.unit));
        }
        if !m.confusable_with.is_empty() {
            let _ = writeln!(
                s,
                "  could also be: {} (these recordings cannot tell)",
                m.confusable_with.join(", ")
            );
        }
        if m.correction {
            let _ = writeln!(
                s,
                "  this is the bench's, not the muscle's: it corrects the data and is not sent to the controller"
            );
        }
    }
    let h = &d.held_out;
    if !d.missing.is_empty() {
        let _ = writeln!(
            s,
            "\nOn unseen rows ({}): {:.3} N before, {:.3} N after; noise {:.3} N\n  with the samples about each turn: {:.3} N before, {:.3} N after",
            h.split, h.rms_before_N, h.rms_after_N, h.noise_N, h.with_turns_before_N, h.with_turns_after_N
        );
    }
    if d.verdict != Verdict::Consistent {
        let pattern = match d.unexplained.pattern.as_str() {
            "none" => "without a pattern",
            pattern => pattern,
        };
        let _ =
            writeln!(s, "\nLeft: {:.0} % of the misfit above noise; {pattern}", 100.0 * d.unexplained.share);
    }
    if let Some(n) = &d.next_experiment {
        let _ =
            writeln!(s, "\nRecord next: {} (expected difference {:.2} N)", n.words, n.expected_difference_N);
    }
    if d.noise_N > 0.0 {
        could_be_hidden(&mut s, d);
    }
    if !d.remarks.is_empty() {
        let _ = writeln!(s, "\nTo know");
        for r in &d.remarks {
            let _ = writeln!(s, "  {r}");
        }
    }
    s
}

/// What may be there unseen, by what would show it; and what checks of the bench have excluded.
fn could_be_hidden(s: &mut String, d: &Diagnosis) {
    let mut by_measure: Vec<(&str, Vec<String>)> = Vec::new();
    for c in &d.considered {
        let unseen = c.hidden_up_to_N.is_none_or(|h| h > 0.02 * d.blocked_force_N);
        if !unseen || c.checked {
            continue;
        }
        let size = match c.hidden_up_to_N {
            Some(h) => format!("{} up to {h:.1} N", c.effect),
            None => format!("{} of any size", c.effect),
        };
        let measure = revealing_experiment(&c.effect);
        match by_measure.iter_mut().find(|m| m.0 == measure) {
            Some(known) => known.1.push(size),
            None => by_measure.push((measure, vec![size])),
        }
    }
    if !by_measure.is_empty() {
        let _ = writeln!(s, "\nCould be hidden in these recordings; what would show it");
    }
    for (measure, effects) in by_measure {
        let _ = writeln!(s, "  {}: {measure}", effects.join(", "));
    }
    let checked = d.considered.iter().filter(|c| c.checked);
    let cleared: Vec<String> = checked
        .map(|c| match c.hidden_up_to_N {
            Some(h) => format!("{} (no more than {h:.2} N)", c.effect),
            None => c.effect.clone(),
        })
        .collect();
    if !cleared.is_empty() {
        let _ = writeln!(s, "\nExcluded by checks of the bench: {}", cleared.join(", "));
    }
}

/// A value with its standard deviation to two digits: `0.924 ± 0.012 N`, `(4.59 ± 0.14)·10^-4 m`.
fn with_interval(value: f64, std: Option<f64>, unit: &str) -> String {
    let exponent = if (1e-2..1e5).contains(&value.abs()) { 0 } else { value.abs().log10().floor() as i32 };
    let scale = 10.0_f64.powi(exponent);
    let body = match std.filter(|s| *s > 0.0) {
        Some(std) => {
            let digits = (1.0 - (std / scale).log10().floor()).clamp(0.0, 5.0) as usize;
            format!("{:.digits$} ± {:.digits$}", value / scale, std / scale)
        }
        None => format!("{:.3}", value / scale),
    };
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let doubt = if std.is_none() { " (not determined)" } else { "" };
    match exponent {
        0 => format!("{body}{unit}{doubt}"),
        _ => format!("({body})·10^{exponent}{unit}{doubt}"),
    }
}

#[cfg(test)]
mod tests {
    use super::with_interval;

    #[test]
    fn a_value_has_as_many_places_as_its_interval() {
        assert_eq!(with_interval(0.92421, Some(0.01247), "N"), "0.924 ± 0.012 N");
        assert_eq!(with_interval(4.5924e-4, Some(1.419e-5), "m"), "(4.59 ± 0.14)·10^-4 m");
        assert_eq!(with_interval(-810.2, Some(31.0), ""), "-810 ± 31");
        assert_eq!(with_interval(2.5, None, "s"), "2.500 s (not determined)");
        assert_eq!(with_interval(1e300, Some(f64::MIN_POSITIVE), "s"), "(1.00000 ± 0.00000)·10^300 s");
    }
}
