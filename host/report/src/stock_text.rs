//! The diagnosis of a stock as text.

use std::fmt::Write as _;

use pam_diagnose::stock::{Interval, LawRefusal, StockDiagnosis};
use pam_fit::stock::Law;

use super::stock_mountings;

/// The description of a law between muscles, with the factor and the unit of its parameter.
pub(crate) fn law(of: Option<Law>) -> (&'static str, f64, &'static str) {
    match of {
        None => ("chance differences only", 1.0, ""),
        Some(Law::Ends) => ("ends of total length λ do not pull: F ∝ 1 − λ/L0", 1e3, "mm"),
        Some(Law::Taper) => ("tapers at the ends grow with contraction: F ∝ 1 − κ·ε/L0", 1e3, "mm"),
        Some(Law::Compliance) => ("the frame yields: x = x_read + F/K", 1e3, "mm/N"),
    }
}

/// Why a law between muscles is not named.
#[must_use]
pub fn law_refusal(of: LawRefusal) -> String {
    match of {
        LawRefusal::Negative => "its parameter would be negative".to_owned(),
        LawRefusal::NoBetterThanChance => {
            "it does not predict left-out muscles better than chance differences".to_owned()
        }
        LawRefusal::Uncertain { t, needed } => {
            format!("its parameter is {t:.1} standard errors from zero, {needed:.1} are needed")
        }
        LawRefusal::OtherLaw => "another law predicts left-out muscles better".to_owned(),
    }
}

fn plus_minus(of: &Interval, scale: f64, decimals: usize) -> String {
    format!("{:.decimals$} ± {:.decimals$}", scale * of.value, scale * 0.5 * (of.high - of.low))
}

/// The first sentences of the answer: the effect between muscles, then the mounted lengths.
#[must_use]
pub(crate) fn headline(answer: &StockDiagnosis) -> String {
    let between = between_muscles(answer);
    stock_mountings::headline(answer).map_or(between.clone(), |lengths| format!("{between} {lengths}"))
}

fn between_muscles(answer: &StockDiagnosis) -> String {
    let count = answer.muscles.len();
    match &answer.named {
        None => format!("The {count} muscles differ by chance only: no effect of their length is named."),
        Some((named, value, t)) => {
            let (description, scale, unit) = law(Some(*named));
            let decimals = if *named == Law::Compliance { 4 } else { 1 };
            let others = if answer.confusable_with.is_empty() {
                String::new()
            } else {
                format!(" These recordings do not distinguish it from {}.", answer.confusable_with.join(", "))
            };
            format!(
                "{}: {description}. The parameter is {} {unit} (95 %), {t:.1} standard errors from zero.{others}",
                named.effect(),
                plus_minus(value, scale, decimals)
            )
        }
    }
}

/// The whole answer.
#[must_use]
pub fn text(answer: &StockDiagnosis) -> String {
    let mut text = between_muscles(answer);
    if let Some(lengths) = stock_mountings::headline(answer) {
        text = format!("{text}\n{lengths}");
    }
    text += "\n\nWhat the muscles share\n";
    let _ = writeln!(
        text,
        "  pulling area at rest length: {:.1} mm² ({:.1} mm² by the described braid)",
        answer.area * 1e6,
        answer.described_area * 1e6
    );
    let _ = writeln!(
        text,
        "  contraction    force at {:.0} kPa    emptying less filling    begins to pull at",
        answer.pressure * 1e-3
    );
    for p in &answer.shared {
        let gap = p.gap.map_or("–".into(), |g| format!("{g:.1} N"));
        let onset = p.onset.map_or("–".into(), |p| format!("{:.0} kPa", p * 1e-3));
        let _ =
            writeln!(text, "  {:>11.3}    {:>14.1} N    {gap:>21}    {onset:>17}", p.contraction, p.force);
    }
    if let Some((low, muscles)) = &answer.run_in {
        let _ = writeln!(
            text,
            "  first filling of a mounting: {} N less than the second ({muscles} muscles)",
            plus_minus(low, 1.0, 1)
        );
    }
    text += "\nWhat each has of its own\n  muscle                  L0, mm   force    lengths, mm shorter than read        zero of the load cell, N\n";
    for m in &answer.muscles {
        let list = |of: &dyn Fn(&pam_diagnose::stock::MountingOwn) -> f64| {
            m.mountings.iter().map(|k| format!("{:+.1}", of(k))).collect::<Vec<_>>().join(" ")
        };
        let _ = writeln!(
            text,
            "  {:<22} {:>7.1} {:>+6.1} %   {:<34} {}",
            m.name,
            m.rest_length * 1e3,
            100.0 * (m.scale.value - 1.0),
            list(&|k| 1e3 * k.length.value),
            list(&|k| k.zero.value)
        );
    }
    text += &answer.mounted_lengths.as_ref().map_or_else(String::new, stock_mountings::text);
    text += "\nLaws between muscles, with the error on muscles that were left out\n";
    for c in &answer.considered {
        let (description, scale, unit) = law(c.law);
        let decimals = if c.law == Some(Law::Compliance) { 4 } else { 1 };
        let value = c
            .parameter
            .as_ref()
            .map_or(String::new(), |p| format!(": {} {unit}", plus_minus(p, scale, decimals)));
        let why = c.why_not.map_or_else(String::new, |why| format!("; {}", law_refusal(why)));
        let _ = writeln!(text, "  {:.2} %  {description}{value}{why}", 100.0 * c.error);
    }
    text
}
