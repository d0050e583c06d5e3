//! One table of topics that have messages at different times.
//!
//! The rows are the messages of one topic, that of the pressure. Other topics are interpolated linearly between the messages before and
//! after a row; integers and switches, which move in steps, hold their last value. Beyond the first and the last message of a topic, and
//! where it paused, there is no value.

use super::topics::Topic;
use super::values::Field;
use crate::bounds::Budget;
use crate::error::{DataCode, Error, Result};
use crate::recording::column_table::{Column, ColumnTable};
use crate::recording::import_guess::is_reading_of;
use crate::recording::quantity::Quantity;
use crate::statistics::integer_median;

/// A topic pauses where no message comes for this many of its usual intervals: single lost messages are none, a driver that was
/// restarted is one.
const PAUSE: u64 = 10;

/// The column of the time.
const TIME: &str = "time_s";

/// What is known of the columns that are needed.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::recording) struct Needed<'a> {
    /// As `topic.field`; what looks like a reading of a muscle where it is not known.
    pub columns: Option<&'a [String]>,
    /// That of the pressure.
    pub pressure: Option<&'a str>,
}

/// A topic with its messages in the order of time.
struct Series<'a> {
    topic: &'a Topic,
    /// The number of each message, and its time.
    order: Vec<(u64, usize)>,
}

impl<'a> Series<'a> {
    fn new(topic: &'a Topic, by_stamp: bool) -> Self {
        let times = if by_stamp { &topic.stamped } else { &topic.logged };
        let mut order: Vec<(u64, usize)> = times.iter().enumerate().map(|(n, t)| (*t, n)).collect();
        order.sort_unstable();
        Self { topic, order }
    }

    fn span(&self) -> Option<(u64, u64)> {
        Some((self.order.first()?.0, self.order.last()?.0))
    }

    /// The usual interval between its messages, ns.
    fn interval(&self) -> u64 {
        let mut steps: Vec<u64> = self.order.windows(2).map(|w| w[1].0 - w[0].0).collect();
        integer_median(&mut steps)
    }

    /// A field at these times, which increase.
    fn at(&self, field: &Field, times: &[u64]) -> Vec<f64> {
        let longest = self.interval().saturating_mul(PAUSE);
        let mut after = 0;
        let value = |t: &u64| {
            while self.order.get(after).is_some_and(|(time, _)| time <= t) {
                after += 1;
            }
            let Some((from, before)) = after.checked_sub(1).map(|i| self.order[i]) else { return f64::NAN };
            let value = field.at(before);
            if from == *t || field.steps {
                return value;
            }
            match self.order.get(after) {
                Some((to, next)) if to - from <= longest => {
                    value + (field.at(*next) - value) * ((t - from) as f64 / (to - from) as f64)
                }
                _ => f64::NAN,
            }
        };
        times.iter().map(value).collect()
    }
}

/// The table, and what the user has to know of it.
pub(super) fn join(
    topics: &[Topic],
    needed: Needed<'_>,
    budget: &mut Budget,
) -> Result<(ColumnTable, Vec<String>)> {
    let read: Vec<&Topic> =
        topics.iter().filter(|t| t.values.rows > 0 && !t.values.fields.is_empty()).collect();
    let used: Vec<&Topic> = read.iter().copied().filter(|t| is_needed(t, needed)).collect();
    let used = if used.is_empty() { read.clone() } else { used };
    let Some(clock) = clock(&used, needed) else { return Err(nothing(topics)) };
    let by_stamp = used.iter().all(|t| t.has_stamps());
    let series: Vec<Series<'_>> =
        read.iter().filter(|t| !by_stamp || t.has_stamps()).map(|t| Series::new(t, by_stamp)).collect();
    let is_used = |s: &&Series<'_>| used.iter().any(|u| std::ptr::eq(*u, s.topic));
    let moving = |s: &&Series<'_>| s.topic.values.fields.iter().any(|f| !f.steps);
    let spans = || series.iter().filter(is_used).filter(moving).filter_map(Series::span);
    let begin = spans().map(|(first, _)| first).max().unwrap_or(0);
    let end = spans().map(|(_, last)| last).min().unwrap_or(u64::MAX);
    let own = series.iter().find(|s| std::ptr::eq(s.topic, clock));
    let times: Vec<u64> = own
        .into_iter()
        .flat_map(|s| &s.order)
        .map(|(t, _)| *t)
        .filter(|t| (begin..=end).contains(t))
        .collect();
    if times.is_empty() {
        return Err(no_common_time(&used));
    }
    let columns: usize = series.iter().map(|s| s.topic.values.fields.len()).sum();
    budget.take((columns + 2).saturating_mul(times.len()))?;
    let seconds = times.iter().map(|t| *t as f64 / 1e9).collect();
    let mut table: ColumnTable = vec![(TIME.to_owned(), Column::Numbers(seconds))];
    for series in &series {
        for field in &series.topic.values.fields {
            let values = series.at(field, &times);
            table.push((format!("{}.{}", series.topic.name, field.path), Column::Numbers(values)));
        }
    }
    for topic in topics {
        let reason = topic.reason.clone().or_else(|| {
            let left = by_stamp && topic.values.rows > 0 && !topic.has_stamps();
            left.then(|| "messages without a stamp in the header".to_owned())
        });
        table.extend(reason.map(|reason| (topic.name.clone(), Column::Other(reason))));
    }
    Ok((table, notes(clock, &series, &used, by_stamp)))
}

