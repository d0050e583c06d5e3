//! What cells are compared with.

use serde::Deserialize;

/// A text or a number to compare cells with.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number; cells are compared as numbers.
    Number(f64),
    /// A text, or `{rest_length_mm}` or `{name}` of the muscle.
    Text(String),
    /// One of these.
    AnyOf(Vec<Value>),
    /// Everything but this.
    Not {
        /// What is excluded.
        not: Box<Value>,
    },
}

impl Value {
    /// A filter of the command line, `COLUMN=VALUE`: the column and the value. `COLUMN!=VALUE` excludes, and `COLUMN=A,B` takes several;
    /// a cell that holds the whole text with its commas passes, too.
    ///
    /// ```
    /// use pam_data::recording::import::Value;
    /// let text = |t: &str| Value::Text(t.to_owned());
    /// assert_eq!(Value::of_option("run", "8"), ("run".to_owned(), text("8")));
    /// let several = Value::AnyOf(vec![text("8,9"), text("8"), text("9")]);
    /// assert_eq!(Value::of_option("run!", "8,9"), ("run".to_owned(), Value::Not { not: Box::new(several) }));
    /// ```
    #[must_use]
    pub fn of_option(column: &str, text: &str) -> (String, Self) {
        let whole = Self::Text(text.to_owned());
        let value = if text.contains(',') {
            let parts = text.split(',').map(|part| Self::Text(part.trim().to_owned()));
            Self::AnyOf(std::iter::once(whole).chain(parts).collect())
        } else {
            whole
        };
        match column.strip_suffix('!') {
            Some(column) => (column.trim_end().to_owned(), Self::Not { not: Box::new(value) }),
            None => (column.to_owned(), value),
        }
    }

    /// Whether it says what does not pass.
    pub(in crate::recording) fn excludes(&self) -> bool {
        matches!(self, Self::Not { .. })
    }

    /// Whether it depends on the muscle's rest length.
    pub(in crate::recording) fn is_of_length(&self) -> bool {
        match self {
            Self::Text(text) => text == "{rest_length_mm}",
            Self::Number(_) => false,
            Self::AnyOf(values) => values.iter().any(Self::is_of_length),
            Self::Not { not } => not.is_of_length(),
        }
    }
}
