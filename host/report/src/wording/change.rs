//! Sentences of a comparison with a reference.

use std::fmt::Write;

use pam_data::date;
use pam_data::pluralise::pluralise;
use pam_diagnose::reference::answer::{
    ChangeReport, Changed, Left, Moment, NotComparable, Place, Remark, Repeatability, Since, Size, Split,
    Verdict, WhyNot,
};
use pam_diagnose::reference::shapes::{Change, Inspect, Owner};

use super::separate;

pub use super::headline::headline;

/// How recordings were held out.
#[must_use]
pub(crate) fn split(split: Split) -> &'static str {
    match split {
        Split::OtherRecordings => "every other recording of AFTER",
        Split::None => "none: AFTER is one recording",
        Split::OtherLevels => "every other level of pressure",
        Split::OtherParts => "every other part of AFTER, by length and time",
    }
}

/// Files in one sentence, at most.
const MOST_FILES: usize = 3;

fn table(error: f64, stated: f64, sources: &[String]) -> String {
    let mut text = if stated > 0.0 {
        format!(
            "the reference is a table: its error ({stated:.2} N rms as stated, {error:.2} N counted here) is part of what repeats, and smaller changes are missed"
        )
    } else {
        format!(
            "the reference is a table that states no error: {error:.2} N is assumed as part of what repeats, and smaller changes are missed"
        )
    };
    if let Some(first) = sources.first() {
        let more = match sources.len() {
            1 => String::new(),
            n if n <= MOST_FILES => sources[1..].iter().map(|s| format!(", {s}")).collect(),
            n => format!(" and {} more", n - 1),
        };
        let _ = write!(text, "; a comparison with its recordings ({first}{more}) finds smaller ones");
    }
    text
}

/// A note on a comparison.
#[must_use]
pub fn remark(remark: &Remark) -> String {
    match remark {
        Remark::ForceRatio(ratio) => format!(
            "the largest force of AFTER is {ratio:.2} times that of the reference at the same pressures: is it the same actuator?"
        ),
        Remark::ReferenceLater { reference, after } => format!(
            "the reference is of {}, AFTER of {}: were they given the wrong way round?",
            date::day(*reference),
            date::day(*after)
        ),
        Remark::Table { error, stated, sources } => table(*error, *stated, sources),
        Remark::OtherTable(table, muscle) => {
            format!("the table is that of `{table}`, and `{muscle}` is described: is it the same actuator?")
        }
        Remark::OtherActuator => "the difference is larger than a change of the bench makes: is it the same actuator, and are the signs and units the same?".into(),
        Remark::OneLengthMountedAnew => "AFTER was remounted and has one length only: a shift of the clamp by a millimetre cannot be distinguished from a change of gain; record at two lengths".into(),
        Remark::WithinMounting => "the difference is larger than between runs of one mounting, but remounting to within a millimetre can cause it. Recordings in different files count as remounted; if nothing was taken off the bench, add --same-mounting".into(),
        Remark::NothingTwice => "nothing in the reference was recorded twice: how far the actuator repeats is assumed, not measured".into(),
        Remark::OneMounting { stroke, log } => format!(
            "the mounting at {:.1} mm differs alone (Bayes factor e^{log:.0}): clamped again, or slipped?",
            stroke * 1e3
        ),
        Remark::Interpolated { stroke, error } => format!(
            "the reference has no recording at {:.1} mm: its force there is interpolated between its other lengths, with an error of {error:.1} N",
            1e3 * stroke
        ),
        Remark::StrokesAssumed => "how far campaigns of strokes repeat is assumed (zero and level to 0.2 % of the largest force, gain to 0.5 %, friction to 5 to 10 %), not measured".into(),
        Remark::CatalogueAssumed(share) => format!(
            "noise is measured on the reference; how far zero, gain, gauge and friction repeat beyond it is assumed: {:.2} % of the largest force",
            100.0 * share
        ),
        Remark::SlippedRests(rests) => format!(
            "{} at a held length hardly count, because friction slipped there in one of the campaigns, as the drift of a regulator causes it",
            pluralise(*rests, "rest")
        ),
        Remark::StrokesMarginal => "probabilities are those that a change is there at all; several changes can be present together".into(),
        Remark::NotAcquitted(none) => {
            format!("no change is named, but the probability that nothing changed is only {none:.2}")
        }
        Remark::GaugeOfMotion => "where length and pressure move together, a zero error of the pressure gauge is often mistaken for a gain, an offset of the stroke or a zero of the load cell: vent the actuator and read the gauge first".into(),
        Remark::GainOfStrokes => "at regulated pressures a gain of the load cell, a gain of the gauge and another piston area have the same shape".into(),
    }
}

