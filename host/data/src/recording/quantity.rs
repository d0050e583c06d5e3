//! The quantities and units of columns. The unit follows the last underscore of a column's name.

/// A quantity that a column of a recording can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Time of the sample.
    Time,
    /// Gauge pressure as measured.
    Pressure,
    /// Contraction stroke ΔL.
    Displacement,
    /// Active length L.
    Length,
    /// Contraction ΔL/L0.
    Contraction,
    /// Force of the muscle as measured.
    Force,
    /// Temperature of the muscle.
    Temperature,
    /// Commanded gauge pressure.
    PressureCommand,
    /// Number of the cycle.
    Cycle,
    /// Which way the bench drives the muscle (only by import description).
    Direction,
    /// Rest length L0 of the muscle in this row (only by import description).
    RestLength,
}

/// A unit: SI value = value · `scale` + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// As written behind the last underscore.
    pub name: &'static str,
    /// Factor to SI.
    pub scale: f64,
    /// Added after scaling; only temperatures have one.
    pub offset: f64,
}

const fn unit(name: &'static str, scale: f64) -> Unit {
    Unit { name, scale, offset: 0.0 }
}

/// One inch is 25.4 mm by definition; one pound-force is 0.45359237 kg at 9.80665 m/s².
const INCH: f64 = 0.0254;
const POUND_FORCE: f64 = 0.453_592_37 * 9.806_65;

const TIME: &[Unit] = &[unit("s", 1.0), unit("ms", 1e-3)];
const PRESSURE: &[Unit] = &[
    unit("Pa", 1.0),
    unit("kPa", 1e3),
    unit("MPa", 1e6),
    unit("bar", 1e5),
    unit("psi", POUND_FORCE / (INCH * INCH)),
];
const LENGTH: &[Unit] = &[unit("m", 1.0), unit("mm", 1e-3), unit("in", INCH)];
const FORCE: &[Unit] = &[unit("N", 1.0), unit("kN", 1e3), unit("lbf", POUND_FORCE)];
const TEMPERATURE: &[Unit] = &[Unit { name: "C", scale: 1.0, offset: 273.15 }, unit("K", 1.0)];
const NONE: &[Unit] = &[unit("", 1.0)];

impl Quantity {
    /// The quantities that a recording's header can name. Only an import description can provide rest length and direction.
    pub(crate) const IN_HEADERS: [Self; 9] = [
        Self::Time,
        Self::Pressure,
        Self::Displacement,
        Self::Length,
        Self::Contraction,
        Self::Force,
        Self::Temperature,
        Self::PressureCommand,
        Self::Cycle,
    ];

    /// The name in a header, without the unit.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Pressure => "pressure",
            Self::Displacement => "displacement",
            Self::Length => "length",
            Self::Contraction => "contraction",
            Self::Force => "force",
            Self::Temperature => "temperature",
            Self::PressureCommand => "pressure_command",
            Self::Cycle => "cycle",
            Self::Direction => "direction",
            Self::RestLength => "rest_length",
        }
    }

    /// The units it may have, the dimensionless one with an empty name.
    #[must_use]
    pub fn units(self) -> &'static [Unit] {
        match self {
            Self::Time => TIME,
            Self::Pressure | Self::PressureCommand => PRESSURE,
            Self::Displacement | Self::Length | Self::RestLength => LENGTH,
            Self::Force => FORCE,
            Self::Temperature => TEMPERATURE,
            Self::Contraction | Self::Cycle | Self::Direction => NONE,
        }
    }

    /// The unit of that name.
    #[must_use]
    pub fn unit(self, name: &str) -> Option<Unit> {
        self.units().iter().copied().find(|u| u.name == name)
    }

    /// Every header name it can have, such as `force_N`.
    pub fn headers(self) -> impl Iterator<Item = String> {
        self.units().iter().map(move |u| {
            if u.name.is_empty() { self.name().to_owned() } else { format!("{}_{}", self.name(), u.name) }
        })
    }

    /// The units as a list for messages: `Pa, kPa, MPa, bar or psi`.
    #[must_use]
    pub fn unit_list(self) -> String {
        let names: Vec<_> = self.units().iter().map(|u| u.name).collect();
        match names.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            Some((last, _)) if !last.is_empty() => (*last).to_owned(),
            _ => "no unit".to_owned(),
        }
    }
}

