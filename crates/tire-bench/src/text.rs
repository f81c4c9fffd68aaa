//! Makes text of the bytes of a file: unpacked, and decoded from UTF-8, UTF-16 or Latin-1.

use std::borrow::Cow;
use std::io::Read as _;

use flate2::read::MultiGzDecoder;

/// The most bytes of an unpacked file [B].
const LIMIT: u64 = 1 << 30;

/// Unpacks gzip, which its first bytes tell; other bytes are left as they are.
///
/// # Errors
/// With the reason, when the file is damaged or larger than it may be.
pub(crate) fn gunzip_if_compressed(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(Cow::Borrowed(bytes));
    }
    let mut found = Vec::new();
    let mut decoder = MultiGzDecoder::new(bytes).take(LIMIT + 1);
    decoder.read_to_end(&mut found).map_err(|error| format!("cannot be unpacked: {error}"))?;
    if found.len() as u64 > LIMIT {
        return Err(format!("expected at most {LIMIT} bytes when it is unpacked, found more"));
    }
    Ok(Cow::Owned(found))
}

/// The text of a file. What is no UTF-8 is read as Latin-1, as old programs write it.
pub(crate) fn decode_text(bytes: &[u8]) -> Cow<'_, str> {
    match bytes.strip_prefix(text_encoding::UTF8_MARK) {
        Some(rest) => text_encoding::utf8_or_latin1(rest),
        None => text_encoding::decode_text(bytes),
    }
}

/// Lines with their numbers from 1, whether they end as on Unix, Windows or old Macs.
pub(crate) fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    let old_mac = !text.contains('\n');
    let lines = text.split(move |it| it == '\n' || old_mac && it == '\r');
    lines.map(|it| it.trim_end_matches('\r')).enumerate().map(|(k, it)| (k + 1, it))
}
