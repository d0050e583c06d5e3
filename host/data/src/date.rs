//! Calendar dates of results and of recordings.

use std::path::Path;
use std::time::UNIX_EPOCH;

/// The present time as ISO 8601 in UTC; `SOURCE_DATE_EPOCH` replaces the clock where it is set, so that builds can be
/// repeated to the byte.
#[must_use]
pub fn now_utc() -> String {
    let fixed = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|s| s.parse::<u64>().ok());
    let clock =
        || std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    iso_8601(fixed.unwrap_or_else(clock))
}

/// Where the date of a recording is from, the surest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DateSource {
    /// The name of the file or of its folder.
    Name,
    /// A column or a remark of the file.
    Column,
    /// The file's time of modification, which a copy may have changed.
    Modified,
}

/// When a recording was made, s since 1970, and how that is known. A date without a time of day counts from its midnight.
///
/// `first` is the first time of the recording, s: a clock that counts from 1970 is a date.
#[must_use]
pub fn of_recording(path: &Path, first: Option<f64>) -> Option<(f64, DateSource)> {
    let dated = |name: Option<&std::ffi::OsStr>| name.and_then(|n| in_text(&n.to_string_lossy()));
    if let Some(date) = dated(path.file_stem()).or_else(|| dated(path.parent()?.file_name())) {
        return Some((date, DateSource::Name));
    }
    let clock = first.filter(|t| *t > YEAR_2000 && *t < YEAR_2100);
    if let Some(date) = clock.or_else(|| in_header(path)) {
        return Some((date, DateSource::Column));
    }
    let modified = std::fs::metadata(path).and_then(|m| m.modified()).ok()?;
    Some((modified.duration_since(UNIX_EPOCH).ok()?.as_secs_f64(), DateSource::Modified))
}

/// s since 1970 of the year 2000: dates before it are none.
const YEAR_2000: f64 = 946_684_800.0;
/// s since 1970 of the year 2100.
const YEAR_2100: f64 = 4_102_444_800.0;
/// Bytes of a text file in which a date is looked for.
const HEADER_BYTES: usize = 4096;
/// Names of columns that hold a date as text.
const DATE_COLUMNS: [&str; 6] = ["date", "datetime", "date_time", "timestamp", "recorded", "started"];

/// The first date in a text: `2026-01-05`, `20260105`, `2026_01_05`, also with a time of day behind it (`T14:30`, `_143000`). The order
/// is year, month, day: others are ambiguous.
///
/// ```
/// use pam_data::date::in_text;
/// assert_eq!(in_text("loops_2026-11-21"), Some(1_795_219_200.0));
/// assert_eq!(in_text("run20261121T013000Z"), Some(1_795_219_200.0 + 5400.0));
/// assert_eq!(in_text("pressure_20261399"), None);
/// ```
#[must_use]
pub fn in_text(text: &str) -> Option<f64> {
    let bytes = text.as_bytes();
    (0..bytes.len()).find_map(|start| {
        let alone = start == 0 || !bytes[start - 1].is_ascii_digit();
        if alone { date_at(&bytes[start..]) } else { None }
    })
}

/// A time stamp, s: of a date with a time of day since 1970, of a time of day alone since midnight. Dates are those of ISO 8601
/// (`2026-11-21T13:30:00.25Z`, also with a blank, and with an offset such as `+01:00`), `21.11.2026`, or `21-Nov-2026`; a month before the
/// day is ambiguous. Milliseconds may follow a colon. `None` for any other text.
///
/// ```
/// use pam_data::date::time_stamp;
/// assert_eq!(time_stamp("2026-11-21 01:30:00.25"), Some(1_795_219_200.0 + 5400.25));
/// assert_eq!(time_stamp("2026-11-21T01:30:00+01:00"), Some(1_795_219_200.0 + 1800.0));
/// assert_eq!(time_stamp("21.11.2026 01:30:00,5"), Some(1_795_219_200.0 + 5400.5));
/// assert_eq!(time_stamp("13:30:00.5"), Some(48_600.5));
/// assert_eq!(time_stamp("1:30:00.5 PM"), Some(48_600.5));
/// assert_eq!(time_stamp("11/21/2026 13:30"), None);
/// ```
#[must_use]
pub fn time_stamp(text: &str) -> Option<f64> {
    time_stamp_in(text, DateOrder::YearFirst)
}

