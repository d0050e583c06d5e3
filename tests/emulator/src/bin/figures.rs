//! Writes `docs/figures/controller.md`: instructions per call on the emulated controller.

use std::io;
use std::path::Path;

fn main() -> io::Result<()> {
    let Ok(figures) = emulator_tests::figures::count() else { return Ok(()) };
    let text = emulator_tests::figures::markdown(&figures);
    print!("{text}");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/figures");
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("controller.md"), text)
}
