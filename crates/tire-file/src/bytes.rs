//! Decodes the bytes of a file: UTF-8, UTF-16 or Latin-1.

use tire::Coefficients;

use crate::{Errors, Message, read};

/// The text of a file in UTF-8, in UTF-16, which its first bytes tell, or else in Latin-1, as instruments write it.
pub fn decode(bytes: &[u8]) -> String {
    if let Some(text) = utf16(bytes) {
        return text;
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().copied().map(char::from).collect(),
    }
}

/// A text in UTF-16, with a byte order mark or with a letter of ASCII at its begin.
fn utf16(bytes: &[u8]) -> Option<String> {
    let (rest, word): (_, fn([u8; 2]) -> u16) = match bytes {
        [0xff, 0xfe, rest @ ..] => (rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => (rest, u16::from_be_bytes),
        [1..=0x7f, 0, 1..=0x7f, 0, ..] => (bytes, u16::from_le_bytes),
        [0, 1..=0x7f, 0, 1..=0x7f, ..] => (bytes, u16::from_be_bytes),
        _ => return None,
    };
    let units = rest.chunks_exact(2).map(|pair| word([pair[0], pair[1]]));
    Some(char::decode_utf16(units).map(|letter| letter.unwrap_or('\u{fffd}')).collect())
}

/// [`read`] of the bytes of a file.
///
/// # Errors
/// As [`read`], and when it is no text.
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<(Coefficients, Vec<Message>), Errors> {
    let (coefficients, mut messages) = read(&decode(bytes), name)?;
    if utf16(bytes).is_some() {
        messages.push(Message::note(None, "the file is in UTF-16: other programs may want UTF-8"));
    }
    Ok((coefficients, messages))
}
