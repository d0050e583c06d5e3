//! Where each board's image lies: its vector table, its initial stack pointer and all it loads, against the board's memory map.

use std::path::Path;

use emulator_tests::machine;
use object::{Object, ObjectSegment, ObjectSymbol};

/// A region of a memory map, as `ORIGIN = …, LENGTH = …` of a linker script says.
struct Region {
    origin: u64,
    length: u64,
}

fn number(text: &str) -> u64 {
    // `4M - 16` is a product and a difference.
    text.split('-')
        .map(|part| {
            let part = part.trim();
            let (digits, unit) = match part.as_bytes().last() {
                Some(b'K') => (&part[..part.len() - 1], 1 << 10),
                Some(b'M') => (&part[..part.len() - 1], 1 << 20),
                _ => (part, 1),
            };
            unit * digits.strip_prefix("0x").map_or_else(
                || digits.parse::<u64>().expect("a decimal number"),
                |hex| u64::from_str_radix(hex, 16).expect("a hexadecimal number"),
            )
        })
        .reduce(|whole, less| whole - less)
        .expect("a number")
}

fn region(map: &str, name: &str) -> Region {
    let line = map.lines().find(|line| line.trim().starts_with(name)).expect("the region is in the map");
    let value = |key: &str| {
        let after = line.split_once(key).expect("the map says it").1;
        number(after.trim_start_matches([' ', '=']).split(',').next().expect("a value"))
    };
    Region { origin: value("ORIGIN"), length: value("LENGTH") }
}

impl Region {
    fn holds(&self, address: u64) -> bool {
        address >= self.origin && address <= self.origin + self.length
    }
}

fn word(elf: &object::File<'_>, address: u64) -> u32 {
    elf.segments()
        .find_map(|segment| segment.data_range(address, 4).ok().flatten())
        .map(|bytes| u32::from_le_bytes(bytes.try_into().expect("four bytes")))
        .expect("the address is loaded")
}

fn check(image: &Path, map: &str) {
    let bytes = std::fs::read(image).expect("an image");
    let elf = object::File::parse(&*bytes).expect("an image");
    let (flash, ram) = (region(map, "FLASH"), region(map, "RAM"));
    // The Nucleo's image brings its boot loader and the words of its slot.
    let more =
        ["BOOT ", "SLOT "].into_iter().filter(|name| map.lines().any(|line| line.trim().starts_with(name)));
    let more: Vec<Region> = more.map(|name| region(map, name)).collect();
    let table = elf.symbols().find(|symbol| symbol.name() == Ok("__vector_table"));
    let table = table.expect("it has a vector table").address();
    assert_eq!(table, flash.origin, "{}: the vector table lies at {table:#x}", image.display());
    let (stack, reset) = (u64::from(word(&elf, table)), u64::from(word(&elf, table + 4)));
    assert!(stack > ram.origin && ram.holds(stack), "the stack begins at {stack:#x}");
    assert!(stack.is_multiple_of(8), "the stack begins at {stack:#x}");
    assert!(reset & 1 == 1 && flash.holds(reset), "the reset vector is {reset:#x}");
    for segment in elf.segments().filter(|segment| segment.size() > 0) {
        let (from, to) = (segment.address(), segment.address() + segment.size());
        let inside = |region: &Region| region.holds(from) && region.holds(to);
        let there = inside(&flash) || inside(&ram) || more.iter().any(inside);
        assert!(there, "a segment lies at {from:#x} to {to:#x}");
    }
}

#[test]
fn each_image_lies_at_the_addresses_of_its_boards_map() {
    let (Ok(emulated), Ok(nucleo)) = (machine::image(), machine::nucleo_image()) else { return };
    check(&emulated, include_str!("../../../memory.x"));
    check(&nucleo, include_str!("../../../firmware/memory/nucleo-f446re.x"));
}

/// The table that the tests of the Nucleo's image send. `TABLE=overwrite` rewrites it.
#[test]
fn the_tests_of_the_nucleo_send_the_example_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../nucleo/example-table.bin");
    let image = emulator_tests::image_of(&model_core::table::example());
    if std::env::var_os("TABLE").is_some_and(|value| value == "overwrite") {
        std::fs::write(&path, &image).expect("a file");
    }
    assert_eq!(std::fs::read(&path).expect("the table's file"), image);
}