/// How dates with slashes are read that do not begin with the year.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::enum_variant_names, reason = "each names the part that stands first")]
pub(crate) enum DateOrder {
    /// They are not.
    #[default]
    YearFirst,
    /// `11/21/2026`, also `11/21/26`.
    MonthFirst,
    /// `21/11/2026`, also `21/11/26`.
    DayFirst,
}

/// As [`time_stamp`], also of dates with slashes in this order.
#[must_use]
pub(crate) fn time_stamp_in(text: &str, order: DateOrder) -> Option<f64> {
    let text = text.trim().as_bytes();
    let Some((date, rest)) = calendar_date(text, order) else {
        // `05:30` alone may be minutes and seconds.
        let whole = text.iter().filter(|b| **b == b':').count() >= 2;
        return time_with_parts(text)
            .filter(|(_, rest)| whole && rest.is_empty())
            .map(|(seconds, _)| seconds);
    };
    let (b' ' | b'T' | b't', rest) = rest.split_first()? else { return None };
    let (seconds, rest) = time_with_parts(rest.trim_ascii_start())?;
    let offset = offset_of_zone(rest.trim_ascii())?;
    Some(date? + seconds - offset)
}

/// A date alone, s since 1970 at its midnight, in the forms that [`time_stamp_in`] reads before a time of day. A spreadsheet writes the
/// midnight behind it.
#[must_use]
pub(crate) fn date_in(text: &str, order: DateOrder) -> Option<f64> {
    let (date, rest) = calendar_date(text.trim().as_bytes(), order)?;
    let midnight = match rest.split_first() {
        None => true,
        Some((b' ' | b'T', rest)) => {
            time_with_parts(rest).is_some_and(|(s, rest)| s == 0.0 && rest.is_empty())
        }
        Some(_) => false,
    };
    date.filter(|_| midnight)
}

/// A date at the beginning of a text, s since 1970 at its midnight, and what follows; no number where the calendar has no such day.
fn calendar_date(text: &[u8], order: DateOrder) -> Option<(Option<f64>, &[u8])> {
    let century = |(year, rest)| (2000 + year, rest);
    let iso = |text| {
        let (year, rest) = number(text, 4)?;
        let (month, rest) = short(rest.strip_prefix(b"-").or_else(|| rest.strip_prefix(b"/"))?)?;
        let (day, rest) = short(rest.strip_prefix(b"-").or_else(|| rest.strip_prefix(b"/"))?)?;
        Some((year, month, day, rest))
    };
    // With points the day is first.
    let german = |text| {
        let (day, rest) = short(text)?;
        let (month, rest) = short(rest.strip_prefix(b".")?)?;
        let rest = rest.strip_prefix(b".")?;
        let (year, rest) = number(rest, 4).or_else(|| number(rest, 2).map(century))?;
        Some((year, month, day, rest))
    };
    let named = |text| {
        let (day, rest) = short(text)?;
        let (month, rest) = named_month(after(rest, b"- "))?;
        let rest = after(rest, b"- ");
        let (year, rest) = number(rest, 4).or_else(|| number(rest, 2).map(century))?;
        Some((year, month, day, rest))
    };
    let slashes = |text| {
        let (first, rest) = short(text)?;
        let (second, rest) = short(rest.strip_prefix(b"/")?)?;
        let rest = rest.strip_prefix(b"/")?;
        let (year, rest) = number(rest, 4).or_else(|| number(rest, 2).map(century))?;
        match order {
            DateOrder::YearFirst => None,
            DateOrder::MonthFirst => Some((year, first, second, rest)),
            DateOrder::DayFirst => Some((year, second, first, rest)),
        }
    };
    let dated = iso(text).or_else(|| german(text)).or_else(|| named(text)).or_else(|| slashes(text));
    let (year, month, day, rest) = dated?;
    let real = (1970..2100).contains(&year)
        && (1..=12).contains(&month)
        && (1..=days_of(year, month)).contains(&day);
    Some((real.then(|| seconds_since_1970(year, month, day) as f64), rest))
}

