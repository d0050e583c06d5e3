//! Errors with cause, place and remedy.
//!
//! Every failure of the libraries is an [`Error`]. Its [`Code`] is stable, so that scripts can test for it, and decides the exit
//! status: 1 when the input or the device is at fault, 2 when the call is. Each crate declares its own codes.

use std::fmt;
use std::path::{Path, PathBuf};

/// Shorthand for results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Who is at fault, and so the exit status of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The input or the device: exit status 1.
    Input,
    /// The way the program was called: exit status 2.
    Call,
}

impl Fault {
    /// The exit status of the program.
    #[must_use]
    pub fn exit_status(self) -> u8 {
        match self {
            Self::Input => 1,
            Self::Call => 2,
        }
    }
}

/// A kind of failure. Every crate declares its own with [`error_codes`](crate::error_codes); the name is stable, so that scripts can
/// test for it.
#[derive(Debug, Clone, Copy)]
pub struct Code {
    name: &'static str,
    remedy: &'static str,
    fault: Fault,
}

impl Code {
    /// A kind of failure; used by [`error_codes`](crate::error_codes).
    #[must_use]
    pub const fn new(name: &'static str, fault: Fault, remedy: &'static str) -> Self {
        Self { name, remedy, fault }
    }

    /// The name that scripts may rely on, such as `recording::missing-column`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.name
    }

    /// What to do about failures of this kind, where nothing better is known.
    #[must_use]
    pub const fn remedy(self) -> &'static str {
        self.remedy
    }

    /// Who is at fault.
    #[must_use]
    pub const fn fault(self) -> Fault {
        self.fault
    }
}

