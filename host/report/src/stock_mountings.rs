//! The held mountings of a stock, each predicted without its own recordings: as text, and as a section of the report.

use std::fmt::Write as _;

use pam_diagnose::stock::{CauseError, LengthsRefusal, MountedLengths, StockDiagnosis};
use pam_fit::stock::MountingCause;

use super::{Section, Table, fixed};

/// What a mounting has of its own as text, and the factor, the decimals and the unit of its number.
fn cause(of: MountingCause) -> (&'static str, f64, usize, &'static str) {
    match of {
        MountingCause::Length => ("a length", 1e3, 2, "mm"),
        MountingCause::ForceZero => ("a zero of the load cell", 1.0, 1, "N"),
        MountingCause::GaugeZero => ("a zero of the pressure sensor", 1e-3, 0, "kPa"),
        MountingCause::ForceScale => ("a scale of the load cell", 100.0, 1, "%"),
    }
}

fn size(of: &CauseError) -> String {
    let (_, scale, decimals, unit) = cause(of.cause);
    format!("{} {unit}", fixed(scale * of.size, decimals))
}

fn too_large(of: &CauseError) -> &'static str {
    if of.plausible { "" } else { " (more than such a sensor's accuracy)" }
}

/// Why errors of the lengths of a number of mountings are not named.
#[must_use]
pub fn lengths_refusal(mountings: usize, of: LengthsRefusal) -> String {
    match of {
        LengthsRefusal::FewMountings { needed } => {
            format!("{mountings} mountings can be predicted from others; {needed} are needed")
        }
        LengthsRefusal::SmallErrors { within } => {
            format!("mountings are predicted to within {:.0} % of the largest force", 100.0 * within)
        }
        LengthsRefusal::SmallGain { left, t, needed } => format!(
            "a length for each mounting leaves {:.0} % of the squared error ({t:.1} standard errors over mountings; {needed:.1} are needed)",
            100.0 * left
        ),
        LengthsRefusal::OtherCause(cause) => {
            format!("{} predicts the mountings better", cause.effect().info().name)
        }
        LengthsRefusal::FollowContraction => {
            "the lengths follow the contraction: the muscles differ, in their braid angle for example, not their mountings".to_owned()
        }
    }
}

/// The sentence on the lengths, where they are named.
pub(crate) fn headline(answer: &StockDiagnosis) -> Option<String> {
    let lengths = answer.mounted_lengths.as_ref().filter(|l| l.named())?;
    let length = lengths.with(MountingCause::Length)?;
    let others = if lengths.confusable_with.is_empty() {
        String::new()
    } else {
        format!(" These recordings do not distinguish it from {}.", lengths.confusable_with.join(", "))
    };
    Some(format!(
        "{}: the mounted lengths differ from those that were read by {} rms. Without its own recordings a mounting is predicted to within {} N rms; \
         with a length of its own to within {} N.{others}",
        length.cause.effect().info().name,
        size(length),
        fixed(lengths.before, 1),
        fixed(length.error, 1)
    ))
}

/// The lines on the mountings.
pub(crate) fn text(lengths: &MountedLengths) -> String {
    let mut text = format!(
        "\nMountings, each predicted without its own recordings ({}, rms)\n  {:>6} N  nothing of its own\n",
        lengths.mountings,
        fixed(lengths.before, 2)
    );
    for c in &lengths.causes {
        let (description, ..) = cause(c.cause);
        let _ = writeln!(
            text,
            "  {:>6} N  {description} of its own, {} rms{}",
            fixed(c.error, 2),
            size(c),
            too_large(c)
        );
    }
    if let Some(why) = lengths.why_not {
        let name = MountingCause::Length.effect().info().name;
        let _ = writeln!(text, "  {name} is not named: {}", lengths_refusal(lengths.mountings, why));
    }
    text
}

/// The section of the report.
pub(crate) fn section(answer: &StockDiagnosis, lengths: &MountedLengths) -> Section {
    let mut section = Section::new("Mountings, each predicted without its own recordings");
    let mut table =
        Table::new("One number for each mounting", &["of its own", "effect", "size, rms", "error, rms (N)"]);
    table.row(["nothing".to_owned(), String::new(), String::new(), fixed(lengths.before, 2)]);
    for c in &lengths.causes {
        let (description, ..) = cause(c.cause);
        table.row([
            description.to_owned(),
            c.cause.effect().info().name.to_owned(),
            size(c) + too_large(c),
            fixed(c.error, 2),
        ]);
    }
    section.table(table);
    let mut table = Table::new("By muscle", &["muscle", "error, rms (N)", "with a length of its own (N)"]);
    for (muscle, own) in answer.muscles.iter().zip(&lengths.muscles) {
        if let Some(own) = own {
            table.row([muscle.name.clone(), fixed(own.before, 2), fixed(own.with_length, 2)]);
        }
    }
    section.table(table);
    section.text(
        "The number is fitted to the recordings of one direction and tried on those of the other. A zero of the pressure sensor moves the curves as a \
         length does; it counts as a cause only where a sensor may have it.",
    );
    if let Some(why) = lengths.why_not {
        section.text(format!("The lengths are not named: {}.", lengths_refusal(lengths.mountings, why)));
    }
    section
}