/// The number of a month that is written as its first three letters in English, and what follows.
fn named_month(bytes: &[u8]) -> Option<(u64, &[u8])> {
    const MONTHS: [&[u8]; 12] =
        [b"jan", b"feb", b"mar", b"apr", b"may", b"jun", b"jul", b"aug", b"sep", b"oct", b"nov", b"dec"];
    let (name, rest) = bytes.split_at_checked(3)?;
    let number = MONTHS.iter().position(|m| name.eq_ignore_ascii_case(m))?;
    Some((number as u64 + 1, rest))
}

/// A time of day, s, and what follows it, also with `AM` or `PM`.
fn time_with_parts(bytes: &[u8]) -> Option<(f64, &[u8])> {
    /// Half a day, s.
    const HALF: f64 = 43_200.0;
    let (seconds, rest) = time_of_24_hours(bytes)?;
    let mark =
        rest.trim_ascii_start().get(..2).map(|m| [m[0].to_ascii_lowercase(), m[1].to_ascii_lowercase()]);
    let late = match mark.as_ref() {
        Some(b"am") => 0.0,
        Some(b"pm") => HALF,
        _ => return Some((seconds, rest)),
    };
    // Half an hour past noon is written as 12:30 PM.
    let of_twelve = (3600.0..HALF + 3600.0).contains(&seconds);
    of_twelve.then_some((seconds % HALF + late, &rest.trim_ascii_start()[2..]))
}

/// A time of day with parts of a second, s, and what follows it.
fn time_of_24_hours(bytes: &[u8]) -> Option<(f64, &[u8])> {
    let (hour, rest) = short(bytes)?;
    let (minute, rest) = number(rest.strip_prefix(b":")?, 2)?;
    let Some(rest) = rest.strip_prefix(b":") else {
        return (hour < 24 && minute < 60).then_some(((3600 * hour + 60 * minute) as f64, rest));
    };
    let (second, rest) = number(rest, 2)?;
    if hour > 23 || minute > 59 || second > 59 {
        return None;
    }
    let whole = (3600 * hour + 60 * minute + second) as f64;
    let (sign, parts) = rest.split_first().unwrap_or((&b' ', rest));
    let digits = parts.iter().take_while(|b| b.is_ascii_digit()).count();
    // Behind a third colon stand milliseconds, with all three digits.
    if !(matches!(sign, b'.' | b',') || *sign == b':' && digits == 3) {
        return Some((whole, rest));
    }
    let parts_of_second = std::str::from_utf8(&parts[..digits]).ok()?;
    let share: f64 = format!("0.{parts_of_second}0").parse().ok()?;
    Some((whole + share, &parts[digits..]))
}

/// The offset of a time zone from UTC, s: nothing, `Z`, `+01:00`, `-0500`, `+01`.
fn offset_of_zone(bytes: &[u8]) -> Option<f64> {
    let (sign, rest) = match bytes.split_first() {
        None => return Some(0.0),
        Some((b'Z' | b'z', [])) => return Some(0.0),
        Some((b'+', rest)) => (1.0, rest),
        Some((b'-', rest)) => (-1.0, rest),
        Some(_) => return None,
    };
    let (hours, rest) = number(rest, 2)?;
    let (minutes, rest) = if rest.is_empty() { (0, rest) } else { number(after(rest, b":"), 2)? };
    (hours < 15 && minutes < 60 && rest.is_empty()).then_some(sign * (3600 * hours + 60 * minutes) as f64)
}

/// A number of one or two digits at the beginning, and what follows.
fn short(bytes: &[u8]) -> Option<(u64, &[u8])> {
    number(bytes, 2).or_else(|| number(bytes, 1))
}