impl PartialEq for Code {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Code {}

/// Declares the kinds of failure of a crate as an enum that converts into [`error::Code`](crate::error::Code).
///
/// ```
/// pam_data::error_codes! {
///     /// Failures of a kettle.
///     pub enum KettleCode {
///         /// There is no water in it.
///         Dry = "kettle::dry", Input, "fill in water up to the mark";
///     }
/// }
/// let error = pam_data::error::Error::new(KettleCode::Dry, "no water");
/// assert_eq!(error.code(), KettleCode::Dry);
/// assert_eq!(error.code().name(), "kettle::dry");
/// ```
#[macro_export]
macro_rules! error_codes {
    ($(#[$outer:meta])* pub enum $enum:ident {
        $($(#[$doc:meta])* $name:ident = $text:literal, $fault:ident, $remedy:literal;)*
    }) => {
        $(#[$outer])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum $enum { $($(#[$doc])* $name,)* }

        impl $enum {
            /// Every code of this crate, for the manual and for tests.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];
        }

        impl From<$enum> for $crate::error::Code {
            fn from(code: $enum) -> Self {
                match code { $($enum::$name => Self::new($text, $crate::error::Fault::$fault, $remedy),)* }
            }
        }

        impl PartialEq<$enum> for $crate::error::Code {
            fn eq(&self, other: &$enum) -> bool {
                *self == Self::from(*other)
            }
        }
    };
}

error_codes! {
    /// Failures of reading recordings and descriptions, of writing results, and of calls.
    pub enum DataCode {
        /// A file does not exist, may not be read, or ends early.
        FileUnreadable = "file::unreadable", Input,
            "look at the name, the folder, and whether this user may read it";
        /// A result could not be written; what stood there before is untouched.
        FileUnwritable = "file::unwritable", Input,
            "check that the folder exists and may be written to, and that the disk has room";
        /// A file holds nothing at all.
        RecordingEmpty = "recording::empty", Input,
            "record again, or name the file that holds the rows";
        /// A file is binary, or text in an encoding other than UTF-8.
        RecordingNotText = "recording::not-text", Input,
            "give a CSV or tab-separated file in UTF-8";
        /// A required column is absent.
        RecordingMissingColumn = "recording::missing-column", Input,
            "name the columns as `host fit --help` shows, or write an import description";
        /// Two columns give the same quantity.
        RecordingDuplicateColumn = "recording::duplicate-column", Input,
            "keep one of them, or choose it by an import description";
        /// A column's name ends in a unit that its quantity does not have.
        RecordingUnknownUnit = "recording::unknown-unit", Input,
            "write the unit behind the last underscore, such as pressure_kPa";
        /// A cell holds something that is not a number.
        RecordingNotANumber = "recording::not-a-number", Input,
            "write numbers with a point, or leave such rows out by --missing skip";
        /// A cell holds NaN or an infinity.
        RecordingNotFinite = "recording::not-finite", Input,
            "leave such rows out by --missing skip; missing values are not filled in";
        /// A line has too few or too many cells.
        RecordingWrongWidth = "recording::wrong-width", Input,
            "every line has as many cells as the header";
        /// Time does not increase.
        RecordingTimeOrder = "recording::time-order", Input,
            "put the rows into the order in which they were measured";
        /// A number is outside what is physically possible.
        RecordingOutOfRange = "recording::out-of-range", Input,
            "is the unit in the column's name the one of its numbers?";
        /// Too few rows to be of use.
        RecordingTooShort = "recording::too-short", Input,
            "record longer, or name another file";
        /// The file's container (compression, MATLAB, HDF5, Parquet) is damaged or not supported.
        RecordingContainer = "recording::container", Input,
            "save the file again, or export it as CSV";
        /// Lengths are given, but not the muscle's rest length that turns them into a stroke.
        RecordingRestLength = "recording::rest-length", Call,
            "give the muscle's description with --muscle";
        /// An import description is not valid, or does not fit the file.
        ImportInvalid = "import::invalid", Input,
            "compare with the descriptions in examples/imports";
        /// A muscle description is not valid.
        MuscleInvalid = "muscle::invalid", Input,
            "compare with the descriptions in examples/muscles, or make one with `host new`";
        /// A check of the bench is invalid or determines nothing.
        CheckInvalid = "check::invalid", Input,
            "compare with the tables in the book's chapter on checking the bench";
        /// A table file is damaged or from another version.
        TableInvalid = "table::invalid", Input,
            "fit the muscle again with `host fit`";
        /// A protocol is not valid, or cannot be carried out.
        ProtocolInvalid = "protocol::invalid", Input,
            "`virtual-bench record` writes a protocol beside its recordings, `host diagnose --next` one that would show more";
        /// Options that contradict each other or are out of range.
        CallInvalid = "call::invalid", Call,
            "--help behind the command shows what it takes, with examples";
    }
}

/// Where in the input a failure was found. Unknown parts stay empty.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: Option<PathBuf>,
    /// Line in the file, counted from 1.
    pub line: Option<u64>,
    /// Column: its name, or its number counted from 1.
    pub column: Option<String>,
    /// The offending text.
    pub value: Option<String>,
}

impl Place {
    fn is_empty(&self) -> bool {
        self.file.is_none() && self.line.is_none() && self.column.is_none() && self.value.is_none()
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}", file.display())?;
        }
        if let Some(line) = self.line {
            // `file:line` is what editors and terminals turn into a link.
            if self.file.is_some() { write!(f, ":{line}")? } else { write!(f, "line {line}")? }
        }
        if let Some(column) = &self.column {
            let gap = if self.file.is_some() || self.line.is_some() { ", " } else { "" };
            write!(f, "{gap}column {column}")?;
        }
        if let Some(value) = &self.value {
            let gap =
                if self.file.is_some() || self.line.is_some() || self.column.is_some() { ": " } else { "" };
            write!(f, "{gap}{value}")?;
        }
        Ok(())
    }
}

#[derive(Debug)]
struct Inner {
    code: Code,
    cause: String,
    place: Place,
    help: Option<String>,
}

/// A failure as the user sees it.
///
/// ```
/// use pam_data::error::{DataCode, Error};
/// let error = Error::new(DataCode::RecordingNotANumber, "not a number")
///     .file("a.csv").line(7).column("force_N").value("12,5").help("write decimals with a point");
/// assert_eq!(error.to_string(), "not a number (a.csv:7, column force_N: `12,5`)");
/// assert_eq!(error.code().name(), "recording::not-a-number");
/// assert_eq!(error.exit_status(), 1);
/// ```
#[derive(Debug, thiserror::Error)]
#[error("{}", self.text())]
pub struct Error(Box<Inner>);

impl Error {
    /// A failure of kind `code` with its `cause` in one clause, without a full stop.
    pub fn new(code: impl Into<Code>, cause: impl Into<String>) -> Self {
        Self(Box::new(Inner { code: code.into(), cause: cause.into(), place: Place::default(), help: None }))
    }

    /// The same failure, with what it concerns before its cause.
    ///
    /// ```
    /// use pam_data::error::{DataCode, Error};
    /// let error = Error::new(DataCode::RecordingTooShort, "two rows").line(3).concerning("campaign `May`");
    /// assert_eq!(error.cause(), "campaign `May`: two rows");
    /// assert_eq!(error.place().line, Some(3));
    /// ```
    #[must_use]
    pub fn concerning(mut self, what: impl std::fmt::Display) -> Self {
        self.0.cause = format!("{what}: {}", self.0.cause);
        self
    }

    /// The file could not be read; the operating system's reason becomes part of the cause.
    pub fn unreadable(file: impl AsRef<Path>, reason: &std::io::Error) -> Self {
        let file = file.as_ref();
        let error =
            Self::new(DataCode::FileUnreadable, format!("cannot be read: {}", plain_text(reason))).file(file);
        match reason.kind() {
            std::io::ErrorKind::NotFound if file.to_string_lossy().contains(['*', '?']) => {
                error.help("no file here matches this pattern")
            }
            std::io::ErrorKind::IsADirectory => error.help("name the files in it"),
            _ => error,
        }
    }

