//! A table beside a recording that lists its runs: which of its columns find the line of a run, and what they say of it.

use std::path::Path;

use super::names::{Name, Score};
use super::sample::SampleColumn;
use crate::recording::Quantity;
use crate::recording::assemble::{LookupTable, same};
use crate::recording::lookup::read_lookup;

/// Files in a folder that are read, and their size in bytes: a list of runs is short.
const FILES: usize = 200;
const SIZE: u64 = 1 << 20;

/// A list of runs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Listed {
    pub file: String,
    /// Column of the list = column of the recording, or `{file}`.
    pub keys: Vec<(String, String)>,
    /// What it says of the stroke and of the rest length.
    pub quantities: Vec<(Quantity, String, Name)>,
}

/// Looks for a table beside the recording that has a line for each of its runs and says how long the muscle was.
pub(super) fn find(recording: &Path, columns: &[SampleColumn]) -> Option<Listed> {
    let own = recording.file_name()?.to_string_lossy().into_owned();
    let folder = recording.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .take(FILES)
        .filter(|e| e.metadata().is_ok_and(|m| m.is_file() && m.len() <= SIZE))
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .filter(|name| {
            *name != own && (name.ends_with(".csv") || name.ends_with(".tsv") || name.ends_with(".txt"))
        })
        .collect();
    files.sort();
    files.into_iter().find_map(|file| {
        let table = read_lookup(recording, &file).ok()?;
        listed(file, &table, &own, columns)
    })
}

fn listed(file: String, table: &LookupTable, own: &str, columns: &[SampleColumn]) -> Option<Listed> {
    let of_this = |n: usize| table.rows.iter().any(|row| row.get(n).is_some_and(|cell| cell == own));
    let file_column = (0..table.header.len()).find(|n| of_this(*n))?;
    let lines: Vec<&Vec<String>> =
        table.rows.iter().filter(|row| row.get(file_column).is_some_and(|cell| cell == own)).collect();
    let mut keys = vec![(table.header[file_column].clone(), "{file}".to_owned())];
    let mut indices = Vec::new();
    for column in columns {
        let Some(levels) = column.levels.as_ref() else { continue };
        // `nominal_contraction` of the list is `contraction` of the recording where it has the same values.
        let called =
            |header: &String| *header == column.header || header.ends_with(&format!("_{}", column.header));
        let has =
            |n: usize, word: &String| lines.iter().any(|l| l.get(n).is_some_and(|cell| same(cell, word)));
        let theirs = (0..table.header.len())
            .find(|n| called(&table.header[*n]) && levels.words.iter().all(|word| has(*n, word)));
        if let Some(n) = theirs {
            keys.push((table.header[n].clone(), column.header.clone()));
            indices.push(n);
        }
    }
    let key = |line: &&Vec<String>| -> Vec<String> {
        indices.iter().map(|n| line.get(*n).cloned().unwrap_or_default()).collect()
    };
    let mut found: Vec<Vec<String>> = lines.iter().map(key).collect();
    found.sort();
    found.dedup();
    if found.len() != lines.len() {
        return None;
    }
    let stroke = [Quantity::Displacement, Quantity::Length, Quantity::Contraction];
    let best = |quantity: Quantity| -> Option<(Score, String, Name)> {
        let named = table.header.iter().filter_map(|header| {
            let name = Name::of(header);
            let (q, score) = name.quantity()?;
            (q == quantity).then_some((score, header.clone(), name))
        });
        named.max_by_key(|(score, ..)| *score)
    };
    let first = stroke.into_iter().find_map(|q| best(q).map(|(_, header, name)| (q, header, name)))?;
    let rest = best(Quantity::RestLength).map(|(_, header, name)| (Quantity::RestLength, header, name));
    Some(Listed { file, keys, quantities: std::iter::once(first).chain(rest).collect() })
}
