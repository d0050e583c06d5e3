//! Common mistakes in a column of a recording, and their corrections.

use super::Row;
use crate::recording::Recording;
use crate::statistics::extremes;

/// The column with a mistake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Column {
    /// The gauge pressure.
    Pressure,
    /// The contraction stroke ΔL.
    Stroke,
    /// The force of the muscle.
    Force,
}

impl Column {
    /// Its name.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Stroke => "stroke",
            Self::Force => "force",
        }
    }
}

/// The kind of a mistake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum MistakeKind {
    /// A wrong unit: the true value is this factor times the reading; the text names the pair of units with this ratio.
    Unit(f64, &'static str),
    /// The wrong sign.
    Sign,
    /// Counted from the other end of the stroke; the sum of the smallest and the largest reading, m.
    OtherEnd(f64),
    /// Absolute pressure, too high by this many Pa; negative where the others are absolute.
    Absolute(f64),
}

/// A mistake in one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mistake {
    /// The column.
    pub(crate) column: Column,
    /// The kind of mistake.
    pub(crate) wrong: MistakeKind,
}

impl Mistake {
    /// The true value for a reading.
    #[must_use]
    pub(crate) fn corrected(&self, read: f64) -> f64 {
        match self.wrong {
            MistakeKind::Unit(factor, _) => read * factor,
            MistakeKind::Sign => -read,
            MistakeKind::OtherEnd(sum) => sum - read,
            MistakeKind::Absolute(atmosphere) => read - atmosphere,
        }
    }

    pub(super) fn of_row(&self, mut row: Row) -> Row {
        let k = match self.column {
            Column::Pressure => 0,
            Column::Stroke => 1,
            Column::Force => 2,
        };
        row[k] = self.corrected(row[k]);
        row
    }

    /// Corrects a whole recording.
    pub(in crate::recording) fn correct(&self, recording: &mut Recording) {
        let column = match self.column {
            Column::Pressure => Some(&mut recording.pressure),
            Column::Stroke => Some(&mut recording.stroke),
            Column::Force => recording.force.as_mut(),
        };
        column.into_iter().flatten().for_each(|v| *v = self.corrected(*v));
    }

    pub(super) fn describe(&self) -> String {
        let column = self.column.name();
        match self.wrong {
            MistakeKind::Unit(factor, units) => {
                let ratio = |r: f64| format!("{r:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
                let times = if factor > 1.0 {
                    format!("{} times", ratio(factor))
                } else {
                    format!("1/{} of", ratio(1.0 / factor))
                };
                format!(
                    "its {column} agrees with theirs at {times} the reading, the ratio of {units}: put the logged unit into the column's \
                     name"
                )
            }
            MistakeKind::Sign => format!(
                "its {column} agrees with theirs with the opposite sign: correct the sign, or give scale = -1 in an import description"
            ),
            MistakeKind::OtherEnd(_) => format!(
                "its {column} agrees with theirs when counted from the other end: contraction is positive; correct it, or give \
                 positive = \"extension\" in an import description"
            ),
            MistakeKind::Absolute(atmosphere) if atmosphere > 0.0 => format!(
                "its {column} agrees with theirs minus one atmosphere: it seems to be absolute; subtract 101.3 kPa for gauge pressure, or \
                 give an offset in an import description"
            ),
            MistakeKind::Absolute(_) => format!(
                "its {column} agrees with theirs plus one atmosphere: theirs seem to be absolute; subtract 101.3 kPa there for gauge \
                 pressure, or give an offset in an import description"
            ),
        }
    }
}

/// One standard atmosphere, Pa.
pub(super) const ATMOSPHERE: f64 = 101_325.0;
/// Ratios of units that are often confused: the factor, and the pair of units.
const PRESSURES: [(f64, &str); 6] = [
    (6.894_757, "psi to kPa"),
    (10.0, "MPa to bar, or kPa to mbar"),
    (14.503_77, "bar to psi"),
    (100.0, "bar to kPa"),
    (145.037_7, "MPa to psi"),
    (1000.0, "MPa to kPa, or kPa to Pa"),
];
const STROKES: [(f64, &str); 4] = [
    (10.0, "cm to mm"),
    (25.4, "inches to millimetres"),
    (39.370_08, "metres to inches"),
    (1000.0, "m to mm, or mm to µm"),
];
const FORCES: [(f64, &str); 5] = [
    (4.448_222, "lbf to N"),
    (9.806_65, "kgf to N"),
    (101.971_6, "N to gf"),
    (224.808_9, "kN to lbf"),
    (1000.0, "kN to N, or N to mN"),
];

/// All mistakes to try on a recording.
pub(super) fn mistakes(rows: &[Row]) -> impl Iterator<Item = Mistake> {
    let scaled = |column: Column, ratios: &'static [(f64, &'static str)]| {
        ratios.iter().flat_map(move |(ratio, units)| {
            [*ratio, 1.0 / ratio].map(|factor| Mistake { column, wrong: MistakeKind::Unit(factor, units) })
        })
    };
    let (low, high) = extremes(rows.iter().map(|r| r[1]));
    let shifted = [
        Mistake { column: Column::Stroke, wrong: MistakeKind::Sign },
        Mistake { column: Column::Force, wrong: MistakeKind::Sign },
        Mistake { column: Column::Stroke, wrong: MistakeKind::OtherEnd(low + high) },
        Mistake { column: Column::Pressure, wrong: MistakeKind::Absolute(ATMOSPHERE) },
        Mistake { column: Column::Pressure, wrong: MistakeKind::Absolute(-ATMOSPHERE) },
    ];
    scaled(Column::Pressure, &PRESSURES)
        .chain(scaled(Column::Stroke, &STROKES))
        .chain(scaled(Column::Force, &FORCES))
        .chain(shifted)
}
