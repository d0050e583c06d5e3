//! `trials reference-further`: two simultaneous changes, and changes that begin within the later runs, on real recordings.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use pam_data::statistics::quantile;

use super::injection::Slopes;
use super::staircases::{self, Half, Muscle};
use super::time_course::{self, TimeCourse};
use super::together;
use crate::rate::Rate;

/// Two changes, and since when.
#[derive(Args)]
pub struct Further {
    /// Directory that holds aarl-festo-10mm-2021 and -2022.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// Where to.
    #[arg(short, long)]
    output: PathBuf,
    /// Write the tables as this page of the book, too.
    #[arg(long)]
    page: Option<PathBuf>,
    /// Only one half of the muscles: development or final.
    #[arg(long, value_parser = ["development", "final"])]
    half: Option<String>,
}

/// How far these trials are a test.
const DEVELOPED: &str = "\nThese are not an independent test: the courses, the pairs and the lags beside other changes were developed on six of the muscles. \
         Two constants were chosen by results of all of them: `named_shape_error` (0.1 instead of 0.05) and the longest lag that is tried.\n";

fn rate<T>(of: &[&T], right: impl Fn(&T) -> bool) -> Rate {
    Rate::new(of.iter().filter(|o| right(o)).count(), of.len())
}

fn two(t: &mut String, trials: &[together::Trial]) {
    let _ = writeln!(
        t,
        "\n## Two simultaneous changes\n\nIn each muscle, the later half of the runs gets two changes, each of the given size: every pair of the twelve. \
         \"In the set\": named, or among the causes that a name may be mistaken for. Rates with exact 95 % intervals.\n\n\
         | pairs | n | both exact | both classes | one class or more | both in the set | a name of a false class |\n\
         | --- | --- | --- | --- | --- | --- | --- |"
    );
    type Kind = (&'static str, fn(&together::Trial) -> bool);
    let kinds: [Kind; 3] = [
        ("of two classes", |p| !p.alike && !p.lag),
        ("of one class", |p| p.alike && !p.lag),
        ("one of them a lag between channels", |p| p.lag),
    ];
    for percent in together::SIZES {
        for (name, is) in kinds {
            let own: Vec<&together::Trial> =
                trials.iter().filter(|p| p.percent == percent && is(p)).collect();
            let _ = writeln!(
                t,
                "| {percent} %, {name} | {} | {} | {} | {} | {} | {} |",
                own.len(),
                rate(&own, |p| p.exact() == 2),
                rate(&own, |p| p.classes() == 2),
                rate(&own, |p| p.classes() > 0),
                rate(&own, |p| p.in_set() == 2),
                rate(&own, together::Trial::is_false)
            );
        }
    }
    let _ = writeln!(
        t,
        "\nBeside a lag, the rows in motion are scored without what is named already, and the settled rows are tested with the lag taken out at any \
         size. Of two lags one is named. Two changes of opposite sign may nearly cancel: then nothing is named, and the set holds \"none\".\n\n\
         ### Pairs of two classes that were not both named, 3 %\n\n| pair | n | both exact | both in the set |\n| --- | --- | --- | --- |"
    );
    let mut by: BTreeMap<[&str; 2], Vec<&together::Trial>> = BTreeMap::new();
    for p in trials.iter().filter(|p| p.percent == 3.0 && !p.alike && !p.lag) {
        by.entry(p.effects).or_default().push(p);
    }
    for (pair, own) in by {
        let exact = own.iter().filter(|p| p.exact() == 2).count();
        if exact < own.len() {
            let set = own.iter().filter(|p| p.in_set() == 2).count();
            let _ = writeln!(t, "| {} | {} | {exact} | {set} |", pair.join(", "), own.len());
        }
    }
}

fn when(t: &mut String, trials: &[time_course::Trial]) {
    let _ = writeln!(
        t,
        "\n## Since when\n\nIn each muscle, one of eight changes begins within the later half of the runs, at a moment drawn by hash from the middle \
         half of their time: suddenly, or growing to the end. \"Size\": once the change is there in full. \"Class right\": a zero that grows may be called a \
         drift, an offset of the stroke that comes an end slip. \"Error\": of the moment found, as a share of the time of AFTER.\n\n\
         | change | n | class right | course right | course wrong | right recording | error, median | error, 90 % | moment in the stated 95 % |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    );
    for time_course in [TimeCourse::Whole, TimeCourse::Step, TimeCourse::Ramp] {
        for percent in time_course::SIZES {
            let own: Vec<&time_course::Trial> =
                trials.iter().filter(|c| c.time_course == time_course && c.percent == percent).collect();
            let (name, right) = match time_course {
                TimeCourse::Whole => ("from the beginning", "beginning"),
                TimeCourse::Step => ("suddenly", "suddenly"),
                TimeCourse::Ramp => ("gradually", "gradually"),
            };
            let named: Vec<&time_course::Trial> = own.iter().copied().filter(|c| c.right).collect();
            let answer: Vec<&time_course::Trial> =
                named.iter().copied().filter(|c| c.answer == right).collect();
            let error = |c: &&time_course::Trial| c.found.map(|f| (f[0] - c.start).abs());
            let mut errors: Vec<f64> = answer.iter().filter_map(error).collect();
            let inside = rate(&answer, |c| c.found.is_some_and(|f| f[1] <= c.start && c.start <= f[2]));
            let wrong = rate(&named, |c| c.answer != right && c.answer != "not determined");
            let (recording, inside) = match time_course {
                TimeCourse::Whole => ("–".into(), "–".into()),
                _ => (rate(&answer, |c| c.recording).to_string(), inside.to_string()),
            };
            let mut error = |share: f64| match errors.as_mut_slice() {
                [] => "–".to_owned(),
                errors => format!("{:.1} %", 100.0 * quantile(errors, share)),
            };
            let _ = writeln!(
                t,
                "| {name}, {percent} % | {} | {} | {} | {wrong} | {recording} | {} | {} | {inside} |",
                own.len(),
                rate(&own, |c| c.right),
                rate(&named, |c| c.answer == right),
                error(0.5),
                error(0.9)
            );
        }
    }
    let runs = trials.iter().map(|c| c.runs).max().unwrap_or(0);
    let fewest = trials.iter().map(|c| c.runs).min().unwrap_or(0);
    let _ = writeln!(
        t,
        "\nAFTER has {fewest} to {runs} recordings, so that one of them is {:.0} to {:.0} % of its time. Course, recording and errors are of the trials whose \
         class is right. Changes that began in the first or last quarter are not tested.",
        100.0 / runs.max(1) as f64,
        100.0 / fewest.max(1) as f64
    );
}

/// Runs all trials and writes `further.json`, `further.md` and, on request, the page.
///
/// # Errors
/// Files that cannot be read or written, a trial without an answer.
pub fn run(what: &Further) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(&what.output)?;
    let muscles = staircases::read(&what.data)?;
    let own = |m: &&Muscle| match what.half.as_deref() {
        Some("development") => m.half == Half::Development,
        Some("final") => m.half == Half::Final,
        _ => true,
    };
    let slopes: Vec<(&Muscle, Slopes)> =
        muscles.iter().filter(own).map(|m| (m, Slopes::of(&m.between(1, m.runs)))).collect();
    let jobs: Vec<(&Muscle, &Slopes)> = slopes.iter().map(|(m, s)| (*m, s)).collect();
    let pairs = together::run(&jobs)?;
    let time_courses = time_course::run(&jobs)?;
    let half = what.half.as_deref().map_or_else(String::new, |h| format!(" --half {h}"));
    let mut text = format!(
        "# Two changes, and since when\n\n`host diagnose AFTER… --reference BEFORE…` is tested on real recordings of {} fluidic muscles (pressure staircases \
         at held lengths): two simultaneous changes, and changes that begin within the later recordings. Changes are added as in the [trials of \
         changes](proof-reference.md), by slopes that the recordings give. Nothing on this page is typed by hand:\n\n\
         ```text\ncargo run --release -p trials -- reference-further{half} -o DIR --page docs/src/proof-reference-further.md\n```\n",
        jobs.len()
    );
    text += DEVELOPED;
    two(&mut text, &pairs);
    when(&mut text, &time_courses);
    std::fs::write(
        what.output.join("further.json"),
        serde_json::to_string_pretty(&(&pairs, &time_courses))?,
    )?;
    std::fs::write(what.output.join("further.md"), &text)?;
    print!("{text}");
    if let Some(page) = &what.page {
        std::fs::write(page, &text)?;
    }
    Ok(())
}
