#![no_main]

#[path = "../entries.rs"]
mod entries;

libfuzzer_sys::fuzz_target!(init: entries::tolerate_caught_panics(), |bytes: &[u8]| entries::reader(bytes));
