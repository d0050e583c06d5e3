//! The results of a batch as one fleet: a member for every muscle, with the quantities by which muscles are compared.

// Fields carry their unit as units are spelled.
#![allow(non_snake_case)]

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use pam_data::error::{Error, Result};
use pam_data::statistics::median;

use crate::columns::Columns;
use crate::error::FleetCode;
use crate::failures::{Failure, Stage};
use crate::partition::{TABLES, muscles};

/// A quantity by which muscles are compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Its name in results, such as `E_1_MPa`.
    pub name: String,
    /// Its name in text, with mark-up.
    pub label: String,
    /// Its unit; empty for a number without.
    pub unit: &'static str,
}

/// An effect that was named for a muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedEffect {
    /// Its name in the catalogue.
    pub effect: String,
    /// Probability that the name is right.
    pub probability: f64,
    /// Whether it is the bench's.
    pub bench: bool,
}

/// One muscle of a fleet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Member {
    /// Its name.
    pub muscle: String,
    /// Its tags.
    pub tags: BTreeMap<String, String>,
    /// A value for every quantity of the fleet; `None` where it was not fitted, or not at this pressure.
    pub values: Vec<Option<f64>>,
    /// The verdict of its diagnosis; `None` where there is none.
    pub verdict: Option<String>,
    /// Effects that the recordings support.
    pub effects: Vec<NamedEffect>,
    /// What failed.
    pub failures: Vec<Failure>,
    /// The reports in its folder.
    pub reports: Vec<String>,
}

/// The results of a batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fleet {
    /// Sorted by name.
    pub members: Vec<Member>,
    /// What [`Member::values`] are.
    pub quantities: Vec<Quantity>,
    /// The pressure at which curves over pressure are compared, kPa: the median of the muscles' middle nodes.
    pub pressure_kPa: Option<f64>,
}

/// A muscle's curves over pressure: `E_1…E_M` in MPa and `k_F`.
struct Curves {
    pressure: Vec<f64>,
    curves: Vec<(String, Vec<Option<f64>>)>,
}

impl Fleet {
    /// Reads the results of a batch.
    ///
    /// # Errors
    /// A folder without results, or damaged ones.
    pub fn read(output: &Path) -> Result<Self> {
        let folders = muscles(output)?;
        if folders.is_empty() {
            return Err(Error::new(FleetCode::FleetInvalid, "the folder holds no results of `host batch`")
                .file(output));
        }
        let mut members = Vec::with_capacity(folders.len());
        let mut curves = Vec::with_capacity(folders.len());
        for (muscle, folder) in folders {
            let [fits, tables, diagnoses, failures] = read_tables(&folder)?;
            let mut member = member(&muscle, &fits, &diagnoses, &failures);
            member.reports = ["fit.html", "diagnosis.html"]
                .iter()
                .filter(|name| folder.join(name).exists())
                .map(|name| (*name).to_owned())
                .collect();
            members.push((member, fits));
            curves.push(curves_of(&tables));
        }
        let mut middles: Vec<f64> = curves.iter().filter_map(Curves::middle).collect();
        let pressure = (!middles.is_empty()).then(|| median(&mut middles));
        let quantities = quantities(pressure, &curves);
        let members = members
            .into_iter()
            .zip(&curves)
            .map(|((mut member, fits), curves)| {
                member.values = quantities.iter().map(|q| value(&q.name, &fits, curves, pressure)).collect();
                member
            })
            .collect();
        Ok(Self { members, quantities, pressure_kPa: pressure })
    }

    /// Muscles with a table.
    #[must_use]
    pub fn fitted(&self) -> usize {
        self.members.iter().filter(|m| m.values.iter().any(Option::is_some)).count()
    }

    /// Muscles whose diagnosis reached a verdict.
    pub fn diagnosed(&self) -> impl Iterator<Item = &Member> {
        self.members.iter().filter(|m| m.verdict.as_deref().is_some_and(|v| v != "not-judged"))
    }

    /// Muscles with at least one failure.
    #[must_use]
    pub fn failed(&self) -> usize {
        self.members.iter().filter(|m| !m.failures.is_empty()).count()
    }
}

fn read_tables(folder: &Path) -> Result<[Columns; 4]> {
    let read = |name: &str| {
        let path = folder.join(format!("{name}.parquet"));
        let file = File::open(&path).map_err(|e| Error::unreadable(&path, &e))?;
        Columns::from_parquet(file).map_err(|e| {
            Error::new(FleetCode::FleetInvalid, format!("the results are damaged: {e}")).file(&path)
        })
    };
    let [fits, tables, diagnoses, failures] = TABLES;
    Ok([read(fits)?, read(tables)?, read(diagnoses)?, read(failures)?])
}

