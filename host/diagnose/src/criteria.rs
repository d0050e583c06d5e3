//! Every number that decides, on one page: symbol, unit, value, statistical meaning, source.
//!
//! One file per stage of the diagnosis. Guards against division by zero and steps of numerical derivatives are no criteria; they stand
//! where they are used. Two ideas of inexactness meet here with several values, on purpose:
//!
//! | criterion | inexactness of | as a share of |
//! | --- | --- | --- |
//! | `selection::SELECTION_FLOOR` | the base model, below which nothing is selected | blocked force |
//! | `judgement::LACK_OF_FIT` | the base model with everything it admits, for the verdict | blocked force |
//! | `candidates::LAW_ERROR` | a law in its sensitivities, as a penalty of its score | the law's own trace |
//! | `selection::RIVAL_FLOOR` | a law, when two are compared by what they leave | the excess error |
//! | `uncertainty::LAW_DEVIATION` | a law in its parameters, for their intervals | the parameter |
//!
//! A sensitivity study scales one criterion at compile time, so that no setting of a running program can change an answer:
//!
//! ```text
//! PAM_CRITERION=FAMILY_ALPHA PAM_CRITERION_FACTOR=0.5 cargo build --release -p host
//! ```
//! `cargo run -p pam-diagnose --example criteria` prints the page.

mod scaling;

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
}

/// The criteria of one stage.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// The stage.
    pub title: &'static str,
    /// Its criteria.
    pub criteria: &'static [Criterion],
}

/// Declares the criteria of a stage as constants and as rows of the page.
macro_rules! criteria {
    ($title:literal: $($(#[doc = $meaning:literal])+ $name:ident: $type:tt = $value:expr, $symbol:literal, $unit:literal, $source:expr;)+) => {
        use super::Source::{self, *};
        $(
            $(#[doc = $meaning])+
            pub(crate) const $name: criteria!(@type $type) = criteria!(@value $type, $name, $value);
        )+
        /// This stage's part of the page.
        pub(super) const STAGE: super::Stage = super::Stage {
            title: $title,
            criteria: &[$(super::Criterion {
                name: stringify!($name),
                symbol: $symbol,
                unit: $unit,
                value: stringify!($value),
                meaning: concat!($($meaning),+),
                source: { const SOURCE: Source = $source; SOURCE },
            }),+],
        };
    };
    (@type f64) => { f64 };
    (@type usize) => { usize };
    (@type u32) => { u32 };
    (@type $other:tt) => { criteria!(@grouped $other) };
    (@grouped ($($inner:tt)+)) => { $($inner)+ };
    (@value f64, $name:ident, $value:expr) => { super::scaling::number(stringify!($name), $value) };
    (@value usize, $name:ident, $value:expr) => { super::scaling::count(stringify!($name), $value) };
    (@value $other:tt, $name:ident, $value:expr) => { $value };
}

pub(crate) mod baseline;
pub(crate) mod candidates;
pub(crate) mod history;
pub(crate) mod judgement;
pub(crate) mod location;
pub(crate) mod motion;
pub(crate) mod noise;
pub(crate) mod planning;
pub(crate) mod reference;
pub(crate) mod rest_friction;
pub(crate) mod rows;
pub(crate) mod selection;
pub(crate) mod timeline;
pub(crate) mod uncertainty;

/// The whole page, stage by stage in the order in which they decide.
pub const PAGE: [Stage; 14] = [
    motion::STAGE,
    rows::STAGE,
    baseline::STAGE,
    rest_friction::STAGE,
    noise::STAGE,
    candidates::STAGE,
    selection::STAGE,
    uncertainty::STAGE,
    judgement::STAGE,
    location::STAGE,
    planning::STAGE,
    history::STAGE,
    reference::STAGE,
    timeline::STAGE,
];

/// The page as Markdown tables.
#[must_use]
pub fn markdown() -> String {
    let mut page = String::new();
    for stage in PAGE {
        page.push_str(&format!("### {}\n\n", stage.title));
        page.push_str("| criterion | symbol | value | unit | meaning | source |\n| --- | --- | --- | --- | --- | --- |\n");
        for c in stage.criteria {
            let meaning = c.meaning.trim();
            page.push_str(&format!(
                "| `{}` | {} | {} | {} | {meaning} | {} |\n",
                c.name, c.symbol, c.value, c.unit, c.source
            ));
        }
        page.push('\n');
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_criterion_has_a_name_of_its_own_and_says_what_it_means() {
        let mut names: Vec<&str> = PAGE.iter().flat_map(|s| s.criteria).map(|c| c.name).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all, "a name scales one criterion");
        for c in PAGE.iter().flat_map(|s| s.criteria) {
            assert!(c.meaning.len() > 20 && !c.symbol.is_empty() && !c.unit.is_empty(), "{}", c.name);
        }
        assert_eq!(markdown().lines().filter(|l| l.starts_with("| `")).count(), all);
    }

    /// A number that decides belongs on the page: no other file of the crate declares one, outside tests.
    #[test]
    fn no_other_file_declares_a_criterion() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut folders = vec![root.clone()];
        let mut stray = Vec::new();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
                let path = entry.path();
                if path.is_dir() && !path.ends_with("criteria") && !path.ends_with("tests") {
                    folders.push(path);
                } else if path.extension().is_some_and(|e| e == "rs")
                    && !path.ends_with("criteria.rs")
                    && !path.ends_with("tests.rs")
                {
                    let text = std::fs::read_to_string(&path).expect("a source file");
                    let production = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
                    let declares = |line: &&str| {
                        let line = line
                            .trim_start()
                            .trim_start_matches("pub(crate) ")
                            .trim_start_matches("pub(super) ");
                        line.starts_with("const ")
                            && [": f64 =", ": usize =", ": u32 =", ": [f64;"].iter().any(|t| line.contains(t))
                    };
                    stray.extend(
                        production.lines().filter(declares).map(|l| format!("{}: {l}", path.display())),
                    );
                }
            }
        }
        assert_eq!(stray, [""; 0], "move these into criteria");
    }
}
