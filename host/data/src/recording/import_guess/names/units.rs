//! Spellings of units, with their conversion to a unit of an import description.

/// What kind of quantity a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Family {
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
pub(in super::super) struct UnitSpelling {
    pub text: &'static str,
    pub family: Family,
    pub unit: &'static str,
    pub scale: f64,
    pub offset: f64,
    /// Whether it says that a pressure counts from vacuum.
    pub absolute: bool,
}

const fn spelling(text: &'static str, family: Family, unit: &'static str, scale: f64) -> UnitSpelling {
    UnitSpelling { text, family, unit, scale, offset: 0.0, absolute: false }
}

/// Standard gravity, by definition 9.80665 m/s²: forces given in kilograms or grams.
const GRAVITY: f64 = 9.806_65;

/// Spellings as laboratory programs write them. Where the case of letters matters, the exact spelling is looked for first.
pub(super) const UNITS: &[UnitSpelling] = &[
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
    spelling("millisecond", Family::Time, "ms", 1.0),
    spelling("us", Family::Time, "ms", 1e-3),
    spelling("µs", Family::Time, "ms", 1e-3),
    spelling("usec", Family::Time, "ms", 1e-3),
    spelling("micros", Family::Time, "ms", 1e-3),
    spelling("microseconds", Family::Time, "ms", 1e-3),
    spelling("ns", Family::Time, "ms", 1e-6),
    spelling("nanoseconds", Family::Time, "ms", 1e-6),
    spelling("min", Family::Time, "s", 60.0),
    spelling("mins", Family::Time, "s", 60.0),
    spelling("minute", Family::Time, "s", 60.0),
    spelling("minutes", Family::Time, "s", 60.0),
    spelling("minuten", Family::Time, "s", 60.0),
    spelling("h", Family::Time, "s", 3600.0),
    spelling("hr", Family::Time, "s", 3600.0),
    spelling("hours", Family::Time, "s", 3600.0),
    spelling("Pa", Family::Pressure, "Pa", 1.0),
    spelling("hPa", Family::Pressure, "Pa", 100.0),
    spelling("kPa", Family::Pressure, "kPa", 1.0),
    spelling("MPa", Family::Pressure, "MPa", 1.0),
    spelling("bar", Family::Pressure, "bar", 1.0),
    spelling("mbar", Family::Pressure, "Pa", 100.0),
    spelling("psi", Family::Pressure, "psi", 1.0),
    spelling("lbf/in2", Family::Pressure, "psi", 1.0),
    spelling("lbf/in²", Family::Pressure, "psi", 1.0),
    spelling("N/mm2", Family::Pressure, "MPa", 1.0),
    spelling("N/mm²", Family::Pressure, "MPa", 1.0),
    // One standard atmosphere is 101.325 kPa; one kilogram-force per square centimetre 98.0665 kPa.
    spelling("atm", Family::Pressure, "kPa", 101.325),
    spelling("kgf/cm2", Family::Pressure, "kPa", 98.0665),
    spelling("kgf/cm²", Family::Pressure, "kPa", 98.0665),
    spelling("torr", Family::Pressure, "Pa", 101_325.0 / 760.0),
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
    spelling("pounds", Family::Force, "lbf", 1.0),
    // An ounce is a sixteenth of a pound.
    spelling("ozf", Family::Force, "lbf", 0.0625),
    spelling("oz", Family::Force, "lbf", 0.0625),
    spelling("kp", Family::Force, "N", GRAVITY),
    spelling("kgf", Family::Force, "N", GRAVITY),
    spelling("kg", Family::Force, "N", GRAVITY),
    spelling("gf", Family::Force, "N", 1e-3 * GRAVITY),
    spelling("g", Family::Force, "N", 1e-3 * GRAVITY),
    spelling("grams", Family::Force, "N", 1e-3 * GRAVITY),
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
        absolute: false,
    },
    UnitSpelling {
        text: "degF",
        family: Family::Temperature,
        unit: "C",
        scale: 5.0 / 9.0,
        offset: -160.0 / 9.0,
        absolute: false,
    },
    spelling("%", Family::Ratio, "", 0.01),
    spelling("percent", Family::Ratio, "", 0.01),
    spelling("pct", Family::Ratio, "", 0.01),
    spelling("% of L0", Family::Ratio, "", 0.01),
    spelling("% L0", Family::Ratio, "", 0.01),
    spelling("%L0", Family::Ratio, "", 0.01),
    spelling("prozent", Family::Ratio, "", 0.01),
    spelling("1", Family::Ratio, "", 1.0),
    spelling("mm/mm", Family::Ratio, "", 1.0),
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

/// Marks behind a unit of pressure that counts from vacuum: `psia`, `bar(a)`, `kPa abs`.
const FROM_VACUUM: &[&str] = &["(abs.)", "(abs)", "(a)", "absolute", "absolut", "abs.", "abs", "a"];
/// Marks behind a unit of pressure that counts from the atmosphere: `psig`, `bar(g)`, `kPa gauge`, `barü`.
const FROM_ATMOSPHERE: &[&str] =
    &["(gauge)", "(g)", "(rel)", "(ü)", "gauge", "gage", "relative", "relativ", "rel.", "rel", "ü", "g"];

/// The unit of that spelling, also with a mark of its zero.
pub(in super::super) fn unit(text: &str) -> Option<UnitSpelling> {
    // Two signs look the same: micro, and the Greek letter.
    let text = text.trim().replace('\u{3bc}', "µ");
    let marked = |marks: &[&str], absolute: bool| {
        let pressures = marks.iter().filter_map(|mark| plain(before(&text, mark)?));
        let found = pressures.into_iter().find(|u| u.family == Family::Pressure)?;
        Some(UnitSpelling { absolute, ..found })
    };
    plain(&text).or_else(|| marked(FROM_VACUUM, true)).or_else(|| marked(FROM_ATMOSPHERE, false))
}

/// Whether a word in brackets behind a unit says where a pressure counts from, and if so, whether from vacuum.
pub(super) fn counts_from_vacuum(mark: &str) -> Option<bool> {
    let is_one = |marks: &[&str]| marks.iter().any(|m| m.eq_ignore_ascii_case(mark.trim()));
    if is_one(FROM_VACUUM) { Some(true) } else { is_one(FROM_ATMOSPHERE).then_some(false) }
}

/// What stands before a mark at the end of a text.
fn before<'a>(text: &'a str, mark: &str) -> Option<&'a str> {
    let at = text.len().checked_sub(mark.len())?;
    let (base, end) = (text.get(..at)?, text.get(at..)?);
    end.eq_ignore_ascii_case(mark).then(|| base.trim_end_matches([' ', '_', '-', '.']))
}

fn plain(text: &str) -> Option<UnitSpelling> {
    let exact = UNITS.iter().find(|u| u.text == text);
    exact.or_else(|| UNITS.iter().find(|u| u.text.eq_ignore_ascii_case(text))).copied()
}
