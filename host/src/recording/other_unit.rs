//! Whole recordings in another unit, or with another sign or zero, than the rest of their campaign: bar under a heading in kPa, a
//! load cell wired the other way round, an absolute gauge among those that read above the atmosphere.
//!
//! What force the other recordings make of pressure and stroke is held against what this one reads. It stands apart only where it is
//! far off as it was read, and one known mistake made good brings it among the others. Two recordings cannot tell which of them is
//! wrong, and nothing is said where the others were never at the strokes of this one.

use nalgebra::{SMatrix, SVector};

use super::{Campaign, Recording};

/// A recording that stands apart, and by what.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// The recording, counted as in the campaign.
    pub recording: usize,
    /// What would bring it among the others.
    pub mistake: Mistake,
    /// What would do so about as well.
    pub or: Option<Mistake>,
}

impl Apart {
    /// What would bring it among the others, and what to do, in words.
    #[must_use]
    pub fn told(&self) -> String {
        let or = self.or.map_or(String::new(), |m| format!("; or {}", m.told()));
        self.mistake.told() + &or
    }
}

/// The column that a mistake is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// The gauge's.
    Pressure,
    /// The stroke's.
    Stroke,
    /// The load cell's.
    Force,
}

impl Column {
    /// As it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Stroke => "stroke",
            Self::Force => "force",
        }
    }
}

/// How a column came to read what it reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wrong {
    /// A unit: the true reading is this many times the one that was read, and the ratio is that of the units named.
    Unit(f64, &'static str),
    /// Its sign.
    Sign,
    /// It is counted from the other end of the stroke, which comes to the sum of its smallest and its largest reading, m.
    OtherEnd(f64),
    /// It counts from vacuum and is so many Pa too much; negative where the others do.
    Absolute(f64),
}

/// A mistake in one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mistake {
    /// Which.
    pub column: Column,
    /// What.
    pub wrong: Wrong,
}

impl Mistake {
    /// The true reading of its column.
    #[must_use]
    pub fn made_good(&self, read: f64) -> f64 {
        match self.wrong {
            Wrong::Unit(factor, _) => read * factor,
            Wrong::Sign => -read,
            Wrong::OtherEnd(sum) => sum - read,
            Wrong::Absolute(atmosphere) => read - atmosphere,
        }
    }

    fn of_row(&self, mut row: Row) -> Row {
        let k = match self.column {
            Column::Pressure => 0,
            Column::Stroke => 1,
            Column::Force => 2,
        };
        row[k] = self.made_good(row[k]);
        row
    }

    /// Makes it good in a whole recording.
    pub(super) fn mend(&self, recording: &mut Recording) {
        let column = match self.column {
            Column::Pressure => Some(&mut recording.pressure),
            Column::Stroke => Some(&mut recording.stroke),
            Column::Force => recording.force.as_mut(),
        };
        column.into_iter().flatten().for_each(|v| *v = self.made_good(*v));
    }

