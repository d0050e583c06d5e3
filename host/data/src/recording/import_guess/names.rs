//! What a column's name means in a laboratory's own words: the quantity by a table of synonyms, the unit by a table of spellings.

use crate::recording::Quantity;

/// What kind of quantity a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Family {
    Time,
    Pressure,
    Length,
    Force,
    Temperature,
    /// A number without a unit, or per cent.
    Ratio,
    /// Volts, milliamperes, counts: a sensor's reading before its calibration.
    Raw,
    /// A unit that no quantity of a recording has, such as degrees of a joint.
    Foreign,
}

/// A spelling of a unit: value in `unit` = value · `scale` + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UnitSpelling {
    pub text: &'static str,
    pub family: Family,
    pub unit: &'static str,
    pub scale: f64,
    pub offset: f64,
}

const fn spelling(text: &'static str, family: Family, unit: &'static str, scale: f64) -> UnitSpelling {
    UnitSpelling { text, family, unit, scale, offset: 0.0 }
}

/// Standard gravity, by definition 9.80665 m/s²: forces given in kilograms or grams.
const GRAVITY: f64 = 9.806_65;

/// Spellings as laboratory programs write them. Where the case of letters matters, the exact spelling is looked for first.
const UNITS: &[UnitSpelling] = &[
    spelling("s", Family::Time, "s", 1.0),
    spelling("sec", Family::Time, "s", 1.0),
    spelling("secs", Family::Time, "s", 1.0),
    spelling("second", Family::Time, "s", 1.0),
    spelling("seconds", Family::Time, "s", 1.0),
    spelling("sek", Family::Time, "s", 1.0),
    spelling("ms", Family::Time, "ms", 1.0),
    spelling("msec", Family::Time, "ms", 1.0),
    spelling("millis", Family::Time, "ms", 1.0),
    spelling("milliseconds", Family::Time, "ms", 1.0),
    spelling("us", Family::Time, "ms", 1e-3),
    spelling("µs", Family::Time, "ms", 1e-3),
    spelling("min", Family::Time, "s", 60.0),
    spelling("h", Family::Time, "s", 3600.0),
    spelling("Pa", Family::Pressure, "Pa", 1.0),
    spelling("hPa", Family::Pressure, "Pa", 100.0),
    spelling("kPa", Family::Pressure, "kPa", 1.0),
    spelling("MPa", Family::Pressure, "MPa", 1.0),
    spelling("bar", Family::Pressure, "bar", 1.0),
    spelling("barg", Family::Pressure, "bar", 1.0),
    spelling("mbar", Family::Pressure, "Pa", 100.0),
    spelling("psi", Family::Pressure, "psi", 1.0),
    spelling("psig", Family::Pressure, "psi", 1.0),
    // One standard atmosphere is 101.325 kPa; one kilogram-force per square centimetre 98.0665 kPa.
    spelling("atm", Family::Pressure, "kPa", 101.325),
    spelling("kgf/cm2", Family::Pressure, "kPa", 98.0665),
    spelling("mmHg", Family::Pressure, "Pa", 133.322_387_415),
    spelling("m", Family::Length, "m", 1.0),
    spelling("cm", Family::Length, "mm", 10.0),
    spelling("mm", Family::Length, "mm", 1.0),
    spelling("µm", Family::Length, "mm", 1e-3),
    spelling("um", Family::Length, "mm", 1e-3),
    spelling("in", Family::Length, "in", 1.0),
    spelling("inch", Family::Length, "in", 1.0),
    spelling("inches", Family::Length, "in", 1.0),
    spelling("\"", Family::Length, "in", 1.0),
    spelling("N", Family::Force, "N", 1.0),
    spelling("newton", Family::Force, "N", 1.0),
    spelling("newtons", Family::Force, "N", 1.0),
    spelling("mN", Family::Force, "N", 1e-3),
    spelling("daN", Family::Force, "N", 10.0),
    spelling("kN", Family::Force, "kN", 1.0),
    spelling("lbf", Family::Force, "lbf", 1.0),
    spelling("lb", Family::Force, "lbf", 1.0),
    spelling("lbs", Family::Force, "lbf", 1.0),
    spelling("kgf", Family::Force, "N", GRAVITY),
    spelling("kg", Family::Force, "N", GRAVITY),
    spelling("gf", Family::Force, "N", 1e-3 * GRAVITY),
    spelling("g", Family::Force, "N", 1e-3 * GRAVITY),
    spelling("C", Family::Temperature, "C", 1.0),
    spelling("°C", Family::Temperature, "C", 1.0),
    spelling("degC", Family::Temperature, "C", 1.0),
    spelling("K", Family::Temperature, "K", 1.0),
    UnitSpelling {
        text: "°F",
        family: Family::Temperature,
        unit: "C",
        scale: 5.0 / 9.0,
        offset: -160.0 / 9.0,
    },
    UnitSpelling {
        text: "degF",
        family: Family::Temperature,
        unit: "C",
        scale: 5.0 / 9.0,
        offset: -160.0 / 9.0,
    },
    spelling("%", Family::Ratio, "", 0.01),
    spelling("percent", Family::Ratio, "", 0.01),
    spelling("-", Family::Ratio, "", 1.0),
    spelling("V", Family::Raw, "", 1.0),
    spelling("mV", Family::Raw, "", 1.0),
    spelling("mA", Family::Raw, "", 1.0),
    spelling("adc", Family::Raw, "", 1.0),
    spelling("counts", Family::Raw, "", 1.0),
    spelling("raw", Family::Raw, "", 1.0),
    spelling("rad", Family::Foreign, "", 1.0),
    spelling("deg", Family::Foreign, "", 1.0),
    spelling("°", Family::Foreign, "", 1.0),
    spelling("Hz", Family::Foreign, "", 1.0),
    spelling("Nm", Family::Foreign, "", 1.0),
    spelling("mm/s", Family::Foreign, "", 1.0),
];

