//! The store on a flash whose power is cut at every write and every erase, against an oracle of what may be there.

use super::*;
use embedded_storage_async::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use heapless::Vec;
use model_core::link::messages::{Mode, SideSample, State};
use model_core::link::settings::Settings;

const PAGE: usize = 2048;
const PAGES: usize = 6;
const WORD: usize = 4;

/// Flash in memory that counts its words and erases, and loses power after some of them.
#[derive(Clone, Debug)]
pub(crate) struct MockFlash {
    bytes: Vec<u8, { PAGE * PAGES }>,
    /// Words that may still be written (an erase of a page counts as one).
    left: usize,
    done: usize,
    off: bool,
    /// Writes that still work, where the flash wears out and is read all the same.
    lasts: usize,
    /// What a cut leaves of the word or page it hits: 0 nothing happened, 1 half, 2 all of it.
    tear: usize,
    /// The word, counted from now, of which a bit is not written as it should be.
    wrong: usize,
}

#[derive(Debug)]
pub(crate) struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl MockFlash {
    pub(crate) fn erased() -> Self {
        let mut bytes = Vec::new();
        bytes.resize(PAGE * PAGES, 0xFF).expect("its own size");
        Self { bytes, left: usize::MAX, done: 0, off: false, lasts: usize::MAX, tear: 0, wrong: usize::MAX }
    }

    /// The same worn out: so many more writes work, and everything is read.
    pub(crate) fn failing_after(mut self, writes: usize) -> Self {
        self.lasts = writes;
        self
    }

    /// Words and pages since the flash was set up.
    pub(super) fn words_written(&self) -> usize {
        self.done
    }

    /// Counts one operation; false when the power goes with it.
    fn spend(&mut self) -> bool {
        if self.left == 0 {
            self.off = true;
            return false;
        }
        self.left -= 1;
        self.done += 1;
        true
    }

    /// The same with a bad cell in the word that is written after so many others.
    pub(super) fn wrong_at(mut self, word: usize) -> Self {
        (self.done, self.wrong) = (0, word);
        self
    }

    pub(crate) fn powered(mut self, left: usize, tear: usize) -> Self {
        (self.left, self.off, self.done, self.tear) = (left, false, 0, tear);
        self
    }
}

impl ErrorType for MockFlash {
    type Error = PowerCut;
}

impl ReadNorFlash for MockFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        if self.off {
            return Err(PowerCut);
        }
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        PAGE * PAGES
    }
}

impl NorFlash for MockFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(PAGE) && to.is_multiple_of(PAGE), "an erase is of whole pages");
        for page in (from..to).step_by(PAGE) {
            if self.off {
                return Err(PowerCut);
            }
            if self.spend() {
                self.bytes[page..page + PAGE].fill(0xFF);
            } else {
                self.bytes[page..page + PAGE * self.tear / 2].fill(0xFF);
                return Err(PowerCut);
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        let offset = offset as usize;
        assert!(offset.is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD), "a write is of whole words");
        if self.lasts == 0 {
            return Err(PowerCut);
        }
        self.lasts = self.lasts.saturating_sub(1);
        for (n, word) in bytes.chunks(WORD).enumerate() {
            if self.off {
                return Err(PowerCut);
            }
            let place = offset + n * WORD;
            let there = &mut self.bytes[place..place + WORD];
            // Bits can only be cleared between erases. A word that a cut left half written may be finished; the F446's flash
            // has no error correction that would forbid it.
            let clears_only = there.iter().zip(word).all(|(old, new)| old & new == *new);
            assert!(clears_only, "a write cannot set bits");
            if !self.spend() {
                let torn = WORD * self.tear / 2;
                self.bytes[place..place + torn].copy_from_slice(&word[..torn]);
                return Err(PowerCut);
            }
            self.bytes[place..place + WORD].copy_from_slice(word);
            if self.done - 1 == self.wrong {
                // A cell that has lost its charge reads as written, or as not written.
                self.bytes[place] ^= 0x04;
            }
        }
        Ok(())
    }
}

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

