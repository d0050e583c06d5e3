//! The numbers: values with intervals, what is not determined and why, how they depend on each other.

use super::super::{Axis, Colour, Figure, Mark, Panel, Section, Table, Tone, figures, fixed};
use super::curves::with_interval;
use super::view::View;
use crate::fit::Options;
use crate::fit::uncertainty;

pub(super) fn section(view: &View<'_>, options: &Options) -> Section {
    let mut section = Section::new("Parameters").summarised();
    let s = &view.fit.summary;
    section.text(format!(
        "P_{{0}} = {} kPa. Intervals are of 95 %, found by leaving out {} stretches of the motion in turn.",
        with_interval(s.deadband_kPa, s.deadband_std_kPa),
        view.fit.uncertain.blocks
    ));
    let order = view.fit.prepared.design.layout().order;
    let friction = view.fit.prepared.design.friction;
    let mut head = vec!["P (kPa)".to_owned()];
    head.extend((1..=order).map(|k| format!("E_{{{k}}} (MPa)")));
    if friction {
        head.push("k_{F}".into());
    }
    let mut table =
        Table { caption: "Values with 95 % intervals; n. d.: not determined".into(), head, rows: Vec::new() };
    let mut loose: Vec<(String, String)> = Vec::new();
    for (group, p) in s.pressures.iter().enumerate() {
        let mut row = vec![fixed(p.pressure_kPa, 0)];
        for (k, (value, std)) in p.E_MPa.iter().zip(&p.E_std_MPa).enumerate() {
            let mut cell = with_interval(*value, *std);
            if !(value.abs() > 1.96 * std) {
                cell += " (n. d.)";
                loose.push((format!("E_{{{}}}", k + 1), view.name(group)));
            }
            row.push(cell);
        }
        if friction {
            row.push(with_interval(p.k_F, p.k_F_std));
        }
        table.row(row);
    }
    section.table(table);
    words(view, &loose, options, &mut section);
    section.figure(correlations(view));
    let mut pressures = Table::new(
        "Pressure by pressure",
        &[
            "P (kPa)",
            "F_{B} (N)",
            "free contraction",
            "mean error (%)",
            "largest (%)",
            "left out (%)",
            "rows",
        ],
    );
    for p in &s.pressures {
        pressures.row([
            fixed(p.pressure_kPa, 0),
            figures(p.blocked_force_N, 4),
            p.free_contraction.map_or("–".into(), |c| format!("{} %", fixed(100.0 * c, 2))),
            figures(p.mean_error_pct, 2),
            figures(p.max_error_pct, 2),
            p.left_out_mean_error_pct.map_or("–".into(), |e| figures(e, 2)),
            fixed(p.samples as f64, 0),
        ]);
    }
    section.table(pressures);
    section
}

/// What is not determined, said in words with the reason and a remedy.
fn words(view: &View<'_>, loose: &[(String, String)], options: &Options, section: &mut Section) {
    let s = &view.fit.summary;
    let reach = view.contraction(view.fit.prepared.points.stroke.span());
    match s.condition {
        Some(condition) => section.text(format!(
            "The elastic columns have a condition number of {}: {}",
            figures(condition, 2),
            if condition > 300.0 {
                "over this stroke they look alike, so single E_{k} mean little. Their sum, which is what the controller uses, \
                 is determined far better than each of them."
            } else {
                "low enough that each E_{k} has a meaning of its own."
            }
        )),
        None => section.text("The elastic columns depend on each other: not all E_{k} can be found from this stroke."),
    }
    if loose.is_empty() {
        section.notice(Tone::Good, "Every coefficient is determined: none of the 95 % intervals holds zero.");
        return;
    }
    let mut names: Vec<&str> = loose.iter().map(|(n, _)| n.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let list: Vec<String> = names
        .iter()
        .map(|name| {
            let at: Vec<&str> = loose.iter().filter(|(n, _)| n == name).map(|(_, a)| a.as_str()).collect();
            if at.len() == view.levels.len() {
                format!("{name} at every pressure")
            } else {
                format!("{name} at {}", at.join(", "))
            }
        })
        .collect();
    let remedy = if options.order > 2 { " or a lower `--order`" } else { "" };
    section.notice(
        Tone::Caution,
        format!(
            "*Not determined:* {}. Their intervals hold zero, because the recordings contract by {} % only and powers of a small \
             strain look alike there. The force inside the recorded range is not affected; do not read these numbers as \
             material constants, and do not extrapolate. A longer stroke{remedy} would determine them.",
            list.join("; "),
            fixed(reach, 1)
        ),
    );
}

fn correlations(view: &View<'_>) -> Figure {
    let prepared = &view.fit.prepared;
    let middle = view.levels.len() / 2;
    let pressure = view.levels.get(middle).copied().unwrap_or(0.0);
    let root = uncertainty::of_table(prepared, &view.fit.uncertain.root, &[pressure]);
    let order = prepared.design.layout().order;
    let friction = usize::from(prepared.design.friction);
    let n = 1 + order + friction;
    let mut names = vec!["P_{0}".to_owned()];
    names.extend((1..=order).map(|k| format!("E_{{{k}}}")));
    if friction == 1 {
        names.push("k_{F}".into());
    }
    let mut values = Vec::with_capacity(n * n);
    for i in 0..n {
        for j in 0..n {
            let mut g = vec![0.0; root.rows];
            let (a, b) = (root.std(i), root.std(j));
            // cov(a, b) from the variances of a sum and of a difference of scaled numbers.
            if a > 0.0 && b > 0.0 {
                (g[i], g[j]) = (g[i] + 1.0 / a, g[j] + 1.0 / b);
                let plus = root.variance(&g);
                values.push(if i == j { 1.0 } else { plus / 2.0 - 1.0 });
            } else {
                values.push(f64::NAN);
            }
        }
    }
    let edges: Vec<f64> = (0..=n).map(|i| i as f64 - 0.5).collect();
    let panel = Panel::new(Axis::names("", names.clone()), Axis::names("", names)).with(
        "",
        Colour::Series(0),
        Mark::Heat { x: edges.clone(), y: edges, values, label: "correlation".into() },
    );
    Figure::new(
        "correlations",
        format!("Correlation of the parameters at {}", view.name(middle)),
        "A full colour off the diagonal means that two numbers trade against each other: an error in one is made good by the other.",
        panel,
    )
}