/// The unit of that spelling.
pub(super) fn unit(text: &str) -> Option<UnitSpelling> {
    let text = text.trim();
    let exact = UNITS.iter().find(|u| u.text == text);
    exact.or_else(|| UNITS.iter().find(|u| u.text.eq_ignore_ascii_case(text))).copied()
}

/// Words that name a quantity by themselves.
const STRONG: &[(Quantity, &[&str])] = &[
    (
        Quantity::Time,
        &[
            "time",
            "zeit",
            "temps",
            "tiempo",
            "tempo",
            "timestamp",
            "elapsed",
            "uhrzeit",
            "seconds",
            "datetime",
        ],
    ),
    (Quantity::Pressure, &["pressure", "druck", "pression", "presion", "pressione", "press", "ueberdruck"]),
    (
        Quantity::Displacement,
        &[
            "displacement",
            "stroke",
            "weg",
            "hub",
            "shortening",
            "disp",
            "crosshead",
            "lvdt",
            "deplacement",
            "desplazamiento",
            "spostamento",
            "extension",
            "elongation",
            "verschiebung",
            "verkuerzung",
            "traverse",
        ],
    ),
    (Quantity::Length, &["length", "laenge", "longueur", "longitud", "lunghezza"]),
    (Quantity::Contraction, &["contraction", "kontraktion", "contraccion", "contrazione"]),
    (
        Quantity::Force,
        &[
            "force",
            "kraft",
            "loadcell",
            "fuerza",
            "forza",
            "zugkraft",
            "standardkraft",
            "tension",
            "thrust",
            "effort",
        ],
    ),
    (Quantity::Temperature, &["temperature", "temperatur", "temp", "temperatura"]),
    (Quantity::Cycle, &["cycle", "zyklus", "ciclo"]),
];

/// Words and symbols that name a quantity where nothing better does.
const WEAK: &[(Quantity, &[&str])] = &[
    (Quantity::Time, &["t", "clock", "sec"]),
    (Quantity::Pressure, &["p"]),
    (Quantity::Displacement, &["position", "pos", "x", "travel", "course"]),
    (Quantity::Force, &["load", "f", "last", "pull", "charge", "carga"]),
    (Quantity::Length, &["l"]),
];

