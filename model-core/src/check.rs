//! The check sum of frames, images and files: CRC-32 (ISO-HDLC), as in Ethernet and zip.

use crc::{CRC_32_ISO_HDLC, Crc, Digest};

/// With a look-up table of 1 KiB: telemetry needs it a thousand times a second.
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// CRC-32 of some bytes.
///
/// ```
/// // The check value of the catalogue of parametrised CRC algorithms.
/// assert_eq!(model_core::check::crc32(b"123456789"), 0xCBF4_3926);
/// ```
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// A CRC-32 that is taken piece by piece.
pub(crate) fn begin() -> Digest<'static, u32> {
    CRC.digest()
}

/// The check sum by which host and controller know a whole image: of its last four bytes, followed by all before them.
///
/// An image ends in the CRC-32 of what stands before. In that order every image would have one and the same CRC-32.
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
