//! The symbols of an effect's equation.

use model_core::effects::Info;

use super::Table;

/// Symbols that mean the same in every equation. Where a parameter has one of them, it is the parameter.
const SYMBOLS: &[(&str, &str)] = &[
    ("F_quasi", "pull of the base model without friction, N"),
    ("F_b", "elastic force of the bladder: the base model's without friction less P·g, N"),
    ("F_w", "what the bladder takes from the pull of the gas: −F_b, between 0 and P·g, N"),
    ("F_G", "Gaylord's force of the effective pressure, P′·g, N"),
    ("k_F", "friction factor of the table at this pressure"),
    ("s", "direction: +1 while shortening, −1 while lengthening, held at rest"),
    ("s_x", "direction in which the stroke last moved; filling and emptying do not reverse it"),
    ("s_y", "direction in which the muscle behind the play last moved"),
    ("P", "pressure at the sensor, Pa"),
    ("P_a", "pressure of the air outside, 101.3 kPa"),
    ("P′", "effective pressure, P − P0, Pa"),
    ("g", "pull per pascal of the cylinder, (3L² − B²)/(4πN²), m²"),
    ("g_n", "weight of a kilogram, 9.807 N/kg"),
    ("∂F/∂x", "slope of the base model's force over the stroke, negative, N/m"),
    ("∂F_quasi/∂x", "slope of the friction-free force over the stroke, negative, N/m"),
    ("x", "stroke, positive in contraction, m"),
    ("ΔL", "stroke, positive in contraction, m"),
    ("y", "stroke of the muscle behind the play, m"),
    ("v", "speed of the stroke, m/s"),
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
    ("E", "modulus of the base model's elastic force there, Pa"),
    ("h", "pressure that the wall itself carries, Pa"),
    ("h′", "slope of h over the length, Pa/m"),
    ("c_1", "elastic force of a linear wall per pascal of its modulus, m²"),
    (
        "c_(M+1)",
        "elastic force of a wall whose stress goes with the power M + 1 of strain, per pascal of its modulus, m²; M is the table's highest",
    ),
    ("c_(M+2)", "the same with the power M + 2 of strain, m²"),
    ("c_H", "elastic force of a neo-Hookean wall per pascal of its shear modulus, m²"),
    ("ξ", "travel of the strands: the stroke, or what pressure would have moved at held length, m"),
    ("ℓ", "travel of the strands since the muscle was new, in rest lengths"),
    ("I", "impulse of the load since the muscle was new, ∫|F_quasi|·dt, N·s"),
    ("d", "damage so far, from 0 to 1"),
    ("q", "decaying over-stress due to the drive u, the expression in the brackets behind it"),
    ("q_i", "part i of the over-stress due to the drive u, the expression in the brackets behind it"),
    ("r_i", "the expression in the brackets behind it, low-pass filtered with time constant τ_i"),
    ("z", "state of friction, from −1 to 1"),
    ("z_i", "state of friction element i, from −1 to 1"),
    ("m", "1 in motion, 0 at rest"),
    ("w", "power that the muscle takes from its load, smoothed over τ, W"),
    ("θ", "temperature less that of the first reading, K"),
    ("t", "time, s"),
    ("t_rest", "duration of the rest, s"),
    ("d_rest", "travel since the rest, m"),
    ("W", "stretch of the rubber, I₁ − 3"),
    ("W_m", "the largest W so far"),
    ("LP_τ", "first-order low-pass filter with time constant τ"),
];

/// The symbols with their indices, without powers and numbers before them.
fn names(law: &str) -> Vec<String> {
    let mut names = vec![String::new()];
    let (mut index, mut last) = (false, ' ');
    for c in law.chars() {
        // An index of more than one letter is in brackets: `c_(M+1)`.
        index = if index { last != ')' } else { c == '(' && last == '_' };
        let is_symbol = (c.is_alphanumeric() && !"²³⁴π¼Σ".contains(c)) || "_′∂".contains(c);
        if is_symbol || index {
            names.last_mut().expect("it begins with one").push(c);
        } else {
            names.push(String::new());
        }
        last = c;
    }
    names
        .iter()
        .map(|n| n.trim_start_matches(|c: char| c.is_ascii_digit()).to_owned())
        .filter(|n| !n.is_empty())
        .collect()
}

