//! Checks of the store that keep people safe: each test fails if the check that it names is removed.

use super::mock_flash::MockFlash;
use super::tests::{kept, open, settings_of, table, used};
use super::*;
use model_core::link::settings::Settings;

/// Writes with a bad cell in each word in turn, until all words are good; `inspect` learns whether the store said that it had succeeded.
fn with_each_word_wrong(
    before: &MockFlash,
    operation: impl Fn(&mut Store<MockFlash>) -> bool,
    inspect: impl Fn(&mut Store<MockFlash>, bool, usize),
) -> usize {
    for word in 0.. {
        let mut store = open(before.clone().wrong_at(word));
        let said = operation(&mut store);
        let flash = store.close();
        let written = flash.done;
        inspect(&mut open(flash), said, word);
        if written <= word {
            assert!(said, "without a bad cell it succeeds");
            return word;
        }
    }
    0
}

#[test]
fn a_commit_that_was_not_written_as_it_should_be_is_not_confirmed() {
    let mut store = used(2);
    let old = kept(&mut store, Side::Agonist);
    let new = table(77);
    let mut refused = core::cell::Cell::new(0);
    let words = with_each_word_wrong(
        &store.close(),
        |store| store.commit(Side::Agonist, &new).is_ok(),
        |store, said, word| {
            let now = store.table(Side::Agonist).ok().flatten().map(<[u8]>::to_vec);
            if said {
                assert_eq!(now.as_deref(), Some(&new[..]), "confirmed, and it is not there: word {word}");
            } else {
                refused.set(refused.get() + 1);
                assert!(now == old || now.as_deref() == Some(&new[..]), "word {word}");
            }
        },
    );
    // The image has 700 bytes: a bad cell in any of its words must be noticed.
    assert!(*refused.get_mut() >= 175, "{refused:?} of {words} words were noticed");
}

#[test]
fn settings_that_were_not_written_as_they_should_be_are_not_confirmed() {
    let store = used(1);
    let mut changed = Settings::default();
    changed.limits.pressure_pa = 123e3;
    let refused = core::cell::Cell::new(0);
    with_each_word_wrong(
        &store.close(),
        |store| store.put_settings(&mut { changed }).is_ok(),
        |store, said, word| {
            if said {
                let mut now = Settings::default();
                let found = store.settings(&mut now);
                let trusted = found == Ok(Kept::Whole) && now == changed;
                assert!(trusted || found == Ok(Kept::Untrusted), "word {word}: {found:?}");
            } else {
                refused.set(refused.get() + 1);
            }
        },
    );
    assert!(refused.get() >= 40, "{refused:?} words were noticed");
    let mut whole = used(1);
    assert_eq!(settings_of(&mut whole), Some(Settings::default()));
}

#[test]
fn an_image_that_is_not_the_selected_one_is_not_given_out() {
    let mut store = used(2);
    let selected = store.selected(Side::Agonist).expect("readable").expect("a table");
    // A whole item, right by its own check sum, and another table than the one that was checked.
    store.put_bytes(image_key(Side::Agonist, selected.slot), &table(99)).expect("room");
    assert_eq!(store.table(Side::Agonist), Err(StoreFault::Verify));
    let mut store = used(2);
    store.put_bytes(image_key(Side::Agonist, 1 - selected.slot), &table(99)).expect("room");
    let generation = selected.table.generation;
    assert_eq!(store.roll_back(Side::Agonist, generation), Err(StoreFault::Verify));
    assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&table(1)[..]), "nothing has changed");
}

#[test]
fn memories_of_another_generation_are_not_given_out() {
    let mut store = used(1);
    let memory = [1.5; MEMORY];
    store.put_memories(Side::Agonist, 2, &|_| memory).expect("room");
    let count = |store: &mut Store<MockFlash>| {
        let mut given = 0;
        let counted = store.each_memory(Side::Agonist, &mut |_, one| given += usize::from(*one == memory));
        assert_eq!(counted, Ok(given));
        given
    };
    assert_eq!(count(&mut store), 2);
    store.commit(Side::Agonist, &table(5)).expect("room");
    assert_eq!(count(&mut store), 0, "of the table before");
    store.roll_back(Side::Agonist, 2).expect("there is one");
    assert_eq!(count(&mut store), 2, "its own table again");
    assert_eq!(store.each_memory(Side::Antagonist, &mut |_, _| ()), Ok(0), "the other muscle");
}

#[test]
fn a_new_table_has_a_generation_that_nothing_kept_has() {
    let mut store = used(3);
    store.put_memories(Side::Agonist, 1, &|_| [1.5; MEMORY]).expect("room");
    let newest = store.roll_back(Side::Agonist, 3).expect("there is one").previous.expect("the newer one");
    assert_eq!(newest.generation, 3);
    assert_eq!(store.commit(Side::Agonist, &table(7)).map(|now| now.table.generation), Ok(4));
    // The selection is lost with its item, the memories are not.
    store.put_bytes(SELECTED, &[]).expect("room");
    assert_eq!(store.commit(Side::Agonist, &table(8)).map(|now| now.table.generation), Ok(4));
    assert_eq!(store.each_memory(Side::Agonist, &mut |_, _| panic!("of another table")), Ok(0));
}