/// Why a change is not named.
#[must_use]
pub fn why_not(why: WhyNot) -> &'static str {
    match why {
        WhyNot::NotComparable => "these recordings cannot show it",
        WhyNot::LessProbable => "possible, but another cause is more probable",
        WhyNot::HeldOutWorse => "the nearest shape, but it does not describe held-out recordings",
        WhyNot::OtherShape => "the difference does not have its shape, or is too small",
    }
}

/// What to do about a change.
#[must_use]
pub fn remedy(change: Change) -> &'static str {
    match change.about().changed.inspect {
        Inspect::LoadCellZero => "re-zero the load cell with nothing pulling on it",
        Inspect::LoadCellScale => "check the load cell's calibration with a known weight",
        Inspect::GaugeScale => "compare the pressure gauge with another one at a high pressure",
        Inspect::GaugeZero => {
            "vent and read the gauge; if it reads zero, the actuator's deadband has changed"
        }
        Inspect::PressureOnLoadCell => "look for a hose or fitting whose pressure acts on the load cell",
        Inspect::MountedLength => "measure the mounted length, re-zero the stroke and clamp again",
        Inspect::Guides => "look at guides, alignment and lubrication",
        Inspect::SealOrBraid => "look at the seal, or at wear and lubrication of the braid",
        Inspect::Braid => "the braid rubs differently: look at wear and lubrication, then refit the table",
        Inspect::Bladder => "the bladder has become stiffer or softer: refit the table",
        Inspect::LoadCellWarmUp => "let the load cell warm up, and tare at both ends of a campaign",
        Inspect::Frame => "tighten bolts and clamps, and stiffen the frame",
        Inspect::EndFittings => "look at the end fittings, clamp again and measure the length",
        Inspect::ForceChannel => "look at the filter settings and the sampling of the force channel",
        Inspect::PressureLine => {
            "look for a long or throttled line to the pressure sensor, and at its filter"
        }
        Inspect::Leaks => {
            "close the valve for a minute and watch the pressure; look for leaks at fittings, valve and bladder"
        }
        Inspect::LoadPath => "look at the load path between muscle and load cell",
        Inspect::Hoses => "look at hoses, valves and filters, then refit the table",
        Inspect::Rest => "let the muscle rest, repeat the first recording, then refit the table",
        Inspect::Muscle => "look at the muscle and its end fittings, then refit the table",
    }
}

/// Where what no name explains lies.
#[must_use]
pub fn pattern(left: &Left) -> String {
    left.place.as_ref().map_or_else(|| "none".to_owned(), place)
}

/// A part of the data in which the difference lies.
#[must_use]
pub fn place(p: &Place) -> String {
    let range = if p.from == p.to {
        // Four decimals are for contractions; a pressure is a whole number of kilopascals.
        let decimals = if p.unit.is_empty() { 4 } else { 0 };
        format!("{:.decimals$} {}", p.from, p.unit)
    } else {
        format!("{:.0} to {:.0} {}", p.from, p.to, p.unit)
    };
    let what = match (p.coordinate.as_str(), p.from) {
        ("direction", d) if d > 0.0 => "filling or shortening".to_owned(),
        ("direction", _) => "emptying or lengthening".to_owned(),
        ("recording", n) => format!("recording {n:.0} of AFTER"),
        (name, _) => format!("{name} {}", range.trim_end()),
    };
    format!("{:.0} % of the difference lies at {what} ({:.0} % of the data)", 100.0 * p.share, 100.0 * p.rows)
}

/// A share that is not zero.
fn percent(share: f64) -> String {
    if share < 0.01 { "under 1 %".into() } else { format!("{:.0} %", 100.0 * share) }
}

