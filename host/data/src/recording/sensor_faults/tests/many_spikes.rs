//! Spikes in several per cent of the rows of all files, and values that a logger writes for readings that it missed.

use super::*;

/// Single rows of all files that are spoiled, one in `every`.
fn single(every: usize) -> impl Iterator<Item = usize> + Clone {
    (20..1600).step_by(every)
}

/// Every `every`th row of all files, spoiled in some channels.
fn spoiled_rows(seed: u32, channels: &[Channel], every: usize, value: impl Fn(f64) -> f64) -> Campaign {
    let mut campaign = campaign(seed);
    for r in &mut campaign.recordings {
        for channel in channels {
            let column = channel.of_mut(r);
            single(every).for_each(|i| column[i] = value(column[i]));
        }
    }
    campaign
}

/// How many of the spoiled rows are excluded, and how many others.
fn excluded(campaign: &Campaign, every: usize) -> (usize, usize) {
    let screened = Screened::of(campaign);
    let (mut right, mut wrong) = (0, 0);
    for index in 0..campaign.recordings.len() {
        let read = screened.read(index);
        let all = read.iter().filter(|read| !**read).count();
        let of_spikes = single(every).filter(|i| !read[*i]).count();
        (right, wrong) = (right + of_spikes, wrong + all - of_spikes);
    }
    (right, wrong)
}

/// Quantiles of all readings are those of the spikes where there are many: then a steady pressure has no range, as that of a dead sensor.
#[test]
fn spikes_in_all_files_leave_all_recordings_in_use() {
    for (channel, value) in
        [(Channel::Pressure, 32_767e3), (Channel::Pressure, 20_000e3), (Channel::Force, 32_767.0)]
    {
        for every in [20, 50, 100] {
            let campaign = spoiled_rows(8, &[channel], every, |_| value);
            let spikes = 6 * single(every).count();
            let (right, wrong) = excluded(&campaign, every);
            assert!(
                right == spikes && wrong == 0,
                "{channel:?} 1/{every}: {right} of {spikes}, {wrong} others"
            );
            let dead = Screened::of(&campaign).faults.iter().any(|f| f.kind == Kind::Dead);
            assert!(!dead, "{channel:?} 1/{every}");
        }
    }
}

/// Where one row in twenty is lost, some of them lie so close together that most changes beside one are those of another.
#[test]
fn spikes_close_together_take_no_good_rows() {
    for (channel, value) in
        [(Channel::Pressure, 0.0), (Channel::Pressure, 32_767e3), (Channel::Force, 32_767.0)]
    {
        let mut campaign = campaign(13);
        let mut state = 1_u32;
        let mut lost: Vec<Vec<bool>> = Vec::new();
        for r in &mut campaign.recordings {
            let column = channel.of_mut(r);
            lost.push(
                (0..column.len())
                    .map(|_| {
                        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                        state >> 8 < (1 << 24) / 20
                    })
                    .collect(),
            );
            column
                .iter_mut()
                .zip(&lost[lost.len() - 1])
                .filter(|(_, lost)| **lost)
                .for_each(|(v, _)| *v = value);
        }
        let screened = Screened::of(&campaign);
        let (mut right, mut wrong, mut all) = (0, 0, 0);
        for (index, lost) in lost.iter().enumerate() {
            for (read, lost) in screened.read(index).into_iter().zip(lost) {
                right += usize::from(!read && *lost);
                wrong += usize::from(!read && !*lost);
                all += usize::from(*lost);
            }
        }
        assert!(
            right * 100 >= all * 98 && wrong * 100 <= all,
            "{channel:?} {value}: {right} of {all}, {wrong} others"
        );
    }
}

/// Zeros are drop-outs near the beginning of a stroke, too, where they step less than a spike does, and where no force contradicts them.
#[test]
fn zeros_that_are_proved_in_dozens_of_rows_are_taken_in_the_others() {
    for channel in Channel::ALL {
        let clean = campaign(9);
        let campaign = spoiled_rows(9, &[channel], 50, |_| 0.0);
        // Less than that a fit does not notice.
        let share = if channel == Channel::Stroke { 0.03e-3 } else { 0.0 };
        let out = |r: &Recording| single(50).filter(|i| channel.of(r)[*i] > share).count();
        let lost: usize = clean.recordings.iter().map(out).sum();
        let (right, wrong) = excluded(&campaign, 50);
        assert!(right >= lost && wrong == 0, "{channel:?}: {right} of {lost}, {wrong} others");
    }
}

/// A row of zeros is that of a vented muscle at rest, which no force contradicts.
#[test]
fn rows_in_which_all_sensors_step_away_are_missed_rows() {
    for (every, value) in [(333, 0.0), (50, 0.0), (333, -1.0)] {
        let value = |v: f64| if value < 0.0 { -1e-3 + 0.0 * v } else { 0.0 };
        let campaign = spoiled_rows(10, &Channel::ALL, every, value);
        let rows = 6 * single(every).count();
        let (right, wrong) = excluded(&campaign, every);
        assert!(right == rows && wrong == 0, "1/{every}: {right} of {rows}, {wrong} others");
        let remark = Screened::of(&campaign).remark().unwrap_or_default();
        assert!(remark.contains("failed logger"), "{remark}");
    }
}

/// A muscle that is vented for a row, and pulls less; noise distinguishes its readings from those of a logger.
#[test]
fn a_vented_muscle_is_no_missed_row() {
    let mut campaign = campaign(11);
    for (file, r) in campaign.recordings.iter_mut().enumerate() {
        let force = r.force.as_mut().unwrap();
        for (k, i) in single(100).enumerate() {
            let noise = |of: usize| 1.0 + ((16 * file + k) * of % 101) as f64 / 10.0;
            (r.pressure[i], r.stroke[i], force[i]) = (50.0 * noise(41), 1e-6 * noise(59), 0.05 * noise(83));
        }
    }
    assert!(!Screened::of(&campaign).faults.iter().any(|f| f.kind == Kind::Missed));
}

/// The stroke of the bench ends at 2.5 mm for its sensor; or an axis holds it there, and the force creeps back.
#[test]
fn a_stroke_that_is_cut_in_all_files_is_found_and_a_hold_is_not() {
    let end = 2.5e-3;
    for seed in 12..16 {
        let mut cut = campaign(seed);
        let mut rows = 0;
        for r in &mut cut.recordings {
            rows += r.stroke.iter().filter(|x| **x >= end).count();
            r.stroke.iter_mut().for_each(|x| *x = x.min(end));
        }
        let found = faults(&cut);
        let saturated = |f: &&SensorFault| (f.channel, f.kind) == (Channel::Stroke, Kind::Saturated);
        let of: usize = found.iter().filter(saturated).map(|f| f.rows.len()).sum();
        assert_eq!((of, found.iter().filter(|f| !saturated(f)).count()), (rows, 0), "seed {seed}");

        let mut held = cut;
        for r in &mut held.recordings {
            let Recording { stroke, force: Some(force), .. } = r else { continue };
            let (mut since, mut first) = (0, 0.0);
            for i in 0..force.len() {
                if stroke[i] < end {
                    (since, first) = (0, force[i]);
                } else {
                    since += 1;
                    let creep = 0.03 * first * (1.0 - (-f64::from(since) / 10.0).exp());
                    force[i] = ((first + creep) / 0.05).round() * 0.05 + 0.05 * f64::from(since * 7 % 5 - 2);
                }
            }
        }
        assert_eq!(faults(&held), [], "seed {seed}");
    }
}