    fn told(&self) -> String {
        let column = self.column.name();
        match self.wrong {
            Wrong::Unit(factor, units) => {
                let ratio = |r: f64| format!("{r:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
                let times = if factor > 1.0 {
                    format!("{} times", ratio(factor))
                } else {
                    format!("1/{} of", ratio(1.0 / factor))
                };
                format!(
                    "its {column} would fit theirs at {times} what was read, the ratio of {units}: put the unit that was logged into the \
                     column's name"
                )
            }
            Wrong::Sign => format!(
                "its {column} would fit theirs with the other sign: mend the sign, or give scale = -1 in an import description"
            ),
            Wrong::OtherEnd(_) => format!(
                "its {column} would fit theirs counted from the other end: positive is a muscle that shortens; mend it, or give \
                 positive = \"extension\" in an import description"
            ),
            Wrong::Absolute(atmosphere) if atmosphere > 0.0 => format!(
                "its {column} would fit theirs less one atmosphere: gauge pressure is wanted, not absolute; take 101.3 kPa off, or give \
                 an offset in an import description"
            ),
            Wrong::Absolute(_) => format!(
                "its {column} would fit theirs with one atmosphere more: theirs seems to be absolute; gauge pressure is wanted, take \
                 101.3 kPa off there, or give an offset in an import description"
            ),
        }
    }
}

/// One standard atmosphere, Pa.
const ATMOSPHERE: f64 = 101_325.0;
/// Ratios of units that laboratories mix up: the unit read as another, and by what its readings are too small then.
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
const FORCES: [(f64, &str); 4] = [
    (4.448_222, "lbf to N"),
    (9.806_65, "kgf to N"),
    (224.808_9, "kN to lbf"),
    (1000.0, "kN to N, or N to mN"),
];

/// Rows of a campaign that are looked at, and of one recording at most.
const ROWS: usize = 6000;
const ROWS_OF_ONE: usize = 400;
/// Fewer rows of a recording tell nothing.
const LEAST_ROWS: usize = 8;
/// With fewer recordings than this none stands apart from the others.
const LEAST_RECORDINGS: usize = 3;
/// A muscle pulls from this share of the campaign's usual largest force.
const PULLS: f64 = 0.05;
/// A recording is far off if a fifth of its rows are further off than this share of that force…
const FAR_OFF: f64 = 0.12;
/// …and so many times further than with the mistake made good.
const BETTER: f64 = 3.0;
/// Another mistake that leaves less than so many times as much may be the one as well.
const AS_GOOD: f64 = 1.5;
/// It is among the others then: within this share of the usual largest force, or so many times as far off as they are among themselves.
const AMONG: (f64, f64) = (0.02, 2.0);
/// But never further than this share.
const AMONG_AT_MOST: f64 = 0.15;
/// The force that the others make of it changes by this share from the lowest fifth of its rows to the highest.
const CHANGES: f64 = 0.1;
/// The others were at a stroke if one of their rows is nearer than this share of their range.
const NEAR: f64 = 0.03;
/// And at a pressure if it is no further than this factor beyond theirs.
const BEYOND: f64 = 1.6;

/// From this share on it is looked at whether one without which the rest agree better is far off them: it bends what all say together.
const LOOKED_AT: f64 = 0.06;
/// So many recordings are left out at most until the rest agree, each one of so many that are furthest off.
const MOST_ODD: usize = 6;
const TRIED: usize = 24;

/// A row: pressure in Pa, stroke in m, force in N.
type Row = [f64; 3];

/// Some rows of a recording.
struct Sample {
    /// The recording, counted as in the campaign.
    recording: usize,
    rows: Vec<Row>,
}

/// The recordings of a campaign that stand apart from all others, in order.
#[must_use]
pub fn standing_apart(campaign: &Campaign) -> Vec<Apart> {
    let long_enough = |r: &Recording| r.force.is_some() && r.len() >= LEAST_ROWS;
    let count = campaign.recordings.iter().filter(|r| long_enough(r)).count();
    if count < LEAST_RECORDINGS {
        return Vec::new();
    }
    let each = (ROWS / count).clamp(LEAST_ROWS, ROWS_OF_ONE);
    let of = |(recording, r)| Sample { recording, rows: sampled(r, each) };
    let samples: Vec<Sample> =
        campaign.recordings.iter().enumerate().filter(|(_, r)| long_enough(r)).map(of).collect();
    let Some(largest) = usual_largest(&samples) else { return Vec::new() };
    let Some((others, odd)) = agreed(&samples, largest) else { return Vec::new() };
    odd.into_iter().filter_map(|i| others.judge(&samples[i])).collect()
}

/// What most recordings agree on, and those that do not, in order; `None` where all agree.
///
/// One in a wrong unit bends what all of them say together, and can make another look odd. So the one is left out without which the
/// rest agree best, then the next, until they agree.
fn agreed(samples: &[Sample], largest: f64) -> Option<(Agreed, Vec<usize>)> {
    let mut kept: Vec<usize> = (0..samples.len()).collect();
    let mut odd = Vec::new();
    let without = |kept: &[usize], i: Option<usize>| {
        let rest = kept.iter().copied().filter(|k| Some(*k) != i).map(|k| &samples[k]);
        Agreed::on(rest, largest)
    };
    let mut agreed = without(&kept, None)?;
    let apart = |agreed: &Agreed, i: usize| agreed.off(&samples[i].rows, None).unwrap_or(0.0);
    let most = MOST_ODD.min((samples.len() - 1) / 2);
    while odd.len() < most {
        let far = if odd.is_empty() { LOOKED_AT } else { FAR_OFF };
        if kept.iter().all(|i| apart(&agreed, *i) < far) {
            break;
        }
        let mut tried: Vec<usize> = kept.clone();
        tried.sort_by(|a, b| apart(&agreed, *b).total_cmp(&apart(&agreed, *a)));
        tried.truncate(TRIED);
        let disagreement = |i: usize| {
            let rest = without(&kept, Some(i))?;
            let sum: f64 = kept.iter().filter(|k| **k != i).map(|k| apart(&rest, *k)).sum();
            Some((sum, i, rest))
        };
        let best = tried.into_iter().filter_map(disagreement).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, i, rest)) = best else { break };
        kept.retain(|k| *k != i);
        odd.push(i);
        agreed = rest;
    }
    odd.sort_unstable();
    (!odd.is_empty()).then_some((agreed, odd))
}