/// Whether a symbol, or a small change of it, is among the names.
fn occurs(symbol: &str, names: &[String]) -> bool {
    self::names(symbol)
        .iter()
        .all(|part| names.iter().any(|n| n == part || n.strip_prefix('d') == Some(part)))
}

/// The symbols of an effect's equation that are not its parameters.
#[must_use]
pub fn symbols(info: &Info) -> Table {
    let mut table = Table::new(
        "Symbols of the equation. Its parameters are below; a d before a symbol is its change",
        &["symbol", "meaning"],
    );
    // The force on the left is the effect's; `F` again on the right is the base model's.
    let (_, law) = info.equation.split_once('=').unwrap_or(("", info.equation));
    let names = names(law);
    table.row(["F", "force that the effect adds, N"]);
    if names.iter().any(|n| n == "F") {
        table.row(["F on the right", "force of the base model with its friction, (1 − s·k_F)·F_quasi, N"]);
    }
    for &(symbol, what) in SYMBOLS {
        if occurs(symbol, &names) && info.parameters.iter().all(|p| p.symbol != symbol) {
            table.row([symbol, what]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use pam_fit::bench::Candidate;

    /// Words, functions and running indices.
    const WORDS: [&str; 18] = [
        "exp", "ln", "max", "clamp", "erf", "play", "of", "each", "way", "wide", "within", "for", "or", "mm",
        "i", "u", "du", "F",
    ];

    #[test]
    fn every_explained_symbol_that_is_not_a_parameter_is_in_an_equation() {
        for &(symbol, _) in SYMBOLS {
            let used = Candidate::all().any(|c| symbols(c.info()).rows.iter().any(|r| r[0] == symbol));
            assert!(used, "{symbol} is in no equation");
        }
    }

    #[test]
    fn every_symbol_of_every_equation_is_explained_a_parameter_or_defined_by_the_equation_itself() {
        for info in Candidate::all().map(|c| c.info()) {
            let table = symbols(info);
            let (_, law) = info.equation.split_once('=').unwrap();
            let all = names(law);
            for p in info.parameters {
                // `LP_τ` has the parameter τ.
                let index = format!("_{}", p.symbol);
                let there = occurs(p.symbol, &all) || all.iter().any(|n| n.ends_with(&index));
                assert!(there, "{}: {} is not in the equation", info.name, p.symbol);
            }
            for name in &all {
                let is = |symbol: &str| {
                    names(symbol).iter().any(|part| name == part || name.strip_prefix('d') == Some(part))
                };
                let defined =
                    info.equation.contains(&format!(", {name} =")) || WORDS.contains(&name.as_str());
                let explained =
                    table.rows.iter().any(|r| is(&r[0])) || info.parameters.iter().any(|p| is(p.symbol));
                assert!(defined || explained, "{}: {name} is not explained", info.name);
            }
        }
    }

    #[test]
    fn the_force_on_the_right_is_distinguished_from_that_on_the_left() {
        let rows = |name| symbols(Candidate::from_name(name).unwrap().info()).rows;
        assert_eq!(rows("force-offset").len(), 1);
        assert_eq!(rows("force-gain")[1][0], "F on the right");
        assert!(rows("coulomb-friction").iter().any(|r| r[0] == "s"));
    }

    #[test]
    fn a_symbol_that_is_a_parameter_is_left_to_it() {
        let explained =
            |name| symbols(Candidate::from_name(name).unwrap().info()).rows.iter().any(|r| r[0] == "m");
        assert!(explained("breakaway-friction") && !explained("gravity"));
    }
}
