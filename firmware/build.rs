//! Picks the memory map of the board that is built.
//!
//! The emulated board's map is the top level's `memory.x`, which cortex-m-rt's script finds because cargo links there. Any other
//! board is linked by a script of its own: a second `memory.x` would never be looked at.

use std::{env, error::Error, fs, path::PathBuf};

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
        println!("cargo:rustc-link-arg-bins=-Tnucleo-f446re.x");
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