/// Words of a commanded value beside a measured one.
const COMMANDED: &[&str] = &[
    "command",
    "cmd",
    "commanded",
    "setpoint",
    "sp",
    "set",
    "soll",
    "sollwert",
    "target",
    "desired",
    "demand",
    "ref",
    "reference",
];
/// Words of a length at rest.
const AT_REST: &[&str] = &["rest", "initial", "l0", "ruhe", "ruhelaenge", "resting"];
/// Words of what is derived from a quantity: a standard deviation is no force.
const DERIVED: &[&str] = &[
    "sd",
    "std",
    "stdev",
    "error",
    "err",
    "rate",
    "speed",
    "velocity",
    "dot",
    "offset",
    "zero",
    "min",
    "max",
    "limit",
    "at",
    "relative",
    "nominal",
    "nom",
    "cut",
    "residual",
    "model",
    "estimated",
    "adc",
    "raw",
    "counts",
    "atmospheric",
    "ambient",
    "barometric",
    "supply",
];
/// Words that say nothing about which quantity it is.
const NEUTRAL: &[&str] = &[
    "measured", "actual", "ist", "istwert", "gauge", "mounted", "active", "muscle", "sensor", "cell",
    "value", "channel", "data", "analog", "input", "current", "pam", "mean", "avg", "abs", "in", "the", "of",
    "messwert", "gemessen",
];
/// Words of displacements that grow as the muscle gets longer.
const LENGTHENING: &[&str] = &["extension", "elongation", "crosshead", "traverse"];

/// Words of columns that set runs apart.
const RUNS: &[&str] = &[
    "run",
    "trial",
    "repeat",
    "repetition",
    "condition",
    "experiment",
    "test",
    "sample",
    "specimen",
    "lauf",
    "versuch",
    "messung",
    "mounting",
    "muscle",
    "muskel",
    "file",
    "series",
    "set",
    "id",
];
/// Words of columns that say which way the bench moves.
const WAYS: &[&str] = &["phase", "direction", "richtung", "dir", "way", "sens"];

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
        let header = header.trim().trim_matches('"').trim();
        for (open, close) in [('[', ']'), ('(', ')'), ('<', '>')] {
            if let Some((base, rest)) = header.split_once(open)
                && let Some((inside, after)) = rest.split_once(close)
            {
                let found = unit(inside);
                let unknown = found.is_none().then(|| inside.trim().to_owned()).filter(|u| !u.is_empty());
                return Self { words: words(&format!("{base} {after}")), unit: found, unknown_unit: unknown };
            }
        }
        for separator in [" / ", "/", " in ", ",", "_", " ", "."] {
            if let Some((base, last)) = header.rsplit_once(separator)
                && !base.trim().is_empty()
                && let Some(found) = unit(last)
            {
                return Self { words: words(base), unit: Some(found), unknown_unit: None };
            }
        }
        Self { words: words(header), unit: unit(header).filter(|u| u.text.len() > 1), unknown_unit: None }
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
        self.has(&["absolute", "abs", "absolut", "absolutdruck"])
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
        let quantity = match quantity {
            Quantity::Pressure if commanded => Quantity::PressureCommand,
            _ if commanded => return None,
            // A contraction in millimetres is a stroke, and a stroke in per cent a contraction.
            Quantity::Contraction if self.family() == Some(Family::Length) => Quantity::Displacement,
            Quantity::Displacement if self.family() == Some(Family::Ratio) => Quantity::Contraction,
            Quantity::Length if self.has(AT_REST) => Quantity::RestLength,
            other => other,
        };
        if self.has(DERIVED) && !self.is_raw() || self.family().is_some_and(|f| !fits(quantity, f)) {
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
        ];
        for (text, quantity, unit) in cases {
            let name = Name::of(text);
            assert_eq!(name.quantity().map(|(q, _)| q), Some(quantity), "{text}: {name:?}");
            assert_eq!(name.unit.map_or("", |u| u.unit), unit, "{text}");
        }
    }

    #[test]
    fn what_is_derived_or_of_another_kind_is_no_quantity() {
        for text in [
            "force_sd_N",
            "length_at_620kPa_mm",
            "joint_angle_rad",
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
