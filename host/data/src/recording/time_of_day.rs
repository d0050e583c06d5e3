//! Times of day that pass midnight, within a file and from one to the next.

use super::Recording;

/// A day, s.
pub(super) const DAY: f64 = 86_400.0;
/// A step from one day to the next is at most this long, s: a recording has no longer pause.
const STEP: f64 = 3600.0;

/// Whether all of these, s = seconds · scale + offset, are times of a day: dates are later.
pub(super) fn are(times: &[f64], scale: f64, offset: f64) -> bool {
    times.iter().all(|t| (0.0..DAY).contains(&((t - offset) / scale)) || t.is_nan())
}

/// Adds a day to the recordings behind each at which the clock goes back, where all have times of day without a date: these do not show the
/// order of the recordings, which is the given one. `None` where it goes back nowhere; otherwise a remark for the user.
pub(super) fn on_following_days(recordings: &mut [Recording]) -> Option<String> {
    if !recordings.iter().all(|r| r.time_of_day) {
        return None;
    }
    let mut days = 0.0;
    let mut back = Vec::new();
    for n in 1..recordings.len() {
        let (before, this) = recordings.split_at_mut(n);
        let (before, this) = (&before[n - 1], &mut this[0]);
        let (Some(begin), Some(last)) = (before.time.first(), this.time.last()) else { continue };
        // Recordings that overlap do not follow each other.
        while last + days * DAY < *begin {
            days += 1.0;
            if back.last() != Some(&this.name) {
                back.push(this.name.clone());
            }
        }
        this.time.iter_mut().for_each(|time| *time += days * DAY);
    }
    let first = back.first()?;
    let more = if back.len() > 1 { format!(" and {} more", back.len() - 1) } else { String::new() };
    Some(format!(
        "the times of day are earlier in `{first}`{more} than in the recording before: the recordings keep the order given, and a day is added \
         there; give them in the order in which they were made"
    ))
}

/// Adds a day to times of day wherever they pass midnight, s = seconds · scale + offset; gives the rows at which they do. Dates are not times
/// of day, and a longer step back is none of a clock that continues: both stay as they are.
pub(super) fn past_midnight(times: &mut [f64], scale: f64, offset: f64) -> Vec<usize> {
    if !are(times, scale, offset) {
        return Vec::new();
    }
    let mut rows = Vec::new();
    let mut days = 0.0;
    let mut last = f64::NAN;
    for (row, time) in times.iter_mut().enumerate() {
        let now = (*time - offset) / scale;
        if now < last && now + DAY - last < STEP {
            days += 1.0;
            rows.push(row);
        }
        if now.is_finite() {
            last = now;
        }
        *time += days * DAY * scale;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::past_midnight;

    #[test]
    fn only_a_short_step_over_midnight_adds_a_day() {
        let of = |times: &[f64]| {
            let mut times = times.to_vec();
            let rows = past_midnight(&mut times, 1.0, 0.0);
            (times, rows)
        };
        assert_eq!(of(&[86_399.0, 1.0, 2.0]), (vec![86_399.0, 86_401.0, 86_402.0], vec![1]));
        assert_eq!(of(&[50_000.0, 40_000.0]).1, Vec::<usize>::new());
        // s since 1970.
        assert_eq!(of(&[1e9, 1.0]).0, [1e9, 1.0]);
        let mut scaled = [2.0 * 86_399.0 + 5.0, 7.0];
        assert_eq!(past_midnight(&mut scaled, 2.0, 5.0), [1]);
        assert_eq!(scaled, [172_803.0, 172_807.0]);
    }
}