/// Rows of a recording, evenly spread.
fn sampled(r: &Recording, most: usize) -> Vec<Row> {
    let Some(force) = &r.force else { return Vec::new() };
    let stride = (r.len() / most).max(1);
    (0..r.len()).step_by(stride).map(|i| [r.pressure[i], r.stroke[i], force[i]]).collect()
}

/// What recordings reach with their largest force, whatever its sign, N: a quarter of them reach more. A campaign may hold as many
/// recordings of a vented muscle as of one that pulls.
fn usual_largest(samples: &[Sample]) -> Option<f64> {
    let top = |s: &Sample| {
        let mut forces: Vec<f64> = s.rows.iter().map(|r| r[2].abs()).collect();
        let at = forces.len() - 1 - forces.len() / 50;
        *forces.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let mut tops: Vec<f64> = samples.iter().map(top).collect();
    let at = tops.len() * 3 / 4;
    let usual = *tops.select_nth_unstable_by(at, f64::total_cmp).1;
    (usual > 0.0).then_some(usual)
}

/// All that is tried of a recording.
fn mistakes(rows: &[Row]) -> impl Iterator<Item = Mistake> {
    let scaled = |column: Column, ratios: &'static [(f64, &'static str)]| {
        ratios.iter().flat_map(move |(ratio, units)| {
            [*ratio, 1.0 / ratio].map(|factor| Mistake { column, wrong: Wrong::Unit(factor, units) })
        })
    };
    let (low, high) =
        rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), r| (l.min(r[1]), h.max(r[1])));
    let shifted = [
        Mistake { column: Column::Force, wrong: Wrong::Sign },
        Mistake { column: Column::Stroke, wrong: Wrong::OtherEnd(low + high) },
        Mistake { column: Column::Pressure, wrong: Wrong::Absolute(ATMOSPHERE) },
        Mistake { column: Column::Pressure, wrong: Wrong::Absolute(-ATMOSPHERE) },
    ];
    scaled(Column::Pressure, &PRESSURES)
        .chain(scaled(Column::Stroke, &STROKES))
        .chain(scaled(Column::Force, &FORCES))
        .chain(shifted)
}

/// `F ≈ p (a0 + a1 u + a2 u² + a3 u³) + b0 + b1 u + b2 u² + b3 u³`, with pressure and stroke as shares of their ranges.
const TERMS: usize = 8;
/// What the rows leave open is taken for nothing.
const HELD: f64 = 1e-6;
/// Rounds in which rows are left out that lie further off than so many times the median.
const ROUNDS: usize = 4;
const FAR: f64 = 5.0;

/// What force pressure and stroke make in the recordings that agree.
struct Agreed {
    terms: SVector<f64, TERMS>,
    /// Lowest and highest, Pa.
    pressure: (f64, f64),
    /// Lowest, and the range above it, m.
    stroke: (f64, f64),
    /// The strokes that there are, sorted, m.
    strokes: Vec<f64>,
    /// The usual largest force, N.
    largest: f64,
    /// How far four fifths of their own rows are off at most, a share of that.
    scatter: f64,
}

