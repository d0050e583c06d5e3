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
            "时间",
            "時間",
            "時刻",
        ],
    ),
    (
        Quantity::Pressure,
        &[
            "pressure",
            "druck",
            "pression",
            "presion",
            "pressione",
            "press",
            "ueberdruck",
            "压力",
            "气压",
            "圧力",
            "압력",
        ],
    ),
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
            "位移",
            "变位",
            "変位",
            "行程",
            "변위",
        ],
    ),
    (Quantity::Length, &["length", "laenge", "longueur", "longitud", "lunghezza", "长度", "長さ"]),
    (
        Quantity::Contraction,
        &[
            "contraction",
            "kontraktion",
            "contraccion",
            "contrazione",
            "收缩率",
            "收缩",
            "収縮率",
            "収縮",
            "strain",
            "dehnung",
            "epsilon",
            "eps",
        ],
    ),
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
            "力",
            "拉力",
            "荷重",
            "载荷",
            "張力",
            "힘",
        ],
    ),
    (Quantity::Temperature, &["temperature", "temperatur", "temp", "temperatura", "温度"]),
    (Quantity::Cycle, &["cycle", "zyklus", "ciclo", "周期", "循环"]),
];

/// Words and symbols that name a quantity where nothing better does.
pub(super) const WEAK: &[(Quantity, &[&str])] = &[
    (Quantity::Time, &["t", "clock", "sec", "date", "datum", "stamp"]),
    (Quantity::Pressure, &["p"]),
    (Quantity::Displacement, &["position", "pos", "x", "travel", "course"]),
    (Quantity::Force, &["load", "f", "last", "pull", "charge", "carga"]),
    (Quantity::Length, &["l"]),
    (Quantity::Contraction, &["ε"]),
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
pub(in super::super) const RUNS: &[&str] = &[
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