fn member(muscle: &str, fits: &Columns, diagnoses: &Columns, failures: &Columns) -> Member {
    let tagged = [fits, diagnoses, failures].into_iter().find_map(|t| t.text("tags", 0));
    let effect = |row: usize| {
        // What was given as known and is not supported was not found.
        diagnoses.flag("supported", row).filter(|s| *s)?;
        Some(NamedEffect {
            effect: diagnoses.text("effect", row)?.to_owned(),
            probability: diagnoses.number("probability", row).unwrap_or(0.0),
            bench: diagnoses.flag("bench", row).unwrap_or(false),
        })
    };
    let failure = |row: usize| {
        let text = |column: &str| failures.text(column, row).unwrap_or_default().to_owned();
        let stage =
            [Stage::Manifest, Stage::Read, Stage::Fit].into_iter().find(|s| s.name() == text("stage"));
        Failure {
            stage: stage.unwrap_or(Stage::Diagnose),
            code: text("code"),
            cause: text("cause"),
            place: text("place"),
            remedy: text("remedy"),
        }
    };
    Member {
        muscle: muscle.to_owned(),
        tags: tagged.and_then(|t| serde_json::from_str(t).ok()).unwrap_or_default(),
        verdict: diagnoses.text("verdict", 0).filter(|_| diagnoses.rows() > 0).map(str::to_owned),
        effects: (0..diagnoses.rows()).filter_map(effect).collect(),
        failures: (0..failures.rows()).map(failure).collect(),
        ..Member::default()
    }
}

fn curves_of(tables: &Columns) -> Curves {
    let rows = tables.rows();
    let column = |name: &str| (0..rows).map(|row| tables.number(name, row)).collect::<Vec<_>>();
    let names = (1..=6).map(|k| format!("E_{k}_MPa")).chain(["k_F".to_owned()]);
    Curves {
        pressure: column("pressure_kPa").into_iter().flatten().collect(),
        curves: names.map(|name| (name.clone(), column(&name))).collect(),
    }
}

impl Curves {
    fn middle(&self) -> Option<f64> {
        Some(0.5 * (self.pressure.first()? + self.pressure.last()?))
    }

    /// A curve at a pressure, between its nodes only.
    fn at(&self, name: &str, pressure: f64) -> Option<f64> {
        let (_, curve) = self.curves.iter().find(|(n, _)| n == name)?;
        let after = self.pressure.iter().position(|p| *p >= pressure)?;
        let high = (*curve.get(after)?)?;
        if self.pressure[after] == pressure {
            return Some(high);
        }
        let before = after.checked_sub(1)?;
        let low = (*curve.get(before)?)?;
        let share = (pressure - self.pressure[before]) / (self.pressure[after] - self.pressure[before]);
        Some(low + share * (high - low))
    }
}

fn quantities(pressure: Option<f64>, curves: &[Curves]) -> Vec<Quantity> {
    let quantity = |name: &str, label: &str, unit| Quantity { name: name.into(), label: label.into(), unit };
    let mut list = vec![
        quantity("deadband_kPa", "P_{0}", "kPa"),
        quantity("blocked_force_N", "blocked force", "N"),
        quantity("mean_error_pct", "mean error of the fit", "%"),
    ];
    let Some(pressure) = pressure else { return list };
    for k in 1..=6 {
        let name = format!("E_{k}_MPa");
        if curves.iter().any(|c| c.at(&name, pressure).is_some()) {
            list.push(quantity(&name, &format!("E_{{{k}}}"), "MPa"));
        }
    }
    list.push(quantity("k_F", "k_{F}", ""));
    list
}

fn value(name: &str, fits: &Columns, curves: &Curves, pressure: Option<f64>) -> Option<f64> {
    fits.number(name, 0).or_else(|| curves.at(name, pressure?)).filter(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_interpolated_between_nodes_and_not_beyond() {
        let curves = Curves {
            pressure: vec![100.0, 200.0, 400.0],
            curves: vec![("k_F".into(), vec![Some(0.1), Some(0.2), None])],
        };
        assert_eq!(curves.at("k_F", 150.0), Some(0.15000000000000002));
        assert_eq!((curves.at("k_F", 100.0), curves.at("k_F", 200.0)), (Some(0.1), Some(0.2)));
        assert_eq!(
            (curves.at("k_F", 300.0), curves.at("k_F", 99.0), curves.at("k_F", 500.0)),
            (None, None, None)
        );
    }
}
