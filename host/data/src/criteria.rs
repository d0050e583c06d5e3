//! Criteria as data: a number that decides, with its symbol, unit, value, statistical meaning and source.
//!
//! The macro [`criteria!`](crate::criteria!) declares the criteria of one stage as constants and as rows of the page that
//! `cargo run -p pam-diagnose --example criteria` prints. No setting of a running program can change them. Only a program built with
//! `--cfg pam_study`, for a study of how much the answers depend on each criterion, reads from its environment which criteria it scales,
//! separated by commas, and the factor:
//!
//! ```text
//! RUSTFLAGS='--cfg pam_study' cargo build --release -p host --target-dir STUDY
//! PAM_CRITERION=FAMILY_ALPHA PAM_CRITERION_FACTOR=0.5 STUDY/release/host diagnose …
//! ```

#[cfg(pam_study)]
#[doc(hidden)]
pub mod study;

/// Where the value of a criterion comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// It follows from the formula or the argument given.
    Derived(&'static str),
    /// A usual level of significance or precision.
    Convention(&'static str),
    /// Data sheets, or measurements on muscles, as given.
    Measured(&'static str),
    /// A publication.
    Published(&'static str),
    /// Set by trials on the virtual bench: the opened development sets.
    Trials(&'static str),
    /// Engineering judgement; the opened development sets were answered with it, and no derivation is known.
    Judgement,
    /// Limits time or memory, and does not decide a verdict.
    Cost,
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Derived(text) => write!(f, "derived: {text}"),
            Self::Convention(text) => write!(f, "convention: {text}"),
            Self::Measured(text) => write!(f, "measured: {text}"),
            Self::Published(text) => write!(f, "{text}"),
            Self::Trials("") => write!(f, "set by trials on the virtual bench"),
            Self::Trials(text) => write!(f, "set by trials on the virtual bench: {text}"),
            Self::Judgement => write!(f, "engineering judgement, used in all trials on the virtual bench"),
            Self::Cost => write!(f, "limit of computing time"),
        }
    }
}

/// One criterion.
#[derive(Clone, Copy, Debug)]
pub struct Criterion {
    /// Its name in the source.
    pub name: &'static str,
    /// Its symbol in formulas of the book, or the name of the quantity.
    pub symbol: &'static str,
    /// Its unit; `1` for a number or a share.
    pub unit: &'static str,
    /// Its value, as written in the source.
    pub value: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// Where the value comes from.
    pub source: Source,
    /// Whether a study can scale it: not the sizes of arrays, and not lists.
    pub scalable: bool,
}

/// The criteria of one stage.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// The stage.
    pub title: &'static str,
    /// Its criteria.
    pub criteria: &'static [Criterion],
}

/// Declares the criteria of a stage as constants and as rows of the page. A type in parentheses is not scaled by a study: lists, and
/// numbers that are the size of an array.
#[macro_export]
macro_rules! criteria {
    ($title:literal: $($(#[doc = $meaning:literal])+ $name:ident: $type:tt = $value:expr, $symbol:literal, $unit:literal, $source:expr;)+) => {
        use $crate::criteria::Source::{self, *};
        $(
            $(#[doc = $meaning])+
            #[cfg(not(pam_study))]
            pub(crate) const $name: $crate::criteria!(@type $type) = $value;
            #[cfg(pam_study)]
            $crate::criteria!(@study $type, $name, $value);
        )+
        /// This stage's part of the page.
        pub(crate) const STAGE: $crate::criteria::Stage = $crate::criteria::Stage {
            title: $title,
            criteria: &[$($crate::criteria::Criterion {
                name: stringify!($name),
                symbol: $symbol,
                unit: $unit,
                value: stringify!($value),
                meaning: concat!($($meaning),+),
                source: { const SOURCE: Source = $source; SOURCE },
                scalable: $crate::criteria!(@scalable $type),
            }),+],
        };
    };
    (@scalable f64) => { true };
    (@scalable usize) => { true };
    (@scalable $other:tt) => { false };
    (@type f64) => { f64 };
    (@type usize) => { usize };
    (@type u32) => { u32 };
    (@type $other:tt) => { $crate::criteria!(@grouped $other) };
    (@grouped ($($inner:tt)+)) => { $($inner)+ };
    (@study f64, $name:ident, $value:expr) => {
        $crate::criteria!(@cell f64, $name, ::std::sync::atomic::AtomicU64::new(f64::to_bits($value)));
    };
    (@study usize, $name:ident, $value:expr) => {
        $crate::criteria!(@cell usize, $name, ::std::sync::atomic::AtomicUsize::new($value));
    };
    (@study $other:tt, $name:ident, $value:expr) => { pub(crate) const $name: $crate::criteria!(@type $other) = $value; };
    // A constant whose value the compiler does not know: declared here, defined below, and scaled before `main`.
    (@cell $type:ident, $name:ident, $cell:expr) => {
        unsafe extern "C" { pub(crate) safe static $name: $type; }
        const _: () = {
            type Cell = <$type as $crate::criteria::study::Scaled>::Cell;
            #[unsafe(export_name = stringify!($name))]
            static CELL: Cell = $cell;
            extern "C" fn scale() { <$type as $crate::criteria::study::Scaled>::scale(stringify!($name), &CELL) }
            #[used]
            #[unsafe(link_section = ".init_array")]
            static BEFORE_MAIN: extern "C" fn() = scale;
        };
    };
}

/// Stages as Markdown tables.
#[must_use]
pub fn markdown(stages: &[Stage]) -> String {
    let mut page = String::new();
    for stage in stages {
        page.push_str(&format!("## {}\n\n", stage.title));
        page.push_str("| criterion | symbol | value | unit | meaning | source |\n| --- | --- | --- | --- | --- | --- |\n");
        for c in stage.criteria {
            let meaning = c.meaning.trim();
            // The source breaks long values into lines.
            let value = c.value.split_whitespace().collect::<Vec<_>>().join(" ");
            page.push_str(&format!(
                "| `{}` | {} | {value} | {} | {meaning} | {} |\n",
                c.name, c.symbol, c.unit, c.source
            ));
        }
        page.push('\n');
    }
    page
}
