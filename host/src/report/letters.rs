//! What the letters in an effect's equation mean.

use super::Table;

/// Letters that mean the same in every equation; what an equation defines itself is left to it, and parameters to their table.
const LETTERS: [(&str, &str); 39] = [
    ("F_quasi", "pull of the base model without friction, N"),
    ("F_b", "what the bladder takes from the pull: the base model's without friction less P·g, N"),
    ("F_G", "Gaylord's force of the effective pressure, P′·g, N"),
    ("k_F", "friction factor of the table at this pressure"),
    ("s", "direction: +1 while shortening, −1 while lengthening, held at rest"),
    ("s_x", "direction in which the stroke last went; filling and emptying do not turn it"),
    ("P", "pressure at the sensor, Pa"),
    ("P_a", "pressure of the air outside, 101.3 kPa"),
    ("P′", "effective pressure, P − P0, Pa"),
    ("dP", "change of the pressure; with dt its rate, Pa/s"),
    ("g", "pull per pascal of the cylinder, (3L² − B²)/(4πN²), m²"),
    ("∂F", "with ∂x the slope of the base model's force over the stroke, negative, N/m"),
    ("x", "stroke, positive in contraction, m"),
    ("ΔL", "stroke, positive in contraction, m"),
    ("v", "speed of the stroke, m/s"),
    ("dv", "with dt the acceleration, m/s²"),
    ("ε", "contraction, the stroke over the rest length"),
    ("ε_x", "radial strain of the bladder"),
    ("L", "length, m"),
    ("L0", "rest length, m"),
    ("R", "radius, m"),
    ("R0", "radius at rest length, m"),
    ("V", "volume of the cylinder, πR²L, m³"),
    ("V_0", "volume at rest length, m³"),
    ("B", "length of one fibre of the braid, m"),
    ("N", "turns of a fibre"),
    ("t_B", "thickness of the bladder's wall, m"),
    ("E", "modulus that the base model's elastic force has there, Pa"),
    ("h′", "slope of h over the length, Pa/m"),
    ("c_1", "elastic force of a linear wall per pascal of its modulus, m²"),
    ("ξ", "travel of the strands, m"),
    ("dξ", "travel of the strands, m"),
    ("t", "time, s"),
    ("t_rest", "how long the muscle rested, s"),
    ("d_rest", "travel since the rest, m"),
    ("θ", "temperature less that of the first reading, K"),
    ("W", "how far the rubber is stretched, I₁ − 3"),
    ("W_m", "the largest W so far"),
    ("LP_τ", "what a filter of first order with time constant τ makes of it"),
];

/// Letters that are looked for beside a function's bracket: `q(u)` is the over-stress that a drive `u` leaves.
const OVERSTRESS: (&str, &str) = ("q", "over-stress that the drive u in brackets leaves, which fades");

/// The letters with their indices, without powers and numbers before them.
fn names(law: &str) -> Vec<&str> {
    let of_a_name = |c: char| (c.is_alphanumeric() && !"²³⁴π".contains(c)) || "_′∂".contains(c);
    law.split(|c| !of_a_name(c))
        .map(|n| n.trim_start_matches(|c: char| c.is_ascii_digit()))
        .filter(|n| !n.is_empty())
        .collect()
}

/// The letters of an equation that its own text and its parameters leave open.
#[must_use]
pub fn letters(equation: &str) -> Table {
    let mut table = Table::new("Letters of the equation; the others are its parameters", &["letter", "what"]);
    // The force on the left is the effect's; `F` again on the right is the base model's.
    let (_, law) = equation.split_once('=').unwrap_or(("", equation));
    let names = names(law);
    table.row(["F", "what the effect adds to the force, N"]);
    if names.contains(&"F") {
        table.row(["F on the right", "force of the base model with its friction, (1 − s·k_F)·F_quasi, N"]);
    }
    for (letter, what) in LETTERS {
        if names.contains(&letter) {
            table.row([letter, what]);
        }
    }
    if names.iter().any(|n| matches!(*n, "q" | "q_i")) {
        table.row([OVERSTRESS.0, OVERSTRESS.1]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Candidate;

    #[test]
    fn every_letter_that_is_explained_stands_in_an_equation() {
        let laws: String = Candidate::all().map(|c| c.info().equation.to_owned() + " ").collect();
        let names = names(&laws);
        for (letter, _) in LETTERS {
            assert!(names.contains(&letter), "{letter} stands in no equation");
        }
    }

    #[test]
    fn the_force_on_the_right_is_told_from_that_on_the_left() {
        let rows = |equation| letters(equation).rows;
        assert_eq!(rows("F = b").len(), 1);
        assert_eq!(rows("F = γ·F")[1][0], "F on the right");
        assert!(rows("F = −s·F_c").iter().any(|r| r[0] == "s"));
    }
}
