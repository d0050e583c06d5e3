//! The differences between two tables, in the terms of the muscle.

use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use model_core::units::{Length, Pressure};

/// One quantity that differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// What it is, with its unit.
    pub name: String,
    /// Its value on the device.
    pub before: String,
    /// Its value in the new table.
    pub after: String,
}

/// The difference between two tables.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TableDiff {
    /// Quantities that differ; empty for equal tables.
    pub changes: Vec<Change>,
    /// Largest and root mean square difference of force over the new table's tested range, N, friction left out.
    pub force: Option<(f64, f64)>,
}

/// Compares the table on a device with the one that is to replace it.
#[must_use]
pub fn between(before: &MuscleTable, after: &MuscleTable) -> TableDiff {
    let mut changes = Vec::new();
    let mut add = |name: &str, a: String, b: String| {
        if a != b {
            changes.push(Change { name: name.to_owned(), before: a, after: b });
        }
    };
    let geometry = |t: &MuscleTable| {
        let g = &t.geometry;
        format!(
            "L0 {:.3} mm, α0 {:.2}°, D0 {:.3} mm, t0 {:.3} mm{}",
            g.rest_length.metres() * 1e3,
            g.braid_angle.si().to_degrees(),
            g.outer_diameter.metres() * 1e3,
            g.wall.metres() * 1e3,
            if g.tip_correction { ", tip correction" } else { "" }
        )
    };
    let list = |values: &[f32], scale: f32, digits: usize| {
        values.iter().map(|v| format!("{:.digits$}", v * scale)).collect::<Vec<_>>().join(" ")
    };
    add("kind", format!("{:?}", before.kind).to_lowercase(), format!("{:?}", after.kind).to_lowercase());
    add("geometry", geometry(before), geometry(after));
    let kpa = |p: Pressure<f32>| format!("{:.2}", p.pascals() * 1e-3);
    add("P0, kPa", kpa(before.deadband), kpa(after.deadband));
    let newtons = |t: &MuscleTable| format!("{:.2}", t.blocked_force.newtons());
    add("blocked force, N", newtons(before), newtons(after));
    add("greatest pressure, kPa", kpa(before.max_pressure), kpa(after.max_pressure));
    add("nodes, kPa", list(&before.nodes, 1e-3, 1), list(&after.nodes, 1e-3, 1));
    for k in 0..before.order().max(after.order()) {
        let row = |t: &MuscleTable| t.elastic.get(k).map_or("none".to_owned(), |c| list(c, 1e-6, 3));
        add(&format!("E_{}, MPa", k + 1), row(before), row(after));
    }
    add("k_F", list(&before.friction, 1.0, 4), list(&after.friction, 1.0, 4));
    let effects = |t: &MuscleTable| {
        if t.effects.is_empty() {
            return "none".to_owned();
        }
        let one = |e: &model_core::effects::FittedEffect| {
            let values: Vec<String> = e.parameters.iter().map(|p| format!("{p:.4e}")).collect();
            format!("{} ({})", e.effect.info().name, values.join(", "))
        };
        t.effects.iter().map(one).collect::<Vec<_>>().join("; ")
    };
    add("effects", effects(before), effects(after));
    TableDiff { changes, force: force_difference(before, after) }
}

/// Largest and root mean square difference of `F_quasi` on a grid over the new table's tested range.
fn force_difference(before: &MuscleTable, after: &MuscleTable) -> Option<(f64, f64)> {
    const STEPS: u32 = 20;
    let (a, b) = (Muscle::<f64>::build(before).ok()?, Muscle::<f64>::build(after).ok()?);
    let tested = &after.tested;
    let l0 = f64::from(after.geometry.rest_length.metres());
    let between = |low: f32, high: f32, i: u32| {
        f64::from(low) + f64::from(high - low) * f64::from(i) / f64::from(STEPS)
    };
    let (mut largest, mut squares, mut count) = (0.0_f64, 0.0, 0u32);
    for i in 0..=STEPS {
        let stroke = Length::from_metres(l0 * between(tested.contraction_low, tested.contraction_high, i));
        for j in 0..=STEPS {
            let pressure = between(tested.pressure_low.pascals(), tested.pressure_high.pascals(), j);
            let pressure = Pressure::from_pascals(pressure);
            let difference =
                (b.force(pressure, stroke, 0.0).newtons() - a.force(pressure, stroke, 0.0).newtons()).abs();
            if difference.is_finite() {
                largest = largest.max(difference);
                squares += difference * difference;
                count += 1;
            }
        }
    }
    (count > 0).then(|| (largest, (squares / f64::from(count)).sqrt()))
}

impl TableDiff {
    /// Whether the tables are the same to the digits that people read.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    /// Lines for a terminal.
    #[must_use]
    pub fn to_text(&self) -> String {
        if self.is_empty() {
            return "no difference".to_owned();
        }
        let width = self.changes.iter().map(|c| c.name.chars().count()).max().unwrap_or(0);
        let mut text = String::new();
        for change in &self.changes {
            let pad = " ".repeat(width - change.name.chars().count());
            text += &format!(
                "  {}{pad}  {}\n  {}  → {}\n",
                change.name,
                change.before,
                " ".repeat(width),
                change.after
            );
        }
        if let Some((largest, rms)) = self.force {
            text += &format!(
                "  force differs by {rms:.2} N rms and {largest:.2} N at most over the tested range\n"
            );
        }
        text.trim_end().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::table::example;

    #[test]
    fn only_differences_are_listed_with_their_effect_on_the_force() {
        assert!(between(&example(), &example()).is_empty());
        let mut other = example();
        other.deadband = Pressure::from_kilopascals(86.5);
        let difference = between(&example(), &other);
        assert_eq!(difference.changes.len(), 1);
        assert_eq!(difference.changes[0].name, "P0, kPa");
        // ΔF = ΔP0 (3 L² − B²)/(4 π N²), largest at rest length, where it is F/P′.
        let blocked = Muscle::<f64>::build(&example()).unwrap();
        let at =
            |kpa| blocked.force(Pressure::from_kilopascals(kpa), Length::from_metres(0.0), 0.0).newtons();
        let expected = at(300.0) - at(290.0);
        let (largest, rms) = difference.force.unwrap();
        assert!((largest - expected).abs() < 1e-3 * expected, "{largest} N, expected {expected} N");
        assert!(rms < largest && rms > 0.5 * largest);
    }
}
