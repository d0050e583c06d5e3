//! Writes `docs/figures/controller.md`: instructions, memory and precision of the controller.

use std::io;
use std::path::Path;

use emulator_tests::figures::memory::{self, sizes, stack};
use emulator_tests::figures::{self, count, precisions, reference_error};

fn main() -> io::Result<()> {
    let (Ok(counted), Ok(sizes), Ok(stack)) = (count(), sizes(), stack()) else { return Ok(()) };
    let text = figures::markdown(&counted)
        + &memory::markdown(&sizes, stack)
        + &figures::precision_markdown(&precisions(), reference_error());
    print!("{text}");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/figures");
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("controller.md"), text)
}
