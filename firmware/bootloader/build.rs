//! Links the boot loader with the memory map of its board.

use std::{env, error::Error, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        let maps = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("../memory");
        println!("cargo:rerun-if-changed={}", maps.display());
        println!("cargo:rustc-link-search={}", maps.display());
        println!("cargo:rustc-link-search={}", env::var("OUT_DIR")?);
        // It uses no interrupt of the chip.
        std::fs::write(PathBuf::from(env::var("OUT_DIR")?).join("device.x"), "")?;
        println!("cargo:rustc-link-arg-bins=-Tnucleo-f446re-boot.x");
        println!("cargo:rustc-link-arg-bins=--nmagic");
    }
    Ok(())
}
