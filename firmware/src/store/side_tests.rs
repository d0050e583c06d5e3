//! Where on flash each muscle's things are, and what a flash that fails or is full is reported as.

use super::mock_flash::MockFlash;
use super::tests::{counted, kept, open, settings_of, table};
use super::*;
use model_core::link::settings::Settings;

fn memory(value: f32) -> Memory<f32> {
    [value; MEMORY]
}

fn memories(store: &mut Store<MockFlash>, side: Side) -> std::vec::Vec<Memory<f32>> {
    let mut all = std::vec::Vec::new();
    let count = store.each_memory(side, &mut |position, memory| {
        assert_eq!(position, all.len());
        all.push(*memory);
    });
    assert_eq!(count, Ok(all.len()));
    all
}

#[test]
fn each_muscle_has_two_places_for_tables_and_one_for_memories() {
    let mut store = open(MockFlash::erased());
    store.put_settings(&mut Settings::default()).expect("room");
    for (side, first) in [(Side::Agonist, 0x20), (Side::Antagonist, 0x22)] {
        for n in 0..5_u8 {
            let image = table(first + n);
            let selected = store.commit(side, &image).expect("room");
            assert_eq!(selected.slot, n % 2, "the slots take turns");
            assert_eq!(store.bytes(first + n % 2), Ok(Some(&image[..])), "{side:?}, commit {n}");
        }
        for (n, slot) in [(0, 1), (1, 0), (2, 1)] {
            let generation = store.selected(side).expect("readable").expect("a table").table.generation;
            assert_eq!(store.roll_back(side, generation).map(|selected| selected.slot), Ok(slot), "back {n}");
        }
    }
    for (side, key) in [(Side::Agonist, 0x40), (Side::Antagonist, 0x41)] {
        let value = f32::from(key);
        store.put_memories(side, 1, &|_| memory(value)).expect("room");
        assert!(store.bytes(key).expect("readable").is_some(), "{side:?}");
    }
    for (side, key) in [(Side::Agonist, 0x40_u8), (Side::Antagonist, 0x41)] {
        assert_eq!(memories(&mut store, side), [memory(f32::from(key))], "{side:?}");
    }
    assert_eq!(settings_of(&mut store), Some(Settings::default()), "and nothing else lies there");
}

#[test]
fn no_more_memories_are_read_than_were_kept_or_can_be() {
    let kept_of = |count: u8, there: usize| {
        let mut bytes = [0; 2_048];
        let mut remembered = Remembered { generation: 1, count: there, memory: &|n| memory(n as f32) };
        let length = fields::write(&mut remembered, &mut bytes).expect("room");
        assert_eq!(bytes[..2], [1, there as u8], "generation and count");
        bytes[1] = count;
        let mut read = std::vec::Vec::new();
        assert_eq!(each_kept(&bytes[..length], 1, &mut |n, one| read.push((n, *one))), read.len());
        for (at, (n, one)) in read.iter().enumerate() {
            assert_eq!((*n, *one), (at, memory(at as f32)));
        }
        assert_eq!(each_kept(&bytes[..length], 2, &mut |_, _| panic!("of another table")), 0);
        read.len()
    };
    let cases = [(2, 2, 2), (2, 3, 2), (0, 3, 0), (5, 3, 3)];
    for (count, there, read) in cases {
        assert_eq!(kept_of(count, there), read, "{count} announced, {there} there");
    }
    let most = MAX_EFFECTS + 2;
    assert_eq!(kept_of(most as u8, most), MAX_EFFECTS);
}

#[test]
fn a_full_flash_and_one_that_fails_are_distinguished() {
    let mut store = open(MockFlash::erased());
    assert_eq!(store.put_bytes(0x20, &[7; 3_000]), Err(StoreFault::Full), "longer than a page");
    let most = [7; 700];
    let written = (0x80..0xFF).take_while(|key| store.put_bytes(*key, &most).is_ok()).count();
    assert!((6..=12).contains(&written), "{written} items of a third of a page");
    assert_eq!(store.put_bytes(0x7F, &most), Err(StoreFault::Full), "no page is left");
    let mut worn = open(MockFlash::erased().failing_after(0));
    assert_eq!(worn.put_bytes(0x20, &[7; 30]), Err(StoreFault::Medium));
    assert_eq!(worn.commit(Side::Agonist, &table(1)).err(), Some(StoreFault::Medium));
    assert!(matches!(open(MockFlash::erased().powered(0, 0)).erase(), Err(StoreFault::Medium)));
}

#[test]
fn the_longest_image_fits() {
    let mut store = open(MockFlash::erased());
    let longest = [7; image::MAX_LEN];
    store.commit(Side::Agonist, &longest).expect("room");
    assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&longest[..]));
    assert_eq!(store.put_bytes(0x20, &[7; image::MAX_LEN + 32]), Err(StoreFault::Full), "no room is wasted");
}

#[test]
fn an_erased_store_holds_nothing_and_takes_everything() {
    let mut store = open(MockFlash::erased());
    store.commit(Side::Agonist, &table(1)).expect("room");
    store.put_settings(&mut Settings::default()).expect("room");
    assert_eq!(counted(&mut store), 1);
    assert_eq!(store.erase(), Ok(()));
    assert_eq!((kept(&mut store, Side::Agonist), settings_of(&mut store)), (None, None));
    assert_eq!(counted(&mut store), 1);
    store.commit(Side::Agonist, &table(2)).expect("room");
    assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&table(2)[..]));
}

#[test]
fn a_next_place_beyond_the_log_is_brought_back_into_it() {
    let mut store = open(MockFlash::erased());
    store.put_value(PAST_FAULT_NEXT, &mut 255_u8).expect("room");
    for back in 0..FAULT_LOG as u8 {
        assert_eq!(store.past_fault(back), Ok(None));
    }
    let mut report = FaultReport { time_us: 5, ..FaultReport::default() };
    store.put_fault(&mut report).expect("room");
    assert_eq!(store.past_fault(0), Ok(Some(report)));
}

#[test]
fn a_layout_with_missing_settings_is_not_treated_as_a_new_device() {
    for layout in [1, FORMAT - 1, FORMAT, FORMAT + 1] {
        let mut store = open(MockFlash::erased());
        store.put_value(0x3F, &mut { layout }).expect("room");
        assert_eq!(store.settings(&mut Settings::default()), Ok(Kept::Untrusted), "layout {layout}");
    }
}
