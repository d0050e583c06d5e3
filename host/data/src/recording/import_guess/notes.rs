//! What `import --guess` reports to the user, with its subject: later steps select by the subject, never by the words.

use std::fmt;

use crate::recording::Quantity;

/// What a note is about.
#[derive(Debug, Clone, PartialEq)]
enum Subject {
    /// The file as a whole.
    File,
    /// A quantity.
    Quantity(Quantity),
    /// A column, and the quantity that it is named for.
    Column { header: String, quantity: Option<Quantity> },
    /// A quantity for which several columns could be meant.
    Choice,
}

/// A sentence about a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    subject: Subject,
    text: String,
}

impl Note {
    /// About a quantity.
    pub(super) fn on_quantity(quantity: Quantity, text: String) -> Self {
        Self { subject: Subject::Quantity(quantity), text }
    }

    /// About a column that is named for a quantity, or for none.
    pub(super) fn on_column(header: &str, quantity: Option<Quantity>, text: String) -> Self {
        Self { subject: Subject::Column { header: header.to_owned(), quantity }, text }
    }

    /// About a quantity that several columns could be.
    pub(super) fn on_choice(text: String) -> Self {
        Self { subject: Subject::Choice, text }
    }

    /// Whether it is about this column.
    pub(super) fn is_on_column(&self, name: &str) -> bool {
        matches!(&self.subject, Subject::Column { header, .. } if header == name)
    }

    /// Whether it is about this quantity, or a column that is named for it.
    pub(super) fn is_on_quantity(&self, sought: Quantity) -> bool {
        match self.subject {
            Subject::Quantity(quantity) | Subject::Column { quantity: Some(quantity), .. } => {
                quantity == sought
            }
            Subject::Column { quantity: None, .. } | Subject::File | Subject::Choice => false,
        }
    }

    /// Whether it is about a quantity that several columns could be.
    pub(super) fn is_on_choice(&self) -> bool {
        self.subject == Subject::Choice
    }

    /// The sentence.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// About the file as a whole.
impl From<String> for Note {
    fn from(text: String) -> Self {
        Self { subject: Subject::File, text }
    }
}

/// See `From<String>`.
impl From<&str> for Note {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
