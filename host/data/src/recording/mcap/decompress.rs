//! Chunks that are compressed by zstd or LZ4.

use std::io::Read;

use crate::mcap_records::{Chunk, LARGEST};

/// The records of a chunk; the reason where there are none.
pub(super) fn records(chunk: &Chunk<'_>) -> Result<Vec<u8>, String> {
    if chunk.uncompressed > LARGEST {
        return Err(format!("a chunk announces {} bytes", chunk.uncompressed));
    }
    let mut out = Vec::new();
    let damaged = |e: &dyn std::fmt::Display| format!("a chunk cannot be decompressed ({e})");
    // Grows with what is there; one byte more than announced shows that the announcement is wrong.
    let most = chunk.uncompressed + 1;
    match chunk.compression {
        "zstd" => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(chunk.records).map_err(|e| damaged(&e))?;
            decoder.take(most).read_to_end(&mut out).map_err(|e| damaged(&e))?;
        }
        "lz4" => {
            let decoder = lz4_flex::frame::FrameDecoder::new(chunk.records);
            decoder.take(most).read_to_end(&mut out).map_err(|e| damaged(&e))?;
        }
        other => return Err(format!("its chunks are compressed by `{other}`, which is not known")),
    }
    if out.len() as u64 != chunk.uncompressed {
        return Err("a chunk decompresses to another length than it announces".into());
    }
    Ok(out)
}
