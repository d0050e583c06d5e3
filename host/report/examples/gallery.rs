//! Every kind of mark and block on one page: `cargo run -p pam-report --example gallery -- OUT.html`.

use pam_report::{Axis, Colour, Figure, Mark, Page, Panel, Section, Table, Tone};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("name the file to write, for example gallery.html")?;
    std::fs::write(path, page().html())?;
    Ok(())
}

fn page() -> Page {
    let mut page = Page::new("Gallery of marks", "what reports are made of, drawn from made-up numbers");
    page.verdict(
        Tone::Good,
        "Every kind of picture is here, with P_{0}, k_{F} and `file names` in running text.",
    );
    page.fact("mean error", "0.18 %", "of blocked force", Tone::Good);
    page.fact("largest error", "1.19 %", "at 207 kPa", Tone::Caution);
    page.fact("deadband P_{0}", "76.5 kPa", "± 0.4 kPa (95 %)", Tone::Plain);
    page.fact("blocked force", "135.7 N", "at 552 kPa", Tone::Plain);
    let mut lines = Section::new("Lines and bands");
    lines.text(
        "A paragraph of text, long enough to see how it is set: measure, leading and the colour of the page.",
    );
    lines.figure(load_lines());
    lines.figure(curve());
    lines.figure(long_series());
    page.push(lines);
    let mut many = Section::new("Small multiples");
    many.figure(multiples());
    page.push(many);
    let mut other = Section::new("Bars, fields, errors");
    other.figure(log_errors());
    other.figure(bars());
    other.figure(field());
    page.push(other);
    let mut text = Section::new("Text and tables").summarised();
    text.notice(
        Tone::Caution,
        "E_{4} is *not determined* below 276 kPa: the data reach a contraction of 2 % only.",
    );
    let mut table =
        Table::new("Parameters with 95 % intervals", &["parameter", "value", "from", "to", "unit"]);
    table.row(["E_{1}", "2.13", "2.10", "2.16", "MPa"]);
    table.row(["k_{F}", "0.14", "0.137", "0.143", "–"]);
    text.table(table);
    text.list(["first point", "second point"]);
    text.listing("host fit --muscle mini.toml run-*.csv -o mini.pam");
    page.push(text);
    page.origin("recordings", "made up in this program");
    page
}

fn loop_at(level: usize) -> (Vec<f64>, Vec<f64>) {
    let top = 40.0 + 18.0 * level as f64;
    let reach = 2.0 + 1.1 * level as f64;
    (0..400)
        .map(|i| {
            let phase = f64::from(i) / 400.0 * std::f64::consts::TAU;
            let contraction = reach * (0.5 - 0.5 * phase.cos());
            let middle = top * (1.0 - contraction / reach).powf(1.3);
            (contraction, middle - 0.06 * top * phase.sin())
        })
        .unzip()
}

fn load_lines() -> Figure {
    let axes = (Axis::new("contraction ΔL/L_{0}", "%"), Axis::new("force F", "N").from_zero());
    let panel = (0..6).fold(Panel::new(axes.0, axes.1), |panel, level| {
        let (x, y) = loop_at(level);
        panel.hair(format!("{} kPa", 207 + 69 * level), Colour::ordered(level, 6), &x, &y)
    });
    Figure::new("load-lines", "Load lines", "Each loop is one pressure; its width is friction.", panel)
}

fn curve() -> Figure {
    let pressure: Vec<f64> = (0..60).map(|i| 207.0 + 6.0 * f64::from(i)).collect();
    let value = |p: &f64| 2.1 + 0.4 * ((p - 207.0) / 120.0).sin();
    let width = |p: &f64| 0.05 + 0.25 * (-(p - 207.0) / 60.0).exp();
    let of = |f: &dyn Fn(&f64) -> f64| pressure.iter().map(f).collect::<Vec<f64>>();
    let nodes: Vec<f64> = (0..6).map(|i| 207.0 + 69.0 * f64::from(i)).collect();
    let at_nodes: Vec<f64> = nodes.iter().map(value).collect();
    let panel = Panel::new(Axis::new("pressure P", "kPa"), Axis::new("E_{1}", "MPa"))
        .band(
            "95 % interval",
            Colour::Series(0),
            &pressure,
            &of(&|p| value(p) - width(p)),
            &of(&|p| value(p) + width(p)),
        )
        .line("E_{1}(P)", Colour::Series(0), &pressure, &of(&value))
        .rings("nodes of the table", Colour::Series(0), &nodes, &at_nodes)
        .region("not tested", 430.0, 480.0);
    Figure::new("e1", "Elastic coefficient against pressure", "The band widens where data are few.", panel)
}