/// Runs an operation with the power cut at every one of its writes and erases, each torn in three ways; looks at what is
/// there after the power came back. Gives how many cuts were tried.
fn cut_everywhere(
    before: &MockFlash,
    operation: impl Fn(&mut Store<MockFlash>) -> bool,
    look: impl Fn(&mut Store<MockFlash>, usize),
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
            look(&mut open(flash.powered(usize::MAX, 0)), left);
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

#[test]
fn rolling_back_returns_and_there_and_back_again() {
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
    assert_eq!((store.count_start(), store.count_start()), (Ok(1), Ok(2)));
}

/// What [`written`] keeps.
fn report() -> FaultReport {
    FaultReport {
        fault: model_core::link::messages::Fault::PressureNotFalling,
        side: Side::Antagonist,
        sensor: Some(model_core::link::messages::Sensor::Pressure),
        from: State::Running,
        mode: Mode::Pair,
        time_us: 123_456_789_012,
        value: 250e3,
        limit: 150e3,
        last: SideSample { pressure_pa: 300e3, stroke_m: 1e-3, ..SideSample::default() },
    }
}

fn memories() -> [Memory<f32>; 2] {
    [1.5, -2.5].map(|value| [value; MEMORY])
}

/// One of everything that is kept, on an erased flash.
fn written() -> MockFlash {
    let mut store = open(MockFlash::erased());
    store.commit(Side::Agonist, &table(1)).expect("room");
    store.commit(Side::Agonist, &table(2)).expect("room");
    let mut settings = Settings::default();
    settings.regulator.line_s = 4.5e-3;
    settings.pressure_band_pa = 1_234.0;
    store.put_settings(&mut settings).expect("room");
    store.put_memories(Side::Agonist, 2, &|position| memories()[position]).expect("room");
    store.put_fault(&mut report()).expect("room");
    store.count_start().expect("room");
    store.close()
}

/// A flash as text: 32 bytes a line, those that are erased at its end left out.
fn text(flash: &MockFlash) -> std::string::String {
    let used = flash.bytes.iter().rposition(|byte| *byte != 0xFF).map_or(0, |last| last + 1);
    let line =
        |bytes: &[u8]| bytes.iter().map(|byte| std::format!("{byte:02x}")).collect::<std::string::String>();
    flash.bytes[..used].chunks(32).map(|bytes| line(bytes) + "\n").collect()
}

fn flash_of(text: &str) -> MockFlash {
    let mut flash = MockFlash::erased();
    let digits: std::vec::Vec<u8> = text.bytes().filter(u8::is_ascii_hexdigit).collect();
    for (byte, pair) in flash.bytes.iter_mut().zip(digits.as_chunks::<2>().0) {
        *byte = u8::from_str_radix(std::str::from_utf8(pair).expect("digits"), 16).expect("digits");
    }
    flash
}

/// If this test breaks, something that is kept has other fields: raise [`FORMAT`] and the key of what changed, run the test once with
/// `STORE=overwrite`, which writes `format-N.txt` of the new number, and keep the files of the numbers before for the test below.
#[test]
fn what_this_format_wrote_is_read_and_written_alike() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("src/store/fixtures")
        .join(std::format!("format-{FORMAT}.txt"));
    if std::env::var_os("STORE").is_some_and(|value| value == "overwrite") {
        std::fs::write(&path, text(&written())).expect("a file");
    }
    let fixture = std::fs::read_to_string(&path).expect("a fixture of this format");
    assert!(fixture == text(&written()), "the bytes on the flash are others than format {FORMAT} has");
    let mut store = open(flash_of(&fixture));
    assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&table(2)[..]));
    assert!(store.selected(Side::Agonist).expect("readable").is_some_and(|s| s.previous.is_some()));
    let settings = settings_of(&mut store).expect("kept");
    assert_eq!((settings.regulator.line_s, settings.pressure_band_pa), (4.5e-3, 1_234.0));
    let mut remembered = std::vec::Vec::new();
    store.each_memory(Side::Agonist, &mut |_, one| remembered.push(*one)).expect("readable");
    assert_eq!(remembered, memories());
    assert_eq!(store.past_fault(0), Ok(Some(report())));
    assert_eq!(store.count_start(), Ok(2));
}

