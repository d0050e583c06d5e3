//! Spikes in several per cent of the rows of all files.

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
