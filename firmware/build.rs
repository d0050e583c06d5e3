//! Picks the memory map of the board that is built.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let here = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let chosen = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let map = if chosen("NUCLEO_F446RE") {
        here.join("memory/nucleo-f446re.x")
    } else {
        // The interrupts of this board are in the program itself, so the linker needs no list of their names.
        fs::write(out.join("device.x"), "")?;
        here.join("../memory.x")
    };
    println!("cargo:rerun-if-changed={}", map.display());
    fs::copy(&map, out.join("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // Functions of the same instructions once.
    println!("cargo:rustc-link-arg-bins=--icf=all");
    if chosen("LOG") {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    Ok(())
}