/// A number of `n` digits at the beginning, and what follows.
fn number(bytes: &[u8], digits: usize) -> Option<(u64, &[u8])> {
    let (own, rest) = bytes.split_at_checked(digits)?;
    let value = own.iter().try_fold(0, |v, b| b.is_ascii_digit().then(|| 10 * v + u64::from(b - b'0')))?;
    Some((value, rest))
}

/// What follows a separator; the same text where there is none.
fn after<'a>(bytes: &'a [u8], separators: &[u8]) -> &'a [u8] {
    match bytes.split_first() {
        Some((first, rest)) if separators.contains(first) => rest,
        _ => bytes,
    }
}

fn date_at(bytes: &[u8]) -> Option<f64> {
    let (year, rest) = number(bytes, 4)?;
    let (month, rest) = number(after(rest, b"-_."), 2)?;
    let (day, rest) = number(after(rest, b"-_."), 2)?;
    if !(2000..2100).contains(&year)
        || !(1..=12).contains(&month)
        || !(1..=days_of(year, month)).contains(&day)
    {
        return None;
    }
    let midnight = seconds_since_1970(year, month, day);
    // A digit right behind the day belongs to some other number.
    let timed = rest.first().is_some_and(|b| b"T_- ".contains(b));
    let (seconds, rest) = if timed { time_of_day(&rest[1..]).unwrap_or((0, rest)) } else { (0, rest) };
    if rest.first().is_some_and(u8::is_ascii_digit) { None } else { Some((midnight + seconds) as f64) }
}

fn time_of_day(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let (hour, rest) = number(bytes, 2)?;
    let (minute, rest) = number(after(rest, b":-_."), 2)?;
    let (second, rest) = number(after(rest, b":-_."), 2).unwrap_or((0, rest));
    (hour < 24 && minute < 60 && second < 60).then_some((3600 * hour + 60 * minute + second, rest))
}

fn days_of(year: u64, month: u64) -> u64 {
    match month {
        4 | 6 | 9 | 11 => 30,
        2 if year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400)) => 29,
        2 => 28,
        _ => 31,
    }
}

