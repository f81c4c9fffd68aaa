//! Decodes the bytes of a file: UTF-8, UTF-16 or Latin-1.

use text_encoding::{ByteOrder, utf8_or_latin1};
use tire::Coefficients;

use crate::{TireFileErrors, TireFileMessage, read_tir};

/// The text of a file in UTF-8, in UTF-16, which its first bytes tell, or else in Latin-1, as instruments write it.
pub fn decode_text(bytes: &[u8]) -> String {
    if let Some(text) = decode_utf16(bytes) {
        return text;
    }
    utf8_or_latin1(bytes).into_owned()
}

/// A text in UTF-16, with a byte order mark or with a letter of ASCII at its begin.
fn decode_utf16(bytes: &[u8]) -> Option<String> {
    let (order, rest) = ByteOrder::from_mark(bytes).or(match bytes {
        [1..=0x7f, 0, 1..=0x7f, 0, ..] => Some((ByteOrder::LittleEndian, bytes)),
        [0, 1..=0x7f, 0, 1..=0x7f, ..] => Some((ByteOrder::BigEndian, bytes)),
        _ => None,
    })?;
    Some(text_encoding::decode_utf16(rest, order))
}

/// [`read_tir`] of the bytes of a file.
///
/// # Errors
/// As [`read_tir`], and when it is no text.
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<(Coefficients, Vec<TireFileMessage>), TireFileErrors> {
    let (coefficients, mut messages) = read_tir(&decode_text(bytes), name)?;
    if decode_utf16(bytes).is_some() {
        messages.push(TireFileMessage::note(None, "the file is in UTF-16: other programs may want UTF-8"));
    }
    Ok((coefficients, messages))
}
