//! A held length that the names of the files say: `muscle_159.5mm_run2.csv`.

use regex_lite::Regex;

use super::constant_pressure::{GAP, NUMBER};
use super::others::Others;
use super::{Guess, GuessedPattern};
use crate::recording::{Quantity, decimal};

/// Units that are looked for in names.
const UNITS: [&str; 3] = ["mm", "cm", "in"];
/// Lengths in a name that are read: the first may be a diameter or the muscle's own length.
const PLACES: usize = 3;
/// A held length is at least this share of the longest one: no muscle shortens by more.
const SHORTEST: f64 = 0.5;
/// The least stroke of a campaign is at most this share of the largest.
const LEAST_STROKE: f64 = 0.25;

/// Takes the length from the names where it differs between them and no column has it.
pub(super) fn find(others: &Others<'_>, guess: &mut Guess) {
    let stroke = [Quantity::Displacement, Quantity::Length, Quantity::Contraction];
    let in_file = stroke.iter().any(|q| guess.has(*q)) || guess.lookup.is_some();
    if in_file || others.files.is_empty() || guess.patterns.iter().any(|p| p.text == "file_name") {
        return;
    }
    let names: Vec<String> = std::iter::once(guess.file.clone()).chain(others.names()).collect();
    let places = (0..PLACES).flat_map(|place| UNITS.map(|unit| (place, unit)));
    for (place, unit) in places {
        let Some(lengths) = lengths(&names, &pattern("length", unit, place)) else { continue };
        let (low, high) = lengths.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
        let (quantity, what) = match low / high {
            share if share >= 1.0 => continue,
            share if share >= SHORTEST => (Quantity::Length, "the length"),
            share if share <= LEAST_STROKE => {
                (Quantity::Displacement, "the displacement from the rest length")
            }
            _ => continue,
        };
        guess.checks.push(format!(
            "{what} is taken from the names of the files: {low} to {high} {unit}; it was held in each of them"
        ).into());
        let expression = pattern(quantity.name(), unit, place);
        guess.patterns.push(GuessedPattern { quantity, text: "file_name", expression });
        return;
    }
}

/// A regular expression that catches the length behind `place` others.
fn pattern(quantity: &str, unit: &str, place: usize) -> String {
    // `run3_in_water` says no length.
    let gap = if unit == "in" { " ?" } else { GAP };
    let before = format!("(?:.*?{NUMBER}{gap}{unit})").repeat(place);
    format!("^{before}(?:|.*?[^0-9])(?<{quantity}_{unit}>{NUMBER}){gap}{unit}(?:[^A-Za-z]|$)")
}

/// What the pattern catches in each name; `None` where it finds nothing in one of them.
fn lengths(names: &[String], pattern: &str) -> Option<Vec<f64>> {
    let pattern = Regex::new(pattern).ok()?;
    names.iter().map(|name| decimal::caught(pattern.captures(name)?.get(1)?.as_str())).collect()
}