/// The way back of [`iso_8601`] (same source).
fn seconds_since_1970(year: u64, month: u64, day: u64) -> u64 {
    let year = year - u64::from(month <= 2);
    let (era, year_of_era) = (year / 400, year % 400);
    let shifted = (month + 9) % 12;
    let day_of_year = (153 * shifted + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    86_400 * (era * 146_097 + day_of_era - 719_468)
}

/// A date in a remark above the header, or in the first row of a column that is named for it.
fn in_header(path: &Path) -> Option<f64> {
    use std::io::Read;
    let mut bytes = Vec::new();
    std::fs::File::open(path).ok()?.take(HEADER_BYTES as u64).read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let mut columns: Option<Vec<usize>> = None;
    for line in text.lines() {
        if line.starts_with('#') {
            if let Some(date) = in_text(line) {
                return Some(date);
            }
            continue;
        }
        let cells: Vec<&str> = line.split([',', ';', '\t']).map(|c| c.trim().trim_matches('"')).collect();
        if let Some(dated) = &columns {
            return dated.iter().find_map(|i| in_text(cells.get(*i)?));
        }
        let is_date_column = |c: &str| DATE_COLUMNS.contains(&c.to_lowercase().as_str());
        columns = Some((0..cells.len()).filter(|i| is_date_column(cells[*i])).collect());
    }
    None
}

/// Seconds since 1970 as a calendar day.
#[must_use]
pub fn day(seconds: f64) -> String {
    iso_8601(if seconds > 0.0 { seconds as u64 } else { 0 })[..10].to_owned()
}

/// Seconds since 1970 as a calendar date (algorithm of H. Hinnant, "chrono-compatible low-level date algorithms").
fn iso_8601(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    let z = days + 719_468;
    let era = z / 146_097;
    let day_of_era = z - era * 146_097;
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest / 60 % 60, rest % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_alone_is_its_midnight() {
        let day = Some(1_795_219_200.0);
        assert_eq!(date_in("2026-11-21", DateOrder::YearFirst), day);
        assert_eq!(date_in("21.11.2026 00:00:00", DateOrder::YearFirst), day);
        assert_eq!(date_in("11/21/2026", DateOrder::MonthFirst), day);
        assert_eq!(date_in("2026-11-21 13:30:00", DateOrder::YearFirst), None);
    }

    #[test]
    fn time_stamps_of_loggers_are_read_and_ambiguous_ones_are_not() {
        let noon = 1_795_219_200.0 + 43_200.0;
        let same = [
            "2026-11-21 12:00:01.5",
            "2026/11/21 12:00:01.5",
            "2026/11/21 12:00:01.5 PM",
            "21.11.2026 12:00:01,5",
        ];
        for text in same {
            assert_eq!(time_stamp(text), Some(noon + 1.5), "{text}");
        }
        for text in [
            "21.11.26 12:00:01:500",
            "21-Nov-2026 12:00:01.5",
            "21-NOV-26 12:00:01,5",
            "21 nov 2026 12:00:01.5",
        ] {
            assert_eq!(time_stamp(text), Some(noon + 1.5), "{text}");
        }
        assert_eq!(time_stamp("12:00:01:500"), Some(43_201.5));
        assert_eq!(time_stamp("1.2.2026 9:05:07"), time_stamp("01.02.2026 09:05:07"));
        assert_eq!((time_stamp("9:05:07"), time_stamp("12:00:01 am")), (Some(32_707.0), Some(1.0)));
        // Minutes and seconds, a month before the day, the thirteenth hour of twelve.
        for text in [
            "05:30",
            "5:30.25",
            "11/21/2026 13:30:00",
            "13:30:00 PM",
            "0:30:00 AM",
            "9:5:7",
            "9:05:07 XM",
            "9:05:07:5",
            "31-Feb-2026 9:05:07",
        ] {
            assert_eq!(time_stamp(text), None, "{text}");
        }
    }

    #[test]
    fn dates_are_those_of_the_calendar() {
        // `date -u -d @N +%FT%TZ` of GNU coreutils.
        assert_eq!(iso_8601(0), "1970-01-01T00:00:00Z");
        assert_eq!(iso_8601(951_782_399), "2000-02-28T23:59:59Z");
        assert_eq!(iso_8601(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(iso_8601(1_795_219_200), "2026-11-21T00:00:00Z");
    }

    #[test]
    fn a_date_in_a_name_is_read_and_written_back() {
        for seconds in [951_782_400_u64, 1_795_219_200, 1_709_164_800] {
            let text = iso_8601(seconds);
            assert_eq!(in_text(&format!("run_{text}_a")), Some(seconds as f64), "{text}");
            assert_eq!(day(seconds as f64), text[..10]);
        }
        assert_eq!(in_text("2026-02-29"), None);
        assert_eq!(in_text("serial 120260105"), None);
        assert_eq!(in_text("2026-01-05_207kPa"), in_text("20260105"));
    }

    #[test]
    fn a_recording_is_dated_by_name_then_column_then_modification() {
        let folder = tempfile::tempdir().unwrap();
        let named = folder.path().join("a-2026-01-05.csv");
        let column = folder.path().join("b.csv");
        let plain = folder.path().join("c.csv");
        std::fs::write(&named, "time_s\n0\n").unwrap();
        std::fs::write(&column, "time_s,date\n0,2026-01-06\n").unwrap();
        std::fs::write(&plain, "time_s\n0\n").unwrap();
        assert_eq!(of_recording(&named, None).unwrap().1, DateSource::Name);
        assert_eq!(
            of_recording(&column, None).unwrap(),
            (in_text("2026-01-06").unwrap(), DateSource::Column)
        );
        assert_eq!(
            of_recording(&plain, Some(1_795_219_200.5)).unwrap(),
            (1_795_219_200.5, DateSource::Column)
        );
        assert_eq!(of_recording(&plain, Some(3.0)).unwrap().1, DateSource::Modified);
    }
}
