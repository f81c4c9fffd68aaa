//! Decodes text files of instruments and tools: UTF-8, UTF-16 by its byte order mark, or else Latin-1 (ISO 8859-1).
//!
//! ```
//! use text_encoding::{ByteOrder, decode_text, decode_utf16};
//!
//! assert_eq!(decode_text("°C".as_bytes()), "°C");
//! assert_eq!(decode_text(b"\xb0C"), "°C");
//! assert_eq!(decode_text(b"\xff\xfe\xb0\0C\0"), "°C");
//! assert_eq!(decode_utf16(b"\0\xb0\0C", ByteOrder::BigEndian), "°C");
//! ```

#![forbid(unsafe_code)]

use std::borrow::Cow;

/// The byte order mark of UTF-8.
pub const UTF8_MARK: &[u8] = b"\xef\xbb\xbf";

/// The order of the two bytes of a UTF-16 code unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// The lowest byte first.
    LittleEndian,
    /// The highest byte first.
    BigEndian,
}

impl ByteOrder {
    /// The order that a byte order mark of UTF-16 shows, and the bytes behind the mark.
    #[must_use]
    pub fn from_mark(bytes: &[u8]) -> Option<(Self, &[u8])> {
        match bytes {
            [0xff, 0xfe, rest @ ..] => Some((Self::LittleEndian, rest)),
            [0xfe, 0xff, rest @ ..] => Some((Self::BigEndian, rest)),
            _ => None,
        }
    }

    /// The code unit of two bytes.
    #[must_use]
    pub fn code_unit(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::LittleEndian => u16::from_le_bytes(bytes),
            Self::BigEndian => u16::from_be_bytes(bytes),
        }
    }
}

/// A text in UTF-16 with its byte order mark, in UTF-8, or else in Latin-1. A mark of UTF-8 stays as U+FEFF.
#[must_use]
pub fn decode_text(bytes: &[u8]) -> Cow<'_, str> {
    match ByteOrder::from_mark(bytes) {
        Some((order, rest)) => Cow::Owned(decode_utf16(rest, order)),
        None => utf8_or_latin1(bytes),
    }
}

/// A text in UTF-8; bytes that are not UTF-8 as a whole are Latin-1.
#[must_use]
pub fn utf8_or_latin1(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(decode_latin1(bytes)),
    }
}

/// A text in Latin-1: each byte is the character of its number.
#[must_use]
pub fn decode_latin1(bytes: &[u8]) -> String {
    bytes.iter().copied().map(char::from).collect()
}

/// A text in UTF-16. A surrogate without its other half is U+FFFD, and a single byte at the end is left out.
#[must_use]
pub fn decode_utf16(bytes: &[u8], order: ByteOrder) -> String {
    utf16_units(bytes.as_chunks().0.iter().map(|pair| order.code_unit(*pair)))
}

/// The text of UTF-16 code units. A surrogate without its other half is U+FFFD.
pub fn utf16_units(units: impl IntoIterator<Item = u16>) -> String {
    char::decode_utf16(units).map(|it| it.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// A text in UTF-16; nothing where a surrogate lacks its other half, or a single byte is left over.
#[must_use]
pub fn strict_utf16(bytes: &[u8], order: ByteOrder) -> Option<String> {
    let (pairs, rest) = bytes.as_chunks();
    let text: Result<String, _> =
        char::decode_utf16(pairs.iter().map(|pair| order.code_unit(*pair))).collect();
    text.ok().filter(|_| rest.is_empty())
}

/// The character of a byte in Windows-1252, which has letters where ISO 8859-1 has the control characters 0x80 to 0x9F. As in the
/// WHATWG encoding standard, five bytes without a letter are the control characters.
#[must_use]
pub fn windows1252_char(byte: u8) -> char {
    const LETTERS: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}',
        '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => LETTERS[usize::from(byte - 0x80)],
        byte => char::from(byte),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_choose_the_order_and_text_without_a_mark_is_utf_8_or_latin_1() {
        assert_eq!(decode_text("ä\u{1f697}".as_bytes()), "ä\u{1f697}");
        assert_eq!(decode_text(b"\xe4"), "ä");
        assert_eq!(decode_text(b"\xfe\xff\xd8\x3d\xde\x97"), "\u{1f697}");
        assert_eq!(decode_text(b"\xff\xfea\0b"), "a", "half a code unit");
        assert_eq!(decode_text(b"\xff\xfe\x3d\xd8a\0"), "\u{fffd}a", "half a letter");
        assert_eq!(decode_text(b"\xef\xbb\xbfa"), "\u{feff}a");
        assert_eq!(decode_text(b""), "");
    }

    #[test]
    fn strict_utf_16_refuses_halves() {
        let strict = |bytes| strict_utf16(bytes, ByteOrder::LittleEndian);
        assert_eq!(strict(b"a\0"), Some("a".to_owned()));
        assert_eq!(strict(b"a\0b"), None);
        assert_eq!(strict(b"\x3d\xd8"), None);
    }

    #[test]
    fn windows_1252_differs_from_latin_1_in_32_bytes_at_most() {
        assert_eq!(windows1252_char(0x80), '€');
        assert_eq!(windows1252_char(0x81), '\u{81}');
        assert_eq!(windows1252_char(0xe4), 'ä');
    }
}
