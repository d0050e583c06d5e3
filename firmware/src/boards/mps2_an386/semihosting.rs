//! Files and the end of the run through the debugger's calls, which QEMU answers.

use cortex_m_semihosting::{debug, nr, syscall};

/// Mode `r+b` of the specification.
const READ_WRITE: usize = 3;
/// Mode `w+b`.
const CREATE: usize = 7;

/// A file of the host.
pub struct File(usize);

impl File {
    /// Opens a file, or makes an empty one. The name must end with a zero byte.
    pub fn open(name: &core::ffi::CStr) -> Option<Self> {
        let length = name.to_bytes().len();
        for mode in [READ_WRITE, CREATE] {
            // SAFETY: the name lives through the call and its length is given without the closing zero, as specified.
            let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, length) };
            if handle != usize::MAX {
                return Some(Self(handle));
            }
        }
        None
    }

    /// Its length in bytes.
    pub fn length(&self) -> Option<usize> {
        // SAFETY: the handle came from `open`.
        let length = unsafe { syscall!(FLEN, self.0) };
        (length as isize >= 0).then_some(length)
    }

    fn seek(&self, position: usize) -> bool {
        // SAFETY: the handle came from `open`.
        unsafe { syscall!(SEEK, self.0, position) == 0 }
    }

    /// Reads all of `bytes` from a position.
    pub fn read(&self, position: usize, bytes: &mut [u8]) -> bool {
        // SAFETY: the buffer lives through the call, which writes at most its length.
        self.seek(position) && unsafe { syscall!(READ, self.0, bytes.as_mut_ptr(), bytes.len()) == 0 }
    }

    /// Writes all of `bytes` at a position.
    pub fn write(&self, position: usize, bytes: &[u8]) -> bool {
        // SAFETY: the buffer lives through the call, which only reads it.
        self.seek(position) && unsafe { syscall!(WRITE, self.0, bytes.as_ptr(), bytes.len()) == 0 }
    }
}

/// Writes text to the debugger's console.
pub fn print(text: &str) {
    let mut buffer = [0u8; 64];
    for piece in text.as_bytes().chunks(buffer.len() - 1) {
        buffer[..piece.len()].copy_from_slice(piece);
        buffer[piece.len()] = 0;
        // SAFETY: the text ends with a zero byte within the buffer.
        let _ = unsafe { cortex_m_semihosting::syscall1(nr::WRITE0, buffer.as_ptr() as usize) };
    }
}

/// Ends the emulator with failure.
pub fn fail() -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
