//! The report of a stock: how the muscles differ with their length, what they share, and what each has of its own.

use pam_diagnose::stock::StockDiagnosis;
use pam_fit::stock::{Law, MountingCause};

use super::stock_mountings;
use super::stock_text::{headline, law, law_refusal};
use super::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, fixed};

/// Points of a curve.
const POINTS: usize = 121;
/// Pressures at which the shared force is drawn, as shares of the highest one.
const CURVES: [f64; 4] = [0.4, 0.6, 0.8, 1.0];

/// The page of a diagnosis.
#[must_use]
pub fn page(answer: &StockDiagnosis) -> Page {
    let names: Vec<&str> = answer.muscles.iter().map(|m| m.name.as_str()).collect();
    let mut page = Page::new("Muscles of one stock", names.join(", "));
    let lengths_named = answer.mounted_lengths.as_ref().filter(|l| l.named());
    let tone = if answer.named.is_some() || lengths_named.is_some() { Tone::Caution } else { Tone::Good };
    page.verdict(tone, headline(answer));
    if let Some((of, value, _)) = &answer.named {
        let (_, scale, unit) = law(Some(*of));
        page.fact(
            of.effect(),
            format!("{} {unit}", fixed(scale * value.value, 1)),
            "of all muscles",
            Tone::Plain,
        );
    }
    if let Some(lengths) = lengths_named {
        page.fact(
            MountingCause::Length.effect().info().name,
            format!("{} mm", fixed(1e3 * lengths.size.value, 1)),
            "rms over the mountings",
            Tone::Plain,
        );
    }
    page.fact("muscles", answer.muscles.len().to_string(), "fitted together", Tone::Plain);
    page.push(lengths(answer));
    page.push(shared(answer));
    page.push(own(answer));
    page.push(laws(answer));
    if let Some(lengths) = &answer.mounted_lengths {
        page.push(stock_mountings::section(answer, lengths));
    }
    page
}

/// Blocked force against rest length.
fn lengths(answer: &StockDiagnosis) -> Section {
    let mut section = Section::new("Blocked force and rest length").summarised();
    let measured: Vec<(f64, f64)> = answer.muscles.iter().map(|m| (m.rest_length, m.blocked)).collect();
    let (short, long) = measured.iter().fold((f64::INFINITY, 0.0_f64), |(s, l), m| (s.min(m.0), l.max(m.0)));
    let fit = &answer.fitted.fit;
    let at: Vec<f64> = (0..POINTS)
        .map(|k| 0.9 * short + (1.05 * long - 0.9 * short) * k as f64 / (POINTS - 1) as f64)
        .collect();
    let shared = fit.shared_force(answer.pressure, 0.0, 0.0);
    let mut panel = Panel::new(Axis::new("rest length", "mm"), Axis::new("blocked force", "N"));
    if !answer.fitted.laws.contains(&Law::Compliance) {
        let x: Vec<f64> = at.iter().map(|l| 1e3 * l).collect();
        let y: Vec<f64> = at.iter().map(|l| shared * fit.pull(0.0, *l)).collect();
        panel = panel.line("stock", Colour::Series(0), &x, &y);
    }
    let (x, y): (Vec<f64>, Vec<f64>) = measured.iter().map(|m| (1e3 * m.0, m.1)).unzip();
    panel = panel.points("muscles", Colour::Series(1), &x, &y);
    section.figure(Figure::new(
        "blocked",
        format!("Blocked force at {} kPa by the joint fit", fixed(answer.pressure * 1e-3, 0)),
        "A curve that rises with length shows ends that do not pull. Distances from it are the muscles' own.",
        panel,
    ));
    section
}

