//! Parameters: values with intervals, which are not identifiable and why, correlations.

use super::super::{Axis, Colour, Figure, Mark, Panel, Section, Table, Tone, fixed, significant};
use super::curves::with_interval;
use super::view::View;
use pam_data::statistics::NORMAL_95;

pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("Parameters").summarised();
    let s = &view.fit.summary;
    section.text(format!(
        "P_{{0}} = {} kPa. ± is the half-width of the 95 % confidence interval, from leaving out {} stretches of the motion in turn.",
        with_interval(s.deadband_kPa, s.deadband_std_kPa),
        view.fit.uncertain.blocks
    ));
    let order = view.fit.solution.problem.design.layout().order;
    let friction = view.fit.solution.problem.design.friction;
    let mut header = vec!["P (kPa)".to_owned()];
    header.extend((1..=order).map(|k| format!("E_{{{k}}} (MPa)")));
    if friction {
        header.push("k_{F}".into());
    }
    let mut table =
        Table { caption: "Values ± half-width of the 95 % confidence interval; n. i.: not identifiable (interval includes zero)".into(), header, rows: Vec::new(), links: Vec::new() };
    for p in &s.pressures {
        let mut row = vec![fixed(p.pressure_kPa, 0)];
        for (value, std) in p.E_MPa.iter().zip(&p.E_std_MPa) {
            let mut cell = with_interval(*value, *std);
            if !(value.abs() > NORMAL_95 * std) {
                cell += " (n. i.)";
            }
            row.push(cell);
        }
        if friction {
            row.push(with_interval(p.k_F, p.k_F_std));
        }
        table.row(row);
    }
    section.table(table);
    identifiability(view, &mut section);
    section.figure(correlations(view));
    let mut pressures = Table::new(
        "Errors by pressure, percent of blocked force",
        &[
            "P (kPa)",
            "F_{B} (N)",
            "free contraction",
            "mean error (%)",
            "largest (%)",
            "held out (%)",
            "rows",
        ],
    );
    for p in &s.pressures {
        pressures.row([
            fixed(p.pressure_kPa, 0),
            significant(p.blocked_force_N, 4),
            p.free_contraction.map_or("–".into(), |c| format!("{} %", fixed(100.0 * c, 2))),
            significant(p.mean_error_pct, 2),
            significant(p.max_error_pct, 2),
            p.left_out_mean_error_pct.map_or("–".into(), |e| significant(e, 2)),
            fixed(p.samples as f64, 0),
        ]);
    }
    section.table(pressures);
    section
}

/// Which parameters are not identifiable, and why.
fn identifiability(view: &View<'_>, section: &mut Section) {
    let s = &view.fit.summary;
    match s.condition {
        Some(condition) => section.text(format!(
            "The elastic columns have a condition number of {}: {}",
            significant(condition, 2),
            if condition > 300.0 {
                "over this stroke they are similar, so single E_{k} are poorly determined. Their sum, which the controller uses, is \
                 determined much better."
            } else if s.not_determined.is_empty() {
                "low enough to identify each E_{k}."
            } else {
                "low enough. What limits the parameters below is the range of the recordings, or their noise."
            }
        )),
        None => section.text("The elastic columns are linearly dependent: not all E_{k} are identifiable from this stroke."),
    }
    if s.not_determined.is_empty() {
        section.notice(
            Tone::Good,
            "All coefficients are identifiable: no 95 % confidence interval includes zero.",
        );
        return;
    }
    let list: Vec<String> = s.not_determined.iter().map(|n| in_symbols(&n.to_string())).collect();
    section.notice(
        Tone::Caution,
        format!(
            "*Not identifiable:* {}. The force inside the recorded range is not affected. Do not use these numbers as material \
             constants, and do not extrapolate.",
            list.join("; ")
        ),
    );
}

/// `E_3` as a symbol with its index.
fn in_symbols(text: &str) -> String {
    let mut out = text.replace("P0", "P_{0}").replace("k_F", "k_{F}");
    for k in 1..=9 {
        out = out.replace(&format!("E_{k}"), &format!("E_{{{k}}}"));
    }
    out
}

fn correlations(view: &View<'_>) -> Figure {
    let all = &view.fit.summary.correlations;
    let names: Vec<String> = all.names.iter().map(|name| in_symbols(name)).collect();
    let n = names.len();
    let values: Vec<f64> = all.matrix.iter().flatten().map(|c| c.unwrap_or(f64::NAN)).collect();
    let edges: Vec<f64> = (0..=n).map(|i| i as f64 - 0.5).collect();
    let panel = Panel::new(Axis::names("", names.clone()), Axis::names("", names)).with(
        "",
        Colour::Series(0),
        Mark::Heat { x: edges.clone(), y: edges, values, label: "correlation".into() },
    );
    Figure::new(
        "correlations",
        format!("Correlation of the parameters at {}", view.name(view.levels.len() / 2)),
        "A strong colour off the diagonal marks two parameters that compensate each other.",
        panel,
    )
}
