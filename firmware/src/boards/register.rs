//! Memory-mapped registers.

/// One 32-bit register.
#[derive(Clone, Copy)]
pub struct Register(*mut u32);

impl Register {
    /// The register at an address of the board's memory map.
    pub const fn at(address: usize) -> Self {
        Self(address as *mut u32)
    }

    /// Reads it.
    pub fn read(self) -> u32 {
        // SAFETY: the addresses used in this board's modules are registers of its memory map, always mapped and aligned.
        unsafe { self.0.read_volatile() }
    }

    /// Writes it.
    pub fn write(self, value: u32) {
        // SAFETY: as above; these registers change nothing that Rust's memory model knows of.
        unsafe { self.0.write_volatile(value) }
    }

    /// Sets bits of it.
    #[allow(dead_code, reason = "not every board needs it")]
    pub fn set(self, bits: u32) {
        self.write(self.read() | bits);
    }
}