/// What could not be compared.
#[must_use]
pub(crate) fn not_comparable(n: &NotComparable) -> String {
    match n {
        NotComparable::Stroke { recording, stroke } => {
            format!("`{recording}`: the reference has no recording at a stroke of {:.1} mm", stroke * 1e3)
        }
        NotComparable::Pressure { recording, share } => {
            format!("`{recording}`: {:.0} % of the rows at pressures that the reference does not have", 100.0 * share)
        }
        NotComparable::FewCells { stroke } => {
            format!("stroke {:.1} mm: too few pressures and directions in common", stroke * 1e3)
        }
        NotComparable::OneLength => {
            "displacement-offset, rig-compliance, end-slip: the reference has one length, the slope over the length is not known".into()
        }
        NotComparable::Level { pressure } => {
            format!("strokes at {:.0} kPa: on one side only, or fewer than two each way", pressure / 1e3)
        }
        NotComparable::Ramps { share } => format!(
            "{} of the rows are ramps of pressure at a held length: give them alone, on both sides, to compare them",
            percent(*share)
        ),
        NotComparable::States { share } => format!(
            "{} of the strokes' parts are at pressures, places or speeds that the reference does not have",
            percent(*share)
        ),
        NotComparable::Moving => {
            "sensor-delay, pressure-sensor-lag: not identifiable from recordings in which length and pressure move together".into()
        }
        NotComparable::Lengths { recording, share } => {
            format!("`{recording}`: {:.0} % of the rows at lengths that the reference does not have, or where its muscle does not pull", 100.0 * share)
        }
        NotComparable::Strokes => {
            "gauge-offset, displacement-offset, rig-compliance, end-slip, drift and lags: not identifiable from strokes at regulated pressures".into()
        }
    }
}

/// Whose a change is.
#[must_use]
pub(crate) fn owner(owner: Owner) -> &'static str {
    match owner {
        Owner::Sensor => "a sensor's",
        Owner::Rig => "the rig's",
        Owner::Muscle => "the actuator's",
        Owner::SensorOrMuscle => "a sensor's or the actuator's",
        Owner::RigOrMuscle => "the rig's or the actuator's",
    }
}

/// A moment with its uncertainty.
fn began(m: &Moment) -> String {
    format!(
        "from `{}` on ({:.0} s after the beginning; 95 %: {:.0} to {:.0} s)",
        m.recording, m.moment, m.low, m.high
    )
}

/// Since when a change is there.
#[must_use]
pub(crate) fn since(since: &Since) -> String {
    match since {
        Since::Beginning => "from the first recording on".into(),
        Since::From(m) => format!("suddenly, {}", began(m)),
        Since::Gradual(m) if m.high <= 0.0 => "gradually, from the first recording on".into(),
        Since::Gradual(m) => format!("gradually, {}", began(m)),
        Since::NotDetermined => "not determined".into(),
    }
}

/// A value with as many digits as its standard deviation supports.
fn rounded(value: f64, std: f64) -> String {
    if value.abs() >= LARGE || std >= LARGE {
        return format!("{value:.1e}");
    }
    let digits =
        if std > 0.0 && std.is_finite() { (1.0 - std.log10().floor()).clamp(0.0, 9.0) as usize } else { 3 };
    format!("{value:.digits$}")
}

/// From here on a number is written with its power of ten.
const LARGE: f64 = 1e6;

/// Factor and name of the unit that people use instead of an SI unit. A number without a unit is a share of something.
fn usual_unit(value: f64, unit: &str) -> (f64, String) {
    let (factor, name) = match unit {
        "Pa" => (1e-3, "kPa"),
        "m" => (1e3, "mm"),
        "s" if value.abs() < 1.0 => (1e3, "ms"),
        "m²" => (1e5, "N per 100 kPa"),
        "m/N" => (1e6, "µm/N"),
        "1/s" => (100.0, "kPa/s per 100 kPa"),
        "" => (100.0, "%"),
        other => (1.0, other),
    };
    (factor, format!(" {name}"))
}

/// Numbers without a unit that are not shares.
const COUNTS: [&str; 4] = ["exponent", "order", "onset", "width"];

/// A size with its interval in a unit that people use.
#[must_use]
pub fn size(s: &Size) -> String {
    let (scale, unit) =
        if COUNTS.contains(&s.name.as_str()) { (1.0, String::new()) } else { usual_unit(s.value, &s.unit) };
    let half = scale * (s.high - s.low) / 2.0;
    format!("{} ± {}{unit}", rounded(scale * s.value, half), rounded(half, half))
}

