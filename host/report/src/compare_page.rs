//! The page of two recordings side by side: each quantity of both over time, its difference, and both as loops.

use super::wording::capital;
use super::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, fixed, significant};
use pam_data::compare::{Column, Comparison};
use pam_data::pluralise::pluralise;
use pam_data::recording::Recording;

/// The page of a comparison of `b` with `a`.
#[must_use]
pub fn page(a: &Recording, b: &Recording, found: &Comparison) -> Page {
    let names = [labelled("A", a, b), labelled("B", b, a)];
    let mut page = Page::new("Two recordings compared", format!("{} and {}", names[0], names[1]));
    page.verdict(Tone::Plain, verdict(a, b, found));
    for c in &found.columns {
        let label = format!("{}, B − A", title(c.name));
        if c.largest == 0.0 {
            page.fact(label, "equal", "at every row", Tone::Plain);
            continue;
        }
        let note =
            format!("rms difference; mean {}, largest {}", signed(c.mean, c.rms), significant(c.largest, 3));
        page.fact(label, format!("{} {}", significant(c.rms, 3), c.unit), note, Tone::Plain);
    }
    page.push(numbers(found));
    let mut over_time = Section::new("Over time");
    over_time.text(
        "Time counts from the start of each recording; B is interpolated linearly at the times of A. A shift in time shows as a \
         difference.",
    );
    for column in &found.columns {
        over_time_of(&mut over_time, a, b, &names, column, found);
    }
    page.push(over_time);
    page.push(loops(a, b, &names));
    for (label, r) in [("A", a), ("B", b)] {
        page.origin(
            format!("recording {label}"),
            format!("{}, {}, {} s", r.source.display(), pluralise(r.len(), "row"), fixed(r.duration(), 1)),
        );
    }
    page.origin("made by", format!("host {}", env!("CARGO_PKG_VERSION")));
    page
}

/// The label of a recording with its name; where both have the same name, with its folder.
fn labelled(label: &str, one: &Recording, other: &Recording) -> String {
    if one.name == other.name && !one.source.as_os_str().is_empty() {
        format!("{label}: {}", one.source.display())
    } else {
        format!("{label}: {}", one.name)
    }
}

/// A mean with its sign; nothing where it is none beside the root mean square.
fn signed(value: f64, rms: f64) -> String {
    if value.abs() < 1e-3 * rms {
        return "0".to_owned();
    }
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", significant(value, 3))
}

fn verdict(a: &Recording, b: &Recording, found: &Comparison) -> String {
    let seconds = fixed(found.overlap, 1);
    let Some(force) = found.columns.iter().find(|c| c.name == "force") else {
        return format!(
            "At least one recording has no force, so forces are not compared ({seconds} s in common)."
        );
    };
    if force.largest == 0.0 {
        return format!("B has the same force as A over the common {seconds} s.");
    }
    // Of both: A may be a tare, of whose noise anything is thousands of percent.
    let largest =
        [a, b].into_iter().flat_map(|r| r.force.iter().flatten()).fold(0.0f64, |m, f| m.max(f.abs()));
    let share = if largest > 0.0 {
        format!(" ({} % of the largest force in either)", significant(100.0 * force.mean.abs() / largest, 2))
    } else {
        String::new()
    };
    format!(
        "The mean force of B is {} N {} than that of A{share}, over the common {seconds} s.",
        significant(force.mean.abs(), 3),
        if force.mean < 0.0 { "lower" } else { "higher" }
    )
}

fn numbers(found: &Comparison) -> Section {
    let mut section = Section::new("Differences").summarised();
    let caption = format!(
        "B − A over {} in {} s",
        pluralise(fixed(found.rows as f64, 0), "row"),
        fixed(found.overlap, 1)
    );
    let mut table = Table::new(caption, &["quantity", "rms", "mean", "largest", "at s"]);
    for c in &found.columns {
        table.row([
            format!("{}, {}", title(c.name), c.unit),
            significant(c.rms, 3),
            signed(c.mean, c.rms),
            significant(c.largest, 3),
            fixed(c.largest_at, 2),
        ]);
    }
    section.table(table);
    section
}