    /// The file could not be written; the operating system's reason becomes part of the cause.
    pub fn unwritable(file: impl AsRef<Path>, reason: &std::io::Error) -> Self {
        Self::new(DataCode::FileUnwritable, format!("cannot be written: {}", plain_text(reason))).file(file)
    }

    /// Names the file. A file already named stays: the innermost place is the exact one.
    #[must_use]
    pub fn file(mut self, file: impl AsRef<Path>) -> Self {
        // What was put together in memory has no file.
        if !file.as_ref().as_os_str().is_empty() {
            self.0.place.file.get_or_insert_with(|| file.as_ref().to_path_buf());
        }
        self
    }

    /// Names the line, counted from 1.
    #[must_use]
    pub fn line(mut self, line: u64) -> Self {
        self.0.place.line.get_or_insert(line);
        self
    }

    /// Names the column.
    #[must_use]
    pub fn column(mut self, column: impl Into<String>) -> Self {
        self.0.place.column.get_or_insert_with(|| column.into());
        self
    }

    /// Quotes the offending text, shortened and with control characters made visible.
    #[must_use]
    pub fn value(mut self, value: impl AsRef<str>) -> Self {
        let text = value.as_ref();
        let mut quoted: String = text.chars().take(40).flat_map(char::escape_debug).collect();
        if text.chars().nth(40).is_some() {
            quoted.push('…');
        }
        self.0.place.value.get_or_insert(format!("`{quoted}`"));
        self
    }

    /// Says what to do about it.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    /// The stable kind of this failure.
    #[must_use]
    pub fn code(&self) -> Code {
        self.0.code
    }

    /// What is wrong, without the place.
    #[must_use]
    pub fn cause(&self) -> &str {
        &self.0.cause
    }

    /// Where it is wrong.
    #[must_use]
    pub fn place(&self) -> &Place {
        &self.0.place
    }

    /// What to do: the advice that was given, or that for all failures of this kind.
    #[must_use]
    pub fn advice(&self) -> Option<&str> {
        Some(self.0.help.as_deref().unwrap_or_else(|| self.code().remedy()))
    }

    /// Whether this failure was given advice of its own.
    #[must_use]
    pub fn advised(&self) -> bool {
        self.0.help.is_some()
    }

    /// The exit status that this failure ends the program with.
    #[must_use]
    pub fn exit_status(&self) -> u8 {
        self.0.code.fault().exit_status()
    }

    fn text(&self) -> String {
        if self.0.place.is_empty() {
            self.0.cause.clone()
        } else {
            format!("{} ({})", self.0.cause, self.0.place)
        }
    }
}

/// The operating system's reason without its number, which repeats the text.
fn plain_text(reason: &std::io::Error) -> String {
    let text = reason.to_string();
    match text.rfind(" (os error ") {
        Some(at) => text[..at].to_owned(),
        None => text,
    }
}

impl miette::Diagnostic for Error {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.0.code.name()))
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.advice().map(|h| Box::new(h) as Box<dyn fmt::Display>)
    }
}

/// The candidate nearest in spelling to `wanted`, if one is near enough to be worth offering.
///
/// ```
/// assert_eq!(pam_data::error::nearest("pressure_kpa", ["time_s", "pressure_kPa"]), Some("pressure_kPa"));
/// assert_eq!(pam_data::error::nearest("voltage", ["time_s", "pressure_kPa"]), None);
/// // Two letters that changed places are one mistake.
/// assert_eq!(pam_data::error::nearest("fti", ["run", "fit"]), Some("fit"));
/// ```
pub fn nearest<'a>(wanted: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Names are short; anything longer is not a misspelling of one of ours.
    let wanted = wanted.chars().take(64).collect::<String>().to_lowercase();
    candidates
        .into_iter()
        // Two transposed letters are one typing error, not two.
        .map(|c| (strsim::osa_distance(&wanted, &c.to_lowercase()), c))
        .filter(|(d, c)| *d <= 1 + wanted.chars().count().max(c.chars().count()) / 4)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_distinct_and_lead_to_an_exit_status() {
        let mut names: Vec<_> = DataCode::ALL.iter().map(|c| Code::from(*c).name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), DataCode::ALL.len());
        assert!(DataCode::ALL.iter().all(|c| matches!(Code::from(*c).fault().exit_status(), 1 | 2)));
        // An error without its own advice has that of its kind.
        assert!(DataCode::ALL.iter().all(|c| Error::new(*c, "x").advice().is_some_and(|a| a.len() > 20)));
    }

    #[test]
    fn the_innermost_place_wins() {
        let error = Error::new(DataCode::MuscleInvalid, "x").line(3).file("inner").file("outer").line(9);
        assert_eq!(error.to_string(), "x (inner:3)");
    }

    #[test]
    fn quoted_values_are_short_and_printable() {
        let error =
            Error::new(DataCode::RecordingNotANumber, "x").value("a\u{1b}[31m".to_owned() + &"é".repeat(100));
        let text = error.to_string();
        assert!(text.chars().count() < 70 && !text.contains('\u{1b}'), "{text}");
    }
}