/// What a header's name means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HeaderName {
    /// A quantity in a unit.
    Known(Quantity, Unit),
    /// A quantity whose unit is not one of its own, or missing.
    UnknownUnit(Quantity),
    /// Nothing we use.
    Other,
}

/// A header's name in its usual form, quantity and unit parted by the last underscore: `Force [N]`, `Force (N)` and `Force_N` are
/// `force_N`. The letters of a unit stay as they are, since `mPa` is not `MPa`; `°C` (whatever a program without UTF-8 made of its first
/// sign) and `degC` are `C`.
pub(super) fn usual_name(header: &str) -> String {
    let header = header.trim();
    let bracketed = [('[', ']'), ('(', ')')].into_iter().find_map(|(open, close)| {
        let (base, unit) = header.strip_suffix(close)?.rsplit_once(open)?;
        Some((base.trim_end_matches(['_', ' ']), unit.trim()))
    });
    let (base, unit) = match bracketed {
        Some(parts) => parts,
        // The last underscore of a bare `pressure_command` belongs to the name.
        None if header.eq_ignore_ascii_case(Quantity::PressureCommand.name()) => (header, ""),
        None => header.rsplit_once('_').unwrap_or((header, "")),
    };
    // Of temperatures only: `µm` is not a metre, whatever became of its first sign.
    let degrees = unit.trim_start_matches(['°', 'º', '\u{fffd}']);
    let degrees = degrees.strip_prefix("deg").map_or(degrees, str::trim_start);
    let unit = if ["C", "K"].contains(&degrees) { degrees } else { unit };
    let base = base.to_lowercase().replace(' ', "_");
    if unit.is_empty() || unit == "-" { base } else { format!("{base}_{unit}") }
}

/// Reads a header's name.
///
/// ```
/// use pam_data::recording::{HeaderName, Quantity, parse_header};
/// assert!(matches!(parse_header("pressure_command_kPa"), HeaderName::Known(Quantity::PressureCommand, u) if u.scale == 1e3));
/// assert_eq!(parse_header("Force [lbf]"), parse_header("force_lbf"));
/// assert_eq!(parse_header("Temperature [°C]"), parse_header("temperature_C"));
/// assert_eq!(parse_header("Time [\u{fffd}s]"), HeaderName::UnknownUnit(Quantity::Time));
/// assert_eq!(parse_header("pressure_mmHg"), HeaderName::UnknownUnit(Quantity::Pressure));
/// assert_eq!(parse_header("pressure_sd_kPa"), HeaderName::Other);
/// assert_eq!(parse_header("t_s"), parse_header("time_s"));
/// assert_eq!(parse_header("stroke_mm"), parse_header("displacement_mm"));
/// ```
#[must_use]
pub fn parse_header(header: &str) -> HeaderName {
    let usual = usual_name(header);
    let known = Quantity::IN_HEADERS.into_iter().filter_map(|q| {
        // `pressure_command_kPa` is not a pressure in `command_kPa`: a unit has no underscore.
        let unit = usual.strip_prefix(q.name())?;
        if unit.is_empty() {
            Some((q, ""))
        } else {
            Some((q, unit.strip_prefix('_').filter(|u| !u.contains('_'))?))
        }
    });
    // The symbols of the quantities are names of theirs where a unit of theirs follows.
    let symbols = [
        ("t", Quantity::Time),
        ("p", Quantity::Pressure),
        ("f", Quantity::Force),
        ("stroke", Quantity::Displacement),
    ];
    if let Some((symbol, unit)) = usual.split_once('_')
        && let Some((_, quantity)) = symbols.iter().find(|(s, _)| *s == symbol)
        && let Some(unit) = quantity.unit(unit)
    {
        return HeaderName::Known(*quantity, unit);
    }
    // The longest name: a bare `pressure_command` is not a pressure in `command`.
    match known.max_by_key(|(q, _)| q.name().len()) {
        Some((quantity, unit)) => {
            quantity.unit(unit).map_or(HeaderName::UnknownUnit(quantity), |u| HeaderName::Known(quantity, u))
        }
        None => HeaderName::Other,
    }
}