/// Flashes that older firmware wrote: settings are taken over field by field, those that it did not know are the board's own. Tables,
/// faults and starts have kept their layout.
#[test]
fn settings_of_older_formats_are_taken_over_field_by_field() {
    let formats = [
        (include_str!("fixtures/format-2.txt"), 0.0, 77),
        (include_str!("fixtures/format-3.txt"), 4.5e-3, 77),
        (include_str!("fixtures/format-4.txt"), 4.5e-3, 10_000),
    ];
    for (fixture, line_s, hold_ticks) in formats {
        let mut store = open(flash_of(fixture));
        let mut settings = Settings::default();
        settings.watch.hold_ticks = 77;
        settings.watch.armed_silence_ticks = 7_777;
        assert_eq!(store.settings(&mut settings), Ok(Kept::Older));
        assert_eq!((settings.regulator.line_s, settings.pressure_band_pa), (line_s, 1_234.0));
        assert_eq!(settings.watch.hold_ticks, hold_ticks);
        assert_eq!(settings.watch.armed_silence_ticks, 7_777);
        assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&table(2)[..]));
        assert_eq!(store.past_fault(0), Ok(Some(report())));
        assert_eq!(store.count_start(), Ok(2));
        store.put_settings(&mut settings).expect("room");
        assert_eq!(settings_of(&mut store), Some(settings));
    }
}

/// Power fails while settings of an older layout are replaced by those of this one.
#[test]
fn a_migration_that_loses_power_leaves_the_older_settings_or_the_new() {
    for fixture in [include_str!("fixtures/format-3.txt"), include_str!("fixtures/format-4.txt")] {
        let mut store = open(flash_of(fixture));
        let mut settings = Settings::default();
        assert_eq!(store.settings(&mut settings), Ok(Kept::Older));
        let before = store.close();
        let cuts = cut_everywhere(
            &before,
            |store| store.put_settings(&mut { settings }).is_ok(),
            |store, left| assert_eq!(settings_of(store), Some(settings), "after {left} words"),
        );
        assert!(cuts > 50, "{cuts} cuts tried");
    }
}

/// Every bit of settings of the layout before: a wrong one is noticed there, too.
#[test]
fn settings_of_the_layout_before_of_which_a_bit_is_wrong_are_not_trusted() {
    let flash = flash_of(include_str!("fixtures/format-4.txt"));
    let mut store = open(flash.clone());
    let mut settings = Settings::default();
    assert_eq!(store.settings(&mut settings), Ok(Kept::Older));
    let bytes = store.bytes(0x33).expect("readable").expect("kept").to_vec();
    let place = flash.bytes.windows(bytes.len()).position(|w| w == bytes).expect("they are there");
    for bit in 0..8 * bytes.len() {
        let mut damaged = flash.clone();
        damaged.bytes[place + bit / 8] ^= 1 << (bit % 8);
        let mut settings = Settings::default();
        assert_eq!(open(damaged).settings(&mut settings), Ok(Kept::Untrusted), "bit {bit}");
        assert_eq!(settings, Settings::default());
    }
}

/// Every bit of the kept settings: whichever is flipped, neither the settings before nor the board's own come into force unseen.
#[test]
fn settings_of_which_a_bit_is_wrong_are_not_trusted() {
    let mut store = open(MockFlash::erased());
    let older = Settings::default();
    let mut newer = older;
    newer.limits.pressure_pa = 250e3;
    for settings in [older, newer] {
        store.put_settings(&mut { settings }).expect("room");
    }
    let flash = store.close();
    let mut bytes = [0; 400];
    let length = fields::write(&mut newer, &mut bytes).expect("room");
    let place = flash.bytes.windows(length).position(|w| w == &bytes[..length]).expect("they are there");
    for bit in 0..8 * length {
        let mut damaged = flash.clone().powered(usize::MAX, 0);
        damaged.bytes[place + bit / 8] ^= 1 << (bit % 8);
        let mut settings = Settings::default();
        assert_eq!(open(damaged).settings(&mut settings), Ok(Kept::Untrusted), "bit {bit}");
        assert_eq!(settings, Settings::default());
    }
}

#[test]
fn settings_that_are_gone_or_of_a_newer_layout_are_not_trusted() {
    let mut settings = Settings::default();
    let mut lost = open(MockFlash::erased());
    assert_eq!(lost.settings(&mut settings), Ok(Kept::None), "a new device");
    lost.put_value(0x3F, &mut { FORMAT }).expect("room");
    assert_eq!(lost.settings(&mut settings), Ok(Kept::Untrusted), "gone");
    lost.put_settings(&mut settings).expect("room");
    assert_eq!(lost.settings(&mut settings), Ok(Kept::Whole), "confirmed");
    lost.put_value(0x3F, &mut { FORMAT + 1 }).expect("room");
    assert_eq!(lost.settings(&mut settings), Ok(Kept::Untrusted), "a newer firmware's");
}
