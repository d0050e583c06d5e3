//! The check sum of frames, images and files: CRC-32 (ISO-HDLC), as in Ethernet and zip.

/// The generator polynomial `x³² + x²⁶ + … + 1`, its bits in the order in which they come over a wire.
const POLYNOMIAL: u32 = 0xEDB8_8320;

/// What half a byte does to the remainder: 64 bytes of flash instead of the 1024 of a table of whole bytes, and two steps a byte.
static HALVES: [u32; 16] = {
    let mut table = [0; 16];
    let mut half = 0;
    while half < 16 {
        let mut remainder = half as u32;
        let mut bit = 0;
        while bit < 4 {
            remainder = if remainder & 1 == 0 { remainder >> 1 } else { remainder >> 1 ^ POLYNOMIAL };
            bit += 1;
        }
        table[half] = remainder;
        half += 1;
    }
    table
};

/// A CRC-32 that is taken piece by piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Digest(u32);

impl Digest {
    /// Takes the next bytes.
    #[inline(never)]
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 ^= u32::from(byte);
            for _ in 0..2 {
                self.0 = self.0 >> 4 ^ HALVES[(self.0 & 0xF) as usize];
            }
        }
    }

    /// The check sum of all that was taken.
    pub(crate) fn finalize(self) -> u32 {
        !self.0
    }
}

/// CRC-32 of some bytes.
///
/// ```
/// // The check value of the catalogue of parametrised CRC algorithms.
/// assert_eq!(model_core::check::crc32(b"123456789"), 0xCBF4_3926);
/// ```
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut digest = begin();
    digest.update(bytes);
    digest.finalize()
}

/// Begins one that is taken piece by piece.
pub(crate) fn begin() -> Digest {
    Digest(u32::MAX)
}

/// The check sum by which host and controller know a whole image: of its last four bytes, followed by all before them.
///
/// An image ends in the CRC-32 of what stands before. In that order every image would have the same CRC-32.
///
/// ```
/// use model_core::check::{crc32, of_image};
/// let image = |body: &[u8]| [body, &crc32(body).to_le_bytes()].concat();
/// let (one, other) = (image(b"one table"), image(b"another table"));
/// assert_eq!(crc32(&one), crc32(&other));
/// assert_ne!(of_image(&one), of_image(&other));
/// ```
#[must_use]
pub fn of_image(image: &[u8]) -> u32 {
    let (content, end) = image.split_at(image.len().saturating_sub(4));
    let mut digest = begin();
    digest.update(end);
    digest.update(content);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_that_of_the_crate_of_crcs_however_it_is_cut() {
        let reference = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
        let bytes: [u8; 300] = core::array::from_fn(|n| (n * n * 31 + 7 * n) as u8);
        for end in 0..bytes.len() {
            let expected = reference.checksum(&bytes[..end]);
            assert_eq!(crc32(&bytes[..end]), expected);
            let (front, back) = bytes[..end].split_at(end / 3);
            let mut digest = begin();
            digest.update(front);
            digest.update(back);
            assert_eq!(digest.finalize(), expected);
        }
    }
}
