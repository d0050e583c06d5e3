//! What a column's name means in a laboratory's own words: the quantity by a table of synonyms, the unit by a table of spellings.

mod units;
mod vocabulary;

use crate::recording::Quantity;

use self::units::counts_from_vacuum;
pub(super) use self::units::{Family, UnitSpelling, unit};
pub(super) use self::vocabulary::RUNS;
use self::vocabulary::{AT_REST, COMMANDED, DERIVED, LENGTHENING, NEUTRAL, STRONG, WAYS, WEAK};

/// A column's name, taken apart.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Name {
    pub words: Vec<String>,
    pub unit: Option<UnitSpelling>,
    /// What stands where a unit does and is none that is known.
    pub unknown_unit: Option<String>,
}

/// How well a name fits a quantity: the larger, the better.
pub(super) type Score = i32;

impl Name {
    /// `Pressure [bar]`, `F (N)`, `t_s`, `Kraft / N`, `load cell`.
    pub(super) fn of(header: &str) -> Self {
        let narrow = header.replace('（', "(").replace('）', ")").replace('［', "[").replace('］', "]");
        let header = narrow.trim().trim_matches('"').trim();
        // The columns of a matrix have no names of their own.
        if is_of_matrix(header) {
            return Self::default();
        }
        if let Some(name) = Self::with_mark(header).or_else(|| Self::of_ratio(header)) {
            return name;
        }
        for (open, close) in [('[', ']'), ('(', ')'), ('<', '>')] {
            if let Some((base, inside, after)) = bracketed(header, open, close) {
                let found = unit(inside);
                let unknown = found.is_none().then(|| inside.trim().to_owned()).filter(|u| !u.is_empty());
                return Self { words: words(&format!("{base} {after}")), unit: found, unknown_unit: unknown };
            }
        }
        for separator in [" / ", "/", " in ", ",", "_", " ", "."] {
            if let Some((base, last)) = header.rsplit_once(separator)
                && !base.trim().is_empty()
                && let Some(found) = unit(last)
                // The `1` of `Load_1` counts; only a fraction bar makes a unit of it.
                && (found.family != Family::Ratio || separator.contains('/') || !["1", "-"].contains(&found.text))
            {
                return Self { words: words(base), unit: Some(found), unknown_unit: None };
            }
        }
        Self { words: words(header), unit: unit(header).filter(|u| u.text.len() > 1), unknown_unit: None }
    }

    /// `Pressure kPa abs`, `p_bar_a`, `Pressure bar (a)`: a unit of pressure with the mark of its zero apart from it.
    fn with_mark(header: &str) -> Option<Self> {
        let (base, mark) = match header.strip_suffix(')').and_then(|h| h.rsplit_once('(')) {
            Some(parts) => parts,
            None => header.rsplit_once([' ', '_'])?,
        };
        let absolute = counts_from_vacuum(mark)?;
        let name = Self::of(base.trim_end());
        let unit = name.unit.filter(|u| u.family == Family::Pressure)?;
        Some(Self { unit: Some(UnitSpelling { absolute, ..unit }), ..name })
    }

    /// `L/L0`, `ΔL / L0`: a length or its change over the rest length.
    fn of_ratio(header: &str) -> Option<Self> {
        let bare = header.find(['[', '(']).map_or(header, |at| &header[..at]);
        let (above, below) = bare.split_once('/')?;
        let is_rest = ["l0", "l_0", "l₀"].contains(&below.trim().to_lowercase().as_str());
        let word = match above.trim().to_lowercase().as_str() {
            "l" => "length",
            "dl" | "δl" | "∆l" | "delta l" | "delta_l" | "deltal" => "contraction",
            _ => return None,
        };
        let of = header[bare.len()..].trim_matches(['[', ']', '(', ')', ' ']);
        let ratio = unit(of).or_else(|| unit("-")).filter(|u| is_rest && u.family == Family::Ratio)?;
        Some(Self { words: vec![word.to_owned()], unit: Some(ratio), unknown_unit: None })
    }

    /// A name with the unit that is below it, in a row of its own.
    pub(super) fn with_unit_below(header: &str, below: &str) -> Self {
        let bare = below.trim().trim_matches(['[', ']', '(', ')']).trim();
        let (found, words) = (unit(bare), words(header));
        let unknown = found.is_none().then(|| bare.to_owned()).filter(|u| !u.is_empty());
        Self { words, unit: found, unknown_unit: unknown }
    }

    fn has(&self, list: &[&str]) -> bool {
        self.words.iter().any(|w| list.contains(&w.as_str()))
    }

    /// Whether it is a displacement that grows as the muscle gets longer.
    pub(super) fn lengthens(&self) -> bool {
        self.has(LENGTHENING)
    }

    /// Whether it says that a pressure counts from vacuum.
    pub(super) fn absolute(&self) -> bool {
        self.unit.is_some_and(|u| u.absolute) || self.has(&["absolute", "abs", "absolut", "absolutdruck"])
    }

