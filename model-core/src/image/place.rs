//! Reads a table's body into a place that is there already. A decoded table is a kilobyte, and each function that hands it on
//! would keep a copy on the stack: more than a small controller has.

use core::fmt;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};

use crate::table::MuscleTable;

/// The place that a table is read into, field by field in the order in which it is written.
pub(super) struct Place<'a>(pub(super) &'a mut MuscleTable);

const FIELDS: usize = 11;

impl<'de> DeserializeSeed<'de> for Place<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_tuple(FIELDS, self)
    }
}

impl<'de> Visitor<'de> for Place<'_> {
    type Value = ();

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("a muscle's table")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut fields: A) -> Result<(), A::Error> {
        let MuscleTable {
            kind,
            geometry,
            deadband,
            goes_slack,
            nodes,
            elastic,
            friction,
            tested,
            max_pressure,
            blocked_force,
            effects,
        } = self.0;
        next(&mut fields, kind)?;
        next(&mut fields, geometry)?;
        next(&mut fields, deadband)?;
        next(&mut fields, goes_slack)?;
        list(&mut fields, nodes)?;
        list(&mut fields, elastic)?;
        list(&mut fields, friction)?;
        next(&mut fields, tested)?;
        next(&mut fields, max_pressure)?;
        next(&mut fields, blocked_force)?;
        list(&mut fields, effects)
    }
}

fn next<'de, A: SeqAccess<'de>, V: Deserialize<'de>>(fields: &mut A, to: &mut V) -> Result<(), A::Error> {
    *to = fields.next_element()?.ok_or_else(missing)?;
    Ok(())
}

fn list<'de, A: SeqAccess<'de>, V: Deserialize<'de>, const N: usize>(
    fields: &mut A,
    to: &mut heapless::Vec<V, N>,
) -> Result<(), A::Error> {
    fields.next_element_seed(List(to))?.ok_or_else(missing)
}

fn missing<E: Error>() -> E {
    E::custom("a field is missing")
}

fn too_long<T, E: Error>(_: T) -> E {
    E::custom("a list is too long")
}

struct List<'a, V, const N: usize>(&'a mut heapless::Vec<V, N>);

impl<'de, V: Deserialize<'de>, const N: usize> DeserializeSeed<'de> for List<'_, V, N> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, V: Deserialize<'de>, const N: usize> Visitor<'de> for List<'_, V, N> {
    type Value = ();

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<(), A::Error> {
        self.0.clear();
        while let Some(element) = elements.next_element()? {
            self.0.push(element).map_err(too_long)?;
        }
        Ok(())
    }
}