fn long_series() -> Figure {
    let n = 1_000_000;
    let time: Vec<f64> = (0..n).map(|i| f64::from(i) * 1e-3).collect();
    let force: Vec<f64> = time.iter().map(|t| 60.0 + 40.0 * (t * 0.02).sin() + (t * 917.0).sin()).collect();
    let command: Vec<f64> = time.iter().map(|t| 60.0 + 40.0 * ((t / 100.0).floor() * 2.0).sin()).collect();
    let panel = Panel::new(Axis::new("time", "s"), Axis::new("force F", "N"))
        .hair("measured, a million rows", Colour::Muted, &time, &force)
        .step("command", Colour::Series(1), &time, &command);
    Figure::new("long", "A long recording", "Downsampled to what a screen can show.", panel)
}

fn multiples() -> Figure {
    let panels = (0..6).map(|level| {
        let (x, y) = loop_at(level);
        let model: Vec<f64> = y.iter().map(|f| f * 1.03).collect();
        Panel::new(Axis::new("contraction ΔL/L_{0}", "%"), Axis::new("force F", "N"))
            .titled(format!("{} kPa", 207 + 69 * level))
            .points("measured", Colour::Muted, &x, &y)
            .line("model", Colour::Series(0), &x, &model)
    });
    Figure::multiples(
        "multiples",
        "Model on the loops",
        "In a good fit, the line covers the dots.",
        panels.collect(),
    )
    .shared(true, true)
}

fn log_errors() -> Figure {
    let x: Vec<f64> = (0..100).map(|i| 0.08 * f64::from(i)).collect();
    let axes = (Axis::new("contraction ΔL/L_{0}", "%"), Axis::log("error e", "% of blocked force"));
    let panel = (0..5).fold(Panel::new(axes.0, axes.1), |panel, i| {
        let name = ["gaylord", "linear", "m2", "m4", "table"][i];
        let y: Vec<f64> =
            x.iter().map(|x| 10f64.powi(1 - i as i32) * (1.2 + (x * 2.0 + i as f64).sin())).collect();
        panel.line(name, Colour::Series(i), &x, &y)
    });
    Figure::new(
        "errors",
        "Error against contraction",
        "Lower is better; the axis is logarithmic.",
        panel.with("1 %", Colour::Ink, Mark::Level(1.0)),
    )
}

fn bars() -> Figure {
    let names =
        ["mullins-softening", "stress-relaxation", "coulomb-friction", "viscous-damping"].map(String::from);
    let horizontal =
        Panel::new(Axis::new("probability", "%").from_zero(), Axis::names("effect", names.to_vec()))
            .titled("names down the side")
            .bars("", Colour::Series(0), &[97.0, 41.0, 12.0, 3.0], &[0.0, 1.0, 2.0, 3.0])
            .intervals("", Colour::Ink, &[0.0, 1.0], &[90.0, 30.0], &[99.0, 55.0]);
    let vertical = Panel::new(Axis::names("", names.to_vec()), Axis::new("gain", ""))
        .titled("names along the bottom")
        .bars("gain", Colour::Series(2), &[0.0, 1.0, 2.0, 3.0], &[0.6, 0.3, -0.1, 0.2]);
    Figure::multiples("bars", "Bars", "Longer is more.", vec![horizontal, vertical])
}

fn field() -> Figure {
    let edges = |n: usize, step: f64| (0..=n).map(|i| i as f64 * step).collect::<Vec<f64>>();
    let values: Vec<f64> =
        (0..80).map(|i| (f64::from(i % 10) * 0.6).sin() * (f64::from(i / 10) * 0.5).cos()).collect();
    let panel = Panel::new(Axis::new("contraction ΔL/L_{0}", "%"), Axis::new("pressure P", "kPa"))
        .with(
            "",
            Colour::Series(0),
            Mark::Heat { x: edges(10, 0.8), y: edges(8, 60.0), values, label: "mean residual (N)".into() },
        )
        .with(
            "the misfit is here",
            Colour::Alarm,
            Mark::Region { x: (Some(1.6), Some(4.0)), y: (Some(0.0), Some(120.0)) },
        );
    Figure::new("field", "Where the misfit is", "Blue: the model is too strong; orange: too weak.", panel)
}