/// All sizes of a change, with their names where there are several.
#[must_use]
pub(crate) fn sizes(all: &[Size]) -> String {
    let named = |s: &Size| format!("{} {}", s.name.replace('_', " "), size(s));
    match all {
        [only] => size(only),
        several => several.iter().map(named).collect::<Vec<_>>().join(", "),
    }
}

/// A size in a unit that people use, without an interval.
#[must_use]
pub(crate) fn in_usual_unit(value: f64, unit: &str) -> String {
    let (scale, unit) = usual_unit(value, unit);
    format!("{}{unit}", rounded(scale * value, scale * value.abs()))
}

fn one(text: &mut String, m: &Changed) {
    let _ = writeln!(
        text,
        "\n{} (probability {:.2}; its class of effects {:.2})",
        m.effect, m.probability, m.class_probability
    );
    for s in &m.parameters {
        let _ = writeln!(text, "  size         {} {} (95 %)", s.name, size(s));
    }
    let _ = writeln!(text, "  law          {}", m.change.about().changed.law);
    let _ = writeln!(text, "  since        {}", since(&m.since));
    let _ = writeln!(text, "  belongs to   {}", owner(m.owner).replace("'s", ""));
    let _ = writeln!(text, "  what to do   {}", remedy(m.change));
    if !m.confusable_with.is_empty() {
        let _ = writeln!(text, "  alternatives {}", m.confusable_with.join(", "));
    }
    let apart = separate::of_change(m);
    if !apart.is_empty() {
        let _ = writeln!(text, "  distinguish by {}", apart.join("; "));
    }
}

/// The answer for a terminal.
#[must_use]
pub fn summary(r: &ChangeReport) -> String {
    let mut text = headline(r);
    text.push('\n');
    let _ = writeln!(
        text,
        "Difference {:.2} N rms ({:.2} % of the largest force); untouched recordings differ by {:.2} N ({}).",
        r.misfit_rms_N,
        100.0 * r.misfit_rms_N / r.largest_force_N.max(f64::MIN_POSITIVE),
        r.noise_N,
        match r.reference.repeatability_from {
            Repeatability::Measured => "from repeats and what is usual",
            Repeatability::Assumed => "assumed",
        }
    );
    for m in &r.missing {
        one(&mut text, m);
    }
    if let Some((names, apart)) = separate::of_unnamed(r) {
        let _ = writeln!(text, "one of: {}; separate them by: {}", names.join(", "), apart.join("; "));
    }
    if r.shows_in_force() {
        let h = &r.held_out;
        let share = if h.rms_before_N > 0.0 { 1.0 - (h.rms_after_N / h.rms_before_N).powi(2) } else { 0.0 };
        let _ = writeln!(
            text,
            "\nOn held-out recordings ({}): {:.2} N without the named changes, {:.2} N with them; they explain {:.0} % of the squared difference.",
            split(h.split),
            h.rms_before_N,
            h.rms_after_N,
            100.0 * share
        );
    }
    if r.verdict != Verdict::Consistent {
        for p in r.r#where.iter().take(3) {
            let _ = writeln!(text, "where: {}", place(p));
        }
    }
    let shown: Vec<String> = r
        .probabilities
        .iter()
        .filter(|p| p.probability >= 0.01)
        .take(6)
        .map(|p| format!("{} {:.2}", p.cause, p.probability))
        .collect();
    let _ = writeln!(text, "\nprobabilities: {}", shown.join(", "));
    if r.verdict == Verdict::Consistent || r.reference.table.is_some() {
        let seen: Vec<String> = r
            .considered
            .iter()
            .filter_map(|c| Some(format!("{} {}", c.effect, in_usual_unit(c.detectable?, &c.unit))))
            .collect();
        let _ = writeln!(text, "would have been seen (90 %): {}", seen.join(", "));
    }
    for n in &r.reference.not_comparable {
        let _ = writeln!(text, "not comparable: {}", not_comparable(n));
    }
    for one in &r.remarks {
        let _ = writeln!(text, "note: {}", remark(one));
    }
    text
}
