//! Words of column names, in the languages of laboratories.

use crate::recording::Quantity;

/// Words that name a quantity by themselves.
pub(super) const STRONG: &[(Quantity, &[&str])] = &[
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
            "zeitstempel",
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
pub(super) const WEAK: &[(Quantity, &[&str])] = &[
    (Quantity::Time, &["t", "clock", "sec", "date", "datum", "stamp"]),
    (Quantity::Pressure, &["p"]),
    (Quantity::Displacement, &["position", "pos", "x", "travel", "course"]),
    (Quantity::Force, &["load", "f", "last", "pull", "charge", "carga"]),
    (Quantity::Length, &["l"]),
];

/// Words of a commanded value beside a measured one.
pub(super) const COMMANDED: &[&str] = &[
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
pub(super) const AT_REST: &[&str] = &["rest", "initial", "l0", "ruhe", "ruhelaenge", "resting"];
/// Words of what is derived from a quantity: a standard deviation is no force.
pub(super) const DERIVED: &[&str] = &[
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
pub(super) const NEUTRAL: &[&str] = &[
    "measured", "actual", "ist", "istwert", "gauge", "mounted", "active", "muscle", "sensor", "cell",
    "value", "channel", "data", "analog", "input", "current", "pam", "mean", "avg", "abs", "in", "the", "of",
    "messwert", "gemessen",
];
/// Words of displacements that grow as the muscle gets longer.
pub(super) const LENGTHENING: &[&str] = &["extension", "elongation", "crosshead", "traverse"];

/// Words of columns that set runs apart.
pub(super) const RUNS: &[&str] = &[
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
pub(super) const WAYS: &[&str] = &["phase", "direction", "richtung", "dir", "way", "sens"];
