//! Decompresses what rosbag2 compressed with zstd: whole files, or each message.

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::Path;

use tempfile::NamedTempFile;

use crate::Error;

/// How a frame of zstd begins; messages in CDR begin with a zero.
const MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
/// A message that would take more memory than this [B] is not read.
const LARGEST: u64 = 256 << 20;

/// Whether bytes are packed.
#[must_use]
pub fn is_compressed(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

/// A message as it was before it was packed.
///
/// # Errors
/// When it cannot be unpacked, or is too large.
pub fn decompress_message(message: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    if !is_compressed(message) {
        return Ok(Cow::Borrowed(message));
    }
    let wrong = |error: std::io::Error| format!("it is packed with zstd, and cannot be unpacked: {error}");
    let decoder = zstd::stream::read::Decoder::with_buffer(message).map_err(wrong)?;
    let mut bytes = Vec::new();
    decoder.take(LARGEST + 1).read_to_end(&mut bytes).map_err(wrong)?;
    match bytes.len() as u64 > LARGEST {
        true => Err(format!("it is packed with zstd, and has more than {LARGEST} bytes")),
        false => Ok(Cow::Owned(bytes)),
    }
}

/// A file as it was before it was packed, in a new one that vanishes.
///
/// # Errors
/// When it cannot be unpacked, or the new one cannot be written.
pub fn decompress_file(path: &Path) -> Result<NamedTempFile, Error> {
    let mut file = NamedTempFile::new()?;
    let packed = BufReader::new(File::open(path)?);
    let mut decoder = zstd::stream::read::Decoder::with_buffer(packed)?;
    std::io::copy(&mut decoder, file.as_file_mut()).map_err(|error| {
        Error::new(format!(
            "it is packed with zstd, and cannot be unpacked to {}: {error}",
            file.path().display()
        ))
    })?;
    Ok(file)
}