/// The shared force over contraction.
fn shared(answer: &StockDiagnosis) -> Section {
    let mut section = Section::new("What the muscles share").summarised();
    let deepest = answer.shared.last().map_or(0.2, |p| p.contraction);
    let at: Vec<f64> = (0..POINTS).map(|k| deepest * k as f64 / (POINTS - 1) as f64).collect();
    let mut panel = Panel::new(Axis::new("contraction", ""), Axis::new("force", "N").from_zero());
    for (k, share) in CURVES.iter().enumerate() {
        let pressure = share * answer.pressure;
        let y: Vec<f64> = at.iter().map(|e| answer.fitted.fit.shared_force(pressure, *e, 0.0)).collect();
        panel = panel.line(format!("{} kPa", fixed(pressure * 1e-3, 0)), Colour::Series(k), &at, &y);
    }
    section.figure(Figure::new(
        "shared",
        "Force of the stock",
        "Mid-line between filling and emptying, of a muscle of mean inverse length.",
        panel,
    ));
    let mut table = Table::new(
        "Bladder and braid",
        &["contraction", "force (N)", "emptying less filling (N)", "begins to pull at (kPa)"],
    );
    for p in &answer.shared {
        table.row([
            fixed(p.contraction, 3),
            fixed(p.force, 1),
            p.gap.map_or(String::new(), |g| fixed(g, 1)),
            p.onset.map_or(String::new(), |p| fixed(p * 1e-3, 0)),
        ]);
    }
    section.table(table);
    section.text(format!(
        "The pressure pulls on {} mm² at rest length; the described braid has {} mm².",
        fixed(answer.area * 1e6, 1),
        fixed(answer.described_area * 1e6, 1)
    ));
    if let Some((low, muscles)) = &answer.run_in {
        section.text(format!(
            "The first filling of a mounting pulls {} N less than the second (95 %: {} to {} N, {muscles} muscles).",
            fixed(low.value, 1),
            fixed(low.low, 1),
            fixed(low.high, 1)
        ));
    }
    section
}

/// What each muscle has of its own.
fn own(answer: &StockDiagnosis) -> Section {
    let mut section = Section::new("What each muscle has of its own");
    let names: Vec<String> = answer.muscles.iter().map(|m| m.name.clone()).collect();
    let (mut x, mut y, mut low, mut high) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (k, m) in answer.muscles.iter().enumerate() {
        let count = m.mountings.len().max(1) as f64;
        for (j, mounting) in m.mountings.iter().enumerate() {
            x.push(k as f64 + 0.5 * (j as f64 + 0.5) / count - 0.25);
            y.push(1e3 * mounting.length.value);
            low.push(1e3 * mounting.length.low);
            high.push(1e3 * mounting.length.high);
        }
    }
    let panel = Panel::new(Axis::names("muscle", names), Axis::new("shorter than read", "mm"))
        .intervals("95 %", Colour::Muted, &x, &low, &high)
        .points("mounting", Colour::Series(0), &x, &y);
    section.figure(Figure::new(
        "mountings",
        "Error of the mounted lengths",
        "One point for each mounting, in the order of the recordings.",
        panel,
    ));
    let mut table = Table::new(
        "Forces, lengths and zeros",
        &[
            "muscle",
            "mounting",
            "rest length (mm)",
            "force beside the stock (%)",
            "shorter than read (mm)",
            "zero of the load cell (N)",
            "first filling low by (N)",
        ],
    );
    for m in &answer.muscles {
        for (k, mounting) in m.mountings.iter().enumerate() {
            let first = k == 0;
            let only = |text: String| if first { text } else { String::new() };
            table.row([
                only(m.name.clone()),
                mounting.stroke.map_or_else(|| "moved".to_owned(), |s| format!("{} mm", fixed(s * 1e3, 2))),
                only(fixed(m.rest_length * 1e3, 1)),
                only(fixed(100.0 * (m.scale.value - 1.0), 1)),
                fixed(1e3 * mounting.length.value, 2),
                fixed(mounting.zero.value, 1),
                only(m.run_in.as_ref().map_or(String::new(), |e| fixed(e.value, 1))),
            ]);
        }
    }
    section.table(table);
    section
}

/// Laws between muscles.
fn laws(answer: &StockDiagnosis) -> Section {
    let mut section = Section::new("Laws between muscles");
    let mut table = Table::new(
        "Each muscle predicted from the others",
        &["law", "effect", "parameter", "95 %", "error on left-out muscles (%)", "why not"],
    );
    for c in &answer.considered {
        let (description, scale, unit) = law(c.law);
        let decimals = if c.law == Some(Law::Compliance) { 4 } else { 1 };
        let shown = |v: f64| format!("{} {unit}", fixed(scale * v, decimals));
        table.row([
            description.to_owned(),
            c.law.map_or("", Law::effect).to_owned(),
            c.parameter.as_ref().map_or(String::new(), |p| shown(p.value)),
            c.parameter.as_ref().map_or(String::new(), |p| format!("{} to {}", shown(p.low), shown(p.high))),
            fixed(100.0 * c.error, 2),
            c.why_not.map_or_else(String::new, law_refusal),
        ]);
    }
    section.table(table);
    section
}
