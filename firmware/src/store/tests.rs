//! The store on a flash whose power is cut at every write and every erase, against an oracle of what may be there.

use super::mock_flash::MockFlash;
use super::*;
use model_core::link::messages::{Mode, SideSample, State};
use model_core::link::settings::Settings;

pub(super) fn table(fill: u8) -> [u8; 700] {
    let mut bytes = [fill; 700];
    for (n, byte) in bytes.iter_mut().enumerate() {
        *byte ^= n as u8;
    }
    bytes
}

pub(super) fn open(flash: MockFlash) -> Store<MockFlash> {
    Store::open(flash).expect("six pages are a store")
}

pub(super) fn kept(store: &mut Store<MockFlash>, side: Side) -> Option<std::vec::Vec<u8>> {
    store.table(side).expect("what is selected is whole").map(<[u8]>::to_vec)
}

/// Counts a start of a store that is whole.
pub(super) fn counted(store: &mut Store<MockFlash>) -> u32 {
    let started = store.start().expect("it works");
    assert!(!started.made_again);
    started.starts
}

pub(super) fn settings_of(store: &mut Store<MockFlash>) -> Option<Settings> {
    let mut settings = Settings::default();
    let kept = store.settings(&mut settings).expect("readable");
    assert!(kept != Kept::Untrusted, "nothing is damaged");
    (kept != Kept::None).then_some(settings)
}

/// A store with some history, so that an operation meets pages that are nearly full and has to move what is alive.
pub(super) fn used(commits: u8) -> Store<MockFlash> {
    let mut store = open(MockFlash::erased());
    for n in 0..commits {
        store.commit(Side::Agonist, &table(n)).expect("room");
        store.commit(Side::Antagonist, &table(100 + n)).expect("room");
        store.put_settings(&mut Settings::default()).expect("room");
    }
    store
}

/// Runs an operation with the power cut at every one of its writes and erases, each interrupted in three ways; looks at what is
/// there after the power came back. Gives how many cuts were tried.
pub(super) fn cut_everywhere(
    before: &MockFlash,
    operation: impl Fn(&mut Store<MockFlash>) -> bool,
    inspect: impl Fn(&mut Store<MockFlash>, usize),
) -> usize {
    let mut cuts = 0;
    for tear in 0..3 {
        for left in 0.. {
            let flash = before.clone().powered(left, tear);
            let mut store = open(flash);
            let whole = operation(&mut store);
            let flash = store.close();
            if !flash.off {
                assert!(whole, "with power it works");
                assert!(flash.done > 0, "it writes something");
                break;
            }
            cuts += 1;
            inspect(&mut open(flash.powered(usize::MAX, 0)), left);
        }
    }
    cuts
}

#[test]
fn a_commit_that_loses_power_anywhere_leaves_the_old_table_or_the_new() {
    let mut cuts = 0;
    for commits in [1, 3, 6, 7] {
        let mut store = used(commits);
        let old = kept(&mut store, Side::Agonist);
        let other = kept(&mut store, Side::Antagonist);
        let new = table(77);
        let before = store.close();
        cuts += cut_everywhere(
            &before,
            |store| store.commit(Side::Agonist, &new).is_ok(),
            |store, left| {
                let now = kept(store, Side::Agonist);
                assert!(now == old || now.as_deref() == Some(&new[..]), "after {left} words");
                assert_eq!(kept(store, Side::Antagonist), other, "the other muscle is not touched");
                assert_eq!(settings_of(store), Some(Settings::default()));
                // And the store still works.
                store.commit(Side::Agonist, &table(3)).expect("it takes the next table");
                assert_eq!(kept(store, Side::Agonist).as_deref(), Some(&table(3)[..]));
            },
        );
    }
    assert!(cuts > 2000, "{cuts} cuts tried");
}

#[test]
fn a_roll_back_that_loses_power_leaves_one_of_both() {
    let mut store = used(2);
    let now = kept(&mut store, Side::Agonist);
    let previous = table(0);
    let before = store.close();
    let cuts = cut_everywhere(
        &before,
        |store| store.roll_back(Side::Agonist, 2).is_ok(),
        |store, left| {
            let after = kept(store, Side::Agonist);
            assert!(after == now || after.as_deref() == Some(&previous[..]), "after {left} words");
        },
    );
    assert!(cuts > 10, "{cuts} cuts tried");
}

#[test]
fn settings_that_lose_power_are_the_old_or_the_new() {
    let store = used(7);
    let mut changed = Settings::default();
    changed.limits.pressure_pa = 123e3;
    let before = store.close();
    cut_everywhere(
        &before,
        |store| store.put_settings(&mut { changed }).is_ok(),
        |store, left| {
            let after = settings_of(store);
            assert!(after == Some(changed) || after == Some(Settings::default()), "after {left} words");
        },
    );
}