fn over_time_of(
    section: &mut Section,
    a: &Recording,
    b: &Recording,
    names: &[String; 2],
    column: &Column,
    found: &Comparison,
) {
    let (Some((ta, ya)), Some((tb, yb))) = (series(a, column.name), series(b, column.name)) else { return };
    let title = title(column.name);
    let time = || Axis::new("time after the start", "s");
    let axis = Axis::new(format!("{title} {}", symbol(column.name)).trim_end(), column.unit);
    let both = Panel::new(time(), axis).line(&names[0], Colour::Series(0), &ta, &ya).line(
        &names[1],
        Colour::Series(1),
        &tb,
        &yb,
    );
    let same = column.largest == 0.0;
    let reading = if same { "Both are equal at every row." } else { "Both recordings over time." };
    section.figure(Figure::new(column.name, capital(title), reading, both));
    if same {
        return;
    }
    let difference = Panel::new(time(), Axis::new("B − A", column.unit)).line(
        "B − A",
        Colour::Series(2),
        &found.time,
        &column.difference,
    );
    let reading = format!(
        "Difference over time. The largest, {} {}, is at {} s.",
        significant(column.largest, 3),
        column.unit,
        fixed(column.largest_at, 2)
    );
    let name = format!("{}-difference", column.name);
    section.figure(Figure::new(name, format!("{}, B − A", capital(title)), reading, difference));
}

fn loops(a: &Recording, b: &Recording, names: &[String; 2]) -> Section {
    let mut section = Section::new("Force against stroke");
    if let (Some(fa), Some(fb)) = (&a.force, &b.force) {
        let millimetres = |r: &Recording| r.stroke.iter().map(|x| x * 1e3).collect::<Vec<_>>();
        let panel = Panel::new(Axis::new("contraction stroke", "mm"), Axis::new("force F", "N"))
            .line(&names[0], Colour::Series(0), &millimetres(a), fa)
            .line(&names[1], Colour::Series(1), &millimetres(b), fb);
        section.figure(Figure::new(
            "loops",
            "Force against stroke",
            "The height of a loop is friction, its position is pressure and elasticity. A loop that is shifted as a whole means another \
             pressure or another zero.",
            panel,
        ));
    }
    section
}

fn title(name: &str) -> &'static str {
    match name {
        "force" => "force",
        "pressure" => "pressure",
        _ => "contraction stroke",
    }
}

fn symbol(name: &str) -> &'static str {
    match name {
        "force" => "F",
        "pressure" => "P",
        _ => "",
    }
}

/// Time after the start, s, and a quantity in the unit that it is compared in.
fn series(r: &Recording, name: &str) -> Option<(Vec<f64>, Vec<f64>)> {
    let (values, scale) = match name {
        "force" => (r.force.as_ref()?, 1.0),
        "pressure" => (&r.pressure, 1e-3),
        _ => (&r.stroke, 1e3),
    };
    let start = r.time.first()?;
    Some((r.time.iter().map(|t| t - start).collect(), values.iter().map(|v| v * scale).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pam_data::compare::compare;

    fn recording(folder: &str, offset: f64) -> Recording {
        let time: Vec<f64> = (0..50).map(|i| f64::from(i) * 0.1).collect();
        Recording {
            name: "run".into(),
            source: format!("{folder}/run.csv").into(),
            force: Some(time.iter().map(|t| 10.0 * t + offset).collect()),
            pressure: vec![3e5; 50],
            stroke: time.iter().map(|t| t * 1e-3).collect(),
            time,
            ..Recording::default()
        }
    }

    #[test]
    fn the_page_states_which_pulls_more_and_distinguishes_equal_names() {
        let (a, b) = (recording("before", 0.0), recording("after", 4.9));
        let page = page(&a, &b, &compare(&a, &b).expect("a comparison"));
        let (_, verdict) = page.verdict.clone().expect("a verdict");
        assert!(
            verdict.contains(
                "The mean force of B is 4.90 N higher than that of A (9.1 % of the largest force in either)"
            ),
            "{verdict}"
        );
        assert_eq!(page.subtitle, "A: before/run.csv and B: after/run.csv");
        assert!(page.markdown().contains("| force, N | 4.90 | +4.90 |"), "{}", page.markdown());
        // Force, its difference, and the loops; pressure and stroke are the same and have no difference to show.
        assert_eq!(page.figures().count(), 5);
    }
}