fn is_needed(topic: &Topic, needed: Needed<'_>) -> bool {
    let name = |f: &Field| format!("{}.{}", topic.name, f.path);
    topic.values.fields.iter().any(|f| match needed.columns {
        Some(columns) => columns.contains(&name(f)),
        None => MEASURED.iter().any(|q| is_reading_of(&name(f), *q)),
    })
}

/// Readings that a recording needs or takes.
const MEASURED: [Quantity; 6] = [
    Quantity::Pressure,
    Quantity::Displacement,
    Quantity::Length,
    Quantity::Contraction,
    Quantity::Force,
    Quantity::Temperature,
];

/// The topic that gives the rows: that of the pressure, else the one with the most messages.
fn clock<'a>(used: &[&'a Topic], needed: Needed<'_>) -> Option<&'a Topic> {
    let has_pressure = |t: &&&Topic| {
        t.values.fields.iter().any(|f| {
            let name = format!("{}.{}", t.name, f.path);
            match needed.pressure {
                Some(pressure) => pressure == name,
                None => is_reading_of(&name, Quantity::Pressure),
            }
        })
    };
    let found = used.iter().find(has_pressure).or_else(|| used.iter().max_by_key(|t| t.values.rows));
    found.copied()
}

fn nothing(topics: &[Topic]) -> Error {
    let mut cause = "no topic has messages with numbers that are read".to_owned();
    let reasons = topics.iter().filter_map(|t| t.reason.as_ref().map(|r| format!("`{}` has {r}", t.name)));
    for reason in reasons.take(5) {
        cause += "; ";
        cause += &reason;
    }
    Error::new(DataCode::RecordingEmpty, cause)
        .help("record topics with messages of ROS 1, ROS 2 (ros2msg) or JSON, or export them as CSV")
}

fn no_common_time(used: &[&Topic]) -> Error {
    let names: Vec<String> = used.iter().map(|t| format!("`{}`", t.name)).collect();
    Error::new(DataCode::RecordingEmpty, format!("the topics {} have no time in common", names.join(", ")))
        .help("record them at the same time, with clocks that agree")
}

fn notes(clock: &Topic, series: &[Series<'_>], used: &[&Topic], by_stamp: bool) -> Vec<String> {
    let time =
        if by_stamp { "the stamp in the header of each message" } else { "the log time of each message" };
    let mut notes =
        vec![format!("{TIME} is {time}, in seconds since 1970; a row is a message of {}", clock.name)];
    let others: Vec<String> = series
        .iter()
        .filter(|s| !std::ptr::eq(s.topic, clock) && used.iter().any(|u| std::ptr::eq(*u, s.topic)))
        .map(|s| match s.interval() {
            0 => s.topic.name.clone(),
            interval => format!("{} ({:.4} messages per second)", s.topic.name, 1e9 / interval as f64),
        })
        .collect();
    if !others.is_empty() {
        notes.push(format!(
            "interpolated linearly to these rows (integers and switches hold their last value): {}",
            others.join(", ")
        ));
    }
    notes
}
