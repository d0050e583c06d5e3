//! The findings of a history as text, and why no memory is named.

use pam_diagnose::history::answer::{
    Estimate, Finding, FindingDetail, GapBesideMemory, LayerName, MemoryRefusal, StaticCurve,
};

/// A finding as text without its full stop.
#[must_use]
pub(crate) fn finding(of: &Finding) -> String {
    match &of.detail {
        FindingDetail::FirstRun { left } => first_run(of, *left),
        FindingDetail::Creep { decades, plateau } => creep(of, *decades, plateau.as_ref()),
        FindingDetail::Gap(beside) => gap(of, beside.as_ref()),
        FindingDetail::Shift { lasts, shortened_mm } => shift(of, *lasts, *shortened_mm),
        FindingDetail::LoadedBefore => format!(
            "the muscle had been loaded for about {:.0} s before the first recorded run: a smaller first-run deficit is to be expected (chosen on a \
             grid, uncertain)",
            of.size.value
        ),
        FindingDetail::SlackReading { grows } => slack_reading(of, *grows),
    }
}

/// A rule of a named memory that does not hold.
#[must_use]
pub(crate) fn memory_refusal(of: &MemoryRefusal) -> String {
    match of {
        MemoryRefusal::SmallShare { share, least } => {
            format!("the relaxed share is {share:.3}; at least {least} is required")
        }
        MemoryRefusal::UncertainShare { share, half } => {
            format!("the 95 % interval of the relaxed share includes zero ({share:.3} ± {half:.3}, by runs)")
        }
        MemoryRefusal::SmallGain { against, gain, least } => format!(
            "against {} the squared error of unseen runs falls by {:.0} %; at least {:.0} % is required",
            match against {
                StaticCurve::ByMounting => "a curve for each mounting",
                StaticCurve::ByMountingAndDirection => "a curve for each mounting and direction",
            },
            100.0 * gain,
            100.0 * least
        ),
    }
}

/// The name of a layer.
#[must_use]
pub(crate) fn layer(of: LayerName) -> &'static str {
    match of {
        LayerName::Memory => "memory",
        LayerName::Slips => "slips",
        LayerName::NotExplained => "not explained",
    }
}

/// A force with its interval.
fn newtons(of: &Estimate) -> String {
    of.half().map_or_else(
        || format!("{:.1} N (one unit: no interval)", of.value),
        |half| format!("{:.1} ± {half:.1} N", of.value),
    )
}

/// Why a finding does not hold; an estimate of one unit has no interval.
fn includes_zero(of: &Finding) -> String {
    of.size.half().map_or_else(String::new, |_| "; its interval includes zero".to_owned())
}

fn first_run(of: &Finding, left: Option<f64>) -> String {
    let rest = match (of.found, left) {
        (true, Some(left)) => format!(
            "; the memory of the bladder, which does not recover in the pauses, explains all but {:.1} N of it",
            -left
        ),
        (true, None) => String::new(),
        (false, _) => includes_zero(of),
    };
    format!(
        "the first filling of a mounting pulls {} less than the second ({} shortened mountings){rest}",
        newtons(&of.size),
        of.units
    )
}

fn creep(of: &Finding, decades: usize, plateau: Option<&Estimate>) -> String {
    let plateau = plateau.map_or_else(String::new, |p| {
        format!("; at the top pressure the force of shortened mountings creeps by {} per decade", newtons(p))
    });
    let a_decade = |share: f64| 100.0 * share / decades as f64;
    format!(
        "the part of the pressure that the bladder carries relaxes by {:.1} ± {:.1} % per decade of time, over {decades} decades, and the next run \
         starts from this state{plateau}",
        a_decade(of.size.value),
        a_decade(of.size.half().unwrap_or(f64::INFINITY))
    )
}

fn gap(of: &Finding, beside: Option<&GapBesideMemory>) -> String {
    let rest = match (of.found, beside) {
        (false, _) => includes_zero(of),
        (true, None) => String::new(),
        (true, Some(known)) => beside_memory(known),
    };
    format!(
        "emptying pulls {} more than filling when shortened, compared with full length ({} {}s){rest}",
        newtons(&of.size),
        of.units,
        of.size.unit_of_uncertainty
    )
}

fn beside_memory(of: &GapBesideMemory) -> String {
    let left =
        of.left.as_ref().map_or_else(String::new, |left| format!("; the memory leaves {}", newtons(left)));
    let beside = of.beside.as_ref().map_or_else(
        || {
            "; dry friction beside it does not lower the error of unseen runs by enough to be named"
                .to_owned()
        },
        |n| {
            format!(
                "; beside it {} of up to {} lowers the error of unseen runs from {:.2} to {:.2} N (rms)",
                n.effect.info().name,
                newtons(&n.peak),
                n.without_N,
                n.with_N
            )
        },
    );
    let instead = of.instead.as_ref().map_or_else(String::new, |friction| {
        let errors =
            format!("{:.2} % against {:.2} % of the largest force", friction.friction_pct, friction.memory_pct);
        if friction.excluded {
            format!("; dry friction in place of the memory within a run is excluded: it predicts unseen runs worse ({errors})")
        } else {
            format!("; dry friction in place of the memory within a run is not excluded ({errors})")
        }
    });
    left + &beside + &instead
}

fn shift(of: &Finding, lasts: bool, shortened_mm: f64) -> String {
    format!(
        "mounting {} (shortened by {shortened_mm:.1} mm), run {}: {} shift of {:+.1} ± {:.1} kPa against the other runs; {}",
        of.mounting.unwrap_or_default(),
        of.run.unwrap_or_default(),
        if lasts { "from this run on a" } else { "a" },
        of.size.value,
        of.size.half().unwrap_or(f64::INFINITY),
        match (lasts, of.found) {
            (true, true) => "the held length changed",
            (true, false) => "the held length may have changed; a finding requires four standard errors",
            (false, _) => "check this run before you use it",
        }
    )
}

fn slack_reading(of: &Finding, grows: Option<f64>) -> String {
    let mountings = of.units;
    if let Some(force) = grows {
        return format!(
            "while the muscle is slack, the reading of the load cell grows with the pressure, by at least {force:.1} N up to the highest pressure \
             ({mountings} mountings). This is more than a lifting tube makes: the load cell reads the pressure"
        );
    }
    let cause = match (of.found, of.size.value > 0.0) {
        (false, _) => ": too small, or too uncertain, for a finding",
        (true, true) => ": the zero of the cell is off, or a weight hangs on it",
        (true, false) => ": the zero of the cell is off, or the slack tube pushes",
    };
    format!(
        "while the muscle is slack, the load cell reads {} ({mountings} mountings){cause}",
        newtons(&of.size)
    )
}
