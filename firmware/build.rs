//! Picks the memory map of the board that is built.
//!
//! The emulated board's map is the top level's `memory.x`, which cortex-m-rt's script finds because cargo links there. Any other
//! board is linked by a script of its own: a second `memory.x` would never be read.

use std::path::{Path, PathBuf};
use std::{env, error::Error, fs};

/// Where the flash of the Nucleo begins.
const FLASH: usize = 0x0800_0000;

/// Takes the bytes of the boot loader out of its ELF file (32 bits, little-endian): the segments that are loaded, at their places.
fn embed_bootloader(out: &Path) -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-env-changed=PAM_BOOTLOADER");
    let path = env::var("PAM_BOOTLOADER").map_err(|_| "PAM_BOOTLOADER is not set; use firmware/build")?;
    println!("cargo:rerun-if-changed={path}");
    let elf = fs::read(&path).map_err(|error| format!("{path}: {error}"))?;
    let word = |at: usize| elf.get(at..at + 4).map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]]) as usize);
    let half = |at: usize| elf.get(at..at + 2).map(|w| usize::from(u16::from_le_bytes([w[0], w[1]])));
    let bytes = (|| {
        let (table, size, count) = (word(28)?, half(42)?, half(44)?);
        let mut bytes = Vec::new();
        for at in (0..count).map(|n| table + n * size) {
            let (kind, from, address, length) = (word(at)?, word(at + 4)?, word(at + 12)?, word(at + 16)?);
            if kind == 1 && length > 0 {
                let place = address.checked_sub(FLASH)?;
                bytes.resize(bytes.len().max(place + length), 0xFF);
                bytes[place..place + length].copy_from_slice(elf.get(from..from + length)?);
            }
        }
        Some(bytes)
    })();
    let bytes = bytes
        .filter(|bytes| !bytes.is_empty())
        .ok_or(format!("{path}: not the ELF file of a boot loader"))?;
    Ok(fs::write(out.join("bootloader.bin"), bytes)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let here = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let chosen = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    if chosen("NUCLEO_F446RE") {
        let maps = here.join("memory");
        println!("cargo:rerun-if-changed={}", maps.display());
        println!("cargo:rustc-link-search={}", maps.display());
        let map = if chosen("SLOT_B") { "nucleo-f446re-b.x" } else { "nucleo-f446re.x" };
        println!("cargo:rustc-link-arg-bins=-T{map}");
        if !chosen("SLOT_B") {
            embed_bootloader(&out)?;
        }
    } else {
        let map = here.join("../memory.x");
        println!("cargo:rerun-if-changed={}", map.display());
        fs::copy(&map, out.join("memory.x"))?;
        // The interrupts of this board are in the program itself, so the linker needs no list of their names.
        fs::write(out.join("device.x"), "")?;
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
    }
    println!("cargo:rustc-link-arg-bins=--nmagic");
    // Functions of the same instructions once.
    println!("cargo:rustc-link-arg-bins=--icf=all");
    if chosen("LOG") {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    Ok(())
}
