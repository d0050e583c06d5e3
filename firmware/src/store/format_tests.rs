//! Flashes of this layout and of older ones, and settings that cannot be trusted.

use model_core::link::messages::{Mode, SideSample, State};
use model_core::link::settings::Settings;

use super::mock_flash::MockFlash;
use super::tests::{counted, cut_everywhere, kept, open, place_of, settings_of, table};
use super::*;

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
    counted(&mut store);
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
fn stored_data_of_this_format_are_read_and_written_alike() {
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
    assert_eq!(counted(&mut store), 2);
}

/// Flashes that older firmware wrote: settings are taken over field by field, those that it did not know are the board's own. Tables,
/// faults and starts have kept their layout.
#[test]
fn settings_of_older_formats_are_taken_over_field_by_field() {
    let formats = [
        (include_str!("fixtures/format-2.txt"), 0.0, 77, 7_777, 7.0),
        (include_str!("fixtures/format-3.txt"), 4.5e-3, 77, 7_777, 7.0),
        (include_str!("fixtures/format-4.txt"), 4.5e-3, 10_000, 7_777, 7.0),
        (include_str!("fixtures/format-5.txt"), 4.5e-3, 10_000, 60_000, 7.0),
        (include_str!("fixtures/format-6.txt"), 4.5e-3, 10_000, 60_000, 1.0),
        (include_str!("fixtures/format-7.txt"), 4.5e-3, 10_000, 60_000, 1.0),
    ];
    for (fixture, line_s, hold_ticks, armed_silence_ticks, per_unit) in formats {
        let mut store = open(flash_of(fixture));
        let mut settings = Settings::default();
        settings.watch.hold_ticks = 77;
        settings.watch.armed_silence_ticks = 7_777;
        settings.scales.force.per_unit = 7.0;
        settings.command.full_pa = 777e3;
        settings.watch.supply_low_pa = 77.0;
        settings.valves.supply_pa = 777e3;
        settings.can.address = 7;
        assert_eq!(store.settings(&mut settings), Ok(Kept::Older));
        assert_eq!((settings.regulator.line_s, settings.pressure_band_pa), (line_s, 1_234.0));
        assert_eq!(settings.watch.hold_ticks, hold_ticks);
        assert_eq!(settings.watch.armed_silence_ticks, armed_silence_ticks);
        // Older firmware had the scales of its board.
        let (full_pa, supply_low_pa) = if per_unit == 1.0 { (2e6, 0.0) } else { (777e3, 77.0) };
        assert_eq!((settings.scales.force.per_unit, settings.command.full_pa), (per_unit, full_pa));
        let supply_pa = if fixture == include_str!("fixtures/format-7.txt") { 700e3 } else { 777e3 };
        assert_eq!((settings.watch.supply_low_pa, settings.valves.supply_pa), (supply_low_pa, supply_pa));
        assert_eq!(settings.can.address, 7);
        assert_eq!(kept(&mut store, Side::Agonist).as_deref(), Some(&table(2)[..]));
        assert_eq!(store.past_fault(0), Ok(Some(report())));
        assert_eq!(counted(&mut store), 2);
        store.put_settings(&mut settings).expect("room");
        assert_eq!(settings_of(&mut store), Some(settings));
    }
}

/// Power fails while settings of an older layout are replaced by those of this one.
#[test]
fn a_migration_that_loses_power_leaves_the_older_settings_or_the_new() {
    for fixture in [
        include_str!("fixtures/format-3.txt"),
        include_str!("fixtures/format-4.txt"),
        include_str!("fixtures/format-5.txt"),
        include_str!("fixtures/format-6.txt"),
        include_str!("fixtures/format-7.txt"),
    ] {
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
    let flash = flash_of(include_str!("fixtures/format-7.txt"));
    let mut store = open(flash.clone());
    let mut settings = Settings::default();
    assert_eq!(store.settings(&mut settings), Ok(Kept::Older));
    let bytes = store.bytes(0x37).expect("readable").expect("kept").to_vec();
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
    let place = place_of(&flash, &mut newer);
    for bit in 0..8 * place.len() {
        let mut damaged = flash.clone().powered(usize::MAX, 0);
        damaged.bytes[place.start + bit / 8] ^= 1 << (bit % 8);
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

/// Whole settings of the layout before, which are not those that were last confirmed: limits of long ago, for instance.
#[test]
fn settings_of_the_layout_before_that_the_seal_does_not_name_are_not_trusted() {
    let mut store = open(flash_of(include_str!("fixtures/format-6.txt")));
    let mut bytes = store.bytes(0x36).expect("readable").expect("kept").to_vec();
    *bytes.last_mut().expect("a byte") ^= 1;
    store.put_bytes(0x36, &bytes).expect("room");
    let mut settings = Settings::default();
    assert_eq!(store.settings(&mut settings), Ok(Kept::Untrusted));
    assert_eq!(settings, Settings::default());
}