    /// Whether it is a length as a share of the rest length, one of a muscle at rest.
    pub(super) fn is_relative_length(&self) -> bool {
        let named = STRONG.iter().chain(WEAK).find(|(q, list)| *q != Quantity::Contraction && self.has(list));
        self.family() == Some(Family::Ratio) && named.is_some_and(|(q, _)| *q == Quantity::Length)
    }

    /// Whether it sets runs apart.
    pub(super) fn sets_apart(&self) -> bool {
        self.has(RUNS) && self.unit.is_none()
    }

    /// Whether it says which way the bench moves.
    pub(super) fn is_way(&self) -> bool {
        self.has(WAYS)
    }

    /// Whether it is a reading of a converter that something else in the file is the calibrated form of.
    pub(super) fn is_raw(&self) -> bool {
        self.unit.is_some_and(|u| u.family == Family::Raw)
    }

    /// The quantity that it names, and how well; `None` where it names none.
    pub(super) fn quantity(&self) -> Option<(Quantity, Score)> {
        let named = |table: &[(Quantity, &[&str])]| {
            table.iter().find(|(_, list)| self.has(list)).map(|(quantity, _)| *quantity)
        };
        let (quantity, base) = match (named(STRONG), named(WEAK), self.unit) {
            (Some(quantity), ..) => (quantity, 10),
            (None, Some(quantity), _) => (quantity, 6),
            (None, None, Some(unit)) => (alone(unit.family)?, 2),
            (None, None, None) if self.words == ["l0"] => (Quantity::RestLength, 8),
            (None, None, None) => return None,
        };
        let commanded = self.has(COMMANDED);
        let ratio = self.family() == Some(Family::Ratio);
        let quantity = match quantity {
            Quantity::Pressure if commanded => Quantity::PressureCommand,
            _ if commanded => return None,
            // A contraction in millimetres is a stroke, and a stroke in per cent a contraction.
            Quantity::Contraction if self.family() == Some(Family::Length) => Quantity::Displacement,
            Quantity::Displacement if ratio => Quantity::Contraction,
            // A length as a share of the rest length.
            Quantity::Length if ratio => Quantity::Contraction,
            Quantity::Length if self.has(AT_REST) => Quantity::RestLength,
            other => other,
        };
        // A "contraction rate" in per cent is a contraction, as data sheets call it.
        let derived = self.words.iter().any(|w| DERIVED.contains(&w.as_str()) && !(ratio && w == "rate"));
        if derived && !self.is_raw() || self.family().is_some_and(|f| !fits(quantity, f)) {
            return None;
        }
        let known = |w: &&String| {
            let w = w.as_str();
            let lists = [COMMANDED, AT_REST, NEUTRAL];
            lists.iter().any(|l| l.contains(&w))
                || STRONG.iter().chain(WEAK).any(|(_, l)| l.contains(&w))
                || w.chars().all(|c| c.is_ascii_digit())
        };
        let unknown = self.words.iter().filter(|w| !known(w)).count() as Score;
        let with_unit = if self.unit.is_some_and(|u| u.family != Family::Raw) { 3 } else { 0 };
        Some((quantity, base + with_unit - unknown))
    }

    fn family(&self) -> Option<Family> {
        self.unit.map(|u| u.family)
    }
}

/// Whether a column is one of a matrix, as `X(:,1)`.
pub(super) fn is_of_matrix(header: &str) -> bool {
    let number = header.strip_suffix(')').and_then(|h| h.rsplit_once("(:,")).map(|(_, number)| number);
    number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
}

/// What stands before a pair of brackets, in it, and behind it; the pair may contain others: `p (bar(a))`.
fn bracketed(text: &str, open: char, close: char) -> Option<(&str, &str, &str)> {
    let (base, rest) = text.split_once(open)?;
    let mut depth = 1_usize;
    let end = rest.char_indices().find_map(|(at, c)| {
        depth = if c == open { depth + 1 } else { depth - usize::from(c == close) };
        (depth == 0).then_some(at)
    });
    let end = end.or_else(|| rest.find(close))?;
    Some((base, &rest[..end], &rest[end + close.len_utf8()..]))
}

/// The quantity of a unit that stands alone; a length could be several.
fn alone(family: Family) -> Option<Quantity> {
    match family {
        Family::Time => Some(Quantity::Time),
        Family::Pressure => Some(Quantity::Pressure),
        Family::Length => Some(Quantity::Displacement),
        Family::Force => Some(Quantity::Force),
        Family::Temperature => Some(Quantity::Temperature),
        Family::Ratio | Family::Raw | Family::Foreign => None,
    }
}

/// Whether a quantity can be given in units of that kind.
fn fits(quantity: Quantity, family: Family) -> bool {
    match quantity {
        Quantity::Time => family == Family::Time,
        Quantity::Pressure | Quantity::PressureCommand => matches!(family, Family::Pressure | Family::Raw),
        Quantity::Displacement | Quantity::Length => matches!(family, Family::Length | Family::Raw),
        Quantity::RestLength => family == Family::Length,
        Quantity::Force => matches!(family, Family::Force | Family::Raw),
        Quantity::Temperature => family == Family::Temperature,
        Quantity::Contraction | Quantity::Cycle | Quantity::Direction => family == Family::Ratio,
    }
}