/// Where settings lie on the flash.
pub(super) fn place_of(flash: &MockFlash, settings: &mut Settings) -> core::ops::Range<usize> {
    let mut bytes = [0; 400];
    let length = model_core::fields::write(settings, &mut bytes).expect("room");
    let place = flash.bytes.windows(length).position(|w| w == &bytes[..length]).expect("they are there");
    place..place + length
}

/// The newest settings are damaged and new ones are confirmed: those of before the damaged ones never come into force unseen.
#[test]
fn settings_confirmed_after_damage_that_lose_power_are_new_or_not_trusted() {
    let mut store = used(1);
    let mut newer = Settings::default();
    newer.limits.pressure_pa = 250e3;
    store.put_settings(&mut { newer }).expect("room");
    let mut damaged = store.close();
    let place = place_of(&damaged, &mut newer).start;
    damaged.bytes[place] ^= 1;
    assert_eq!(open(damaged.clone()).settings(&mut Settings::default()), Ok(Kept::Untrusted));
    let mut confirmed = newer;
    confirmed.limits.pressure_pa = 240e3;
    let cuts = cut_everywhere(
        &damaged,
        |store| store.put_settings(&mut { confirmed }).is_ok(),
        |store, left| {
            let mut read = Settings::default();
            match store.settings(&mut read) {
                Ok(Kept::Untrusted) => {}
                Ok(Kept::Whole) => assert_eq!(read, confirmed, "after {left} words"),
                other => panic!("{other:?} after {left} words"),
            }
        },
    );
    assert!(cuts > 50, "{cuts} cuts tried");
}

#[test]
fn a_rollback_returns_to_the_table_before_and_a_second_one_back() {
    let mut store = open(MockFlash::erased());
    assert_eq!(store.roll_back(Side::Agonist, 0), Err(StoreFault::NoPrevious));
    store.commit(Side::Agonist, &table(1)).expect("room");
    assert_eq!(store.roll_back(Side::Agonist, 1), Err(StoreFault::NoPrevious));
    store.commit(Side::Agonist, &table(2)).expect("room");
    for expected in [1, 2, 1] {
        let selected = store.roll_back(Side::Agonist, 3 - u32::from(expected)).expect("there are two");
        // The answer was lost and the host asks again.
        assert_eq!(store.roll_back(Side::Agonist, 3 - u32::from(expected)), Ok(selected));
        assert_eq!(selected.table.generation, u32::from(expected));
        assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&table(expected)[..]));
    }
    assert_eq!(kept(&mut store, Side::Antagonist), None);
}

#[test]
fn a_thousand_commits_wear_all_pages_and_lose_nothing() {
    let mut store = open(MockFlash::erased());
    for n in 0..1000_u32 {
        let image = table(n as u8);
        store.commit(Side::Agonist, &image).expect("room");
        assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&image[..]));
    }
    assert_eq!(store.selected(Side::Agonist).expect("readable").map(|s| s.table.generation), Some(1000));
}

#[test]
fn a_damaged_table_is_noticed() {
    let store = used(1);
    let image = table(0);
    let mut flash = store.close();
    let place = flash.bytes.windows(64).position(|w| w == &image[..64]).expect("it is on the flash");
    flash.bytes[place + 10] ^= 0x10;
    let mut store = open(flash);
    // Its own check sum makes the damaged item vanish, or the table's does: it is never given out.
    assert_ne!(store.table(Side::Agonist), Ok(Some(&image[..])));
    assert!(matches!(store.table(Side::Agonist), Err(_) | Ok(None)));
}

#[test]
fn the_log_keeps_the_last_faults_and_starts_are_counted() {
    let mut store = open(MockFlash::erased());
    assert_eq!(store.past_fault(0), Ok(None));
    for n in 0..FAULT_LOG as u64 + 3 {
        let report = FaultReport {
            fault: model_core::link::messages::Fault::OverStroke,
            side: Side::Agonist,
            sensor: None,
            from: State::Running,
            mode: Mode::Force,
            time_us: n,
            value: 1.0,
            limit: 0.5,
            last: SideSample::default(),
        };
        store.put_fault(&mut { report }).expect("room");
    }
    for back in 0..FAULT_LOG as u8 {
        let report = store.past_fault(back).expect("readable").expect("kept");
        assert_eq!(report.time_us, FAULT_LOG as u64 + 2 - u64::from(back));
    }
    assert_eq!(store.past_fault(FAULT_LOG as u8), Ok(None));
    assert_eq!((counted(&mut store), counted(&mut store)), (1, 2));
}
