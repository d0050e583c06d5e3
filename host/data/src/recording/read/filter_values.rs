//! Whether the files have the values that the filters of a call name: a misspelled value would exclude or add nothing.

use std::sync::{Mutex, PoisonError};

use super::super::assemble::same;
use crate::error::{DataCode, Error, Result};

/// At most this many values of a column are listed.
const LISTED: usize = 20;

/// The filters of a call, with what was found of each.
#[derive(Debug, Default)]
pub struct FilterValues(Mutex<Vec<Filter>>);

#[derive(Debug)]
struct Filter {
    column: String,
    /// The whole text, and its parts between commas, each with whether a cell is so.
    whole: (String, bool),
    parts: Vec<(String, bool)>,
    /// Values that the column has, and how many more.
    words: Vec<String>,
    more: usize,
}

impl FilterValues {
    /// Of options `COLUMN=VALUE`, taken apart.
    pub(super) fn of(filters: &[(String, String)]) -> Self {
        let one = |(column, text): &(String, String)| Filter {
            column: column.strip_suffix('!').unwrap_or(column).trim_end().to_owned(),
            whole: (text.clone(), false),
            parts: text.split(',').map(|part| (part.trim().to_owned(), false)).collect(),
            words: Vec::new(),
            more: 0,
        };
        Self(Mutex::new(filters.iter().map(one).collect()))
    }

    /// Notes the values of a column of one file.
    pub(in crate::recording) fn note(&self, column: &str, words: &[String]) {
        let mut filters = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for filter in filters.iter_mut().filter(|f| f.column == column) {
            for (text, found) in std::iter::once(&mut filter.whole).chain(&mut filter.parts) {
                // Names in braces are properties of the muscle.
                *found = *found || text.starts_with('{') || words.iter().any(|word| same(text, word));
            }
            for word in words {
                if filter.words.len() == LISTED {
                    filter.more += usize::from(!filter.words.contains(word));
                } else if !filter.words.contains(word) {
                    filter.words.push(word.clone());
                }
            }
        }
    }

    /// # Errors
    /// [`DataCode::CallInvalid`] for a value that no row has.
    pub(super) fn check(&self) -> Result<()> {
        let filters = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for filter in filters.iter().filter(|f| !f.whole.1) {
            let Some((absent, _)) = filter.parts.iter().find(|(_, found)| !found) else { continue };
            let mut values = filter.words.clone();
            if filter.more > 0 {
                values.push("others".to_owned());
            }
            return Err(Error::new(
                DataCode::CallInvalid,
                format!("no row has this value in {}", filter.column),
            )
            .value(absent)
            .help(format!("{} is one of {}", filter.column, values.join(", "))));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::error::{DataCode, Error};
    use crate::recording::{Campaign, Import, Reader};

    /// Two files with the runs 1 and 2, and 3.
    fn read(filters: &[(&str, &str)]) -> Result<Campaign, Error> {
        let folder = tempfile::tempdir().unwrap();
        let paths = [[1, 2], [3, 3]].map(|runs| {
            let path = folder.path().join(format!("{}.csv", runs[0]));
            let row = |i: i32| format!("{},{i},300,1,50\n", runs[i as usize / 12]);
            let rows: String = (0..24).map(row).collect();
            std::fs::write(&path, format!("run,time_s,pressure_kPa,displacement_mm,force_N\n{rows}"))
                .unwrap();
            path
        });
        let import = Import::parse("split_by = [\"run\"]\n").unwrap();
        let filters = filters.iter().map(|(c, v)| ((*c).to_owned(), (*v).to_owned())).collect();
        Reader { filters, ..Reader::new().import(Some(&import)) }.campaign(&paths)
    }

    #[test]
    fn several_values_of_one_column_take_the_rows_with_any_of_them() {
        let runs = |filters: &[(&str, &str)]| -> Vec<String> {
            read(filters).unwrap().recordings.iter().map(|r| r.labels[0].1.clone()).collect()
        };
        assert_eq!(runs(&[("run", "1"), ("run", "3")]), ["1", "3"]);
        assert_eq!(runs(&[("run!", "1")]), ["2", "3"]);
        assert_eq!(runs(&[("run", "2,3"), ("run", "1"), ("run!", "2")]), ["1", "3"]);
    }

    #[test]
    fn a_value_that_no_row_of_any_file_has_is_refused() {
        for filters in [("run!", "99"), ("run", "1,99,3"), ("run!", "1,99")] {
            let error = read(&[filters]).unwrap_err();
            assert_eq!(
                (error.code(), error.cause()),
                (DataCode::CallInvalid.into(), "no row has this value in run")
            );
            assert_eq!(error.advice(), Some("run is one of 1, 2, 3"), "{error}");
        }
        // A number is one however it is written.
        assert!(
            read(&[("run!", "1.0"), ("time_s", "0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21")])
                .is_ok()
        );
    }
}
