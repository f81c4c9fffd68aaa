//! Takes values out of records: integers of any bits and either order of bytes, floating-point numbers, texts.

use crate::text::{decode_latin1, decode_utf8_or_latin1};

/// Where a value is in a record, and how it is stored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordField {
    /// Its first byte.
    pub byte: usize,
    /// The lowest bit within that.
    pub bit: u32,
    /// Its length.
    pub bits: u32,
    pub form: FieldFormat,
    /// Whether the highest byte comes first.
    pub big: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FieldFormat {
    Unsigned,
    Signed,
    Float,
    Text(TextEncoding),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextEncoding {
    Latin,
    Utf8,
    Utf16,
    /// A mark at the beginning tells it.
    Marked,
}

impl RecordField {
    /// The field of a channel, or why it cannot be read.
    pub fn new(kind: u8, [byte, bit, bits]: [u32; 3]) -> Result<Self, String> {
        let big = matches!(kind, 1 | 3 | 5 | 9);
        let form = match kind {
            0 | 1 => FieldFormat::Unsigned,
            2 | 3 => FieldFormat::Signed,
            4 | 5 => FieldFormat::Float,
            6 => FieldFormat::Text(TextEncoding::Latin),
            7 => FieldFormat::Text(TextEncoding::Utf8),
            8 | 9 => FieldFormat::Text(TextEncoding::Utf16),
            17 => FieldFormat::Text(TextEncoding::Marked),
            10 => return Err("bytes without a meaning".to_owned()),
            11 | 12 => return Err("media such as pictures or sound".to_owned()),
            13 | 14 => return Err("dates of CANopen".to_owned()),
            15 | 16 => return Err("complex numbers".to_owned()),
            other => return Err(format!("the unknown type of data {other}")),
        };
        let sound = match form {
            FieldFormat::Float => matches!(bits, 16 | 32 | 64),
            FieldFormat::Text(_) => bits % 8 == 0 && bit == 0,
            _ => (1..=64).contains(&bits),
        };
        if !sound || bit > 7 {
            return Err(format!("a value of {bits} bits from bit {bit} on, which its type does not have"));
        }
        Ok(Self { byte: byte as usize, bit, bits, form, big })
    }

    /// The bytes that it takes of a record.
    pub fn byte_length(&self) -> usize {
        (self.bit as usize + self.bits as usize).div_ceil(8)
    }

    /// Whether it is an integer that a double may round.
    pub fn is_wide(&self) -> bool {
        match self.form {
            FieldFormat::Unsigned => self.bits > 53,
            FieldFormat::Signed => self.bits > 54,
            _ => false,
        }
    }

    /// Whether its values are integers.
    pub fn is_integer(&self) -> bool {
        matches!(self.form, FieldFormat::Unsigned | FieldFormat::Signed)
    }

    pub fn is_text(&self) -> bool {
        matches!(self.form, FieldFormat::Text(_))
    }

    /// Its bits in a record, with zeros above.
    fn raw_bits(&self, record: &[u8]) -> u64 {
        let bytes = record.get(self.byte..).unwrap_or_default();
        let bytes = bytes.get(..self.byte_length()).unwrap_or_default();
        let add = |all: u128, byte: &u8| all << 8 | u128::from(*byte);
        let all = match self.big {
            true => bytes.iter().fold(0, add),
            false => bytes.iter().rev().fold(0, add),
        };
        (all >> self.bit) as u64 & (u64::MAX >> (64 - self.bits))
    }

    /// Its integer.
    pub fn decode_integer(&self, record: &[u8]) -> i128 {
        let raw = self.raw_bits(record);
        match self.form {
            FieldFormat::Signed => {
                let above = 64 - self.bits;
                i128::from((raw << above).cast_signed() >> above)
            }
            _ => i128::from(raw),
        }
    }

    /// Its number, as a double.
    pub fn decode_number(&self, record: &[u8]) -> f64 {
        match (self.form, self.bits) {
            (FieldFormat::Float, 64) => f64::from_bits(self.raw_bits(record)),
            (FieldFormat::Float, 32) => f64::from(f32::from_bits(self.raw_bits(record) as u32)),
            (FieldFormat::Float, _) => f16_to_f64(self.raw_bits(record) as u16),
            (FieldFormat::Unsigned, _) => self.raw_bits(record) as f64,
            (FieldFormat::Signed, _) => self.decode_integer(record) as f64,
            (FieldFormat::Text(_), _) => f64::NAN,
        }
    }

    /// Its text, of at most so many bytes.
    pub fn decode_text(&self, record: &[u8], most: usize) -> String {
        let bytes = record.get(self.byte..).unwrap_or_default();
        self.decode_text_bytes(&bytes[..bytes.len().min(self.byte_length()).min(most)])
    }

    /// The text of bytes, up to the first zero.
    pub fn decode_text_bytes(&self, bytes: &[u8]) -> String {
        let FieldFormat::Text(coding) = self.form else { return String::new() };
        let narrow = |bytes: &[u8]| bytes.iter().position(|it| *it == 0).unwrap_or(bytes.len());
        match coding {
            TextEncoding::Latin => decode_latin1(&bytes[..narrow(bytes)]),
            TextEncoding::Utf8 => decode_utf8_or_latin1(&bytes[..narrow(bytes)]),
            TextEncoding::Utf16 => decode_utf16(bytes, self.big),
            TextEncoding::Marked => match bytes {
                [0xff, 0xfe, rest @ ..] => decode_utf16(rest, false),
                [0xfe, 0xff, rest @ ..] => decode_utf16(rest, true),
                [0xef, 0xbb, 0xbf, rest @ ..] => decode_utf8_or_latin1(&rest[..narrow(rest)]),
                _ => decode_utf8_or_latin1(&bytes[..narrow(bytes)]),
            },
        }
    }
}

fn decode_utf16(bytes: &[u8], big: bool) -> String {
    let pair = |it: &[u8]| match big {
        true => u16::from_be_bytes([it[0], it[1]]),
        false => u16::from_le_bytes([it[0], it[1]]),
    };
    let units = bytes.chunks_exact(2).map(pair).take_while(|it| *it != 0);
    let characters = char::decode_utf16(units);
    characters.map(|it| it.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// A floating-point number of 16 bits (IEEE 754 binary16).
fn f16_to_f64(raw: u16) -> f64 {
    let (exponent, fraction) = (i32::from(raw >> 10 & 31), f64::from(raw & 1023));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if raw >> 15 == 1 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(kind: u8, byte: u32, bit: u32, bits: u32) -> RecordField {
        RecordField::new(kind, [byte, bit, bits]).expect("a field")
    }

    #[test]
    fn integers_of_any_bits_are_exact() {
        let record = [0b1010_0000, 0b0000_0110, 0xff, 0x01, 2, 3, 4, 5, 6, 7, 8, 0x80];
        assert_eq!(field(0, 0, 5, 6).decode_integer(&record), 0b11_0101);
        assert_eq!(field(2, 0, 5, 6).decode_integer(&record), -11);
        assert_eq!(field(1, 3, 0, 16).decode_integer(&record), 0x0102);
        assert_eq!(field(0, 3, 0, 64).decode_integer(&record), 0x0807_0605_0403_0201);
        // Nine bytes: 64 bits from bit 4 on.
        assert_eq!(field(0, 3, 4, 64).decode_integer(&record), 0x0080_7060_5040_3020_u64.into());
        assert_eq!(field(3, 11, 0, 8).decode_integer(&record), -128);
    }

    #[test]
    fn numbers_of_all_lengths_are_doubles() {
        assert_eq!(field(4, 0, 0, 16).decode_number(&[0x00, 0xc5]), -5.0);
        assert_eq!(field(5, 0, 0, 16).decode_number(&[0x00, 0x01]), 2f64.powi(-24));
        assert_eq!(field(4, 0, 0, 16).decode_number(&[0x00, 0x7c]), f64::INFINITY);
        assert_eq!(field(5, 0, 0, 32).decode_number(&1.5f32.to_be_bytes()), 1.5);
        assert_eq!(field(4, 0, 0, 64).decode_number(&0.1f64.to_le_bytes()), 0.1);
    }

    #[test]
    fn texts_of_all_codings_end_at_a_zero() {
        let of = |kind: u8, bytes: &[u8]| field(kind, 0, 0, 8 * bytes.len() as u32).decode_text(bytes, 99);
        assert_eq!(of(6, b"\xb0C\0x"), "°C");
        assert_eq!(of(7, "°C\0x".as_bytes()), "°C");
        assert_eq!(of(8, b"a\0\xb0\0\0\0x\0"), "a°");
        assert_eq!(of(9, b"\0a\0\xb0\0"), "a°");
        assert_eq!(of(17, b"\xfe\xff\0a"), "a");
    }

    #[test]
    fn what_no_type_has_is_refused() {
        assert!(RecordField::new(0, [0, 0, 65]).is_err() && RecordField::new(0, [0, 0, 0]).is_err());
        assert!(RecordField::new(4, [0, 0, 24]).is_err() && RecordField::new(0, [0, 8, 8]).is_err());
        assert!(RecordField::new(10, [0, 0, 8]).is_err() && RecordField::new(99, [0, 0, 8]).is_err());
    }
}
