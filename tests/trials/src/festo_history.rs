//! The section of festo.md on the memory of the bladder: errors of held-out runs with and without memory, the documented findings by muscle
//! and pooled over each set, and the end effect over the lengths.

use pam_fit::numerics::student::half_width_95;
use serde_json::Value;
use std::fmt::Write as _;

/// Heading of the section.
pub const HEADING: &str = "## Memory of the bladder: each run predicted from the others";

/// An answer to settled points: set, muscle, JSON.
pub struct MuscleAnswer<'a> {
    pub year: &'a str,
    pub label: &'a str,
    pub answer: Option<&'a Value>,
}

fn number(v: &Value, path: &[&str]) -> Option<f64> {
    path.iter().try_fold(v, |v, k| v.get(k)).and_then(Value::as_f64)
}

fn shown(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".into(), |v| format!("{v:.decimals$}"))
}

/// An estimate with the half-width of its 95 % interval.
fn estimate(v: Option<&Value>, decimals: usize) -> String {
    let Some(v) = v else { return "–".into() };
    let (value, low, high) = (number(v, &["value"]), number(v, &["low"]), number(v, &["high"]));
    let half = low.zip(high).map(|(l, h)| format!(" ± {:.decimals$}", 0.5 * (h - l)));
    shown(value, decimals) + &half.unwrap_or_default()
}

fn finding<'a>(history: &'a Value, kind: &str) -> Option<&'a Value> {
    let all = history.get("findings")?.as_array()?;
    all.iter().find(|f| f.get("kind").and_then(Value::as_str) == Some(kind))
}

fn found(history: &Value, kind: &str) -> bool {
    finding(history, kind).and_then(|f| f.get("found")).and_then(Value::as_bool) == Some(true)
}

/// First paragraph of the section, and the header of its table.
pub const INTRODUCTION: &str = "Settled points. Each run is predicted from the other runs of the muscle. \"Static\": a curve for each mounting and \
    direction. \"With memory\": a curve for each mounting, with the memory of the bladder. Everything is chosen without the predicted run, \
    except the places of slips and, in sets with 20 runs and more, pause and earlier load. Root mean square in percent of the largest \
    force. A point is supported when another run of the mounting reaches its pressure. Intervals: 95 %, delete-one-run jackknife.\n\n\
    | set, muscle | static | with memory | change | supported points | with slips | relaxed share c | P_b, kPa | one time constant, times the error |\n";

/// Paragraph on the documented findings, and the header of its table.
pub const DOCUMENTED: &str = "### Documented findings\n\nUnits of uncertainty are mountings or runs. \"Pooled\": one spread between mountings \
    for all muscles of a set. This is an assumption on the protocol: a muscle with two or three mountings has too few degrees of freedom \
    of its own.\n\n\
    | set, muscle | first filling low by, N | pooled | creep with memory | emptying over filling, shortened less full length, N | pooled | gap explained by | slips, bad runs |\n";

/// Paragraph on the end effect, and the header of its table.
pub const END_EFFECT: &str = "### End effect\n\nSlope of the force over pressure at full length near the highest pressures, \
    `A = A_0 (1 − ℓ/L0)`, over the lengths of a set. ℓ is the total length of the ends, which do not pull. Unit of uncertainty: \
    muscle.\n\n\
    | set | muscles | ℓ, mm (± standard error) | t | found |\n";

/// The whole section.
pub fn section(answers: &[MuscleAnswer<'_>]) -> String {
    let mut text =
        format!("{HEADING}\n\n{INTRODUCTION}| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
    let mut lower = (0, 0, 0);
    for t in answers {
        let Some(h) = t.answer.and_then(|a| a.get("history")) else {
            let _ = writeln!(text, "| {} | no history | | | | | | | |", t.label);
            continue;
        };
        let rms = |which: &str| number(h, &["unseen", which, "rms_pct"]);
        let (before, after) = (rms("without_memory"), rms("with_memory"));
        let change = before.zip(after).map(|(b, a)| 100.0 * (a / b - 1.0));
        lower.0 += usize::from(change.is_some_and(|c| c <= -35.0));
        lower.1 += usize::from(after.is_some_and(|a| a <= 0.6));
        lower.2 += 1;
        let law = |which: &str| h.get("law").and_then(|l| l.get(which));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} % | {} → {} | {} | {} | {} | {} |",
            t.label,
            shown(before, 2),
            shown(after, 2),
            shown(change, 0),
            shown(rms("supported_without"), 2),
            shown(rms("supported_with"), 2),
            shown(rms("with_slips"), 2),
            estimate(law("relaxed_share"), 2),
            estimate(law("balance_pressure"), 0),
            shown(number(h, &["law", "one_time_constant_ratio"]), 2)
        );
    }
    let _ = writeln!(
        text,
        "\nError lower by 35 % or more on {} of {}, at most 0.6 % on {} of {}.",
        lower.0, lower.2, lower.1, lower.2
    );
    documented(&mut text, answers);
    end_effect(&mut text, answers);
    text
}