impl Agreed {
    /// Of some recordings, where they pull; `None` where that is too little.
    fn on<'a>(samples: impl Iterator<Item = &'a Sample>, largest: f64) -> Option<Self> {
        let pulls = |r: &Row| r[2].abs() > PULLS * largest;
        let rows: Vec<Row> = samples.flat_map(|s| &s.rows).copied().filter(pulls).collect();
        if rows.len() < 5 * TERMS {
            return None;
        }
        let bounds = |k: usize| {
            let mut all: Vec<f64> = rows.iter().map(|r| r[k]).collect();
            all.sort_unstable_by(f64::total_cmp);
            // Rows that few share must not set the scale.
            (all[all.len() / 100], all[all.len() - 1 - all.len() / 100], all)
        };
        let ((low, high, _), (short, long, strokes)) = (bounds(0), bounds(1));
        if high <= 0.0 {
            return None;
        }
        let mut agreed = Self {
            terms: SVector::zeros(),
            pressure: (low, high),
            stroke: (short, (long - short).max(1e-9)),
            strokes,
            largest,
            scatter: 0.0,
        };
        let mut kept = rows.clone();
        for _ in 0..ROUNDS {
            agreed.terms = agreed.solved(&kept)?;
            let off = |r: &Row| (r[2] - agreed.force(r[0], r[1])).abs();
            let mut sizes: Vec<f64> = rows.iter().map(off).collect();
            let middle = sizes.len() / 2;
            let far = FAR * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
            kept = rows.iter().copied().filter(|r| off(r) <= far).collect();
        }
        agreed.scatter = agreed.off(&rows, None)?;
        Some(agreed)
    }

    fn solved(&self, rows: &[Row]) -> Option<SVector<f64, TERMS>> {
        let (mut normal, mut moment) =
            (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::<f64, TERMS>::zeros());
        for [p, x, f] in rows {
            let row = self.row(*p, *x);
            normal += row * row.transpose();
            moment += row * *f;
        }
        normal += SMatrix::identity() * (HELD * rows.len() as f64);
        Some(normal.cholesky()?.solve(&moment))
    }

    /// Beyond the strokes that there are it goes on as at their end.
    fn row(&self, pressure: f64, stroke: f64) -> SVector<f64, TERMS> {
        let p = pressure / self.pressure.1;
        let u = ((stroke - self.stroke.0) / self.stroke.1).clamp(0.0, 1.0);
        SVector::from([p, p * u, p * u * u, p * u.powi(3), 1.0, u, u * u, u.powi(3)])
    }

    /// N.
    fn force(&self, pressure: f64, stroke: f64) -> f64 {
        self.row(pressure, stroke).dot(&self.terms)
    }

    /// Whether there are rows about such a stroke and pressure.
    fn know(&self, pressure: f64, stroke: f64) -> bool {
        let next = self.strokes.partition_point(|x| *x < stroke);
        let near = |i: usize| self.strokes.get(i).is_some_and(|x| (x - stroke).abs() <= NEAR * self.stroke.1);
        let within = pressure <= BEYOND * self.pressure.1 && pressure >= self.pressure.0 / BEYOND;
        within && (near(next) || next > 0 && near(next - 1))
    }

    /// Whether a recording that does not agree would with one mistake made good.
    fn judge(&self, sample: &Sample) -> Option<Apart> {
        let as_read = self.off(&sample.rows, None).filter(|off| *off >= FAR_OFF)?;
        let tried = mistakes(&sample.rows).filter_map(|m| Some((self.off(&sample.rows, Some(&m))?, m)));
        let mut tried: Vec<(f64, Mistake)> = tried.collect();
        tried.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (left, mistake) = tried.first().copied()?;
        let among = AMONG.0.max(AMONG.1 * self.scatter);
        let next = tried.get(1).filter(|(next, _)| *next < AS_GOOD * left);
        (left <= among.min(AMONG_AT_MOST) && as_read >= BETTER * left).then(|| Apart {
            recording: sample.recording,
            mistake,
            or: next.map(|(_, m)| *m),
        })
    }

    /// How far four fifths of a recording's rows are off at most, a share of the usual largest force; a slack muscle pulls nothing.
    /// With a mistake made good `None` where the others do not know most of the rows, or the force that they make of it hardly changes.
    fn off(&self, rows: &[Row], mistake: Option<&Mistake>) -> Option<f64> {
        let rows: Vec<Row> = rows.iter().map(|r| mistake.map_or(*r, |m| m.of_row(*r))).collect();
        let known = rows.iter().filter(|r| self.know(r[0], r[1])).count();
        if mistake.is_some() && 4 * known < 3 * rows.len() {
            return None;
        }
        let quantile = |values: &mut Vec<f64>, fifths: usize| {
            let at = values.len() * fifths / 5;
            *values.select_nth_unstable_by(at, f64::total_cmp).1 / self.largest
        };
        let four_fifths = |values: &mut Vec<f64>| quantile(values, 4);
        let fifth = |values: &mut Vec<f64>| quantile(values, 1);
        let (mut made, mut sizes) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
        for [p, x, f] in &rows {
            let force = self.force(*p, *x).max(0.0);
            made.push(force);
            sizes.push((f - force).abs());
        }
        // A dead load cell reads what any muscle makes of no pressure, and one level fits many units: the force must change.
        let telling = mistake.is_none() || four_fifths(&mut made) - fifth(&mut made) >= CHANGES;
        telling.then(|| four_fifths(&mut sizes))
    }
}

#[cfg(test)]
mod tests;