/// The words of a name in lower case, without accents: `LoadCell_2` is `load`, `cell`, `2`.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut word = String::new();
    let mut before = ' ';
    for c in text.chars() {
        let camel = c.is_uppercase() && before.is_lowercase();
        let digit = c.is_ascii_digit() != before.is_ascii_digit() && before.is_alphanumeric();
        // `L0` is one word: a symbol with its index.
        if (!c.is_alphanumeric() || camel || digit && word.len() > 1) && !word.is_empty() {
            words.push(std::mem::take(&mut word));
        }
        if c.is_alphanumeric() {
            for lower in c.to_lowercase() {
                match lower {
                    'ä' => word += "ae",
                    'ö' => word += "oe",
                    'ü' => word += "ue",
                    'ß' => word += "ss",
                    'é' | 'è' | 'ê' => word.push('e'),
                    'á' | 'à' | 'â' => word.push('a'),
                    'ó' | 'ò' | 'ô' => word.push('o'),
                    'í' | 'ì' => word.push('i'),
                    'ñ' => word.push('n'),
                    other => word.push(other),
                }
            }
        }
        before = c;
    }
    if !word.is_empty() {
        words.push(word);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::units::UNITS;
    use super::*;

    #[test]
    fn names_of_laboratories_are_understood() {
        let cases = [
            ("t_s", Quantity::Time, "s"),
            ("Zeit [ms]", Quantity::Time, "ms"),
            ("Timestamp (µs)", Quantity::Time, "ms"),
            ("Pressure [bar]", Quantity::Pressure, "bar"),
            ("Druck / kPa", Quantity::Pressure, "kPa"),
            ("P1 (psi)", Quantity::Pressure, "psi"),
            ("F (N)", Quantity::Force, "N"),
            ("load cell", Quantity::Force, ""),
            ("LoadCell_kg", Quantity::Force, "N"),
            ("kraft", Quantity::Force, ""),
            ("Standardkraft [N]", Quantity::Force, "N"),
            ("Weg in mm", Quantity::Displacement, "mm"),
            ("shortening_mm", Quantity::Displacement, "mm"),
            ("Crosshead extension (in)", Quantity::Displacement, "in"),
            ("mounted_length_mm", Quantity::Length, "mm"),
            ("Länge [cm]", Quantity::Length, "mm"),
            ("rest_length_mm", Quantity::RestLength, "mm"),
            ("contraction", Quantity::Contraction, ""),
            ("p_soll (bar)", Quantity::PressureCommand, "bar"),
            ("muscle1_pressure_command_bar", Quantity::PressureCommand, "bar"),
            ("Temp. [°C]", Quantity::Temperature, "C"),
            ("Load_1", Quantity::Force, ""),
            ("pressure 1", Quantity::Pressure, ""),
            ("压力（kPa）", Quantity::Pressure, "kPa"),
            ("力(N)", Quantity::Force, "N"),
            ("変位[mm]", Quantity::Displacement, "mm"),
            ("收缩率(%)", Quantity::Contraction, ""),
            ("时间", Quantity::Time, ""),
            ("Strain / %", Quantity::Contraction, ""),
            ("ε [-]", Quantity::Contraction, ""),
        ];
        for (text, quantity, unit) in cases {
            let name = Name::of(text);
            assert_eq!(name.quantity().map(|(q, _)| q), Some(quantity), "{text}: {name:?}");
            assert_eq!(name.unit.map_or("", |u| u.unit), unit, "{text}");
        }
    }

    #[test]
    fn names_of_derived_or_other_values_are_not_quantities() {
        for text in [
            "force_sd_N",
            "length_at_620kPa_mm",
            "joint_angle_rad",
            "diameter_mm",
            "Breite [mm]",
            "force setpoint (N)",
            "relative_contraction_percent",
            "notes",
            "valve_flag",
            "temperature_kPa",
        ] {
            assert_eq!(Name::of(text).quantity(), None, "{text}");
        }
        // A converter's counts are a force before its calibration.
        assert!(Name::of("force_adc").is_raw() && Name::of("load [V]").is_raw());
    }

    #[test]
    fn spellings_convert_to_units_that_a_description_has() {
        for spelling in UNITS {
            if !spelling.unit.is_empty() {
                let family = alone(spelling.family).expect("a unit of a quantity");
                assert!(family.unit(spelling.unit).is_some(), "{}", spelling.text);
            }
        }
        // 50 °F are 10 °C.
        let fahrenheit = unit("°F").expect("a unit");
        assert!((50.0 * fahrenheit.scale + fahrenheit.offset - 10.0).abs() < 1e-12);
        assert_eq!(unit("kpa").map(|u| u.unit), Some("kPa"));
    }
}