/// The documented findings, muscle by muscle and pooled.
fn documented(text: &mut String, answers: &[MuscleAnswer<'_>]) {
    let _ = writeln!(text, "\n{DOCUMENTED}| --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut counts = [0; 5];
    for t in answers {
        let Some(h) = t.answer.and_then(|a| a.get("history")) else { continue };
        let own = |kind: &str| {
            let sign = if found(h, kind) { "found" } else { "not found" };
            format!("{} ({sign})", estimate(finding(h, kind).and_then(|f| f.get("size")), 1))
        };
        let pooled = |kind: &str| {
            let (deviation, freedom) = pool(answers, t.year, kind)?;
            let f = finding(h, kind)?;
            let (value, units) = (number(f, &["size", "value"])?, number(f, &["units"])?);
            let half = half_width_95(freedom) * deviation / units.sqrt();
            Some((value, half))
        };
        let by_pool = |kind: &str| pooled(kind).map_or("–".into(), |(v, h)| format!("{v:.1} ± {h:.1}"));
        let kinds = ["first-run-deficit", "creep", "filling-emptying-gap"];
        for (k, kind) in kinds.iter().enumerate() {
            counts[k] += usize::from(found(h, kind));
        }
        counts[3] += usize::from(pooled(kinds[0]).is_some_and(|(v, h)| v > h));
        counts[4] += usize::from(pooled(kinds[2]).is_some_and(|(v, h)| v > h));
        let events: Vec<String> = h
            .get("findings")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .filter(|f| {
                matches!(f.get("kind").and_then(Value::as_str), Some("slip" | "bad-run" | "loaded-before"))
            })
            .filter_map(|f| {
                let sure = f.get("found").and_then(Value::as_bool) == Some(true);
                let words = f.get("words").and_then(Value::as_str)?.replace('|', "/");
                Some(if sure { words } else { format!("(not named) {words}") })
            })
            .collect();
        let cause = finding(h, kinds[2]).and_then(|f| f.get("cause")).and_then(Value::as_str).unwrap_or("–");
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {cause} | {} |",
            t.label,
            own(kinds[0]),
            by_pool(kinds[0]),
            if found(h, kinds[1]) { "named" } else { "not named" },
            own(kinds[2]),
            by_pool(kinds[2]),
            events.join("; ")
        );
    }
    let n = answers.iter().filter(|t| t.answer.and_then(|a| a.get("history")).is_some()).count();
    let _ = writeln!(
        text,
        "\nFirst filling low: {} of {n} by its own mountings, {} of {n} pooled. Creep with memory: {} of {n}. Gap: {} of {n} by its own \
         mountings or runs, {} of {n} pooled.",
        counts[0], counts[3], counts[1], counts[2], counts[4]
    );
}

/// Standard deviation between mountings pooled over the muscles of a set, and its degrees of freedom.
fn pool(answers: &[MuscleAnswer<'_>], year: &str, kind: &str) -> Option<(f64, usize)> {
    let mut sum = (0.0, 0);
    for h in answers.iter().filter(|t| t.year == year).filter_map(|t| t.answer?.get("history")) {
        let Some(f) = finding(h, kind) else { continue };
        let by_mounting = f.get("size").and_then(|s| s.get("unit_of_uncertainty")).and_then(Value::as_str)
            == Some("mounting");
        if let (true, Some(squares), Some(units)) =
            (by_mounting, number(f, &["squares"]), number(f, &["units"]))
        {
            sum = (sum.0 + squares, sum.1 + (units as usize).saturating_sub(1));
        }
    }
    (sum.1 > 0).then(|| ((sum.0 / sum.1 as f64).sqrt(), sum.1))
}

/// The slope of force over pressure at full length against the inverse length: ends that do not pull.
fn end_effect(text: &mut String, answers: &[MuscleAnswer<'_>]) {
    let _ = writeln!(text, "\n{END_EFFECT}| --- | --- | --- | --- | --- |");
    let mut years: Vec<&str> = answers.iter().map(|t| t.year).collect();
    years.dedup();
    for year in years {
        let points: Vec<(f64, f64)> = answers
            .iter()
            .filter(|t| t.year == year)
            .filter_map(|t| {
                let h = t.answer?.get("history")?;
                let lengths = h.get("mountings")?.as_array()?;
                let longest = lengths.iter().filter_map(|m| number(m, &["length_mm"])).fold(0.0, f64::max);
                Some((1.0 / longest, number(h, &["full_length_slope_N_per_kPa"])?))
            })
            .collect();
        let n = points.len();
        if n < 3 {
            continue;
        }
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n as f64;
        let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
        let spread: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
        let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / spread;
        let whole = my - slope * mx;
        let left: f64 = points.iter().map(|p| (p.1 - whole - slope * p.0).powi(2)).sum();
        let error = (left / (n - 2) as f64 / spread).sqrt();
        let t = -slope / error;
        let _ = writeln!(
            text,
            "| {year} | {n} | {:.1} ± {:.1} | {t:.1} | {} |",
            -slope / whole,
            error / whole,
            if t > half_width_95(n - 2) { "yes" } else { "no" }
        );
    }
}

/// A page with its section of a heading replaced, or with the section at its end.
pub fn replaced(page: &str, heading: &str, section: &str) -> String {
    let Some(from) = page.find(heading) else { return format!("{}\n\n{section}", page.trim_end()) };
    let after = page[from + heading.len()..].find("\n## ").map(|k| from + heading.len() + k);
    let rest = after.map_or(String::new(), |k| page[k..].to_owned());
    format!("{}{}\n{rest}", &page[..from], section.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn muscle(length: f64, first: f64) -> Value {
        let size = json!({ "value": first, "low": first - 1.0, "high": first + 1.0, "unit_of_uncertainty": "mounting" });
        let f = |kind: &str| json!({ "kind": kind, "found": true, "size": size, "units": 3, "squares": 8.0, "cause": "log-creep" });
        json!({ "history": {
            "unseen": { "without_memory": { "rms_pct": 1.0 }, "with_memory": { "rms_pct": 0.4 } },
            "law": { "relaxed_share": size },
            "mountings": [{ "length_mm": length }],
            "full_length_slope_N_per_kPa": 0.8 * (1.0 - 20.0 / length) + 1e-4 * (length / 100.0).sin(),
            "findings": [f("first-run-deficit"), f("creep"), f("filling-emptying-gap")],
        } })
    }

    #[test]
    fn shared_values_are_pooled_and_the_end_effect_is_found() {
        let answers = [100.0, 150.0, 220.0, 300.0].map(|l| muscle(l, 3.0));
        let answers: Vec<MuscleAnswer<'_>> =
            answers.iter().map(|a| MuscleAnswer { year: "2022", label: "x", answer: Some(a) }).collect();
        // Eight of squares in two degrees of freedom each: a deviation of 2, eight degrees in all.
        assert_eq!(pool(&answers, "2022", "creep"), Some((2.0, 8)));
        let text = section(&answers);
        assert!(
            text.contains("3.0 ± 2.7") && text.contains("Error lower by 35 % or more on 4 of 4"),
            "{text}"
        );
        assert!(text.contains("| 2022 | 4 | 20.0 ±") && text.contains("| yes |"), "{text}");
    }

    #[test]
    fn a_section_is_put_in_the_place_of_the_old_one() {
        let page = format!("# T\n\na\n\n{HEADING}\n\nold\n\n## Next\n\nb\n");
        assert_eq!(
            replaced(&page, HEADING, &format!("{HEADING}\n\nnew\n")),
            format!("# T\n\na\n\n{HEADING}\n\nnew\n\n## Next\n\nb\n")
        );
        assert!(replaced("# T\n", HEADING, &format!("{HEADING}\n\nnew\n")).ends_with("new\n"));
    }
}
